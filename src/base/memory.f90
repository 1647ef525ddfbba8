!> Whether so much memory can be had, before a run that would be ended from outside for want of it.
module memory
   use kinds, only: wp, i8
   implicit none
   private
   public :: can_be_had

contains

   !> True where so many bytes can be allocated. They are not touched, so it takes no time.
   logical function can_be_had(bytes)
      real(wp), intent(in) :: bytes
      ! Not left out for being of no use.
      real(wp), allocatable, volatile :: space(:)
      integer :: status
      can_be_had = bytes < real(huge(1_i8), wp)
      if (.not. can_be_had) return
      allocate (space(int(bytes, i8) / 8), stat=status)
      can_be_had = status == 0
   end function can_be_had
end module memory
