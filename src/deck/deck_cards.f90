!> Splits the text of a deck into cards: keyword, parameters, data lines, fields, each with its place.
!>
!> This module does not depend on which cards exist. A keyword line that ends with a comma continues on the next line. Comments
!> (lines that begin with **) and blank lines are allowed everywhere.
module deck_cards
   use, intrinsic :: iso_fortran_env, only: int8
   use kinds, only: wp
   use text, only: blanks, squeeze
   use deck_source, only: deck_source_t, first_letter
   use diagnostics, only: diagnostics_t, place_t
   implicit none
   private
   public :: deck_t, split_deck, line_end

   !> A parameter of a card as the deck gives it.
   type :: parameter_t
      type(place_t) :: name, value         !! places of name and value in the deck; the value of a flag is empty
      logical :: has_value = .false.       !! true: the name is followed by an equals sign
      integer :: item = 0                  !! position in the items of the table; 0: unknown
      real(wp) :: number = 0.0_wp          !! converted value, see item_values
   end type parameter_t

   !> A data line of a card.
   type :: data_line_t
      integer :: card = 0                  !! index of the card to which the line belongs
      integer :: line = 0                  !! number of the line in the deck
      integer :: first_field = 1, n_fields = 0
      logical :: sound = .true.            !! true: the line passed the check against the table
   end type data_line_t

   !> A card of the deck: keyword, parameters and data lines, and the result of its check.
   type :: card_t
      character(:), allocatable :: keyword !! keyword without the star, as typed; after the check in the spelling of the table
      type(place_t) :: place               !! place of star and keyword in the deck
      integer :: first_parameter = 1, last_parameter = 0
      integer :: first_line = 1, last_line = 0
      integer :: spec = 0                  !! position of the card in the table; 0: unknown keyword
      integer :: layout = 0                !! position of the layout that applies in the table; 0: none
      integer :: step = 0                  !! number of the step that contains the card; 0: the model part
      logical :: sound = .true.            !! true: keyword, place in the deck and parameters passed the check
   end type card_t

   !> A deck split into cards. An empty field has last < first. The check of the cards (card_check) adds the converted values.
   type :: deck_t
      type(deck_source_t) :: source
      integer :: n_cards = 0, n_parameters = 0, n_lines = 0, n_fields = 0
      type(card_t), allocatable :: card(:) !! of this and the following arrays only the first n_... entries are in use. Behind them
      !! there is one card without parameters, which stands for a card that the deck omits (card_values)
      type(parameter_t), allocatable :: parameter(:)
      type(data_line_t), allocatable :: data_line(:)
      type(place_t), allocatable :: field(:)
      real(wp), allocatable :: number(:)        !! converted values of the fields, see item_values
      type(diagnostics_t) :: diagnostics        !! errors found so far
   contains
      procedure :: text_at, complain, given_parameter, field_given, field_place, whole_line
   end type deck_t

