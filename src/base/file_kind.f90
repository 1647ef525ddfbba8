!> Checks that a name in the file system is that of a file that can be read from beginning to end.
module file_kind
   use, intrinsic :: iso_c_binding, only: c_ptr, c_char, c_int, c_long, c_null_char, c_associated
   use errors, only: error_t, fail
   use printable_text, only: quoted_path
   implicit none
   private
   public :: check_file

   interface
      type(c_ptr) function c_fopen(path, mode) bind(c, name='fopen')
         import :: c_ptr, c_char
         character(kind=c_char), intent(in) :: path(*), mode(*)
      end function c_fopen

      integer(c_long) function c_ftell(stream) bind(c, name='ftell')
         import :: c_ptr, c_long
         type(c_ptr), value :: stream
      end function c_ftell

      integer(c_int) function c_fclose(stream) bind(c, name='fclose')
         import :: c_ptr, c_int
         type(c_ptr), value :: stream
      end function c_fclose
   end interface

contains

   !> Rejects folders and pipes. Names of files that the shell has opened are accepted even if they are pipes: unilat <(command).
   subroutine check_file(path, error)
      character(*), intent(in) :: path                 !! name of the file to be read
      type(error_t), allocatable, intent(out) :: error !! allocated: the name is that of a folder or a pipe (a missing file is not
      !! an error here)
      logical :: there
      integer :: bytes
      inquire (file=path//'/.', exist=there)
      if (there) then
         call fail(error, quoted_path(path)//' is a folder; a deck is a file')
         return
      end if
      inquire (file=path, exist=there, size=bytes)
      if (.not. there .or. bytes > 0) return
      if (any([index(path, '/dev/stdin'), index(path, '/dev/fd/'), index(path, '/proc/self/fd/')] == 1)) return
      if (is_pipe(path)) call fail(error, quoted_path(path)//' is empty, or a pipe; a deck from a pipe is read from standard input')
   end subroutine check_file

   !> True for a pipe, and for an empty file that must not be opened for update. (A pipe opened for update does not wait for its
   !> writing end, and its position cannot be determined.)
   logical function is_pipe(path)
      character(*), intent(in) :: path
      type(c_ptr) :: stream
      integer(c_int) :: status
      stream = c_fopen(path//c_null_char, 'r+'//c_null_char)
      is_pipe = .true.
      if (.not. c_associated(stream)) return
      is_pipe = c_ftell(stream) < 0
      status = c_fclose(stream)
   end function is_pipe
end module file_kind
