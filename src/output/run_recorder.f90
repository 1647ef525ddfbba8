!> Passes every point of a run to the result file and to the listing.
module run_recorder
   use errors, only: error_t
   use path_record, only: recorder_t, point_t, critical_t, branch_start_t, buckling_t, limit_point_t
   use results, only: results_t, results_point, results_critical, results_branch, results_buckling, results_limit_point, &
      & results_due, results_state
   use listing, only: listing_t, listing_point, listing_critical, listing_branch, listing_buckling, listing_limit_point
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
      integer :: on_branch = 0          !! branch of the points; 0: the path of the steps
      logical :: quiet = .false.        !! true: no listing is written
   contains
      procedure :: point => record_point
      procedure :: critical => record_critical
      procedure :: branch => record_branch
      procedure :: buckling => record_buckling
      procedure :: limit_point => record_limit_point
      procedure :: wants_state => state_is_due
      procedure :: state => record_state
   end type run_recorder_t

contains

   !> Records an accepted point.
   subroutine record_point(self, point, error)
      class(run_recorder_t), intent(inout) :: self
      type(point_t), intent(in) :: point
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_point(self%results, point, error)
      if (.not. self%quiet) call listing_point(self%listing, point)
      call progress_point(self%progress, point, self%on_branch)
      call timing_stop(phase_output)
   end subroutine record_point

   !> Records a critical point.
   subroutine record_critical(self, critical, error)
      class(run_recorder_t), intent(inout) :: self
      type(critical_t), intent(in) :: critical
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_critical(self%results, critical, error)
      if (.not. self%quiet) call listing_critical(self%listing, critical)
      call timing_stop(phase_output)
   end subroutine record_critical

   !> Records the start of another path.
   subroutine record_branch(self, start, error)
      class(run_recorder_t), intent(inout) :: self
      type(branch_start_t), intent(in) :: start
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_branch(self%results, start, error)
      if (.not. self%quiet) call listing_branch(self%listing, start)
      self%on_branch = start%branch
      call timing_stop(phase_output)
   end subroutine record_branch

   !> Records the modes of a buckling step.
   subroutine record_buckling(self, buckling, error)
      class(run_recorder_t), intent(inout) :: self
      type(buckling_t), intent(in) :: buckling
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_buckling(self%results, buckling, error)
      if (.not. self%quiet) call listing_buckling(self%listing, buckling)
      call timing_stop(phase_output)
   end subroutine record_buckling

   !> Records a point of a limit curve.
   subroutine record_limit_point(self, limit_point, error)
      class(run_recorder_t), intent(inout) :: self
      type(limit_point_t), intent(in) :: limit_point
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_limit_point(self%results, limit_point, error)
      if (.not. self%quiet) call listing_limit_point(self%listing, limit_point)
      call timing_stop(phase_output)
   end subroutine record_limit_point

   !> True if a checkpoint is to be written to the result file.
   logical function state_is_due(self)
      class(run_recorder_t), intent(inout) :: self
      state_is_due = results_due(self%results)
   end function state_is_due

   !> Takes a checkpoint of the run.
   subroutine record_state(self, words, error)
      class(run_recorder_t), intent(inout) :: self
      integer, intent(in), contiguous :: words(:)
      type(error_t), allocatable, intent(out) :: error
      call timing_start(phase_output)
      call results_state(self%results, words, error)
      call timing_stop(phase_output)
   end subroutine record_state
end module run_recorder
