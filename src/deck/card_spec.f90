!> Types of the table of cards: the parameters and data lines of a card, and the rules for their checks.
module card_spec
   use text, only: squeeze
   implicit none
   private
   public :: card_spec_t, layout_t, item_t, find_card, find_item
   public :: add_card, add_parameter, add_layout, add_field
   public :: kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_label, kind_label_or_set, kind_dof
   public :: kind_path, kind_value
   public :: in_model, in_step, anywhere, outside_step
   public :: any_value, positive, not_negative, not_zero
   public :: many_lines, usual_most

   enum, bind(c)
      enumerator :: kind_flag = 1     !! a parameter without a value
      enumerator :: kind_word         !! one of the item's words
      enumerator :: kind_name         !! a letter, then letters, digits, _ - . +
      enumerator :: kind_integer
      enumerator :: kind_real
      enumerator :: kind_label        !! positive integer
      enumerator :: kind_label_or_set !! positive integer or the name of a set
      enumerator :: kind_dof          !! an integer from 1 to 6, or one of the item's words
      enumerator :: kind_path         !! name of a file
      enumerator :: kind_value        !! name = number, formula or text in quotes
   end enum

   enum, bind(c)
      enumerator :: in_model = 1 !! before the first *STEP
      enumerator :: in_step      !! between *STEP and *END STEP
      enumerator :: anywhere     !! inside or outside a step
      enumerator :: outside_step !! not inside a step, but perhaps after one
   end enum

   enum, bind(c)
      enumerator :: any_value = 0, positive, not_negative, not_zero
   end enum

   integer, parameter :: many_lines = huge(1)
   integer, parameter :: usual_most = 1000000000 !! largest magnitude of an integer by default; twice this value is still an integer

   !> A parameter, or a field of a data line.
   type :: item_t
      character(:), allocatable :: name    !! parameter: name in the deck; field: name in the manual
      integer :: kind = kind_real
      logical :: required = .true.         !! parameter with `only`: required if that condition is satisfied
      character(:), allocatable :: default !! '': none
      integer :: times_field = 0           !! field whose value is multiplied by the default (0: the default itself is the value)
      character(:), allocatable :: words   !! accepted words between bars
      character(:), allocatable :: former  !! words of earlier versions, between bars, each followed by a blank and the present word
      character(:), allocatable :: only    !! condition under which the item is allowed, such as 'TYPE=CIRCLE'; '': always
      integer :: bound = any_value
      integer :: most = usual_most         !! largest magnitude of an integer
      character(:), allocatable :: unit    !! in words; '': none
      character(:), allocatable :: meaning !! one line
   end type item_t

   !> The data lines of a card, or of one variant of the card.
   type :: layout_t
      character(:), allocatable :: when         !! 'SECTION=RECT', 'GENERATE' (flag given), or '': always
      type(item_t), allocatable :: field(:)
      logical :: last_repeats = .false.         !! the last field may be given any number of times
      integer :: least = 1, most = many_lines   !! number of data lines
   end type layout_t

   type :: card_spec_t
      character(:), allocatable :: keyword    !! without the star, single blanks
      integer :: where = in_model
      logical :: once = .false.               !! at most once in the model part, or in each step
      logical :: free_text = .false.          !! data lines are not split into fields; a layout serves the manual only
      character(:), allocatable :: follows    !! card below which this one must be, with only cards of the same kind between; ''
      character(:), allocatable :: meaning
      type(item_t), allocatable :: parameter(:)
      type(layout_t), allocatable :: layout(:) !! the first one whose condition is satisfied applies; empty: no data lines
   end type card_spec_t

