!> Standard output with detection of failures. (The Fortran runtime loses output that cannot be written, because a disk is full or a
!> pipe closed, without a message.)
!>
!> Short texts are written as a whole. Fortran writes a listing line by line, and put_text writes its last byte: if previous lines
!> could not be written, the last byte cannot be written either.
module checked_output
   use, intrinsic :: iso_fortran_env, only: output_unit
   use posix_files, only: write_bytes, error_text, is_closed
   implicit none
   private
   public :: put_text, open_draft, put_draft

contains

   !> Writes text to standard output, after all text that Fortran has written there.
   subroutine put_text(text, why)
      character(*), intent(in) :: text
      character(:), allocatable, intent(out) :: why !! reason why output cannot be written; '': no failure
      integer :: status
      flush (output_unit)
      call write_bytes(1, text, status)
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
end module checked_output
