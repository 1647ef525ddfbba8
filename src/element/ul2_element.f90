!> The element of Silveira & Goncalves (2001), section 3: two-node updated-Lagrangian beam-column, straight, without shear
!> flexibility.
!>
!> Natural (rigid-body-free) deformations are measured from the last converged configuration; their natural forces (N, M1, M2) are
!> added to those of that configuration. The tangent is K_L + K_tau, with an initial stress matrix consistent with these forces, so
!> that Newton's method converges quadratically. Element loads are lumped at the nodes. The element is of second order. The stored
!> forces are those of the whole deformation, thermal strain included; procedures that use them subtract the thermal part.
module ul2_element
   use kinds, only: wp
   use rod_load, only: ge_load_t, line_at_stage
   implicit none
   private
   public :: ul2_stress_stiffness, ul2_evaluate, ul2_forces, ul2_size, ul2_heat_scale

   !> Scale of forces as a part of the forces that would suppress thermal expansion: in a freely heated rod these forces cancel up
   !> to rounding.
   real(wp), parameter :: ul2_heat_scale = 1.0e-6_wp
   integer, parameter :: ul2_size = 3 !! number of stored natural forces of the whole deformation: N, M1, M2

contains

   !> Computes end forces and tangent; signs as in ge_element: f = (-n, -m) at the first node, (n, m) at the second.
   subroutine ul2_evaluate(h, chord, ea, ei, load, u, u_base, z_base, f, k, fl, z)
      real(wp), intent(in) :: h               !! stress-free length
      real(wp), intent(in) :: chord(2)        !! stress-free position of node 2 minus node 1
      real(wp), intent(in) :: ea, ei          !! axial stiffness EA; bending stiffness EI
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6)            !! present node displacements
      real(wp), intent(in) :: u_base(6)       !! node displacements at the last converged configuration
      real(wp), intent(in) :: z_base(3)       !! stored forces of the last converged configuration
      real(wp), intent(out) :: f(6), k(6, 6), fl(6) !! end forces; tangent; minus the derivative of f by the load factor
      real(wp), intent(out) :: z(3)           !! stored forces of the present configuration
      real(wp) :: force(3), d(2), d_base(2), change(2), l, l_base, e(2), stretch, turn, phi(2)
      real(wp) :: ba(6), bt(6), b1(6), b2(6), side(2), line(2), line_rate(2)
      integer :: i, j

      d_base = chord + u_base(4:5) - u_base(1:2)
      change = (u(4:5) - u_base(4:5)) - (u(1:2) - u_base(1:2))
      d = d_base + change
      l = norm2(d)
      l_base = norm2(d_base)
      e = d / l
      ! (l^2 - l_base^2)/(l + l_base), because nearly equal lengths would cancel in l - l_base.
      stretch = dot_product(change, 2.0_wp * d_base + change) / (l + l_base)
      turn = atan2(d_base(1) * d(2) - d_base(2) * d(1), dot_product(d_base, d))
      phi = [u(3) - u_base(3), u(6) - u_base(6)] - turn
      z(1) = z_base(1) + ea / h * stretch
      z(2) = z_base(2) + ei / h * (4.0_wp * phi(1) + 2.0_wp * phi(2))
      z(3) = z_base(3) + ei / h * (2.0_wp * phi(1) + 4.0_wp * phi(2))
      force = ul2_forces(ea, ei, load, z)

      ba = [-e(1), -e(2), 0.0_wp, e(1), e(2), 0.0_wp]               ! derivative of the stretch by u
      bt = [e(2), -e(1), 0.0_wp, -e(2), e(1), 0.0_wp] / l           ! derivative of the chord's rotation by u
      b1 = -bt
      b1(3) = b1(3) + 1.0_wp
      b2 = -bt
      b2(6) = b2(6) + 1.0_wp
      f = force(1) * ba + force(2) * b1 + force(3) * b2
      do j = 1, 6
         do i = 1, 6
            k(i, j) = ea / h * ba(i) * ba(j) &
               & + ei / h * (4.0_wp * (b1(i) * b1(j) + b2(i) * b2(j)) + 2.0_wp * (b1(i) * b2(j) + b2(i) * b1(j))) &
               & + force(1) * l * bt(i) * bt(j) + (force(2) + force(3)) / l * (ba(i) * bt(j) + bt(i) * ba(j))
         end do
      end do

      side = 0.5_wp * [-d(2), d(1)]
      call line_at_stage(load, 1, line, line_rate)
      f(1:2) = f(1:2) - 0.5_wp * h * line - load%pressure * side
      f(4:5) = f(4:5) - 0.5_wp * h * line - load%pressure * side
      fl = (ea * load%strain_rate) * ba - (ei * load%curvature_rate) * (b1 - b2)
      fl(1:2) = fl(1:2) + 0.5_wp * h * line_rate + load%pressure_rate * side
      fl(4:5) = fl(4:5) + 0.5_wp * h * line_rate + load%pressure_rate * side
      ! Symmetric part of the pressure's load stiffness; the skew part cancels between neighbouring elements.
      k(1, 5) = k(1, 5) + 0.5_wp * load%pressure
      k(5, 1) = k(5, 1) + 0.5_wp * load%pressure
      k(2, 4) = k(2, 4) - 0.5_wp * load%pressure
      k(4, 2) = k(4, 2) - 0.5_wp * load%pressure
   end subroutine ul2_evaluate

   !> Natural forces N, M1, M2 of the section: the stored forces of the whole deformation minus those of the thermal strain.
   pure function ul2_forces(ea, ei, load, z) result(force)
      real(wp), intent(in) :: ea, ei !! axial stiffness EA; bending stiffness EI
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: z(3)            !! stored natural forces of the whole deformation
      real(wp) :: force(3)
      force = z - [ea * load%strain, -ei * load%curvature, ei * load%curvature]
   end function ul2_forces

   !> Derivative of the tangent by a displacement increment, due to the axial force alone at fixed geometry, and due to the
   !> pressure. (Shear forces couple bending with extension, which is negligible in the buckling of nearly inextensible rods.)
   pure subroutine ul2_stress_stiffness(h, chord, ea, load, u, du, k)
      real(wp), intent(in) :: h, chord(2), ea !! stress-free length, chord, and axial stiffness, see ul2_evaluate
      type(ge_load_t), intent(in) :: load     !! load; its rates are derivatives by the factor of the increment
      real(wp), intent(in) :: u(6)            !! present node displacements
      real(wp), intent(in) :: du(6)           !! increment of the node displacements
      real(wp), intent(out) :: k(6, 6)        !! derivative of the tangent, symmetric
      real(wp) :: d(2), l, e(2), ba(6), bt(6), force
      integer :: i, j
      d = chord + u(4:5) - u(1:2)
      l = norm2(d)
      e = d / l
      ba = [-e(1), -e(2), 0.0_wp, e(1), e(2), 0.0_wp]
      bt = [e(2), -e(1), 0.0_wp, -e(2), e(1), 0.0_wp] / l
      force = ea / h * dot_product(ba, du) - ea * load%strain_rate
      do j = 1, 6
         do i = 1, 6
            k(i, j) = force * l * bt(i) * bt(j)
         end do
      end do
      k(1, 5) = k(1, 5) + 0.5_wp * load%pressure_rate
      k(5, 1) = k(5, 1) + 0.5_wp * load%pressure_rate
      k(2, 4) = k(2, 4) - 0.5_wp * load%pressure_rate
      k(4, 2) = k(4, 2) - 0.5_wp * load%pressure_rate
   end subroutine ul2_stress_stiffness
end module ul2_element
