!> Checks each card by itself against the table: known keyword, right part of the deck, right parameters and data lines.
!>
!> A card with a bad keyword or parameter is marked as not sound, and so is a data line with a bad field; the readers skip both.
!> Relations between cards are checked by the readers.
module card_check
   use kinds, only: wp, name_length
   use text, only: to_text, squeeze, plural, nearest_word, parse_integer, parse_real, word_at, word_count, word_index
   use printable_text, only: quoted
   use diagnostics, only: diagnostics_t, place_t
   use card_spec, only: card_spec_t, item_t, find_card, find_item, in_model, in_step, outside_step, &
      positive, not_negative, not_zero, kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_label, &
      kind_label_or_set, kind_dof
   use card_table, only: all_cards
   use deck_cards, only: deck_t, text_at, complain
   use foreign_words, only: foreign_card, foreign_parameter, foreign_value, foreign_field
   use card_values, only: holds, parameter_place, parameter_word, field_given, field_place, whole_line
   implicit none
   private
   public :: check_cards, is_name, choices, known_card

   character(*), parameter :: foreign = '; a word of Abaqus and CalculiX; ' !! introduces the equivalent in unilat
   real(wp), parameter :: largest_real = 1.0e100_wp !! cubes of such numbers, and sums of these, are below 1e308

   !> Data carried from card to card.
   type :: reading_t
      integer :: step = 0             !! step that is open, or the last one
      logical :: open = .false.
      integer :: open_card = 0        !! card of the open step
      character(:), allocatable :: chain !! preceding card to which *ELASTIC and similar cards belong; ''
      integer, allocatable :: first_use(:) !! by spec: first card of this kind in the present part, 0: none yet
   end type reading_t

