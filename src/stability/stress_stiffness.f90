!> Stress stiffness: change of the tangent by the stresses alone, at fixed geometry.
!>
!> This is the matrix of classical linear buckling, without the displacements of the increment. If these were included in linear
!> form, they would rotate the stiff directions of slender rods without the second-order terms that keep them stiff, and there would
!> be spurious eigenvalues. The stress stiffness of a rod is linear in the stresses; that of an element is not, because its inner
!> unknowns are eliminated. Load factors from the derivative (new_stress_stiffness) have the error O(h^4) for any order of the
!> element; load factors with the finite stresses (stiffness_under) have the accuracy of the element.
module stress_stiffness
   use kinds, only: wp
   use problem, only: problem_t, dof, carried_by
   use rod_state, only: state_t, element_load, end_pressures
   use rod_load, only: ge_load_t
   use linear_system, only: system_t, sum_elements, turn_pair, matrix_to_node, to_global, add_swings, apply_joints, contact_pull
   use tied_nodes, only: tie_swing, node_unknowns, spread_force, add_matrix
   use element_products, only: apply_elements
   use node_axes, only: element_unknowns
   use carried_obstacles, only: load_on_carrier, apply_carried_loads, apply_at_contact, add_at_contact
   use node_loads, only: node_push_t, node_pushes
   use bordered_system, only: resultant_rates, held_force_change
   use node_contact_functional, only: reaction_rate
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use band_matrix, only: band_t, band_sum
   implicit none
   private
   public :: stress_stiffness_t, new_stress_stiffness, stiffness_under, apply_stress

   !> Stress stiffness of the whole structure, as a band matrix and by its parts.
   type :: stress_stiffness_t
      type(band_t) :: k                        !! band matrix by the load factor, node axes
      real(wp), allocatable :: element(:, :, :) !! (6, 6, elements) element matrices, node axes
      real(wp), allocatable :: shift(:, :, :) !! (6, 2, elements) element matrices times a unit translation in x and in y; (6, 2, 0)
      !! without foundations
      real(wp), allocatable :: contact(:, :, :) !! (2, 2, candidates) matrices of contacts at their nodes
      real(wp), allocatable :: pull(:, :)      !! (2, candidates) forces of contacts, see add_at_contact
      real(wp), allocatable :: laid(:, :, :)   !! (9, 9, elements) tangents of loads on conforming elements, see load_on_carrier
      real(wp), allocatable :: swing(:)        !! (ties) geometric stiffness of rigid links
      real(wp), allocatable :: pressure(:, :)  !! (2, elements) follower pressure contained in the matrices, at both ends
      type(node_push_t), allocatable :: push(:) !! loads on nodes with stiffness, node axes
   end type stress_stiffness_t

