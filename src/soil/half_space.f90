!> Settlement of an elastic half-space under uniformly loaded rectangles (Boussinesq; A. E. H. Love, Phil. Trans. R. Soc. A 228,
!> 1929), averaged over a rectangle.
!>
!> The rectangles form one row and have the width of the row. The settlement is the mean over the rectangle that settles. The
!> compliance is therefore twice the energy of the ground over the square of the force: symmetric for any lengths, and positive
!> definite if no two rectangles overlap. The settlement of the rectangle's centre would be neither.
module half_space
   use kinds, only: wp, pi
   implicit none
   private
   public :: rectangle_compliance

   real(wp), parameter :: far = 20.0_wp !! distance, over the length of the longer rectangle, beyond which differences of the closed
   !! formula cancel

   ! Gauss points and weights on (0, 1), used beyond this distance; the relative error is 1e-12 there:
   real(wp), parameter :: point(3) = [0.5_wp - sqrt(0.15_wp), 0.5_wp, 0.5_wp + sqrt(0.15_wp)]
   real(wp), parameter :: weight(3) = [5.0_wp, 8.0_wp, 5.0_wp] / 18.0_wp

contains

   !> Mean settlement of the rectangle `there` under a unit force that is distributed evenly over the rectangle `here`.
   pure real(wp) function rectangle_compliance(there, here, width, young, poisson) result(compliance)
      real(wp), intent(in) :: there(2), here(2) !! beginning and end along the row [length]
      real(wp), intent(in) :: width             !! width of the row [length]
      real(wp), intent(in) :: young, poisson    !! Young's modulus and Poisson's ratio of the ground
      real(wp) :: lengths(2), sum_
      integer :: i, j
      lengths = [there(2) - there(1), here(2) - here(1)]
      if (0.5_wp * abs(sum(there) - sum(here)) > far * maxval(lengths)) then
         sum_ = 0.0_wp
         do j = 1, 3
            do i = 1, 3
               sum_ = sum_ + weight(i) * weight(j) * &
                  & across(there(1) + point(i) * lengths(1) - here(1) - point(j) * lengths(2), width)
            end do
         end do
      else
         sum_ = twice_integrated(there(2) - here(1), width) - twice_integrated(there(2) - here(2), width) &
            & - twice_integrated(there(1) - here(1), width) + twice_integrated(there(1) - here(2), width)
         sum_ = sum_ / lengths(1) / lengths(2)
      end if
      compliance = (1.0_wp - poisson**2) / (pi * young) * sum_ / width**2
   end function rectangle_compliance

   !> Integral of 1/distance over both widths of the row, for the distance x along the row.
   pure real(wp) function across(x, width)
      real(wp), intent(in) :: x, width
      across = 2.0_wp * (width * asinh(width / abs(x)) - width**2 / (hypot(x, width) + abs(x)))
   end function across

   !> The function `across`, integrated twice along the row.
   pure real(wp) function twice_integrated(x, width) result(integral)
      real(wp), intent(in) :: x, width
      real(wp) :: a, b, s, cubes
      a = abs(x)
      b = width
      integral = 0.0_wp
      if (.not. a > 0.0_wp) return
      s = hypot(a, b)
      ! cubes = s^3 - a^3 - b^3 with s = sqrt(a^2 + b^2), in a form in which the largest terms do not cancel.
      if (a < b) then
         cubes = a**2 * (s**2 + s * b + b**2) / (s + b) - a**3
      else
         cubes = b**2 * (s**2 + s * a + a**2) / (s + a) - b**3
      end if
      integral = b * a**2 * asinh(b / a) + b**2 * a * asinh(a / b) - cubes / 3.0_wp
   end function twice_integrated
end module half_space
