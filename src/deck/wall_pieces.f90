!> Walls of several obstacles. If obstacles join, the contacts of a rod with them, one behind the other along the rod, become one
!> contact with the whole wall. Contact then passes the joint without a change. Forces are still reported for each obstacle: on the
!> part of the rod that its own *CONTACT names.
!>
!> Obstacles are pieces of one wall if the second begins at the end of the first with the same direction, or both are the same
!> straight line (join_obstacles). Their surfaces are joined to one curve, so that a rod that passes the joint neither leaves a
!> surface nor touches a new one.
module wall_pieces
   use kinds, only: wp
   use model, only: model_t, contact_t, contact_part_t, elements_among
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle
   use obstacle_curve, only: join_pieces
   implicit none
   private
   public :: join_walls, join_obstacles

contains

   !> Joins those contacts of a model that may act anywhere along the rod.
   subroutine join_walls(model)
      type(model_t), intent(inout) :: model
      integer :: k, j
      logical :: joined
      do k = 1, size(model%contact)
         j = k + 1
         do while (k < size(model%contact) .and. j <= size(model%contact))
            joined = may_join(model, k, j)
            if (joined) call join(model, k, j, joined)
            ! A longer wall may reach contacts that the shorter one did not reach.
            j = merge(k + 1, j + 1, joined)
         end do
      end do
   end subroutine join_walls

   !> True if two contacts are equal in everything except obstacle and nodes, and meet at a node between two elements.
   logical function may_join(model, k, j)
      type(model_t), intent(in) :: model
      integer, intent(in) :: k, j
      logical :: first(model%mesh%n_nodes)      ! true: a node of the first contact
      integer :: s
      associate (one => model%contact(k), other => model%contact(j))
         may_join = one%along .and. other%along .and. one%obstacle /= other%obstacle .and. &
            & .not. abs(one%gap - other%gap) > 0.0_wp .and. &
            & model%obstacle(one%obstacle)%carrier == model%obstacle(other%obstacle)%carrier
         if (.not. may_join) return
         first = .false.
         first(one%node) = .true.
         may_join = any(first(other%node)) .and. .not. &
            & any(elements_among(model%mesh, one%node) .and. elements_among(model%mesh, other%node))
         ! An obstacle that the deck moves or reports separately needs its own contacts.
         do s = 1, size(model%step)
            associate (load => model%step(s)%load, o => [one%obstacle, other%obstacle])
               may_join = may_join .and. .not. (any(abs(load%motion(:, o(1)) - load%motion(:, o(2))) > 0.0_wp) .or. &
                  & abs(load%closing(o(1)) - load%closing(o(2))) > 0.0_wp .or. any(abs(load%resolved(o)) > 0.0_wp))
            end associate
            may_join = may_join .and. .not. &
               & any(model%step(s)%limit_curve%obstacle == one%obstacle) .and. .not. &
               & any(model%step(s)%limit_curve%obstacle == other%obstacle)
         end do
         may_join = may_join .and. .not. &
            & any(model%contact_print%obstacle == one%obstacle .or. model%contact_print%obstacle == other%obstacle)
      end associate
   end function may_join

   !> Makes contact j a part of contact k, if their obstacles are pieces of one wall.
   subroutine join(model, k, j, joined)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: k, j
      logical, intent(out) :: joined
      type(obstacle_t) :: one, other
      type(contact_part_t), allocatable :: part(:)
      logical :: known(model%mesh%n_nodes)
      integer :: i
      one = model%obstacle(model%contact(k)%obstacle)
      other = model%obstacle(model%contact(j)%obstacle)
      call join_obstacles(one, other, norm2(maxval(model%mesh%x, 2) - minval(model%mesh%x, 2)), joined)
      if (.not. joined) return
      part = [parts(model%contact(k)), parts(model%contact(j))]
      model%obstacle(model%contact(k)%obstacle) = one
      model%obstacle(model%contact(j)%obstacle) = other
      do i = 1, size(part)
         model%obstacle(part(i)%obstacle)%curve = one%curve
      end do
      known = .false.
      known(model%contact(k)%node) = .true.
      model%contact(k)%node = [model%contact(k)%node, pack(model%contact(j)%node, .not. known(model%contact(j)%node))]
      model%contact(k)%part = part
      model%contact = [model%contact(:j - 1), model%contact(j + 1:)]
   end subroutine join

   !> Parts of a contact; a contact that was not joined is its only part.
   function parts(contact) result(part)
      type(contact_t), intent(in) :: contact
      type(contact_part_t), allocatable :: part(:)
      if (allocated(contact%part)) then
         part = contact%part
      else
         allocate (part(1))
         part(1)%obstacle = contact%obstacle
         part(1)%node = contact%node
      end if
   end function parts

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
      real(wp), intent(in) :: point(2), tangent(2), other_point(2), other_tangent(2), size
      real(wp), parameter :: rounded = 1.0e-8_wp !! tolerance for equal points and directions; decks give eight digits or more
      meet = norm2(other_point - point) <= rounded * size .and. norm2(other_tangent - tangent) <= rounded
   end function meet
end module wall_pieces
