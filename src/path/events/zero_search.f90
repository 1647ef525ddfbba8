!> Finds the zero of an event function inside an increment from points of the path on both sides.
module zero_search
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_samples, only: state_between, lagrange, zero_of_cubic, n_samples
   use increment_points, only: division_t, point_within
   use path_events, only: event_value, event_bifurcation
   use event_eigenvalue, only: zero_eigenvalue, follow_through_zero
   use located_events, only: located_event_t
   use tangent_modes, only: modes_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use bracketing, only: bracket_t, next_guess, take_value
   implicit none
   private
   public :: zero_search_t, find_zero, tangent_turn_per_force

   integer, parameter :: max_centres = 6 !! largest number of interpolations for one zero; with values from 1 to 12 every deck in
   !! input has the same results
   real(wp), parameter :: reach = epsilon(1.0_wp)**0.2_wp !! spacing of the samples, as a fraction of the increment, see smooth_zero

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
      logical :: known = .false.                 !! the point evaluated last converged, with the trial's contact set
   end type zero_search_t

contains

   !> Finds the zero of the event function and the state there. Bracketing is tried first, except for bifurcations; if it fails, a
   !> cubic through samples around the zero is used.
   subroutine find_zero(problem, step, run, trial, division, search, located_event, found)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(division_t), intent(inout) :: division
      type(zero_search_t), intent(inout) :: search !! in: its bracket is given
      type(located_event_t), intent(inout) :: located_event !! out: point and fraction are set, also if the zero was not located to
      !! the tolerance; its report is that of the point corrected last
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

      !> Computes a point of the increment and the event function there. search%known becomes false if the corrector fails or the
      !> contact set differs from that of the trial.
      subroutine evaluate_at(fraction, near)
         real(wp), value :: fraction !! fraction of the increment, 0 to 1. Passed by value, because the actual argument may be a
         !! component of `search`
         type(path_point_t), intent(in), optional :: near !! known point of the increment with which the correction starts
         search%value_here = 0.0_wp
         call point_within(problem, run, trial, division, fraction, .false., .false., search%here, located_event%report, near)
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

   !> Positions of the four samples: two on each side of the centre. If the centre is next to an end of the increment, all four are
   !> on the other side, at a distance from the zero.
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
      real(wp), parameter :: times = 4.0_wp !! change between the two inner samples over the mean change on both sides (1 for a
      !! smooth function), above which the function jumps; with values up to 40 every deck in input has the same results; at 0.4 six
      !! have others
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
end module zero_search
