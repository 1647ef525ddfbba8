!> States interpolated by a cubic between points of the path, with their tangents. They replace points at which the last correction
!> of Newton's method is meaningless (bifurcation) or the method fails (point contact at zero relative curvature).
module path_samples
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: displacements_at
   use path_control, only: metric
   use path_continuity, only: path_tangent_t, blended
   implicit none
   private
   public :: state_between, lagrange, zero_of_cubic, n_samples

   integer, parameter :: n_samples = 4           !! number of samples of a cubic

contains

   !> Computes the state and the unit tangent at a position of the cubic through the samples.
   subroutine state_between(problem, sample, at, x, place, heading)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: sample(n_samples)
      real(wp), intent(in) :: at(n_samples)      !! positions of the samples along the path
      real(wp), intent(in) :: x                  !! position of the interpolated state
      type(state_t), intent(out) :: place
      type(path_tangent_t), intent(out) :: heading
      real(wp) :: w(n_samples), d(n_samples), norm
      integer :: i
      call lagrange(at, x, w, d)
      place = blended(problem, sample, w)
      heading%load = dot_product(d, sample%load_factor)
      heading%u = 0.0_wp * place%u
      do i = 1, n_samples
         if (problem%moves_nodes()) then
            heading%u = heading%u + d(i) * displacements_at(problem, sample(i), place%geometry)
         else
            heading%u = heading%u + d(i) * sample(i)%u
         end if
      end do
      norm = sqrt(metric(problem, heading%u, heading%u))
      if (.not. norm > 0.0_wp) return
      heading%u = heading%u / norm
      heading%load = heading%load / norm
   end subroutine state_between

   !> Weights of the samples in the value and in the derivative, at x, of the polynomial through them.
   pure subroutine lagrange(at, x, value, derivative)
      real(wp), intent(in) :: at(:), x
      real(wp), intent(out) :: value(:), derivative(:)
      real(wp) :: product
      integer :: i, j, k
      do i = 1, size(at)
         value(i) = 1.0_wp
         derivative(i) = 0.0_wp
         do j = 1, size(at)
            if (j == i) cycle
            value(i) = value(i) * (x - at(j)) / (at(i) - at(j))
            product = 1.0_wp / (at(i) - at(j))
            do k = 1, size(at)
               if (k /= i .and. k /= j) product = product * (x - at(k)) / (at(i) - at(k))
            end do
            derivative(i) = derivative(i) + product
         end do
      end do
   end subroutine lagrange

   !> Zero, by Newton's method, of the cubic through four samples that is nearest to the middle of the samples.
   pure real(wp) function zero_of_cubic(at, mu) result(x)
      real(wp), intent(in) :: at(n_samples), mu(n_samples)
      real(wp) :: value(n_samples), derivative(n_samples), slope, shift, reach
      integer :: iteration
      reach = at(n_samples) - at(1)
      x = 0.5_wp * (at(1) + at(n_samples))
      do iteration = 1, 20
         call lagrange(at, x, value, derivative)
         slope = dot_product(derivative, mu)
         if (.not. abs(slope) > 0.0_wp) return
         shift = -dot_product(value, mu) / slope
         ! A Newton step is at most as long as the sampled interval, beyond which the cubic is meaningless.
         shift = min(max(shift, -reach), reach)
         x = x + shift
         if (abs(shift) <= epsilon(x) * max(abs(x), reach)) return
      end do
   end function zero_of_cubic
end module path_samples
