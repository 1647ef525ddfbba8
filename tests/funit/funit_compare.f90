!> What the assertions of `funit` have in common: values of any rank as lists, their comparison, the text of a failure.
module funit_compare
   use, intrinsic :: iso_fortran_env, only: real64, int32, int64
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use funit_report, only: source_location, report_failure
   implicit none
   private
   public :: compare_reals, compare_integers, shapes_differ, element
   public :: r0, r1, r2, i0, i1, i2

   !> Values of any rank up to 2 as a list, with their shape; the scalar has an empty shape.
   type :: reals
      real(real64), allocatable :: value(:)
      integer, allocatable :: shape(:)
   end type reals

   type :: integers
      integer(int64), allocatable :: value(:)
      integer, allocatable :: shape(:)
   end type integers

contains

   !> Does "left relation right" hold? Never raises a floating-point exception.
   pure logical function holds(relation, left, right, tolerance)
      character(*), intent(in) :: relation
      real(real64), intent(in) :: left, right
      real(real64), intent(in) :: tolerance !! for '==' and '~'
      holds = .false.
      if (ieee_is_nan(left) .or. ieee_is_nan(right)) return
      select case (relation)
      case ('<')
         holds = left < right
      case ('<=')
         holds = left <= right
      case ('>')
         holds = left > right
      case ('>=')
         holds = left >= right
      case default
         if (ieee_is_nan(tolerance)) return
         holds = left <= right .and. left >= right
         if (holds .or. .not. (ieee_is_finite(left) .and. ieee_is_finite(right))) return
         if (relation == '~') then
            holds = abs(right - left) <= tolerance * abs(left)
         else
            holds = abs(right - left) <= tolerance
         end if
      end select
   end function holds

   subroutine compare_reals(relation, left, right, tolerance, message, location)
      character(*), intent(in) :: relation
      type(reals), intent(in) :: left, right
      real(real64), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      character(200) :: text
      character(:), allocatable :: where_it_is
      real(real64) :: l, bound
      integer :: k

      if (shapes_differ(left%shape, right%shape, message, location)) return
      bound = 0.0_real64
      if (present(tolerance)) bound = tolerance
      do k = 1, size(right%value)
         l = left%value(min(k, size(left%value)))
         if (relation == '~' .and. holds('==', 0.0_real64, l, 0.0_real64)) then
            call report_failure('a relative comparison with zero'//element(k, right%shape), message, location)
            return
         end if
         if (holds(relation, l, right%value(k), bound)) cycle
         where_it_is = element(k, right%shape)
         select case (relation)
         case ('==', '~')
            write (text, '(*(g0))') 'expected ', l, ' but got ', right%value(k), where_it_is, &
               & ', ', merge('relative', 'absolute', relation == '~'), ' tolerance ', bound
         case default
            write (text, '(*(g0))') 'expected ', l, ' ', relation, ' ', right%value(k), where_it_is
         end select
         call report_failure(trim(text), message, location)
         return
      end do
   end subroutine compare_reals

   subroutine compare_integers(relation, left, right, message, location)
      character(*), intent(in) :: relation
      type(integers), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      character(200) :: text
      integer(int64) :: l, r
      logical :: good
      integer :: k

      if (shapes_differ(left%shape, right%shape, message, location)) return
      do k = 1, size(right%value)
         l = left%value(min(k, size(left%value)))
         r = right%value(k)
         select case (relation)
         case ('<')
            good = l < r
         case ('<=')
            good = l <= r
         case ('>')
            good = l > r
         case ('>=')
            good = l >= r
         case default
            good = l == r
         end select
         if (good) cycle
         if (relation == '==') then
            write (text, '(*(g0))') 'expected ', l, ' but got ', r, element(k, right%shape)
         else
            write (text, '(*(g0))') 'expected ', l, ' ', relation, ' ', r, element(k, right%shape)
         end if
         call report_failure(trim(text), message, location)
         return
      end do
   end subroutine compare_integers

   !> A scalar on the left goes with every shape on the right.
   logical function shapes_differ(left, right, message, location)
      integer, intent(in) :: left(:), right(:)
      character(*), intent(in), optional :: message
      type(source_location), intent(in), optional :: location
      shapes_differ = .false.
      if (size(left) == 0) return
      shapes_differ = any(left /= right)
      if (shapes_differ) call report_failure('expected shape '//list(left)//' but got '//list(right), message, location)
   end function shapes_differ

   !> ' at element (i,j)' of the k-th value of an array; nothing for a scalar.
   pure function element(k, shape) result(text)
      integer, intent(in) :: k, shape(:)
      character(:), allocatable :: text
      select case (size(shape))
      case (0)
         text = ''
      case (1)
         text = ' at element '//list([k])
      case default
         text = ' at element '//list([mod(k - 1, shape(1)) + 1, (k - 1) / shape(1) + 1])
      end select
   end function element

   pure function list(numbers) result(text)
      integer, intent(in) :: numbers(:)
      character(:), allocatable :: text
      character(60) :: buffer
      write (buffer, '("(",*(i0,:,","))') numbers
      text = trim(buffer)//')'
   end function list

   ! ---- values of every rank as lists ----

   pure type(reals) function r0(x)
      real(real64), intent(in) :: x
      allocate (r0%value, source=[x])
      allocate (r0%shape, source=[integer ::])
   end function r0

   pure type(reals) function r1(x)
      real(real64), intent(in) :: x(:)
      allocate (r1%value, source=x)
      allocate (r1%shape, source=shape(x))
   end function r1

   pure type(reals) function r2(x)
      real(real64), intent(in) :: x(:, :)
      allocate (r2%value, source=reshape(x, [size(x)]))
      allocate (r2%shape, source=shape(x))
   end function r2

   pure type(integers) function i0(n)
      integer(int64), intent(in) :: n
      allocate (i0%value, source=[n])
      allocate (i0%shape, source=[integer ::])
   end function i0

   pure type(integers) function i1(n)
      integer(int32), intent(in) :: n(:)
      allocate (i1%value, source=int(n, int64))
      allocate (i1%shape, source=shape(n))
   end function i1

   pure type(integers) function i2(n)
      integer(int32), intent(in) :: n(:, :)
      allocate (i2%value, source=int(reshape(n, [size(n)]), int64))
      allocate (i2%shape, source=shape(n))
   end function i2
end module funit_compare
