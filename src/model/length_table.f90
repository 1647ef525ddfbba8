!> Excess of a curve's true length over its nominal coordinate, as a function of this coordinate. It is smooth, and stored as
!> polynomials on panels that are short enough for an accuracy of rounding.
!>
!> The excess of an imperfect rod is small: lengths of short pieces, computed as differences of it, have no additional rounding
!> error.
module length_table
   use kinds, only: wp, pi
   use ordered_knots, only: piece_at
   implicit none
   private
   public :: length_table_t, new_length_table, add_panel, close_table, panel_places, table_value, table_excess, table_points

   integer, parameter :: table_points = 8 !! number of Chebyshev points of a panel

   !> Table of the excess of length for curves with the same nominal curvature.
   type :: length_table_t
      real(wp) :: curvature = 0.0_wp !! curvature of the nominal curve; huge: the curve is a spline, which has a table of its own
      integer :: n = 0                        !! number of panels so far
      real(wp), allocatable :: at(:)          !! (panels + 1) ends of the panels; larger until the table is closed
      real(wp), allocatable :: excess(:, :)   !! (points + 1, panels) coefficients of x^0, x^1, ...; x goes from -1 to 1 in a panel
   end type length_table_t

contains

   !> A table without panels.
   pure function new_length_table(curvature) result(table)
      real(wp), intent(in) :: curvature
      type(length_table_t) :: table
      table%curvature = curvature
      allocate (table%at(17), table%excess(table_points + 1, 16), source=0.0_wp)
   end function new_length_table

   !> Removes the unused part of the arrays behind the last panel; only then the table can be evaluated.
   pure subroutine close_table(table)
      type(length_table_t), intent(inout) :: table
      table%at = table%at(:table%n + 1)
      table%excess = table%excess(:, :table%n)
   end subroutine close_table

   !> Coordinates in a panel at which the derivative d(excess)/ds must be given.
   pure function panel_places(from, to) result(s)
      real(wp), intent(in) :: from, to
      real(wp) :: s(table_points)
      integer :: i
      real(wp), parameter :: place(table_points) = [(cos(pi * (i - 0.5_wp) / table_points), i=1, table_points)]
      s = 0.5_wp * (from + to) + 0.5_wp * (to - from) * place
   end function panel_places

   !> Appends a panel at the end of the table, if the polynomial through the derivatives is accurate to rounding.
   pure subroutine add_panel(table, to, rate, last_try, added)
      type(length_table_t), intent(inout) :: table
      real(wp), intent(in) :: to              !! coordinate of the panel's end
      real(wp), intent(in) :: rate(:)         !! (points) d(excess)/ds at the coordinates panel_places
      logical, intent(in) :: last_try         !! true: the panel is added whatever its accuracy
      logical, intent(out) :: added
      real(wp) :: c(0:table_points + 1), d(0:table_points), half, noise
      integer :: k, i, n
      real(wp), parameter :: wave(table_points, 0:table_points - 1) = reshape([((cos(k * pi * (i - 0.5_wp) / table_points), &
         & i=1, table_points), k=0, table_points - 1)], [table_points, table_points]) !! Chebyshev polynomials at the points
      ! First the Chebyshev coefficients of the derivative, then those of its integral.
      c = 0.0_wp
      do k = 0, table_points - 1
         c(k) = sum(rate * wave(:, k)) * 2.0_wp / table_points
      end do
      c(0) = 0.5_wp * c(0)
      n = table%n + 1
      half = 0.5_wp * (to - table%at(n))
      ! If the last coefficients are below this size, they are the rounding of a length, or of the coordinates times the slope of
      ! the rate.
      noise = 1.0_wp + maxval(abs(rate)) + abs(to) / half * sum([(k**2 * abs(c(k)), k=1, table_points - 1)])
      added = last_try .or. maxval(abs(c(table_points - 2:table_points - 1))) <= epsilon(c) * noise
      if (.not. added) return
      d(1) = half * (c(0) - 0.5_wp * c(2))
      do k = 2, table_points
         d(k) = half * (c(k - 1) - c(k + 1)) / (2 * k)
      end do
      ! The excess is continuous where the previous panel ends.
      d(0) = sum(d(1::2)) - sum(d(2::2))
      if (n > 1) d(0) = d(0) + sum(table%excess(:, n - 1))
      if (n == size(table%at)) then
         table%at = [table%at, table%at] ! twice the room
         table%excess = reshape(table%excess, [table_points + 1, 2 * n - 1], pad=[0.0_wp])
      end if
      table%n = n
      table%at(n + 1) = to
      table%excess(:, n) = powers(d)
   end subroutine add_panel

   !> Coefficients of powers of x that are equivalent to given Chebyshev coefficients.
   pure function powers(d) result(a)
      real(wp), intent(in) :: d(0:table_points)
      real(wp), dimension(0:table_points) :: a, before, now, next
      integer :: k
      before = 0.0_wp
      before(0) = 1.0_wp
      now = 0.0_wp
      now(1) = 1.0_wp
      a = d(0) * before + d(1) * now
      do k = 2, table_points
         next = -before
         next(1:) = next(1:) + 2.0_wp * now(:table_points - 1)
         a = a + d(k) * next
         before = now
         now = next
      end do
   end function powers

   !> Excess and its derivative at coordinate s; beyond the ends of the table the excess is continued linearly.
   pure subroutine table_value(table, s, excess, rate)
      type(length_table_t), intent(in) :: table
      real(wp), intent(in) :: s
      real(wp), intent(out) :: excess, rate
      real(wp) :: x, inside, slope
      integer :: panel, k
      inside = min(max(s, table%at(1)), table%at(size(table%at)))
      call find_in_panel(table, inside, panel, x)
      excess = table%excess(table_points + 1, panel)
      slope = 0.0_wp
      do k = table_points, 1, -1
         slope = excess + x * slope
         excess = table%excess(k, panel) + x * excess
      end do
      rate = slope * (2.0_wp / (table%at(panel + 1) - table%at(panel)))
      excess = excess + rate * (s - inside)
   end subroutine table_value

   !> The excess without its derivative.
   pure real(wp) function table_excess(table, s) result(excess)
      type(length_table_t), intent(in) :: table
      real(wp), intent(in) :: s
      real(wp) :: x, rate
      integer :: panel, k
      if (s < table%at(1) .or. s > table%at(size(table%at))) then
         call table_value(table, s, excess, rate)
         return
      end if
      call find_in_panel(table, s, panel, x)
      excess = table%excess(table_points + 1, panel)
      do k = table_points, 1, -1
         excess = table%excess(k, panel) + x * excess
      end do
   end function table_excess

   !> Panel that contains a coordinate inside the table, and the position of the coordinate in this panel.
   pure subroutine find_in_panel(table, s, panel, x)
      type(length_table_t), intent(in) :: table
      real(wp), intent(in) :: s
      integer, intent(out) :: panel
      real(wp), intent(out) :: x              !! position in the panel, -1 to 1
      panel = piece_at(table%at, s)
      x = ((s - table%at(panel)) - (table%at(panel + 1) - s)) / (table%at(panel + 1) - table%at(panel))
   end subroutine find_in_panel
end module length_table
