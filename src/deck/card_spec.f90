!> Types of the table of cards: the parameters and data lines of a card, and the rules for their checks.
module card_spec
   use text, only: squeeze
   implicit none
   private
   public :: card_spec_t, layout_t, item_t, find_card, find_item, names_of, keywords_of
   public :: table_t, begin_table, end_table, is_wanted, add_card, add_layout, add_item
   public :: kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_label, kind_label_or_set, kind_dof
   public :: kind_component, kind_path, kind_value, kind_distributed, kind_formula
   public :: in_model, in_step, anywhere, outside_step
   public :: any_value, positive, not_negative, not_zero, below_one, poisson, bound_words
   public :: many_lines, usual_most

   enum, bind(c)
      enumerator :: kind_flag = 1     !! a parameter without a value
      enumerator :: kind_word         !! one of the item's words
      enumerator :: kind_name         !! a letter, then letters, digits, _ - . +
      enumerator :: kind_integer
      enumerator :: kind_real
      enumerator :: kind_label        !! positive integer
      enumerator :: kind_label_or_set !! positive integer or the name of a set
      enumerator :: kind_component    !! degree of freedom of a node: 1, 2 or 6
      enumerator :: kind_dof          !! an integer from 1 to 6, or one of the words of the item
      enumerator :: kind_path         !! name of a file
      enumerator :: kind_value        !! name = number, formula or text in quotes
      enumerator :: kind_distributed  !! a number or the name of a *DISTRIBUTION
      enumerator :: kind_formula      !! a formula without commas
   end enum

   enum, bind(c)
      enumerator :: in_model = 1 !! before the first *STEP
      enumerator :: in_step      !! between *STEP and *END STEP
      enumerator :: anywhere     !! inside or outside a step
      enumerator :: outside_step !! not inside a step, but perhaps after one
   end enum

   enum, bind(c)
      enumerator :: any_value = 0, positive, not_negative, not_zero
      enumerator :: below_one !! positive and below 1
      enumerator :: poisson   !! Poisson's ratio
   end enum

   !> Descriptions of the bounds for messages.
   character(*), parameter :: bound_words(0:*) = [character(26) :: '', 'positive', 'zero or positive', 'other than zero', &
      'positive and below 1', 'above -1 and at most 0.5']

   integer, parameter :: most_cards = 100 !! largest number of entries of the table
   integer, parameter :: many_lines = huge(1)
   integer, parameter :: usual_most = 1000000000 !! largest magnitude of an integer by default; twice this number is still an
   !! integer

   !> A parameter, or a field of a data line.
   type :: item_t
      character(:), allocatable :: name    !! name of a parameter in the deck; name of a field in the manual
      integer :: kind = kind_real
      logical :: required = .true. !! true: the item must be given; if `only` is set, it must be given if that condition is
      !! satisfied
      character(:), allocatable :: default !! default value as text; '': none
      integer :: times_field = 0 !! number of the field whose value is multiplied by the default; 0: the default itself is the value
      character(:), allocatable :: words   !! accepted words between bars
      character(:), allocatable :: only    !! condition under which the item is allowed, such as 'TYPE=CIRCLE'; '': always
      integer :: bound = any_value
      integer :: most = usual_most         !! largest magnitude of an integer
      character(:), allocatable :: meaning !! meaning of the item, one line
   end type item_t

   !> The data lines of a card, or of one variant of the card.
   type :: layout_t
      character(:), allocatable :: when !! condition under which the layout applies: 'SECTION=RECT', 'GENERATE' (flag given), or '':
      !! always
      type(item_t), allocatable :: field(:)
      logical :: last_repeats = .false.         !! true: the last field may be given any number of times
      integer :: least = 1, most = many_lines   !! smallest and largest number of data lines
   end type layout_t

   !> Entry of one card in the table of cards.
   type :: card_spec_t
      character(:), allocatable :: keyword    !! keyword without the star, with single blanks
      character(:), allocatable :: key        !! keyword in capitals without blanks
      integer :: where = in_model
      logical :: once = .false.               !! true: the card is allowed once in the model part, or once in each step
      logical :: free_text = .false.          !! true: data lines are not split into fields, and the layout serves the manual only
      character(:), allocatable :: follows !! keyword of the card that must precede this card, with only cards of this kind in
      !! between; '': none
      type(item_t), allocatable :: parameter(:)
      type(layout_t), allocatable :: layout(:) !! layouts of data lines; the first one whose condition is satisfied applies; size 0:
      !! no data lines
   end type card_spec_t

   !> The table while it is being made. It receives only the cards that are needed, because a run needs few of them.
   type :: table_t
      integer :: n = 0
      type(card_spec_t), allocatable :: card(:) !! only the first n entries are in use
      integer :: layout = 0                   !! number of the last card's layout to which fields are added; 0: parameters are added
      integer :: item = 0                     !! number of items that were added to it
      character(:), allocatable :: wanted     !! keys of the cards to be added, between bars, with a bar at both ends; '': all cards
   end type table_t

