!> Zeros along the path that no points within an increment tell: one of its ends may be as good.
module zero_at_end
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: path_length
   use path_continuity, only: path_tangent_t
   use path_events, only: event_bifurcation
   use located_events, only: located_event_t, note_balance
   use path_state, only: path_state_t
   implicit none
   private
   public :: take_beginning, take_nearer_end

contains

   !> The last point. There it is where a line of contact has just become a point: what holds the point's rotation is without
   !> bounds where it is as curved as the obstacle, Newton's method does not get near, and by how much the line was shorter than
   !> none no eigenvalue tells.
   subroutine take_beginning(problem, step, run, sighting)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(located_event_t), intent(inout) :: sighting !! place, heading, fraction; located where it is there
      logical :: balanced
      sighting%place = run%state
      sighting%heading = run%heading
      sighting%fraction = 0.0_wp
      call linearise(problem, run%state, run%state, run%system)
      call note_balance(step, run%system, sighting%report, balanced)
      sighting%located = run%since_change%shrunk .and. balanced
      sighting%event%jumps = sighting%located .and. sighting%event%kind == event_bifurcation
   end subroutine take_beginning

   !> A limit point. Where an increment is so short that rounding lets no point within it be told, the load beyond its higher end,
   !> or below its lower one, is at most where the tangents at both ends meet.
   subroutine take_nearer_end(problem, step, run, trial, ahead, sighting)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead        !! tangent there
      type(located_event_t), intent(inout) :: sighting !! place, heading, fraction; located where that is near enough
      real(wp) :: left, rates(2)
      if (run%state%load_factor * sighting%event%before > trial%load_factor * sighting%event%before) then
         sighting%place = run%state
         sighting%heading = run%heading
         sighting%fraction = 0.0_wp
      else
         sighting%place = trial
         sighting%heading = ahead
         sighting%fraction = 1.0_wp
      end if
      rates = abs([run%heading%load, ahead%load])
      left = (product(rates) * path_length(problem, run%state, trial) - abs(sighting%heading%load) * abs(trial%load_factor - &
         & run%state%load_factor)) / sum(rates)
      if (left > step%locate_tolerance * abs(sighting%place%load_factor)) return
      call linearise(problem, sighting%place, sighting%place, run%system)
      call note_balance(step, run%system, sighting%report, sighting%located)
      sighting%event%pivots = run%system%negative_pivots
   end subroutine take_nearer_end
end module zero_at_end
