!> Mesh of a limit curve at the ends of contact with foundations. The interface points move along the curve, and the elements beside
!> them are refined as the foundation becomes stiffer.
module limit_marks
   use kinds, only: wp
   use model, only: method_linearised
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use span_problem, only: new_span_problem, same_spans
   use span_division, only: outgrown
   use span_candidates, only: present_contact_spans
   use ground_mark, only: cut_t
   use ground_cuts, only: find_cuts, marked
   use mesh_change, only: carry_over
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: renew_marks, take_marks_off, transfer_and_solve

contains

   !> Transfers a limit point to a mesh with nodes at the present ends of foundation contact, unless its mesh already has these
   !> nodes and is fine enough beside them.
   subroutine renew_marks(base, problem, state, direction, ok)
      type(problem_t), intent(inout) :: base     !! the problem with the value of the parameter from the deck
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                 !! false: no equilibrium was found
      type(cut_t), allocatable :: cut(:)
      ok = .true.
      if (size(problem%mark) == 0) return
      cut = find_cuts(problem, state)
      if (marked(problem, state, cut)) then
         if (.not. outgrown(problem, state, cut)) return
      end if
      call transfer_and_solve(new_span_problem(problem, present_contact_spans(problem, state), state, cut), problem, state, &
         & direction, ok)
      if (ok) base = same_spans(base, problem)
   end subroutine renew_marks

   !> Transfers a limit point to a mesh without interface points, on which the ends of contact lie inside elements.
   subroutine take_marks_off(problem, state, direction, ok)
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                              !! false: no equilibrium was found
      ok = .true.
      if (size(problem%mark) == 0) return
      call transfer_and_solve(new_span_problem(problem, present_contact_spans(problem, state), state), problem, state, direction, &
         & ok)
   end subroutine take_marks_off

   !> Corrects the state to equilibrium on another mesh, in the plane normal to the path direction.
   subroutine transfer_and_solve(next, problem, state, direction, ok)
      type(problem_t), intent(in) :: next
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                              !! false: no equilibrium was found
      type(state_t) :: there
      type(system_t) :: system
      type(control_t) :: plane
      type(increment_t) :: report
      call carry_over(problem, next, state, direction)
      system = new_system(next)
      plane%method = method_linearised
      plane%tangent = direction
      plane%increment = 0.0_wp
      call copy_problem(next, problem)
      there = state
      call correct(problem, there, plane, .true., state, system, report)
      ok = report%converged
   end subroutine transfer_and_solve
end module limit_marks
