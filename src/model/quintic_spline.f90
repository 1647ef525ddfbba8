!> Interpolating quintic spline of one variable: four times continuously differentiable between its ends, at which second and third
!> derivative vanish, so that it goes on straight beyond them three times continuously differentiable.
module quintic_spline
   use kinds, only: wp
   use lapack, only: dgbtrf, dgbtrs
   implicit none
   private
   public :: spline_derivatives, hermite_coefficients

   integer, parameter :: band = 3             !! diagonals beside the main one, on either side

contains

   !> Slope and second derivative at the knots: those with which third and fourth derivative are continuous.
   subroutine spline_derivatives(knot, value, slope, bend)
      real(wp), intent(in) :: knot(:)         !! increasing; 2 or more
      real(wp), intent(in) :: value(:, :)     !! (knots, functions)
      real(wp), intent(out) :: slope(:, :), bend(:, :) !! likewise
      ! Unknowns are, over the lengths h of the pieces, slope 1, bend 1, slope 2, bend 2 ...; a row for each.
      real(wp) :: matrix(3 * band + 1, 2 * size(knot)), right(2 * size(knot), size(value, 2))
      real(wp) :: h(size(knot) - 1)
      integer :: pivot(2 * size(knot)), i, order, row, n, info
      n = size(knot)
      h = knot(2:) - knot(:n - 1)
      matrix = 0.0_wp
      right = 0.0_wp
      call put(1, 2, 1.0_wp)
      call add_piece(2, 1, 3, 0.0_wp, h(1)**3)
      row = 2
      do i = 2, n - 1
         do order = 3, 4
            row = row + 1
            call add_piece(row, i - 1, order, 1.0_wp, h(i)**order)
            call add_piece(row, i, order, 0.0_wp, -h(i)**order)
         end do
      end do
      call add_piece(2 * n - 1, n - 1, 3, 1.0_wp, h(n - 1)**3)
      call put(2 * n, 2 * n, 1.0_wp)
      call dgbtrf(2 * n, 2 * n, band, band, matrix, size(matrix, 1), pivot, info)
      ! info: the spline is unique, so no pivot vanishes.
      call dgbtrs('N', 2 * n, band, band, size(right, 2), matrix, size(matrix, 1), pivot, right, 2 * n, info)
      slope = right(1::2, :)
      bend = right(2::2, :)

   contains

      !> Adds a derivative at an end of a piece, times a factor, to an equation.
      subroutine add_piece(row, piece, order, at, factor)
         integer, intent(in) :: row, piece, order
         real(wp), intent(in) :: at           !! 0 or 1: its first or last end
         real(wp), intent(in) :: factor
         real(wp) :: unit(6), c(6)
         integer :: k
         do k = 1, 4
            unit = 0.0_wp
            unit(k + 1) = h(piece)**(2 - modulo(k, 2))
            c = hermite_coefficients(unit)
            call put(row, 2 * piece - 2 + k, factor * derivative(c, order, at) / h(piece)**order)
         end do
         c = hermite_coefficients([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp])
         right(row, :) = right(row, :) - factor * derivative(c, order, at) / h(piece)**order * (value(piece + 1, :) - &
            & value(piece, :))
      end subroutine add_piece

      subroutine put(row, column, term)
         integer, intent(in) :: row, column
         real(wp), intent(in) :: term
         associate (a => matrix(2 * band + 1 + row - column, column))
            a = a + term
         end associate
      end subroutine put
   end subroutine spline_derivatives

   !> The quintic on 0 to 1 by powers of its parameter, from its first value, slope and second derivative at its first end, both
   !> at its last, and by how much it rises.
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

   !> Third or fourth derivative of a quintic by its parameter.
   pure real(wp) function derivative(c, order, at)
      real(wp), intent(in) :: c(6)
      integer, intent(in) :: order            !! 3 or 4
      real(wp), intent(in) :: at
      if (order == 3) then
         derivative = 6 * c(4) + at * (24 * c(5) + at * 60 * c(6))
      else
         derivative = 24 * c(5) + at * 120 * c(6)
      end if
   end function derivative
end module quintic_spline
