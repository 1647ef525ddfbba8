!> Finds the zero of an event function inside an increment from points of the path on both sides.
!>
!> The function at a bifurcation, or where a line contact without force lets go (detachment), is the eigenvalue of the tangent
!> stiffness that vanishes (zero_eigenvalue). Where the last correction of Newton's method is meaningless (bifurcation) or the
!> method fails (point contact at zero relative curvature), states are interpolated by a cubic between points of the path, with
!> their tangents (state_between).
module zero_search
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use increment_points, only: increment_measure_t, point_within
   use path_events, only: event_value, event_bifurcation, event_t, event_release
   use tangent_modes, only: modes_t, lowest_modes, numbered_eigenvalue, most_null_vectors
   use path_point, only: path_point_t
   use path_state, only: path_state_t, located_event_t
   use bracketing, only: bracket_t, next_guess, take_value
   use errors, only: error_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use force_free_contact, only: isolate_force_free_lines
   use state_transfer, only: displacements_at
   use path_control, only: metric
   use path_continuity, only: path_tangent_t, blended
   implicit none
   private
   public :: zero_search_t, find_zero, tangent_turn_per_force, zero_eigenvalue, state_between, zero_of_cubic, n_samples

   integer, parameter :: max_centres = 6 !! largest number of interpolations for one zero; with values from 1 to 12 every deck in
   !! input has the same results
   real(wp), parameter :: reach = epsilon(1.0_wp)**0.2_wp !! spacing of the samples, as a fraction of the increment

   integer, parameter :: n_samples = 4           !! number of samples of a cubic

   !> Data of the search for the zero of an event function.
   type :: zero_search_t
      type(bracket_t) :: bracket !! bracket of the zero; initially with the function's values at both ends of the increment
      real(wp) :: centre = 0.0_wp                !! best estimate of the zero, as a fraction of the increment
      real(wp) :: at(n_samples) = 0.0_wp         !! positions of the samples, as fractions of the increment
      real(wp) :: value(n_samples) = 0.0_wp      !! values of the event function at the samples
      ! The point evaluated last:
      type(path_point_t) :: here
      real(wp) :: value_here = 0.0_wp
      type(modes_t) :: modes                     !! eigenvalues nearest zero at the point evaluated last; only for a bifurcation
      logical :: known = .false.                 !! true: the point evaluated last converged, with the trial's contact set
   end type zero_search_t

