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
!> The resultants are stored unknowns z = (n_x, n_y, m at the first end, m at the stages [, n at the stages if there is pressure or
!> a foundation]), condensed out here, so that N never comes from EA times a difference of coordinates: there is neither locking nor
!> cancellation for large EA. Gauss collocation is symplectic, hence the condensed tangent is symmetric.
module ge_element
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages, stage_basis
   use small_dense, only: solve_small
   use inner_forces, only: inner_forces_t
   implicit none
   private
   public :: ge_compliance, forbid_stretch, ge_stiffness_t, ge_load_t, ge_evaluate, ge_end_forces, ge_interior, ge_between, &
      & ge_directions, ge_direction_changes, ge_direction_rates, ge_size, ge_columns, line_at

   integer, parameter :: ge_columns = 8 !! columns of the update operator: six node displacements, residual, load factor

   !> Compliances; zero means rigid. Of a section that varies along the element these are the values at its middle, for scales.
   type :: ge_stiffness_t
      real(wp) :: axial = 0.0_wp   !! 1/EA
      real(wp) :: bending = 0.0_wp !! 1/EI
      real(wp) :: shear = 0.0_wp   !! 1/GA, exactly zero for shear-rigid rods
      real(wp) :: part(3, max_stages) = 1.0_wp !! axial, bending and shear compliance at the stages over those above
      real(wp) :: give = 0.0_wp    !! axial compliance of the tangent of an inextensible element (1/EA = 0), which would be singular
      !! for a straight one
   end type ge_stiffness_t

   !> Element load at the present load factor, and its derivative by the load factor.
   type :: ge_load_t
      real(wp) :: line(2, max_stages) = 0.0_wp, line_rate(2, max_stages) = 0.0_wp !! q at the stages; without stages at the first
      logical :: uniform = .true.                             !! true: q is the same at all stages
      real(wp) :: pressure = 0.0_wp, pressure_rate = 0.0_wp   !! p at the deformed position of the first node
      real(wp) :: gradient(2) = 0.0_wp, gradient_rate(2) = 0.0_wp !! derivative of p by the deformed position
      real(wp) :: strain = 0.0_wp, strain_rate = 0.0_wp       !! thermal strain e of the unstressed rod
      real(wp) :: curvature = 0.0_wp, curvature_rate = 0.0_wp !! thermal curvature k of the unstressed rod
   end type ge_load_t

   real(wp), parameter :: moment_rounding = 8.0_wp * epsilon(1.0_wp) !! relative rounding error of a moment, as a sum of eight
   !! products of force and length

   ! Columns of the local linearisation before condensation.
   integer, parameter :: by_rotation = 1, by_nx = 2, by_ny = 3, by_m = 4, by_residual = 5, by_load = 6, &
      & by_x = 7, by_y = 8, n_by = 8

