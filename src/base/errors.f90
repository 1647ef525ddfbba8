!> The error type. Procedures return it allocated if they fail; only the main program stops.
module errors
   implicit none
   private
   public :: error_t, fail

   !> An error that is returned to the caller; the text says what happened, where, and what was expected.
   type :: error_t
      character(:), allocatable :: message
      logical :: system = .false.   !! true: caused neither by the deck nor by the program: no disk space, no permission, file in
      !! use, no memory
   end type error_t

contains

   !> Allocates an error with a text; the caller then returns.
   subroutine fail(error, message, system)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: message     !! what happened, where, and what was expected
      logical, intent(in), optional :: system !! see error_t, default false
      allocate (error)
      error%message = message
      if (present(system)) error%system = system
   end subroutine fail
end module errors
