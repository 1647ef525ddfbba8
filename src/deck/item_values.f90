!> Values of parameters and fields: conversion of the typed text, check against kind, bound and words of the table, and message
!> about a wrong value. A value is converted once, here; all readers use the number.
module item_values
   use kinds, only: wp, name_length
   use text, only: to_text, nearest_word, parse_integer, parse_real, word_index, separated
   use printable_text, only: quoted
   use formula, only: letters, digits
   use card_spec, only: item_t, bound_words, kind_word, kind_name, kind_integer, kind_real, kind_label, &
      kind_label_or_set, kind_dof, kind_component, kind_distributed, positive, not_negative, not_zero, below_one, poisson
   use card_table, only: foreign_answer
   implicit none
   private
   public :: convert, value_error, choices, component_dof

   integer, parameter :: component_dof(3) = [1, 2, 6] !! degrees of freedom, in the numbering of decks, of the components x, y and
   !! rotation
   real(wp), parameter :: largest_real = 1.0e100_wp !! largest number that is accepted; cubes of such numbers, and sums of cubes,
   !! are below 1e308

contains

   !> Converts a typed value to the number that readers use.
   pure subroutine convert(item, typed, number, right)
      type(item_t), intent(in) :: item
      character(*), intent(in) :: typed
      real(wp), intent(out) :: number !! for a word: position in the item's list; component: 1 to 3; dof: 1 to 6, or minus the
      !! position of the word; label or set: the label, 0 for a set; name, path: 0; 0 after an error
      logical, intent(out) :: right   !! false: the item does not accept the value
      integer :: whole
      number = 0.0_wp
      right = .true.
      select case (item%kind)
      case (kind_word)
         number = word_index(item%words, typed)
         right = number > 0.0_wp
      case (kind_name)
         right = is_name(typed)
      case (kind_real)
         call parse_real(typed, number, right)
         if (right) right = abs(number) <= largest_real .and. within(item%bound, number)
      case (kind_distributed)
         call parse_real(typed, number, right)
         if (right) then
            right = abs(number) <= largest_real .and. within(item%bound, number)
         else
            number = 0.0_wp
            right = is_name(typed)
         end if
      case (kind_integer)
         call parse_integer(typed, whole, right)
         number = whole
         if (right) right = abs(number) <= item%most .and. within(item%bound, number)
      case (kind_label, kind_label_or_set)
         call parse_integer(typed, whole, right)
         number = whole
         if (right) right = whole > 0 .and. whole < huge(whole)
         if (.not. right .and. item%kind == kind_label_or_set) then
            number = 0.0_wp
            right = is_name(typed)
         end if
      case (kind_component)
         call parse_integer(typed, whole, right)
         number = findloc(component_dof, whole, 1)
         right = right .and. number > 0.0_wp
      case (kind_dof)
         call parse_integer(typed, whole, right)
         if (.not. right) whole = -word_index(item%words, typed)
         number = whole
         right = merge(whole >= 1 .and. whole <= 6, whole < 0, right)
      end select
      if (.not. right) number = 0.0_wp
   end subroutine convert

   !> Description of the error in a value that `convert` refuses.
   pure function value_error(item, typed) result(wrong)
      type(item_t), intent(in) :: item
      character(*), intent(in) :: typed
      character(:), allocatable :: wrong, name, near, answer
      name = trim(item%name)
      answer = foreign_answer('value', name, typed)
      select case (item%kind)
      case (kind_word)
         if (answer == '') answer = '; '//choices(item%words, typed)
         wrong = name//' cannot be '//quoted(typed)//answer
      case (kind_name)
         wrong = name//' must be a name (a letter, then letters, digits, _ - . +; at most '//to_text(name_length)// &
            ' characters), not '//quoted(typed)
      case (kind_integer, kind_real)
         wrong = number_error()
      case (kind_distributed)
         wrong = number_error()
         if (index(wrong, ' must be a number') > 0) wrong = wrong//'; or the name of a *DISTRIBUTION'
      case (kind_label)
         wrong = name//' must be a positive integer'//label_limit()//', not '//quoted(typed)
      case (kind_label_or_set)
         wrong = name//' must be a label (positive integer'//label_limit()//') or the name of a set, not '//quoted(typed)
      case (kind_component)
         wrong = name//' must be 1 (x), 2 (y) or 6 (rotation), not '//quoted(typed)
      case default
         near = nearest_word(item%words, typed)
         if (answer /= '') then
            wrong = name//' cannot be '//quoted(typed)//answer
         else if (near /= '') then
            wrong = name//' cannot be '//quoted(typed)//'; did you mean '//near//'?'
         else
            wrong = name//' must be an integer from 1 to 6 or one of '//separated(item%words, ', ')//', not '//quoted(typed)
         end if
      end select

   contains

      pure function number_error() result(wrong)
         character(:), allocatable :: wrong, most
         integer :: whole
         real(wp) :: x
         logical :: is_number, too_large
         if (item%kind == kind_integer) then
            call parse_integer(typed, whole, is_number)
            x = whole
            too_large = .not. is_number .and. whole /= 0 .or. abs(x) > item%most
            most = 'at most '//to_text(item%most)
         else
            call parse_real(typed, x, is_number)
            too_large = .not. is_number .and. x > 0.0_wp .or. abs(x) > largest_real
            most = 'numbers are at most '//to_text(largest_real)//' in size'
         end if
         if (too_large) then
            wrong = name//' is too large: '//quoted(typed)//'; '//most
         else if (is_number) then
            wrong = name//' must be '//trim(bound_words(item%bound))//', not '//quoted(typed)
         else
            wrong = name//' must be '//trim(merge('an integer', 'a number  ', item%kind == kind_integer))//', not '//quoted(typed)
         end if
      end function number_error

      !> Largest permitted label, for the message about a label that exceeds it; else ''.
      pure function label_limit() result(string)
         character(:), allocatable :: string
         integer :: label
         logical :: ok
         call parse_integer(typed, label, ok)
         string = ''
         if (label == huge(label)) string = ' below '//to_text(huge(label))
      end function label_limit
   end function value_error

   !> "accepted: A, B, C" for words between bars, or the word that was probably meant.
   pure function choices(words, typed) result(string)
      character(*), intent(in) :: words !! words between bars
      character(*), intent(in) :: typed !! word in the deck, as typed
      character(:), allocatable :: string
      string = nearest_word(words, typed)
      if (string /= '') then
         string = 'did you mean '//string//'?'
      else
         string = 'accepted: '//separated(words, ', ')
      end if
   end function choices

   !> True for a letter or underscore that is followed by letters, digits, _ - . + (at most name_length characters).
   pure logical function is_name(string)
      character(*), intent(in) :: string
      is_name = len(string) > 0 .and. len(string) <= name_length .and. verify(string, letters//digits//'-.+') == 0
      if (is_name) is_name = index(letters, string(1:1)) > 0
   end function is_name

   !> True if a number satisfies a bound of card_spec.
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
      case (below_one)
         within = x > 0.0_wp .and. x < 1.0_wp
      case (poisson)
         within = x > -1.0_wp .and. x <= 0.5_wp
      case default
         within = .true.
      end select
   end function within
end module item_values
