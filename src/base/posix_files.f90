!> File operations of POSIX: resolution of links, locks, atomic replacement of files, checked writing. Implemented in posix_files.c;
!> this module provides interfaces with Fortran texts.
module posix_files
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_null_char
   implicit none
   private
   public :: resolved_name, look_at, lock_file, unlock_file, put_in_place, overwrite, what_is_there, rename_file, write_bytes
   public :: error_text, longest_name
   public :: kind_nothing, kind_empty, kind_file, kind_folder, kind_other, is_locked, is_closed, file_mark_t
   public :: is_same, is_missing, is_changed, is_another

   integer, parameter :: kind_nothing = 0, kind_empty = 1, kind_file = 2, kind_folder = 3, kind_other = 4
   integer, parameter :: is_same = 0, is_missing = 1, is_changed = 2, is_another = 3
   integer, parameter :: longest_name = 4096      !! [bytes] longest file name
   integer, parameter :: is_locked = -1           !! status of lock_file: another process has the lock
   integer, parameter :: is_closed = -2           !! status of write_bytes: the output is closed

   !> Identification of a file written by put_in_place, by which later changes by other programs are detected.
   type :: file_mark_t
      integer(c_long) :: number(3) = -1_c_long     !! device, inode, number of bytes
   end type file_mark_t

   interface
      integer(c_int) function c_resolve(name, target, size) bind(c, name='unilat_resolve')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)
         character(kind=c_char), intent(out) :: target(*)
         integer(c_long), value :: size
      end function c_resolve

      integer(c_int) function c_look_at(name, kind) bind(c, name='unilat_look_at')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), intent(out) :: kind
      end function c_look_at

      integer(c_int) function c_lock(name, descriptor, owner, size) bind(c, name='unilat_lock')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), intent(out) :: descriptor
         character(kind=c_char), intent(out) :: owner(*)
         integer(c_long), value :: size
      end function c_lock

      subroutine c_unlock(name, descriptor) bind(c, name='unilat_unlock')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: descriptor
      end subroutine c_unlock

      integer(c_int) function c_put(name, beside, bytes, count, mark) bind(c, name='unilat_put_in_place')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*), beside(*), bytes(*)
         integer(c_long), value :: count
         integer(c_long), intent(inout) :: mark(3)
      end function c_put

      integer(c_int) function c_overwrite(name, at, bytes, count) bind(c, name='unilat_overwrite')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*), bytes(*)
         integer(c_long), value :: at, count
      end function c_overwrite

      integer(c_int) function c_compare(name, mark) bind(c, name='unilat_compare')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)
         integer(c_long), intent(in) :: mark(3)
      end function c_compare

      integer(c_int) function c_rename(from, to) bind(c, name='unilat_rename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_rename

      integer(c_int) function c_write_all(descriptor, bytes, count) bind(c, name='unilat_write_all')
         import :: c_char, c_int, c_long
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_long), value :: count
      end function c_write_all

      subroutine c_error_text(number, text, size) bind(c, name='unilat_error_text')
         import :: c_char, c_int, c_long
         integer(c_int), value :: number
         character(kind=c_char), intent(out) :: text(*)
         integer(c_long), value :: size
      end subroutine c_error_text
   end interface

