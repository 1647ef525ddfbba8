!> Stress stiffness: what stresses alone add to the tangent, the geometry held.
!>
!> This is the matrix of classical linear buckling. The displacements of the increment are left out on purpose: linearised,
!> they turn the stiff directions of slender rods without the second-order terms that keep them stiff, and the pencil
!> then has eigenvalues that no structure has. Of a rod the stiffness is linear in the stresses, of an element, whose inner
!> unknowns are eliminated, it is not: its derivative (new_stress_stiffness) errs by O(h^4) in the load factors, whatever the
!> order; at the load factor itself (stiffness_under) they are as good as the element.
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
   public :: stress_stiffness_t, new_stress_stiffness, stiffness_under, apply_stress

   type :: stress_stiffness_t
      type(band_t) :: k                        !! per unit of load factor, node axes
      real(wp), allocatable :: element(:, :, :) !! (6, 6, elements) its elements, node axes
      real(wp), allocatable :: shift(:, :, :)  !! (6, 2, elements) these times unit translations, (6, 2, 0) without foundations
      real(wp), allocatable :: contact(:, :, :) !! (2, 2, candidates) and its contacts
      real(wp), allocatable :: swing(:)        !! (ties) what the forces of rigid links add against rotation
      real(wp), allocatable :: pressure(:)     !! (elements) that makes a part of it
   end type stress_stiffness_t

