!> Rods of the deck's mesh: rod segments between segment boundaries. They do not depend on the mesh with which the program computes.
!>
!> Along a rod segment section, element type, loads and obstacles do not change and the stress-free axis is smooth: nodes may be
!> placed anywhere. Segment boundaries (`breakpoint`) are those nodes of the deck at which one of these changes, or at which
!> something acts on a point of the rod.
module rod_layout
   use kinds, only: wp
   use ordered_knots, only: piece_at
   use model, only: obstacle_of, elements_among, model_t
   use element_families, only: conforms
   use reference_curve, only: curve_goes_on
   implicit none
   private
   public :: layout_t, rod_segment_t, new_layout, segment_element

   !> A rod between two segment boundaries.
   type :: rod_segment_t
      integer :: node(2) = 0 !! nodes of the deck at the ends of the segment; the same node twice for a closed segment
      integer, allocatable :: element(:)      !! elements of the deck along the segment, in their order and direction
      real(wp), allocatable :: at(:) !! (elements + 1) coordinates of the deck's nodes along the segment: nominal length from its
      !! first node
      real(wp) :: length = 0.0_wp             !! length of the segment: the last of these coordinates
      logical :: free = .false.               !! true: nodes may be placed anywhere; false: the deck's nodes are used
      logical :: placed = .false.             !! true: the deck leaves the number of elements open
   end type rod_segment_t

   !> All rod segments of the deck's mesh, and the places of its elements and nodes on them.
   type :: layout_t
      type(rod_segment_t), allocatable :: rod_segment(:)
      integer, allocatable :: rod_segment_of(:)   !! (deck's elements) rod segment to which the element belongs
      real(wp), allocatable :: origin(:) !! (deck's elements) coordinate along the segment minus nominal coordinate of the element
      integer, allocatable :: node_rod_segment(:) !! (deck's nodes) a rod segment that contains the node; 0: none
      real(wp), allocatable :: node_at(:)     !! (deck's nodes) coordinate of the node along that segment
      logical, allocatable :: breakpoint(:)   !! (deck's nodes) true: the node is a segment boundary
   end type layout_t

contains

   !> The layout of a deck's model. Segments are in the order of their first elements; closed chains without a segment boundary come
   !> last and are cut at their first node.
   function new_layout(model) result(layout)
      type(model_t), intent(in) :: model
      type(layout_t) :: layout
      integer, allocatable :: beside(:, :)   ! (2, nodes) element that ends at the node, and element that begins there
      logical, allocatable :: kept(:)
      type(rod_segment_t), allocatable :: rod_segment(:)
      integer :: e, node, n
      associate (mesh => model%mesh)
         call find_breakpoints(model, beside, layout%breakpoint)
         kept = elements_that_stay(model)
         allocate (layout%rod_segment_of(mesh%n_elements), layout%node_rod_segment(mesh%n_nodes), source=0)
         allocate (layout%origin(mesh%n_elements), layout%node_at(mesh%n_nodes), source=0.0_wp)
         ! The number of elements would also be an upper bound of the list's length, but mostly far too large.
         allocate (rod_segment(count(layout%breakpoint(mesh%node(1, :))) + count(.not. layout%breakpoint)))
         n = 0
         do e = 1, mesh%n_elements
            if (layout%breakpoint(mesh%node(1, e))) call follow(e)
         end do
         do node = 1, mesh%n_nodes
            if (layout%breakpoint(node)) cycle
            if (layout%rod_segment_of(beside(2, node)) > 0) cycle
            layout%breakpoint(node) = .true.
            call follow(beside(2, node))
         end do
      end associate
      layout%rod_segment = rod_segment(:n)

   contains

      !> Follows one segment from its first element to the next segment boundary.
      subroutine follow(first)
         integer, intent(in) :: first
         integer :: at, k, length
         n = n + 1
         associate (mesh => model%mesh, new => rod_segment(n))
            at = first
            length = 1
            do while (.not. layout%breakpoint(mesh%node(2, at)))
               at = beside(2, mesh%node(2, at))
               length = length + 1
            end do
            new%node = [mesh%node(1, first), mesh%node(2, at)]
            allocate (new%element(length), new%at(length + 1))
            new%at(1) = 0.0_wp
            new%free = .true.
            new%placed = mesh%placed(first)
            at = first
            do k = 1, length
               if (k > 1) at = beside(2, mesh%node(2, at))
               new%element(k) = at
               layout%rod_segment_of(at) = n
               layout%origin(at) = new%at(k) - mesh%s(1, at)
               ! All elements of a curve get the same value, without differences by rounding.
               if (k > 1) then
                  associate (before => new%element(k - 1))
                     if (mesh%curve(at) == mesh%curve(before) .and. abs(mesh%s(1, at) - mesh%s(2, before)) <= 0.0_wp) &
                        & layout%origin(at) = layout%origin(before)
                  end associate
               end if
               new%at(k + 1) = mesh%s(2, at) + layout%origin(at)
               new%free = new%free .and. .not. kept(at)
               layout%node_rod_segment(mesh%node(:, at)) = n
               layout%node_at(mesh%node(:, at)) = new%at(k:k + 1)
            end do
            new%length = new%at(length + 1)
         end associate
      end subroutine follow
   end function new_layout

   !> Determines the segment boundaries and, for every other node, the two elements at it.
   subroutine find_breakpoints(model, beside, breakpoint)
      type(model_t), intent(in) :: model
      integer, allocatable, intent(out) :: beside(:, :) !! (2, nodes) element that ends at the node, and element that begins there
      logical, allocatable, intent(out) :: breakpoint(:)    !! (nodes) true: the node is a segment boundary
      integer :: ends(2, model%mesh%n_nodes)                ! (2, nodes) number of elements that end, and that begin, at the node
      logical, allocatable :: covered(:)
      integer :: e, i, k
      associate (mesh => model%mesh)
         allocate (beside(2, mesh%n_nodes), source=0)
         allocate (breakpoint(mesh%n_nodes))
         ends = 0
         do e = 1, mesh%n_elements
            do i = 1, 2
               associate (node => mesh%node(i, e))
                  ends(3 - i, node) = ends(3 - i, node) + 1
                  beside(3 - i, node) = e
               end associate
            end do
         end do
         do i = 1, mesh%n_nodes
            breakpoint(i) = any(ends(:, i) /= 1) .or. any(model%fixed(:, i)) .or. any(model%spring(:, i) > 0.0_wp) .or. &
               & any(model%obstacle%carrier == i) .or. joined(model, i)
            if (.not. breakpoint(i)) breakpoint(i) = .not. goes_on(model, beside(1, i), beside(2, i))
         end do
         do k = 1, size(model%step)
            associate (load => model%step(k)%load)
               do i = 1, mesh%n_nodes
                  breakpoint(i) = breakpoint(i) .or. load%acts_at(i)
               end do
            end associate
         end do
         allocate (covered(0:mesh%n_elements))
         do k = 1, size(model%contact)
            associate (contact => model%contact(k))
               covered = .false.
               if (.not. model%obstacle(contact%obstacle)%at_nodes) covered(1:) = elements_among(mesh, contact%node)
               do i = 1, size(contact%node)
                  associate (node => contact%node(i), e => beside(:, contact%node(i)))
                     if (.not. all(covered(e))) then
                        breakpoint(node) = .true.
                     else if (allocated(contact%part)) then
                        ! The pieces of a wall are segment boundaries, because forces are reported for each piece.
                        if (obstacle_of(contact, mesh%node(:, e(1))) /= obstacle_of(contact, mesh%node(:, e(2)))) &
                           & breakpoint(node) = .true.
                     end if
                  end associate
               end do
            end associate
         end do
      end associate
   end subroutine find_breakpoints

   !> True for a node with a tie, or with a spring to another node.
   pure logical function joined(model, node)
      type(model_t), intent(in) :: model
      integer, intent(in) :: node
      integer :: k
      joined = .true.
      do k = 1, size(model%tie)
         if (model%tie(k)%node == node .or. any(model%tie(k)%of == node) .or. model%tie(k)%turner == node) return
      end do
      do k = 1, size(model%joint_spring)
         if (any(model%joint_spring(k)%node == node)) return
      end do
      joined = .false.
   end function joined

   !> True if one element continues another one: they are equal in all properties except the nodes.
   pure logical function goes_on(model, a, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: a, b             !! element that ends at a node; element that begins there
      integer :: k
      associate (mesh => model%mesh)
         goes_on = min(mesh%curve(a), mesh%curve(b)) > 0 .and. mesh%family(a) == mesh%family(b) .and. &
            & mesh%stages(a) == mesh%stages(b) .and. mesh%section(a) == mesh%section(b) .and. &
            & (mesh%placed(a) .eqv. mesh%placed(b))
         if (goes_on) goes_on = curve_goes_on(model%curve(mesh%curve(a)), mesh%s(2, a), model%curve(mesh%curve(b)), mesh%s(1, b))
         if (.not. goes_on) return
         do k = 1, size(model%distribution)
            goes_on = model%distribution(k)%continues([mesh%curve(a), mesh%curve(b)], mesh%s(:, a), mesh%s(:, b))
            if (.not. goes_on) return
         end do
         do k = 1, size(model%step)
            if (.not. goes_on) return
            goes_on = model%step(k)%load%same_on(a, b)
         end do
      end associate
   end function goes_on

   !> Elements whose nodes are kept: all except GE elements of two or more stages on curves. Kept are also elements at whose nodes
   !> forces act: contact at nodes that the deck requests, and foundations that couple nodes.
   function elements_that_stay(model) result(kept)
      type(model_t), intent(in) :: model
      logical, allocatable :: kept(:)         !! (elements) true: the nodes of the element are kept
      integer :: k
      associate (mesh => model%mesh)
         kept = .not. conforms(mesh%family) .or. mesh%stages < 2 .or. mesh%curve == 0
         do k = 1, size(model%contact)
            associate (contact => model%contact(k))
               if (contact%distributed .or. model%obstacle(contact%obstacle)%at_nodes .or. &
                  & (contact%along .and. model%obstacle(contact%obstacle)%rigid)) cycle
               kept = kept .or. elements_among(mesh, contact%node)
            end associate
         end do
      end associate
   end function elements_that_stay

   !> Index in a segment's list of the deck's element that contains a coordinate; at a node, of the element that begins there.
   pure integer function segment_element(rod_segment, at) result(k)
      type(rod_segment_t), intent(in) :: rod_segment
      real(wp), intent(in) :: at              !! coordinate along the segment; beyond its ends the first or last element is returned
      k = piece_at(rod_segment%at, at)
   end function segment_element
end module rod_layout
