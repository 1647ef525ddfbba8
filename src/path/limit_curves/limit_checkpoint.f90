!> Checkpoint on a limit curve: stores where a run is on a limit curve, and restores it.
!>
!> The frame of such a checkpoint (module checkpoint) has the results of the step's path and branches. The critical points of the
!> path follow, at which the later curves of the step begin, and the place on the curve.
module limit_checkpoint
   use errors, only: error_t
   use archive, only: archive_t, archive_reset
   use run_archive, only: exchange_critical_points_t, exchange_curve_walk_t, exchange_outcome_t
   use critical_points, only: critical_points_t
   use checkpoint, only: standing_t, clear_end, change_steps
   use limit_search, only: curve_walk_t
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: keep_walk, take_walk

contains

   !> Passes a checkpoint to the recorder.
   subroutine keep_walk(frame, own, walk, now, recorder, outcome)
      type(archive_t), intent(inout) :: frame          !! data with which the checkpoint begins; empty: none is kept
      type(critical_points_t), intent(inout) :: own    !! critical points of the step's path
      type(curve_walk_t), intent(inout) :: walk
      logical, intent(in) :: now                       !! true: even if the recorder does not request one
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome        !! why: the results cannot be written
      type(error_t), allocatable :: error
      integer :: n
      if (frame%n == 0 .or. .not. (now .or. recorder%wants_state())) return
      n = frame%n
      call exchange(frame, own, walk, outcome)
      call recorder%state(frame%words(:frame%n), error)
      call archive_reset(frame, n)
      if (allocated(error) .and. .not. allocated(outcome%why)) outcome%why = error%message
   end subroutine keep_walk

   !> Restores a run on a limit curve from a checkpoint of which the frame has been read.
   subroutine take_walk(standing, own, walk, outcome)
      type(standing_t), intent(inout) :: standing
      type(critical_points_t), intent(inout) :: own
      type(curve_walk_t), intent(inout) :: walk
      type(outcome_t), intent(inout) :: outcome
      call exchange(standing%archive, own, walk, outcome)
      call clear_end(outcome)
      if (.not. standing%changed) return
      call change_steps(standing%steps, walk%follower%base)
      call change_steps(standing%steps, walk%follower%problem)
   end subroutine take_walk

   !> Stores or reads the part of the checkpoint behind the frame.
   subroutine exchange(a, own, walk, outcome)
      type(archive_t), intent(inout) :: a
      type(critical_points_t), intent(inout) :: own
      type(curve_walk_t), intent(inout) :: walk
      type(outcome_t), intent(inout) :: outcome
      call exchange_critical_points_t(a, own)
      call exchange_curve_walk_t(a, walk)
      call exchange_outcome_t(a, outcome)
   end subroutine exchange
end module limit_checkpoint
