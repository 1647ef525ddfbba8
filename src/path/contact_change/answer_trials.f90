!> The set of a rule's answer, and the run with it. Where no equilibrium is found with it the rule is asked once more: for others
!> that lie down with a point, or for the points of a divided one further apart.
module answer_trials
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use contact_spans, only: shortest, first_length
   use touchdown_points, only: point_force
   use test_kinds, only: test_slack, test_curvature, test_force, test_length, test_crossing
   use span_tests, only: spans_hold
   use span_answer, only: answer_t
   use span_rules, only: answer_to
   use span_set, only: change_set
   use contact_change_types, only: step_interval_t, change_t
   use reachability, only: reach_of
   use path_control, only: path_length
   use path_state, only: path_state_t, copy_path_state
   implicit none
   private
   public :: take_answer

contains

   !> The run with the set of an answer.
   subroutine take_answer(problem, run, interval, change, answer, next, on, holds)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run             !! at the change's place
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change       !! by a rule
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(out) :: next
      type(path_state_t), intent(out) :: on
      logical, intent(out) :: holds              !! false: a point divides into none that push
      holds = .true.
      if (change%tests(change%which)%kind == test_curvature .and. answer%between(1) /= answer%between(2)) then
         call take_divided(problem, run, interval, change, answer, next, on, holds)
      else
         call take_larger(problem, run, interval, change, answer, next, on)
      end if
   end subroutine take_answer

   !> One set, from where the run stands.
   subroutine try(problem, run, interval, change, answer, next, on, grows)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(inout) :: next
      type(path_state_t), intent(inout) :: on
      logical, intent(out) :: grows              !! as change_set has it
      call copy_problem(problem, next)
      call copy_path_state(run, on)
      call change_set(next, on, change%tests(change%which), change%begins, answer, least_reach(problem, interval, &
         & change%which), grows)
   end subroutine try

   !> Where a point lies down, and another does so before the line of the first has the length that it begins with, as its image at
   !> a mirror that the mesh does not know, there is none with that alone: both at once.
   subroutine take_larger(problem, run, interval, change, answer, next, on)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(inout) :: next
      type(path_state_t), intent(inout) :: on
      type(answer_t) :: larger
      integer :: more, lines
      logical :: grows
      larger = answer
      more = 0
      do
         call try(problem, run, interval, change, larger, next, on, grows)
         if (grows .and. more > 0) grows = spans_hold(next, on%state, on%system%force_scale)
         if (grows) return
         more = more + 1
         lines = count(larger%contact_span%line)
         larger = answer_to(problem, change%place, change%tests, change%which, interval%before%value - interval%after%value, &
            & run%spans_begun, &
            & more)
         if (count(larger%contact_span%line) <= lines) exit
      end do
      ! Perhaps the next increment finds it.
      call try(problem, run, interval, change, answer, next, on, grows)
   end subroutine take_larger

   !> The two points of a divided one. Where the rod comes down beside a point just before that is flat, by less than is told,
   !> points that are near would have to pull, and others further apart do not.
   subroutine take_divided(problem, run, interval, change, answer, next, on, holds)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer       !! with points as near as any begin
      type(problem_t), intent(inout) :: next
      type(path_state_t), intent(inout) :: on
      logical, intent(out) :: holds              !! false: none of them, taken are those that are as near as any
      integer, parameter :: most = 4             ! doublings of their distance: what is told is not that deep
      type(answer_t) :: wider
      integer :: doublings
      logical :: grows
      wider = answer
      do doublings = 0, most + 1
         ! Where none holds the nearest.
         if (doublings > most) wider = answer
         call try(problem, run, interval, change, wider, next, on, grows)
         holds = .not. allocated(on%stuck)
         if (holds) holds = pushes(next, on, wider%between)
         if (holds) exit
         wider = answer_to(problem, change%place, change%tests, change%which, interval%before%value - interval%after%value, &
            & run%spans_begun, &
            & apart=2.0_wp**(doublings + 1) * first_length)
      end do
   end subroutine take_divided

   !> True for points that the rod pushes, or that are none.
   logical function pushes(problem, run, opened)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      integer, intent(in) :: opened(2)           !! numbers of touches
      integer :: c
      pushes = .true.
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         if (.not. problem%candidates%moves(c) .or. all(opened /= &
            & problem%contact_span(problem%candidates%contact_span(c))%number)) cycle
         pushes = pushes .and. point_force(problem, run%state, c) >= -test_slack(test_force) * run%system%force_scale
      end do
   end function pushes

   !> How far along the path the zero of a line's length, or of the way to a breakpoint, may be from where it is taken for none: as
   !> far as the increment's chord tells, and as far as paths are followed as straight. 0: the test is another one.
   real(wp) function least_reach(problem, interval, which) result(reach)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index into the tests
      reach = 0.0_wp
      if (all(interval%after(which)%kind /= [test_length, test_crossing])) return
      associate (before => interval%before(which), after => interval%after(which))
         reach = reach_of(interval) * path_length(problem, interval%from, interval%to) * shortest * &
            & problem%layout%rod_segment(after%rod_segment)%length / (problem%size * max(before%value - after%value, tiny(reach)))
      end associate
   end function least_reach
end module answer_trials
