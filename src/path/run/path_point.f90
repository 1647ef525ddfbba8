!> A point of the path: an equilibrium with its factored equations, its path tangent and its test values.
!>
!> The corrector makes a point; if a state is known without the corrector, point_at makes it. Later procedures only read the point.
!> Procedures that need the factored equations (tangents, modes, error bars, the next increment) take them from the point, so that
!> no procedure has to restore them for its caller.
module path_point
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_control, only: control_t
   use path_continuity, only: path_tangent_t
   use path_events, only: test_values_t, new_test_values
   use corrector, only: increment_t, take_increment
   use force_free_contact, only: count_opening
   use test_kinds, only: span_test_t
   use span_tests, only: run_span_tests
   implicit none
   private
   public :: path_point_t, point_at, move_to, renew, advance, evaluate_tests, evaluate_span_tests, span_tests_at

   !> Tangent and test values of a trial point are set as soon as the direction of travel is known (path_state). The tests of
   !> contact spans at the end of an increment are used again at the start of the next one.
   type :: path_point_t
      type(state_t) :: state
      type(system_t) :: system                   !! assembled and factored at `state`
      type(path_tangent_t) :: tangent            !! path tangent at `state`, in the direction of travel
      type(test_values_t) :: test_values         !! test values at `state`
      type(span_test_t), allocatable :: span_tests(:) !! tests of the contact spans at `state`, for its own scale of forces; not
      !! allocated: unknown
   end type path_point_t

contains

   !> Point at a given state, which need not be in equilibrium: its equations are assembled and factored there (see system%ok).
   function point_at(problem, state) result(point)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(path_point_t) :: point
      point%state = state
      point%system = new_system(problem)
      call linearise(problem, point%state, point%state, point%system)
   end function point_at

   !> Moves a point to another state near it, for example to the equilibrium with another contact set. The tangent is unchanged
   !> until the direction of travel is known there.
   subroutine move_to(problem, state, point)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(path_point_t), intent(inout) :: point
      point%state = state
      call renew(problem, point)
   end subroutine move_to

   !> Assembles and factors the equations of a point anew, after its state or its problem has changed.
   subroutine renew(problem, point)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(inout) :: point
      if (allocated(point%span_tests)) deallocate (point%span_tests)
      call linearise(problem, point%state, point%state, point%system)
   end subroutine renew

   !> Makes the increment of the control from one point to another. If report%converged is false, the new point is undefined.
   subroutine advance(problem, from, control, to, report, keep_contact)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: from
      type(control_t), intent(in) :: control
      type(path_point_t), intent(out) :: to      !! the new point; its state and system are set
      type(increment_t), intent(out) :: report
      logical, intent(in), optional :: keep_contact !! true: contact set of `from`, for any signs of gaps and reactions
      to%system = from%system
      call take_increment(problem, from%state, control, to%state, to%system, report, keep_contact)
   end subroutine advance

   !> Computes the test values of a point whose state, system and tangent are known.
   subroutine evaluate_tests(problem, point)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(inout) :: point
      point%test_values = new_test_values(problem, point%state, point%system, point%tangent%load)
      call count_opening(problem, point%state, point%system, point%test_values%opening, point%test_values%weak)
   end subroutine evaluate_tests

   !> Evaluates the tests of the contact spans at a converged point, unless they are known.
   subroutine evaluate_span_tests(problem, point)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(inout) :: point
      if (.not. allocated(point%span_tests)) point%span_tests = span_tests_at(problem, point)
   end subroutine evaluate_span_tests

   !> Tests of the contact spans at a converged point, for its own scale of forces.
   function span_tests_at(problem, point) result(tests)
      type(problem_t), intent(in) :: problem
      class(path_point_t), intent(in) :: point
      type(span_test_t), allocatable :: tests(:)
      tests = run_span_tests(problem, point%state, max(point%system%force_scale, tiny(point%system%force_scale)))
   end function span_tests_at
end module path_point
