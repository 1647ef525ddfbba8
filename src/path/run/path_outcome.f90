!> Result of a run along a path: its end, and failures beside the path.
module path_outcome
   use kinds, only: wp
   use text, only: to_text
   use run_accuracy, only: accuracy_t
   use run_end, only: end_wanted, reason_to_end
   implicit none
   private
   public :: outcome_t, must_end, note_trouble, note_bracketed

   !> How a run ended.
   type :: outcome_t
      logical :: complete = .false.
      character(:), allocatable :: why           !! the run cannot go on: the reason, one sentence
      logical :: sampled = .false.               !! contact at the start is at nodes still: it has not become spans
      logical :: turns = .false.                 !! stopped where the path turns back for a strategy that cannot follow it
      logical :: home = .false.                  !! stopped where the path comes back to a bifurcation of its own
      logical :: wrong = .false.                 !! stopped at a point that the run's own checks found wrong
      logical :: used_up = .false.               !! stopped after the number of points that the deck allows
      logical :: ended = .false.                 !! stopped because something from outside wanted it: a signal, a limit of time
      logical :: dead_end = .false.              !! stopped because there is no way on, and not for these reasons
      integer :: deck_line = 0                   !! and the deck is at fault: the line of the card; 0: it is not
      character(:), allocatable :: trouble       !! what could not be done beside the path of the steps: branches, limit curves
      type(accuracy_t) :: accuracy
   end type outcome_t

contains

   !> True where something from outside wants the run to end: what is under way is dropped.
   logical function must_end(outcome)
      type(outcome_t), intent(inout) :: outcome  !! gets the reason
      must_end = end_wanted()
      if (.not. must_end .or. outcome%ended) return
      outcome%ended = .true.
      outcome%why = reason_to_end()
   end function must_end

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
