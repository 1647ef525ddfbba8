!> Detects that a signal or a time limit requires the run to end; both are recorded in posix_signals.c.
!>
!> These records are global state of the program (as is the clock of module timing), because signals belong to the process.
module run_end
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_long
   implicit none
   private
   public :: watch_for_end, reason_to_end, guard_exit, ends_by_itself, has_stack

   !> Reasons for an end, in the numbering of posix_signals.c:
   character(*), parameter :: reason(7) = [character(60) :: 'ended by SIGTERM', 'ended by SIGINT', 'ended by SIGHUP', &
      & 'ended by SIGXCPU: the limit of CPU time is used up', 'ended by SIGXFSZ: the limit of file sizes is reached', &
      & 'ended by SIGPIPE: nobody reads the listing any more', 'the seconds of --max-seconds are used up']

   interface
      !> After this call the signals TERM, INT, HUP, XCPU, XFSZ and PIPE are recorded instead of ending the program; a second TERM,
      !> INT or HUP ends it.
      subroutine watch_for_end(max_seconds) bind(c, name='unilat_watch')
         import :: c_double
         real(c_double), value :: max_seconds !! time from this call until the run must end [s]; 0: no limit
      end subroutine watch_for_end

      integer(c_int) function c_received() bind(c, name='unilat_received')
         import :: c_int
      end function c_received

      !> Sets the exit codes for an end of the program by the Fortran runtime.
      subroutine guard_exit(without_memory, otherwise) bind(c, name='unilat_guard_exit')
         import :: c_int
         integer(c_int), value :: without_memory !! exit code of the program if an array could not be allocated
         integer(c_int), value :: otherwise
      end subroutine guard_exit

      !> Announces that the program ends regularly: the exit codes of guard_exit then no longer apply.
      subroutine ends_by_itself() bind(c, name='unilat_ends_by_itself')
      end subroutine ends_by_itself

      integer(c_int) function c_has_stack(bytes) bind(c, name='unilat_has_stack')
         import :: c_int, c_long
         integer(c_long), value :: bytes
      end function c_has_stack
   end interface

contains

   !> Message that explains why the run must end; '' if it need not end.
   function reason_to_end() result(words)
      character(:), allocatable :: words
      integer :: number
      number = int(c_received())
      words = ''
      if (number > 0) words = trim(reason(number))
   end function reason_to_end

   !> Ensures a stack of at least a given size. False if the system's limit is smaller.
   logical function has_stack(bytes)
      integer, intent(in) :: bytes !! size of the stack [bytes]
      has_stack = c_has_stack(int(bytes, c_long)) == 0
   end function has_stack
end module run_end
