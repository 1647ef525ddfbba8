!> The one error type. Kernels return it allocated when they failed; only the main program stops.
module errors
   implicit none
   private
   public :: error_t, fail

   !> An error that reached the caller; the text says what happened, where, and what was expected.
   type :: error_t
      character(:), allocatable :: message
      logical :: system = .false.   !! neither the deck's fault nor the program's: no room, no permission, in use, no memory
   end type error_t

contains

   !> Allocates the error with a text; the caller returns afterwards.
   subroutine fail(error, message, system)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: message
      logical, intent(in), optional :: system !! see error_t, default false
      allocate (error)
      error%message = message
      if (present(system)) error%system = system
   end subroutine fail
end module errors
