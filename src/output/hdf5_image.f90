!> Items as the bytes of an HDF5 file. The library works in memory; all objects of the file are created at once, in their order.
!>
!> Every dataset has the attributes `units` and `description`. Datasets have fixed sizes: chunks that could be extended take three
!> times the time and five times the room. Array shapes are given in Fortran's order; a reader in C or Python sees them reversed.
module hdf5_image
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char
   use hdf5, only: hid_t, hsize_t, size_t, h5dont_atexit_f, h5open_f, h5eset_auto_f, h5f_acc_trunc_f, h5f_close_strong_f, &
      & h5f_scope_global_f, h5fcreate_f, h5fclose_f, h5fflush_f, h5fget_file_image_f, h5p_file_access_f, h5p_group_create_f, &
      & h5pcreate_f, h5pclose_f, h5pset_fclose_degree_f, h5pset_fapl_core_f, h5pset_link_creation_order_f, &
      & h5p_crt_order_tracked_f, h5p_crt_order_indexed_f, h5pset_link_phase_change_f, h5pset_est_link_info_f, h5gcreate_f, &
      & h5gopen_f, h5gclose_f, h5acreate_f, h5awrite_f, h5aclose_f, h5dcreate_f, h5dwrite_f, h5dclose_f, h5screate_f, &
      & h5screate_simple_f, h5sclose_f, h5s_scalar_f, h5tcopy_f, h5tclose_f, h5tset_cset_f, h5tset_size_f, h5tset_strpad_f, &
      & h5t_cset_utf8_f, h5t_str_nullpad_f, h5t_fortran_s1, h5t_string, h5t_native_double, h5t_native_integer
   use kinds, only: i8
   use file_items, only: items_t, item_t, data_t, is_real, is_integer, is_text
   implicit none
   private
   public :: start_library, make_image, value_type

   integer(hid_t), parameter :: none = -1_hid_t
   character(*), parameter :: nowhere = '/dev/null/nowhere' !! a name that no file has: the library would read a file of that name
   integer(size_t), parameter :: memory_step = 131072_size_t  !! bytes by which the file grows in memory
   integer, parameter :: most_compact = 64  !! members of a group up to which their names take the least room
   integer, parameter :: members = 12, letters = 16 !! members of a group, and bytes of their names, for which it has room from the
   !! beginning

   !> What all items of a file need.
   type :: image_t
      integer(hid_t) :: file = none             !! the file
      integer(hid_t) :: any_text = none         !! type of UTF-8 text of any length
      integer(hid_t) :: single = none           !! space of one value
      integer(hid_t) :: layout = none           !! creation properties of groups
      integer(hid_t) :: group = none            !! the group that was used last
      character(:), allocatable :: path         !! its full path; '': the root
   end type image_t

