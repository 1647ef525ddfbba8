!> Stress stiffness: change of the tangent by the stresses alone, at fixed geometry.
!>
!> This is the matrix of classical linear buckling, without the change of the tangent by the displacements of the load increment.
!> Included in linear form, these displacements would rotate the stiff axial directions of slender rods without the second-order
!> terms that belong to the rotation, and cause spurious eigenvalues. The stress stiffness of a rod is linear in the stresses; the
!> stress stiffness of an element is not, because the inner unknowns of the element are eliminated. Load factors from the derivative
!> (new_stress_stiffness) have the error O(h^4) for any order of the element; load factors with the finite stresses
!> (stiffness_under) have the accuracy of the element.
module stress_stiffness
   use kinds, only: wp
   use problem, only: problem_t, dof, carried_by
   use rod_state, only: state_t, element_load, end_pressures
   use rod_load, only: ge_load_t
   use linear_system, only: system_t, sum_elements, turn_pair, matrix_to_node, to_global, contact_pull
   use node_matrices, only: node_matrices_t, add_node_matrices, apply_node_matrices, combined
   use tied_nodes, only: tie_swing
   use joint_stiffness, only: swing_matrix
   use element_products, only: apply_elements
   use node_axes, only: element_unknowns
   use carried_obstacles, only: load_on_carrier, with_carrier
   use node_loads, only: node_push_t, node_pushes
   use bordered_system, only: resultant_rates, held_force_change
   use node_contact_functional, only: reaction_rate
   use rod_equations, only: rod_stress_stiffness
   use band_matrix, only: band_t, band_sum
   implicit none
   private
   public :: stress_stiffness_t, new_stress_stiffness, stiffness_under, apply_stress

   !> Stress stiffness of the whole structure, as a band matrix and as the matrices of elements and nodes of which it is the sum.
   type :: stress_stiffness_t
      type(band_t) :: k                        !! assembled band matrix, node axes
      real(wp), allocatable :: element(:, :, :) !! (6, 6, elements) element matrices, node axes
      real(wp), allocatable :: shift(:, :, :) !! (6, 2, elements) element matrices times a unit translation in x and in y; (6, 2, 0)
      !! without foundations
      type(node_matrices_t) :: at_nodes        !! matrices of single nodes and of pairs, see system_t
      real(wp), allocatable :: pressure(:, :) !! (2, elements) follower pressure whose stiffness the matrices contain, at both ends
      !! of each element
   end type stress_stiffness_t

