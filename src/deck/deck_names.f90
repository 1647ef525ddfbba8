!> Names and labels that the deck has defined so far: of nodes, elements, sets, materials, obstacles, monitors, steps.
module deck_names
   use text, only: to_text
   use lookup, only: label_map_t, name_list_t
   use card_values, only: position_t
   use kinds, only: wp
   use model, only: model_t, mesh_t, node_set_t
   implicit none
   private
   public :: deck_names_t, labels_t, definitions_t, take_node_sets, copy_node, node_words, element_words

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
      integer, allocatable :: placed_line(:) !! (curves) index of the data line if it omits the number of elements; else 0
      type(position_t), allocatable :: tie_origin(:) !! (ties) position of the tie's card or line in the deck; card 0: the tie
      !! belongs to a release
      logical, allocatable :: connected(:) !! (nodes) true: the node belongs to an element; set when the mesh has been read
   contains
      procedure :: is_loose
   end type deck_names_t

contains

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
end module deck_names
