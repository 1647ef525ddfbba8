!> Conditions on the candidates of an obstacle with coupled ground; checked if the rest of the deck has no errors.
module check_grounds
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t
   use obstacle_types, only: ground_half_space
   use gauss_tableau, only: tableau_t, max_stages, new_tableau
   use rod_geometry, only: geometry_t, new_geometry
   use candidates, only: candidates_t, new_candidates
   use surface_patches, only: patches_t, new_patches, couples, first_overlap
   use checked_deck, only: checked_deck_t, cursor_t
   use deck_names, only: node_words
   implicit none
   private
   public :: check_ground_candidates

   integer, parameter :: most_candidates = 1500 !! limit, because the compliances of the candidates form a full matrix

contains

   !> Number, lengths and places of the candidates.
   subroutine check_ground_candidates(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model                !! of a deck without errors: contacts in the order of the cards
      type(tableau_t) :: tableau(max_stages)
      type(geometry_t) :: geometry
      type(candidates_t) :: list
      type(patches_t) :: patches
      type(cursor_t) :: at, last
      character(:), allocatable :: problem, found
      integer :: contact, i
      if (.not. any(couples(model%obstacle))) return
      do i = 1, max_stages
         tableau(i) = new_tableau(i)
      end do
      geometry = new_geometry(model, tableau)
      list = new_candidates(model, geometry, distributed=.false.)
      patches = new_patches(model, list, geometry)
      ! The error is reported at the last card concerned.
      contact = 0
      last = cursor_t()
      do while (deck%next_card(at, 'CONTACT'))
         contact = contact + 1
         if (.not. couples(model%obstacle(model%contact(contact)%obstacle))) cycle
         found = contact_problem(model, list, patches, model%contact(contact)%obstacle)
         if (found == '') cycle
         problem = found
         last = at
      end do
      if (last%card > 0) call deck%wrong(last, 'NSET', problem)
   end subroutine check_ground_candidates

   !> Reason why an obstacle with coupled ground cannot carry its candidates; '' if it can.
   function contact_problem(model, list, patches, obstacle) result(problem)
      type(model_t), intent(in) :: model
      type(candidates_t), intent(in) :: list
      type(patches_t), intent(in) :: patches
      integer, intent(in) :: obstacle
      character(:), allocatable :: problem
      integer :: pair(2), alone
      problem = ''
      if (patches%n > most_candidates) then
         problem = 'all obstacles that carry load sideways have '//to_text(patches%n)//' candidates; with a full matrix of '// &
            'compliances '//to_text(most_candidates)//' are allowed'
         return
      end if
      alone = findloc(list%obstacle == obstacle .and. .not. list%tributary > 0.0_wp, .true., 1)
      if (alone > 0 .and. model%obstacle(obstacle)%ground == ground_half_space) then
         problem = node_words(model%mesh, list%node(alone))//' is a candidate without an element to another one: a force on '// &
            'no area sinks into a half-space without limit'
         return
      end if
      pair = first_overlap(patches, list, obstacle)
      if (pair(1) == 0) return
      problem = 'nodes '//to_text(model%mesh%node_label(list%node(pair(1))))//' and '// &
         to_text(model%mesh%node_label(list%node(pair(2))))//' load the same place of the ground, which carries load sideways; '// &
         'give one of the rods an obstacle of its own'
   end function contact_problem
end module check_grounds
