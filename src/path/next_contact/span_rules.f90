!> Rules for the contact set that follows where a line contact has no length left, or a contact arrives at a segment boundary. Line
!> contacts that lift off and free spans that close are located with the next set itself: span_opening, vanishing_span. For all
!> other changes neighbours of the present set are solved (contact_trials).
module span_rules
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t, line_share, shortest
   use contact_set_edits, only: numbered
   use passages, only: pass_breakpoints, is_turned
   use test_kinds, only: span_test_t, test_words, test_gap, test_force, test_length, test_crossing, test_slack
   use breakpoint_forces, only: stands
   use span_candidates, only: present_contact_spans
   use touchdown_points, only: point_force
   use span_answer, only: answer_t, numbers, segment_length
   implicit none
   private
   public :: answer_to, beginning_together, coming_next, zero_too, lies_elsewhere

contains

   !> Next contact set for a test that is zero, by the rule for this kind of test.
   function answer_to(problem, state, tests, which, fall, last) result(answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: tests(:)   !! tests of this state
      integer, intent(in) :: which                !! index of the zero test
      real(wp), intent(in) :: fall(:)             !! (tests) decrease of each along the path
      integer, intent(in) :: last                 !! last number given to a contact span
      type(answer_t) :: answer
      type(span_test_t) :: test
      logical :: passed, meets
      integer :: k
      test = tests(which)
      answer%contact_span = present_contact_spans(problem, state)
      allocate (answer%crosses(2, 0))
      select case (test%kind)
      case (test_gap)
         answer%label = 'C+'
         answer%no_rule = trim(test_words(test%kind))
         if (lies_elsewhere(answer%contact_span, test)) answer%no_rule = 'no contact set leads on from '// &
            & 'where the rod lies on one obstacle and meets '// &
            & trim(problem%model%obstacle(problem%model%contact(test%contact)%obstacle)%name)//', which may hold it fast'
      case (test_force)
         if (.not. problem%contact_span(test%contact_span)%line) answer%label = 'C-'
         answer%no_rule = trim(test_words(test%kind))
      case (test_length)
         associate (ends => problem%contact_span(test%contact_span)%candidate)
            if (stands(problem, state, ends(1)) .or. stands(problem, state, ends(2))) answer%label = 'C-'
         end associate
         call pass_breakpoints(problem, tests, which, fall, answer%contact_span, answer%crosses, passed, meets)
         if (.not. passed) call shrink_lines(problem, state, tests, which, fall, answer)
      case (test_crossing)
         call pass_breakpoints(problem, tests, which, fall, answer%contact_span, answer%crosses, passed, meets)
         if (meets) then
            ! The change is located with the next set (vanishing_span).
            answer%no_rule = 'two lines of contact meet at a breakpoint of the rod'
         else if (is_turned(problem, state, test)) then
            answer%no_rule = 'contact comes to a node that a couple turns'
         end if
      case default
         ! Line contacts that lift off, and spans that close, are located with the next set (predicted_contact_set, vanishing_span);
         ! otherwise trials give the next set.
         answer%no_rule = trim(test_words(test%kind))
      end select
      answer%contact_span = numbered(answer%contact_span, last)
      do k = 1, size(answer%crosses, 2)
         answer%crosses(:, k) = numbers(answer%contact_span, answer%crosses(:, k))
      end do
   end function answer_to

   !> Indices of gaps that close at the same point of the path, for instance those of mirror images: the gap of the test comes last.
   pure function beginning_together(problem, tests, which, falling) result(begins)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical, intent(in) :: falling(:)            !! (tests)
      integer, allocatable :: begins(:)
      logical :: closed(size(tests))
      integer :: k, i
      begins = [which]
      closed = tests%kind == test_gap .and. falling .and. at_zero(tests, which)
      closed(which) = .false.
      do k = 1, size(tests)
         if (.not. closed(k)) cycle
         if (any([(one_contact(problem, tests(begins(i)), tests(k)), i=1, size(begins))])) cycle
         begins = [k, begins]
      end do
   end function beginning_together

   !> Tests that become zero soon after a located change, because another contact begins or ends there.
   pure function coming_next(tests, which, fall, reach) result(next)
      type(span_test_t), intent(in) :: tests(:)    !! tests at the change's place
      integer, intent(in) :: which                 !! index of the zero test
      real(wp), intent(in) :: fall(:)              !! (tests) decrease of each over an increment
      real(wp), intent(in) :: reach                !! search distance as a share of the increment
      integer, allocatable :: next(:)
      integer :: k
      next = pack([(k, k=1, size(tests))], (tests%kind == test_gap .or. tests%kind == test_force) .and. fall > 0.0_wp .and. &
         & .not. at_zero(tests, which) .and. tests%value <= reach * fall)
   end function coming_next

   !> True if the place of a gap is on a line contact with another obstacle.
   pure logical function lies_elsewhere(now, test)
      type(contact_span_t), intent(in) :: now(:)  !! the present contact spans
      type(span_test_t), intent(in) :: test
      lies_elsewhere = any(now%line .and. now%rod_segment == test%rod_segment .and. now%at(1) <= test%at .and. &
         & now%at(2) >= test%at)
   end function lies_elsewhere

   !> True if two gap tests belong to one contact: both gaps close at the same place, or at the same segment boundary from its two
   !> sides.
   pure logical function one_contact(problem, a, b)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: a, b
      integer :: i, j
      one_contact = .false.
      if (a%contact /= b%contact) return
      one_contact = a%rod_segment == b%rod_segment .and. abs(a%at - b%at) <= line_share * &
         & problem%layout%rod_segment(a%rod_segment)%length
      associate (first => problem%layout%rod_segment(a%rod_segment), second => problem%layout%rod_segment(b%rod_segment))
         do i = 1, 2
            do j = 1, 2
               if (first%node(i) /= second%node(j)) cycle
               one_contact = one_contact .or. abs(a%at - merge(0.0_wp, first%length, i == 1)) <= line_share * first%length .and. &
                  & abs(b%at - merge(0.0_wp, second%length, j == 1)) <= line_share * second%length
            end do
         end do
      end associate
   end function one_contact

   !> Other tests that are zero at the same point of the path as the located one.
   pure function zero_too(tests, which, falling) result(others)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical, intent(in) :: falling(:)            !! (tests) the test decreases along the path
      type(span_test_t), allocatable :: others(:)
      logical :: zero(size(tests))
      zero = falling .and. at_zero(tests, which)
      zero(which) = .false.
      others = pack(tests, zero)
   end function zero_too

   !> (tests) true: the test is zero at the same point of the path as the located one. The located test is accurate to its own value
   !> there, the others to a few times this value.
   pure function at_zero(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical :: at_zero(size(tests))
      at_zero = tests%value <= max(test_slack(tests%kind), 10.0_wp * abs(tests(which)%value))
   end function at_zero

   !> Replaces the line contact of a test by its remainder, and other line contacts that reach the least length at the same point of
   !> the path, for instance mirror images.
   subroutine shrink_lines(problem, state, tests, which, fall, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      real(wp), intent(in) :: fall(:)              !! (tests) decrease of each along the path
      type(answer_t), intent(inout) :: answer
      logical :: gone(size(answer%contact_span))
      real(wp) :: left
      integer :: k
      gone = .false.
      left = shortest * segment_length(problem, answer%contact_span(tests(which)%contact_span)) / problem%size
      do k = 1, size(tests)
         if (tests(k)%kind /= test_length) cycle
         if (k /= which .and. .not. (fall(k) > 0.0_wp .and. tests(k)%value * fall(which) <= left * fall(k))) cycle
         call shrink(problem, state, tests(k)%contact_span, answer%contact_span(tests(k)%contact_span), gone(tests(k)%contact_span))
      end do
      answer%contact_span = pack(answer%contact_span, .not. gone)
   end subroutine shrink_lines

   !> Replaces a line contact below the least length by its remainder: a point contact at the centre of its end forces, or nothing.
   subroutine shrink(problem, state, k, line, gone)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: k                     !! index into problem%contact_span
      type(contact_span_t), intent(inout) :: line         !! the line contact
      logical, intent(out) :: gone                 !! true: other contacts have its ends
      real(wp) :: push(2), whole
      integer :: side
      gone = any(others_touch(problem, k))
      if (gone) return
      line%line = .false.
      whole = segment_length(problem, line)
      if (line%at(1) <= 0.0_wp) then
         line%at = 0.0_wp
      else if (line%at(2) >= whole) then
         line%at = whole
      else
         do side = 1, 2
            push(side) = max(point_force(problem, state, line%candidate(side)), tiny(whole))
         end do
         line%at = dot_product(push, line%at) / sum(push)
      end if
   end subroutine shrink

   !> (ends) true: the end of a contact span is also an end of another contact span.
   pure function others_touch(problem, k) result(shared)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k                     !! index into problem%contact_span
      logical :: shared(2)
      integer :: j, side
      shared = .false.
      do j = 1, size(problem%contact_span)
         if (j == k) cycle
         do side = 1, 2
            shared(side) = shared(side) .or. any(problem%contact_span(j)%candidate == problem%contact_span(k)%candidate(side))
         end do
      end do
   end function others_touch

end module span_rules
