!> Track of an obstacle: the curve at a constant distance from its surface on the free side, along which the axis of a rod in line
!> contact runs. The free side is to the left of the track. The track has the direction from the first to the second point of a
!> line, and the direction of a curve; it is counterclockwise inside circles and clockwise around them.
!>
!> With the curvature k (> 0 to the left) and arc length s of the surface, the track at the distance d has
!>   d(sigma) = (1 - k d) ds,   curvature k / (1 - k d),   its derivatives by sigma by the chain rule,
!> so that sigma = s - d * (turn of the surface to the left). The track exists only if d is smaller than the radius of every turn to
!> the left.
!>
!> The curvature of the track may jump at joints of arcs and straight pieces. To follow the track across such a joint a rod would
!> need a couple of EI times the jump, which a one-sided obstacle cannot exert. The rod therefore bridges the joint, see
!> lifted_node.
module obstacle_track
   use kinds, only: wp, pi
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle
   use obstacle_curve, only: foot_t, nearest_point, piece_point, shape_quintic, arc_length, turned_angle, polynomial_at, &
      & first_derivatives
   implicit none
   private
   public :: joints_between, joint_distance, track_t, track_foot, track_at, across_joint, track_ahead, track_between

   !> A point of the track.
   type :: track_t
      real(wp) :: sigma = 0.0_wp !! arc length of the track: for lines and curves from the first point; for circles the angle from
      !! the x axis times the radius of the track, increasing in the direction of the track
      real(wp) :: place(2) = 0.0_wp
      real(wp) :: tangent(2) = 0.0_wp        !! unit tangent; the free side is on its left
      real(wp) :: curvature = 0.0_wp         !! d(angle)/d(sigma), > 0 if the track turns to the left
      real(wp) :: curvature_rate = 0.0_wp    !! first derivative of the curvature by sigma
      real(wp) :: curvature_second = 0.0_wp  !! second derivative of the curvature by sigma
      integer :: piece = 0                   !! number of the piece of a curve, see foot_t
      real(wp) :: averaged = 0.0_wp !! for argument `near` of track_at: mean curvature of an interval minus the curvature of the
      !! interval's piece (track_between)
   end type track_t

   real(wp), parameter :: at_joint = 1.0e-6_wp !! distance from a joint, as part of an interval of the track, up to which an end of
   !! the interval counts as at the joint

