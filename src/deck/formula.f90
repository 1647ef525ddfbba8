!> Evaluates a formula in a deck, such as 2*pi*EI/L**2.
!>
!> Numbers, names, + - * / **, brackets and functions, with the precedence of Fortran: ** first, from the right, then signs, then *
!> and /, then + and -, from the left. All numbers are real. A result that is not finite is an error.
module formula
   use kinds, only: wp, pi, degree
   use printable_text, only: quoted
   use text, only: parse_real, same_name, is_blank, nearest_word, word_index, word_at
   implicit none
   private
   public :: evaluate, is_plain_name, is_reserved

   character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_', digits = '0123456789'
   character(*), parameter :: one_argument = 'sqrt|sin|cos|tan|asin|acos|atan|exp|log|abs|radians|degrees'
   character(*), parameter :: reserved = one_argument//'|min|max|pi'
   integer, parameter :: deepest = 100 !! largest depth of nested brackets, signs and powers

   !> A formula that is being read.
   type :: reading_t
      character(:), allocatable :: text
      integer :: at = 1, depth = 0
      character(:), allocatable :: known    !! names between bars
      real(wp), allocatable :: value(:)     !! values of the known names
      character(:), allocatable :: wrong    !! first error; '' if there is none
   end type reading_t

contains

   !> Evaluates a formula.
   pure subroutine evaluate(string, known, value, result, wrong)
      character(*), intent(in) :: string                 !! the formula
      character(*), intent(in) :: known                  !! permitted names, between bars; case is ignored
      real(wp), intent(in) :: value(:)                   !! values of the known names
      real(wp), intent(out) :: result                    !! finite; 0 after an error
      character(:), allocatable, intent(out) :: wrong    !! description of the error, in words; '' if there is none
      type(reading_t) :: reading
      reading%text = string
      reading%known = known
      reading%value = value
      reading%wrong = ''
      call read_sum(reading, result)
      if (next(reading) /= '') call object(reading, 'unexpected '''//next(reading)//'''')
      wrong = reading%wrong
      if (wrong /= '') result = 0.0_wp
   end subroutine evaluate

   !> True for a letter or underscore, then letters, digits and underscores.
   pure logical function is_plain_name(string)
      character(*), intent(in) :: string
      is_plain_name = len(string) > 0 .and. verify(string, letters//digits) == 0
      if (is_plain_name) is_plain_name = scan(string(1:1), letters) == 1
   end function is_plain_name

   !> True for names with a meaning in every formula: pi and the functions.
   pure logical function is_reserved(string)
      character(*), intent(in) :: string
      is_reserved = word_index(reserved, string) > 0
   end function is_reserved

   pure recursive subroutine read_sum(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      real(wp) :: y
      character(1) :: sign
      call read_product(reading, x)
      do while (scan(next(reading), '+-') == 1)
         sign = next(reading)
         call step(reading)
         call read_product(reading, y)
         if (reading%wrong /= '') return
         if (sign == '-') y = -y
         if (0.5_wp * abs(x) + 0.5_wp * abs(y) > 0.5_wp * huge(x)) then
            call object(reading, 'the sum is too large')
         else
            x = x + y
         end if
      end do
   end subroutine read_sum

   pure recursive subroutine read_product(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      real(wp) :: y
      logical :: over
      call read_signed(reading, x)
      do while (scan(next(reading), '*/') == 1)
         over = next(reading) == '/'
         call step(reading)
         call read_signed(reading, y)
         if (reading%wrong /= '') return
         if (over) then
            call divide(reading, x, y)
         else if (abs(y) > 1.0_wp .and. abs(x) > huge(x) / max(abs(y), 1.0_wp)) then
            call object(reading, 'the product is too large')
         else
            x = x * y
         end if
      end do
   end subroutine read_product

   pure recursive subroutine read_signed(reading, x)
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

   pure recursive subroutine read_power(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      real(wp) :: y
      call read_operand(reading, x)
      if (next(reading) /= '*') return
      if (index(reading%text(place(reading):), '**') /= 1) return
      call step(reading)
      call step(reading)
      call deeper(reading)
      call read_signed(reading, y)
      reading%depth = reading%depth - 1
      if (reading%wrong == '') call raise(reading, x, y)
   end subroutine read_power

   !> Reads a number, a name, a function or a sum in brackets.
   pure recursive subroutine read_operand(reading, x)
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
         call read_sum(reading, x)
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

   pure subroutine read_number(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      integer :: first, last
      logical :: ok
      first = place(reading)
      last = first + span_of(reading%text(first:), digits//'.') - 1
      ! 1e-3: an exponent belongs to the number, with its sign.
      if (last < len(reading%text)) then
         if (scan(reading%text(last + 1:last + 1), 'eEdD') == 1) then
            last = last + 1
            if (last < len(reading%text)) then
               if (scan(reading%text(last + 1:last + 1), '+-') == 1) last = last + 1
            end if
            last = last + span_of(reading%text(last + 1:), digits)
         end if
      end if
      call parse_real(reading%text(first:last), x, ok)
      if (.not. ok .and. x > 0.0_wp) then
         call object(reading, quoted(reading%text(first:last))//' is too large; numbers are below 1e308')
      else if (.not. ok) then
         call object(reading, quoted(reading%text(first:last))//' is not a number')
      end if
      reading%at = last + 1
   end subroutine read_number

   pure recursive subroutine read_name(reading, x)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(out) :: x
      character(:), allocatable :: name
      integer :: first, i
      first = place(reading)
      reading%at = first + span_of(reading%text(first:), letters//digits)
      name = reading%text(first:reading%at - 1)
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

   pure recursive subroutine read_function(reading, name, x)
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
      call read_sum(reading, x)
      if (word_index('min|max', name) > 0) then
         do while (next(reading) == ',')
            call step(reading)
            call read_sum(reading, y)
            if (same_name(name, 'min')) x = min(x, y)
            if (same_name(name, 'max')) x = max(x, y)
         end do
      end if
      reading%depth = reading%depth - 1
      call close_bracket(reading)
      i = word_index(one_argument, name)
      if (reading%wrong == '' .and. i > 0) call apply(reading, word_at(one_argument, i), x)
   end subroutine read_function

   !> Replaces x by the value of a function at x.
   pure subroutine apply(reading, name, x)
      type(reading_t), intent(inout) :: reading
      character(*), intent(in) :: name
      real(wp), intent(inout) :: x
      select case (name)
      case ('sqrt')
         if (x < 0.0_wp) call object(reading, 'sqrt of a negative number')
         x = sqrt(max(x, 0.0_wp))
      case ('sin')
         x = sin(x)
      case ('cos')
         x = cos(x)
      case ('tan')
         x = tan(x)
      case ('asin', 'acos')
         if (abs(x) > 1.0_wp) call object(reading, name//' of a number above 1 in size')
         x = max(-1.0_wp, min(x, 1.0_wp))
         if (name == 'asin') x = asin(x)
         if (name == 'acos') x = acos(x)
      case ('atan')
         x = atan(x)
      case ('exp')
         if (x >= log(huge(x))) call object(reading, 'exp of a number that is too large')
         if (reading%wrong == '') x = exp(x)
      case ('log')
         if (x <= 0.0_wp) call object(reading, 'log of a number that is not positive')
         x = log(max(x, tiny(x)))
      case ('abs')
         x = abs(x)
      case ('radians')
         x = x * degree
      case ('degrees')
         if (abs(x) > huge(x) * degree) call object(reading, 'degrees of a number that is too large')
         if (reading%wrong == '') x = x / degree
      end select
   end subroutine apply

   !> Replaces x by x/y.
   pure subroutine divide(reading, x, y)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(inout) :: x
      real(wp), intent(in) :: y
      if (abs(y) <= 0.0_wp) then
         call object(reading, 'division by zero')
      else if (abs(x) > huge(x) * min(abs(y), 1.0_wp)) then
         call object(reading, 'the quotient is too large')
      else
         x = x / y
      end if
   end subroutine divide

   !> Replaces x by x**y.
   pure subroutine raise(reading, x, y)
      type(reading_t), intent(inout) :: reading
      real(wp), intent(inout) :: x
      real(wp), intent(in) :: y
      real(wp) :: size
      size = abs(x)
      if (abs(y) <= 0.0_wp) then
         x = 1.0_wp
      else if (size <= 0.0_wp) then
         if (y < 0.0_wp) call object(reading, 'division by zero')
      else if (x < 0.0_wp .and. abs(y - anint(y)) > 0.0_wp) then
         call object(reading, 'a power of a negative number that is not whole')
      else if (too_large(log(size), y)) then
         call object(reading, 'the power is too large')
      else if (x < 0.0_wp .and. modulo(abs(y), 2.0_wp) > 0.5_wp) then
         x = -size**y
      else
         x = size**y
      end if

   contains

      !> True if exp(a b) overflows. The product itself may overflow in either direction.
      pure logical function too_large(a, b)
         real(wp), intent(in) :: a, b
         too_large = (a > 0.0_wp .eqv. b > 0.0_wp) .and. abs(a) > 0.0_wp
         if (.not. too_large) return
         if (abs(b) > 1.0_wp) then
            too_large = abs(a) >= log(huge(x)) / abs(b)
         else
            too_large = abs(a) * abs(b) >= log(huge(x))
         end if
      end function too_large
   end subroutine raise

   !> Position of the next character that is not blank; behind the text at its end and after an error, so that every loop ends.
   pure integer function place(reading)
      type(reading_t), intent(in) :: reading
      do place = reading%at, len(reading%text)
         if (reading%wrong /= '') exit
         if (.not. is_blank(reading%text(place:place))) return
      end do
      place = len(reading%text) + 1
   end function place

   !> The next character that is not blank; a blank at the end.
   pure character(1) function next(reading)
      type(reading_t), intent(in) :: reading
      next = ''
      if (place(reading) <= len(reading%text)) next = reading%text(place(reading):place(reading))
   end function next

   !> Moves behind the next character.
   pure subroutine step(reading)
      type(reading_t), intent(inout) :: reading
      reading%at = place(reading) + 1
   end subroutine step

   !> Moves behind a closing bracket, which must be the next character.
   pure subroutine close_bracket(reading)
      type(reading_t), intent(inout) :: reading
      if (next(reading) == '') call object(reading, 'a closing bracket is missing')
      if (next(reading) /= ')') call object(reading, 'unexpected '''//next(reading)//'''')
      call step(reading)
   end subroutine close_bracket

   !> Counts one more level of nesting.
   pure subroutine deeper(reading)
      type(reading_t), intent(inout) :: reading
      reading%depth = reading%depth + 1
      if (reading%depth > deepest) call object(reading, 'too many brackets inside each other')
   end subroutine deeper

   !> Stores an error, unless there was one before.
   pure subroutine object(reading, wrong)
      type(reading_t), intent(inout) :: reading
      character(*), intent(in) :: wrong
      if (reading%wrong == '') reading%wrong = wrong
   end subroutine object

   !> Number of leading characters of a text that belong to a set.
   pure integer function span_of(string, set)
      character(*), intent(in) :: string, set
      span_of = verify(string, set) - 1
      if (span_of < 0) span_of = len(string)
   end function span_of

   !> "; did you mean X?", or ''.
   pure function guess(words, typed) result(string)
      character(*), intent(in) :: words, typed
      character(:), allocatable :: string
      string = nearest_word(words, typed)
      if (string /= '') string = '; did you mean '//string//'?'
   end function guess
end module formula
