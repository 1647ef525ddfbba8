!> A thin layer over the HDF5 library for writing one file.
!>
!> Handles start invalid and every call is guarded by "if still ok": after the first failure nothing more is done,
!> the first error text is kept, and the caller asks for it once (`hdf5_error`). Closing the file closes whatever is
!> open in it.
!> Array shapes are given the Fortran way; a reader in C or Python sees them reversed.
module hdf5_file
   use hdf5, only: hid_t, h5dont_atexit_f, h5open_f, h5eset_auto_f, h5f_acc_trunc_f, h5f_acc_rdonly_f, &
      & h5f_close_strong_f, h5f_scope_global_f, h5fopen_f, h5fcreate_f, h5fclose_f, h5fflush_f, h5p_file_access_f, &
      & h5p_group_create_f, h5pcreate_f, h5pset_fclose_degree_f, h5pset_link_creation_order_f, &
      & h5p_crt_order_tracked_f, h5p_crt_order_indexed_f, h5pclose_f, h5gcreate_f, h5gclose_f
   use errors, only: error_t, fail
   implicit none
   private
   public :: hdf5_file_t, hdf5_create, hdf5_group, hdf5_flush, hdf5_close, hdf5_ok, hdf5_failed, hdf5_error

   integer(hid_t), parameter :: no_handle = -1_hid_t

   !> An open result file. A default-initialised one is closed and not ok: calls on it do nothing.
   type :: hdf5_file_t
      private
      integer(hid_t), public :: handle = no_handle
      character(:), allocatable :: path
      character(:), allocatable :: message      !! first failure; not allocated: none so far
   end type hdf5_file_t

contains

   !> Creates a file. A result file of that name is replaced: whoever is reading it keeps the old one. Anything else of
   !> that name that is not empty is left alone. On failure the error names the path and says why.
   subroutine hdf5_create(file, path)
      type(hdf5_file_t), intent(out) :: file
      character(*), intent(in) :: path
      integer(hid_t) :: access
      integer :: status
      file%path = trim(path)
      ! After a failed write (disk full) the library's own clean-up at the end of the program would crash.
      call h5dont_atexit_f(status)
      call h5open_f(status)
      if (status < 0) file%message = 'the HDF5 library could not be started'
      if (status < 0) return
      call h5eset_auto_f(0, status) ! the library is not to print on its own
      call remove_old(file)
      if (allocated(file%message)) return
      call h5pcreate_f(h5p_file_access_f, access, status)
      if (status >= 0) call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)
      ! The oldest file format on purpose: newer ones carry an "open for writing" mark that a killed run would leave.
      if (status >= 0) call h5fcreate_f(file%path, h5f_acc_trunc_f, file%handle, status, access_prp=access)
      if (status < 0) then
         file%handle = no_handle
         file%message = 'cannot create the result file '//file%path//': ' &
            & //reason(file%path, 'the HDF5 library refuses it')
      end if
      call h5pclose_f(access, status)
   end subroutine hdf5_create

   !> Deletes the file of a former run. The library would overwrite it before asking whether anyone is using it.
   subroutine remove_old(file)
      type(hdf5_file_t), intent(inout) :: file
      integer(hid_t) :: old
      integer :: length, unit, status
      inquire (file=file%path, size=length)
      if (length <= 0) return
      call h5fopen_f(file%path, h5f_acc_rdonly_f, old, status)
      if (status < 0) then
         file%message = 'cannot create the result file '//file%path//': '//reason(file%path, 'the file of that name ' &
            & //'is no HDF5 file, is damaged, or is being written by another run; remove it or choose another name')
         return
      end if
      call h5fclose_f(old, status)
      open (newunit=unit, file=file%path, status='old', action='readwrite', iostat=status)
      if (status == 0) close (unit, status='delete', iostat=status)
   end subroutine remove_old

   !> Why a file cannot be written, in the words of the Fortran runtime: the HDF5 library has none.
   function reason(path, otherwise) result(text)
      character(*), intent(in) :: path
      character(*), intent(in) :: otherwise     !! the answer when Fortran can write it
      character(:), allocatable :: text
      character(300) :: message
      logical :: existed
      integer :: unit, status
      inquire (file=path, exist=existed)
      open (newunit=unit, file=path, action='readwrite', iostat=status, iomsg=message)
      if (status /= 0) then
         text = trim(message)
      else
         text = otherwise
         if (existed) then
            close (unit)
         else
            close (unit, status='delete')
         end if
      end if
   end function reason

   !> True while the file is open and nothing has failed.
   pure logical function hdf5_ok(file)
      type(hdf5_file_t), intent(in) :: file
      hdf5_ok = file%handle /= no_handle .and. .not. allocated(file%message)
   end function hdf5_ok

   !> Keeps the first failure: "cannot <what> in the result file <path>".
   subroutine hdf5_failed(file, what)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: what          !! what was tried, e.g. 'write /path/label'
      if (allocated(file%message)) return
      file%message = 'cannot '//what//' in the result file '//file%path//' (is the disk full?)'
   end subroutine hdf5_failed

   !> The first failure as an error; not allocated when nothing has failed.
   subroutine hdf5_error(file, error)
      type(hdf5_file_t), intent(in) :: file
      type(error_t), allocatable, intent(out) :: error
      if (allocated(file%message)) call fail(error, file%message)
   end subroutine hdf5_error

   !> Creates a group, in which readers find the members in the order of their creation; the group above it must exist.
   subroutine hdf5_group(file, name)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name          !! full path, e.g. '/path/monitor'
      integer(hid_t) :: group, layout
      integer :: status, close_status
      if (.not. hdf5_ok(file)) return
      call h5pcreate_f(h5p_group_create_f, layout, status)
      if (status >= 0) then
         call h5pset_link_creation_order_f(layout, ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f), status)
         if (status >= 0) call h5gcreate_f(file%handle, name, group, status, gcpl_id=layout)
         if (status >= 0) call h5gclose_f(group, status)
         call h5pclose_f(layout, close_status)
      end if
      if (status < 0) call hdf5_failed(file, 'create group '//name)
   end subroutine hdf5_group

   !> Hands everything written so far to the operating system: from here on a killed run leaves it readable.
   subroutine hdf5_flush(file)
      type(hdf5_file_t), intent(inout) :: file
      integer :: status
      if (.not. hdf5_ok(file)) return
      call h5fflush_f(file%handle, h5f_scope_global_f, status)
      if (status < 0) call hdf5_failed(file, 'write')
   end subroutine hdf5_flush

   !> Closes the file and every object open in it, after a failure too. Closing twice does no harm.
   subroutine hdf5_close(file)
      type(hdf5_file_t), intent(inout) :: file
      integer :: status
      if (file%handle == no_handle) return
      call h5fclose_f(file%handle, status)
      file%handle = no_handle
      if (status < 0) call hdf5_failed(file, 'write the last data')
   end subroutine hdf5_close
end module hdf5_file
