!> Gap between two nodes of a rigid contact: a quintic with the gap, slope and curvature at both ends of an element. At the nodes
!> these have the full order of the element, whereas the rod's profile between nodes has only the order s + 1.
module gap_profile
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_opening, candidate_gap, element_load
   use rod_load, only: ge_load_t
   use rod_geometry, only: element_geometry_t
   use section_forces, only: local_forces, rod_direction
   use quintic_spline, only: hermite_coefficients
   use golden_section, only: golden_section_t, sections_to_rounding
   implicit none
   private
   public :: smallest_gap, natural_curvature

contains

   !> Smallest gap along the elements between marked candidates. On coupled ground only the gaps at nodes count, relative to the
   !> settled surface.
   real(wp) function smallest_gap(problem, state, marked) result(least)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: marked(:)     !! (candidates)
      integer :: c, next
      least = huge(1.0_wp)
      do c = 1, problem%candidates%n
         next = problem%candidates%neighbour(2, c)
         if (next == 0 .or. problem%coupling%entry(c) > 0) then
            if (marked(c)) least = min(least, candidate_opening(problem, state, c))
         else
            if (marked(c) .or. marked(next)) least = min(least, least_gap_after(problem, state, c))
         end if
      end do
   end function smallest_gap

   !> Smallest gap on the element from a candidate to its next neighbour, ends included, next to the smallest of several samples.
   real(wp) function least_gap_after(problem, state, candidate) result(least)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate     !! candidate with a neighbour after it
      integer, parameter :: samples = 8
      type(golden_section_t) :: search
      real(wp) :: c(6), value(0:samples), tau
      integer :: i
      c = gap_coefficients(problem, state, candidate)
      value = [(gap_at(real(i, wp) / samples), i=0, samples)]
      i = minloc(value, 1) - 1
      call search%begin(real(max(i - 1, 0), wp) / samples, real(min(i + 1, samples), wp) / samples, sections_to_rounding)
      do while (search%asks(tau))
         call search%tell(gap_at(tau))
      end do
      least = min(value(i), search%least)

   contains

      !> Gap at a position, 0 to 1 of the element.
      pure real(wp) function gap_at(t)
         real(wp), intent(in) :: t
         gap_at = c(1) + t * (c(2) + t * (c(3) + t * (c(4) + t * (c(5) + t * c(6)))))
      end function gap_at
   end function least_gap_after

   !> Coefficients of the gap as a polynomial of the position, 0 to 1, on the element after a candidate.
   function gap_coefficients(problem, state, candidate) result(c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate     !! candidate with a neighbour after it
      real(wp) :: c(6), local(3, 2), h, gap(2), slope(2), second(2)
      integer :: e, side, there(2)
      e = problem%candidates%element(2, candidate)
      h = state%geometry%element(e)%length
      there = [candidate, problem%candidates%neighbour(2, candidate)]
      call local_forces(problem, state, e, local)
      do side = 1, 2
         call end_derivatives(problem, state, there(side), e, side, local(:, side), (local(1:2, 2) - local(1:2, 1)) / h, &
            & gap(side), slope(side), second(side))
      end do
      c = hermite_coefficients([gap(1), h * slope(1), h**2 * second(1), h * slope(2), h**2 * second(2), gap(2) - gap(1)])
   end function gap_coefficients

   !> Computes gap, slope and second derivative of the gap along the rod at one end of an element, by the stress-free length, from
   !> r' = (1 + e + N/EA) t + (Q/GA) nu, with position r, thermal strain e, normal force N along the tangent t and shear force Q
   !> along the normal nu.
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
      along = 1.0_wp + load%strain + local(1) * problem%compliance(e)%axial
      across = local(2) * shear
      d = along * t + across * nu
      slope = dot_product(normal, d)
      curvature = natural_curvature(state%geometry%element(e)) + load%curvature + local(3) * problem%compliance(e)%bending
      second = bend * (normal(2) * d(1) - normal(1) * d(2))**2 + &
         & dot_product(normal, (along * curvature + change(2) * shear) * nu + &
         & (change(1) * problem%compliance(e)%axial - across * curvature) * t)
   end subroutine end_derivatives

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
