!> Interpolating cubic spline of one variable, with natural or periodic ends.
module cubic_spline
   use kinds, only: wp
   use lapack, only: dptsv
   implicit none
   private
   public :: spline_bend, spline_value

contains

   !> Second derivatives at the knots. Natural: zero at both ends. Periodic: value, slope and bend meet at the ends.
   subroutine spline_bend(knot, value, periodic, bend)
      real(wp), intent(in) :: knot(:)     !! increasing; 2 or more, periodic: 3 or more
      real(wp), intent(in) :: value(:)    !! as many; periodic: the last one equals the first
      logical, intent(in) :: periodic     !! how the ends are treated
      real(wp), intent(out) :: bend(:)    !! as many
      real(wp) :: h(size(knot) - 1), slope(size(knot) - 1)
      real(wp) :: diagonal(size(knot)), beside(size(knot)), x(size(knot), 2), corner
      integer :: n, info
      n = size(h)
      h = knot(2:) - knot(:n)
      slope = (value(2:) - value(:n)) / h
      bend = 0.0_wp
      if (.not. periodic) then
         if (n < 2) return
         diagonal(:n - 1) = (h(:n - 1) + h(2:)) / 3
         beside(:n - 1) = h(2:) / 6
         x(:n - 1, 1) = slope(2:) - slope(:n - 1)
         call dptsv(n - 1, 1, diagonal, beside, x, n + 1, info)
         bend(2:n) = x(:n - 1, 1)
      else
         ! The unknowns are the first n bends. The cyclic matrix is a tridiagonal one plus corner * u u^T with
         ! u = (1, 0, ..., 0, 1); the tridiagonal one is solved for both right-hand sides (Sherman and Morrison).
         corner = h(n) / 6
         diagonal(1) = (h(n) + h(1)) / 3
         diagonal(2:n) = (h(:n - 1) + h(2:)) / 3
         diagonal([1, n]) = diagonal([1, n]) - corner
         beside(:n - 1) = h(:n - 1) / 6
         x(1, 1) = slope(1) - slope(n)
         x(2:n, 1) = slope(2:) - slope(:n - 1)
         x(:n, 2) = 0.0_wp
         x([1, n], 2) = 1.0_wp
         call dptsv(n, 2, diagonal, beside, x, n + 1, info)
         bend(:n) = x(:n, 1) - x(:n, 2) * corner * (x(1, 1) + x(n, 1)) / (1.0_wp + corner * (x(1, 2) + x(n, 2)))
         bend(n + 1) = bend(1)
      end if
      ! info: the matrix is diagonally dominant for increasing knots, so dptsv cannot meet a pivot below zero.
   end subroutine spline_bend

   !> Value and derivatives of a spline; beyond the ends its last piece goes on.
   pure subroutine spline_value(knot, value, bend, s, w, dw, ddw, dddw)
      real(wp), intent(in) :: knot(:)  !! increasing, 2 or more
      real(wp), intent(in) :: value(:) !! at the knots
      real(wp), intent(in) :: bend(:)  !! second derivatives from spline_bend
      real(wp), intent(in) :: s        !! where
      real(wp), intent(out) :: w       !! value
      real(wp), intent(out) :: dw      !! slope
      real(wp), intent(out), optional :: ddw, dddw !! second and third derivative, the latter of the piece after a knot
      real(wp) :: h, a, b
      integer :: left, right, middle
      left = 1
      right = size(knot)
      do while (right - left > 1)
         middle = (left + right) / 2
         if (knot(middle) > s) then
            right = middle
         else
            left = middle
         end if
      end do
      h = knot(right) - knot(left)
      a = (knot(right) - s) / h
      b = (s - knot(left)) / h
      w = a * value(left) + b * value(right)
      w = w + (a * (a * a - 1) * bend(left) + b * (b * b - 1) * bend(right)) * h * h / 6
      dw = (value(right) - value(left)) / h + ((3 * b * b - 1) * bend(right) - (3 * a * a - 1) * bend(left)) * h / 6
      if (present(ddw)) ddw = a * bend(left) + b * bend(right)
      if (present(dddw)) dddw = (bend(right) - bend(left)) / h
   end subroutine spline_value
end module cubic_spline
