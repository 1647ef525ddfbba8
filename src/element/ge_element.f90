!> The geometrically exact rod element: Gauss collocation of the rod equations between two nodes, order 2 to 8.
!>
!>   r' = C [(1 + e + N/EA) t + (Q/GA) nu] N = n.t, Q = n.nu, t at the angle (stress-free angle + rotation)
!>   rotation' = k + m/EI                   n' = -q - p J r' - f(r)     m' = -r' x n
!>
!> ' is the derivative by the stress-free length. r: position; n, m: force and moment of the section, with the components N along
!> the section's normal t and Q along nu, a quarter turn to the left of t; q: dead load per unit stress-free length, given at the
!> stages; p: follower pressure per deformed length, linear in the position; EA, EI, GA: given at the stages, too; J: a quarter
!> turn anticlockwise; e, k: thermal strain and curvature of the unstressed rod;
!> f: force of foundations per unit stress-free length, a function of the position. Its quadrature points may be anywhere in the
!> element (contact may end inside): the stages take n_i = n_1 - ... - h sum_q w_q (1 - A_i(tau_q)/b_i) f_q, A_i the integral of the
!> Lagrange polynomial, as the virtual work of f_q requires; with the Gauss points this is the collocation itself.
!> C = 1 + O(h^2s) makes the stress-free shape an exact discrete solution (see rod_geometry).
!>
!> With one stage the bending flexibility of a shear-rigid element would be singular; MacNeal's residual bending
!> flexibility h^2/12EI is added to 1/GA there (R. H. MacNeal, Comput. & Struct. 8 (1978) 175-183): still order 2.
!>
!> The section forces are stored unknowns z = (n_x, n_y, m at the first end, m at the stages [, n at the stages if there is pressure
!> or a foundation]). They are condensed out here. N is never computed as EA times a difference of coordinates, so that there is
!> neither locking nor cancellation for large EA. As Gauss collocation is symplectic, the condensed tangent is symmetric.
module ge_element
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages
   use small_dense, only: solve_small
   use rod_load, only: sum_line, inner_forces_t
   use ge_stages, only: ge_stages_t, find_stages, press_section, ge_data_t
   use ge_equations, only: solve_stages, by_rotation, by_nx, by_ny, by_m, by_residual, by_load, by_x, by_y, n_by
   implicit none
   private
   public :: ge_evaluate, ge_size, ge_columns

   integer, parameter :: ge_columns = 8 !! number of columns of the update operator: six node displacements, residual, load factor

