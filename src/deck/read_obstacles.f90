!> Reads *OBSTACLE, and *OBSTACLE MOTION of the steps.
module read_obstacles
   use kinds, only: wp, degree
   use text, only: to_text
   use model, only: model_t, load_t
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, obstacle_spline, &
      & ground_independent, ground_half_space, ground_pasternak
   use obstacle_curve, only: crosses_itself
   use obstacle_shapes, only: arc_curve, polyline_curve, spline_curve, corner_turn, widest_corner_radius, &
      default_corner_radius
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, parameter_word, parameter_real, parameter_place, value_place, field_real, &
      field_place, whole_line
   use deck_names, only: deck_names_t, find_named
   implicit none
   private
   public :: read_obstacle_cards, read_motion

   real(wp), parameter :: half_turn = 180.0_wp       !! [degrees] largest turn of an arc
   real(wp), parameter :: back = 175.0_wp            !! [degrees] larger turns at a corner are rejected: the curve would reverse

contains

   !> Reads the obstacles.
   subroutine read_obstacle_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! receives the obstacles
      type(model_t), intent(inout) :: model             !! receives obstacle
      type(diagnostics_t), intent(inout) :: diagnostics
      type(obstacle_t) :: obstacle
      integer :: card, position
      logical :: is_new, ok
      allocate (model%obstacle(0))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'OBSTACLE') cycle
         call names%obstacle%add(parameter_text(deck, card, 'NAME'), position, is_new)
         if (.not. is_new) then
            call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), 'the name is used already')
            cycle
         end if
         obstacle = obstacle_t()
         obstacle%name = parameter_text(deck, card, 'NAME')
         obstacle%rigid = parameter_word(deck, card, 'FOUNDATION') == 'RIGID'
         obstacle%bilateral = given(deck, card, 'BILATERAL')
         select case (parameter_word(deck, card, 'FOUNDATION'))
         case ('WINKLER')
            obstacle%modulus = parameter_real(deck, card, 'MODULUS') * parameter_real(deck, card, 'WIDTH')
         case ('PASTERNAK')
            obstacle%ground = ground_pasternak
            obstacle%width = parameter_real(deck, card, 'WIDTH')
            obstacle%modulus = parameter_real(deck, card, 'MODULUS') * obstacle%width
            obstacle%shear = parameter_real(deck, card, 'SHEAR') * obstacle%width
         case ('HALF SPACE')
            obstacle%ground = ground_half_space
            obstacle%width = parameter_real(deck, card, 'WIDTH')
            obstacle%young = parameter_real(deck, card, 'YOUNG')
            obstacle%poisson = parameter_real(deck, card, 'POISSON')
         case ('LAW')
            obstacle%width = parameter_real(deck, card, 'WIDTH')
            call find_named(deck, names%law, diagnostics, card, value_place(deck, card, 'LAW'), 'foundation law', obstacle%law)
         end select
         ok = all(deck%data_line(deck%card(card)%first_line:deck%card(card)%last_line)%sound)
         if (ok) call check_ground(deck, diagnostics, card, obstacle, ok)
         if (ok) call read_shape(deck, diagnostics, card, obstacle, ok)
         if (.not. ok) then
            ! A placeholder for which gaps can be computed without further errors.
            names%obstacle%incomplete = .true.
            obstacle%kind = obstacle_line
            obstacle%point = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], [2, 2])
         end if
         model%obstacle = [model%obstacle, obstacle]
      end do
   end subroutine read_obstacle_cards

   !> Checks the requirements of coupled ground.
   subroutine check_ground(deck, diagnostics, card, obstacle, ok)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(obstacle_t), intent(in) :: obstacle
      logical, intent(out) :: ok
      ok = obstacle%ground == ground_independent .or. parameter_word(deck, card, 'TYPE') == 'LINE'
      if (.not. ok) call complain(deck, diagnostics, card, value_place(deck, card, 'FOUNDATION'), &
         parameter_word(deck, card, 'FOUNDATION')//' needs TYPE=LINE: it carries load along a plane surface')
      if (obstacle%ground /= ground_half_space) return
      if (.not. given(deck, card, 'WIDTH')) then
         call complain(deck, diagnostics, card, value_place(deck, card, 'FOUNDATION'), 'HALF SPACE needs WIDTH, of the strip '// &
            'that presses on it')
         ok = .false.
      end if
      if (obstacle%poisson > -1.0_wp .and. obstacle%poisson <= 0.5_wp) return
      call complain(deck, diagnostics, card, value_place(deck, card, 'POISSON'), &
         'POISSON is above -1 and at most 0.5')
      ok = .false.
   end subroutine check_ground

   !> Reads kind, position and size.
   subroutine read_shape(deck, diagnostics, card, obstacle, ok)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card                       !! all its data lines are sound
      type(obstacle_t), intent(inout) :: obstacle
      logical, intent(out) :: ok
      integer :: line
      line = deck%card(card)%first_line
      ok = .true.
      select case (parameter_word(deck, card, 'TYPE'))
      case ('LINE')
         obstacle%kind = obstacle_line
         allocate (obstacle%point(2, 2))
         obstacle%point(:, 1) = [field_real(deck, line, 1), field_real(deck, line, 2)]
         obstacle%point(:, 2) = [field_real(deck, line, 3), field_real(deck, line, 4)]
         ok = norm2(obstacle%point(:, 2) - obstacle%point(:, 1)) > 0.0_wp
         if (.not. ok) call complain(deck, diagnostics, card, whole_line(deck, line), 'both points are at the same place')
      case ('CIRCLE')
         obstacle%kind = obstacle_circle
         obstacle%inside = parameter_word(deck, card, 'SIDE') == 'INSIDE'
         call read_centre()
      case ('ARC')
         obstacle%kind = obstacle_arc
         call read_centre()
         call read_arc(deck, diagnostics, card, obstacle, ok)
      case ('POLYLINE')
         obstacle%kind = obstacle_polyline
         call read_points(deck, diagnostics, card, obstacle%point, ok)
         if (ok) call read_polyline(deck, diagnostics, card, obstacle, ok)
      case ('SPLINE')
         obstacle%kind = obstacle_spline
         call read_points(deck, diagnostics, card, obstacle%point, ok)
         if (ok) obstacle%curve = spline_curve(obstacle%point)
      end select
      if (.not. ok .or. .not. allocated(obstacle%curve%piece)) return
      ok = .not. crosses_itself(obstacle%curve)
      if (.not. ok) call complain(deck, diagnostics, card, value_place(deck, card, 'TYPE'), 'the obstacle, which goes on '// &
         'straight beyond both ends, meets itself')

   contains

      subroutine read_centre()
         obstacle%centre = [field_real(deck, line, 1), field_real(deck, line, 2)]
         obstacle%radius = field_real(deck, line, 3)
         obstacle%reference_angle = parameter_real(deck, card, 'REFERENCE') * degree
      end subroutine read_centre
   end subroutine read_shape

   !> Reads both angles of an arc.
   subroutine read_arc(deck, diagnostics, card, obstacle, ok)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(obstacle_t), intent(inout) :: obstacle
      logical, intent(out) :: ok
      real(wp) :: angle(2)
      integer :: line
      line = deck%card(card)%first_line
      angle = [field_real(deck, line, 4), field_real(deck, line, 5)]
      obstacle%angle = angle * degree
      ok = .false.
      if (.not. abs(angle(2) - angle(1)) > 0.0_wp) then
         call complain(deck, diagnostics, card, field_place(deck, line, 5), 'the arc ends where it starts')
      else if (abs(angle(2) - angle(1)) > half_turn) then
         call complain(deck, diagnostics, card, field_place(deck, line, 5), 'the arc turns by '// &
            to_text(abs(angle(2) - angle(1)))//' degrees; beyond 180 its straight continuations meet')
      else
         ok = .true.
         obstacle%curve = arc_curve(obstacle%centre, obstacle%radius, obstacle%angle(1), obstacle%angle(2))
      end if
   end subroutine read_arc

   !> Reads the points of a polyline or spline; neighbouring points must be different.
   subroutine read_points(deck, diagnostics, card, point, ok)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      real(wp), allocatable, intent(out) :: point(:, :)
      logical, intent(out) :: ok
      integer :: line, i
      ok = .true.
      allocate (point(2, deck%card(card)%last_line - deck%card(card)%first_line + 1))
      do i = 1, size(point, 2)
         line = deck%card(card)%first_line + i - 1
         point(:, i) = [field_real(deck, line, 1), field_real(deck, line, 2)]
         if (i == 1) cycle
         if (norm2(point(:, i) - point(:, i - 1)) > 0.0_wp) cycle
         call complain(deck, diagnostics, card, whole_line(deck, line), 'the point is at the place of the one before')
         ok = .false.
      end do
   end subroutine read_points

   !> Reads the corner radius of a polyline.
   subroutine read_polyline(deck, diagnostics, card, obstacle, ok)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(obstacle_t), intent(inout) :: obstacle       !! with its points
      logical, intent(out) :: ok
      real(wp) :: widest
      integer :: i
      ok = .true.
      do i = 2, size(obstacle%point, 2) - 1
         if (abs(corner_turn(obstacle%point, i)) < back * degree) cycle
         call complain(deck, diagnostics, card, whole_line(deck, deck%card(card)%first_line + i - 1), &
            'the polyline turns back at this point')
         ok = .false.
      end do
      if (.not. ok) return
      widest = widest_corner_radius(obstacle%point)
      obstacle%radius = default_corner_radius(obstacle%point)
      if (given(deck, card, 'RADIUS')) obstacle%radius = parameter_real(deck, card, 'RADIUS')
      ok = obstacle%radius / (1.0_wp + 4 * epsilon(widest)) <= widest ! widest is huge without corners
      if (ok) then
         obstacle%curve = polyline_curve(obstacle%point, min(obstacle%radius, widest))
      else
         call complain(deck, diagnostics, card, value_place(deck, card, 'RADIUS'), &
            'corners of this radius do not fit between the points; at most '//to_text(rounded_down(widest)))
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
   subroutine read_motion(deck, names, diagnostics, line, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(load_t), intent(inout) :: load
      integer :: obstacle
      call find_named(deck, names%obstacle, diagnostics, deck%data_line(line)%card, field_place(deck, line, 1), 'obstacle', &
         obstacle)
      if (obstacle == 0) return
      load%motion(:, obstacle) = load%motion(:, obstacle) + [field_real(deck, line, 2), field_real(deck, line, 3)]
   end subroutine read_motion
end module read_obstacles
