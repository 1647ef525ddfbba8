!> Gap function of the obstacles: value, gradient and curvature at a point.
module obstacle_geometry
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp, degree
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc
   use obstacle_curve, only: foot_t, nearest_point
   implicit none
   private
   public :: has_angle, nearest_piece, joints_apart
   public :: obstacle_gap, moved_gap, contact_angle, turns_forward, unwrap_angle, contact_curvature

contains

   !> Distance of a point to the obstacle, > 0 on the free side. The Hessian of the gap is bend * (tangent tangent^T).
   pure subroutine obstacle_gap(obstacle, x, gap, normal, bend)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2) !! point in the axes of the obstacle
      real(wp), intent(out) :: gap !! distance to the surface [length], < 0 inside the obstacle
      real(wp), intent(out) :: normal(2)   !! unit gradient of the gap, pointing to the free side
      real(wp), intent(out) :: bend        !! curvature of the gap function along the tangent
      type(foot_t) :: foot
      real(wp) :: d(2), r
      select case (obstacle%kind)
      case (obstacle_line)
         d = obstacle%point(:, 2) - obstacle%point(:, 1)
         d = d / norm2(d)
         normal = [-d(2), d(1)]
         gap = dot_product(x - obstacle%point(:, 1), normal)
         bend = 0.0_wp
      case (obstacle_circle)
         d = x - obstacle%centre
         r = norm2(d)
         if (r > 0.0_wp) then
            d = d / r
            bend = 1.0_wp / r
         else
            d = [1.0_wp, 0.0_wp]
            bend = 0.0_wp
         end if
         normal = d
         gap = r - obstacle%radius
         if (obstacle%inside) then
            normal = -d
            gap = -gap
            bend = -bend
         end if
      case default
         ! The normal is that of the curve: for a small gap the direction from the nearest point to x would be undetermined.
         foot = nearest_point(obstacle%curve, x)
         normal = [-foot%tangent(2), foot%tangent(1)]
         gap = dot_product(x - foot%point, normal)
         ! If the gap equals the radius of curvature, the nearest point is not unique; the curvature is then set to zero.
         r = 1.0_wp - foot%curvature * gap
         bend = 0.0_wp
         if (r > epsilon(r)) bend = -foot%curvature / r
      end select
   end subroutine obstacle_gap

   !> Change of a point's gap caused by a motion, with the normal and the curvature after the motion. For lines and circles the
   !> change has the rounding error of the motion, not of the positions; a stiff foundation would multiply the rounding error of
   !> positions.
   pure subroutine moved_gap(obstacle, home, motion, at_home, change, normal, bend)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: home(2), motion(2) !! position before the motion; displacement
      real(wp), intent(out) :: at_home     !! gap before the motion
      real(wp), intent(out) :: change      !! change of the gap
      real(wp), intent(out) :: normal(2), bend !! unit normal and curvature after the motion, see obstacle_gap
      real(wp) :: gap, d(2)
      call obstacle_gap(obstacle, home, at_home, normal, bend)
      call obstacle_gap(obstacle, home + motion, gap, normal, bend)
      select case (obstacle%kind)
      case (obstacle_line)
         change = dot_product(motion, normal)
      case (obstacle_circle)
         d = home - obstacle%centre
         change = 0.0_wp
         if (norm2(d) + norm2(d + motion) > 0.0_wp) &
            & change = dot_product(2.0_wp * d + motion, motion) / (norm2(d) + norm2(d + motion))
         if (obstacle%inside) change = -change
      case default
         change = gap - at_home
      end select
   end subroutine moved_gap

   !> Number of the piece of an obstacle's curve that is nearest to a point (foot_t); 0 for lines and circles.
   pure integer function nearest_piece(obstacle, x) result(piece)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2) !! point in the axes of the obstacle
      type(foot_t) :: foot
      piece = 0
      if (.not. allocated(obstacle%curve%piece)) return
      foot = nearest_point(obstacle%curve, x)
      piece = foot%piece
   end function nearest_piece

   !> Number of joints between two pieces of an obstacle's curve; on a closed curve in the direction with fewer joints.
   pure integer function joints_apart(obstacle, first, last) result(joints)
      type(obstacle_t), intent(in) :: obstacle
      integer, intent(in) :: first, last   !! numbers of the pieces, from nearest_piece
      joints = abs(last - first)
      if (obstacle%curve%closed) joints = min(joints, size(obstacle%curve%piece) - joints)
   end function joints_apart

   !> True for an obstacle with angles about a centre, by which contact is reported.
   pure logical function has_angle(obstacle)
      type(obstacle_t), intent(in) :: obstacle
      has_angle = obstacle%kind == obstacle_circle .or. obstacle%kind == obstacle_arc
   end function has_angle

   !> Direction from the centre to a point, in degrees from the reference direction, in (-180, 180]; NaN for an obstacle without
   !> angles.
   pure real(wp) function contact_angle(obstacle, x) result(angle)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2)             !! position in the axes of the obstacle
      real(wp) :: d(2), c, s
      angle = ieee_value(angle, ieee_quiet_nan)
      if (.not. has_angle(obstacle)) return
      d = x - obstacle%centre
      c = cos(obstacle%reference_angle)
      s = sin(obstacle%reference_angle)
      angle = atan2(c * d(2) - s * d(1), c * d(1) + s * d(2)) / degree
   end function contact_angle

   !> True if the contact angle increases along a rod through point x in direction `tangent`.
   pure logical function turns_forward(obstacle, x, tangent)
      type(obstacle_t), intent(in) :: obstacle !! obstacle with angles
      real(wp), intent(in) :: x(2), tangent(2) !! position in the axes of the obstacle; unit direction of the rod
      real(wp) :: d(2)
      d = x - obstacle%centre
      turns_forward = d(1) * tangent(2) - d(2) * tangent(1) > 0.0_wp
   end function turns_forward

   !> Adds full turns to the angle at the end of a contact region, so that it differs from the angle at the start by about length
   !> over radius, forward or backward. Nothing is changed for an obstacle without angles.
   pure subroutine unwrap_angle(obstacle, length, forward, start, end)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: length           !! stress-free length of the contact region
      logical, intent(in) :: forward           !! true: the angle increases
      real(wp), intent(in) :: start            !! angle at the start of the region [degrees]
      real(wp), intent(inout) :: end           !! angle at the end of the region [degrees]; in: between -180 and 180
      real(wp) :: span
      if (.not. has_angle(obstacle)) return
      span = length / obstacle%radius / degree
      if (.not. forward) span = -span
      end = end + 360.0_wp * anint((start + span - end) / 360.0_wp)
   end subroutine unwrap_angle

   !> Curvature d(angle)/ds of a rod that lies on the obstacle, passes through x and has the direction `tangent` there.
   pure real(wp) function contact_curvature(obstacle, x, tangent) result(curvature)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2)         !! point on the surface, or on a curve at constant distance from it
      real(wp), intent(in) :: tangent(2)   !! unit direction of the rod
      real(wp) :: gap, normal(2), bend
      call obstacle_gap(obstacle, x, gap, normal, bend)
      curvature = -bend
      ! The free side lies to the left of (n_y, -n_x).
      if (normal(2) * tangent(1) - normal(1) * tangent(2) < 0.0_wp) curvature = bend
   end function contact_curvature
end module obstacle_geometry
