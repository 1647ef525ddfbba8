!> The items of an HDF5 file. Values of types that a result file never has are left out.
module hdf5_contents
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char, c_null_ptr, c_associated, c_f_pointer
   use hdf5, only: hid_t, hsize_t, size_t, h5f_acc_rdonly_f, h5fopen_f, h5fclose_f, h5fis_hdf5_f, h5oopen_f, h5oclose_f, &
      & h5aget_num_attrs_f, h5aopen_by_idx_f, h5aget_name_f, h5aget_type_f, h5aget_space_f, h5aread_f, h5aclose_f, &
      & h5gget_info_f, h5lget_name_by_idx_f, h5iget_type_f, h5i_group_f, h5i_dataset_f, &
      & h5_index_name_f, h5_index_crt_order_f, h5_iter_inc_f, h5dget_type_f, h5dget_space_f, h5dread_f, &
      & h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f, h5sclose_f, h5tget_class_f, h5tget_size_f, h5tclose_f, &
      & h5tis_variable_str_f, h5t_float_f, h5t_integer_f, h5t_string_f
   use kinds, only: i8
   use file_items, only: items_t, data_t, data_of, put_item, most_extents, is_integer, is_text, text_in
   use hdf5_image, only: start_library, value_type
   implicit none
   private
   public :: read_items, is_hdf5

   integer, parameter :: longest_name = 1024    !! bytes; members with longer names are left out
   integer, parameter :: deepest = 8            !! groups inside each other; deeper ones are left out: a group may be inside itself

