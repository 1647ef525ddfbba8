!> Bifurcations at which the present path crosses another path with a load extremum of its own: a symmetric pitchfork, followed
!> along its branch. Along the branch the vanishing eigenvalue touches zero there without changing its sign, so that points near the
!> bifurcation are inaccurate. Along the other (symmetric) path the eigenvalue passes through zero, and all displacements have no
!> component along the null vector.
module crossing_path
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use tangent_modes, only: modes_t, lowest_modes
   use null_directions, only: response_without, tangent_without
   use bordered_system, only: apply_increment
   use path_control, only: control_t, metric
   use path_continuity, only: path_tangent_t, normal_plane
   use path_samples, only: state_between, zero_of_cubic, n_samples
   use corrector, only: increment_t, correct
   use path_point, only: path_point_t, point_at
   implicit none
   private
   public :: locate_on_crossing_path

   integer, parameter :: most = 6                !! largest number of interpolations
   real(wp), parameter :: spacing = epsilon(1.0_wp)**0.2_wp !! spacing of the samples over the whole displacement, see smooth_zero

contains

   !> Finds the bifurcation as the zero of the eigenvalue along the symmetric path, extrapolated from samples on the side of the
   !> bifurcation without a branch.
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
end module crossing_path
