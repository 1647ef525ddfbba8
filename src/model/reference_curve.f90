!> Position, direction, curvature and length of the stress-free axis: a line or an arc with its imperfection.
module reference_curve
   use kinds, only: wp, pi, parallel
   use model, only: curve_t, imperfection_t, shape_nodal
   use imperfection, only: imperfection_value
   use length_table, only: length_table_t, new_length_table, add_panel, close_table, panel_places, table_value, table_excess, &
      & table_points
   implicit none
   private
   public :: measure_curves, curve_point, curve_bend, curve_length, curve_abscissa, curve_goes_on

contains

   !> The point at nominal coordinate s: position, tangent angle and true length per nominal length.
   pure subroutine curve_point(curve, imperfections, s, x, angle, speed)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: s         !! 0 to curve%length
      real(wp), intent(out) :: x(2)     !! position
      real(wp), intent(out) :: angle    !! tangent direction [rad], continuous in s
      real(wp), intent(out) :: speed    !! d(true arc length)/ds
      real(wp) :: half, chord, w, dw, across, along
      angle = curve%angle + curve%curvature * s
      half = 0.5_wp * curve%curvature * s
      chord = s
      if (abs(half) > 0.0_wp) chord = s * sin(half) / half
      x = curve%origin + chord * [cos(curve%angle + half), sin(curve%angle + half)]
      speed = 1.0_wp
      if (curve%imperfection == 0) return
      call imperfection_value(imperfections(curve%imperfection), curve%offset + s, w, dw)
      x = x + w * [-sin(angle), cos(angle)]
      along = 1.0_wp - curve%curvature * w
      across = dw
      speed = hypot(along, across)
      angle = angle + atan2(across, along)
   end subroutine curve_point

   !> Curvature d(angle)/d(true arc length) at nominal coordinate s, positive when the curve turns anticlockwise.
   pure subroutine curve_bend(curve, imperfections, s, bend, rate)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: s         !! 0 to curve%length
      real(wp), intent(out) :: bend     !! [1/length]
      real(wp), intent(out), optional :: rate !! its derivative by the true arc length
      real(wp) :: w, dw, ddw, dddw, along, square, turn, growth
      bend = curve%curvature
      if (present(rate)) rate = 0.0_wp
      if (curve%imperfection == 0) return
      call imperfection_value(imperfections(curve%imperfection), curve%offset + s, w, dw, ddw, dddw)
      ! The axis turns by atan(dw / along) from the nominal direction; d(along)/ds = -curvature dw.
      along = 1.0_wp - curve%curvature * w
      square = along**2 + dw**2
      turn = (along * ddw + curve%curvature * dw**2) / square
      bend = (curve%curvature + turn) / sqrt(square)
      if (.not. present(rate)) return
      growth = dw * (ddw - curve%curvature * along) / square ! growth of the speed with s, over the speed
      rate = ((along * dddw + curve%curvature * dw * ddw) / square - 2 * turn * growth - (curve%curvature + turn) * growth) / square
   end subroutine curve_bend

   !> Computes tables of the lengths along all curves for curve_length and curve_abscissa; to be called after every change of curves
   !> or imperfections. One table serves all curves of an imperfection with the same curvature; an element may extend beyond its
   !> curve.
   pure subroutine measure_curves(curve, imperfections)
      type(curve_t), intent(inout) :: curve(:)
      type(imperfection_t), intent(inout) :: imperfections(:)
      type(length_table_t), allocatable :: table(:), more(:)
      integer :: c, i, k
      do i = 1, size(imperfections)
         allocate (table(0))
         do c = 1, size(curve)
            if (curve(c)%imperfection /= i) cycle
            do k = 1, size(table)
               if (abs(table(k)%curvature - curve(c)%curvature) <= 0.0_wp) exit
            end do
            if (k > size(table)) then
               allocate (more(k))
               more(:k - 1) = table
               more(k) = measured(imperfections(i), curve(c)%curvature)
               call move_alloc(more, table)
            end if
            curve(c)%table = k
         end do
         call move_alloc(table, imperfections(i)%table)
      end do
   end subroutine measure_curves

   !> Length table of an imperfection on a nominal curve.
   pure function measured(imperfection, curvature) result(table)
      type(imperfection_t), intent(in) :: imperfection
      real(wp), intent(in) :: curvature
      type(length_table_t) :: table
      integer, parameter :: halvings = 20       ! limit of refinement, reached at a cusp only
      real(wp) :: from, to, end, width, shortest, s(table_points), rate(table_points)
      integer :: k, i, pieces
      logical :: added
      table = new_length_table(curvature)
      ! A spline is smooth between its knots only: the panels of the table end at the knots.
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
               rate(i) = excess_rate(imperfection, curvature, s(i))
            end do
            call add_panel(table, to, rate, to - from <= shortest, added)
            if (added) then
               width = to - from
               from = to
               to = from + 2.0_wp * width
               ! The last panel is not to be shorter than half of the others.
               if (end - to < 0.5_wp * width) to = end
            else
               to = 0.5_wp * (from + to)
            end if
         end do
      end do
      call close_table(table)
   end function measured

   !> True length per nominal length, less one.
   pure real(wp) function excess_rate(imperfection, curvature, s) result(rate)
      type(imperfection_t), intent(in) :: imperfection
      real(wp), intent(in) :: curvature
      real(wp), intent(in) :: s                 !! along the chain
      real(wp) :: w, dw, more
      call imperfection_value(imperfection, s, w, dw)
      more = curvature * w * (curvature * w - 2.0_wp) + dw**2
      rate = more / (1.0_wp + sqrt(1.0_wp + more))
   end function excess_rate

   !> True length of the curve between two nominal coordinates.
   pure function curve_length(curve, imperfections, from, to) result(length)
      type(curve_t), intent(in) :: curve        !! measured
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, to
      real(wp) :: length
      length = to - from
      if (curve%imperfection == 0) return
      associate (table => imperfections(curve%imperfection)%table(curve%table))
         length = length + (table_excess(table, curve%offset + to) - table_excess(table, curve%offset + from))
      end associate
   end function curve_length

   !> Nominal coordinate of the point that lies `length` of true arc length after `from` (Newton on curve_length).
   pure function curve_abscissa(curve, imperfections, from, length) result(s)
      type(curve_t), intent(in) :: curve        !! measured
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, length
      real(wp) :: s, before, after, rate, step
      integer :: iteration
      s = from + length
      if (curve%imperfection == 0) return
      associate (table => imperfections(curve%imperfection)%table(curve%table))
         call table_value(table, curve%offset + from, before, rate)
         s = from + length / (1.0_wp + rate)
         do iteration = 1, 20
            call table_value(table, curve%offset + s, after, rate)
            step = ((length - (s - from)) - (after - before)) / (1.0_wp + rate)
            s = s + step
            ! The error after this step is of the order of its square.
            if (abs(step) <= 0.1_wp * sqrt(epsilon(s)) * abs(length)) exit
         end do
      end associate
   end function curve_abscissa

   !> True if one curve continues another one from a common point: the same line or circle and the same imperfection, so that either
   !> curve may be extended with the other's coordinates.
   pure logical function curve_goes_on(first, at_first, second, at_second) result(goes_on)
      type(curve_t), intent(in) :: first, second
      real(wp), intent(in) :: at_first, at_second  !! coordinate of the point on each curve
      real(wp), parameter :: same = parallel       !! [rad], and relative
      real(wp) :: turn, span
      span = max(first%length, second%length)
      turn = second%angle + second%curvature * at_second - first%angle - first%curvature * at_first
      turn = modulo(turn + pi, 2.0_wp * pi) - pi
      goes_on = abs(turn) <= same .and. abs(second%curvature - first%curvature) * span <= same .and. &
         & second%imperfection == first%imperfection
      if (first%imperfection > 0) goes_on = goes_on .and. &
         & abs(second%offset + at_second - first%offset - at_first) <= same * span
   end function curve_goes_on
end module reference_curve
