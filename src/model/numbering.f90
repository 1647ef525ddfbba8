!> Order of the nodes in the band: reverse Cuthill-McKee. A chain gets half bandwidth 5, a closed ring 11 or less.
module numbering
   use kinds, only: i8
   use model, only: mesh_t
   implicit none
   private
   public :: numbering_t, new_numbering

   !> Positions of the nodes in the band matrix.
   type :: numbering_t
      integer, allocatable :: position(:)   !! (nodes) position of the node in the band matrix, from 1
      integer :: half_bandwidth = 0         !! half bandwidth of the matrix with three unknowns for each node
   end type numbering_t

contains

   !> Numbers the nodes of a mesh; unconnected parts follow each other. Supported nodes come late: elimination from the free end
   !> towards the support has large pivots, whereas in the opposite direction pivots decrease with the cube of the length.
   function new_numbering(mesh, supported, pair) result(numbering)
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: supported(:)    !! (nodes) true: the node is supported
      integer, intent(in) :: pair(:, :) !! (2, pairs) nodes that share matrix entries, in addition to the two nodes of each element
      type(numbering_t) :: numbering
      integer, allocatable :: edge(:, :), start(:), neighbour(:), order(:), level(:)
      integer :: n, placed, node

      n = mesh%n_nodes
      edge = reshape([mesh%node, pair], [2, mesh%n_elements + size(pair, 2)])
      call build_adjacency(edge, n, start, neighbour)
      allocate (order(n), numbering%position(n))
      allocate (level(n), source=0)
      placed = 0
      do node = 1, n
         if (level(node) /= 0) cycle
         call number_part(start, neighbour, end_of_part(start, neighbour, node, n), level, order, placed)
      end do
      do node = 1, n
         numbering%position(order(node)) = n + 1 - node
      end do
      if (count(supported) > 0) then
         if (2 * sum(int(numbering%position, i8), mask=supported) < (n + 1_i8) * count(supported)) &
            & numbering%position = n + 1 - numbering%position
      end if
      associate (position => numbering%position)
         numbering%half_bandwidth = 3 * max(0, maxval(abs(position(edge(1, :)) - position(edge(2, :))))) + 2
      end associate
   end function new_numbering

   !> Neighbour lists in compressed form: neighbour(start(i) : start(i + 1) - 1).
   subroutine build_adjacency(edge, n_nodes, start, neighbour)
      integer, intent(in) :: edge(:, :)      ! (2, edges) pairs of neighbouring nodes
      integer, intent(in) :: n_nodes
      integer, allocatable, intent(out) :: start(:), neighbour(:)
      integer, allocatable :: fill(:)
      integer :: e, a, side
      allocate (start(n_nodes + 1), source=0)
      start(1) = 1
      do e = 1, size(edge, 2)
         do side = 1, 2
            start(edge(side, e) + 1) = start(edge(side, e) + 1) + 1
         end do
      end do
      do a = 1, n_nodes
         start(a + 1) = start(a) + start(a + 1)
      end do
      fill = start(:n_nodes)
      allocate (neighbour(start(n_nodes + 1) - 1))
      do e = 1, size(edge, 2)
         do side = 1, 2
            associate (node => edge(side, e))
               neighbour(fill(node)) = edge(3 - side, e)
               fill(node) = fill(node) + 1
            end associate
         end do
      end do
   end subroutine build_adjacency

   !> A node at an end of the connected part that contains `seed`: the last node of two breadth-first sweeps.
   integer function end_of_part(start, neighbour, seed, n) result(last)
      integer, intent(in) :: start(:), neighbour(:), seed, n
      integer, allocatable :: mark(:), queue(:)
      integer :: sweep, placed
      allocate (queue(n), mark(n))
      last = seed
      do sweep = 1, 2
         mark = 0
         placed = 0
         call number_part(start, neighbour, last, mark, queue, placed)
         last = queue(placed)
      end do
   end function end_of_part

   !> Breadth-first order starting from a root; nodes with few neighbours come first.
   subroutine number_part(start, neighbour, root, level, order, placed)
      integer, intent(in) :: start(:), neighbour(:), root
      integer, intent(inout) :: level(:)    !! (nodes) not zero: the node has been placed
      integer, intent(inout) :: order(:)    !! (nodes) nodes in their new order
      integer, intent(inout) :: placed      !! number of nodes placed
      integer :: head, first, i, j, node, next
      placed = placed + 1
      order(placed) = root
      level(root) = 1
      head = placed
      do while (head <= placed)
         node = order(head)
         first = placed + 1
         do i = start(node), start(node + 1) - 1
            next = neighbour(i)
            if (level(next) /= 0) cycle
            level(next) = level(node) + 1
            placed = placed + 1
            ! Sorts the new neighbours of this node by their numbers of neighbours, by insertion.
            j = placed
            do while (j > first)
               if (degree(order(j - 1)) <= degree(next)) exit
               order(j) = order(j - 1)
               j = j - 1
            end do
            order(j) = next
         end do
         head = head + 1
      end do

   contains

      pure integer function degree(of)
         integer, intent(in) :: of
         degree = start(of + 1) - start(of)
      end function degree
   end subroutine number_part
end module numbering
