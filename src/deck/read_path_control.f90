!> Reads *STOP, *LOCATE, *TURNING POINTS and *FIELD OUTPUT, and checks that each step can be followed.
module read_path_control
   use kinds, only: wp
   use text, only: same_name
   use model, only: model_t, step_t, threshold_t, quantity_displacement, method_load, method_displacement
   use diagnostics, only: diagnostics_t, place_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_integer, value_place, field_text, field_word, field_real, field_place
   use deck_names, only: deck_names_t, find_named
   use read_loads, only: load_cards
   implicit none
   private
   public :: read_path_cards, read_bound, check_steps

contains

   !> Reads the stops of the steps, the points that they locate, and the fields that they store.
   subroutine read_path_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the monitors
      type(model_t), intent(inout) :: model             !! with contacts; receives step%stop, locate, turning, field_...
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, line
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%step == 0) cycle
         associate (step => model%step(deck%card(card)%step))
            if (deck%card(card)%keyword == 'FIELD OUTPUT') step%field_every = parameter_integer(deck, card, 'EVERY')
            do line = deck%card(card)%first_line, deck%card(card)%last_line
               if (.not. deck%data_line(line)%sound) cycle
               select case (deck%card(card)%keyword)
               case ('STOP')
                  call read_bound(deck, names, diagnostics, line, step%stop)
               case ('LOCATE')
                  call read_values(deck, names, diagnostics, line, step)
               case ('TURNING POINTS')
                  call read_turning(deck, names, diagnostics, line, step)
               case ('FIELD OUTPUT')
                  call read_fields(deck, model, names, diagnostics, line, step)
               end select
            end do
         end associate
      end do
   end subroutine read_path_cards

   !> Reads a line of *STOP or *BRANCH: quantity, sense, value.
   subroutine read_bound(deck, names, diagnostics, line, stop)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names                !! with the monitors
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line                            !! index of the data line
      type(threshold_t), allocatable, intent(inout) :: stop(:) !! receives one more threshold, unless the quantity is undefined
      type(threshold_t) :: threshold
      logical :: ok
      call read_quantity(deck, names, diagnostics, line, threshold%monitor, ok)
      if (.not. ok) return
      threshold%rising = field_word(deck, line, 2) == 'ABOVE'
      threshold%value = field_real(deck, line, 3)
      stop = [stop, threshold]
   end subroutine read_bound

   !> Reads a line of *LOCATE: quantity, value, ...
   subroutine read_values(deck, names, diagnostics, line, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(step_t), intent(inout) :: step
      type(threshold_t) :: threshold
      integer :: field
      logical :: ok
      call read_quantity(deck, names, diagnostics, line, threshold%monitor, ok)
      if (.not. ok) return
      do field = 2, deck%data_line(line)%n_fields
         threshold%value = field_real(deck, line, field)
         step%locate = [step%locate, threshold]
      end do
   end subroutine read_values

   !> Reads the first field of a line: LOAD or a monitor.
   subroutine read_quantity(deck, names, diagnostics, line, monitor, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      integer, intent(out) :: monitor ! 0: the load factor
      logical, intent(out) :: ok      ! false: not defined
      monitor = 0
      ok = same_name(field_text(deck, line, 1), 'LOAD')
      if (ok) return
      call find_named(deck, names%monitor, diagnostics, deck%data_line(line)%card, field_place(deck, line, 1), 'monitor', &
         monitor, also='LOAD')
      ok = monitor > 0
   end subroutine read_quantity

   !> Reads a line of *TURNING POINTS: monitors.
   subroutine read_turning(deck, names, diagnostics, line, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(step_t), intent(inout) :: step
      type(place_t) :: place
      integer :: card, field, monitor
      card = deck%data_line(line)%card
      do field = 1, deck%data_line(line)%n_fields
         place = field_place(deck, line, field)
         if (same_name(field_text(deck, line, field), 'LOAD')) then
            call complain(deck, diagnostics, card, place, 'turning points of the load factor are limit points, which '// &
               'are always located')
            cycle
         end if
         call find_named(deck, names%monitor, diagnostics, card, place, 'monitor', monitor)
         if (monitor == 0) cycle
         if (any(step%turning == monitor)) then
            call complain(deck, diagnostics, card, place, 'monitor '//field_text(deck, line, field)// &
               ' is named already in this step')
         else
            step%turning = [step%turning, monitor]
         end if
      end do
   end subroutine read_turning

   !> Reads a line of *FIELD OUTPUT.
   subroutine read_fields(deck, model, names, diagnostics, line, step)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(in) :: model
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(step_t), intent(inout) :: step
      integer :: field
      do field = 1, deck%data_line(line)%n_fields
         select case (field_word(deck, line, field))
         case ('DISPLACEMENT')
            step%field_displacement = .true.
         case ('SECTION FORCES')
            step%field_section_forces = .true.
         case ('REACTION')
            step%field_reaction = .true.
            call needs_contact()
         case ('GAP')
            step%field_gap = .true.
            call needs_contact()
         end select
      end do

   contains

      subroutine needs_contact()
         if (size(model%contact) == 0 .and. .not. names%contacts_incomplete) call complain(deck, diagnostics, &
            deck%data_line(line)%card, field_place(deck, line, field), 'the deck has no *CONTACT')
      end subroutine needs_contact
   end subroutine read_fields

   !> Checks that each step has a load to be scaled, a controlled quantity, and an end. A LOAD step without *STOP ends at load
   !> factor 1.
   subroutine check_steps(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(inout) :: model             !! read completely; receives the stop at load factor 1
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: s
      do s = 1, size(model%step)
         call check_step(deck, names, model, diagnostics, s)
      end do
   end subroutine check_steps

   subroutine check_step(deck, names, model, diagnostics, s)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(inout) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: s
      integer :: card, step_card, static_card, stop_card
      logical :: limited, buckling
      step_card = 0
      static_card = 0
      stop_card = 0
      limited = .false.
      buckling = .false.
      do card = 1, deck%n_cards
         if (deck%card(card)%step /= s) cycle
         select case (deck%card(card)%keyword)
         case ('STEP')
            step_card = card
         case ('STATIC')
            static_card = card
         case ('BUCKLE')
            buckling = .true.
         case ('STOP')
            stop_card = card
         case ('CONTROLS')
            limited = .not. deck%card(card)%sound .or. given(deck, card, 'POINTS')
         end select
      end do
      if (step_card == 0 .or. names%unknown_cards) return
      associate (step => model%step(s))
         if (.not. (names%loads_incomplete .or. names%mesh_incomplete .or. names%supports_incomplete .or. &
            names%sections_incomplete .or. step%load%does_anything())) call complain(deck, diagnostics, step_card, &
            deck%card(step_card)%place, 'the step has no load: no '//load_cards()//' or prescribed displacement other than zero')
         if (static_card == 0 .or. buckling) return
         if (.not. deck%card(static_card)%sound) return
         if (step%method == method_displacement .and. step%monitor > 0) call check_control()
         if (stop_card > 0) return
         if (step%method == method_load) then
            if (step%increment < 0.0_wp) call complain(deck, diagnostics, static_card, &
               field_place(deck, deck%card(static_card)%first_line, 1), &
               'without *STOP the step ends at load factor 1, which a negative increment never reaches')
            step%stop = [threshold_t(monitor=0, value=1.0_wp, rising=.true.)]
         else if (.not. limited) then
            call complain(deck, diagnostics, static_card, deck%card(static_card)%place, &
               'the step has no end: give *STOP, or POINTS on *CONTROLS')
         end if
      end associate

   contains

      !> Checks that the monitor of displacement control can change.
      subroutine check_control()
         associate (monitor => model%monitor(model%step(s)%monitor))
            if (monitor%quantity /= quantity_displacement .or. size(monitor%node) == 0) return
            if (.not. all(model%fixed(monitor%component, monitor%node))) return
            if (any(abs(model%step(s)%load%displacement(monitor%component, monitor%node)) > 0.0_wp)) return
            call complain(deck, diagnostics, static_card, value_place(deck, static_card, 'MONITOR'), 'monitor '// &
               trim(monitor%name)//' cannot move: all its nodes are supported in this direction')
         end associate
      end subroutine check_control
   end subroutine check_step
end module read_path_control
