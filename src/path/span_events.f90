!> Where along an increment its contact spans first fail: the first zero of a test function.
module span_events
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use free_span_gap, only: gap_at
   use span_tests, only: span_test_t, run_span_tests, any_fails, another_fails, test_slack, test_gap, test_curvature, test_closing
   use span_change, only: leg_t, change_t, change_none, change_missed, change_by_rule, change_lying, change_merging, place_here, &
      & place_ahead
   use span_location, only: locate, turns, arrival, leads_to, leads_to_next
   use span_lie_down, only: lie_down, beside_free_span, free_span, span_gap
   use held_openings, only: find_flat_point, held_load
   use span_merging, only: find_merging, closing_point
   use path_control, only: path_length
   use path_run, only: run_t
   use timing, only: timers_t
   implicit none
   private
   public :: find_change

   real(wp), parameter :: far = 2.0_wp            !! increments, over which a straight line tells what comes
   real(wp), parameter :: far_when_stuck = 20.0_wp !! and where no shorter one converges

contains

   !> The first change on an increment, or just beyond its end. What the path does there without any test that tells comes first:
   !> such tests as fail at the end do so because of it.
   subroutine find_change(problem, step, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run           !! its system is factored at the place where one is located
      type(leg_t), intent(inout) :: leg           !! shorter on return where one is found that others come after
      type(change_t), intent(out) :: change
      type(timers_t), intent(inout) :: timers
      logical :: fails, flat
      change%tests = leg%after
      fails = any_fails(leg%after)
      flat = any_flat(problem, leg, fails)
      if (flat) call find_line(problem, run, leg, fails, change, timers)
      if (change%kind == change_none .and. .not. turns(run, leg)) call find_one_of_two(problem, run, leg, change, timers)
      if (change%kind /= change_none) return
      if (fails) then
         call find_first(problem, step, run, leg, change, timers)
      else if (.not. (flat .or. turns(run, leg))) then
         call look_ahead(problem, run, leg, change, timers)
      end if
      if (change%kind == change_by_rule) call take_one_of_two(problem, run, leg, change, timers)
   end subroutine find_change

   !> True where the gap of some free span is gone, or its length, though no test may tell: what is left of the span, too short for
   !> its ends to be told apart, may stay as it is until something else happens.
   logical function any_flat(problem, leg, fails)
      type(problem_t), intent(in) :: problem
      type(leg_t), intent(in) :: leg
      logical, intent(in) :: fails                !! some test does at the end
      real(wp) :: from, to
      integer :: c, side
      any_flat = fails .and. any(leg%after%kind == test_closing .and. leg%after%value < 0.0_wp)
      do c = 1, problem%candidates%n
         do side = 1, 2
            if (.not. beside_free_span(problem, c, side)) cycle
            from = span_gap(problem, leg%from, c, side)
            to = span_gap(problem, leg%to, c, side)
            any_flat = any_flat .or. ((from > rounding_gap(problem) .or. fails .or. closes(c, side)) .and. &
               & to <= rounding_gap(problem))
         end do
      end do

   contains

      !> True for a span between two contacts that becomes shorter: its gap, of the sixth power of its length, is gone long before.
      logical function closes(c, side)
         integer, intent(in) :: c, side
         real(wp) :: from(2), to(2), whole
         call free_span(problem, leg%from, c, side, from)
         call free_span(problem, leg%to, c, side, to)
         whole = problem%layout%stretch(problem%touch(problem%candidates%touch(c))%stretch)%length
         closes = to(2) - to(1) < from(2) - from(1) .and. to(side) > 0.0_wp .and. to(side) < whole
      end function closes
   end function any_flat

   !> A free span whose gap is gone at the end of the increment has lain down on the way. Where exactly the increments of the old
   !> set cannot tell, for the place of its point is neutral; the line does.
   subroutine find_line(problem, run, leg, fails, change, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      logical, intent(in) :: fails                !! tests fail on the same increment: which comes first?
      type(change_t), intent(inout) :: change
      type(timers_t), intent(inout) :: timers
      logical :: lies
      associate (next => change%next)
         call lie_down(problem, run%state, leg%to, held_load(run), next%problem, next%state, next%system, next%rate, lies, timers)
         if (lies .and. fails) lies = (next%state%load_factor - run%state%load_factor) * &
            & (next%state%load_factor - leg%to%load_factor) <= 0.0_wp
      end associate
      if (lies) call stand_before(run, change_lying, change)
   end subroutine find_line

   !> Two contact points that are about to become one.
   subroutine find_one_of_two(problem, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      type(timers_t), intent(inout) :: timers
      integer :: k
      do k = 1, size(leg%after)
         if (leg%after(k)%kind /= test_curvature .or. leg%after(k)%value >= leg%before(k)%value) cycle
         if (.not. problem%candidates%moves(leg%after(k)%candidate)) cycle
         call merge_near(problem, run, leg, leg%to, leg%after(k)%candidate, change, timers)
         if (change%kind /= change_none) return
      end do
   end subroutine find_one_of_two

   !> What looks like the place where one of two points is flat is that where they are one.
   subroutine take_one_of_two(problem, run, leg, change, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      type(timers_t), intent(inout) :: timers
      type(state_t) :: near
      integer :: candidate
      associate (test => change%tests(change%which))
         if (test%kind /= test_curvature) return
         if (.not. problem%candidates%moves(test%candidate)) return
         if (closing_point(problem, change%place, test%candidate) == 0) return
         change%kind = merge(change_none, change_missed, change%where == place_ahead)
         candidate = test%candidate
      end associate
      near = change%place
      call merge_near(problem, run, leg, near, candidate, change, timers)
   end subroutine take_one_of_two

   !> The merging of a point with another one, if it is the next that happens.
   subroutine merge_near(problem, run, leg, near, candidate, change, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      type(state_t), intent(in) :: near           !! a state of the path where they nearly are one
      integer, intent(in) :: candidate
      type(change_t), intent(inout) :: change     !! as it was where it is not found
      type(timers_t), intent(inout) :: timers
      logical :: found
      associate (next => change%next)
         call find_merging(problem, run, near, candidate, reach_of(leg) * path_length(problem, leg%from, leg%to), next%problem, &
            & next%state, next%system, found, timers)
         next%rate = 0.0_wp
         if (found) found = leads_to_next(problem, run, next)
      end associate
      if (found) call stand_before(run, change_merging, change)
   end subroutine merge_near

   !> How far beyond the end of an increment something may be that is looked for from there, in its length.
   pure real(wp) function reach_of(leg) result(reach)
      type(leg_t), intent(in) :: leg
      reach = merge(far_when_stuck, far, leg%stuck)
   end function reach_of

   !> A change whose equilibrium is known, from where the run stands.
   subroutine stand_before(run, kind, change)
      type(run_t), intent(in) :: run
      integer, intent(in) :: kind
      type(change_t), intent(inout) :: change
      change%kind = kind
      change%where = place_here
      change%which = 0
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
      type(state_t) :: place
      integer :: k
      logical :: found
      found = .false.
      do k = 1, size(leg%after)
         associate (before => leg%before(k), after => leg%after(k))
            if (after%kind /= test_curvature) cycle
            if (.not. problem%candidates%moves(after%candidate)) cycle
            if (after%value <= 0.0_wp .or. after%value > reach_of(leg) * (before%value - after%value)) cycle
            place = leg%to
            call find_flat_point(problem, run, after%candidate, place, found, timers)
         end associate
         if (found) found = leads_to(problem, leg%to, leg%ahead, .false., place)
         if (found) exit
      end do
      if (.not. found) return
      change%tests = run_span_tests(problem, place, leg%scale)
      if (another_fails(change%tests, k)) return
      change%kind = change_by_rule
      change%where = place_ahead
      change%which = k
      change%place = place
      call linearise(problem, place, run%state, run%system, timers)
      change%heading = arrival(problem, run, place)
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
         if (change%kind == change_missed .or. change%where == place_here) return
         if (.not. another_fails(change%tests, change%which)) return
         leg%to = change%place
         leg%ahead = change%heading
         leg%after = change%tests
         ! This one is zero there.
         leg%after(change%which)%value = 0.0_wp
      end do
      change%kind = change_missed
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
end module span_events
