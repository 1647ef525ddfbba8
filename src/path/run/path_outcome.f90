!> Result of a run: why its path ended, and failures of branches and limit curves.
module path_outcome
   use kinds, only: wp
   use text, only: to_text, add_clause
   use path_record, only: accuracy_t
   use run_end, only: reason_to_end, has_given_up
   implicit none
   private
   public :: outcome_t, must_end, cut_short, note_trouble, note_bracketed

   !> How a run ended.
   type :: outcome_t
      logical :: complete = .false.
      character(:), allocatable :: why           !! reason why the run ended early, one sentence
      logical :: sampled = .false.               !! true: contact is still represented at nodes and has not become contact spans
      logical :: turns = .false.                 !! true: the run ended where the path turns back and the strategy cannot follow it
      logical :: home = .false.                  !! true: the run ended where the path returns to one of its own bifurcations
      logical :: wrong = .false.                 !! true: the run ended at a point that fails the independent checks
      logical :: used_up = .false. !! true: further points exist, but the deck allows no more of them, or nothing moves any more
      logical :: ended = .false.                 !! true: the run was ended by a signal or a time limit
      logical :: dead_end = .false. !! true: the run ended because no further point was found, and for none of the reasons above
      integer :: deck_line = 0                   !! line of the deck with the card that caused the end; 0: none
      character(:), allocatable :: trouble       !! failures of branches and limit curves, which do not end the path of the steps
      type(accuracy_t) :: accuracy
   end type outcome_t

contains

   !> True if a signal or a time limit requires the run to end.
   logical function must_end(outcome)
      type(outcome_t), intent(inout) :: outcome  !! result of the run; out: its reason is set if the run must end
      character(:), allocatable :: why
      why = reason_to_end()
      must_end = why /= ''
      if (.not. must_end .or. outcome%ended) return
      outcome%ended = .true.
      outcome%why = why
   end function must_end

   !> True if the run must end and a computation was given up for this. Nothing that was sought since is then known: the increment
   !> in progress is dropped, and what has failed is no reason why the run ends.
   logical function cut_short(outcome)
      type(outcome_t), intent(inout) :: outcome  !! result of the run; out: its reason is set if it is cut short
      cut_short = has_given_up()
      if (cut_short) cut_short = must_end(outcome)
   end function cut_short

   !> Appends a failure that does not end the run, unless the run was cut short.
   subroutine note_trouble(outcome, what)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what !! description of the failure, one sentence
      if (.not. cut_short(outcome)) call add_clause(outcome%trouble, what)
   end subroutine note_trouble

   !> Appends a message about an event that was bracketed but not located.
   subroutine note_bracketed(outcome, what, from, to)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what           !! name of the event
      real(wp), intent(in) :: from, to           !! load factors of the points before and behind the event
      call note_trouble(outcome, what//' between load factors '//to_text(from)//' and '//to_text(to)// &
         & ' was not located (a smaller largest increment may)')
   end subroutine note_bracketed
end module path_outcome
