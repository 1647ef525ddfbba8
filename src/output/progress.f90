!> Progress line on the terminal during a long run whose listing is written to a file.
!>
!> The line is written to standard error, and only if that is a terminal and the listing is not shown on a terminal: logs of batch
!> runs do not contain it. It is overwritten a few times per second, and erased at the end.
module progress
   use, intrinsic :: iso_fortran_env, only: error_unit
   use kinds, only: wp, i8
   use text, only: to_text
   use terminal, only: is_terminal, standard_output, standard_error
   use columns, only: significant
   use path_record, only: point_t
   implicit none
   private
   public :: progress_t, progress_open, progress_point, progress_close

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

contains

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
end module progress
