!> Changes of the contact spans along a path: the change is located at the zero of a test function, the contact set is changed, the
!> structure is remeshed, and the path continues in the sense in which the new contact or free span grows.
module span_changes
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use span_regions, only: find_span_regions
   use test_kinds, only: span_test_t, any_crosses, test_words, test_slack, well_below, test_curvature
   use reachability, only: turns
   use contact_change_types, only: step_interval_t, change_t, new_interval, change_none, change_missed, change_by_rule, &
      & change_mended, change_opening, change_vanishing, place_within, place_here, place_ahead
   use next_spans, only: next_t
   use span_events, only: find_change
   use minima_of_tests, only: look_between
   use span_answer, only: answer_t
   use span_rules, only: answer_to, coming_next
   use answer_trials, only: take_answer
   use entering_contact_set, only: go_to_next, come_nearer
   use span_mesh, only: ask_for_twice
   use contact_trials, only: try_sets
   use contact_in_doubt, only: ask_nodes
   use path_continuity, only: path_tangent_t
   use path_events, only: event_t, new_test_values, value_events, event_stop
   use path_state, only: path_state_t, copy_path_state, forget_mesh
   use path_acceptance, only: arrival_t, accept
   use corner_limit, only: look_whether_back
   use remeshing, only: wants_another
   use path_outcome, only: outcome_t
   use step_control, only: smallest
   use path_record, only: recorder_t
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_point
   implicit none
   private
   public :: pass_change, pass_doubt, set_holds, set_changed, go_nearer, other_mesh, no_set

   ! Result of the search for a change.
   integer, parameter :: set_holds = 0           !! no change: the set is valid
   integer, parameter :: set_changed = 1         !! the run is at the change, with the next set
   integer, parameter :: go_nearer = 2           !! the increment was halved and must be repeated
   integer, parameter :: other_mesh = 3          !! a finer mesh is requested (run%request%density)
   integer, parameter :: no_set = 4              !! no valid set was found; run%stuck has the reason

   integer, parameter :: most_meshes = 4         !! remeshings to determine which of two changes comes first
   real(wp), parameter :: likely = 10.0_wp       !! factor on one change's error bar; other changes' bars are rarely wider

