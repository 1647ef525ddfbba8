!> Reachability of an equilibrium: whether it lies ahead on the run's path, and in which direction the path arrives at it.
module reachability
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_change_types, only: step_interval_t
   use other_set, only: other_set_t
   use state_transfer, only: carried, carried_field
   use path_control, only: path_length, displacement_between
   use path_continuity, only: path_tangent_t, relate, same_path, stands_still
   use path_point, only: path_point_t
   use path_state, only: path_state_t, path_tangent_of
   implicit none
   private
   public :: turns, leads_to, leads_to_next, arrival

contains

   !> True if the load passes a limit point on an increment. If a change of contact is located with the load or the curvature
   !> prescribed, it may lie beyond this limit point, and the limit point would not be recorded.
   pure logical function turns(run, interval)
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      turns = run%last%tangent%load * interval%to%tangent%load < 0.0_wp
   end function turns

   !> Direction of the path at a point: the path tangent there, or the chord from the last accepted point if this tangent does not
   !> continue the path. The chord is needed where the tangent stiffness is singular: the computed tangent is then a null vector,
   !> not the direction of the path.
   function arrival(problem, run, point) result(heading)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: point
      type(path_tangent_t) :: heading
      heading = path_tangent_of(problem, run, point)
      if (same_path(relate(problem, run%last%state, point%state, run%last%tangent, heading, run%fresh))) return
      if (path_length(problem, run%last%state, point%state) > 0.0_wp) heading = chord(problem, run%last%state, point%state)
   end function arrival

   !> True if an equilibrium is ahead on the same path; Newton's method may have found an equilibrium on another path or behind a
   !> limit point. The tangent at the equilibrium may be undetermined, so the chord to the equilibrium, with the load rate of the
   !> path, takes its place in the comparison with the path's direction.
   logical function leads_to(problem, from, heading, fresh, place) result(leads)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, place
      type(path_tangent_t), intent(in) :: heading      !! path tangent at `from`
      logical, intent(in) :: fresh                !! true: `from` is an unloaded start, where the path has no previous direction
      type(path_tangent_t) :: there
      leads = .not. path_length(problem, from, place) > 0.0_wp
      if (leads) return
      there = chord(problem, from, place)
      there%load = heading%load
      leads = same_path(relate(problem, from, place, heading, there, fresh .or. stands_still(heading, place%load_factor - &
         & from%load_factor)))
   end function leads_to

   !> True if an equilibrium with another contact set lies ahead of the run's point on the same path (see leads_to).
   logical function leads_to_next(problem, run, next) result(leads)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(in) :: next
      type(state_t) :: from
      type(path_tangent_t) :: heading
      from = carried(problem, run%last%state, next%problem)
      heading%load = run%last%tangent%load
      heading%u = carried_field(problem, run%last%state, run%last%tangent%u, next%problem, from)
      leads = leads_to(next%problem, from, heading, run%fresh, next%state)
   end function leads_to_next

   !> Unit chord from one state to another.
   function chord(problem, from, to) result(heading)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to       !! two different states
      type(path_tangent_t) :: heading
      real(wp) :: length
      length = path_length(problem, from, to)
      heading%u = displacement_between(problem, from, to) / length
      heading%load = (to%load_factor - from%load_factor) / length
   end function chord
end module reachability
