!> A free span vanishes: its gap closes everywhere, or its length becomes zero. At this point a point contact beside the span is in
!> neutral equilibrium along the rod, and no increment with the present set converges further on. The set without the span is
!> regular and is located at its onset.
!>
!> Either the whole span comes into contact (an arc under pressure, a straight rod at a wall, a remainder between two contacts); the
!> onset is at zero pressure of the new line contact. Or the span is a closing bow between two point contacts, whose relative
!> curvatures vanish with the square of their distance, and a line contact between the points would have tensile contact force; the
!> points merge into one osculating contact, the reverse of a point contact that divides.
module vanishing_span
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use contact_spans, only: contact_span_t, shortest, line_share
   use contact_set_edits, only: laid_down, merged
   use line_pressure, only: virtual_pressure
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_vanishing, test_force, test_slack, another_fails
   use past_breakpoints, only: beyond
   use span_regions, only: find_span_regions
   use contact_change_types, only: step_interval_t
   use next_spans, only: next_t, new_next, tests_of
   use set_begins, only: find_begin, small_load
   use vanished_length, only: find_vanished, clamped_ends
   use reachability, only: turns, leads_to_next, reach_of
   use osculating_contacts, only: find_osculating_contact
   use state_transfer, only: carried
   use path_control, only: path_length
   use path_continuity, only: largest_distance
   use path_state, only: path_state_t
   implicit none
   private
   public :: locate_vanishing, is_gone, closes

