!> Passes every point of a run to the result file and to the listing.
module run_recorder
   use errors, only: error_t
   use path_record, only: recorder_t, record_t, point_t, branch_start_t
   use results, only: results_t, results_record, results_due, results_state
   use listing, only: listing_t, listing_record
   use progress, only: progress_t, progress_point
   use timing, only: timing_start, timing_stop, phase_output
   implicit none
   private
   public :: run_recorder_t

   !> Recorder of a run: passes points to the result file, the listing and the progress line.
   type, extends(recorder_t) :: run_recorder_t
      type(results_t) :: results
      type(listing_t) :: listing
      type(progress_t) :: progress
      integer :: on_branch = 0          !! branch to which the points belong; 0: the path of the steps
      logical :: quiet = .false.        !! true: no listing is written
   contains
      procedure :: take
      procedure :: wants_state => state_is_due
      procedure :: state => record_state
   end type run_recorder_t

contains

   !> Stores a record of the path.
   subroutine take(self, record, error)
      class(run_recorder_t), intent(inout) :: self
      class(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_record(self%results, record, error)
      if (.not. self%quiet) call listing_record(self%listing, record)
      select type (record)
      type is (point_t)
         call progress_point(self%progress, record, self%on_branch)
      type is (branch_start_t)
         self%on_branch = record%branch
      end select
      call timing_stop(phase_output)
   end subroutine take

   !> True if a checkpoint must be written to the result file.
   logical function state_is_due(self)
      class(run_recorder_t), intent(inout) :: self
      state_is_due = results_due(self%results)
   end function state_is_due

   !> Receives a checkpoint of the run.
   subroutine record_state(self, words, error)
      class(run_recorder_t), intent(inout) :: self
      integer, intent(in), contiguous :: words(:)
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_state(self%results, words, error)
      call timing_stop(phase_output)
   end subroutine record_state
end module run_recorder
