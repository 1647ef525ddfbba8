!> Gap function of the obstacles: value, gradient and curvature at a point.
module obstacle_geometry
   use kinds, only: wp, degree
   use model, only: obstacle_t
   implicit none
   private
   public :: obstacle_gap, contact_angle, contact_curvature

contains

   !> Signed distance to the obstacle, positive on the free side; hessian = bend * (tangent tangent^T).
   pure subroutine obstacle_gap(obstacle, x, gap, normal, bend)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2)
      real(wp), intent(out) :: gap
      real(wp), intent(out) :: normal(2)   !! unit gradient, towards the free side
      real(wp), intent(out) :: bend        !! curvature of the gap function along the tangent
      real(wp) :: d(2), r
      if (obstacle%is_circle) then
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
      else
         d = obstacle%point(:, 2) - obstacle%point(:, 1)
         d = d / norm2(d)
         normal = [-d(2), d(1)]
         gap = dot_product(x - obstacle%point(:, 1), normal)
         bend = 0.0_wp
      end if
   end subroutine obstacle_gap

   !> Direction of a point seen from the circle's centre, in degrees from the reference direction, in (-180, 180].
   pure real(wp) function contact_angle(obstacle, x) result(angle)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2)
      real(wp) :: d(2), c, s
      d = x - obstacle%centre
      c = cos(obstacle%reference_angle)
      s = sin(obstacle%reference_angle)
      angle = atan2(c * d(2) - s * d(1), c * d(1) + s * d(2)) / degree
   end function contact_angle

   !> Curvature d(angle)/ds that a rod running along the obstacle at point x in direction `tangent` would have.
   pure real(wp) function contact_curvature(obstacle, x, tangent) result(curvature)
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: x(2)         !! on the surface
      real(wp), intent(in) :: tangent(2)
      real(wp) :: d(2)
      curvature = 0.0_wp
      if (.not. obstacle%is_circle) return
      d = x - obstacle%centre
      curvature = sign(1.0_wp / norm2(d), d(1) * tangent(2) - d(2) * tangent(1))
   end function contact_curvature
end module obstacle_geometry
