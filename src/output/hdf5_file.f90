!> A thin layer over the HDF5 library for writing one file.
!>
!> The library writes into memory. A flush writes the whole contents to a temporary file, which then replaces the result file. If
!> the program is ended at any moment, the file has the contents of the last flush, or the former contents before the first flush.
!> Readers never see a partly written file and need no lock. If two runs write the same file, the second one is refused: a lock file
!> exists next to the result file while it is open.
!>
!> A full disk has no room for the new contents, but the file of the last flush must not say "running" for ever. So one text of the
!> file is stored with room behind it (hdf5_room), in which closing overwrites it by the reason why the file could not be replaced.
!>
!> Handles are initially invalid, and every call first checks that no failure has occurred: after the first failure all calls do
!> nothing, the first message is kept, and the caller obtains it with `hdf5_error`. Closing the file closes all objects that are
!> open in it.
!> Array shapes are given in Fortran's order; a reader in C or Python sees them reversed.
module hdf5_file
   use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_ptr, c_null_char
   use hdf5, only: hid_t, size_t, h5dont_atexit_f, h5open_f, h5eset_auto_f, h5f_acc_trunc_f, h5f_close_strong_f, &
      & h5f_scope_global_f, h5fcreate_f, h5fclose_f, h5fflush_f, h5fget_file_image_f, h5p_file_access_f, h5p_group_create_f, &
      & h5pcreate_f, h5pset_fclose_degree_f, h5pset_fapl_core_f, h5pset_link_creation_order_f, h5p_crt_order_tracked_f, &
      & h5p_crt_order_indexed_f, h5pset_link_phase_change_f, h5pset_est_link_info_f, &
      & h5pclose_f, h5gcreate_f, h5gclose_f, h5fopen_f, h5f_acc_rdwr_f, h5lexists_f, h5ldelete_f, &
      & h5s_scalar_f, h5screate_f, h5sclose_f, h5tcopy_f, h5tclose_f, h5tset_cset_f, h5t_cset_utf8_f, h5t_string
   use kinds, only: wp
   use errors, only: error_t, fail
   use memory, only: can_be_had
   use posix_files, only: resolved_name, lock_file, unlock_file, put_in_place, overwrite, what_is_there, error_text, is_locked, &
      & is_same, is_another, is_changed, is_missing, file_mark_t
   use printable_text, only: character_end
   use former_file, only: make_room
   implicit none
   private
   public :: hdf5_file_t, hdf5_create, hdf5_group, hdf5_flush, hdf5_close, hdf5_ok, hdf5_failed, hdf5_error, hdf5_note
   public :: hdf5_has, hdf5_remove, hdf5_room

   integer(hid_t), parameter :: no_handle = -1_hid_t
   integer(size_t), parameter :: memory_step = 131072_size_t  !! bytes by which the file grows in memory
   integer, parameter :: most_compact = 64  !! members of a group up to which their names take the least room
   integer, parameter :: members = 12, letters = 16 !! members of a group, and bytes of their names, for which
   !! it has room from the beginning
   integer, parameter :: room = 400         !! bytes of the text with room
   character(*), parameter :: spare = achar(127)      !! a character that no text has, for the room behind the text
   real(wp), parameter :: little_memory = 16.0e6_wp   !! bytes: if this memory is not available, the library fails

   !> An open result file. With its default values it is closed and not ok: calls on it do nothing.
   type :: hdf5_file_t
      private
      integer(hid_t), public :: handle = no_handle
      integer(hid_t), public :: text_type = no_handle !! UTF-8 text of any length
      integer(hid_t), public :: single = no_handle !! space of one value
      integer(hid_t) :: layout = no_handle      !! creation properties of groups
      character(:), allocatable :: path         !! file name given by the caller
      character(:), allocatable :: target       !! file name with symbolic links resolved
      integer :: lock = -1                      !! descriptor of the lock file, while the result file is open
      type(file_mark_t) :: mark                 !! identification of the file written by the last flush
      integer :: room_at = -1                   !! number of bytes before the text with room; negative: there is none
      logical :: flushed = .false.              !! true: at least one flush was made
      logical, public :: meddled = .false.      !! true: afterwards another program removed or changed the file
      character(:), allocatable :: message      !! first failure; not allocated: none so far
      logical :: system = .false.               !! true: the failure was caused by the system, see error_t
      character(:), allocatable :: note         !! message for the user although nothing failed
   end type hdf5_file_t

