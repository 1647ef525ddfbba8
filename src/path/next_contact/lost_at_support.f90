!> Contact that ends beside a support which stands on the obstacle: a line that shrinks onto it, or a point that comes back to the
!> clamp it began beside. What is left has no length to tell the place by; the set without it has: there the rod beside a clamp is
!> as curved as the obstacle, beside a hinge level with it, and from there on neither is any more.
module lost_at_support
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use breakpoint_forces, only: stands
   use contact_set_edits, only: lost
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_curvature, test_slope
   use span_answer, only: answer_t
   use span_rules, only: answer_to
   use contact_change_types, only: step_interval_t
   use next_spans, only: next_t, new_next, tests_of
   use set_begins, only: find_begin
   use path_state, only: path_state_t
   implicit none
   private
   public :: clamped_ends, go_into_clamp, lose_line

contains

   !> Which points beside a span are clamps that stand on the obstacle.
   function clamped_ends(problem, state, test) result(clamped)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test      !! of the span, between two points
      logical :: clamped(2)
      integer :: k
      do k = 1, 2
         associate (c => problem%contact_span(test%beside(k))%candidate(1))
            clamped(k) = problem%model%fixed(3, problem%candidates%node(c)) .and. stands(problem, state, c)
         end associate
      end do
   end function clamped_ends

   !> The equilibrium at which the point beside a span has come to the clamp on its other side.
   subroutine go_into_clamp(problem, run, interval, which, next, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! the test of the span, a wave
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      integer :: side
      associate (beside => interval%after(which)%beside)
         side = findloc(clamped_ends(problem, interval%to, interval%after(which)), .true., 1)
         next = new_next(problem, interval%to, lost(present_contact_spans(problem, interval%to), beside(3 - side)))
      end associate
      call lose(run, interval, next, found)
   end subroutine go_into_clamp

   !> The equilibrium at which a line has shrunk onto the support at its end. Not found where it goes on beyond, or has no such end.
   subroutine lose_line(problem, run, interval, which, next, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! the test of its length
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      type(answer_t) :: answer
      found = .false.
      answer = answer_to(problem, interval%to, interval%after, which, interval%before%value - interval%after%value, run%spans_begun)
      if (answer%label /= 'C-' .or. allocated(answer%no_rule) .or. size(answer%crosses, 2) > 0) return
      next = new_next(problem, interval%to, answer%contact_span)
      call lose(run, interval, next, found)
   end subroutine lose_line

   !> Where the set without it begins to hold, by the test beside a support that is nearest to zero.
   subroutine lose(run, interval, next, found)
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(next_t), intent(inout) :: next
      logical, intent(out) :: found
      type(span_test_t), allocatable :: tests(:)
      logical, allocatable :: beside(:)
      integer :: k
      tests = tests_of(next)
      beside = tests%kind == test_curvature .or. tests%kind == test_slope
      do k = 1, size(tests)
         if (beside(k)) beside(k) = stands(next%problem, next%state, tests(k)%candidate)
      end do
      found = any(beside)
      if (.not. found) return
      next%label = 'C-'
      next%test = minloc(abs(tests%value), 1, mask=beside)
      call find_begin(run, interval, .false., next, found, next%test)
      ! The path goes on as it came.
      next%rate = 0.0_wp
   end subroutine lose
end module lost_at_support
