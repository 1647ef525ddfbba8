!> Interpolating quintic spline of one variable; four times continuously differentiable between its ends.
module quintic_spline
   use kinds, only: wp
   use ordered_knots, only: piece_at
   use lapack, only: dgbtrf, dgbtrs
   implicit none
   private
   public :: spline_derivatives, spline_value, hermite_coefficients
   public :: ends_straight, ends_odd, ends_meet

   ! Conditions at the ends:
   integer, parameter :: ends_straight = 1 !! second and third derivative are zero: the spline is continued by a straight line and
   !! is three times differentiable there
   integer, parameter :: ends_odd = 2 !! second and fourth derivative are zero: the continuation is point-symmetric about the end
   integer, parameter :: ends_meet = 3        !! periodic: the last knot is the first knot of the next period

contains

   !> Slopes and second derivatives at the knots for which third and fourth derivative are continuous.
   subroutine spline_derivatives(knot, value, ends, slope, bend)
      real(wp), intent(in) :: knot(:)         !! knots, increasing; 2 or more, for periodic splines 3 or more
      real(wp), intent(in) :: value(:, :)     !! (knots, functions) values; for periodic splines the last equals the first
      integer, intent(in) :: ends             !! condition at the ends, ends_...
      real(wp), intent(out) :: slope(:, :), bend(:, :) !! (knots, functions) first and second derivatives
      ! The unknowns are slope and second derivative (bend), knot by knot. In a periodic spline the knots are numbered from both
      ! ends alternately, so that the numbers of neighbours differ by at most two.
      integer, parameter :: widest = 5        ! number of diagonals of the matrix on either side of the main diagonal
      real(wp) :: matrix(3 * widest + 1, 2 * size(knot)), right(2 * size(knot), size(value, 2)), h(size(knot) - 1)
      integer :: pivot(2 * size(knot)), place(size(knot)), band, order, i, n, info
      n = size(knot)
      h = knot(2:) - knot(:n - 1)
      matrix = 0.0_wp
      right = 0.0_wp
      band = 3
      place = [(i, i=1, n)]
      if (ends == ends_meet) then
         band = widest
         place(:n - 1) = [(min(2 * i - 1, 2 * (n - i)), i=1, n - 1)]
         place(n) = place(1)
         call join(1, n - 1, 1)
      else
         order = merge(3, 4, ends == ends_straight)
         call put(row(1, 1), row(1, 2), 1.0_wp)
         call add_piece(row(1, 2), 1, order, 0.0_wp, h(1)**order)
         call add_piece(row(n, 1), n - 1, order, 1.0_wp, h(n - 1)**order)
         call put(row(n, 2), row(n, 2), 1.0_wp)
      end if
      do i = 2, n - 1
         call join(i, i - 1, i)
      end do
      n = 2 * maxval(place)
      call dgbtrf(n, n, band, band, matrix, size(matrix, 1), pivot, info)
      ! info is not tested: the spline is unique, so that no pivot is zero.
      call dgbtrs('N', n, band, band, size(right, 2), matrix, size(matrix, 1), pivot, right, size(right, 1), info)
      slope = right(2 * place - 1, :)
      bend = right(2 * place, :)

   contains

      !> Index of a knot's unknown or equation: `which` is 1 for the slope, 2 for the second derivative.
      pure integer function row(knot, which)
         integer, intent(in) :: knot, which
         row = 2 * place(knot) - 2 + which
      end function row

      !> Equations of a knot: third and fourth derivative are equal on both sides of it.
      subroutine join(knot, before, after)
         integer, intent(in) :: knot, before, after !! number of the knot; pieces before and after it
         integer :: order
         do order = 3, 4
            call add_piece(row(knot, order - 2), before, order, 1.0_wp, h(after)**order)
            call add_piece(row(knot, order - 2), after, order, 0.0_wp, -h(after)**order)
         end do
      end subroutine join

      !> Adds the derivative of a given order at an end of a piece, times a factor, to an equation.
      subroutine add_piece(equation, piece, order, at, factor)
         integer, intent(in) :: equation, piece, order
         real(wp), intent(in) :: at           !! 0: first end of the piece, 1: last end
         real(wp), intent(in) :: factor
         real(wp) :: unit(6), c(6)
         integer :: k
         do k = 1, 4
            unit = 0.0_wp
            unit(k + 1) = h(piece)**(2 - modulo(k, 2))
            c = hermite_coefficients(unit)
            call put(equation, row(piece + (k - 1) / 2, 2 - modulo(k, 2)), factor * derivative(c, order, at) / h(piece)**order)
         end do
         c = hermite_coefficients([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp])
         right(equation, :) = right(equation, :) - factor * derivative(c, order, at) / h(piece)**order * (value(piece + 1, :) - &
            & value(piece, :))
      end subroutine add_piece

      subroutine put(equation, column, term)
         integer, intent(in) :: equation, column
         real(wp), intent(in) :: term
         associate (a => matrix(2 * band + 1 + equation - column, column))
            a = a + term
         end associate
      end subroutine put
   end subroutine spline_derivatives

   !> Value and derivatives of a spline; beyond an end its last piece there is continued.
   pure subroutine spline_value(knot, value, slope, bend, s, w, dw, ddw, dddw)
      real(wp), intent(in) :: knot(:)            !! knots, increasing, 2 or more
      real(wp), intent(in) :: value(:)           !! values at the knots
      real(wp), intent(in) :: slope(:), bend(:)  !! derivatives at the knots, from spline_derivatives
      real(wp), intent(in) :: s                  !! argument at which the spline is evaluated
      real(wp), intent(out) :: w, dw, ddw, dddw  !! value and first three derivatives
      real(wp) :: h, t, c(6)
      integer :: left, right
      left = piece_at(knot, s)
      right = left + 1
      h = knot(right) - knot(left)
      c = hermite_coefficients([value(left), h * slope(left), h**2 * bend(left), h * slope(right), h**2 * bend(right), &
         & value(right) - value(left)])
      t = (s - knot(left)) / h
      w = c(1) + t * (c(2) + t * (c(3) + t * (c(4) + t * (c(5) + t * c(6)))))
      dw = (c(2) + t * (2 * c(3) + t * (3 * c(4) + t * (4 * c(5) + t * 5 * c(6))))) / h
      ddw = (2 * c(3) + t * (6 * c(4) + t * (12 * c(5) + t * 20 * c(6)))) / h**2
      dddw = (6 * c(4) + t * (24 * c(5) + t * 60 * c(6))) / h**3
   end subroutine spline_value

   !> Coefficients of the quintic on 0 to 1 by powers of its parameter. `data` has: value, slope and second derivative at the first
   !> end, slope and second derivative at the last end, last value minus first value.
   pure function hermite_coefficients(data) result(c)
      real(wp), intent(in) :: data(6)
      real(wp) :: c(6)
      associate (slope => data([2, 4]), bend => data([3, 5]), rise => data(6))
         c(1) = data(1)
         c(2) = slope(1)
         c(3) = 0.5_wp * bend(1)
         c(4) = 10 * rise - 6 * slope(1) - 4 * slope(2) - 1.5_wp * bend(1) + 0.5_wp * bend(2)
         c(5) = -15 * rise + 8 * slope(1) + 7 * slope(2) + 1.5_wp * bend(1) - bend(2)
         c(6) = 6 * rise - 3 * slope(1) - 3 * slope(2) - 0.5_wp * bend(1) + 0.5_wp * bend(2)
      end associate
   end function hermite_coefficients

   !> Third or fourth derivative of a quintic with respect to its parameter, at parameter `at`.
   pure real(wp) function derivative(c, order, at)
      real(wp), intent(in) :: c(6)
      integer, intent(in) :: order            !! order of the derivative, 3 or 4
      real(wp), intent(in) :: at
      if (order == 3) then
         derivative = 6 * c(4) + at * (24 * c(5) + at * 60 * c(6))
      else
         derivative = 24 * c(5) + at * 120 * c(6)
      end if
   end function derivative
end module quintic_spline
