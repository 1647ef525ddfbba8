!> Reads *RELEASE: element ends that are partly released from a node. They get a node of their own, which follows the first node in
!> the components that are not released.
module read_releases
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, release_t, tie_t, joint_spring_t, complete_joints
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, field_given, field_integer, field_real, field_place
   use deck_names, only: deck_names_t, find_nodes, find_elements, take_node_sets
   use copied_nodes, only: copy_node
   use read_supports, only: dof_number
   implicit none
   private
   public :: read_release_cards

contains

   !> Reads the releases. They divide chains of elements, so that cards that need whole chains must be read before.
   subroutine read_release_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! with mesh; receives the new nodes
      type(model_t), intent(inout) :: model             !! receives nodes, tie, joint_spring, release
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, allocatable :: nodes(:), elements(:)
      logical, allocatable :: released(:, :)            ! (2, elements) ends that are released by an earlier line
      logical :: free(3)
      integer :: card, line, i, set
      call complete_joints(model)
      allocate (released(2, model%mesh%n_elements), source=.false.)
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'RELEASE') cycle
         set = 0
         if (given(deck, card, 'NSET')) call names%node_set%begin(parameter_text(deck, card, 'NSET'), set)
         do line = deck%card(card)%first_line, deck%card(card)%last_line
            if (.not. deck%data_line(line)%sound) cycle
            call find_nodes(deck, names, diagnostics, line, 1, nodes)
            if (field_given(deck, line, 2)) call find_elements(deck, names, diagnostics, line, 2, elements)
            call read_range(line, free)
            if (names%mesh_incomplete .or. .not. any(free)) cycle
            do i = 1, size(nodes)
               if (field_given(deck, line, 2)) then
                  call release_ends(line, nodes(i), elements)
               else
                  call release_all(line, nodes(i))
               end if
            end do
         end do
      end do
      if (size(model%release) > 0) call take_node_sets(names, model%node_set)

   contains

      !> Reads the components that a line releases.
      subroutine read_range(line, free)
         integer, intent(in) :: line
         logical, intent(out) :: free(3)
         integer :: first, last
         first = field_integer(deck, line, 3)
         last = first
         if (field_given(deck, line, 4)) last = field_integer(deck, line, 4)
         free = dof_number >= first .and. dof_number <= last
         if (.not. any(free) .or. last > 6) then
            call complain(deck, diagnostics, card, field_place(deck, line, 3), &
               'a plane rod has the degrees of freedom 1, 2 and 6 only')
            free = .false.
         else if (all(free)) then
            call complain(deck, diagnostics, card, field_place(deck, line, 3), 'nothing would hold the ends to the node')
            free = .false.
         end if
      end subroutine read_range

      !> Releases the ends of some elements at a node, which remain connected to each other.
      subroutine release_ends(line, node, elements)
         integer, intent(in) :: line, node, elements(:)
         logical :: chosen(2, model%mesh%n_elements)
         integer :: e, k
         chosen = .false.
         do k = 1, size(elements)
            e = elements(k)
            chosen(:, e) = model%mesh%node(:, e) == node
         end do
         if (size(elements) > 0) call release(line, node, chosen)
      end subroutine release_ends

      !> Releases all ends at a node except the first one, each separately.
      subroutine release_all(line, node)
         integer, intent(in) :: line, node
         logical :: chosen(2, model%mesh%n_elements)
         integer :: e, side, n
         n = 0
         do e = 1, model%mesh%n_elements
            do side = 1, 2
               if (model%mesh%node(side, e) /= node) cycle
               n = n + 1
               if (n == 1) cycle
               chosen = .false.
               chosen(side, e) = .true.
               call release(line, node, chosen)
            end do
         end do
         if (n < 2) call wrong(line, 'node '//label(node)//' has '//trim(merge('one element ', 'no element  ', n == 1))// &
            '; a joint needs a second one')
      end subroutine release_all

      !> Gives the chosen ends at a node a node of their own.
      subroutine release(line, node, chosen)
         integer, intent(in) :: line, node
         logical, intent(in) :: chosen(:, :)
         type(release_t) :: new
         type(tie_t) :: tie
         integer :: i
         if (.not. any(chosen)) then
            if (any(released)) then
               call wrong(line, 'no end of these elements is at node '//label(node)//', or it is released already')
            else
               call wrong(line, 'no end of these elements is at node '//label(node))
            end if
            return
         end if
         if (all(chosen .eqv. (model%mesh%node == node))) then
            call wrong(line, 'all ends at node '//label(node)//' would be released from it, and none stay: a joint needs a '// &
               'second element (an end that a support lets turn is PINNED)')
            return
         end if
         call copy_node(names, model%mesh, node)
         new%node = node
         new%own = model%mesh%n_nodes
         new%free = free
         where (chosen) model%mesh%node = new%own
         released = released .or. chosen
         model%release = [model%release, new]
         call names%node_set%append(set, new%own)
         do i = 1, 3
            if (.not. free(i)) then
               tie%node = new%own
               tie%component = i
               tie%of = [node]
               tie%part = [i]
               tie%factor = [1.0_wp]
               model%tie = [model%tie, tie]
            else if (field_given(deck, line, 5)) then
               model%joint_spring = [model%joint_spring, joint_spring_t([node, new%own], i, field_real(deck, line, 5))]
            end if
         end do
      end subroutine release

      subroutine wrong(line, message)
         integer, intent(in) :: line
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, field_place(deck, line, 1), message)
      end subroutine wrong

      function label(node) result(string)
         integer, intent(in) :: node
         character(:), allocatable :: string
         string = to_text(model%mesh%node_label(node))
      end function label
   end subroutine read_release_cards
end module read_releases