contains

   !> True if a file is an HDF5 file.
   logical function is_hdf5(path)
      character(*), intent(in) :: path
      integer :: status
      call start_library(status)
      call h5fis_hdf5_f(path, is_hdf5, status)
      if (status < 0) is_hdf5 = .false.
   end function is_hdf5

   !> Reads all items of a file.
   subroutine read_items(path, items, readable, root_only)
      character(*), intent(in) :: path
      type(items_t), intent(out) :: items
      logical, intent(out) :: readable          !! false: the file cannot be opened
      logical, intent(in), optional :: root_only !! true: only the attributes of the file are read; default: false
      integer(hid_t) :: file, root
      integer :: status, close_status
      logical :: all
      all = .true.
      if (present(root_only)) all = .not. root_only
      call start_library(status)
      call h5fopen_f(path, h5f_acc_rdonly_f, file, status)
      readable = status >= 0
      if (.not. readable) return
      call h5oopen_f(file, '/', root, status)
      readable = status >= 0
      if (readable) then
         call read_attributes(items, root, '')
         if (all) call read_group(items, root, '', 1)
         call h5oclose_f(root, close_status)
      end if
      call h5fclose_f(file, close_status)
   end subroutine read_items

   !> Reads the members of a group in the order of their creation, or by name if the file does not have this order.
   recursive subroutine read_group(items, place, group, depth)
      type(items_t), intent(inout) :: items
      integer(hid_t), intent(in) :: place       !! the open group
      character(*), intent(in) :: group         !! its full path; '': the root
      integer, intent(in) :: depth              !! groups around its members
      character(longest_name) :: name
      integer(hid_t) :: member
      integer(size_t) :: length
      integer :: storage, n, largest, status, kind, order, i, k
      call h5gget_info_f(place, storage, n, largest, status)
      if (status < 0) return
      order = h5_index_crt_order_f
      do i = 0, n - 1
         call h5lget_name_by_idx_f(place, '.', order, h5_iter_inc_f, int(i, hsize_t), name, status, length)
         if (status < 0) then
            order = h5_index_name_f
            call h5lget_name_by_idx_f(place, '.', order, h5_iter_inc_f, int(i, hsize_t), name, status, length)
         end if
         if (status < 0 .or. length > longest_name) cycle
         call h5oopen_f(place, trim(name), member, status)
         if (status < 0) cycle
         call h5iget_type_f(member, kind, status)
         if (kind == h5i_dataset_f) call read_dataset(items, member, group//'/'//trim(name))
         if (kind == h5i_group_f .and. depth < deepest) then
            call put_item(items, group//'/'//trim(name), '', k)
            call read_attributes(items, member, group//'/'//trim(name))
            call read_group(items, member, group//'/'//trim(name), depth + 1)
         end if
         call h5oclose_f(member, status)
      end do
   end subroutine read_group

   !> Reads a dataset with its units and description.
   subroutine read_dataset(items, dataset, path)
      type(items_t), intent(inout) :: items
      integer(hid_t), intent(in) :: dataset
      character(*), intent(in) :: path
      type(items_t) :: words
      type(data_t), target :: values
      type(c_ptr) :: data
      integer(hid_t) :: own_type, space, memory_type
      integer :: i, status, close_status
      logical :: varies
      call h5dget_type_f(dataset, own_type, status)
      call h5dget_space_f(dataset, space, status)
      call shape_of(own_type, space, values, varies, status)
      call h5sclose_f(space, close_status)
      call h5tclose_f(own_type, close_status)
      if (status < 0 .or. varies) return
      call value_type(values, memory_type, status)
      if (size(values%bytes) > 0) then
         data = c_loc(values%bytes)
         call h5dread_f(dataset, memory_type, data, status)
      end if
      if (values%kind == is_text) call h5tclose_f(memory_type, close_status)
      if (status < 0) return
      call put_item(items, path, '', i)
      call read_attributes(words, dataset, '')
      associate (item => items%box(i)%item)
         item%values = values
         item%units = text_in(words, '', 'units')
         item%description = text_in(words, '', 'description')
      end associate
   end subroutine read_dataset

   !> Reads the attributes of a group or dataset.
   subroutine read_attributes(items, place, path)
      type(items_t), intent(inout) :: items
      integer(hid_t), intent(in) :: place
      character(*), intent(in) :: path          !! its full path
      character(longest_name) :: name
      type(data_t), target :: values
      type(c_ptr) :: data
      integer(hid_t) :: attribute, own_type, space, memory_type
      integer :: n, i, k, status, close_status
      logical :: varies
      call h5aget_num_attrs_f(place, n, status)
      if (status < 0) return
      do i = 0, n - 1
         call h5aopen_by_idx_f(place, '.', h5_index_name_f, h5_iter_inc_f, int(i, hsize_t), attribute, status)
         if (status < 0) cycle
         name = ''
         call h5aget_name_f(attribute, int(longest_name, size_t), name, status)
         call h5aget_type_f(attribute, own_type, status)
         call h5aget_space_f(attribute, space, status)
         call shape_of(own_type, space, values, varies, status)
         if (status >= 0 .and. varies) then
            values = data_of(varying_text(attribute, own_type))
         else if (status >= 0 .and. size(values%bytes) > 0) then
            call value_type(values, memory_type, status)
            data = c_loc(values%bytes)
            call h5aread_f(attribute, memory_type, data, status)
            if (values%kind == is_text) call h5tclose_f(memory_type, close_status)
         end if
         call h5sclose_f(space, close_status)
         call h5tclose_f(own_type, close_status)
         call h5aclose_f(attribute, close_status)
         if (status < 0) cycle
         call put_item(items, path, trim(name), k)
         items%box(k)%item%values = values
      end do
   end subroutine read_attributes

   !> Kind and extents of values, with room for them.
   subroutine shape_of(own_type, space, values, varies, status)
      integer(hid_t), intent(in) :: own_type, space
      type(data_t), intent(out) :: values
      logical, intent(out) :: varies            !! true: texts of variable length
      integer, intent(out) :: status            !! negative: values of another type, or of too many extents
      integer(hsize_t) :: extent(most_extents), most(most_extents)
      integer(size_t) :: length
      integer :: class
      varies = .false.
      call h5sget_simple_extent_ndims_f(space, values%rank, status)
      if (status < 0 .or. values%rank > most_extents) status = -1
      if (status < 0) return
      extent = 1
      if (values%rank > 0) call h5sget_simple_extent_dims_f(space, extent(:values%rank), most(:values%rank), status)
      values%extent = int(extent)
      call h5tget_class_f(own_type, class, status)
      if (class == h5t_string_f) then
         values%kind = is_text
         call h5tis_variable_str_f(own_type, varies, status)
         call h5tget_size_f(own_type, length, status)
         values%length = int(length)
      else if (class == h5t_integer_f) then
         values%kind = is_integer
         values%length = storage_size(1) / 8
      else if (class /= h5t_float_f) then
         status = -1
      end if
      if (status >= 0) allocate (values%bytes(product(int(extent, i8)) * values%length), stat=status)
      if (status > 0) status = -1
   end subroutine shape_of

   !> Value of a text attribute of variable length; '' if it cannot be read.
   function varying_text(attribute, own_type) result(text)
      integer(hid_t), intent(in) :: attribute, own_type
      character(:), allocatable :: text
      type(c_ptr), target :: pointer(1)
      type(c_ptr) :: data
      character(kind=c_char), pointer :: letters(:)
      integer :: status, n
      text = ''
      pointer(1) = c_null_ptr
      data = c_loc(pointer)
      call h5aread_f(attribute, own_type, data, status)
      if (status < 0 .or. .not. c_associated(pointer(1))) return
      call c_f_pointer(pointer(1), letters, [huge(1)])
      n = 0
      do while (letters(n + 1) /= c_null_char)
         n = n + 1
      end do
      text = transfer(letters(:n), repeat(' ', n))
   end function varying_text
end module hdf5_contents
