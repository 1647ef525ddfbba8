!> Position, direction, curvature and length of the stress-free axis: a line, an arc or a spline, each with its imperfection.
module reference_curve
   use kinds, only: wp, pi, parallel
   use ordered_knots, only: piece_at, shortest_piece
   use model, only: curve_t, path_t, imperfection_t, shape_nodal
   use obstacle_track, only: track_t, track_at
   use imperfection, only: imperfection_value, imperfection_scale
   use length_table, only: length_table_t, new_length_table, add_panel, close_table, panel_places, table_value, table_excess, &
      & table_points
   implicit none
   private
   public :: measure_curves, curve_point, curve_bend, nominal_bend, curve_excess, curve_length, curve_abscissa, curve_goes_on
   public :: curve_angle, path_point, is_straight, curve_scale

contains

   !> The point at nominal coordinate s: position, tangent angle, and derivative of the true length by the nominal length.
   pure subroutine curve_point(curve, imperfections, s, x, angle, speed)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: s         !! nominal coordinate, 0 to curve%length
      real(wp), intent(out) :: x(2)     !! position
      real(wp), intent(out) :: angle    !! tangent angle [rad], continuous in s
      real(wp), intent(out) :: speed    !! d(true arc length)/ds
      real(wp) :: half, chord, w, dw, across, along, bend(0:2), d(2), t(2), turn
      type(track_t) :: at
      if (allocated(curve%path)) then
         call path_point(curve%path, s, at, angle)
         bend(0) = at%curvature / curve%path%scale
         turn = curve%angle - curve%path%angle
         angle = angle + turn
         d = curve%path%scale * (at%place - curve%path%point)
         x = curve%origin + [cos(turn) * d(1) - sin(turn) * d(2), sin(turn) * d(1) + cos(turn) * d(2)]
      else
         bend(0) = curve%curvature
         angle = curve%angle + bend(0) * s
         half = 0.5_wp * bend(0) * s
         chord = s
         if (abs(half) > 0.0_wp) chord = s * sin(half) / half
         t = [cos(curve%angle + half), sin(curve%angle + half)]
         x = curve%origin + chord * t
      end if
      speed = 1.0_wp
      if (curve%imperfection == 0) return
      call imperfection_value(imperfections(curve%imperfection), curve%offset + s, w, dw)
      if (allocated(curve%path) .or. abs(bend(0)) > 0.0_wp) t = [cos(angle), sin(angle)]
      x = x + w * [-t(2), t(1)]
      along = 1.0_wp - bend(0) * w
      across = dw
      speed = hypot(along, across)
      angle = angle + atan2(across, along)
   end subroutine curve_point

   !> Tangent angle [rad] at nominal coordinate s, as from curve_point.
   pure real(wp) function curve_angle(curve, imperfections, s) result(angle)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: s
      real(wp) :: x(2), speed, w, dw
      if (allocated(curve%path)) then
         call curve_point(curve, imperfections, s, x, angle, speed)
         return
      end if
      angle = curve%angle + curve%curvature * s
      if (curve%imperfection == 0) return
      call imperfection_value(imperfections(curve%imperfection), curve%offset + s, w, dw)
      angle = angle + atan2(dw, 1.0_wp - curve%curvature * w)
   end function curve_angle

   !> Curvature d(angle)/d(true arc length) at nominal coordinate s, positive if the curve turns anticlockwise.
   pure subroutine curve_bend(curve, imperfections, s, bend, rate)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: s         !! nominal coordinate, 0 to curve%length
      real(wp), intent(out) :: bend     !! curvature [1/length]
      real(wp), intent(out), optional :: rate !! derivative of the curvature by the true arc length [1/length^2]
      real(wp) :: w, dw, ddw, dddw, along, d_along, dd_along, square, turn, growth, perfect(0:2)
      perfect = nominal_bend(curve, s)
      bend = perfect(0)
      if (present(rate)) rate = perfect(1)
      if (curve%imperfection == 0) return
      call imperfection_value(imperfections(curve%imperfection), curve%offset + s, w, dw, ddw, dddw)
      ! The direction of the axis differs from the nominal direction by atan(dw / along).
      along = 1.0_wp - perfect(0) * w
      d_along = -perfect(0) * dw - perfect(1) * w
      square = along**2 + dw**2
      turn = (along * ddw - dw * d_along) / square
      bend = (perfect(0) + turn) / sqrt(square)
      if (.not. present(rate)) return
      dd_along = -perfect(0) * ddw - 2 * perfect(1) * dw - perfect(2) * w
      growth = (along * d_along + dw * ddw) / square ! derivative of the speed by s, over the speed
      rate = (perfect(1) + (along * dddw - dw * dd_along) / square - 2 * turn * growth - (perfect(0) + turn) * growth) / square
   end subroutine curve_bend

   !> Curvature of the nominal curve and its first two derivatives by s, which is the true arc length if there is no imperfection.
   pure function nominal_bend(curve, s) result(bend)
      type(curve_t), intent(in) :: curve
      real(wp), intent(in) :: s
      real(wp) :: bend(0:2)
      type(track_t) :: at
      bend = [curve%curvature, 0.0_wp, 0.0_wp]
      if (.not. allocated(curve%path)) return
      at = path_place(curve%path, s)
      bend = [at%curvature, at%curvature_rate, at%curvature_second] / curve%path%scale**[1, 2, 3]
   end function nominal_bend

   !> Length over which the curvature varies like a polynomial of low degree, on a part of the curve.
   pure real(wp) function curve_scale(curve, imperfections, from, to) result(length)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, to  !! nominal coordinates of the ends of this part
      real(wp) :: ends(2)
      length = huge(length)
      if (allocated(curve%path)) then
         associate (path => curve%path, spline => curve%path%shape%curve)
            associate (knot => spline%start(:size(spline%piece) + 1))
               ends = path%start + [from, to] / path%scale
               ! A closed spline continues at its beginning.
               if (spline%closed) ends = [knot(1), knot(size(knot))]
               length = path%scale * shortest_piece(knot, ends(1), ends(2))
            end associate
         end associate
      end if
      if (curve%imperfection > 0) length = min(length, imperfection_scale(imperfections(curve%imperfection), curve%offset + from, &
         & curve%offset + to))
   end function curve_scale

   !> True if the curve with its imperfection is a straight line.
   pure logical function is_straight(curve)
      type(curve_t), intent(in) :: curve
      is_straight = .not. (allocated(curve%path) .or. abs(curve%curvature) > 0.0_wp .or. curve%imperfection > 0)
   end function is_straight

   !> Point of a path's spline at the distance s behind the path's start, measured along the nominal curve, and the direction of the
   !> spline there, continuous in s.
   pure subroutine path_point(path, s, at, angle)
      type(path_t), intent(in) :: path
      real(wp), intent(in) :: s
      type(track_t), intent(out) :: at        !! the point, in the axes of the spline
      real(wp), intent(out) :: angle          !! direction of the spline [rad]
      integer :: n, rounds
      at = path_place(path, s)
      associate (curve => path%shape%curve)
         n = size(curve%piece)
         ! Pieces turn by much less than half a turn: the direction at the first point of this piece determines the number of whole
         ! turns.
         rounds = 0
         if (curve%closed) rounds = floor(real(at%piece - 1, wp) / n)
         angle = atan2(curve%tangent(2, 1), curve%tangent(1, 1)) + curve%turned(min(max(at%piece - rounds * n, 1), n + 1)) + &
            & rounds * curve%turned(n + 1)
         angle = angle + modulo(atan2(at%tangent(2), at%tangent(1)) - angle + pi, 2.0_wp * pi) - pi
      end associate
   end subroutine path_point

   !> Point of a path's spline, as from path_point. Beyond an end an open spline is continued by a straight line, a closed spline by
   !> further turns.
   pure type(track_t) function path_place(path, s) result(at)
      type(path_t), intent(in) :: path
      real(wp), intent(in) :: s               !! distance behind the path's start, measured along the nominal curve
      type(track_t) :: near
      real(wp) :: sigma, local
      integer :: n, rounds
      associate (curve => path%shape%curve)
         n = size(curve%piece)
         sigma = path%start + s / path%scale
         rounds = 0
         if (curve%closed) rounds = floor(sigma / curve%start(n + 1))
         local = sigma - rounds * curve%start(n + 1)
         near%piece = piece_at(curve%start(:n + 1), local) + rounds * n
         at = track_at(path%shape, 0.0_wp, sigma, near)
      end associate
   end function path_place

   !> Computes the length tables of all curves for curve_length and curve_abscissa. Must be called after every change of curves or
   !> imperfections. Curves of one imperfection with the same curvature share a table; an element may extend beyond its curve.
   pure subroutine measure_curves(curve, imperfections)
      type(curve_t), intent(inout) :: curve(:)
      type(imperfection_t), intent(inout) :: imperfections(:)
      type(length_table_t), allocatable :: table(:)
      integer :: c, i, k
      do i = 1, size(imperfections)
         allocate (table(0))
         do c = 1, size(curve)
            if (curve(c)%imperfection /= i) cycle
            do k = 1, size(table)
               if (allocated(curve(c)%path)) cycle
               ! Arcs of one circle have curvatures that differ by the rounding of their radii.
               if (abs(table(k)%curvature - curve(c)%curvature) <= 4 * epsilon(1.0_wp) * abs(curve(c)%curvature)) exit
            end do
            if (k > size(table)) table = [table, measured(imperfections(i), curve(c))]
            curve(c)%table = k
         end do
         call move_alloc(table, imperfections(i)%table)
      end do
   end subroutine measure_curves

   !> Length table of an imperfection on a nominal curve.
   pure function measured(imperfection, curve) result(table)
      type(imperfection_t), intent(in) :: imperfection
      type(curve_t), intent(in) :: curve
      type(length_table_t) :: table
      integer, parameter :: halvings = 20       ! largest number of halvings of a panel, reached only at a cusp
      real(wp) :: from, to, end, width, shortest, s(table_points), rate(table_points)
      integer :: k, i, pieces
      logical :: added
      table = new_length_table(merge(huge(from), curve%curvature, allocated(curve%path)))
      ! A spline is smooth only between its knots: the panels of the table end at the knots.
      pieces = 1
      if (imperfection%shape == shape_nodal) pieces = size(imperfection%knot) - 1
      from = 0.0_wp
      do k = 1, pieces
         end = imperfection%length
         if (imperfection%shape == shape_nodal) end = imperfection%knot(k + 1)
         shortest = 0.5_wp**halvings * (end - from)
         to = end
         do while (from < end)
            s = panel_places(from, to)
            do i = 1, table_points
               rate(i) = excess_rate(imperfection, nominal_bend(curve, s(i) - curve%offset), s(i))
            end do
            call add_panel(table, to, rate, to - from <= shortest, added)
            if (added) then
               width = to - from
               from = to
               to = from + 2.0_wp * width
               ! The last panel must not be shorter than half of the others.
               if (end - to < 0.5_wp * width) to = end
            else
               to = 0.5_wp * (from + to)
            end if
         end do
      end do
      call close_table(table)
   end function measured

   !> Derivative of the arc length by the nominal coordinate, minus one.
   pure real(wp) function excess_rate(imperfection, bend, s) result(rate)
      type(imperfection_t), intent(in) :: imperfection
      real(wp), intent(in) :: bend(0:2)         !! curvature of the nominal curve at s, and its first two derivatives
      real(wp), intent(in) :: s                 !! coordinate along the chain
      real(wp) :: w, dw, more
      call imperfection_value(imperfection, s, w, dw)
      more = bend(0) * w * (bend(0) * w - 2.0_wp) + dw**2
      rate = more / (1.0_wp + sqrt(1.0_wp + more))
   end function excess_rate

   !> Arc length of the curve with its imperfection minus the nominal coordinate s, which is the arc length of the perfect curve,
   !> and the derivative of this difference by s. Both lengths begin at one fixed point, the beginning of the length table.
   pure function curve_excess(curve, imperfections, s) result(excess)
      type(curve_t), intent(in) :: curve        !! curve that measure_curves has measured
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: s
      real(wp) :: excess(2)
      excess = 0.0_wp
      if (curve%imperfection > 0) call table_value(imperfections(curve%imperfection)%table(curve%table), curve%offset + s, &
         & excess(1), excess(2))
   end function curve_excess

   !> Arc length of the curve with its imperfection between two nominal coordinates.
   pure function curve_length(curve, imperfections, from, to, excess) result(length)
      type(curve_t), intent(in) :: curve        !! curve that measure_curves has measured
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, to
      real(wp), intent(in), optional :: excess(2) !! result of curve_excess at `from`, if known
      real(wp) :: length, before
      length = to - from
      if (curve%imperfection == 0) return
      associate (table => imperfections(curve%imperfection)%table(curve%table))
         if (present(excess)) then
            before = excess(1)
         else
            before = table_excess(table, curve%offset + from)
         end if
         length = length + (table_excess(table, curve%offset + to) - before)
      end associate
   end function curve_length

   !> Nominal coordinate of the point at a given true arc length after `from`, by Newton's method on curve_length.
   pure function curve_abscissa(curve, imperfections, from, length, excess) result(s)
      type(curve_t), intent(in) :: curve        !! curve that measure_curves has measured
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, length
      real(wp), intent(in) :: excess(2)         !! result of curve_excess at `from`
      real(wp) :: s, after, rate, step
      integer :: iteration
      s = from + length
      if (curve%imperfection == 0) return
      associate (table => imperfections(curve%imperfection)%table(curve%table))
         s = from + length / (1.0_wp + excess(2))
         do iteration = 1, 20
            call table_value(table, curve%offset + s, after, rate)
            step = ((length - (s - from)) - (after - excess(1))) / (1.0_wp + rate)
            s = s + step
            ! After this step the error is half of the step's square times the derivative of the rate, which has changed by about
            ! this much.
            if (step**2 * (abs(rate - excess(2)) * abs(length) + abs(step)) <= 0.1_wp * epsilon(s) * abs(length)**3) exit
         end do
      end associate
   end function curve_abscissa

   !> True if one curve continues another one from a common point: both have the same line or circle and the same imperfection, so
   !> that either curve may be extended by the coordinates of the other.
   pure logical function curve_goes_on(first, at_first, second, at_second) result(goes_on)
      type(curve_t), intent(in) :: first, second
      real(wp), intent(in) :: at_first, at_second  !! coordinate of the common point on each curve
      real(wp), parameter :: same = parallel       !! tolerance: [rad], and relative
      real(wp) :: turn, span
      span = max(first%length, second%length)
      if (allocated(first%path) .or. allocated(second%path)) then
         goes_on = allocated(first%path) .and. allocated(second%path)
         if (goes_on) goes_on = norm2([second%origin - first%origin, second%angle - first%angle, second%length - first%length, &
            & at_second - at_first]) <= 0.0_wp
         return
      end if
      turn = second%angle + second%curvature * at_second - first%angle - first%curvature * at_first
      turn = modulo(turn + pi, 2.0_wp * pi) - pi
      goes_on = abs(turn) <= same .and. abs(second%curvature - first%curvature) * span <= same .and. &
         & second%imperfection == first%imperfection
      if (first%imperfection > 0) goes_on = goes_on .and. abs(second%offset + at_second - first%offset - at_first) <= same * span
   end function curve_goes_on
end module reference_curve
