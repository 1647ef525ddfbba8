!> Curves that divide the plane: consecutive straight, circular and quintic pieces with common tangents. They are closed, or
!> continued by straight lines beyond both ends.
!>
!> The nearest point is found with a tree of circles around the pieces. Only pieces that may contain the nearest point are examined;
!> the cost grows with the logarithm of the number of pieces, and searches are independent of each other. A quintic piece turns by
!> so little that its nearest point is unique. It is found by Newton's method within a bracket.
module obstacle_curve
   use kinds, only: wp
   use gauss_tableau, only: gauss_points
   implicit none
   private
   public :: obstacle_curve_t, foot_t, nearest_point, curve_samples, sharpest_turn, crosses_itself
   public :: piece_t, piece_point, straight_piece, arc_piece, quintic_pieces, join_pieces
   public :: shape_quintic, arc_length, turned_angle, polynomial_at, first_derivatives, angle_between

   integer, parameter :: shape_straight = 1, shape_arc = 2, shape_quintic = 3

   real(wp), parameter :: piece_turn = 0.25_wp   !! largest turn of a quintic piece [rad]
   real(wp), parameter :: sample_turn = 0.05_wp  !! turn of the curve between two samples [rad]
   integer, parameter :: n_gauss = 10 !! number of quadrature points on a quintic piece; the piece turns so little that the
   !! quadrature error is rounding
   real(wp), parameter :: factorial(0:5) = [1.0_wp, 1.0_wp, 2.0_wp, 6.0_wp, 24.0_wp, 120.0_wp]

   !> One piece of a curve; its parameter t runs from 0 to 1.
   type :: piece_t
      integer :: shape = shape_straight
      real(wp) :: c(2, 6) = 0.0_wp      !! straight and quintic pieces: position = sum c(:, k) t^(k - 1)
      real(wp) :: centre(2) = 0.0_wp, radius = 0.0_wp
      real(wp) :: angle = 0.0_wp        !! arc: direction from the centre to the first point [rad]
      real(wp) :: turn = 0.0_wp         !! arc: turn from the first to the last point [rad], > 0 counterclockwise
   end type piece_t

   !> A curve of consecutive pieces with a search tree of circles around them.
   type :: obstacle_curve_t
      type(piece_t), allocatable :: piece(:)
      logical :: closed = .false.       !! true: the last point is the first point, with the same tangent
      integer :: leaves = 0             !! number of leaves of the tree, a power of 2
      real(wp), allocatable :: ball(:, :) !! (3, 2 leaves - 1) centre (x, y) and radius of a circle around tree node k, whose
      !! children are 2 k and 2 k + 1; radius < 0: empty
      real(wp) :: point(2, 2) = 0.0_wp  !! first and last point of the curve
      real(wp) :: tangent(2, 2) = 0.0_wp !! unit tangents at the first and last point, in the direction of the curve
      real(wp), allocatable :: start(:) !! (pieces + 1) arc length at the first point of each piece, and at the end of the curve
      real(wp), allocatable :: turned(:) !! (pieces + 1) turn of the curve to the left, from its first point to the same points
      !! [rad]
      logical, allocatable :: jumps(:)  !! (0:pieces) true: the curvature jumps at the end of piece i
      real(wp) :: abscissa(n_gauss) = 0.0_wp, weight(n_gauss) = 0.0_wp !! quadrature rule of arc_length
   end type obstacle_curve_t

   real(wp), parameter :: smooth = 1.0e-9_wp !! smallest jump of curvature times piece length that counts; it is far above the
   !! rounding in splines

   !> A point of a curve with its direction and curvature.
   type :: foot_t
      real(wp) :: point(2) = 0.0_wp
      real(wp) :: tangent(2) = 0.0_wp   !! unit tangent
      real(wp) :: curvature = 0.0_wp    !! curvature, > 0 if the curve turns to the left
      integer :: piece = 0              !! number of the piece; 0 and pieces + 1: the straight continuations
      real(wp) :: t = 0.0_wp !! parameter on the piece; on a continuation: distance from the end along the curve, with sign
   end type foot_t

