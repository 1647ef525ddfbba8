!> What is lost and gained between two sets of touches of which nobody has seen how one became the other.
module set_differences
   use kinds, only: wp
   use contact_spans, only: contact_span_t
   implicit none
   private
   public :: differences_t, compare_sets

   !> How often each.
   type :: differences_t
      integer :: lost = 0, gained = 0, divided = 0, merged = 0
   end type differences_t

contains

   !> Contacts that go on keep their numbers: those that lie over each other, as well as nodes tell. Others are new. The parts of a
   !> line on both sides of a breakpoint are one contact, and what goes from one side to the other goes on.
   pure subroutine compare_sets(before, last, spacing, start, round, now, touch, differences)
      type(contact_span_t), intent(in) :: before(:)
      integer, intent(in) :: last                  !! number given last
      real(wp), intent(in) :: spacing(:)           !! (stretches) of the nodes that have told
      real(wp), intent(in) :: start(:, :)          !! (stretches, contacts) where they begin along the chains
      real(wp), intent(in) :: round(:)             !! (contacts) length of a closed chain, 0 where it is open
      type(contact_span_t), intent(in) :: now(:)
      type(contact_span_t), intent(inout) :: touch(:)     !! those of `now` that get the numbers
      type(differences_t), intent(out) :: differences
      logical :: over(size(before), size(now)), both(size(before), size(now))
      integer :: k, j, part(size(before)), part_now(size(now))
      do k = 1, size(now)
         over(:, k) = [(apart(before(j), now(k)) <= 0.0_wp, j=1, size(before))]
      end do
      do k = 1, size(now)
         if (any(over(:, k))) cycle
         do j = 1, size(before)
            if (any(over(j, :)) .or. apart(before(j), now(k)) > spacing(now(k)%stretch)) cycle
            over(j, k) = .true.
            exit
         end do
      end do
      do k = 1, size(now)
         touch(k)%number = last + k
         j = findloc(over(:, k) .and. before%stretch == now(k)%stretch, .true., 1)
         if (j == 0) j = findloc(over(:, k), .true., 1)
         ! Of a contact that has divided the first part goes on.
         if (j > 0) then
            if (findloc(over(j, :) .and. (now%stretch == before(j)%stretch .or. .not. any(over(j, :) .and. now%stretch == &
               & before(j)%stretch)), .true., 1) == k) touch(k)%number = before(j)%number
         end if
      end do
      part = first_parts(before)
      part_now = first_parts(now)
      both = .false.
      do k = 1, size(now)
         do j = 1, size(before)
            if (over(j, k)) both(part(j), part_now(k)) = .true.
         end do
      end do
      associate (whole => part == [(j, j=1, size(part))], whole_now => part_now == [(k, k=1, size(part_now))])
         differences%lost = count(whole .and. .not. any(both, 2))
         differences%gained = count(whole_now .and. .not. any(both, 1))
         differences%divided = sum(max(count(both, 2) - 1, 0))
         differences%merged = sum(max(count(both, 1) - 1, 0))
      end associate

   contains

      !> Distance of two contacts along the rod; huge where they are not with one obstacle.
      pure real(wp) function apart(one, other)
         type(contact_span_t), intent(in) :: one, other
         real(wp) :: a(2), b(2)
         apart = huge(apart)
         if (one%contact /= other%contact) return
         a = one%at + start(one%stretch, one%contact)
         b = other%at + start(other%stretch, other%contact)
         apart = max(a(1) - b(2), b(1) - a(2))
         ! Where a chain closes the way may be shorter the other way round.
         if (round(one%contact) > 0.0_wp) apart = min(apart, round(one%contact) + min(a(1) - b(2), b(1) - a(2)))
      end function apart
   end subroutine compare_sets

   !> For each touch the first one of its contact: parts of a line share the node of the breakpoint between them.
   pure function first_parts(set) result(first)
      type(contact_span_t), intent(in) :: set(:)
      integer :: first(size(set)), k, j
      first = [(k, k=1, size(set))]
      do k = 2, size(set)
         do j = 1, k - 1
            if (any(set(k)%candidate == set(j)%candidate([2, 1]))) where (first == first(k)) first = first(j)
         end do
      end do
   end function first_parts
end module set_differences
