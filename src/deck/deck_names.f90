!> Names and labels defined by the deck so far: nodes, elements, sets, materials, obstacles, monitors, steps.
module deck_names
   use text, only: to_text, parse_integer, nearest_word
   use lookup, only: label_map_t, name_list_t
   use model, only: node_set_t
   use diagnostics, only: diagnostics_t, place_t
   use printable_text, only: quoted
   use card_check, only: choices
   use deck_cards, only: deck_t, text_at, complain
   use card_values, only: value_place, field_place
   implicit none
   private
   public :: deck_names_t, set_list_t, find_nodes, find_elements, find_named, find_set, take_node_sets

   !> A set that grows: members in the order in which they were added, each once.
   type :: growing_set_t
      integer :: n = 0
      integer, allocatable :: member(:)    !! the first n are in use
      type(label_map_t), private :: known
   end type growing_set_t

   !> Sets of nodes or of elements (indices, not labels).
   type :: set_list_t
      type(name_list_t) :: names
      type(growing_set_t), allocatable :: set(:)
   contains
      procedure :: begin => begin_set
      procedure :: append => append_to_set
      procedure :: members => members_of_set
   end type set_list_t

   type :: deck_names_t
      logical :: above_only = .true.       !! the mesh is being read: cards may refer to preceding definitions only
      logical :: mesh_incomplete = .false. !! a card of the mesh has errors: nodes, elements or sets may be missing
      logical :: imperfections_incomplete = .false. !! an *IMPERFECTION has errors
      logical :: sections_incomplete = .false. !! a card of materials or sections has errors
      logical :: supports_incomplete = .false. !! a *BOUNDARY has errors
      logical :: loads_incomplete = .false.    !! a card of loads in a step has errors
      logical :: contacts_incomplete = .false. !! a *CONTACT or *GAP has errors
      logical :: unknown_cards = .false.       !! a keyword is not known
      type(label_map_t) :: node, element   !! from label to index
      integer :: least_node = huge(1), greatest_node = 0
      integer :: least_element = huge(1), greatest_element = 0
      type(set_list_t) :: node_set, element_set
      type(name_list_t) :: material, law, obstacle, monitor, step
      integer, allocatable :: placed_line(:) !! by curve: index of the data line that omits its number of elements, else 0
      integer, allocatable :: element_line(:) !! by element index: line of the deck that defines it (once the mesh is read)
      logical, allocatable :: connected(:) !! by node index: the node belongs to an element (once the mesh is read)
   end type deck_names_t

