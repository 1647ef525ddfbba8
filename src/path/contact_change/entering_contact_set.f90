!> Moves the run past a change of its contact spans, to a state at which the next set is known to be in equilibrium.
module entering_contact_set
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use other_set, only: other_set_t, copy_other_set, on_next_mesh, is_there
   use test_zero, only: find_test_zero, quantity_t
   use test_kinds, only: span_test_t
   use path_events, only: event_t, new_test_values, detect_events, value_events
   use path_point, only: evaluate_tests
   use trial_request, only: request_t
   use mesh_transfer, only: refine_point
   use path_state, only: path_state_t, copy_path_state, path_tangent_of, forget_mesh, difference_load
   use settle_findings, only: arrival_t
   use path_acceptance, only: accept
   use error_report, only: bars_at_point, tolerance_at
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: go_to_next, replace_set, passes_value

   !> The test that is zero at the onset of a set.
   type, extends(quantity_t) :: onset_quantity_t
      integer :: test = 0                        !! index of the test
   contains
      procedure :: evaluate
   end type onset_quantity_t

contains

   !> Moves the run to the next contact set, whose known equilibrium is recorded as a point of the path, on a mesh as fine as the
   !> deck's tolerance demands.
   subroutine go_to_next(problem, step, run, next, recorder, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(other_set_t), intent(inout) :: next
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(problem_t) :: before
      type(path_state_t) :: start
      type(arrival_t) :: arrival
      type(request_t) :: request
      logical :: known, done
      integer :: lost                            ! number of contacts of nodes that contact spans replace in the next set
      call copy_problem(problem, before)
      call copy_path_state(run, start)
      known = allocated(next%tangent%u)
      arrival%report = next%report
      arrival%label = next%label
      arrival%times = next%times
      arrival%bracketed = .not. is_located(problem, step, run, next)
      arrival%divides = next%divides
      ! Where a test of the set is zero the contact changes, and the load may turn, with or without a label.
      arrival%changes = next%test > 0
      arrival%tries = 0
      do
         run = on_next_mesh(before, start, next)
         if (arrival%tries > 0) run%mesh%refinement = start%mesh%refinement
         lost = node_contacts(before, start%last%state) - node_contacts(next%problem, run%last%state)
         if (next%label == '' .and. lost > 0) then
            arrival%label = 'C-'
            arrival%times = lost
         end if
         call copy_problem(next%problem, problem)
         if (.not. known) then
            next%tangent = run%last%tangent
            if (.not. is_there(run, next)) next%tangent = path_tangent_of(problem, run, next%path_point_t)
         end if
         if (next%test > 0) call bars_at_point(problem, step, run, next%path_point_t, next%label, .false., next%test, &
            & arrival%bars, wanted=.true.)
         call accept(problem, step, run, next%path_point_t, arrival, recorder, request, finished, outcome)
         if (.not. request%repeats_increment()) exit
         start%mesh%refinement = run%mesh%refinement
         arrival%tries = arrival%tries + 1
         done = .false.
         if (allocated(request%density)) call refine_point(problem, run, next%path_point_t, request%density, done)
         if (done) then
            call copy_problem(problem, next%problem)
            call locate_onset(step, run, next)
         else
            ! No finer mesh is required, or none has an equilibrium: the point is accepted on the present mesh.
            arrival%tries = huge(arrival%tries) - 1
         end if
      end do
      if (finished .or. allocated(outcome%why) .or. known) return
      ! The path up to this point belongs to another contact set; records of its meshes are discarded.
      call forget_mesh(run)
   end subroutine go_to_next

   !> Moves a set from its onset on the former mesh to its onset on a new mesh: the load at which its test is zero depends on the
   !> mesh.
   subroutine locate_onset(step, run, next)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(inout) :: next   !! unchanged if the onset is not found
      type(other_set_t) :: there
      type(span_test_t), allocatable :: tests(:)
      logical :: found
      if (next%test == 0) return
      call copy_other_set(next, there)
      call find_test_zero(there, onset_quantity_t(next%test), difference_load(run), step%locate_tolerance, found, tests)
      if (.not. found) return
      there%span_tests = tests
      call evaluate_tests(there%problem, there%path_point_t)
      call copy_other_set(there, next)
   end subroutine locate_onset

   !> Computes the value of the test that is zero at the onset.
   subroutine evaluate(self, set, tests, value, found)
      class(onset_quantity_t), intent(in) :: self
      type(other_set_t), intent(in) :: set
      type(span_test_t), intent(in) :: tests(:)
      real(wp), intent(out) :: value
      logical, intent(out) :: found
      found = size(tests) >= self%test .and. set%test == self%test
      value = 0.0_wp
      if (found) value = tests(self%test)%value
   end subroutine evaluate

   !> True if the place of the change to another set is known: a test of this set is zero there, or its equilibrium has the load
   !> factor of the run's point, up to the largest error bar that the deck allows. Otherwise the change, and perhaps other changes,
   !> lie somewhere between the run's point and this equilibrium.
   pure logical function is_located(problem, step, run, next)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(in) :: next
      is_located = next%times == 0 .or. next%test > 0 .or. abs(next%state%load_factor - run%last%state%load_factor) <= &
         & max(step%locate_tolerance, tolerance_at(problem, step, next%label)) * abs(run%last%state%load_factor)
   end function is_located

   !> Number of active contacts of nodes.
   pure integer function node_contacts(problem, state) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      number = count(state%active .and. problem%candidates%contact_span(:size(state%active)) == 0)
   end function node_contacts

   !> True if a value that the deck asks for, or the end of the step, lies between the run's point and the known equilibrium of the
   !> next set.
   logical function passes_value(problem, step, run, next, smooth) result(passes)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(in) :: next           !! the other set at its known equilibrium, with its path tangent
      logical, intent(in) :: smooth !! true: the path has no corner at the run's point, so that limit points and bifurcations count,
      !! too
      type(path_state_t) :: on
      type(event_t), allocatable :: events(:)
      on = on_next_mesh(problem, run, next)
      if (smooth) then
         call detect_events(next%problem, step, on%last%test_values, new_test_values(next%problem, next%state, next%system, &
            & next%tangent%load), on%last%state, next%state, events)
      else
         call value_events(next%problem, step, on%last%test_values, new_test_values(next%problem, next%state, next%system, &
            & next%tangent%load), on%last%state, next%state, events)
      end if
      passes = size(events) > 0
   end function passes_value

   !> Replaces the run's last point, with its contact set, by the known equilibrium of another set and the path tangent there.
   subroutine replace_set(problem, run, next)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(other_set_t), intent(in) :: next           !! the other set at its known equilibrium, with its path tangent
      run = on_next_mesh(problem, run, next)
      call copy_problem(next%problem, problem)
      run%last = next%path_point_t
      call evaluate_tests(problem, run%last)
   end subroutine replace_set
end module entering_contact_set
