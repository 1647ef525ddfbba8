!> The error type. A procedure that fails returns it allocated; only the main program stops.
module errors
   implicit none
   private
   public :: error_t, fail

   !> An error that is returned to the caller. Its text describes what happened, where, and what was expected.
   type :: error_t
      character(:), allocatable :: message
      logical :: system = .false. !! true: the error is caused neither by the deck nor by the program: no disk space, no permission,
      !! file in use, no memory
   end type error_t

contains

   !> Allocates an error with a text; the calling procedure then returns.
   subroutine fail(error, message, system)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: message     !! what happened, where, and what was expected
      logical, intent(in), optional :: system !! see component `system` of error_t; default: false
      allocate (error)
      error%message = message
      if (present(system)) error%system = system
   end subroutine fail
end module errors
