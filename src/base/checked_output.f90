!> Standard output with an eye on failures: the Fortran runtime loses what cannot be written (a full disk, a reader that has left)
!> without a word.
!>
!> Short texts are written at once and whole. A listing is written line by line by Fortran, and its very last byte by put_text:
!> where there was no room for what came before there is none for that either.
module checked_output
   use, intrinsic :: iso_fortran_env, only: output_unit
   use posix_files, only: write_bytes, error_text, is_closed
   implicit none
   private
   public :: put_text, open_draft, put_draft

contains

   !> Writes text behind what Fortran has written.
   subroutine put_text(text, why)
      character(*), intent(in) :: text
      character(:), allocatable, intent(out) :: why !! it, or what came before, cannot be written; empty: all is well
      integer :: status
      flush (output_unit)
      call write_bytes(1, text, status)
      why = ''
      if (status /= 0 .and. status /= is_closed) why = error_text(status)
   end subroutine put_text

   !> A unit for formatted output that put_draft writes.
   subroutine open_draft(unit)
      integer, intent(out) :: unit
      open (newunit=unit, status='scratch', access='stream', form='formatted')
   end subroutine open_draft

   !> Writes what was written to a draft to standard output, and closes the draft.
   subroutine put_draft(unit, why)
      integer, intent(in) :: unit                 !! of open_draft
      character(:), allocatable, intent(out) :: why !! as in put_text
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
