!> Why a path has no further point, in words that are true, with a way out.
!>
!> Load and displacement control end at limit and turning points. Whether one lies ahead is not guessed from a failure but
!> looked up: the path is followed on by its arc length, off the record, until the load, or the monitor, turns back.
module stop_reasons
   use kinds, only: wp
   use text, only: to_text
   use model, only: step_t, method_load, method_displacement, method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent, is_arc_length, displacement_between
   use monitor_rows, only: monitor_change
   use path_continuity, only: path_tangent_t, path_tangent_at, relate, same_path
   use path_state, only: path_state_t
   use corrector, only: increment_t, take_increment
   use span_tests, only: spans_hold
   implicit none
   private
   public :: why_stuck

   integer, parameter :: most_points = 40       !! to be looked ahead

contains

   !> The reason, one sentence. The run's system is factored at its last point on entry, anywhere on return.
   subroutine why_stuck(problem, step, run, report, why, turns)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(increment_t), intent(in) :: report   !! of the last try
      character(:), allocatable, intent(out) :: why
      logical, intent(out) :: turns             !! the path goes on, but not for this strategy
      real(wp) :: at
      turns = .false.
      why = 'no further point at load factor '//to_text(run%state%load_factor)//': '//report%message
      if (is_arc_length(run%control%method)) then
         why = why//' (increments were cut to '//to_text(abs(run%control%increment))// &
            & '; *STATIC sets the smallest, *CONTROLS the iterations)'
         return
      end if
      call look_ahead(problem, run, at, turns)
      if (.not. turns) then
         why = why//' (increments were cut to '//to_text(abs(run%control%increment))// &
            & '; an arc-length METHOD may go on)'
      else if (step%method == method_displacement) then
         why = 'displacement control cannot pass the turning point of '//trim(problem%model%monitor(step%monitor)%name)// &
            & ' ahead, near load factor '//to_text(at)//' (an arc-length METHOD can): '//why
      else if (step%method == method_load) then
         why = 'load control cannot pass the limit point ahead, near load factor '//to_text(at)//' (an arc-length METHOD can): '// &
            & why
      else
         why = 'the first increment cannot pass the limit point near load factor '//to_text(at)//' (a smaller one can): '//why
      end if
   end subroutine why_stuck

   !> Goes on by arc length until what the strategy prescribes turns back.
   subroutine look_ahead(problem, run, at, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      real(wp), intent(out) :: at               !! load factor there
      logical, intent(out) :: found
      integer, parameter :: most_cuts = 10
      type(state_t) :: here, next
      type(path_tangent_t) :: heading, ahead
      type(control_t) :: control
      type(increment_t) :: report
      real(wp) :: rate_here
      integer :: point, cuts
      found = .false.
      at = run%state%load_factor
      ! So far as the last increment went, or would have gone.
      control%method = method_cylindrical
      control%increment = run%last_length
      if (.not. control%increment > 0.0_wp) &
         & control%increment = abs(run%control%increment) / max(abs(run%heading%load), tiny(1.0_wp))
      here = run%state
      heading = run%heading
      cuts = 0
      point = 0
      do while (point < most_points .and. cuts <= most_cuts)
         call linearise(problem, here, here, run%system)
         if (.not. run%system%ok) return
         rate_here = rate(here, heading)
         call set_tangent(problem, run%system, heading%u, heading%load, control)
         call take_increment(problem, here, control, next, run%system, report)
         if (report%converged) then
            ahead = path_tangent_at(problem, run%system, displacement_between(problem, here, next), &
               & next%load_factor - here%load_factor)
            report%converged = same_path(relate(problem, here, next, heading, ahead, .false.))
         end if
         if (.not. report%converged) then
            cuts = cuts + 1
            control%increment = 0.5_wp * control%increment
            cycle
         end if
         ! Nor is it known how the path goes on where its contacts change.
         if (problem%has_spans()) report%converged = spans_hold(problem, next, run%system%force_scale)
         if (.not. report%converged) return
         point = point + 1
         found = rate_here * rate(next, ahead) < 0.0_wp
         at = here%load_factor
         if (abs(next%load_factor) > abs(at)) at = next%load_factor
         if (found) return
         here = next
         heading = ahead
      end do

   contains

      !> Of what the strategy prescribes, along the path, where the system is factored now.
      real(wp) function rate(state, along)
         type(state_t), intent(in) :: state
         type(path_tangent_t), intent(in) :: along
         rate = along%load
         if (run%control%method == method_displacement) &
            & rate = along%load * monitor_change(problem, run%control%monitor, state, run%system, run%system%tangent, 1.0_wp)
      end function rate
   end subroutine look_ahead
end module stop_reasons
