!> Gap between two nodes of a rigid contact: a quintic through gap, slope and curvature at both ends of an element. At the nodes
!> these quantities have the full order of the element, whereas the rod's profile between nodes has the order s + 1 only.
module gap_profile
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_opening, candidate_gap, element_load
   use rod_load, only: ge_load_t
   use rod_geometry, only: element_geometry_t
   use section_forces, only: local_forces, rod_direction
   implicit none
   private
   public :: smallest_gap, natural_curvature

   !> Gap along one element, tau from 0 to 1.
   type :: profile_t
      real(wp) :: value(2) = 0.0_wp, slope(2) = 0.0_wp, bend(2) = 0.0_wp !! gap and its derivatives by tau at both ends
   end type profile_t

contains

   !> Gap profile on the element after a candidate.
   function element_profile(problem, state, candidate) result(profile)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate     !! candidate with a neighbour after it
      type(profile_t) :: profile
      real(wp) :: local(3, 2), h
      integer :: e, side, c
      e = problem%candidates%element(2, candidate)
      h = state%geometry%element(e)%length
      call local_forces(problem, state, e, local)
      do side = 1, 2
         c = candidate
         if (side == 2) c = problem%candidates%neighbour(2, candidate)
         call end_derivatives(problem, state, c, e, side, local(:, side), (local(1:2, 2) - local(1:2, 1)) / h, &
            & profile%value(side), profile%slope(side), profile%bend(side))
      end do
      profile%slope = profile%slope * h
      profile%bend = profile%bend * h**2
   end function element_profile

   !> Computes gap, slope and second derivative of the gap along the rod at one end of an element, by the stress-free length, from
   !> r' = (1 + e + N/EA) t + (Q/GA) nu: r position, e thermal strain, N normal force along the tangent t, Q shear force along the
   !> normal nu.
   subroutine end_derivatives(problem, state, candidate, e, side, local, change, gap, slope, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, e, side
      real(wp), intent(in) :: local(3)     !! N, Q, M at that end
      real(wp), intent(in) :: change(2)    !! derivatives of N and Q by length
      real(wp), intent(out) :: gap, slope, second
      real(wp) :: normal(2), bend, angle, t(2), nu(2), curvature, along, across, shear, d(2)
      type(ge_load_t) :: load
      load = element_load(problem, state, e)
      call candidate_gap(problem, state, candidate, gap, normal, bend)
      angle = rod_direction(problem, state, e, side)
      t = [cos(angle), sin(angle)]
      nu = [-t(2), t(1)]
      shear = shear_compliance(problem, e)
      along = stretch(problem, state, e, local(1))
      across = local(2) * shear
      d = along * t + across * nu
      slope = dot_product(normal, d)
      curvature = natural_curvature(state%geometry%element(e)) + load%curvature + local(3) * problem%compliance(e)%bending
      second = bend * (normal(2) * d(1) - normal(1) * d(2))**2 + &
         & dot_product(normal, (along * curvature + change(2) * shear) * nu + &
         & (change(1) * problem%compliance(e)%axial - across * curvature) * t)
   end subroutine end_derivatives

   !> Gap at a place in the element.
   pure real(wp) function profile_value(profile, tau)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      profile_value = quintic(profile%value, profile%slope, profile%bend, tau)
   end function profile_value

   !> Finds the smallest gap of the element, ends included, and its place.
   pure subroutine profile_least(profile, least, tau)
      type(profile_t), intent(in) :: profile
      real(wp), intent(out) :: least, tau
      integer, parameter :: samples = 8
      real(wp) :: step, f(3), curvature
      integer :: i
      least = huge(1.0_wp)
      tau = 0.0_wp
      do i = 0, samples
         if (profile_value(profile, real(i, wp) / samples) >= least) cycle
         tau = real(i, wp) / samples
         least = profile_value(profile, tau)
      end do
      step = 0.5_wp / samples
      do i = 1, 40
         f(1) = profile_value(profile, max(tau - step, 0.0_wp))
         f(2) = profile_value(profile, tau)
         f(3) = profile_value(profile, min(tau + step, 1.0_wp))
         curvature = f(1) - 2.0_wp * f(2) + f(3)
         if (curvature > 0.0_wp) tau = tau + min(max(0.5_wp * step * (f(1) - f(3)) / curvature, -step), step)
         tau = min(max(tau, 0.0_wp), 1.0_wp)
         step = max(0.5_wp * step, 1.0e-4_wp)
      end do
      least = min(least, profile_value(profile, tau))
      if (profile%value(1) <= least) tau = 0.0_wp
      if (profile%value(2) < least) tau = 1.0_wp
      least = profile_value(profile, tau)
   end subroutine profile_least

   !> Finds the smallest gap on the element from a candidate to its next neighbour, ends included.
   subroutine least_gap_after(problem, state, candidate, least, tau)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate     !! candidate with a neighbour after it
      real(wp), intent(out) :: least
      real(wp), intent(out) :: tau         !! place, 0 to 1 from the candidate to its neighbour
      call profile_least(element_profile(problem, state, candidate), least, tau)
   end subroutine least_gap_after

   !> Smallest gap along the elements that join marked candidates; on coupled ground at the nodes only, relative to the settled
   !> surface.
   real(wp) function smallest_gap(problem, state, marked) result(least)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: marked(:)     !! (candidates)
      real(wp) :: value, tau
      integer :: c, next
      least = huge(1.0_wp)
      do c = 1, problem%candidates%n
         next = problem%candidates%neighbour(2, c)
         if (next == 0 .or. problem%coupling%entry(c) > 0) then
            if (.not. marked(c)) cycle
            value = candidate_opening(problem, state, c)
         else
            if (.not. (marked(c) .or. marked(next))) cycle
            call least_gap_after(problem, state, c, value, tau)
         end if
         least = min(least, value)
      end do
   end function smallest_gap

   !> Extension ratio, deformed over stress-free length, for the normal force n.
   pure real(wp) function stretch(problem, state, e, n)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: n
      type(ge_load_t) :: load
      load = element_load(problem, state, e)
      stretch = 1.0_wp + load%strain + n * problem%compliance(e)%axial
   end function stretch

   !> Hermite's quintic on (0, 1).
   pure real(wp) function quintic(value, slope, bend, tau)
      real(wp), intent(in) :: value(2), slope(2), bend(2), tau
      real(wp) :: d, p, c3, c4, c5
      d = value(2) - value(1) - slope(1) - 0.5_wp * bend(1)
      p = slope(2) - slope(1) - bend(1)
      c3 = 10.0_wp * d - 4.0_wp * p + 0.5_wp * (bend(2) - bend(1))
      c4 = -15.0_wp * d + 7.0_wp * p - (bend(2) - bend(1))
      c5 = 6.0_wp * d - 3.0_wp * p + 0.5_wp * (bend(2) - bend(1))
      quintic = value(1) + tau * (slope(1) + tau * (0.5_wp * bend(1) + tau * (c3 + tau * (c4 + tau * c5))))
   end function quintic

   !> 1/GA of an element, without the residual bending flexibility that elements of one stage add to 1/GA.
   pure real(wp) function shear_compliance(problem, e)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: e
      shear_compliance = 0.0_wp
      associate (section => problem%model%section(problem%model%mesh%section(e)))
         if (.not. section%shear_rigid) shear_compliance = 1.0_wp / section%ga
      end associate
   end function shear_compliance

   !> Mean stress-free curvature of an element.
   pure real(wp) function natural_curvature(element)
      type(element_geometry_t), intent(in) :: element
      natural_curvature = (element%end_angle(2) - element%end_angle(1)) / element%length
   end function natural_curvature
end module gap_profile
