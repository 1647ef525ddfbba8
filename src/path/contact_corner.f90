!> Corners of the path where the contact set changes and the path turns back on itself.
!>
!> Past a limit point the LCP of an increment may have no solution: along the tangent a contact has to open, but the path
!> without it leaves in a direction with a negative component on that tangent, so no increment of given length exists.
!> Then the corner itself is found (the contact set held, the offending reaction or gap brought to zero), the set is
!> changed there, and the new tangent is pointed where the gap opens, or the reaction grows, instead of along the old one.
module contact_corner
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, to_global
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent
   use corrector, only: increment_t, take_increment
   use contact_set, only: reaction_rate
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_update
   use timing, only: timers_t
   implicit none
   private
   public :: find_corner, leave_corner

contains

   !> Looks for a corner within one increment of `start`. The system is assembled and factored at `start` on entry.
   subroutine find_corner(problem, start, control, corner, candidate, system, report, found, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(state_t), intent(out) :: corner     !! converged, contact set of `start`, the candidate's sign about to change
      integer, intent(out) :: candidate        !! whose reaction or gap vanishes there
      type(system_t), intent(inout) :: system  !! assembled and factored at the corner when found
      type(increment_t), intent(out) :: report
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      integer, parameter :: max_tries = 40
      type(state_t) :: beyond
      type(control_t) :: part
      real(wp), allocatable :: before(:), after(:)
      type(bracket_t) :: bracket
      real(wp) :: fraction
      integer :: try, c
      logical :: low_moved

      found = .false.
      candidate = 0
      call take_increment(problem, start, control, beyond, system, report, timers, keep_contact=.true.)
      if (.not. report%converged) return
      after = signs(problem, beyond, system)
      call linearise(problem, start, start, system, timers)
      before = signs(problem, start, system)
      fraction = 1.0_wp
      do c = 1, problem%candidates%n
         if (after(c) >= 0.0_wp .or. before(c) < 0.0_wp) cycle
         if (before(c) / (before(c) - after(c)) >= fraction) cycle
         fraction = before(c) / (before(c) - after(c))
         candidate = c
      end do
      if (candidate == 0) return

      bracket = new_bracket(before(candidate), after(candidate))
      part = control
      corner = start
      do try = 1, max_tries
         fraction = bracket_guess(bracket)
         part%increment = fraction * control%increment
         call take_increment(problem, start, part, corner, system, report, timers, keep_contact=.true.)
         if (.not. report%converged) return
         after = signs(problem, corner, system)
         found = abs(after(candidate)) <= problem%model%step(problem%step)%locate_tolerance * bracket%scale &
            & .or. bracket%high - bracket%low <= epsilon(fraction)
         if (found) exit
         call bracket_update(bracket, fraction, after(candidate), low_moved)
         call linearise(problem, start, start, system, timers)
      end do
   end subroutine find_corner

   !> Changes the set at a corner and returns the direction in which the path goes on.
   subroutine leave_corner(problem, control, candidate, corner, system, direction, direction_load, ok, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      integer, intent(in) :: candidate
      type(state_t), intent(inout) :: corner   !! its contact set is changed
      type(system_t), intent(inout) :: system  !! assembled and factored with the new set
      real(wp), intent(out) :: direction(:, :) !! (3, nodes) tangent, displacements
      real(wp), intent(out) :: direction_load  !! tangent, load factor
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      type(control_t) :: ahead
      real(wp) :: du(3), rate, none(3, size(corner%u, 2))
      corner%active(candidate) = .not. corner%active(candidate)
      corner%reaction(candidate) = 0.0_wp
      call linearise(problem, corner, corner, system, timers)
      ok = system%ok
      if (.not. ok) return
      ahead = control
      none = 0.0_wp
      call set_tangent(problem, system, none, 0.0_wp, ahead)
      if (corner%active(candidate)) then
         rate = reaction_rate(system, candidate)
      else
         du = to_global(problem, system, system%tangent, problem%candidates%node(candidate))
         rate = dot_product(system%normal(:, candidate), du(1:2))
      end if
      ! Rates are per unit of load factor, the tangent may point against it.
      if (rate * ahead%tangent_load < 0.0_wp) then
         ahead%tangent = -ahead%tangent
         ahead%tangent_load = -ahead%tangent_load
      end if
      direction = ahead%tangent
      direction_load = ahead%tangent_load
   end subroutine leave_corner

   !> Reactions of active candidates and gaps of open ones: all positive while the set holds.
   function signs(problem, state, system) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: value(problem%candidates%n)
      value = merge(state%reaction / max(system%force_scale, tiny(1.0_wp)), system%gap / problem%size, state%active)
   end function signs
end module contact_corner
