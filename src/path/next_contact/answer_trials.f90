!> Transfers the run to the contact set that a rule gives for a change (span_rules). If Newton's method finds no equilibrium with
!> this set, the rule is evaluated again: with more points that become lines, or with a larger distance between the two points of a
!> divided contact.
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

   !> Transfers the run to the next contact set, which a rule gives as its answer to the located change.
   subroutine take_answer(problem, run, interval, change, answer, next, on, holds, why)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run             !! the run at the place of the change
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change       !! located change, to which a rule gives the answer
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(out) :: next
      type(path_state_t), intent(out) :: on
      logical, intent(out) :: holds  !! false: a point contact divides, but a new point has a tensile contact force
      character(:), allocatable, intent(out) :: why !! reason why no equilibrium was found; not allocated: it was found
      holds = .true.
      if (change%tests(change%which)%kind == test_curvature .and. answer%between(1) /= answer%between(2)) then
         call take_divided(problem, run, interval, change, answer, next, on, holds, why)
      else
         call take_larger(problem, run, interval, change, answer, next, on, why)
      end if
   end subroutine take_answer

   !> Transfers the run from its point to one contact set, if an equilibrium with this set is found.
   subroutine try(problem, run, interval, change, answer, next, on, grows, why)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(inout) :: next
      type(path_state_t), intent(inout) :: on
      character(:), allocatable, intent(out) :: why
      logical, intent(out) :: grows              !! false: a new line contact has no positive length, see change_set
      call copy_problem(problem, next)
      call copy_path_state(run, on)
      call change_set(next, on, change%tests(change%which), change%begins, answer, least_reach(problem, interval, &
         & change%which), grows, why)
   end subroutine try

   !> Transfers the run where a point contact becomes a line contact. Another point contact, for instance the mirror image in a
   !> structure whose mesh is not symmetric, may become a line before the first line has its initial length; then no equilibrium has
   !> only one of the lines, and both begin together.
   subroutine take_larger(problem, run, interval, change, answer, next, on, why)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer
      type(problem_t), intent(inout) :: next
      type(path_state_t), intent(inout) :: on
      character(:), allocatable, intent(out) :: why
      type(answer_t) :: larger
      integer :: more, lines
      logical :: grows
      larger = answer
      more = 0
      do
         call try(problem, run, interval, change, larger, next, on, grows, why)
         if (allocated(why)) return
         if (grows .and. more > 0) grows = spans_hold(next, on%last%state, on%last%system%force_scale)
         if (grows) return
         more = more + 1
         lines = count(larger%contact_span%line)
         larger = answer_to(problem, change%point%state, change%tests, change%which, interval%before%value - interval%after%value, &
            & run%spans_begun, &
            & more)
         if (count(larger%contact_span%line) <= lines) exit
      end do
      ! The next increment may find the equilibrium.
      call try(problem, run, interval, change, answer, next, on, grows, why)
   end subroutine take_larger

   !> Divides a point contact into two points. If the rod came into contact beside an almost osculating point just before, by less
   !> than the tolerance of the relative curvature, the forces of two near points would be tensile, but those of points further
   !> apart are not.
   subroutine take_divided(problem, run, interval, change, answer, next, on, holds, why)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(answer_t), intent(in) :: answer       !! the two points have the least initial distance
      type(problem_t), intent(inout) :: next
      type(path_state_t), intent(inout) :: on
      character(:), allocatable, intent(out) :: why
      logical, intent(out) :: holds              !! false: no distance gives compressive forces; the set has the least distance
      integer, parameter :: most = 4             ! doublings of the distance; errors of the relative curvature are not larger
      type(answer_t) :: wider
      integer :: doublings
      logical :: grows
      wider = answer
      do doublings = 0, most + 1
         ! If no distance is successful, the least distance is used.
         if (doublings > most) wider = answer
         call try(problem, run, interval, change, wider, next, on, grows, why)
         holds = .not. allocated(why)
         if (holds) holds = pushes(next, on, wider%between)
         if (holds) exit
         wider = answer_to(problem, change%point%state, change%tests, change%which, interval%before%value - interval%after%value, &
            & run%spans_begun, &
            & apart=2.0_wp**(doublings + 1) * first_length)
      end do
   end subroutine take_divided

   !> True if the contact forces at all free touchdown points of the given contact spans are compressive.
   logical function pushes(problem, run, opened)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      integer, intent(in) :: opened(2)           !! numbers of contact spans
      integer :: c
      pushes = .true.
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         if (.not. problem%candidates%moves(c) .or. all(opened /= &
            & problem%contact_span(problem%candidates%contact_span(c))%number)) cycle
         pushes = pushes .and. point_force(problem, run%last%state, c) >= -test_slack(test_force) * run%last%system%force_scale
      end do
   end function pushes

   !> Path distance within which the equilibrium is searched for after a length has vanished: the arc length over which a line
   !> contact's length, or a contact's distance to a segment boundary, changes by the shortest length that a mesh resolves
   !> (contact_spans%shortest) at its mean rate on the interval, times the number of increments of extrapolation (reach_of). 0 for
   !> tests that are no lengths.
   real(wp) function least_reach(problem, interval, which) result(reach)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test
      reach = 0.0_wp
      if (all(interval%after(which)%kind /= [test_length, test_crossing])) return
      associate (before => interval%before(which), after => interval%after(which))
         reach = reach_of(interval) * path_length(problem, interval%from, interval%to%state) * shortest * &
            & problem%layout%rod_segment(after%rod_segment)%length / (problem%size * max(before%value - after%value, tiny(reach)))
      end associate
   end function least_reach
end module answer_trials