contains

   !> Creates a result file. An existing result file of this name is replaced at the first flush: programs that are reading it keep
   !> the old one. Any other file of this name that is not empty is not replaced. On failure the error contains the path and the
   !> reason.
   subroutine hdf5_create(file, path, force, from)
      type(hdf5_file_t), intent(out) :: file
      character(*), intent(in) :: path
      logical, intent(in), optional :: force    !! true: any file of this name is replaced; default: false
      character(*), intent(in), optional :: from !! existing file with whose contents the new file begins; objects created again
      !! replace the old ones
      character(:), allocatable :: owner, why
      integer(hid_t) :: access
      integer :: status
      logical :: forced
      file%path = trim(path)
      ! After a failure the library's own clean-up at the end of the program would crash.
      call h5dont_atexit_f(status)
      call h5open_f(status)
      if (status < 0) file%message = 'the HDF5 library could not be started'
      if (status < 0) return
      call h5eset_auto_f(0, status) ! no messages printed by the library itself
      call resolved_name(file%path, file%target, status)
      if (status == 0) call lock_file(lock_name(file), file%lock, owner, status)
      if (status /= 0) then
         why = error_text(status)
         if (status == is_locked) why = 'another run is writing it ('//owner//')'
         call refuse(file, 'cannot create the result file '//file%path//': '//why)
         return
      end if
      forced = .false.
      if (present(force)) forced = force
      call make_room(file%target, forced, file%note, why)
      if (why /= '') then
         call refuse(file, 'cannot create the result file '//file%path//': '//why)
         call give_lock_back(file)
         return
      end if
      call h5pcreate_f(h5p_file_access_f, access, status)
      if (status >= 0) call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)
      if (status >= 0) call h5pset_fapl_core_f(access, memory_step, .false., status)
      if (status >= 0 .and. present(from)) then
         call h5fopen_f(from, h5f_acc_rdwr_f, file%handle, status, access_prp=access)
      else if (status >= 0) then
         call h5fcreate_f(file%target, h5f_acc_trunc_f, file%handle, status, access_prp=access)
      end if
      if (status >= 0) call h5tcopy_f(h5t_string, file%text_type, status)
      if (status >= 0) call h5tset_cset_f(file%text_type, h5t_cset_utf8_f, status)
      if (status >= 0) call h5screate_f(h5s_scalar_f, file%single, status)
      if (status >= 0) call h5pcreate_f(h5p_group_create_f, file%layout, status)
      if (status >= 0) call h5pset_link_creation_order_f(file%layout, ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f), status)
      if (status >= 0) call h5pset_est_link_info_f(file%layout, members, letters, status)
      if (status >= 0) call h5pset_link_phase_change_f(file%layout, most_compact, most_compact - 1, status)
      if (status < 0) then
         file%handle = no_handle
         call hdf5_failed(file, 'begin')
         call give_lock_back(file)
      end if
      call h5pclose_f(access, status)
   end subroutine hdf5_create

   !> Name of the lock file.
   pure function lock_name(file) result(name)
      type(hdf5_file_t), intent(in) :: file
      character(:), allocatable :: name
      name = file%target//'.lock'
   end function lock_name

   !> Releases the lock, so that other runs can write the file.
   subroutine give_lock_back(file)
      type(hdf5_file_t), intent(inout) :: file
      if (file%lock >= 0) call unlock_file(lock_name(file), file%lock)
      file%lock = -1
   end subroutine give_lock_back

   !> Stores a refusal by the system.
   subroutine refuse(file, message)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: message
      if (allocated(file%message)) return
      file%message = message
      file%system = .true.
   end subroutine refuse

   !> True while the file is open and nothing has failed.
   pure logical function hdf5_ok(file)
      type(hdf5_file_t), intent(in) :: file
      hdf5_ok = file%handle /= no_handle .and. .not. allocated(file%message)
   end function hdf5_ok

   !> Keeps the first failure: "cannot <what> in the result file <path>".
   subroutine hdf5_failed(file, what)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: what          !! action that failed, e.g. 'write /path/label'
      if (allocated(file%message)) return
      file%message = 'cannot '//what//' in the result file '//file%path
      if (can_be_had(little_memory)) return
      file%message = file%message//': there is not enough memory'
      file%system = .true.
   end subroutine hdf5_failed

   !> The first failure as an error; not allocated if nothing has failed.
   subroutine hdf5_error(file, error)
      type(hdf5_file_t), intent(in) :: file
      type(error_t), allocatable, intent(out) :: error
      if (allocated(file%message)) call fail(error, file%message, file%system)
   end subroutine hdf5_error

   !> Message for the user although nothing failed, returned once; empty: none.
   subroutine hdf5_note(file, note)
      type(hdf5_file_t), intent(inout) :: file
      character(:), allocatable, intent(out) :: note
      note = ''
      if (allocated(file%note)) call move_alloc(file%note, note)
   end subroutine hdf5_note

   !> True if a group or dataset exists.
   logical function hdf5_has(file, name)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: name
      integer :: status
      hdf5_has = .false.
      if (.not. hdf5_ok(file)) return
      call h5lexists_f(file%handle, name, hdf5_has, status)
   end function hdf5_has

   !> Removes a group or dataset, if it exists.
   subroutine hdf5_remove(file, name)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name
      integer :: status
      if (.not. hdf5_has(file, name)) return
      call h5ldelete_f(file%handle, name, status)
      if (status < 0) call hdf5_failed(file, 'remove '//name)
   end subroutine hdf5_remove

   !> Creates a group, if there is none of this name; the group above it must exist. Readers find its members in the order of their
   !> creation.
   subroutine hdf5_group(file, name)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name          !! full path, e.g. '/path/monitor'
      integer(hid_t) :: group
      integer :: status
      if (.not. hdf5_ok(file)) return
      call h5gcreate_f(file%handle, name, group, status, gcpl_id=file%layout)
      if (status >= 0) call h5gclose_f(group, status)
      if (status >= 0) return
      if (.not. hdf5_has(file, name)) call hdf5_failed(file, 'create group '//name)
   end subroutine hdf5_group

   !> Replaces the result file by everything written so far.
   subroutine hdf5_flush(file)
      type(hdf5_file_t), intent(inout) :: file
      character(kind=c_char), allocatable, target :: image(:)
      type(c_ptr) :: place
      integer(size_t) :: bytes
      integer :: status
      if (.not. hdf5_ok(file)) return
      call h5fflush_f(file%handle, h5f_scope_global_f, status)
      bytes = 0
      if (status >= 0) call h5fget_file_image_f(file%handle, place, 0_size_t, status, bytes)
      if (status >= 0) allocate (image(bytes), stat=status)
      if (status == 0) then
         place = c_loc(image)
         call h5fget_file_image_f(file%handle, place, bytes, status)
      else
         status = -1
      end if
      if (status < 0) call hdf5_failed(file, 'write')
      if (status < 0) return
      call look_after(file)
      if (allocated(file%message)) return
      call clear_room(image, file%room_at)
      call put_in_place(file%target, file%target//'.part', image, file%mark, status)
      file%flushed = .true.
      if (status /= 0) call refuse(file, 'cannot write the result file '//file%path//': '//error_text(status))
   end subroutine hdf5_flush

   !> A text with room behind it, for an attribute: readers see the text alone.
   pure function hdf5_room(text)
      character(*), intent(in) :: text          !! shorter than half the room
      character(room) :: hdf5_room
      hdf5_room = text//repeat(spare, room - len(text))
   end function hdf5_room

   !> Ends the text with room in the bytes of a file, as a C string, and finds its place; negative: the file has no such text.
   pure subroutine clear_room(image, at)
      character(kind=c_char), intent(inout) :: image(:)
      integer, intent(out) :: at                !! number of bytes before the text
      integer :: i, first, last
      at = -1
      ! Every row of spare characters as long as half the room has one at a multiple of half its length.
      do i = room / 2, size(image), room / 2
         if (image(i) /= spare) cycle
         first = i
         do while (first > 1)
            if (image(first - 1) /= spare) exit
            first = first - 1
         end do
         last = i
         do while (last < size(image))
            if (image(last + 1) /= spare) exit
            last = last + 1
         end do
         if (last - first < room / 2) cycle
         image(first:last) = c_null_char
         at = last - room
         return
      end do
   end subroutine clear_room

   !> Overwrites the text with room by the reason why the file could not be replaced. Nothing happens if another program has changed
   !> the file, or if the file system does not let it.
   subroutine leave_reason(file)
      type(hdf5_file_t), intent(in) :: file
      character(:), allocatable :: text
      integer :: status
      if (.not. file%flushed .or. file%room_at < 0 .or. .not. allocated(file%message)) return
      if (what_is_there(file%target, file%mark) /= is_same) return
      text = 'stopped: '//file%message
      text = text(:character_end(text, min(len(text), room - 1)))
      call overwrite(file%target, file%room_at, text//repeat(c_null_char, room - len(text)), status)
   end subroutine leave_reason

   !> Checks whether another program has changed the file. A missing or truncated file is written again; another file of the same
   !> name is not replaced.
   subroutine look_after(file)
      type(hdf5_file_t), intent(inout) :: file
      if (.not. file%flushed) return
      select case (what_is_there(file%target, file%mark))
      case (is_another)
         call refuse(file, 'the result file '//file%path//' was replaced by another file while the run was under way')
      case (is_changed)
         file%note = 'the result file '//file%path//' was changed while the run was under way; it was written again'
         file%meddled = .true.
      case (is_missing)
         file%note = 'the result file '//file%path//' was removed while the run was under way; it was written again'
         file%meddled = .true.
      end select
   end subroutine look_after

   !> Writes all data since the last flush, unless something failed, and closes the file and all objects open in it. A second call
   !> does nothing.
   subroutine hdf5_close(file)
      type(hdf5_file_t), intent(inout) :: file
      integer :: status
      if (file%handle == no_handle) return
      call hdf5_flush(file)
      call h5tclose_f(file%text_type, status)
      call h5sclose_f(file%single, status)
      call h5pclose_f(file%layout, status)
      call h5fclose_f(file%handle, status)
      file%handle = no_handle
      if (status < 0) call hdf5_failed(file, 'write the last data')
      call leave_reason(file)
      call give_lock_back(file)
   end subroutine hdf5_close
end module hdf5_file
