!> Evaluates a formula in a deck, such as 2*pi*EI/L**2.
!>
!> A formula consists of numbers, names, + - * / **, brackets and functions, with the precedence of Fortran: ** first, from the
!> right, then signs, then * and /, then + and -, from the left. All numbers are real. A result that is not finite is an error.
module formula
   use kinds, only: wp, pi, degree
   use printable_text, only: quoted
   use text, only: parse_real, same_name, blanks, nearest_word, word_index, word_at
   implicit none
   private
   public :: evaluate, is_plain_name, is_reserved, span_of, letters, digits

   character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_', digits = '0123456789'
   character(*), parameter :: one_argument = 'sqrt|sin|cos|tan|asin|acos|atan|exp|log|abs|radians|degrees'
   character(*), parameter :: reserved = one_argument//'|min|max|pi'
   integer, parameter :: deepest = 100 !! largest depth of nested brackets, signs and powers

   !> A formula that is being read. Each procedure read_... reads the part that begins at `at` and gives its value.
   type :: reading_t
      character(:), pointer :: string => null()          !! the formula
      character(:), pointer :: known => null()           !! permitted names, between bars
      real(wp), pointer :: value(:) => null()            !! values of the known names
      character(:), allocatable :: wrong                 !! description of the first error; '': none
      integer :: at = 1                                  !! position in the formula
      integer :: depth = 0                               !! level of nesting
   end type reading_t