contains

   !> Finds the contact set without the closing free span, and its equilibrium at its onset, if the path leads there. The following
   !> sets are tried in this order; the first one that is valid within reach is taken:
   !>
   !>   two line contacts that meet at a segment boundary (find_vanished)
   !>   a line contact along the whole span (lie_down), unless contact moves past the segment boundary there (is_passage)
   !>   closing bow beside a clamp on the obstacle: the point contact reaches the clamp (find_vanished)
   !>   closing bow between two point contacts that merge (become_one)
   subroutine locate_vanishing(problem, run, interval, which, fails, next, found, wave)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span
      logical, intent(in) :: fails               !! true: another test fails at the interval's end, maybe before this one
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      logical, intent(out) :: wave               !! true: the span is a closing bow between two point contacts
      wave = .false.
      found = .false.
      if (.not. all(interval%after(which)%beside > 0)) call find_vanished(problem, interval%to%state, interval%after(which), &
         & small_load(run), next, found)
      if (found) found = holds_within_reach(problem, run, interval, fails, next)
      if (.not. found) then
         if (is_passage(problem, interval%after(which))) return
         call lie_down(problem, run, interval, which, next, found)
         if (found) found = holds_within_reach(problem, run, interval, fails, next)
      end if
      if (.not. found) wave = is_wave(problem, interval%to%state, interval%after(which))
      ! Two points with a gap between them and compressive forces on both remain two.
      if (wave .and. .not. turns(run, interval)) then
         call find_vanished(problem, interval%to%state, interval%after(which), small_load(run), next, found)
         if (.not. found) call become_one(problem, interval, which, next, found)
         if (found) found = leads_to_next(problem, run, next, interval%to%tangent%load)
         if (found) found = holds_within_reach(problem, run, interval, fails, next)
      end if
      if (.not. found .or. next%label /= '') return
      if (size(find_span_regions(next%problem, next%state)) < size(find_span_regions(problem, run%last%state))) next%label = 'C+'
   end subroutine locate_vanishing

   !> True if the next set passes its tests, lies ahead within the search distance, and does not lie behind a limit point.
   logical function holds_within_reach(problem, run, interval, fails, next) result(right)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      logical, intent(in) :: fails               !! true: another test fails at the interval's end, maybe before this one
      type(next_t), intent(in) :: next
      real(wp) :: away, whole
      away = path_length(next%problem, carried(problem, interval%to%state, next%problem), next%state)
      whole = path_length(problem, interval%from, interval%to%state)
      right = away <= reach_of(interval) * whole
      ! If no displacement is larger than rounding, the distance is measured by the load.
      if (.not. right .and. away <= rounding_gap(problem) * sqrt(sum(problem%weight))) right = abs(next%state%load_factor - &
         & interval%to%state%load_factor) <= reach_of(interval) * abs(interval%to%state%load_factor - interval%from%load_factor)
      if (right) right = .not. another_fails(tests_of(next), 0)
      associate (load => next%state%load_factor, here => run%last%state%load_factor, from => interval%from%load_factor, &
         & to => interval%to%state%load_factor)
         right = right .and. (load - here) * (to - from) >= 0.0_wp .and. &
            & (.not. fails .or. (load - here) * (load - to) <= 0.0_wp)
         if (right .and. .not. interval%stuck) right = .not. behind_turn(problem, interval, next, away, whole)
      end associate
   end function holds_within_reach

   !> True if an equilibrium with a different number of negative pivots probably lies behind a limit point. Load within the
   !> interval's range: the equilibrium is further from the interval's start than the interval's end is. Load outside this range:
   !> the equilibrium is so far from the interval's end that the load change is less than half of its rate times this distance,
   !> which is the ratio on a parabola up to its vertex.
   logical function behind_turn(problem, interval, next, away, whole) result(behind)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      type(next_t), intent(in) :: next
      real(wp), intent(in) :: away               !! path distance from the interval's end
      real(wp), intent(in) :: whole              !! path length of the interval
      behind = next%system%negative_pivots /= interval%pivots
      if (.not. behind) return
      associate (load => next%state%load_factor, from => interval%from%load_factor, to => interval%to%state%load_factor)
         if ((load - from) * (load - to) <= 0.0_wp) then
            behind = path_length(next%problem, carried(problem, interval%from, next%problem), next%state) > &
               & (1.0_wp + largest_distance) * whole
         else
            behind = away > largest_distance * whole .and. abs(load - to) < 0.5_wp * (1.0_wp - largest_distance) * &
               & abs(interval%to%tangent%load) * away
         end if
      end associate
   end function behind_turn

   !> Finds the line contact into which a free span closes, and its equilibrium at zero pressure.
   subroutine lie_down(problem, run, interval, which, next, lies)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span
      type(next_t), intent(out) :: next
      logical, intent(out) :: lies
      type(span_test_t), allocatable :: tests(:)
      type(contact_span_t), allocatable :: lying(:)
      real(wp) :: left, come
      integer :: across                          ! test of the part of the span beyond a segment boundary
      integer :: held                            ! test of a tensile contact force, 0: none
      logical :: gone
      associate (test => interval%after(which))
         left = test%value
         come = interval%before(which)%value
         gone = is_gone(problem, test)
         lying = laid_down(present_contact_spans(problem, interval%to%state), own_contacts(problem, test), test%ends)
      end associate
      across = gone_across(problem, interval, which)
      if (gone .and. across > 0) lying = laid_down(lying, own_contacts(problem, interval%after(across)), &
         & interval%after(across)%ends)
      next = new_next(problem, interval%to%state, lying)
      call find_begin(run, interval, gone, next, lies)
      if (.not. lies) return
      tests = tests_of(next)
      held = findloc(tests%kind == test_force .and. tests%value < -test_slack(test_force), .true., 1)
      if (held > 0) call find_begin(run, interval, .false., next, lies, held)
      if (.not. lies) return
      if (gone) return
      ! At a straight wall a straight line contact has no pressure at any load; then only a closed gap is evidence. Otherwise other
      ! equilibria are excluded: a gap that changed its sign was zero on the interval, and a falling gap must extrapolate linearly
      ! to the onset. A gap below zero by less than its error may close just ahead.
      associate (load => next%state%load_factor - interval%from%load_factor, &
         & whole => interval%to%state%load_factor - interval%from%load_factor)
         lies = left >= -test_slack(test_vanishing) .and. abs(load * (come - left) - whole * come) <= largest_distance * &
            & abs(whole * (come - left))
         if (left * problem%size < -rounding_gap(problem)) lies = lies .or. load * (load - whole) <= 0.0_wp
         lies = lies .and. abs(next%rate) > 0.0_wp
      end associate
   end subroutine lie_down

   !> Contacts beside a free span that are recorded in its rod segment, 0: none. A contact that is recorded in the next segment
   !> stays at their boundary.
   pure function own_contacts(problem, test) result(own)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! test of the free span
      integer :: own(2)
      own = test%beside
      where (own > 0)
         where (problem%contact_span(max(own, 1))%rod_segment /= test%rod_segment) own = 0
      end where
   end function own_contacts

   !> Index of the test of a second closed span that adjoins the span across a segment boundary without contact. 0: none.
   pure integer function gone_across(problem, interval, which) result(other)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span
      associate (tests => interval%after)
         do other = 1, size(tests)
            if (other == which .or. tests(other)%kind /= test_vanishing .or. tests(other)%contact /= tests(which)%contact) cycle
            if (open_node(tests(other)) == 0 .or. open_node(tests(other)) /= open_node(tests(which))) cycle
            if (is_gone(problem, tests(other)) .and. closes(interval, other)) return
         end do
      end associate
      other = 0

   contains

      !> Node at the end of a rod segment that is the open end of a span with one contact. 0: the span has two contacts or none.
      pure integer function open_node(test) result(node)
         type(span_test_t), intent(in) :: test
         node = 0
         if (count(test%beside > 0) /= 1) return
         if (test%beside(1) == 0) then
            node = problem%model%mesh%node(1, problem%element_first(test%rod_segment))
         else
            node = problem%model%mesh%node(2, problem%element_last(test%rod_segment))
         end if
      end function open_node
   end function gone_across

   !> True if the span has become shorter on the interval.
   pure logical function closes(interval, which)
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span
      closes = length(interval%after(which)) < length(interval%before(which))

   contains

      pure real(wp) function length(test)
         type(span_test_t), intent(in) :: test
         length = test%ends(2) - test%ends(1)
      end function length
   end function closes

   !> True if a free span has closed: its gap is zero everywhere within rounding, or its length is below the least length.
   pure logical function is_gone(problem, test) result(gone)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! test of the free span
      gone = abs(test%value) * problem%size <= rounding_gap(problem) .or. &
         & test%ends(2) - test%ends(1) < shortest * problem%layout%rod_segment(test%rod_segment)%length
   end function is_gone

   !> True if the free span is a short remainder before a segment boundary beyond which the contact beside the span can continue:
   !> the contact then passes the boundary, and the remainder does not come into contact.
   pure logical function is_passage(problem, test)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! test of the free span
      integer :: side
      side = findloc(test%beside > 0, .true., 1)
      is_passage = count(test%beside > 0) == 1 .and. test%ends(2) - test%ends(1) <= line_share * &
         & problem%layout%rod_segment(test%rod_segment)%length
      if (is_passage) is_passage = beyond(problem, test%beside(side), merge(1, -1, side == 1)) > 0
   end function is_passage

   !> True if the free span is a closing bow: it lies between two point contacts, and a line contact in it would have tensile
   !> contact force.
   logical function is_wave(problem, state, test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test      !! test of the free span
      logical :: clamped(2)
      integer :: k
      is_wave = all(test%beside > 0)
      if (is_wave) is_wave = .not. any(problem%contact_span(test%beside)%line)
      if (.not. is_wave) return
      clamped = clamped_ends(problem, state, test)
      do k = 1, 2
         associate (c => problem%contact_span(test%beside(k))%candidate(1))
            if (clamped(k)) then
               is_wave = virtual_pressure(problem, state, c, 3 - k) < 0.0_wp
            else
               is_wave = virtual_pressure(problem, state, c) < 0.0_wp
            end if
         end associate
         if (is_wave) return
      end do
   end function is_wave

   !> Finds the equilibrium at which the two point contacts beside a span merge.
   subroutine become_one(problem, interval, which, next, found)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span, a closing bow
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      integer :: k
      found = all(own_contacts(problem, interval%after(which)) > 0)
      if (.not. found) return
      associate (beside => interval%after(which)%beside)
         next = new_next(problem, interval%to%state, merged(present_contact_spans(problem, interval%to%state), beside(1), &
            & beside(2)))
         k = findloc(next%problem%contact_span%number, problem%contact_span(beside(1))%number, 1)
      end associate
      call find_osculating_contact(next%problem, next%problem%contact_span(k)%candidate(1), [integer ::], next%state, found)
      if (.not. found) return
      call linearise(next%problem, next%state, next%state, next%system)
      found = next%system%ok
   end subroutine become_one
end module vanishing_span
