!> A deck whose cards have passed their check, and the procedures by which readers get values from it.
!>
!> How a line of the deck is processed: `deck_assembly` replaces *INCLUDE and ${...}. `deck_cards` splits the text into cards,
!> parameters and fields, each with its place. `card_check` compares each card with its entry in `card_table`. `item_values`
!> converts each value once: words become their position in the table, everything else a number. After this no reader converts or
!> checks a single value. A reader visits the cards of one keyword and their data lines; `deck%at` is its position:
!>    do while (deck%next_card('CLOAD'))
!>       do while (deck%next_line())
!>          nodes = deck%nodes('node or set')
!>          magnitude = deck%real('magnitude')
!>
!> Cards and lines with errors are skipped. Parameters and fields have the names of the card table, which also contains their
!> defaults. Names and labels in a value are resolved here, too, with one message for each kind of definition. A reader only
!> interprets: it compares fields with each other and with the model, and reports an error at an item by `deck%wrong`. Definitions
!> that may be missing because of an error already reported (`names%..._incomplete`) cause no further error.
module checked_deck
   use text, only: to_text, nearest_word, same_name
   use lookup, only: name_list_t
   use printable_text, only: quoted
   use item_values, only: choices
   use card_values, only: card_values_t, position_t
   use model, only: mesh_t
   use deck_names, only: deck_names_t, labels_t, definitions_t, node_words
   implicit none
   private
   public :: checked_deck_t, position_t

   !> A deck that is being read.
   type, extends(card_values_t) :: checked_deck_t
      type(deck_names_t) :: names       !! names and labels that the readers have defined so far
   contains
      procedure :: nodes, elements, node, on_elements, named, touched_obstacle, quantity, defines
   end type checked_deck_t

