!> Curves of obstacles as decks describe them: arcs, polylines with rounded corners (also closed ones that consist of arcs only),
!> and splines.
module obstacle_shapes
   use kinds, only: wp, pi
   use quintic_spline, only: spline_derivatives, hermite_coefficients, ends_straight, ends_meet
   use obstacle_curve, only: obstacle_curve_t, piece_t, straight_piece, arc_piece, quintic_pieces, join_pieces, &
      & angle_between
   implicit none
   private
   public :: arc_curve, ellipse_points, polyline_curve, misfit, spline_curve, mirrored, corner_turn, widest_corner_radius, &
      & default_corner_radius

   real(wp), parameter :: straight_on = 1.0e-9_wp   !! corners with a smaller turn are ignored [rad]
   real(wp), parameter :: same = 1.0e-9_wp !! accuracy with which mirror images close a curve: part of the curve's size, and [rad]
   real(wp), parameter :: default_share = 0.1_wp    !! largest part of a segment that a corner takes by default

contains

   !> Circular arc from start to end angle [rad], counterclockwise if the angle increases.
   pure function arc_curve(centre, radius, start_angle, end_angle) result(curve)
      real(wp), intent(in) :: centre(2), radius, start_angle, end_angle
      type(obstacle_curve_t) :: curve
      curve = join_pieces([arc_piece(centre, radius, start_angle, end_angle - start_angle)], closed=.false.)
   end function arc_curve

   !> Points of an ellipse, the last one equal to the first. They are so many that the closed spline through them deviates by
   !> rounding only.
   pure function ellipse_points(centre, half, turn, anticlockwise) result(point)
      real(wp), intent(in) :: centre(2)       !! centre of the ellipse
      real(wp), intent(in) :: half(2)         !! half axes, positive
      real(wp), intent(in) :: turn            !! direction of the first axis [rad]
      logical, intent(in) :: anticlockwise    !! true: the inside of the ellipse is on the left
      real(wp), allocatable :: point(:, :)    !! (2, points) positions
      integer, parameter :: circle = 256 ! number of points on a circle: the error h^6/720 of a quintic is then 3e-13 of the radius
      real(wp) :: t, d(2)
      integer :: i, n
      n = circle * ceiling(sqrt(maxval(half) / minval(half)))
      allocate (point(2, n + 1))
      do i = 1, n
         t = (2.0_wp * pi * (i - 1)) / n
         if (.not. anticlockwise) t = -t
         d = half * [cos(t), sin(t)]
         point(:, i) = centre + [cos(turn) * d(1) - sin(turn) * d(2), sin(turn) * d(1) + cos(turn) * d(2)]
      end do
      point(:, n + 1) = point(:, 1)
   end function ellipse_points

   !> Straight segments through distinct points; the corners are rounded by arcs.
   function polyline_curve(point, radius, closed) result(curve)
      real(wp), intent(in) :: point(:, :)     !! (2, 2 or more) distinct points; if closed, with two points more beyond each
      !! end, so that every point has its neighbours
      real(wp), intent(in) :: radius(:)       !! radius of the corner at each point; all corners must fit, see misfit
      logical, intent(in) :: closed
      type(obstacle_curve_t) :: curve
      type(piece_t), allocatable :: piece(:)
      real(wp) :: at(2), before(2), start(2), turn, centre(2), arm(2)
      integer :: i, n, pieces, beyond
      n = size(point, 2)
      beyond = merge(2, 0, closed)            ! number of added points at either end
      allocate (piece(2 * n))                 ! upper bound of the number of pieces
      pieces = 0
      at = point(:, 1)
      if (closed) at = point(:, 2) + radius(2) * cut(point, 2) * unit(point(:, 3) - point(:, 2))
      do i = max(2, beyond + 1), min(n - 1, n - beyond)
         turn = corner_turn(point, i)
         if (abs(turn) < straight_on) cycle
         before = unit(point(:, i) - point(:, i - 1))
         start = point(:, i) - radius(i) * cut(point, i) * before
         call add_straight(start)
         centre = start + sign(radius(i), turn) * [-before(2), before(1)]
         arm = start - centre
         pieces = pieces + 1
         piece(pieces) = arc_piece(centre, radius(i), atan2(arm(2), arm(1)), turn)
         at = point(:, i) + radius(i) * cut(point, i) * unit(point(:, i + 1) - point(:, i))
      end do
      if (.not. closed) call add_straight(point(:, n))
      curve = join_pieces(piece(:pieces), closed)

   contains

      !> Adds a straight piece up to a point, unless arcs take the whole segment.
      subroutine add_straight(to)
         real(wp), intent(in) :: to(2)
         if (norm2(to - at) <= same * norm2(point(:, i) - point(:, i - 1))) return
         pieces = pieces + 1
         piece(pieces) = straight_piece(at, to)
      end subroutine add_straight
   end function polyline_curve

   !> Quintic spline through distinct points, with the chord length as parameter. The pressure of a rod along the curve contains EI
   !> times the second derivative of the curvature, which is continuous.
   function spline_curve(point, closed) result(curve)
      real(wp), intent(in) :: point(:, :) !! (2, 2 or more) points; a closed spline has 4 or more, the last one equal to the first
      logical, intent(in) :: closed       !! true: the spline is periodic
      type(obstacle_curve_t) :: curve
      type(piece_t), allocatable :: piece(:), more(:), next(:)
      real(wp), dimension(size(point, 2), 2) :: value, slope, bend
      real(wp) :: knot(size(point, 2)), c(2, 6), h
      integer :: i, k, n, pieces
      n = size(point, 2)
      knot(1) = 0.0_wp
      do i = 2, n
         knot(i) = knot(i - 1) + norm2(point(:, i) - point(:, i - 1))
      end do
      value = transpose(point)
      call spline_derivatives(knot, value, merge(ends_meet, ends_straight, closed), slope, bend)
      allocate (piece(4 * n))
      pieces = 0
      do i = 1, n - 1
         h = knot(i + 1) - knot(i)
         do k = 1, 2
            c(k, :) = hermite_coefficients([value(i, k), h * slope(i, k), h**2 * bend(i, k), h * slope(i + 1, k), &
               & h**2 * bend(i + 1, k), value(i + 1, k) - value(i, k)])
         end do
         next = quintic_pieces(c)
         if (pieces + size(next) > size(piece)) then
            allocate (more(2 * (pieces + size(next))))
            more(:pieces) = piece(:pieces)
            call move_alloc(more, piece)
         end if
         piece(pieces + 1:pieces + size(next)) = next
         pieces = pieces + size(next)
      end do
      curve = join_pieces(piece(:pieces), closed)
   end function spline_curve

   !> Points of a curve, continued by mirror images beyond those ends whose direction is given; the mirror is normal to the curve at
   !> the end. With one mirror there is one image. With mirrors at both ends there are as many images as close the curve, and the
   !> last point is equal to the first.
   function mirrored(point, at, direction, closed) result(all_points)
      real(wp), intent(in) :: point(:, :)     !! (2, 2 or more) points of the curve
      logical, intent(in) :: at(2)            !! true: there is a mirror at the first point; at the last point
      real(wp), intent(in) :: direction(2)    !! direction of the curve at the first and at the last point [rad]
      logical, intent(out) :: closed          !! true: the images close the curve; with two mirrors false is a failure
      real(wp), allocatable :: all_points(:, :) !! (2, points) points with their mirror images
      integer, parameter :: most = 24         ! largest number of copies: mirrors at angles down to 15 degrees
      real(wp) :: t(2), angle(2), arm(2, size(point, 2) - 1)
      integer :: copy, n, m
      closed = .false.
      m = size(point, 2)
      all_points = point
      angle = direction
      if (.not. at(2)) then
         all_points = point(:, m:1:-1)
         angle = direction([2, 1])
      end if
      do copy = 2, merge(most, 2, all(at))
         n = size(all_points, 2)
         t = [cos(angle(2)), sin(angle(2))]
         arm = all_points(:, n - 1:n - m + 1:-1) - spread(all_points(:, n), 2, m - 1)
         arm = arm - 2.0_wp * spread(t, 2, m - 1) * spread(matmul(t, arm), 1, 2)
         all_points = reshape([all_points, spread(all_points(:, n), 2, m - 1) + arm], [2, n + m - 1])
         ! Directions at the two ends of the image: it begins where the former one ends; at its end is the beginning of the former
         ! one, with the direction mirrored at that tangent and reversed.
         angle = [angle(2), 2.0_wp * angle(2) - angle(1)]
         n = size(all_points, 2)
         closed = all(at) .and. norm2(all_points(:, n) - point(:, 1)) <= same * norm2(all_points(:, n) - all_points(:, n / 2)) &
            & .and. norm2([cos(angle(2)), sin(angle(2))] - [cos(direction(1)), sin(direction(1))]) <= same
         if (closed) all_points(:, n) = all_points(:, 1)
         if (closed) return
      end do
      if (.not. at(2)) all_points = all_points(:, size(all_points, 2):1:-1)
   end function mirrored

   !> Turn [rad] of a polyline at an inner point, > 0 to the left, between -pi and pi.
   pure real(wp) function corner_turn(point, i) result(turn)
      real(wp), intent(in) :: point(:, :)
      integer, intent(in) :: i
      turn = angle_between(point(:, i) - point(:, i - 1), point(:, i + 1) - point(:, i))
   end function corner_turn

   !> Number of the first point whose corner does not fit on its segment together with the previous corner; 0: all corners fit.
   pure integer function misfit(point, radius)
      real(wp), intent(in) :: point(:, :)     !! (2, points) points as in polyline_curve
      real(wp), intent(in) :: radius(:)       !! radius of the corner at each point
      do misfit = 2, size(point, 2)
         if (radius(misfit - 1) * cut(point, misfit - 1) + radius(misfit) * cut(point, misfit) > &
            & (1.0_wp + same) * norm2(point(:, misfit) - point(:, misfit - 1))) return
      end do
      misfit = 0
   end function misfit

   !> Largest radius for which all corners of a polyline fit on its segments; huge if there are no corners.
   pure real(wp) function widest_corner_radius(point) result(radius)
      real(wp), intent(in) :: point(:, :)
      real(wp) :: need
      integer :: i
      radius = huge(radius)
      do i = 1, size(point, 2) - 1
         need = cut(point, i) + cut(point, i + 1)
         if (need > 0.0_wp) radius = min(radius, norm2(point(:, i + 1) - point(:, i)) / need)
      end do
   end function widest_corner_radius

   !> Largest radius for which no corner takes more than a tenth of a segment beside it; 0 if there are no corners.
   pure real(wp) function default_corner_radius(point) result(radius)
      real(wp), intent(in) :: point(:, :)
      real(wp) :: need
      integer :: i
      radius = huge(radius)
      do i = 1, size(point, 2) - 1
         need = max(cut(point, i), cut(point, i + 1))
         if (need > 0.0_wp) radius = min(radius, default_share * norm2(point(:, i + 1) - point(:, i)) / need)
      end do
      if (radius >= huge(radius)) radius = 0.0_wp
   end function default_corner_radius

   !> Length by which the rounded corner at point i shortens the two segments beside it, for a radius of 1.
   pure real(wp) function cut(point, i)
      real(wp), intent(in) :: point(:, :)
      integer, intent(in) :: i
      cut = 0.0_wp
      if (i == 1 .or. i == size(point, 2)) return
      cut = corner_turn(point, i)
      if (abs(cut) < straight_on) then
         cut = 0.0_wp
      else
         cut = tan(0.5_wp * abs(cut))
      end if
   end function cut

   pure function unit(a)
      real(wp), intent(in) :: a(2)
      real(wp) :: unit(2)
      unit = a / norm2(a)
   end function unit
end module obstacle_shapes
