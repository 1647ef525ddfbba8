!> Transformations of vectors, forces and stiffness matrices at nodes from global axes to the axes of the unknowns, and back.
module node_axes
   use kinds, only: wp
   use problem, only: problem_t, carried_by
   use system_type, only: system_t
   use tied_nodes, only: node_unknowns, spread_force
   implicit none
   private
   public :: to_node, turn_force, turn_pair, matrix_to_node, own_axes, to_global, element_unknowns, relative_increments, &
      & spread_element

contains

   !> Transforms a force and a moment on a node, or coefficients of its displacements, to the axes of the node.
   pure subroutine to_node(system, node, force)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp), intent(inout) :: force(3)      !! force (x, y) and moment; in: global axes; out: node axes
      if (system%turned(node)) call turn_force(system%axis(:, node), system%roll(node), system%lean(node), force)
   end subroutine to_node

   !> Transforms a force and a moment on a node to the axes of the node. In these axes the first unknown also rotates the node with
   !> the track (`roll`), and the third unknown also displaces the node along the normal (`lean`).
   pure subroutine turn_force(axis, roll, lean, force)
      real(wp), intent(in) :: axis(2), roll, lean !! first axis of the node; couplings `roll` and `lean` of its unknowns, see
      !! system_t
      real(wp), intent(inout) :: force(3)         !! force (x, y) and moment; in: global axes; out: node axes
      call turn_pair(axis, force(1:2))
      force(1) = force(1) + roll * force(3)
      force(3) = force(3) + lean * force(2)
   end subroutine turn_force

   !> Components of a vector along a unit vector and along the normal to its left.
   pure subroutine turn_pair(axis, v)
      real(wp), intent(in) :: axis(2) !! unit vector
      real(wp), intent(inout) :: v(2) !! vector; in: global axes; out: components along axis and normal
      v = [axis(1) * v(1) + axis(2) * v(2), axis(1) * v(2) - axis(2) * v(1)]
   end subroutine turn_pair

   !> Transforms a stiffness matrix at a node to the axes of the node.
   pure subroutine matrix_to_node(system, node, k)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp), intent(inout) :: k(3, 3) !! stiffness matrix; in: global axes; out: node axes
      integer :: i
      do i = 1, 3
         call to_node(system, node, k(:, i))
      end do
      do i = 1, 3
         call to_node(system, node, k(i, :))
      end do
   end subroutine matrix_to_node

   !> Matrix that transforms the unknowns of a node to its displacements and rotation in global axes.
   pure function own_axes(system, node) result(matrix)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp) :: matrix(3, 3)
      matrix = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      if (.not. system%turned(node)) return
      associate (a => system%axis(:, node))
         matrix(1:2, 1) = a
         matrix(1:2, 2) = [-a(2), a(1)]
         matrix(3, 1) = system%roll(node)
         matrix(1:2, 3) = system%lean(node) * matrix(1:2, 2)
      end associate
   end function own_axes

   !> Increments of an element's nodes in node axes. For an element on a carried obstacle the increments are relative to the
   !> obstacle.
   pure function element_unknowns(problem, system, x, e) result(local)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)             !! (n) increments of the unknowns, node axes
      integer, intent(in) :: e
      real(wp) :: local(6)
      integer :: i
      do i = 1, 2
         associate (node => problem%model%mesh%node(i, e), own => local(3 * i - 2:3 * i))
            if (carried_by(problem, e) > 0) then
               own = node_unknowns(problem, system%slip_block, node, x)
            else
               own = node_unknowns(problem, system%tie_block, node, x)
            end if
         end associate
      end do
   end function element_unknowns

   !> Increments of the nodes of an element on a carried obstacle, relative to the obstacle and in global axes. The third entry of
   !> the first node is the rotation of the obstacle; the third entry of the second node is zero (see evaluate_conforming).
   pure function relative_increments(problem, system, x, e) result(du)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)             !! (n) increments of the unknowns, node axes
      integer, intent(in) :: e
      real(wp) :: du(6), own(6), axes(3, 3)
      integer :: i
      own = element_unknowns(problem, system, x, e)
      do i = 1, 2
         axes = own_axes(system, problem%model%mesh%node(i, e))
         du(3 * i - 2:3 * i) = matmul(axes, own(3 * i - 2:3 * i))
      end do
      own(:3) = to_global(problem, system, x, carried_by(problem, e))
      du(3) = own(3)
      du(6) = 0.0_wp
   end function relative_increments

   !> Adds the end forces of an element, in node axes, to the forces on the unknowns.
   pure subroutine spread_element(problem, system, e, force, vector)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: e
      real(wp), intent(in) :: force(6)
      real(wp), intent(inout) :: vector(:)     !! (n) forces on the unknowns
      integer :: i
      do i = 1, 2
         associate (node => problem%model%mesh%node(i, e))
            if (carried_by(problem, e) > 0) then
               call spread_force(problem, system%slip_block, node, force(3 * i - 2:3 * i), vector)
            else
               call spread_force(problem, system%tie_block, node, force(3 * i - 2:3 * i), vector)
            end if
         end associate
      end do
   end subroutine spread_element

   !> Increment of a node in global axes.
   pure function to_global(problem, system, x, node) result(du)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:) !! (n) increments of the unknowns, node axes
      integer, intent(in) :: node
      real(wp) :: du(3), own(3), normal
      du = node_unknowns(problem, system%tie_block, node, x)
      if (.not. system%turned(node)) return
      own = du
      associate (a => system%axis(:, node))
         normal = own(2) + system%lean(node) * own(3)
         du(1:2) = [a(1) * own(1) - a(2) * normal, a(2) * own(1) + a(1) * normal]
         du(3) = own(3) + system%roll(node) * own(1)
      end associate
   end function to_global
end module node_axes
