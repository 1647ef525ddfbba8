!> Types of the table of cards: the parameters and data lines of a card, and the rules for their checks.
module card_spec
   use text, only: squeeze
   implicit none
   private
   public :: card_spec_t, layout_t, item_t, find_card, find_item, names_of, keywords_of
   public :: table_t, add_card, add_parameter, add_layout, add_field, add_point
   public :: kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_label, kind_label_or_set, kind_dof
   public :: kind_component, kind_path, kind_value, kind_distributed, kind_formula, kind_names
   public :: in_model, in_step, anywhere, outside_step, part_names
   public :: any_value, positive, not_negative, not_zero, below_one, poisson, bound_signs, bound_words
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
      enumerator :: kind_dof          !! an integer from 1 to 6, or one of the item's words
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

   !> Names of the kinds, parts of the deck and signs of the bounds, for the manual and for other programs; bounds in words, for
   !> messages.
   character(*), parameter :: kind_names(*) = [character(18) :: 'flag', 'word', 'name', 'integer', 'real', 'label', &
      'label or set', '1, 2 or 6', 'degrees of freedom', 'path', 'name = value', 'real or name', 'formula']
   character(*), parameter :: part_names(*) = [character(13) :: 'model', 'step', 'anywhere', 'outside steps']
   character(*), parameter :: bound_signs(0:*) = [character(12) :: '', '> 0', '>= 0', 'not 0', '> 0, < 1', '> -1, <= 0.5']
   character(*), parameter :: bound_words(0:*) = [character(26) :: '', 'positive', 'zero or positive', 'other than zero', &
      'positive and below 1', 'above -1 and at most 0.5']

   integer, parameter :: most_cards = 100 !! room of the table
   integer, parameter :: many_lines = huge(1)
   integer, parameter :: usual_most = 1000000000 !! largest magnitude of an integer by default; twice this value is still an integer

   !> A parameter, or a field of a data line.
   type :: item_t
      character(:), allocatable :: name    !! parameter: name in the deck; field: name in the manual
      integer :: kind = kind_real
      logical :: required = .true.         !! true: the item must be given; with `only`: if that condition is satisfied
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
      logical :: last_repeats = .false.         !! true: the last field may be given any number of times
      integer :: least = 1, most = many_lines   !! number of data lines
   end type layout_t

   !> Entry of one card in the table of cards.
   type :: card_spec_t
      character(:), allocatable :: keyword    !! without the star, single blanks
      character(:), allocatable :: key        !! the keyword in capitals without blanks
      integer :: where = in_model
      logical :: once = .false.               !! true: the card is allowed once in the model part, or once in each step
      logical :: free_text = .false.          !! true: data lines are not split into fields; a layout serves the manual only
      character(:), allocatable :: follows    !! card below which this one must be, with only cards of the same kind between; ''
      character(:), allocatable :: meaning
      type(item_t), allocatable :: parameter(:)
      type(layout_t), allocatable :: layout(:) !! the first one whose condition is satisfied applies; empty: no data lines
   end type card_spec_t

   !> The table while it is being made: it receives only the cards that are wanted, for a run needs few of them.
   type :: table_t
      integer :: n = 0
      type(card_spec_t) :: card(most_cards)   !! the first n are in use
      character(:), allocatable :: wanted     !! keys of the wanted cards between bars, with a bar at both ends; '': all cards
      logical :: skips = .false.              !! true: the last card is not wanted, and its parameters and fields are passed over
   end type table_t

