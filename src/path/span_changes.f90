!> Changes of the contact spans along a path: where a test function has its zero the path stops, the set is changed, the mesh
!> made anew, and the path goes on where what is new grows.
module span_changes
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use span_regions, only: find_span_regions
   use test_kinds, only: span_test_t, any_fails, test_words, test_slack, test_curvature, test_force, test_length
   use span_tests, only: spans_hold
   use contact_touch, only: shortest, first_length
   use touchdown_points, only: point_force
   use lying_ahead, only: reach_of, turns
   use change_kinds, only: leg_t, change_t, new_leg, change_none, change_missed, change_by_rule, &
      & change_opening, change_vanishing, place_within, place_here, place_ahead
   use next_spans, only: next_t
   use span_events, only: find_change
   use span_beyond, only: look_beyond
   use span_dips, only: look_between
   use span_answer, only: answer_t
   use span_rules, only: answer_to
   use span_set, only: take_set
   use span_arrival, only: take_next, come_nearer
   use span_mesh, only: ask_for_twice
   use contact_in_doubt, only: ask_nodes
   use path_continuity, only: heading_t
   use path_control, only: path_length
   use path_events, only: event_t, new_probe, value_events, event_stop
   use path_run, only: run_t, copy_run
   use path_acceptance, only: arrival_t, accept
   use accuracy_asked, only: wants_another
   use path_outcome, only: outcome_t
   use step_control, only: smallest
   use path_record, only: recorder_t
   use error_report, only: bars_at_point
   use timing, only: timers_t
   implicit none
   private
   public :: pass_change, pass_doubt, set_holds, set_changed, go_nearer, other_mesh, no_set

   ! What has come of looking for a change.
   integer, parameter :: set_holds = 0           !! there is none
   integer, parameter :: set_changed = 1         !! the run stands where it is, with the next set
   integer, parameter :: go_nearer = 2           !! the increment is to be shorter, and has become so
   integer, parameter :: other_mesh = 3          !! see run%wanted
   integer, parameter :: no_set = 4              !! run%stuck says what was not found

