!> Locates the zero of a function that is smooth along the path: bifurcation (an eigenvalue of the tangent stiffness), limit point
!> (load rate), turning point (rate of a monitor).
!>
!> Near a bifurcation the last Newton correction is meaningless: the rounding of the residual divided by a vanishing eigenvalue is
!> an arbitrary multiple of the null vector and may lead to the path that crosses there. On that path, too, the eigenvalue may
!> vanish or the load be stationary at the same point. The zero is therefore interpolated between points on both sides, far enough
!> from it for Newton's method and near enough for a cubic. At a distance h (fraction of the increment) the errors are epsilon/h and
!> h^4, which suggests h = epsilon^(1/5). If several eigenvalues vanish together, their order by value changes at the zero; their
!> order by magnitude is the same on both sides.
!>
!> The present path may be the branch of a symmetric pitchfork that comes to its bifurcation, where the load of the branch has an
!> extremum. On the branch the vanishing eigenvalue touches zero there without changing its sign, so that points near the
!> bifurcation are inaccurate. The bifurcation is then located on the symmetric path that crosses the branch
!> (locate_on_crossing_path). On the symmetric path the eigenvalue passes through zero, and the displacements have no component
!> along the null vector.
!>
!> If the corrector fails for every point inside the increment, the event is placed at an end of the increment.
module smooth_zero
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_control, only: control_t, path_length, metric
   use corrector, only: correct, increment_t
   use path_continuity, only: path_tangent_t, normal_plane, between
   use increment_points, only: increment_measure_t
   use path_events, only: event_bifurcation, event_limit
   use zero_search, only: zero_search_t, find_zero, tangent_turn_per_force, zero_eigenvalue, state_between, zero_of_cubic, &
      & n_samples
   use path_point, only: path_point_t, point_at, evaluate_tests
   use path_state, only: path_state_t, located_event_t, note_balance
   use bracketing, only: new_bracket
   use errors, only: error_t
   use tangent_modes, only: modes_t, lowest_modes
   use null_directions, only: response_without, tangent_without
   use bordered_system, only: apply_increment
   implicit none
   private
   public :: locate_smooth, take_beginning

   integer, parameter :: most = 6                !! largest number of interpolations
   real(wp), parameter :: spacing = epsilon(1.0_wp)**0.2_wp !! spacing of the samples over the whole displacement

