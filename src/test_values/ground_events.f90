!> Contact regions on distributed foundations that appear, vanish, split or merge between two points of the path.
!>
!> The chain of a contact is the sequence of its candidates (nodes) along the rods. The event function is minus the smallest gap on
!> the part of the chain around the region or, for a region that opens inside, minus the largest local maximum of the gap. Both
!> functions are smooth along the path, also if the place of the extreme gap is inside an element, and remain defined if the region
!> moves. A support on the foundation's surface at an end of the chain keeps the gap at zero there at every load: the end is a root
!> of the gap. If the contact beside such an end is lost, its length shrinks to zero. The least gap then tends to zero with the
!> power 3/2 of the slope at the end and remains zero after the loss. It does not change its sign, so that it could not locate the
!> loss. The gap is therefore divided by its roots (root_orders). The gap divided by the distance from the end is smooth, and
!> changes its sign where the slope at the end is zero. If the support also fixes the slope, the gap is divided by the square of the
!> distance, and the curvature takes the place of the slope.
module ground_events
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, chain_gap
   use ground_regions, only: smallest_ground_gap, inner_opening
   use path_record, only: region_t
   use contact_labels, only: contact_gained, contact_lost
   use ordering, only: ascending
   use element_families, only: collocates
   use node_rates, only: rod_derivatives
   use element_gap, only: gap_root_t
   implicit none
   private
   public :: ground_event_t, find_ground_events, find_roots, ground_event_value, ground_event_place, ground_event_gap, &
      & root_orders, chain_roots

   !> A change of the contact regions on a part of the chain of a contact.
   type :: ground_event_t
      character(2) :: label = ''                 !! C+ or C-
      integer :: contact = 0                   !! index into model%contact
      real(wp) :: from = 0.0_wp, to = 0.0_wp   !! arc lengths at the two ends of this part of the chain
      logical :: divided = .false.             !! true: a region splits, or two regions merge
      integer :: root(2) = 0 !! orders of the gap's roots at the two ends of the chain, see the header of this module; 0: no root
   end type ground_event_t

