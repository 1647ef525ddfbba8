!> Position of the reader in a checked deck, typed values of parameters and fields at this position, and errors at them.
!>
!> All items have the names of the table of cards. Their values have passed the check of the cards; a value that is not given is
!> replaced by its default.
module card_values
   use kinds, only: wp
   use text, only: word_at
   use diagnostics, only: place_t
   use card_spec, only: item_t, kind_word, kind_dof
   use card_table, only: find_card, cards, layouts, items
   use item_values, only: convert
   use deck_cards, only: deck_t, line_end
   implicit none
   private
   public :: card_values_t, position_t, is_listed

   !> A card and one of its data lines: the position of a reader.
   type :: position_t
      integer :: card = 0           !! index of the card; 0: before the first card
      integer :: line = 0           !! index of the data line; one less than that of the card's first line: before the first line
      character(24) :: keyword = '' !! keyword of the card in the spelling of the table
      integer :: step = 0           !! number of the step that contains the card; 0: the model part
      logical :: sound = .true.     !! true: the card has no errors in its keyword, place and parameters
      integer :: n_lines = 0        !! number of data lines of the card, including those with errors
      integer :: card_at = 0        !! number of the deck's line that has the keyword
      integer :: line_at = 0        !! number of the deck's line that is the data line
   end type position_t

   !> A deck whose cards have passed their check.
   type, extends(deck_t) :: card_values_t
      type(position_t) :: at !! the card and the line to which the procedures below refer
   contains
      procedure :: next_card, next_line, rewind, at_card, at_line, last_card, visit_omitted
      procedure :: field_name, lines_sound
      procedure :: given, count => count_of, text => text_of, word, integer => integer_of, real => real_of
      procedure :: wrong, wrong_card, wrong_line, wrong_at_line
   end type card_values_t

   !> A parameter or field of a card: its entry in the table, and the value given in the deck.
   type :: found_t
      integer :: item = 0           !! position in the items of the table
      integer :: column = 0         !! for a field: its number on the data line; 0: a parameter
      logical :: given = .false.
      type(place_t) :: place !! place of the value in the deck. If no value is given: place of the keyword for a parameter, end of
      !! the line for a field
      real(wp) :: number = 0.0_wp   !! converted value, or the default; 0 if there is neither
   end type found_t

