!> Where along an increment its contact spans first fail: the first zero of a test function.
module span_events
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use free_span_gap, only: gap_at
   use span_tests, only: span_test_t, run_span_tests, any_fails, another_fails, test_slack, test_gap, test_curvature, test_closing
   use span_lie_down, only: lie_down, beside_free_span, span_gap
   use held_openings, only: find_flat_point, held_load
   use span_merging, only: find_merging, closing_point
   use state_transfer, only: carried, carried_field
   use path_control, only: path_length, displacement_between
   use path_continuity, only: heading_t, relate, same_path
   use path_run, only: run_t, heading_of
   use increment_points, only: division_t, new_division, point_within
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_update
   use corrector, only: increment_t
   use timing, only: timers_t
   implicit none
   private
   public :: leg_t, change_t, next_t, new_leg, find_change, arrival

   !> The increment that is looked at.
   type :: leg_t
      type(state_t) :: from, to                   !! its ends; where it is stuck, the last increment that was not
      type(heading_t) :: ahead                    !! tangent at its end
      logical :: stuck = .false.                  !! no increment converges from its end, which is where the run stands
      real(wp) :: scale = 0.0_wp                  !! of forces
      type(span_test_t), allocatable :: before(:), after(:) !! tests at both ends
   end type leg_t

   !> What happens first on it, and where.
   type :: change_t
      logical :: found = .false.
      logical :: missed = .false.                 !! there is one, but its place was not found
      integer :: which = 0                        !! index into the tests; 0: a free span has lain down, which none of them tells
      type(span_test_t), allocatable :: tests(:)  !! at the place
      type(state_t) :: place
      type(heading_t) :: heading                  !! of the path that arrives there
      type(increment_t) :: report                 !! of the way there
      logical :: standing = .false.               !! the run stands there already
      logical :: looked_ahead = .false.           !! the place is beyond the increment
      logical :: lies = .false.                   !! a free span becomes a line, two points one: the equilibrium with it is known
   end type change_t

   !> An equilibrium with another set, known before the run goes there.
   type :: next_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(system_t) :: system                    !! factored there
      real(wp) :: rate = 0.0_wp                   !! of a line that has lain down: of its least pressure, per unit of load factor;
      !! 0: the path goes on as it came
   end type next_t

   integer, parameter :: max_tries = 40
   real(wp), parameter :: far = 2.0_wp            !! increments, over which a straight line tells what comes
   real(wp), parameter :: far_when_stuck = 20.0_wp !! and where no shorter one converges

