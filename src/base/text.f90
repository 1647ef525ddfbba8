!> Small procedures for words and numbers: comparing, parsing, printing, listing.
module text
   use kinds, only: wp, i8
   implicit none
   private
   public :: upper, squeeze, same_name, blanks, to_text, rounded, nearest_word, plural, add_clause
   public :: parse_integer, parse_real, word_at, word_index, separated

   character(*), parameter :: blanks = ' '//achar(9) !! a blank and a tab

   !> The shortest text of an integer of either kind; or the shortest text of a real that reads back as the same number.
   interface to_text
      module procedure integer_to_text, long_to_text, real_to_text
   end interface to_text

   integer(i8), parameter :: room_for_a_digit = 900719925474099_i8 !! for m below this number 10 m + 9 is exact in working precision
   real(wp), parameter :: power_of_ten(0:22) = [1e0_wp, 1e1_wp, 1e2_wp, 1e3_wp, 1e4_wp, 1e5_wp, 1e6_wp, 1e7_wp, &
      1e8_wp, &
      & 1e9_wp, 1e10_wp, 1e11_wp, 1e12_wp, 1e13_wp, 1e14_wp, 1e15_wp, 1e16_wp, 1e17_wp, 1e18_wp, 1e19_wp, 1e20_wp, &
      & 1e21_wp, 1e22_wp]                        !! all numbers are exact in working precision