contains

   !> Position of a card in the table, 0 if there is none; case and blanks are ignored.
   pure integer function find_card(table, keyword) result(position)
      type(card_spec_t), intent(in) :: table(:)
      character(*), intent(in) :: keyword !! without the star
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
      type(item_t), intent(in) :: items(:) !! at least one
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

   !> Begins a card; the following parameters and layouts belong to it.
   pure subroutine add_card(table, keyword, where, meaning, once, follows, free_text)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: keyword            !! this and the following arguments: components of card_spec_t
      integer, intent(in) :: where
      character(*), intent(in) :: meaning
      logical, intent(in), optional :: once, free_text !! default false
      character(*), intent(in), optional :: follows  !! default ''
      character(:), allocatable :: key
      key = squeeze(keyword)
      table%skips = table%wanted /= '' .and. index(table%wanted, '|'//key//'|') == 0
      if (table%skips) return
      table%n = table%n + 1
      associate (card => table%card(table%n))
         card%keyword = keyword
         card%key = key
         card%where = where
         card%meaning = meaning
         if (present(once)) card%once = once
         if (present(free_text)) card%free_text = free_text
         card%follows = text_of(follows)
         allocate (card%parameter(0), card%layout(0))
      end associate
   end subroutine add_card

   !> Adds a parameter to the last card of a table. It is required unless it has a default or is optional.
   pure subroutine add_parameter(table, name, kind, meaning, default, words, only, optional, bound, former, most)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name                         !! this and the following arguments: components of item_t
      integer, intent(in) :: kind
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: default, words, only, former !! default ''
      logical, intent(in), optional :: optional                !! true: may be left out
      integer, intent(in), optional :: bound, most
      if (table%skips) return
      associate (card => table%card(table%n))
         call add_item(card%parameter, name, kind, meaning, default, words, optional, bound)
         associate (item => card%parameter(size(card%parameter)))
            item%only = text_of(only)
            item%former = text_of(former)
            if (present(most)) item%most = most
         end associate
      end associate
   end subroutine add_parameter

   !> Adds a form of data lines to the last card of a table.
   pure subroutine add_layout(table, when, least, most, last_repeats)
      type(table_t), intent(inout) :: table
      character(*), intent(in), optional :: when     !! this and the following arguments: components of layout_t
      integer, intent(in), optional :: least, most
      logical, intent(in), optional :: last_repeats
      type(layout_t) :: layout
      if (table%skips) return
      layout%when = text_of(when)
      if (present(least)) layout%least = least
      if (present(most)) layout%most = most
      if (present(last_repeats)) layout%last_repeats = last_repeats
      allocate (layout%field(0))
      associate (card => table%card(table%n))
         card%layout = [card%layout, layout]
      end associate
   end subroutine add_layout

   !> Adds a field to the last form of the last card of a table. It is required unless it has a default or is optional.
   pure subroutine add_field(table, name, kind, meaning, unit, default, words, optional, bound, times_field)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name                         !! this and the following arguments: components of item_t
      integer, intent(in) :: kind
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: unit, default, words !! default ''
      logical, intent(in), optional :: optional                !! true: may be left out
      integer, intent(in), optional :: bound, times_field
      if (table%skips) return
      associate (card => table%card(table%n))
         associate (layout => card%layout(size(card%layout)))
            call add_item(layout%field, name, kind, meaning, default, words, optional, bound)
            associate (item => layout%field(size(layout%field)))
               item%unit = text_of(unit)
               if (present(times_field)) item%times_field = times_field
            end associate
         end associate
      end associate
   end subroutine add_field

   !> Adds two fields: coordinates of a point, or components of a vector, as lengths.
   pure subroutine add_point(table, x, y, meaning)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: x, y     !! names of the fields
      character(*), intent(in) :: meaning  !! of both
      call add_field(table, x, kind_real, meaning, unit='length')
      call add_field(table, y, kind_real, meaning, unit='length')
   end subroutine add_point

   !> Appends what parameters and fields have in common to a list; texts that are not given are ''.
   pure subroutine add_item(items, name, kind, meaning, default, words, optional, bound)
      type(item_t), allocatable, intent(inout) :: items(:)
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: default, words
      logical, intent(in), optional :: optional
      integer, intent(in), optional :: bound
      type(item_t) :: item
      type(item_t), allocatable :: longer(:)
      integer :: n, i
      item%name = name
      item%kind = kind
      item%meaning = meaning
      item%default = text_of(default)
      item%words = text_of(words)
      item%former = ''
      item%only = ''
      item%unit = ''
      item%required = .not. present(default)
      if (present(optional)) item%required = item%required .and. .not. optional
      if (present(bound)) item%bound = bound
      n = size(items)
      allocate (longer(n + 1))
      do i = 1, n
         call move_item(items(i), longer(i))
      end do
      call move_item(item, longer(n + 1))
      call move_alloc(longer, items)
   end subroutine add_item

   !> Moves the contents of one item to another; the first is empty afterwards.
   pure subroutine move_item(from, to)
      type(item_t), intent(inout) :: from
      type(item_t), intent(inout) :: to
      call move_alloc(from%name, to%name)
      to%kind = from%kind
      to%required = from%required
      call move_alloc(from%default, to%default)
      to%times_field = from%times_field
      call move_alloc(from%words, to%words)
      call move_alloc(from%former, to%former)
      call move_alloc(from%only, to%only)
      to%bound = from%bound
      to%most = from%most
      call move_alloc(from%unit, to%unit)
      call move_alloc(from%meaning, to%meaning)
   end subroutine move_item

   !> An optional text, '' if it is not given.
   pure function text_of(given) result(string)
      character(*), intent(in), optional :: given
      character(:), allocatable :: string
      string = ''
      if (present(given)) string = given
   end function text_of
end module card_spec
