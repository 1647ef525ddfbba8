!> Regions of contact with distributed foundations that appear, vanish, split or merge between two points of the path.
!>
!> The event's function is the smallest gap on the stretch where the region is (the largest one where it opens): it
!> changes smoothly, wherever inside an element that happens.
module ground_events
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use ground_regions, only: extreme_gap
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

   !> Compares the regions of two points.
   subroutine find_ground_events(problem, earlier, later, events)
      type(problem_t), intent(in) :: problem
      type(region_t), intent(in) :: earlier(:), later(:)
      type(ground_event_t), allocatable, intent(out) :: events(:)
      allocate (events(0))
      call compare(earlier, later, 'C-')
      call compare(later, earlier, 'C+')

   contains

      !> Regions of `there` that have no counterpart in `other`, or several.
      subroutine compare(there, other, label)
         type(region_t), intent(in) :: there(:), other(:)
         character(2), intent(in) :: label
         real(wp) :: reach, last_end, closed
         integer :: i, k, parts
         logical :: near
         do i = 1, size(there)
            parts = 0
            near = .false.
            last_end = 0.0_wp
            closed = problem%ground%chain%chain_length(there(i)%contact)
            reach = 2.0_wp * longest_element(there(i)%contact)
            do k = 1, size(other)
               if (other(k)%contact /= there(i)%contact) cycle
               near = near .or. meet(there(i), other(k), reach, closed)
               if (.not. meet(there(i), other(k), 0.0_wp, closed)) cycle
               parts = parts + 1
               if (parts > 1 .and. closed <= 0.0_wp) &
                  & events = [events, ground_event_t(label, there(i)%contact, last_end, other(k)%start, .true.)]
               last_end = other(k)%end
            end do
            ! A short region may have moved by more than its length.
            if (parts == 0 .and. .not. near) events = [events, ground_event_t(label, there(i)%contact, there(i)%start - reach, &
               & there(i)%end + reach, .false.)]
            ! Round a closed chain two regions have two stretches between them: told by their number.
            if (closed > 0.0_wp .and. parts > 1) call divide_closed(there(i), other, label)
         end do
      end subroutine compare

      !> The open stretches of `other` inside a region of a closed chain.
      subroutine divide_closed(region, other, label)
         type(region_t), intent(in) :: region, other(:)
         character(2), intent(in) :: label
         real(wp) :: closed, from, to
         integer :: k, j, turn
         closed = problem%ground%chain%chain_length(region%contact)
         do k = 1, size(other)
            if (other(k)%contact /= region%contact) cycle
            from = other(k)%end
            to = huge(to)
            do j = 1, size(other)
               if (other(j)%contact /= region%contact) cycle
               do turn = 0, 1
                  if (other(j)%start + turn * closed > from) to = min(to, other(j)%start + turn * closed)
               end do
            end do
            do turn = -1, 1
               if (from + turn * closed < region%start .or. to + turn * closed > region%end) cycle
               events = [events, ground_event_t(label, region%contact, from + turn * closed, to + turn * closed, .true.)]
               exit
            end do
         end do
      end subroutine divide_closed

      real(wp) function longest_element(contact)
         integer, intent(in) :: contact
         longest_element = maxval(problem%ground%chain%tributary, mask=problem%ground%chain%contact == contact)
      end function longest_element
   end subroutine find_ground_events

   !> Overlap of a region with another one and what is next to it, also once round a closed chain.
   pure logical function meet(a, b, reach, closed)
      type(region_t), intent(in) :: a, b
      real(wp), intent(in) :: reach            !! how far they may be apart
      real(wp), intent(in) :: closed           !! length of the closed chain, 0 when open
      integer :: turn
      meet = .false.
      do turn = -1, 1
         if (turn /= 0 .and. .not. closed > 0.0_wp) cycle
         meet = meet .or. (b%start + turn * closed <= a%end + reach .and. b%end + turn * closed >= a%start - reach)
      end do
   end function meet

   !> Positive on the side where the region is (whole).
   real(wp) function ground_event_value(problem, state, event) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ground_event_t), intent(in) :: event
      real(wp) :: closed
      closed = problem%ground%chain%chain_length(event%contact)
      ! The chain's list covers one round and the next.
      associate (back => merge(closed, 0.0_wp, event%from < 0.0_wp .and. closed > 0.0_wp))
         value = -extreme_gap(problem, state, event%contact, event%from + back, event%to + back, event%divided)
      end associate
   end function ground_event_value
end module ground_events
