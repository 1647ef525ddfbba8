!> Dense output of the geometrically exact element: section forces, positions and rotations between its nodes, from the stored
!> unknowns. The equations are those of ge_element.
module ge_fields
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages, stage_basis
   use rod_load, only: ge_load_t, sum_line
   use rod_compliance, only: ge_stiffness_t
   use ge_stages, only: ge_directions, stage_force
   use inner_forces, only: inner_forces_t
   implicit none
   private
   public :: ge_end_forces, ge_interior, ge_between, ge_rotation

contains

   !> n and m at both ends from the stored unknowns without condensation, in global axes.
   pure subroutine ge_end_forces(tab, h, scale, tangent, compliance, load, u, z, first, second, inner)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      real(wp), intent(in) :: tangent(:, :)    !! (2, at least stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)           !! as in ge_evaluate
      real(wp), intent(out) :: first(3), second(3) !! (n_x, n_y, m)
      type(inner_forces_t), intent(in), optional :: inner
      real(wp) :: rho(2, max_stages), span(2)
      integer :: q
      first = z(1:3)
      call ge_directions(tab, h, tangent, compliance, load, u, z, rho)
      call sum_part(tab, h, scale, load, z, rho, tab%b, span, second)
      if (.not. present(inner)) return
      do q = 1, inner%n
         second(1:2) = second(1:2) - (h * inner%weight(q)) * inner%force(:, q)
      end do
   end subroutine ge_end_forces

   !> Dense output of the collocation inside an element. n does not contain the forces of foundations along the element.
   pure subroutine ge_interior(tab, h, scale, tangent, compliance, load, u, z, tau, span, rotation, resultant)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      real(wp), intent(in) :: tangent(:, :)    !! (2, at least stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)       !! as in ge_evaluate
      real(wp), intent(in) :: tau              !! position, 0 to 1 of the stress-free length
      real(wp), intent(out) :: span(2)         !! deformed position minus that of the first node
      real(wp), intent(out) :: rotation        !! rotation at the place
      real(wp), intent(out) :: resultant(3)    !! (n_x, n_y, m) at the place
      real(wp) :: rho(2, max_stages)
      call ge_directions(tab, h, tangent, compliance, load, u, z, rho)
      call ge_between(tab, h, scale, load, z, rho, tau, span, resultant)
      rotation = ge_rotation(tab, h, compliance, load, u, z, tau)
   end subroutine ge_interior

   !> Rotation at a place of an element.
   pure real(wp) function ge_rotation(tab, h, compliance, load, u, z, tau) result(rotation)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)
      real(wp), intent(in) :: tau
      real(wp) :: basis(max_stages)
      call stage_basis(tab, tau, basis)
      associate (s => tab%stages)
         rotation = u(3) + h * compliance%bending * dot_product(basis(:s) * compliance%part(2, :s), z(4:3 + s)) + &
            & (tau * h) * load%curvature
      end associate
   end function ge_rotation

   !> As ge_interior, with the directions rho at the stages given, for many places of one element.
   pure subroutine ge_between(tab, h, scale, load, z, rho, tau, span, resultant)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: z(:)             !! (ge_size) stored unknowns
      real(wp), intent(in) :: rho(:, :)        !! (2, at least stages) directions from ge_directions
      real(wp), intent(in) :: tau              !! position, 0 to 1
      real(wp), intent(out) :: span(2), resultant(3) !! as in ge_interior
      real(wp) :: basis(max_stages)
      call stage_basis(tab, tau, basis)
      call sum_part(tab, h, scale, load, z, rho, basis, span, resultant)
   end subroutine ge_between

   !> The same as ge_between, with the quadrature weights given for the part of the element before the point.
   pure subroutine sum_part(tab, h, scale, load, z, rho, weight, span, resultant)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: rho(:, :)
      real(wp), intent(in) :: weight(max_stages) !! (stages)
      real(wp), intent(out) :: span(2), resultant(3)
      real(wp) :: nn(2), rate(2), pressure, step(2)
      logical :: graded
      integer :: i, s
      s = tab%stages
      span = 0.0_wp
      graded = any(abs(load%gradient) > 0.0_wp)
      resultant = z(1:3)
      call sum_line(tab, load, weight, nn, rate)
      resultant(1:2) = resultant(1:2) - h * nn
      do i = 1, s
         step = (h * scale * weight(i)) * rho(:, i)
         nn = stage_force(tab, h, load, z, i)
         span = span + step
         resultant(3) = resultant(3) - (step(1) * nn(2) - step(2) * nn(1))
         pressure = load%pressure
         if (graded) pressure = pressure + (h * scale) * dot_product(load%gradient, matmul(rho(:, :s), tab%a(i, :s)))
         resultant(1:2) = resultant(1:2) - pressure * [-step(2), step(1)]
      end do
   end subroutine sum_part
end module ge_fields
