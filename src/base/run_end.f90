!> Detects that a signal or a time limit requires the run to end; both are recorded in posix_signals.c.
!>
!> The run ends between two increments. So that an increment with its searches for contact does not keep it, Newton's method and the
!> trials of contact sets give up as soon as the run must end (give_up_for_end): what is sought inside the increment is then not
!> found, and the increment is dropped.
!> The records of both are global state of the program (as is the clock of module timing), because signals belong to the process.
module run_end
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_long
   implicit none
   private
   public :: watch_for_end, give_up_for_end, has_given_up, reason_to_end, guard_exit, ends_by_itself, has_stack

   !> Reasons for an end, in the numbering of posix_signals.c:
   character(*), parameter :: reason(7) = [character(60) :: 'ended by SIGTERM', 'ended by SIGINT', 'ended by SIGHUP', &
      & 'ended by SIGXCPU: the limit of CPU time is used up', 'ended by SIGXFSZ: the limit of file sizes is reached', &
      & 'ended by SIGPIPE: nobody reads the listing any more', 'the seconds of --max-seconds are used up']

   logical :: given_up = .false.                 !! true: a computation was given up because the run must end

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

   !> True if the run must end. The caller then gives up what it is computing, which is recorded.
   logical function give_up_for_end()
      give_up_for_end = c_received() > 0
      given_up = given_up .or. give_up_for_end
   end function give_up_for_end

   !> True if a computation was given up because the run must end: whatever has failed since may have failed only for that.
   logical function has_given_up()
      has_given_up = given_up
   end function has_given_up

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