contains

   !> Checks whether the contact set is valid at the end of an increment. If not, the run moves to the first failure and continues
   !> with the next contact set.
   subroutine pass_change(problem, step, run, trial, ahead, stuck, tries, recorder, result, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run !! system factored at the trial if the set is valid, else at the run's point
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! path tangent at the trial
      logical, intent(in) :: stuck  !! true: no increment converges; the trial is the run's state, and a change just ahead is sought
      integer, intent(in) :: tries               !! number of remeshings so far, as in arrival_t
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result             !! set_holds, set_changed, go_nearer, other_mesh or no_set
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(step_interval_t) :: interval
      type(change_t) :: change
      logical :: mended
      finished = .false.
      interval = new_interval(problem, run, trial, ahead, stuck)
      call find_change(problem, step, run, interval, change)
      call mend_last_change(problem, step, run, interval, change, recorder, mended, finished, outcome)
      if (mended) change%kind = change_mended
      select case (change%kind)
      case (change_none)
         call keep_set(problem, step, run, interval, result)
      case (change_missed)
         call go_less_far(problem, step, run, interval%after(change%which), result)
      case (change_vanishing)
         call pass_vanishing(problem, step, run, interval, change, recorder, result, finished, outcome)
      case (change_by_rule)
         call pass_by_rule(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      case (change_opening)
         call pass_opening(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      case (change_mended)
         result = set_changed
      end select
      if (result == set_changed) run%since_change%at = run%arc_length
      if (result == set_changed .and. .not. (finished .or. allocated(outcome%why) .or. allocated(run%stuck))) &
         & call look_whether_back(problem, step, run, outcome)
      if (allocated(run%stuck)) result = no_set
   end subroutine pass_change

   !> Keeps the set, which is valid at the interval's end, unless the slopes of the tests show a failure inside the interval.
   subroutine keep_set(problem, step, run, interval, result)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(out) :: result
      logical :: shorter
      shorter = .false.
      call linearise(problem, interval%to, run%state, run%system)
      if (.not. interval%stuck) call look_between(problem, step, run, interval, 0, shorter)
      result = merge(go_nearer, set_holds, shorter)
      ! The set of the last change is right.
      if (result == set_holds .and. .not. interval%stuck .and. allocated(run%before_change)) deallocate (run%before_change)
   end subroutine keep_set

   !> Closes a free span. The set without this span is known only at its onset, and events before the onset would be missed: the
   !> increment is halved while a limit point lies on the interval, and the present set is kept if the step ends before the onset.
   subroutine pass_vanishing(problem, step, run, interval, change, recorder, result, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      finished = .false.
      if (turns(run, interval) .and. .not. interval%stuck .and. 0.5_wp * abs(run%control%increment) >= smallest(step, &
         & run%control)) then
         call go_less_far(problem, step, run, interval%after(change%which), result)
      else if (lies_beyond(interval, change%next) .and. ends_before(step, run, change%next)) then
         call keep_set(problem, step, run, interval, result)
      else
         result = set_changed
         call go_to_next(problem, step, run, change%next, recorder, finished, outcome)
      end if
   end subroutine pass_vanishing

   !> True if the next set begins beyond the end of an interval on which the present set is valid.
   pure logical function lies_beyond(interval, next)
      type(step_interval_t), intent(in) :: interval
      type(next_t), intent(in) :: next
      associate (here => interval%to%load_factor)
         lies_beyond = .not. (interval%stuck .or. any_crosses(interval%before, interval%after)) .and. &
            & (next%state%load_factor - here) * &
            & (here - interval%from%load_factor) > 0.0_wp
      end associate
   end function lies_beyond

   !> True if the step ends between the run's point and the state where the next set is known.
   logical function ends_before(step, run, next)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: next
      type(event_t), allocatable :: events(:)
      call value_events(next%problem, step, run%test_values, new_test_values(next%problem, next%state, next%system, next%rate), &
         & run%state, &
         & next%state, events)
      ends_before = any(events%kind == event_stop)
   end function ends_before

   !> Makes a change at the zero of a test for which a rule gives the next set.
   subroutine pass_by_rule(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: tries
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(step_interval_t) :: near
      type(answer_t) :: answer
      type(problem_t) :: next
      type(path_state_t) :: on
      logical :: shorter, holds, asked
      finished = .false.
      if (change%where == place_within .and. .not. interval%stuck) then
         near = interval
         near%to = change%place
         near%ahead = change%heading
         near%after = change%tests
         call look_between(problem, step, run, near, change%which, shorter)
         result = go_nearer
         if (shorter) return
      end if
      answer = answer_to(problem, change%place, change%tests, change%which, interval%before%value - interval%after%value, &
         & run%spans_begun)
      ! If contact only spreads at a point where another change was just reported, no second change is reported.
      if (.not. (change%where == place_here .and. change%tests(change%which)%kind == test_curvature)) change%label = answer%label
      change%divides = answer%divides
      call record_change(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      if (result /= set_changed .or. finished .or. allocated(outcome%why)) return
      call take_answer(problem, run, interval, change, answer, next, on, holds)
      if (.not. holds .and. change%where == place_here .and. tries == 0) then
         ! Mesh errors may have made the point osculating; nothing is recorded yet, so a finer mesh is tried.
         call ask_for_twice(problem, run, asked)
         result = merge(other_mesh, set_changed, asked)
         if (asked) return
      end if
      call keep_for_trials(problem, run)
      on%before_change = run%before_change
      call go_on(problem, step, run, next, on, recorder, finished, outcome)
   end subroutine pass_by_rule

   !> Makes the change at which a free span opens in a line contact; the next set is known. If contact remains on both sides, the
   !> contact region divides.
   subroutine pass_opening(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: tries
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      change%divides = size(find_span_regions(change%next%problem, change%next%state)) > &
         & size(find_span_regions(problem, change%place))
      if (change%divides) change%label = 'C-'
      call record_change(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      if (result /= set_changed .or. finished .or. allocated(outcome%why)) return
      call come_nearer(problem, step, run, interval, change)
      call go_to_next(problem, step, run, change%next, recorder, finished, outcome)
   end subroutine pass_opening

   !> Continues with the next set. If this set is known only at another load, user-requested values on the way there are located.
   subroutine go_on(problem, step, run, next, on, recorder, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! at the change's place
      type(problem_t), intent(in) :: next
      type(path_state_t), intent(in) :: on              !! at the state where the next set is known
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(event_t), allocatable :: events(:)
      type(next_t) :: ahead
      finished = .false.
      allocate (events(0))
      if (.not. allocated(on%stuck)) call value_events(next, step, run%test_values, on%test_values, on%state, on%state, events)
      if (size(events) == 0) then
         call copy_problem(next, problem)
         call copy_path_state(on, run)
         return
      end if
      call copy_problem(next, ahead%problem)
      ahead%state = on%state
      ahead%system = on%system
      ahead%heading = on%heading
      call go_to_next(problem, step, run, ahead, recorder, finished, outcome)
      run%since_change%arrives = on%since_change%arrives
   end subroutine go_on

   !> Fallback if no increment converges or no rule gives the next set: contact at nodes finds the next set ahead; if it finds none,
   !> neighbours of the present set are tried.
   subroutine pass_doubt(problem, step, run, reach, recorder, changed, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! system factored at the run's point
      real(wp), intent(in) :: reach              !! size of the increment that failed
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: changed            !! false: no other set was found
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(next_t) :: first, next
      finished = .false.
      call ask_nodes(problem, run, reach, next, changed)
      if (changed) then
         call go_to_next(problem, step, run, next, recorder, finished, outcome)
      else
         call linearise(problem, run%state, run%state, run%system)
         call try_at_change(problem, run, first, next, changed)
         if (.not. changed) call try_sets(problem, run, first, next, changed)
         if (changed) call begin_set(problem, step, run, first, next, recorder, finished, outcome)
      end if
      if (changed) then
         if (.not. (finished .or. allocated(outcome%why))) call look_whether_back(problem, step, run, outcome)
      else
         call linearise(problem, run%state, run%state, run%system)
      end if
   end subroutine pass_doubt

   !> Keeps the run's point, at a contact change, with the contact set before the change.
   subroutine keep_for_trials(problem, run)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      if (.not. allocated(run%before_change)) allocate (run%before_change)
      call copy_problem(problem, run%before_change%problem)
      run%before_change%state = run%state
      run%before_change%heading = run%heading
      run%before_change%test_values = run%test_values
   end subroutine keep_for_trials

   !> Replaces the set of the last contact change if it was wrong from its beginning: no point was accepted since, and a test is far
   !> below zero at the run's point already.
   subroutine mend_last_change(problem, step, run, interval, change, recorder, mended, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: mended
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(next_t) :: first, next
      finished = .false.
      ! A point contact that begins where the rod is more curved than the obstacle spreads at once, and has a rule.
      mended = any(change%kind == [change_missed, change_opening]) .and. change%where == place_here .and. change%which > 0
      if (.not. mended) return
      associate (test => interval%before(change%which))
         mended = test%value < -well_below * test_slack(test%kind)
      end associate
      if (mended) call try_at_change(problem, run, first, next, mended)
      if (mended) call begin_set(problem, step, run, first, next, recorder, finished, outcome)
   end subroutine mend_last_change

   !> Neighbours of the set before the last contact change, if no point was accepted since: the rule's set is not the right one.
   subroutine try_at_change(problem, run, first, next, found)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run       !! if a set is found: at the place of the change
      type(next_t), intent(out) :: first, next       !! as from try_sets
      logical, intent(out) :: found
      type(path_state_t) :: before
      found = allocated(run%before_change) .and. run%arc_length <= run%since_change%at
      if (.not. found) return
      call copy_path_state(run, before)
      call forget_mesh(before)
      associate (change => run%before_change)
         before%state = change%state
         before%heading = change%heading
         before%test_values = change%test_values
         before%system = new_system(change%problem)
         call linearise(change%problem, before%state, before%state, before%system)
         found = before%system%ok
         if (found) call try_sets(change%problem, before, first, next, found)
         if (.not. found) return
         call copy_problem(change%problem, problem)
      end associate
      call copy_path_state(before, run)
   end subroutine try_at_change

   !> Continues with a set found by trials: to its first equilibrium, and from there to a point at which all its tests are
   !> satisfied.
   subroutine begin_set(problem, step, run, first, next, recorder, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(next_t), intent(inout) :: first, next     !! as from try_sets
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      call go_to_next(problem, step, run, first, recorder, finished, outcome)
      if (finished .or. allocated(outcome%why)) return
      call go_to_next(problem, step, run, next, recorder, finished, outcome)
   end subroutine begin_set

   !> Moves the run to the place of a change and records it, unless another event comes first.
   subroutine record_change(problem, step, run, interval, tries, change, recorder, result, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: tries               !! number of remeshings so far, as in arrival_t
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      integer, intent(out) :: result             !! set_changed: the change is recorded
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(arrival_t) :: arrival
      real(wp) :: increment
      logical :: shorter, asked
      shorter = .false.
      finished = .false.
      increment = run%control%increment
      ! For a place beyond the increment, events on the way are located by fractions of the distance to this place.
      if (change%where == place_ahead .and. run%control%method == method_load) &
         & run%control%increment = change%place%load_factor - run%state%load_factor
      if (.not. allocated(change%bars)) call bars_at_point(problem, step, run, change%place, change%heading, change%label, &
         & .false., change%which, change%bars)
      if (change%label /= '  ' .and. tries < most_meshes .and. in_doubt(problem, step, run, interval, change)) then
         call ask_for_twice(problem, run, asked)
         run%control%increment = increment
         result = other_mesh
         if (asked) return
      end if
      ! Two changes at the same point: the point is recorded already, and the spreading contact is found by the next correction.
      if (.not. (change%where == place_here .and. change%label == '  ')) then
         arrival%report = change%report
         arrival%can_cut = .not. interval%stuck
         arrival%tries = tries
         arrival%label = change%label
         arrival%divides = change%divides
         arrival%changes = .true.
         if (allocated(change%bars)) arrival%bars = change%bars
         call accept(problem, step, run, change%place, change%heading, arrival, recorder, shorter, finished, outcome)
      end if
      run%control%increment = increment
      if (allocated(run%onset%region)) deallocate (run%onset%region)
      run%onset%element = 0
      if (wants_another(run)) then
         result = other_mesh
      else if (.not. shorter) then
         result = set_changed
      else if (change%where == place_ahead) then
         call keep_set(problem, step, run, interval, result)
      else
         ! An earlier event is located more reliably on a shorter increment.
         call go_less_far(problem, step, run, interval%after(change%which), result)
      end if
   end subroutine record_change

   !> True if the order of two changes is uncertain: their distance is less than the sum of their error bars.
   logical function in_doubt(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! system factored at the change's place
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(error_bars_t), allocatable :: bars
      real(wp) :: fall(size(change%tests)), way
      integer, allocatable :: next(:)
      integer :: k
      in_doubt = .false.
      if (.not. allocated(change%bars) .or. change%which == 0) return
      way = abs(interval%to%load_factor - interval%from%load_factor)
      if (.not. (change%bars%load%estimated .and. change%bars%load%bounded .and. way > 0.0_wp)) return
      fall = interval%before%value - interval%after%value
      next = coming_next(change%tests, change%which, fall, likely * change%bars%load%bar / way)
      do k = 1, size(next)
         call bars_at_point(problem, step, run, change%place, change%heading, 'C+', .false., next(k), bars)
         if (.not. allocated(bars)) return
         if (.not. (bars%load%estimated .and. bars%load%bounded)) cycle
         in_doubt = change%tests(next(k))%value * way <= (change%bars%load%bar + bars%load%bar) * fall(next(k))
         if (in_doubt) return
      end do
   end function in_doubt

   !> Halves the increment to locate a zero that was not found.
   subroutine go_less_far(problem, step, run, test, result)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! stuck if the increment is below the least one
      type(span_test_t), intent(in) :: test      !! test whose zero was not found
      integer, intent(out) :: result
      result = go_nearer
      call linearise(problem, run%state, run%state, run%system)
      run%control%increment = 0.5_wp * run%control%increment
      if (abs(run%control%increment) < smallest(step, run%control)) &
         & run%stuck = 'where '//trim(test_words(test%kind))//' was not found'
   end subroutine go_less_far
end module span_changes
