!> What is lost and gained between two sets of touches of which nobody has seen how one became the other.
module set_differences
   use kinds, only: wp
   use contact_touch, only: touch_t
   implicit none
   private
   public :: differences_t, compare_sets

   !> How often each.
   type :: differences_t
      integer :: lost = 0, gained = 0, divided = 0, merged = 0
   end type differences_t

contains

   !> Contacts that go on keep their numbers: those that lie over each other, as well as nodes tell. Others are new.
   pure subroutine compare_sets(before, last, spacing, now, touch, differences)
      type(touch_t), intent(in) :: before(:)
      integer, intent(in) :: last                  !! number given last
      real(wp), intent(in) :: spacing(:)           !! (stretches) of the nodes that have told
      type(touch_t), intent(in) :: now(:)
      type(touch_t), intent(inout) :: touch(:)     !! those of `now` that get the numbers
      type(differences_t), intent(out) :: differences
      logical :: over(size(before), size(now))
      integer :: k, j
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
         j = findloc(over(:, k), .true., 1)
         ! Of a contact that has divided the first part goes on.
         if (j > 0) then
            if (findloc(over(j, :), .true., 1) == k) touch(k)%number = before(j)%number
         end if
      end do
      differences%lost = count(.not. any(over, 2))
      differences%gained = count(.not. any(over, 1))
      differences%divided = sum(max(count(over, 2) - 1, 0))
      differences%merged = sum(max(count(over, 1) - 1, 0))
   end subroutine compare_sets

   !> Distance of two contacts along the rod; huge where they are not on one stretch with one obstacle.
   pure real(wp) function apart(one, other)
      type(touch_t), intent(in) :: one, other
      apart = max(one%at(1) - other%at(2), other%at(1) - one%at(2))
      if (one%stretch /= other%stretch .or. one%contact /= other%contact) apart = huge(apart)
   end function apart
end module set_differences
