!> Reads the steps without their loads: kind, strategy and iteration controls (*STEP, *STATIC, *BUCKLE, *CONTROLS); ends, points to
!> be located and stored fields (*STOP, *LOCATE, *TURNING POINTS, *FIELD OUTPUT). Checks that each step can be followed.
module read_steps
   use kinds, only: wp
   use text, only: to_text, plural, same_name, separated
   use model, only: model_t, step_t, threshold_t, quantity_displacement, method_load, method_displacement
   use card_values, only: is_listed
   use checked_deck, only: checked_deck_t, position_t
   use read_loads, only: load_cards
   implicit none
   private
   public :: read_step_cards, read_path_cards, read_bound, check_steps

   !> Cards that belong to a path, and are therefore allowed only in a step with *STATIC.
   character(*), parameter :: path_cards = 'CONTROLS|STOP|LOCATE|TURNING POINTS|FIELD OUTPUT|BRANCH|LIMIT CURVE|IMPERFECTION'

   !> Number of tangent updates in an increment for NEWTON=FULL, MODIFIED, ONCE.
   integer, parameter :: updates(3) = [huge(1), 0, 1]

contains

   !> Reads names, methods and controls of all steps.
   subroutine read_step_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains the monitors; out: also the names of the steps
      type(model_t), intent(inout) :: model             !! in: with monitors; out: also step, without loads and path control
      integer :: s
      allocate (model%step(maxval([0, deck%card(:deck%n_cards)%step])))
      do while (deck%next_card('STEP', also_bad=.true.))
         call name_step(deck, model%step(deck%at%step))
      end do
      call deck%visit_omitted('CONTROLS')
      do s = 1, size(model%step)
         call read_controls(deck, model%step(s))
      end do
      call deck%rewind()
      do while (deck%next_card('STATIC|BUCKLE|CONTROLS'))
         associate (step => model%step(deck%at%step))
            if (deck%at%keyword == 'STATIC') call read_static(deck, model, step)
            if (deck%at%keyword == 'BUCKLE') then
               if (deck%next_line()) step%n_modes = deck%integer('modes')
               associate (free => count(.not. model%fixed))
                  if (step%n_modes > free .and. .not. deck%names%mesh_incomplete) call deck%wrong('modes', 'there are only '// &
                     plural(free, 'free degree')//' of freedom')
               end associate
            end if
            if (deck%at%keyword == 'CONTROLS') call read_controls(deck, step)
         end associate
      end do
      if (.not. deck%names%unknown_cards) call check_kinds(deck)
   end subroutine read_step_cards

   !> Checks that each step either follows a path or computes buckling modes.
   subroutine check_kinds(deck)
      type(checked_deck_t), intent(inout) :: deck
      integer :: static, buckle
      do while (deck%next_card('STEP|STATIC|BUCKLE|'//path_cards, also_bad=.true.))
         if (deck%at%step == 0) cycle
         static = deck%last_card('STATIC', deck%at%step)
         buckle = deck%last_card('BUCKLE', deck%at%step)
         if (static == 0 .and. buckle == 0) then
            if (deck%at%keyword == 'STEP') call deck%wrong_card('the step has neither *STATIC nor *BUCKLE')
         else if (static > 0 .and. buckle > 0) then
            if (deck%at%card == max(static, buckle)) call deck%wrong_card('a step has either *STATIC or *BUCKLE, not both')
         else if (buckle > 0 .and. is_listed(path_cards, deck%at%keyword)) then
            call deck%wrong_card('belongs to a step with *STATIC; this one has *BUCKLE')
         end if
      end do
   end subroutine check_kinds

   !> Sets the name of a step, and makes its lists empty.
   subroutine name_step(deck, step)
      type(checked_deck_t), intent(inout) :: deck
      type(step_t), intent(inout) :: step
      logical :: ok
      step%name = 'Step-'//to_text(deck%at%step)
      if (.not. deck%at%sound) then
         deck%names%step%incomplete = .true.
      else if (deck%given('NAME')) then
         step%name = deck%text('NAME')
      end if
      ok = deck%defines(deck%names%step, step%name)
      allocate (step%stop(0), step%locate(0), step%turning(0), step%branch(0), step%limit_curve(0), step%mode_offset(0))
   end subroutine name_step

   !> Reads *STATIC: strategy, monitor, increments.
   subroutine read_static(deck, model, step)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(step_t), intent(inout) :: step
      step%method = deck%integer('METHOD')
      step%tangent_updates = updates(deck%integer('NEWTON'))
      step%paper_loop = deck%word('LOOP') == 'PAPER'
      if (deck%given('MONITOR')) then
         step%monitor = deck%named('MONITOR', deck%names%monitor, 'monitor')
         if (step%monitor > 0) then
            if (model%monitor(step%monitor)%quantity /= quantity_displacement) call deck%wrong('MONITOR', 'monitor '// &
               trim(model%monitor(step%monitor)%name)//' is a reaction; displacement control needs U1, U2 or UR')
         end if
      end if
      if (.not. deck%next_line()) return
      step%increment = deck%real('first')
      step%smallest = deck%real('smallest')
      step%smallest_given = deck%given('smallest')
      step%largest = deck%real('largest')
      if (step%method /= method_load .and. step%method /= method_displacement) then
         if (step%smallest >= step%largest) call deck%wrong_line('the smallest arc length must be below the largest one: '// &
            to_text(step%smallest)//', '//to_text(step%largest))
      else if (step%smallest > abs(step%increment) .or. abs(step%increment) > step%largest) then
         call deck%wrong_line('the first increment must lie between the smallest and the largest one: '// &
            to_text(abs(step%increment))//' in '//to_text(step%smallest)//' to '//to_text(step%largest))
      end if
   end subroutine read_static

   subroutine read_controls(deck, step)
      type(checked_deck_t), intent(inout) :: deck
      type(step_t), intent(inout) :: step
      step%tolerance = deck%real('TOLERANCE')
      step%tolerance_given = deck%given('TOLERANCE')
      step%locate_tolerance = deck%real('LOCATE')
      step%max_iterations = deck%integer('ITERATIONS')
      step%desired_iterations = deck%integer('DESIRED')
      step%max_points = deck%integer('POINTS')
      if (step%desired_iterations > step%max_iterations) call deck%wrong(&
         trim(merge('DESIRED   ', 'ITERATIONS', deck%given('DESIRED'))), 'DESIRED ('//to_text(step%desired_iterations)// &
         ') must not be above ITERATIONS ('//to_text(step%max_iterations)//')')
   end subroutine read_controls

   !> Reads the stops of the steps, the points to be located, and the fields to be stored.
   subroutine read_path_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the monitors
      type(model_t), intent(inout) :: model             !! in: with contacts; out: also step%stop, locate, turning, field_...
      do while (deck%next_card('STOP|LOCATE|TURNING POINTS|FIELD OUTPUT'))
         call read_card(deck, size(model%contact) > 0, model%step(deck%at%step))
      end do
   end subroutine read_path_cards

   subroutine read_card(deck, has_contact, step)
      type(checked_deck_t), intent(inout) :: deck
      logical, intent(in) :: has_contact
      type(step_t), intent(inout) :: step
      if (deck%at%keyword == 'FIELD OUTPUT') step%field_every = deck%integer('EVERY')
      do while (deck%next_line())
         select case (deck%at%keyword)
         case ('STOP')
            call read_bound(deck, step%stop)
         case ('LOCATE')
            call read_values()
         case ('TURNING POINTS')
            call read_turning()
         case ('FIELD OUTPUT')
            call read_fields()
         end select
      end do

   contains

      !> Reads a data line of *LOCATE: quantity, value, ...
      subroutine read_values()
         type(threshold_t) :: threshold
         integer :: k
         threshold%monitor = deck%quantity('quantity')
         if (threshold%monitor < 0) return
         do k = 1, deck%count('value')
            threshold%value = deck%real('value', k)
            step%locate = [step%locate, threshold]
         end do
      end subroutine read_values

      !> Reads a data line of *TURNING POINTS: monitors.
      subroutine read_turning()
         integer :: k, monitor
         do k = 1, deck%count('monitor')
            if (same_name(deck%text('monitor', k), 'LOAD')) then
               call deck%wrong('monitor', 'turning points of the load factor are limit points, which are always located', k)
               cycle
            end if
            monitor = deck%named('monitor', deck%names%monitor, 'monitor', k)
            if (monitor == 0) cycle
            if (any(step%turning == monitor)) then
               call deck%wrong('monitor', 'monitor '//deck%text('monitor', k)//' is named already in this step', k)
            else
               step%turning = [step%turning, monitor]
            end if
         end do
      end subroutine read_turning

      !> Reads a data line of *FIELD OUTPUT.
      subroutine read_fields()
         integer :: k
         do k = 1, deck%count('field')
            select case (deck%word('field', k))
            case ('DISPLACEMENT')
               step%field_displacement = .true.
            case ('SECTION FORCES')
               step%field_section_forces = .true.
            case ('REACTION')
               step%field_reaction = .true.
            case ('GAP')
               step%field_gap = .true.
            end select
            if (has_contact .or. deck%names%contacts_incomplete) cycle
            if (any(deck%word('field', k) == ['REACTION', 'GAP     '])) call deck%wrong('field', 'the deck has no *CONTACT', k)
         end do
      end subroutine read_fields
   end subroutine read_card

   !> Reads a data line of *STOP or *BRANCH: quantity, sense, value.
   subroutine read_bound(deck, stop)
      type(checked_deck_t), intent(inout) :: deck              !! contains the monitors
      type(threshold_t), allocatable, intent(inout) :: stop(:) !! out: with one more threshold, unless the quantity is not defined
      type(threshold_t) :: threshold
      threshold%monitor = deck%quantity('quantity')
      if (threshold%monitor < 0) return
      threshold%rising = deck%word('sense') == 'ABOVE'
      threshold%value = deck%real('value')
      stop = [stop, threshold]
   end subroutine read_bound

   !> Checks that each step has a load that the load factor multiplies, a controlled quantity, and an end. A LOAD step without *STOP
   !> ends at load factor 1.
   subroutine check_steps(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(inout) :: model             !! in: complete; out: with the stop at load factor 1
      if (deck%names%unknown_cards) return
      do while (deck%next_card('STEP', also_bad=.true.))
         associate (names => deck%names, step => model%step(deck%at%step))
            if (.not. (names%loads_incomplete .or. names%mesh_incomplete .or. names%supports_incomplete .or. &
               names%sections_incomplete .or. step%load%does_anything())) call deck%wrong_card('the step has no load: no '// &
               '*'//separated(load_cards, ', *')//' or prescribed displacement other than zero')
         end associate
      end do
      do while (deck%next_card('STATIC'))
         if (deck%last_card('BUCKLE', deck%at%step) == 0) call check_path(deck, model, model%step(deck%at%step))
      end do
   end subroutine check_steps

   !> Checks the control and the end of a step with *STATIC.
   subroutine check_path(deck, model, step)
      type(checked_deck_t), intent(inout) :: deck       ! deck, with the position at the step's *STATIC
      type(model_t), intent(in) :: model
      type(step_t), intent(inout) :: step               ! out: with the stop at load factor 1
      type(position_t) :: static
      logical :: limited
      integer :: controls
      if (step%method == method_displacement .and. step%monitor > 0) then
         associate (monitor => model%monitor(step%monitor))
            if (monitor%quantity == quantity_displacement .and. size(monitor%node) > 0 .and. &
               all(model%fixed(monitor%component, monitor%node)) .and. &
               .not. any(abs(step%load%displacement(monitor%component, monitor%node)) > 0.0_wp)) call deck%wrong('MONITOR', &
               'monitor '//trim(monitor%name)//' cannot move: all its nodes are supported in this direction')
         end associate
      end if
      if (deck%last_card('STOP', deck%at%step) > 0) return
      if (step%method == method_load) then
         if (step%increment < 0.0_wp .and. deck%next_line()) call deck%wrong('first', &
            'without *STOP the step ends at load factor 1, which a negative increment never reaches')
         step%stop = [threshold_t(monitor=0, value=1.0_wp, rising=.true.)]
         return
      end if
      static = deck%at
      controls = deck%last_card('CONTROLS', static%step)
      limited = .false.
      if (controls > 0) then
         deck%at = deck%at_card(controls)
         limited = .not. deck%at%sound
         if (.not. limited) limited = deck%given('POINTS')
         deck%at = static
      end if
      if (.not. limited) call deck%wrong_card('the step has no end: give *STOP, or POINTS on *CONTROLS')
   end subroutine check_path
end module read_steps
