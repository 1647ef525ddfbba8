!> Reads a deck that a test holds as text.
module deck_reading
   use deck_source, only: deck_source_t, source_from_text
   use deck_to_model, only: read_deck
   use diagnostics, only: diagnostics_t, diagnostics_report
   use model, only: model_t
   implicit none
   private
   public :: read_deck_text

contains

   !> Reads a deck named `d`; a deck without steps is good.
   subroutine read_deck_text(text, model, report)
      character(*), intent(in) :: text                     !! lines with semicolons between them
      type(model_t), intent(out) :: model                  !! what the readers made of it
      character(:), allocatable, intent(out) :: report     !! its errors; '' without
      type(deck_source_t) :: source
      type(diagnostics_t) :: diagnostics
      character(:), allocatable :: deck
      integer :: i
      deck = text
      do i = 1, len(deck)
         if (deck(i:i) == ';') deck(i:i) = new_line('a')
      end do
      call source_from_text(deck, 'd', source)
      call read_deck(source, model, diagnostics, steps_optional=.true.)
      report = diagnostics_report(diagnostics, source)
   end subroutine read_deck_text
end module deck_reading