contains

   !> Name of the file to which a name leads through symbolic links; the file need not exist.
   subroutine resolved_name(name, target, status)
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: target !! name of the file
      integer, intent(out) :: status              !! 0, or errno: the error number of the system
      character(kind=c_char) :: buffer(longest_name)
      status = int(c_resolve(name//c_null_char, buffer, int(longest_name, c_long)))
      target = name
      if (status == 0) target = text_of(buffer)
   end subroutine resolved_name

   !> Kind of a file, and whether it may be replaced.
   subroutine look_at(name, kind, status)
      character(*), intent(in) :: name
      integer, intent(out) :: kind                !! kind of the file, kind_...
      integer, intent(out) :: status              !! 0, or errno: the file may not be replaced
      integer(c_int) :: found
      status = int(c_look_at(name//c_null_char, found))
      kind = int(found)
   end subroutine look_at

   !> Takes a lock, which the system removes when the process ends for any reason.
   subroutine lock_file(name, descriptor, owner, status)
      character(*), intent(in) :: name            !! name of the lock file
      integer, intent(out) :: descriptor          !! file descriptor that unlock_file needs
      character(:), allocatable, intent(out) :: owner !! process that has the lock, if the file is locked
      integer, intent(out) :: status              !! 0, is_locked, or errno
      character(kind=c_char) :: buffer(longest_name)
      integer(c_int) :: opened
      opened = -1
      buffer(1) = c_null_char
      status = int(c_lock(name//c_null_char, opened, buffer, int(longest_name, c_long)))
      descriptor = int(opened)
      owner = text_of(buffer)
   end subroutine lock_file

   !> Releases a lock.
   subroutine unlock_file(name, descriptor)
      character(*), intent(in) :: name
      integer, intent(in) :: descriptor           !! file descriptor from lock_file
      call c_unlock(name//c_null_char, int(descriptor, c_int))
   end subroutine unlock_file

   !> Writes a temporary file beside the file and then renames it to the file's name. If the program is ended at any moment, either
   !> the old or the new file exists, never a part of one.
   subroutine put_in_place(name, beside, bytes, mark, status)
      character(*), intent(in) :: name            !! name of the file to be written
      character(*), intent(in) :: beside          !! name of the temporary file, in the same folder
      character(kind=c_char), intent(in), contiguous :: bytes(:)
      type(file_mark_t), intent(inout) :: mark    !! identification of the new file
      integer, intent(out) :: status              !! 0, or errno: the old file is then unchanged
      status = int(c_put(name//c_null_char, beside//c_null_char, bytes, size(bytes, kind=c_long), mark%number))
   end subroutine put_in_place

   !> Overwrites bytes within a file; the length of the file does not change.
   subroutine overwrite(name, at, text, status)
      character(*), intent(in) :: name
      integer, intent(in) :: at                   !! number of bytes before the first byte that is overwritten
      character(*), intent(in) :: text            !! new bytes
      integer, intent(out) :: status              !! 0, or errno: the error number of the system
      status = int(c_overwrite(name//c_null_char, int(at, c_long), text, len(text, kind=c_long)))
   end subroutine overwrite

   !> Compares a file with the identification of an earlier file: is_same, is_missing, is_changed (another size) or is_another.
   integer function what_is_there(name, mark)
      character(*), intent(in) :: name
      type(file_mark_t), intent(in) :: mark
      what_is_there = int(c_compare(name//c_null_char, mark%number))
   end function what_is_there

   !> Renames a file.
   subroutine rename_file(from, to, status)
      character(*), intent(in) :: from, to
      integer, intent(out) :: status              !! 0, or errno: the error number of the system
      status = int(c_rename(from//c_null_char, to//c_null_char))
   end subroutine rename_file

   !> Writes text at once, without Fortran's buffers.
   subroutine write_bytes(descriptor, text, status)
      integer, intent(in) :: descriptor           !! file descriptor: 1: standard output, 2: standard error
      character(*), intent(in) :: text
      integer, intent(out) :: status              !! 0, is_closed, or errno
      status = int(c_write_all(int(descriptor, c_int), text//c_null_char, len(text, kind=c_long)))
   end subroutine write_bytes

   !> The system's message about an error number.
   function error_text(status) result(text)
      integer, intent(in) :: status
      character(:), allocatable :: text
      character(kind=c_char) :: buffer(300)
      call c_error_text(int(status, c_int), buffer, size(buffer, kind=c_long))
      text = text_of(buffer)
   end function error_text

   !> Text up to its terminating null character.
   pure function text_of(buffer) result(text)
      character(kind=c_char), intent(in) :: buffer(:)
      character(:), allocatable :: text
      integer :: n, i
      n = 0
      do while (n < size(buffer))
         if (buffer(n + 1) == c_null_char) exit
         n = n + 1
      end do
      allocate (character(n) :: text)
      do i = 1, n
         text(i:i) = buffer(i)
      end do
   end function text_of
end module posix_files
