!> Values on a card, with the table's defaults for omitted values.
!>
!> For cards and data lines that passed the check; unreadable values are returned as zero or ''.
module card_values
   use kinds, only: wp
   use text, only: squeeze, parse_integer, parse_real, word_at, word_index
   use diagnostics, only: place_t
   use card_spec, only: item_t, find_card, find_item
   use deck_cards, only: deck_t, text_at, line_end
   implicit none
   private
   public :: given, parameter_place, value_place, parameter_text, parameter_word, parameter_integer, parameter_real
   public :: holds, default_text
   public :: field_given, field_place, field_text, field_word, field_integer, field_real, whole_line

contains

   !> True if the parameter is given on the card.
   pure logical function given(deck, card, name)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      given = position_of(deck, card, name) > 0
   end function given

   !> Place of a parameter with its value; of the keyword if it is not given.
   pure type(place_t) function parameter_place(deck, card, name) result(place)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      integer :: p
      p = position_of(deck, card, name)
      place = deck%card(card)%place
      if (p == 0) return
      place = deck%parameter(p)%name
      place%last = max(place%last, deck%parameter(p)%value%last)
   end function parameter_place

   !> Place of a parameter's value; of the keyword if it is not given.
   pure type(place_t) function value_place(deck, card, name) result(place)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      integer :: p
      p = position_of(deck, card, name)
      place = deck%card(card)%place
      if (p > 0) place = deck%parameter(p)%value
   end function value_place

   !> The parameter's value as typed, or its default; '' if there is neither.
   pure function parameter_text(deck, card, name) result(string)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      character(:), allocatable :: string
      integer :: p
      p = position_of(deck, card, name)
      if (p > 0) then
         string = text_at(deck, deck%parameter(p)%value)
      else
         string = ''
         associate (spec => deck%spec(deck%card(card)%spec))
            p = find_item(spec%parameter, name)
            if (p > 0) string = spec%parameter(p)%default
         end associate
      end if
   end function parameter_text

   !> The parameter's value as the table spells it; '' if it is none of the accepted words.
   pure function parameter_word(deck, card, name) result(word)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      character(:), allocatable :: word
      integer :: p
      word = ''
      associate (spec => deck%spec(deck%card(card)%spec))
         p = find_item(spec%parameter, name)
         if (p > 0) word = canonical(spec%parameter(p)%words, parameter_text(deck, card, name))
      end associate
   end function parameter_word

   !> The parameter's value as an integer.
   pure integer function parameter_integer(deck, card, name)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      logical :: ok
      call parse_integer(parameter_text(deck, card, name), parameter_integer, ok)
      if (.not. ok) parameter_integer = 0
   end function parameter_integer

   !> The parameter's value as a real.
   pure real(wp) function parameter_real(deck, card, name)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card      !! index of the card
      character(*), intent(in) :: name !! of the parameter
      logical :: ok
      call parse_real(parameter_text(deck, card, name), parameter_real, ok)
      if (.not. ok) parameter_real = 0
   end function parameter_real

   !> Default of a parameter, for decks without the card.
   pure function default_text(deck, keyword, name) result(string)
      type(deck_t), intent(in) :: deck
      character(*), intent(in) :: keyword !! of the card, without the star
      character(*), intent(in) :: name    !! of the parameter
      character(:), allocatable :: string
      associate (spec => deck%spec(find_card(deck%spec, keyword)))
         string = spec%parameter(find_item(spec%parameter, name))%default
      end associate
   end function default_text

   !> True if a condition of the table is satisfied: 'TYPE=CIRCLE|LINE' (one of these words), 'GENERATE' (given), ''.
   pure logical function holds(deck, card, condition)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card           !! index of the card
      character(*), intent(in) :: condition !! as in the table
      character(:), allocatable :: word
      integer :: equals
      holds = .true.
      if (condition == '') return
      equals = index(condition, '=')
      if (equals == 0) then
         holds = given(deck, card, condition)
      else
         word = parameter_word(deck, card, condition(:equals - 1))
         holds = .false.
         if (word /= '') holds = word_index(condition(equals + 1:), word) > 0
      end if
   end function holds

   !> True if a field is present and not empty.
   pure logical function field_given(deck, line, field)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! from 1
      integer :: i
      field_given = .false.
      if (field > deck%data_line(line)%n_fields) return
      i = deck%data_line(line)%first_field + field - 1
      field_given = deck%field(i)%last >= deck%field(i)%first
   end function field_given

   !> Place of a field; behind the end of the line if it is missing.
   pure type(place_t) function field_place(deck, line, field) result(place)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! from 1
      if (field <= deck%data_line(line)%n_fields) then
         place = deck%field(deck%data_line(line)%first_field + field - 1)
      else
         place%line = deck%data_line(line)%line
         place%first = line_end(deck%source, place%line) + 1
         place%last = place%first
      end if
   end function field_place

   !> Place of a whole data line.
   pure type(place_t) function whole_line(deck, line) result(place)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line !! index of the data line
      place = field_place(deck, line, 1)
      place%last = line_end(deck%source, place%line)
   end function whole_line

   !> A field as typed, or its default; '' if there is neither.
   pure function field_text(deck, line, field) result(string)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! from 1
      character(:), allocatable :: string
      type(item_t) :: item
      if (field_given(deck, line, field)) then
         string = text_at(deck, field_place(deck, line, field))
      else
         item = item_of(deck, line, field)
         string = item%default
      end if
   end function field_text

   !> A field's word as the table spells it; '' if it is none of the accepted words.
   pure function field_word(deck, line, field) result(word)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! from 1
      character(:), allocatable :: word
      type(item_t) :: item
      item = item_of(deck, line, field)
      word = canonical(item%words, field_text(deck, line, field))
   end function field_word

   !> A field as an integer.
   pure integer function field_integer(deck, line, field) result(value)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! from 1
      integer :: before
      logical :: ok
      if (field_given(deck, line, field)) then
         associate (place => deck%field(deck%data_line(line)%first_field + field - 1))
            before = deck%source%first(place%line) - 1
            call parse_integer(deck%source%text(before + place%first:before + place%last), value, ok)
         end associate
      else
         call parse_integer(field_text(deck, line, field), value, ok)
      end if
      if (.not. ok) value = 0
   end function field_integer

   !> A field as a real.
   pure recursive function field_real(deck, line, field) result(value)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line  !! index of the data line
      integer, intent(in) :: field !! from 1
      real(wp) :: value
      type(item_t) :: item
      integer :: before
      logical :: ok
      if (field_given(deck, line, field)) then
         associate (place => deck%field(deck%data_line(line)%first_field + field - 1))
            before = deck%source%first(place%line) - 1
            call parse_real(deck%source%text(before + place%first:before + place%last), value, ok)
         end associate
         if (.not. ok) value = 0.0_wp
      else
         item = item_of(deck, line, field)
         call parse_real(item%default, value, ok)
         if (item%times_field > 0) value = value * abs(field_real(deck, line, item%times_field))
      end if
   end function field_real

   !> Description of a field in the table.
   pure function item_of(deck, line, field) result(item)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: line, field
      type(item_t) :: item
      associate (card => deck%card(deck%data_line(line)%card))
         associate (layout => deck%spec(card%spec)%layout(card%layout))
            item = layout%field(min(field, size(layout%field)))
         end associate
      end associate
   end function item_of

   pure function canonical(words, typed) result(word)
      character(*), intent(in) :: words, typed
      character(:), allocatable :: word
      integer :: i
      word = ''
      i = word_index(words, typed)
      if (i > 0) word = word_at(words, i)
   end function canonical

   !> Position of a parameter of a card in deck%parameter, 0 if it is not given.
   pure integer function position_of(deck, card, name) result(p)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card
      character(*), intent(in) :: name
      character(:), allocatable :: key
      key = squeeze(name)
      do p = deck%card(card)%first_parameter, deck%card(card)%last_parameter
         if (squeeze(text_at(deck, deck%parameter(p)%name)) == key) return
      end do
      p = 0
   end function position_of
end module card_values