contains

   !> Index of a set, which is created if it does not exist yet.
   subroutine begin_set(self, name, set)
      class(set_list_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(out) :: set
      type(growing_set_t), allocatable :: larger(:)
      logical :: is_new
      integer :: i
      call self%names%add(name, set, is_new)
      if (.not. is_new) return
      if (.not. allocated(self%set)) allocate (self%set(16))
      if (set <= size(self%set)) return
      allocate (larger(2 * size(self%set)))
      do i = 1, size(self%set)
         larger(i)%n = self%set(i)%n
         larger(i)%known = self%set(i)%known
         call move_alloc(self%set(i)%member, larger(i)%member)
      end do
      call move_alloc(larger, self%set)
   end subroutine begin_set

   !> Adds a member to a set that does not contain it yet.
   pure subroutine append_to_set(self, set, member)
      class(set_list_t), intent(inout) :: self
      integer, intent(in) :: set    !! index of the set; 0: nothing happens
      integer, intent(in) :: member !! index of a node or an element
      integer, allocatable :: larger(:)
      if (set == 0) return
      associate (this => self%set(set))
         if (this%known%find(member) > 0) return
         if (.not. allocated(this%member)) allocate (this%member(16))
         if (this%n == size(this%member)) then
            allocate (larger(2 * this%n))
            larger(:this%n) = this%member
            call move_alloc(larger, this%member)
         end if
         this%n = this%n + 1
         this%member(this%n) = member
         call this%known%add(member, this%n)
      end associate
   end subroutine append_to_set

   !> The members of a set; none if the set is 0.
   pure function members_of_set(self, set) result(members)
      class(set_list_t), intent(in) :: self
      integer, intent(in) :: set !! index of the set
      integer, allocatable :: members(:)
      allocate (members(0))
      if (set == 0) return
      if (self%set(set)%n > 0) members = self%set(set)%member(:self%set(set)%n)
   end function members_of_set

   !> The nodes of a field that contains a label or a set. An error is added if there are none.
   subroutine find_nodes(deck, names, diagnostics, line, field, nodes)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line                    !! index of the data line
      integer, intent(in) :: field                   !! position of the field
      integer, allocatable, intent(out) :: nodes(:)  !! node indices; size 0 if not defined
      call find_members(deck, names, diagnostics, line, field, 'node', nodes)
   end subroutine find_nodes

   !> The elements of a field that contains a label or a set. An error is added if there are none.
   subroutine find_elements(deck, names, diagnostics, line, field, elements)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line                       !! index of the data line
      integer, intent(in) :: field                      !! position of the field
      integer, allocatable, intent(out) :: elements(:)  !! element indices; size 0 if not defined
      call find_members(deck, names, diagnostics, line, field, 'element', elements)
   end subroutine find_elements

   subroutine find_members(deck, names, diagnostics, line, field, what, members)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line, field
      character(*), intent(in) :: what ! node or element
      integer, allocatable, intent(out) :: members(:)
      type(place_t) :: place
      integer :: label, i
      logical :: is_label
      allocate (members(0))
      place = field_place(deck, line, field)
      call parse_integer(text_at(deck, place), label, is_label)
      if (.not. is_label) then
         i = set_at(deck, names, diagnostics, deck%data_line(line)%card, place, what)
         if (what == 'node') members = names%node_set%members(i)
         if (what == 'element') members = names%element_set%members(i)
         return
      end if
      if (what == 'node') i = names%node%find(label)
      if (what == 'element') i = names%element%find(label)
      if (i > 0) then
         members = [i]
      else if (.not. names%mesh_incomplete) then
         call complain(deck, diagnostics, deck%data_line(line)%card, place, what//' '//to_text(label)// &
            ' is not defined'//scope(names)//range_text(names, what))
      end if
   end subroutine find_members

   !> Index of the set that a parameter names. An error is added if it is not defined.
   subroutine find_set(deck, names, diagnostics, card, parameter, what, set)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card           !! index of the card
      character(*), intent(in) :: parameter !! NSET or ELSET
      character(*), intent(in) :: what      !! node or element
      integer, intent(out) :: set           !! 0 if not defined
      set = set_at(deck, names, diagnostics, card, value_place(deck, card, parameter), what)
   end subroutine find_set

   !> Index of the set named at a place; 0, and an error is added, if there is no such set or it is empty.
   integer function set_at(deck, names, diagnostics, card, place, what) result(set)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(place_t), intent(in) :: place
      character(*), intent(in) :: what
      character(:), allocatable :: name, message
      integer :: other
      name = text_at(deck, place)
      if (what == 'node') then
         set = names%node_set%names%find(name)
         other = names%element_set%names%find(name)
      else
         set = names%element_set%names%find(name)
         other = names%node_set%names%find(name)
      end if
      if (set > 0 .or. names%mesh_incomplete) return
      message = what//' set '//quoted(name)//' is not defined'//scope(names)
      if (other > 0) then
         message = message//' ('//quoted(name)//' is a set of '//trim(merge('elements', 'nodes   ', what == 'node'))//')'
      else if (what == 'node') then
         message = message//suggestion(names%node_set%names, name)
      else
         message = message//suggestion(names%element_set%names, name)
      end if
      call complain(deck, diagnostics, card, place, message)
   end function set_at

   !> Position in a list of the name at a place; 0, and an error is added, if it is missing.
   subroutine find_named(deck, list, diagnostics, card, place, what, position, also)
      type(deck_t), intent(in) :: deck
      type(name_list_t), intent(in) :: list
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card        !! index of the card
      type(place_t), intent(in) :: place !! of the name
      character(*), intent(in) :: what   !! 'material' and so on, for the message
      integer, intent(out) :: position
      character(*), intent(in), optional :: also !! another word allowed at this place, which the message then names
      character(:), allocatable :: name, message
      name = text_at(deck, place)
      position = list%find(name)
      if (position > 0 .or. list%incomplete) return
      message = what//' '//quoted(name)//' is not defined'
      if (present(also)) then
         if (nearest_word(also, name) /= '') then
            call complain(deck, diagnostics, card, place, message//'; did you mean '//also//'?')
            return
         end if
      end if
      call complain(deck, diagnostics, card, place, message//suggestion(list, name))
   end subroutine find_named

   !> Moves the node sets to the model.
   pure subroutine take_node_sets(names, node_set)
      type(deck_names_t), intent(in) :: names
      type(node_set_t), allocatable, intent(out) :: node_set(:)
      integer :: i
      allocate (node_set(names%node_set%names%n))
      do i = 1, size(node_set)
         node_set(i)%name = names%node_set%names%name(i)
         node_set(i)%node = names%node_set%members(i)
      end do
   end subroutine take_node_sets

   pure function suggestion(list, name) result(string)
      type(name_list_t), intent(in) :: list
      character(*), intent(in) :: name
      character(:), allocatable :: string
      integer, parameter :: most_listed = 8
      string = ''
      if (list%n == 0) return
      string = '; '//choices(list%listed(), name)
      if (list%n > most_listed .and. index(string, '; accepted') == 1) string = ''
      if (index(string, '; accepted') == 1) string = '; defined:'//string(len('; accepted:') + 1:)
   end function suggestion

   pure function scope(names) result(string)
      type(deck_names_t), intent(in) :: names
      character(:), allocatable :: string
      string = ''
      if (names%above_only) string = ' above this line'
   end function scope

   pure function range_text(names, what) result(string)
      type(deck_names_t), intent(in) :: names
      character(*), intent(in) :: what
      character(:), allocatable :: string
      integer :: least, greatest
      least = names%least_node
      greatest = names%greatest_node
      if (what == 'element') then
         least = names%least_element
         greatest = names%greatest_element
      end if
      string = ' (there are no '//what//'s)'
      if (greatest > 0) string = ' (labels run from '//to_text(least)//' to '//to_text(greatest)//')'
   end function range_text
end module deck_names
