!> The one error type. Kernels return it allocated when they failed; only the main program stops.
module errors
   implicit none
   private
   public :: error_t, fail

   !> An error that reached the caller; the text says what happened, where, and what was expected.
   type :: error_t
      character(:), allocatable :: message
   end type error_t

contains

   !> Allocates the error with a text; the caller returns afterwards.
   subroutine fail(error, message)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: message
      allocate (error)
      error%message = message
   end subroutine fail
end module errors
