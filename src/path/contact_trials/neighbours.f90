!> Neighbours of a contact set: the sets that differ from it by one edit at a place where a test of the set fails.
!>
!> The kind of the failing test gives the order of the edits, and the zone in which the test fails gives first lengths. Only the
!> tests at a neighbour's equilibrium decide whether the neighbour is valid (contact_trials), not the signs of contact forces or the
!> sense of the path. An edit also states which ends of contacts have prescribed places, so that the new contact or free span has a
!> prescribed length (set_trial). Sets are in coordinates along strips, which are sequences of rod segments (rod_strips).
module neighbours
   use kinds, only: wp
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: same_set, begun, lost, spread_out, parted, shrunk, laid_down, merged, end_moved, extended, opened
   use test_kinds, only: test_gap, test_leaving
   use rod_strips, only: strip_t, brought_near
   implicit none
   private
   public :: edit_place_t, neighbour_t, neighbours_at, may_close_span, no_test
   public :: edit_remove, edit_add, edit_spread, edit_part, edit_leave, edit_shrink, edit_ends, edit_open, edit_end_off, &
      & edit_lie_down, edit_merge, edit_pass, edit_jump, edit_rise, edit_change, edit_arrive

   ! Edits.
   integer, parameter :: edit_remove = 1     !! a contact ends
   integer, parameter :: edit_add = 2        !! a point contact begins
   integer, parameter :: edit_spread = 3     !! a point contact becomes a line contact
   integer, parameter :: edit_part = 4       !! a point contact becomes two point contacts
   integer, parameter :: edit_leave = 5 !! a point contact leaves the end of a rod or a segment boundary, or another point contact
   !! begins beside it
   integer, parameter :: edit_shrink = 6     !! a line contact becomes a point contact
   integer, parameter :: edit_ends = 7       !! point contacts at the ends of a line contact remain
   integer, parameter :: edit_open = 8       !! a free span opens inside a line contact
   integer, parameter :: edit_end_off = 9    !! the end of a line contact moves back, and a free span opens behind it
   integer, parameter :: edit_lie_down = 10  !! a free span becomes part of a line contact
   integer, parameter :: edit_merge = 11     !! two contacts become one
   integer, parameter :: edit_pass = 12      !! a contact moves to a segment boundary, or past it
   integer, parameter :: edit_jump = 13      !! the end of a line contact jumps over a segment boundary and leaves a free span there
   integer, parameter :: edit_rise = 14      !! a line contact opens around a new point contact with another obstacle
   integer, parameter :: edit_change = 15    !! a line contact leaves its obstacle and lies on another obstacle instead
   integer, parameter :: edit_arrive = 16    !! the end of a line contact moves to a segment boundary and stays at the boundary
   integer, parameter :: n_edits = 16

   integer, parameter :: no_test = 0         !! kind of a place without failing test

   !> Order in which the edits are tried, one row for each kind of failing test (test_kinds); the first row is for a place without
   !> failing test. Edits that are missing in a row are tried after those of the row, in the order of their numbers. 0: no edit.
   integer, parameter :: order(5, 0:10) = reshape([ &
      & edit_lie_down, edit_merge, edit_pass, edit_arrive, edit_jump, &   ! no test
      & edit_add, edit_rise, edit_change, edit_lie_down, 0, &             ! gap
      & edit_open, edit_jump, edit_ends, edit_end_off, edit_remove, &    ! force
      & edit_spread, edit_part, edit_lie_down, edit_leave, edit_merge, &  ! curvature
      & edit_open, edit_end_off, edit_ends, edit_remove, 0, &             ! pressure
      & edit_shrink, edit_remove, edit_pass, edit_arrive, 0, &            ! length
      & edit_lie_down, edit_merge, 0, 0, 0, &                             ! vanishing
      & edit_pass, edit_arrive, edit_jump, edit_lie_down, edit_leave, &   ! boundary span
      & edit_spread, edit_leave, edit_part, edit_lie_down, 0, &           ! slope
      & edit_leave, edit_pass, edit_spread, 0, 0, &                       ! leaving
      & edit_open, edit_jump, edit_end_off, edit_pass, edit_arrive], [5, 11])       ! couple

   !> A place at which the contact set may be wrong: that of a failing test, or an end of a contact.
   type :: edit_place_t
      integer :: kind = no_test              !! kind of the failing test (test_kinds)
      real(wp) :: value = 0.0_wp             !! value of the test of a point or gap
      integer :: contact = 0 !! contact to which the place belongs, an index into model%contact; 0: not restricted to one contact
      integer :: strip = 0
      real(wp) :: at = 0.0_wp                !! coordinate along the strip
      real(wp) :: width = 0.0_wp             !! half the length of the zone in which the test fails; 0: it fails at a point
      logical :: beyond = .false.            !! the equilibrium at the end of the increment is known, and `width` belongs to it
      logical :: whole = .false.             !! the test fails all along the line contact, which may lift off as a whole
      integer :: beside(2) = 0 !! numbers of the contacts before and after a free span that closes, 0: none, or no such span
      real(wp) :: room = huge(1.0_wp)        !! longest new contact or free span: distance to a joint of the obstacle
   end type edit_place_t

   !> A contact set to be tried, with up to two ends of contacts whose places are prescribed. The prescribed length is that of a new
   !> contact, of a free span beside the end of a line contact, or of either half of a free span inside a line contact.
   type :: neighbour_t
      integer :: edit = 0
      integer :: parent = 0                  !! number of the contact that the edit changes, 0: none
      type(contact_span_t), allocatable :: set(:) !! contact set on strips, new contact spans without number
      integer :: held(2) = 0                 !! indices of the contacts that have an end with a prescribed place, 0: none
      integer :: side(2) = 1                 !! which end of this contact: 1 first, 2 last
      logical :: beyond = .false. !! true: the new free span has about the length that it has at the end of the increment; no length
      !! is prescribed
      integer :: length = 1                  !! index of the prescribed length of the new contact or free span
   end type neighbour_t

   !> Data that all edits of a set at one place share.
   type :: editing_t
      type(contact_span_t), allocatable :: set(:) !! contact set on strips, sorted
      type(edit_place_t) :: place
      type(strip_t) :: strip                 !! strip of the place
      real(wp) :: near = 0.0_wp              !! contacts within this distance of the place are edited
      real(wp) :: new = 0.0_wp               !! prescribed length of a new contact or free span
   end type editing_t

   ! With half or twice each of these values no run of a sample of the tests changes. Shortest new spans / length within which
   ! contacts are edited:
   real(wp), parameter :: least_resolved = 0.1_wp !! contact or free span in general
   real(wp), parameter :: least_gap = 0.2_wp  !! free span between two point contacts whose gap is resolved
   real(wp), parameter :: behind = 0.1_wp !! first guess for a free span across a segment boundary: its length past the boundary /
   !! its length on the line's side
   real(wp), parameter :: at_load_beyond = 256.0_wp !! first guess for the size of a span that a force or couple at a segment
   !! boundary opens, at the end of the increment / prescribed length of a new span

