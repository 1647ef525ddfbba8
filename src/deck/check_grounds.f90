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
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: value_place, parameter_text
   use deck_names, only: deck_names_t
   implicit none
   private
   public :: check_ground_candidates

   integer, parameter :: most_candidates = 1500 !! limit, because the compliances of the candidates form a full matrix

contains

   !> Number, lengths and places of the candidates.
   subroutine check_ground_candidates(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      type(tableau_t) :: tableau(max_stages)
      type(geometry_t) :: geometry
      type(candidates_t) :: list
      type(patches_t) :: patches
      integer :: card, o, i, pair(2), alone
      if (.not. any(couples(model%obstacle))) return
      do i = 1, max_stages
         tableau(i) = new_tableau(i)
      end do
      geometry = new_geometry(model, tableau)
      list = new_candidates(model, geometry, distributed=.false.)
      patches = new_patches(model, list, geometry)
      do card = deck%n_cards, 1, -1
         if (deck%card(card)%keyword /= 'CONTACT') cycle
         o = names%obstacle%find(parameter_text(deck, card, 'OBSTACLE'))
         if (.not. couples(model%obstacle(o))) cycle
         if (patches%n > most_candidates) then
            call wrong('all obstacles that carry load sideways have '//to_text(patches%n)//' candidates; with a full matrix of '// &
               'compliances '//to_text(most_candidates)//' are allowed')
            return
         end if
         alone = findloc(list%obstacle == o .and. .not. list%tributary > 0.0_wp, .true., 1)
         if (alone > 0 .and. model%obstacle(o)%ground == ground_half_space) then
            call wrong('node '//label(alone)//' is a candidate without an element to another one: a force on no area '// &
               'sinks into a half-space without limit')
            return
         end if
         pair = first_overlap(patches, list, o)
         if (pair(1) == 0) cycle
         call wrong('nodes '//label(pair(1))//' and '//label(pair(2))//' load the same place of the ground, which carries load '// &
            'sideways; give one of the rods an obstacle of its own')
         return
      end do

   contains

      subroutine wrong(message)
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, value_place(deck, card, 'NSET'), message)
      end subroutine wrong

      function label(candidate) result(string)
         integer, intent(in) :: candidate
         character(:), allocatable :: string
         string = to_text(model%mesh%node_label(list%node(candidate)))
      end function label
   end subroutine check_ground_candidates
end module check_grounds