contains

   !> Straight piece between two points.
   pure type(piece_t) function straight_piece(first, second) result(piece)
      real(wp), intent(in) :: first(2), second(2)
      piece%c(:, 1) = first
      piece%c(:, 2) = second - first
   end function straight_piece

   !> Circular arc; `angle` is the direction from the centre to the first point [rad], `turn` the turn from the first to the last
   !> point [rad], > 0 counterclockwise.
   pure type(piece_t) function arc_piece(centre, radius, angle, turn) result(piece)
      real(wp), intent(in) :: centre(2), radius, angle, turn
      piece%shape = shape_arc
      piece%centre = centre
      piece%radius = radius
      piece%angle = angle
      piece%turn = turn
   end function arc_piece

   !> The quintic with coefficients c and parameter 0 to 1, divided into pieces that turn little.
   pure function quintic_pieces(c) result(pieces)
      real(wp), intent(in) :: c(2, 6)
      type(piece_t), allocatable :: pieces(:)
      real(wp) :: leg(2, 5), d(2, 0:5), h, turn
      integer :: i, k, n
      ! The curve turns by at most the sum of the turns between the sides of its control polygon.
      leg = legs(c)
      turn = sum([(abs(angle_between(leg(:, k), leg(:, k + 1))), k=1, 4)])
      n = 2 + int(turn / (0.5_wp * piece_turn))
      h = 1.0_wp / n
      allocate (pieces(n))
      do i = 1, n
         d = polynomial_at(c, (i - 1) * h)
         pieces(i)%shape = shape_quintic
         do k = 0, 5
            pieces(i)%c(:, k + 1) = d(:, k) * h**k / factorial(k)
         end do
      end do
   end function quintic_pieces

   !> Sides of the control polygon of a quintic, times 5: the coefficients of the quintic's derivative in Bernstein polynomials.
   pure function legs(c) result(leg)
      real(wp), intent(in) :: c(2, 6)
      real(wp) :: leg(2, 5)
      ! The coefficients are binomial(i, k)/binomial(4, k) times k + 1, row i from 0, column k.
      leg(:, 1) = c(:, 2)
      leg(:, 2) = leg(:, 1) + 0.5_wp * c(:, 3)
      leg(:, 3) = c(:, 2) + c(:, 3) + 0.5_wp * c(:, 4)
      leg(:, 4) = c(:, 2) + 1.5_wp * c(:, 3) + 1.5_wp * c(:, 4) + c(:, 5)
      leg(:, 5) = c(:, 2) + 2 * c(:, 3) + 3 * c(:, 4) + 4 * c(:, 5) + 5 * c(:, 6)
   end function legs

   !> Value and derivatives 1 to 5 of a polynomial with respect to its parameter.
   pure function polynomial_at(c, t) result(d)
      real(wp), intent(in) :: c(2, 6)     !! coefficients of the polynomial, see piece_t
      real(wp), intent(in) :: t
      real(wp) :: d(2, 0:5)
      call first_derivatives(c, t, d(:, 0), d(:, 1), d(:, 2))
      d(:, 3) = 6 * c(:, 4) + t * (24 * c(:, 5) + t * 60 * c(:, 6))
      d(:, 4) = 24 * c(:, 5) + t * 120 * c(:, 6)
      d(:, 5) = 120 * c(:, 6)
   end function polynomial_at

   !> Value and first two derivatives of a polynomial.
   pure subroutine first_derivatives(c, t, x, d, dd)
      real(wp), intent(in) :: c(2, 6), t   !! coefficients of the polynomial, see piece_t; parameter
      real(wp), intent(out) :: x(2), d(2), dd(2) !! position and derivatives by t
      x = c(:, 1) + t * (c(:, 2) + t * (c(:, 3) + t * (c(:, 4) + t * (c(:, 5) + t * c(:, 6)))))
      d = c(:, 2) + t * (2 * c(:, 3) + t * (3 * c(:, 4) + t * (4 * c(:, 5) + t * 5 * c(:, 6))))
      dd = 2 * c(:, 3) + t * (6 * c(:, 4) + t * (12 * c(:, 5) + t * 20 * c(:, 6)))
   end subroutine first_derivatives

   !> Joins pieces to a curve. Each piece must begin at the end of the previous piece, with the same tangent.
   pure function join_pieces(pieces, closed) result(curve)
      type(piece_t), intent(in) :: pieces(:)
      logical, intent(in) :: closed     !! true: the last piece ends where the first one begins, with the same tangent
      type(obstacle_curve_t) :: curve
      type(foot_t) :: first, last
      integer :: i
      curve%piece = pieces
      curve%closed = closed
      first = piece_point(pieces(1), 0.0_wp)
      last = piece_point(pieces(size(pieces)), 1.0_wp)
      curve%point = reshape([first%point, last%point], [2, 2])
      curve%tangent = reshape([first%tangent, last%tangent], [2, 2])
      curve%leaves = 1
      do while (curve%leaves < size(pieces))
         curve%leaves = 2 * curve%leaves
      end do
      call gauss_points(n_gauss, curve%abscissa, curve%weight)
      allocate (curve%start(size(pieces) + 1), curve%turned(size(pieces) + 1), source=0.0_wp)
      do i = 1, size(pieces)
         curve%start(i + 1) = curve%start(i) + arc_length(curve, i, 1.0_wp)
         curve%turned(i + 1) = curve%turned(i) + turned_angle(curve, i, 1.0_wp)
      end do
      allocate (curve%jumps(0:size(pieces)))
      do i = 0, size(pieces)
         curve%jumps(i) = curvature_jumps(curve, i)
      end do
      allocate (curve%ball(3, 2 * curve%leaves - 1), source=-1.0_wp)
      do i = 1, size(pieces)
         curve%ball(:, curve%leaves + i - 1) = piece_ball(pieces(i))
      end do
      do i = curve%leaves - 1, 1, -1
         curve%ball(:, i) = ball_around(curve%ball(:, 2 * i), curve%ball(:, 2 * i + 1))
      end do
   end function join_pieces

   !> True if the curvature jumps between piece i and the next piece. Pieces 0 and size + 1 are the straight continuations; on a
   !> closed curve they are its last and its first piece.
   pure logical function curvature_jumps(curve, i) result(jumps)
      type(obstacle_curve_t), intent(in) :: curve
      integer, intent(in) :: i
      type(foot_t) :: before, after         ! undefined: the straight continuation
      real(wp) :: length
      integer :: n, left, right             ! number of pieces; pieces on both sides, 0 and n + 1: none
      n = size(curve%piece)
      left = i
      right = i + 1
      if (curve%closed .and. left == 0) left = n
      if (curve%closed .and. right > n) right = 1
      length = 0.0_wp
      if (left > 0) then
         before = piece_point(curve%piece(left), 1.0_wp)
         length = curve%start(left + 1) - curve%start(left)
      end if
      if (right <= n) then
         after = piece_point(curve%piece(right), 0.0_wp)
         length = max(length, curve%start(right + 1) - curve%start(right))
      end if
      jumps = abs(after%curvature - before%curvature) * length > smooth
   end function curvature_jumps

   !> Nearest point to x on the curve and its straight continuations.
   pure type(foot_t) function nearest_point(curve, x) result(foot)
      type(obstacle_curve_t), intent(in) :: curve
      real(wp), intent(in) :: x(2) !! point in the plane
      real(wp) :: best, along, least(2), waiting(2 * bit_size(1))
      integer :: stack(2 * bit_size(1)), top, k, near, i
      type(foot_t) :: candidate
      best = huge(best)
      do i = 1, merge(0, 2, curve%closed)
         along = dot_product(x - curve%point(:, i), curve%tangent(:, i))
         if (i == 1) along = -along
         if (along < 0.0_wp) cycle
         if (i == 1) along = -along
         candidate = foot_t(curve%point(:, i) + along * curve%tangent(:, i), curve%tangent(:, i), &
            & piece=merge(0, size(curve%piece) + 1, i == 1), t=along)
         call keep_nearer(x, candidate, foot, best)
      end do
      top = 1
      stack(1) = 1
      waiting(1) = least_square(1)
      do while (top > 0)
         k = stack(top)
         top = top - 1
         ! No point of this tree node can be nearer than the best point found so far.
         if (waiting(top + 1) >= best) cycle
         if (k >= curve%leaves) then
            candidate = piece_foot(curve%piece(k - curve%leaves + 1), x)
            candidate%piece = k - curve%leaves + 1
            call keep_nearer(x, candidate, foot, best)
            cycle
         end if
         ! The nearer child is examined first: its result often excludes the other child.
         least = [least_square(2 * k), least_square(2 * k + 1)]
         near = merge(1, 2, least(1) <= least(2))
         stack(top + 1:top + 2) = 2 * k - 1 + [3 - near, near]
         waiting(top + 1:top + 2) = [least(3 - near), least(near)]
         top = top + 2
      end do

   contains

      !> Lower bound of the squared distance to the points of a tree node; < 0 inside its circle, huge for an empty node.
      pure real(wp) function least_square(node)
         integer, intent(in) :: node
         least_square = huge(best)
         associate (ball => curve%ball(:, node))
            if (ball(3) < 0.0_wp) return
            least_square = sqrt((x(1) - ball(1))**2 + (x(2) - ball(2))**2) - ball(3)
         end associate
         least_square = sign(least_square**2, least_square)
      end function least_square
   end function nearest_point

   !> Of two points, keeps the one nearer to x.
   pure subroutine keep_nearer(x, candidate, foot, best)
      real(wp), intent(in) :: x(2)
      type(foot_t), intent(in) :: candidate
      type(foot_t), intent(inout) :: foot
      real(wp), intent(inout) :: best      !! squared distance from x to `foot`
      real(wp) :: square
      square = dot_product(x - candidate%point, x - candidate%point)
      if (square >= best) return
      best = square
      foot = candidate
   end subroutine keep_nearer

   !> Position, direction and curvature at a parameter of a piece.
   pure type(foot_t) function piece_point(piece, t) result(foot)
      type(piece_t), intent(in) :: piece
      real(wp), intent(in) :: t
      real(wp) :: angle, d(2), dd(2), speed
      if (piece%shape == shape_arc) then
         angle = piece%angle + t * piece%turn
         d = [cos(angle), sin(angle)]
         foot%point = piece%centre + piece%radius * d
         foot%tangent = sign(1.0_wp, piece%turn) * [-d(2), d(1)]
         foot%curvature = sign(1.0_wp, piece%turn) / piece%radius
         return
      end if
      call first_derivatives(piece%c, t, foot%point, d, dd)
      speed = norm2(d)
      foot%tangent = d / speed
      if (piece%shape == shape_straight) return
      foot%curvature = (foot%tangent(1) * dd(2) - foot%tangent(2) * dd(1)) / speed**2
   end function piece_point

   !> Nearest point to x on a piece, including its ends.
   pure type(foot_t) function piece_foot(piece, x) result(foot)
      type(piece_t), intent(in) :: piece
      real(wp), intent(in) :: x(2)
      real(wp) :: d(2), first(2), t
      select case (piece%shape)
      case (shape_straight)
         t = dot_product(x - piece%c(:, 1), piece%c(:, 2)) / dot_product(piece%c(:, 2), piece%c(:, 2))
         t = min(max(t, 0.0_wp), 1.0_wp)
      case (shape_arc)
         ! Angles are measured from the middle of the arc, so that the jump of atan2 is on the opposite side of the circle.
         d = x - piece%centre
         first = [cos(piece%angle + 0.5_wp * piece%turn), sin(piece%angle + 0.5_wp * piece%turn)]
         t = 0.5_wp
         if (any(abs(d) > 0.0_wp)) t = 0.5_wp + atan2(first(1) * d(2) - first(2) * d(1), dot_product(first, d)) / piece%turn
         t = min(max(t, 0.0_wp), 1.0_wp)
      case default
         t = nearest_parameter(piece%c, x)
      end select
      foot = piece_point(piece, t)
      foot%t = t
   end function piece_foot

   !> Arc length along piece i from its first point to parameter t (for straight and circular pieces t may be any number).
   pure real(wp) function arc_length(curve, i, t) result(length)
      type(obstacle_curve_t), intent(in) :: curve !! curve with its pieces and quadrature rule
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      real(wp), dimension(n_gauss) :: s, dx, dy
      associate (piece => curve%piece(i), c => curve%piece(i)%c)
         select case (piece%shape)
         case (shape_straight)
            length = t * norm2(piece%c(:, 2))
         case (shape_arc)
            length = t * abs(piece%turn) * piece%radius
         case default
            s = t * curve%abscissa
            dx = c(1, 2) + s * (2 * c(1, 3) + s * (3 * c(1, 4) + s * (4 * c(1, 5) + s * 5 * c(1, 6))))
            dy = c(2, 2) + s * (2 * c(2, 3) + s * (3 * c(2, 4) + s * (4 * c(2, 5) + s * 5 * c(2, 6))))
            length = t * sum(curve%weight * sqrt(dx**2 + dy**2))
         end select
      end associate
   end function arc_length

   !> Turn [rad] of piece i to the left from its first point to parameter t.
   pure real(wp) function turned_angle(curve, i, t) result(angle)
      type(obstacle_curve_t), intent(in) :: curve
      integer, intent(in) :: i !! number of the piece
      real(wp), intent(in) :: t !! parameter, 0 to 1
      real(wp) :: x(2), d(2), dd(2)
      angle = 0.0_wp
      associate (piece => curve%piece(i))
         if (piece%shape == shape_arc) angle = t * piece%turn
         if (piece%shape /= shape_quintic) return
         call first_derivatives(piece%c, t, x, d, dd)
         angle = angle_between(piece%c(:, 2), d)
      end associate
   end function turned_angle

   !> Parameter of the point on a quintic piece that is nearest to x: the zero of the derivative of half the squared distance.
   pure real(wp) function nearest_parameter(c, x) result(t)
      real(wp), intent(in) :: c(2, 6), x(2)
      real(wp) :: low, high, f, slope, q(2), d(2), dd(2), ends(2), next
      integer :: iteration
      ends(1) = dot_product(c(:, 1) - x, c(:, 2))
      call first_derivatives(c, 1.0_wp, q, d, dd)
      q = q - x
      ends(2) = dot_product(q, d)
      if (ends(1) >= 0.0_wp .or. ends(2) <= 0.0_wp) then
         t = 0.0_wp
         if (ends(1) < 0.0_wp) t = 1.0_wp
         if (ends(1) >= 0.0_wp .and. ends(2) <= 0.0_wp .and. dot_product(q, q) < dot_product(c(:, 1) - x, c(:, 1) - x)) t = 1.0_wp
         return
      end if
      low = 0.0_wp
      high = 1.0_wp
      t = ends(1) / (ends(1) - ends(2))
      do iteration = 1, 60
         call first_derivatives(c, t, q, d, dd)
         q = q - x
         f = dot_product(q, d)
         if (f < 0.0_wp) then
            low = t
         else
            high = t
         end if
         slope = dot_product(d, d) + dot_product(q, dd)
         next = 0.5_wp * (low + high)
         if (slope > 0.0_wp) then
            next = t - f / slope
            if (next < low .or. next > high) next = 0.5_wp * (low + high)
         end if
         if (abs(next - t) <= 2 * epsilon(t)) exit
         t = next
      end do
   end function nearest_parameter

   !> Angle from one direction to another [rad], > 0 counterclockwise.
   pure real(wp) function angle_between(a, b)
      real(wp), intent(in) :: a(2), b(2)
      angle_between = 0.0_wp
      if (any(abs(a) > 0.0_wp) .and. any(abs(b) > 0.0_wp)) angle_between = atan2(a(1) * b(2) - a(2) * b(1), dot_product(a, b))
   end function angle_between

   !> Centre and radius of a circle around a piece. (Arcs are at most half circles.)
   pure function piece_ball(piece) result(ball)
      type(piece_t), intent(in) :: piece
      real(wp) :: ball(3), polygon(2, 6), leg(2, 5)
      type(foot_t) :: first, last
      integer :: k
      first = piece_point(piece, 0.0_wp)
      last = piece_point(piece, 1.0_wp)
      ball(1:2) = 0.5_wp * (first%point + last%point)
      ball(3) = 0.5_wp * norm2(last%point - first%point)
      if (piece%shape == shape_quintic) then
         leg = legs(piece%c)
         polygon(:, 1) = piece%c(:, 1)
         do k = 1, 5
            polygon(:, k + 1) = polygon(:, k) + leg(:, k) / 5
         end do
         ball(3) = sqrt(maxval((polygon(1, :) - ball(1))**2 + (polygon(2, :) - ball(2))**2))
      end if
      ball(3) = ball(3) * (1.0_wp + 1.0e-9_wp)
   end function piece_ball

   !> Smallest circle around two circles.
   pure function ball_around(a, b) result(ball)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: ball(3), distance
      ball = a
      if (b(3) < 0.0_wp) return
      distance = norm2(b(1:2) - a(1:2))
      if (a(3) >= distance + b(3)) return
      ball = b
      if (a(3) < 0.0_wp .or. b(3) >= distance + a(3)) return
      ball(3) = 0.5_wp * (distance + a(3) + b(3))
      ball(1:2) = a(1:2) + (ball(3) - a(3)) / distance * (b(1:2) - a(1:2))
   end function ball_around

   !> Points along the curve, close enough to draw it.
   pure function curve_samples(curve) result(points)
      type(obstacle_curve_t), intent(in) :: curve
      real(wp), allocatable :: points(:, :)   !! (2, samples) positions
      type(foot_t), allocatable :: foot(:)
      integer :: i
      foot = feet(curve)
      allocate (points(2, size(foot)))
      do i = 1, size(foot)
         points(:, i) = foot(i)%point
      end do
   end function curve_samples

   !> Samples of a curve with their directions and curvatures.
   pure function feet(curve) result(foot)
      type(obstacle_curve_t), intent(in) :: curve
      type(foot_t), allocatable :: foot(:)
      integer :: i, k, n, total
      total = 1
      do i = 1, size(curve%piece)
         total = total + parts(curve%piece(i))
      end do
      allocate (foot(total))
      foot(1) = piece_point(curve%piece(1), 0.0_wp)
      total = 1
      do i = 1, size(curve%piece)
         n = parts(curve%piece(i))
         do k = 1, n
            foot(total + k) = piece_point(curve%piece(i), real(k, wp) / n)
         end do
         total = total + n
      end do

   contains

      pure integer function parts(piece)
         type(piece_t), intent(in) :: piece
         parts = 1
         if (piece%shape == shape_arc) parts = 1 + int(abs(piece%turn) / sample_turn)
         if (piece%shape == shape_quintic) parts = 1 + nint(piece_turn / sample_turn)
      end function parts
   end function feet

   !> Largest turn [rad] of the curve to the right (against the structure) within a given length along it.
   pure real(wp) function sharpest_turn(curve, length) result(sharpest)
      type(obstacle_curve_t), intent(in) :: curve
      real(wp), intent(in) :: length !! length along the curve
      type(foot_t), allocatable :: foot(:)
      real(wp), allocatable :: s(:), turn(:)  ! arc length and turn from the first sample on
      integer, allocatable :: least(:)        ! samples that may have the least turn within the length, in their order
      integer :: k, first, last
      foot = feet(curve)
      if (curve%closed) foot = [foot, foot(2:)]
      allocate (s(size(foot)), turn(size(foot)), least(size(foot)))
      s(1) = 0.0_wp
      turn(1) = 0.0_wp
      sharpest = 0.0_wp
      first = 1
      last = 0
      do k = 1, size(foot)
         if (k > 1) then
            s(k) = s(k - 1) + norm2(foot(k)%point - foot(k - 1)%point)
            turn(k) = turn(k - 1) - angle_between(foot(k - 1)%tangent, foot(k)%tangent)
         end if
         do while (first <= last)
            if (s(k) - s(least(first)) <= length) exit
            first = first + 1
         end do
         if (first <= last) sharpest = max(sharpest, turn(k) - turn(least(first)))
         do while (last >= first)
            if (turn(least(last)) < turn(k)) exit
            last = last - 1
         end do
         last = last + 1
         least(last) = k
      end do
   end function sharpest_turn

   !> True if the curve, with its straight continuations unless it is closed, intersects itself: it then does not divide the plane
   !> in two.
   !>
   !> A tree of boxes around the segments excludes pairs that cannot intersect; the cost is almost proportional to the number of
   !> segments.
   pure logical function crosses_itself(curve) result(crosses)
      type(obstacle_curve_t), intent(in) :: curve
      real(wp), parameter :: far = 1.0e4_wp !! length of the straight continuations, over the size of the curve
      real(wp), allocatable :: p(:, :), inner(:, :), box(:, :)
      integer, allocatable :: stack(:, :), more(:, :)
      real(wp) :: size_
      integer :: i, n, leaves, top, a, b
      inner = curve_samples(curve)
      n = size(inner, 2)
      if (curve%closed) then
         p = inner
         n = n - 2
      else
         size_ = norm2(maxval(inner, 2) - minval(inner, 2))
         allocate (p(2, n + 2))
         p(:, 2:n + 1) = inner
         p(:, 1) = curve%point(:, 1) - far * size_ * curve%tangent(:, 1)
         p(:, n + 2) = curve%point(:, 2) + far * size_ * curve%tangent(:, 2)
      end if
      ! Tree node k has the children 2 k and 2 k + 1; segment i is the leaf leaves + i - 1.
      leaves = 1
      do while (leaves < n + 1)
         leaves = 2 * leaves
      end do
      allocate (box(4, 2 * leaves - 1), source=huge(size_))
      box(3:4, :) = -huge(size_)
      do i = 1, n + 1
         box(:, leaves + i - 1) = [min(p(:, i), p(:, i + 1)), max(p(:, i), p(:, i + 1))]
      end do
      do i = leaves - 1, 1, -1
         box(1:2, i) = min(box(1:2, 2 * i), box(1:2, 2 * i + 1))
         box(3:4, i) = max(box(3:4, 2 * i), box(3:4, 2 * i + 1))
      end do
      crosses = .false.
      allocate (stack(2, 256))
      top = 1
      stack(:, 1) = 1
      do while (top > 0)
         a = stack(1, top)
         b = stack(2, top)
         top = top - 1
         if (any(box(1:2, a) > box(3:4, b)) .or. any(box(1:2, b) > box(3:4, a))) cycle
         if (a >= leaves) then
            ! Both tree nodes are single segments. Neighbouring segments share a point, which does not count as an intersection.
            if (b - a < 2 .or. (curve%closed .and. b - a == n)) cycle
            i = a - leaves + 1
            crosses = segments_meet(p(:, i), p(:, i + 1), p(:, i + b - a), p(:, i + b - a + 1))
            if (crosses) return
            cycle
         end if
         if (top + 4 > size(stack, 2)) then
            allocate (more(2, 2 * size(stack, 2)))
            more(:, :top) = stack(:, :top)
            call move_alloc(more, stack)
         end if
         stack(:, top + 1) = [2 * a, 2 * b]
         stack(:, top + 2) = [2 * a, 2 * b + 1]
         stack(:, top + 3) = [2 * a + 1, 2 * b + 1]
         top = top + 3
         if (a == b) cycle
         top = top + 1
         stack(:, top) = [2 * a + 1, 2 * b]
      end do
   end function crosses_itself

   !> True if the segments ab and cd have a common point.
   pure logical function segments_meet(a, b, c, d) result(meet)
      real(wp), intent(in) :: a(2), b(2), c(2), d(2)
      integer :: i
      meet = .false.
      do i = 1, 2
         if (max(a(i), b(i)) < min(c(i), d(i)) .or. max(c(i), d(i)) < min(a(i), b(i))) return
      end do
      meet = side(a, b, c) * side(a, b, d) <= 0.0_wp .and. side(c, d, a) * side(c, d, b) <= 0.0_wp

   contains

      !> Side of the line pq on which point r is: 1 left, -1 right, 0 within rounding.
      pure real(wp) function side(p, q, r)
         real(wp), intent(in) :: p(2), q(2), r(2)
         side = (q(1) - p(1)) * (r(2) - p(2)) - (q(2) - p(2)) * (r(1) - p(1))
         if (abs(side) <= 1.0e-12_wp * norm2(q - p) * norm2(r - p)) side = 0.0_wp
         side = sign(merge(1.0_wp, 0.0_wp, abs(side) > 0.0_wp), side)
      end function side
   end function segments_meet
end module obstacle_curve
