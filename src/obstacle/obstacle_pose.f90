!> Present position of an obstacle: a rigid body that is displaced and rotated about a pivot.
!>
!> A point X of the body, in the axes in which the deck gives its shape, is at x = c + d + R (X - c), with the pivot c, the
!> displacement d of the pivot and the rotation matrix R. Gaps, curvatures and lengths along the track are the same in the axes of
!> the body; directions rotate with R.
module obstacle_pose
   use kinds, only: wp
   use obstacle_track, only: track_t
   implicit none
   private
   public :: pose_t, rigid_motion, about_pivot

   type :: pose_t
      real(wp) :: shift(2) = 0.0_wp         !! displacement of the pivot
      real(wp) :: pivot(2) = 0.0_wp         !! position of the pivot before the displacement
      real(wp) :: turn = 0.0_wp             !! rotation, counterclockwise [rad]
   contains
      procedure :: own_place, own_motion, own_direction, direction, place, placed, arm
   end type pose_t

contains

   !> Position in the axes of the body of a point given in space.
   pure function own_place(self, x) result(own)
      class(pose_t), intent(in) :: self
      real(wp), intent(in) :: x(2)
      real(wp) :: own(2)
      own = x - self%shift
      own = own + turned_less(-self%turn, own - self%pivot)
   end function own_place

   !> Displacement of a point relative to the body, own_place(home + motion) - home, without the rounding error of positions.
   pure function own_motion(self, home, motion) result(own)
      class(pose_t), intent(in) :: self
      real(wp), intent(in) :: home(2), motion(2)
      real(wp) :: own(2)
      own = motion - self%shift
      own = own + turned_less(-self%turn, home - self%pivot + own)
   end function own_motion

   !> Components, in the axes of the body, of a vector given in space.
   pure function own_direction(self, v) result(own)
      class(pose_t), intent(in) :: self
      real(wp), intent(in) :: v(2)
      real(wp) :: own(2)
      own = v + turned_less(-self%turn, v)
   end function own_direction

   !> Vector in space that has given components in the axes of the body.
   pure function direction(self, own) result(v)
      class(pose_t), intent(in) :: self
      real(wp), intent(in) :: own(2)
      real(wp) :: v(2)
      v = own + turned_less(self%turn, own)
   end function direction

   !> Position in space of a point given in the axes of the body.
   pure function place(self, own) result(x)
      class(pose_t), intent(in) :: self
      real(wp), intent(in) :: own(2)
      real(wp) :: x(2)
      x = own + self%shift + turned_less(self%turn, own - self%pivot)
   end function place

   !> Point of the track in space. Arc lengths, curvatures and numbers of pieces are unchanged.
   pure type(track_t) function placed(self, own) result(track)
      class(pose_t), intent(in) :: self
      type(track_t), intent(in) :: own         !! point of the track in the axes of the body
      track = own
      track%place = own%place + self%shift
      if (.not. abs(self%turn) > 0.0_wp) return
      track%place = self%place(own%place)
      track%tangent = self%direction(own%tangent)
   end function placed

   !> Vector from the pivot to a point in space.
   pure function arm(self, x)
      class(pose_t), intent(in) :: self
      real(wp), intent(in) :: x(2)
      real(wp) :: arm(2)
      arm = x - self%shift - self%pivot
   end function arm

   !> Matrix from the displacements and the rotation of a body's pivot (columns) to the motion of a point of the body (rows).
   pure function rigid_motion(arm) result(motion)
      real(wp), intent(in) :: arm(2)           !! vector from the pivot to the point
      real(wp) :: motion(3, 3)
      motion = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, -arm(2), arm(1), 1.0_wp], [3, 3])
   end function rigid_motion

   !> A force at a point, expressed as force and moment about the pivot.
   pure function about_pivot(arm, force) result(both)
      real(wp), intent(in) :: arm(2)           !! vector from the pivot to the point
      real(wp), intent(in) :: force(2)         !! force at the point
      real(wp) :: both(3)
      both = [force, arm(1) * force(2) - arm(2) * force(1)]
   end function about_pivot

   !> (R - 1) v for the rotation matrix R, in a form without cancellation; exactly zero without rotation.
   pure function turned_less(turn, v) result(change)
      real(wp), intent(in) :: turn, v(2)
      real(wp) :: change(2), half
      change = 0.0_wp
      if (.not. abs(turn) > 0.0_wp) return
      half = 0.5_wp * turn
      change = (2.0_wp * sin(half)) * [-sin(half) * v(1) - cos(half) * v(2), cos(half) * v(1) - sin(half) * v(2)]
   end function turned_less
end module obstacle_pose
