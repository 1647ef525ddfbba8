!> Reads *GAP: one-sided supports of nodes. Each becomes a candidate for a line obstacle that represents the stops of the card.
module read_gap_supports
   use kinds, only: wp, degree
   use text, only: to_text
   use model, only: model_t, contact_t
   use obstacle_types, only: obstacle_t, obstacle_line
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, parameter_real, parameter_place, value_place, field_real, field_place
   use deck_names, only: deck_names_t, find_named, find_nodes
   use read_interference, only: pushes_out
   implicit none
   private
   public :: read_gap_cards

   real(wp), parameter :: grazing = 1.0e-6_wp !! direction cosines below this are zero

contains

   !> Reads the one-sided supports: each card becomes an obstacle, each data line a contact.
   subroutine read_gap_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! with mesh and laws; receives the names of the cards as those of obstacles
      type(model_t), intent(inout) :: model             !! with supports, obstacles and contacts; receives new obstacles and
      !! contacts
      type(diagnostics_t), intent(inout) :: diagnostics
      type(obstacle_t) :: obstacle
      integer :: card, line, position
      logical :: is_new
      real(wp) :: normal(2)
      integer, allocatable :: stopped_in(:)             ! by node: line of the deck, for the card being read
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'GAP') cycle
         call names%obstacle%add(parameter_text(deck, card, 'NAME'), position, is_new)
         if (.not. is_new) then
            call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), &
               'the name is used already, by another *GAP or an *OBSTACLE')
            cycle
         end if
         obstacle = obstacle_t()
         obstacle%name = parameter_text(deck, card, 'NAME')
         obstacle%kind = obstacle_line
         obstacle%at_nodes = .true.
         normal = direction(parameter_real(deck, card, 'DIRECTION'))
         obstacle%point = reshape([0.0_wp, 0.0_wp, normal(2), -normal(1)], [2, 2])
         obstacle%rigid = .not. (given(deck, card, 'STIFFNESS') .or. given(deck, card, 'LAW'))
         if (given(deck, card, 'STIFFNESS')) obstacle%modulus = parameter_real(deck, card, 'STIFFNESS')
         if (given(deck, card, 'LAW')) call find_named(deck, names%law, diagnostics, card, value_place(deck, card, 'LAW'), &
            'foundation law', obstacle%law)
         if (given(deck, card, 'STIFFNESS') .and. given(deck, card, 'LAW')) call complain(deck, diagnostics, card, &
            parameter_place(deck, card, 'LAW'), 'a stop has either STIFFNESS or LAW')
         model%obstacle = [model%obstacle, obstacle]
         if (allocated(stopped_in)) deallocate (stopped_in)
         allocate (stopped_in(model%mesh%n_nodes), source=0)
         do line = deck%card(card)%first_line, deck%card(card)%last_line
            if (deck%data_line(line)%sound) call read_stops(deck, names, diagnostics, card, line, normal, stopped_in, model)
         end do
      end do
   end subroutine read_gap_cards

   !> Unit vector at an angle [degrees]; exact along the axes.
   pure function direction(angle) result(d)
      real(wp), intent(in) :: angle
      real(wp) :: d(2)
      d = [cos(angle * degree), sin(angle * degree)]
      where (abs(d) < epsilon(d) * max(abs(angle), 1.0_wp)) d = 0.0_wp
      where (abs(d) > 1.0_wp - epsilon(d)) d = sign(1.0_wp, d)
   end function direction

   !> Reads a data line: node or set, clearance.
   subroutine read_stops(deck, names, diagnostics, card, line, normal, stopped_in, model)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, line
      real(wp), intent(in) :: normal(2)                 !! direction in which the stops push
      integer, intent(inout) :: stopped_in(:)
      type(model_t), intent(inout) :: model             !! its last obstacle is that of the card
      type(contact_t) :: contact
      character(:), allocatable :: problem
      integer :: i
      contact%obstacle = size(model%obstacle)
      contact%gap = field_real(deck, line, 2)
      call find_nodes(deck, names, diagnostics, line, 1, contact%node)
      if (contact%gap < 0.0_wp .and. .not. pushes_out(deck, model%obstacle(contact%obstacle)%name)) &
         call complain(deck, diagnostics, card, field_place(deck, line, 2), 'a clearance below zero needs *CONTACT '// &
         'INTERFERENCE, SHRINK in a step, which pushes out what penetrates')
      do i = 1, size(contact%node)
         associate (node => contact%node(i))
            problem = ''
            if (.not. names%mesh_incomplete) then
               if (.not. names%connected(node)) problem = 'belongs to no element'
            end if
            if (.not. any(.not. model%fixed(1:2, node) .and. abs(normal) > grazing)) &
               problem = 'is supported in this direction already'
            if (stopped_in(node) > 0) problem = 'has a stop of this card already, from '// &
               deck%source%line_words(stopped_in(node))
            stopped_in(node) = deck%data_line(line)%line
            if (problem == '') cycle
            call complain(deck, diagnostics, card, field_place(deck, line, 1), 'node '// &
               to_text(model%mesh%node_label(node))//' '//problem)
         end associate
         exit
      end do
      model%contact = [model%contact, contact]
   end subroutine read_stops
end module read_gap_supports
