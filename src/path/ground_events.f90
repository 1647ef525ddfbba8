!> Regions of contact with distributed foundations that appear, vanish, split or merge between two points of the path.
!>
!> The event's function is the smallest gap on the stretch where the region is, or the largest local maximum of the gap
!> where it opens: it changes smoothly, wherever inside an element that happens, and follows what moves.
module ground_events
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use ground_regions, only: smallest_ground_gap, inner_opening
   use path_record, only: region_t
   implicit none
   private
   public :: ground_event_t, find_ground_events, ground_event_value

   !> What happens on a stretch of a contact's chain.
   type :: ground_event_t
      character(2) :: label = ''
      integer :: contact = 0                   !! index into model%contact
      real(wp) :: from = 0.0_wp, to = 0.0_wp   !! arc lengths
      logical :: divided = .false.             !! a region splits there, or two merge
   end type ground_event_t

contains

   !> Compares the regions of two points, contact by contact.
   subroutine find_ground_events(problem, earlier, later, events)
      type(problem_t), intent(in) :: problem
      type(region_t), intent(in) :: earlier(:), later(:)
      type(ground_event_t), allocatable, intent(out) :: events(:)
      type(region_t), allocatable :: a(:), b(:)
      real(wp) :: reach, closed
      integer, allocatable :: partner_a(:), partner_b(:)
      integer :: contact
      allocate (events(0))
      do contact = 1, size(problem%model%contact)
         if (.not. problem%model%contact(contact)%distributed) cycle
         a = pack(earlier, earlier%contact == contact)
         b = pack(later, later%contact == contact)
         closed = problem%ground%chain%chain_length(contact)
         reach = 2.0_wp * maxval(problem%ground%chain%tributary, mask=problem%ground%chain%contact == contact)
         if (closed > 0.0_wp) call turn_round(a, b, closed)
         call match(a, b, reach, partner_a, partner_b)
         call tell(contact, a, b, partner_b, reach, 'C+', 'C-', events)
         call tell(contact, b, a, partner_a, reach, 'C-', 'C+', events)
      end do
   end subroutine find_ground_events

   !> Shifts the regions of a closed chain so that both lists begin at the same place and rise.
   pure subroutine turn_round(a, b, closed)
      type(region_t), intent(in) :: a(:)
      type(region_t), intent(inout) :: b(:)
      real(wp), intent(in) :: closed
      real(wp) :: turn
      integer :: k, first
      if (size(a) == 0 .or. size(b) == 0) return
      ! Each region within half a round of the first one's middle, or behind.
      do k = 1, size(b)
         turn = anint((0.5_wp * (a(1)%start + a(1)%end) - 0.5_wp * (b(k)%start + b(k)%end)) / closed)
         b(k)%start = b(k)%start + turn * closed
         b(k)%end = b(k)%end + turn * closed
      end do
      do k = 1, size(b)
         if (b(k)%end >= a(1)%start) cycle
         b(k)%start = b(k)%start + closed
         b(k)%end = b(k)%end + closed
      end do
      first = minloc(b%start, 1)
      b = cshift(b, first - 1)
   end subroutine turn_round

   !> Pairs the regions of two lists in their order, as many as can be: those that overlap or nearly do, for a short region
   !> may move by more than its length. Longest common subsequence.
   subroutine match(a, b, reach, partner_a, partner_b)
      type(region_t), intent(in) :: a(:), b(:)
      real(wp), intent(in) :: reach
      integer, allocatable, intent(out) :: partner_a(:), partner_b(:) !! index into the other list, 0: none
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

      !> Of a pair: pairs count more than how much they overlap.
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

   !> Regions of `there` without a partner in `other`: they are new, or parts of a region that is whole in `other`.
   subroutine tell(contact, other, there, partner, reach, new, divided, events)
      integer, intent(in) :: contact
      type(region_t), intent(in) :: other(:), there(:)
      integer, intent(in) :: partner(:)        !! of the regions of `there`
      real(wp), intent(in) :: reach            !! two elements
      character(2), intent(in) :: new, divided !! labels
      type(ground_event_t), allocatable, intent(inout) :: events(:)
      real(wp) :: from, to, width
      integer :: k, side, beside
      do k = 1, size(there)
         if (partner(k) > 0) cycle
         do side = -1, 1, 2
            beside = k + side
            if (beside < 1 .or. beside > size(there)) cycle
            if (partner(beside) == 0) cycle
            if (overlap_length(there(k), other(partner(beside))) > 0.0_wp) exit
         end do
         if (side > 1) then
            events = [events, ground_event_t(new, contact, free_from(there(k)), free_to(there(k)), .false.)]
         else
            ! The opening may move while it grows.
            from = min(there(k)%end, there(beside)%end)
            to = max(there(k)%start, there(beside)%start)
            width = max(10.0_wp * (to - from), 10.0_wp * reach)
            events = [events, ground_event_t(divided, contact, max(from - width, min(there(k)%start, there(beside)%start)), &
               & min(to + width, max(there(k)%end, there(beside)%end)), .true.)]
         end if
      end do

   contains

      !> Half way to the region before, of either list: a small region may move while it grows.
      real(wp) function free_from(region)
         type(region_t), intent(in) :: region
         free_from = region%start - (region%end - region%start)
         free_from = min(free_from, 0.5_wp * (region%start + max(maxval(there%end, mask=there%end < region%start), &
            & maxval(other%end, mask=other%end < region%start), -huge(1.0_wp) * 0.25_wp)))
      end function free_from

      real(wp) function free_to(region)
         type(region_t), intent(in) :: region
         free_to = region%end + (region%end - region%start)
         free_to = max(free_to, 0.5_wp * (region%end + min(minval(there%start, mask=there%start > region%end), &
            & minval(other%start, mask=other%start > region%end), huge(1.0_wp) * 0.25_wp)))
      end function free_to
   end subroutine tell

   !> Length that two regions have in common; negative when they are apart.
   pure real(wp) function overlap_length(a, b)
      type(region_t), intent(in) :: a, b
      overlap_length = min(a%end, b%end) - max(a%start, b%start)
   end function overlap_length

   !> Positive on the side where the region is (whole).
   real(wp) function ground_event_value(problem, state, event) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ground_event_t), intent(in) :: event
      real(wp) :: closed
      closed = problem%ground%chain%chain_length(event%contact)
      ! The chain's list covers one round and the next.
      associate (back => merge(closed, 0.0_wp, event%from < 0.0_wp .and. closed > 0.0_wp))
         if (event%divided) then
            value = -inner_opening(problem, state, event%contact, event%from + back, event%to + back)
         else
            value = -smallest_ground_gap(problem, state, event%contact, event%from + back, event%to + back)
         end if
      end associate
   end function ground_event_value
end module ground_events