contains

   !> Position of a card in the table, 0 if there is none; case and blanks are ignored.
   pure integer function find_card(table, keyword) result(position)
      type(card_spec_t), intent(in) :: table(:)
      character(*), intent(in) :: keyword !! without the star
      character(:), allocatable :: key
      key = squeeze(keyword)
      do position = 1, size(table)
         if (squeeze(table(position)%keyword) == key) return
      end do
      position = 0
   end function find_card

   !> Position of a parameter in its card's list, 0 if there is none; case and blanks are ignored.
   pure integer function find_item(items, name) result(position)
      type(item_t), intent(in) :: items(:)
      character(*), intent(in) :: name
      character(:), allocatable :: key
      key = squeeze(name)
      do position = 1, size(items)
         if (squeeze(items(position)%name) == key) return
      end do
      position = 0
   end function find_item

   !> Appends a card to a table.
   pure subroutine add_card(table, keyword, where, meaning, once, follows, free_text)
      type(card_spec_t), allocatable, intent(inout) :: table(:)
      character(*), intent(in) :: keyword            !! this and the following arguments: components of card_spec_t
      integer, intent(in) :: where
      character(*), intent(in) :: meaning
      logical, intent(in), optional :: once, free_text !! default false
      character(*), intent(in), optional :: follows  !! default ''
      type(card_spec_t), allocatable :: longer(:)
      integer :: n, i
      n = size(table) + 1
      allocate (longer(n))
      do i = 1, n - 1
         call move_card(table(i), longer(i))  ! moved, not copied: copies of the whole table for every card would take longer than
         ! reading a deck
      end do
      call move_alloc(longer, table)
      table(n)%keyword = keyword
      table(n)%where = where
      table(n)%meaning = meaning
      if (present(once)) table(n)%once = once
      if (present(free_text)) table(n)%free_text = free_text
      table(n)%follows = ''
      if (present(follows)) table(n)%follows = follows
      allocate (table(n)%parameter(0), table(n)%layout(0))
   end subroutine add_card

   !> Moves the contents of one card to another; the first is empty afterwards.
   pure subroutine move_card(from, to)
      type(card_spec_t), intent(inout) :: from
      type(card_spec_t), intent(inout) :: to
      call move_alloc(from%keyword, to%keyword)
      to%where = from%where
      to%once = from%once
      call move_alloc(from%follows, to%follows)
      to%free_text = from%free_text
      call move_alloc(from%meaning, to%meaning)
      call move_alloc(from%parameter, to%parameter)
      call move_alloc(from%layout, to%layout)
   end subroutine move_card

   !> Adds a parameter to the last card of a table. It is required unless it has a default or is optional.
   pure subroutine add_parameter(table, name, kind, meaning, default, words, only, optional, bound, former, most)
      type(card_spec_t), intent(inout) :: table(:)
      character(*), intent(in) :: name                         !! this and the following arguments: components of item_t
      integer, intent(in) :: kind
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: default, words, only, former !! default ''
      logical, intent(in), optional :: optional                !! true: may be left out
      integer, intent(in), optional :: bound, most
      type(item_t) :: item
      item = new_item(name, kind, meaning, default, words, only, optional, bound)
      if (present(most)) item%most = most
      if (present(former)) item%former = former
      associate (card => table(size(table)))
         call append(card%parameter, item)
      end associate
   end subroutine add_parameter

   !> Adds a form of data lines to the last card of a table.
   pure subroutine add_layout(table, when, least, most, last_repeats)
      type(card_spec_t), intent(inout) :: table(:)
      character(*), intent(in), optional :: when     !! this and the following arguments: components of layout_t
      integer, intent(in), optional :: least, most
      logical, intent(in), optional :: last_repeats
      type(layout_t), allocatable :: longer(:)
      integer :: n
      associate (card => table(size(table)))
         n = size(card%layout)
         allocate (longer(n + 1))
         longer(:n) = card%layout
         longer(n + 1)%when = ''
         if (present(when)) longer(n + 1)%when = when
         if (present(least)) longer(n + 1)%least = least
         if (present(most)) longer(n + 1)%most = most
         if (present(last_repeats)) longer(n + 1)%last_repeats = last_repeats
         allocate (longer(n + 1)%field(0))
         call move_alloc(longer, card%layout)
      end associate
   end subroutine add_layout

   !> Adds a field to the last form of the last card of a table. It is required unless it has a default or is optional.
   pure subroutine add_field(table, name, kind, meaning, unit, default, words, optional, bound, times_field)
      type(card_spec_t), intent(inout) :: table(:)
      character(*), intent(in) :: name                         !! this and the following arguments: components of item_t
      integer, intent(in) :: kind
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: unit, default, words !! default ''
      logical, intent(in), optional :: optional                !! true: may be left out
      integer, intent(in), optional :: bound, times_field
      type(item_t) :: item
      item = new_item(name, kind, meaning, default, words, optional=optional, bound=bound)
      if (present(unit)) item%unit = unit
      if (present(times_field)) item%times_field = times_field
      associate (card => table(size(table)))
         call append(card%layout(size(card%layout))%field, item)
      end associate
   end subroutine add_field

   pure type(item_t) function new_item(name, kind, meaning, default, words, only, optional, bound) result(item)
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: default, words, only
      logical, intent(in), optional :: optional
      integer, intent(in), optional :: bound
      item%name = name
      item%kind = kind
      item%meaning = meaning
      item%default = ''
      item%words = ''
      item%former = ''
      item%only = ''
      item%unit = ''
      item%required = .not. present(default)
      if (present(default)) item%default = default
      if (present(words)) item%words = words
      if (present(only)) item%only = only
      if (present(optional)) item%required = item%required .and. .not. optional
      if (present(bound)) item%bound = bound
   end function new_item

   pure subroutine append(items, item)
      type(item_t), allocatable, intent(inout) :: items(:)
      type(item_t), intent(in) :: item
      type(item_t), allocatable :: longer(:)
      integer :: n
      n = size(items)
      allocate (longer(n + 1))
      longer(:n) = items
      longer(n + 1) = item
      call move_alloc(longer, items)
   end subroutine append
end module card_spec