contains

   !> Position of a card in the table, 0 if there is none; case and blanks are ignored.
   pure integer function find_card(table, keyword) result(position)
      type(card_spec_t), intent(in) :: table(:)
      character(*), intent(in) :: keyword !! keyword without the star
      character(:), allocatable :: key
      key = squeeze(keyword)
      do position = 1, size(table)
         if (table(position)%key == key) return
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

   !> Names of parameters or fields, between bars.
   pure function names_of(items) result(string)
      type(item_t), intent(in) :: items(:) !! parameters or fields, at least one
      character(:), allocatable :: string
      integer :: i
      string = items(1)%name
      do i = 2, size(items)
         string = string//'|'//items(i)%name
      end do
   end function names_of

   !> Keywords of cards with their stars, between bars.
   pure function keywords_of(table) result(string)
      type(card_spec_t), intent(in) :: table(:)
      character(:), allocatable :: string
      integer :: i
      string = '*'//table(1)%keyword
      do i = 2, size(table)
         string = string//'|*'//table(i)%keyword
      end do
   end function keywords_of

   !> Begins a table.
   pure subroutine begin_table(table, wanted)
      type(table_t), intent(out) :: table
      character(*), intent(in) :: wanted !! keys of the cards to be added, see table_t
      integer :: room, i
      table%wanted = wanted
      room = most_cards
      if (wanted /= '') room = count([(wanted(i:i) == '|', i=1, len(wanted))]) - 1
      allocate (table%card(room))
   end subroutine begin_table

   !> Returns the cards of a table.
   pure subroutine end_table(table, cards)
      type(table_t), intent(inout) :: table !! out: empty
      type(card_spec_t), allocatable, intent(out) :: cards(:)
      if (table%n == size(table%card)) call move_alloc(table%card, cards)
      if (.not. allocated(cards)) cards = table%card(:table%n)
   end subroutine end_table

   !> True if the card with this key must be added to the table.
   pure logical function is_wanted(table, key)
      type(table_t), intent(in) :: table
      character(*), intent(in) :: key !! keyword in capitals without blanks
      is_wanted = table%wanted == '' .or. index(table%wanted, '|'//key//'|') > 0
   end function is_wanted

   !> Begins a card. The items that follow are its parameters; those behind a layout are fields of its data lines.
   pure subroutine add_card(table, keyword, where, once, free_text, follows, n_parameters, n_layouts)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: keyword            !! keyword; this and the following arguments are components of card_spec_t
      integer, intent(in) :: where
      logical, intent(in) :: once, free_text
      character(*), intent(in) :: follows
      integer, intent(in) :: n_parameters, n_layouts !! numbers of parameters and layouts that will be added
      table%n = table%n + 1
      associate (card => table%card(table%n))
         card%keyword = keyword
         card%key = squeeze(keyword)
         card%where = where
         card%once = once
         card%free_text = free_text
         card%follows = follows
         allocate (card%parameter(n_parameters), card%layout(n_layouts))
      end associate
      table%layout = 0
      table%item = 0
   end subroutine add_card

   !> Begins a layout of data lines of the last card; the items that follow are its fields.
   pure subroutine add_layout(table, when, least, most, last_repeats, n_fields)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: when               !! condition; this and the following arguments are components of layout_t
      integer, intent(in) :: least, most
      logical, intent(in) :: last_repeats
      integer, intent(in) :: n_fields                !! number of fields that will be added
      table%layout = table%layout + 1
      table%item = 0
      associate (layout => table%card(table%n)%layout(table%layout))
         layout%when = when
         layout%least = least
         layout%most = most
         layout%last_repeats = last_repeats
         allocate (layout%field(n_fields))
      end associate
   end subroutine add_layout

   !> Adds a parameter to the last card, or a field to its last layout.
   pure subroutine add_item(table, name, kind, required, default, words, only, bound, most, times_field, meaning)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name               !! name; this and the following arguments are components of item_t
      integer, intent(in) :: kind
      logical, intent(in) :: required
      character(*), intent(in) :: default, words, only
      integer, intent(in) :: bound, most, times_field
      character(*), intent(in) :: meaning
      table%item = table%item + 1
      if (table%layout == 0) then
         call set(table%card(table%n)%parameter(table%item))
      else
         call set(table%card(table%n)%layout(table%layout)%field(table%item))
      end if

   contains

      pure subroutine set(item)
         type(item_t), intent(inout) :: item
         item%name = name
         item%kind = kind
         item%required = required
         item%default = default
         item%words = words
         item%only = only
         item%bound = bound
         item%most = most
         item%times_field = times_field
         item%meaning = meaning
      end subroutine set
   end subroutine add_item
end module card_spec
