!> Linearised equations at the stages of a geometrically exact element, and their solution: the increments at the stages as linear
!> functions of the increments at the first end. Notation and equations are those of ge_element.
module ge_equations
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages
   use small_dense, only: solve_small
   use ge_stages, only: ge_stages_t, press_section, ge_data_t
   use rod_load, only: inner_forces_t
   implicit none
   private
   public :: solve_stages, by_rotation, by_nx, by_ny, by_m, by_residual, by_load, by_x, by_y, n_by

   !> Columns of these linear functions: rotation, n and m at the first end, residual, load factor, position of the first node.
   integer, parameter :: by_rotation = 1, by_nx = 2, by_ny = 3, by_m = 4, by_residual = 5, by_load = 6, by_x = 7, by_y = 8, n_by = 8
   real(wp), parameter :: moment_rounding = 8.0_wp * epsilon(1.0_wp) !! relative rounding error of a moment, which is a sum of eight
   !! products of force and length

contains

   !> Solves for the increments of m, of n if it is stored, and of the pressures of foundations, at the stages.
   subroutine solve_stages(tab, element, stages, inner, change, defect, singular)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      type(ge_stages_t), intent(in) :: stages
      type(inner_forces_t), intent(in) :: inner !! forces of foundations; if there are any, z must contain n at the stages
      real(wp), contiguous, intent(out) :: change(:, :) !! (n_by, unknowns) increments; stored unknowns but the first three, then
      !! one for each quadrature point of `inner`
      real(wp), intent(out) :: defect          !! largest residual, as a rotation
      logical, intent(out) :: singular         !! true: a pivot was zero, and the increments are undefined
      real(wp) :: system(size(change, 2), size(change, 2)), row_weight(size(change, 2)) ! columns are equations, see solve_small
      integer :: s, stored_by, unknowns
      s = stages%s
      stored_by = s
      if (stages%stored) stored_by = 3 * s
      unknowns = stored_by + inner%n
      system = 0.0_wp
      change = 0.0_wp
      ! Weight of force equations relative to moment equations: a force times h is a moment, a pressure times h**2 is a moment.
      row_weight(:s) = 1.0_wp
      row_weight(s + 1:stored_by) = stages%h
      row_weight(stored_by + 1:) = stages%h**2
      call add_moment_rows()
      if (stages%stored) call add_force_rows()
      call add_foundation()
      call find_defect()
      call solve_small(unknowns, system, change, singular, row_weight)

   contains

      !> Adds the equations m_i = m_1 - integral of r' x n between the first end and stage i.
      subroutine add_moment_rows()
         integer :: i, j
         real(wp) :: part
         do i = 1, s
            system(i, i) = 1.0_wp
            change(by_m, i) = 1.0_wp
            change(by_residual, i) = element%z(3) - element%z(3 + i)
            do j = 1, s
               part = stages%hc * tab%a(i, j)
               change(by_rotation, i) = change(by_rotation, i) + part * stages%g_phi(j)
               change(by_residual, i) = change(by_residual, i) + part * stages%g(j)
               change(by_load, i) = change(by_load, i) + part * stages%g_heat(j)
               system(:s, i) = system(:s, i) - (part * stages%g_phi(j)) * stages%turn(:s, j)
               if (stages%stored) then
                  system(s + 2 * j - 1:s + 2 * j, i) = part * stages%d(:, j)
               else
                  change(by_nx:by_ny, i) = change(by_nx:by_ny, i) - part * stages%d(:, j)
                  change(by_load, i) = change(by_load, i) + part * dot_product(stages%d(:, j), stages%drop_rate(:, j))
               end if
            end do
         end do
      end subroutine add_moment_rows

      !> Adds the equations n_i = n_1 - dead load - pressure between the first end and stage i.
      subroutine add_force_rows()
         real(wp) :: pushed(2), pushed_rate(2), by_slope(2, 2, max_stages), by_shift(2, 2)
         integer :: row, a, b, i
         do a = 1, s
            row = s + 2 * a - 1
            system(row, row) = 1.0_wp
            system(row + 1, row + 1) = 1.0_wp
            change(by_nx, row) = 1.0_wp
            change(by_ny, row + 1) = 1.0_wp
            change(by_residual, row:row + 1) = element%z(1:2) - stages%nn(:, a) - stages%drop(:, a)
            change(by_load, row:row + 1) = -stages%drop_rate(:, a)
            if (.not. stages%pressed) cycle
            call press_section(tab, element, stages, tab%a(a, :), pushed, pushed_rate, by_slope, by_shift)
            do i = 1, 2
               associate (line => row + i - 1)
                  change(by_residual, line) = change(by_residual, line) - pushed(i)
                  change(by_load, line) = change(by_load, line) - pushed_rate(i)
                  change(by_x:by_y, line) = change(by_x:by_y, line) - by_shift(i, :)
                  do b = 1, s
                     associate (w => by_slope(i, :, b), d => stages%d(:, b))
                        change(by_rotation, line) = change(by_rotation, line) - dot_product(w, d)
                        change(by_load, line) = change(by_load, line) - dot_product(w, stages%heat(:, b))
                        system(:s, line) = system(:s, line) + dot_product(w, d) * stages%turn(:s, b)
                        system(s + 2 * b - 1, line) = system(s + 2 * b - 1, line) + dot_product(w, stages%bnn(1:2, b))
                        system(s + 2 * b, line) = system(s + 2 * b, line) + dot_product(w, stages%bnn(2:3, b))
                     end associate
                  end do
               end associate
            end do
         end do
      end subroutine add_force_rows

      !> Adds the forces of foundations to the equations of n, and one equation for the pressure at each quadrature point: dp +
      !> spring * normal.dx = spring * approach * dl. If the pressures were substituted into the equations of n, motions without
      !> resistance, such as sliding along a stiff foundation, would be lost to cancellation.
      subroutine add_foundation()
         ! Displacement of the quadrature point: by_x, by_y, swing * rotation 1, along * (dm, dn), heated * dl.
         real(wp) :: swing(2), along(3 * max_stages, 2), turned(3 * max_stages, 2), heated(2), part, share(max_stages)
         integer :: row, a, b, q, i
         do q = 1, inner%n
            along(:s, :) = 0.0_wp
            swing = 0.0_wp
            heated = 0.0_wp
            do b = 1, s
               part = stages%hc * inner%at(q)%basis(b)
               heated = heated + part * stages%heat(:, b)
               swing = swing + part * stages%d(:, b)
               do i = 1, 2
                  along(:s, i) = along(:s, i) + (part * stages%d(i, b)) * stages%turn(:s, b)
                  along(s + 2 * b - 1:s + 2 * b, i) = part * stages%bnn(i:i + 1, b)
               end do
            end do
            row = stored_by + q
            associate (normal => inner%at(q)%normal, spring => inner%at(q)%spring)
               system(row, row) = 1.0_wp
               system(:3 * s, row) = spring * (normal(1) * along(:3 * s, 1) + normal(2) * along(:3 * s, 2))
               change(by_rotation, row) = -spring * dot_product(normal, swing)
               change(by_x:by_y, row) = -spring * normal
               change(by_load, row) = spring * (inner%at(q)%approach - dot_product(normal, heated))
            end associate
            associate (sway => inner%at(q)%sway)
               heated = matmul(sway, heated)
               do a = 1, s
                  row = s + 2 * a - 1
                  share(a) = stages%h * inner%at(q)%weight * (1.0_wp - inner%at(q)%basis(a) / tab%b(a))
                  system(stored_by + q, row:row + 1) = share(a) * inner%at(q)%normal
                  change(by_residual, row:row + 1) = change(by_residual, row:row + 1) - share(a) * inner%at(q)%force
                  change(by_load, row:row + 1) = change(by_load, row:row + 1) + share(a) * (heated - inner%at(q)%rate)
               end do
               ! Straight ground turns no force when the point moves along it.
               if (.not. any(abs(sway) > 0.0_wp)) cycle
               swing = matmul(sway, swing)
               do i = 1, 2
                  turned(:3 * s, i) = sway(i, 1) * along(:3 * s, 1) + sway(i, 2) * along(:3 * s, 2)
               end do
               do a = 1, s
                  row = s + 2 * a - 1
                  system(:3 * s, row:row + 1) = system(:3 * s, row:row + 1) - share(a) * turned(:3 * s, :)
                  change(by_rotation, row:row + 1) = change(by_rotation, row:row + 1) + share(a) * swing
                  change(by_x:by_y, row:row + 1) = change(by_x:by_y, row:row + 1) + share(a) * sway
               end do
            end associate
         end do
      end subroutine add_foundation

      !> Residuals of moments and forces, expressed as the rotations that they cause over the length of the element.
      subroutine find_defect()
         real(wp) :: rounding, give
         give = stages%h * maxval(stages%bending(:s))
         ! The rounding error of products of force and length enters the moments and would strongly rotate a taut rod of very small
         ! EI. The defect is reduced by this rounding error, and by no other one.
         rounding = moment_rounding * maxval(abs(stages%nn(:, :s))) * stages%h
         defect = max(0.0_wp, (maxval(abs(change(by_residual, :s))) - rounding) * give)
         if (stages%stored) defect = max(defect, maxval(abs(change(by_residual, s + 1:3 * s))) * stages%hc * give)
      end subroutine find_defect
   end subroutine solve_stages
end module ge_equations
