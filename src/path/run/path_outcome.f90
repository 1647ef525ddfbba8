!> How a run along a path ended, and what it could not do on the way.
module path_outcome
   use kinds, only: wp
   use text, only: to_text
   use run_accuracy, only: accuracy_t
   implicit none
   private
   public :: outcome_t, note_trouble, note_bracketed

   !> How a run ended.
   type :: outcome_t
      logical :: complete = .false.
      character(:), allocatable :: why           !! the run cannot go on: the reason, one sentence
      logical :: sampled = .false.               !! contact at the start is at nodes still: it has not become spans
      logical :: turns = .false.                 !! stopped where the path turns back for a strategy that cannot follow it
      logical :: home = .false.                  !! stopped where the path comes back to a bifurcation of its own
      logical :: used_up = .false.               !! stopped after the number of points that the deck allows
      logical :: stop_reasons = .false.              !! stopped because there is no way on, and not for these reasons
      integer :: deck_line = 0                   !! and the deck is at fault: the line of the card; 0: it is not
      character(:), allocatable :: trouble       !! what could not be done beside the path of the steps: branches, limit curves
      type(accuracy_t) :: accuracy
   end type outcome_t

contains

   !> Adds something that could not be done, while the run goes on.
   subroutine note_trouble(outcome, what)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what
      if (allocated(outcome%trouble)) then
         outcome%trouble = outcome%trouble//'; '//what
      else
         outcome%trouble = what
      end if
   end subroutine note_trouble

   !> Adds an event that the run has gone past without finding its place.
   subroutine note_bracketed(outcome, what, from, to)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what
      real(wp), intent(in) :: from, to           !! load factors of the points that it lies between
      call note_trouble(outcome, what//' between load factors '//to_text(from)//' and '//to_text(to)// &
         & ' was not located (a smaller largest increment may)')
   end subroutine note_bracketed
end module path_outcome
