!> Reads *CONTACT PRINT: columns of the listing with the beginning or end of contact.
module read_contact_prints
   use model, only: model_t, contact_print_t
   use obstacle_types, only: obstacle_circle, obstacle_arc
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: value_place, field_place, field_word, field_integer
   use deck_names, only: deck_names_t, find_named
   implicit none
   private
   public :: read_contact_print_cards

contains

   !> Reads the columns in the order of the deck.
   subroutine read_contact_print_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the obstacles
      type(model_t), intent(inout) :: model             !! with contacts; receives contact_print
      type(diagnostics_t), intent(inout) :: diagnostics
      type(contact_print_t) :: print
      character(:), allocatable :: word
      integer :: card, line
      allocate (model%contact_print(0))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'CONTACT PRINT') cycle
         call find_named(deck, names%obstacle, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'obstacle', print%obstacle)
         if (print%obstacle == 0) cycle
         associate (obstacle => model%obstacle(print%obstacle))
            if (.not. (names%contacts_incomplete .or. any(model%contact%obstacle == print%obstacle))) then
               call complain(deck, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'no *CONTACT names obstacle '// &
                  trim(obstacle%name))
               cycle
            end if
            do line = deck%card(card)%first_line, deck%card(card)%last_line
               if (.not. deck%data_line(line)%sound) cycle
               word = field_word(deck, line, 1)
               print%at_end = index(word, 'END') == 1
               print%angle = index(word, 'ANGLE') > 0
               print%region = field_integer(deck, line, 2)
               if (print%angle .and. .not. (obstacle%kind == obstacle_circle .or. obstacle%kind == obstacle_arc)) then
                  call complain(deck, diagnostics, card, field_place(deck, line, 1), 'angles are those of circles and arcs; '// &
                     trim(obstacle%name)//' is neither')
                  cycle
               end if
               model%contact_print = [model%contact_print, print]
            end do
         end associate
      end do
   end subroutine read_contact_print_cards
end module read_contact_prints
