!> Whether a set of contact spans is the right one for a state.
module span_validity
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use span_tests, only: span_test_t, run_span_tests, test_slack, well_below
   implicit none
   private
   public :: spans_hold, any_fails, another_fails

contains

   !> True for a converged state whose contact spans are the right ones.
   logical function spans_hold(problem, state, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale              !! of forces
      spans_hold = .not. any_fails(run_span_tests(problem, state, max(scale, tiny(scale))))
   end function spans_hold

   !> True where some test is below zero by more than it errs by.
   pure logical function any_fails(tests)
      type(span_test_t), intent(in) :: tests(:)
      any_fails = .not. all(tests%value >= -test_slack(tests%kind))
   end function any_fails

   !> True where a test other than the one that is zero is well below.
   pure logical function another_fails(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which               !! index of the one that is
      integer :: k
      another_fails = any(tests%value < -well_below * test_slack(tests%kind) .and. [(k, k=1, size(tests))] /= which)
   end function another_fails
end module span_validity
