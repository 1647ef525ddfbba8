!> Checks each card by itself against the table of cards: known keyword, right part of the deck, right parameters and data lines.
!>
!> A card with a wrong keyword or parameter is marked as not sound, and so is a data line with a wrong field; the readers skip both.
!> Relations between cards are checked by the readers.
module card_check
   use kinds, only: wp
   use text, only: to_text, plural, nearest_word, word_at, word_index, separated
   use printable_text, only: quoted
   use diagnostics, only: place_t
   use card_spec, only: card_spec_t, layout_t, item_t, in_model, in_step, outside_step, kind_flag
   use deck_cards, only: deck_t
   use card_table, only: find_card, cards, layouts, items, card_names, foreign_answer
   use item_values, only: convert, value_error, choices
   implicit none
   private
   public :: check_cards, known_card

   !> What is known from the cards checked so far.
   type :: reading_t
      integer :: step = 0             !! number of the open step, or of the last step
      logical :: open = .false.
      integer :: open_card = 0        !! index of the card that opened the step
      character(:), allocatable :: chain !! keyword of the preceding card to which *ELASTIC and similar cards belong; '': none
      integer :: first_use(size(cards)) = 0 !! (entries of the table) first card of this kind in this part of the deck; 0: none
   end type reading_t

contains

   !> Checks all cards. Sets their entry of the table, layout, step, soundness, and converted values.
   subroutine check_cards(deck)
      class(deck_t), intent(inout) :: deck !! in: a split deck; out: with errors
      type(reading_t) :: reading
      character(:), allocatable :: typed
      integer :: card
      allocate (deck%number(deck%n_fields), source=0.0_wp)
      reading%chain = ''
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .and. deck%card(card)%keyword == '') cycle
         deck%card(card)%spec = find_card(deck%card(card)%keyword)
         if (deck%card(card)%spec == 0) then
            deck%card(card)%sound = .false.
            typed = deck%text_at(deck%card(card)%place)
            call deck%diagnostics%add(deck%card(card)%place, 'unknown keyword '//quoted(typed)//known_card(typed(2:)))
            cycle
         end if
         call check_card(deck, card, cards(deck%card(card)%spec), reading)
      end do
      if (reading%open) call deck%complain(reading%open_card, deck%card(reading%open_card)%place, 'its *END STEP is missing')
   end subroutine check_cards

   !> Checks one card: its position in the deck, its parameters, and its data lines.
   subroutine check_card(deck, card, spec, reading)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      type(reading_t), intent(inout) :: reading
      deck%card(card)%keyword = trim(spec%keyword)
      call check_position(deck, card, spec, reading, deck%card(card)%spec)
      call check_parameters(deck, card, spec)
      ! The parameters determine the layout of the data lines. If a parameter is wrong, the lines are checked only if the card has a
      ! single layout.
      if (deck%card(card)%sound .or. spec%first_layout == spec%last_layout) call check_lines(deck, card, spec)
   end subroutine check_card

   !> Adds an error at the card, which is then not sound.
   subroutine bad_card(deck, card, place, message)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(place_t), intent(in) :: place
      character(*), intent(in) :: message
      deck%card(card)%sound = .false.
      call deck%complain(card, place, message)
   end subroutine bad_card

   !> Checks that the card is in the right part of the deck, and opens and closes steps.
   subroutine check_position(deck, card, spec, reading, kind)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      type(reading_t), intent(inout) :: reading
      integer, intent(in) :: kind                     ! position of the card's entry in the table
      character(:), allocatable :: wrong
      wrong = ''
      if (spec%keyword == 'STEP') then
         if (reading%open) wrong = 'the step that began in '// &
            deck%source%line_words(deck%card(reading%open_card)%place%line)//' has no *END STEP yet'
         reading%step = reading%step + 1
         reading%open = .true.
         reading%open_card = card
         where (cards%where == in_step) reading%first_use = 0
      else if (spec%where == in_model .and. reading%step > 0) then
         wrong = 'belongs in the model part, above the first *STEP'
      else if (spec%where == in_step .and. .not. reading%open) then
         wrong = 'belongs in a step, between *STEP and *END STEP'
      else if (spec%where /= outside_step .and. reading%step > 0 .and. .not. reading%open) then
         wrong = 'belongs in the model part, above the first *STEP, or in a step'
      else if (spec%follows /= '' .and. reading%chain /= spec%follows) then
         wrong = 'must stand below a *'//trim(spec%follows)
      else if (spec%once .and. reading%first_use(kind) > 0) then
         wrong = 'given twice, first in '//deck%source%line_words(deck%card(reading%first_use(kind))%place%line)
      end if
      deck%card(card)%step = merge(reading%step, 0, reading%open)
      if (spec%keyword == 'END STEP') reading%open = .false.
      if (spec%follows == '') reading%chain = trim(spec%keyword)
      if (reading%first_use(kind) == 0) reading%first_use(kind) = card
      if (wrong /= '') call bad_card(deck, card, deck%card(card)%place, wrong)
   end subroutine check_position

   !> Checks and converts the parameters that are given; then checks those that are missing.
   subroutine check_parameters(deck, card, spec)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      character(:), allocatable :: wrong
      type(place_t) :: place
      integer :: p
      do p = deck%card(card)%first_parameter, deck%card(card)%last_parameter
         call check_parameter(deck, card, spec, p, place, wrong)
         if (wrong == '') cycle
         call bad_card(deck, card, place, wrong)
         ! An unknown name on a continuation line: the comma at the end of the line above is probably superfluous, and the line a
         ! data line.
         if (deck%parameter(p)%item == 0 .and. place%line > deck%card(card)%place%line) exit
      end do
      if (.not. deck%card(card)%sound) return
      do p = spec%first, spec%last
         call check_presence(deck, card, spec, items(p), deck%given_parameter(card, p))
      end do
   end subroutine check_parameters

   !> Checks and converts one parameter, and stores which item of the table it is.
   subroutine check_parameter(deck, card, spec, p, place, wrong)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      integer, intent(in) :: p                        ! index of the parameter in deck%parameter
      type(place_t), intent(out) :: place             ! place of the error in the deck
      character(:), allocatable, intent(out) :: wrong ! description of the error; '' if there is none
      character(:), allocatable :: name
      logical :: right
      wrong = ''
      associate (parameter => deck%parameter(p))
         place = parameter%name
         parameter%item = item_named(spec, deck%text_at(place))
         if (parameter%item == 0) then
            wrong = foreign_answer('parameter', trim(spec%keyword), deck%text_at(place))
            if (wrong == '' .and. spec%names == '') wrong = '; the card has none'
            if (wrong == '') wrong = '; '//choices(spec%names, deck%text_at(place))
            wrong = 'unknown parameter '//quoted(deck%text_at(place))//wrong
            if (place%line > deck%card(card)%place%line) &
               wrong = wrong//' (the line above ends in a comma, so the keyword goes on here)'
            return
         end if
         name = trim(items(parameter%item)%name)
         associate (item => items(parameter%item))
            if (any(deck%parameter(deck%card(card)%first_parameter:p - 1)%item == parameter%item)) then
               wrong = name//' is given twice'
            else if (item%kind == kind_flag) then
               if (parameter%has_value) wrong = name//' takes no value'
            else if (parameter%value%last < parameter%value%first) then
               wrong = name//' needs a value: '//name//'='
            else
               place = parameter%value
               call convert(item, deck%text_at(place), parameter%number, right)
               if (.not. right) wrong = value_error(item, deck%text_at(place))
            end if
         end associate
      end associate
   end subroutine check_parameter

   !> Checks that a parameter is given if it is required, and not given if its condition is not satisfied.
   subroutine check_presence(deck, card, spec, item, p)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      type(item_t), intent(in) :: item                ! entry of the parameter in the table
      integer, intent(in) :: p                        ! index of the parameter in deck%parameter; 0: not given
      character(:), allocatable :: why
      type(place_t) :: place
      if (index(item%only, '=') > 0) then
         ! The error in that parameter is reported already.
         if (given_word(deck, card, spec, item%only(:index(item%only, '=') - 1)) == '') return
      end if
      if (p > 0 .and. .not. holds(deck, card, spec, item%only)) then
         place = deck%parameter(p)%name
         place%last = max(place%last, deck%parameter(p)%value%last)
         call bad_card(deck, card, place, trim(item%name)//' goes with '//separated(item%only, ', ')//' only')
      else if (item%required .and. p == 0 .and. holds(deck, card, spec, item%only)) then
         why = ''
         if (item%only /= '') why = '; required with '//separated(item%only, ', ')
         call bad_card(deck, card, deck%card(card)%place, 'parameter '//trim(item%name)//' is missing'//why)
      end if
   end subroutine check_presence

   !> The word that is given for a parameter, or its default, in the spelling of the table; '' if there is neither.
   pure function given_word(deck, card, spec, name) result(word)
      class(deck_t), intent(in) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      character(*), intent(in) :: name
      character(:), allocatable :: word
      integer :: i, p
      word = ''
      i = item_named(spec, name)
      if (i == 0) return
      p = deck%given_parameter(card, i)
      if (p == 0) word = trim(items(i)%default)
      if (p > 0) word = word_at(items(i)%words, nint(deck%parameter(p)%number))
   end function given_word

   !> Position of a parameter of the card in the items of the table; 0 if it has no such parameter. Case and blanks are ignored.
   pure integer function item_named(spec, name) result(i)
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      character(*), intent(in) :: name
      i = word_index(spec%names, name)
      if (i > 0) i = i + spec%first - 1
   end function item_named

   !> True if a condition of the table is satisfied: 'TYPE=CIRCLE|LINE' (one of these words), 'GENERATE' (given), ''.
   pure logical function holds(deck, card, spec, condition)
      class(deck_t), intent(in) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      character(*), intent(in) :: condition
      character(:), allocatable :: word
      integer :: equals
      holds = .true.
      if (condition == '') return
      equals = index(condition, '=')
      if (equals == 0) then
         holds = deck%given_parameter(card, item_named(spec, condition)) > 0
      else
         word = given_word(deck, card, spec, condition(:equals - 1))
         holds = .false.
         if (word /= '') holds = word_index(condition(equals + 1:), word) > 0
      end if
   end function holds

   !> Determines which layout applies, and checks the number and the fields of the data lines.
   subroutine check_lines(deck, card, spec)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      integer :: first, last, l, i
      first = deck%card(card)%first_line
      last = deck%card(card)%last_line
      if (spec%last_layout < spec%first_layout) then
         if (last < first) return
         call deck%complain(card, deck%whole_line(first), 'takes no data lines')
         deck%data_line(first:last)%sound = .false.
         return
      end if
      do i = spec%first_layout, spec%last_layout
         if (holds(deck, card, spec, layouts(i)%when)) exit
      end do
      deck%card(card)%layout = i
      associate (layout => layouts(i))
         if (last - first + 1 < layout%least) then
            call bad_card(deck, card, deck%card(card)%place, 'a data line is missing: '//separated(layout%names, ', '))
         else if (last - first + 1 > layout%most) then
            call deck%complain(card, deck%whole_line(first + layout%most), 'takes '//plural(layout%most, 'data line')//' only')
            deck%data_line(first + layout%most:last)%sound = .false.
            last = first + layout%most - 1
         end if
         do l = first, merge(first - 1, last, spec%free_text)
            call check_fields(deck, card, spec, l, layout, items(layout%first:layout%last))
         end do
      end associate
   end subroutine check_lines

   !> Checks and converts the fields of a data line.
   subroutine check_fields(deck, card, spec, line, layout, item)
      class(deck_t), intent(inout) :: deck
      integer, intent(in) :: card                        ! index of the card
      type(card_spec_t), intent(in) :: spec              ! entry of the card in the table
      integer, intent(in) :: line                     ! index of the data line
      type(layout_t), intent(in) :: layout
      type(item_t), intent(in) :: item(:)             ! fields of the layout
      type(place_t) :: place
      character(:), allocatable :: wrong
      integer :: f, i, before
      logical :: right
      do f = 1, max(deck%data_line(line)%n_fields, size(item))
         i = f
         if (layout%last_repeats) i = min(f, size(item))
         place = deck%field_place(line, f)
         if (i > size(item)) then
            wrong = 'a field too many; the line reads: '//separated(layout%names, ', ')// &
               foreign_answer('field', trim(spec%keyword), to_text(f))
         else if (.not. deck%field_given(line, f)) then
            if (.not. item(i)%required) cycle
            wrong = trim(item(i)%name)//' is missing; the line reads: '//separated(layout%names, ', ')
         else
            before = deck%source%first(place%line) - 1
            call convert(item(i), deck%source%text(before + place%first:before + place%last), &
               deck%number(deck%data_line(line)%first_field + f - 1), right)
            if (right) cycle
            wrong = value_error(item(i), deck%text_at(place))
         end if
         deck%data_line(line)%sound = .false.
         call deck%complain(card, place, wrong)
         if (i > size(item)) return
      end do
   end subroutine check_fields

   !> Suggestion for a keyword that is not in the table, to be appended to a message.
   pure function known_card(keyword) result(string)
      character(*), intent(in) :: keyword !! keyword as typed, without the star
      character(:), allocatable :: string
      string = foreign_answer('card', '', keyword)
      if (string /= '') return
      string = nearest_word(card_names, '*'//keyword)
      if (string /= '') then
         string = '; did you mean '//string//'?'
      else
         string = '; unilat --cards lists the keywords there are'
      end if
   end function known_card
end module card_check
