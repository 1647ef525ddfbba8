!> Passage of contacts across segment boundaries of their rod: the end of a line contact, or a point contact that may not roll
!> there, arrives at a boundary and continues behind it; or a line contact that extends past a boundary shrinks and ends before it.
!> A remainder below the least length counts as zero, and the continuation on the other side starts with a larger length: the path
!> jumps over this small distance. Contacts that reach another boundary within this distance pass this boundary as well, because a
!> span below the least length would stop every increment; mirror images pass together in this way. A point contact that may roll
!> stays at the boundary until it leaves by rolling (test_leaving).
module passages
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t, shortest, line_share
   use contact_set_edits, only: lost, shrunk, end_moved, moved, continued
   use past_breakpoints, only: beyond, end_node
   use lifted_node, only: lifted_ahead
   use span_candidates, only: rolls_at
   use rod_state, only: state_t
   use test_kinds, only: span_test_t, test_length, test_crossing
   implicit none
   private
   public :: pass_breakpoints, is_turned, behind

   !> Passage of one contact across a segment boundary.
   type :: passage_t
      integer :: contact_span = 0           !! index into the set
      integer :: way = 0                    !! boundary before (-1) or after (1) the contact span
      logical :: shrinks = .false.          !! true: the part behind the boundary vanishes; `other` before it remains
      integer :: rod_segment = 0            !! segment of the continuation, 0: contact stays at the boundary
      integer :: other = 0                  !! if `shrinks`: index of the remaining contact span
      real(wp) :: left = 0.0_wp             !! distance to the boundary
      real(wp) :: least = 0.0_wp            !! distance that counts as zero
      real(wp) :: ahead = 0.0_wp            !! initial distance behind the boundary
      real(wp) :: rate = 0.0_wp             !! decrease of `left` along the path
   end type passage_t

