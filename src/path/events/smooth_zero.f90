!> Locates the zero of a function that is smooth along the path: bifurcation (an eigenvalue of the tangent stiffness), limit point
!> (load rate), turning point (rate of a monitor).
!>
!> Near a bifurcation the last Newton correction is meaningless: the rounding of the residual divided by a vanishing eigenvalue is
!> an arbitrary multiple of the null vector and may lead to the path that crosses there. On that path, too, the eigenvalue may
!> vanish or the load be stationary at the same point. The zero is therefore interpolated between points on both sides, far enough
!> from it for Newton's method and near enough for a cubic. At a distance h (fraction of the increment) the errors are epsilon/h and
!> h^4, which suggests h = epsilon^(1/5). If several eigenvalues vanish together, their order by value changes at the zero; their
!> order by magnitude is the same on both sides.
module smooth_zero
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_control, only: control_t, path_length
   use corrector, only: correct
   use path_continuity, only: path_tangent_t, normal_plane, between
   use increment_points, only: division_t
   use path_events, only: event_bifurcation, event_limit
   use event_eigenvalue, only: zero_eigenvalue
   use zero_search, only: zero_search_t, find_zero, tangent_turn_per_force
   use crossing_path, only: locate_on_crossing_path
   use zero_at_end, only: take_beginning, take_nearer_end
   use located_events, only: located_event_t, note_balance
   use path_point, only: path_point_t, point_at, evaluate_tests
   use path_state, only: path_state_t
   use bracketing, only: new_bracket
   implicit none
   private
   public :: locate_smooth

contains

   !> Finds the zero of the event function between the last accepted point and the trial.
   subroutine locate_smooth(problem, step, run, trial, division, located_event)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(division_t), intent(inout) :: division
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
      if (.not. division%smooth .and. any(run%last%state%active .neqv. trial%state%active)) return
      if (located_event%event%meets) then
         associate (event => located_event%event, point => located_event%point)
            located_event%fraction = event%before / (event%before - event%after)
            point%tangent = path_tangent_t(run%last%tangent%u, 0.0_wp)
            point%state = between(problem, run%last%state, trial%state, run%last%tangent, trial%tangent, located_event%fraction)
            call locate_on_crossing_path(problem, sign(1.0_wp, event%before), point%state, found)
         end associate
      else
         call find_zero(problem, step, run, trial, division, search, located_event, found)
      end if
      if (found) call bring_to_balance(found)
      if (found) then
         located_event%event%pivots = located_event%point%system%negative_pivots
         ! The event counts as located if the residual of the interpolated state is within tolerance, and the function there is zero
         ! relative to its change over the increment. At the zero of an eigenvalue the test functions of a bifurcation are
         ! undefined; they are therefore evaluated at the samples.
         located_event%located = .true.
         if (located_event%event%kind == event_bifurcation) call confirm_bifurcation()
      else if (run%since_change%shrunk) then
         call take_beginning(step, run, located_event)
      else if (located_event%event%kind == event_limit .and. .not. located_event%event%meets) then
         call take_nearer_end(problem, step, run, trial, located_event)
      end if

   contains

      !> Computes the event's eigenvalue at both ends of the increment, and places the event at the last point if it vanishes there.
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

      !> Completes the point at the interpolated state, and corrects it if its residual is above tolerance. This happens if
      !> touchdown points move far between the samples. Bifurcations are not corrected (reason: see the header of this module).
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

      !> Checks that an eigenvalue is zero at the interpolated state. Also computes the turn of the path tangent per unit force on
      !> the null vector, which distinguishes a bifurcation from two paths close to each other. The order of vanishing eigenvalues
      !> is rounding, so that the smallest eigenvalue is checked.
      subroutine confirm_bifurcation()
         real(wp) :: f
         f = zero_eigenvalue(problem, located_event%event, located_event%point, search%modes)
         located_event%located = minval(abs(search%modes%mu)) <= sqrt(step%locate_tolerance) * search%bracket%scale
         located_event%tangent_turn = tangent_turn_per_force(search, path_length(problem, run%last%state, trial%state))
      end subroutine confirm_bifurcation
   end subroutine locate_smooth
end module smooth_zero
