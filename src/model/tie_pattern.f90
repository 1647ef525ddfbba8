!> Nodes whose unknowns determine those of tied nodes; chains of ties are resolved.
!>
!> A tied component is not an unknown. Its forces act on the nodes to which it is tied; these nodes are therefore neighbours in the
!> band, as the two ends of an element are.
!>
!> A node that may touch an obstacle carried by another node keeps its unknowns, and moves with that node while the two touch. The
!> unknowns of nodes that carry obstacles form the border of the band matrix.
module tie_pattern
   use model, only: mesh_t, tie_t, joint_spring_t
   implicit none
   private
   public :: tie_pattern_t, new_tie_pattern, coupled_pairs

   !> The nodes that determine the displacements of each tied node.
   type :: tie_pattern_t
      logical, allocatable :: tied(:, :)    !! (3, nodes) true: the component is tied
      logical, allocatable :: follows(:)    !! (nodes) true: at least one component of the node is tied
      integer, allocatable :: first(:)      !! (nodes + 1) index in `of` of the first entry of each node
      integer, allocatable :: of(:) !! nodes on which a node depends. For a tied node: the node itself and all nodes to which it is
      !! tied; for a node that may touch carried obstacles: the nodes that carry these; for other nodes: none
      integer, allocatable :: carrier(:)    !! nodes that carry obstacles
   contains
      procedure :: has_blocks
   end type tie_pattern_t

contains

   !> True if the displacements of a node depend on the unknowns of other nodes.
   elemental logical function has_blocks(self, node)
      class(tie_pattern_t), intent(in) :: self
      integer, intent(in) :: node
      has_blocks = self%first(node + 1) > self%first(node)
   end function has_blocks

   !> Pattern for ties that have been checked and ordered (see tie_t).
   function new_tie_pattern(tie, carrier, touching) result(pattern)
      type(tie_t), intent(in) :: tie(:)
      integer, intent(in) :: carrier(:)     !! nodes that carry obstacles
      logical, intent(in) :: touching(:, :) !! (carriers, nodes) true: the node may touch an obstacle of this carrier; false for
      !! tied nodes
      type(tie_pattern_t) :: pattern
      type :: list_t
         integer, allocatable :: node(:)
      end type list_t
      type(list_t), allocatable :: list(:)  ! (ties) nodes on which the tied node depends, stored at the first tie of the node
      integer :: at(size(touching, 2)), i, k, n, n_nodes
      n_nodes = size(touching, 2)
      pattern%carrier = carrier
      allocate (pattern%tied(3, n_nodes), source=.false.)
      allocate (list(size(tie)))
      at = 0
      do i = 1, size(tie)
         pattern%tied(tie(i)%component, tie(i)%node) = .true.
         if (at(tie(i)%node) == 0) then
            at(tie(i)%node) = i
            list(i)%node = [tie(i)%node]
         end if
         do k = 1, size(tie(i)%of)
            call join(at(tie(i)%node), tie(i)%of(k))
         end do
         if (tie(i)%turner > 0) call join(at(tie(i)%node), tie(i)%turner)
      end do
      pattern%follows = at > 0
      allocate (pattern%first(n_nodes + 1))
      n = 0
      do i = 1, n_nodes
         pattern%first(i) = n + 1
         if (at(i) > 0) n = n + size(list(at(i))%node)
         n = n + count(touching(:, i))
      end do
      pattern%first(n_nodes + 1) = n + 1
      allocate (pattern%of(n))
      do i = 1, n_nodes
         if (at(i) > 0) pattern%of(pattern%first(i):pattern%first(i + 1) - 1) = list(at(i))%node
         if (any(touching(:, i))) pattern%of(pattern%first(i):pattern%first(i + 1) - 1) = pack(carrier, touching(:, i))
      end do

   contains

      !> Adds to a list a node or, if it is tied, the nodes on which it depends.
      subroutine join(to, node)
         integer, intent(in) :: to, node
         integer, allocatable :: more(:)
         integer :: j
         if (at(node) > 0) more = list(at(node))%node
         if (at(node) == 0) more = [node, pack(carrier, touching(:, node))]
         do j = 1, size(more)
            if (.not. any(list(to)%node == more(j))) list(to)%node = [list(to)%node, more(j)]
         end do
      end subroutine join
   end function new_tie_pattern

   !> Pairs of nodes that are neighbours in the band in addition to the two nodes of each element; nodes of the border are left out.
   function coupled_pairs(mesh, pattern, spring) result(pair)
      type(mesh_t), intent(in) :: mesh
      type(tie_pattern_t), intent(in) :: pattern
      type(joint_spring_t), intent(in) :: spring(:)
      integer, allocatable :: pair(:, :)    !! (2, pairs) the pairs
      integer :: i
      allocate (pair(2, 0))
      do i = 1, size(spring)
         call couple(members([spring(i)%node(1), spring(i)%node(2)]))
      end do
      if (.not. any(pattern%follows)) return
      do i = 1, mesh%n_elements
         if (any(pattern%follows(mesh%node(:, i)))) call couple(members(mesh%node(:, i)))
      end do
      do i = 1, mesh%n_nodes
         if (pattern%follows(i)) call couple(members([i]))
      end do

   contains

      !> The given nodes and all nodes on which they depend.
      function members(nodes) result(all_of)
         integer, intent(in) :: nodes(:)
         integer, allocatable :: all_of(:)
         integer :: j, k
         all_of = nodes
         do j = 1, size(nodes)
            associate (of => pattern%of(pattern%first(nodes(j)):pattern%first(nodes(j) + 1) - 1))
               all_of = [all_of, pack(of, [(all(pattern%carrier /= of(k)), k=1, size(of))])]
            end associate
         end do
      end function members

      !> Makes every two nodes of a group neighbours in the band.
      subroutine couple(group)
         integer, intent(in) :: group(:)
         integer :: more(2, size(group)**2 / 2), a, b, n
         n = 0
         do a = 1, size(group)
            do b = a + 1, size(group)
               if (group(a) == group(b)) cycle
               n = n + 1
               more(:, n) = [group(a), group(b)]
            end do
         end do
         pair = reshape([pair, more(:, :n)], [2, size(pair, 2) + n])
      end subroutine couple
   end function coupled_pairs
end module tie_pattern
