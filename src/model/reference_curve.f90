!> Position, direction, curvature and length of the stress-free axis: a line or an arc with its imperfection.
module reference_curve
   use kinds, only: wp, pi
   use model, only: curve_t, imperfection_t
   use imperfection, only: imperfection_value
   implicit none
   private
   public :: curve_point, curve_bend, curve_length, curve_abscissa, curve_goes_on

   ! Gauss's rule of 10 points on (0, 1): per element far beyond the elements' order.
   integer, parameter :: n_gauss = 10
   real(wp), parameter :: c(n_gauss) = [ &
      & 0.01304673574141413996_wp, 0.06746831665550774463_wp, 0.16029521585048779688_wp, &
      & 0.28330230293537640460_wp, 0.42556283050918439456_wp, 0.57443716949081560544_wp, &
      & 0.71669769706462359540_wp, 0.83970478414951220312_wp, 0.93253168334449225537_wp, &
      & 0.98695326425858586004_wp]
   real(wp), parameter :: b(n_gauss) = [ &
      & 0.03333567215434406880_wp, 0.07472567457529029657_wp, 0.10954318125799102200_wp, &
      & 0.13463335965499817755_wp, 0.14776211235737643509_wp, 0.14776211235737643509_wp, &
      & 0.13463335965499817755_wp, 0.10954318125799102200_wp, 0.07472567457529029657_wp, &
      & 0.03333567215434406880_wp]

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
      real(wp), intent(out), optional :: rate !! its derivative by the true arc length; nodal imperfections: it jumps at nodes
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
      growth = dw * (ddw - curve%curvature * along) / square ! of the speed by s, over the speed
      rate = ((along * dddw + curve%curvature * dw * ddw) / square - 2 * turn * growth - (curve%curvature + turn) * growth) / square
   end subroutine curve_bend

   !> True length of the curve between two nominal coordinates.
   pure function curve_length(curve, imperfections, from, to) result(length)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, to
      real(wp) :: length, x(2), angle, speed
      integer :: i
      length = to - from
      if (curve%imperfection == 0) return
      length = 0.0_wp
      do i = 1, n_gauss
         call curve_point(curve, imperfections, from + c(i) * (to - from), x, angle, speed)
         length = length + (to - from) * b(i) * speed
      end do
   end function curve_length

   !> Nominal coordinate of the point that lies `length` of true arc length after `from` (Newton on curve_length).
   pure function curve_abscissa(curve, imperfections, from, length) result(s)
      type(curve_t), intent(in) :: curve
      type(imperfection_t), intent(in) :: imperfections(:)
      real(wp), intent(in) :: from, length
      real(wp) :: s, x(2), angle, speed, step
      integer :: iteration
      s = from + length
      if (curve%imperfection == 0) return
      do iteration = 1, 20
         call curve_point(curve, imperfections, s, x, angle, speed)
         step = (length - curve_length(curve, imperfections, from, s)) / speed
         s = s + step
         if (abs(step) <= 8.0_wp * epsilon(s) * max(abs(s), abs(length))) exit
      end do
   end function curve_abscissa

   !> True when one curve goes on as another one from a common point: the same line or circle and the same imperfection, so
   !> that either may be continued with the other's coordinates.
   pure logical function curve_goes_on(first, at_first, second, at_second) result(goes_on)
      type(curve_t), intent(in) :: first, second
      real(wp), intent(in) :: at_first, at_second  !! the point's coordinate on each of them
      real(wp), parameter :: same = 1.0e-6_wp      !! as good as coordinates of six digits make an arc
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
