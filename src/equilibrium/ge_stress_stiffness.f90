!> How the tangent of a geometrically exact element changes with the load factor through its forces alone: linear buckling.
module ge_stress_stiffness
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use ge_element, only: ge_evaluate, ge_direction_rates, ge_load_t, ge_columns
   implicit none
   private
   public :: ge_tangent_rate

contains

   !> Central differences of its condensed tangent, to the sixth order in n h^2/EI.
   subroutine ge_tangent_rate(problem, state, du, dz, e, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6)            !! node displacements per unit of load factor
      real(wp), intent(in) :: dz(:)            !! stored resultants per unit of load factor
      integer, intent(in) :: e
      real(wp), intent(out) :: k(6, 6)
      real(wp), intent(out) :: shift(6, 2)     !! k times unit translations
      ! (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! n h^2/EI at the outermost sides
      type(ge_load_t) :: load, shifted
      real(wp) :: force(2, max_stages), f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), step, largest, &
         & moved(6, 2)
      type(inner_forces_t) :: inner, pressed
      integer :: i, s, z
      logical :: ok
      s = problem%model%mesh%stages(e)
      z = problem%z_size(e)
      load = element_load(problem, state, e)
      associate (g => state%geometry%element(e), tab => problem%tableau(s), flexible => problem%compliance(e))
         do i = 1, s
            if (z > 3 + s) then
               force(:, i) = dz(2 + s + 2 * i:3 + s + 2 * i)
            else
               force(:, i) = dz(1:2) - (tab%c(i) * g%length) * load%line_rate
            end if
         end do
         largest = maxval(abs(force(:, :s))) * g%length**2 * flexible%bending
         largest = max(largest, abs(load%pressure_rate) * g%length**3 * flexible%bending)
         call foundation_forces(problem, state, e, inner)
         pressed = inner
         k = 0.0_wp
         shift = 0.0_wp
         if (.not. largest > 0.0_wp) return
         step = small / largest
         do i = 1, size(sides)
            shifted = load
            shifted%pressure = load%pressure + sides(i) * step * load%pressure_rate
            if (inner%n > 0) call press(sides(i) * step)
            call ge_evaluate(tab, g%length, g%scale, g%angle, g%chord, flexible, shifted, &
               & element_displacement(problem, state, e), state%z(:z, e), f, raw, part, fl, op, defect, ok, &
               & more_force=sides(i) * step * force(:, :s), inner=pressed, shift=moved)
            k = k + (weights(i) / step) * part
            shift = shift + (weights(i) / step) * moved
         end do
      end associate

   contains

      !> The curvature of a foundation's surface under the additional pressure.
      subroutine press(part_of_load)
         real(wp), intent(in) :: part_of_load
         real(wp) :: along(2), d(2), rho(2, max_stages), change
         integer :: q
         associate (g => state%geometry%element(e))
            call ge_direction_rates(problem%tableau(s), g%length, g%angle, problem%compliance(e), load, &
               & element_displacement(problem, state, e), state%z(:z, e), du, dz(:z), 1.0_wp, rho(:, :s))
            do q = 1, inner%n
               d = du(1:2) + g%length * g%scale * matmul(rho(:, :s), inner%basis(:s, q))
               along = [inner%normal(2, q), -inner%normal(1, q)]
               change = part_of_load * inner%bend(q) * &
                  & dot_product(inner%normal(:, q), inner%rate(:, q) - matmul(inner%stiffness(:, :, q), d))
               pressed%stiffness(:, 1, q) = inner%stiffness(:, 1, q) - change * along * along(1)
               pressed%stiffness(:, 2, q) = inner%stiffness(:, 2, q) - change * along * along(2)
            end do
         end associate
      end subroutine press
   end subroutine ge_tangent_rate
end module ge_stress_stiffness
