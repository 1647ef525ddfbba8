!> Locates an event that was seen to happen within an increment.
module event_location
   use kinds, only: wp
   use model, only: step_t, method_linearised, method_load, method_cylindrical, method_largest
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t, is_arc_length, is_free, plane_distance
   use corrector, only: increment_t, take_increment, correct
   use path_events, only: event_t, probe_t, event_value, event_bifurcation, event_release, event_contact
   use weak_contacts, only: release_weak
   use tangent_modes, only: modes_t, lowest_modes, numbered_eigenvalue
   use errors, only: error_t
   use path_run, only: run_t, probe_at
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_update
   use timing, only: timers_t
   implicit none
   private
   public :: locate

   integer, parameter :: eigenvalues_looked_at = 4

contains

   !> Finds the zero of an event's function between the last accepted point and the trial by the Illinois rule on the
   !> length of the increment.
   subroutine locate(problem, step, run, trial, event, place, report, fraction, located, later, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(event_t), intent(inout) :: event         !! gets its scale
      type(state_t), intent(out) :: place           !! the located point, or the nearest one found
      type(increment_t), intent(out) :: report
      real(wp), intent(out) :: fraction             !! of the increment
      logical, intent(out) :: located
      logical, intent(out) :: later                 !! bifurcation: it comes after the trial, whose pivots have the sign of rounding
      type(timers_t), intent(inout) :: timers
      integer, parameter :: max_tries = 60
      type(control_t) :: control
      type(state_t) :: here, below, above
      type(probe_t) :: probe
      type(bracket_t) :: bracket
      real(wp) :: f, whole
      integer :: try
      logical :: branching, held, low_moved
      later = .false.
      located = .false.
      fraction = 1.0_wp
      place = trial
      branching = any(event%kind == [event_bifurcation, event_release])
      held = event%kind == event_contact .and. event%ground%contact == 0 .and. &
         & .not. (event%divided .and. event%before < 0.0_wp)
      control = run%control
      whole = control%increment
      if (is_arc_length(control%method)) then
         ! Where the contact set stays, the load tells parts of an increment best: what rounding adds across the path, much
         ! where a structure hardly moves before it buckles, is nothing to it. Else a plane normal to the tangent: free
         ! strategies have no constraint of their own that could.
         if (event%load_tells .and. alike(run%state, trial)) then
            control%method = method_load
            whole = trial%load_factor - run%state%load_factor
         else if (any(run%control%method == [method_cylindrical, method_largest]) .or. &
            & is_free(run%control%method)) then
            control%method = method_linearised
            ! Of the displacements only, as the strategy: with the load in it the plane may meet the path twice.
            control%load_scale = 0.0_wp
            whole = plane_distance(problem, control, run%state, trial)
            if (.not. (is_free(run%control%method) .or. whole > 0.3_wp * run%control%increment)) then
               control = run%control
               whole = control%increment
            end if
         end if
      end if
      control%whole = whole
      if (branching) then
         call linearise(problem, trial, trial, run%system, timers)
         f = eigenvalue(trial)
         call linearise(problem, run%state, run%state, run%system, timers)
         bracket = new_bracket(eigenvalue(run%state), f)
         later = bracket%f_low * f > 0.0_wp .and. event%before * f > 0.0_wp
         if (later) return
      else
         bracket = new_bracket(event%before, event%after)
      end if
      event%scale = bracket%scale
      below = run%state
      above = trial
      ! A contact that is lost may leave no gap where something else holds the node; with it held its reaction tells.
      located = abs(bracket%f_high) <= step%locate_tolerance * bracket%scale .and. .not. held
      if (branching) then
         if (bracket%f_low * event%before <= 0.0_wp) then
            ! It was passed next to the last point, which had the sign of rounding.
            place = run%state
            fraction = 0.0_wp
            located = .true.
         end if
      end if
      search: do try = 1, max_tries
         if (located) exit search
         fraction = bracket_guess(bracket)
         control%increment = fraction * whole
         ! With the contact set of the start the function of a contact event is smooth through its zero.
         if (alike(below, above) .and. .not. held) then
            here = between(below, above, (fraction - bracket%low) / (bracket%high - bracket%low))
            call correct(problem, run%state, control, .false., here, run%system, report, timers)
            ! Once more: next to a bifurcation a small residual leaves a share of the null vector.
            if (branching .and. report%converged) &
               & call correct(problem, run%state, control, .false., here, run%system, report, timers)
         else
            call linearise(problem, run%state, run%state, run%system, timers)
            call take_increment(problem, run%state, control, here, run%system, report, timers, keep_contact=held)
         end if
         if (held .and. report%converged) then
            ! Other candidates may have changed sides meanwhile; then the LCP has to take part.
            if (.not. holds_elsewhere(problem, run%system, event%marked, here)) then
               held = .false.
               cycle search
            end if
         end if
         if (.not. report%converged) exit search
         probe = probe_at(problem, run, here)
         if (branching) then
            f = eigenvalue(here)
         else
            f = event_value(problem, event, here, probe)
         end if
         place = here
         event%pivots = run%system%negative_pivots
         located = abs(f) <= step%locate_tolerance * bracket%scale .and. load_error() <= step%locate_tolerance
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
      ! Where the contact set changes, eigenvalues may jump without a bifurcation.
      if (branching .and. located .and. size(below%active) > 0) located = all(below%active .eqv. above%active)

   contains

      !> What is left to the zero, as a change of the load factor over its size.
      real(wp) function load_error()
         load_error = abs((above%load_factor - below%load_factor) * f / max(abs(bracket%f_high - bracket%f_low), tiny(f))) / &
            & max(abs(here%load_factor), abs(trial%load_factor - run%state%load_factor))
      end function load_error

      !> The eigenvalue that changes its sign, where the system is factored now; with contacts released it is so afterwards.
      real(wp) function eigenvalue(state)
         type(state_t), intent(in) :: state
         type(modes_t) :: modes
         type(error_t), allocatable :: error
         type(state_t) :: at
         real(wp), parameter :: alone = 1.0e-2_wp
         logical :: any_weak
         at = state
         if (event%kind == event_release) then
            call release_weak(problem, state, run%system, at, any_weak)
            call linearise(problem, at, at, run%system, timers)
         end if
         call lowest_modes(problem, at, run%system, eigenvalues_looked_at, modes, error, timers)
         eigenvalue = numbered_eigenvalue(modes, event%number, event%least, event%most)
         ! Free spans on a straight wall leave nothing but this one near zero: the others are rounding.
         if (event%kind == event_release .and. abs(modes%mu(1)) <= alone * abs(modes%mu(2))) eigenvalue = modes%mu(1)
      end function eigenvalue
   end subroutine locate

   !> True for states that differ in nothing that jumps: contact set, places of the sliding nodes.
   pure logical function alike(a, b)
      type(state_t), intent(in) :: a, b
      integer :: e
      alike = all(a%active .eqv. b%active)
      do e = 1, size(a%geometry%element)
         if (.not. alike) return
         alike = all(abs(a%geometry%element(e)%s - b%geometry%element(e)%s) <= 0.0_wp)
      end do
   end function alike

   !> The state a part of the way from one to another.
   pure function between(from, to, part) result(state)
      type(state_t), intent(in) :: from, to    !! alike
      real(wp), intent(in) :: part             !! 0 to 1
      type(state_t) :: state
      state = from
      state%load_factor = from%load_factor + part * (to%load_factor - from%load_factor)
      state%u = from%u + part * (to%u - from%u)
      state%z = from%z + part * (to%z - from%z)
      state%reaction = from%reaction + part * (to%reaction - from%reaction)
   end function between

   !> Signs of the gaps and reactions of all but some candidates; of these only that they do not work against each other.
   pure logical function holds_elsewhere(problem, system, marked, state) result(holds)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled at `state`
      logical, intent(in) :: marked(:)           !! (candidates) whose own signs do not count
      type(state_t), intent(in) :: state
      real(wp), parameter :: tolerance = 1.0e-8_wp
      real(wp) :: least
      least = tolerance * system%force_scale
      ! Held, a region may pull at one node what it pushes at another: their sum vanishes where no contact is lost.
      holds = .not. (any(marked .and. state%active .and. state%reaction < -least) .and. &
         & any(marked .and. state%active .and. state%reaction > least))
      if (.not. holds) return
      holds = .not. any(.not. marked .and. .not. problem%candidates%bilateral .and. &
         & merge(state%reaction < -least, system%opening < -tolerance * problem%size, state%active))
   end function holds_elsewhere
end module event_location
