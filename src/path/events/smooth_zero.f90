!> Locates what is the zero of a function that is smooth along the path: a bifurcation (an eigenvalue of the tangent), a
!> limit point (the rate of the load), a turning point (that of a monitor).
!>
!> At a bifurcation Newton's method has no use for its last correction: the residual's rounding over a vanishing eigenvalue
!> is any share of the null vector, and with it the iteration leaves for the other path, where the eigenvalue has its zero,
!> too; and a branch may have its limit point there. So the zero is interpolated between points on both sides that are far
!> enough from it for Newton's method and near enough for a cubic: a distance h is off by epsilon/h there and by h^4 here,
!> least at h = epsilon^(1/5). Several eigenvalues that go through zero together change their order there; their sizes keep it.
module smooth_zero
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: control_t, path_length
   use corrector, only: correct
   use path_continuity, only: path_tangent_t, normal_plane
   use increment_points, only: division_t
   use path_events, only: event_bifurcation, event_limit
   use event_eigenvalue, only: zero_eigenvalue
   use zero_search, only: zero_search_t, find_zero, swerve_per_force
   use zero_at_end, only: take_beginning, take_nearer_end
   use located_events, only: located_event_t, note_balance
   use path_state, only: path_state_t
   use bracketing, only: bracket_t, new_bracket
   implicit none
   private
   public :: locate_smooth

contains

   !> Finds the zero of the event's function between the last accepted point and the trial.
   subroutine locate_smooth(problem, step, run, trial, ahead, division, sighting)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      type(located_event_t), intent(inout) :: sighting  !! located, place, heading, fraction, and the scale of its event
      type(zero_search_t) :: search
      logical :: told, found
      sighting%located = .false.
      search%bracket = new_bracket(sighting%event%before, sighting%event%after)
      if (sighting%event%kind == event_bifurcation) then
         call bracket_eigenvalue(problem, step, run, trial, search%bracket, sighting, told)
         if (told) return
      end if
      sighting%event%scale = search%bracket%scale
      ! Where contact at nodes changes the function may jump: no zero can be interpolated there. Foundations that act along the
      ! elements take hold and let go little by little.
      if (.not. division%smooth .and. any(run%state%active .neqv. trial%active)) return
      call find_zero(problem, step, run, trial, ahead, division, search, sighting, found)
      if (found) call bring_to_balance(problem, step, run, sighting, found)
      if (found) then
         sighting%event%pivots = run%system%negative_pivots
         ! In balance as any point is, and zero relative to its change over the increment. Other functions than the eigenvalue
         ! mean nothing there where it is zero, too: of these the samples tell.
         sighting%located = .true.
         if (sighting%event%kind == event_bifurcation) call confirm_bifurcation(problem, step, run, trial, search, sighting)
      else if (run%since_change%shrunk) then
         call take_beginning(problem, step, run, sighting)
      else if (sighting%event%kind == event_limit) then
         call take_nearer_end(problem, step, run, trial, ahead, sighting)
      end if
   end subroutine locate_smooth

   !> The eigenvalue at both ends of the increment.
   subroutine bracket_eigenvalue(problem, step, run, trial, bracket, sighting, told)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(bracket_t), intent(out) :: bracket
      type(located_event_t), intent(inout) :: sighting
      logical, intent(out) :: told               !! nothing is to be looked for within
      real(wp) :: f
      call linearise(problem, trial, trial, run%system)
      f = zero_eigenvalue(problem, run, sighting%event, trial)
      call linearise(problem, run%state, run%state, run%system)
      bracket = new_bracket(zero_eigenvalue(problem, run, sighting%event, run%state), f)
      sighting%event%scale = bracket%scale
      sighting%later = bracket%f_low * f > 0.0_wp .and. sighting%event%before * f > 0.0_wp
      told = sighting%later .or. bracket%f_low * sighting%event%before <= 0.0_wp
      if (sighting%later .or. .not. told) return
      ! It was passed next to the last point, which had the sign of rounding.
      call take_beginning(problem, step, run, sighting)
      sighting%located = sighting%located .or. abs(bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
   end subroutine bracket_eigenvalue

   !> Ends of contact that have gone far between the samples make more of the cubic's error than the iteration leaves. But at
   !> bifurcations, see above.
   subroutine bring_to_balance(problem, step, run, sighting, balanced)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the place on return
      type(located_event_t), intent(inout) :: sighting !! its place
      logical, intent(out) :: balanced
      type(control_t) :: hold
      type(state_t) :: base
      call linearise(problem, sighting%place, sighting%place, run%system)
      balanced = run%system%ok
      if (.not. balanced) return
      call note_balance(step, run%system, sighting%report, balanced)
      if (balanced .or. sighting%event%kind == event_bifurcation) return
      base = sighting%place
      hold = normal_plane(problem, base, sighting%heading)
      hold%increment = 0.0_wp
      call correct(problem, base, hold, .true., sighting%place, run%system, sighting%report)
      if (sighting%report%converged) call note_balance(step, run%system, sighting%report, balanced)
   end subroutine bring_to_balance

   !> Whether the eigenvalue is zero there, and how far two paths would be from it that pass each other. The numbers that tell
   !> eigenvalues apart are rounding there.
   subroutine confirm_bifurcation(problem, step, run, trial, search, sighting)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the place
      type(state_t), intent(in) :: trial
      type(zero_search_t), intent(inout) :: search
      type(located_event_t), intent(inout) :: sighting !! located, swerve
      real(wp) :: f
      f = zero_eigenvalue(problem, run, sighting%event, sighting%place, search%modes)
      sighting%located = minval(abs(search%modes%mu)) <= sqrt(step%locate_tolerance) * search%bracket%scale
      sighting%swerve = swerve_per_force(search, path_length(problem, run%state, trial))
   end subroutine confirm_bifurcation
end module smooth_zero
