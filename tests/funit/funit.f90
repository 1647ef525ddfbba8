!> The assertions of the unit tests: the small part of pFUnit's `funit` that the .pf files of this project use.
!>
!> In a .pf file an assertion is written `@assertEqual(expected, actual, tolerance=..., message=...)`; pf2f90.py
!> turns it into a call, adds `location`, and lets the test return when it failed.
!> A NaN and a wrong shape always fail. Tolerances are absolute, except in assertRelativelyEqual.
!> Relations read from left to right: assertLessThan(a, b) asks for a < b.
module funit
   use, intrinsic :: iso_fortran_env, only: real64, int32, int64
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use funit_compare, only: compare_reals, compare_integers, shapes_differ, element, r0, r1, r2, i0, i1, i2
   use funit_report, only: source_location, funit_failed, report_failure
   implicit none
   private
   public :: assertEqual, assertRelativelyEqual, assertTrue, assertFalse, assertIsFinite
   public :: assertLessThan, assertLessThanOrEqual, assertGreaterThan, assertGreaterThanOrEqual
   public :: source_location, funit_failed

   interface assertEqual
      module procedure equal_real_00, equal_real_01, equal_real_11, equal_real_02, equal_real_22
      module procedure equal_integer_00, equal_integer_01, equal_integer_11, equal_integer_02, equal_integer_22
      module procedure equal_long_00, equal_mixed_00
      module procedure equal_character, equal_logical_0, equal_logical_1
   end interface assertEqual

   interface assertRelativelyEqual
      module procedure relative_00, relative_01, relative_11, relative_02, relative_22
   end interface assertRelativelyEqual

   interface assertTrue
      module procedure true_0, true_1
   end interface assertTrue

   interface assertFalse
      module procedure false_0, false_1
   end interface assertFalse

   interface assertLessThan
      module procedure less_real_00, less_real_01, less_real_11, less_integer
   end interface assertLessThan

   interface assertLessThanOrEqual
      module procedure less_equal_real_00, less_equal_real_01, less_equal_real_11, less_equal_integer
   end interface assertLessThanOrEqual

   interface assertGreaterThan
      module procedure greater_real_00, greater_real_01, greater_real_11, greater_integer
   end interface assertGreaterThan

   interface assertGreaterThanOrEqual
      module procedure greater_equal_real_00, greater_equal_real_01, greater_equal_real_11, greater_equal_integer
   end interface assertGreaterThanOrEqual

