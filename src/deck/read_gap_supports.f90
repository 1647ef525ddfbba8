!> Reads *GAP: one-sided supports of nodes. Each becomes a candidate for a line obstacle that represents the stops of the card.
module read_gap_supports
   use kinds, only: wp, parallel, degree
   use model, only: model_t, contact_t
   use obstacle_types, only: obstacle_t, obstacle_line
   use checked_deck, only: checked_deck_t
   use deck_names, only: node_words
   use read_interference, only: pushes_out
   implicit none
   private
   public :: read_gap_cards

contains

   !> Reads the one-sided supports: each card becomes an obstacle, each data line a contact.
   subroutine read_gap_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with mesh and laws; receives the names of the cards as those of obstacles
      type(model_t), intent(inout) :: model             !! with supports, obstacles and contacts; receives new obstacles and
      !! contacts
      type(obstacle_t) :: obstacle
      real(wp) :: normal(2)
      integer :: stopped_in(model%mesh%n_nodes)         ! (nodes) line of the deck with the stop, for the card being read; 0: none
      do while (deck%next_card('GAP'))
         if (.not. deck%defines(deck%names%obstacle, deck%text('NAME'))) cycle
         obstacle = obstacle_t()
         obstacle%name = deck%text('NAME')
         obstacle%kind = obstacle_line
         obstacle%at_nodes = .true.
         normal = direction(deck%real('DIRECTION'))
         obstacle%point = reshape([0.0_wp, 0.0_wp, normal(2), -normal(1)], [2, 2])
         obstacle%rigid = .not. (deck%given('STIFFNESS') .or. deck%given('LAW'))
         if (deck%given('STIFFNESS')) obstacle%modulus = deck%real('STIFFNESS')
         if (deck%given('LAW')) obstacle%law = deck%named('LAW', deck%names%law, 'foundation law')
         if (deck%given('STIFFNESS') .and. deck%given('LAW')) call deck%wrong('LAW', 'a stop has either STIFFNESS or LAW')
         model%obstacle = [model%obstacle, obstacle]
         stopped_in = 0
         do while (deck%next_line())
            call read_stops(deck, normal, stopped_in, model)
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
   subroutine read_stops(deck, normal, stopped_in, model)
      type(checked_deck_t), intent(inout) :: deck
      real(wp), intent(in) :: normal(2)                 !! direction in which the stops push
      integer, intent(inout) :: stopped_in(:)
      type(model_t), intent(inout) :: model             !! its last obstacle is that of the card
      type(contact_t) :: contact
      character(:), allocatable :: problem
      integer :: i
      contact%obstacle = size(model%obstacle)
      contact%gap = deck%real('clearance')
      contact%node = deck%nodes('node or set')
      if (contact%gap < 0.0_wp .and. .not. pushes_out(deck, model%obstacle(contact%obstacle)%name)) call deck%wrong('clearance', &
         'a clearance below zero needs *CONTACT INTERFERENCE, SHRINK in a step, which pushes out what penetrates')
      do i = 1, size(contact%node)
         associate (node => contact%node(i))
            problem = ''
            if (deck%names%is_loose(node)) problem = 'belongs to no element'
            if (.not. any(.not. model%fixed(1:2, node) .and. abs(normal) > parallel)) &
               problem = 'is supported in this direction already'
            if (stopped_in(node) > 0) problem = 'has a stop of this card already, from '//deck%source%line_words(stopped_in(node))
            stopped_in(node) = deck%at%line_at
            if (problem == '') cycle
            call deck%wrong('node or set', node_words(model%mesh, node)//' '//problem)
         end associate
         exit
      end do
      model%contact = [model%contact, contact]
   end subroutine read_stops
end module read_gap_supports
