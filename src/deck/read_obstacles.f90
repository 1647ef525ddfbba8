!> Reads *OBSTACLE and *FOUNDATION LAW.
module read_obstacles
   use kinds, only: wp, degree
   use text, only: to_text
   use model, only: model_t, law_t
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, obstacle_spline, &
      & ground_independent, ground_half_space, ground_pasternak
   use obstacle_curve, only: crosses_itself
   use obstacle_shapes, only: arc_curve, ellipse_points, polyline_curve, misfit, spline_curve, corner_turn, widest_corner_radius, &
      & default_corner_radius, mirrored
   use checked_deck, only: checked_deck_t
   implicit none
   private
   public :: read_foundation_law_cards, read_obstacle_cards, end_spline

   real(wp), parameter :: half_turn = 180.0_wp       !! largest turn of an arc [degrees]
   real(wp), parameter :: back = 175.0_wp !! largest turn at a corner [degrees]; larger ones would reverse the curve and are
   !! rejected

contains

   !> Reads the force laws of foundations.
   subroutine read_foundation_law_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! out: with the names of the laws added
      type(model_t), intent(inout) :: model             !! out: with law added
      type(law_t) :: law
      do while (deck%next_card('FOUNDATION LAW'))
         if (.not. deck%defines(deck%names%law, deck%text('NAME'))) cycle
         law = law_t()
         allocate (law%penetration(0), law%force(0))
         law%name = deck%text('NAME')
         if (deck%lines_sound()) call read_law(deck, law)
         model%law = [model%law, law]
      end do
   end subroutine read_foundation_law_cards

   !> Reads the points of a law; only the first error is reported.
   subroutine read_law(deck, law)
      type(checked_deck_t), intent(inout) :: deck
      type(law_t), intent(inout) :: law
      real(wp) :: penetration, force, last
      integer :: n
      last = 0.0_wp
      do while (deck%next_line())
         penetration = deck%real('penetration')
         force = deck%real('force')
         n = size(law%force)
         if (n == 0 .and. abs(penetration) > 0.0_wp) then
            call deck%wrong('penetration', 'the first point of a law is 0, 0')
         else if (n == 0 .and. abs(force) > 0.0_wp) then
            call deck%wrong('force', 'the first point of a law is 0, 0')
         else if (n > 0 .and. .not. penetration > last) then
            call deck%wrong('penetration', 'penetrations must rise from line to line')
         else if (n == 1 .and. .not. force > 0.0_wp) then
            call deck%wrong('force', 'the force must rise from 0 at first; for a clearance use GAP of *CONTACT')
         else if (n > 1 .and. .not. force > 0.0_wp) then
            call deck%wrong('force', 'the force must stay above 0: contact ends where the penetration does, not where the law ends')
         else
            law%penetration = [law%penetration, penetration]
            law%force = [law%force, force]
            last = penetration
            cycle
         end if
         return
      end do
      n = size(law%force)
      if (law%force(n) < law%force(n - 1)) call deck%wrong('force', &
         'the force falls in the last line, and beyond it below 0; add a line with its residue')
   end subroutine read_law

   !> Reads the obstacles.
   subroutine read_obstacle_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains the laws; out: also the names of the obstacles
      type(model_t), intent(inout) :: model             !! out: with obstacle added
      type(obstacle_t) :: obstacle
      logical :: ok
      do while (deck%next_card('OBSTACLE'))
         if (.not. deck%defines(deck%names%obstacle, deck%text('NAME'))) cycle
         obstacle = obstacle_t()
         obstacle%name = deck%text('NAME')
         obstacle%bilateral = deck%given('BILATERAL')
         if (deck%given('NODE')) then
            obstacle%carrier = deck%node('NODE')
            if (obstacle%carrier > 0) deck%names%connected(obstacle%carrier) = .true.
         end if
         call read_foundation(deck, obstacle, ok)
         if (ok) call read_shape(deck, obstacle, ok)
         if (.not. ok) then
            ! An invalid obstacle is replaced by one for which gaps can be computed, so that cards that refer to it can still be
            ! checked.
            deck%names%obstacle%incomplete = .true.
            obstacle%kind = obstacle_line
            obstacle%point = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], [2, 2])
         end if
         model%obstacle = [model%obstacle, obstacle]
      end do
   end subroutine read_obstacle_cards

   !> Reads kind and constants of the obstacle's foundation.
   subroutine read_foundation(deck, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(obstacle_t), intent(inout) :: obstacle
      logical, intent(out) :: ok           ! false: the foundation is wrong, or a data line
      real(wp) :: width
      width = deck%real('WIDTH')
      obstacle%rigid = deck%word('FOUNDATION') == 'RIGID'
      select case (deck%word('FOUNDATION'))
      case ('WINKLER')
         obstacle%modulus = deck%real('MODULUS') * width
      case ('PASTERNAK')
         obstacle%ground = ground_pasternak
         obstacle%width = width
         obstacle%modulus = deck%real('MODULUS') * width
         obstacle%shear = deck%real('SHEAR') * width
      case ('HALF SPACE')
         obstacle%ground = ground_half_space
         obstacle%width = width
         obstacle%young = deck%real('YOUNG')
         obstacle%poisson = deck%real('POISSON')
      case ('LAW')
         obstacle%width = width
         obstacle%law = deck%named('LAW', deck%names%law, 'foundation law')
      end select
      ok = deck%lines_sound()
      if (.not. ok .or. obstacle%ground == ground_independent) return
      ok = deck%word('TYPE') == 'LINE'
      if (.not. ok) call deck%wrong('FOUNDATION', deck%word('FOUNDATION')// &
         ' needs TYPE=LINE: it carries load along a plane surface')
      if (obstacle%ground /= ground_half_space .or. deck%given('WIDTH')) return
      call deck%wrong('FOUNDATION', 'HALF SPACE needs WIDTH, of the strip that presses on it')
      ok = .false.
   end subroutine read_foundation

   !> Reads kind, position and size of the obstacle.
   subroutine read_shape(deck, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(obstacle_t), intent(inout) :: obstacle
      logical, intent(out) :: ok
      logical :: closed
      real(wp), allocatable :: radius(:) ! corner radii at the points of a polyline; 0: not given
      ok = deck%next_line()
      select case (deck%word('TYPE'))
      case ('LINE')
         obstacle%kind = obstacle_line
         obstacle%point = reshape([deck%real('x1'), deck%real('y1'), deck%real('x2'), deck%real('y2')], [2, 2])
         ok = norm2(obstacle%point(:, 2) - obstacle%point(:, 1)) > 0.0_wp
         if (.not. ok) call deck%wrong_line('both points are at the same place')
      case ('CIRCLE')
         obstacle%kind = obstacle_circle
         obstacle%inside = deck%word('SIDE') == 'INSIDE'
         call read_centre()
      case ('ARC')
         obstacle%kind = obstacle_arc
         call read_centre()
         obstacle%angle = [deck%real('start'), deck%real('end')] * degree
         associate (turn => abs(deck%real('end') - deck%real('start')))
            ok = turn > 0.0_wp .and. turn <= half_turn
            if (turn <= 0.0_wp) then
               call deck%wrong('end', 'the arc ends where it starts')
            else if (.not. ok) then
               call deck%wrong('end', 'the arc turns by '//to_text(turn)//' degrees; beyond 180 its straight continuations meet')
            else
               obstacle%curve = arc_curve(obstacle%centre, obstacle%radius, obstacle%angle(1), obstacle%angle(2))
            end if
         end associate
      case ('POLYLINE')
         obstacle%kind = obstacle_polyline
         call read_points()
         if (ok) call read_polyline(deck, radius, obstacle, ok)
      case ('SPLINE')
         obstacle%kind = obstacle_spline
         call read_points()
         if (ok) call end_spline(deck, obstacle%point, closed, ok)
         if (ok) obstacle%curve = spline_curve(obstacle%point, closed)
      case ('ELLIPSE')
         obstacle%kind = obstacle_spline
         obstacle%point = ellipse_points([deck%real('xc'), deck%real('yc')], [deck%real('a'), deck%real('b')], &
            deck%real('angle') * degree, anticlockwise=deck%word('SIDE') == 'INSIDE')
         obstacle%curve = spline_curve(obstacle%point, closed=.true.)
      end select
      if (.not. ok .or. .not. allocated(obstacle%curve%piece)) return
      ok = .not. crosses_itself(obstacle%curve)
      if (ok) return
      if (obstacle%curve%closed) call deck%wrong('TYPE', 'the obstacle meets itself')
      if (.not. obstacle%curve%closed) call deck%wrong('TYPE', &
         'the obstacle, which goes on straight beyond both ends, meets itself')

   contains

      !> Reads centre and radius of a circle or an arc.
      subroutine read_centre()
         obstacle%centre = [deck%real('xc'), deck%real('yc')]
         obstacle%radius = deck%real('radius')
         obstacle%reference_angle = deck%real('REFERENCE') * degree
      end subroutine read_centre

      !> Reads the points of a polyline or spline; neighbouring points must be different.
      subroutine read_points()
         integer :: i
         ok = .true.
         allocate (obstacle%point(2, deck%at%n_lines), radius(deck%at%n_lines))
         do i = 1, deck%at%n_lines
            obstacle%point(:, i) = [deck%real('x'), deck%real('y')]
            if (obstacle%kind == obstacle_polyline) radius(i) = deck%real('radius')
            if (i > 1) then
               if (norm2(obstacle%point(:, i) - obstacle%point(:, i - 1)) <= 0.0_wp) then
                  call deck%wrong_line('the point is at the place of the one before')
                  ok = .false.
               end if
            end if
            if (.not. deck%next_line()) exit
         end do
      end subroutine read_points
   end subroutine read_shape

   !> Makes the curve of a polyline from its points.
   subroutine read_polyline(deck, own, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck       ! position at the last line of the card
      real(wp), intent(in) :: own(:)                    ! corner radii at the points, 0: not given
      type(obstacle_t), intent(inout) :: obstacle       ! in: with the points; out: also with the curve
      logical, intent(out) :: ok
      real(wp), allocatable :: point(:, :), radius(:)
      real(wp) :: widest
      logical :: closed
      integer :: i, before, beyond
      closed = deck%word('ENDS') == 'CLOSED'
      ok = .not. closed .or. size(own) > 2
      if (.not. ok) call deck%wrong('ENDS', 'a closed polyline has 3 points or more')
      if (.not. ok) return
      beyond = merge(2, 0, closed)
      before = deck%at%line - size(own)
      point = obstacle%point
      associate (n => size(point, 2)) ! each point of a closed polyline has two neighbours on both sides
         if (closed) point = reshape([point(:, n - 1:n), point, point(:, 1:2)], [2, n + 4])
      end associate
      do i = 2, size(point, 2) - 1
         if (i <= beyond .or. i > size(point, 2) - beyond) cycle
         if (abs(corner_turn(point, i)) < back * degree) cycle
         deck%at = deck%at_line(before + i - beyond)
         call deck%wrong_line('the polyline turns back at this point')
         ok = .false.
      end do
      if (.not. ok) return
      widest = widest_corner_radius(point)
      obstacle%radius = default_corner_radius(point)
      if (deck%given('RADIUS')) obstacle%radius = deck%real('RADIUS')
      if (any(own > 0.0_wp)) then
         radius = merge(own, obstacle%radius, own > 0.0_wp)
         if (closed) radius = [radius(size(own) - 1:), radius, radius(:2)]
         i = misfit(point, radius)
         ok = i == 0
         if (.not. ok) then
            deck%at = deck%at_line(before + 1 + modulo(i - beyond - 1, size(own)))
            call deck%wrong_line('the corners here and at the point before, of radii '//to_text(radius(i - 1))//' and '// &
               to_text(radius(i))//', do not fit between the points')
            return
         end if
      else
         ok = obstacle%radius / (1.0_wp + 4 * epsilon(widest)) <= widest ! `widest` is huge if there are no corners
         allocate (radius(size(point, 2)), source=min(obstacle%radius, widest))
         if (.not. ok) call deck%wrong('RADIUS', 'corners of this radius do not fit between the points; at most '// &
            to_text(rounded_down(widest)))
      end if
      if (ok) obstacle%curve = polyline_curve(point, radius, closed)
   end subroutine read_polyline

   !> Adds the points behind the ends of a spline, of an obstacle or of a rod, that parameters ENDS, START and END request: closed,
   !> or with a direction at which its mirror image continues it. Errors are added to the deck.
   subroutine end_spline(deck, point, closed, ok)
      type(checked_deck_t), intent(inout) :: deck       !! deck, with the position at the last line of the card
      real(wp), allocatable, intent(inout) :: point(:, :) !! (2, points) points; neighbouring points are different
      logical, intent(out) :: closed                    !! true: the last point equals the first
      logical, intent(out) :: ok                        !! false: there is an error
      logical :: at(2)
      real(wp) :: angle(2)
      integer :: n
      n = size(point, 2)
      ok = .false.
      closed = deck%word('ENDS') == 'CLOSED'
      at = [deck%given('START'), deck%given('END')]
      angle = [deck%real('START'), deck%real('END')] * degree
      if (closed) then
         if (any(at)) then
            call deck%wrong(trim(merge('START', 'END  ', at(1))), 'a closed spline has no ends')
         else if (n < 3) then
            call deck%wrong('ENDS', 'a closed spline has 3 points or more')
         else if (norm2(point(:, n) - point(:, 1)) <= 0.0_wp) then
            call deck%wrong_line('the point is the first one again, to which a closed spline goes on')
         else
            ok = .true.
            point = reshape([point, point(:, 1)], [2, n + 1])
         end if
      else if (at(1) .and. dot_product(point(:, 2) - point(:, 1), [cos(angle(1)), sin(angle(1))]) <= 0.0_wp) then
         call deck%wrong('START', 'the curve does not leave its first point in this direction: the second is behind')
      else if (at(2) .and. dot_product(point(:, n) - point(:, n - 1), [cos(angle(2)), sin(angle(2))]) <= 0.0_wp) then
         call deck%wrong('END', 'the curve does not come to its last point in this direction: the one before is ahead')
      else
         ok = .true.
         if (.not. any(at)) return
         point = mirrored(point, at, angle, closed)
         ok = closed .or. .not. all(at)
         if (.not. ok) call deck%wrong('END', 'mirror images beyond START and END do not close the curve: the mirrors '// &
            'must meet at a whole part of 180 degrees, or be one')
      end if
   end subroutine end_spline

   !> The number x rounded down to 4 significant digits.
   real(wp) function rounded_down(x)
      real(wp), intent(in) :: x
      character(16) :: buffer
      write (buffer, '(es16.3e3)') x * (1.0_wp - 5.0e-4_wp)
      read (buffer, *) rounded_down
   end function rounded_down
end module read_obstacles
