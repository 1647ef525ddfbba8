!> Reads *IMPERFECTION, SHAPE=MODE: buckling modes as the stress-free offset at the start of a step.
module read_mode_imperfections
   use text, only: plural
   use model, only: model_t, mode_offset_t
   use checked_deck, only: checked_deck_t, cursor_t
   use imperfection_chain, only: chain_t, follow_chain
   implicit none
   private
   public :: read_mode_imperfection_cards

contains

   !> Reads the modes of all steps, and reports each *IMPERFECTION in the wrong part of the deck.
   subroutine read_mode_imperfection_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with mesh and steps
      type(model_t), intent(inout) :: model             !! with all other imperfections; receives step%mode_offset
      type(cursor_t) :: at
      type(chain_t) :: chain
      integer :: s, from_step
      logical :: of_mode, ok
      do while (deck%next_card(at, 'IMPERFECTION'))
         s = deck%step_of(at)
         of_mode = deck%word(at, 'SHAPE') == 'MODE'
         if (s == 0 .and. of_mode) call deck%wrong(at, 'SHAPE', 'SHAPE=MODE belongs in a step with *STATIC')
         if (s > 0 .and. .not. of_mode) call deck%wrong(at, 'SHAPE', &
            'only SHAPE=MODE may stand in a step; all other shapes belong above the first *STEP')
         if (s == 0 .or. .not. of_mode) cycle
         if (model%step(s)%n_modes > 0) cycle ! reported elsewhere
         call find_buckling_step(deck, at, from_step)
         call follow_chain(deck, at, model, deck%elements(at, 'ELSET'), chain, ok)
         if (ok .and. from_step > 0) call read_modes(deck, at, from_step, model%step(from_step)%n_modes, chain%element, &
            model%step(s)%mode_offset)
      end do
   end subroutine read_mode_imperfection_cards

   !> The step named by STEP: an earlier one with *BUCKLE.
   subroutine find_buckling_step(deck, at, step)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      integer, intent(out) :: step ! 0: none
      type(cursor_t) :: other
      logical :: buckles
      step = deck%named(at, 'STEP', deck%names%step, 'step')
      if (step == 0) return
      buckles = deck%names%unknown_cards
      do while (deck%next_card(other, 'BUCKLE', also_bad=.true.))
         buckles = buckles .or. deck%step_of(other) == step
      end do
      if (step >= deck%step_of(at)) then
         call deck%wrong(at, 'STEP', 'step '//trim(deck%names%step%name(step))//' does not come before this one')
      else if (.not. buckles) then
         call deck%wrong(at, 'STEP', 'step '//trim(deck%names%step%name(step))//' has no *BUCKLE')
      else
         return
      end if
      step = 0
   end subroutine find_buckling_step

   !> Reads the data lines: mode, amplitude.
   subroutine read_modes(deck, card, from_step, n_modes, element, mode_offset)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: card
      integer, intent(in) :: from_step
      integer, intent(in) :: n_modes    ! number of modes of that step; 0: unknown because of an error
      integer, intent(in) :: element(:)
      type(mode_offset_t), allocatable, intent(inout) :: mode_offset(:)
      type(cursor_t) :: at
      integer :: mode
      at = card
      do while (deck%next_line(at))
         mode = deck%integer(at, 'mode')
         if (n_modes > 0 .and. mode > n_modes) call deck%wrong(at, 'mode', 'that step finds '//plural(n_modes, 'mode')//' only')
         mode_offset = [mode_offset, mode_offset_t(step=from_step, mode=mode, amplitude=deck%real(at, 'amplitude'), &
            element=element, line=deck%card_line(card))]
      end do
   end subroutine read_modes
end module read_mode_imperfections