contains

   !> The increment from where the run stands to a trial, with the tests at its ends.
   function new_leg(problem, run, trial, ahead, stuck) result(leg)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run              !! its system is factored at the trial
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead        !! tangent there
      logical, intent(in) :: stuck                !! the trial is the run's state
      type(leg_t) :: leg
      leg%to = trial
      leg%ahead = ahead
      leg%stuck = stuck
      leg%from = run%state
      if (stuck) leg%from = run%trail(1)%from
      leg%scale = max(run%system%force_scale, tiny(leg%scale))
      leg%after = run_span_tests(problem, leg%to, leg%scale)
      leg%before = run_span_tests(problem, leg%from, leg%scale)
   end function new_leg

   !> The first change on an increment, or just beyond its end. Where a span lies down on the way `next` has the line.
   subroutine find_change(problem, step, run, leg, change, next, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run           !! its system is factored at the place where one is located
      type(leg_t), intent(inout) :: leg           !! shorter on return where one is found that others come after
      type(change_t), intent(out) :: change
      type(next_t), intent(out) :: next
      type(timers_t), intent(inout) :: timers
      logical :: fails, flat
      fails = any_fails(leg%after)
      flat = any_flat(problem, leg, fails)
      if (fails) flat = flat .or. any(leg%after%kind == test_closing .and. leg%after%value < 0.0_wp)
      change%tests = leg%after
      if (flat) then
         call find_line(problem, run, leg, fails, change, next, timers)
         if (change%found) return
      end if
      if (.not. turns(run, leg)) call find_one_of_two(problem, run, leg, change, next, timers)
      if (change%found) return
      if (fails) then
         call find_first(problem, step, run, leg, change, timers)
      else if (.not. (flat .or. turns(run, leg))) then
         call look_ahead(problem, run, leg, change, timers)
      end if
      if (change%found .and. change%which > 0) call take_one_of_two(problem, run, leg, change, next, timers)
   end subroutine find_change

   !> True for an increment on which the load turns back: places found at once, not on the way, would hide where.
   pure logical function turns(run, leg)
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      turns = run%heading%load * leg%ahead%load < 0.0_wp
   end function turns

   !> True where the gap of some free span is gone, though no test may tell: what is left of the span, too short for its ends to
   !> be told apart, may stay as it is until something else happens.
   logical function any_flat(problem, leg, fails)
      type(problem_t), intent(in) :: problem
      type(leg_t), intent(in) :: leg
      logical, intent(in) :: fails                !! some test does at the end
      real(wp) :: from, to
      integer :: c, side
      any_flat = .false.
      do c = 1, problem%candidates%n
         do side = 1, 2
            if (.not. beside_free_span(problem, c, side)) cycle
            from = span_gap(problem, leg%from, c, side)
            to = span_gap(problem, leg%to, c, side)
            any_flat = any_flat .or. ((from > rounding_gap(problem) .or. fails) .and. to <= rounding_gap(problem))
         end do
      end do
   end function any_flat

   !> A free span whose gap is gone at the end of the increment has lain down on the way. Where exactly the increments of the old
   !> set cannot tell, for the place of its point is neutral; the line does.
   subroutine find_line(problem, run, leg, fails, change, next, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      logical, intent(in) :: fails                !! tests fail on the same increment: which comes first?
      type(change_t), intent(inout) :: change
      type(next_t), intent(inout) :: next
      type(timers_t), intent(inout) :: timers
      logical :: lies
      call lie_down(problem, run%state, leg%to, held_load(run), next%problem, next%state, next%system, next%rate, lies, timers)
      if (lies .and. fails) lies = (next%state%load_factor - run%state%load_factor) * &
         & (next%state%load_factor - leg%to%load_factor) <= 0.0_wp
      if (.not. lies) return
      change%found = .true.
      call stand_before(run, change)
   end subroutine find_line

   !> Two contact points that are about to become one.
   subroutine find_one_of_two(problem, run, leg, change, next, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      type(next_t), intent(inout) :: next
      type(timers_t), intent(inout) :: timers
      integer :: k
      do k = 1, size(leg%after)
         if (leg%after(k)%kind /= test_curvature .or. leg%after(k)%value >= leg%before(k)%value) cycle
         if (.not. problem%candidates%moves(leg%after(k)%candidate)) cycle
         call find_merging(problem, run, leg%to, leg%after(k)%candidate, reach_of(problem, leg), next%problem, next%state, &
            & next%system, change%found, timers)
         if (change%found) change%found = leads_to_next(problem, run, next)
         if (change%found) call stand_before(run, change)
         if (change%found) return
      end do
   end subroutine find_one_of_two

   !> What looks like the place where one of two points is flat is that where they are one.
   subroutine take_one_of_two(problem, run, leg, change, next, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      type(next_t), intent(inout) :: next
      type(timers_t), intent(inout) :: timers
      associate (test => change%tests(change%which))
         if (test%kind /= test_curvature) return
         if (.not. problem%candidates%moves(test%candidate)) return
         if (closing_point(problem, change%place, test%candidate) == 0) return
         call find_merging(problem, run, change%place, test%candidate, reach_of(problem, leg), next%problem, next%state, &
            & next%system, change%found, timers)
      end associate
      if (change%found) change%found = leads_to_next(problem, run, next)
      change%missed = .not. (change%found .or. change%looked_ahead)
      if (change%found) call stand_before(run, change)
   end subroutine take_one_of_two

   !> How far beyond the end of an increment it may be.
   real(wp) function reach_of(problem, leg) result(reach)
      type(problem_t), intent(in) :: problem
      type(leg_t), intent(in) :: leg
      reach = merge(far_when_stuck, far, leg%stuck) * path_length(problem, leg%from, leg%to)
   end function reach_of

   !> A change whose equilibrium is known, from where the run stands.
   subroutine stand_before(run, change)
      type(run_t), intent(in) :: run
      type(change_t), intent(inout) :: change
      change%which = 0
      change%lies = .true.
      change%standing = .true.
      change%looked_ahead = .false.
      change%place = run%state
      change%heading = run%heading
   end subroutine stand_before

   !> A point contact that is about to become as curved as its obstacle: no increment may get there.
   subroutine look_ahead(problem, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      type(timers_t), intent(inout) :: timers
      real(wp) :: reach
      integer :: k
      logical :: found
      reach = merge(far_when_stuck, far, leg%stuck)
      found = .false.
      do k = 1, size(leg%after)
         if (leg%after(k)%kind /= test_curvature) cycle
         if (.not. problem%candidates%moves(leg%after(k)%candidate)) cycle
         if (leg%after(k)%value <= 0.0_wp .or. leg%after(k)%value > reach * (leg%before(k)%value - leg%after(k)%value)) cycle
         change%place = leg%to
         call find_flat_point(problem, run, leg%after(k)%candidate, change%place, found, timers)
         if (found) found = leads_to(problem, leg%to, leg%ahead, .false., change%place)
         if (found) exit
      end do
      if (.not. found) return
      change%tests = run_span_tests(problem, change%place, leg%scale)
      if (another_fails(change%tests, k)) return
      change%found = .true.
      change%which = k
      change%looked_ahead = .true.
      call linearise(problem, change%place, run%state, run%system, timers)
      change%heading = arrival(problem, run, change%place)
   end subroutine look_ahead

   !> The first change along the path: where another test fails at the place of one, that comes before, on the way there.
   subroutine find_first(problem, step, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(inout) :: leg           !! at its end some test fails
      type(change_t), intent(inout) :: change
      type(timers_t), intent(inout) :: timers
      integer :: round
      do round = 1, size(leg%after)
         call tell_places_apart(problem, leg)
         change%which = steepest(leg, leg%after)
         call locate(problem, step, run, leg, change, timers)
         if (.not. change%found .or. change%standing) return
         if (.not. another_fails(change%tests, change%which)) return
         leg%to = change%place
         leg%ahead = change%heading
         leg%after = change%tests
         ! This one is zero there.
         leg%after(change%which)%value = 0.0_wp
      end do
      change%missed = .true.
      change%found = .false.
   end subroutine find_first

   !> A span that is inside at the end may have been nearest somewhere else at the beginning, as where it has just left: where it
   !> leaves the obstacle nothing begins, and what counts is the gap at the place where it comes down.
   subroutine tell_places_apart(problem, leg)
      type(problem_t), intent(in) :: problem
      type(leg_t), intent(inout) :: leg
      integer :: k
      do k = 1, size(leg%after)
         associate (before => leg%before(k), after => leg%after(k))
            if (after%kind /= test_gap .or. after%value >= -test_slack(test_gap)) cycle
            if (gap_at(problem, leg%to, before%contact, before%stretch, before%at) <= 0.0_wp) cycle
            before%value = max(before%value, &
               & gap_at(problem, leg%from, after%contact, after%stretch, after%at) / problem%size)
         end associate
      end do
   end subroutine tell_places_apart

   !> Of the tests that fail at a place the one that a straight line between the ends has at zero first. 0: none fails.
   pure integer function steepest(leg, tests) result(first)
      type(leg_t), intent(in) :: leg
      type(span_test_t), intent(in) :: tests(:)   !! at that place
      real(wp) :: at, least
      integer :: k
      first = 0
      least = 1.0_wp
      do k = 1, size(tests)
         if (tests(k)%value >= -test_slack(tests(k)%kind)) cycle
         associate (before => max(leg%before(k)%value, 0.0_wp), fall => leg%before(k)%value - leg%after(k)%value)
            at = before / max(fall, tiny(fall))
         end associate
         if (first > 0 .and. at >= least) cycle
         first = k
         least = at
      end do
   end function steepest

   !> The zero of the test change%which between both ends.
   subroutine locate(problem, step, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change     !! found, or missed
      type(timers_t), intent(inout) :: timers
      real(wp) :: tolerance
      associate (before => leg%before(change%which), after => leg%after(change%which))
         change%found = .true.
         change%place = run%state
         change%heading = run%heading
         change%tests = leg%before
         tolerance = 0.5_wp * step%locate_tolerance * max(before%value, -after%value)
         change%standing = before%value <= tolerance
         if (change%standing) return
         if (after%kind == test_curvature) then
            if (problem%candidates%moves(after%candidate) .and. .not. turns(run, leg)) then
               call locate_flat_point(problem, run, leg, change, timers)
               if (change%found) return
            end if
         end if
         call locate_by_parts(problem, step, run, leg, tolerance, change, timers)
         change%missed = .not. change%found
      end associate
   end subroutine locate

   !> Where a point is as curved as its obstacle, by Newton's method.
   subroutine locate_flat_point(problem, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change     !! as it was where it is not found
      type(timers_t), intent(inout) :: timers
      type(state_t) :: place
      place = run%state
      if (leg%before(change%which)%value > -leg%after(change%which)%value) place = leg%to
      call find_flat_point(problem, run, leg%after(change%which)%candidate, place, change%found, timers)
      if (change%found) change%found = path_length(problem, run%state, place) <= path_length(problem, run%state, leg%to)
      if (change%found) change%found = leads_to(problem, run%state, run%heading, run%fresh, place)
      if (.not. change%found) return
      change%place = place
      change%report = increment_t(converged=.true.)
      call linearise(problem, place, run%state, run%system, timers)
      change%heading = arrival(problem, run, place)
      change%tests = run_span_tests(problem, place, leg%scale)
   end subroutine locate_flat_point

   !> Where a test is zero, by points of the increment.
   subroutine locate_by_parts(problem, step, run, leg, tolerance, change, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(leg_t), intent(in) :: leg
      real(wp), intent(in) :: tolerance           !! of the test's value
      type(change_t), intent(inout) :: change
      type(timers_t), intent(inout) :: timers
      type(division_t) :: division
      type(bracket_t) :: bracket
      real(wp) :: f, fraction
      integer :: try
      logical :: low_moved
      division = new_division(problem, run, leg%to, leg%ahead, .false.)
      ! Found on the side that it is reached from: beyond it the set does not hold.
      bracket = new_bracket(leg%before(change%which)%value - tolerance, leg%after(change%which)%value - tolerance)
      change%found = .false.
      do try = 1, max_tries
         fraction = bracket_guess(bracket)
         call point_within(problem, run, leg%to, leg%ahead, division, fraction, .false., .true., change%place, change%report, &
            & timers)
         if (.not. change%report%converged) return
         change%heading = arrival(problem, run, change%place)
         change%tests = run_span_tests(problem, change%place, leg%scale)
         f = change%tests(change%which)%value - tolerance
         change%found = abs(f) <= tolerance .or. bracket%high - bracket%low <= epsilon(f)
         if (change%found) return
         call bracket_update(bracket, fraction, f, low_moved)
      end do
      change%found = abs(bracket%f_high - bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
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
end module span_events
