!> The gap between the nodes: a quintic through gap, slope and curvature at both ends of an element.
module gap_profile
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap
   use rod_geometry, only: element_geometry_t
   use section_forces, only: local_forces, rod_direction
   implicit none
   private
   public :: least_gap_after, smallest_gap, gap_and_slope, gap_bend, natural_curvature

contains

   !> Smallest gap on the element from a candidate to its next neighbour, ends included.
   subroutine least_gap_after(problem, state, candidate, least, tau)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate     !! with a neighbour after it
      real(wp), intent(out) :: least
      real(wp), intent(out) :: tau         !! where, 0 to 1 from the candidate to its neighbour
      integer, parameter :: samples = 8
      real(wp) :: gap(2), slope(2), bend(2), h, step, value
      integer :: next, e, i
      next = problem%candidates%neighbour(2, candidate)
      e = problem%candidates%element(2, candidate)
      h = state%geometry%element(e)%length
      call gap_and_slope(problem, state, candidate, e, 1, gap(1), slope(1))
      call gap_and_slope(problem, state, next, e, 2, gap(2), slope(2))
      bend(1) = gap_bend(problem, state, candidate, e, 1)
      bend(2) = gap_bend(problem, state, next, e, 2)
      slope = slope * h
      bend = bend * h**2
      least = huge(1.0_wp)
      tau = 0.0_wp
      do i = 0, samples
         value = quintic(gap, slope, bend, real(i, wp) / samples)
         if (value >= least) cycle
         least = value
         tau = real(i, wp) / samples
      end do
      step = 0.5_wp / samples
      do i = 1, 40
         call parabola_step(gap, slope, bend, tau, step)
      end do
      least = quintic(gap, slope, bend, tau)
      if (gap(1) < least) then
         least = gap(1)
         tau = 0.0_wp
      end if
      if (gap(2) < least) then
         least = gap(2)
         tau = 1.0_wp
      end if
   end subroutine least_gap_after

   !> Smallest gap along the elements that touch a set of candidates.
   real(wp) function smallest_gap(problem, state, marked) result(least)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: marked(:)     !! (candidates)
      real(wp) :: value, tau, normal(2), bend
      integer :: c, next
      least = huge(1.0_wp)
      do c = 1, problem%candidates%n
         next = problem%candidates%neighbour(2, c)
         if (next == 0) then
            if (.not. marked(c)) cycle
            call candidate_gap(problem, state, c, value, normal, bend)
         else
            if (.not. (marked(c) .or. marked(next))) cycle
            call least_gap_after(problem, state, c, value, tau)
         end if
         least = min(least, value)
      end do
   end function smallest_gap

   !> Gap of a candidate and its derivative along the rod, seen from one end of an element.
   subroutine gap_and_slope(problem, state, candidate, e, side, gap, slope)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, e, side
      real(wp), intent(out) :: gap, slope
      real(wp) :: normal(2), bend, angle
      call candidate_gap(problem, state, candidate, gap, normal, bend)
      angle = rod_direction(problem, state, e, side)
      slope = normal(1) * cos(angle) + normal(2) * sin(angle)
   end subroutine gap_and_slope

   !> Moves tau towards the minimum of the quintic and halves the step.
   pure subroutine parabola_step(value, slope, bend, tau, step)
      real(wp), intent(in) :: value(2), slope(2), bend(2)
      real(wp), intent(inout) :: tau, step
      real(wp) :: f(3), curvature
      f(1) = quintic(value, slope, bend, max(tau - step, 0.0_wp))
      f(2) = quintic(value, slope, bend, tau)
      f(3) = quintic(value, slope, bend, min(tau + step, 1.0_wp))
      curvature = f(1) - 2.0_wp * f(2) + f(3)
      if (curvature > 0.0_wp) tau = tau + min(max(0.5_wp * step * (f(1) - f(3)) / curvature, -step), step)
      tau = min(max(tau, 0.0_wp), 1.0_wp)
      step = max(0.5_wp * step, 1.0e-4_wp)
   end subroutine parabola_step

   !> Second derivative of the gap along the rod at one end of an element.
   real(wp) function gap_bend(problem, state, candidate, e, side) result(second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, e, side
      real(wp) :: local(3, 2), gap, normal(2), bend, angle, t(2), curvature
      call candidate_gap(problem, state, candidate, gap, normal, bend)
      call local_forces(problem, state, e, local)
      angle = rod_direction(problem, state, e, side)
      t = [cos(angle), sin(angle)]
      curvature = natural_curvature(state%geometry%element(e)) + local(3, side) * problem%compliance(e)%bending
      second = bend * (normal(2) * t(1) - normal(1) * t(2))**2 + curvature * (normal(2) * t(1) - normal(1) * t(2))
   end function gap_bend

   !> Hermite quintic on (0, 1).
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

   !> Mean stress-free curvature of an element.
   pure real(wp) function natural_curvature(element)
      type(element_geometry_t), intent(in) :: element
      natural_curvature = (element%end_angle(2) - element%end_angle(1)) / element%length
   end function natural_curvature
end module gap_profile
