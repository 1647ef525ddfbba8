!> First point of another path through a bifurcation.
!>
!> The predictor moves the state along the null vector. The corrector stays in a plane whose normal is the null vector without its
!> component along the known path, so that it cannot return to that path. The first distance is halved until the tangent of the new
!> path hardly turns over this distance, and the load of the new path has no extremum within it.
module branch_switching
   use kinds, only: wp
   use errors, only: error_t
   use model, only: step_t, method_load, method_displacement, method_linearised
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: to_global
   use bordered_system, only: apply_increment
   use tangent_modes, only: modes_t, lowest_modes, choose_null_vectors, deck_mode
   use test_kinds, only: span_test_t, test_slack, test_gap
   use span_tests, only: run_span_tests
   use path_control, only: control_t, metric, is_arc_length, displacement_between
   use state_transfer, only: carried
   use path_continuity, only: path_tangent_at
   use path_point, only: path_point_t, point_at, evaluate_tests
   use path_state, only: path_state_t
   use critical_points, only: critical_point_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: switch_branch, take_way

   integer, parameter :: max_tries = 12
   real(wp), parameter :: straight = 0.3_wp !! largest correction as a part of the distance; with values up to 3 every deck in input
   !! has the same results; at 0.03 three have others

contains

   !> Moves the path state to the first point of the other path.
   subroutine switch_branch(problem, step, critical_point, mode, side, distance, run, report)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(critical_point_t), intent(in) :: critical_point !! the bifurcation
      integer, intent(in) :: mode               !! index of the null vector, at most the multiplicity
      integer, intent(in) :: side               !! 1 along the null vector, -1 against it (sign convention of tangent_modes)
      real(wp), intent(in) :: distance          !! arc length tried first
      type(path_state_t), intent(inout) :: run  !! in: at the bifurcation; out: at the first point of the new path
      type(increment_t), intent(out) :: report  !! report of the correction to the first point; converged: the point was found
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(path_point_t) :: trial
      type(state_t) :: predicted
      type(control_t) :: plane
      real(wp), allocatable :: shape(:, :), chord(:, :), away(:, :), seen(:, :)
      real(wp) :: length, along, sense, drift
      integer :: try, node

      if (.not. run%last%system%ok) then
         report%message = 'the tangent at the bifurcation is singular'
         return
      end if
      call lowest_modes(problem, run%last%state, run%last%system, critical_point%multiplicity + 2, modes, error)
      if (modes%n < critical_point%multiplicity) then
         report%message = 'the null vector was not found'
         return
      end if
      call choose_null_vectors(problem, run%last%state, run%last%system, critical_point%multiplicity, modes)
      allocate (shape(3, size(run%last%state%u, 2)))
      do node = 1, size(shape, 2)
         shape(:, node) = to_global(problem, run%last%system, modes%x(:, mode), node)
      end do
      allocate (seen(3, problem%deck%mesh%n_nodes))
      call deck_mode(problem, run%last%state, run%last%system, modes%x(:, mode), seen, sense)
      sense = side * sense
      plane%method = method_linearised
      plane%tangent = sense * shape
      ! Direction of the known path without its rounding error: that error contains a component of the null vector.
      chord = critical_point%direction - critical_point%drift
      along = metric(problem, chord, chord)
      if (along > 0.0_wp) plane%tangent = plane%tangent - chord * (metric(problem, plane%tangent, chord) / along)
      plane%tangent = plane%tangent / sqrt(metric(problem, plane%tangent, plane%tangent))

      length = distance
      do try = 1, max_tries
         trial = run%last
         call apply_increment(problem, run%last%system, sense * length * modes%x(:, mode), 0.0_wp, trial%state)
         predicted = trial%state
         plane%increment = sense * length * metric(problem, plane%tangent, shape)
         ! The distance is measured from the known path without its rounding error, so that rounding does not move the points.
         drift = metric(problem, plane%tangent, critical_point%drift)
         if (abs(drift) >= 0.1_wp * abs(plane%increment)) drift = 0.0_wp
         plane%increment = plane%increment - drift
         call correct(problem, run%last%state, plane, .false., trial%state, trial%system, report)
         if (report%converged) then
            report%converged = transverse_distance() <= straight * length
            if (.not. report%converged) report%message = 'no other path was found near the bifurcation'
            if (report%converged) call check_penetration()
            if (report%converged) call check_extremum()
            if (report%converged) exit
         end if
         length = 0.5_wp * length
      end do
      if (.not. report%converged) return

      run%last_length = sqrt(metric(problem, away, away))
      run%last_load = trial%state%load_factor - run%last%state%load_factor
      call evaluate_tests(problem, trial)
      run%arc_length = critical_point%arc_length + run%last_length
      call set_increment(problem, step, critical_point, trial, length, run)
      run%last = trial

   contains

      !> Distance of the first point from the predictor, without its component along the known path. (Along the known path the load
      !> may change with the distance.)
      real(wp) function transverse_distance()
         real(wp), allocatable :: correction(:, :)
         correction = displacement_between(problem, predicted, trial%state)
         if (along > 0.0_wp) correction = correction - chord * (metric(problem, correction, chord) / along)
         transverse_distance = sqrt(metric(problem, correction, correction))
      end function transverse_distance

      !> Rejects a first point in which a free span penetrates an obstacle. This happens if the first contact of the new path lies
      !> within the distance.
      subroutine check_penetration()
         type(span_test_t), allocatable :: tests(:)
         if (.not. problem%has_spans()) return
         tests = run_span_tests(problem, trial%state, max(trial%system%force_scale, tiny(length)))
         report%converged = all(tests%value >= -test_slack(tests%kind) .or. tests%kind /= test_gap)
         if (.not. report%converged) report%message = 'the other path begins inside an obstacle'
      end subroutine check_penetration

      !> Computes the path tangent at the first point, and rejects the point if the load has an extremum between the bifurcation and
      !> the first point. A load that changes by c a^2 + d a^4 over the distance a has no extremum if its rate times the distance
      !> lies between zero and four times its change.
      subroutine check_extremum()
         real(wp) :: change, rate
         away = trial%state%u - (run%last%state%u - drift * plane%tangent)
         change = trial%state%load_factor - run%last%state%load_factor
         trial%tangent = path_tangent_at(problem, trial%system, away, change)
         if (abs(change) <= step%locate_tolerance * abs(trial%state%load_factor)) return
         rate = trial%tangent%load * sqrt(metric(problem, away, away))
         report%converged = rate * change >= 0.0_wp .and. abs(rate) <= 4.0_wp * abs(change)
         if (.not. report%converged) report%message = 'the other path has a limit point next to the bifurcation'
      end subroutine check_extremum
   end subroutine switch_branch

   !> Moves the path state to the first point of a path with another contact set.
   subroutine take_way(problem, step, critical_point, way, run)
      type(problem_t), intent(inout) :: problem  !! in: problem of the contact change; out: problem of the new path
      type(step_t), intent(in) :: step
      type(critical_point_t), intent(in) :: critical_point !! the contact change from which the new path starts
      integer, intent(in) :: way                 !! index of the new path in critical_point%way
      type(path_state_t), intent(inout) :: run   !! in: at the contact change; out: at the first point of the new path
      type(path_point_t) :: first
      real(wp), allocatable :: away(:, :)
      associate (on => critical_point%way(way))
         away = displacement_between(on%problem, carried(problem, run%last%state, on%problem), on%state)
         run%last_length = sqrt(metric(on%problem, away, away))
         run%last_load = on%state%load_factor - run%last%state%load_factor
         first = point_at(on%problem, on%state)
         first%tangent = on%tangent
         call evaluate_tests(on%problem, first)
         run%arc_length = critical_point%arc_length + run%last_length
         call set_increment(on%problem, step, critical_point, first, critical_point%control%increment, run)
         run%last = first
         call copy_problem(on%problem, problem)
         run%spans_begun = max(run%spans_begun, maxval(problem%contact_span%number))
      end associate
   end subroutine take_way

   !> Sets the strategy of the step and the direction of the branch. The first increment is at most the distance of the branch's
   !> first point from the critical point.
   subroutine set_increment(problem, step, critical_point, first, distance, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(critical_point_t), intent(in) :: critical_point
      type(path_point_t), intent(in) :: first    !! first point of the branch
      real(wp), intent(in) :: distance           !! arc length from the critical point to `first`
      type(path_state_t), intent(inout) :: run   !! in: its last accepted point is the critical point
      real(wp) :: change(size(problem%model%monitor))
      run%control = critical_point%control
      run%control%method = step%method
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      if (is_arc_length(step%method)) then
         if (.not. run%control%load_scale > 0.0_wp .and. abs(critical_point%direction_load) > 0.0_wp) &
            & run%control%load_scale = sqrt(metric(problem, critical_point%direction, critical_point%direction)) / &
            & abs(critical_point%direction_load)
         run%control%increment = min(distance, step%largest)
      else if (step%method == method_load) then
         run%control%increment = sign(min(max(abs(run%last_load), step%smallest), abs(step%increment)), run%last_load)
      else if (step%method == method_displacement) then
         change = first%test_values%monitor - run%last%test_values%monitor
         run%control%increment = sign(min(max(abs(change(step%monitor)), step%smallest), abs(step%increment)), change(step%monitor))
      end if
   end subroutine set_increment
end module branch_switching
