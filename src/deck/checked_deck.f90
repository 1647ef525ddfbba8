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
!> that may be missing because of an error already reported (`names%..._incomplete`) cause no further error. The definitions are the
!> names and labels that the deck has defined so far: of nodes, elements, sets, materials, obstacles, monitors, steps.
module checked_deck
   use text, only: to_text, nearest_word, same_name
   use lookup, only: name_list_t, label_map_t
   use printable_text, only: quoted
   use item_values, only: choices
   use card_values, only: card_values_t, position_t
   use model, only: mesh_t, model_t, node_set_t
   use kinds, only: wp
   implicit none
   private
   public :: checked_deck_t, position_t, labels_t, definitions_t, take_node_sets, copy_node, node_words, element_words

   !> A set to which members are added: each member once, in the order in which they were added.
   type :: growing_set_t
      integer :: n = 0
      integer, allocatable :: member(:)    !! only the first n entries are in use
      type(label_map_t), private :: known
   end type growing_set_t

   !> Nodes or elements: their labels, the lines of the deck that define them, and sets of them. Sets contain indices, not labels.
   type :: labels_t
      character(7) :: what = ''            !! 'node' or 'element', for messages
      integer :: n = 0
      integer :: least = huge(1), greatest = 0 !! smallest and largest label
      integer, allocatable :: line(:) !! (nodes or elements, in the order of their definition) line of the deck with the definition;
      !! only the first n entries are in use
      type(name_list_t) :: set_names
      type(label_map_t), private :: index
      type(growing_set_t), allocatable, private :: set(:)
   contains
      procedure :: add => add_label, find => find_label, begin_set, append => append_to_set, members => members_of_set
   end type labels_t

   !> Names with the lines of the deck that define them.
   type, extends(name_list_t) :: definitions_t
      integer, allocatable :: line(:)      !! (names) line of the deck that defines the name
   contains
      procedure :: define
   end type definitions_t

   !> All names and labels that the deck has defined so far, and the kinds of definitions that may be missing because of errors.
   type :: deck_names_t
      logical :: above_only = .true.       !! true: the mesh is being read, and cards may refer to preceding definitions only
      logical :: mesh_incomplete = .false. !! true: a card of the mesh has errors: nodes, elements or sets may be missing
      logical :: imperfections_incomplete = .false. !! true: an *IMPERFECTION has errors
      logical :: sections_incomplete = .false. !! true: a card of materials or sections has errors
      logical :: supports_incomplete = .false. !! true: a card of supports, springs or joints has errors
      logical :: loads_incomplete = .false.    !! true: a card of loads in a step has errors
      logical :: contacts_incomplete = .false. !! true: a *CONTACT or *GAP has errors
      logical :: unknown_cards = .false.       !! true: a keyword is not known
      type(labels_t) :: node = labels_t(what='node'), element = labels_t(what='element')
      type(definitions_t) :: distribution, material, law, obstacle, monitor, step
      type(name_list_t) :: pushed_out        !! obstacles named by a *CONTACT INTERFERENCE, SHRINK
      logical :: has_modes = .false.         !! true: an *IMPERFECTION has SHAPE=MODE
      logical, allocatable :: touched(:) !! (obstacles) true: a *CONTACT or *GAP names the obstacle; set when these cards have been
      !! read
      integer, allocatable :: curve_line(:) !! (curves) index of the data line that defines the curve, or of its card's last one
      type(position_t), allocatable :: contact_origin(:) !! (contacts) position of the contact's card or line in the deck
      type(position_t), allocatable :: tie_origin(:) !! (ties) position of the tie's card or line in the deck; card 0: the tie
      !! belongs to a release
      logical, allocatable :: connected(:) !! (nodes) true: the node belongs to an element; set when the mesh has been read
   contains
      procedure :: is_loose
   end type deck_names_t

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

   !> Adds a node or element behind the last one.
   pure subroutine add_label(self, label, line)
      class(labels_t), intent(inout) :: self
      integer, intent(in) :: label !! label that is not in use yet
      integer, intent(in) :: line  !! line of the deck that defines it
      if (.not. allocated(self%line)) allocate (self%line(64))
      call put(self%line, self%n, line)
      self%least = min(self%least, label)
      self%greatest = max(self%greatest, label)
      call self%index%add(label, self%n)
   end subroutine add_label

   !> Index of the node or element with a label; 0 if there is none.
   pure integer function find_label(self, label) result(i)
      class(labels_t), intent(in) :: self
      integer, intent(in) :: label
      i = self%index%find(label)
   end function find_label

   !> Index of a set. The set is created if it does not exist.
   subroutine begin_set(self, name, set)
      class(labels_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(out) :: set
      type(growing_set_t), allocatable :: larger(:)
      logical :: is_new
      call self%set_names%add(name, set, is_new)
      if (.not. is_new) return
      if (.not. allocated(self%set)) allocate (self%set(16))
      if (set <= size(self%set)) return
      allocate (larger(2 * size(self%set)))
      larger(:size(self%set)) = self%set
      call move_alloc(larger, self%set)
   end subroutine begin_set

   !> Adds to a set those members that it does not contain yet.
   pure subroutine append_to_set(self, set, members)
      class(labels_t), intent(inout) :: self
      integer, intent(in) :: set        !! index of the set; 0: nothing is done
      integer, intent(in) :: members(:) !! indices of nodes or elements
      integer :: i
      if (set == 0) return
      associate (this => self%set(set))
         if (.not. allocated(this%member)) allocate (this%member(16))
         do i = 1, size(members)
            if (this%known%find(members(i)) > 0) cycle
            call put(this%member, this%n, members(i))
            call this%known%add(members(i), this%n)
         end do
      end associate
   end subroutine append_to_set

   !> Puts a number behind the first n of a list, which gets more room if it is full.
   pure subroutine put(list, n, number)
      integer, allocatable, intent(inout) :: list(:)
      integer, intent(inout) :: n
      integer, intent(in) :: number
      if (n == size(list)) list = [list, list] ! the length of the array is doubled
      n = n + 1
      list(n) = number
   end subroutine put

   !> The members of a set; size 0 for set 0.
   pure function members_of_set(self, set) result(members)
      class(labels_t), intent(in) :: self
      integer, intent(in) :: set !! index of the set
      integer, allocatable :: members(:)
      allocate (members(0))
      if (set == 0) return
      if (self%set(set)%n > 0) members = self%set(set)%member(:self%set(set)%n)
   end function members_of_set

   !> Adds a name to a list, with the line of the deck that defines it.
   pure subroutine define(self, name, line, position, earlier)
      class(definitions_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: line       !! number of the line in the deck
      integer, intent(out) :: position  !! position of the name in the list
      integer, intent(out) :: earlier   !! line that already defines the name; 0: none
      logical :: is_new
      if (.not. allocated(self%line)) allocate (self%line(0))
      call self%add(name, position, is_new)
      earlier = 0
      if (is_new) self%line = [self%line, line]
      if (.not. is_new) earlier = self%line(position)
   end subroutine define

   !> True if a node belongs to no element, and the mesh is complete.
   pure logical function is_loose(self, node)
      class(deck_names_t), intent(in) :: self
      integer, intent(in) :: node !! index of the node
      is_loose = .not. (self%mesh_incomplete .or. self%connected(node))
   end function is_loose

   !> Moves the node sets to the model.
   pure subroutine take_node_sets(names, node_set)
      type(deck_names_t), intent(in) :: names
      type(node_set_t), allocatable, intent(out) :: node_set(:)
      integer :: i
      allocate (node_set(names%node%set_names%n))
      do i = 1, size(node_set)
         node_set(i)%name = names%node%set_names%name(i)
         node_set(i)%node = names%node%members(i)
      end do
   end subroutine take_node_sets

   !> Adds a node for a joint at the position of another node, with the next free label. It counts as the node of an element.
   subroutine copy_node(names, model, node)
      type(deck_names_t), intent(inout) :: names
      type(model_t), intent(inout) :: model !! out: with the new node, which has neither supports nor springs
      integer, intent(in) :: node !! index of the node that is copied
      integer :: n
      n = model%mesh%n_nodes
      associate (mesh => model%mesh)
         mesh%x = reshape([mesh%x, mesh%x(:, node)], [2, n + 1])
         mesh%x_nominal = reshape([mesh%x_nominal, mesh%x_nominal(:, node)], [2, n + 1])
         mesh%node_label = [mesh%node_label, names%node%greatest + 1]
         mesh%n_nodes = n + 1
      end associate
      model%fixed = reshape([model%fixed, .false., .false., .false.], [3, n + 1])
      model%spring = reshape([model%spring, 0.0_wp, 0.0_wp, 0.0_wp], [3, n + 1])
      names%connected = [names%connected(:n), .true.]
      call names%node%add(names%node%greatest + 1, names%node%line(node))
   end subroutine copy_node

   !> "node 12", for messages.
   pure function node_words(mesh, node) result(words)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node !! index of the node
      character(:), allocatable :: words
      words = 'node '//to_text(mesh%node_label(node))
   end function node_words

   !> "element 12", for messages.
   pure function element_words(mesh, element) result(words)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element !! index of the element
      character(:), allocatable :: words
      words = 'element '//to_text(mesh%element_label(element))
   end function element_words
end module checked_deck