contains

   !> Assembles the stress stiffness for a change of the load factor, and its derivative at this change, in the node axes of the
   !> system.
   subroutine stiffness_under(problem, state, system, factor, matrix, derivative)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(in) :: factor           !! change of the load factor, not 0
      type(stress_stiffness_t), intent(out) :: matrix, derivative
      ! The derivative is a central difference with this relative step. Its error, of the order of the square of the step, only
      ! makes Newton's method slower.
      real(wp), parameter :: part = 1.0e-3_wp
      type(stress_stiffness_t) :: more
      real(wp) :: over
      call new_stress_stiffness(problem, state, system, factor, matrix)
      call new_stress_stiffness(problem, state, system, (1.0_wp + part) * factor, more)
      call new_stress_stiffness(problem, state, system, (1.0_wp - part) * factor, derivative)
      derivative%pressure = end_pressures(problem, state, problem%model%step(problem%step)%load)
      over = 0.5_wp / (part * factor)
      derivative%k = band_sum(over, more%k, -over, derivative%k)
      derivative%element = over * (more%element - derivative%element)
      derivative%shift = over * (more%shift - derivative%shift)
      derivative%at_nodes = combined(over, more%at_nodes, -over, derivative%at_nodes)
   end subroutine stiffness_under

   !> Assembles the stress stiffness for the change `factor` of the load factor, in the node axes of the system; for factor 0, the
   !> derivative of the stress stiffness by the load factor.
   subroutine new_stress_stiffness(problem, state, system, factor, matrix)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(in) :: factor
      type(stress_stiffness_t), intent(out) :: matrix
      type(system_t) :: stresses
      type(node_push_t), allocatable :: push(:)
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements), du(6), shift(6, 2)
      real(wp) :: k(3, 3), reaction, t(2), pull(2), times
      integer :: e, c
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
         call rod_stress_stiffness(problem, state, du, rate(:, e), e, factor, stresses%ek(:, :, e), shift)
         if (size(stresses%eshift, 3) > 0) stresses%eshift(:, :, e) = shift
      end do
      call sum_elements(problem, stresses)
      matrix%k = stresses%k
      matrix%element = stresses%ek
      matrix%shift = stresses%eshift
      matrix%pressure = times * end_pressures(problem, state, problem%model%step(problem%step)%load)
      do c = 1, size(problem%model%tie)
         associate (tie => problem%model%tie(c))
            if (tie%turner > 0) call matrix%at_nodes%append([tie%turner], swing_matrix(system, tie%turner, times * &
               & tie_swing(tie, state%u, held_force_change(system, dof(problem, tie%node, tie%component), system%tangent, 1.0_wp))))
         end associate
      end do
      call load_carriers()
      ! A reaction turns when its node slides along a curved obstacle: geometric stiffness of the reaction.
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         associate (node => problem%candidates%node(c), carrier => problem%model%obstacle(problem%candidates%obstacle(c))%carrier)
            reaction = times * reaction_rate(problem, state, system, c)
            t = [system%normal(2, c), -system%normal(1, c)]
            if (system%turned(node)) call turn_pair(system%axis(:, node), t)
            k = 0.0_wp
            k(1:2, 1) = -reaction * system%bend(c) * t * t(1)
            k(1:2, 2) = -reaction * system%bend(c) * t * t(2)
            if (carrier == 0) then
               call matrix%at_nodes%append([node], k)
            else
               pull = contact_pull(problem, system, c, reaction, &
                  & times * held_force_change(system, dof(problem, node, 3), system%tangent, 1.0_wp), stresses%ef)
               call matrix%at_nodes%append([node, carrier], with_carrier(problem, system, c, k, pull), relative=.true.)
            end if
         end associate
      end do
      push = node_pushes(problem, state)
      do c = 1, size(push)
         call matrix_to_node(system, push(c)%node, push(c)%stiffness_rate)
         call matrix%at_nodes%append([push(c)%node], times * push(c)%stiffness_rate)
      end do
      call add_node_matrices(problem, system%tie_block, system%slip_block, matrix%at_nodes, matrix%k)

   contains

      !> For conforming elements on obstacles that a node carries: adds the tangent of the step's loads on these elements, and sets
      !> the change of their end forces.
      subroutine load_carriers()
         type(ge_load_t) :: load
         real(wp) :: force(3), unused(3), laid(9, 9)
         if (size(problem%ties%carrier) == 0) return
         do e = 1, problem%model%mesh%n_elements
            if (carried_by(problem, e) == 0) cycle
            stresses%ef(:, e) = times * (matmul(system%ek(:, :, e), element_unknowns(problem, system, system%tangent, e)) - &
               & system%el(:, e))
            load = element_load(problem, state, e)
            load%line = load%line_rate
            load%pressure = load%pressure_rate
            if (allocated(load%more)) load%more%line = load%more%line_rate
            call load_on_carrier(problem, state, system, e, load, force, unused, laid)
            call matrix%at_nodes%append([carried_by(problem, e), problem%model%mesh%node(:, e)], times * laid, relative=.true.)
         end do
      end subroutine load_carriers
   end subroutine new_stress_stiffness

   !> Multiplies the stress stiffness by x, and forms x^T y, from the parts and thus without the rounding error of the assembled
   !> matrix (see apply_elements).
   subroutine apply_stress(problem, system, matrix, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(stress_stiffness_t), intent(in) :: matrix
      real(wp), intent(in) :: x(:)             !! (n) vector, node axes; zero at the fixed unknowns
      real(wp), intent(out) :: y(:), form      !! (n) product; x^T y
      call apply_elements(problem, system, matrix%element, matrix%shift, matrix%pressure, x, y, form)
      call apply_node_matrices(problem, system%tie_block, system%slip_block, matrix%at_nodes, x, y, form)
   end subroutine apply_stress
end module stress_stiffness
