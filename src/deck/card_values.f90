!> Cursor through the cards of a checked deck, typed values of their parameters and fields, and errors at them.
!>
!> All items are named as in the table of cards. They are values that passed the check of the cards; defaults stand in for values
!> that are not given.
module card_values
   use kinds, only: wp
   use text, only: word_at
   use diagnostics, only: diagnostics_t, place_t
   use card_spec, only: item_t, find_card, find_item, kind_word, kind_dof
   use item_values, only: convert
   use deck_cards, only: deck_t, text_at, complain, given_parameter, field_given, field_place, whole_line, line_end
   implicit none
   private
   public :: card_values_t, cursor_t, is_listed

   !> Position of a reader in the deck: a card, and one of its data lines.
   type :: cursor_t
      integer :: card = 0           !! index of the card; 0: before the first one
      integer :: line = 0           !! index of the data line; one less than the first of the card: before its first line
      character(24) :: keyword = '' !! of the card, as the table spells it
      integer :: step = 0           !! number of the step that contains the card; 0: the model part
      logical :: sound = .true.     !! true: the card has no errors in its keyword, place and parameters
      integer :: n_lines = 0        !! number of data lines of the card, with those that have errors
      integer :: card_at = 0        !! line of the deck with the keyword
      integer :: line_at = 0        !! line of the deck that the data line is
   end type cursor_t

   !> A deck whose cards have passed their check.
   type, extends(deck_t) :: card_values_t
      type(diagnostics_t) :: diagnostics !! errors found so far
   contains
      procedure :: next_card, next_line, at_card, at_line
      procedure :: first_field, lines_sound
      procedure :: given, count => count_of, place, text => text_of, word, integer => integer_of, real => real_of, default
      procedure :: wrong, wrong_card, wrong_line, wrong_at_line
   end type card_values_t

   !> A parameter or field of a card: its entry in the table, and the value that the deck gives.
   type :: found_t
      logical :: is_parameter = .false. !! false: a field
      integer :: item = 0               !! position in the parameters of the entry, or in the fields of the layout
      integer :: column = 0             !! fields: number on the data line
      integer :: value = 0              !! position in deck%parameter or deck%field; 0: not given
   end type found_t

