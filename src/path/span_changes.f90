!> Changes of the contact spans along a path: where a test function has its zero the path stops, the set is changed, the mesh
!> made anew, and the path goes on where what is new grows.
module span_changes
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: find_point
   use bordered_system, only: linearise
   use span_regions, only: beginning_region, find_span_regions
   use line_pressure, only: virtual_pressure
   use span_tests, only: span_test_t, test_words, test_gap, test_force, test_curvature, test_pressure, test_length, test_closing
   use span_events, only: leg_t, change_t, next_t, new_leg, find_change
   use span_arrival, only: begin_sharply, take_line, take_opened
   use span_set, only: change_set
   use touchdown_points, only: stands
   use held_openings, only: held_load, first_length, longest_length
   use span_opening, only: open_line
   use span_lie_down, only: lie_down
   use path_continuity, only: heading_t, heading_at
   use path_run, only: run_t
   use path_acceptance, only: accept, wants_another, outcome_t
   use step_control, only: smallest
   use path_record, only: recorder_t
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_point, bars_of_line
   use timing, only: timers_t
   implicit none
   private
   public :: pass_change

contains

   !> Looks whether the contact spans of an increment still hold at its end. Where they do not the run goes to where they
   !> first fail and on from there with those that hold.
   subroutine pass_change(problem, step, run, trial, ahead, stuck, tries, recorder, changed, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the trial, or at its new state where changed
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead       !! tangent there
      logical, intent(in) :: stuck               !! no increment converges: the trial is the run's state, what may be ahead of it?
      integer, intent(in) :: tries               !! as accept has it
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: changed            !! false with run%wanted allocated: the change wants another mesh
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(leg_t) :: leg
      type(change_t) :: change
      type(next_t) :: next
      type(error_bars_t), allocatable :: bars
      logical :: shorter
      finished = .false.
      leg = new_leg(problem, run, trial, ahead, stuck)
      call find_change(problem, step, run, leg, change, next, timers)
      if (change%found .and. change%which > 0) call prepare(problem, step, run, leg, change, next, bars, timers)
      changed = change%found .or. change%missed
      if (change%missed) call go_less_far(problem, step, run, leg%after(change%which), timers)
      if (change%missed) return
      if (changed) then
         call record_change(problem, step, run, stuck, tries, change, next, bars, recorder, shorter, finished, outcome, timers)
         changed = .false.
         if (wants_another(run)) return
         ! Something lies before it that is better found from nearer.
         changed = .not. shorter
      end if
      if (.not. changed) then
         call linearise(problem, trial, run%state, run%system, timers)
         return
      end if
      if (finished .or. allocated(outcome%why)) return
      if (change%lies) then
         call take_line(problem, step, run, change, next, recorder, finished, outcome, timers)
      else if (opens_line(problem, change%tests(change%which))) then
         call take_opened(problem, step, run, leg, change, next, recorder, finished, outcome, timers)
      else
         call take_set(problem, run, change%tests(change%which), timers)
      end if
   end subroutine pass_change

   !> What must be known at the place before the run goes there: its contact, and the equilibrium beyond where it is not to be
   !> found from there.
   subroutine prepare(problem, step, run, leg, change, next, bars, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      type(next_t), intent(inout) :: next
      type(error_bars_t), allocatable, intent(inout) :: bars !! of a touch
      type(timers_t), intent(inout) :: timers
      real(wp) :: tau
      logical :: opened
      if (opens_line(problem, change%tests(change%which))) then
         ! Here nothing tells yet where the span that opens ends; a little further on it does.
         call open_line(problem, change%place, leg%to, leg%after(change%which), leg%scale, run%touches + 1, next%problem, &
            & next%state, next%system, opened, timers)
         change%missed = .not. opened
         return
      end if
      if (change%tests(change%which)%kind == test_gap) then
         call begin_sharply(problem, step, run, leg, change, bars, timers)
         associate (test => change%tests(change%which))
            run%beginning = beginning_region(problem, change%place, test%contact, test%stretch, test%at)
            call find_point(problem, change%place, test%stretch, test%at, run%beginning_in, tau)
         end associate
      end if
      call lie_down(problem, leg%from, change%place, held_load(run), next%problem, next%state, next%system, next%rate, &
         & change%lies, timers)
      ! There the span is neutral, and its pivot has the sign of rounding; the line's are definite.
      if (change%lies) run%system%negative_pivots = next%system%negative_pivots
   end subroutine prepare

   !> The run goes to the place of a change, which is recorded.
   subroutine record_change(problem, step, run, stuck, tries, change, next, bars, recorder, shorter, finished, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      logical, intent(in) :: stuck               !! no nearer place is to be had
      integer, intent(in) :: tries               !! as accept has it
      type(change_t), intent(inout) :: change
      type(next_t), intent(in) :: next
      type(error_bars_t), allocatable, intent(inout) :: bars
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: shorter            !! the run stays where it is: something else comes before
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      character(2) :: label
      type(run_t) :: line
      real(wp) :: increment
      logical :: divides
      shorter = .false.
      finished = .false.
      call describe(problem, change, next, label, divides)
      increment = run%control%increment
      ! What happens on the way to a place beyond is looked for in parts of the increment.
      if (change%looked_ahead .and. run%control%method == method_load) &
         & run%control%increment = change%place%load_factor - run%state%load_factor
      if (change%lies .and. label == '  ') then
         line = run
         line%state = next%state
         line%system = next%system
         line%heading = heading_at(next%problem, next%system, 0.0_wp * next%state%u, sign(1.0_wp, &
            & merge(next%rate, change%heading%load, abs(next%rate) > 0.0_wp)))
         call bars_of_line(problem, step, run, change%place, next%problem, line, bars, timers)
      end if
      if (change%which > 0 .and. .not. allocated(bars)) &
         & call bars_at_point(problem, step, run, change%place, change%heading, label, .false., change%which, bars, timers)
      ! Two changes at once, of which the first has its point: where contact only spreads Newton's method has yet to follow.
      if (.not. (change%standing .and. label == '  ')) &
         & call accept(problem, step, run, change%place, change%heading, label, change%report, change%looked_ahead .and. &
         & .not. stuck, recorder, shorter, finished, outcome, timers, divides=divides, changes=.true., &
         & bars=bars, tries=tries)
      run%control%increment = increment
      if (allocated(run%beginning)) deallocate (run%beginning)
      run%beginning_in = 0
   end subroutine record_change

   !> What is told of a change: contact gained or lost; where it only spreads, nothing.
   subroutine describe(problem, change, next, label, divides)
      type(problem_t), intent(in) :: problem
      type(change_t), intent(in) :: change
      type(next_t), intent(in) :: next
      character(2), intent(out) :: label
      logical, intent(out) :: divides            !! of the contact that is lost a part stays on both sides
      integer :: c
      label = '  '
      divides = .false.
      if (change%which == 0) return
      associate (test => change%tests(change%which))
         if (any(test%kind == [test_gap, test_closing])) label = 'C+'
         if (any(test%kind == [test_force, test_pressure])) label = 'C-'
         if (opens_line(problem, test)) then
            divides = size(find_span_regions(next%problem, next%state)) > size(find_span_regions(problem, change%place))
            if (.not. divides) label = '  '
         end if
         if (test%kind == test_curvature .and. .not. (change%lies .or. change%standing)) then
            divides = virtual_pressure(problem, change%place, test%candidate) < 0.0_wp
            if (divides) label = 'C-'
         end if
         if (change%lies) return
         ! Contact that begins, or ends, where a clamp stands.
         do c = 1, problem%candidates%n
            if (problem%candidates%touch(c) == 0 .or. problem%candidates%touch(c) /= test%touch) cycle
            if (.not. stands(problem, change%place, c)) cycle
            if (test%kind == test_curvature .and. .not. change%standing) then
               label = 'C+'
               divides = .false.
            end if
            if (test%kind == test_length) label = 'C-'
         end do
      end associate
   end subroutine describe

   !> Changes the set at the place where the run stands. A span that opens gets as long as it takes to tell its ends.
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

   !> A shorter increment may tell.
   subroutine go_less_far(problem, step, run, test, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! stuck where it has become too short
      type(span_test_t), intent(in) :: test      !! whose zero was not found
      type(timers_t), intent(inout) :: timers
      call linearise(problem, run%state, run%state, run%system, timers)
      run%control%increment = 0.5_wp * run%control%increment
      if (abs(run%control%increment) < smallest(step, run%control)) &
         & run%stuck = 'where '//trim(test_words(test%kind))//' was not found'
   end subroutine go_less_far

   !> True where a line lifts off inside, or at an end that a breakpoint of the rod holds.
   pure logical function opens_line(problem, test)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test
      opens_line = test%kind == test_pressure
      if (test%kind == test_force) opens_line = problem%touch(test%touch)%line .and. .not. problem%candidates%moves(test%candidate)
   end function opens_line
end module span_changes
