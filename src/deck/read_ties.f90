!> Reads *RELEASE, *MPC and *EQUATION: nodes and degrees of freedom that are tied to others. Element ends that are partly released
!> from a node get a node of their own, which is tied to the first one in the components that are not released.
module read_ties
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, tie_t, release_t, joint_spring_t, same_component
   use item_values, only: component_dof
   use checked_deck, only: checked_deck_t, position_t, take_node_sets, copy_node, node_words
   use read_supports, only: read_dofs
   implicit none
   private
   public :: read_release_cards, read_tie_cards, order_ties

contains

   !> Reads the releases. They divide chains of elements: cards that need whole chains must be read before.
   subroutine read_release_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains mesh; out: also the new nodes
      type(model_t), intent(inout) :: model             !! out: with new nodes, ties, joint_spring and release, and with node_set
      logical :: free(3)                                ! true for components that the present line releases
      real(wp) :: stiffness                             ! stiffness of a spring in the released components; 0: none
      integer :: set                                    ! node set to which the new nodes are added; 0: none
      logical, allocatable :: released(:, :)            ! (2, elements) true: an earlier line releases this end
      logical, allocatable :: chosen(:, :)              ! (2, elements) true: this end is at the present node, and to be released
      integer, allocatable :: nodes(:), elements(:)
      integer :: i
      allocate (released(2, model%mesh%n_elements), source=.false.)
      chosen = released
      do while (deck%next_card('RELEASE'))
         set = 0
         if (deck%given('NSET')) call deck%names%node%begin_set(deck%text('NSET'), set)
         do while (deck%next_line())
            nodes = deck%nodes('node or set')
            elements = [integer ::]
            if (deck%given('element or set')) elements = deck%elements('element or set')
            stiffness = deck%real('stiffness')
            call read_dofs(deck, free)
            if (all(free)) call deck%wrong('dof', 'nothing would hold the ends to the node')
            if (deck%names%mesh_incomplete .or. all(free) .or. .not. any(free)) cycle
            do i = 1, size(nodes)
               if (.not. deck%given('element or set')) then
                  call release_all(nodes(i))
               else if (size(elements) > 0) then
                  chosen = .false.
                  chosen(:, elements) = model%mesh%node(:, elements) == nodes(i)
                  call release(nodes(i))
               end if
            end do
         end do
      end do
      call take_node_sets(deck%names, model%node_set)

   contains

      !> Releases all element ends at a node except the first one, each by a node of its own.
      subroutine release_all(node)
         integer, intent(in) :: node
         integer :: e, side, n
         n = 0
         do e = 1, model%mesh%n_elements
            do side = 1, 2
               if (model%mesh%node(side, e) /= node) cycle
               n = n + 1
               if (n == 1) cycle
               chosen = .false.
               chosen(side, e) = .true.
               call release(node)
            end do
         end do
         if (n < 2) call deck%wrong('node or set', node_words(model%mesh, node)//' has '// &
            trim(merge('one element ', 'no element  ', n == 1))//'; a joint needs a second one')
      end subroutine release_all

      !> Gives the chosen element ends at a node a new common node, by which they remain connected to each other.
      subroutine release(node)
         integer, intent(in) :: node
         character(:), allocatable :: problem
         type(release_t) :: new
         integer :: i
         problem = ''
         if (all(chosen .eqv. (model%mesh%node == node))) problem = 'all ends at '//node_words(model%mesh, node)// &
            ' would be released from it, and none stay: a joint needs a second element (an end that a support lets turn is PINNED)'
         if (.not. any(chosen)) then
            problem = 'no end of these elements is at '//node_words(model%mesh, node)
            if (any(released)) problem = problem//', or it is released already'
         end if
         if (problem /= '') then
            call deck%wrong('node or set', problem)
            return
         end if
         call copy_node(deck%names, model, node)
         new = release_t(node=node, own=model%mesh%n_nodes, free=free)
         where (chosen) model%mesh%node = new%own
         released = released .or. chosen
         model%release = [model%release, new]
         call deck%names%node%append(set, [new%own])
         do i = 1, 3
            if (.not. free(i)) then
               model%tie = [model%tie, same_component(new%own, i, node)]
            else if (stiffness > 0.0_wp) then
               model%joint_spring = [model%joint_spring, joint_spring_t([node, new%own], i, stiffness)]
            end if
         end do
      end subroutine release
   end subroutine read_release_cards

   !> Reads the ties in the order of the deck.
   subroutine read_tie_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck !! in: with the mesh (nodes to which others are tied need not belong to an
      !! element); out: names%tie_origin is extended
      type(model_t), intent(inout) :: model             !! in: with the releases; out: with further ties
      allocate (deck%names%tie_origin(size(model%tie)))
      do while (deck%next_card('MPC|EQUATION'))
         if (deck%at%keyword == 'EQUATION') then
            call read_equation()
         else
            do while (deck%next_line())
               call read_pair()
            end do
         end if
      end do

   contains

      !> Reads a data line of *MPC: nodes, and the node to which they are tied.
      subroutine read_pair()
         character(:), allocatable :: kind
         integer, allocatable :: nodes(:)
         integer :: i, lead
         kind = deck%word('TYPE')
         nodes = deck%nodes('node or set')
         lead = deck%node('node')
         if (lead == 0) return
         ! Nodes with rigid bars or links, and nodes that are tied in all components, need not belong to an element.
         if (kind == 'BEAM' .or. kind == 'LINK') deck%names%connected(lead) = .true.
         if (kind /= 'PIN') deck%names%connected(nodes) = .true.
         if (.not. deck%on_elements('node or set', model%mesh, nodes)) return
         if (.not. deck%on_elements('node', model%mesh, [lead])) return
         do i = 1, size(nodes)
            if (nodes(i) == lead) then
               call deck%wrong('node', node_words(model%mesh, lead)//' cannot follow itself')
            else if (kind == 'LINK' .and. norm2(model%mesh%x(:, nodes(i)) - model%mesh%x(:, lead)) <= 0.0_wp) then
               call deck%wrong('node', 'nodes '//to_text(model%mesh%node_label(nodes(i)))//' and '// &
                  to_text(model%mesh%node_label(lead))//' are at the same place, and a link between them has no length; '// &
                  'TYPE=PIN joins them')
            else
               call tie_pair(kind, nodes(i), lead)
               cycle
            end if
            return
         end do
      end subroutine read_pair

      !> Ties the components of a node to those of another node.
      subroutine tie_pair(kind, node, other)
         character(*), intent(in) :: kind     ! kind of the *MPC
         integer, intent(in) :: node, other   ! node that is tied; node to which it is tied
         type(tie_t) :: tie
         integer :: lead, k
         lead = other
         if (kind == 'LINK') then
            ! LINK is a bar with hinges at both ends. An additional node carries the bar; it is pinned to the other node and has its
            ! own rotation.
            call copy_node(deck%names, model, other)
            lead = model%mesh%n_nodes
            do k = 1, 2
               call add(same_component(lead, k, other))
            end do
         end if
         do k = 1, merge(2, 3, kind == 'PIN' .or. kind == 'LINK')
            tie = same_component(node, k, lead)
            if ((kind == 'BEAM' .or. kind == 'LINK') .and. k < 3) then
               tie%turner = lead
               tie%arm = model%mesh%x(:, node) - model%mesh%x(:, lead)
            end if
            call add(tie)
         end do
      end subroutine tie_pair

      !> Reads a card of *EQUATION: the first term is tied to the others.
      subroutine read_equation()
         type(position_t) :: card, first
         type(tie_t) :: tie
         integer :: node, part, i
         real(wp) :: lead
         card = deck%at
         lead = 1.0_wp
         allocate (tie%of(0), tie%part(0), tie%factor(0))
         do while (deck%next_line())
            node = deck%node('node')
            if (node == 0) return
            part = deck%integer('dof')
            if (.not. deck%on_elements('node', model%mesh, [node])) return
            if (deck%at%line == card%line + 1) then
               first = deck%at
               tie%node = node
               tie%component = part
               lead = deck%real('coefficient')
               cycle
            else if (node == tie%node .and. part == tie%component) then
               call deck%wrong('node', 'the first term stands again: a degree of freedom cannot follow itself')
               return
            end if
            do i = 1, size(tie%of)
               if (tie%of(i) == node .and. tie%part(i) == part) exit
            end do
            if (i > size(tie%of)) then
               tie%of = [tie%of, node]
               tie%part = [tie%part, part]
               tie%factor = [tie%factor, 0.0_wp]
            end if
            tie%factor(i) = tie%factor(i) - deck%real('coefficient') / lead
         end do
         if (.not. deck%lines_sound()) return
         deck%at = first
         call add(tie)
      end subroutine read_equation

      !> Adds a tie, unless its degree of freedom is already tied.
      subroutine add(tie)
         type(tie_t), intent(in) :: tie
         character(:), allocatable :: from
         integer :: i
         do i = 1, size(model%tie)
            if (model%tie(i)%node /= tie%node .or. model%tie(i)%component /= tie%component) cycle
            from = ', for it is a released end'
            associate (origin => deck%names%tie_origin(i))
               if (origin%card > 0) from = ', from '//deck%source%line_words(origin%line_at)
            end associate
            call deck%wrong(deck%field_name(1), dof_text(model, tie)//' follows others already'//from)
            return
         end do
         model%tie = [model%tie, tie]
         deck%names%tie_origin = [deck%names%tie_origin, deck%at]
      end subroutine add
   end subroutine read_tie_cards

   !> Orders the ties so that their values can be computed one after the other. Ties of supported degrees of freedom and circular
   !> ties are errors.
   subroutine order_ties(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the supports, and the ties in the order in which they were read
      type(model_t), intent(inout) :: model             !! contains ties and supports
      logical :: waits(3, model%mesh%n_nodes)           ! true: the value of the component is not known yet
      logical :: done(size(model%tie))
      integer :: order(size(model%tie)), i, n, before
      waits = .false.
      do i = 1, size(model%tie)
         associate (tie => model%tie(i))
            if (.not. deck%names%supports_incomplete .and. model%fixed(tie%component, tie%node)) then
               call wrong_tie(i, dof_text(model, tie)//' is supported and cannot follow others; let these follow it')
               return
            end if
            waits(tie%component, tie%node) = .true.
         end associate
      end do
      done = .false.
      n = 0
      do
         before = n
         do i = 1, size(model%tie)
            if (done(i)) cycle
            if (.not. is_ready(model%tie(i))) cycle
            n = n + 1
            order(n) = i
            done(i) = .true.
            waits(model%tie(i)%component, model%tie(i)%node) = .false.
         end do
         if (n == before) exit
      end do
      if (n < size(model%tie)) then
         i = findloc(done, .false., 1, back=.true.)
         call wrong_tie(i, dof_text(model, model%tie(i))//' follows itself in the end: ties make a circle')
         return
      end if
      model%tie = model%tie(order)

   contains

      !> True if the value of a tie can be computed from values that are known.
      pure logical function is_ready(tie)
         type(tie_t), intent(in) :: tie
         integer :: k
         is_ready = .true.
         do k = 1, size(tie%of)
            is_ready = is_ready .and. .not. waits(tie%part(k), tie%of(k))
         end do
         if (tie%turner > 0) is_ready = is_ready .and. .not. waits(3, tie%turner)
      end function is_ready

      !> Adds an error at the line of a tie, or at the first *RELEASE: nodes of releases have no line of their own in the deck.
      subroutine wrong_tie(i, message)
         integer, intent(in) :: i ! index of the tie
         character(*), intent(in) :: message
         deck%at = deck%names%tie_origin(i)
         if (deck%at%card > 0) then
            call deck%wrong(deck%field_name(1), message)
         else if (deck%next_card('RELEASE')) then
            call deck%wrong_card(message)
         end if
         call deck%rewind()
      end subroutine wrong_tie
   end subroutine order_ties

   !> A tied degree of freedom in words.
   function dof_text(model, tie) result(string)
      type(model_t), intent(in) :: model
      type(tie_t), intent(in) :: tie
      character(:), allocatable :: string
      string = 'degree of freedom '//to_text(component_dof(tie%component))//' of '//node_words(model%mesh, tie%node)
   end function dof_text
end module read_ties
