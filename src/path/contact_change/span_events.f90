!> Where along an increment its contact spans first fail: the first zero of a test function.
module span_events
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, rounding_gap
   use free_span_gap, only: gap_at
   use test_kinds, only: any_crosses, crosses, another_fails, test_slack, test_gap, test_curvature, test_vanishing, test_slope, &
      & test_length
   use contact_change_types, only: step_interval_t, change_t, change_none, change_missed, change_by_rule, change_vanishing, &
      & place_here, &
      & place_ahead
   use next_spans, only: next_t, copy_next
   use span_location, only: locate, locate_flat_point
   use predicted_contact_set, only: look_beyond
   use reachability, only: turns, reach_of
   use vanishing_span, only: locate_vanishing, locate_lost_line, is_gone, closes
   use path_state, only: path_state_t
   implicit none
   private
   public :: find_change

contains

   !> The first change on an increment, or just beyond its end, what kind it is, and what is known of it with the next set only.
   subroutine find_change(problem, step, run, leg, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run           !! its system is factored at the place where one is located
      type(step_interval_t), intent(inout) :: leg           !! shorter on return where one is found that others come after
      type(change_t), intent(out) :: change
      call find_first(problem, step, run, leg, change)
      if (change%kind == change_by_rule) call look_beyond(problem, step, run, leg, change)
   end subroutine find_change

   !> The first change, and its place: where another test fails at the place of one, that comes before, on the way there. A free
   !> span that vanishes comes first: such tests as fail at the same place do so because of it.
   subroutine find_first(problem, step, run, leg, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run           !! its system is factored at the place where one is located
      type(step_interval_t), intent(inout) :: leg           !! shorter on return where one is found that others come after
      type(change_t), intent(out) :: change
      type(step_interval_t) :: near
      integer :: round
      logical :: fails
      associate (since => run%since_change)
         since%arrives = since%arrives .and. any(leg%before%kind == test_curvature .and. leg%before%value <= 0.0_wp)
         call excuse_arriving_points(leg, since%arrives, since%rises)
      end associate
      change%tests = leg%after
      near = leg
      fails = any_crosses(leg%before, leg%after)
      do round = 0, size(leg%after)
         call find_vanishing(problem, run, near, fails, change)
         if (any(change%kind == [change_vanishing, change_missed])) return
         if (fails) then
            call tell_places_apart(problem, leg)
            change%which = steepest(leg)
            call locate(problem, step, run, leg, change)
         else if (round == 0 .and. .not. turns(run, leg)) then
            call look_ahead(problem, run, leg, change)
            if (change%kind == change_none) return
         else
            return
         end if
         if (change%kind == change_missed .or. change%where == place_here) return
         near%to = change%place
         near%ahead = change%heading
         near%after = change%tests
         ! This one is zero there.
         near%after(change%which)%value = 0.0_wp
         fails = another_fails(change%tests, change%which)
         if (fails) leg = near
      end do
      change%kind = change_missed
   end subroutine find_first

   !> A point that rolls to the end of a rod is held there as soon as the span beyond is as short as none: until it really is there
   !> the rod still turns in, from a slope just below zero. What a line has shrunk to, and a point that has come to a breakpoint,
   !> are as curved as the obstacle at first; on another mesh, or as long as a span is left, they may be a little more.
   pure subroutine excuse_arriving_points(leg, arrives, rises)
      type(step_interval_t), intent(inout) :: leg
      logical, intent(in) :: arrives, rises       !! see path_state_t
      integer :: k
      do k = 1, size(leg%after)
         associate (before => leg%before(k), after => leg%after(k))
            if (.not. (after%kind == test_slope .or. arrives .and. after%kind == test_curvature)) cycle
            ! On a new mesh the first point is not in balance, and its value a guess.
            if (before%value <= 0.0_wp .and. (after%value > before%value .or. after%kind == test_curvature .and. rises)) &
               & after%value = max(after%value, 0.0_wp)
         end associate
      end do
   end subroutine excuse_arriving_points

   !> A free span that vanishes on the way to the end of an increment, or just beyond, where no increment may get; and a line that
   !> shrinks onto a support.
   subroutine find_vanishing(problem, run, leg, fails, change)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: leg
      logical, intent(in) :: fails                !! another test does at its end, and may come first
      type(change_t), intent(inout) :: change     !! as it was where none is found
      type(next_t) :: next
      integer :: k
      logical :: found, wave
      do k = 1, size(leg%after)
         if (leg%after(k)%kind == test_length .and. leg%after(k)%value < 0.0_wp) then
            call locate_lost_line(problem, run, leg, k, next, found)
            if (found) exit
         end if
         if (leg%after(k)%kind /= test_vanishing) cycle
         ! Of a gap that is gone rounding is left.
         if (leg%after(k)%value > reach_of(leg) * (leg%before(k)%value - leg%after(k)%value) .and. .not. &
            & (is_gone(problem, leg%after(k)) .and. closes(leg, k))) cycle
         call locate_vanishing(problem, run, leg, k, fails, next, found, wave)
         if (found) exit
         if (wave .and. abs(leg%after(k)%value) <= test_slack(test_gap)) call withdraw_flat_point(change)
      end do
      if (k > size(leg%after)) return
      change%kind = change_vanishing
      change%which = k
      call copy_next(next, change%next)
   end subroutine find_vanishing

   !> What looks like the place where one of two points is as curved as its obstacle is that where they are one: it is none.
   pure subroutine withdraw_flat_point(change)
      type(change_t), intent(inout) :: change
      if (change%kind /= change_by_rule) return
      if (change%tests(change%which)%kind /= test_curvature) return
      change%kind = merge(change_none, change_missed, change%where == place_ahead)
   end subroutine withdraw_flat_point

   !> A point contact that is about to become as curved as its obstacle: no increment may get there.
   subroutine look_ahead(problem, run, leg, change)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: leg
      type(change_t), intent(inout) :: change
      integer :: k
      logical :: found
      do k = 1, size(leg%after)
         associate (before => leg%before(k), after => leg%after(k))
            if (after%kind /= test_curvature) cycle
            if (.not. problem%candidates%rolls(after%candidate)) cycle
            ! Beside a span that is gone its place is neutral.
            if (any(leg%after%kind == test_vanishing .and. leg%after%value * problem%size <= rounding_gap(problem) .and. &
               & (leg%after%beside(1) == after%touch .or. leg%after%beside(2) == after%touch))) cycle
            if (after%value <= 0.0_wp .or. after%value > reach_of(leg) * (before%value - after%value)) cycle
         end associate
         change%which = k
         call locate_flat_point(problem, run, leg, change, found)
         if (found) exit
      end do
      if (change%kind == change_by_rule) then
         if (another_fails(change%tests, k)) change%kind = change_none
      end if
   end subroutine look_ahead

   !> A span that is inside at the end may have been nearest somewhere else at the beginning, as where it has just left: where it
   !> leaves the obstacle nothing begins, and what counts is the gap at the place where it comes down.
   subroutine tell_places_apart(problem, leg)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(inout) :: leg
      integer :: k
      do k = 1, size(leg%after)
         associate (before => leg%before(k), after => leg%after(k))
            if (after%kind /= test_gap .or. after%value >= -test_slack(test_gap)) cycle
            if (gap_at(problem, leg%to, before%contact, before%stretch, before%at) <= 0.0_wp) cycle
            before%value = gap_at(problem, leg%from, after%contact, after%stretch, after%at) / problem%size
         end associate
      end do
   end subroutine tell_places_apart

   !> Of the tests that fail on a leg the one that a straight line between its ends has at zero first. 0: none fails.
   pure integer function steepest(leg) result(first)
      type(step_interval_t), intent(in) :: leg
      real(wp) :: at, least
      integer :: k
      first = 0
      least = 1.0_wp
      do k = 1, size(leg%after)
         if (.not. crosses(leg%before(k), leg%after(k))) cycle
         associate (before => max(leg%before(k)%value, 0.0_wp), fall => leg%before(k)%value - leg%after(k)%value)
            at = before / max(fall, tiny(fall))
         end associate
         if (first > 0 .and. at >= least) cycle
         first = k
         least = at
      end do
   end function steepest
end module span_events
