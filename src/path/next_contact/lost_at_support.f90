!> Loss of contact beside a support on the obstacle: a line contact shrinks onto the support, or a point contact returns to the
!> clamp beside which it began. The remaining span has no length by which the change could be located. The set without this span is
!> used: at its onset the rod has the curvature of the obstacle beside a clamp, or its direction beside a hinge.
module lost_at_support
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use breakpoint_forces, only: stands
   use contact_set_edits, only: lost
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_curvature, test_slope
   use contact_change_types, only: step_interval_t
   use next_spans, only: next_t, new_next, tests_of
   use set_begins, only: find_begin
   use path_state, only: path_state_t
   implicit none
   private
   public :: clamped_ends, go_into_clamp

contains

   !> (sides) true: the point contact on this side of the free span is at a clamp on the obstacle.
   function clamped_ends(problem, state, test) result(clamped)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test      !! test of the span between two point contacts
      logical :: clamped(2)
      integer :: k
      do k = 1, 2
         associate (c => problem%contact_span(test%beside(k))%candidate(1))
            clamped(k) = problem%model%fixed(3, problem%candidates%node(c)) .and. stands(problem, state, c)
         end associate
      end do
   end function clamped_ends

   !> Finds the equilibrium at which the point contact beside a span has reached the clamp on the other side of the span.
   subroutine go_into_clamp(problem, run, interval, which, next, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span, a closing bow
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      integer :: side
      associate (beside => interval%after(which)%beside)
         side = findloc(clamped_ends(problem, interval%to%state, interval%after(which)), .true., 1)
         next = new_next(problem, interval%to%state, lost(present_contact_spans(problem, interval%to%state), beside(3 - side)))
      end associate
      call lose(run, interval, next, found)
   end subroutine go_into_clamp

   !> Finds the onset of the set without the contact: the zero of the curvature or slope test at a support. Of several such tests
   !> the one nearest to zero is used.
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
      ! The load continues in its present sense.
      next%rate = 0.0_wp
   end subroutine lose
end module lost_at_support
