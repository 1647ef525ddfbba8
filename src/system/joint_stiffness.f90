!> Springs between two nodes, and the geometric stiffness of rigid links.
module joint_stiffness
   use kinds, only: wp
   use model, only: joint_spring_t
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use band_matrix, only: band_t
   use tied_nodes, only: tie_swing, node_unknowns, spread_force, add_matrix
   use system_type, only: system_t
   use node_axes, only: to_node, matrix_to_node
   implicit none
   private
   public :: add_joint_springs, set_swings, add_swings, apply_joints

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
            call add_matrix(problem, system%tie_block, spring%node, k, system%k)
         end associate
      end do
   end subroutine add_joint_springs

   !> Derivatives of a spring's elongation with respect to the increments of its two nodes (node_unknowns).
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

   !> Computes the geometric stiffness of rigid links.
   pure subroutine set_swings(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! contains the residual, which at a tied component is the force of the tie
      integer :: i
      do i = 1, size(system%swing)
         associate (tie => problem%model%tie(i))
            system%swing(i) = tie_swing(tie, state%u, system%residual(dof(problem, tie%node, tie%component)))
         end associate
      end do
   end subroutine set_swings

   !> Adds the geometric stiffness of rigid links to a band.
   pure subroutine add_swings(problem, system, swing, band)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: swing(:)         !! (ties) geometric stiffness from set_swings
      type(band_t), intent(inout) :: band
      real(wp) :: k(3, 3)
      integer :: i
      do i = 1, size(swing)
         if (.not. abs(swing(i)) > 0.0_wp) cycle
         k = 0.0_wp
         k(3, 3) = swing(i)
         call matrix_to_node(system, problem%model%tie(i)%turner, k)
         call add_matrix(problem, system%tie_block, [problem%model%tie(i)%turner], k, band)
      end do
   end subroutine add_swings

   !> Adds to y the products of springs between nodes, and of the geometric stiffness of rigid links, with a vector x.
   pure subroutine apply_joints(problem, system, swing, springs, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: swing(:)         !! (ties) geometric stiffness from set_swings
      logical, intent(in) :: springs           !! true: springs are included; false: only rigid links
      real(wp), intent(in) :: x(:)             !! (n) vector, node axes
      real(wp), intent(inout) :: y(:)          !! (n) products; in/out: these products are added
      real(wp), intent(inout) :: form          !! x^T y; in/out: x^T times these products is added
      real(wp) :: row(6), du(3), stretch
      integer :: i, j
      do i = 1, size(swing)
         if (.not. abs(swing(i)) > 0.0_wp) cycle
         associate (node => problem%model%tie(i)%turner)
            row(:3) = [0.0_wp, 0.0_wp, 1.0_wp]
            call to_node(system, node, row(:3))
            du = node_unknowns(problem, system%tie_block, node, x)
            stretch = dot_product(row(:3), du)
            call spread_force(problem, system%tie_block, node, (swing(i) * stretch) * row(:3), y)
            form = form + swing(i) * stretch**2
         end associate
      end do
      if (.not. springs) return
      do i = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(i))
            row = joint_row(system, spring)
            stretch = 0.0_wp
            do j = 1, 2
               stretch = stretch + dot_product(row(3 * j - 2:3 * j), &
                  & node_unknowns(problem, system%tie_block, spring%node(j), x))
            end do
            do j = 1, 2
               call spread_force(problem, system%tie_block, spring%node(j), (spring%stiffness * stretch) * row(3 * j - 2:3 * j), y)
            end do
            form = form + spring%stiffness * stretch**2
         end associate
      end do
   end subroutine apply_joints
end module joint_stiffness
