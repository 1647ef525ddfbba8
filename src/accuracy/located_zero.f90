!> Test function of a located event, evaluated at other points of the path and for the enriched problem.
module located_zero
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t, unknown_weights
   use rod_state, only: state_t
   use linear_system, only: system_t
   use element_products, only: element_deformation
   use path_events, only: event_t, new_test_values, event_value, event_bifurcation, event_limit
   use test_kinds, only: span_test_t, test_couple, is_length
   use breakpoint_forces, only: breakpoint_couple
   use span_tests, only: run_span_tests, least_length
   use ground_events, only: ground_event_place, ground_event_gap
   use ground_segments, only: gap_in_state
   use element_gap, only: element_gap_t, gap_value, gap_and_gradient
   use rod_profile, only: profile_error
   use state_functional, only: functional_t, new_functional
   use displacement_functional, only: new_place_gap_functional
   use tangent_modes, only: modes_t, lowest_modes, null_vectors, apply_tangent, stretching_forces, mode_tolerance, &
      & most_null_vectors
   use bordered_system, only: solve_effective
   use null_directions, only: likeness, new_null_directions, leave_out
   implicit none
   private
   public :: as_zero, zero_t, new_zero, zero_value, left_of_zero, find_event_gap, between_nodes, located_gap, mode_rounding

   !> A located event: an event of the path, or a test of contact spans that is zero.
   type :: zero_t
      type(event_t), allocatable :: event
      real(wp), allocatable :: modes(:, :)       !! (unknowns, multiplicity) bifurcation: null vectors, node axes
      real(wp), allocatable :: coincident(:, :) !! (unknowns, number of null vectors) limit point: null vectors of bifurcations that
      !! coincide with the limit point
      integer :: test = 0                        !! index of the test in run_span_tests; 0: the event is not a test of contact spans
      real(wp) :: force_scale = 1.0_wp !! scale of the forces in tests of contact spans, the same at all points. A scale from the
      !! forces of each point would make the test unsmooth: where the last contact of an unstressed structure ends, such a scale
      !! vanishes together with the tested force
   end type zero_t

   real(wp), parameter :: as_zero = 1.0e-4_wp !! an eigenvalue counts as zero below this part of its change over the increment; with
   !! values from 1E-5 to 1E-3 every deck in input has the same results

