!> Stress stiffness of a geometrically exact element, for linear buckling.
module ge_stress_stiffness
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_compliance, element_load
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use rod_load, only: ge_load_t, line_before
   use ge_element, only: ge_evaluate, ge_columns
   use ge_stages, only: ge_direction_rates
   implicit none
   private
   public :: ge_stress

contains

   !> Change of the element's tangent, internal unknowns eliminated, due to the stresses of a change `factor` of the load factor.
   !> For factor 0 the derivative, by central differences of sixth order in n h^2/EI, n the section force, h the element's length.
   subroutine ge_stress(problem, state, du, dz, e, factor, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6)            !! nodal displacements per unit of load factor
      real(wp), intent(in) :: dz(:)            !! stored section forces per unit of load factor
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(out) :: k(6, 6)
      real(wp), intent(out) :: shift(6, 2)     !! k times unit translations
      ! Sixth-order difference: (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e, K(e) the tangent under e times
      ! the stresses
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! n h^2/EI at the outermost points of the difference
      type(ge_load_t) :: load
      real(wp) :: force(2, max_stages), step, largest, line(2), rate(2)
      type(inner_forces_t) :: inner, pressed
      integer :: i, s, z
      s = problem%model%mesh%stages(e)
      z = problem%z_size(e)
      load = element_load(problem, state, e)
      k = 0.0_wp
      shift = 0.0_wp
      associate (g => state%geometry%element(e), tab => problem%tableau(s), flexible => problem%compliance(e))
         do i = 1, s
            if (z > 3 + s) then
               force(:, i) = dz(2 + s + 2 * i:3 + s + 2 * i)
            else
               call line_before(tab, load, i, line, rate)
               force(:, i) = dz(1:2) - g%length * rate
            end if
         end do
         largest = maxval(abs(force(:, :s))) * g%length**2 * flexible%bending
         largest = max(largest, (abs(load%pressure_rate) + norm2(load%gradient_rate) * g%length) * g%length**3 * flexible%bending)
         call foundation_forces(problem, state, e, inner)
      end associate
      if (.not. largest > 0.0_wp) return
      if (abs(factor) > 0.0_wp) then
         call add(factor, 1.0_wp)
         call add(0.0_wp, -1.0_wp)
      else
         step = small / largest
         do i = 1, size(sides)
            call add(sides(i) * step, weights(i) / step)
         end do
      end if

   contains

      !> Adds the tangent, internal unknowns eliminated, under the stresses of a part of the load change, times a weight.
      subroutine add(part_of_load, weight)
         real(wp), intent(in) :: part_of_load, weight
         type(ge_load_t) :: shifted
         real(wp) :: f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), moved(6, 2)
         logical :: ok
         shifted = load
         shifted%pressure = load%pressure + part_of_load * load%pressure_rate
         shifted%gradient = load%gradient + part_of_load * load%gradient_rate
         pressed = inner
         if (inner%n > 0) call press(part_of_load)
         associate (g => state%geometry%element(e))
            call ge_evaluate(problem%tableau(s), g%length, g%scale, g%tangent, element_compliance(problem, state, e), &
               & shifted, element_displacement(problem, state, e), state%z(:z, e), pressed, f, raw, part, moved, fl, op, defect, &
               & ok, more_force=part_of_load * force(:, :s))
         end associate
         k = k + weight * part
         shift = shift + weight * moved
      end subroutine add

      !> Adds the geometric stiffness of a curved foundation surface under the pressure of a part of the load change.
      subroutine press(part_of_load)
         real(wp), intent(in) :: part_of_load
         real(wp) :: along(2), d(2), rho(2, max_stages), change
         integer :: q
         associate (g => state%geometry%element(e))
            call ge_direction_rates(problem%tableau(s), g%length, g%tangent, element_compliance(problem, state, e), load, &
               & element_displacement(problem, state, e), state%z(:z, e), du, dz(:z), 1.0_wp, rho(:, :s))
            do q = 1, inner%n
               d = du(1:2) + g%length * g%scale * matmul(rho(:, :s), inner%basis(:s, q))
               along = [inner%normal(2, q), -inner%normal(1, q)]
               change = part_of_load * inner%bend(q) * inner%spring(q) * (inner%approach(q) - dot_product(inner%normal(:, q), d))
               pressed%sway(:, 1, q) = inner%sway(:, 1, q) - change * along * along(1)
               pressed%sway(:, 2, q) = inner%sway(:, 2, q) - change * along * along(2)
            end do
         end associate
      end subroutine press
   end subroutine ge_stress
end module ge_stress_stiffness