contains

   !> Starts the library, which prints no messages of its own. A second call does nothing.
   subroutine start_library(status)
      integer, intent(out) :: status            !! negative if it failed
      ! After a failure the library's own clean-up at the end of the program would crash.
      call h5dont_atexit_f(status)
      call h5open_f(status)
      if (status >= 0) call h5eset_auto_f(0, status)
   end subroutine start_library

   !> Makes a file of items. The group of an item must come before it.
   subroutine make_image(items, bytes, failed)
      type(items_t), intent(in), target :: items
      character(kind=c_char), allocatable, target, intent(out) :: bytes(:) !! the file
      character(:), allocatable, intent(out) :: failed !! action that failed, e.g. 'write /path/label'; '': none
      type(image_t) :: image
      type(c_ptr) :: place
      integer(size_t) :: length
      integer :: i, status, close_status
      failed = ''
      call begin_file(image, status)
      do i = 1, items%n
         if (status < 0) exit
         if (.not. allocated(items%box(i)%item)) cycle
         call write_item(image, items%box(i)%item, status)
         if (status < 0) failed = 'write '//items%box(i)%item%path
      end do
      length = 0
      if (status >= 0) call h5fflush_f(image%file, h5f_scope_global_f, status)
      if (status >= 0) call h5fget_file_image_f(image%file, place, 0_size_t, status, length)
      if (status >= 0) then
         allocate (bytes(length), stat=status)
         if (status > 0) status = -1
      end if
      if (status >= 0) then
         place = c_loc(bytes)
         call h5fget_file_image_f(image%file, place, length, status)
      end if
      if (status < 0 .and. failed == '') failed = 'write'
      if (image%file == none) return
      call leave_group(image)
      call h5tclose_f(image%any_text, close_status)
      call h5sclose_f(image%single, close_status)
      call h5pclose_f(image%layout, close_status)
      call h5fclose_f(image%file, close_status)
   end subroutine make_image

   !> Creates an empty file in memory.
   subroutine begin_file(image, status)
      type(image_t), intent(inout) :: image
      integer, intent(out) :: status            !! negative if it failed
      integer(hid_t) :: access
      integer :: close_status
      image%path = '?'
      call h5pcreate_f(h5p_file_access_f, access, status)
      if (status >= 0) call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)
      if (status >= 0) call h5pset_fapl_core_f(access, memory_step, .false., status)
      if (status >= 0) call h5fcreate_f(nowhere, h5f_acc_trunc_f, image%file, status, access_prp=access)
      if (status < 0) image%file = none
      if (status >= 0) call h5tcopy_f(h5t_string, image%any_text, status)
      if (status >= 0) call h5tset_cset_f(image%any_text, h5t_cset_utf8_f, status)
      if (status >= 0) call h5screate_f(h5s_scalar_f, image%single, status)
      if (status >= 0) call h5pcreate_f(h5p_group_create_f, image%layout, status)
      if (status >= 0) call h5pset_link_creation_order_f(image%layout, ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f), &
         & status)
      if (status >= 0) call h5pset_est_link_info_f(image%layout, members, letters, status)
      if (status >= 0) call h5pset_link_phase_change_f(image%layout, most_compact, most_compact - 1, status)
      call h5pclose_f(access, close_status)
   end subroutine begin_file

   !> Writes one item.
   subroutine write_item(image, item, status)
      type(image_t), intent(inout) :: image
      type(item_t), intent(in) :: item
      integer, intent(out) :: status            !! negative if it failed
      integer :: slash
      slash = index(item%path, '/', back=.true.)
      if (item%attribute /= '') then
         call go_to_group(image, item%path, status)
         if (status >= 0) call write_attribute(image, item, status)
      else if (allocated(item%values%bytes)) then
         call go_to_group(image, item%path(:slash - 1), status)
         if (status >= 0) call write_dataset(image, item, item%path(slash + 1:), status)
      else
         call leave_group(image)
         call h5gcreate_f(image%file, item%path, image%group, status, gcpl_id=image%layout)
         image%path = item%path
      end if
   end subroutine write_item

   !> Opens a group, unless it is open.
   subroutine go_to_group(image, path, status)
      type(image_t), intent(inout) :: image
      character(*), intent(in) :: path          !! full path; '': the root
      integer, intent(out) :: status            !! negative if it failed
      status = 0
      if (image%path == path .and. len(image%path) == len(path)) return
      call leave_group(image)
      call h5gopen_f(image%file, path//'/', image%group, status)
      if (status >= 0) image%path = path
   end subroutine go_to_group

   subroutine leave_group(image)
      type(image_t), intent(inout) :: image
      integer :: status
      if (image%group /= none) call h5gclose_f(image%group, status)
      image%group = none
      image%path = '?'
   end subroutine leave_group

   subroutine write_dataset(image, item, name, status)
      type(image_t), intent(in) :: image
      type(item_t), intent(in), target :: item
      character(*), intent(in) :: name          !! its name in the open group
      integer, intent(out) :: status            !! negative if it failed
      integer(hid_t) :: space, own_type, dataset
      type(c_ptr) :: place
      integer :: close_status
      associate (values => item%values)
         call value_type(values, own_type, status)
         if (status >= 0) call h5screate_simple_f(values%rank, int(values%extent(:values%rank), hsize_t), space, status)
         if (status < 0) return
         call h5dcreate_f(image%group, name, own_type, space, dataset, status)
         if (status >= 0) then
            if (product(int(values%extent(:values%rank), i8)) > 0) then
               place = c_loc(values%bytes)
               call h5dwrite_f(dataset, own_type, place, status)
            end if
            if (status >= 0) call write_text(image, dataset, 'units', item%units, status)
            if (status >= 0) call write_text(image, dataset, 'description', item%description, status)
            call h5dclose_f(dataset, close_status)
         end if
         call h5sclose_f(space, close_status)
         if (values%kind == is_text) call h5tclose_f(own_type, close_status)
      end associate
   end subroutine write_dataset

   subroutine write_attribute(image, item, status)
      type(image_t), intent(in) :: image
      type(item_t), intent(in), target :: item  !! attribute of the open group
      integer, intent(out) :: status            !! negative if it failed
      integer(hid_t) :: space, own_type
      integer :: close_status
      associate (values => item%values)
         if (values%kind == is_text) then
            call write_text(image, image%group, item%attribute, transfer(values%bytes, repeat(' ', values%length)), status)
            return
         end if
         call value_type(values, own_type, status)
         call h5screate_simple_f(values%rank, int(values%extent(:values%rank), hsize_t), space, status)
         if (status < 0) return
         call put_attribute(image%group, item%attribute, own_type, space, c_loc(values%bytes), status)
         call h5sclose_f(space, close_status)
      end associate
   end subroutine write_attribute

   !> Writes a text attribute of variable length: Python readers get a str from it, and it may be longer than the 64 kB that fit
   !> into an object's header, as the deck's text may be.
   subroutine write_text(image, place, name, value, status)
      type(image_t), intent(in) :: image
      integer(hid_t), intent(in) :: place
      character(*), intent(in) :: name, value
      integer, intent(out) :: status
      character(len(value) + 1, c_char), target :: text
      type(c_ptr), target :: pointer(1)
      text = value//c_null_char
      pointer(1) = c_loc(text)
      call put_attribute(place, name, image%any_text, image%single, c_loc(pointer), status)
   end subroutine write_text

   subroutine put_attribute(place, name, own_type, space, values, status)
      integer(hid_t), intent(in) :: place, own_type, space
      character(*), intent(in) :: name
      type(c_ptr), intent(in) :: values
      integer, intent(out) :: status
      integer(hid_t) :: attribute
      integer :: close_status
      call h5acreate_f(place, name, own_type, space, attribute, status)
      if (status < 0) return
      call h5awrite_f(attribute, own_type, values, status)
      call h5aclose_f(attribute, close_status)
   end subroutine put_attribute

   !> Type of values in the file and in memory. That of texts is closed by the caller.
   subroutine value_type(values, own_type, status)
      type(data_t), intent(in) :: values
      integer(hid_t), intent(out) :: own_type
      integer, intent(out) :: status            !! negative if it failed
      status = 0
      select case (values%kind)
      case (is_real)
         own_type = h5t_native_double
      case (is_integer)
         own_type = h5t_native_integer
      case default
         ! UTF-8 text of fixed length, padded with null characters
         call h5tcopy_f(h5t_fortran_s1, own_type, status)
         if (status >= 0) call h5tset_size_f(own_type, int(values%length, size_t), status)
         if (status >= 0) call h5tset_strpad_f(own_type, h5t_str_nullpad_f, status)
         if (status >= 0) call h5tset_cset_f(own_type, h5t_cset_utf8_f, status)
      end select
   end subroutine value_type
end module hdf5_image
