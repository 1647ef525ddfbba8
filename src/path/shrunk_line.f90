!> What is left of a line of contact that is taken for none. It had a length still: without it the equilibrium is a little another.
module shrunk_line
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use conforming_span, only: excess_curvature
   use path_control, only: control_t, path_length, metric
   use path_continuity, only: heading_t, normal_plane
   use path_samples, only: state_between, zero_of_cubic, n_samples
   use path_run, only: run_t
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: come_to_rest

   integer, parameter :: max_centres = 6        !! of samples
   !> Times the reach that a flat point may be away: where a line's length is zero its moments tell, where a point is flat its
   !> curvature, and a mesh errs in these on its own.
   real(wp), parameter :: farther = 10.0_wp

contains

   !> The run in equilibrium with what a line has become. A point is as curved as the obstacle where the line that it comes from is
   !> none; of a line it is the equilibrium at the same load. It stays where none is found nearby.
   subroutine come_to_rest(problem, run, candidate, reach, flat, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      integer, intent(in) :: candidate           !! of what the contact has become, 0: it has become nothing of its own
      real(wp), intent(in) :: reach              !! along the path
      logical, intent(out) :: flat               !! a point is: the run's heading is that of the path there
      type(timers_t), intent(inout) :: timers
      type(control_t) :: here
      type(increment_t) :: report
      type(state_t) :: state
      flat = .false.
      if (candidate == 0) return
      if (problem%touch(problem%candidates%touch(candidate))%line .or. .not. problem%candidates%moves(candidate)) then
         state = run%state
         here%method = method_load
         here%whole = run%state%load_factor
         call correct(problem, run%state, here, .true., state, run%system, report, timers)
         if (report%converged) report%converged = path_length(problem, run%state, state) <= reach
         if (report%converged) run%state = state
      else
         call go_to_flat_point(problem, run, candidate, reach, flat, timers)
      end if
      call linearise(problem, run%state, run%state, run%system, timers)
   end subroutine come_to_rest

   !> To where the point is as curved as its obstacle. What holds its rotation there is without bounds, and free spans beside it
   !> may buckle as the line between them vanishes, so that the load hardly tells: the place is interpolated between equilibria in
   !> planes across the path, beyond it and, though the obstacle would have to give way there, before it.
   subroutine go_to_flat_point(problem, run, candidate, reach, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      integer, intent(in) :: candidate
      real(wp), intent(in) :: reach              !! along the path
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(control_t) :: across
      type(increment_t) :: report
      type(state_t) :: sample(n_samples), place
      type(heading_t) :: heading
      real(wp) :: at(n_samples), excess(n_samples), centre, near, whole, stretch
      integer :: try, k
      found = .false.
      across = normal_plane(problem, run%state, run%heading)
      if (.not. allocated(across%tangent)) return
      ! Of the motion along the path as the plane counts it, with the load.
      whole = reach / sqrt(metric(problem, across%tangent, across%tangent))
      centre = 0.5_wp * whole
      near = 0.25_wp * whole
      do try = 1, max_centres
         at = centre + near * [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
         do k = 1, n_samples
            sample(k) = run%state
            across%increment = at(k)
            call correct(problem, run%state, across, .true., sample(k), run%system, report, timers)
            if (.not. report%converged) return
            call excess_curvature(problem, sample(k), candidate, excess(k), stretch)
         end do
         centre = zero_of_cubic(at, excess)
         if (abs(centre) > farther * whole) return
         found = centre >= at(2) .and. centre <= at(3)
         if (found) exit
      end do
      if (.not. found) return
      call state_between(problem, sample, at, centre, place, heading)
      found = path_length(problem, run%state, place) <= farther * reach
      if (.not. found) return
      run%state = place
      run%heading = heading
   end subroutine go_to_flat_point
end module shrunk_line