contains

   !> The nodes that a label or a set stands for. If they are not defined, an error is added and the result has size 0.
   function nodes(self, name, nth)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      integer, allocatable :: nodes(:)       !! node indices
      nodes = members_of(self, name, nth, self%names%node, self%names%element)
   end function nodes

   !> The elements that a label or a set stands for. If they are not defined, an error is added and the result has size 0.
   function elements(self, name, nth)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      integer, allocatable :: elements(:)    !! element indices
      elements = members_of(self, name, nth, self%names%element, self%names%node)
   end function elements

   !> The node that a label stands for. If it is not defined, an error is added and the result is 0.
   integer function node(self, name)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the field in the card table
      integer, allocatable :: found(:)
      found = self%nodes(name)
      node = 0
      if (size(found) > 0) node = found(1)
   end function node

   !> The nodes or elements that a label or a set stands for. An error is added if they are not defined, unless their definition may
   !> have an error.
   function members_of(self, name, nth, labels, others) result(members)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in), optional :: nth
      type(labels_t), intent(in) :: labels, others ! labels of the kind that is meant, and of the other kind
      integer, allocatable :: members(:)
      character(:), allocatable :: typed, what, hint
      integer :: label, i
      label = nint(self%real(name, nth))
      if (label > 0) then
         i = labels%find(label)
         members = pack([i], i > 0)
      else
         i = labels%set_names%find(self%text(name, nth))
         members = labels%members(i)
      end if
      if (i > 0 .or. self%names%mesh_incomplete) return
      typed = self%text(name, nth)
      if (label > 0) then
         what = trim(labels%what)//' '//to_text(label)
         hint = ' (there are no '//trim(labels%what)//'s)'
         if (labels%n > 0) hint = ' (labels run from '//to_text(labels%least)//' to '//to_text(labels%greatest)//')'
      else
         what = trim(labels%what)//' set '//quoted(typed)
         hint = suggestion(labels%set_names, typed)
         if (others%set_names%find(typed) > 0) hint = ' ('//quoted(typed)//' is a set of '//trim(others%what)//'s)'
      end if
      if (self%names%above_only) hint = ' above this line'//hint
      call self%wrong(name, what//' is not defined'//hint, nth)
   end function members_of

   !> True if all nodes belong to elements; otherwise an error is added.
   logical function on_elements(self, name, mesh, nodes, consequence)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the parameter or field that names the nodes
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: nodes(:)        !! node indices
      character(*), intent(in), optional :: consequence !! text at the end of the message; default: ''
      character(:), allocatable :: message
      integer :: i
      on_elements = .true.
      do i = 1, size(nodes)
         on_elements = .not. self%names%is_loose(nodes(i))
         if (on_elements) cycle
         message = node_words(mesh, nodes(i))//' belongs to no element'
         if (present(consequence)) message = message//consequence
         call self%wrong(name, message)
         return
      end do
   end function on_elements

   !> Position in a list of the definition that a value names. If it is missing, an error is added and the result is 0.
   integer function named(self, name, list, what, nth, also) result(position)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      class(name_list_t), intent(in) :: list
      character(*), intent(in) :: what       !! kind of the definition for the message, such as 'material'
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      character(*), intent(in), optional :: also !! another word that is allowed at this place, for the message
      character(:), allocatable :: typed, message
      typed = self%text(name, nth)
      position = list%find(typed)
      if (position > 0 .or. list%incomplete) return
      message = what//' '//quoted(typed)//' is not defined'
      if (present(also)) then
         if (nearest_word(also, typed) /= '') then
            call self%wrong(name, message//'; did you mean '//also//'?', nth)
            return
         end if
      end if
      call self%wrong(name, message//suggestion(list, typed), nth)
   end function named

   !> The obstacle that a value names. An error is added if the obstacle is not defined, or if no contact names it.
   subroutine touched_obstacle(self, name, obstacle, ok)
      class(checked_deck_t), intent(inout) :: self !! deck whose contacts have been read
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      integer, intent(out) :: obstacle       !! index of the obstacle; 0: not defined
      logical, intent(out) :: ok !! true: the obstacle is defined, and a contact with it exists or may be missing because of an
      !! error
      obstacle = self%named(name, self%names%obstacle, 'obstacle')
      ok = obstacle > 0
      if (.not. ok) return
      ok = self%names%contacts_incomplete .or. self%names%touched(obstacle)
      if (.not. ok) call self%wrong(name, 'no *CONTACT names obstacle '//trim(self%names%obstacle%name(obstacle)))
   end subroutine touched_obstacle

   !> A quantity of the path: 0 for LOAD, or the index of a monitor. If there is no such monitor, an error is added and the result
   !> is -1.
   integer function quantity(self, name)
      class(checked_deck_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the field in the card table
      quantity = 0
      if (same_name(self%text(name), 'LOAD')) return
      quantity = self%named(name, self%names%monitor, 'monitor', also='LOAD')
      if (quantity == 0) quantity = -1
   end function quantity

   !> Defines the name of a card (its parameter NAME, or a default). If the name is in use, an error is added and the result is
   !> false.
   logical function defines(self, list, name)
      class(checked_deck_t), intent(inout) :: self
      class(definitions_t), intent(inout) :: list
      character(*), intent(in) :: name       !! the name
      integer :: position, earlier
      call list%define(trim(name), self%at%card_at, position, earlier)
      defines = earlier == 0
      if (.not. defines) call self%wrong('NAME', 'the name '//trim(name)//' was used in '//self%source%line_words(earlier))
   end function defines

   !> "; did you mean X?", or the names that are defined if they are few; '' if there are none.
   pure function suggestion(list, name) result(string)
      class(name_list_t), intent(in) :: list
      character(*), intent(in) :: name
      character(:), allocatable :: string
      integer, parameter :: most_listed = 8
      string = ''
      if (list%n == 0) return
      string = '; '//choices(list%listed(), name)
      if (list%n > most_listed .and. index(string, '; accepted') == 1) string = ''
      if (index(string, '; accepted') == 1) string = '; defined:'//string(len('; accepted:') + 1:)
   end function suggestion
end module checked_deck
