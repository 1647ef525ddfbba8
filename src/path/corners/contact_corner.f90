!> Corners of the path where the contact set changes.
!>
!> Behind a limit point the LCP of an increment may have no solution: along the tangent a contact has to open, but the path without
!> that contact leaves in a direction with a negative component along the tangent, so that no increment of the given length exists.
!> The corner is therefore located with the contact set kept, by bringing the first reaction or gap that violates its sign to zero.
!> The set is changed there, and the new tangent is oriented along growing reaction or opening gap instead of along the old tangent.
module contact_corner
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t
   use path_continuity, only: path_tangent_t, path_tangent_at
   use corrector, only: increment_t, take_increment
   use node_contact_functional, only: reaction_rate, gap_rate
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   implicit none
   private
   public :: find_corner, leave_corner

contains

   !> Searches for a corner within one increment of `start`. Several candidates may change at once, for example by symmetry. The
   !> system is assembled and factored at `start` on entry.
   subroutine find_corner(problem, start, control, place, corner, system, report, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(state_t), intent(out) :: place      !! converged, with the contact set of `start`, whose signs are about to change
      integer, allocatable, intent(out) :: corner(:) !! candidates that change
      type(system_t), intent(inout) :: system  !! assembled and factored at the corner if found
      type(increment_t), intent(out) :: report
      logical, intent(out) :: found
      real(wp), parameter :: at_once = 1.0e-8_wp !! share of an increment within which signs change together
      type(state_t) :: beyond
      type(control_t) :: part
      real(wp), allocatable :: before(:), after(:), ends(:)
      type(bracket_t) :: bracket
      real(wp) :: fraction
      integer :: k, first

      found = .false.
      call take_increment(problem, start, control, beyond, system, report, keep_contact=.true.)
      if (.not. report%converged) return
      after = signs(problem, start%active, beyond, system)
      call linearise(problem, start, start, system)
      before = signs(problem, start%active, start, system)
      first = 0
      fraction = 1.0_wp
      do k = 1, size(after)
         if (after(k) >= 0.0_wp .or. before(k) < 0.0_wp) cycle
         if (before(k) / (before(k) - after(k)) >= fraction) cycle
         fraction = before(k) / (before(k) - after(k))
         first = k
      end do
      if (first == 0) return
      allocate (corner(0))
      ends = after
      bracket = new_bracket(before(first), after(first))
      part = control
      place = start
      do while (next_guess(bracket, epsilon(fraction), fraction))
         part%increment = fraction * control%increment
         call take_increment(problem, start, part, place, system, report, keep_contact=.true.)
         if (.not. report%converged) return
         after = signs(problem, start%active, place, system)
         found = abs(after(first)) <= problem%model%step(problem%step)%locate_tolerance * bracket%scale
         if (found) exit
         call take_value(bracket, fraction, after(first))
         call linearise(problem, start, start, system)
      end do
      ! The corner is valid only if no other sign has changed before.
      if (found) found = all(after >= -1.0e-6_wp .or. before < 0.0_wp)
      if (.not. found) return
      do k = 1, size(after)
         ! Other candidates whose signs change at the corner.
         if (after(k) >= huge(1.0_wp) .or. before(k) < 0.0_wp .or. ends(k) >= 0.0_wp) cycle
         if (k /= first .and. after(k) > at_once * (before(k) - ends(k))) cycle
         corner = [corner, k]
      end do
   end subroutine find_corner

   !> Changes the contact set at a corner and returns the tangent of the continuation, along which the new reactions grow or the new
   !> gaps open.
   subroutine leave_corner(problem, corner, place, system, heading, ok)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: corner(:)         !! candidates
      type(state_t), intent(inout) :: place    !! its contact set is changed
      type(system_t), intent(inout) :: system  !! factored at `place` on entry, there with the new set on return
      type(path_tangent_t), intent(inout) :: heading !! tangent of the old path on entry, of the new one on return
      logical, intent(out) :: ok
      real(wp) :: rate, none(3, size(place%u, 2))
      integer :: k
      do k = 1, size(corner)
         associate (candidate => corner(k))
            place%active(candidate) = .not. place%active(candidate)
            place%reaction(candidate) = 0.0_wp
         end associate
      end do
      call linearise(problem, place, place, system)
      ok = system%ok
      if (.not. ok) return
      rate = 0.0_wp
      do k = 1, size(corner)
         associate (candidate => corner(k))
            if (place%active(candidate)) then
               rate = rate + reaction_rate(problem, place, system, candidate)
            else
               rate = rate + gap_rate(problem, system, candidate)
            end if
         end associate
      end do
      none = 0.0_wp
      ! The rates are per unit load factor.
      heading = path_tangent_at(problem, system, none, sign(1.0_wp, rate))
   end subroutine leave_corner

   !> Reactions of active candidates, and gaps of the others, both dimensionless: all positive while the contact set is valid; huge
   !> for bilateral candidates, which have no condition.
   function signs(problem, active, state, system) result(value)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: value(problem%candidates%n)
      integer :: c
      value = huge(1.0_wp)
      do c = 1, problem%candidates%n
         if (problem%candidates%bilateral(c)) cycle
         if (active(c)) then
            value(c) = state%reaction(c) / max(system%force_scale, tiny(1.0_wp))
         else
            value(c) = system%opening(c) / problem%size
         end if
      end do
   end function signs
end module contact_corner