contains

   !> Splits the text of a deck into cards.
   subroutine split_deck(source, deck)
      type(deck_source_t), intent(in) :: source !! text of the deck
      class(deck_t), intent(inout) :: deck      !! out: the cards, and errors about lines that are not cards
      integer :: line, first, commas
      logical :: misplaced
      deck%source = source
      commas = count(transfer(source%text, [integer(int8) ::]) == iachar(',', int8))
      ! A line has at most as many parameters as commas, and one more field than commas.
      allocate (deck%card(count(transfer(source%text, [integer(int8) ::]) == iachar('*', int8)) + 1), deck%parameter(commas), &
         & deck%data_line(source%n_lines), deck%field(source%n_lines + commas))
      misplaced = .false.
      line = 0
      do while (line < source%n_lines)
         line = line + 1
         first = first_letter(source%text(source%first(line):source%last(line)))
         if (first == 0) cycle
         if (letter_at(source, line, first) == '*') then
            call split_keyword_line(line, first)
         else if (deck%n_cards > 0) then
            call split_data_line(line)
         else if (.not. misplaced) then
            call deck%diagnostics%add(place_t(line, first, line_end(source, line)), &
               'data before the first keyword; a deck begins with a keyword such as *HEADING')
            misplaced = .true.
         end if
      end do

   contains

      !> Splits a keyword line into the keyword and its parameters; on return `line` is the last line of the keyword.
      subroutine split_keyword_line(line, first)
         integer, intent(inout) :: line
         integer, intent(in) :: first                         ! column of the star
         type(place_t) :: place
         integer :: from, length, next
         from = first
         call next_part(line, from, place)
         call new_card(place)
         if (place%last == place%first) then
            deck%card(deck%n_cards)%sound = .false.
            call deck%diagnostics%add(place, 'a keyword is missing after the star')
         end if
         length = line_end(source, line)
         do while (from <= length + 1) ! there is a comma before column `from`
            if (from > length) then
               ! The comma is the last character: the card continues on the next line that is not a comment.
               next = next_line(line)
               if (next == 0) then
                  call missing(line, length, 'a parameter must follow the last comma')
                  return
               end if
               line = next
               length = line_end(source, line)
               from = 1
            end if
            call next_part(line, from, place)
            if (place%last < place%first) then
               call missing(line, from - 1, 'a parameter is missing before the comma')
            else
               call split_parameter(place)
            end if
         end do
      end subroutine split_keyword_line

      !> Reports a missing parameter; the card is then not sound.
      subroutine missing(line, column, message)
         integer, intent(in) :: line, column      ! line and column where a parameter is missing
         character(*), intent(in) :: message
         deck%card(deck%n_cards)%sound = .false.
         call deck%complain(deck%n_cards, place_t(line, column, column), message)
      end subroutine missing

      !> The line on which a keyword line continues; 0 if another card or the end follows.
      pure integer function next_line(line)
         integer, intent(in) :: line
         integer :: first
         do next_line = line + 1, source%n_lines
            first = first_letter(source%text(source%first(next_line):source%last(next_line)))
            if (first == 0) cycle
            if (letter_at(source, next_line, first) == '*') exit
            return
         end do
         next_line = 0
      end function next_line

      !> Splits NAME or NAME=value.
      subroutine split_parameter(place)
         type(place_t), intent(in) :: place
         integer :: equals
         deck%n_parameters = deck%n_parameters + 1
         deck%card(deck%n_cards)%last_parameter = deck%n_parameters
         equals = index(deck%text_at(place), '=')
         associate (parameter => deck%parameter(deck%n_parameters))
            parameter%has_value = equals > 0
            if (parameter%has_value) then
               equals = place%first + equals - 1
               parameter%name = trimmed(place%line, place%first, equals - 1)
               parameter%value = trimmed(place%line, equals + 1, place%last)
            else
               parameter%name = place
               parameter%value = place_t(place%line, place%last + 1, place%last)
            end if
         end associate
      end subroutine split_parameter

      subroutine new_card(place)
         type(place_t), intent(in) :: place
         deck%n_cards = deck%n_cards + 1
         associate (card => deck%card(deck%n_cards))
            card%keyword = squeeze(deck%text_at(place_t(place%line, place%first + 1, place%last)))
            card%place = place
            card%first_parameter = deck%n_parameters + 1
            card%last_parameter = deck%n_parameters
            card%first_line = deck%n_lines + 1
            card%last_line = deck%n_lines
         end associate
      end subroutine new_card

      !> Splits a data line at its commas into fields; a comma at the end of the line does not begin a field.
      subroutine split_data_line(line)
         integer, intent(in) :: line
         integer :: from, length
         deck%n_lines = deck%n_lines + 1
         deck%card(deck%n_cards)%last_line = deck%n_lines
         associate (data_line => deck%data_line(deck%n_lines))
            data_line%card = deck%n_cards
            data_line%line = line
            data_line%first_field = deck%n_fields + 1
            length = line_end(source, line)
            from = 1
            do while (from <= length)
               deck%n_fields = deck%n_fields + 1
               call next_part(line, from, deck%field(deck%n_fields))
            end do
            data_line%n_fields = deck%n_fields - data_line%first_field + 1
         end associate
      end subroutine split_data_line

      !> The place from `from` to `to` without the blanks at both ends; last = first - 1 if nothing is left.
      pure type(place_t) function trimmed(line, from, to) result(place)
         integer, intent(in) :: line, from, to
         associate (before => source%first(line) - 1)
            place = place_t(line, from, from - 1 + verify(source%text(before + from:before + to), blanks, back=.true.))
            if (place%last > place%first) place%first = from - 1 + verify(source%text(before + from:before + to), blanks)
         end associate
      end function trimmed

      !> The part of a line from a column to the next comma or the end of the line, without the blanks at both ends.
      pure subroutine next_part(line, from, place)
         integer, intent(in) :: line
         integer, intent(inout) :: from        ! in: first column of the part; out: column behind the comma or behind the line's end
         type(place_t), intent(out) :: place
         integer :: length
         length = index(source%text(source%first(line) + from - 1:source%last(line)), ',') - 1
         if (length < 0) length = source%last(line) - source%first(line) + 2 - from
         place = trimmed(line, from, from + length - 1)
         from = from + length + 1
      end subroutine next_part
   end subroutine split_deck

   !> The text at a place; '' if it is empty.
   pure function text_at(self, place) result(string)
      class(deck_t), intent(in) :: self
      type(place_t), intent(in) :: place !! inside one line of the deck
      character(:), allocatable :: string
      integer :: before
      before = self%source%first(place%line) - 1
      string = self%source%text(before + place%first:before + place%last)
   end function text_at

   !> Adds an error, with the card's keyword in front of the message.
   pure subroutine complain(self, card, place, message)
      class(deck_t), intent(inout) :: self
      integer, intent(in) :: card         !! index of the card
      type(place_t), intent(in) :: place  !! place in the deck that is marked
      character(*), intent(in) :: message !! text of the message: one line
      call self%diagnostics%add(place, '*'//self%card(card)%keyword//': '//message)
   end subroutine complain

   !> Column of the last character of a line that is not blank, 0 for a blank line.
   pure integer function line_end(source, line)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line !! number of the line, from 1; a line behind the last one is blank
      line_end = 0
      if (line <= source%n_lines) line_end = verify(source%text(source%first(line):source%last(line)), blanks, back=.true.)
   end function line_end

   !> Position in self%parameter of a parameter of a checked card; 0: not given.
   pure integer function given_parameter(self, card, item) result(p)
      class(deck_t), intent(in) :: self
      integer, intent(in) :: card !! index of the card
      integer, intent(in) :: item !! position of the parameter in the items of the table
      do p = self%card(card)%first_parameter, self%card(card)%last_parameter
         if (self%parameter(p)%item == item) return
      end do
      p = 0
   end function given_parameter

   !> True if a field is present and not empty.
   pure logical function field_given(self, line, field)
      class(deck_t), intent(in) :: self
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! number of the field, from 1
      integer :: i
      field_given = .false.
      if (field > self%data_line(line)%n_fields) return
      i = self%data_line(line)%first_field + field - 1
      field_given = self%field(i)%last >= self%field(i)%first
   end function field_given

   !> Place of a field; behind the end of the line if it is missing.
   pure type(place_t) function field_place(self, line, field) result(place)
      class(deck_t), intent(in) :: self
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! number of the field, from 1
      if (field <= self%data_line(line)%n_fields) then
         place = self%field(self%data_line(line)%first_field + field - 1)
      else
         place%line = self%data_line(line)%line
         place%first = line_end(self%source, place%line) + 1
         place%last = place%first
      end if
   end function field_place

   !> Place of a whole data line.
   pure type(place_t) function whole_line(self, line) result(place)
      class(deck_t), intent(in) :: self
      integer, intent(in) :: line !! index of the data line
      place = self%field_place(line, 1)
      place%last = line_end(self%source, place%line)
   end function whole_line

   pure character(1) function letter_at(source, line, column)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line, column
      integer :: position
      position = source%first(line) + column - 1
      letter_at = source%text(position:position)
   end function letter_at
end module deck_cards
