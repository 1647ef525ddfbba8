!> Passes every point of a run to the result file, to the listing, and to a progress line on the terminal.
!>
!> The progress line is written to standard error, and only if that is a terminal and the listing is not shown on a terminal: logs
!> of batch runs do not contain it. It is overwritten a few times per second, and erased at the end.
module run_recorder
   use errors, only: error_t
   use path_record, only: recorder_t, record_t, point_t, branch_start_t
   use results, only: results_t, results_record, results_due, results_state
   use listing, only: listing_t, listing_record
   use timing, only: timing_start, timing_stop, phase_output
   use, intrinsic :: iso_fortran_env, only: error_unit
   use kinds, only: wp, i8
   use text, only: to_text
   use terminal, only: is_terminal, standard_output, standard_error
   use columns, only: significant
   implicit none
   private
   public :: run_recorder_t, progress_open, progress_close

   real(wp), parameter :: seconds_between = 0.25_wp
   integer, parameter :: line_width = 79

   !> State of the progress line.
   type :: progress_t
      private
      logical :: shown = .false.
      integer :: points = 0
      integer(i8) :: started = 0, last = 0      !! clock ticks at the start, and when the line was written last
      real(wp) :: ticks = 1.0_wp                !! clock ticks per second
   end type progress_t

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

   !> Determines where the line is shown. `listed`: the listing is written to standard output.
   subroutine progress_open(progress, listed)
      type(progress_t), intent(out) :: progress
      logical, intent(in) :: listed
      integer(i8) :: rate
      progress%shown = is_terminal(standard_error) .and. .not. (listed .and. is_terminal(standard_output))
      call system_clock(progress%started, rate)
      progress%ticks = real(rate, wp)
      progress%last = progress%started
   end subroutine progress_open

   !> Shows the present point of the path, if enough time has passed since the line was written last.
   subroutine progress_point(progress, point, branch)
      type(progress_t), intent(inout) :: progress
      type(point_t), intent(in) :: point
      integer, intent(in) :: branch             !! path to which the point belongs; 0: the path of the steps
      integer(i8) :: now
      character(:), allocatable :: words
      progress%points = progress%points + 1
      if (.not. progress%shown) return
      call system_clock(now)
      if (real(now - progress%last, wp) < seconds_between * progress%ticks) return
      progress%last = now
      words = 'step '//to_text(point%step)
      if (branch > 0) words = words//', branch '//to_text(branch)
      words = words//', '//to_text(progress%points)//' points, load factor '//trim(adjustl(significant(point%load_factor, 6)))// &
         & ', '//to_text(int(real(now - progress%started, wp) / progress%ticks))//' s'
      call show(words)
   end subroutine progress_point

   !> Erases the line.
   subroutine progress_close(progress)
      type(progress_t), intent(inout) :: progress
      if (progress%shown .and. progress%last > progress%started) call show('')
      progress%shown = .false.
   end subroutine progress_close

   !> Replaces the text of the line.
   subroutine show(words)
      character(*), intent(in) :: words
      character(line_width) :: line
      character(*), parameter :: back = achar(13)
      line = words
      write (error_unit, '(a)', advance='no') back//line//back
      flush (error_unit)
   end subroutine show
end module run_recorder
