!> Checks before a run whether enough memory is available. (Otherwise the system would kill the run later.)
module memory
   use kinds, only: wp, i8
   implicit none
   private
   public :: can_be_had

contains

   !> True if the given number of bytes can be allocated. The memory is not accessed, so that the check takes no time.
   logical function can_be_had(bytes)
      real(wp), intent(in) :: bytes
      ! volatile: the compiler must not remove the unused array.
      real(wp), allocatable, volatile :: space(:)
      integer :: status
      can_be_had = bytes < real(huge(1_i8), wp)
      if (.not. can_be_had) return
      allocate (space(int(bytes, i8) / 8), stat=status)
      can_be_had = status == 0
   end function can_be_had
end module memory
