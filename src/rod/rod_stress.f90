!> Change of an element's tangent by the stresses alone, at fixed geometry, for linear buckling (see stress_stiffness).
module rod_stress
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use element_families, only: collocates
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use gauss_tableau, only: max_stages
   use rod_load, only: line_before
   use ge_data, only: ge_data_t
   use ge_in_state, only: ge_at
   use ge_element, only: ge_evaluate, ge_columns
   use ge_stages, only: ge_stages_t, find_stages, ge_direction_rates
   use ul2_element, only: ul2_stress_stiffness
   implicit none
   private
   public :: rod_stress_stiffness

contains

   !> Change of the tangent at fixed geometry, caused by the section forces and the pressure that a change `factor` of the load
   !> factor gives. For factor 0 the result is the derivative by the load factor. It is zero for a conforming element, because on an
   !> obstacle of constant curvature all strains are linear in the displacements.
   subroutine rod_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6)            !! nodal displacements by the load factor
      real(wp), intent(in) :: dz(:)            !! changes of the stored unknowns by the load factor; not used for UL2 elements
      integer, intent(in) :: e
      real(wp), intent(in) :: factor           !! change of the load factor
      real(wp), intent(out) :: k(6, 6)
      real(wp), intent(out) :: shift(6, 2)     !! k times a unit translation in x and in y
      k = 0.0_wp
      shift = 0.0_wp
      if (problem%conforms(e) > 0) return
      if (collocates(problem%model%mesh%family(e))) then
         call ge_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
         return
      end if
      associate (g => state%geometry%element(e))
         call ul2_stress_stiffness(g%length, g%chord, 1.0_wp / problem%compliance(e)%axial, element_load(problem, state, e), &
            & element_displacement(problem, state, e), du, k)
      end associate
      if (abs(factor) > 0.0_wp) k = factor * k
   end subroutine rod_stress_stiffness

   !> The same for a GE element: change of its tangent with the internal unknowns eliminated. For factor 0 it is computed by central
   !> differences of sixth order in n h^2/EI, with the section force n and the element's length h.
   subroutine ge_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6), dz(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: k(6, 6), shift(6, 2) !! in: 0
      ! Sixth-order difference: (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e and the tangent K(e) under e
      ! times the stresses.
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! largest magnitude of n h^2/EI in the difference
      type(ge_data_t) :: element
      real(wp) :: force(2, max_stages), step, largest, line(2), rate(2)
      type(inner_forces_t) :: inner, pressed
      integer :: i, s, z
      element = ge_at(problem, state, e)
      s = problem%model%mesh%stages(e)
      z = element%unknowns
      associate (g => element%g, tab => problem%tableau(s), load => element%load, flexible => element%compliance)
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

      !> Adds, times a weight, the tangent (internal unknowns eliminated) under the stresses of a part of the load change.
      subroutine add(part_of_load, weight)
         real(wp), intent(in) :: part_of_load, weight
         type(ge_data_t) :: shifted
         real(wp) :: f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), moved(6, 2)
         logical :: ok
         shifted = element
         shifted%load%pressure = element%load%pressure + part_of_load * element%load%pressure_rate
         shifted%load%gradient = element%load%gradient + part_of_load * element%load%gradient_rate
         pressed = inner
         if (inner%n > 0) call press(part_of_load)
         call ge_evaluate(problem%tableau(s), shifted, pressed, f, raw, part, moved, fl, op, defect, ok, &
            & more_force=part_of_load * force(:, :s))
         k = k + weight * part
         shift = shift + weight * moved
      end subroutine add

      !> Adds the geometric stiffness of a curved foundation surface under the pressure of a part of the load change.
      subroutine press(part_of_load)
         real(wp), intent(in) :: part_of_load
         real(wp) :: along(2), d(2), rho(2, max_stages), change
         type(ge_stages_t) :: stages
         integer :: q
         call find_stages(problem%tableau(s), element, stages)
         rho = ge_direction_rates(stages, du, dz(:z), 1.0_wp)
         associate (g => element%g)
            do q = 1, inner%n
               d = du(1:2) + g%length * g%scale * matmul(rho(:, :s), inner%basis(:s, q))
               along = [inner%normal(2, q), -inner%normal(1, q)]
               change = part_of_load * inner%bend(q) * inner%spring(q) * (inner%approach(q) - dot_product(inner%normal(:, q), d))
               pressed%sway(:, 1, q) = inner%sway(:, 1, q) - change * along * along(1)
               pressed%sway(:, 2, q) = inner%sway(:, 2, q) - change * along * along(2)
            end do
         end associate
      end subroutine press
   end subroutine ge_stress_stiffness
end module rod_stress
