!> File operations of POSIX: resolution of links, locks, atomic replacement of files, checked writing. Implemented in posix_files.c.
module posix_files
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_null_char
   implicit none
   private
   public :: resolved_name, look_at, lock_file, unlock_file, put_in_place, overwrite, what_is_there, rename_file, write_bytes
   public :: error_text, longest_name
   public :: kind_nothing, kind_empty, kind_folder, kind_other, kind_pipe, is_locked, is_closed, file_mark_t
   public :: is_same, is_missing, is_changed, is_another

   integer, parameter :: kind_nothing = 0, kind_empty = 1, kind_folder = 3, kind_other = 4, kind_pipe = 5 !! 2: any other
   integer, parameter :: is_same = 0, is_missing = 1, is_changed = 2, is_another = 3
   integer, parameter :: longest_name = 4096      !! [bytes] longest file name
   integer, parameter :: is_locked = -1           !! status of lock_file: another process has the lock
   integer, parameter :: is_closed = -2           !! status of write_bytes: the output is closed

   !> Identification of a file written by put_in_place, by which later changes by other programs are detected.
   type :: file_mark_t
      integer(c_long) :: number(3) = -1_c_long     !! device, inode, number of bytes
   end type file_mark_t

   ! Texts passed to these procedures end with a null character. The functions return 0 or errno, the error number of the system,
   ! unless something else is stated.
   interface
      !> Kind of a file, kind_...; errno: the file may not be replaced.
      integer(c_int) function look_at(name, kind) bind(c, name='unilat_look_at')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), intent(out) :: kind
      end function look_at

      !> Releases a lock.
      subroutine unlock_file(name, descriptor) bind(c, name='unilat_unlock')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: descriptor           !! file descriptor from lock_file
      end subroutine unlock_file

      !> Writes a temporary file beside the file and then renames it to the file's name. If the program is ended at any moment,
      !> either the old or the new file exists, never a part of one; after an error the old file is unchanged.
      integer(c_int) function put_in_place(name, beside, bytes, count, mark) bind(c, name='unilat_put_in_place')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)    !! name of the file to be written
         character(kind=c_char), intent(in) :: beside(*)  !! name of the temporary file, in the same folder
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_long), value :: count                  !! number of bytes
         integer(c_long), intent(inout) :: mark(3)        !! identification of the new file, see file_mark_t
      end function put_in_place

      !> Overwrites bytes within a file; the length of the file does not change.
      integer(c_int) function overwrite(name, at, bytes, count) bind(c, name='unilat_overwrite')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*), bytes(*) !! name of the file; new bytes
         integer(c_long), value :: at                     !! number of bytes before the first byte that is overwritten
         integer(c_long), value :: count                  !! number of new bytes
      end function overwrite

      !> Compares a file with the identification of an earlier file: is_same, is_missing, is_changed (another size) or is_another.
      integer(c_int) function what_is_there(name, mark) bind(c, name='unilat_compare')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)
         integer(c_long), intent(in) :: mark(3)
      end function what_is_there

      !> Renames a file.
      integer(c_int) function rename_file(from, to) bind(c, name='unilat_rename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function rename_file

      !> Writes text at once, without Fortran's buffers; returns 0, is_closed, or errno.
      integer(c_int) function write_bytes(descriptor, bytes, count) bind(c, name='unilat_write_all')
         import :: c_char, c_int, c_long
         integer(c_int), value :: descriptor              !! file descriptor: 1: standard output, 2: standard error
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_long), value :: count                  !! number of bytes
      end function write_bytes

      integer(c_int) function c_resolve(name, target, size) bind(c, name='unilat_resolve')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)
         character(kind=c_char), intent(out) :: target(*)
         integer(c_long), value :: size
      end function c_resolve

      integer(c_int) function c_lock(name, descriptor, owner, size) bind(c, name='unilat_lock')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), intent(out) :: descriptor
         character(kind=c_char), intent(out) :: owner(*)
         integer(c_long), value :: size
      end function c_lock

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