contains

   !> Checks all cards and fills in their spec, layout, step and soundness.
   subroutine check_cards(deck, diagnostics)
      type(deck_t), intent(inout) :: deck                !! as split; receives the table
      type(diagnostics_t), intent(inout) :: diagnostics  !! receives the errors
      type(reading_t) :: reading
      integer :: card
      deck%spec = all_cards()
      reading%chain = ''
      allocate (reading%first_use(size(deck%spec)), source=0)
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .and. deck%card(card)%keyword == '') cycle
         deck%card(card)%spec = find_card(deck%spec, deck%card(card)%keyword)
         if (deck%card(card)%spec == 0) then
            call report_unknown(deck, diagnostics, card)
            cycle
         end if
         deck%card(card)%keyword = deck%spec(deck%card(card)%spec)%keyword
         call check_position(deck, diagnostics, card, reading)
         call check_parameters(deck, diagnostics, card)
         ! With bad parameters the layout is unknown, unless the card has only one.
         if (deck%card(card)%sound .or. size(deck%spec(deck%card(card)%spec)%layout) == 1) &
            call check_lines(deck, diagnostics, card)
      end do
      if (reading%open) call complain(deck, diagnostics, reading%open_card, deck%card(reading%open_card)%place, &
         'its *END STEP is missing')
   end subroutine check_cards

   !> "one of A, B, C" for words between bars, with a suggestion for a misspelt word.
   pure function choices(words, typed) result(string)
      character(*), intent(in) :: words !! between bars
      character(*), intent(in) :: typed !! word in the deck
      character(:), allocatable :: string
      integer :: i
      string = nearest_word(words, typed)
      if (string /= '') then
         string = 'did you mean '//string//'?'
         return
      end if
      string = 'accepted: '
      do i = 1, word_count(words)
         if (i > 1) string = string//', '
         string = string//word_at(words, i)
      end do
   end function choices

   !> True for a letter or underscore, then letters, digits, _ - . + (at most name_length characters).
   pure logical function is_name(string)
      character(*), intent(in) :: string
      character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_'
      is_name = len(string) > 0 .and. len(string) <= name_length .and. verify(string, letters//'0123456789-.+') == 0
      if (is_name) is_name = index(letters, string(1:1)) > 0
   end function is_name

   subroutine report_unknown(deck, diagnostics, card)
      type(deck_t), intent(inout) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      character(:), allocatable :: typed
      deck%card(card)%sound = .false.
      typed = text_at(deck, deck%card(card)%place)
      call diagnostics%add(deck%card(card)%place, 'unknown keyword '//quoted(typed)//known_card(deck%spec, typed(2:)))
   end subroutine report_unknown

   !> Suggestion for a keyword that is not in the table, to be appended to a message.
   pure function known_card(table, keyword) result(string)
      type(card_spec_t), intent(in) :: table(:)
      character(*), intent(in) :: keyword !! as typed, without the star
      character(:), allocatable :: string, words
      integer :: i
      string = foreign_card(keyword)
      if (string /= '') then
         string = foreign//string
         return
      end if
      words = '*'//table(1)%keyword
      do i = 2, size(table)
         words = words//'|*'//table(i)%keyword
      end do
      string = nearest_word(words, '*'//keyword)
      if (string /= '') then
         string = '; did you mean '//string//'?'
      else
         string = '; unilat --cards lists the keywords there are'
      end if
   end function known_card

   !> Checks that the card is in the right part of the deck, and opens and closes steps.
   subroutine check_position(deck, diagnostics, card, reading)
      type(deck_t), intent(inout) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(reading_t), intent(inout) :: reading
      type(card_spec_t) :: spec
      character(:), allocatable :: wrong
      integer :: i
      i = deck%card(card)%spec
      spec = deck%spec(i)
      wrong = ''
      if (spec%keyword == 'STEP') then
         if (reading%open) wrong = 'the step that began in '// &
            deck%source%line_words(deck%card(reading%open_card)%place%line)//' has no *END STEP yet'
         reading%step = reading%step + 1
         reading%open = .true.
         reading%open_card = card
         where (deck%spec%where == in_step) reading%first_use = 0
      else if (spec%where == in_model .and. reading%step > 0) then
         wrong = 'belongs in the model part, above the first *STEP'
      else if (spec%where == in_step .and. .not. reading%open) then
         wrong = 'belongs in a step, between *STEP and *END STEP'
      else if (spec%where /= outside_step .and. reading%step > 0 .and. .not. reading%open) then
         wrong = 'belongs in the model part, above the first *STEP, or in a step'
      else if (spec%follows /= '' .and. reading%chain /= spec%follows) then
         wrong = 'must stand below a *'//spec%follows
      else if (spec%once .and. reading%first_use(i) > 0) then
         wrong = 'given twice, first in '//deck%source%line_words(deck%card(reading%first_use(i))%place%line)
      end if
      deck%card(card)%step = merge(reading%step, 0, reading%open)
      if (spec%keyword == 'END STEP') reading%open = .false.
      if (spec%follows == '') reading%chain = spec%keyword
      if (reading%first_use(i) == 0) reading%first_use(i) = card
      if (wrong == '') return
      deck%card(card)%sound = .false.
      call complain(deck, diagnostics, card, deck%card(card)%place, wrong)
   end subroutine check_position

   subroutine check_parameters(deck, diagnostics, card)
      type(deck_t), intent(inout) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(card_spec_t) :: spec
      type(item_t) :: item
      character(:), allocatable :: name, wrong
      type(place_t) :: place
      integer :: p, i
      logical :: seen(size(deck%spec(deck%card(card)%spec)%parameter))
      spec = deck%spec(deck%card(card)%spec)
      seen = .false.
      do p = deck%card(card)%first_parameter, deck%card(card)%last_parameter
         place = deck%parameter(p)%name
         name = text_at(deck, place)
         wrong = ''
         i = find_item(spec%parameter, name)
         if (i == 0) then
            wrong = unknown_parameter(spec, name)
            if (place%line > deck%card(card)%place%line) &
               wrong = wrong//' (the line above ends in a comma, so the keyword goes on here)'
         else
            item = spec%parameter(i)
            if (seen(i)) then
               wrong = item%name//' is given twice'
            else if (item%kind == kind_flag .and. deck%parameter(p)%has_value) then
               wrong = item%name//' takes no value'
            else if (item%kind == kind_flag) then ! nothing to read
               continue
            else if (deck%parameter(p)%value%last < deck%parameter(p)%value%first) then
               wrong = item%name//' needs a value: '//item%name//'='
            else
               place = deck%parameter(p)%value
               wrong = value_error(item, text_at(deck, place))
            end if
            seen(i) = .true.
         end if
         if (wrong == '') cycle
         deck%card(card)%sound = .false.
         call complain(deck, diagnostics, card, place, wrong)
         if (i == 0 .and. place%line > deck%card(card)%place%line) exit ! most likely the card has no parameters at all
      end do
      if (.not. deck%card(card)%sound) return
      do i = 1, size(spec%parameter)
         item = spec%parameter(i)
         wrong = ''
         if (depends_on_missing(item%only)) then ! the missing parameter is already reported
            continue
         else if (seen(i) .and. .not. holds(deck, card, item%only)) then
            wrong = item%name//' goes with '//with_commas(item%only)//' only'
         else if (item%required .and. .not. seen(i) .and. holds(deck, card, item%only)) then
            wrong = 'parameter '//item%name//' is missing'
            if (item%only /= '') wrong = wrong//'; required with '//with_commas(item%only)
         end if
         if (wrong == '') cycle
         deck%card(card)%sound = .false.
         call complain(deck, diagnostics, card, parameter_place(deck, card, item%name), wrong)
      end do

   contains

      !> True for a condition such as 'TYPE=CIRCLE' if TYPE has neither value nor default.
      logical function depends_on_missing(condition)
         character(*), intent(in) :: condition
         integer :: equals
         equals = index(condition, '=')
         depends_on_missing = .false.
         if (equals > 0) depends_on_missing = parameter_word(deck, card, condition(:equals - 1)) == ''
      end function depends_on_missing
   end subroutine check_parameters

   pure function unknown_parameter(spec, name) result(string)
      type(card_spec_t), intent(in) :: spec
      character(*), intent(in) :: name
      character(:), allocatable :: string, words
      integer :: i
      string = foreign_parameter(spec%keyword, name)
      if (string /= '') then
         string = 'unknown parameter '//quoted(name)//foreign//string
         return
      end if
      string = 'unknown parameter '//quoted(name)//'; the card has none'
      if (size(spec%parameter) == 0) return
      words = spec%parameter(1)%name
      do i = 2, size(spec%parameter)
         words = words//'|'//spec%parameter(i)%name
      end do
      string = 'unknown parameter '//quoted(name)//'; '//choices(words, name)
   end function unknown_parameter

   !> Determines the layout that applies, and checks number and fields of the data lines.
   subroutine check_lines(deck, diagnostics, card)
      type(deck_t), intent(inout) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      integer :: first, last, l, i
      type(place_t) :: place
      first = deck%card(card)%first_line
      last = deck%card(card)%last_line
      associate (spec => deck%spec(deck%card(card)%spec))
         if (size(spec%layout) == 0) then
            if (last < first) return
            call complain(deck, diagnostics, card, whole_line(deck, first), 'takes no data lines')
            deck%data_line(first:last)%sound = .false.
            return
         end if
         do i = 1, size(spec%layout)
            if (holds(deck, card, spec%layout(i)%when)) exit
         end do
         deck%card(card)%layout = i
         associate (layout => spec%layout(i))
            if (last - first + 1 < layout%least) then
               deck%card(card)%sound = .false.
               place = deck%card(card)%place
               call complain(deck, diagnostics, card, place, 'a data line is missing: '//field_names(layout%field))
            else if (last - first + 1 > layout%most) then
               call complain(deck, diagnostics, card, whole_line(deck, first + layout%most), &
                  'takes '//plural(layout%most, 'data line')//' only')
               deck%data_line(first + layout%most:last)%sound = .false.
               last = first + layout%most - 1
            end if
            do l = first, merge(first - 1, last, spec%free_text)
               call check_fields(deck, diagnostics, card, l, layout%field, layout%last_repeats)
            end do
         end associate
      end associate
   end subroutine check_lines

   subroutine check_fields(deck, diagnostics, card, line, item, last_repeats)
      type(deck_t), intent(inout) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, line
      type(item_t), intent(in) :: item(:)
      logical, intent(in) :: last_repeats
      type(place_t) :: place
      character(:), allocatable :: wrong
      integer :: f, i
      do f = 1, max(deck%data_line(line)%n_fields, size(item))
         place = field_place(deck, line, f)
         i = f
         if (last_repeats) i = min(f, size(item))
         if (i > size(item)) then
            deck%data_line(line)%sound = .false.
            wrong = 'a field too many; the line reads: '//field_names(item)
            if (foreign_field(deck%card(card)%keyword, f) /= '') wrong = wrong//'; '//foreign_field(deck%card(card)%keyword, f)
            call complain(deck, diagnostics, card, place, wrong)
            return
         else if (.not. field_given(deck, line, f)) then
            if (.not. item(i)%required) cycle
            wrong = item(i)%name//' is missing; the line reads: '//field_names(item)
         else
            if (looks_right(item(i), deck%source%text(deck%source%first(place%line) + place%first - 1: &
               deck%source%first(place%line) + place%last - 1))) cycle
            wrong = value_error(item(i), text_at(deck, place))
         end if
         if (wrong == '') cycle
         deck%data_line(line)%sound = .false.
         call complain(deck, diagnostics, card, place, wrong)
      end do
   end subroutine check_fields

   !> Fast check of the most frequent values: labels and unbounded reals.
   pure logical function looks_right(item, typed)
      type(item_t), intent(in) :: item
      character(*), intent(in) :: typed
      real(wp) :: number
      integer :: label
      looks_right = .false.
      if (item%kind == kind_real) then
         call parse_real(typed, number, looks_right)
         if (looks_right) looks_right = within(item%bound, number) .and. abs(number) <= largest_real
      else if (item%kind == kind_label .or. item%kind == kind_label_or_set) then
         call parse_integer(typed, label, looks_right)
         looks_right = looks_right .and. label > 0 .and. label < huge(label)
      end if
   end function looks_right

   !> Description of the error in a value; '' if there is none.
   pure function value_error(item, typed) result(wrong)
      type(item_t), intent(in) :: item
      character(*), intent(in) :: typed
      character(:), allocatable :: wrong, pair
      integer :: number
      real(wp) :: x
      logical :: ok
      wrong = ''
      select case (item%kind)
      case (kind_word)
         if (word_index(item%words, typed) > 0) return
         wrong = item%name//' cannot be '//quoted(typed)//'; '//choices(item%words, typed)
         if (foreign_value(item%name, typed) /= '') wrong = item%name//' cannot be '//quoted(typed)//foreign// &
            foreign_value(item%name, typed)
         do number = 1, word_count(item%former)
            pair = word_at(item%former, number)
            if (pair(:index(pair, ' ') - 1) == squeeze(typed)) wrong = item%name//' cannot be '//squeeze(typed)// &
               ' any more; write '//pair(index(pair, ' ') + 1:)
         end do
      case (kind_name)
         if (.not. is_name(typed)) wrong = item%name//' must be a name (a letter, then letters, digits, _ - . +; '// &
            'at most '// &
            to_text(name_length)//' characters), not '//quoted(typed)
      case (kind_integer)
         call parse_integer(typed, number, ok)
         if (.not. ok .and. number == 0) then
            wrong = item%name//' must be an integer, not '//quoted(typed)
         else if (.not. ok .or. abs(real(number, wp)) > item%most) then
            wrong = item%name//' is too large: '//quoted(typed)//'; at most '//to_text(item%most)
         else if (.not. within(item%bound, real(number, wp))) then
            wrong = item%name//' must be '//bound_text(item%bound)//', not '//quoted(typed)
         end if
      case (kind_real)
         call parse_real(typed, x, ok)
         if (.not. ok .and. .not. x > 0.0_wp) then
            wrong = item%name//' must be a number, not '//quoted(typed)
         else if (.not. ok .or. abs(x) > largest_real) then
            wrong = item%name//' is too large: '//quoted(typed)//'; numbers are at most '//to_text(largest_real)//' in size'
         else if (.not. within(item%bound, x)) then
            wrong = item%name//' must be '//bound_text(item%bound)//', not '//quoted(typed)
         end if
      case (kind_label)
         if (.not. looks_right(item, typed)) wrong = item%name//' must be a positive integer'//label_limit(typed)//', not '// &
            quoted(typed)
      case (kind_label_or_set)
         if (.not. (looks_right(item, typed) .or. is_name(typed))) wrong = item%name// &
            ' must be a label (positive integer'//label_limit(typed)//') or the name of a set, not '//quoted(typed)
      case (kind_dof)
         call parse_integer(typed, number, ok)
         if (ok) ok = number >= 1 .and. number <= 6
         if (ok .or. word_index(item%words, typed) > 0) return
         wrong = item%name//' cannot be '//quoted(typed)//foreign//foreign_value(item%name, typed)
         if (foreign_value(item%name, typed) /= '') return
         wrong = item%name//' must be an integer from 1 to 6 or one of '//with_commas(item%words)//', not '//quoted(typed)
         pair = nearest_word(item%words, typed)
         if (pair /= '') wrong = item%name//' cannot be '//quoted(typed)//'; did you mean '//pair//'?'
      end select
   end function value_error

   !> Largest permitted label, for the message about a label that exceeds it; else ''.
   pure function label_limit(typed) result(string)
      character(*), intent(in) :: typed
      character(:), allocatable :: string
      integer :: label
      logical :: ok
      call parse_integer(typed, label, ok)
      string = ''
      if (label == huge(label)) string = ' below '//to_text(huge(label))
   end function label_limit

   pure logical function within(bound, x)
      integer, intent(in) :: bound
      real(wp), intent(in) :: x
      select case (bound)
      case (positive)
         within = x > 0.0_wp
      case (not_negative)
         within = x >= 0.0_wp
      case (not_zero)
         within = abs(x) > 0.0_wp
      case default
         within = .true.
      end select
   end function within

   pure function bound_text(bound) result(string)
      integer, intent(in) :: bound
      character(:), allocatable :: string
      select case (bound)
      case (positive)
         string = 'positive'
      case (not_negative)
         string = 'zero or positive'
      case default
         string = 'other than zero'
      end select
   end function bound_text

   pure function with_commas(words) result(string)
      character(*), intent(in) :: words
      character(:), allocatable :: string
      integer :: i
      string = word_at(words, 1)
      do i = 2, word_count(words)
         string = string//', '//word_at(words, i)
      end do
   end function with_commas

   pure function field_names(item) result(string)
      type(item_t), intent(in) :: item(:)
      character(:), allocatable :: string
      integer :: i
      string = ''
      do i = 1, size(item)
         if (i > 1) string = string//', '
         string = string//item(i)%name
      end do
   end function field_names
end module card_check
