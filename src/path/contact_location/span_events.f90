!> First change of the contact spans on an increment: the first zero of a test, a quantity that is not negative while the contact
!> set is valid.
module span_events
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, rounding_gap
   use free_span_gap, only: gap_at
   use test_kinds, only: any_crosses, crosses, another_fails, test_slack, test_gap, test_curvature, test_vanishing
   use contact_change_types, only: step_interval_t, change_t, change_none, change_missed, change_located, place_here
   use span_location, only: locate_test_zero, locate_osculation
   use span_tests, only: gaps_as_low
   use simultaneous_tests, only: zero_tests
   use beginning_place, only: complete_beginning
   use step_control, only: largest_growth
   use reachability, only: turns
   use path_state, only: path_state_t
   implicit none
   private
   public :: find_change

contains

   !> Finds the first contact change on an increment or just beyond its end: its kind, its place, all tests that are zero there and,
   !> where a gap closes, the contact that begins.
   subroutine find_change(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(inout) :: interval      !! out: ends at a located change if another test fails before it
      type(change_t), intent(out) :: change
      call find_first(problem, step, run, interval, change)
      if (change%kind /= change_located) return
      change%zero = [change%tests(change%which)]
      if (change%zero(1)%kind == test_gap) change%zero = [change%zero, gaps_as_low(problem, change%point%state, change%tests, &
         & change%which)]
      change%zero = zero_tests(problem, change%tests, change%which, interval%after%value < interval%before%value, change%zero)
      if (change%zero(1)%kind == test_gap) call complete_beginning(problem, step, run, interval, change)
   end subroutine find_change

   !> Finds the first contact change and its place. If another test already fails at the place of a located change, this test was
   !> zero earlier, and its zero is located next.
   subroutine find_first(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(inout) :: interval      !! out: ends at a located change if another test fails before it
      type(change_t), intent(out) :: change
      integer :: round
      logical :: fails
      change%tests = interval%after
      fails = any_crosses(interval%before, interval%after)
      if (.not. (fails .or. turns(run, interval))) call find_osculation_ahead(problem, run, interval, change)
      do round = 0, size(interval%after)
         if (fails) then
            call correct_gaps_before(problem, interval)
            change%which = steepest(interval)
            call locate_test_zero(problem, step, run, interval, change)
         end if
         if (change%kind /= change_located .or. change%where == place_here) return
         fails = another_fails(change%tests, change%which)
         if (.not. fails) return
         interval%to = change%point
         interval%after = change%tests
         ! The located test counts as exactly zero at the located place.
         interval%after(change%which)%value = 0.0_wp
      end do
      change%kind = change_missed
   end subroutine find_first

   !> Looks for a point contact that is about to osculate, that is, to have the curvature of its obstacle: increments may not
   !> converge there.
   subroutine find_osculation_ahead(problem, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(inout) :: change
      integer :: k
      logical :: found
      do k = 1, size(interval%after)
         associate (before => interval%before(k), after => interval%after(k))
            if (after%kind /= test_curvature) cycle
            if (.not. problem%candidates%rolls(after%candidate)) cycle
            ! Beside a free span that has closed, the place of a point contact is undetermined.
            if (any(interval%after%kind == test_vanishing .and. interval%after%value * problem%size <= rounding_gap(problem) .and. &
               & (interval%after%beside(1) == after%contact_span .or. interval%after%beside(2) == after%contact_span))) cycle
            if (after%value <= 0.0_wp .or. after%value > largest_growth * (before%value - after%value)) cycle
         end associate
         change%which = k
         call locate_osculation(problem, run, interval, change, found)
         if (found) exit
      end do
      if (change%kind == change_located) then
         if (another_fails(change%tests, k)) change%kind = change_none
      end if
   end subroutine find_osculation_ahead

   !> Corrects gap tests at the beginning of an increment. A free span that penetrates at the end may have had its least gap
   !> elsewhere at the beginning, for instance where it just opened; no contact begins at that place. The gap at the place of the
   !> later penetration is then used for the beginning, too.
   subroutine correct_gaps_before(problem, interval)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(inout) :: interval
      integer :: k
      do k = 1, size(interval%after)
         associate (before => interval%before(k), after => interval%after(k))
            if (after%kind /= test_gap .or. after%value >= -test_slack(test_gap)) cycle
            if (gap_at(problem, interval%to%state, before%contact, before%rod_segment, before%at) <= 0.0_wp) cycle
            before%value = gap_at(problem, interval%from, after%contact, after%rod_segment, after%at) / problem%size
            before%at = after%at
         end associate
      end do
   end subroutine correct_gaps_before

   !> Failing test with the earliest zero by linear interpolation between the ends of the increment; 0: no test fails.
   pure integer function steepest(interval) result(first)
      type(step_interval_t), intent(in) :: interval
      real(wp) :: at, least
      integer :: k
      first = 0
      least = 1.0_wp
      do k = 1, size(interval%after)
         if (.not. crosses(interval%before(k), interval%after(k))) cycle
         associate (before => max(interval%before(k)%value, 0.0_wp), fall => interval%before(k)%value - interval%after(k)%value)
            at = before / max(fall, tiny(fall))
         end associate
         if (first > 0 .and. at >= least) cycle
         first = k
         least = at
      end do
   end function steepest
end module span_events
