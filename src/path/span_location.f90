!> Where on an increment a test of its contact spans is zero, and whether an equilibrium lies ahead on the path.
module span_location
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use span_tests, only: run_span_tests, test_curvature
   use span_change, only: leg_t, change_t, next_t, change_by_rule, change_missed, place_within, place_here, &
      & place_ahead
   use held_openings, only: find_flat_point
   use state_transfer, only: carried, carried_field
   use path_control, only: path_length, displacement_between
   use path_continuity, only: heading_t, relate, same_path
   use path_run, only: run_t, heading_of
   use increment_points, only: division_t, new_division, point_within
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use corrector, only: increment_t
   use timing, only: timers_t
   implicit none
   private
   public :: locate, locate_flat_point, turns, leads_to_next, reach_of

   real(wp), parameter :: far = 2.0_wp            !! increments, over which a straight line tells what comes
   real(wp), parameter :: far_when_stuck = 20.0_wp !! and where no shorter one converges

contains

   !> The zero of the test change%which between both ends.
   subroutine locate(problem, step, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run           !! its system ends up factored at the place
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change     !! by a rule, or missed
      type(timers_t), intent(inout) :: timers
      real(wp) :: tolerance
      logical :: found
      associate (before => leg%before(change%which), after => leg%after(change%which))
         change%kind = change_by_rule
         change%where = place_within
         tolerance = 0.5_wp * step%locate_tolerance * max(before%value, -after%value)
         if (before%value <= tolerance) then
            change%where = place_here
            change%place = run%state
            change%heading = run%heading
            change%tests = leg%before
            return
         end if
         found = .false.
         if (after%kind == test_curvature) then
            if (problem%candidates%moves(after%candidate) .and. .not. turns(run, leg)) &
               & call locate_flat_point(problem, run, leg, change, found, timers)
         end if
         if (.not. found) call locate_by_parts(problem, step, run, leg, tolerance, change, found, timers)
         if (.not. found) change%kind = change_missed
      end associate
   end subroutine locate

   !> How far beyond the end of an increment something may be that is looked for from there, in its length.
   pure real(wp) function reach_of(leg) result(reach)
      type(leg_t), intent(in) :: leg
      reach = merge(far_when_stuck, far, leg%stuck)
   end function reach_of

   !> True for an increment on which the load turns back: places found at once, not on the way, would hide where.
   pure logical function turns(run, leg)
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      turns = run%heading%load * leg%ahead%load < 0.0_wp
   end function turns

   !> Where a point is as curved as its obstacle, by Newton's method: on the increment, or beyond its end where it is not yet there.
   subroutine locate_flat_point(problem, run, leg, change, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change     !! as it was but for its test where it is not found
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(state_t) :: place
      associate (before => leg%before(change%which)%value, after => leg%after(change%which)%value)
         place = run%state
         if (before > -after) place = leg%to
         call find_flat_point(problem, run, leg%after(change%which)%candidate, place, found, timers)
         if (.not. found) return
         if (after > 0.0_wp) then
            found = leads_to(problem, leg%to, leg%ahead, .false., place)
         else
            found = path_length(problem, run%state, place) <= path_length(problem, run%state, leg%to) .and. &
               & leads_to(problem, run%state, run%heading, run%fresh, place)
         end if
         if (.not. found) return
         change%where = merge(place_ahead, place_within, after > 0.0_wp)
      end associate
      change%kind = change_by_rule
      change%place = place
      change%report = increment_t(converged=.true.)
      call linearise(problem, place, run%state, run%system, timers)
      change%heading = arrival(problem, run, place)
      change%tests = run_span_tests(problem, place, leg%scale)
   end subroutine locate_flat_point

   !> Where a test is zero, by points of the increment.
   subroutine locate_by_parts(problem, step, run, leg, tolerance, change, found, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      real(wp), intent(in) :: tolerance           !! of the test's value
      type(change_t), intent(inout) :: change
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(division_t) :: division
      type(bracket_t) :: bracket
      real(wp) :: f, fraction
      division = new_division(problem, run, leg%to, leg%ahead, .false.)
      ! Found on the side that it is reached from: beyond it the set does not hold.
      bracket = new_bracket(leg%before(change%which)%value - tolerance, leg%after(change%which)%value - tolerance)
      found = .false.
      do while (next_guess(bracket, epsilon(f), fraction))
         call point_within(problem, run, leg%to, leg%ahead, division, fraction, .false., .true., change%place, change%report, &
            & timers)
         if (.not. change%report%converged) return
         change%heading = arrival(problem, run, change%place)
         change%tests = run_span_tests(problem, change%place, leg%scale)
         f = change%tests(change%which)%value - tolerance
         found = abs(f) <= tolerance
         if (found) return
         call take_value(bracket, fraction, f)
      end do
      ! What jumps has no zero.
      found = abs(bracket%f_high - bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
   end subroutine locate_by_parts

   !> The path's direction at a place: the chord where the tangent there does not belong to it, as where the set of the next
   !> increment has a neutral span, the tangent of this one thus a null vector.
   function arrival(problem, run, place) result(heading)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run              !! its system is factored at the place
      type(state_t), intent(in) :: place
      type(heading_t) :: heading
      heading = heading_of(problem, run, place)
      if (same_path(relate(problem, run%state, place, run%heading, heading, run%fresh))) return
      if (path_length(problem, run%state, place) > 0.0_wp) heading = chord(problem, run%state, place)
   end function arrival

   !> True for an equilibrium that lies ahead on the path: Newton's method may find one on another, or behind a limit point. Its
   !> own tangent may tell nothing, so the chord must have the direction that the path starts in, and the load its rate.
   logical function leads_to(problem, from, heading, fresh, place) result(leads)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, place
      type(heading_t), intent(in) :: heading      !! at `from`
      logical, intent(in) :: fresh                !! as relate has it
      type(heading_t) :: there
      leads = .not. path_length(problem, from, place) > 0.0_wp
      if (leads) return
      there = chord(problem, from, place)
      there%load = heading%load
      leads = same_path(relate(problem, from, place, heading, there, fresh))
   end function leads_to

   !> The same of an equilibrium with another set, from where the run stands.
   logical function leads_to_next(problem, run, next) result(leads)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(next_t), intent(in) :: next
      type(state_t) :: from
      type(heading_t) :: heading
      from = carried(problem, run%state, next%problem)
      heading%load = run%heading%load
      heading%u = carried_field(problem, run%state, run%heading%u, next%problem, from)
      leads = leads_to(next%problem, from, heading, run%fresh, next%state)
   end function leads_to_next

   !> The way from one state to another, of length 1.
   function chord(problem, from, to) result(heading)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to       !! not the same
      type(heading_t) :: heading
      real(wp) :: length
      length = path_length(problem, from, to)
      heading%u = displacement_between(problem, from, to) / length
      heading%load = (to%load_factor - from%load_factor) / length
   end function chord
end module span_location
