!> Stress stiffness: the derivative of the tangent along the path through the stresses alone, the geometry held.
!>
!> This is the matrix of classical linear buckling. The displacements of the increment are left out on purpose: linearised,
!> they turn the stiff directions of slender rods without the second-order terms that keep them stiff, and the pencil
!> then has eigenvalues that no structure has.
module stress_stiffness
   use kinds, only: wp
   use model, only: family_ge
   use gauss_tableau, only: max_stages
   use problem, only: problem_t, dof
   use rod_state, only: state_t, element_displacement, element_load
   use linear_system, only: system_t, sum_elements, turn_pair, to_global
   use element_products, only: apply_elements
   use bordered_system, only: resultant_rates
   use contact_set, only: reaction_rate
   use ge_element, only: ge_evaluate, ge_load_t, ge_columns
   use ul2_element, only: ul2_stress_stiffness
   use band_matrix, only: band_t
   implicit none
   private
   public :: stress_stiffness_t, new_stress_stiffness, apply_stress

   type :: stress_stiffness_t
      type(band_t) :: k                        !! per unit of load factor, node axes
      real(wp), allocatable :: element(:, :, :) !! (6, 6, elements) its elements, node axes
      real(wp), allocatable :: contact(:, :, :) !! (2, 2, candidates) and its contacts
   end type stress_stiffness_t

contains

   !> Assembles it per unit of load factor, in the node axes of the system.
   subroutine new_stress_stiffness(problem, state, system, matrix)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      type(stress_stiffness_t), intent(out) :: matrix
      type(system_t) :: stresses
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements)
      real(wp) :: y(1 + system%n_slides), reaction, t(2), du(6)
      integer :: e, c, d
      y(1) = 1.0_wp
      if (system%n_slides > 0) y(2:) = system%slide_rate
      rate = resultant_rates(problem, system, system%tangent, y)
      stresses = system
      stresses%ef = 0.0_wp
      stresses%eraw = 0.0_wp
      stresses%el = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         if (problem%model%mesh%family(e) == family_ge) then
            call ge_stress_stiffness(problem, state, rate(:, e), e, stresses%ek(:, :, e))
         else
            du(1:3) = to_global(problem, system, system%tangent, problem%model%mesh%node(1, e))
            du(4:6) = to_global(problem, system, system%tangent, problem%model%mesh%node(2, e))
            associate (g => state%geometry%element(e), flexible => problem%compliance(e))
               call ul2_stress_stiffness(g%length, g%chord, 1.0_wp / flexible%axial, element_load(problem, state, e), &
                  & element_displacement(problem, state, e), du, stresses%ek(:, :, e))
            end associate
         end if
      end do
      call sum_elements(problem, stresses)
      matrix%k = stresses%k
      matrix%element = stresses%ek
      allocate (matrix%contact(2, 2, problem%candidates%n), source=0.0_wp)
      ! A reaction on a curved obstacle.
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         associate (node => problem%candidates%node(c))
            reaction = reaction_rate(problem, system, c) * system%bend(c)
            t = [system%normal(2, c), -system%normal(1, c)]
            if (system%turned(node)) call turn_pair(system%axis(:, node), t)
            matrix%contact(:, 1, c) = -reaction * t * t(1)
            matrix%contact(:, 2, c) = -reaction * t * t(2)
            d = dof(problem, node, 1)
         end associate
         matrix%k%a(1, d) = matrix%k%a(1, d) + matrix%contact(1, 1, c)
         matrix%k%a(2, d) = matrix%k%a(2, d) + matrix%contact(2, 1, c)
         matrix%k%a(1, d + 1) = matrix%k%a(1, d + 1) + matrix%contact(2, 2, c)
      end do
   end subroutine new_stress_stiffness

   !> K' x and x^T K' x without the rounding of the sum (see apply_elements).
   subroutine apply_stress(problem, system, matrix, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(stress_stiffness_t), intent(in) :: matrix
      real(wp), intent(in) :: x(:)             !! (n) node axes, zero at the fixed unknowns
      real(wp), intent(out) :: y(:), form
      real(wp) :: force(2)
      integer :: c, d
      call apply_elements(problem, system, matrix%element, problem%model%step(problem%step)%load%pressure, x, y, form)
      do c = 1, problem%candidates%n
         d = dof(problem, problem%candidates%node(c), 1)
         force = matmul(matrix%contact(:, :, c), x(d:d + 1))
         y(d:d + 1) = y(d:d + 1) + force
         form = form + dot_product(x(d:d + 1), force)
      end do
   end subroutine apply_stress

   !> Of one GE element: central differences of its condensed tangent, to the sixth order in n h^2/EI.
   subroutine ge_stress_stiffness(problem, state, dz, e, k)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: dz(:)            !! stored resultants per unit of load factor
      integer, intent(in) :: e
      real(wp), intent(out) :: k(6, 6)
      ! (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! n h^2/EI at the outermost sides
      type(ge_load_t) :: load, shifted
      real(wp) :: force(2, max_stages), f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), step, largest
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
         k = 0.0_wp
         if (.not. largest > 0.0_wp) return
         step = small / largest
         do i = 1, size(sides)
            shifted = load
            shifted%pressure = load%pressure + sides(i) * step * load%pressure_rate
            call ge_evaluate(tab, g%length, g%scale, g%angle, g%chord, flexible, shifted, &
               & element_displacement(problem, state, e), state%z(:z, e), f, raw, part, fl, op, defect, ok, &
               & more_force=sides(i) * step * force(:, :s))
            k = k + (weights(i) / step) * part
         end do
      end associate
   end subroutine ge_stress_stiffness
end module stress_stiffness