contains

   !> The text in upper case (ASCII letters only; other bytes are unchanged).
   pure function upper(string) result(capital)
      character(*), intent(in) :: string !! text with any characters
      character(len(string)) :: capital
      integer, parameter :: distance = iachar('a') - iachar('A')
      integer :: i
      capital = string
      do i = 1, len(string)
         if (string(i:i) >= 'a' .and. string(i:i) <= 'z') capital(i:i) = achar(iachar(string(i:i)) - distance)
      end do
   end function upper

   !> The text in upper case without blanks: the form in which words of the deck are compared.
   pure function squeeze(string) result(word)
      character(*), intent(in) :: string !! text with any characters
      character(:), allocatable :: word
      integer :: i, n
      allocate (character(len(string)) :: word) ! (an allocated text is not on the stack, which a long line of a deck would fill)
      n = 0
      do i = 1, len(string)
         if (string(i:i) == ' ' .or. string(i:i) == achar(9)) cycle
         n = n + 1
         word(n:n) = string(i:i)
         if (string(i:i) >= 'a' .and. string(i:i) <= 'z') word(n:n) = achar(iachar(string(i:i)) - 32)
      end do
      if (n < len(word)) word = word(:n)
   end function squeeze

   !> True if two names are equal apart from case and trailing blanks.
   pure logical function same_name(first, second)
      character(*), intent(in) :: first  !! any name
      character(*), intent(in) :: second !! any name
      same_name = upper(trim(first)) == upper(trim(second))
   end function same_name

   pure function integer_to_text(value) result(string)
      integer, intent(in) :: value !! any integer
      character(:), allocatable :: string
      string = long_to_text(int(value, i8))
   end function integer_to_text

   pure function long_to_text(value) result(string)
      integer(i8), intent(in) :: value !! any integer
      character(:), allocatable :: string
      character(20) :: buffer
      integer(i8) :: left
      integer :: first
      ! The most negative integer has no positive counterpart: its digits are taken from a negative number.
      left = value
      if (value > 0) left = -value
      first = len(buffer) + 1
      do
         first = first - 1
         buffer(first:first) = achar(iachar('0') - int(mod(left, 10_i8)))
         left = left / 10
         if (left == 0) exit
      end do
      if (value < 0) then
         first = first - 1
         buffer(first:first) = '-'
      end if
      string = buffer(first:)
   end function long_to_text

   pure function real_to_text(value) result(string)
      real(wp), intent(in) :: value !! any real; NaN and infinities are named
      character(:), allocatable :: string
      character(40) :: buffer, format
      character(17) :: digit
      integer :: places, exponent, n, mark
      real(wp) :: again
      if (.not. abs(value) <= huge(value)) then
         write (buffer, '(g0)') value
         string = trim(adjustl(buffer))
         return
      end if
      do places = 0, 16
         write (format, '(a, i0, a)') '(es40.', places, 'e4)'
         write (buffer, format) value
         read (buffer, *) again
         if (abs(again - value) <= 0.0_wp) exit
      end do
      ! The buffer contains [-]d.ddde+xxxx, which is rewritten in the usual notation.
      buffer = adjustl(buffer)
      string = ''
      if (buffer(1:1) == '-') then
         string = '-'
         buffer = buffer(2:)
      end if
      mark = scan(buffer, 'Ee')
      read (buffer(mark + 1:), *) exponent
      digit = buffer(1:1)//buffer(3:mark - 1)
      n = len_trim(digit)
      if (exponent < -4 .or. exponent > 6) then
         string = string//digit(1:1)
         if (n > 1) string = string//'.'//digit(2:n)
         string = string//'e'//integer_to_text(exponent)
      else if (exponent < 0) then
         string = string//'0.'//repeat('0', -exponent - 1)//digit(:n)
      else if (n <= exponent + 1) then
         string = string//digit(:n)//repeat('0', exponent + 1 - n)
      else
         string = string//digit(:exponent + 1)//'.'//digit(exponent + 2:n)
      end if
   end function real_to_text

   !> A number with 3 significant digits, for messages.
   pure function rounded(x) result(string)
      real(wp), intent(in) :: x !! any real
      character(:), allocatable :: string
      character(12) :: buffer
      real(wp) :: short
      write (buffer, '(es12.2e3)') x
      read (buffer, *) short
      string = to_text(short)
   end function rounded

   !> Appends a clause to a text, behind a semicolon if the text is not empty.
   pure subroutine add_clause(text, clause)
      character(:), allocatable, intent(inout) :: text !! text; not allocated: it is empty
      character(*), intent(in) :: clause
      if (.not. allocated(text)) text = ''
      if (text /= '') text = text//'; '
      text = text//clause
   end subroutine add_clause

   !> Number and noun: "1 error", "2 errors".
   pure function plural(number, noun) result(string)
      integer, intent(in) :: number    !! number of things
      character(*), intent(in) :: noun !! noun in the singular; the plural is formed with s
      character(:), allocatable :: string
      string = to_text(number)//' '//noun
      if (number /= 1) string = string//'s'
   end function plural

   !> One word of a list separated by bars.
   pure function word_at(list, position) result(word)
      character(*), intent(in) :: list    !! words between bars
      integer, intent(in) :: position     !! from 1 to the number of words
      character(:), allocatable :: word
      integer :: first, last, i
      last = 0
      do i = 1, position
         call next_word(list, first, last)
      end do
      word = list(first:last)
   end function word_at

   !> The words of a list with another separator instead of bars.
   pure function separated(list, separator) result(string)
      character(*), intent(in) :: list      !! words between bars
      character(*), intent(in) :: separator !! separator, such as ', '
      character(:), allocatable :: string
      integer :: first, last
      string = ''
      last = 0
      do
         call next_word(list, first, last)
         if (first == 0) return
         if (first > 1) string = string//separator
         string = string//list(first:last)
      end do
   end function separated

   !> Position of a word in a list separated by bars; case and blanks are ignored; 0 if the word is not in the list.
   pure integer function word_index(list, word)
      character(*), intent(in) :: list !! words between bars
      character(*), intent(in) :: word !! the word as typed
      character(:), allocatable :: key
      integer :: first, last
      key = squeeze(word)
      last = 0
      word_index = 0
      do
         call next_word(list, first, last)
         if (first == 0) exit
         word_index = word_index + 1
         if (squeeze(list(first:last)) == key) return
      end do
      word_index = 0
   end function word_index

   !> The word of a list (separated by bars) that begins with a given word or has the most similar spelling; '' if there is none.
   pure function nearest_word(list, word) result(nearest)
      character(*), intent(in) :: list !! words between bars
      character(*), intent(in) :: word !! the word as typed
      character(:), allocatable :: nearest, key, each
      integer :: distance, least, first, last
      nearest = ''
      key = squeeze(word)
      least = len_trim(word) / 3 + 1 ! one wrong letter in three; for a shorter word there is no similar word
      last = 0
      do
         call next_word(list, first, last)
         if (first == 0) exit
         ! The distance is at least the sum, over all letters, of the differences of their numbers in the two words.
         each = squeeze(list(first:last))
         distance = abs(len(each) - len(key))
         if (distance < least) distance = edit_distance(each, key)
         if (len_trim(word) > 2 .and. index(each, key) == 1) distance = 0
         if (distance >= least) cycle
         least = distance
         nearest = list(first:last)
      end do
   end function nearest_word

   !> Finds the next word of a list separated by bars.
   pure subroutine next_word(list, first, last)
      character(*), intent(in) :: list
      integer, intent(out) :: first    !! first character of the word; 0: there is no further word
      integer, intent(inout) :: last   !! last character of the word; in: that of the previous word, 0 at first
      integer :: bar
      first = last + 1
      if (last > 0) first = last + 2
      if (len_trim(list) == 0 .or. first > len_trim(list) + 1) then
         first = 0
         return
      end if
      bar = index(list(first:), '|')
      last = len_trim(list)
      if (bar > 0) last = first + bar - 2
   end subroutine next_word

   !> Smallest number of insertions, deletions, substitutions and swaps of neighbouring letters that turn one word into the other.
   pure integer function edit_distance(first, second)
      character(*), intent(in) :: first, second
      integer :: d(0:len(first), 0:len(second)), i, j, change
      do i = 0, len(first)
         d(i, 0) = i
      end do
      do j = 0, len(second)
         d(0, j) = j
      end do
      do j = 1, len(second)
         do i = 1, len(first)
            change = merge(0, 1, first(i:i) == second(j:j))
            d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + change)
            if (i > 1 .and. j > 1) then
               if (first(i:i) == second(j - 1:j - 1) .and. first(i - 1:i - 1) == second(j:j)) then
                  d(i, j) = min(d(i, j), d(max(i - 2, 0), max(j - 2, 0)) + 1)
               end if
            end if
         end do
      end do
      edit_distance = d(len(first), len(second))
   end function edit_distance

   !> Reads an integer that fills the whole text.
   pure subroutine parse_integer(string, value, ok)
      character(*), intent(in) :: string !! text without blanks at its ends
      integer, intent(out) :: value      !! value of the integer; if not ok: huge(1) for an integer that is too large, else 0
      logical, intent(out) :: ok         !! false: not an integer, or out of range
      integer(i8) :: total
      integer :: i, first
      value = 0
      ok = .false.
      first = 1
      if (scan(string, '+-') == 1) first = 2
      if (len(string) < first) return
      total = 0
      do i = first, len(string)
         if (.not. is_digit(string(i:i))) return
         total = min(10 * total + digit_value(string(i:i)), int(huge(value), i8) + 1)
      end do
      if (total > huge(value)) then
         value = huge(value)
         return
      end if
      value = int(total)
      if (string(1:1) == '-') value = -value
      ok = .true.
   end subroutine parse_integer

   !> Reads a Fortran real (1, 1.5, .5, 1e5, 1D-5) that fills the whole text.
   pure subroutine parse_real(string, value, ok)
      character(*), intent(in) :: string !! text without blanks at its ends
      real(wp), intent(out) :: value     !! value of the real; if not ok: huge for a real of 1e308 or more, else 0
      logical, intent(out) :: ok         !! false: the text is not a real, or the value is 1e308 or more
      integer(i8) :: mantissa
      integer :: i, digits, scale, exponent, mark
      logical :: exact
      value = 0.0_wp
      ok = .false.
      mantissa = 0
      digits = 0       ! number of digits before the exponent
      scale = 0        ! power of ten of the last digit that is in the mantissa
      exact = .true.
      mark = 0
      i = 1
      if (scan(string, '+-') == 1) i = 2
      do while (i <= len(string))
         if (is_digit(string(i:i))) then
            digits = digits + 1
            if (mantissa < room_for_a_digit) then
               mantissa = 10 * mantissa + digit_value(string(i:i))
               if (mark > 0) scale = scale - 1
            else
               exact = .false.
               if (mark == 0) scale = scale + 1
            end if
         else if (string(i:i) == '.' .and. mark == 0) then
            mark = i
         else
            exit
         end if
         i = i + 1
      end do
      if (digits == 0) return
      exponent = 0
      if (i <= len(string)) then
         if (scan(string(i:i), 'eEdD') == 0) return
         call parse_integer(string(i + 1:), exponent, ok)
         if (.not. ok .and. exponent == 0) return
         if (.not. ok .and. string(i + 1:i + 1) == '-') exponent = -exponent
         ok = .false.
         exponent = min(max(exponent, -100000), 100000)
      end if
      scale = scale + exponent
      if (mantissa == 0) then
         ok = .true.
         return
      end if
      ! Values below 1e308, judged by the position of the leading digit, are accepted; values too small for the number range become
      ! zero.
      if (log10(real(mantissa, wp)) + scale >= 308.0_wp) then
         value = huge(value)
         return
      end if
      ok = .true.
      if (log10(real(mantissa, wp)) + scale < -330.0_wp) return
      if (exact .and. abs(scale) <= ubound(power_of_ten, 1)) then
         ! Both factors are exact: the result is rounded only once, correctly.
         if (scale >= 0) value = real(mantissa, wp) * power_of_ten(scale)
         if (scale < 0) value = real(mantissa, wp) / power_of_ten(-scale)
         if (string(1:1) == '-') value = -value
      else
         read (string, *, iostat=mark) value
         ok = mark == 0
      end if
   end subroutine parse_real

   !> True for the digits 0 to 9.
   pure logical function is_digit(letter)
      character(1), intent(in) :: letter
      is_digit = letter >= '0' .and. letter <= '9'
   end function is_digit

   pure integer function digit_value(letter)
      character(1), intent(in) :: letter
      digit_value = iachar(letter) - iachar('0')
   end function digit_value
end module text
