!> Tied nodes: their displacements as functions of the unknowns, and the corresponding transformation of forces and matrices.
!>
!> The unknown of a tied component is its difference from the value that the tie prescribes. This unknown is fixed at zero, like the
!> unknown of a support. Let u = T(q) be the displacements of all nodes as functions of the unknowns q. Forces f on the nodes are
!> then forces T'^T f on the unknowns. The tangent K becomes T'^T K T'; for a tie that rotates with a node (rigid link) the tie
!> force times the second derivative of T is added. The derivative T' differs from the unit matrix only in the blocks of this
!> module, and in the blocks of nodes that touch carried obstacles (carried_obstacles).
module tied_nodes
   use kinds, only: wp
   use model, only: tie_t
   use problem, only: problem_t, dof
   use band_matrix, only: band_t, add_entry
   implicit none
   private
   public :: set_blocks, tie_value, tie_swing, turned_arm, node_unknowns, spread_force, add_matrix

contains

   !> Sets the blocks of T' at a state: for each tied node the derivatives of its displacements and rotation with respect to the
   !> unknowns of the nodes that it follows.
   subroutine set_blocks(problem, u, turned, axis, roll, lean, block)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: u(:, :)            !! (3, nodes) displacements
      logical, intent(in) :: turned(:)           !! (nodes) true: rotated axes, see system_t; false for tied nodes
      real(wp), intent(in) :: axis(:, :), roll(:), lean(:) !! (2, nodes) first axis; (nodes) couplings of the unknowns; see system_t
      real(wp), intent(inout) :: block(:, :, :) !! (3, 3, size(problem%ties%of)) blocks, rows: global axes, columns: node axes. In:
      !! the blocks of nodes that touch carried obstacles are set; out: all blocks
      real(wp) :: arm(2)
      integer :: i, k, n
      do n = 1, size(problem%ties%follows)
         if (.not. problem%ties%follows(n)) cycle
         block(:, :, problem%ties%first(n):problem%ties%first(n + 1) - 1) = 0.0_wp
         do i = 1, 3
            block(i, i, problem%ties%first(n)) = 1.0_wp
         end do
      end do
      do i = 1, size(problem%model%tie)
         associate (tie => problem%model%tie(i))
            do k = 1, size(tie%of)
               call add_row(tie%node, tie%component, tie%of(k), tie%part(k), tie%factor(k))
            end do
            if (tie%turner == 0 .or. tie%component == 3) cycle
            arm = turned_arm(tie, u(3, tie%turner))
            call add_row(tie%node, tie%component, tie%turner, 3, merge(-arm(2), arm(1), tie%component == 1))
         end associate
      end do

   contains

      !> Adds to the row of a tied component `factor` times component `part` of node `of`, expressed by the unknowns of that node.
      subroutine add_row(node, component, of, part, factor)
         integer, intent(in) :: node, component, of, part
         real(wp), intent(in) :: factor
         real(wp) :: row(3)
         integer :: b, to
         associate (first => problem%ties%first, list => problem%ties%of)
            if (.not. problem%ties%follows(of)) then
               to = first(node) - 1 + findloc(list(first(node):first(node + 1) - 1), of, 1)
               block(component, :, to) = block(component, :, to) + factor * own_row(of, part)
               ! The node `of` may touch carried obstacles. It then also follows the nodes that carry these obstacles.
               do b = first(of), first(of + 1) - 1
                  to = first(node) - 1 + findloc(list(first(node):first(node + 1) - 1), list(b), 1)
                  block(component, :, to) = block(component, :, to) + factor * matmul(own_row(of, part), block(:, :, b))
               end do
               return
            end if
            do b = first(of), first(of + 1) - 1
               row = block(part, :, b)
               if (.not. any(abs(row) > 0.0_wp)) cycle
               to = first(node) - 1 + findloc(list(first(node):first(node + 1) - 1), list(b), 1)
               block(component, :, to) = block(component, :, to) + factor * row
            end do
         end associate
      end subroutine add_row

      !> A displacement or the rotation of an untied node as a linear function of the unknowns of this node.
      pure function own_row(node, part) result(row)
         integer, intent(in) :: node, part
         real(wp) :: row(3)
         row = 0.0_wp
         row(part) = 1.0_wp
         if (.not. turned(node)) return
         select case (part)
         case (1)
            row = [axis(1, node), -axis(2, node), -axis(2, node) * lean(node)]
         case (2)
            row = [axis(2, node), axis(1, node), axis(1, node) * lean(node)]
         case default
            row = [roll(node), 0.0_wp, 1.0_wp]
         end select
      end function own_row
   end subroutine set_blocks

   !> Value that a tie prescribes for its component.
   pure real(wp) function tie_value(tie, u) result(value)
      type(tie_t), intent(in) :: tie
      real(wp), intent(in) :: u(:, :)            !! (3, nodes) displacements
      real(wp) :: half, change(2)
      integer :: k
      value = 0.0_wp
      do k = 1, size(tie%of)
         value = value + tie%factor(k) * u(tie%part(k), tie%of(k))
      end do
      if (tie%turner == 0 .or. tie%component == 3) return
      ! (R - 1) arm, with the rotation matrix R, in a form without cancellation.
      half = 0.5_wp * u(3, tie%turner)
      change = (2.0_wp * sin(half)) * [-sin(half) * tie%arm(1) - cos(half) * tie%arm(2), &
         & cos(half) * tie%arm(1) - sin(half) * tie%arm(2)]
      value = value + change(tie%component)
   end function tie_value

   !> Arm of a rigid link after rotation (x, y).
   pure function turned_arm(tie, rotation) result(arm)
      type(tie_t), intent(in) :: tie
      real(wp), intent(in) :: rotation           !! rotation of the node with which the link rotates [rad]
      real(wp) :: arm(2)
      arm = [cos(rotation) * tie%arm(1) - sin(rotation) * tie%arm(2), sin(rotation) * tie%arm(1) + cos(rotation) * tie%arm(2)]
   end function turned_arm

   !> Geometric stiffness of a rigid link: contribution of the tie force to the rotational stiffness of the node that turns the
   !> link.
   pure real(wp) function tie_swing(tie, u, force) result(stiffness)
      type(tie_t), intent(in) :: tie
      real(wp), intent(in) :: u(:, :)            !! (3, nodes) displacements
      real(wp), intent(in) :: force !! tie force (internal minus external force on the tied component), or its derivative
      real(wp) :: arm(2)
      stiffness = 0.0_wp
      if (tie%turner == 0 .or. tie%component == 3) return
      arm = turned_arm(tie, u(3, tie%turner))
      stiffness = -force * arm(tie%component)
   end function tie_swing

   !> Increments of a node's displacements and rotation in node axes. For a tied node the increments are in global axes, and follow
   !> from the unknowns of the nodes to which it is tied.
   pure function node_unknowns(problem, block, node, x) result(du)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)     !! (3, 3, ties) blocks from set_blocks
      integer, intent(in) :: node
      real(wp), intent(in) :: x(:)               !! (n) increments of the unknowns
      real(wp) :: du(3)
      integer :: b, d
      du = 0.0_wp
      if (.not. problem%ties%follows(node)) then
         d = dof(problem, node, 1)
         du = x(d:d + 2)
      end if
      do b = problem%ties%first(node), problem%ties%first(node + 1) - 1
         d = dof(problem, problem%ties%of(b), 1)
         du = du + matmul(block(:, :, b), x(d:d + 2))
      end do
   end function node_unknowns

   !> Adds a force and a moment on a node to the forces on the unknowns.
   pure subroutine spread_force(problem, block, node, force, vector)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)     !! (3, 3, ties) blocks from set_blocks
      integer, intent(in) :: node
      real(wp), intent(in) :: force(3)           !! force (2) and moment in node axes; for a tied node in global axes
      real(wp), intent(inout) :: vector(:)       !! (n) forces on the unknowns
      integer :: b, d
      if (.not. problem%ties%follows(node)) then
         d = dof(problem, node, 1)
         vector(d:d + 2) = vector(d:d + 2) + force
      end if
      do b = problem%ties%first(node), problem%ties%first(node + 1) - 1
         d = dof(problem, problem%ties%of(b), 1)
         vector(d:d + 2) = vector(d:d + 2) + matmul(force, block(:, :, b))
      end do
   end subroutine spread_force

   !> Adds a symmetric matrix of one or two nodes to the band.
   pure subroutine add_matrix(problem, block, nodes, k, band)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)     !! (3, 3, ties) blocks from set_blocks
      integer, intent(in) :: nodes(:)            !! one or two nodes
      real(wp), intent(in) :: k(:, :) !! (3 n, 3 n) matrix of the n nodes, in the nodes' axes; for tied nodes in global axes
      type(band_t), intent(inout) :: band
      integer :: place(size(nodes) + size(block, 3)), end_of(size(nodes) + size(block, 3)), with(size(nodes) + size(block, 3))
      real(wp) :: part(3, 3)
      integer :: n, p, q, i, j, first, last
      n = 0
      do i = 1, size(nodes)
         associate (node => nodes(i), ties => problem%ties)
            first = ties%first(node)
            last = ties%first(node + 1) - 1
            if (.not. ties%follows(node)) then
               n = n + 1
               place(n) = dof(problem, node, 1)
               with(n) = 0
               end_of(n) = 3 * i - 3
            end if
            do j = first, last
               n = n + 1
               place(n) = dof(problem, ties%of(j), 1)
               with(n) = j
               end_of(n) = 3 * i - 3
            end do
         end associate
      end do
      do q = 1, n
         do p = 1, n
            if (place(p) < place(q)) cycle
            part = k(end_of(p) + 1:end_of(p) + 3, end_of(q) + 1:end_of(q) + 3)
            if (with(p) > 0) part = matmul(transpose(block(:, :, with(p))), part)
            if (with(q) > 0) part = matmul(part, block(:, :, with(q)))
            do j = 1, 3
               do i = merge(j, 1, place(p) == place(q)), 3
                  call add_entry(band, place(p) + i - 1, place(q) + j - 1, part(i, j))
               end do
            end do
         end do
      end do
   end subroutine add_matrix
end module tied_nodes
