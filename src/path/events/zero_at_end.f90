!> Places an event at an end of the increment if the corrector fails for every point inside the increment.
module zero_at_end
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use path_control, only: path_length
   use path_events, only: event_bifurcation
   use located_events, only: located_event_t, note_balance
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   implicit none
   private
   public :: take_beginning, take_nearer_end

contains

   !> Places the event at the last accepted point if a line contact has just become a point contact there. The rotational stiffness
   !> of the point contact is unbounded at zero relative curvature, so that no point inside the increment can be corrected. The
   !> eigenvalues do not show by how much the length of the line contact has become negative.
   subroutine take_beginning(step, run, located_event)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(located_event_t), intent(inout) :: located_event !! out: point and fraction are set; located is true if the event is at
      !! the last accepted point
      logical :: balanced
      located_event%point = run%last
      located_event%fraction = 0.0_wp
      call note_balance(step, located_event%point%system, located_event%report, balanced)
      located_event%located = run%since_change%shrunk .and. balanced
      located_event%event%jumps = located_event%located .and. located_event%event%kind == event_bifurcation
   end subroutine take_beginning

   !> Places a limit point at that end of the increment that has the larger (maximum) or smaller (minimum) load, if the increment is
   !> so short that points inside it differ by rounding only. The intersection of the load's tangents at both ends bounds the error
   !> of the load.
   subroutine take_nearer_end(problem, step, run, trial, located_event)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(inout) :: located_event !! out: point and fraction are set; located is true if the bound is
      !! within tolerance
      real(wp) :: left, rates(2)
      if (run%last%state%load_factor * located_event%event%before > trial%state%load_factor * located_event%event%before) then
         located_event%point = run%last
         located_event%fraction = 0.0_wp
      else
         located_event%point = trial
         located_event%fraction = 1.0_wp
      end if
      rates = abs([run%last%tangent%load, trial%tangent%load])
      left = (product(rates) * path_length(problem, run%last%state, trial%state) - abs(located_event%point%tangent%load) * &
         & abs(trial%state%load_factor - run%last%state%load_factor)) / sum(rates)
      if (left > step%locate_tolerance * abs(located_event%point%state%load_factor)) return
      call note_balance(step, located_event%point%system, located_event%report, located_event%located)
      located_event%event%pivots = located_event%point%system%negative_pivots
   end subroutine take_nearer_end
end module zero_at_end
