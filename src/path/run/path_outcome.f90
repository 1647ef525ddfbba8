!> Result of a run along a path: its end, and failures beside the path.
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
      logical :: wrong = .false.                 !! stopped at a point that the run's own checks found wrong
      logical :: used_up = .false.               !! stopped after the number of points that the deck allows
      logical :: dead_end = .false.              !! stopped without further increment, for none of the reasons above
      integer :: deck_line = 0                   !! line of the card if the deck is at fault; 0: not
      character(:), allocatable :: trouble       !! failures beside the path of the steps: branches, limit curves
      type(accuracy_t) :: accuracy               !! worst error bars and checks of the run
   end type outcome_t

contains

   !> Appends a failure that does not stop the run.
   subroutine note_trouble(outcome, what)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what
      if (allocated(outcome%trouble)) then
         outcome%trouble = outcome%trouble//'; '//what
      else
         outcome%trouble = what
      end if
   end subroutine note_trouble

   !> Appends an event that was bracketed but not located.
   subroutine note_bracketed(outcome, what, from, to)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what
      real(wp), intent(in) :: from, to           !! load factors of the points on both sides
      call note_trouble(outcome, what//' between load factors '//to_text(from)//' and '//to_text(to)// &
         & ' was not located (a smaller largest increment may)')
   end subroutine note_bracketed
end module path_outcome
