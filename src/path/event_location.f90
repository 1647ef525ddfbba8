!> Locates an event that was seen to happen within an increment.
module event_location
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t
   use corrector, only: increment_t, take_increment
   use path_events, only: event_t, probe_t, event_value, event_bifurcation, event_contact
   use path_run, only: run_t, probe_at
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_middle, bracket_update
   use timing, only: timers_t
   implicit none
   private
   public :: locate

contains

   !> Finds the zero of an event's function between the last accepted point and the trial by the Illinois rule on the
   !> length of the increment; an event of counts only by bisection.
   subroutine locate(problem, step, run, trial, event, place, report, fraction, located, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(event_t), intent(in) :: event
      type(state_t), intent(out) :: place           !! the located point, or the nearest one found
      type(increment_t), intent(out) :: report
      real(wp), intent(out) :: fraction             !! of the increment
      logical, intent(out) :: located
      type(timers_t), intent(inout) :: timers
      integer, parameter :: max_tries = 60
      type(control_t) :: control
      type(state_t) :: here, below, above
      type(probe_t) :: probe
      type(bracket_t) :: bracket
      real(wp) :: f
      integer :: try
      logical :: counts, held, low_moved
      counts = event%kind == event_bifurcation
      held = event%kind == event_contact
      control = run%control
      bracket = new_bracket(event%before, event%after)
      below = run%state
      above = trial
      place = trial
      fraction = 1.0_wp
      located = abs(event%after) <= step%locate_tolerance * bracket%scale
      search: do try = 1, max_tries
         if (located) exit search
         fraction = bracket_guess(bracket)
         if (counts) fraction = bracket_middle(bracket)
         control%increment = fraction * run%control%increment
         call linearise(problem, run%state, run%state, run%system, timers)
         ! With the contact set of the start the function of a contact event is smooth through its zero.
         call take_increment(problem, run%state, control, here, run%system, report, timers, &
            & keep_contact=held)
         if (held .and. report%converged) then
            ! Other candidates may have changed sides meanwhile; then the LCP has to take part.
            if (.not. holds_elsewhere(problem, run%system, event%marked, here)) then
               held = .false.
               cycle search
            end if
         end if
         if (.not. report%converged) exit search
         probe = probe_at(problem, run, here)
         f = event_value(problem, event, here, probe)
         place = here
         located = abs(f) <= step%locate_tolerance * bracket%scale .and. .not. counts
         if (located) exit search
         call bracket_update(bracket, fraction, f, low_moved)
         if (low_moved) then
            below = here
         else
            above = here
         end if
         if (bracket%high - bracket%low <= step%locate_tolerance) then
            place = above
            fraction = bracket%high
            located = .true.
         end if
      end do search
      ! Where the contact set changes, pivot counts may jump without a bifurcation.
      if (counts .and. located .and. size(below%active) > 0) located = all(below%active .eqv. above%active)
   end subroutine locate

   !> Signs of the gaps and reactions of all but some candidates.
   pure logical function holds_elsewhere(problem, system, marked, state) result(holds)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled at `state`
      logical, intent(in) :: marked(:)           !! (candidates) that do not count
      type(state_t), intent(in) :: state
      real(wp), parameter :: tolerance = 1.0e-8_wp
      holds = .not. any(.not. marked .and. merge(state%reaction < -tolerance * system%force_scale, &
         & system%gap < -tolerance * problem%size, state%active))
   end function holds_elsewhere
end module event_location
