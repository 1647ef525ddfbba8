!> The model of a deck on another mesh: nodes anywhere along its free rod segments; all other data are those of the deck.
module remeshed_model
   use kinds, only: wp
   use model, only: model_t, curve_t, mesh_t, contact_t, imperfection_t
   use rod_layout, only: layout_t, segment_element
   use reference_curve, only: curve_point
   implicit none
   private
   public :: division_t, new_remeshed_model

   !> Positions of a mesh's nodes on one rod segment.
   type :: division_t
      real(wp), allocatable :: at(:)   !! (elements + 1) coordinates along the segment, increasing, from 0 to its length
   end type division_t

contains

   !> Nodes: first the segment boundaries in the deck's order, then the inner nodes segment by segment. Elements: segment by
   !> segment, in their order. Each element has the curve, the coordinates and the label of the deck's element that contains its
   !> first end, and may extend beyond the curve of that element. Node sets and monitors keep only those of their nodes that are
   !> segment boundaries; contacts have all nodes of the segments that they cover. Elements named by steps (limit curves, modes as
   !> imperfections) remain those of the deck.
   function new_remeshed_model(deck, layout, division) result(model)
      type(model_t), intent(in) :: deck
      type(layout_t), intent(in) :: layout       !! layout of the deck's rods
      type(division_t), intent(in) :: division(:) !! (rod segments) positions of the nodes; a segment that is not free has all nodes
      !! of the deck
      type(model_t) :: model
      integer, allocatable :: mesh_node(:), deck_node(:), deck_element(:), first(:)
      integer :: i, k
      model = deck
      call lay_mesh(deck, layout, division, model%mesh, mesh_node, first, deck_element)
      allocate (deck_node(model%mesh%n_nodes), source=0)
      do i = 1, size(mesh_node)
         if (mesh_node(i) > 0) deck_node(mesh_node(i)) = i
      end do
      model%fixed = spread([.false., .false., .false.], 2, model%mesh%n_nodes)
      model%spring = spread([0.0_wp, 0.0_wp, 0.0_wp], 2, model%mesh%n_nodes)
      do i = 1, count(layout%breakpoint)
         model%fixed(:, i) = deck%fixed(:, deck_node(i))
         model%spring(:, i) = deck%spring(:, deck_node(i))
      end do
      do k = 1, size(model%obstacle)
         if (model%obstacle(k)%carrier > 0) model%obstacle(k)%carrier = mesh_node(model%obstacle(k)%carrier)
      end do
      do k = 1, size(model%tie)
         associate (tie => model%tie(k))
            tie%node = mesh_node(tie%node)
            tie%of = mesh_node(tie%of)
            if (tie%turner > 0) tie%turner = mesh_node(tie%turner)
         end associate
      end do
      do k = 1, size(model%joint_spring)
         model%joint_spring(k)%node = mesh_node(model%joint_spring(k)%node)
      end do
      do k = 1, size(model%release)
         model%release(k)%node = mesh_node(model%release(k)%node)
         model%release(k)%own = mesh_node(model%release(k)%own)
      end do
      do k = 1, size(deck%step)
         model%step(k)%load = deck%step(k)%load%mapped(deck_node, deck_element)
      end do
      do k = 1, size(deck%contact)
         model%contact(k)%node = contact_nodes(deck, layout, division, deck%contact(k), mesh_node, first)
      end do
      do k = 1, size(deck%monitor)
         if (allocated(deck%monitor(k)%node)) model%monitor(k)%node = there(deck%monitor(k)%node)
      end do
      do k = 1, size(deck%node_set)
         if (allocated(deck%node_set(k)%node)) model%node_set(k)%node = there(deck%node_set(k)%node)
      end do

   contains

      !> Nodes of the new mesh that correspond to nodes of the deck; nodes that the mesh lacks are left out.
      pure function there(node)
         integer, intent(in) :: node(:)
         integer, allocatable :: there(:)
         there = pack(mesh_node(node), mesh_node(node) > 0)
      end function there
   end function new_remeshed_model

   !> Sets nodes and elements of the mesh.
   subroutine lay_mesh(deck, layout, division, mesh, mesh_node, first, deck_element)
      type(model_t), intent(in) :: deck
      type(layout_t), intent(in) :: layout
      type(division_t), intent(in) :: division(:)
      type(mesh_t), intent(out) :: mesh
      integer, allocatable, intent(out) :: mesh_node(:) !! (deck's nodes) new node if the deck's node is a segment boundary; else 0
      integer, allocatable, intent(out) :: first(:) !! (rod segments) number of the node that precedes the segment's first inner
      !! node
      integer, allocatable, intent(out) :: deck_element(:) !! (elements) deck's element that contains the element's first end
      integer :: i, j, k, n, e, node
      allocate (mesh_node(deck%mesh%n_nodes), source=0)
      n = 0
      do i = 1, deck%mesh%n_nodes
         if (.not. layout%breakpoint(i)) cycle
         n = n + 1
         mesh_node(i) = n
      end do
      allocate (first(size(division)))
      mesh%n_elements = 0
      do j = 1, size(division)
         first(j) = n
         n = n + size(division(j)%at) - 2
         mesh%n_elements = mesh%n_elements + size(division(j)%at) - 1
      end do
      mesh%n_nodes = n
      allocate (mesh%node_label(n), mesh%x(2, n), mesh%x_nominal(2, n))
      n = mesh%n_elements
      allocate (mesh%element_label(n), mesh%node(2, n), mesh%s(2, n), deck_element(n))
      do i = 1, deck%mesh%n_nodes
         if (mesh_node(i) == 0) cycle
         mesh%node_label(mesh_node(i)) = deck%mesh%node_label(i)
         mesh%x(:, mesh_node(i)) = deck%mesh%x(:, i)
         mesh%x_nominal(:, mesh_node(i)) = deck%mesh%x_nominal(:, i)
      end do
      e = 0
      do j = 1, size(division)
         associate (rod => layout%rod_segment(j), at => division(j)%at)
            node = mesh_node(rod%node(1))
            do i = 1, size(at) - 1
               e = e + 1
               k = segment_element(rod, at(i))
               deck_element(e) = rod%element(k)
               mesh%node(1, e) = node
               node = first(j) + i
               if (i == size(at) - 1) node = mesh_node(rod%node(2))
               mesh%node(2, e) = node
               mesh%s(:, e) = at(i:i + 1) - layout%origin(deck_element(e))
               ! At the deck's nodes the coordinate is exactly that of the deck.
               if (abs(at(i) - rod%at(k)) <= 0.0_wp) mesh%s(1, e) = deck%mesh%s(1, deck_element(e))
               if (abs(at(i + 1) - rod%at(k + 1)) <= 0.0_wp) mesh%s(2, e) = deck%mesh%s(2, deck_element(e))
               if (i < size(at) - 1) call place_node(deck, layout, j, at(i + 1), mesh, node)
            end do
         end associate
      end do
      mesh%element_label = deck%mesh%element_label(deck_element)
      mesh%family = deck%mesh%family(deck_element)
      mesh%stages = deck%mesh%stages(deck_element)
      mesh%section = deck%mesh%section(deck_element)
      mesh%curve = deck%mesh%curve(deck_element)
      mesh%placed = deck%mesh%placed(deck_element)
   end subroutine lay_mesh

   !> Stress-free position of a node inside a segment; its label is that of the nearest node of the deck.
   subroutine place_node(deck, layout, rod_segment, at, mesh, node)
      type(model_t), intent(in) :: deck
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: rod_segment
      real(wp), intent(in) :: at
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: node
      type(imperfection_t) :: none(0)
      type(curve_t) :: perfect
      real(wp) :: s, angle, speed, tau
      integer :: k, next
      associate (rod => layout%rod_segment(rod_segment))
         k = segment_element(rod, at)
         tau = (at - rod%at(k)) / (rod%at(k + 1) - rod%at(k))
         associate (e => rod%element(k))
            next = deck%mesh%node(merge(1, 2, tau < 0.5_wp), e)
            mesh%node_label(node) = deck%mesh%node_label(next)
            if (abs(at - rod%at(k)) <= 0.0_wp) then
               mesh%x(:, node) = deck%mesh%x(:, next)
               mesh%x_nominal(:, node) = deck%mesh%x_nominal(:, next)
               return
            end if
            ! Elsewhere the segment is free, and its elements are on curves.
            s = at - layout%origin(e)
            perfect = deck%curve(deck%mesh%curve(e))
            perfect%imperfection = 0
            call curve_point(perfect, none, s, mesh%x_nominal(:, node), angle, speed)
            call curve_point(deck%curve(deck%mesh%curve(e)), deck%imperfection, s, mesh%x(:, node), angle, speed)
         end associate
      end associate
   end subroutine place_node

   !> Nodes of a contact: first the node at which a closed chain begins, which is the next one after the deck's first node; then the
   !> nodes segment by segment in their order; then single nodes in the deck's order.
   function contact_nodes(deck, layout, division, contact, mesh_node, first) result(list)
      type(model_t), intent(in) :: deck
      type(layout_t), intent(in) :: layout
      type(division_t), intent(in) :: division(:)
      type(contact_t), intent(in) :: contact      !! contact in the deck
      integer, intent(in) :: mesh_node(:), first(:) !! results of lay_mesh
      integer, allocatable :: list(:)
      logical :: member(deck%mesh%n_nodes), listed(deck%mesh%n_nodes), covered(size(division))
      integer :: i, j, n, start
      member = .false.
      member(contact%node) = .true.
      listed = .false.
      covered = .false.
      n = count(layout%breakpoint(contact%node))
      if (.not. deck%obstacle(contact%obstacle)%at_nodes) then
         do j = 1, size(division)
            ! A contact ends at segment boundaries only: the first element of a segment shows whether the contact covers the
            ! segment.
            covered(j) = all(member(deck%mesh%node(:, layout%rod_segment(j)%element(1))))
            if (covered(j)) n = n + size(division(j)%at) - 2
         end do
      end if
      allocate (list(n))
      n = 0
      j = layout%node_rod_segment(contact%node(1))
      start = 0
      if (j > 0) then
         if (covered(j)) call begin(layout%rod_segment(j)%node, division(j)%at, layout%node_at(contact%node(1)))
      end if
      do j = 1, size(division)
         if (.not. covered(j)) cycle
         call add(layout%rod_segment(j)%node(1))
         do i = 1, size(division(j)%at) - 2
            if (first(j) + i == start) cycle
            n = n + 1
            list(n) = first(j) + i
         end do
         call add(layout%rod_segment(j)%node(2))
      end do
      do i = 1, size(contact%node)
         call add(contact%node(i))
      end do
      list = list(:n)

   contains

      !> The first node of segment j at or behind a coordinate.
      subroutine begin(ends, at, from)
         integer, intent(in) :: ends(2)
         real(wp), intent(in) :: at(:), from
         i = findloc(at >= from - 8.0_wp * epsilon(from) * at(size(at)), .true., 1)
         if (i == 1 .or. i == size(at)) then
            call add(ends(merge(1, 2, i == 1)))
         else
            n = 1
            start = first(j) + i - 1
            list(n) = start
         end if
      end subroutine begin

      !> Adds a segment boundary to the list, unless it is already in it.
      subroutine add(node)
         integer, intent(in) :: node
         if (listed(node) .or. mesh_node(node) == 0) return
         listed(node) = .true.
         n = n + 1
         list(n) = mesh_node(node)
      end subroutine add
   end function contact_nodes
end module remeshed_model