contains

   !> Finds the events between two points by comparing the contact regions at both, contact by contact.
   subroutine find_ground_events(problem, earlier, later, events)
      type(problem_t), intent(in) :: problem
      type(region_t), intent(in) :: earlier(:), later(:)
      type(ground_event_t), allocatable, intent(out) :: events(:)
      type(region_t), allocatable :: a(:), b(:)
      real(wp) :: reach, closed, ends(2)
      integer, allocatable :: partner_a(:), partner_b(:)
      integer :: contact
      allocate (events(0))
      do contact = 1, size(problem%model%contact)
         if (.not. problem%model%contact(contact)%distributed) cycle
         a = pack(earlier, earlier%contact == contact)
         b = pack(later, later%contact == contact)
         closed = problem%ground%chain%chain_length(contact)
         reach = 2.0_wp * maxval(problem%ground%chain%tributary, mask=problem%ground%chain%contact == contact)
         ends = [minval(problem%ground%chain%s, mask=problem%ground%chain%contact == contact), &
            & maxval(problem%ground%chain%s, mask=problem%ground%chain%contact == contact)]
         if (closed > 0.0_wp) then
            call unroll(a, b, closed)
            ends = [-closed, 2.0_wp * closed]
         end if
         call match(a, b, reach, partner_a, partner_b)
         call append_unmatched(contact, a, b, partner_b, reach, closed, ends, contact_gained, contact_lost, events)
         call append_unmatched(contact, b, a, partner_a, reach, closed, ends, contact_lost, contact_gained, events)
      end do
   end subroutine find_ground_events

   !> Opens a closed chain at the place that the fewest regions cover. The arc lengths of all regions are shifted by whole turns, so
   !> that each region is on the turn around the chain that begins at this place; each list is then sorted.
   pure subroutine unroll(a, b, closed)
      type(region_t), intent(inout) :: a(:), b(:)
      real(wp), intent(in) :: closed
      real(wp) :: mark(2 * (size(a) + size(b))), place, cut, width
      integer :: k, next, covers, fewest
      mark = modulo([a%start, a%end, b%start, b%end], closed)
      cut = 0.0_wp
      fewest = huge(1)
      width = 0.0_wp
      do k = 1, size(mark)
         next = minloc(modulo(mark - mark(k), closed), 1, mask=modulo(mark - mark(k), closed) > 0.0_wp)
         place = mark(k) + 0.5_wp * closed
         if (next > 0) place = mark(k) + 0.5_wp * modulo(mark(next) - mark(k), closed)
         covers = count(covered(a)) + count(covered(b))
         if (covers > fewest .or. (covers == fewest .and. place - mark(k) <= width)) cycle
         fewest = covers
         width = place - mark(k)
         cut = modulo(place, closed)
      end do
      call shift(a)
      call shift(b)

   contains

      !> True if a region covers the place at which the chain is opened.
      pure elemental logical function covered(region)
         type(region_t), intent(in) :: region
         covered = modulo(place - region%start, closed) < region%end - region%start
      end function covered

      !> Moves the regions of a list to the turn around the chain that begins at the opening `cut`, and sorts the list.
      pure subroutine shift(list)
         type(region_t), intent(inout) :: list(:)
         real(wp) :: middle
         integer :: i
         do i = 1, size(list)
            associate (moved => list(i))
               if (all_round(moved, closed)) then
                  moved%start = cut
                  moved%end = cut + closed
               else
                  middle = 0.5_wp * (moved%start + moved%end)
                  moved%start = moved%start - middle + cut + modulo(middle - cut, closed)
                  moved%end = moved%end - middle + cut + modulo(middle - cut, closed)
               end if
            end associate
         end do
         list = list(ascending(list%start))
      end subroutine shift
   end subroutine unroll

   !> True if a region covers the whole closed chain.
   pure elemental logical function all_round(region, closed)
      type(region_t), intent(in) :: region
      real(wp), intent(in) :: closed
      all_round = closed > 0.0_wp .and. region%end - region%start >= (1.0_wp - 1.0e-9_wp) * closed
   end function all_round

   !> Pairs as many regions of two lists as possible, in the order of both lists (longest common subsequence). Two regions can be
   !> paired if they overlap or, because a short region may move by more than its length, if their distance is less than `reach`.
   subroutine match(a, b, reach, partner_a, partner_b)
      type(region_t), intent(in) :: a(:), b(:)
      real(wp), intent(in) :: reach
      integer, allocatable, intent(out) :: partner_a(:), partner_b(:) !! for each region: index of its partner in the other list; 0:
      !! none
      real(wp) :: best(0:size(a), 0:size(b)), pair
      integer :: i, j
      best = 0.0_wp
      do i = 1, size(a)
         do j = 1, size(b)
            best(i, j) = max(best(i - 1, j), best(i, j - 1), best(i - 1, j - 1) + worth(i, j))
         end do
      end do
      allocate (partner_a(size(a)), partner_b(size(b)), source=0)
      i = size(a)
      j = size(b)
      do while (i > 0 .and. j > 0)
         pair = worth(i, j)
         if (pair > 0.0_wp .and. best(i, j) <= best(i - 1, j - 1) + pair) then
            partner_a(i) = j
            partner_b(j) = i
            i = i - 1
            j = j - 1
         else if (best(i - 1, j) >= best(i, j - 1)) then
            i = i - 1
         else
            j = j - 1
         end if
      end do

   contains

      !> Weight of a pair of regions: 1, plus a small part that grows with their overlap; 0 if they cannot be paired.
      real(wp) function worth(k, l)
         integer, intent(in) :: k, l
         real(wp) :: overlap
         worth = 0.0_wp
         overlap = min(a(k)%end, b(l)%end) - max(a(k)%start, b(l)%start)
         if (overlap < -reach) return
         worth = 1.0_wp
         if (overlap > 0.0_wp) worth = 1.0_wp + 0.01_wp * overlap / max(a(k)%end - a(k)%start, b(l)%end - b(l)%start)
      end function worth
   end subroutine match

   !> Appends the events of those regions of `there` that have no partner in `other`: these are new regions, or parts of a region
   !> that is undivided in `other`. (A region that covers a whole closed chain can open without being divided into two.)
   subroutine append_unmatched(contact, other, there, partner, reach, closed, ends, new, divided, events)
      integer, intent(in) :: contact
      type(region_t), intent(in) :: other(:), there(:)
      integer, intent(in) :: partner(:)        !! index in `other` of the partner of each region of `there`; 0: none
      real(wp), intent(in) :: reach            !! twice the length of an element
      real(wp), intent(in) :: closed           !! length of the chain if it is closed; 0: the chain is open
      real(wp), intent(in) :: ends(2)          !! arc lengths at the two ends of the chain
      character(2), intent(in) :: new, divided !! labels of the event for a new region and for a division
      type(ground_event_t), allocatable, intent(inout) :: events(:)
      integer :: k, beside, last
      do k = 1, size(there)
         if (partner(k) > 0) cycle
         beside = other_part(k)
         if (beside == 0) then
            events = [events, ground_event_t(new, contact, free_from(there(k)), free_to(there(k)), .false.)]
         else
            call open_between(there(min(k, beside)), there(max(k, beside)), 0.0_wp)
         end if
      end do
      last = size(there)
      if (last == 0 .or. size(other) /= 1) return
      if (all_round(other(1), closed) .and. .not. all_round(there(1), closed)) call open_between(there(last), there(1), closed)

   contains

      !> For a region of `there` that is a part of a region of `other`: its neighbour in `there`, on the side of the part that is
      !> the partner; 0: the region is no such part.
      integer function other_part(number) result(beside)
         integer, intent(in) :: number
         integer :: side, whole, kept
         do whole = 1, size(other)
            if (min(there(number)%end, other(whole)%end) <= max(there(number)%start, other(whole)%start)) cycle
            kept = findloc(partner, whole, 1)
            if (kept == 0) cycle
            side = sign(1, kept - number)
            beside = number + side
            return
         end do
         beside = 0
      end function other_part

      !> Appends the event at which a free span opens inside a region of contact and divides the region. The search interval is
      !> wider than the free span, which may move along the rod while it grows.
      subroutine open_between(before, after, round)
         type(region_t), intent(in) :: before, after
         real(wp), intent(in) :: round !! length added to the arc lengths of `after`: the length of a closed chain if `after` lies
         !! behind the place where the chain is opened, else 0
         real(wp) :: width
         width = max(10.0_wp * (after%start + round - before%end), 10.0_wp * reach)
         events = [events, ground_event_t(divided, contact, max(before%end - width, before%start), &
            & min(after%start + round + width, after%end + round), .true.)]
      end subroutine open_between

      !> Start of the part of the chain that is searched around a region. It is half way to the region before this one in either
      !> list, because a small region may move while it grows. For a long region it is at least one region length before it. It is
      !> never inside another region.
      real(wp) function free_from(region)
         type(region_t), intent(in) :: region
         real(wp) :: before
         before = max(maxval(there%end, mask=there%end < region%start), maxval(other%end, mask=other%end < region%start))
         free_from = min(region%start - (region%end - region%start), 0.5_wp * (region%start + max(ends(1), before)))
         if (free_from <= before) free_from = 0.5_wp * (region%start + before)
         if (closed > 0.0_wp) free_from = max(free_from, 0.5_wp * (region%start + region%end - closed))
      end function free_from

      !> End of the part of the chain that is searched around a region, by the same rule as in free_from.
      real(wp) function free_to(region)
         type(region_t), intent(in) :: region
         real(wp) :: after
         after = min(minval(there%start, mask=there%start > region%end), minval(other%start, mask=other%start > region%end))
         free_to = max(region%end + (region%end - region%start), 0.5_wp * (region%end + min(ends(2), after)))
         if (free_to >= after) free_to = 0.5_wp * (region%end + after)
         if (closed > 0.0_wp) free_to = min(free_to, 0.5_wp * (region%start + region%end + closed))
      end function free_to
   end subroutine append_unmatched

   !> Sets the orders of the gap's roots at the ends of the chain, as far as they lie in the event's part of the chain: at each end
   !> the smaller order of the two states.
   subroutine find_roots(problem, from, to, event)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      type(ground_event_t), intent(inout) :: event
      if (event%divided) return
      event%root = min(root_orders(problem, from, event%contact, event%from, event%to), &
         & root_orders(problem, to, event%contact, event%from, event%to))
   end subroutine find_roots

   !> Event function: positive while the region exists or, for a division, while it is undivided.
   real(wp) function ground_event_value(problem, state, event) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ground_event_t), intent(in) :: event
      integer :: candidate
      real(wp) :: tau, factor
      call evaluate_event(problem, state, event, value, candidate, tau, factor)
   end function ground_event_value

   !> Magnitude of the gap, not divided by roots, at the position of the event; at a located event it is the error of the location.
   real(wp) function ground_event_gap(problem, state, event) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ground_event_t), intent(in) :: event
      type(ground_event_t) :: with_roots
      with_roots = event
      with_roots%root = 0
      gap = abs(ground_event_value(problem, state, with_roots))
   end function ground_event_gap

   !> Finds the position of the smallest gap, or of the largest maximum of the gap, that defines the event function.
   subroutine ground_event_place(problem, state, event, candidate, tau, factor)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ground_event_t), intent(in) :: event
      integer, intent(out) :: candidate !! index, in the chain of the foundations, of the candidate before the element with this
      !! position; 0: none, or the position is at a root
      real(wp), intent(out) :: tau             !! position in the element, 0 to 1
      real(wp), intent(out) :: factor          !! factor by which the division by roots multiplies the gap at this position
      real(wp) :: value
      call evaluate_event(problem, state, event, value, candidate, tau, factor)
      if (.not. factor > 0.0_wp) candidate = 0
   end subroutine ground_event_place

   !> Computes the value of the event function, its position, and the factor of the gap's roots at this position.
   subroutine evaluate_event(problem, state, event, value, candidate, tau, factor)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ground_event_t), intent(in) :: event
      real(wp), intent(out) :: value
      integer, intent(out) :: candidate
      real(wp), intent(out) :: tau, factor
      real(wp) :: closed, from, to
      factor = 1.0_wp
      closed = problem%ground%chain%chain_length(event%contact)
      from = event%from
      ! The search covers two turns around a closed chain; the range must begin in the first turn.
      if (closed > 0.0_wp) from = modulo(event%from, closed)
      to = event%to + (from - event%from)
      if (event%divided) then
         call inner_opening(problem, state, event%contact, from, to, value, candidate, tau)
      else
         call smallest_ground_gap(problem, state, event%contact, from, to, chain_roots(problem, state, event%contact, event%root), &
            & value, candidate, tau, factor)
      end if
      value = -value
   end subroutine evaluate_event

   !> Orders of the gap's roots at the first and the last end of a contact's chain; 0: no root inside the given range.
   function root_orders(problem, state, contact, from, to) result(order)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact          !! index of a contact that has a chain
      real(wp), intent(in) :: from, to        !! range of arc lengths along the chain
      integer :: order(2)
      real(wp) :: gap, slope, bend
      integer :: side, c, e
      order = 0
      if (problem%ground%chain%chain_length(contact) > 0.0_wp) return
      do side = 1, 2
         call chain_end(problem, contact, side, c, e)
         if (c == 0) cycle
         if (problem%ground%chain%s(c) < from .or. problem%ground%chain%s(c) > to) cycle
         associate (node => problem%ground%chain%node(c), mesh => problem%model%mesh)
            if (.not. all(problem%model%fixed(1:2, node)) .or. .not. collocates(mesh%family(e))) cycle
            call gap_at_rod_end(problem, state, side, c, e, gap, slope, bend)
            if (abs(gap) > rounding_gap(problem)) cycle
            order(side) = 1
            if (problem%model%fixed(3, node) .and. abs(slope) * problem%size <= rounding_gap(problem)) order(side) = 2
         end associate
      end do
   end function root_orders

   !> Roots of the gap at the ends of a chain, with their positions as arc lengths; empty if all orders are 0.
   function chain_roots(problem, state, contact, order) result(root)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      integer, intent(in) :: order(2)         !! orders of the roots at the first and last end; 0: no root at this end
      type(gap_root_t) :: root(count(order > 0))
      real(wp) :: gap, slope, bend
      integer :: side, c, e, n
      n = 0
      do side = 1, 2
         if (order(side) == 0) cycle
         n = n + 1
         call chain_end(problem, contact, side, c, e)
         call gap_at_rod_end(problem, state, side, c, e, gap, slope, bend)
         root(n)%at = problem%ground%chain%s(c)
         root(n)%order = order(side)
         root(n)%scale = problem%size
         root(n)%limit = slope * problem%size
         if (order(side) == 2) root(n)%limit = 0.5_wp * bend * problem%size**2
      end do
   end function chain_roots

   !> Finds the candidate at an end of an open chain, and the element beside it; 0: none.
   pure subroutine chain_end(problem, contact, side, candidate, element)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, side    !! index of the contact; side 1: first end, 2: last end of its chain
      integer, intent(out) :: candidate, element
      associate (chain => problem%ground%chain)
         candidate = findloc(chain%contact == contact .and. chain%element(side, :) == 0 .and. chain%element(3 - side, :) > 0, &
            & .true., 1, back=side == 2)
         element = 0
         if (candidate > 0) element = chain%element(3 - side, candidate)
      end associate
   end subroutine chain_end

   !> Computes the gap at an end of a rod and its first and second derivatives with respect to the stress-free distance from the
   !> end.
   subroutine gap_at_rod_end(problem, state, side, candidate, e, gap, slope, bend)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: side, candidate, e
      real(wp), intent(out) :: gap, slope, bend
      real(wp) :: normal(2), x(2, 3), curvature
      call chain_gap(problem, state, problem%ground%chain, candidate, gap, normal, curvature)
      call rod_derivatives(problem, state, e, side, x)
      slope = merge(1.0_wp, -1.0_wp, side == 1) * dot_product(normal, x(:, 1))
      bend = dot_product(normal, x(:, 2)) + curvature * (normal(1) * x(2, 1) - normal(2) * x(1, 1))**2
   end subroutine gap_at_rod_end
end module ground_events
