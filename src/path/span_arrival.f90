!> The equilibria around a change of contact spans that are computed on the next set: the touch itself where contact begins, the
!> line of a span that has lain down, the free span that opens within a line.
module span_arrival
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use span_problem, only: hold_touches
   use span_regions, only: find_span_regions
   use span_tests, only: run_span_tests
   use span_events, only: leg_t, change_t, next_t
   use span_opening, only: open_line
   use span_set, only: begin_touch, touched_at
   use state_transfer, only: carried, carried_field
   use path_control, only: control_t, path_length, displacement_between
   use path_continuity, only: heading_t, heading_at, between
   use path_events, only: event_t, new_probe, detect_events
   use path_run, only: run_t, heading_of, forget_mesh
   use path_acceptance, only: accept, outcome_t
   use corrector, only: increment_t, correct
   use path_record, only: recorder_t
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_touch
   use timing, only: timers_t
   implicit none
   private
   public :: begin_sharply, take_line, take_opened

   real(wp), parameter :: near_by = 0.1_wp     !! of an increment: what a better place may differ by

contains

   !> Where contact begins: the gap is as good as the dense output, the touch itself as good as the nodes.
   subroutine begin_sharply(problem, step, run, leg, change, bars, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the change's place
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change    !! as it was where no touch is found nearby
      type(error_bars_t), allocatable, intent(inout) :: bars
      type(timers_t), intent(inout) :: timers
      type(run_t) :: touched
      type(problem_t) :: next
      type(state_t) :: better
      type(control_t) :: control
      type(increment_t) :: anew
      logical :: found
      touched = run
      touched%state = change%place
      touched%heading = change%heading
      next = problem
      call begin_touch(next, touched, change%tests(change%which), found, timers)
      if (.not. found) return
      control%method = method_load
      control%increment = touched%state%load_factor - change%place%load_factor
      control%whole = change%place%load_factor
      better = change%place
      call correct(problem, change%place, control, .true., better, run%system, anew, timers)
      found = anew%converged
      ! Where the path turns back the load tells nothing.
      if (found) found = path_length(problem, change%place, better) <= near_by * path_length(problem, run%state, leg%to)
      if (.not. found) then
         call linearise(problem, change%place, run%state, run%system, timers)
         return
      end if
      change%place = better
      change%report%iterations = change%report%iterations + anew%iterations
      change%report%residual = anew%residual
      change%heading = heading_of(problem, run, better)
      change%tests = run_span_tests(problem, better, leg%scale)
      change%tests(change%which)%at = touched_at(next, touched)
      call bars_at_touch(problem, step, run, better, change%heading, next, touched, bars, timers)
   end subroutine begin_sharply

   !> Goes on with the line of a span that has lain down. Its first point is one of the path where the
   !> increment came to it, an event where contacts have merged by that.
   subroutine take_line(problem, step, run, change, next, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! at the change's place
      type(change_t), intent(in) :: change
      type(next_t), intent(inout) :: next
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(state_t) :: before
      logical :: merges, shorter
      finished = .false.
      merges = .false.
      if (change%which == 0) &
         & merges = size(find_span_regions(next%problem, next%state)) < size(find_span_regions(problem, change%place))
      before = carried(problem, run%state, next%problem)
      call hold_touches(next%problem, before%active)
      ! A line that presses already goes on as the path came.
      run%heading%u = carried_field(problem, run%state, run%heading%u, next%problem, before)
      problem = next%problem
      run%system = next%system
      if (change%standing) then
         run%state = before
         run%heading = heading_at(problem, next%system, displacement_between(problem, before, next%state), &
            & next%state%load_factor - before%load_factor)
         run%probe = new_probe(problem, before, next%system, run%heading%load)
         call forget_mesh(run)
         call accept(problem, step, run, next%state, heading_of(problem, run, next%state), merge('C+', '  ', merges), &
            & increment_t(converged=.true.), .false., recorder, shorter, finished, outcome, timers)
         if (finished .or. allocated(outcome%why)) return
      end if
      run%state = next%state
      if (abs(next%rate) > 0.0_wp) run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, next%rate))
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
      call forget_mesh(run)
   end subroutine take_line

   !> From where a span opens, where the run stands, to the equilibrium with the open span: as near as it takes for nothing
   !> else to happen before.
   subroutine take_opened(problem, step, run, leg, change, next, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! at the change's place
      type(leg_t), intent(in) :: leg             !! from there on to its end
      type(change_t), intent(in) :: change
      type(next_t), intent(inout) :: next        !! the open span at the end of the leg
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(next_t) :: nearer
      type(state_t) :: here
      type(control_t) :: control
      type(increment_t) :: report
      type(heading_t) :: heading
      type(run_t) :: on
      type(event_t), allocatable :: events(:)
      real(wp) :: part
      logical :: found, shorter
      finished = .false.
      report = change%report
      part = 1.0_wp
      do
         on = run
         on%state = carried(problem, run%state, next%problem)
         call hold_touches(next%problem, on%state%active)
         on%system = next%system
         call forget_mesh(on)
         on%heading = heading_at(next%problem, next%system, displacement_between(next%problem, on%state, next%state), &
            & next%state%load_factor - on%state%load_factor)
         on%probe = new_probe(next%problem, on%state, next%system, on%heading%load)
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
end module span_arrival