contains

   !> Moves the cursor to the next card without errors. False if no such card follows: the cursor is then before the first card
   !> again.
   logical function next_card(self, at, keywords, also_bad) result(found)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(inout) :: at        !! at no card: the search begins with the first card
      character(*), intent(in) :: keywords       !! of the cards, between bars
      logical, intent(in), optional :: also_bad  !! true: cards with errors are visited, too; default false
      logical :: all_cards
      integer :: card
      all_cards = .false.
      if (present(also_bad)) all_cards = also_bad
      do card = at%card + 1, self%n_cards
         if (.not. (all_cards .or. self%card(card)%sound)) cycle
         found = is_listed(keywords, self%card(card)%keyword)
         if (.not. found) cycle
         at = self%at_card(card)
         return
      end do
      at = cursor_t()
      found = .false.
   end function next_card

   !> True if a keyword is one of those between bars.
   pure logical function is_listed(keywords, keyword)
      character(*), intent(in) :: keywords !! between bars
      character(*), intent(in) :: keyword
      integer :: first, bar
      first = 1
      do
         bar = index(keywords(first:), '|')
         if (bar == 0) bar = len(keywords) - first + 2
         is_listed = keywords(first:first + bar - 2) == keyword
         first = first + bar
         if (is_listed .or. first > len(keywords)) return
      end do
   end function is_listed

   !> Moves the cursor to the next data line of its card without errors; false if no such line follows.
   logical function next_line(self, at) result(found)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(inout) :: at
      do while (at%line < self%card(at%card)%last_line)
         at%line = at%line + 1
         at%line_at = self%data_line(at%line)%line
         found = self%data_line(at%line)%sound
         if (found) return
      end do
      found = .false.
   end function next_line

   !> The cursor at a card, before its first data line.
   pure type(cursor_t) function at_card(self, card) result(at)
      class(card_values_t), intent(in) :: self
      integer, intent(in) :: card !! index of the card
      associate (this => self%card(card))
         at = cursor_t(card=card, line=this%first_line - 1, keyword=this%keyword, step=this%step, sound=this%sound, &
            n_lines=this%last_line - this%first_line + 1, card_at=this%place%line)
      end associate
   end function at_card

   !> The cursor at a data line.
   pure type(cursor_t) function at_line(self, line) result(at)
      class(card_values_t), intent(in) :: self
      integer, intent(in) :: line !! index of the data line
      at = self%at_card(self%data_line(line)%card)
      at%line = line
      at%line_at = self%data_line(line)%line
   end function at_line

   !> Name of the first field of the data lines.
   pure function first_field(self, at) result(name)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(:), allocatable :: name
      name = self%spec(self%card(at%card)%spec)%layout(self%card(at%card)%layout)%field(1)%name
   end function first_field

   !> True if no data line of the card has errors.
   pure logical function lines_sound(self, at)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      lines_sound = all(self%data_line(self%card(at%card)%first_line:self%card(at%card)%last_line)%sound)
   end function lines_sound

   !> True if a parameter or field is given.
   logical function given(self, at, name, nth)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! which one of a field that repeats; default 1
      type(found_t) :: found
      found = find(self, at, name, nth)
      given = found%value > 0
   end function given

   !> Number of values that a data line has for the last field of its layout, which may repeat.
   integer function count_of(self, at, name) result(n)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the field in the card table
      type(found_t) :: found
      found = find(self, at, name)
      n = max(0, self%data_line(at%line)%n_fields - found%column + 1)
   end function count_of

   !> Place of a value. If it is not given: of the keyword for a parameter, of the end of the line for a field.
   type(place_t) function place(self, at, name, nth)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! which one of a field that repeats; default 1
      type(found_t) :: found
      found = find(self, at, name, nth)
      if (.not. found%is_parameter) then
         place = field_place(self, at%line, found%column)
      else if (found%value == 0) then
         place = self%card(at%card)%place
      else if (self%parameter(found%value)%has_value) then
         place = self%parameter(found%value)%value
      else
         place = self%parameter(found%value)%name
      end if
   end function place

   !> A value as typed, or its default; '' if there is neither.
   function text_of(self, at, name, nth) result(string)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! which one of a field that repeats; default 1
      character(:), allocatable :: string
      type(found_t) :: found
      found = find(self, at, name, nth)
      if (found%value > 0) then
         string = text_at(self, self%place(at, name, nth))
      else if (found%is_parameter) then
         string = self%spec(self%card(at%card)%spec)%parameter(found%item)%default
      else
         string = self%spec(self%card(at%card)%spec)%layout(self%card(at%card)%layout)%field(found%item)%default
      end if
   end function text_of

   !> A word as the table spells it; '' if the value is not given and has no default, or is a number.
   function word(self, at, name, nth)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! which one of a field that repeats; default 1
      character(:), allocatable :: word
      type(found_t) :: found
      found = find(self, at, name, nth)
      if (found%is_parameter) then
         word = word_of(self%spec(self%card(at%card)%spec)%parameter(found%item), self%real(at, name))
      else
         word = word_of(self%spec(self%card(at%card)%spec)%layout(self%card(at%card)%layout)%field(found%item), &
            self%real(at, name, nth))
      end if
   end function word

   !> An integer, or the position of a word among those of the table; 0 if it is not given and has no default.
   integer function integer_of(self, at, name) result(value)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      value = nint(self%real(at, name))
   end function integer_of

   !> A number; 0 if it is not given and has no default.
   recursive function real_of(self, at, name, nth) result(value)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      integer, intent(in), optional :: nth   !! which one of a field that repeats; default 1
      real(wp) :: value
      type(found_t) :: found
      found = find(self, at, name, nth)
      if (found%is_parameter) then
         value = default_of(self%spec(self%card(at%card)%spec)%parameter(found%item))
         if (found%value > 0) value = self%parameter(found%value)%number
      else if (found%value > 0) then
         value = self%number(found%value)
      else
         associate (field => self%spec(self%card(at%card)%spec)%layout(self%card(at%card)%layout)%field)
            value = default_of(field(found%item))
            if (field(found%item)%times_field > 0) value = value * abs(self%real(at, field(field(found%item)%times_field)%name))
         end associate
      end if
   end function real_of

   !> Default of a parameter of a card that the deck need not have.
   real(wp) function default(self, keyword, name)
      class(card_values_t), intent(in) :: self
      character(*), intent(in) :: keyword    !! of the card in the table; card_check lists these cards
      character(*), intent(in) :: name       !! of the parameter
      associate (spec => self%spec(find_card(self%spec, keyword)))
         default = default_of(spec%parameter(find_item(spec%parameter, name)))
      end associate
   end function default

   !> Adds an error at a parameter or field.
   subroutine wrong(self, at, name, message, nth, last)
      class(card_values_t), intent(inout) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name       !! of the parameter or field in the card table
      character(*), intent(in) :: message    !! one line, without the keyword
      integer, intent(in), optional :: nth   !! which one of a field that repeats; default 1
      character(*), intent(in), optional :: last !! name of the last field that is marked
      type(place_t) :: place, end
      place = self%place(at, name, nth)
      if (present(last)) then
         end = self%place(at, last)
         place%last = end%last
      end if
      call complain(self, self%diagnostics, at%card, place, message)
   end subroutine wrong

   !> Adds an error at the keyword of a card.
   subroutine wrong_card(self, at, message)
      class(card_values_t), intent(inout) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: message    !! one line, without the keyword
      call complain(self, self%diagnostics, at%card, self%card(at%card)%place, message)
   end subroutine wrong_card

   !> Adds an error at a whole data line.
   subroutine wrong_line(self, at, message)
      class(card_values_t), intent(inout) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: message    !! one line, without the keyword
      call complain(self, self%diagnostics, at%card, whole_line(self, at%line), message)
   end subroutine wrong_line

   !> Adds an error at a line of the deck.
   subroutine wrong_at_line(self, line, message)
      class(card_values_t), intent(inout) :: self
      integer, intent(in) :: line            !! of the deck
      character(*), intent(in) :: message    !! one line
      call self%diagnostics%add(place_t(line, 1, max(1, line_end(self%source, line))), message)
   end subroutine wrong_at_line

   !> Finds a parameter of the card or a field of its data line.
   function find(self, at, name, nth) result(found)
      class(card_values_t), intent(in) :: self
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name
      integer, intent(in), optional :: nth
      type(found_t) :: found
      integer :: i
      associate (card => self%card(at%card), spec => self%spec(self%card(at%card)%spec))
         if (at%line_at > 0) then ! on a data line; its fields come first because there are many lines
            do i = 1, size(spec%layout(card%layout)%field)
               if (spec%layout(card%layout)%field(i)%name /= name) cycle
               found = found_t(item=i, column=i)
               if (present(nth)) found%column = i + nth - 1
               if (field_given(self, at%line, found%column)) &
                  found%value = self%data_line(at%line)%first_field + found%column - 1
               return
            end do
         end if
         do i = 1, size(spec%parameter)
            if (spec%parameter(i)%name /= name) cycle
            found = found_t(item=i, is_parameter=.true., value=given_parameter(self, at%card, i))
            return
         end do
      end associate
      error stop 'a reader names a parameter or field that the card does not have, or a field before its line'
   end function find

   !> A word of an item by its converted value; '' for a value that is no word.
   pure function word_of(item, value) result(word)
      type(item_t), intent(in) :: item
      real(wp), intent(in) :: value
      character(:), allocatable :: word
      word = ''
      if (item%kind == kind_word .and. value > 0.0_wp) word = word_at(item%words, nint(value))
      if (item%kind == kind_dof .and. value < 0.0_wp) word = word_at(item%words, -nint(value))
   end function word_of

   !> Converted default of an item; 0 if there is none.
   pure real(wp) function default_of(item) result(value)
      type(item_t), intent(in) :: item
      logical :: right
      value = 0.0_wp
      if (item%default /= '') call convert(item, item%default, value, right)
   end function default_of
end module card_values
