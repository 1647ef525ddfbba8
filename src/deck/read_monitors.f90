!> Reads *MONITOR: displacements and reactions of nodes, contact reactions of obstacles.
module read_monitors
   use kinds, only: wp
   use text, only: to_text, same_name
   use model, only: model_t, monitor_t, quantity_displacement, quantity_reaction, quantity_contact
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, parameter_place, value_place, field_word, field_real, field_place
   use deck_names, only: deck_names_t, find_named, find_nodes
   implicit none
   private
   public :: read_monitor_cards

contains

   !> Reads the monitors.
   subroutine read_monitor_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! with the mesh; receives the monitors
      type(model_t), intent(inout) :: model             !! with supports and contacts; receives monitor
      type(diagnostics_t), intent(inout) :: diagnostics
      type(monitor_t) :: monitor
      integer :: card, line, position
      logical :: is_new
      allocate (model%monitor(0))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'MONITOR') cycle
         monitor%name = parameter_text(deck, card, 'NAME')
         if (same_name(monitor%name, 'LOAD')) then
            call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), 'LOAD means the load factor')
            cycle
         end if
         call names%monitor%add(parameter_text(deck, card, 'NAME'), position, is_new)
         if (.not. is_new) then
            call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), 'the name is used already')
            cycle
         end if
         line = deck%card(card)%first_line
         monitor%quantity = quantity_displacement
         monitor%component = 1
         monitor%obstacle = 0
         if (allocated(monitor%node)) deallocate (monitor%node)
         allocate (monitor%node(0))
         if (given(deck, card, 'OBSTACLE')) then
            call read_contact_monitor(deck, names, model, diagnostics, card, monitor)
         else if (deck%data_line(line)%sound) then
            call quantity(field_word(deck, line, 2), monitor)
            call find_nodes(deck, names, diagnostics, line, 1, monitor%node)
            monitor%factor = field_real(deck, line, 3)
            monitor%offset = field_real(deck, line, 4)
            call check_monitor(deck, names, model, diagnostics, card, line, monitor)
         end if
         model%monitor = [model%monitor, monitor]
      end do
   end subroutine read_monitor_cards

   !> Reads a monitor with OBSTACLE: quantity, factor, offset.
   subroutine read_contact_monitor(deck, names, model, diagnostics, card, monitor)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model                !! with the contacts
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(monitor_t), intent(inout) :: monitor
      integer :: line
      line = deck%card(card)%first_line
      monitor%quantity = quantity_contact
      call find_named(deck, names%obstacle, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'obstacle', &
         monitor%obstacle)
      if (monitor%obstacle > 0 .and. .not. names%contacts_incomplete) then
         if (.not. any(model%contact%obstacle == monitor%obstacle)) call complain(deck, diagnostics, card, &
            value_place(deck, card, 'OBSTACLE'), 'no *CONTACT names obstacle '//trim(model%obstacle(monitor%obstacle)%name))
      end if
      if (.not. deck%data_line(line)%sound) return
      monitor%component = findloc(['RF1', 'RF2', 'RN '] == field_word(deck, line, 1), .true., 1)
      monitor%factor = field_real(deck, line, 2)
      monitor%offset = field_real(deck, line, 3)
   end subroutine read_contact_monitor

   pure subroutine quantity(word, monitor)
      character(*), intent(in) :: word
      type(monitor_t), intent(inout) :: monitor
      if (word(1:1) == 'R') monitor%quantity = quantity_reaction
      select case (word)
      case ('U1', 'RF1')
         monitor%component = 1
      case ('U2', 'RF2')
         monitor%component = 2
      case default
         monitor%component = 3
      end select
   end subroutine quantity

   !> Checks that the nodes belong to elements; for a reaction, that at least one node is supported.
   subroutine check_monitor(deck, names, model, diagnostics, card, line, monitor)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, line
      type(monitor_t), intent(in) :: monitor
      integer :: i
      if (size(monitor%node) == 0) return
      if (.not. names%mesh_incomplete) then
         do i = 1, size(monitor%node)
            if (names%connected(monitor%node(i))) cycle
            call complain(deck, diagnostics, card, field_place(deck, line, 1), &
               'node '//to_text(model%mesh%node_label(monitor%node(i)))//' belongs to no element')
            return
         end do
      end if
      if (monitor%quantity == quantity_reaction .and. .not. names%supports_incomplete) then
         if (.not. any(model%fixed(monitor%component, monitor%node) .or. model%spring(monitor%component, monitor%node) > 0.0_wp)) &
            call complain(deck, diagnostics, card, field_place(deck, line, 2), 'no *BOUNDARY of the model part supports this'// &
            ', so there is no reaction')
      end if
   end subroutine check_monitor
end module read_monitors