contains

   !> Assembles its derivative by the load factor, in the node axes of the system.
   subroutine new_stress_stiffness(problem, state, system, matrix)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      type(stress_stiffness_t), intent(out) :: matrix
      call sum_stresses(problem, state, system, 0.0_wp, matrix)
   end subroutine new_stress_stiffness

   !> Assembles it under the stresses of a change of the load factor, in the node axes of the system; and its derivative there.
   subroutine stiffness_under(problem, state, system, factor, matrix, derivative)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(in) :: factor           !! the change, not 0
      type(stress_stiffness_t), intent(out) :: matrix, derivative
      ! Central differences of an analytic function: an error of the square, in what Newton's method divides by.
      real(wp), parameter :: part = 1.0e-3_wp
      type(stress_stiffness_t) :: more
      call sum_stresses(problem, state, system, factor, matrix)
      call sum_stresses(problem, state, system, (1.0_wp + part) * factor, more)
      call sum_stresses(problem, state, system, (1.0_wp - part) * factor, derivative)
      derivative%pressure = problem%model%step(problem%step)%load%pressure
      derivative%k%a = (more%k%a - derivative%k%a) / (2.0_wp * part * factor)
      derivative%element = (more%element - derivative%element) / (2.0_wp * part * factor)
      derivative%shift = (more%shift - derivative%shift) / (2.0_wp * part * factor)
      derivative%swing = (more%swing - derivative%swing) / (2.0_wp * part * factor)
      derivative%contact = (more%contact - derivative%contact) / (2.0_wp * part * factor)
   end subroutine stiffness_under

   !> The stress stiffness under a change of the load factor; its derivative per unit of load factor where the change is 0.
   subroutine sum_stresses(problem, state, system, factor, matrix)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(in) :: factor
      type(stress_stiffness_t), intent(out) :: matrix
      type(system_t) :: stresses
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements)
      real(wp) :: reaction, t(2), du(6), shift(6, 2), times
      integer :: e, c, d
      times = factor
      if (.not. abs(factor) > 0.0_wp) times = 1.0_wp
      rate = resultant_rates(problem, system, system%tangent, 1.0_wp)
      stresses = system
      stresses%ef = 0.0_wp
      stresses%eraw = 0.0_wp
      stresses%el = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         du(1:3) = to_global(problem, system, system%tangent, problem%model%mesh%node(1, e))
         du(4:6) = to_global(problem, system, system%tangent, problem%model%mesh%node(2, e))
         if (problem%conforms(e) > 0) then
            ! On an obstacle of constant curvature all strains are linear in the displacements.
            stresses%ek(:, :, e) = 0.0_wp
            if (size(stresses%eshift, 3) > 0) stresses%eshift(:, :, e) = 0.0_wp
         else if (problem%model%mesh%family(e) == family_ge) then
            call ge_stress_stiffness(problem, state, du, rate(:, e), e, factor, stresses%ek(:, :, e), shift)
            if (size(stresses%eshift, 3) > 0) stresses%eshift(:, :, e) = shift
         else
            associate (g => state%geometry%element(e), flexible => problem%compliance(e))
               call ul2_stress_stiffness(g%length, g%chord, 1.0_wp / flexible%axial, element_load(problem, state, e), &
                  & element_displacement(problem, state, e), du, stresses%ek(:, :, e))
            end associate
            stresses%ek(:, :, e) = times * stresses%ek(:, :, e)
         end if
      end do
      call sum_elements(problem, stresses)
      allocate (matrix%swing(size(system%swing)))
      do c = 1, size(matrix%swing)
         associate (tie => problem%model%tie(c))
            d = dof(problem, tie%node, tie%component)
            matrix%swing(c) = times * tie_swing(tie, state%u, row_times(system, d, system%tangent) - system%load(d))
         end associate
      end do
      call add_swings(problem, system, matrix%swing, stresses%k)
      matrix%k = stresses%k
      matrix%element = stresses%ek
      matrix%shift = stresses%eshift
      matrix%pressure = times * problem%model%step(problem%step)%load%pressure
      allocate (matrix%contact(2, 2, problem%candidates%n), source=0.0_wp)
      ! A reaction on a curved obstacle.
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         associate (node => problem%candidates%node(c))
            reaction = times * reaction_rate(problem, system, c) * system%bend(c)
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
   end subroutine sum_stresses

   !> K' x and x^T K' x without the rounding of the sum (see apply_elements).
   subroutine apply_stress(problem, system, matrix, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(stress_stiffness_t), intent(in) :: matrix
      real(wp), intent(in) :: x(:)             !! (n) node axes, zero at the fixed unknowns
      real(wp), intent(out) :: y(:), form
      real(wp) :: force(2)
      integer :: c, d
      call apply_elements(problem, system, matrix%element, matrix%shift, matrix%pressure, x, y, form)
      call apply_joints(problem, system, matrix%swing, .false., x, y, form)
      do c = 1, problem%candidates%n
         d = dof(problem, problem%candidates%node(c), 1)
         force = matmul(matrix%contact(:, :, c), x(d:d + 1))
         y(d:d + 1) = y(d:d + 1) + force
         form = form + dot_product(x(d:d + 1), force)
      end do
   end subroutine apply_stress

   !> Of one GE element, under a change of the load factor: what it adds to the condensed tangent. Where the change is 0 the
   !> derivative, by central differences, to the sixth order in n h^2/EI.
   subroutine ge_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6)            !! node displacements per unit of load factor
      real(wp), intent(in) :: dz(:)            !! stored resultants per unit of load factor
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(out) :: k(6, 6)
      real(wp), intent(out) :: shift(6, 2)     !! k times unit translations
      ! (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! n h^2/EI at the outermost sides
      type(ge_load_t) :: load
      real(wp) :: force(2, max_stages), step, largest
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
               force(:, i) = dz(1:2) - (tab%c(i) * g%length) * load%line_rate
            end if
         end do
         largest = maxval(abs(force(:, :s))) * g%length**2 * flexible%bending
         largest = max(largest, abs(load%pressure_rate) * g%length**3 * flexible%bending)
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

      !> Adds the condensed tangent under the stresses of a part of the load, times a weight.
      subroutine add(part_of_load, weight)
         real(wp), intent(in) :: part_of_load, weight
         type(ge_load_t) :: shifted
         real(wp) :: f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), moved(6, 2)
         logical :: ok
         shifted = load
         shifted%pressure = load%pressure + part_of_load * load%pressure_rate
         pressed = inner
         if (inner%n > 0) call press(part_of_load)
         associate (g => state%geometry%element(e))
            call ge_evaluate(problem%tableau(s), g%length, g%scale, g%angle, g%chord, problem%compliance(e), shifted, &
               & element_displacement(problem, state, e), state%z(:z, e), f, raw, part, fl, op, defect, ok, &
               & more_force=part_of_load * force(:, :s), inner=pressed, shift=moved)
         end associate
         k = k + weight * part
         shift = shift + weight * moved
      end subroutine add

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
