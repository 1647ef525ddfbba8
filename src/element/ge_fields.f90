!> Section forces, positions and rotations between the nodes of the geometrically exact element, from its stored unknowns. Notation
!> and equations are those of ge_element.
module ge_fields
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages, stage_basis
   use rod_load, only: sum_line, inner_forces_t
   use ge_stages, only: ge_directions, find_stage_force, ge_data_t
   implicit none
   private
   public :: ge_end_forces, ge_between, ge_rotation

contains

   !> Computes n and m at both ends from the stored unknowns without condensation, in global axes.
   pure subroutine ge_end_forces(tab, element, first, second, inner, rho)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      real(wp), intent(out) :: first(3), second(3) !! (n_x, n_y, m) at the first and at the second end
      type(inner_forces_t), intent(in), optional :: inner
      real(wp), intent(in), optional :: rho(2, max_stages) !! (2, stages) result of ge_directions, if it is known
      real(wp) :: span(2)
      integer :: q
      first = element%z(1:3)
      if (present(rho)) then
         call sum_part(tab, element, rho, tab%b, span, second)
      else
         call sum_part(tab, element, ge_directions(tab, element), tab%b, span, second)
      end if
      if (.not. present(inner)) return
      do q = 1, inner%n
         second(1:2) = second(1:2) - (element%g%length * inner%at(q)%weight) * inner%at(q)%force
      end do
   end subroutine ge_end_forces

   !> Rotation at a place of an element.
   pure real(wp) function ge_rotation(tab, element, tau) result(rotation)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      real(wp), intent(in) :: tau              !! place in the element, 0 to 1 of its stress-free length
      real(wp) :: basis(max_stages)
      call stage_basis(tab, tau, basis)
      associate (s => tab%stages, h => element%g%length, compliance => element%compliance)
         rotation = element%u(3) + h * compliance%bending * dot_product(basis(:s) * compliance%part(2, :s), element%z(4:3 + s)) + &
            & (tau * h) * element%load%curvature
      end associate
   end function ge_rotation

   !> Position and section forces of the collocation inside an element. n does not contain the forces of foundations along the
   !> element.
   pure subroutine ge_between(tab, element, rho, tau, span, resultant)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      real(wp), intent(in) :: rho(2, max_stages) !! (2, stages) directions rho at the stages, from ge_directions
      real(wp), intent(in) :: tau              !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(out) :: span(2)         !! deformed position minus deformed position of the first node
      real(wp), intent(out) :: resultant(3)    !! (n_x, n_y, m) at the place
      real(wp) :: basis(max_stages)
      call stage_basis(tab, tau, basis)
      call sum_part(tab, element, rho, basis, span, resultant)
   end subroutine ge_between

   !> Computes the results of ge_between for given quadrature weights of the part of the element before the point.
   pure subroutine sum_part(tab, element, rho, weight, span, resultant)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      real(wp), intent(in) :: rho(2, max_stages)
      real(wp), intent(in) :: weight(max_stages) !! (stages) quadrature weights of this part of the element
      real(wp), intent(out) :: span(2), resultant(3)
      real(wp) :: nn(2), rate(2), pressure, step(2), scaled
      logical :: graded
      integer :: i, s
      s = tab%stages
      scaled = element%g%length * element%g%scale
      span = 0.0_wp
      graded = any(abs(element%load%gradient) > 0.0_wp)
      resultant = element%z(1:3)
      call sum_line(tab, element%load, weight, nn, rate)
      resultant(1:2) = resultant(1:2) - element%g%length * nn
      do i = 1, s
         step = (scaled * weight(i)) * rho(:, i)
         call find_stage_force(tab, element, i, nn)
         span = span + step
         resultant(3) = resultant(3) - (step(1) * nn(2) - step(2) * nn(1))
         pressure = element%load%pressure
         if (graded) pressure = pressure + scaled * dot_product(element%load%gradient, way_to(i))
         resultant(1:2) = resultant(1:2) - pressure * [-step(2), step(1)]
      end do

   contains

      !> Position of a stage relative to the first node, over the length and C.
      pure function way_to(i) result(way)
         integer, intent(in) :: i
         real(wp) :: way(2)
         way = matmul(rho(:, :s), tab%a(i, :s))
      end function way_to
   end subroutine sum_part
end module ge_fields