contains

   !> Assembles the derivative of the stress stiffness by the load factor, in the node axes of the system.
   subroutine new_stress_stiffness(problem, state, system, matrix)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      type(stress_stiffness_t), intent(out) :: matrix
      call sum_stresses(problem, state, system, 0.0_wp, matrix)
   end subroutine new_stress_stiffness

   !> Assembles the stress stiffness for a change of the load factor, and its derivative at this change, in the node axes of the
   !> system.
   subroutine stiffness_under(problem, state, system, factor, matrix, derivative)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(in) :: factor           !! change of the load factor, not 0
      type(stress_stiffness_t), intent(out) :: matrix, derivative
      ! Central differences of an analytic function. Their error, of the order of the square of the step, only makes Newton's method
      ! slower.
      real(wp), parameter :: part = 1.0e-3_wp
      type(stress_stiffness_t) :: more
      integer :: c
      call sum_stresses(problem, state, system, factor, matrix)
      call sum_stresses(problem, state, system, (1.0_wp + part) * factor, more)
      call sum_stresses(problem, state, system, (1.0_wp - part) * factor, derivative)
      derivative%pressure = end_pressures(problem, state, problem%model%step(problem%step)%load)
      derivative%k = band_sum(0.5_wp / (part * factor), more%k, -0.5_wp / (part * factor), derivative%k)
      derivative%element = (more%element - derivative%element) / (2.0_wp * part * factor)
      derivative%shift = (more%shift - derivative%shift) / (2.0_wp * part * factor)
      derivative%swing = (more%swing - derivative%swing) / (2.0_wp * part * factor)
      derivative%contact = (more%contact - derivative%contact) / (2.0_wp * part * factor)
      derivative%pull = (more%pull - derivative%pull) / (2.0_wp * part * factor)
      derivative%laid = (more%laid - derivative%laid) / (2.0_wp * part * factor)
      do c = 1, size(more%push)
         derivative%push(c)%stiffness_rate = (more%push(c)%stiffness_rate - derivative%push(c)%stiffness_rate) / &
            & (2.0_wp * part * factor)
      end do
   end subroutine stiffness_under

   !> Stress stiffness for a change of the load factor; for factor 0 its derivative by the load factor.
   subroutine sum_stresses(problem, state, system, factor, matrix)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(in) :: factor
      type(stress_stiffness_t), intent(out) :: matrix
      type(system_t) :: stresses
      class(rod_element_t), pointer :: rod
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements)
      real(wp) :: reaction, t(2), du(6), shift(6, 2), bent(3, 3), times
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
         rod => rod_at(problem, e)
         call rod%stress_stiffness(problem, state, du, rate(:, e), e, factor, stresses%ek(:, :, e), shift)
         if (size(stresses%eshift, 3) > 0) stresses%eshift(:, :, e) = shift
      end do
      call sum_elements(problem, stresses)
      allocate (matrix%swing(size(system%swing)))
      do c = 1, size(matrix%swing)
         associate (tie => problem%model%tie(c))
            d = dof(problem, tie%node, tie%component)
            matrix%swing(c) = times * tie_swing(tie, state%u, held_force_change(system, d, system%tangent, 1.0_wp))
         end associate
      end do
      call add_swings(problem, system, matrix%swing, stresses%k)
      matrix%k = stresses%k
      matrix%element = stresses%ek
      matrix%shift = stresses%eshift
      matrix%pressure = times * end_pressures(problem, state, problem%model%step(problem%step)%load)
      call load_carriers()
      allocate (matrix%contact(2, 2, problem%candidates%n), source=0.0_wp)
      allocate (matrix%pull(2, problem%candidates%n), source=0.0_wp)
      ! Geometric stiffness of curved obstacles under their reactions.
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         associate (node => problem%candidates%node(c))
            reaction = times * reaction_rate(problem, state, system, c) * system%bend(c)
            t = [system%normal(2, c), -system%normal(1, c)]
            if (system%turned(node)) call turn_pair(system%axis(:, node), t)
            matrix%contact(:, 1, c) = -reaction * t * t(1)
            matrix%contact(:, 2, c) = -reaction * t * t(2)
            bent = 0.0_wp
            bent(1:2, 1:2) = matrix%contact(:, :, c)
            matrix%pull(:, c) = contact_pull(problem, system, c, times * reaction_rate(problem, state, system, c), &
               & times * held_force_change(system, dof(problem, node, 3), system%tangent, 1.0_wp), stresses%ef)
            call add_at_contact(problem, system, c, bent, matrix%pull(:, c), matrix%k)
         end associate
      end do
      matrix%push = node_pushes(problem, state)
      do c = 1, size(matrix%push)
         associate (push => matrix%push(c))
            call matrix_to_node(system, push%node, push%stiffness_rate)
            push%stiffness_rate = times * push%stiffness_rate
            call add_matrix(problem, system%tie_block, [push%node], push%stiffness_rate, matrix%k)
         end associate
      end do

   contains

      !> Adds the tangent of the step's loads on conforming elements, and sets the derivatives of the end forces of these elements.
      subroutine load_carriers()
         type(ge_load_t) :: load
         real(wp) :: force(3), unused(3)
         matrix%laid = 0.0_wp * system%laid
         do e = 1, size(matrix%laid, 3)
            if (carried_by(problem, e) == 0) cycle
            stresses%ef(:, e) = times * (matmul(system%ek(:, :, e), element_unknowns(problem, system, system%tangent, e)) - &
               & system%el(:, e))
            load = element_load(problem, state, e)
            load%line = load%line_rate
            load%pressure = load%pressure_rate
            if (allocated(load%more)) load%more%line = load%more%line_rate
            call load_on_carrier(problem, state, system, e, load, force, unused, matrix%laid(:, :, e))
            matrix%laid(:, :, e) = times * matrix%laid(:, :, e)
            call add_matrix(problem, system%slip_block, [carried_by(problem, e), problem%model%mesh%node(:, e)], &
               & matrix%laid(:, :, e), matrix%k)
         end do
      end subroutine load_carriers
   end subroutine sum_stresses

   !> K' x and x^T K' x, without the rounding error of the assembled sum (see apply_elements).
   subroutine apply_stress(problem, system, matrix, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(stress_stiffness_t), intent(in) :: matrix
      real(wp), intent(in) :: x(:)             !! (n) vector, node axes; zero at the fixed unknowns
      real(wp), intent(out) :: y(:), form      !! (n) product; x^T y
      real(wp) :: force(3), moved(3), bent(3, 3)
      integer :: c
      call apply_elements(problem, system, matrix%element, matrix%shift, matrix%pressure, x, y, form)
      call apply_joints(problem, system, matrix%swing, .false., x, y, form)
      call apply_carried_loads(problem, system, matrix%laid, x, y, form)
      bent = 0.0_wp
      do c = 1, problem%candidates%n
         bent(1:2, 1:2) = matrix%contact(:, :, c)
         call apply_at_contact(problem, system, c, bent, matrix%pull(:, c), x, y, form)
      end do
      do c = 1, size(matrix%push)
         associate (node => matrix%push(c)%node)
            moved = node_unknowns(problem, system%tie_block, node, x)
            force = matmul(matrix%push(c)%stiffness_rate, moved)
            call spread_force(problem, system%tie_block, node, force, y)
            form = form + dot_product(moved, force)
         end associate
      end do
   end subroutine apply_stress
end module stress_stiffness
