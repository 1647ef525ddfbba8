!> The run beyond a change of its contact spans.
module span_arrival
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use span_tests, only: span_test_t, test_length
   use span_change, only: leg_t, change_t, next_t
   use span_regions, only: find_span_regions
   use span_opening, only: open_line
   use span_set, only: change_set
   use held_openings, only: first_length, longest_length
   use state_transfer, only: carried
   use path_control, only: control_t, displacement_between
   use path_continuity, only: heading_t, heading_at, between
   use path_events, only: event_t, new_probe, detect_events
   use path_run, only: run_t, heading_of, forget_mesh
   use path_acceptance, only: accept, note_trouble, outcome_t
   use contact_in_doubt, only: differences_t
   use monitors, only: monitor_rate
   use error_bar, only: error_bars_t, new_error_bar, no_error_bars, moved_error_bar
   use text, only: to_text
   use corrector, only: increment_t, correct
   use path_record, only: recorder_t
   use timing, only: timers_t
   implicit none
   private
   public :: take_set, take_known, take_opened, take_told

contains

   !> With the set that a test's rule tells. A span that opens gets as long as it takes to tell its ends.
   subroutine take_set(problem, run, test, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run          !! stuck where there is no way on
      type(span_test_t), intent(in) :: test      !! there
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: kept
      type(run_t) :: kept_run
      real(wp) :: length
      logical :: shallow
      character(:), allocatable :: why
      kept = problem
      kept_run = run
      length = first_length
      do
         call change_set(problem, run, test, length, shallow, timers)
         if (allocated(run%stuck) .or. .not. shallow .or. length > longest_length) exit
         length = 4.0_wp * length
         problem = kept
         run = kept_run
      end do
      if (.not. allocated(run%stuck)) then
         ! A point that a line has shrunk to may leave a span neutral there; the line's pivots are definite.
         if (test%kind == test_length) run%probe%negative_pivots = kept_run%probe%negative_pivots
         return
      end if
      ! Back to where it was still right.
      why = run%stuck
      problem = kept
      run = kept_run
      run%stuck = why
   end subroutine take_set

   !> Goes on with the set without a free span that has vanished. Its first point is one of the path, an event where contacts have
   !> become one by that.
   subroutine take_known(problem, step, run, next, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(next_t), intent(in) :: next
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(state_t) :: first
      logical :: merges, shorter
      merges = size(find_span_regions(next%problem, next%state)) < size(find_span_regions(problem, run%state))
      run = bound_for(problem, run, next)
      problem = next%problem
      first = next%state
      call accept(problem, step, run, first, heading_of(problem, run, first), merge('C+', '  ', merges), &
         & increment_t(converged=.true.), .false., recorder, shorter, finished, outcome, timers)
      if (finished .or. allocated(outcome%why)) return
      if (abs(next%rate) > 0.0_wp) run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, next%rate))
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
      call forget_mesh(run)
   end subroutine take_known

   !> Goes on with the set that contact at nodes has found. What is lost or gained is told at its first point, and lies between that
   !> and where the run stands.
   subroutine take_told(problem, step, run, next, onward, since, differences, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(next_t), intent(inout) :: next
      type(heading_t), intent(in) :: onward      !! tangent there
      real(wp), intent(in) :: since              !! load factor after which the set changes
      type(differences_t), intent(in) :: differences
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(error_bars_t), allocatable :: bars
      integer :: k
      character(2) :: label
      logical :: shorter
      label = ''
      if (differences%gained + differences%merged > 0) label = 'C+'
      if (differences%lost + differences%divided > 0) label = 'C-'
      run = bound_for(problem, run, next)
      run%touches = max(run%touches, maxval(next%problem%touch%number))
      problem = next%problem
      if (differences%lost + differences%divided > 0 .and. differences%gained + differences%merged > 0) call note_trouble(outcome, &
         & 'between load factors '//to_text(since)//' and '//to_text(next%state%load_factor)// &
         & ' contact begins and ends, told as one')
      if (step%error_bars .and. label /= '') then
         allocate (bars)
         bars = no_error_bars(size(problem%model%monitor), '')
         associate (left => since - next%state%load_factor)
            bars%load = new_error_bar(left, 0.0_wp, abs(left), epsilon(left) * abs(since))
         end associate
         do k = 1, size(bars%monitor)
            bars%monitor(k) = moved_error_bar(new_error_bar(0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp), bars%load, monitor_rate(problem, k, &
               & next%state, next%system))
         end do
      end if
      call accept(problem, step, run, next%state, onward, label, increment_t(converged=.true.), &
         & .false., recorder, shorter, finished, outcome, timers, bars=bars, divides=differences%divided > 0 .and. &
         & differences%lost == 0, times=differences%all_together())
   end subroutine take_told

   !> From where a span opens, where the run stands, to the equilibrium with the open span: as near as it takes for nothing
   !> else to happen before.
   subroutine take_opened(problem, step, run, leg, change, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! at the change's place
      type(leg_t), intent(in) :: leg             !! from there on to its end
      type(change_t), intent(in) :: change       !! the open span is known at the end of the leg
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(next_t) :: next, nearer
      type(state_t) :: here
      type(control_t) :: control
      type(increment_t) :: report
      type(heading_t) :: heading
      type(run_t) :: on
      type(event_t), allocatable :: events(:)
      real(wp) :: part
      logical :: found, shorter
      next = change%next
      report = change%report
      part = 1.0_wp
      do
         on = bound_for(problem, run, next)
         heading = heading_of(next%problem, on, next%state)
         call detect_events(next%problem, step, on%probe, new_probe(next%problem, next%state, next%system, heading%load), &
            & on%state, next%state, events)
         if (size(events) == 0) exit
         part = 0.5_wp * part
         here = between(problem, run%state, leg%to, run%heading, leg%ahead, part)
         control%method = method_load
         control%increment = here%load_factor - run%state%load_factor
         call correct(problem, run%state, control, .true., here, run%system, report, timers)
         if (.not. report%converged) exit
         call open_line(problem, run%state, here, change%tests(change%which), leg%scale, run%touches + 1, nearer%problem, &
            & nearer%state, nearer%system, found, timers)
         if (.not. found) exit
         next = nearer
      end do
      problem = next%problem
      run = on
      run%touches = max(run%touches, maxval(problem%touch%number))
      call accept(problem, step, run, next%state, heading, '  ', report, .false., recorder, shorter, finished, outcome, timers)
   end subroutine take_opened

   !> The run where it stands, on the mesh of the next set, bound for the equilibrium that is known there.
   function bound_for(problem, run, next) result(on)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(next_t), intent(in) :: next
      type(run_t) :: on
      on = run
      on%state = carried(problem, run%state, next%problem)
      on%system = next%system
      call forget_mesh(on)
      on%heading = heading_at(next%problem, next%system, displacement_between(next%problem, on%state, next%state), &
         & next%state%load_factor - on%state%load_factor)
      on%probe = new_probe(next%problem, on%state, next%system, on%heading%load)
   end function bound_for
end module span_arrival