contains

   !> Moves to the next card without errors. False if there is none; the position is then again before the first card.
   logical function next_card(self, keywords, also_bad) result(found)
      class(card_values_t), intent(inout) :: self
      character(*), intent(in) :: keywords       !! keywords of the cards, between bars
      logical, intent(in), optional :: also_bad  !! true: also to cards with errors; default: false
      logical :: all_cards
      integer :: card
      all_cards = .false.
      if (present(also_bad)) all_cards = also_bad
      do card = self%at%card + 1, self%n_cards
         if (.not. (all_cards .or. self%card(card)%sound)) cycle
         found = is_listed(keywords, self%card(card)%keyword)
         if (.not. found) cycle
         self%at = self%at_card(card)
         return
      end do
      call self%rewind()
      found = .false.
   end function next_card

   !> True if a keyword is one of those between bars.
   pure logical function is_listed(keywords, keyword)
      character(*), intent(in) :: keywords !! keywords between bars
      character(*), intent(in) :: keyword
      is_listed = index(keywords, trim(keyword)) > 0
      if (is_listed) is_listed = index('|'//keywords//'|', '|'//trim(keyword)//'|') > 0
   end function is_listed

   !> Moves to the next data line of the card without errors; false if no such line follows.
   logical function next_line(self) result(found)
      class(card_values_t), intent(inout) :: self
      found = .false.
      do while (self%at%line < self%card(self%at%card)%last_line)
         self%at%line = self%at%line + 1
         self%at%line_at = self%data_line(self%at%line)%line
         found = self%data_line(self%at%line)%sound
         if (found) return
      end do
   end function next_line

   !> Moves before the first card.
   subroutine rewind(self)
      class(card_values_t), intent(inout) :: self
      self%at = position_t()
   end subroutine rewind

   !> Position at a card, before its first data line.
   pure type(position_t) function at_card(self, card) result(at)
      class(card_values_t), intent(in) :: self
      integer, intent(in) :: card !! index of the card
      associate (this => self%card(card))
         at = position_t(card=card, line=this%first_line - 1, keyword=this%keyword, step=this%step, sound=this%sound, &
            n_lines=this%last_line - this%first_line + 1, card_at=this%place%line)
      end associate
   end function at_card

   !> Position at a data line.
   pure type(position_t) function at_line(self, line) result(at)
      class(card_values_t), intent(in) :: self
      integer, intent(in) :: line !! index of the data line
      at = self%at_card(self%data_line(line)%card)
      at%line = line
      at%line_at = self%data_line(line)%line
   end function at_line

   !> Index of the last card of a kind in a step, with or without errors; 0 if there is none. The position does not change.
   pure integer function last_card(self, keywords, step) result(card)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: keywords   !! keywords of the cards, between bars
      integer, intent(in) :: step            !! number of the step; 0: the model part
      do card = self%n_cards, 1, -1
         if (self%card(card)%step /= step) cycle
         if (is_listed(keywords, self%card(card)%keyword)) return
      end do
      card = 0
   end function last_card

   !> Moves to a card that stands for one that the deck omits: it has no parameters, so that all values are their defaults.
   subroutine visit_omitted(self, keyword)
      class(card_values_t), intent(inout) :: self
      character(*), intent(in) :: keyword    !! keyword of the card
      associate (card => self%card(self%n_cards + 1))
         card%keyword = keyword
         card%spec = find_card(keyword)
      end associate
      self%at = self%at_card(self%n_cards + 1)
   end subroutine visit_omitted

   !> Name of a field of the data lines.
   pure function field_name(self, column) result(name)
      class(card_values_t), intent(in) :: self
      integer, intent(in) :: column          !! number of the field in the card table
      character(:), allocatable :: name
      name = trim(items(layouts(self%card(self%at%card)%layout)%first + column - 1)%name)
   end function field_name

   !> True if no data line of the card has errors.
   pure logical function lines_sound(self)
      class(card_values_t), intent(in) :: self
      lines_sound = all(self%data_line(self%card(self%at%card)%first_line:self%card(self%at%card)%last_line)%sound)
   end function lines_sound

   !> True if a parameter or field is given.
   logical function given(self, name)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      type(found_t) :: found
      found = find(self, name)
      given = found%given
   end function given

   !> Number of values on a data line for the last field of its layout, if this field may repeat.
   integer function count_of(self, name) result(n)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name       !! name of the field in the card table
      type(found_t) :: found
      found = find(self, name)
      n = max(0, self%data_line(self%at%line)%n_fields - found%column + 1)
   end function count_of

   !> A value as text, as it was typed, or its default; '' if there is neither.
   function text_of(self, name, nth) result(string)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      character(:), allocatable :: string
      type(found_t) :: found
      found = find(self, name, nth)
      string = trim(items(found%item)%default)
      if (found%given) string = self%text_at(found%place)
   end function text_of

   !> A word in the spelling of the table; '' if the value is a number, or is not given and has no default.
   function word(self, name, nth)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      character(:), allocatable :: word
      type(found_t) :: found
      integer :: position
      found = find(self, name, nth)
      word = ''
      position = 0
      if (items(found%item)%kind == kind_word) position = nint(found%number)
      if (items(found%item)%kind == kind_dof) position = -nint(found%number)
      if (position > 0) word = word_at(items(found%item)%words, position)
   end function word

   !> An integer, or the position of a word among the words of the table; 0 if it is not given and has no default.
   integer function integer_of(self, name) result(value)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      value = nint(self%real(name))
   end function integer_of

   !> A real number; 0 if it is not given and has no default.
   real(wp) function real_of(self, name, nth) result(value)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      type(found_t) :: found
      found = find(self, name, nth)
      value = found%number
   end function real_of

   !> Converted default of an item; 0 if there is none.
   pure real(wp) function default_of(item) result(value)
      type(item_t), intent(in) :: item
      logical :: right
      value = 0.0_wp
      if (item%default /= '') call convert(item, trim(item%default), value, right)
   end function default_of

   !> Adds an error at a parameter or field.
   subroutine wrong(self, name, message, nth, last)
      class(card_values_t), intent(inout) :: self
      character(*), intent(in) :: name       !! name of the parameter or field in the card table
      character(*), intent(in) :: message    !! text of the message: one line, without the keyword
      integer, intent(in), optional :: nth   !! number of the value, if the field repeats; default: 1
      character(*), intent(in), optional :: last !! name of the last of several fields that are marked
      type(found_t) :: found, end
      found = find(self, name, nth)
      end = found
      if (present(last)) end = find(self, last)
      call self%complain(self%at%card, place_t(found%place%line, found%place%first, end%place%last), message)
   end subroutine wrong

   !> Adds an error at the keyword of the card.
   subroutine wrong_card(self, message)
      class(card_values_t), intent(inout) :: self
      character(*), intent(in) :: message    !! text of the message: one line, without the keyword
      call self%complain(self%at%card, self%card(self%at%card)%place, message)
   end subroutine wrong_card

   !> Adds an error at the whole data line.
   subroutine wrong_line(self, message)
      class(card_values_t), intent(inout) :: self
      character(*), intent(in) :: message    !! text of the message: one line, without the keyword
      call self%complain(self%at%card, self%whole_line(self%at%line), message)
   end subroutine wrong_line

   !> Adds an error at a line of the deck.
   subroutine wrong_at_line(self, line, message)
      class(card_values_t), intent(inout) :: self
      integer, intent(in) :: line            !! number of the line in the deck
      character(*), intent(in) :: message    !! text of the message: one line
      call self%diagnostics%add(place_t(line, 1, max(1, line_end(self%source, line))), message)
   end subroutine wrong_at_line

   !> Finds a parameter of the card or a field of its data line.
   recursive function find(self, name, nth) result(found)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, intent(in), optional :: nth
      type(found_t) :: found, factor
      integer :: p
      associate (card => self%card(self%at%card))
         if (self%at%line_at > 0) then ! on a data line the fields are searched first, because there are many lines
            associate (first => layouts(card%layout)%first, line => self%data_line(self%at%line))
               found%item = named_item(first, layouts(card%layout)%last, name)
               if (found%item > 0) then
                  found%column = found%item - first + 1
                  if (present(nth)) found%column = found%column + nth - 1
                  found%place = self%field_place(self%at%line, found%column)
                  found%given = self%field_given(self%at%line, found%column)
                  if (found%given) then
                     found%number = self%number(line%first_field + found%column - 1)
                     return
                  end if
                  found%number = default_of(items(found%item))
                  if (items(found%item)%times_field == 0) return
                  factor = find(self, items(first + items(found%item)%times_field - 1)%name)
                  found%number = found%number * abs(factor%number)
                  return
               end if
            end associate
         end if
         found%item = named_item(cards(card%spec)%first, cards(card%spec)%last, name)
         if (found%item == 0) error stop 'a reader names an item that the card does not have, or a field before its line'
         p = self%given_parameter(self%at%card, found%item)
         found%given = p > 0
         if (.not. found%given) then
            found%place = card%place
            found%number = default_of(items(found%item))
         else
            found%place = self%parameter(p)%name
            if (self%parameter(p)%has_value) found%place = self%parameter(p)%value
            found%number = self%parameter(p)%number
         end if
      end associate
   end function find

   !> Position of the item with a name in a part of the items of the table; 0 if there is none.
   pure integer function named_item(first, last, name) result(item)
      integer, intent(in) :: first, last
      character(*), intent(in) :: name
      do item = first, last
         if (items(item)%name == name) return
      end do
      item = 0
   end function named_item
end module card_values