contains

   !> Determines the contact set after the passage that belongs to a zero length or crossing test, and after other passages within
   !> the same distance.
   subroutine pass_breakpoints(problem, tests, which, fall, set, passes, passed, meets)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which                   !! index of a length or crossing test
      real(wp), intent(in) :: fall(:)                !! (tests) decrease of each along the path
      type(contact_span_t), allocatable, intent(inout) :: set(:)
      integer, allocatable, intent(out) :: passes(:, :) !! (2, passages) for each segment boundary that a contact crosses, indices
      !! of the contact spans on both sides of the free span that opens behind it; 0: that side ends at the boundary itself. The
      !! boundary crossed last comes first
      logical, intent(out) :: passed                 !! false: the test is that of a line contact that shrinks and does not continue
      logical, intent(out) :: meets                  !! another line contact arrives at the boundary from the other side
      type(passage_t) :: passage(size(tests))
      logical :: taken(size(tests))
      logical, allocatable :: gone(:)
      real(wp) :: time
      integer :: last, k
      allocate (passes(2, 0))
      passage = [(passage_of(problem, set, tests(k), fall(k)), k=1, size(tests))]
      passed = passage(which)%contact_span > 0
      meets = .false.
      if (.not. passed) return
      taken = .false.
      taken(which) = .true.
      do
         call find_last(passage, taken, last, time)
         k = findloc(.not. taken .and. passage%rod_segment > 0 .and. passage%rate > 0.0_wp .and. &
            & passage%left - passage%rate * time < passage%least, .true., 1)
         if (k == 0) exit
         taken(k) = .true.
      end do
      meets = any(taken .and. meet(passage(which), passage, set))
      if (meets) return
      gone = spread(.false., 1, size(set))
      do k = 1, size(tests)
         if (taken(k) .and. k /= last) call pass(problem, passage(k), passage(k)%rate * time - passage(k)%left, set, gone, passes)
      end do
      call pass(problem, passage(last), passage(last)%ahead, set, gone, passes)
      do k = size(gone), 1, -1
         if (.not. gone(k)) cycle
         set = lost(set, k)
         where (passes > k) passes = passes - 1
      end do
   end subroutine pass_breakpoints

   !> (passages) true: the end of another line contact arrives at the boundary of the passage `one` from the other side.
   pure function meet(one, passage, set)
      type(passage_t), intent(in) :: one, passage(:)
      type(contact_span_t), intent(in) :: set(:)
      logical :: meet(size(passage))
      integer :: k
      meet = passage%contact_span > 0 .and. .not. (one%shrinks .or. passage%shrinks) .and. passage%way == -one%way .and. &
         & one%rod_segment > 0
      do k = 1, size(passage)
         if (.not. meet(k)) cycle
         associate (a => set(one%contact_span), b => set(passage(k)%contact_span))
            meet(k) = a%line .and. b%line .and. a%contact == b%contact .and. a%rod_segment == passage(k)%rod_segment .and. &
               & b%rod_segment == one%rod_segment
         end associate
      end do
   end function meet

   !> True if the end of a line contact has reached a node on which a couple acts that lifts the rod behind the node over more than
   !> the least length of a free span.
   logical function is_turned(problem, state, test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test          !! crossing test
      integer :: way
      way = nint(test%sense)
      associate (contact_span => problem%contact_span(test%contact_span))
         is_turned = contact_span%line .and. beyond(problem, test%contact_span, way) > 0
         if (is_turned) is_turned = lifted_ahead(problem, state, contact_span%candidate(merge(1, 2, way < 0)), end_node(problem, &
            & test%contact_span, way)) > shortest * problem%layout%rod_segment(contact_span%rod_segment)%length
      end associate
   end function is_turned

   !> Finds the last of the passages `taken`, and the path parameter at which it is complete (length / decrease of the length).
   pure subroutine find_last(passage, taken, last, time)
      type(passage_t), intent(in) :: passage(:)
      logical, intent(in) :: taken(:)
      integer, intent(out) :: last
      real(wp), intent(out) :: time
      real(wp) :: times(size(passage))
      times = 0.0_wp
      where (passage%rate > 0.0_wp) times = (passage%left + passage%ahead) / passage%rate
      last = maxloc(times, 1, mask=taken)
      time = times(last)
   end subroutine find_last

   !> Passage to which a test belongs; contact_span = 0: none.
   pure type(passage_t) function passage_of(problem, set, test, fall) result(passage)
      type(problem_t), intent(in) :: problem
      type(contact_span_t), intent(in) :: set(:)
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: fall
      integer :: k, way, next, rod_segment
      real(wp) :: whole
      k = test%contact_span
      if (test%kind == test_crossing) then
         passage = passage_t(contact_span=k, way=nint(test%sense), rod_segment=beyond(problem, k, nint(test%sense)))
         ! A point that may roll leaves the boundary by rolling, or never, for instance at a point load.
         if (.not. set(k)%line .and. rolls_at(problem, set(k)%contact, set(k)%rod_segment, merge(1, 2, passage%way < 0))) &
            & passage%rod_segment = 0
      else if (test%kind == test_length) then
         whole = problem%layout%rod_segment(set(k)%rod_segment)%length
         do way = -1, 1, 2
            rod_segment = beyond(problem, k, way)
            if (rod_segment == 0) cycle
            if (abs(set(k)%at(merge(1, 2, way < 0)) - merge(0.0_wp, whole, way < 0)) > 0.0_wp) cycle
            next = findloc(set%line .and. set%rod_segment == rod_segment .and. set%contact == set(k)%contact .and. &
               & abs(set%at(merge(2, 1, way < 0)) - merge(problem%layout%rod_segment(rod_segment)%length, 0.0_wp, way < 0)) <= &
               & 0.0_wp, &
               & .true., 1)
            if (next == 0) cycle
            passage = passage_t(contact_span=k, way=way, shrinks=.true., rod_segment=rod_segment, other=next)
            exit
         end do
      end if
      if (passage%contact_span == 0) return
      passage%least = shortest * problem%layout%rod_segment(set(k)%rod_segment)%length
      passage%left = test%value * problem%size + passage%least
      if (passage%rod_segment > 0) passage%ahead = line_share * problem%layout%rod_segment(passage%rod_segment)%length
      passage%rate = fall * problem%size
   end function passage_of

   !> Changes the contact set by one passage.
   subroutine pass(problem, passage, to, set, gone, passes)
      type(problem_t), intent(in) :: problem
      type(passage_t), intent(in) :: passage
      real(wp), intent(in) :: to                     !! distance behind the boundary
      type(contact_span_t), allocatable, intent(inout) :: set(:)
      logical, allocatable, intent(inout) :: gone(:) !! contact spans that have vanished
      integer, allocatable, intent(inout) :: passes(:, :)
      integer :: side, k
      real(wp) :: at(2), end
      k = passage%contact_span
      side = merge(1, 2, passage%way < 0)
      at = 0.0_wp
      if (passage%rod_segment > 0) at = behind(problem, passage%rod_segment, passage%way, to, .not. passage%shrinks .and. &
         & set(k)%line)
      if (passage%shrinks) then
         if (gone(passage%other)) return
         associate (other => set(passage%other))
            end = other%at(3 - side)
            if (abs(at(1) - end) >= abs(other%at(side) - end)) then
               ! The contact has no length left on either side of the boundary; a point contact remains there.
               set = shrunk(set, passage%other, end)
            else
               set = end_moved(set, passage%other, 3 - side, at(1))
               call add(merge([passage%other, 0], [0, passage%other], side == 1))
            end if
         end associate
         gone(k) = .true.
         return
      end if
      associate (whole => problem%layout%rod_segment(set(k)%rod_segment)%length)
         end = merge(0.0_wp, whole, passage%way < 0)
      end associate
      if (passage%rod_segment == 0) then
         set = end_moved(set, k, side, end)
      else if (set(k)%line) then
         set = end_moved(set, k, side, end)
         set = continued(set, k, passage%rod_segment, at)
         gone = [gone, .false.]
         call add(merge([0, size(set)], [size(set), 0], side == 1))
      else
         set = moved(set, k, passage%rod_segment, at)
         call add([0, k])
      end if

   contains

      !> Puts a free span at the front of the list `passes`.
      subroutine add(between)
         integer, intent(in) :: between(2)
         passes = reshape([between, passes], [2, size(passes, 2) + 1])
      end subroutine add
   end subroutine pass

   !> Position behind a boundary on a rod segment: a line contact from the boundary on, or a point contact.
   pure function behind(problem, rod_segment, way, length, line) result(at)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: rod_segment
      integer, intent(in) :: way                     !! -1: before the boundary, 1: after it
      real(wp), intent(in) :: length                 !! length of the line, or distance of the point
      logical, intent(in) :: line
      real(wp) :: at(2)
      at = length
      if (line) at(1) = 0.0_wp
      if (way < 0) at = problem%layout%rod_segment(rod_segment)%length - at([2, 1])
   end function behind
end module passages
