!> Reads *CONTACT INTERFERENCE: gaps that close in a step by a prescribed amount.
module read_interference
   use kinds, only: wp
   use text, only: same_name
   use model, only: model_t, load_t
   use obstacle_geometry, only: obstacle_gap
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_word, field_text, field_real, field_place
   use deck_names, only: deck_names_t, find_named
   implicit none
   private
   public :: read_interference_line, pushes_out

contains

   !> Reads a line: obstacle, value; with SHRINK only the obstacle.
   subroutine read_interference_line(deck, names, model, diagnostics, line, shrunk_in, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model                !! with obstacles and contacts
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      integer, intent(inout) :: shrunk_in(:)            !! (obstacles) line of the deck that pushes the obstacle out already, 0:
      !! none
      type(load_t), intent(inout) :: load
      integer :: card, obstacle
      card = deck%data_line(line)%card
      call find_named(deck, names%obstacle, diagnostics, card, field_place(deck, line, 1), 'obstacle', obstacle)
      if (obstacle == 0) return
      if (.not. (names%contacts_incomplete .or. any(model%contact%obstacle == obstacle))) then
         call wrong('no *CONTACT names obstacle '//trim(model%obstacle(obstacle)%name))
      else if (.not. given(deck, card, 'SHRINK')) then
         load%closing(obstacle) = load%closing(obstacle) + field_real(deck, line, 2)
      else if (shrunk_in(obstacle) > 0) then
         call wrong(deck%source%line_words(shrunk_in(obstacle))//' pushes out all that penetrates already')
      else if (.not. (names%contacts_incomplete .or. names%mesh_incomplete .or. penetrated() .or. modes_to_come())) then
         call wrong('nothing begins behind '//trim(model%obstacle(obstacle)%name))
      else
         load%resolved(obstacle) = 1.0_wp
         if (model%step(deck%card(card)%step)%n_modes == 0) shrunk_in(obstacle) = deck%data_line(line)%line
      end if

   contains

      subroutine wrong(message)
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, field_place(deck, line, 1), message)
      end subroutine wrong

      !> True if buckling modes are imperfections: the initial positions are then known only after the buckling step.
      logical function modes_to_come()
         integer :: other
         modes_to_come = .false.
         do other = 1, deck%n_cards
            if (deck%card(other)%sound .and. deck%card(other)%keyword == 'IMPERFECTION') &
               & modes_to_come = modes_to_come .or. parameter_word(deck, other, 'SHAPE') == 'MODE'
         end do
      end function modes_to_come

      !> True if some candidate begins behind the obstacle.
      logical function penetrated()
         real(wp) :: gap, normal(2), bend
         integer :: c, i
         penetrated = model%obstacle(obstacle)%at_nodes .and. any(model%contact%obstacle == obstacle .and. &
            & model%contact%gap < 0.0_wp)
         if (model%obstacle(obstacle)%at_nodes .or. model%obstacle(obstacle)%bilateral) return
         do c = 1, size(model%contact)
            if (model%contact(c)%obstacle /= obstacle) cycle
            do i = 1, size(model%contact(c)%node)
               call obstacle_gap(model%obstacle(obstacle), model%mesh%x(:, model%contact(c)%node(i)), gap, normal, bend)
               penetrated = penetrated .or. gap + model%contact(c)%gap < 0.0_wp
            end do
         end do
      end function penetrated
   end subroutine read_interference_line

   !> True if some step pushes out the initial penetration of the obstacle of this name.
   logical function pushes_out(deck, name)
      type(deck_t), intent(in) :: deck
      character(*), intent(in) :: name
      integer :: card, line
      pushes_out = .false.
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'CONTACT INTERFERENCE') cycle
         if (.not. given(deck, card, 'SHRINK')) cycle
         do line = deck%card(card)%first_line, deck%card(card)%last_line
            if (deck%data_line(line)%sound) pushes_out = pushes_out .or. same_name(field_text(deck, line, 1), name)
         end do
      end do
   end function pushes_out
end module read_interference
