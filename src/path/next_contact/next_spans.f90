!> Another set of contact spans and its equilibrium: made from a state of the set before, brought to balance, at one load factor or
!> another.
module next_spans
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use contact_spans, only: contact_span_t
   use span_problem, only: new_span_problem
   use test_kinds, only: span_test_t, any_fails
   use span_tests, only: run_span_tests
   use touchdown_points, only: with_held
   use state_transfer, only: carried
   use path_control, only: control_t
   use path_continuity, only: path_tangent_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: next_t, copy_next, new_next, settle, go_to_load, tests_of, holds

   !> The equilibrium with another set, known before the run goes there: its next point.
   type :: next_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(system_t) :: system                    !! factored there
      type(path_tangent_t) :: heading                  !! of the path that arrives there; without displacements: the run's own way
      real(wp) :: rate = 0.0_wp                   !! of a line that has lain down: of its least pressure, per unit of load factor;
      !! 0: the path goes on as it came
      type(increment_t) :: report = increment_t(converged=.true.)
      character(2) :: label = '  '                !! what is told there: contact gained or lost
      logical :: divides = .false.                !! of the contact that is lost a part stays on both sides
      integer :: times = 1                        !! so often
      integer :: test = 0                         !! which of its tests is zero there, 0: none
      logical :: located = .true.                 !! false: somewhere between the run's point and this one
   end type next_t

contains

   !> What is ahead, copied out of line as copy_problem does.
   pure subroutine copy_next(from, to)
      type(next_t), intent(in) :: from
      type(next_t), intent(inout) :: to
      to = from
   end subroutine copy_next

   !> Another set of touches, not in equilibrium yet.
   function new_next(problem, state, touch) result(next)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state          !! of `problem`: a guess
      type(contact_span_t), intent(in) :: touch(:)       !! as they are on it
      type(next_t) :: next
      next%problem = new_span_problem(problem, touch)
      next%state = carried(problem, state, next%problem)
      next%system = new_system(next%problem)
   end function new_next

   !> Its equilibrium at the load factor where it is: first with touchdown points held, for they move where forces in equilibrium
   !> tell them to.
   subroutine settle(next, found)
      type(next_t), intent(inout) :: next
      logical, intent(out) :: found
      integer :: c
      call stay(with_held(next%problem, [(c, c=1, next%problem%candidates%n)]))
      if (found) call stay(next%problem)

   contains

      subroutine stay(problem)
         type(problem_t), intent(in) :: problem
         type(state_t) :: start
         type(control_t) :: here
         type(increment_t) :: report
         start = next%state
         here%method = method_load
         call correct(problem, start, here, .true., next%state, next%system, report, far_off=.true.)
         found = report%converged
      end subroutine stay
   end subroutine settle

   !> The next set at another load factor, and its tests there. Its state stays where there is no equilibrium: no tests.
   subroutine go_to_load(next, load, tests)
      type(next_t), intent(inout) :: next
      real(wp), intent(in) :: load
      type(span_test_t), allocatable, intent(out) :: tests(:)
      type(control_t) :: control
      type(increment_t) :: report
      type(state_t) :: start
      start = next%state
      control%method = method_load
      control%increment = load - start%load_factor
      call correct(next%problem, start, control, .true., next%state, next%system, report)
      if (report%converged) then
         tests = tests_of(next)
      else
         next%state = start
      end if
   end subroutine go_to_load

   !> What must hold for the set, at its equilibrium.
   function tests_of(next) result(tests)
      type(next_t), intent(in) :: next
      type(span_test_t), allocatable :: tests(:)
      tests = run_span_tests(next%problem, next%state, max(next%system%force_scale, tiny(1.0_wp)))
   end function tests_of

   !> True where all of it does.
   logical function holds(next)
      type(next_t), intent(in) :: next
      holds = .not. any_fails(tests_of(next))
   end function holds
end module next_spans
