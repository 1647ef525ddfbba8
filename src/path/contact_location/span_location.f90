!> Locates the zero of a test of contact spans: at the run's point, on the increment, or beyond its end.
module span_location
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use test_kinds, only: span_test_t, test_curvature, test_force
   use lifted_node, only: inside_line
   use breakpoint_forces, only: breakpoint_force, left_over
   use span_tests, only: run_span_tests
   use contact_change_types, only: step_interval_t, change_t, change_located, change_missed, place_within, place_here, &
      & place_ahead
   use osculating_contacts, only: find_osculating_contact
   use tangent_step, only: states_along
   use step_control, only: largest_growth
   use reachability, only: turns, leads_to, arrival
   use path_control, only: path_length
   use path_point, only: path_point_t, point_at
   use path_state, only: path_state_t
   use increment_points, only: increment_measure_t, new_measure, point_within
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use corrector, only: increment_t
   implicit none
   private
   public :: locate_test_zero, locate_osculation

contains

   !> Locates the zero of the test `change%which` on the interval, whose ends enclose it. The tolerance (LOCATE of *CONTROLS) limits
   !> the test's value at the located place, as a share of the larger of its values at the ends; it does not limit the error of the
   !> load.
   subroutine locate_test_zero(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(inout) :: change     !! kind on return: change_located if located, change_missed if not
      real(wp) :: tolerance
      logical :: found
      associate (before => interval%before(change%which), after => interval%after(change%which))
         change%kind = change_located
         change%where = place_within
         tolerance = 0.5_wp * step%locate_tolerance * max(before%value, -after%value)
         if (before%value <= tolerance) then
            ! The test of a contact that just began is about zero at the run's point, but increases. Its zero lies further on the
            ! increment and is not located on this one.
            if (before%value >= -tolerance .and. grows(problem, run, interval, change%which, tolerance)) then
               change%kind = change_missed
               return
            end if
            change%where = place_here
            change%point = run%last
            change%tests = interval%before
            call find_earlier_zero(problem, run, interval, before, change%since)
            return
         end if
         found = .false.
         if (after%kind == test_curvature) then
            if (problem%candidates%rolls(after%candidate) .and. .not. turns(run, interval)) &
               & call locate_osculation(problem, run, interval, change, found)
         end if
         if (.not. found) call locate_by_parts(problem, step, run, interval, tolerance, change, found)
         if (.not. found) change%kind = change_missed
      end associate
   end subroutine locate_test_zero

   !> Finds the load at which the force on a node inside a line contact was zero, if this load lies before the run's point. Since
   !> then the force pulls, but it lifts only a negligible length of rod, so that the test at the run's point counts as zero. The
   !> force is taken as linear in the load.
   subroutine find_earlier_zero(problem, run, interval, test, since)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(span_test_t), intent(in) :: test       !! at the run's point
      real(wp), allocatable, intent(out) :: since !! load factor; not allocated: the force is zero at the run's point
      real(wp) :: here, ahead
      if (test%kind /= test_force .or. test%candidate == 0) return
      if (.not. inside_line(problem, test%candidate)) return
      here = breakpoint_force(problem, run%last%state, test%candidate)
      ahead = breakpoint_force(problem, interval%to%state, test%candidate)
      if (here >= -left_over(problem) * interval%scale .or. ahead >= here) return
      since = run%last%state%load_factor - here / (ahead - here) * (interval%to%state%load_factor - run%last%state%load_factor)
   end subroutine find_earlier_zero

   !> True if a test increases by more than the tolerance over the increment, extrapolated with its slope at the run's point.
   logical function grows(problem, run, interval, which, tolerance)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which                !! index into the tests
      real(wp), intent(in) :: tolerance
      type(span_test_t), allocatable :: here(:), ahead(:)
      type(state_t) :: beside(2)
      real(wp) :: step
      grows = .false.
      if (.not. run%last%system%ok) return
      call states_along(problem, run%last%system, run%last%state, run%last%tangent%load, beside(1), beside(2), step)
      here = run_span_tests(problem, beside(1), interval%scale, which)
      ahead = run_span_tests(problem, beside(2), interval%scale, which)
      grows = (ahead(which)%value - here(which)%value) * path_length(problem, run%last%state, interval%to%state) > &
         & tolerance * path_length(problem, beside(1), beside(2))
   end function grows

   !> Locates by Newton's method the place where a point contact osculates, that is, where the curvature of the rod relative to the
   !> obstacle is zero. The place is on the increment, or beyond its end if the relative curvature is not yet zero at the end.
   subroutine locate_osculation(problem, run, interval, change, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(inout) :: change     !! out: the located change; unchanged if nothing is found
      logical, intent(out) :: found
      type(path_point_t) :: point
      type(state_t) :: place
      real(wp) :: residual
      associate (before => interval%before(change%which)%value, after => interval%after(change%which)%value)
         place = run%last%state
         if (before > -after) place = interval%to%state
         associate (candidate => interval%after(change%which)%candidate)
            call find_osculating_contact(problem, candidate, osculating_too(problem, interval, change%which), place, residual, &
               & found)
         end associate
         if (.not. found) return
         if (after > 0.0_wp) then
            ! A place beyond the longest next increment is not taken, because other changes come before it.
            found = path_length(problem, interval%to%state, place) <= largest_growth * path_length(problem, run%last%state, &
               & interval%to%state) .and. leads_to(problem, interval%to%state, interval%to%tangent, .false., place)
         else
            found = path_length(problem, run%last%state, place) <= path_length(problem, run%last%state, interval%to%state) .and. &
               & leads_to(problem, run%last%state, run%last%tangent, run%fresh, place)
         end if
         if (.not. found) return
         point = point_at(problem, place)
         ! The couple of a touchdown point is undetermined where the contact osculates.
         point%system%force_residual = residual
         ! At most one eigenvalue may have changed its sign, because it may be zero at the place; a larger difference means other
         ! events on the way.
         found = after <= 0.0_wp .or. abs(point%system%negative_pivots - interval%pivots) <= 1
         if (.not. found) return
         change%where = merge(place_ahead, place_within, after > 0.0_wp)
      end associate
      point%tangent = arrival(problem, run, point)
      change%kind = change_located
      change%point = point
      change%report = increment_t(converged=.true.)
      change%tests = run_span_tests(problem, place, interval%scale)
   end subroutine locate_osculation

   !> Candidates of the other point contacts whose relative curvature is negative at the end of an increment, except contacts at
   !> segment boundaries.
   pure function osculating_too(problem, interval, which) result(candidate)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which                !! index of the test of the contact that is left out
      integer, allocatable :: candidate(:)
      integer :: k
      candidate = pack(interval%after%candidate, interval%after%kind == test_curvature .and. interval%after%value < 0.0_wp .and. &
         & [(k, k=1, size(interval%after))] /= which)
      candidate = pack(candidate, problem%candidates%moves(candidate) .and. problem%candidates%rolls(candidate))
   end function osculating_too

   !> Locates the zero of a test by bracketing, at points of the increment.
   subroutine locate_by_parts(problem, step, run, interval, tolerance, change, found)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      real(wp), intent(in) :: tolerance           !! largest size of the test's value that counts as zero
      type(change_t), intent(inout) :: change
      logical, intent(out) :: found
      type(increment_measure_t) :: measure
      type(bracket_t) :: bracket
      real(wp) :: f, fraction
      found = .false.
      measure = new_measure(problem, run, interval%to, .false.)
      ! If remeshing has moved a change to a position before the last point, the ends of the interval coincide and it has no points
      ! inside.
      if (.not. (measure%length > 0.0_wp .or. abs(interval%to%state%load_factor - run%last%state%load_factor) > 0.0_wp)) return
      ! The place is located just before the zero, because the contact set is not valid beyond the zero.
      bracket = new_bracket(interval%before(change%which)%value - tolerance, interval%after(change%which)%value - tolerance)
      do while (next_guess(bracket, epsilon(f), fraction))
         call point_within(problem, run, interval%to, measure, fraction, .false., .true., change%point, change%report)
         if (.not. change%report%converged) return
         change%point%tangent = arrival(problem, run, change%point)
         change%tests = run_span_tests(problem, change%point%state, interval%scale)
         f = change%tests(change%which)%value - tolerance
         found = abs(f) <= tolerance
         if (found) return
         call take_value(bracket, fraction, f)
      end do
      ! The bracket has closed. If the values at its ends still differ, the test jumps there and has no zero.
      found = abs(bracket%f_high - bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
   end subroutine locate_by_parts
end module span_location
