!> Reason why a path has no further point, with a remedy if one was tried.
!>
!> Load and displacement control end at limit and turning points. Whether such a point lies ahead is verified: the path is followed
!> by arc length, without recording, until the load or the monitor turns back.
module stop_reasons
   use kinds, only: wp
   use text, only: to_text
   use model, only: step_t, method_load, method_displacement
   use problem, only: problem_t
   use path_control, only: is_arc_length
   use displacement_functional, only: monitor_change
   use path_state, only: path_state_t
   use looking_ahead, only: look_t, look_from, look_on
   use corrector, only: increment_t
   implicit none
   private
   public :: why_stuck

   integer, parameter :: most_points = 40       !! largest number of points followed ahead; no input deck changes from 20 to 80
   character(*), parameter :: arc_length_can = ' (METHOD=CYLINDRICAL can)'

contains

   !> Returns the reason as one sentence.
   subroutine why_stuck(problem, step, run, report, why, turns)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(increment_t), intent(in) :: report   !! report of the last increment tried
      character(:), allocatable, intent(out) :: why
      logical, intent(out) :: turns             !! the path continues, but this strategy cannot follow it
      character(:), allocatable :: cut
      real(wp) :: at
      integer :: points
      turns = .false.
      why = 'no further point at load factor '//to_text(run%last%state%load_factor)//': '//report%message
      cut = ' (increments were cut to '//to_text(abs(run%control%increment))
      if (is_arc_length(run%control%method)) then
         why = why//cut//'; *STATIC sets the smallest, *CONTROLS the iterations)'
         return
      end if
      call look_ahead(problem, run, at, points, turns)
      if (.not. turns) then
         ! A step by arc length begins with an increment of the load.
         if (is_arc_length(step%method)) then
            why = why//cut//' of the load factor)'
         else if (points > 0) then
            why = why//cut//'; METHOD=CYLINDRICAL goes on from there, to load factor '//to_text(at)//' at least)'
         else
            why = why//cut//')'
         end if
      else if (step%method == method_displacement) then
         why = 'displacement control cannot pass the turning point of '//trim(problem%model%monitor(step%monitor)%name)// &
            & ' ahead, near load factor '//to_text(at)//arc_length_can//': '//why
      else if (step%method == method_load) then
         why = 'load control cannot pass the limit point ahead, near load factor '//to_text(at)//arc_length_can//': '//why
      else
         why = 'the first increment cannot pass the limit point near load factor '//to_text(at)//' (a smaller one can): '//why
      end if
   end subroutine why_stuck

   !> Follows the path by arc length until the controlled quantity (load or monitor) turns back.
   subroutine look_ahead(problem, run, at, points, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp), intent(out) :: at               !! load factor at the turn, or at the last point
      integer, intent(out) :: points            !! number of points found
      logical, intent(out) :: found             !! the controlled quantity turns back
      type(look_t) :: look
      real(wp) :: rate_here, rate_there, load, slope
      logical :: ahead
      found = .false.
      points = 0
      at = run%last%state%load_factor
      if (.not. run%last%system%ok) return
      look = look_from(run)
      rate_here = rate()
      ! A controlled quantity that changes against the increment at the start has turned before the last point.
      if (.not. rate_here * run%control%increment > 0.0_wp) return
      do while (points < most_points)
         load = look%here%state%load_factor
         slope = look%here%tangent%load
         call look_on(problem, look, ahead)
         if (.not. ahead) return
         points = points + 1
         rate_there = rate()
         found = rate_here * rate_there < 0.0_wp
         at = look%here%state%load_factor
         if (found .and. (at - load) * slope < 0.0_wp) at = load
         if (found) return
         rate_here = rate_there
      end do

   contains

      !> Derivative of the controlled quantity (load or monitor) by arc length at the point followed last.
      real(wp) function rate()
         associate (here => look%here)
            rate = here%tangent%load
            if (run%control%method == method_displacement) rate = here%tangent%load * monitor_change(problem, &
               & run%control%monitor, here%state, here%system, here%system%tangent, 1.0_wp)
         end associate
      end function rate
   end subroutine look_ahead
end module stop_reasons
