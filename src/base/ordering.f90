!> Sorting of short lists.
module ordering
   use kinds, only: wp
   implicit none
   private
   public :: ascending

contains

   !> Indices that sort a list in ascending order of its numbers. Entries with equal numbers keep their order, so that a list sorted
   !> by one number and then by another is sorted by the second, and where this is equal by the first.
   pure function ascending(number) result(order)
      real(wp), intent(in) :: number(:)
      integer :: order(size(number)), i, j
      do i = 1, size(number)
         do j = i - 1, 1, -1
            if (number(order(j)) <= number(i)) exit
            order(j + 1) = order(j)
         end do
         order(j + 1) = i
      end do
   end function ascending
end module ordering
