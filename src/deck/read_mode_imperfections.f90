!> Reads *IMPERFECTION, SHAPE=MODE: buckling modes as the stress-free offset at the start of a step.
module read_mode_imperfections
   use text, only: plural
   use model, only: model_t, mode_offset_t
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: parameter_place, parameter_word, value_place, field_place, field_integer, field_real
   use deck_names, only: deck_names_t, find_set, find_named
   use imperfection_chain, only: chain_t, follow_chain
   implicit none
   private
   public :: read_mode_imperfection_cards

contains

   !> Reads the modes of all steps, and reports each *IMPERFECTION in the wrong part of the deck.
   subroutine read_mode_imperfection_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with mesh and steps
      type(model_t), intent(inout) :: model             !! with all other imperfections; receives step%mode_offset
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, s, from_step, set
      type(chain_t) :: chain
      logical :: of_mode, ok
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'IMPERFECTION') cycle
         s = deck%card(card)%step
         of_mode = parameter_word(deck, card, 'SHAPE') == 'MODE'
         if (s == 0 .and. of_mode) call misplaced('SHAPE=MODE belongs in a step with *STATIC')
         if (s > 0 .and. .not. of_mode) call misplaced('only SHAPE=MODE may stand in a step; all other shapes belong '// &
            'above the first *STEP')
         if (s == 0 .or. .not. of_mode) cycle
         if (model%step(s)%n_modes > 0) cycle ! reported elsewhere
         call find_buckling_step(deck, names, diagnostics, card, from_step)
         call find_set(deck, names, diagnostics, card, 'ELSET', 'element', set)
         if (set == 0 .or. names%mesh_incomplete) cycle
         call follow_chain(deck, model, diagnostics, card, names%element_set%members(set), chain, ok)
         if (ok .and. from_step > 0) call read_modes(deck, diagnostics, card, from_step, model%step(from_step)%n_modes, &
            chain%element, model%step(s)%mode_offset)
      end do

   contains

      subroutine misplaced(message)
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'SHAPE'), message)
      end subroutine misplaced
   end subroutine read_mode_imperfection_cards

   !> The step named by STEP: an earlier one with *BUCKLE.
   subroutine find_buckling_step(deck, names, diagnostics, card, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      integer, intent(out) :: step ! 0: none
      character(:), allocatable :: name
      integer :: other
      call find_named(deck, names%step, diagnostics, card, value_place(deck, card, 'STEP'), 'step', step)
      if (step == 0) return
      name = trim(names%step%name(step))
      if (step >= deck%card(card)%step) then
         call wrong('step '//name//' does not come before this one')
         return
      end if
      do other = 1, deck%n_cards
         if (deck%card(other)%step == step .and. deck%card(other)%keyword == 'BUCKLE') return
      end do
      if (.not. names%unknown_cards) call wrong('step '//name//' has no *BUCKLE')

   contains

      subroutine wrong(message)
         character(*), intent(in) :: message
         step = 0
         call complain(deck, diagnostics, card, value_place(deck, card, 'STEP'), message)
      end subroutine wrong
   end subroutine find_buckling_step

   !> Reads the data lines: mode, amplitude.
   subroutine read_modes(deck, diagnostics, card, from_step, n_modes, element, mode_offset)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, from_step
      integer, intent(in) :: n_modes    ! number of modes of that step; 0: unknown because of an error
      integer, intent(in) :: element(:)
      type(mode_offset_t), allocatable, intent(inout) :: mode_offset(:)
      integer :: line, mode
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         if (.not. deck%data_line(line)%sound) cycle
         mode = field_integer(deck, line, 1)
         if (n_modes > 0 .and. mode > n_modes) call complain(deck, diagnostics, card, field_place(deck, line, 1), &
            'that step finds '//plural(n_modes, 'mode')//' only')
         mode_offset = [mode_offset, mode_offset_t(step=from_step, mode=mode, amplitude=field_real(deck, line, 2), &
            element=element, line=deck%card(card)%place%line)]
      end do
   end subroutine read_modes
end module read_mode_imperfections