contains

   !> Number of stored unknowns of an element.
   pure integer function ge_size(stages, loaded)
      integer, intent(in) :: stages
      logical, intent(in) :: loaded          !! true: pressure or a foundation acts on the element
      ge_size = 3 + stages
      if (loaded) ge_size = ge_size + 2 * stages
   end function ge_size

   !> Computes the forces at both ends, the condensed tangent, and the operator that updates the stored unknowns.
   !>
   !> Sign: f = (-n, -m) at the first node and (n, m) at the second, so that in equilibrium the sum over elements minus the node
   !> loads vanishes. With the increments du of the six node displacements and dl of the load factor,
   !>   f + k du - fl dl   are the end forces after one Newton step,   z + op (du, 1, dl)   the stored unknowns.
   subroutine ge_evaluate(tab, element, inner, f, raw, k, shift, fl, op, defect, ok, more_force)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      type(inner_forces_t), intent(in) :: inner !! forces of foundations; if there are any, z must contain n at the stages
      real(wp), intent(out) :: f(6)            !! condensed end forces: internal residuals eliminated
      real(wp), intent(out) :: raw(6)          !! end forces from the stored unknowns, without rounding errors multiplied by EA
      real(wp), intent(out) :: k(6, 6)         !! condensed tangent, symmetric
      real(wp), intent(out) :: shift(6, 2)     !! k times a unit translation in x and in y; not zero only if a foundation acts
      real(wp), intent(out) :: fl(6)           !! minus the derivative of f by the load factor
      real(wp), intent(out) :: op(:, :)        !! (ge_size, ge_columns) update operator of z
      real(wp), intent(out) :: defect(2)       !! largest internal residual: of rotation [rad] and of position
      logical, intent(out) :: ok               !! false: the internal system is singular; the other results are then undefined
      real(wp), intent(in), optional :: more_force(:, :) !! (2, stages) additional n that enters the geometric stiffness but not the
      !! residuals

      type(ge_stages_t) :: stages
      real(wp) :: change(n_by, element%unknowns - 3 + inner%n) ! increments at the stages as linear functions of the columns, see
      ! ge_equations
      real(wp) :: dend(n_by, 3), dtail(n_by, 3), end_defect(3), tail(3), flexibility(3, 3), end_weight(3)
      real(wp), dimension(ge_columns + 2, 3) :: ends, tails
      integer :: s
      logical :: anchored, singular

      s = tab%stages
      ! Forces that depend on the position resist a translation of the element.
      anchored = inner%n > 0 .or. any(abs(element%load%gradient) > 0.0_wp)
      call find_stages(tab, element, stages, more_force)
      call solve_stages(tab, element, stages, inner, change, defect(1), singular)
      if (.not. singular) then
         call go_to_second_end()
         call set_up_end_conditions()
         end_weight = [1.0_wp, 1.0_wp, element%g%length]
         call solve_small(3, flexibility, ends, singular, end_weight)
      end if
      ok = .not. singular
      shift = 0.0_wp
      if (ok) then
         call condense()
      else
         f = 0.0_wp; raw = 0.0_wp; k = 0.0_wp; fl = 0.0_wp; op = 0.0_wp
      end if

   contains

      !> Increments of position and rotation (dend) and of n and m (dtail) at the second end, as linear functions of the columns:
      !> increments of rotation, n and m at the first end, 1, increment of the load factor.
      subroutine go_to_second_end()
         real(wp) :: rate(n_by, 3, max_stages) ! derivatives of r'/C and m'/C at the stages by the columns
         real(wp) :: drop(2), drop_rate(2), dphi(n_by), dn(n_by, 2), moved(n_by, 2), pull(n_by, 2), part
         real(wp) :: pushed(2), pushed_rate(2), by_slope(2, 2, max_stages), by_shift(2, 2)
         integer :: i, l, q
         call sum_line(tab, element%load, tab%b, drop, drop_rate)
         dend = 0.0_wp
         dtail = 0.0_wp
         dend(by_rotation, 3) = 1.0_wp
         dtail(by_nx, 1) = 1.0_wp
         dtail(by_ny, 2) = 1.0_wp
         dtail(by_m, 3) = 1.0_wp
         dtail(by_load, 1:2) = -stages%h * drop_rate
         dend(by_load, 3) = stages%h * element%load%curvature_rate
         ! Differences of displacements have smaller rounding errors than differences of positions. The factor C makes the
         ! stress-free element close exactly.
         end_defect = [element%u(4:5) - element%u(1:2), element%u(6) - element%u(3) - stages%h * element%load%curvature]
         tail = element%z(1:3)
         tail(1:2) = tail(1:2) - stages%h * drop
         do i = 1, s
            dphi = 0.0_wp
            dphi(by_rotation) = 1.0_wp
            do l = 1, s
               dphi = dphi + stages%turn(l, i) * change(:, l)
            end do
            if (stages%stored) then
               dn = change(:, s + 2 * i - 1:s + 2 * i)
            else
               dn = 0.0_wp
               dn(by_nx, 1) = 1.0_wp
               dn(by_ny, 2) = 1.0_wp
               dn(by_load, :) = -stages%drop_rate(:, i)
            end if
            associate (d => stages%d(:, i), bnn => stages%bnn(:, i))
               rate(:, 1, i) = d(1) * dphi + bnn(1) * dn(:, 1) + bnn(2) * dn(:, 2)
               rate(:, 2, i) = d(2) * dphi + bnn(2) * dn(:, 1) + bnn(3) * dn(:, 2)
               rate(:, 3, i) = stages%g_phi(i) * dphi - d(1) * dn(:, 1) - d(2) * dn(:, 2)
            end associate
            rate(by_load, 1:2, i) = rate(by_load, 1:2, i) + stages%heat(:, i)
            rate(by_load, 3, i) = rate(by_load, 3, i) + stages%g_heat(i)
            part = stages%hc * tab%b(i)
            dend(:, 1:2) = dend(:, 1:2) + part * rate(:, 1:2, i)
            dtail(:, 3) = dtail(:, 3) + part * rate(:, 3, i)
            end_defect(1:2) = end_defect(1:2) - part * stages%change(:, i)
            tail(3) = tail(3) + part * stages%g(i)
            part = stages%h * stages%bending(i) * tab%b(i)
            dend(:, 3) = dend(:, 3) + part * change(:, i)
            end_defect(3) = end_defect(3) - part * element%z(3 + i)
         end do
         if (stages%pressed) then
            call press_section(tab, element, stages, tab%b, pushed, pushed_rate, by_slope, by_shift)
            tail(1:2) = tail(1:2) - pushed
            do i = 1, s
               dtail(:, 1:2) = dtail(:, 1:2) - matmul(rate(:, 1:2, i), transpose(by_slope(:, :, i)))
            end do
            dtail(by_x:by_y, 1:2) = dtail(by_x:by_y, 1:2) - transpose(by_shift)
            dtail(by_load, 1:2) = dtail(by_load, 1:2) - pushed_rate
         end if
         do q = 1, inner%n
            part = stages%h * inner%at(q)%weight
            tail(1:2) = tail(1:2) - part * inner%at(q)%force
            do i = 1, 2
               pull(:, i) = -inner%at(q)%normal(i) * change(:, size(change, 2) - inner%n + q)
            end do
            if (any(abs(inner%at(q)%sway) > 0.0_wp)) then
               ! Increment of the position of the quadrature point, as a linear function of the columns.
               moved = 0.0_wp
               moved(by_x, 1) = 1.0_wp
               moved(by_y, 2) = 1.0_wp
               do i = 1, s
                  moved = moved + (stages%hc * inner%at(q)%basis(i)) * rate(:, 1:2, i)
               end do
               do i = 1, 2
                  pull(:, i) = pull(:, i) + (inner%at(q)%sway(i, 1) * moved(:, 1) + inner%at(q)%sway(i, 2) * moved(:, 2))
               end do
            end if
            dtail(:, 1:2) = dtail(:, 1:2) + part * pull
            dtail(by_load, 1:2) = dtail(by_load, 1:2) - part * inner%at(q)%rate
         end do
         defect(1) = max(defect(1), abs(end_defect(3)))
         defect(2) = max(abs(end_defect(1)), abs(end_defect(2)))
      end subroutine go_to_second_end

      !> Sets up the conditions at the second end, whose solution is the increment of n and m at the first end.
      subroutine set_up_end_conditions()
         integer :: i
         flexibility = dend(by_nx:by_m, :)
         if (element%compliance%give > 0.0_wp) then
            do i = 1, s
               associate (t => stages%t(:, i), part => stages%hc * tab%b(i) * element%compliance%give)
                  flexibility(1, 1:2) = flexibility(1, 1:2) + (part * t(1)) * t
                  flexibility(2, 1:2) = flexibility(2, 1:2) + (part * t(2)) * t
               end associate
            end do
         end if
         ends = 0.0_wp
         do i = 1, 3
            ends(i, i) = -1.0_wp
            ends(i + 3, i) = 1.0_wp
         end do
         ! dend(by_rotation, 3) contains the rotation of the first end itself, which is no part of the difference of the end
         ! rotations.
         ends(3, 1:2) = ends(3, 1:2) - dend(by_rotation, 1:2)
         ends(3, 3) = -dend(by_rotation, 3)
         ends(7, :) = end_defect - dend(by_residual, :)
         ends(8, :) = -dend(by_load, :)
         if (anchored) then
            ! Columns of a translation of the first node, and of the whole element.
            ends(1:2, :) = ends(1:2, :) - dend(by_x:by_y, :)
            ends(ge_columns + 1:, :) = -dend(by_x:by_y, :)
         end if
      end subroutine set_up_end_conditions

      !> Computes end forces, tangent and the update operator from the increments at the first end.
      subroutine condense()
         integer :: i, l
         op(1:3, :) = transpose(ends(:ge_columns, :))
         do l = 1, element%unknowns - 3
            op(3 + l, :) = change(by_nx, l) * ends(:ge_columns, 1) + change(by_ny, l) * ends(:ge_columns, 2) + &
               & change(by_m, l) * ends(:ge_columns, 3)
            op(3 + l, 3) = op(3 + l, 3) + change(by_rotation, l)
            if (anchored) op(3 + l, 1:2) = op(3 + l, 1:2) + change(by_x:by_y, l)
            op(3 + l, 7:8) = op(3 + l, 7:8) + change(by_residual:by_load, l)
         end do
         do i = 1, 3
            tails(:, i) = dtail(by_nx, i) * ends(:, 1) + dtail(by_ny, i) * ends(:, 2) + dtail(by_m, i) * ends(:, 3)
         end do

         k(1:3, :) = -transpose(ends(:6, :))
         k(4:6, :) = transpose(tails(:6, :))
         k(4:6, 3) = k(4:6, 3) + dtail(by_rotation, :)
         if (anchored) then
            k(4:6, 1:2) = k(4:6, 1:2) + transpose(dtail(by_x:by_y, :))
            shift(1:3, :) = -transpose(ends(ge_columns + 1:, :))
            shift(4:6, :) = transpose(tails(ge_columns + 1:, :) + dtail(by_x:by_y, :))
         end if
         raw(1:3) = -element%z(1:3)
         raw(4:6) = tail
         f(1:3) = -element%z(1:3) - ends(7, :)
         f(4:6) = tail + tails(7, :) + dtail(by_residual, :)
         fl(1:3) = ends(8, :)
         fl(4:6) = -tails(8, :) - dtail(by_load, :)
         ! Pressure gives a skew-symmetric part that cancels between neighbouring elements; without it the band matrix is symmetric.
         if (stages%stored) k = 0.5_wp * (k + transpose(k))
      end subroutine condense
   end subroutine ge_evaluate
end module ge_element