contains

   !> Evaluates a formula.
   subroutine evaluate(string, known, value, result, wrong)
      character(*), intent(in), target :: string         !! the formula
      character(*), intent(in), target :: known          !! permitted names, between bars; case is ignored
      real(wp), intent(in), target :: value(:)           !! values of the known names
      real(wp), intent(out) :: result                    !! value of the formula, finite; 0 after an error
      character(:), allocatable, intent(out) :: wrong    !! description of the error, in words; '' if there is none
      type(reading_t) :: reading
      reading%string => string
      reading%known => known
      reading%value => value
      reading%wrong = ''
      call read_level(reading, 1, result)
      if (next(reading) /= '') call object(reading, 'unexpected '''//next(reading)//'''')
      call move_alloc(reading%wrong, wrong)
      if (wrong /= '') result = 0.0_wp
   end subroutine evaluate

   !> Reads operands joined by the operators of a level: level 1 are sums of products, level 2 products of signed powers.
   recursive subroutine read_level(reading, level, x)
      type(reading_t), intent(inout) :: reading
      integer, intent(in) :: level
      real(wp), intent(out) :: x
      character(2), parameter :: operators(2) = ['+-', '*/']
      real(wp) :: y
      character(1) :: operator
      if (level > size(operators)) then
         call read_signed(reading, x)
         return
      end if
      call read_level(reading, level + 1, x)
      do while (scan(next(reading), operators(level)) == 1)
         operator = next(reading)
         call step(reading)
         call read_level(reading, level + 1, y)
         if (reading%wrong /= '') return
         call combine(operator, x, y, reading%wrong)
      end do
   end subroutine read_level

   !> Reads a power with its signs.
   recursive subroutine read_signed(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      character(1) :: sign
      x = 0.0_wp
      if (scan(next(reading), '+-') == 0) then
         call read_power(reading, x)
         return
      end if
      sign = next(reading)
      call step(reading)
      call deeper(reading)
      call read_signed(reading, x)
      reading%depth = reading%depth - 1
      if (sign == '-') x = -x
   end subroutine read_signed

   !> Reads an operand and its exponent, if there is one.
   recursive subroutine read_power(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      real(wp) :: y
      call read_operand(reading, x)
      if (next(reading) /= '*') return
      if (index(reading%string(place(reading):), '**') /= 1) return
      call step(reading)
      call step(reading)
      call deeper(reading)
      call read_signed(reading, y)
      reading%depth = reading%depth - 1
      if (reading%wrong == '') call raise(x, y, reading%wrong)
   end subroutine read_power

   !> Reads a number, a name, a function or a sum in brackets.
   recursive subroutine read_operand(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      character(1) :: letter
      x = 0.0_wp
      letter = next(reading)
      if (letter == '') then
         call object(reading, 'something is missing at the end')
      else if (letter == '(') then
         call step(reading)
         call deeper(reading)
         call read_level(reading, 1, x)
         reading%depth = reading%depth - 1
         call close_bracket(reading)
      else if (scan(letter, digits//'.') == 1) then
         call read_number(reading, x)
      else if (scan(letter, letters) == 1) then
         call read_name(reading, x)
      else
         call object(reading, 'unexpected '''//letter//'''')
      end if
   end subroutine read_operand

   !> Reads a number.
   subroutine read_number(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      integer :: first, last
      logical :: ok
      first = place(reading)
      last = first + span_of(reading%string(first:), digits//'.') - 1
      ! An exponent with its sign belongs to the number: 1e-3.
      if (last < len(reading%string)) then
         if (scan(reading%string(last + 1:last + 1), 'eEdD') == 1) then
            last = last + 1
            if (last < len(reading%string)) then
               if (scan(reading%string(last + 1:last + 1), '+-') == 1) last = last + 1
            end if
            last = last + span_of(reading%string(last + 1:), digits)
         end if
      end if
      call parse_real(reading%string(first:last), x, ok)
      if (.not. ok .and. x > 0.0_wp) then
         call object(reading, quoted(reading%string(first:last))//' is too large; numbers are below 1e308')
      else if (.not. ok) then
         call object(reading, quoted(reading%string(first:last))//' is not a number')
      end if
      reading%at = last + 1
   end subroutine read_number

   !> Reads a name, or a function with its arguments.
   recursive subroutine read_name(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      character(:), allocatable :: name
      integer :: first, i
      first = place(reading)
      reading%at = first + span_of(reading%string(first:), letters//digits)
      name = reading%string(first:reading%at - 1)
      x = 0.0_wp
      if (next(reading) == '(') then
         call read_function(reading, name, x)
      else if (same_name(name, 'pi')) then
         x = pi
      else
         i = word_index(reading%known, name)
         if (i > 0) then
            x = reading%value(i)
         else if (is_reserved(name)) then
            call object(reading, 'an opening bracket is missing after '//quoted(name))
         else
            call object(reading, 'no parameter '''//quoted(name)//''' stands above'//guess(reading%known, name))
         end if
      end if
   end subroutine read_name

   !> Reads the arguments of a function, from the opening bracket, and applies it.
   recursive subroutine read_function(reading, name, x)
      type(reading_t), intent(inout) :: reading
      character(*), intent(in) :: name
      real(wp), intent(out) :: x
      real(wp) :: y
      integer :: i
      x = 0.0_wp
      if (same_name(name, 'pi') .or. .not. is_reserved(name)) then
         call object(reading, 'no function '''//quoted(name)//''''//guess(reserved, name))
         return
      end if
      call step(reading)
      call deeper(reading)
      call read_level(reading, 1, x)
      if (word_index('min|max', name) > 0) then
         do while (next(reading) == ',')
            call step(reading)
            call read_level(reading, 1, y)
            if (same_name(name, 'min')) x = min(x, y)
            if (same_name(name, 'max')) x = max(x, y)
         end do
      end if
      reading%depth = reading%depth - 1
      call close_bracket(reading)
      i = word_index(one_argument, name)
      if (reading%wrong == '' .and. i > 0) call apply(word_at(one_argument, i), x, reading%wrong)
   end subroutine read_function

   !> Position of the next character that is not blank. At the end of the text, and after an error, it is the position behind the
   !> text, so that every loop ends.
   integer function place(reading)
      type(reading_t), intent(in) :: reading
      place = 0
      if (reading%wrong == '') place = verify(reading%string(reading%at:), blanks)
      place = merge(reading%at - 1 + place, len(reading%string) + 1, place > 0)
   end function place

   !> The next character that is not blank; at the end a blank.
   character(1) function next(reading)
      type(reading_t), intent(in) :: reading
      next = ''
      if (place(reading) <= len(reading%string)) next = reading%string(place(reading):place(reading))
   end function next

   !> Moves to the character after the next one.
   subroutine step(reading)
      type(reading_t), intent(inout) :: reading
      reading%at = place(reading) + 1
   end subroutine step

   !> Moves past a closing bracket, which must be the next character.
   subroutine close_bracket(reading)
      type(reading_t), intent(inout) :: reading
      if (next(reading) == '') call object(reading, 'a closing bracket is missing')
      if (next(reading) /= ')') call object(reading, 'unexpected '''//next(reading)//'''')
      call step(reading)
   end subroutine close_bracket

   !> Counts one more level of nesting.
   subroutine deeper(reading)
      type(reading_t), intent(inout) :: reading
      reading%depth = reading%depth + 1
      if (reading%depth > deepest) call object(reading, 'too many brackets inside each other')
   end subroutine deeper

   !> Stores an error, unless an error is stored already.
   subroutine object(reading, message)
      type(reading_t), intent(inout) :: reading
      character(*), intent(in) :: message
      if (reading%wrong == '') reading%wrong = message
   end subroutine object

   !> Replaces x by the sum, difference, product or quotient of x and y.
   pure subroutine combine(operator, x, y, wrong)
      character(1), intent(in) :: operator
      real(wp), intent(inout) :: x
      real(wp), intent(in) :: y
      character(:), allocatable, intent(inout) :: wrong
      if (operator == '*') then
         if (abs(y) > 1.0_wp .and. abs(x) > huge(x) / max(abs(y), 1.0_wp)) wrong = 'the product is too large'
         if (wrong == '') x = x * y
      else if (operator == '/') then
         if (abs(y) <= 0.0_wp) then
            wrong = 'division by zero'
         else if (abs(x) > huge(x) * min(abs(y), 1.0_wp)) then
            wrong = 'the quotient is too large'
         else
            x = x / y
         end if
      else
         if (abs(0.5_wp * x) + abs(0.5_wp * y) > 0.5_wp * huge(x)) wrong = 'the sum is too large'
         if (wrong == '') x = x + merge(-y, y, operator == '-')
      end if
   end subroutine combine

   !> Replaces x by the value of a function at x.
   pure subroutine apply(name, x, wrong)
      character(*), intent(in) :: name
      real(wp), intent(inout) :: x
      character(:), allocatable, intent(inout) :: wrong
      select case (name)
      case ('sqrt')
         if (x < 0.0_wp) wrong = 'sqrt of a negative number'
         x = sqrt(max(x, 0.0_wp))
      case ('sin')
         x = sin(x)
      case ('cos')
         x = cos(x)
      case ('tan')
         x = tan(x)
      case ('asin', 'acos')
         if (abs(x) > 1.0_wp) wrong = name//' of a number above 1 in size'
         x = max(-1.0_wp, min(x, 1.0_wp))
         if (name == 'asin') x = asin(x)
         if (name == 'acos') x = acos(x)
      case ('atan')
         x = atan(x)
      case ('exp')
         if (x >= log(huge(x))) wrong = 'exp of a number that is too large'
         if (wrong == '') x = exp(x)
      case ('log')
         if (x <= 0.0_wp) wrong = 'log of a number that is not positive'
         x = log(max(x, tiny(x)))
      case ('abs')
         x = abs(x)
      case ('radians')
         x = x * degree
      case ('degrees')
         if (abs(x) > huge(x) * degree) wrong = 'degrees of a number that is too large'
         if (wrong == '') x = x / degree
      end select
   end subroutine apply

   !> Replaces x by x**y.
   pure subroutine raise(x, y, wrong)
      real(wp), intent(inout) :: x
      real(wp), intent(in) :: y
      character(:), allocatable, intent(inout) :: wrong
      real(wp) :: size
      size = abs(x)
      if (abs(y) <= 0.0_wp) then
         x = 1.0_wp
      else if (size <= 0.0_wp) then
         if (y < 0.0_wp) wrong = 'division by zero'
      else if (x < 0.0_wp .and. abs(y - anint(y)) > 0.0_wp) then
         wrong = 'a power of a negative number that is not whole'
      else if (too_large(log(size), y)) then
         wrong = 'the power is too large'
      else if (x < 0.0_wp .and. modulo(abs(y), 2.0_wp) > 0.5_wp) then
         x = -size**y
      else
         x = size**y
      end if
   end subroutine raise

   !> True if exp(a b) overflows. (The product a b itself may overflow, with either sign.)
   pure logical function too_large(a, b)
      real(wp), intent(in) :: a, b
      too_large = (a > 0.0_wp .eqv. b > 0.0_wp) .and. abs(a) > 0.0_wp
      if (.not. too_large) return
      if (abs(b) > 1.0_wp) then
         too_large = abs(a) >= log(huge(a)) / abs(b)
      else
         too_large = abs(a) * abs(b) >= log(huge(a))
      end if
   end function too_large

   !> True for a letter or underscore that is followed by letters, digits and underscores.
   pure logical function is_plain_name(string)
      character(*), intent(in) :: string
      is_plain_name = len(string) > 0 .and. verify(string, letters//digits) == 0
      if (is_plain_name) is_plain_name = scan(string(1:1), letters) == 1
   end function is_plain_name

   !> True for names that have a meaning in every formula: pi and the functions.
   pure logical function is_reserved(string)
      character(*), intent(in) :: string
      is_reserved = word_index(reserved, string) > 0
   end function is_reserved

   !> Number of leading characters of a text that belong to a set.
   pure integer function span_of(string, set)
      character(*), intent(in) :: string !! the text
      character(*), intent(in) :: set    !! the characters of the set
      span_of = verify(string, set) - 1
      if (span_of < 0) span_of = len(string)
   end function span_of

   !> Suggestion "; did you mean X?", or ''.
   pure function guess(words, typed) result(string)
      character(*), intent(in) :: words, typed
      character(:), allocatable :: string
      string = nearest_word(words, typed)
      if (string /= '') string = '; did you mean '//string//'?'
   end function guess
end module formula
