!> Decides about an existing file with the name of a result file: results of unilat may be replaced, damaged files are renamed, and
!> all other files are left unchanged.
module former_file
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr, c_char, c_null_char, c_f_pointer, c_associated, c_null_ptr
   use hdf5, only: hid_t, h5f_acc_rdonly_f, h5fopen_f, h5fclose_f, h5fis_hdf5_f, h5oopen_f, h5oclose_f, h5aexists_f, h5aopen_f, &
      & h5aread_f, h5aget_type_f, h5aclose_f, h5tclose_f, h5tis_variable_str_f
   use posix_files, only: look_at, rename_file, error_text, kind_nothing, kind_empty, kind_folder, kind_other
   implicit none
   private
   public :: make_room, is_result, text_attribute

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
      integer(hid_t) :: file, root
      integer :: status, close_status
      logical :: is_hdf5, exists
      call h5fis_hdf5_f(name, is_hdf5, status)
      content = is_no_hdf5
      if (status < 0 .or. .not. is_hdf5) return
      content = is_damaged
      call h5fopen_f(name, h5f_acc_rdonly_f, file, status)
      if (status < 0) return
      call h5oopen_f(file, '/', root, status)
      if (status >= 0) then
         call h5aexists_f(root, 'program', exists, status)
         if (status >= 0) then
            content = is_foreign
            if (exists) content = merge(is_ours, is_foreign, text_attribute(root, 'program') == 'unilat')
         end if
         call h5oclose_f(root, close_status)
      end if
      call h5fclose_f(file, close_status)
   end function content

   !> Value of a text attribute of variable length; '' if the attribute is missing, has another type, or cannot be read.
   function text_attribute(place, name) result(text)
      integer(hid_t), intent(in) :: place
      character(*), intent(in) :: name
      character(:), allocatable :: text
      type(c_ptr), target :: pointer(1)
      type(c_ptr) :: data
      character(kind=c_char), pointer :: characters(:)
      integer(hid_t) :: attribute, text_type
      integer :: status, close_status, i
      logical :: varies
      text = ''
      pointer(1) = c_null_ptr
      data = c_loc(pointer)
      call h5aopen_f(place, name, attribute, status)
      if (status < 0) return
      call h5aget_type_f(attribute, text_type, status)
      if (status >= 0) then
         call h5tis_variable_str_f(text_type, varies, status)
         if (status >= 0 .and. varies) call h5aread_f(attribute, text_type, data, status)
         call h5tclose_f(text_type, close_status)
      end if
      call h5aclose_f(attribute, close_status)
      if (status < 0 .or. .not. c_associated(pointer(1))) return
      call c_f_pointer(pointer(1), characters, [huge(1)])
      do i = 1, huge(1) - 1
         if (characters(i) == c_null_char) exit
         text = text//characters(i)
      end do
   end function text_attribute
end module former_file
