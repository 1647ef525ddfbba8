!> Obstacles that are pieces of one wall: the second begins at the end of the first with the same direction, or both are the same
!> straight line. Their surfaces are joined to one curve, so that a rod that passes the joint neither leaves a surface nor touches a
!> new one.
module joined_obstacles
   use kinds, only: wp
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle
   use obstacle_curve, only: join_pieces
   implicit none
   private
   public :: join_obstacles

contains

   !> Replaces the surfaces of two obstacles by that of the wall to which both belong. A straight line that touches the end of a
   !> curve counts as the straight continuation of this curve.
   pure subroutine join_obstacles(one, other, size, joined)
      type(obstacle_t), intent(inout) :: one, other
      real(wp), intent(in) :: size          !! length to which gaps between ends are related
      logical, intent(out) :: joined        !! false: the obstacles are not pieces of one wall, and are unchanged
      type(obstacle_t) :: wall
      wall = one
      joined = .not. any([one%kind, other%kind] == obstacle_circle)
      if (.not. joined) return
      if (one%kind == obstacle_line) then
         wall = other
         if (other%kind == obstacle_line) then
            joined = on_line(one, other%point(:, 1), other%point(:, 2) - other%point(:, 1), size)
         else
            joined = touches_end(one, other, size)
         end if
      else if (other%kind == obstacle_line) then
         joined = touches_end(other, one, size)
      else if (one%curve%closed .or. other%curve%closed) then
         joined = .false.
      else if (follows(one, other, size)) then
         wall%curve = join_pieces([one%curve%piece, other%curve%piece], follows(other, one, size))
      else if (follows(other, one, size)) then
         wall%curve = join_pieces([other%curve%piece, one%curve%piece], .false.)
      else
         joined = .false.
      end if
      if (.not. joined) return
      one = with_surface(one, wall)
      other = with_surface(other, wall)
   end subroutine join_obstacles

   !> An obstacle with the surface of a wall. It keeps the data of its own shape, which are written to the results.
   pure type(obstacle_t) function with_surface(obstacle, wall) result(new)
      type(obstacle_t), intent(in) :: obstacle, wall
      new = obstacle
      if (wall%kind == obstacle_line) then
         ! Lengths along both lines are measured from the same origin.
         new%point = wall%point
         return
      end if
      if (obstacle%kind == obstacle_line) then
         new = wall
         new%name = obstacle%name
      end if
      new%curve = wall%curve
   end function with_surface

   !> True if the second curve begins at the end of the first.
   pure logical function follows(first, second, size)
      type(obstacle_t), intent(in) :: first, second
      real(wp), intent(in) :: size
      follows = meet(first%curve%point(:, 2), first%curve%tangent(:, 2), second%curve%point(:, 1), second%curve%tangent(:, 1), size)
   end function follows

   !> True if an end of a curve lies on a straight line, in its direction.
   pure logical function touches_end(line, curve, size)
      type(obstacle_t), intent(in) :: line, curve
      real(wp), intent(in) :: size
      touches_end = .not. curve%curve%closed
      if (touches_end) touches_end = on_line(line, curve%curve%point(:, 1), curve%curve%tangent(:, 1), size) .or. &
         & on_line(line, curve%curve%point(:, 2), curve%curve%tangent(:, 2), size)
   end function touches_end

   !> True if a point is on a straight line and a direction is that of the line.
   pure logical function on_line(line, point, direction, size)
      type(obstacle_t), intent(in) :: line
      real(wp), intent(in) :: point(2), direction(2), size
      real(wp) :: d(2)
      d = line%point(:, 2) - line%point(:, 1)
      d = d / norm2(d)
      on_line = meet(line%point(:, 1) + dot_product(point - line%point(:, 1), d) * d, d, point, direction / norm2(direction), size)
   end function on_line

   !> True if two points and their unit directions are equal up to the rounding of decimal numbers in a deck.
   pure logical function meet(point, tangent, other_point, other_tangent, size)
      real(wp), intent(in) :: point(2), tangent(2), other_point(2), other_tangent(2)
      real(wp), intent(in) :: size
      real(wp), parameter :: rounded = 1.0e-8_wp !! tolerance for equal points and directions; decks give eight digits or more
      meet = norm2(other_point - point) <= rounded * size .and. norm2(other_tangent - tangent) <= rounded
   end function meet
end module joined_obstacles