contains

   !> Prepares the test function of an event for evaluation at other points. A bifurcation is recognised there by its null vectors.
   subroutine new_zero(problem, event, state, system, zero)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: state         !! located state of the event
      type(system_t), intent(in) :: system       !! factored at `state`
      type(zero_t), intent(out) :: zero
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      real(wp) :: change
      integer :: n
      zero%event = event
      if (all(event%kind /= [event_bifurcation, event_limit])) return
      change = event%scale
      ! Along a path tangent t of length 1 the tangent stiffness K, the load rate p' and the load vector q satisfy t.K t = p' q.t.
      if (event%kind == event_limit) change = change * abs(dot_product(system%tangent, system%load)) / &
         & max(sqrt(likeness(problem, system%tangent, system%tangent)), tiny(change))
      call null_vectors(problem, state, system, as_zero * change, modes, n, error)
      if (event%kind == event_limit) then
         zero%coincident = without_work(system%load, modes%x(:, :n))
      else
         ! Next to a singular tangent the mode can be used even if the iteration for it has not converged.
         n = max(n, min(modes%n, 1))
         if (n > 0) zero%modes = modes%x(:, :n)
      end if
   end subroutine new_zero

   !> Basis of those combinations of null vectors on which the load does no work. At a limit point these combinations are the null
   !> vectors of coinciding bifurcations, because the load does work on the null vector of the limit point itself.
   pure function without_work(load, modes) result(basis)
      real(wp), intent(in) :: load(:)            !! (unknowns) load vector, node axes
      real(wp), intent(in) :: modes(:, :) !! (unknowns, number of null vectors) null vectors, orthonormal in the arc-length metric
      !! of the path
      real(wp), allocatable :: basis(:, :) !! (unknowns, number of null vectors - 1) orthonormal; no columns for fewer than two null
      !! vectors
      real(wp) :: work(size(modes, 2)), mirror(size(modes, 2))
      integer :: k, n
      n = size(modes, 2)
      allocate (basis(size(modes, 1), max(0, n - 1)))
      if (n < 2) return
      ! The reflection that takes the last coordinate vector to the direction of `work` takes the other coordinate vectors to the
      ! basis (Householder).
      work = matmul(load, modes)
      mirror = work / norm2([work, tiny(work)])
      mirror(n) = mirror(n) + sign(1.0_wp, mirror(n))
      do k = 1, n - 1
         basis(:, k) = modes(:, k) - matmul(modes, mirror) * (2.0_wp * mirror(k) / dot_product(mirror, mirror))
      end do
   end function without_work

   !> Test function at a converged point; NaN if it is undefined there.
   function zero_value(problem, zero, state, system, load_rate) result(value)
      type(problem_t), intent(in) :: problem
      type(zero_t), intent(in) :: zero
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      real(wp), intent(in) :: load_rate          !! load rate of the path at `state`
      real(wp) :: value
      type(span_test_t), allocatable :: tests(:)
      value = ieee_value(value, ieee_quiet_nan)
      if (zero%test > 0) then
         tests = run_span_tests(problem, state, zero%force_scale, zero%test)
         if (size(tests) < zero%test) return
         value = tests(zero%test)%value
         ! The test of contact spans is minus the magnitude of the couple, because a couple of either sign lifts the contact. Here
         ! the couple itself is used, because it is smooth where it changes its sign.
         if (tests(zero%test)%kind == test_couple) value = breakpoint_couple(problem, state, tests(zero%test)%candidate) / &
            & (zero%force_scale * problem%size)
      else if (.not. allocated(zero%event)) then
         return
      else if (zero%event%kind == event_bifurcation) then
         if (allocated(zero%modes)) value = eigenvalue_of(problem, zero%modes, state, system)
      else
         value = event_value(problem, zero%event, state, new_test_values(problem, state, system, load_rate))
      end if
   end function zero_value

   !> Value of the test function that remains at the located event. A line contact, or a free span between a contact and a segment
   !> boundary, counts as vanished when it has a least length above zero; this length is then the remaining value. Otherwise it is
   !> zero.
   real(wp) function left_of_zero(problem, zero, state) result(left)
      type(problem_t), intent(in) :: problem
      type(zero_t), intent(in) :: zero
      type(state_t), intent(in) :: state
      type(span_test_t), allocatable :: tests(:)
      left = 0.0_wp
      if (zero%test == 0) return
      tests = run_span_tests(problem, state, zero%force_scale, 0)
      if (size(tests) < zero%test) return
      associate (test => tests(zero%test))
         if (is_length(test%kind)) left = least_length(problem, test) / problem%size
      end associate
   end function left_of_zero

   !> The gap that is the event function at an end of contact with a foundation, as a functional.
   subroutine find_event_gap(problem, zero, state, system, number)
      type(problem_t), intent(in) :: problem
      type(zero_t), intent(in) :: zero
      type(state_t), intent(in) :: state         !! located state of the event
      type(system_t), intent(in) :: system       !! assembled at `state`
      type(functional_t), allocatable, intent(out) :: number !! the gap; not allocated for other kinds of events
      real(wp) :: tau, factor, x(2), gap, normal(2), bend
      integer :: candidate
      if (.not. is_on_ground(zero)) return
      call ground_event_place(problem, state, zero%event%ground, candidate, tau, factor)
      if (candidate == 0) return
      call gap_and_gradient(problem, gap_in_state(problem, state, candidate), tau, x, gap, normal, bend)
      number = new_functional(system%n)
      call number%add(factor / zero%event%gap_scale, new_place_gap_functional(problem, state, system, &
         & problem%ground%chain%contact(candidate), problem%ground%chain%element(2, candidate), tau, gap, normal))
   end subroutine find_event_gap

   !> Difference of the event function between the enriched and the original problem, as far as it comes from the polynomials
   !> between nodes and not from the nodal values. Only events of foundations have such a difference: their smallest gap lies inside
   !> an element and is only as accurate as the polynomial of the element.
   subroutine between_nodes(problem, zero, state, system, load_rate, finer, there, value, element, part, most, interpolation)
      type(problem_t), intent(in) :: problem, finer
      type(zero_t), intent(in) :: zero
      type(state_t), intent(in) :: state         !! located state of the event
      type(system_t), intent(in) :: system       !! factored at `state`
      real(wp), intent(in) :: load_rate          !! load rate of the path at `state`
      type(state_t), intent(in) :: there         !! state of the enriched problem at the same value of the prescribed quantity
      real(wp), intent(in) :: value              !! event function on the enriched problem
      integer, intent(out) :: element            !! element that contains the smallest gap; 0: none
      real(wp), intent(out) :: part              !! the difference
      real(wp), intent(out) :: most              !! bound of the difference at the place of the smallest gap; zero at the nodes
      real(wp), intent(out) :: interpolation !! larger of the interpolation errors of the two rod profiles at the smallest gap
      type(element_gap_t) :: gap(2)
      real(wp) :: tau, factor
      integer :: j, candidate
      element = 0
      part = 0.0_wp
      most = 0.0_wp
      interpolation = 0.0_wp
      if (.not. is_on_ground(zero)) return
      call ground_event_place(finer, there, zero%event%ground, candidate, tau, factor)
      if (candidate == 0) return
      element = problem%ground%chain%element(2, candidate)
      gap = [gap_in_state(problem, state, candidate), gap_in_state(finer, there, candidate)]
      factor = factor / zero%event%gap_scale
      part = value - zero_value(problem, zero, state, system, load_rate) + along(tau) * factor
      ! At the nodes the profile has no interpolation error.
      most = 4.0_wp * tau * (1.0_wp - tau) * maxval([(abs(gap_change(0.125_wp * j) - along(0.125_wp * j)), j=1, 7)]) * factor
      if (gap(1)%profile%mended) interpolation = (4.0_wp * tau * (1.0_wp - tau))**4 * &
         & max(profile_error(gap(1)%profile), profile_error(gap(2)%profile)) * factor

   contains

      !> Linear interpolation of gap_change between the two ends of the element.
      real(wp) function along(tau)
         real(wp), intent(in) :: tau
         along = (1.0_wp - tau) * gap_change(0.0_wp) + tau * gap_change(1.0_wp)
      end function along

      !> Gap of the enriched problem minus gap of the original problem.
      real(wp) function gap_change(tau)
         real(wp), intent(in) :: tau
         gap_change = gap_value(finer, gap(2), tau) - gap_value(problem, gap(1), tau)
      end function gap_change
   end subroutine between_nodes

   !> True if contact with a foundation begins or ends at the event.
   pure logical function is_on_ground(zero)
      type(zero_t), intent(in) :: zero
      is_on_ground = .false.
      if (allocated(zero%event)) is_on_ground = zero%event%ground%contact > 0
   end function is_on_ground

   !> Gap that the location left at an end of foundation contact, plus one per cent; zero for other events.
   real(wp) function located_gap(problem, zero, state)
      type(problem_t), intent(in) :: problem
      type(zero_t), intent(in) :: zero
      type(state_t), intent(in) :: state
      located_gap = 0.0_wp
      if (is_on_ground(zero)) located_gap = 1.01_wp * ground_event_gap(problem, state, zero%event%ground)
   end function located_gap

   !> The eigenvalue nearest to zero among those whose modes are mainly combinations of the given modes; NaN if there is none.
   function eigenvalue_of(problem, given, state, system) result(value)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: given(:, :)
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: value
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      real(wp) :: nearby(size(given, 1)), held(size(given, 1)), answer(size(given, 1))
      logical :: settled
      integer :: i, k
      value = ieee_value(value, ieee_quiet_nan)
      if (size(given, 2) == 1 .and. system%rigidity%n == 0) then
         call iterate_mode(problem, given(:, 1), system, nearby, settled)
         if (settled) then
            held = merge(0.0_wp, nearby, system%fixed)
            call apply_tangent(problem, state, system, held, answer, value)
            value = value - of_other_modes(problem, state, system, nearby)
            return
         end if
      end if
      call lowest_modes(problem, state, system, most_null_vectors + 1, modes, error)
      ! Eigenvalues are sorted by magnitude: of those with such a mode, the first is nearest to zero.
      do i = 1, modes%n
         if (sum([(likeness(problem, given(:, k), modes%x(:, i))**2, k=1, size(given, 2))]) < 0.5_wp) cycle
         value = modes%mu(i) - of_other_modes(problem, state, system, modes%x(:, i))
         return
      end do
   end function eigenvalue_of

   !> Computes the mode that is nearest to a given one by inverse iteration. The iteration converges at once if the eigenvalue of
   !> this mode is much nearer to zero than all others, as at a bifurcation.
   subroutine iterate_mode(problem, given, system, mode, settled)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: given(:)           !! (unknowns) given mode, node axes
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(out) :: mode(:)           !! (unknowns) computed mode, of length 1 in the metric
      logical, intent(out) :: settled            !! false: the iteration has not converged, and several modes have to be computed
      integer, parameter :: most = 4
      real(wp) :: before(size(given)), length
      integer :: k
      settled = .false.
      mode = given
      do k = 1, most
         before = mode
         call solve_effective(system, merge(0.0_wp, unknown_weights(problem) * before, system%fixed), mode)
         length = sqrt(likeness(problem, mode, mode))
         if (.not. length > 0.0_wp) return
         mode = mode / length
         settled = 1.0_wp - abs(likeness(problem, mode, before)) < 0.5_wp * mode_tolerance**2
         if (settled) exit
      end do
      settled = settled .and. likeness(problem, given, mode)**2 >= 0.5_wp
   end subroutine iterate_mode

   !> Error of the eigenvalue of a mode by rounding: the rounding of the element deformations from which the Rayleigh quotient is
   !> computed (see tangent_modes), plus the contribution of other modes that the iteration left in the mode.
   real(wp) function mode_rounding(problem, state, system, mode) result(rounding)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at the state of the mode
      real(wp), intent(in) :: mode(:)            !! (unknowns) the mode, node axes
      real(wp) :: local(6)
      integer :: e
      rounding = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         local = abs(element_deformation(problem, system, e, mode))
         rounding = rounding + dot_product(local, matmul(abs(system%ek(:, :, e)), local))**2
      end do
      rounding = epsilon(rounding) * sqrt(rounding) + abs(of_other_modes(problem, state, system, mode))
   end function mode_rounding

   !> Contribution of other modes to the Rayleigh quotient of an iterated mode. If the iterated mode contains the part c of another
   !> mode phi with the eigenvalue m, this part adds c^2 m to the quotient and c m M phi (M: metric) to the residual r. Hence r.K^-1
   !> r with the tangent K is the sum of the contributions of all other modes.
   real(wp) function of_other_modes(problem, state, system, mode) result(added)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: mode(:)            !! (unknowns) iterated mode, node axes
      real(wp), dimension(size(mode)) :: held, weighted, left, answer
      real(wp) :: direction(size(mode), 1), eigenvalue
      held = merge(0.0_wp, mode, system%fixed)
      weighted = merge(0.0_wp, unknown_weights(problem) * held, system%fixed)
      call apply_tangent(problem, state, system, held, left, eigenvalue)
      if (system%rigidity%n > 0) left = left - stretching_forces(system, weighted, held)
      left = merge(0.0_wp, left, system%fixed)
      left = left - dot_product(held, left) * weighted
      call solve_effective(system, left, answer)
      direction = new_null_directions(problem, system, spread(held, 2, 1))
      call leave_out(problem, spread(held, 2, 1), direction, answer)
      added = dot_product(answer, left)
   end function of_other_modes
end module located_zero
