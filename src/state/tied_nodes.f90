!> Nodes that follow others: their displacements as functions of the unknowns, and what that does to forces and matrices.
!>
!> The unknowns of a tied component are what it departs from the value that its tie gives it; they are held at zero like a support.
!> With u = T(q) at every node, forces on the unknowns are T'^T f, and the tangent is T'^T K T' and, where a tie turns with a node
!> (rigid links), the force in the tie times the second derivative. T' is the unit matrix but for the blocks kept here.
module tied_nodes
   use kinds, only: wp
   use model, only: tie_t
   use problem, only: problem_t, dof
   use band_matrix, only: band_t
   implicit none
   private
   public :: set_blocks, tie_value, tie_swing, turned_arm, node_unknowns, spread_force, add_matrix

contains

   !> T' at a state: for each tied node the derivatives of its displacements and rotation by the unknowns of the nodes in its list.
   subroutine set_blocks(problem, u, turned, axis, roll, lean, block)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: u(:, :)            !! (3, nodes) displacements
      logical, intent(in) :: turned(:)           !! (nodes) the axes of a node, as in system_t; tied ones are not turned
      real(wp), intent(in) :: axis(:, :), roll(:), lean(:)
      real(wp), intent(out) :: block(:, :, :)    !! (3, 3, size(problem%ties%of)) rows: global axes, columns: node axes
      real(wp) :: arm(2)
      integer :: i, k, n
      block = 0.0_wp
      do n = 1, size(problem%ties%follows)
         if (.not. problem%ties%follows(n)) cycle
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

      !> Adds factor times what component `part` of node `of` is made of to the row of a tied component.
      subroutine add_row(node, component, of, part, factor)
         integer, intent(in) :: node, component, of, part
         real(wp), intent(in) :: factor
         real(wp) :: row(3)
         integer :: b, to
         associate (first => problem%ties%first, list => problem%ties%of)
            if (.not. problem%ties%follows(of)) then
               to = first(node) - 1 + findloc(list(first(node):first(node + 1) - 1), of, 1)
               block(component, :, to) = block(component, :, to) + factor * own_row(of, part)
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

      !> A displacement or the rotation of a node that follows none, by its own unknowns.
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

   !> The value that a tie gives its component.
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
      ! (R - 1) arm without the difference of large numbers.
      half = 0.5_wp * u(3, tie%turner)
      change = (2.0_wp * sin(half)) * [-sin(half) * tie%arm(1) - cos(half) * tie%arm(2), &
         & cos(half) * tie%arm(1) - sin(half) * tie%arm(2)]
      value = value + change(tie%component)
   end function tie_value

   !> The arm of a rigid link, turned.
   pure function turned_arm(tie, rotation) result(arm)
      type(tie_t), intent(in) :: tie
      real(wp), intent(in) :: rotation           !! of its turner [rad]
      real(wp) :: arm(2)
      arm = [cos(rotation) * tie%arm(1) - sin(rotation) * tie%arm(2), sin(rotation) * tie%arm(1) + cos(rotation) * tie%arm(2)]
   end function turned_arm

   !> What a force in a tie adds to the stiffness against rotation of its turner.
   pure real(wp) function tie_swing(tie, u, force) result(stiffness)
      type(tie_t), intent(in) :: tie
      real(wp), intent(in) :: u(:, :)            !! (3, nodes) displacements
      real(wp), intent(in) :: force              !! in the tie: inner less outer ones on its component; or its rate
      real(wp) :: arm(2)
      stiffness = 0.0_wp
      if (tie%turner == 0 .or. tie%component == 3) return
      arm = turned_arm(tie, u(3, tie%turner))
      stiffness = -force * arm(tie%component)
   end function tie_swing

   !> Increments of a node: of its unknowns, in its axes; of a tied node in global axes, all that it follows included.
   pure function node_unknowns(problem, block, node, x) result(du)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)     !! by set_blocks
      integer, intent(in) :: node
      real(wp), intent(in) :: x(:)               !! (n) unknowns
      real(wp) :: du(3)
      integer :: b, d
      if (.not. problem%ties%follows(node)) then
         d = dof(problem, node, 1)
         du = x(d:d + 2)
         return
      end if
      du = 0.0_wp
      do b = problem%ties%first(node), problem%ties%first(node + 1) - 1
         d = dof(problem, problem%ties%of(b), 1)
         du = du + matmul(block(:, :, b), x(d:d + 2))
      end do
   end function node_unknowns

   !> Adds force and moment on a node to those on the unknowns.
   pure subroutine spread_force(problem, block, node, force, vector)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)     !! by set_blocks
      integer, intent(in) :: node
      real(wp), intent(in) :: force(3)           !! axes of the node; global ones where it is tied
      real(wp), intent(inout) :: vector(:)       !! (n)
      integer :: b, d
      if (.not. problem%ties%follows(node)) then
         d = dof(problem, node, 1)
         vector(d:d + 2) = vector(d:d + 2) + force
         return
      end if
      do b = problem%ties%first(node), problem%ties%first(node + 1) - 1
         d = dof(problem, problem%ties%of(b), 1)
         vector(d:d + 2) = vector(d:d + 2) + matmul(force, block(:, :, b))
      end do
   end subroutine spread_force

   !> Adds a symmetric matrix on one or two nodes to the band.
   pure subroutine add_matrix(problem, block, nodes, k, band)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)     !! by set_blocks
      integer, intent(in) :: nodes(:)
      real(wp), intent(in) :: k(:, :)            !! (3 nodes, 3 nodes) axes of the nodes; global ones where tied
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
                  associate (entry => band%a(1 + place(p) + i - place(q) - j, place(q) + j - 1))
                     entry = entry + part(i, j)
                  end associate
               end do
            end do
         end do
      end do
   end subroutine add_matrix
end module tied_nodes
