!> Where on an increment a test of its contact spans is zero: where the run stands, within the increment, or beyond its end.
module span_location
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use test_kinds, only: span_test_t, test_curvature
   use span_tests, only: run_span_tests
   use contact_change_types, only: step_interval_t, change_t, change_by_rule, change_missed, place_within, place_here, &
      & place_ahead
   use flat_points, only: find_flat_point
   use tangent_step, only: states_along
   use flat_point_rule, only: would_press
   use reachability, only: turns, leads_to, arrival
   use path_control, only: path_length
   use path_state, only: path_state_t
   use increment_points, only: division_t, new_division, point_within
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use corrector, only: increment_t
   implicit none
   private
   public :: locate, locate_flat_point

contains

   !> The zero of the test change%which between both ends.
   subroutine locate(problem, step, run, leg, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run           !! its system ends up factored at the place
      type(step_interval_t), intent(in) :: leg
      type(change_t), intent(inout) :: change     !! by a rule, or missed
      real(wp) :: tolerance
      logical :: found
      associate (before => leg%before(change%which), after => leg%after(change%which))
         change%kind = change_by_rule
         change%where = place_within
         tolerance = 0.5_wp * step%locate_tolerance * max(before%value, -after%value)
         if (before%value <= tolerance) then
            ! What has just begun, and grows, has its zero further on: nearer than the end is its sign.
            if (before%value >= -tolerance .and. grows(problem, run, leg, change%which, tolerance)) then
               change%kind = change_missed
               return
            end if
            change%where = place_here
            change%place = run%state
            change%heading = run%heading
            change%tests = leg%before
            return
         end if
         found = .false.
         if (after%kind == test_curvature) then
            if (problem%candidates%rolls(after%candidate) .and. .not. turns(run, leg)) &
               & call locate_flat_point(problem, run, leg, change, found)
         end if
         if (.not. found) call locate_by_parts(problem, step, run, leg, tolerance, change, found)
         if (.not. found) change%kind = change_missed
      end associate
   end subroutine locate

   !> True for a test that its slope where the run stands takes up on an increment, by more than a tolerance.
   logical function grows(problem, run, leg, which, tolerance)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run           !! its system ends up factored where it stands
      type(step_interval_t), intent(in) :: leg
      integer, intent(in) :: which                !! index into the tests
      real(wp), intent(in) :: tolerance
      type(span_test_t), allocatable :: here(:), ahead(:)
      type(state_t) :: beside(2)
      real(wp) :: step
      grows = .false.
      call linearise(problem, run%state, run%state, run%system)
      if (.not. run%system%ok) return
      call states_along(problem, run%system, run%state, run%heading%load, beside(1), beside(2), step)
      here = run_span_tests(problem, beside(1), leg%scale, which)
      ahead = run_span_tests(problem, beside(2), leg%scale, which)
      grows = (ahead(which)%value - here(which)%value) * path_length(problem, run%state, leg%to) > &
         & tolerance * path_length(problem, beside(1), beside(2))
   end function grows

   !> Where a point is as curved as its obstacle, by Newton's method: on the increment, or beyond its end where it is not yet there.
   subroutine locate_flat_point(problem, run, leg, change, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: leg
      type(change_t), intent(inout) :: change     !! as it was but for its test where it is not found
      logical, intent(out) :: found
      type(state_t) :: place
      associate (before => leg%before(change%which)%value, after => leg%after(change%which)%value)
         place = run%state
         if (before > -after) place = leg%to
         associate (candidate => leg%after(change%which)%candidate)
            call find_flat_point(problem, run, candidate, flat_too(problem, leg, change%which), place, found)
            ! At a breakpoint that is to the first order of how far it has rolled: nothing is told where a line begins.
            if (found .and. .not. problem%candidates%moves(candidate)) found = would_press(problem, place, candidate, &
               & 0.0_wp)
         end associate
         if (.not. found) return
         if (after > 0.0_wp) then
            found = leads_to(problem, leg%to, leg%ahead, .false., place)
         else
            found = path_length(problem, run%state, place) <= path_length(problem, run%state, leg%to) .and. &
               & leads_to(problem, run%state, run%heading, run%fresh, place)
         end if
         if (.not. found) return
         call linearise(problem, place, run%state, run%system)
         ! Of the eigenvalues one may be zero there; where more have changed their sign other events lie on the way.
         found = after <= 0.0_wp .or. abs(run%system%negative_pivots - leg%pivots) <= 1
         if (.not. found) return
         change%where = merge(place_ahead, place_within, after > 0.0_wp)
      end associate
      change%kind = change_by_rule
      change%place = place
      change%report = increment_t(converged=.true.)
      change%heading = arrival(problem, run, place)
      change%tests = run_span_tests(problem, place, leg%scale)
   end subroutine locate_flat_point

   !> Other points that are less curved than their obstacle at the end of a leg, before breakpoints hold them.
   pure function flat_too(problem, leg, which) result(candidate)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: leg
      integer, intent(in) :: which                !! index of the test of the one that is looked at
      integer, allocatable :: candidate(:)
      integer :: k
      candidate = pack(leg%after%candidate, leg%after%kind == test_curvature .and. leg%after%value < 0.0_wp .and. &
         & [(k, k=1, size(leg%after))] /= which)
      candidate = pack(candidate, problem%candidates%moves(candidate) .and. problem%candidates%rolls(candidate))
   end function flat_too

   !> Where a test is zero, by points of the increment.
   subroutine locate_by_parts(problem, step, run, leg, tolerance, change, found)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: leg
      real(wp), intent(in) :: tolerance           !! of the test's value
      type(change_t), intent(inout) :: change
      logical, intent(out) :: found
      type(division_t) :: division
      type(bracket_t) :: bracket
      real(wp) :: f, fraction
      division = new_division(problem, run, leg%to, leg%ahead, .false.)
      ! Found on the side that it is reached from: beyond it the set does not hold.
      bracket = new_bracket(leg%before(change%which)%value - tolerance, leg%after(change%which)%value - tolerance)
      found = .false.
      do while (next_guess(bracket, epsilon(f), fraction))
         call point_within(problem, run, leg%to, leg%ahead, division, fraction, .false., .true., change%place, change%report)
         if (.not. change%report%converged) return
         change%heading = arrival(problem, run, change%place)
         change%tests = run_span_tests(problem, change%place, leg%scale)
         f = change%tests(change%which)%value - tolerance
         found = abs(f) <= tolerance
         if (found) return
         call take_value(bracket, fraction, f)
      end do
      ! A function that jumps closes its bracket without a zero.
      found = abs(bracket%f_high - bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
   end subroutine locate_by_parts
end module span_location