contains

   !> Finds the zero of the event function and the state there. Bracketing is tried first, except for bifurcations. If bracketing
   !> fails, a cubic through samples around the zero is used.
   subroutine find_zero(problem, step, run, trial, measure, search, located_event, found)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(increment_measure_t), intent(inout) :: measure
      type(zero_search_t), intent(inout) :: search !! the search, with its bracket
      type(located_event_t), intent(inout) :: located_event !! out: point and fraction are set, even if the zero was not located to
      !! the tolerance; the report is that of the last correction
      logical, intent(out) :: found                         !! true: the zero was located to the tolerance
      type(bracket_t) :: whole
      whole = search%bracket
      found = .false.
      if (located_event%event%kind /= event_bifurcation) call close_in()
      if (found) return
      search%bracket = whole
      call narrow_bracket()
      if (found) call interpolate_zero()

   contains

      !> Finds the zero by bracketing alone. When a foundation begins to act, the function may be curved so strongly between the
      !> samples that the interpolation mistakes the zero for a jump.
      subroutine close_in()
         type(path_point_t), allocatable :: look    ! the last point
         do while (next_guess(search%bracket, epsilon(1.0_wp), search%centre))
            call evaluate_at(search%centre, look)
            look = search%here
            located_event%point = search%here
            if (.not. search%known) return
            found = abs(search%value_here) <= step%locate_tolerance * search%bracket%scale
            if (found) exit
            call take_value(search%bracket, search%centre, search%value_here)
         end do
         if (found) located_event%fraction = search%centre
      end subroutine close_in

      !> Narrows the bracket to the spacing of the samples. If the corrector fails near the zero, several eigenvalues may vanish
      !> there; samples around the estimate are then used instead.
      subroutine narrow_bracket()
         found = .true.
         do while (next_guess(search%bracket, reach, search%centre))
            call evaluate_at(search%centre)
            found = search%known .or. .not. located_event%report%converged
            if (.not. search%known .or. abs(search%value_here) <= reach * search%bracket%scale) return
            call take_value(search%bracket, search%centre, search%value_here)
         end do
      end subroutine narrow_bracket

      !> Finds the zero of the cubic through four samples around the estimate, repeated until the estimate moves by less than two
      !> sample spacings.
      subroutine interpolate_zero()
         type(state_t) :: sample(n_samples)
         real(wp) :: guess
         integer :: try
         do try = 1, max_centres
            guess = search%centre
            call take_samples(sample)
            if (.not. found) return
            found = .not. jumps(search%value)
            if (.not. found) return
            search%centre = zero_of_cubic(search%at, search%value)
            if (abs(search%centre - guess) <= 2.0_wp * reach) exit
         end do
         ! The signs of the function at the two ends differ, except for rounding, so that the zero lies between the ends. If the
         ! load is monotonic, the load at the zero lies between the loads of the ends.
         found = search%centre >= -reach .and. search%centre <= 1.0_wp + reach
         if (.not. found) return
         search%centre = min(max(search%centre, 0.0_wp), 1.0_wp)
         located_event%fraction = search%centre
         call state_between(problem, sample, search%at, search%centre, located_event%point%state, located_event%point%tangent)
         if (.not. run%last%tangent%load * trial%tangent%load > 0.0_wp) return
         associate (load => located_event%point%state%load_factor, first => run%last%state%load_factor, &
            & last => trial%state%load_factor)
            load = min(max(load, min(first, last)), max(first, last))
         end associate
      end subroutine interpolate_zero

      !> Computes states of the path around search%centre, and the event function at these states.
      subroutine take_samples(sample)
         type(state_t), intent(inout) :: sample(n_samples)
         type(modes_t) :: modes(n_samples)
         integer :: k
         search%at = sample_places(search%centre)
         do k = 1, n_samples
            call evaluate_at(search%at(k))
            search%value(k) = search%value_here
            sample(k) = search%here%state
            found = search%known
            if (.not. found) return
            if (located_event%event%kind == event_bifurcation) modes(k) = search%modes
         end do
         if (located_event%event%kind == event_bifurcation) call follow_through_zero(modes, located_event%event, search%value)
      end subroutine take_samples

      !> Computes a point of the increment and the event function there. search%known becomes false if the corrector fails, or if
      !> the contact set of the point differs from the contact set of the trial.
      subroutine evaluate_at(fraction, near)
         real(wp), value :: fraction !! fraction of the increment, 0 to 1. Passed by value, because the actual argument may be a
         !! component of `search`
         type(path_point_t), intent(in), optional :: near !! known point of the increment with which the correction starts
         search%value_here = 0.0_wp
         call point_within(problem, run, trial, measure, fraction, .false., .false., search%here, located_event%report, near)
         search%known = located_event%report%converged
         if (search%known) search%known = all(search%here%state%active .eqv. trial%state%active)
         if (.not. search%known) return
         if (located_event%event%kind == event_bifurcation) then
            search%value_here = zero_eigenvalue(problem, located_event%event, search%here, search%modes)
         else
            search%value_here = event_value(problem, located_event%event, search%here%state, search%here%test_values)
         end if
      end subroutine evaluate_at
   end subroutine find_zero

   !> Positions of the four samples: two on each side of the centre. If the centre is next to an end of the increment, all four
   !> samples lie on the other side of the centre, inside the increment.
   pure function sample_places(centre) result(at)
      real(wp), intent(in) :: centre             !! best estimate of the zero, as a fraction of the increment
      real(wp) :: at(n_samples)
      at = centre + reach * [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
      if (at(1) < 0.0_wp) at = max(centre, 0.0_wp) + reach * [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
      if (at(n_samples) > 1.0_wp) at = min(centre, 1.0_wp) - reach * [4.0_wp, 3.0_wp, 2.0_wp, 1.0_wp]
   end function sample_places

   !> True if the samples show a jump instead of a zero: the corrector converged to another path that is close.
   pure logical function jumps(value)
      real(wp), intent(in) :: value(n_samples)  !! function at two samples on each side of the zero
      real(wp), parameter :: times = 4.0_wp !! change between the two inner samples over the sum of both outer changes (1 for a
      !! smooth function), above which the function jumps; with values up to 40 every deck in input has the same results; with 0.4
      !! six decks have other results
      jumps = value(2) * value(3) < 0.0_wp .and. abs(value(3) - value(2)) > times * (abs(value(2) - value(1)) + &
         & abs(value(4) - value(3)))
   end function jumps

   !> Turn of the path tangent by a unit force on the null vector of length 1. A force f displaces the path by f/mu along the null
   !> vector if mu is the eigenvalue, and mu grows linearly with the distance from the zero.
   pure real(wp) function tangent_turn_per_force(search, length) result(turn)
      type(zero_search_t), intent(in) :: search !! search that has found the zero between its samples
      real(wp), intent(in) :: length            !! arc length of the increment
      real(wp) :: w(n_samples), d(n_samples), slope
      call lagrange(search%at, search%centre, w, d)
      slope = abs(dot_product(d, search%value))
      turn = slope * minval(abs(search%at - search%centre))**2 * length
      if (turn > 0.0_wp) turn = 1.0_wp / turn
   end function tangent_turn_per_force

   !> Eigenvalue that changes its sign at the event, evaluated at a point near the event. For a detachment the eigenvalue belongs to
   !> the structure without its force-free line contacts.
   real(wp) function zero_eigenvalue(problem, event, point, found) result(mu)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      type(path_point_t), intent(in) :: point
      type(modes_t), intent(out), optional :: found !! all eigenvalues computed
      real(wp), parameter :: alone = sqrt(epsilon(mu))
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(problem_t) :: free
      type(state_t) :: at
      type(system_t) :: other
      logical :: any_weak
      if (event%kind == event_release) then
         call isolate_force_free_lines(problem, point%state, point%system, free, at, any_weak)
         if (.not. any_weak) then
            call copy_problem(problem, free)
            at = point%state
         end if
         other = new_system(free)
         call linearise(free, at, at, other)
         call lowest_modes(free, at, other, most_null_vectors, modes, error)
      else
         call lowest_modes(problem, point%state, point%system, most_null_vectors, modes, error)
      end if
      mu = numbered_eigenvalue(modes, event%number, event%least, event%most)
      ! At the event itself the sign of the vanishing eigenvalue is rounding, so that its number in the order is unknown: the
      ! smallest eigenvalue is returned.
      if (event%kind == event_release .and. size(modes%mu) > 1) then
         if (abs(modes%mu(1)) <= alone * abs(modes%mu(2))) mu = modes%mu(1)
      end if
      if (present(found)) found = modes
   end function zero_eigenvalue

   !> Selects the eigenvalue of the event at samples on both sides of the event, if several eigenvalues vanish there. Among the
   !> eigenvalues that change their sign, the k-th by magnitude is the same eigenvalue on both sides.
   pure subroutine follow_through_zero(modes, event, mu)
      type(modes_t), intent(in) :: modes(n_samples)
      type(event_t), intent(in) :: event
      real(wp), intent(inout) :: mu(n_samples)  !! eigenvalue at each sample; in: selected by its number in the order
      integer :: first, last, k, i, j, left
      logical :: wanted, beyond
      first = negative_count(modes(1))
      last = negative_count(modes(n_samples))
      if (abs(last - first) < 2) return
      k = event%number - min(max(min(first, last), event%least), event%most - 1)
      if (k < 1 .or. k > abs(last - first)) return
      do i = 1, n_samples
         beyond = abs(negative_count(modes(i)) - last) < abs(negative_count(modes(i)) - first)
         wanted = merge(last > first, first > last, beyond)
         left = k
         ! The eigenvalues in `modes` are sorted by magnitude.
         do j = 1, modes(i)%n
            if (modes(i)%mu(j) < 0.0_wp .neqv. wanted) cycle
            left = left - 1
            if (left == 0) mu(i) = modes(i)%mu(j)
         end do
      end do
   end subroutine follow_through_zero

   !> Number of negative eigenvalues that event functions use. Where refined eigenvalues were computed, their signs are counted.
   pure integer function negative_count(modes)
      type(modes_t), intent(in) :: modes
      negative_count = modes%pivots - modes%hinges - count(modes%was_negative) + count(modes%mu < 0.0_wp)
   end function negative_count

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
end module zero_search