contains

   !> Point of the track nearest to x, in the axes of the obstacle.
   pure type(track_t) function track_foot(obstacle, offset, x) result(track)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset      !! distance of the track from the surface, > 0 towards the free side
      real(wp), intent(in) :: x(2)        !! point in the axes of the obstacle
      type(foot_t) :: foot
      real(wp) :: d(2)
      select case (obstacle%kind)
      case (obstacle_line)
         d = obstacle%point(:, 2) - obstacle%point(:, 1)
         d = d / norm2(d)
         track = on_line(obstacle, offset, dot_product(x - obstacle%point(:, 1), d))
      case (obstacle_circle)
         d = x - obstacle%centre
         if (.not. any(abs(d) > 0.0_wp)) d = [1.0_wp, 0.0_wp]
         track = on_circle(obstacle, offset, circle_sense(obstacle) * track_radius(obstacle, offset) * atan2(d(2), d(1)), &
            & d / hypot(d(1), d(2)))
      case default
         foot = nearest_point(obstacle%curve, x)
         track = on_piece(obstacle, offset, foot%piece, foot%t)
         track%sigma = piece_start(obstacle, offset, foot%piece) + piece_length(obstacle, offset, foot%piece, foot%t)
      end select
   end function track_foot

   !> Point of the track at arc length sigma. On closed curves the numbers of pieces continue from turn to turn, in both directions.
   !>
   !> On curves the search starts on the piece of `near` and passes to a neighbouring piece only if the curvature does not jump
   !> there (quintic pieces). Otherwise the piece is continued beyond its end, straight or circular, so that nothing jumps within
   !> Newton's method. In an interval with a jump (track_between) only the curvature is that of the piece; position and direction
   !> are those of the track.
   pure type(track_t) function track_at(obstacle, offset, sigma, near) result(track)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset !! distance of the track from the surface
      real(wp), intent(in) :: sigma  !! arc length of the track
      type(track_t), intent(in) :: near   !! a point of the piece on which the search starts, see track_between
      type(track_t) :: on
      real(wp) :: angle
      select case (obstacle%kind)
      case (obstacle_line)
         track = on_line(obstacle, offset, sigma)
      case (obstacle_circle)
         angle = circle_sense(obstacle) * sigma / track_radius(obstacle, offset)
         track = on_circle(obstacle, offset, sigma, [cos(angle), sin(angle)])
      case default
         track = walk_to(obstacle, offset, sigma, near%piece, .false.)
         if (.not. abs(near%averaged) > 0.0_wp) return
         on = walk_to(obstacle, offset, sigma, near%piece, .true.)
         track%place = on%place
         track%tangent = on%tangent
         track%curvature = track%curvature + near%averaged
      end select
   end function track_at

   !> Point of a curve's track at arc length sigma, found by passing from piece to piece.
   pure type(track_t) function walk_to(obstacle, offset, sigma, from, everywhere) result(track)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset, sigma
      integer, intent(in) :: from         !! number of the piece on which the search starts
      logical, intent(in) :: everywhere !! true: the search passes to any piece; false: not to a piece with a different curvature,
      !! and the last piece is continued instead
      real(wp) :: along                   ! sigma, within half a round of the beginning of the first piece
      integer :: i
      i = from
      along = sigma
      associate (n => size(obstacle%curve%piece), closed => obstacle%curve%closed)
         if (closed) then
            associate (half => 0.5_wp * round_length(obstacle, offset), start => piece_start(obstacle, offset, from))
               if (abs(sigma - start) > half) along = start - half + modulo(sigma - start + half, 2 * half)
            end associate
         end if
         ! In a diverging iterate sigma may be any number, or none.
         do while (i > 0 .or. closed)
            if (.not. along < piece_start(obstacle, offset, i)) exit
            if (jumps_behind(obstacle, i - 1) .and. .not. everywhere) exit
            i = i - 1
         end do
         do while (i <= n .or. closed)
            if (.not. along > piece_start(obstacle, offset, i + 1)) exit
            if (jumps_behind(obstacle, i) .and. .not. everywhere) exit
            i = i + 1
         end do
      end associate
      track = on_piece(obstacle, offset, i, piece_parameter(obstacle, offset, i, along))
      track%sigma = sigma
   end function walk_to

   !> Arc length from one point of the track to another, with sign; on circles and closed curves in the shorter direction.
   pure real(wp) function track_ahead(obstacle, offset, from, to) result(ahead)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset !! distance of the track from the surface
      type(track_t), intent(in) :: from, to
      real(wp) :: round
      ahead = to%sigma - from%sigma
      round = round_length(obstacle, offset)
      if (round > 0.0_wp) ahead = ahead - round * anint(ahead / round)
   end function track_ahead

   !> Length of one turn around a closed track; 0 if the track is not closed.
   pure real(wp) function round_length(obstacle, offset) result(round)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      round = 0.0_wp
      if (obstacle%kind == obstacle_circle) round = 2 * pi * track_radius(obstacle, offset)
      if (.not. obstacle%curve%closed) return
      associate (n => size(obstacle%curve%piece))
         round = obstacle%curve%start(n + 1) - offset * obstacle%curve%turned(n + 1)
      end associate
   end function round_length

   !> A point of a closed curve, with arc length and piece number of the turn to which another point belongs.
   pure type(track_t) function same_round(obstacle, offset, track, near) result(same)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      type(track_t), intent(in) :: track, near
      integer :: rounds
      same = track
      if (.not. obstacle%curve%closed) return
      rounds = nint((track%sigma - near%sigma) / round_length(obstacle, offset))
      same%sigma = track%sigma - rounds * round_length(obstacle, offset)
      same%piece = track%piece - rounds * size(obstacle%curve%piece)
   end function same_round

   !> Piece of the curve with a given number, which may belong to any turn around a closed curve.
   pure integer function piece_of(obstacle, number) result(i)
      type(obstacle_t), intent(in) :: obstacle
      integer, intent(in) :: number
      i = number
      if (.not. obstacle%curve%closed .or. (number >= 1 .and. number <= size(obstacle%curve%piece))) return
      i = 1 + modulo(number - 1, size(obstacle%curve%piece))
   end function piece_of

   !> True if the curvature jumps at the end of a piece.
   pure logical function jumps_behind(obstacle, number) result(jumps)
      type(obstacle_t), intent(in) :: obstacle
      integer, intent(in) :: number !! number of the piece, in any turn; on open curves 0 is the straight continuation before the
      !! curve
      jumps = obstacle%curve%jumps(piece_of(obstacle, number))
   end function jumps_behind

   !> A point for the argument `near` of track_at. It is on the piece that contains the middle of the track interval between two
   !> given points, because end points at a joint may belong to either piece. If the curvature jumps inside the interval, the
   !> curvature of the piece is shifted so that the interval turns by its true angle. The curvature, and with it the moment of a rod
   !> along the interval, is then a continuous function of the end points, even if one of them passes the joint.
   pure type(track_t) function track_between(obstacle, offset, first, last) result(between)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset !! distance of the track from the surface
      type(track_t), intent(in) :: first, last
      real(wp) :: middle, joint
      type(track_t) :: other
      real(wp) :: ends(2)
      integer :: i
      between = first
      other = same_round(obstacle, offset, last, first)
      if (first%piece == other%piece) return
      middle = 0.5_wp * (first%sigma + other%sigma)
      ends = [min(first%sigma, other%sigma), max(first%sigma, other%sigma)]
      between%piece = min(first%piece, other%piece)
      do i = min(first%piece, other%piece) + 1, max(first%piece, other%piece)
         joint = piece_start(obstacle, offset, i)
         if (middle > joint) between%piece = i
         if (.not. (ends(1) < joint .and. joint < ends(2))) cycle
         between%averaged = between%averaged + jump_at(obstacle, offset, i) * &
            & ((ends(2) - joint) / (ends(2) - ends(1)) - merge(1.0_wp, 0.0_wp, middle > joint))
      end do
   end function track_between

   !> A point of the track, expressed as a point of the piece (or straight continuation) beyond the nearest joint with a jump of
   !> curvature; the point itself if no such joint is within the given distance.
   pure type(track_t) function across_joint(obstacle, offset, track, reach) result(other)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset !! distance of the track from the surface
      type(track_t), intent(in) :: track
      real(wp), intent(in) :: reach       !! largest distance to the joint along the track
      real(wp) :: nearest, away
      integer :: side, i, next
      other = track
      if (.not. allocated(obstacle%curve%piece)) return
      nearest = reach
      next = track%piece
      do side = 0, 1
         i = track%piece - 1 + side
         if (.not. obstacle%curve%closed .and. (i < 0 .or. i > size(obstacle%curve%piece))) cycle
         if (.not. jumps_behind(obstacle, i)) cycle
         away = abs(piece_start(obstacle, offset, i + 1) - track%sigma)
         if (away > nearest) cycle
         nearest = away
         next = merge(i, i + 1, side == 0)
      end do
      if (next == track%piece) return
      other = on_piece(obstacle, offset, next, piece_parameter(obstacle, offset, next, track%sigma))
      other%sigma = track%sigma
   end function across_joint

   !> Joints inside an interval of the track, as increasing fractions of the interval's length from its first point. Joints at the
   !> ends of the interval are not included.
   pure subroutine joints_between(obstacle, offset, first, last, share, jump)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset             !! distance of the track from the surface
      type(track_t), intent(in) :: first, last   !! ends of the interval, in either order
      real(wp), allocatable, intent(out) :: share(:) !! (joints) fractions, 0 to 1
      real(wp), allocatable, intent(out), optional :: jump(:) !! (joints) jump of the track's curvature, in the direction of the
      !! track
      type(track_t) :: other
      integer, allocatable :: behind(:)          ! number of the piece behind each joint
      integer :: i
      other = same_round(obstacle, offset, last, first)
      if (first%piece == other%piece) then
         allocate (share(0))
         if (present(jump)) allocate (jump(0))
         return
      end if
      behind = [(i, i=min(first%piece, other%piece) + 1, max(first%piece, other%piece))]
      share = [((piece_start(obstacle, offset, behind(i)) - first%sigma) / (other%sigma - first%sigma), i=1, size(behind))]
      behind = pack(behind, share > at_joint .and. share < 1.0_wp - at_joint)
      share = pack(share, share > at_joint .and. share < 1.0_wp - at_joint)
      if (first%piece > other%piece) then
         behind = behind(size(behind):1:-1)
         share = share(size(share):1:-1)
      end if
      if (present(jump)) jump = [(jump_at(obstacle, offset, behind(i)), i=1, size(behind))]
   end subroutine joints_between

   !> Jump of the track's curvature at the beginning of a piece; 0 if it is within the rounding of splines.
   pure real(wp) function jump_at(obstacle, offset, number) result(jump)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      integer, intent(in) :: number       !! number of the piece, in any turn
      type(track_t) :: before, behind
      jump = 0.0_wp
      if (.not. jumps_behind(obstacle, number - 1)) return
      before = on_piece(obstacle, offset, number - 1, merge(1.0_wp, 0.0_wp, piece_of(obstacle, number - 1) > 0))
      behind = on_piece(obstacle, offset, number, 0.0_wp)
      jump = behind%curvature - before%curvature
   end function jump_at

   !> Distance along the track from one of its points to the nearest joint with a jump of curvature at an end of the point's piece;
   !> huge if there is none.
   pure real(wp) function joint_distance(obstacle, offset, track) result(distance)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset !! distance of the track from the surface
      type(track_t), intent(in) :: track
      integer :: i
      distance = huge(distance)
      if (.not. allocated(obstacle%curve%piece)) return
      do i = track%piece, track%piece + 1
         if (.not. obstacle%curve%closed .and. (i < 1 .or. i > size(obstacle%curve%piece) + 1)) cycle
         if (jumps_behind(obstacle, i - 1)) distance = min(distance, abs(piece_start(obstacle, offset, i) - track%sigma))
      end do
   end function joint_distance

   pure type(track_t) function on_line(obstacle, offset, sigma) result(track)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset, sigma
      real(wp) :: d(2)
      d = obstacle%point(:, 2) - obstacle%point(:, 1)
      d = d / norm2(d)
      track%sigma = sigma
      track%place = obstacle%point(:, 1) + sigma * d + offset * [-d(2), d(1)]
      track%tangent = d
   end function on_line

   pure type(track_t) function on_circle(obstacle, offset, sigma, d) result(track)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset, sigma
      real(wp), intent(in) :: d(2)        !! unit vector from the centre to the point
      real(wp) :: r, sense
      sense = circle_sense(obstacle)
      r = track_radius(obstacle, offset)
      track%sigma = sigma
      track%place = obstacle%centre + r * d
      track%tangent = sense * [-d(2), d(1)]
      track%curvature = sense / r
   end function on_circle

   !> 1 if the track is counterclockwise, -1 if clockwise.
   pure real(wp) function circle_sense(obstacle)
      type(obstacle_t), intent(in) :: obstacle
      circle_sense = merge(1.0_wp, -1.0_wp, obstacle%inside)
   end function circle_sense

   pure real(wp) function track_radius(obstacle, offset)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      track_radius = obstacle%radius - circle_sense(obstacle) * offset
   end function track_radius

   !> Arc length of the track at the beginning of piece i, 1 to pieces + 1; the continuation before the curve extends from 0
   !> backwards.
   pure real(wp) function piece_start(obstacle, offset, i) result(sigma)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      integer, intent(in) :: i
      integer :: k
      sigma = 0.0_wp
      if (i <= 0 .and. .not. obstacle%curve%closed) return
      k = piece_of(obstacle, i)
      sigma = obstacle%curve%start(k) - offset * obstacle%curve%turned(k)
      if (k /= i) sigma = sigma + ((i - k) / size(obstacle%curve%piece)) * round_length(obstacle, offset)
   end function piece_start

   !> Arc length of the track from the beginning of a piece, or of a continuation, to the point with parameter t.
   pure real(wp) function piece_length(obstacle, offset, i, t) result(length)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      integer :: k
      length = t
      k = piece_of(obstacle, i)
      if (k < 1 .or. k > size(obstacle%curve%piece)) return
      length = arc_length(obstacle%curve, k, t)
      if (abs(offset) > 0.0_wp) length = length - offset * turned_angle(obstacle%curve, k, t)
   end function piece_length

   !> Point of the track at parameter t of a piece; its arc length is not set.
   pure type(track_t) function on_piece(obstacle, offset, i, t) result(track)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      real(wp) :: k(0:2), d5(2, 0:5), stretch
      type(foot_t) :: foot
      integer :: e, which
      track%piece = i
      which = piece_of(obstacle, i)
      associate (curve => obstacle%curve)
         if (which < 1 .or. which > size(curve%piece)) then
            e = merge(1, 2, i < 1)
            track%tangent = curve%tangent(:, e)
            track%place = curve%point(:, e) + t * track%tangent + offset * [-track%tangent(2), track%tangent(1)]
            return
         end if
         k = 0.0_wp
         associate (piece => curve%piece(which))
            if (piece%shape == shape_quintic) then
               d5 = polynomial_at(piece%c, t)
               track%place = d5(:, 0)
               call polynomial_curvature(d5, track%tangent, k)
            else
               foot = piece_point(piece, t)
               track%place = foot%point
               track%tangent = foot%tangent
               k(0) = foot%curvature
            end if
         end associate
      end associate
      track%place = track%place + offset * [-track%tangent(2), track%tangent(1)]
      stretch = 1.0_wp - k(0) * offset
      track%curvature = k(0) / stretch
      track%curvature_rate = k(1) / stretch**3
      track%curvature_second = k(2) / stretch**4 + 3 * offset * k(1)**2 / stretch**5
   end function on_piece

   !> Direction of a polynomial piece, its curvature, and two derivatives of the curvature by the arc length.
   pure subroutine polynomial_curvature(d, tangent, k)
      real(wp), intent(in) :: d(2, 0:5)   !! derivatives of the position by the parameter
      real(wp), intent(out) :: tangent(2), k(0:2)
      real(wp) :: square, speed, growth, by_t, twice_by_t
      associate (d1 => d(:, 1), d2 => d(:, 2), d3 => d(:, 3), d4 => d(:, 4))
         square = dot_product(d1, d1)
         speed = sqrt(square)
         tangent = d1 / speed
         growth = dot_product(d1, d2) / square ! derivative of the speed by t, over the speed
         k(0) = cross(d1, d2) / (square * speed)
         by_t = cross(d1, d3) / (square * speed) - 3 * k(0) * growth
         twice_by_t = (cross(d2, d3) + cross(d1, d4) - 3 * growth * cross(d1, d3)) / (square * speed) - 3 * by_t * growth - &
            & 3 * k(0) * ((dot_product(d2, d2) + dot_product(d1, d3)) / square - 2 * growth**2)
         k(1) = by_t / speed
         k(2) = (twice_by_t - by_t * growth) / square
      end associate
   end subroutine polynomial_curvature

   !> Parameter of the point at arc length sigma on piece i or on a continuation.
   pure real(wp) function piece_parameter(obstacle, offset, i, sigma) result(t)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: offset
      integer, intent(in) :: i
      real(wp), intent(in) :: sigma
      ! Newton's method converges quadratically: if this step is smaller, the remaining error is below rounding.
      real(wp), parameter :: last_step = 1.0e-9_wp
      real(wp) :: local, step, square, x(2), d(2), dd(2)
      integer :: iteration, which
      which = piece_of(obstacle, i)
      local = sigma - piece_start(obstacle, offset, i)
      t = local
      associate (curve => obstacle%curve)
         if (which < 1 .or. which > size(curve%piece)) return
         if (curve%piece(which)%shape /= shape_quintic) then
            t = local / piece_length(obstacle, offset, i, 1.0_wp)
            return
         end if
         t = local / (curve%start(which + 1) - curve%start(which) - offset * (curve%turned(which + 1) - curve%turned(which)))
         do iteration = 1, 20
            call first_derivatives(curve%piece(which)%c, t, x, d, dd)
            square = dot_product(d, d)
            step = (local - piece_length(obstacle, offset, which, t)) / (sqrt(square) - offset * cross(d, dd) / square)
            t = t + step
            if (abs(step) <= last_step) exit
         end do
      end associate
   end function piece_parameter

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)
      cross = a(1) * b(2) - a(2) * b(1)
   end function cross
end module obstacle_track
