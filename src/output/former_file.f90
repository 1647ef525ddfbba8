!> Decides about an existing file with the name of a result file: results of unilat may be replaced, damaged files are renamed, and
!> all other files are left unchanged.
module former_file
   use posix_files, only: look_at, rename_file, error_text, kind_nothing, kind_empty, kind_folder, kind_other
   use file_items, only: items_t, text_in
   use hdf5_contents, only: is_hdf5, read_items
   implicit none
   private
   public :: make_room, is_result

   !> Contents of a file:
   enum, bind(c)
      enumerator :: is_ours = 1, is_foreign, is_damaged, is_no_hdf5
   end enum

contains

   !> Checks whether a result file may have a name, and renames a damaged file of that name.
   subroutine make_room(name, force, note, why)
      character(*), intent(in) :: name            !! name of the file, with symbolic links resolved
      logical, intent(in) :: force                !! true: any plain file may be replaced
      character(:), allocatable, intent(inout) :: note !! out: with a message if a file was renamed
      character(:), allocatable, intent(out) :: why !! message that explains why the name cannot be used; '': it can
      character(:), allocatable :: aside
      integer :: kind, status
      why = ''
      call look_at(name, kind, status)
      if (kind == kind_folder) then
         why = 'it is a directory'
      else if (kind == kind_other) then
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
            call rename_file(name, aside, status)
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
         call look_at(free, kind, status)
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
end module former_file
