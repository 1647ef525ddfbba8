!> A result file: its items, kept in memory, and the file with the same contents.
!>
!> A flush writes the whole contents to a temporary file, which then replaces the result file. If the program is ended at any
!> moment, the file has the contents of the last flush, or the former contents before the first flush. Readers never see a partly
!> written file and need no lock. If two runs write the same file, the second one is refused: a lock file exists next to the result
!> file while it is open.
!>
!> A full disk has no room for the new contents, but the file of the last flush must not say "running" for ever. So one text of the
!> file is stored with room behind it (text_with_room), in which closing overwrites it by the reason why the file could not be
!> replaced.
!>
!> After the first failure nothing is written any more, the first message is kept, and the caller obtains it with `file_error`.
!>
!> Of existing files with the name of a result file, results of unilat may be replaced, damaged files are renamed, and all others
!> are left unchanged (make_room).
module result_file
   use, intrinsic :: iso_c_binding, only: c_char, c_long, c_null_char
   use kinds, only: wp
   use errors, only: error_t, fail
   use memory, only: can_be_had
   use posix_files, only: resolved_name, lock_file, unlock_file, put_in_place, overwrite, what_is_there, error_text, is_locked, &
      & is_same, is_another, is_changed, is_missing, file_mark_t, look_at, rename_file, kind_nothing, kind_empty, kind_folder, &
      & kind_other, kind_pipe
   use printable_text, only: character_end
   use file_items, only: items_t, data_t, put_item, text_in
   use hdf5_image, only: start_library, make_image
   use hdf5_contents, only: is_hdf5, read_items
   implicit none
   private
   public :: result_file_t, table_t, file_create, file_flush, file_close, file_failed, file_error, file_note, put_group, put_data, &
      & put_attribute, text_with_room, is_result

   character(*), parameter :: lock_suffix = '.lock'    !! of the lock file beside a result file
   integer, parameter :: room = 400         !! bytes of the text with room
   character(*), parameter :: spare = achar(127)      !! a character that no text has, for the room behind the text
   real(wp), parameter :: little_memory = 16.0e6_wp   !! bytes: if this memory is not available, the library fails

   !> One growing table of a file, see growing_tables.
   type :: table_t
      character(:), allocatable :: group
      integer, allocatable :: column(:)         !! (columns) indices of the datasets in the file's list of items
      integer :: filled = 0                     !! columns that have their values in the present row
      integer :: rows = 0                       !! rows, the present one included
   end type table_t

   !> An open result file. With its default values it is closed: a flush does nothing.
   type :: result_file_t
      private
      type(items_t), public :: items            !! the contents
      type(table_t), allocatable, public :: table(:) !! the growing tables
      integer, public :: present = 0            !! table whose row is being filled
      character(:), allocatable, public :: continued !! names of tables that are continued from another file, each between line ends
      integer, allocatable, public :: continued_rows(:) !! number of rows of these tables
      logical :: is_open = .false.
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
   end type result_file_t

   !> Contents of a file:
   enum, bind(c)
      enumerator :: is_ours = 1, is_foreign, is_damaged, is_no_hdf5
   end enum

