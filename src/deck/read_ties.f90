!> Reads *MPC and *EQUATION: nodes and degrees of freedom that follow others.
module read_ties
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, tie_t, complete_joints
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: parameter_word, field_integer, field_real, field_place
   use deck_names, only: deck_names_t, find_nodes
   use copied_nodes, only: copy_node
   use read_supports, only: dof_number
   implicit none
   private
   public :: read_tie_cards, order_ties

   !> Card that defines a tie of the model; 0: a *RELEASE, which is already checked.
   type, public :: tie_origin_t
      integer :: card = 0, line = 0
   end type tie_origin_t

contains

   !> Reads the ties in the order of the deck.
   subroutine read_tie_cards(deck, names, model, origin, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! with the mesh; nodes that others follow need not belong to an element
      type(model_t), intent(inout) :: model             !! with the releases; receives further ties
      type(tie_origin_t), allocatable, intent(out) :: origin(:) !! (ties)
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, line
      call complete_joints(model)
      allocate (origin(size(model%tie)))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound) cycle
         select case (deck%card(card)%keyword)
         case ('MPC')
            do line = deck%card(card)%first_line, deck%card(card)%last_line
               if (deck%data_line(line)%sound) call read_pair(card, line, parameter_word(deck, card, 'TYPE'))
            end do
         case ('EQUATION')
            call read_equation(card)
         end select
      end do

   contains

      !> Reads a line of *MPC: nodes, and the node that they follow.
      subroutine read_pair(card, line, kind)
         integer, intent(in) :: card, line
         character(*), intent(in) :: kind
         integer, allocatable :: nodes(:), of(:)
         type(tie_t) :: tie
         integer :: i, k, lead
         call find_nodes(deck, names, diagnostics, line, 1, nodes)
         call find_nodes(deck, names, diagnostics, line, 2, of)
         if (size(of) == 0) return
         ! Nodes with rigid bars or links, and nodes that follow others in all components, need not belong to an element.
         if (kind == 'BEAM' .or. kind == 'LINK') names%connected(of(1)) = .true.
         if (kind /= 'PIN') names%connected(nodes) = .true.
         do i = 1, size(nodes)
            if (nodes(i) == of(1)) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), 'node '//label(of(1))//' cannot follow itself')
               return
            end if
            if (.not. is_there(card, line, 1, nodes(i))) return
            if (.not. is_there(card, line, 2, of(1))) return
            lead = of(1)
            if (kind == 'LINK') then
               if (norm2(model%mesh%x(:, nodes(i)) - model%mesh%x(:, lead)) <= 0.0_wp) then
                  call complain(deck, diagnostics, card, field_place(deck, line, 2), 'nodes '//label(nodes(i))//' and '// &
                     label(lead)//' are at the same place, and a link between them has no length; TYPE=PIN joins them')
                  return
               end if
               ! An additional pinned node with a rotation of its own carries the link as a rigid bar.
               call copy_node(names, model%mesh, lead)
               do k = 1, 2
                  tie = follower(model%mesh%n_nodes, k, lead)
                  call add(card, line, tie)
               end do
               lead = model%mesh%n_nodes
            end if
            do k = 1, merge(2, 3, kind == 'PIN' .or. kind == 'LINK')
               tie = follower(nodes(i), k, lead)
               if ((kind == 'BEAM' .or. kind == 'LINK') .and. k < 3) then
                  tie%turner = lead
                  tie%arm = model%mesh%x(:, nodes(i)) - model%mesh%x(:, lead)
               end if
               call add(card, line, tie)
            end do
         end do
      end subroutine read_pair

      !> A tie of a component to the same component of another node.
      pure type(tie_t) function follower(node, component, of) result(tie)
         integer, intent(in) :: node, component, of
         tie%node = node
         tie%component = component
         tie%of = [of]
         tie%part = [component]
         tie%factor = [1.0_wp]
      end function follower

      !> Reads a card of *EQUATION: its first term follows the others.
      subroutine read_equation(card)
         integer, intent(in) :: card
         integer, allocatable :: nodes(:)
         type(tie_t) :: tie
         integer :: line, part, first, i
         real(wp) :: lead
         first = deck%card(card)%first_line
         lead = 1.0_wp
         allocate (tie%of(0), tie%part(0), tie%factor(0))
         do line = first, deck%card(card)%last_line
            if (.not. deck%data_line(line)%sound) return
            call find_nodes(deck, names, diagnostics, line, 1, nodes)
            if (size(nodes) == 0) return
            part = findloc(dof_number, field_integer(deck, line, 2), 1)
            if (part == 0) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), &
                  'a plane rod has the degrees of freedom 1, 2 and 6 only')
               return
            end if
            if (.not. is_there(card, line, 1, nodes(1))) return
            if (line == first) then
               tie%node = nodes(1)
               tie%component = part
               lead = field_real(deck, line, 3)
               cycle
            end if
            if (nodes(1) == tie%node .and. part == tie%component) then
               call complain(deck, diagnostics, card, field_place(deck, line, 1), &
                  'the first term stands again: a degree of freedom cannot follow itself')
               return
            end if
            do i = 1, size(tie%of)
               if (tie%of(i) == nodes(1) .and. tie%part(i) == part) exit
            end do
            if (i > size(tie%of)) then
               tie%of = [tie%of, nodes(1)]
               tie%part = [tie%part, part]
               tie%factor = [tie%factor, 0.0_wp]
            end if
            tie%factor(i) = tie%factor(i) - field_real(deck, line, 3) / lead
         end do
         call add(card, first, tie)
      end subroutine read_equation

      subroutine add(card, line, tie)
         integer, intent(in) :: card, line
         type(tie_t), intent(in) :: tie
         integer :: i
         do i = 1, size(model%tie)
            if (model%tie(i)%node /= tie%node .or. model%tie(i)%component /= tie%component) cycle
            call complain(deck, diagnostics, card, field_place(deck, line, 1), dof_text(model, tie)// &
               ' follows others already'//from(origin(i)))
            return
         end do
         model%tie = [model%tie, tie]
         origin = [origin, tie_origin_t(card, line)]
      end subroutine add

      !> Words for the place of a tie in the deck.
      function from(origin) result(words)
         type(tie_origin_t), intent(in) :: origin
         character(:), allocatable :: words
         words = ', for it is a released end'
         if (origin%card > 0) words = ', from line '//to_text(deck%data_line(origin%line)%line)
      end function from

      !> False for a node that belongs to no element and has no other use; an error is then added.
      logical function is_there(card, line, field, node)
         integer, intent(in) :: card, line, field, node
         is_there = names%mesh_incomplete
         if (.not. is_there) is_there = names%connected(node)
         if (.not. is_there) call complain(deck, diagnostics, card, field_place(deck, line, field), &
            'node '//label(node)//' belongs to no element')
      end function is_there

      function label(node) result(string)
         integer, intent(in) :: node
         character(:), allocatable :: string
         string = to_text(model%mesh%node_label(node))
      end function label
   end subroutine read_tie_cards

   !> Orders ties so that their values can be computed one after the other; ties of supported degrees of freedom and circular ties
   !> are errors.
   subroutine order_ties(deck, names, origin, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(tie_origin_t), intent(in) :: origin(:)       !! (ties) in the present order
      type(model_t), intent(inout) :: model             !! with ties and supports
      type(diagnostics_t), intent(inout) :: diagnostics
      logical :: waits(3, model%mesh%n_nodes)
      integer :: order(size(model%tie)), i, n, before
      logical :: done(size(model%tie))
      waits = .false.
      do i = 1, size(model%tie)
         associate (tie => model%tie(i))
            if (.not. names%supports_incomplete .and. model%fixed(tie%component, tie%node)) then
               call wrong(i, dof_text(model, tie)//' is supported and cannot follow others; let these follow it')
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
            if (.not. ready(model%tie(i))) cycle
            n = n + 1
            order(n) = i
            done(i) = .true.
            waits(model%tie(i)%component, model%tie(i)%node) = .false.
         end do
         if (n == before) exit
      end do
      if (n < size(model%tie)) then
         i = findloc(done, .false., 1, back=.true.)
         call wrong(i, dof_text(model, model%tie(i))//' follows itself in the end: ties make a circle')
         return
      end if
      model%tie = model%tie(order)

   contains

      !> True if the value of a tie can be computed.
      pure logical function ready(tie)
         type(tie_t), intent(in) :: tie
         integer :: k
         ready = .true.
         do k = 1, size(tie%of)
            ready = ready .and. .not. waits(tie%part(k), tie%of(k))
         end do
         if (tie%turner > 0) ready = ready .and. .not. waits(3, tie%turner)
      end function ready

      subroutine wrong(i, message)
         integer, intent(in) :: i
         character(*), intent(in) :: message
         integer :: card
         if (origin(i)%card == 0) then
            ! A node of a release, which has no line of its own in the deck.
            do card = 1, deck%n_cards - 1
               if (deck%card(card)%keyword == 'RELEASE') exit
            end do
            call complain(deck, diagnostics, card, deck%card(card)%place, message)
         else
            call complain(deck, diagnostics, origin(i)%card, field_place(deck, origin(i)%line, 1), message)
         end if
      end subroutine wrong
   end subroutine order_ties

   !> A tied degree of freedom in words.
   function dof_text(model, tie) result(string)
      type(model_t), intent(in) :: model
      type(tie_t), intent(in) :: tie
      character(:), allocatable :: string
      string = 'degree of freedom '//to_text(dof_number(tie%component))//' of node '//to_text(model%mesh%node_label(tie%node))
   end function dof_text
end module read_ties
