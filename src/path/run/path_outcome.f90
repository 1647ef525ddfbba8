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
      character(:), allocatable :: why           !! reason why the run ended early, one sentence
      logical :: sampled = .false.               !! contact is still represented at nodes: it has not become contact spans
      logical :: turns = .false.                 !! stopped where the path turns back and the strategy cannot follow it
      logical :: home = .false.                  !! stopped where the path returns to one of its own bifurcations
      logical :: wrong = .false.                 !! stopped at a point that fails the independent checks
      logical :: used_up = .false.               !! stopped after the largest number of points that the deck allows
      logical :: ended = .false.                 !! stopped by a signal or a time limit
      logical :: dead_end = .false.              !! stopped because no further point was found, and for none of the reasons above
      integer :: deck_line = 0                   !! line of the card at fault; 0: none
      character(:), allocatable :: trouble       !! failures of branches and limit curves, beside the path of the steps
      type(accuracy_t) :: accuracy
   end type outcome_t

contains

   !> True if a signal or a time limit requires the run to end; the increment in progress is dropped.
   logical function must_end(outcome)
      type(outcome_t), intent(inout) :: outcome  !! receives the reason
      must_end = end_wanted()
      if (.not. must_end .or. outcome%ended) return
      outcome%ended = .true.
      outcome%why = reason_to_end()
   end function must_end

   !> Appends a failure that does not stop the run.
   subroutine note_trouble(outcome, what)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what !! one sentence
      if (allocated(outcome%trouble)) then
         outcome%trouble = outcome%trouble//'; '//what
      else
         outcome%trouble = what
      end if
   end subroutine note_trouble

   !> Appends an event that was bracketed but not located.
   subroutine note_bracketed(outcome, what, from, to)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what           !! name of the event
      real(wp), intent(in) :: from, to           !! load factors of the points on both sides
      call note_trouble(outcome, what//' between load factors '//to_text(from)//' and '//to_text(to)// &
         & ' was not located (a smaller largest increment may)')
   end subroutine note_bracketed
end module path_outcome