contains

   !> Looks whether the contact spans of an increment still hold at its end. Where they do not the run goes to where they
   !> first fail and on from there with those that hold.
   subroutine pass_change(problem, step, run, trial, ahead, stuck, tries, recorder, result, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the trial where the set holds, else where it stands
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead       !! tangent there
      logical, intent(in) :: stuck               !! no increment converges: the trial is the run's state, what may be ahead of it?
      integer, intent(in) :: tries               !! as arrival_t has it
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result             !! set_holds, set_changed, ...
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(leg_t) :: leg
      type(change_t) :: change
      finished = .false.
      leg = new_leg(problem, run, trial, ahead, stuck)
      call find_change(problem, step, run, leg, change, timers)
      if (change%kind == change_by_rule) call look_beyond(problem, step, run, leg, change, timers)
      select case (change%kind)
      case (change_none)
         call stay(problem, step, run, leg, result, timers)
      case (change_missed)
         call go_less_far(problem, step, run, leg%after(change%which), result, timers)
      case (change_vanishing)
         call pass_vanishing(problem, step, run, leg, change, recorder, result, finished, outcome, timers)
      case (change_by_rule)
         call pass_by_rule(problem, step, run, leg, tries, change, recorder, result, finished, outcome, timers)
      case (change_opening)
         call pass_opening(problem, step, run, leg, tries, change, recorder, result, finished, outcome, timers)
      end select
      if (result == set_changed) run%since_change%at = run%arc_length
      if (allocated(run%stuck)) result = no_set
   end subroutine pass_change

   !> The set holds at the end of the leg; between its ends slopes tell.
   subroutine stay(problem, step, run, leg, result, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(out) :: result
      type(timers_t), intent(inout) :: timers
      logical :: shorter
      shorter = .false.
      call linearise(problem, leg%to, run%state, run%system, timers)
      if (.not. leg%stuck) call look_between(problem, step, run, leg, 0, shorter, timers)
      result = merge(go_nearer, set_holds, shorter)
   end subroutine stay

   !> A span is gone, or will be. The set without it is known where it begins alone, and what is on the way would not be told:
   !> nearer, as long as the load turns before, and not beyond the leg where the step ends on the way there.
   subroutine pass_vanishing(problem, step, run, leg, change, recorder, result, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      finished = .false.
      if (turns(run, leg) .and. .not. leg%stuck .and. 0.5_wp * abs(run%control%increment) >= smallest(step, run%control)) then
         call go_less_far(problem, step, run, leg%after(change%which), result, timers)
      else if (lies_beyond(leg, change%next) .and. ends_before(step, run, change%next)) then
         call stay(problem, step, run, leg, result, timers)
      else
         result = set_changed
         call take_next(problem, step, run, change%next, recorder, finished, outcome, timers)
      end if
   end subroutine pass_vanishing

   !> True for a set that begins behind the end of a leg over which the old one holds.
   pure logical function lies_beyond(leg, next)
      type(leg_t), intent(in) :: leg
      type(next_t), intent(in) :: next
      associate (here => leg%to%load_factor)
         lies_beyond = .not. (leg%stuck .or. any_fails(leg%after)) .and. (next%state%load_factor - here) * &
            & (here - leg%from%load_factor) > 0.0_wp
      end associate
   end function lies_beyond

   !> True where the step ends between the run and where the next set begins.
   logical function ends_before(step, run, next)
      type(step_t), intent(in) :: step
      type(run_t), intent(in) :: run
      type(next_t), intent(in) :: next
      type(event_t), allocatable :: events(:)
      call value_events(next%problem, step, run%probe, new_probe(next%problem, next%state, next%system, next%rate), run%state, &
         & next%state, events)
      ends_before = any(events%kind == event_stop)
   end function ends_before

   !> A test is zero, and a rule says what comes behind it.
   subroutine pass_by_rule(problem, step, run, leg, tries, change, recorder, result, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: tries
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(leg_t) :: near
      type(answer_t) :: answer
      type(problem_t) :: next
      type(run_t) :: on
      logical :: shorter, holds, asked
      finished = .false.
      if (change%where == place_within .and. .not. leg%stuck) then
         near = leg
         near%to = change%place
         near%ahead = change%heading
         near%after = change%tests
         call look_between(problem, step, run, near, change%which, shorter, timers)
         result = go_nearer
         if (shorter) return
      end if
      answer = answer_to(problem, change%place, change%tests, change%which, leg%before%value - leg%after%value, run%touches)
      ! At once with another change that has its point.
      if (change%where == place_here .and. change%tests(change%which)%kind == test_curvature) answer%label = '  '
      call record_change(problem, step, run, leg, tries, answer%label, answer%divides, change, recorder, result, finished, &
         & outcome, timers)
      if (result /= set_changed .or. finished .or. allocated(outcome%why)) return
      call take_answer(problem, run, leg, change, answer, next, on, holds, timers)
      if (.not. holds .and. change%where == place_here .and. tries == 0) then
         ! Of a point that is as curved as its obstacle but for what the mesh errs by, and nothing is recorded yet.
         call ask_for_twice(problem, run, asked)
         result = merge(other_mesh, set_changed, asked)
         if (asked) return
      end if
      call go_on(problem, step, run, next, on, recorder, finished, outcome, timers)
   end subroutine pass_by_rule

   !> A line opens inside, and what comes behind that is known. Where one stays on both sides its contact divides.
   subroutine pass_opening(problem, step, run, leg, tries, change, recorder, result, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: tries
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      logical :: divides
      divides = size(find_span_regions(change%next%problem, change%next%state)) > size(find_span_regions(problem, change%place))
      call record_change(problem, step, run, leg, tries, merge('C-', '  ', divides), divides, change, recorder, result, finished, &
         & outcome, timers)
      if (result /= set_changed .or. finished .or. allocated(outcome%why)) return
      call come_nearer(problem, step, run, leg, change, timers)
      call take_next(problem, step, run, change%next, recorder, finished, outcome, timers)
   end subroutine pass_opening

   !> The set of the answer, and the run with it. Where a point lies down, and another does so before the line of the first has the
   !> length that it begins with, as its image at a mirror that the mesh does not know, there is none with that alone: both at once.
   subroutine take_answer(problem, run, leg, change, answer, next, on, holds, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run             !! at the change's place
      type(leg_t), intent(in) :: leg
      type(change_t), intent(in) :: change       !! by a rule
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(out) :: next
      type(run_t), intent(out) :: on
      logical, intent(out) :: holds              !! false: a point divides into none that push
      type(timers_t), intent(inout) :: timers
      type(answer_t) :: larger
      integer :: more, lines
      logical :: grows
      holds = .true.
      if (change%tests(change%which)%kind == test_curvature .and. answer%opens(1) /= answer%opens(2)) then
         call divide(problem, run, leg, change, answer, next, on, holds, timers)
         return
      end if
      larger = answer
      more = 0
      do
         call start()
         call take_set(next, on, change%tests(change%which), change%begins, larger, line_reach(problem, leg, change%which), grows, &
            & timers)
         if (grows .and. more > 0) grows = spans_hold(next, on%state, on%system%force_scale)
         if (grows) return
         more = more + 1
         lines = count(larger%touch%line)
         larger = answer_to(problem, change%place, change%tests, change%which, leg%before%value - leg%after%value, run%touches, &
            & more)
         if (count(larger%touch%line) > lines) cycle
         ! Perhaps the next increment finds it.
         call start()
         call take_set(next, on, change%tests(change%which), change%begins, answer, line_reach(problem, leg, change%which), grows, &
            & timers)
         return
      end do

   contains

      subroutine start()
         call copy_problem(problem, next)
         call copy_run(run, on)
      end subroutine start
   end subroutine take_answer

   !> The run with its next set. Where that is known at another load only, values that are asked for may lie on the way there.
   subroutine go_on(problem, step, run, next, on, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! at the change's place
      type(problem_t), intent(in) :: next
      type(run_t), intent(in) :: on              !! where the next set is known
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(event_t), allocatable :: events(:)
      type(next_t) :: ahead
      finished = .false.
      allocate (events(0))
      if (.not. allocated(on%stuck)) call value_events(next, step, run%probe, on%probe, on%state, on%state, events)
      if (size(events) == 0) then
         call copy_problem(next, problem)
         call copy_run(on, run)
         return
      end if
      call copy_problem(next, ahead%problem)
      ahead%state = on%state
      ahead%system = on%system
      ahead%heading = on%heading
      call take_next(problem, step, run, ahead, recorder, finished, outcome, timers)
      run%since_change%arrives = on%since_change%arrives
   end subroutine go_on

   !> The two points of a divided one. Where the rod comes down beside a point just before that is flat, by less than is told,
   !> points that are near would have to pull, and others further apart do not.
   subroutine divide(problem, run, leg, change, answer, next, on, holds, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run             !! at the change's place
      type(leg_t), intent(in) :: leg
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer       !! with points as near as any begin
      type(problem_t), intent(inout) :: next
      type(run_t), intent(inout) :: on
      logical, intent(out) :: holds              !! false: none of them, taken are those that are as near as any
      type(timers_t), intent(inout) :: timers
      integer, parameter :: most = 4             ! doublings of their distance: what is told is not that deep
      type(answer_t) :: wider
      integer :: try
      logical :: grows
      wider = answer
      do try = 0, most + 1
         ! Where none holds the nearest.
         if (try > most) wider = answer
         call copy_problem(problem, next)
         call copy_run(run, on)
         call take_set(next, on, change%tests(change%which), change%begins, wider, 0.0_wp, grows, timers)
         holds = .not. allocated(on%stuck)
         if (holds) holds = pushes(next, on, wider%opens)
         if (holds) exit
         wider = answer_to(problem, change%place, change%tests, change%which, leg%before%value - leg%after%value, run%touches, &
            & apart=2.0_wp**(try + 1) * first_length)
      end do
   end subroutine divide

   !> True for points that the rod pushes, or that are none.
   logical function pushes(problem, run, opened)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      integer, intent(in) :: opened(2)           !! numbers of touches
      integer :: c
      pushes = .true.
      do c = 1, problem%candidates%n
         if (problem%candidates%touch(c) == 0) cycle
         if (.not. problem%candidates%moves(c) .or. all(opened /= problem%touch(problem%candidates%touch(c))%number)) cycle
         pushes = pushes .and. point_force(problem, run%state, c) >= -test_slack(test_force) * run%system%force_scale
      end do
   end function pushes

   !> How far along the path the zero of a line's length may be from where the line is taken for none: as far as the increment's
   !> chord tells, and as far as paths are followed as straight. 0: the test is another one.
   real(wp) function line_reach(problem, leg, which) result(reach)
      type(problem_t), intent(in) :: problem
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: which               !! index into the tests
      reach = 0.0_wp
      if (leg%after(which)%kind /= test_length) return
      associate (before => leg%before(which), after => leg%after(which))
         reach = reach_of(leg) * path_length(problem, leg%from, leg%to) * shortest * &
            & problem%layout%stretch(after%stretch)%length / (problem%size * max(before%value - after%value, tiny(reach)))
      end associate
   end function line_reach

   !> Where no increment gets further and no test tells why: the set that contact at nodes finds ahead.
   subroutine pass_doubt(problem, step, run, reach, recorder, changed, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored where it stands
      real(wp), intent(in) :: reach              !! of the increment that failed
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: changed            !! false: nodes do not find one
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(next_t) :: next
      finished = .false.
      call ask_nodes(problem, run, reach, next, changed, timers)
      if (changed) then
         call take_next(problem, step, run, next, recorder, finished, outcome, timers)
      else
         call linearise(problem, run%state, run%state, run%system, timers)
      end if
   end subroutine pass_doubt

   !> The run goes to the place of a change, which is recorded, unless something else comes before.
   subroutine record_change(problem, step, run, leg, tries, label, divides, change, recorder, result, finished, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: tries               !! as arrival_t has it
      character(2), intent(in) :: label          !! contact gained or lost; where it only spreads, nothing
      logical, intent(in) :: divides             !! of the contact that is lost a part stays on both sides
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result             !! set_changed: it is recorded
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(arrival_t) :: arrival
      real(wp) :: increment
      logical :: shorter
      shorter = .false.
      finished = .false.
      increment = run%control%increment
      ! What happens on the way to a place beyond is looked for in parts of the increment.
      if (change%where == place_ahead .and. run%control%method == method_load) &
         & run%control%increment = change%place%load_factor - run%state%load_factor
      if (.not. allocated(change%bars)) call bars_at_point(problem, step, run, change%place, change%heading, label, .false., &
         & change%which, change%bars, timers)
      ! Two changes at once, of which the first has its point: where contact only spreads Newton's method has yet to follow.
      if (.not. (change%where == place_here .and. label == '  ')) then
         arrival%report = change%report
         arrival%can_cut = .not. leg%stuck
         arrival%tries = tries
         arrival%label = label
         arrival%divides = divides
         arrival%changes = .true.
         if (allocated(change%bars)) arrival%bars = change%bars
         call accept(problem, step, run, change%place, change%heading, arrival, recorder, shorter, finished, outcome, timers)
      end if
      run%control%increment = increment
      if (allocated(run%beginning)) deallocate (run%beginning)
      run%beginning_in = 0
      if (wants_another(run)) then
         result = other_mesh
      else if (.not. shorter) then
         result = set_changed
      else if (change%where == place_ahead) then
         call stay(problem, step, run, leg, result, timers)
      else
         ! What lies before is better found from nearer.
         call go_less_far(problem, step, run, leg%after(change%which), result, timers)
      end if
   end subroutine record_change

   !> A shorter increment may tell.
   subroutine go_less_far(problem, step, run, test, result, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! stuck where it has become too short
      type(span_test_t), intent(in) :: test      !! whose zero was not found
      integer, intent(out) :: result
      type(timers_t), intent(inout) :: timers
      result = go_nearer
      call linearise(problem, run%state, run%state, run%system, timers)
      run%control%increment = 0.5_wp * run%control%increment
      if (abs(run%control%increment) < smallest(step, run%control)) &
         & run%stuck = 'where '//trim(test_words(test%kind))//' was not found'
   end subroutine go_less_far
end module span_changes