contains

   !> Neighbours of a set at one place, in the order in which they are tried: sorted by edits, and those of one edit by lengths.
   function neighbours_at(set, edit_place, strip, length_of_new, near) result(found)
      type(contact_span_t), intent(in) :: set(:)  !! contact set on strips, sorted
      type(edit_place_t), intent(in) :: edit_place
      type(strip_t), intent(in) :: strip     !! strip of the place
      real(wp), intent(in) :: length_of_new(:) !! prescribed lengths of a new contact or free span that are tried
      real(wp), intent(in) :: near           !! contacts within this distance of the place are edited
      type(neighbour_t), allocatable :: found(:)
      type(neighbour_t), allocatable :: all(:)
      type(editing_t) :: how
      integer :: rank(n_edits), k, r, i
      how%set = set
      how%place = edit_place
      how%strip = strip
      how%near = near
      allocate (all(0))
      do k = 1, size(length_of_new)
         how%new = length_of_new(k)
         i = size(all)
         call add_edits(how, all)
         all(i + 1:)%length = k
      end do
      rank = ranks(edit_place%kind)
      if (edit_place%whole) rank(edit_ends) = 0
      allocate (found(0))
      do r = 0, n_edits
         do k = 1, size(all)
            if (rank(all(k)%edit) /= r) cycle
            ! Without a failing test the contact force is not zero, so the contact does not end.
            if (all(k)%edit == edit_remove .and. edit_place%kind == no_test) cycle
            if (.not. resolved(all(k))) cycle
            ! An edit without a new length gives the same neighbour for every length; it is taken once.
            if (any([(same_trial(found(i), all(k)), i=1, size(found))])) cycle
            found = [found, all(k)]
         end do
      end do

   contains

      !> True if two neighbours are the same set with the same prescribed places.
      pure logical function same_trial(one, other) result(same)
         type(neighbour_t), intent(in) :: one, other
         same = one%edit == other%edit .and. .not. any(one%held /= other%held) .and. (one%beyond .eqv. other%beyond)
         if (same) same = same_set(one%set, other%set)
      end function same_trial

      !> False if the new contact or free span is too short for the mesh. Between two points a short free span has a gap smaller
      !> than the slack of its test. A line contact that begins inside a segment may have any length.
      pure logical function resolved(one)
         type(neighbour_t), intent(in) :: one
         real(wp) :: least
         resolved = size(length_of_new) == 1 .or. maxval(one%held) == 0
         if (resolved) return
         least = least_resolved
         if (one%edit == edit_spread .and. minval(one%held) > 0) least = 0.0_wp
         if (any(one%edit == [edit_part, edit_leave]) .and. size(one%set) > size(set)) least = least_gap
         resolved = length_of_new(one%length) >= least * min(near, edit_place%room)
      end function resolved
   end function neighbours_at

   !> Adds all edits at a place, with one length of a new contact or free span.
   subroutine add_edits(how, all)
      type(editing_t), intent(in) :: how
      type(neighbour_t), allocatable, intent(inout) :: all(:)
      real(wp) :: at(1)
      integer :: k, first
      associate (set => how%set, place => how%place)
         do k = 1, size(set)
            if (set(k)%rod_segment /= place%strip) cycle
            at = brought_near(how%strip, [place%at], 0.5_wp * sum(set(k)%at))
            if (at(1) < set(k)%at(1) - how%near .or. at(1) > set(k)%at(2) + how%near) cycle
            first = size(all) + 1
            if (set(k)%line) then
               call edit_line(how, k, at(1), all)
            else
               ! A point contact leaves a segment boundary and moves to the place of its force.
               if (place%kind == test_leaving) call add(all, edit_leave, end_moved(set, k, 1, at(1)))
               call edit_point(how, k, all)
            end if
            all(first:)%parent = set(k)%number
         end do
         call edit_free_spans(how, all)
         if (place%contact > 0 .and. place%kind == test_gap) call meet_obstacle(how, all)
      end associate
   end subroutine add_edits

   !> True if an edit may take a free span away.
   pure logical function may_close_span(edit)
      integer, intent(in) :: edit
      may_close_span = any(edit == [edit_lie_down, edit_merge, edit_pass, edit_arrive, edit_remove])
   end function may_close_span

   !> Rank of each edit for a kind of test.
   pure function ranks(kind) result(rank)
      integer, intent(in) :: kind
      integer :: rank(n_edits)
      integer :: k, n
      rank = 0
      n = 0
      do k = 1, size(order, 1)
         if (order(k, kind) == 0) cycle
         n = n + 1
         rank(order(k, kind)) = n
      end do
      do k = 1, n_edits
         if (rank(k) > 0) cycle
         n = n + 1
         rank(k) = n
      end do
   end function ranks

   !> Adds the edits where a gap to an obstacle closes: a point contact begins. Inside a line contact with another obstacle there
   !> are two more edits: the rod lifts off that obstacle on both sides of the point, or the whole line contact changes over to the
   !> new obstacle.
   subroutine meet_obstacle(how, all)
      type(editing_t), intent(in) :: how     !! its `new`: prescribed length of the free span that opens on each side
      type(neighbour_t), allocatable, intent(inout) :: all(:)
      type(contact_span_t), allocatable :: new(:)
      real(wp) :: at(1)
      integer :: k
      logical :: lies
      lies = .false.
      associate (set => how%set, place => how%place, e => how%new)
         do k = 1, size(set)
            if (set(k)%rod_segment /= place%strip .or. set(k)%contact == place%contact .or. .not. set(k)%line) cycle
            at = brought_near(how%strip, [place%at], 0.5_wp * sum(set(k)%at))
            if (at(1) - e > set(k)%at(1) .and. at(1) + e < set(k)%at(2)) then
               lies = .true.
               new = opened(set, k, at(1) - e, at(1) + e)
               call add(all, edit_rise, begun(new, place%contact, place%strip, at(1)), [k, size(new)], [2, 1])
            end if
            if (at(1) < set(k)%at(1) .or. at(1) > set(k)%at(2)) cycle
            new = set
            new(k)%contact = place%contact
            call add(all, edit_change, new)
         end do
         if (.not. lies) call add(all, edit_add, begun(set, place%contact, place%strip, place%at))
      end associate
   end subroutine meet_obstacle

   !> Adds the edits of point contact k.
   subroutine edit_point(how, k, all)
      type(editing_t), intent(in) :: how
      integer, intent(in) :: k
      type(neighbour_t), allocatable, intent(inout) :: all(:)
      integer :: b, way
      real(wp) :: ends(2)
      ends = how%strip%ends()
      associate (set => how%set, at => how%set(k)%at(1), boundary => how%strip%start, e => how%new)
         call add(all, edit_remove, lost(set, k))
         call add(all, edit_spread, spread_out(set, k, 0.5_wp * e, ends), [k, k], [1, 2])
         if (at - 0.5_wp * e > ends(1) .and. at + 0.5_wp * e < ends(2)) &
            & call add(all, edit_part, parted(set, k, e), [k, size(set) + 1], [1, 1])
         do b = 1, size(boundary)
            if (abs(at - boundary(b)) > how%near) cycle
            if (abs(at - boundary(b)) > 0.0_wp) call add(all, edit_pass, end_moved(set, k, 1, boundary(b)))
            do way = -1, 1, 2
               associate (to => boundary(b) + way * e)
                  if (to <= ends(1) .or. to >= ends(2)) cycle
                  call add(all, edit_leave, begun(set, set(k)%contact, set(k)%rod_segment, to), [size(set) + 1, 0])
                  call add(all, edit_leave, end_moved(set, k, 1, to), [k, 0])
                  call add(all, edit_spread, extended(end_moved(set, k, 1, boundary(b)), k, to), [k, 0], &
                     & spread(merge(1, 2, way < 0), 1, 2))
               end associate
            end do
         end do
      end associate
   end subroutine edit_point

   !> Adds the edits of line contact k.
   subroutine edit_line(how, k, s, all)
      type(editing_t), intent(in) :: how
      integer, intent(in) :: k
      real(wp), intent(in) :: s              !! the place, on the same turn around a closed strip as the line
      type(neighbour_t), allocatable, intent(inout) :: all(:)
      real(wp) :: ends(2), g, zone, middle
      integer :: i, j, first
      ends = how%strip%ends()
      zone = max(how%place%width, how%new)
      associate (set => how%set, a => how%set(k)%at(1), b => how%set(k)%at(2), e => how%new, near => how%near)
         call add(all, edit_remove, lost(set, k))
         middle = 0.5_wp * (a + b)
         if (a <= ends(1)) middle = ends(1)
         if (b >= ends(2)) middle = ends(2)
         call add(all, edit_shrink, shrunk(set, k, middle))
         if (a > ends(1) .and. b < ends(2)) &
            & call add(all, edit_ends, begun(shrunk(set, k, a), set(k)%contact, set(k)%rod_segment, b))
         if (a > ends(1)) call add(all, edit_ends, shrunk(set, k, a))
         if (b < ends(2)) call add(all, edit_ends, shrunk(set, k, b))
         do i = 1, 2
            g = merge(zone, e, i == 1)
            first = size(all)
            call open_at(s, g, [k, size(set) + 1])
            if (b - a <= g) cycle
            if (s - a <= max(2.0_wp * zone, near)) call end_off(1, a + g, a <= ends(1))
            if (b - s <= max(2.0_wp * zone, near)) call end_off(2, b - g, b >= ends(2))
            if (.not. (how%place%beyond .and. how%place%width > 0.0_wp) .or. i == 2) cycle
            ! At the end of the increment the free span is about as long as the zone of tensile force there, so that no length is
            ! prescribed.
            all(first + 1:)%beyond = .true.
            do j = first + 1, size(all)
               all(j)%held = 0
            end do
         end do
         do i = 1, size(how%strip%start)
            if (how%strip%start(i) > ends(1) .and. how%strip%start(i) < ends(2)) call at_boundary(how%strip%start(i))
         end do
      end associate

   contains

      !> Moves an end of the line to `to`, so that a free span opens behind it. A point contact remains at the former end. If this
      !> is an end of the rod, the set without the point contact is tried first.
      subroutine end_off(side, to, rod_ends)
         integer, intent(in) :: side
         real(wp), intent(in) :: to
         logical, intent(in) :: rod_ends
         type(contact_span_t), allocatable :: new(:)
         new = end_moved(how%set, k, side, to)
         if (rod_ends) call add(all, edit_end_off, new, [k, 0], [side, side])
         call add(all, edit_end_off, begun(new, how%set(k)%contact, how%set(k)%rod_segment, how%set(k)%at(side)), &
            & [k, size(how%set) + 1], [side, 1])
      end subroutine end_off

      !> Adds the edits of the line contact at a segment boundary: an end of the line moves to the boundary, passes it, or leaves a
      !> free span around it; or a free span opens around the boundary.
      subroutine at_boundary(s)
         real(wp), intent(in) :: s
         type(contact_span_t), allocatable :: new(:)
         integer :: side, way, first
         if (s < how%set(k)%at(1) - how%near .or. s > how%set(k)%at(2) + how%near) return
         do side = 1, 2
            if (abs(s - how%set(k)%at(side)) > how%near) cycle
            way = merge(-1, 1, side == 1)
            call add(all, edit_pass, end_moved(how%set, k, side, s + way * how%new), [k, 0], [side, side])
            ! If the other end is before the boundary, this end may also stop before the boundary or come to it. An end at the
            ! boundary is held there by a couple, which is zero at the arrival, so that this set seems valid even if the end goes on
            ! past the boundary. Therefore `order` has edit_arrive behind edit_pass.
            if (way * (s - how%set(k)%at(3 - side)) > 0.0_wp) then
               call add(all, edit_arrive, end_moved(how%set, k, side, s))
               call add(all, edit_pass, end_moved(how%set, k, side, s - way * how%new), [k, 0], [side, side])
            end if
            if (way * (s - how%set(k)%at(3 - side)) <= how%new) cycle
            ! Most of the free span lies on the line's side of the boundary; the point contact behind it takes over the force of the
            ! line's end.
            new = begun(end_moved(how%set, k, side, s - way * how%new), how%set(k)%contact, how%set(k)%rod_segment, &
               & s + way * behind * how%new)
            call add(all, edit_jump, new, [k, size(how%set) + 1], [side, 1])
         end do
         call open_at(s, how%new, [k, size(how%set) + 1])
         if (.not. how%place%beyond) return
         ! Where a force and a couple act, the parts of the span on both sides may grow with different powers of the load. A short
         ! span then has no equilibrium near any fixed ratio of the parts; the span at the end of the increment has.
         first = size(all)
         call open_at(s, at_load_beyond * how%new, [0, 0])
         all(first + 1:)%beyond = .true.
      end subroutine at_boundary

      !> Opens a free span around a place of the line.
      subroutine open_at(place, half, held)
         real(wp), intent(in) :: place, half    !! place and half the length of the free span
         integer, intent(in) :: held(2)         !! contacts whose ends have prescribed places, 0: none
         if (how%set(k)%at(1) < place - half .and. place + half < how%set(k)%at(2)) &
            & call add(all, edit_open, opened(how%set, k, place - half, place + half), held, [2, 1])
      end subroutine open_at
   end subroutine edit_line

   !> Adds the edits of free spans at a place: the whole span comes into contact, or the contacts beside it merge.
   subroutine edit_free_spans(how, all)
      type(editing_t), intent(in) :: how
      type(neighbour_t), allocatable, intent(inout) :: all(:)
      integer :: k, next, j
      real(wp) :: ends(2), whole(2)
      whole = how%strip%ends()
      do k = 1, size(how%set)
         if (how%set(k)%rod_segment /= how%place%strip) cycle
         next = following(k)
         if (next == 0 .and. how%strip%closed) then
            call edit_gap_over_ends(k)
            cycle
         end if
         ends = [how%set(k)%at(2), whole(2)]
         if (next > 0) ends(2) = how%set(next)%at(1)
         call edit_gap(how%set, [k, next])
         if (any([(following(next) == k, next=1, size(how%set))]) .or. how%strip%closed) cycle
         ends = [whole(1), how%set(k)%at(1)]
         call edit_gap(how%set, [0, k])
      end do

   contains

      !> Next contact span of the same contact along the same strip (`rod_segment` is the strip in a set on strips); 0: none.
      pure integer function following(k) result(next)
         integer, intent(in) :: k
         integer :: j
         next = 0
         do j = 1, size(how%set)
            if (how%set(j)%rod_segment /= how%set(k)%rod_segment .or. how%set(j)%contact /= how%set(k)%contact) cycle
            if (how%set(j)%at(1) <= how%set(k)%at(2) .or. j == k) cycle
            if (next > 0) then
               if (how%set(next)%at(1) <= how%set(j)%at(1)) cycle
            end if
            next = j
         end do
      end function following

      !> Adds the edits of the free span of a closed strip between its last contact and its first.
      subroutine edit_gap_over_ends(k)
         integer, intent(in) :: k
         type(contact_span_t) :: turned(size(how%set))
         integer :: first
         first = k
         do while (any([(following(j) == first, j=1, size(how%set))]))
            first = findloc([(following(j) == first, j=1, size(how%set))], .true., 1)
         end do
         if (first == k) return
         turned = how%set
         turned(k)%at = how%set(k)%at - how%strip%length()
         ends = [turned(k)%at(2), how%set(first)%at(1)]
         call edit_gap(turned, [k, first])
      end subroutine edit_gap_over_ends

      !> Adds the edits of the free span `ends` between two contacts, or between a contact and an end of the strip.
      subroutine edit_gap(set, beside)
         type(contact_span_t), intent(in) :: set(:) !! contact set, with both contacts on the same turn around a closed strip
         integer, intent(in) :: beside(2)           !! the two contacts; 0: the end of the strip
         integer :: one, other
         real(wp) :: end, at(1)
         at = brought_near(how%strip, [how%place%at], 0.5_wp * sum(ends))
         if (.not. ends(2) > ends(1) .or. at(1) < ends(1) - how%near .or. at(1) > ends(2) + how%near) return
         call add(all, edit_lie_down, laid_down(set, beside, ends))
         if (ends(2) - ends(1) > 10.0_wp * how%near) return
         if (any(beside == 0)) then
            one = maxval(beside)
            end = merge(ends(1), ends(2), beside(1) == 0)
            if (.not. set(one)%line) call add(all, edit_pass, end_moved(set, one, 1, end))
            return
         end if
         one = beside(1)
         other = beside(2)
         if (.not. (set(one)%line .or. set(other)%line)) then
            call add(all, edit_merge, merged(set, one, other))
         else if (set(one)%line .and. .not. set(other)%line) then
            call join_point(set, other, one, 2)
         else if (set(other)%line .and. .not. set(one)%line) then
            call join_point(set, one, other, 1)
         end if
      end subroutine edit_gap

      !> Merges a point contact with an end of a line contact. The merged end lies at the place of the point, or has already moved
      !> back along the line. (If they meet at a joint of the obstacle, no equilibrium exists with the end beyond the joint.)
      subroutine join_point(set, point, line, side)
         type(contact_span_t), intent(in) :: set(:) !! contact set, with both contacts on the same turn around a closed strip
         integer, intent(in) :: point, line, side
         associate (e => how%new)
            call add(all, edit_merge, lost(end_moved(set, line, side, set(point)%at(1)), point))
            if (set(line)%at(2) - set(line)%at(1) > e) call add(all, edit_merge, lost(end_moved(set, line, side, &
               & set(line)%at(side) + merge(e, -e, side == 1)), point), [merge(line - 1, line, point < line), 0], [side, side])
         end associate
      end subroutine join_point
   end subroutine edit_free_spans

   !> Appends a neighbour to a list.
   subroutine add(all, edit, set, held, side)
      type(neighbour_t), allocatable, intent(inout) :: all(:)
      integer, intent(in) :: edit
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in), optional :: held(2), side(2)
      type(neighbour_t), allocatable :: longer(:)
      allocate (longer(size(all) + 1))
      longer(:size(all)) = all
      associate (new => longer(size(longer)))
         new%edit = edit
         new%set = set
         if (present(held)) new%held = held
         if (present(side)) new%side = side
      end associate
      call move_alloc(longer, all)
   end subroutine add
end module neighbours
