!> Springs between two nodes, and the geometric stiffness of rigid links.
module joint_stiffness
   use kinds, only: wp
   use model, only: joint_spring_t
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use tied_nodes, only: tie_swing, spread_force
   use system_type, only: system_t
   use node_axes, only: to_node, matrix_to_node
   implicit none
   private
   public :: add_joint_springs, add_links, swing_matrix

contains

   !> Adds springs between two nodes, whose force is proportional to the difference of the nodes' displacements.
   subroutine add_joint_springs(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: k(6, 6), row(6), force
      integer :: i, j
      do i = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(i))
            row = joint_row(system, spring)
            force = spring%stiffness * (state%u(spring%component, spring%node(2)) - state%u(spring%component, spring%node(1)))
            do j = 1, 2
               call spread_force(problem, system%tie_block, spring%node(j), force * row(3 * j - 2:3 * j), system%residual)
            end do
            do j = 1, 6
               k(:, j) = (spring%stiffness * row(j)) * row
            end do
            call system%at_nodes%append(spring%node, k)
         end associate
      end do
   end subroutine add_joint_springs

   !> Derivatives of a spring's elongation by the increments of displacements and rotations of its two nodes, in node axes.
   pure function joint_row(system, spring) result(row)
      type(system_t), intent(in) :: system     !! provides the node axes
      type(joint_spring_t), intent(in) :: spring
      real(wp) :: row(6)
      integer :: j
      row = 0.0_wp
      row(spring%component) = -1.0_wp
      row(3 + spring%component) = 1.0_wp
      do j = 1, 2
         call to_node(system, spring%node(j), row(3 * j - 2:3 * j))
      end do
   end function joint_row

   !> Adds the geometric stiffness of rigid links.
   subroutine add_links(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! contains the residual, which at a tied component is the force of the tie
      integer :: i
      do i = 1, size(problem%model%tie)
         associate (tie => problem%model%tie(i))
            if (tie%turner > 0) call system%at_nodes%append([tie%turner], swing_matrix(system, tie%turner, &
               & tie_swing(tie, state%u, system%residual(dof(problem, tie%node, tie%component)))))
         end associate
      end do
   end subroutine add_links

   !> Rotational stiffness at a node as a matrix in the node's axes.
   pure function swing_matrix(system, node, swing) result(k)
      type(system_t), intent(in) :: system     !! provides the node axes
      integer, intent(in) :: node
      real(wp), intent(in) :: swing            !! rotational stiffness, see tie_swing
      real(wp) :: k(3, 3)
      k = 0.0_wp
      k(3, 3) = swing
      call matrix_to_node(system, node, k)
   end function swing_matrix
end module joint_stiffness
