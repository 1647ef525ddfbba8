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
   use linear_system, only: system_t, sum_elements, turn_pair, to_global, row_times, add_swings, apply_joints
   use tied_nodes, only: tie_swing
   use element_products, only: apply_elements
   use bordered_system, only: resultant_rates
   use contact_set, only: reaction_rate
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use ge_element, only: ge_evaluate, ge_direction_rates, ge_load_t, ge_columns
   use ul2_element, only: ul2_stress_stiffness
   use band_matrix, only: band_t
   implicit none
   private
   public :: stress_stiffness_t, new_stress_stiffness, apply_stress

   type :: stress_stiffness_t
      type(band_t) :: k                        !! per unit of load factor, node axes
      real(wp), allocatable :: element(:, :, :) !! (6, 6, elements) its elements, node axes
      real(wp), allocatable :: shift(:, :, :)  !! (6, 2, elements) these times unit translations, (6, 2, 0) without foundations
      real(wp), allocatable :: contact(:, :, :) !! (2, 2, candidates) and its contacts
      real(wp), allocatable :: swing(:)        !! (ties) what the forces of rigid links add against rotation
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
      real(wp) :: reaction, t(2), du(6), shift(6, 2)
      integer :: e, c, d
      rate = resultant_rates(problem, system, system%tangent, 1.0_wp)
      stresses = system
      stresses%ef = 0.0_wp
      stresses%eraw = 0.0_wp
      stresses%el = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         if (problem%model%mesh%family(e) == family_ge) then
            du(1:3) = to_global(problem, system, system%tangent, problem%model%mesh%node(1, e))
            du(4:6) = to_global(problem, system, system%tangent, problem%model%mesh%node(2, e))
            call ge_stress_stiffness(problem, state, du, rate(:, e), e, stresses%ek(:, :, e), shift)
            if (size(stresses%eshift, 3) > 0) stresses%eshift(:, :, e) = shift
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
      allocate (matrix%swing(size(system%swing)))
      do c = 1, size(matrix%swing)
         associate (tie => problem%model%tie(c))
            d = dof(problem, tie%node, tie%component)
            matrix%swing(c) = tie_swing(tie, state%u, row_times(system, d, system%tangent) - system%load(d))
         end associate
      end do
      call add_swings(problem, system, matrix%swing, stresses%k)
      matrix%k = stresses%k
      matrix%element = stresses%ek
      matrix%shift = stresses%eshift
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
      call apply_elements(problem, system, matrix%element, matrix%shift, problem%model%step(problem%step)%load%pressure, &
         & x, y, form)
      call apply_joints(problem, system, matrix%swing, .false., x, y, form)
      do c = 1, problem%candidates%n
         d = dof(problem, problem%candidates%node(c), 1)
         force = matmul(matrix%contact(:, :, c), x(d:d + 1))
         y(d:d + 1) = y(d:d + 1) + force
         form = form + dot_product(x(d:d + 1), force)
      end do
   end subroutine apply_stress

   !> Of one GE element: central differences of its condensed tangent, to the sixth order in n h^2/EI.
   subroutine ge_stress_stiffness(problem, state, du, dz, e, k, shift)
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
   end subroutine ge_stress_stiffness
end module stress_stiffness
