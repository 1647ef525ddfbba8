!> Terminals, and standard output with detection of failures.
!>
!> Colours are escape sequences (ECMA-48, SGR). A terminal gets them unless environment variable NO_COLOR is set (no-color.org) or
!> TERM is empty or "dumb". FORCE_COLOR requests colours also if the output is passed on to a terminal by another program. NO_COLOR
!> and FORCE_COLOR have no effect if they are empty.
!>
!> The Fortran runtime loses output that cannot be written, because a disk is full or a pipe closed, without a message. Short texts
!> are written as a whole. Fortran writes a listing line by line, and put_text writes its last byte: if previous lines could not be
!> written, the last byte cannot be written either.
module terminal
   use, intrinsic :: iso_c_binding, only: c_int, c_long
   use, intrinsic :: iso_fortran_env, only: output_unit
   use posix_files, only: write_bytes, error_text, is_closed
   implicit none
   private
   public :: is_terminal, has_colours, painted, standard_input, standard_output, standard_error, red, green, bold, put_text, &
      & open_draft, put_draft

   integer, parameter :: standard_input = 0, standard_output = 1, standard_error = 2 !! file descriptors of POSIX

   enum, bind(c)
      enumerator :: bold = 1, red = 31, green = 32 !! parameters of the escape sequence
   end enum

   interface
      !> POSIX function: 1 if a file descriptor is a terminal.
      integer(c_int) function c_isatty(descriptor) bind(c, name='isatty')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_isatty
   end interface

contains

   !> True if a file descriptor is a terminal.
   logical function is_terminal(descriptor)
      integer, intent(in) :: descriptor !! file descriptor, standard_...
      is_terminal = c_isatty(int(descriptor, c_int)) == 1
   end function is_terminal

   !> True if output to a file descriptor is coloured.
   logical function has_colours(descriptor)
      integer, intent(in) :: descriptor !! standard_output or standard_error
      character(4) :: kind
      integer :: length
      has_colours = .false.
      if (is_set('NO_COLOR')) return
      has_colours = is_set('FORCE_COLOR')
      if (has_colours) return
      if (.not. is_terminal(descriptor)) return
      call get_environment_variable('TERM', kind, length)
      has_colours = length > 0 .and. .not. (kind == 'dumb' .and. length == 4)
   end function has_colours

   !> Text in a colour, or unchanged.
   pure function painted(text, colour, wanted) result(string)
      character(*), intent(in) :: text
      integer, intent(in) :: colour  !! bold, red or green
      logical, intent(in) :: wanted  !! result of has_colours; false: the text is not changed
      character(:), allocatable :: string
      character(*), parameter :: escape = achar(27)//'['
      character(2) :: code
      string = text
      if (.not. wanted) return
      write (code, '(i0)') colour
      string = escape//trim(code)//'m'//text//escape//'0m'
   end function painted

   !> True if an environment variable exists and is not empty.
   logical function is_set(variable)
      character(*), intent(in) :: variable
      integer :: length
      call get_environment_variable(variable, length=length)
      is_set = length > 0
   end function is_set

   !> Writes text to standard output, after all text that Fortran has written there.
   subroutine put_text(text, why)
      character(*), intent(in) :: text
      character(:), allocatable, intent(out) :: why !! reason why output cannot be written; '': no failure
      integer :: status
      flush (output_unit)
      status = write_bytes(1, text, len(text, kind=c_long))
      why = ''
      if (status /= 0 .and. status /= is_closed) why = error_text(status)
   end subroutine put_text

   !> Opens a unit for formatted output, which put_draft writes to standard output.
   subroutine open_draft(unit)
      integer, intent(out) :: unit !! unit number of a scratch file
      open (newunit=unit, status='scratch', access='stream', form='formatted')
   end subroutine open_draft

   !> Writes the text of a draft to standard output, and closes the draft.
   subroutine put_draft(unit, why)
      integer, intent(in) :: unit                 !! unit from open_draft
      character(:), allocatable, intent(out) :: why !! reason why output cannot be written; '': no failure
      character(:), allocatable :: text
      character(1) :: letter
      integer :: length, i, status
      inquire (unit=unit, pos=length)
      allocate (character(length - 1) :: text)
      rewind (unit)
      do i = 1, len(text)
         read (unit, '(a)', advance='no', iostat=status) letter
         if (is_iostat_eor(status)) letter = new_line('a')
         text(i:i) = letter
      end do
      close (unit)
      call put_text(text, why)
   end subroutine put_draft
end module terminal
