!> Reads *STEP, *STATIC, *BUCKLE and *CONTROLS: kind, method and controls of each step.
module read_steps
   use kinds, only: wp
   use text, only: to_text, plural, parse_integer, parse_real
   use model, only: model_t, step_t, quantity_displacement, method_load, method_displacement, method_cylindrical, &
      method_spherical, method_linearised, method_minimum_residual, method_variable_load, method_generalised, &
      method_largest
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, default_text, parameter_text, parameter_word, parameter_integer, parameter_real, &
      parameter_place, value_place, field_given, field_place, field_integer, field_real, whole_line
   use deck_names, only: deck_names_t, find_named
   implicit none
   private
   public :: read_step_cards

contains

   !> Reads names, methods and controls of all steps.
   subroutine read_step_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! with the monitors; receives the steps
      type(model_t), intent(inout) :: model             !! with monitors; receives step without loads and path control
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, s
      integer, allocatable :: step_card(:), static_card(:), buckle_card(:) ! by step: position of the card; 0: none
      allocate (step_card(0))
      do card = 1, deck%n_cards
         if (deck%card(card)%keyword == 'STEP') step_card = [step_card, card]
      end do
      allocate (model%step(size(step_card)))
      allocate (static_card(size(step_card)), buckle_card(size(step_card)), source=0)
      do s = 1, size(step_card)
         call begin_step(deck, names, diagnostics, step_card(s), model%step(s))
      end do
      do card = 1, deck%n_cards
         s = deck%card(card)%step
         if (s == 0) cycle
         if (deck%card(card)%keyword == 'STATIC') static_card(s) = card
         if (deck%card(card)%keyword == 'BUCKLE') buckle_card(s) = card
         if (.not. deck%card(card)%sound) cycle
         select case (deck%card(card)%keyword)
         case ('STATIC')
            call read_static(deck, names, model, diagnostics, card, model%step(s))
         case ('BUCKLE')
            call read_buckle(deck, names, model%fixed, diagnostics, card, model%step(s)%n_modes)
         case ('CONTROLS')
            call read_controls(deck, diagnostics, card, model%step(s))
         end select
      end do
      if (names%unknown_cards) return
      do s = 1, size(step_card)
         if (static_card(s) == 0 .and. buckle_card(s) == 0) then
            call complain(deck, diagnostics, step_card(s), deck%card(step_card(s))%place, &
               'the step has neither *STATIC nor *BUCKLE')
         else if (static_card(s) > 0 .and. buckle_card(s) > 0) then
            card = max(static_card(s), buckle_card(s))
            call complain(deck, diagnostics, card, deck%card(card)%place, 'a step has either *STATIC or *BUCKLE, not both')
         else if (buckle_card(s) > 0) then
            call check_buckling_step(deck, diagnostics, s)
         end if
      end do
   end subroutine read_step_cards

   !> Checks a buckling step: it must have loads, and no card about a path.
   subroutine check_buckling_step(deck, diagnostics, s)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: s
      integer :: card
      do card = 1, deck%n_cards
         if (deck%card(card)%step /= s) cycle
         select case (deck%card(card)%keyword)
         case ('CONTROLS', 'STOP', 'LOCATE', 'TURNING POINTS', 'FIELD OUTPUT', 'BRANCH', 'LIMIT CURVE', &
            & 'IMPERFECTION')
            call complain(deck, diagnostics, card, deck%card(card)%place, &
               'belongs to a step with *STATIC; this one has *BUCKLE')
         end select
      end do
   end subroutine check_buckling_step

   !> Sets name and defaults of a step.
   subroutine begin_step(deck, names, diagnostics, card, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(step_t), intent(inout) :: step
      integer :: position
      logical :: is_new, ok
      step%name = 'Step-'//to_text(names%step%n + 1)
      if (deck%card(card)%sound .and. given(deck, card, 'NAME')) step%name = parameter_text(deck, card, 'NAME')
      if (.not. deck%card(card)%sound) names%step%incomplete = .true.
      call names%step%add(step%name, position, is_new)
      if (.not. is_new) call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), &
         'the name '//trim(step%name)//' is used already')
      call parse_real(default_text(deck, 'CONTROLS', 'TOLERANCE'), step%tolerance, ok)
      call parse_real(default_text(deck, 'CONTROLS', 'LOCATE'), step%locate_tolerance, ok)
      call parse_integer(default_text(deck, 'CONTROLS', 'ITERATIONS'), step%max_iterations, ok)
      call parse_integer(default_text(deck, 'CONTROLS', 'DESIRED'), step%desired_iterations, ok)
      call parse_integer(default_text(deck, 'CONTROLS', 'POINTS'), step%max_points, ok)
      allocate (step%stop(0), step%locate(0), step%turning(0), step%branch(0), step%limit_curve(0), step%mode_offset(0))
   end subroutine begin_step

   !> Reads *STATIC: method, monitor, increments.
   subroutine read_static(deck, names, model, diagnostics, card, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(step_t), intent(inout) :: step
      integer :: line
      select case (parameter_word(deck, card, 'METHOD'))
      case ('LOAD')
         step%method = method_load
      case ('DISPLACEMENT')
         step%method = method_displacement
      case ('CYLINDRICAL')
         step%method = method_cylindrical
      case ('SPHERICAL')
         step%method = method_spherical
      case ('LINEARISED')
         step%method = method_linearised
      case ('MINIMUM RESIDUAL')
         step%method = method_minimum_residual
      case ('VARIABLE LOAD')
         step%method = method_variable_load
      case ('GENERALISED DISPLACEMENT')
         step%method = method_generalised
      case ('LARGEST DISPLACEMENT')
         step%method = method_largest
      end select
      select case (parameter_word(deck, card, 'NEWTON'))
      case ('FULL')
         step%tangent_updates = huge(1)
      case ('MODIFIED')
         step%tangent_updates = 0
      case ('ONCE')
         step%tangent_updates = 1
      end select
      step%paper_loop = parameter_word(deck, card, 'LOOP') == 'PAPER'
      if (given(deck, card, 'MONITOR')) then
         call find_named(deck, names%monitor, diagnostics, card, value_place(deck, card, 'MONITOR'), 'monitor', &
            step%monitor)
         if (step%monitor > 0) then
            if (model%monitor(step%monitor)%quantity /= quantity_displacement) call complain(deck, diagnostics, card, &
               value_place(deck, card, 'MONITOR'), 'monitor '//trim(model%monitor(step%monitor)%name)// &
               ' is a reaction; displacement control needs U1, U2 or UR')
         end if
      end if
      line = deck%card(card)%first_line
      if (.not. deck%data_line(line)%sound) return
      step%increment = field_real(deck, line, 1)
      step%smallest = field_real(deck, line, 2)
      step%smallest_given = field_given(deck, line, 2)
      step%largest = field_real(deck, line, 3)
      if (step%method /= method_load .and. step%method /= method_displacement) then
         if (step%smallest >= step%largest) call complain(deck, diagnostics, card, whole_line(deck, line), &
            'the smallest arc length must be below the largest one: '//to_text(step%smallest)//', '// &
            to_text(step%largest))
      else if (step%smallest > abs(step%increment) .or. abs(step%increment) > step%largest) then
         call complain(deck, diagnostics, card, whole_line(deck, line), 'the first increment must lie between the '// &
            'smallest and the largest one: '//to_text(abs(step%increment))//' in '//to_text(step%smallest)//' to '// &
            to_text(step%largest))
      end if
   end subroutine read_static

   !> Reads *BUCKLE: number of modes.
   subroutine read_buckle(deck, names, fixed, diagnostics, card, n_modes)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      logical, intent(in) :: fixed(:, :)
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      integer, intent(out) :: n_modes
      integer :: line, n_free
      line = deck%card(card)%first_line
      n_modes = 0
      if (.not. deck%data_line(line)%sound) return
      n_modes = field_integer(deck, line, 1)
      if (names%mesh_incomplete) return
      n_free = count(.not. fixed)
      if (n_modes > n_free) call complain(deck, diagnostics, card, field_place(deck, line, 1), &
         'there are only '//plural(n_free, 'free degree')//' of freedom')
   end subroutine read_buckle

   subroutine read_controls(deck, diagnostics, card, step)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(step_t), intent(inout) :: step
      step%tolerance = parameter_real(deck, card, 'TOLERANCE')
      step%tolerance_given = given(deck, card, 'TOLERANCE')
      step%locate_tolerance = parameter_real(deck, card, 'LOCATE')
      step%max_iterations = parameter_integer(deck, card, 'ITERATIONS')
      step%desired_iterations = parameter_integer(deck, card, 'DESIRED')
      step%max_points = parameter_integer(deck, card, 'POINTS')
      call below_one('TOLERANCE', step%tolerance)
      call below_one('LOCATE', step%locate_tolerance)
      if (step%desired_iterations > step%max_iterations) call complain(deck, diagnostics, card, &
         parameter_place(deck, card, merge('DESIRED   ', 'ITERATIONS', given(deck, card, 'DESIRED'))), 'DESIRED ('// &
         to_text(step%desired_iterations)//') must not be above ITERATIONS ('//to_text(step%max_iterations)//')')

   contains

      subroutine below_one(name, value)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value
         if (value >= 1.0_wp) call complain(deck, diagnostics, card, parameter_place(deck, card, name), &
            name//' must be below 1')
      end subroutine below_one
   end subroutine read_controls
end module read_steps
