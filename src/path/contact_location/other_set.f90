!> Another contact set with its equilibrium. The first guess is transferred from a state of the present set; the equilibrium can be
!> found at any load factor. The run can be put on the mesh of such a set.
module other_set
   use kinds, only: wp, parallel
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use contact_spans, only: contact_span_t
   use span_problem, only: new_span_problem
   use test_kinds, only: span_test_t
   use touchdown_points, only: with_held
   use state_transfer, only: carried, carried_field
   use path_control, only: control_t, displacement_between
   use path_continuity, only: path_tangent_at
   use path_events, only: new_test_values
   use path_point, only: path_point_t, point_at, span_tests_at
   use path_state, only: path_state_t, copy_path_state, forget_mesh
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: other_set_t, copy_other_set, new_other_set, find_equilibrium, go_to_load, tests_of, on_next_mesh, &
      & is_there

   !> Point of the path with another contact set, found before the run accepts this set. Its tangent is the set's own path tangent,
   !> in the direction in which the path continues; it is not allocated at the start of a step, where nothing has been displaced
   !> yet.
   type, extends(path_point_t) :: other_set_t
      type(problem_t) :: problem
      type(increment_t) :: report = increment_t(converged=.true.)
      character(2) :: label = '  '                !! label of the point: contact gained (C+) or lost (C-)
      logical :: divides = .false.                !! a part of the lost contact remains on both sides
      integer :: times = 1                        !! number of contacts gained or lost
      integer :: test = 0                         !! index of the test that is zero at the state, 0: none
   end type other_set_t

contains

   !> Copies such a point. A procedure, because the compiler would expand the copies of all components at each assignment.
   pure subroutine copy_other_set(from, to)
      type(other_set_t), intent(in) :: from
      type(other_set_t), intent(inout) :: to
      to = from
   end subroutine copy_other_set

   !> Makes the data of another contact set, which is not in equilibrium yet.
   function new_other_set(problem, state, contact_span) result(next)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state          !! state of `problem`, the first guess
      type(contact_span_t), intent(in) :: contact_span(:) !! contact spans of the other set, with ends at the places that they have
      !! in `state`
      type(other_set_t) :: next
      next%problem = new_span_problem(problem, contact_span)
      next%state = carried(problem, state, next%problem)
      call release_held_twice(next%problem, next%state)
      next%system = new_system(next%problem)
   end function new_other_set

   !> Releases contacts of nodes with rigid obstacles if a contact span holds the node in the same direction: two rigid obstacles
   !> cannot constrain a node along one line, and the forces of both would be undetermined. A released contact that must carry a
   !> force becomes active again with the next increment.
   subroutine release_held_twice(problem, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      real(wp) :: gap, bend, normal(2), other(2)
      integer :: c, twin
      associate (list => problem%candidates)
         do c = 1, list%n
            if (.not. state%active(c) .or. list%contact_span(c) > 0) cycle
            if (.not. problem%model%obstacle(list%obstacle(c))%rigid) cycle
            call candidate_gap(problem, state, c, gap, normal, bend)
            twin = list%twin(c)
            do while (twin /= c)
               call candidate_gap(problem, state, twin, gap, other, bend)
               if (list%contact_span(twin) > 0 .and. abs(normal(1) * other(2) - normal(2) * other(1)) < parallel) then
                  state%active(c) = .false.
                  state%reaction(c) = 0.0_wp
               end if
               twin = list%twin(twin)
            end do
         end do
      end associate
   end subroutine release_held_twice

   !> Finds the equilibrium at the state's load factor: first with fixed touchdown points, because only forces in equilibrium
   !> determine the places of the touchdown points.
   subroutine find_equilibrium(next, found, plane)
      type(other_set_t), intent(inout) :: next
      logical, intent(out) :: found
      type(control_t), intent(in), optional :: plane !! plane in which the equilibrium is sought; absent: the load is held
      integer :: c
      found = .true.
      if (any(next%problem%candidates%moves)) call solve_with(with_held(next%problem, [(c, c=1, next%problem%candidates%n)]))
      if (found) call solve_with(next%problem)

   contains

      subroutine solve_with(problem)
         type(problem_t), intent(in) :: problem
         type(state_t) :: start
         type(control_t) :: here
         type(increment_t) :: report
         start = next%state
         here%method = method_load
         if (present(plane)) here = plane
         call correct(problem, start, here, .true., next%state, next%system, report, far_off=.true.)
         found = report%converged
      end subroutine solve_with
   end subroutine find_equilibrium

   !> Moves the next set to another load factor, factors its system there and runs its tests. If no equilibrium is found, the state
   !> is unchanged and `tests` is not allocated.
   subroutine go_to_load(next, load, tests)
      type(other_set_t), intent(inout) :: next
      real(wp), intent(in) :: load
      type(span_test_t), allocatable, intent(out) :: tests(:)
      type(control_t) :: control
      type(increment_t) :: report
      type(state_t) :: start
      start = next%state
      control%method = method_load
      control%increment = load - start%load_factor
      call correct(next%problem, start, control, .true., next%state, next%system, report)
      if (report%converged) call linearise(next%problem, next%state, next%state, next%system)
      if (report%converged .and. next%system%ok) then
         tests = tests_of(next)
      else
         next%state = start
      end if
   end subroutine go_to_load

   !> Tests of the other set at its equilibrium.
   function tests_of(next) result(tests)
      type(other_set_t), intent(in) :: next
      type(span_test_t), allocatable :: tests(:)
      tests = span_tests_at(next%problem, next)
   end function tests_of

   !> The run at its present point, but on the mesh of the next set, with the path tangent towards the known equilibrium of this
   !> set.
   function on_next_mesh(problem, run, next) result(on)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(in) :: next
      type(path_state_t) :: on
      type(state_t) :: state
      real(wp) :: rise
      call copy_path_state(run, on)
      on%spans_begun = max(run%spans_begun, maxval(next%problem%contact_span%number))
      call forget_mesh(on)
      ! The point need not be in equilibrium on that mesh: its tangent and test values are those of the next set's equilibrium.
      state = carried(problem, run%last%state, next%problem)
      call release_held_twice(next%problem, state)
      on%last = point_at(next%problem, state)
      associate (here => on%last)
         rise = next%state%load_factor - here%state%load_factor
         ! The chord between states on two meshes may be shorter than the difference of the meshes, so a known tangent is preferred.
         if (allocated(next%tangent%u)) then
            here%tangent = next%tangent
         else if (is_there(on, next)) then
            here%tangent = path_tangent_at(next%problem, next%system, carried_field(problem, run%last%state, &
               & run%last%tangent%u, next%problem, here%state), run%last%tangent%load)
         else
            here%tangent = path_tangent_at(next%problem, next%system, displacement_between(next%problem, here%state, next%state), &
               & rise)
         end if
         here%test_values = new_test_values(next%problem, here%state, next%system, here%tangent%load)
      end associate
   end function on_next_mesh

   !> True if the run's point and the next set's state have the same load within the rounding of a few operations: the two are one
   !> equilibrium on two meshes.
   pure logical function is_there(run, next)
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(in) :: next
      associate (load => run%last%state%load_factor)
         is_there = abs(next%state%load_factor - load) <= 8.0_wp * epsilon(load) * abs(load)
      end associate
   end function is_there
end module other_set