contains

   !> Opens a result file. An existing result file of this name is replaced at the first flush: programs that are reading it keep
   !> the old one. Any other file of this name that is not empty is not replaced. On failure the error contains the path and the
   !> reason.
   subroutine file_create(file, path, force)
      type(result_file_t), intent(out) :: file
      character(*), intent(in) :: path
      logical, intent(in), optional :: force    !! true: any file of this name is replaced; default: false
      character(:), allocatable :: owner, why
      integer :: status
      logical :: forced
      file%path = trim(path)
      call start_library(status)
      if (status < 0) file%message = 'the HDF5 library could not be started'
      if (status < 0) return
      call resolved_name(file%path, file%target, status)
      if (status == 0) call lock_file(file%target//lock_suffix, file%lock, owner, status)
      if (status /= 0) then
         why = error_text(status)
         if (status == is_locked) why = 'another run is writing it ('//owner//')'
         call refuse(file, 'cannot create the result file '//file%path//': '//why)
         return
      end if
      forced = .false.
      if (present(force)) forced = force
      call make_room(file%target, forced, file%note, why)
      file%is_open = why == ''
      if (file%is_open) return
      call refuse(file, 'cannot create the result file '//file%path//': '//why)
      call give_lock_back(file)
   end subroutine file_create

   !> Releases the lock, so that other runs can write the file.
   subroutine give_lock_back(file)
      type(result_file_t), intent(inout) :: file
      if (file%lock >= 0) call unlock_file(file%target//lock_suffix//c_null_char, file%lock)
      file%lock = -1
   end subroutine give_lock_back

   !> Stores a refusal by the system.
   subroutine refuse(file, message)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: message
      if (allocated(file%message)) return
      file%message = message
      file%system = .true.
   end subroutine refuse

   !> Keeps the first failure: "cannot <what> in the result file <path>".
   subroutine file_failed(file, what)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: what          !! action that failed, e.g. 'write /path/label'
      if (allocated(file%message)) return
      file%message = 'cannot '//what//' in the result file '//file%path
      if (can_be_had(little_memory)) return
      file%message = file%message//': there is not enough memory'
      file%system = .true.
   end subroutine file_failed

   !> The first failure as an error; not allocated if nothing has failed.
   subroutine file_error(file, error)
      type(result_file_t), intent(in) :: file
      type(error_t), allocatable, intent(out) :: error
      if (allocated(file%message)) call fail(error, file%message, file%system)
   end subroutine file_error

   !> Message for the user although nothing failed, returned once; empty: none.
   subroutine file_note(file, note)
      type(result_file_t), intent(inout) :: file
      character(:), allocatable, intent(out) :: note
      note = ''
      if (allocated(file%note)) call move_alloc(file%note, note)
   end subroutine file_note

   ! The contents ---------------------------------------------------------------------------------------------------

   !> Creates a group, if there is none of this name. The group above it must exist.
   subroutine put_group(file, path)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: path          !! full path, e.g. '/path/monitor'
      integer :: i
      call put_item(file%items, path, '', i)
   end subroutine put_group

   !> Stores a dataset of fixed size. A dataset of this name is replaced.
   subroutine put_data(file, path, values, units, description)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: path          !! full path; its group must exist
      type(data_t), intent(in) :: values
      character(*), intent(in) :: units, description
      integer :: i
      call put_item(file%items, path, '', i)
      associate (item => file%items%box(i)%item)
         item%values = values
         item%units = units
         item%description = description
      end associate
   end subroutine put_data

   !> Stores an attribute. An attribute of this name is replaced.
   subroutine put_attribute(file, path, name, value)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: path          !! full path of the group; '': the file itself
      character(*), intent(in) :: name
      type(data_t), intent(in) :: value         !! a text may have any length
      integer :: i
      call put_item(file%items, path, name, i)
      file%items%box(i)%item%values = value
   end subroutine put_attribute

   !> A text with room behind it, for an attribute: readers see the text alone.
   pure function text_with_room(text)
      character(*), intent(in) :: text          !! shorter than half the room
      character(room) :: text_with_room
      text_with_room = text//repeat(spare, room - len(text))
   end function text_with_room

   ! The file -------------------------------------------------------------------------------------------------------

   !> Replaces the result file by a file with the present contents, unless something failed.
   subroutine file_flush(file)
      type(result_file_t), intent(inout) :: file
      character(kind=c_char), allocatable :: bytes(:)
      character(:), allocatable :: failed
      integer :: status
      if (.not. file%is_open .or. allocated(file%message)) return
      call make_image(file%items, bytes, failed)
      if (failed /= '') call file_failed(file, failed)
      if (failed /= '') return
      call look_after(file)
      if (allocated(file%message)) return
      call clear_room(bytes, file%room_at)
      status = put_in_place(file%target//c_null_char, file%target//'.part'//c_null_char, bytes, size(bytes, kind=c_long), &
         & file%mark%number)
      file%flushed = .true.
      if (status /= 0) call refuse(file, 'cannot write the result file '//file%path//': '//error_text(status))
   end subroutine file_flush

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
      type(result_file_t), intent(in) :: file
      character(:), allocatable :: text
      integer :: status
      if (.not. file%flushed .or. file%room_at < 0 .or. .not. allocated(file%message)) return
      if (what_is_there(file%target//c_null_char, file%mark%number) /= is_same) return
      text = 'stopped: '//file%message
      text = text(:character_end(text, min(len(text), room - 1)))
      status = overwrite(file%target//c_null_char, int(file%room_at, c_long), text//repeat(c_null_char, room - len(text)), &
         & int(room, c_long))
   end subroutine leave_reason

   !> Checks whether another program has changed the file. A missing or truncated file is written again; another file of the same
   !> name is not replaced.
   subroutine look_after(file)
      type(result_file_t), intent(inout) :: file
      if (.not. file%flushed) return
      select case (what_is_there(file%target//c_null_char, file%mark%number))
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

   !> Writes the contents, unless something failed, and closes the file. A second call does nothing.
   subroutine file_close(file)
      type(result_file_t), intent(inout) :: file
      if (.not. file%is_open) return
      call file_flush(file)
      file%is_open = .false.
      call leave_reason(file)
      call give_lock_back(file)
   end subroutine file_close

   !> Checks whether a result file may have a name, and renames a damaged file of that name.
   subroutine make_room(name, force, note, why)
      character(*), intent(in) :: name            !! name of the file, with symbolic links resolved
      logical, intent(in) :: force                !! true: any plain file may be replaced
      character(:), allocatable, intent(inout) :: note !! out: with a message if a file was renamed
      character(:), allocatable, intent(out) :: why !! message that explains why the name cannot be used; '': it can
      character(:), allocatable :: aside
      integer :: kind, status
      why = ''
      status = look_at(name//c_null_char, kind)
      if (kind == kind_folder) then
         why = 'it is a directory'
      else if (kind == kind_other .or. kind == kind_pipe) then
         why = 'it is not a plain file'
      else if (status /= 0) then
         why = error_text(status)
      else if (kind /= kind_nothing .and. kind /= kind_empty .and. .not. force) then
         select case (content(name))
         case (is_foreign)
            why = 'the HDF5 file of that name is none of unilat''s; remove it, choose another name, or replace it with --force'
         case (is_no_hdf5)
            why = 'the file of that name is no HDF5 file; remove it, choose another name, or replace it with --force'
         case (is_damaged)
            aside = free_name(name)
            status = rename_file(name//c_null_char, aside//c_null_char)
            if (status /= 0) why = 'it is damaged, and cannot be moved away: '//error_text(status)
            note = 'the result file '//name//' that was there is damaged; it is kept as '//aside
         end select
      end if
   end subroutine make_room

   !> An unused name for a damaged file.
   function free_name(name) result(free)
      character(*), intent(in) :: name
      character(:), allocatable :: free
      character(12) :: digits
      integer :: number, kind, status
      free = name//'.damaged'
      number = 1
      do
         status = look_at(free//c_null_char, kind)
         if (kind == kind_nothing) return
         number = number + 1
         write (digits, '(i0)') number
         free = name//'.damaged-'//trim(digits)
      end do
   end function free_name

   !> True for a file that can be read and is a result of unilat.
   logical function is_result(name)
      character(*), intent(in) :: name
      is_result = content(name) == is_ours
   end function is_result

   !> Contents of a file that is not empty: is_ours, is_foreign, is_damaged or is_no_hdf5.
   integer function content(name)
      character(*), intent(in) :: name
      type(items_t) :: items
      logical :: readable
      content = is_no_hdf5
      if (.not. is_hdf5(name)) return
      call read_items(name, items, readable, root_only=.true.)
      content = is_damaged
      if (readable) content = merge(is_ours, is_foreign, text_in(items, '', 'program') == 'unilat')
   end function content
end module result_file
