!> Whether an equilibrium lies ahead on the path, and the path's direction there.
module reachability
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_change_types, only: step_interval_t
   use next_spans, only: next_t
   use state_transfer, only: carried, carried_field
   use path_control, only: path_length, displacement_between
   use path_continuity, only: path_tangent_t, relate, same_path, stands_still
   use path_state, only: path_state_t, path_tangent_of
   implicit none
   private
   public :: turns, reach_of, leads_to, leads_to_next, arrival

   real(wp), parameter :: far = 2.0_wp            !! increments, over which a straight line tells what comes
   real(wp), parameter :: far_when_stuck = 20.0_wp !! and where no shorter one converges

contains

   !> How far beyond the end of an increment something may be that is looked for from there, in its length.
   pure real(wp) function reach_of(leg) result(reach)
      type(step_interval_t), intent(in) :: leg
      reach = merge(far_when_stuck, far, leg%stuck)
   end function reach_of

   !> True for an increment on which the load turns back: places found at once, not on the way, would hide where.
   pure logical function turns(run, leg)
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: leg
      turns = run%heading%load * leg%ahead%load < 0.0_wp
   end function turns

   !> The path's direction at a place: the chord where the tangent there does not belong to it, as where the set of the next
   !> increment has a neutral span, the tangent of this one thus a null vector.
   function arrival(problem, run, place) result(heading)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run              !! its system is factored at the place
      type(state_t), intent(in) :: place
      type(path_tangent_t) :: heading
      heading = path_tangent_of(problem, run, place)
      if (same_path(relate(problem, run%state, place, run%heading, heading, run%fresh))) return
      if (path_length(problem, run%state, place) > 0.0_wp) heading = chord(problem, run%state, place)
   end function arrival

   !> True for an equilibrium that lies ahead on the path: Newton's method may find one on another, or behind a limit point. Its
   !> own tangent may tell nothing, so the chord must have the direction that the path starts in, and the load its rate.
   logical function leads_to(problem, from, heading, fresh, place, rate) result(leads)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, place
      type(path_tangent_t), intent(in) :: heading      !! at `from`
      logical, intent(in) :: fresh                !! as relate has it
      real(wp), intent(in), optional :: rate      !! of the load further on, as a heading has it; else it stays as at `from`
      type(path_tangent_t) :: there
      leads = .not. path_length(problem, from, place) > 0.0_wp
      if (leads) return
      there = chord(problem, from, place)
      there%load = heading%load
      if (present(rate)) there%load = rate
      leads = same_path(relate(problem, from, place, heading, there, fresh .or. stands_still(heading, place%load_factor - &
         & from%load_factor)))
   end function leads_to

   !> The same of an equilibrium with another set, from where the run stands.
   logical function leads_to_next(problem, run, next, rate) result(leads)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: next
      real(wp), intent(in), optional :: rate      !! as leads_to has it
      type(state_t) :: from
      type(path_tangent_t) :: heading
      from = carried(problem, run%state, next%problem)
      heading%load = run%heading%load
      heading%u = carried_field(problem, run%state, run%heading%u, next%problem, from)
      leads = leads_to(next%problem, from, heading, run%fresh, next%state, rate)
   end function leads_to_next

   !> The way from one state to another, of length 1.
   function chord(problem, from, to) result(heading)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to       !! not the same
      type(path_tangent_t) :: heading
      real(wp) :: length
      length = path_length(problem, from, to)
      heading%u = displacement_between(problem, from, to) / length
      heading%load = (to%load_factor - from%load_factor) / length
   end function chord
end module reachability
