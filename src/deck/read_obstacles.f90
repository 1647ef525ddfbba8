!> Reads *OBSTACLE and *FOUNDATION LAW, and *OBSTACLE MOTION of the steps.
module read_obstacles
   use kinds, only: wp, degree
   use text, only: to_text
   use model, only: model_t, load_t, law_t
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, obstacle_spline, &
      & ground_independent, ground_half_space, ground_pasternak
   use obstacle_curve, only: crosses_itself
   use obstacle_shapes, only: arc_curve, polyline_curve, spline_curve, corner_turn, widest_corner_radius, &
      default_corner_radius
   use checked_deck, only: checked_deck_t, cursor_t
   implicit none
   private
   public :: read_foundation_law_cards, read_obstacle_cards, read_motion

   real(wp), parameter :: half_turn = 180.0_wp       !! [degrees] largest turn of an arc
   real(wp), parameter :: back = 175.0_wp            !! [degrees] larger turns at a corner are rejected: the curve would reverse

contains

   !> Reads the laws.
   subroutine read_foundation_law_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! receives the names of the laws
      type(model_t), intent(inout) :: model             !! receives law
      type(cursor_t) :: at
      type(law_t) :: law
      logical :: ok
      allocate (model%law(0))
      do while (deck%next_card(at, 'FOUNDATION LAW'))
         call deck%define(at, deck%names%law, deck%text(at, 'NAME'), ok)
         if (.not. ok) cycle
         law = law_t()
         allocate (law%penetration(0), law%force(0))
         law%name = deck%text(at, 'NAME')
         if (deck%lines_sound(at)) call read_law(deck, at, law)
         model%law = [model%law, law]
      end do
   end subroutine read_foundation_law_cards

   !> Reads the points of a law; only the first error is reported.
   subroutine read_law(deck, at, law)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(inout) :: at
      type(law_t), intent(inout) :: law
      real(wp) :: penetration, force
      integer :: n
      do while (deck%next_line(at))
         penetration = deck%real(at, 'penetration')
         force = deck%real(at, 'force')
         n = size(law%force)
         if (n == 0) then
            if (abs(penetration) > 0.0_wp) then
               call deck%wrong(at, 'penetration', 'the first point of a law is 0, 0')
               return
            else if (abs(force) > 0.0_wp) then
               call deck%wrong(at, 'force', 'the first point of a law is 0, 0')
               return
            end if
         else if (.not. penetration > law%penetration(n)) then
            call deck%wrong(at, 'penetration', 'penetrations must rise from line to line')
            return
         else if (n == 1 .and. .not. force > 0.0_wp) then
            call deck%wrong(at, 'force', 'the force must rise from 0 at first; for a clearance use GAP of *CONTACT')
            return
         else if (force < law%force(n)) then
            call deck%wrong(at, 'force', 'forces must not fall: a foundation that softens is not available')
            return
         end if
         law%penetration = [law%penetration, penetration]
         law%force = [law%force, force]
      end do
   end subroutine read_law

   !> Reads the obstacles.
   subroutine read_obstacle_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with the laws; receives the names of the obstacles
      type(model_t), intent(inout) :: model             !! receives obstacle
      type(cursor_t) :: at
      type(obstacle_t) :: obstacle
      logical :: ok
      allocate (model%obstacle(0))
      do while (deck%next_card(at, 'OBSTACLE'))
         call deck%define(at, deck%names%obstacle, deck%text(at, 'NAME'), ok)
         if (.not. ok) cycle
         obstacle = obstacle_t()
         obstacle%name = deck%text(at, 'NAME')
         obstacle%bilateral = deck%given(at, 'BILATERAL')
         call read_foundation(deck, at, obstacle)
         ok = deck%lines_sound(at)
         if (ok) call check_ground(deck, at, obstacle, ok)
         if (ok) call read_shape(deck, at, obstacle, ok)
         if (.not. ok) then
            ! An invalid obstacle is replaced by one for which gaps can be computed, so that cards that refer to it are still
            ! checked.
            deck%names%obstacle%incomplete = .true.
            obstacle%kind = obstacle_line
            obstacle%point = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], [2, 2])
         end if
         model%obstacle = [model%obstacle, obstacle]
      end do
   end subroutine read_obstacle_cards

   !> Reads kind and constants of the foundation.
   subroutine read_foundation(deck, at, obstacle)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      type(obstacle_t), intent(inout) :: obstacle
      real(wp) :: width
      width = deck%real(at, 'WIDTH')
      obstacle%rigid = deck%word(at, 'FOUNDATION') == 'RIGID'
      select case (deck%word(at, 'FOUNDATION'))
      case ('WINKLER')
         obstacle%modulus = deck%real(at, 'MODULUS') * width
      case ('PASTERNAK')
         obstacle%ground = ground_pasternak
         obstacle%width = width
         obstacle%modulus = deck%real(at, 'MODULUS') * width
         obstacle%shear = deck%real(at, 'SHEAR') * width
      case ('HALF SPACE')
         obstacle%ground = ground_half_space
         obstacle%width = width
         obstacle%young = deck%real(at, 'YOUNG')
         obstacle%poisson = deck%real(at, 'POISSON')
      case ('LAW')
         obstacle%width = width
         obstacle%law = deck%named(at, 'LAW', deck%names%law, 'foundation law')
      end select
   end subroutine read_foundation

   !> Checks the requirements of coupled ground.
   subroutine check_ground(deck, at, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      type(obstacle_t), intent(in) :: obstacle
      logical, intent(out) :: ok
      ok = obstacle%ground == ground_independent .or. deck%word(at, 'TYPE') == 'LINE'
      if (.not. ok) call deck%wrong(at, 'FOUNDATION', deck%word(at, 'FOUNDATION')// &
         ' needs TYPE=LINE: it carries load along a plane surface')
      if (obstacle%ground /= ground_half_space .or. deck%given(at, 'WIDTH')) return
      call deck%wrong(at, 'FOUNDATION', 'HALF SPACE needs WIDTH, of the strip that presses on it')
      ok = .false.
   end subroutine check_ground

   !> Reads kind, position and size.
   subroutine read_shape(deck, card, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: card                !! all its data lines are sound
      type(obstacle_t), intent(inout) :: obstacle
      logical, intent(out) :: ok
      type(cursor_t) :: at
      at = card
      ok = deck%next_line(at)
      select case (deck%word(at, 'TYPE'))
      case ('LINE')
         obstacle%kind = obstacle_line
         obstacle%point = reshape([deck%real(at, 'x1'), deck%real(at, 'y1'), deck%real(at, 'x2'), deck%real(at, 'y2')], [2, 2])
         ok = norm2(obstacle%point(:, 2) - obstacle%point(:, 1)) > 0.0_wp
         if (.not. ok) call deck%wrong_line(at, 'both points are at the same place')
      case ('CIRCLE')
         obstacle%kind = obstacle_circle
         obstacle%inside = deck%word(at, 'SIDE') == 'INSIDE'
         call read_centre()
      case ('ARC')
         obstacle%kind = obstacle_arc
         call read_centre()
         call read_arc(deck, at, obstacle, ok)
      case ('POLYLINE')
         obstacle%kind = obstacle_polyline
         call read_points(deck, card, obstacle%point, ok)
         if (ok) call read_polyline(deck, card, obstacle, ok)
      case ('SPLINE')
         obstacle%kind = obstacle_spline
         call read_points(deck, card, obstacle%point, ok)
         if (ok) obstacle%curve = spline_curve(obstacle%point)
      end select
      if (.not. ok .or. .not. allocated(obstacle%curve%piece)) return
      ok = .not. crosses_itself(obstacle%curve)
      if (.not. ok) call deck%wrong(at, 'TYPE', 'the obstacle, which goes on straight beyond both ends, meets itself')

   contains

      subroutine read_centre()
         obstacle%centre = [deck%real(at, 'xc'), deck%real(at, 'yc')]
         obstacle%radius = deck%real(at, 'radius')
         obstacle%reference_angle = deck%real(at, 'REFERENCE') * degree
      end subroutine read_centre
   end subroutine read_shape

   !> Reads both angles of an arc.
   subroutine read_arc(deck, at, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      type(obstacle_t), intent(inout) :: obstacle
      logical, intent(out) :: ok
      real(wp) :: angle(2), turn
      angle = [deck%real(at, 'start'), deck%real(at, 'end')]
      turn = abs(angle(2) - angle(1))
      obstacle%angle = angle * degree
      ok = .false.
      if (.not. turn > 0.0_wp) then
         call deck%wrong(at, 'end', 'the arc ends where it starts')
      else if (turn > half_turn) then
         call deck%wrong(at, 'end', 'the arc turns by '//to_text(turn)//' degrees; beyond 180 its straight continuations meet')
      else
         ok = .true.
         obstacle%curve = arc_curve(obstacle%centre, obstacle%radius, obstacle%angle(1), obstacle%angle(2))
      end if
   end subroutine read_arc

   !> Reads the points of a polyline or spline; neighbouring points must be different.
   subroutine read_points(deck, card, point, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: card
      real(wp), allocatable, intent(out) :: point(:, :)
      logical, intent(out) :: ok
      type(cursor_t) :: at
      integer :: i
      ok = .true.
      allocate (point(2, card%n_lines))
      at = card
      i = 0
      do while (deck%next_line(at))
         i = i + 1
         point(:, i) = [deck%real(at, 'x'), deck%real(at, 'y')]
         if (i == 1) cycle
         if (norm2(point(:, i) - point(:, i - 1)) > 0.0_wp) cycle
         call deck%wrong_line(at, 'the point is at the place of the one before')
         ok = .false.
      end do
   end subroutine read_points

   !> Reads the corner radius of a polyline.
   subroutine read_polyline(deck, card, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: card
      type(obstacle_t), intent(inout) :: obstacle       !! with its points
      logical, intent(out) :: ok
      real(wp) :: widest
      integer :: i
      ok = .true.
      do i = 2, size(obstacle%point, 2) - 1
         if (abs(corner_turn(obstacle%point, i)) < back * degree) cycle
         call deck%wrong_line(deck%at_line(card%line + i), 'the polyline turns back at this point')
         ok = .false.
      end do
      if (.not. ok) return
      widest = widest_corner_radius(obstacle%point)
      obstacle%radius = default_corner_radius(obstacle%point)
      if (deck%given(card, 'RADIUS')) obstacle%radius = deck%real(card, 'RADIUS')
      ok = obstacle%radius / (1.0_wp + 4 * epsilon(widest)) <= widest ! widest is huge without corners
      if (ok) then
         obstacle%curve = polyline_curve(obstacle%point, min(obstacle%radius, widest))
      else
         call deck%wrong(card, 'RADIUS', 'corners of this radius do not fit between the points; at most '// &
            to_text(rounded_down(widest)))
      end if
   end subroutine read_polyline

   !> The number x rounded down to 4 significant digits.
   real(wp) function rounded_down(x)
      real(wp), intent(in) :: x
      character(16) :: buffer
      write (buffer, '(es16.3e3)') x * (1.0_wp - 5.0e-4_wp)
      read (buffer, *) rounded_down
   end function rounded_down

   !> Reads a line of *OBSTACLE MOTION: obstacle, dx, dy.
   subroutine read_motion(deck, at, load)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      type(load_t), intent(inout) :: load
      integer :: obstacle
      obstacle = deck%named(at, 'obstacle', deck%names%obstacle, 'obstacle')
      if (obstacle == 0) return
      load%motion(:, obstacle) = load%motion(:, obstacle) + [deck%real(at, 'dx'), deck%real(at, 'dy')]
   end subroutine read_motion
end module read_obstacles