contains

   ! ---- assertEqual; the digits in the names are the ranks of expected and actual ----

   subroutine equal_real_00(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual
      real(real64), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('==', r0(expected), r0(actual), tolerance, message, location)
   end subroutine equal_real_00

   subroutine equal_real_01(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual(:)
      real(real64), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('==', r0(expected), r1(actual), tolerance, message, location)
   end subroutine equal_real_01

   subroutine equal_real_11(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:), actual(:)
      real(real64), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('==', r1(expected), r1(actual), tolerance, message, location)
   end subroutine equal_real_11

   subroutine equal_real_02(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual(:, :)
      real(real64), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('==', r0(expected), r2(actual), tolerance, message, location)
   end subroutine equal_real_02

   subroutine equal_real_22(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:, :), actual(:, :)
      real(real64), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('==', r2(expected), r2(actual), tolerance, message, location)
   end subroutine equal_real_22

   subroutine equal_integer_00(expected, actual, message, location)
      integer(int32), intent(in) :: expected, actual
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i0(int(expected, int64)), i0(int(actual, int64)), message, location)
   end subroutine equal_integer_00

   subroutine equal_integer_01(expected, actual, message, location)
      integer(int32), intent(in) :: expected, actual(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i0(int(expected, int64)), i1(actual), message, location)
   end subroutine equal_integer_01

   subroutine equal_integer_11(expected, actual, message, location)
      integer(int32), intent(in) :: expected(:), actual(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i1(expected), i1(actual), message, location)
   end subroutine equal_integer_11

   subroutine equal_integer_02(expected, actual, message, location)
      integer(int32), intent(in) :: expected, actual(:, :)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i0(int(expected, int64)), i2(actual), message, location)
   end subroutine equal_integer_02

   subroutine equal_integer_22(expected, actual, message, location)
      integer(int32), intent(in) :: expected(:, :), actual(:, :)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i2(expected), i2(actual), message, location)
   end subroutine equal_integer_22

   subroutine equal_long_00(expected, actual, message, location)
      integer(int64), intent(in) :: expected, actual
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i0(expected), i0(actual), message, location)
   end subroutine equal_long_00

   subroutine equal_mixed_00(expected, actual, message, location)
      integer(int32), intent(in) :: expected
      integer(int64), intent(in) :: actual
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('==', i0(int(expected, int64)), i0(actual), message, location)
   end subroutine equal_mixed_00

   ! ---- assertRelativelyEqual: |actual - expected| <= tolerance |expected|, expected not zero ----

   subroutine relative_00(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual
      real(real64), intent(in) :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('~', r0(expected), r0(actual), tolerance, message, location)
   end subroutine relative_00

   subroutine relative_01(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual(:)
      real(real64), intent(in) :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('~', r0(expected), r1(actual), tolerance, message, location)
   end subroutine relative_01

   subroutine relative_11(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:), actual(:)
      real(real64), intent(in) :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('~', r1(expected), r1(actual), tolerance, message, location)
   end subroutine relative_11

   subroutine relative_02(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual(:, :)
      real(real64), intent(in) :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('~', r0(expected), r2(actual), tolerance, message, location)
   end subroutine relative_02

   subroutine relative_22(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:, :), actual(:, :)
      real(real64), intent(in) :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('~', r2(expected), r2(actual), tolerance, message, location)
   end subroutine relative_22

   ! ---- order relations ----

   subroutine less_real_00(left, right, message, location)
      real(real64), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('<', r0(left), r0(right), message=message, location=location)
   end subroutine less_real_00

   subroutine less_real_01(left, right, message, location)
      real(real64), intent(in) :: left, right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('<', r0(left), r1(right), message=message, location=location)
   end subroutine less_real_01

   subroutine less_real_11(left, right, message, location)
      real(real64), intent(in) :: left(:), right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('<', r1(left), r1(right), message=message, location=location)
   end subroutine less_real_11

   subroutine less_integer(left, right, message, location)
      integer(int32), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('<', i0(int(left, int64)), i0(int(right, int64)), message, location)
   end subroutine less_integer

   subroutine less_equal_real_00(left, right, message, location)
      real(real64), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('<=', r0(left), r0(right), message=message, location=location)
   end subroutine less_equal_real_00

   subroutine less_equal_real_01(left, right, message, location)
      real(real64), intent(in) :: left, right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('<=', r0(left), r1(right), message=message, location=location)
   end subroutine less_equal_real_01

   subroutine less_equal_real_11(left, right, message, location)
      real(real64), intent(in) :: left(:), right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('<=', r1(left), r1(right), message=message, location=location)
   end subroutine less_equal_real_11

   subroutine less_equal_integer(left, right, message, location)
      integer(int32), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('<=', i0(int(left, int64)), i0(int(right, int64)), message, location)
   end subroutine less_equal_integer

   subroutine greater_real_00(left, right, message, location)
      real(real64), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('>', r0(left), r0(right), message=message, location=location)
   end subroutine greater_real_00

   subroutine greater_real_01(left, right, message, location)
      real(real64), intent(in) :: left, right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('>', r0(left), r1(right), message=message, location=location)
   end subroutine greater_real_01

   subroutine greater_real_11(left, right, message, location)
      real(real64), intent(in) :: left(:), right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('>', r1(left), r1(right), message=message, location=location)
   end subroutine greater_real_11

   subroutine greater_integer(left, right, message, location)
      integer(int32), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('>', i0(int(left, int64)), i0(int(right, int64)), message, location)
   end subroutine greater_integer

   subroutine greater_equal_real_00(left, right, message, location)
      real(real64), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('>=', r0(left), r0(right), message=message, location=location)
   end subroutine greater_equal_real_00

   subroutine greater_equal_real_01(left, right, message, location)
      real(real64), intent(in) :: left, right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('>=', r0(left), r1(right), message=message, location=location)
   end subroutine greater_equal_real_01

   subroutine greater_equal_real_11(left, right, message, location)
      real(real64), intent(in) :: left(:), right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_reals('>=', r1(left), r1(right), message=message, location=location)
   end subroutine greater_equal_real_11

   subroutine greater_equal_integer(left, right, message, location)
      integer(int32), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call compare_integers('>=', i0(int(left, int64)), i0(int(right, int64)), message, location)
   end subroutine greater_equal_integer

   ! ---- words and logicals ----

   !> Blanks and tabs at both ends do not count, as in pFUnit.
   subroutine equal_character(expected, actual, message, location)
      character(*), intent(in) :: expected, actual
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      character(:), allocatable :: e, a
      e = bare(expected)
      a = bare(actual)
      if (len(e) == len(a) .and. e == a) return
      call report_failure('expected "'//e//'" but got "'//a//'"', message, location)
   end subroutine equal_character

   pure function bare(text)
      character(*), intent(in) :: text
      character(:), allocatable :: bare
      character(2), parameter :: white = ' '//achar(9)
      bare = text(max(1, verify(text, white)):verify(text, white, back=.true.))
   end function bare

   subroutine equal_logical_0(expected, actual, message, location)
      logical, intent(in) :: expected, actual
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call equal_logical_1([expected], [actual], message, location)
   end subroutine equal_logical_0

   subroutine equal_logical_1(expected, actual, message, location)
      logical, intent(in) :: expected(:), actual(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      integer :: k
      character(60) :: text
      if (shapes_differ(shape(expected), shape(actual), message, location)) return
      do k = 1, size(expected)
         if (expected(k) .eqv. actual(k)) cycle
         write (text, '(a,l1,a,l1,a)') 'expected ', expected(k), ' but got ', actual(k), element(k, shape(actual))
         call report_failure(trim(text), message, location)
         return
      end do
   end subroutine equal_logical_1

   subroutine true_0(condition, message, location)
      logical, intent(in) :: condition
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      if (.not. condition) call report_failure('expected true but got false', message, location)
   end subroutine true_0

   subroutine true_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call equal_logical_1(spread(.true., 1, size(condition)), condition, message, location)
   end subroutine true_1

   subroutine false_0(condition, message, location)
      logical, intent(in) :: condition
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      if (condition) call report_failure('expected false but got true', message, location)
   end subroutine false_0

   subroutine false_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      call equal_logical_1(spread(.false., 1, size(condition)), condition, message, location)
   end subroutine false_1

   subroutine assertIsFinite(x, message, location)
      real(real64), intent(in) :: x
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      character(60) :: text
      if (ieee_is_finite(x)) return
      write (text, '(a,g0)') 'expected a finite number but got ', x
      call report_failure(trim(text), message, location)
   end subroutine assertIsFinite
end module funit
