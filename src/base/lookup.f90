!> Finds labels and names in constant time, by hash tables with open addressing.
module lookup
   use kinds, only: i8, name_length
   use text, only: upper
   implicit none
   private
   public :: label_map_t, name_list_t

   !> Maps labels (any integer but huge) to positions.
   type :: label_map_t
      private
      integer :: n = 0
      integer, allocatable :: key(:), position(:)
   contains
      procedure :: find => find_label
      procedure :: add => add_label
   end type label_map_t

   !> Names in the order in which they were added, each once; upper and lower case count as equal.
   type :: name_list_t
      integer :: n = 0
      character(name_length), allocatable :: name(:) !! names in the spelling in which they were added; only the first n are in use
      logical :: incomplete = .false.                        !! true: names may be missing because their cards have errors
      character(name_length), allocatable, private :: key(:) !! the names in capitals
      integer, allocatable, private :: slot(:)
   contains
      procedure :: find => find_name
      procedure :: add => add_name
      procedure :: listed => listed_names
   end type name_list_t

   integer, parameter :: vacant = huge(1)
   integer, parameter :: first_capacity = 16 !! a power of two, as are all larger capacities

contains

   !> Position of a label; 0 if it was not added.
   pure integer function find_label(self, label)
      class(label_map_t), intent(in) :: self
      integer, intent(in) :: label !! the label to be found
      integer :: slot
      find_label = 0
      if (self%n == 0) return
      slot = label_slot(self%key, label)
      if (self%key(slot) == label) find_label = self%position(slot)
   end function find_label

   !> Adds a label, or changes the position of an existing one.
   pure subroutine add_label(self, label, position)
      class(label_map_t), intent(inout) :: self
      integer, intent(in) :: label    !! label, any integer but huge(1)
      integer, intent(in) :: position !! position that find_label then returns, not 0
      integer :: slot
      if (.not. allocated(self%key)) then
         allocate (self%key(first_capacity), source=vacant)
         allocate (self%position(first_capacity), source=0)
      else if (2 * self%n >= size(self%key)) then
         call enlarge_labels(self)
      end if
      slot = label_slot(self%key, label)
      if (self%key(slot) == vacant) self%n = self%n + 1
      self%key(slot) = label
      self%position(slot) = position
   end subroutine add_label

   pure subroutine enlarge_labels(self)
      class(label_map_t), intent(inout) :: self
      integer, allocatable :: key(:), position(:)
      integer :: i, slot
      allocate (key(2 * size(self%key)), source=vacant)
      allocate (position(2 * size(self%key)), source=0)
      do i = 1, size(self%key)
         if (self%key(i) == vacant) cycle
         slot = label_slot(key, self%key(i))
         key(slot) = self%key(i)
         position(slot) = self%position(i)
      end do
      call move_alloc(key, self%key)
      call move_alloc(position, self%position)
   end subroutine enlarge_labels

   !> Slot that contains the label, or the vacant slot in which it is to be stored.
   pure integer function label_slot(key, label) result(slot)
      integer, intent(in) :: key(:), label
      integer(i8), parameter :: spread = 2654435761_i8 ! 2**32 divided by the golden ratio, odd
      integer :: mask
      mask = size(key) - 1
      slot = int(iand(ishft(int(label, i8) * spread, -16), int(mask, i8))) + 1
      do while (key(slot) /= label .and. key(slot) /= vacant)
         slot = iand(slot, mask) + 1
      end do
   end function label_slot

   !> Position of a name in the list; 0 if it is not in the list.
   pure integer function find_name(self, name)
      class(name_list_t), intent(in) :: self
      character(*), intent(in) :: name !! name as typed
      character(name_length) :: key
      find_name = 0
      if (self%n == 0) return
      key = upper(name)
      find_name = self%slot(name_slot(self%slot, self%key, key))
   end function find_name

   !> Position of a name in the list. A name that is not in the list is appended.
   pure subroutine add_name(self, name, position, is_new)
      class(name_list_t), intent(inout) :: self
      character(*), intent(in) :: name  !! name as typed
      integer, intent(out) :: position  !! position of the name in self%name
      logical, intent(out) :: is_new    !! false: the name was already in the list
      integer :: i
      position = self%find(name)
      is_new = position == 0
      if (.not. is_new) return
      if (.not. allocated(self%name)) then
         allocate (self%name(first_capacity), self%key(first_capacity))
         allocate (self%slot(2 * first_capacity), source=0)
      else if (self%n == size(self%name)) then
         self%name = [self%name, self%name] ! the length of the array is doubled
         self%key = [self%key, self%key]
         deallocate (self%slot)
         allocate (self%slot(2 * size(self%name)), source=0)
         do i = 1, self%n
            self%slot(name_slot(self%slot, self%key, self%key(i))) = i
         end do
      end if
      self%n = self%n + 1
      position = self%n
      self%name(position) = name
      self%key(position) = upper(name)
      self%slot(name_slot(self%slot, self%key, self%key(position))) = position
   end subroutine add_name

   !> All names, separated by bars, for messages.
   pure function listed_names(self) result(list)
      class(name_list_t), intent(in) :: self
      character(:), allocatable :: list
      integer :: i, n
      n = 0
      do i = 1, self%n
         n = n + len_trim(self%name(i)) + 1
      end do
      allocate (character(max(n - 1, 0)) :: list)
      n = 0
      do i = 1, self%n
         if (i > 1) list(n:n) = '|'
         list(n + 1:n + len_trim(self%name(i))) = trim(self%name(i))
         n = n + len_trim(self%name(i)) + 1
      end do
   end function listed_names

   !> Slot that refers to the name, or the vacant slot in which it is to be stored.
   pure integer function name_slot(slots, keys, key) result(slot)
      integer, intent(in) :: slots(:)
      character(name_length), intent(in) :: keys(:), key
      integer(i8) :: mix
      integer :: i
      mix = 5381
      do i = 1, len_trim(key)
         mix = iand(33 * mix + iachar(key(i:i)), 4294967295_i8)
      end do
      slot = int(iand(mix, int(size(slots) - 1, i8))) + 1
      do while (slots(slot) /= 0)
         if (keys(slots(slot)) == key) return
         slot = iand(slot, size(slots) - 1) + 1
      end do
   end function name_slot
end module lookup