contains

   !> Number of stored unknowns of an element.
   pure integer function ge_size(stages, loaded)
      integer, intent(in) :: stages
      logical, intent(in) :: loaded          !! true: by pressure or a foundation
      ge_size = 3 + stages
      if (loaded) ge_size = ge_size + 2 * stages
   end function ge_size

   !> Compliances of an element with the stiffnesses EA, EI and, if it shears, GA.
   pure function ge_compliance(stages, h, ea, ei, ga, shear_rigid) result(compliance)
      integer, intent(in) :: stages
      real(wp), intent(in) :: h, ea, ei, ga
      logical, intent(in) :: shear_rigid      !! true: the element does not shear, and GA is not used
      type(ge_stiffness_t) :: compliance
      compliance%axial = 1.0_wp / ea
      compliance%bending = 1.0_wp / ei
      if (.not. shear_rigid) compliance%shear = 1.0_wp / ga
      if (stages == 1) compliance%shear = compliance%shear + h**2 / (12.0_wp * ei)
   end function ge_compliance

   !> Makes an element inextensible. The tangent keeps an axial compliance, size**2/EI times the root of the rounding unit: the
   !> rounding error multiplied by the remaining stiffness, and the artificial extension left in a solution, are then equally small.
   pure subroutine forbid_stretch(compliance, size)
      type(ge_stiffness_t), intent(inout) :: compliance
      real(wp), intent(in) :: size             !! size of the structure [length]
      compliance%axial = 0.0_wp
      compliance%give = sqrt(epsilon(size)) * size**2 * compliance%bending
   end subroutine forbid_stretch

   !> Forces at both ends, condensed tangent and the operator that updates the stored unknowns.
   !>
   !> Sign: f = (-n, -m) at the first node and (n, m) at the second, so that the sum over elements minus the node loads
   !> vanishes in equilibrium. With du the six node displacement increments and dl that of the load factor,
   !>   f + k du - fl dl   are the end forces after one Newton step,   z + op (du, 1, dl)   the stored unknowns.
   subroutine ge_evaluate(tab, h, scale, angle, tangent, compliance, load, u, z, f, raw, k, fl, op, defect, ok, more_force, &
      & inner, shift)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h                !! stress-free length
      real(wp), intent(in) :: scale            !! C, see the module header
      real(wp), intent(in) :: angle(:)         !! (stages) stress-free tangent angle at the stages [rad]
      real(wp), intent(in) :: tangent(:, :)    !! (2, stages) cosine and sine of `angle`
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6)             !! node displacements (u, v, rotation) twice
      real(wp), intent(in) :: z(:)             !! (ge_size) stored unknowns
      real(wp), intent(out) :: f(6)            !! condensed end forces: internal residuals eliminated
      real(wp), intent(out) :: raw(6)          !! end forces from the stored unknowns, without rounding errors multiplied by EA
      real(wp), intent(out) :: k(6, 6)         !! condensed tangent, symmetric
      real(wp), intent(out) :: fl(6)           !! minus the derivative of f by the load factor
      real(wp), intent(out) :: op(:, :)        !! (ge_size, ge_columns)
      real(wp), intent(out) :: defect(2)       !! largest internal residual: of rotation [rad] and of position
      logical, intent(out) :: ok               !! false: the internal system is singular; outputs undefined
      real(wp), intent(in), optional :: more_force(:, :) !! (2, stages) additional n in the geometric stiffness only, not in
      !! residuals
      type(inner_forces_t), intent(in), optional :: inner !! forces of foundations; require n at the stages in z
      real(wp), intent(out), optional :: shift(6, 2)      !! k times a unit translation in x and in y: not zero on foundations only

      real(wp) :: phi(max_stages), m(max_stages), nn(2, max_stages), rho(2, max_stages), g(max_stages)
      real(wp) :: g_phi(max_stages), d(2, max_stages), bnn(3, max_stages), position(2, max_stages)
      real(wp), allocatable :: system(:, :), rhs(:, :), row_weight(:) ! equations are columns, see solve_small
      real(wp) :: turn(max_stages, max_stages) ! (j, i) derivative of the rotation at stage i by m at stage j
      real(wp) :: rate(n_by, 3, max_stages) ! derivatives of r'/C and m'/C at the stages by the columns, without those of heat
      real(wp) :: slope(n_by, max_stages) ! m'/C at the stages: derivatives by the columns, and m'/C itself in the residual's column
      real(wp) :: moved(n_by, 2), dphi(n_by), dend(n_by, 3), dtail(n_by, 3), flexibility(3, 3), end_weight(3)
      real(wp), dimension(ge_columns + 2, 3) :: ends, tails
      real(wp), dimension(2, max_stages) :: drop, drop_rate ! dead load between the first end and the stages
      real(wp) :: axial_give(max_stages), shear_give(max_stages), bending_give(max_stages), beta(max_stages) ! compliances
      real(wp) :: pressure(max_stages), pressure_rate(max_stages)
      real(wp) :: end_defect(3), tail(3), hc, he, end_drop(2), end_drop_rate(2)
      real(wp) :: free, heat(2, max_stages), g_heat(max_stages), largest, rounding
      real(wp) :: moved_direction(2, max_stages) ! rho less rho of the stress-free element
      integer :: s, stored_by, unknowns
      logical :: stored, founded, anchored, pressed, singular

      s = tab%stages
      hc = h * scale
      axial_give = compliance%axial * compliance%part(1, :)
      bending_give = compliance%bending * compliance%part(2, :)
      shear_give = compliance%shear * compliance%part(3, :)
      beta = axial_give - shear_give
      he = h * maxval(bending_give(:s))
      free = 1.0_wp + load%strain
      largest = 0.0_wp
      stored = size(z) > 3 + s
      founded = .false.
      if (present(inner)) founded = inner%n > 0
      ! Forces that depend on the position resist a translation of the element.
      anchored = founded .or. any(abs(load%gradient) > 0.0_wp)
      pressed = stored .and. (abs(load%pressure) > 0.0_wp .or. abs(load%pressure_rate) > 0.0_wp .or. &
         & any(abs(load%gradient) > 0.0_wp) .or. any(abs(load%gradient_rate) > 0.0_wp))
      call take_dead_load()

      call find_stage_values()
      call set_up_stage_equations()
      call solve_small(unknowns, system, rhs, singular, row_weight)
      if (.not. singular) then
         call go_to_second_end()
         call set_up_end_conditions()
         end_weight = [1.0_wp, 1.0_wp, h]
         call solve_small(3, flexibility, ends, singular, end_weight)
      end if
      ok = .not. singular
      if (present(shift)) shift = 0.0_wp
      if (ok) then
         call condense()
      else
         f = 0.0_wp; raw = 0.0_wp; k = 0.0_wp; fl = 0.0_wp; op = 0.0_wp
      end if

   contains

      !> Dead load between the first end and the stages and the second end, and rotations by the moments.
      subroutine take_dead_load()
         integer :: i, j
         drop(:, :s) = 0.0_wp
         drop_rate(:, :s) = 0.0_wp
         end_drop = 0.0_wp
         end_drop_rate = 0.0_wp
         do j = 1, s
            do i = 1, s
               turn(j, i) = h * tab%a(i, j) * bending_give(j)
               drop(:, i) = drop(:, i) + (h * tab%a(i, j)) * load%line(:, j)
               drop_rate(:, i) = drop_rate(:, i) + (h * tab%a(i, j)) * load%line_rate(:, j)
            end do
            end_drop = end_drop + (h * tab%b(j)) * load%line(:, j)
            end_drop_rate = end_drop_rate + (h * tab%b(j)) * load%line_rate(:, j)
         end do
      end subroutine take_dead_load

      !> Strains, section forces and their derivatives at the stages.
      subroutine find_stage_values()
         real(wp) :: t(2), nu(2), axial, shear, more(2), along, across, half
         integer :: i, j
         m(:s) = z(4:3 + s)
         do i = 1, s
            phi(i) = u(3) + dot_product(turn(:s, i), m(:s)) + (tab%c(i) * h) * load%curvature
            if (stored) then
               nn(:, i) = z(2 + s + 2 * i:3 + s + 2 * i)
            else
               nn(:, i) = z(1:2) - drop(:, i)
            end if
            half = 0.5_wp * phi(i)
            t = tangent(:, i)
            moved_direction(:, i) = (2.0_wp * sin(half)) * (cos(half) * [-t(2), t(1)] - sin(half) * t)
            t = t + moved_direction(:, i)
            nu = [-t(2), t(1)]
            axial = dot_product(nn(:, i), t)
            shear = dot_product(nn(:, i), nu)
            largest = max(largest, abs(nn(1, i)), abs(nn(2, i)))
            moved_direction(:, i) = moved_direction(:, i) + (load%strain + axial * axial_give(i)) * t + &
               & (shear * shear_give(i)) * nu
            rho(:, i) = (free + axial * axial_give(i)) * t + (shear * shear_give(i)) * nu
            g(i) = -free * shear - axial * shear * beta(i)
            g_phi(i) = free * axial + beta(i) * (axial**2 - shear**2)
            d(:, i) = (beta(i) * shear) * t + (free + beta(i) * axial) * nu
            if (present(more_force)) then
               ! The strains do not change, but a shear-flexible section shears when it rotates under an axial force (Haringx).
               more = [dot_product(more_force(:, i), t), dot_product(more_force(:, i), nu)]
               across = free + beta(i) * axial - shear_give(i) * more(1)
               along = beta(i) * shear
               d(:, i) = along * t + across * nu
               g_phi(i) = across * (axial + more(1)) - along * (shear + more(2))
            end if
            ! Derivatives of r'/C and m'/C by the load factor through heat.
            heat(:, i) = load%strain_rate * t + (tab%c(i) * h * load%curvature_rate) * d(:, i)
            g_heat(i) = -load%strain_rate * shear + (tab%c(i) * h * load%curvature_rate) * g_phi(i)
            slope(:, i) = 0.0_wp
            slope(by_rotation, i) = g_phi(i)
            slope(by_residual, i) = g(i)
            slope(by_load, i) = g_heat(i)
            if (.not. stored) slope(by_nx:by_ny, i) = -d(:, i)
            bnn(1, i) = axial_give(i) * t(1) * t(1) + shear_give(i) * nu(1) * nu(1)
            bnn(2, i) = axial_give(i) * t(1) * t(2) + shear_give(i) * nu(1) * nu(2)
            bnn(3, i) = axial_give(i) * t(2) * t(2) + shear_give(i) * nu(2) * nu(2)
         end do
         if (.not. pressed) return
         do i = 1, s
            position(:, i) = 0.0_wp
            do j = 1, s
               position(:, i) = position(:, i) + (hc * tab%a(i, j)) * rho(:, j)
            end do
            pressure(i) = load%pressure + dot_product(load%gradient, position(:, i))
            pressure_rate(i) = load%pressure_rate + dot_product(load%gradient_rate, position(:, i))
         end do
      end subroutine find_stage_values

      !> Linearised stage equations for the increments of m (and n) at the stages.
      subroutine set_up_stage_equations()
         integer :: i, j
         stored_by = s
         if (stored) stored_by = 3 * s
         unknowns = stored_by
         if (founded) unknowns = unknowns + inner%n
         allocate (system(unknowns, unknowns), rhs(n_by, unknowns), row_weight(unknowns))
         defect = 0.0_wp
         ! The rounding error of products of force and length appears in moments and would rotate a taut rod of very small EI by
         ! much.
         ! The defect is reduced by this rounding error, and by no other.
         rounding = moment_rounding * largest * h
         system = 0.0_wp
         rhs = 0.0_wp
         do i = 1, s
            system(i, i) = 1.0_wp
            rhs(by_m, i) = 1.0_wp
            rhs(by_residual, i) = z(3) - m(i)
            do j = 1, s
               rhs(:, i) = rhs(:, i) + (hc * tab%a(i, j)) * slope(:, j)
               system(:s, i) = system(:s, i) - (hc * tab%a(i, j) * g_phi(j)) * turn(:s, j)
               if (stored) then
                  system(s + 2 * j - 1:s + 2 * j, i) = hc * tab%a(i, j) * d(:, j)
               else
                  rhs(by_load, i) = rhs(by_load, i) + hc * tab%a(i, j) * dot_product(d(:, j), drop_rate(:, j))
               end if
            end do
            defect(1) = max(defect(1), (abs(rhs(by_residual, i)) - rounding) * he)
         end do
         if (stored) call add_force_rows()
         ! Weight of force equations against moment equations: a force times h is a moment.
         row_weight(:s) = 1.0_wp
         row_weight(s + 1:) = h
         if (founded) call add_pressure_rows()
      end subroutine set_up_stage_equations

      !> Increments of position and rotation (dend) and of n and m (dtail) at the second end, as linear functions of the columns:
      !> (increments of the rotation, n and m at the first end, 1, load factor).
      subroutine go_to_second_end()
         real(wp) :: pushed(2), pushed_rate(2), by_slope(2, 2, max_stages), by_shift(2, 2)
         integer :: i, l, q
         dend = 0.0_wp
         dtail = 0.0_wp
         dend(by_rotation, 3) = 1.0_wp
         dtail(by_nx, 1) = 1.0_wp
         dtail(by_ny, 2) = 1.0_wp
         dtail(by_m, 3) = 1.0_wp
         dtail(by_load, 1:2) = -end_drop_rate
         dend(by_load, 3) = h * load%curvature_rate
         ! Differences of displacements instead of positions have a smaller rounding error, and C closes the stress-free element.
         end_defect = [u(4:5) - u(1:2), u(6) - u(3) - h * load%curvature]
         tail = z(1:3)
         tail(1:2) = tail(1:2) - end_drop
         do i = 1, s
            dphi = 0.0_wp
            dphi(by_rotation) = 1.0_wp
            do l = 1, s
               dphi = dphi + turn(l, i) * rhs(:, l)
            end do
            rate(:, 1, i) = d(1, i) * dphi
            rate(:, 2, i) = d(2, i) * dphi
            rate(:, 3, i) = g_phi(i) * dphi
            if (stored) then
               associate (dn => rhs(:, s + 2 * i - 1:s + 2 * i))
                  rate(:, 1, i) = rate(:, 1, i) + bnn(1, i) * dn(:, 1) + bnn(2, i) * dn(:, 2)
                  rate(:, 2, i) = rate(:, 2, i) + bnn(2, i) * dn(:, 1) + bnn(3, i) * dn(:, 2)
                  rate(:, 3, i) = rate(:, 3, i) - d(1, i) * dn(:, 1) - d(2, i) * dn(:, 2)
               end associate
            else
               associate (dn => -drop_rate(:, i))
                  rate(by_nx:by_ny, 1, i) = rate(by_nx:by_ny, 1, i) + bnn(1:2, i)
                  rate(by_nx:by_ny, 2, i) = rate(by_nx:by_ny, 2, i) + bnn(2:3, i)
                  rate(by_nx:by_ny, 3, i) = rate(by_nx:by_ny, 3, i) - d(:, i)
                  rate(by_load, 1, i) = rate(by_load, 1, i) + bnn(1, i) * dn(1) + bnn(2, i) * dn(2)
                  rate(by_load, 2, i) = rate(by_load, 2, i) + bnn(2, i) * dn(1) + bnn(3, i) * dn(2)
                  rate(by_load, 3, i) = rate(by_load, 3, i) - d(1, i) * dn(1) - d(2, i) * dn(2)
               end associate
            end if
            dend(:, 1) = dend(:, 1) + (hc * tab%b(i)) * rate(:, 1, i)
            dend(:, 2) = dend(:, 2) + (hc * tab%b(i)) * rate(:, 2, i)
            dend(:, 3) = dend(:, 3) + (h * bending_give(i) * tab%b(i)) * rhs(:, i)
            dtail(:, 3) = dtail(:, 3) + (hc * tab%b(i)) * rate(:, 3, i)
            dend(by_load, 1:2) = dend(by_load, 1:2) + (hc * tab%b(i)) * heat(:, i)
            dtail(by_load, 3) = dtail(by_load, 3) + (hc * tab%b(i)) * g_heat(i)
            end_defect(1:2) = end_defect(1:2) - (hc * tab%b(i)) * moved_direction(:, i)
            end_defect(3) = end_defect(3) - (h * bending_give(i) * tab%b(i)) * m(i)
            tail(3) = tail(3) + (hc * tab%b(i)) * g(i)
         end do
         if (pressed) then
            call press_section(tab%b, pushed, pushed_rate, by_slope, by_shift)
            tail(1:2) = tail(1:2) - pushed
            do i = 1, s
               do q = 1, 2
                  dtail(:, q) = dtail(:, q) - matmul(rate(:, 1:2, i), by_slope(q, :, i))
                  dtail(by_load, q) = dtail(by_load, q) - dot_product(by_slope(q, :, i), heat(:, i))
               end do
            end do
            dtail(by_x:by_y, 1:2) = dtail(by_x:by_y, 1:2) - transpose(by_shift)
            dtail(by_load, 1:2) = dtail(by_load, 1:2) - pushed_rate
         end if
         if (founded) then
            do q = 1, inner%n
               call point_increment(q)
               tail(1:2) = tail(1:2) - (h * inner%weight(q)) * inner%force(:, q)
               do i = 1, 2
                  dtail(:, i) = dtail(:, i) + (h * inner%weight(q)) * (matmul(moved, inner%sway(i, :, q)) - &
                     & inner%normal(i, q) * rhs(:, stored_by + q))
               end do
               dtail(by_load, 1:2) = dtail(by_load, 1:2) - (h * inner%weight(q)) * inner%rate(:, q)
            end do
         end if
         defect(1) = max(defect(1), abs(end_defect(3)))
         defect(2) = max(abs(end_defect(1)), abs(end_defect(2)))
      end subroutine go_to_second_end

      !> Sets up the end conditions, whose solution is the increment of n and m at the first end.
      subroutine set_up_end_conditions()
         real(wp) :: t(2)
         integer :: i
         flexibility = dend(by_nx:by_m, :)
         if (compliance%give > 0.0_wp) then
            do i = 1, s
               t = [cos(angle(i) + phi(i)), sin(angle(i) + phi(i))]
               flexibility(1, 1:2) = flexibility(1, 1:2) + (hc * tab%b(i) * compliance%give * t(1)) * t
               flexibility(2, 1:2) = flexibility(2, 1:2) + (hc * tab%b(i) * compliance%give * t(2)) * t
            end do
         end if
         ends = 0.0_wp
         do i = 1, 3
            ends(i, i) = -1.0_wp
            ends(i + 3, i) = 1.0_wp
         end do
         ! dend(by_rotation, 3) contains the rotation of the first end itself; the difference of the end rotations needs the rest
         ! only.
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

      !> End forces, tangent and the operator of the stored unknowns, from the increments at the first end.
      subroutine condense()
         integer :: i, l
         op(1:3, :) = transpose(ends(:ge_columns, :))
         do l = 1, stored_by
            op(3 + l, :) = rhs(by_nx, l) * ends(:ge_columns, 1) + rhs(by_ny, l) * ends(:ge_columns, 2) + &
               & rhs(by_m, l) * ends(:ge_columns, 3)
            op(3 + l, 3) = op(3 + l, 3) + rhs(by_rotation, l)
            if (anchored) op(3 + l, 1:2) = op(3 + l, 1:2) + rhs(by_x:by_y, l)
            op(3 + l, 7:8) = op(3 + l, 7:8) + rhs(by_residual:by_load, l)
         end do
         do i = 1, 3
            tails(:, i) = dtail(by_nx, i) * ends(:, 1) + dtail(by_ny, i) * ends(:, 2) + dtail(by_m, i) * ends(:, 3)
         end do

         k(1:3, :) = -transpose(ends(:6, :))
         k(4:6, :) = transpose(tails(:6, :))
         k(4:6, 3) = k(4:6, 3) + dtail(by_rotation, :)
         if (anchored) then
            k(4:6, 1:2) = k(4:6, 1:2) + transpose(dtail(by_x:by_y, :))
            if (present(shift)) then
               shift(1:3, :) = -transpose(ends(ge_columns + 1:, :))
               shift(4:6, :) = transpose(tails(ge_columns + 1:, :) + dtail(by_x:by_y, :))
            end if
         end if
         raw(1:3) = -z(1:3)
         raw(4:6) = tail
         f(1:3) = -z(1:3) - ends(7, :)
         f(4:6) = tail + tails(7, :) + dtail(by_residual, :)
         fl(1:3) = ends(8, :)
         fl(4:6) = -tails(8, :) - dtail(by_load, :)
         ! Pressure gives a skew part that cancels between neighbouring elements; without it the band is symmetric.
         if (stored) k = 0.5_wp * (k + transpose(k))
      end subroutine condense

      !> Increment of the position of a quadrature point, as a linear function of the columns.
      subroutine point_increment(number)
         integer, intent(in) :: number
         integer :: a
         real(wp) :: weight
         moved = 0.0_wp
         moved(by_x, 1) = 1.0_wp
         moved(by_y, 2) = 1.0_wp
         do a = 1, s
            weight = hc * inner%basis(a, number)
            moved(by_load, :) = moved(by_load, :) + weight * heat(:, a)
            moved = moved + weight * rate(:, 1:2, a)
         end do
      end subroutine point_increment

      !> Force of the pressure on a part of the element, sum of weight p J r' over the stages, and its derivatives.
      subroutine press_section(weight, force, force_rate, by_slope, by_shift)
         real(wp), intent(in) :: weight(:)                 ! (stages) quadrature weights of the part
         real(wp), intent(out) :: force(2), force_rate(2)  ! force, and its derivative by the load factor
         real(wp), intent(out) :: by_slope(2, 2, max_stages) ! derivatives by r'/C at the stages
         real(wp), intent(out) :: by_shift(2, 2)           ! derivative by the position of the first node
         real(wp) :: side(2)
         integer :: b, c
         force = 0.0_wp
         force_rate = 0.0_wp
         by_slope = 0.0_wp
         by_shift = 0.0_wp
         do b = 1, s
            side = (hc * weight(b)) * [-rho(2, b), rho(1, b)]
            force = force + pressure(b) * side
            force_rate = force_rate + pressure_rate(b) * side
            by_slope(1, 2, b) = by_slope(1, 2, b) - hc * weight(b) * pressure(b)
            by_slope(2, 1, b) = by_slope(2, 1, b) + hc * weight(b) * pressure(b)
            if (.not. any(abs(load%gradient) > 0.0_wp)) cycle
            by_shift(1, :) = by_shift(1, :) + side(1) * load%gradient
            by_shift(2, :) = by_shift(2, :) + side(2) * load%gradient
            do c = 1, s
               by_slope(1, :, c) = by_slope(1, :, c) + (hc * tab%a(b, c) * side(1)) * load%gradient
               by_slope(2, :, c) = by_slope(2, :, c) + (hc * tab%a(b, c) * side(2)) * load%gradient
            end do
         end do
      end subroutine press_section

      !> n_i = n_1 - dead load - pressure - foundation between the first end and every stage, linearised.
      subroutine add_force_rows()
         integer :: row, a, b, q, i
         real(wp) :: share, k_d(2), along(max_stages, 2), swing(2), heated(2), k_dn(2, 2, max_stages)
         real(wp) :: pushed(2), pushed_rate(2), by_slope(2, 2, max_stages), by_shift(2, 2)
         do a = 1, s
            row = s + 2 * a - 1
            system(row, row) = 1.0_wp
            system(row + 1, row + 1) = 1.0_wp
            rhs(by_nx, row) = 1.0_wp
            rhs(by_ny, row + 1) = 1.0_wp
            rhs(by_residual, row:row + 1) = z(1:2) - nn(:, a) - drop(:, a)
            rhs(by_load, row:row + 1) = rhs(by_load, row:row + 1) - drop_rate(:, a)
            if (.not. pressed) cycle
            call press_section(tab%a(a, :), pushed, pushed_rate, by_slope, by_shift)
            do i = 1, 2
               associate (line => row + i - 1)
                  rhs(by_residual, line) = rhs(by_residual, line) - pushed(i)
                  rhs(by_load, line) = rhs(by_load, line) - pushed_rate(i)
                  rhs(by_x:by_y, line) = rhs(by_x:by_y, line) - by_shift(i, :)
                  do b = 1, s
                     associate (w => by_slope(i, :, b))
                        rhs(by_rotation, line) = rhs(by_rotation, line) - dot_product(w, d(:, b))
                        rhs(by_load, line) = rhs(by_load, line) - dot_product(w, heat(:, b))
                        system(:s, line) = system(:s, line) + dot_product(w, d(:, b)) * turn(:s, b)
                        system(s + 2 * b - 1, line) = system(s + 2 * b - 1, line) + dot_product(w, bnn(1:2, b))
                        system(s + 2 * b, line) = system(s + 2 * b, line) + dot_product(w, bnn(2:3, b))
                     end associate
                  end do
               end associate
            end do
         end do
         if (founded) then
            do q = 1, inner%n
               ! Displacement of the point: by_x, by_y, swing * rotation 1, along * dm, k_dn * dn.
               along = 0.0_wp
               swing = 0.0_wp
               heated = 0.0_wp
               do b = 1, s
                  heated = heated + matmul(inner%sway(:, :, q), heat(:, b)) * (hc * inner%basis(b, q))
                  k_d = matmul(inner%sway(:, :, q), d(:, b)) * (hc * inner%basis(b, q))
                  swing = swing + k_d
                  along(:s, 1) = along(:s, 1) + (k_d(1) * h) * (bending_give(:s) * tab%a(b, :s))
                  along(:s, 2) = along(:s, 2) + (k_d(2) * h) * (bending_give(:s) * tab%a(b, :s))
                  k_dn(1, :, b) = matmul(inner%sway(:, :, q), bnn(1:2, b)) * (hc * inner%basis(b, q))
                  k_dn(2, :, b) = matmul(inner%sway(:, :, q), bnn(2:3, b)) * (hc * inner%basis(b, q))
               end do
               do a = 1, s
                  row = s + 2 * a - 1
                  share = h * inner%weight(q) * (1.0_wp - inner%basis(a, q) / tab%b(a))
                  system(stored_by + q, row:row + 1) = system(stored_by + q, row:row + 1) + share * inner%normal(:, q)
                  system(:s, row:row + 1) = system(:s, row:row + 1) - share * along(:s, :)
                  do b = 1, s
                     system(s + 2 * b - 1:s + 2 * b, row:row + 1) = system(s + 2 * b - 1:s + 2 * b, row:row + 1) - &
                        & share * k_dn(:, :, b)
                  end do
                  rhs(by_rotation, row:row + 1) = rhs(by_rotation, row:row + 1) + share * swing
                  rhs(by_x:by_y, row:row + 1) = rhs(by_x:by_y, row:row + 1) + share * transpose(inner%sway(:, :, q))
                  rhs(by_residual, row:row + 1) = rhs(by_residual, row:row + 1) - share * inner%force(:, q)
                  rhs(by_load, row:row + 1) = rhs(by_load, row:row + 1) + share * (heated - inner%rate(:, q))
               end do
            end do
         end if
         ! Defect: the rotation that the residual force would cause over the length of the element.
         do a = 1, s
            defect(1) = max(defect(1), maxval(abs(rhs(by_residual, s + 2 * a - 1:s + 2 * a))) * hc * he)
         end do
      end subroutine add_force_rows

      !> dp + spring * normal.dx = spring * approach * dl at every quadrature point, dp the increment of its pressure. Pressures are
      !> unknowns of their own. If they were substituted into the rows of n, motions without resistance, as sliding along a stiff
      !> foundation, would be lost to cancellation.
      subroutine add_pressure_rows()
         real(wp) :: stiff, lever
         integer :: row, b, q
         do q = 1, inner%n
            row = stored_by + q
            ! Weight: a pressure times h**2 is a moment.
            row_weight(row) = h**2
            system(row, row) = 1.0_wp
            do b = 1, s
               stiff = inner%spring(q) * hc * inner%basis(b, q)
               lever = stiff * dot_product(inner%normal(:, q), d(:, b))
               system(:s, row) = system(:s, row) + (lever * h) * (bending_give(:s) * tab%a(b, :s))
               system(s + 2 * b - 1, row) = stiff * dot_product(inner%normal(:, q), bnn(1:2, b))
               system(s + 2 * b, row) = stiff * dot_product(inner%normal(:, q), bnn(2:3, b))
               rhs(by_rotation, row) = rhs(by_rotation, row) - lever
               rhs(by_load, row) = rhs(by_load, row) - stiff * dot_product(inner%normal(:, q), heat(:, b))
            end do
            rhs(by_x:by_y, row) = -inner%spring(q) * inner%normal(:, q)
            rhs(by_load, row) = rhs(by_load, row) + inner%spring(q) * inner%approach(q)
         end do
      end subroutine add_pressure_rows
   end subroutine ge_evaluate

   !> n and m at both ends from the stored unknowns without condensation, in global axes.
   pure subroutine ge_end_forces(tab, h, scale, angle, compliance, load, u, z, first, second, inner)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      real(wp), intent(in) :: angle(:)         !! (stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)
      real(wp), intent(out) :: first(3), second(3) !! (n_x, n_y, m)
      type(inner_forces_t), intent(in), optional :: inner
      real(wp) :: span(2), rotation
      integer :: q
      first = z(1:3)
      call ge_interior(tab, h, scale, angle, compliance, load, u, z, 1.0_wp, span, rotation, second)
      if (.not. present(inner)) return
      do q = 1, inner%n
         second(1:2) = second(1:2) - (h * inner%weight(q)) * inner%force(:, q)
      end do
   end subroutine ge_end_forces

   !> Dense output of the collocation inside an element. n does not contain the forces of foundations along the element.
   pure subroutine ge_interior(tab, h, scale, angle, compliance, load, u, z, tau, span, rotation, resultant)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      real(wp), intent(in) :: angle(:)         !! (stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)
      real(wp), intent(in) :: tau              !! place, 0 to 1 of the stress-free length
      real(wp), intent(out) :: span(2)         !! deformed position minus that of the first node
      real(wp), intent(out) :: rotation        !! rotation at the place
      real(wp), intent(out) :: resultant(3)    !! (n_x, n_y, m) at the place
      real(wp) :: basis(max_stages), rho(2, max_stages)
      integer :: s
      s = tab%stages
      call stage_basis(tab, tau, basis)
      call ge_directions(tab, h, angle, compliance, load, u, z, rho(:, :s))
      rotation = u(3) + h * compliance%bending * dot_product(basis(:s) * compliance%part(2, :s), z(4:3 + s)) + &
         & (tau * h) * load%curvature
      call ge_between(tab, h, scale, load, z, rho, tau, span, resultant)
   end subroutine ge_interior

   !> As ge_interior, with the directions rho at the stages given, for many places of one element.
   pure subroutine ge_between(tab, h, scale, load, z, rho, tau, span, resultant)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h, scale
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: rho(:, :)        !! (2, at least stages) directions from ge_directions
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: span(2), resultant(3)
      real(wp) :: basis(max_stages), nn(2), pressure
      integer :: i, s
      s = tab%stages
      call stage_basis(tab, tau, basis)
      span = 0.0_wp
      resultant = z(1:3)
      do i = 1, s
         nn = stage_force(tab, h, load, z, i)
         span = span + (h * scale * basis(i)) * rho(:, i)
         resultant(3) = resultant(3) - (h * scale * basis(i)) * (rho(1, i) * nn(2) - rho(2, i) * nn(1))
         pressure = load%pressure
         if (any(abs(load%gradient) > 0.0_wp)) pressure = pressure + (h * scale) * dot_product(load%gradient, &
            & matmul(rho(:, :s), tab%a(i, :s)))
         resultant(1:2) = resultant(1:2) - (h * basis(i)) * (load%line(:, i) + (pressure * scale) * [-rho(2, i), rho(1, i)])
      end do
   end subroutine ge_between

   !> Derivative of the position by the stress-free arc length, divided by C, at the stages.
   pure subroutine ge_directions(tab, h, angle, compliance, load, u, z, rho)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h
      real(wp), intent(in) :: angle(:)         !! (stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)
      real(wp), intent(out) :: rho(:, :)       !! (2, stages)
      integer :: i
      call ge_direction_changes(tab, h, angle, compliance, load, u, z, rho)
      do i = 1, tab%stages
         rho(:, i) = rho(:, i) + [cos(angle(i)), sin(angle(i))]
      end do
   end subroutine ge_directions

   !> Result of ge_directions less its value in the stress-free element, exact to the rounding of displacements.
   pure subroutine ge_direction_changes(tab, h, angle, compliance, load, u, z, change)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h
      real(wp), intent(in) :: angle(:)         !! (stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)
      real(wp), intent(out) :: change(:, :)    !! (2, stages)
      real(wp) :: phi, nn(2), t(2), nu(2)
      integer :: i, s
      s = tab%stages
      do i = 1, s
         phi = u(3) + h * compliance%bending * dot_product(tab%a(i, :s) * compliance%part(2, :s), z(4:3 + s)) + &
            & (tab%c(i) * h) * load%curvature
         nn = stage_force(tab, h, load, z, i)
         t = [cos(angle(i) + phi), sin(angle(i) + phi)]
         nu = [-t(2), t(1)]
         change(:, i) = (load%strain + dot_product(nn, t) * compliance%axial * compliance%part(1, i)) * t + &
            & (dot_product(nn, nu) * compliance%shear * compliance%part(3, i)) * nu + &
            & (2.0_wp * sin(0.5_wp * phi)) * [-sin(angle(i) + 0.5_wp * phi), cos(angle(i) + 0.5_wp * phi)]
      end do
   end subroutine ge_direction_changes

   !> Change of the result of ge_directions due to changes of the first node's rotation, the stored resultants and the load factor.
   pure subroutine ge_direction_rates(tab, h, angle, compliance, load, u, z, du, dz, load_change, rate)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h
      real(wp), intent(in) :: angle(:)         !! (stages)
      type(ge_stiffness_t), intent(in) :: compliance
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: u(6), z(:)
      real(wp), intent(in) :: du(6), dz(:)     !! changes of the displacements and of the stored unknowns
      real(wp), intent(in) :: load_change      !! change of the load factor
      real(wp), intent(out) :: rate(:, :)      !! (2, stages)
      type(ge_load_t) :: increment
      real(wp) :: phi, dphi, nn(2), dn(2), t(2), nu(2), axial, shear, axial_give, shear_give, beta
      integer :: i, s
      s = tab%stages
      increment%line = load_change * load%line_rate
      do i = 1, s
         phi = u(3) + h * compliance%bending * dot_product(tab%a(i, :s) * compliance%part(2, :s), z(4:3 + s)) + &
            & (tab%c(i) * h) * load%curvature
         axial_give = compliance%axial * compliance%part(1, i)
         shear_give = compliance%shear * compliance%part(3, i)
         beta = axial_give - shear_give
         dphi = du(3) + h * compliance%bending * dot_product(tab%a(i, :s) * compliance%part(2, :s), dz(4:3 + s)) + &
            & (tab%c(i) * h) * load_change * load%curvature_rate
         nn = stage_force(tab, h, load, z, i)
         dn = stage_force(tab, h, increment, dz, i)
         t = [cos(angle(i) + phi), sin(angle(i) + phi)]
         nu = [-t(2), t(1)]
         axial = dot_product(nn, t)
         shear = dot_product(nn, nu)
         rate(:, i) = dphi * ((beta * shear) * t + (1.0_wp + load%strain + beta * axial) * nu) + &
            & (load_change * load%strain_rate + axial_give * dot_product(dn, t)) * t + &
            & (shear_give * dot_product(dn, nu)) * nu
      end do
   end subroutine ge_direction_rates

   !> Force n at a stage.
   pure function stage_force(tab, h, load, z, i) result(nn)
      type(tableau_t), intent(in) :: tab
      real(wp), intent(in) :: h
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: z(:)
      integer, intent(in) :: i
      real(wp) :: nn(2)
      integer :: j
      associate (s => tab%stages)
         if (size(z) > 3 + s) then
            nn = z(2 + s + 2 * i:3 + s + 2 * i)
         else
            nn = z(1:2)
            do j = 1, s
               nn = nn - (h * tab%a(i, j)) * load%line(:, j)
            end do
         end if
      end associate
   end function stage_force

   !> Dead load at a place of an element: the polynomial through its values at the stages.
   pure subroutine line_at(tab, load, tau, line, slope)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: tau              !! place, 0 to 1 of the stress-free length
      real(wp), intent(out) :: line(2)         !! q
      real(wp), intent(out) :: slope(2)        !! its derivative by tau
      real(wp) :: basis(max_stages), rate(max_stages)
      integer :: k
      line = load%line(:, 1)
      slope = 0.0_wp
      if (load%uniform) return
      basis = 0.0_wp
      rate = 0.0_wp
      do k = tab%stages, 1, -1
         rate = rate * tau + basis
         basis = basis * tau + k * tab%integral(k, :)
      end do
      line = matmul(load%line, basis)
      slope = matmul(load%line, rate)
   end subroutine line_at
end module ge_element