contains

   !> Finds the zero of the event function between the last accepted point and the trial.
   subroutine locate_smooth(problem, step, run, trial, measure, located_event)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(increment_measure_t), intent(inout) :: measure
      type(located_event_t), intent(inout) :: located_event !! out: located, point, fraction, and the scale of the event are set
      type(zero_search_t) :: search
      logical :: decided, found
      located_event%located = .false.
      search%bracket = new_bracket(located_event%event%before, located_event%event%after)
      if (located_event%event%kind == event_bifurcation) then
         call bracket_eigenvalue(decided)
         if (decided) return
      end if
      located_event%event%scale = search%bracket%scale
      ! A contact change at nodes may make the function jump, so that no zero can be interpolated. A foundation that acts along
      ! elements changes its contact gradually; its function does not jump.
      if (.not. measure%smooth .and. any(run%last%state%active .neqv. trial%state%active)) return
      if (located_event%event%meets) then
         associate (event => located_event%event, point => located_event%point)
            located_event%fraction = event%before / (event%before - event%after)
            point%tangent = path_tangent_t(run%last%tangent%u, 0.0_wp)
            point%state = between(problem, run%last%state, trial%state, run%last%tangent, trial%tangent, located_event%fraction)
            call locate_on_crossing_path(problem, sign(1.0_wp, event%before), point%state, found)
         end associate
      else
         call find_zero(problem, step, run, trial, measure, search, located_event, found)
      end if
      if (found) call bring_to_balance(found)
      if (found) then
         located_event%event%pivots = located_event%point%system%negative_pivots
         ! The event counts as located if the residual of the interpolated state is within tolerance, and the function there is zero
         ! relative to its change over the increment. At the zero of an eigenvalue the test functions of a bifurcation are
         ! undefined; a bifurcation is therefore evaluated at the samples.
         located_event%located = .true.
         if (located_event%event%kind == event_bifurcation) call confirm_bifurcation()
      else if (run%since_change%shrunk) then
         call take_beginning(step, run, located_event)
      else if (located_event%event%kind == event_limit .and. .not. located_event%event%meets) then
         call take_nearer_end(problem, step, run, trial, located_event)
      end if

   contains

      !> Computes the event's eigenvalue at both ends of the increment. If the eigenvalue vanishes at the last point, the event is
      !> placed there.
      subroutine bracket_eigenvalue(decided)
         logical, intent(out) :: decided !! true: the event was located, or rejected, at an end of the increment: no zero is
         !! searched for inside
         real(wp) :: f
         f = zero_eigenvalue(problem, located_event%event, trial)
         associate (bracket => search%bracket)
            bracket = new_bracket(zero_eigenvalue(problem, located_event%event, run%last), f)
            located_event%event%scale = bracket%scale
            located_event%later = bracket%f_low * f > 0.0_wp .and. located_event%event%before * f > 0.0_wp
            decided = located_event%later .or. bracket%f_low * located_event%event%before <= 0.0_wp
            if (located_event%later .or. .not. decided) return
            ! The eigenvalue vanishes so close to the last accepted point that the signs of this point's pivots are rounding.
            call take_beginning(step, run, located_event)
            located_event%located = located_event%located .or. abs(bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
         end associate
      end subroutine bracket_eigenvalue

      !> Completes the point at the interpolated state, and corrects the point if its residual is above tolerance. The residual can
      !> be so large if touchdown points move far between the samples. Bifurcations are not corrected, see the header of this
      !> module.
      subroutine bring_to_balance(balanced)
         logical, intent(out) :: balanced
         type(path_tangent_t) :: tangent
         type(control_t) :: plane
         type(state_t) :: base
         tangent = located_event%point%tangent
         associate (point => located_event%point)
            point = point_at(problem, point%state)
            point%tangent = tangent
            balanced = point%system%ok
            if (.not. balanced) return
            call note_balance(step, point%system, located_event%report, balanced)
            if (.not. (balanced .or. located_event%event%kind == event_bifurcation .or. located_event%event%meets)) then
               base = point%state
               plane = normal_plane(problem, base, tangent)
               plane%increment = 0.0_wp
               call correct(problem, base, plane, .true., point%state, point%system, located_event%report)
               if (located_event%report%converged) call note_balance(step, point%system, located_event%report, balanced)
            end if
            call evaluate_tests(problem, point)
         end associate
      end subroutine bring_to_balance

      !> Checks that an eigenvalue is zero at the interpolated state. The smallest eigenvalue is checked, because the order of
      !> vanishing eigenvalues is rounding. The turn of the path tangent per unit force on the null vector is computed, too; it
      !> distinguishes a bifurcation from two paths close to each other.
      subroutine confirm_bifurcation()
         real(wp) :: f
         f = zero_eigenvalue(problem, located_event%event, located_event%point, search%modes)
         located_event%located = minval(abs(search%modes%mu)) <= sqrt(step%locate_tolerance) * search%bracket%scale
         located_event%tangent_turn = tangent_turn_per_force(search, path_length(problem, run%last%state, trial%state))
      end subroutine confirm_bifurcation
   end subroutine locate_smooth

   !> Finds the bifurcation to which the branch of a symmetric pitchfork comes (module header): the zero of the eigenvalue along the
   !> symmetric path. The eigenvalue is extrapolated from samples on the side of the bifurcation on which there is no branch.
   subroutine locate_on_crossing_path(problem, side, state, found)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: side               !! 1 (or -1): the samples have larger (or smaller) loads than the branch
      type(state_t), intent(inout) :: state !! in: state between two points of the branch, with hardly any component along the null
      !! vector; out: state at the bifurcation, unchanged if it is not found
      logical, intent(out) :: found
      type(path_point_t) :: here, there
      type(state_t) :: sample(n_samples)
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(path_tangent_t) :: heading, along
      type(control_t) :: plane
      type(increment_t) :: report
      real(wp) :: at(n_samples), mu(n_samples), length, x
      integer :: try, k
      here = point_at(problem, state)
      do try = 1, most
         found = here%system%ok
         if (found) call lowest_modes(problem, here%state, here%system, 1, modes, error)
         if (found) found = modes%n > 0
         if (.not. found) return
         heading = tangent_without(problem, here%system, modes%x(:, :1))
         plane = normal_plane(problem, here%state, heading)
         length = sqrt(metric(problem, here%state%u, here%state%u))
         at = spacing * [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
         if (side < 0.0_wp) at = -at(n_samples:1:-1)
         there = here
         do k = 1, n_samples
            plane%increment = at(k) * length
            ! Newton's method converges on the symmetric path only at some distance from the bifurcation.
            if (k == 1) call apply_increment(problem, here%system, plane%increment * heading%load * response_without(problem, &
               & here%system, modes%x(:, :1)), plane%increment * heading%load, there%state)
            call correct(problem, here%state, plane, .true., there%state, there%system, report)
            found = report%converged
            if (found) call lowest_modes(problem, there%state, there%system, 1, modes, error)
            if (found) found = modes%n > 0
            if (.not. found) return
            sample(k) = there%state
            mu(k) = modes%mu(1)
         end do
         x = zero_of_cubic(at, mu)
         call state_between(problem, sample, at, x, here%state, along)
         found = abs(x) <= 2.0_wp * spacing
         if (found) exit
         here = point_at(problem, here%state)
      end do
      if (found) state = here%state
   end subroutine locate_on_crossing_path

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
end module smooth_zero
