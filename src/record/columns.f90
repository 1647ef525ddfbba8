!> Numbers as text for tables. The text is as wide as necessary, so that no format overflows into asterisks.
module columns
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: wp
   use text, only: to_text
   implicit none
   private
   public :: significant, brief, pair, scientific, fixed, right, left

   real(wp), parameter :: smallest_fixed = 1.0e-4_wp, largest_fixed = 1.0e7_wp

contains

   !> A number with a given number of significant digits: 81.557428, 0.035869738. If it is very large or small, it has an exponent:
   !> 1.2345679E-09.
   pure function significant(x, digits) result(text)
      real(wp), intent(in) :: x
      integer, intent(in) :: digits               !! number of significant digits, 1 to 17
      character(:), allocatable :: text
      if (.not. ieee_is_finite(x)) then
         text = written(x, '(g0)')
      else if (abs(x) <= 0.0_wp) then
         text = fixed(0.0_wp, digits - 1)
      else if (abs(x) < smallest_fixed .or. abs(x) >= largest_fixed) then
         text = scientific(x, digits)
      else
         text = fixed(x, max(0, digits - 1 - floor(log10(abs(x)))))
      end if
   end function significant

   !> A number with at most six significant digits, without trailing zeros.
   pure function brief(x) result(text)
      real(wp), intent(in) :: x
      character(:), allocatable :: text
      integer :: mark, last
      text = significant(x, 6)
      if (index(text, '.') == 0) return
      mark = index(text, 'E')
      if (mark == 0) mark = len(text) + 1
      last = verify(text(:mark - 1), '0', back=.true.)
      if (text(last:last) == '.') last = last - 1
      text = text(:last)//text(mark:)
   end function brief

   !> Two numbers in parentheses: (0.5, -1).
   pure function pair(x) result(text)
      real(wp), intent(in) :: x(2)
      character(:), allocatable :: text
      text = '('//brief(x(1))//', '//brief(x(2))//')'
   end function pair

   !> A number with an exponent: 1.23E-09, 1.23E-109.
   pure function scientific(x, digits) result(text)
      real(wp), intent(in) :: x
      integer, intent(in) :: digits               !! number of significant digits, 1 to 17
      character(:), allocatable :: text
      integer :: mark
      if (.not. ieee_is_finite(x)) then
         text = written(x, '(g0)')
         return
      end if
      text = written(x, '(es40.'//to_text(digits - 1)//'e3)')
      mark = index(text, 'E')
      if (text(mark + 2:mark + 2) == '0') text = text(:mark + 1)//text(mark + 3:)
      if (text(mark - 1:mark - 1) == '.') text = text(:mark - 2)//text(mark:)
   end function scientific

   !> A number with a given number of decimals and no exponent (except beyond 15 digits before the point).
   pure function fixed(x, decimals) result(text)
      real(wp), intent(in) :: x
      integer, intent(in) :: decimals             !! number of decimals, 0 to 30
      character(:), allocatable :: text
      if (.not. ieee_is_finite(x)) then
         text = written(x, '(g0)')
      else if (abs(x) < 1.0e15_wp) then
         text = written(x, '(f60.'//to_text(decimals)//')')
      else
         text = scientific(x, 6)
      end if
      if (decimals == 0 .and. text(len(text):) == '.') text = text(:len(text) - 1)
   end function fixed

   pure function written(x, format) result(text)
      real(wp), intent(in) :: x
      character(*), intent(in) :: format
      character(:), allocatable :: text
      character(60) :: buffer
      write (buffer, format) x
      text = trim(adjustl(buffer))
   end function written

   !> Text aligned to the right end of a field; a longer text is not cut.
   pure function right(text, width) result(field)
      character(*), intent(in) :: text
      integer, intent(in) :: width
      character(:), allocatable :: field
      field = repeat(' ', max(0, width - len_trim(text)))//trim(text)
   end function right

   !> Text aligned to the left end of a field; a longer text is not cut.
   pure function left(text, width) result(field)
      character(*), intent(in) :: text
      integer, intent(in) :: width
      character(:), allocatable :: field
      field = trim(text)//repeat(' ', max(0, width - len_trim(text)))
   end function left
end module columns
