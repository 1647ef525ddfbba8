!> Attributes of groups and datasets in a result file. A failure is stored in the file, see hdf5_file.
module hdf5_attributes
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char
   use hdf5, only: hid_t, hsize_t, h5oopen_f, h5oclose_f, h5acreate_f, h5aopen_f, h5awrite_f, h5aclose_f, &
      & h5screate_f, h5screate_simple_f, h5sclose_f, h5s_scalar_f, h5t_native_double, h5t_native_integer
   use kinds, only: wp
   use hdf5_file, only: hdf5_file_t, hdf5_ok, hdf5_failed
   implicit none
   private
   public :: hdf5_attribute, hdf5_describe, hdf5_space

   !> hdf5_attribute(file, object, name, value): attaches text, a real number or array, or an integer to a group or dataset given by
   !> its full path; with arrays of names and integers, an attribute of each name. An existing attribute is overwritten: it must
   !> have had the same type and shape.
   interface hdf5_attribute
      module procedure attribute_text, attribute_integer, attribute_integers, attribute_real, attribute_real_1, attribute_real_2
   end interface hdf5_attribute

contains

   !> Attaches `units` and `description` to an open dataset.
   subroutine hdf5_describe(file, dataset, units, description, status)
      type(hdf5_file_t), intent(in) :: file
      integer(hid_t), intent(in) :: dataset
      character(*), intent(in) :: units, description
      integer, intent(out) :: status            !! negative if it failed
      call put_text(file, dataset, 'units', units, status)
      if (status >= 0) call put_text(file, dataset, 'description', description, status)
   end subroutine hdf5_describe

   subroutine attribute_text(file, object, name, value)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object        !! full path of the group or dataset; '/' is the file itself
      character(*), intent(in) :: name
      character(*), intent(in) :: value         !! any length; trailing blanks are dropped
      integer(hid_t) :: place
      integer :: status, close_status
      if (.not. hdf5_ok(file)) return
      call h5oopen_f(file%handle, object, place, status)
      if (status >= 0) then
         call put_text(file, place, name, value, status)
         call h5oclose_f(place, close_status)
      end if
      if (status < 0) call hdf5_failed(file, 'write attribute '//name//' of '//object)
   end subroutine attribute_text

   subroutine attribute_integer(file, object, name, value)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object, name
      integer, intent(in) :: value
      call attribute_integers(file, object, [name], [value])
   end subroutine attribute_integer

   subroutine attribute_integers(file, object, name, value)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object, name(:)
      integer, intent(in) :: value(:)           !! values of the attributes, one for each name
      integer, target :: copy
      integer :: i
      do i = 1, size(name)
         copy = value(i)
         call attribute_data(file, object, trim(name(i)), h5t_native_integer, [integer(hsize_t) ::], c_loc(copy))
      end do
   end subroutine attribute_integers

   subroutine attribute_real(file, object, name, value)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object, name
      real(wp), intent(in) :: value
      real(wp), target :: copy
      copy = value
      call attribute_data(file, object, name, h5t_native_double, [integer(hsize_t) ::], c_loc(copy))
   end subroutine attribute_real

   subroutine attribute_real_1(file, object, name, value)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object, name
      real(wp), intent(in) :: value(:)          !! not empty
      real(wp), target :: copy(size(value))
      copy = value
      call attribute_data(file, object, name, h5t_native_double, shape(value, hsize_t), c_loc(copy))
   end subroutine attribute_real_1

   subroutine attribute_real_2(file, object, name, value)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object, name
      real(wp), intent(in) :: value(:, :)       !! not empty
      real(wp), target :: copy(size(value, 1), size(value, 2))
      copy = value
      call attribute_data(file, object, name, h5t_native_double, shape(value, hsize_t), c_loc(copy))
   end subroutine attribute_real_2

   !> Numeric attribute of any rank; rank 0 when `dims` is empty.
   subroutine attribute_data(file, object, name, data_type, dims, data)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: object, name
      integer(hid_t), intent(in) :: data_type
      integer(hsize_t), intent(in) :: dims(:)
      type(c_ptr), intent(in) :: data
      integer(hid_t) :: place, space
      integer :: status, close_status
      if (.not. hdf5_ok(file)) return
      call h5oopen_f(file%handle, object, place, status)
      if (status >= 0) then
         call hdf5_space(dims, space, status)
         if (status >= 0) then
            call put_attribute(place, name, data_type, space, data, status)
            call h5sclose_f(space, close_status)
         end if
         call h5oclose_f(place, close_status)
      end if
      if (status < 0) call hdf5_failed(file, 'write attribute '//name//' of '//object)
   end subroutine attribute_data

   !> Text attribute of variable length: Python readers get a str from it, and it may be longer than the 64 kB that fit into an
   !> object's header, as the deck's text may be.
   subroutine put_text(file, place, name, value, status)
      type(hdf5_file_t), intent(in) :: file
      integer(hid_t), intent(in) :: place
      character(*), intent(in) :: name, value
      integer, intent(out) :: status
      character(len_trim(value) + 1, c_char), target :: text
      type(c_ptr), target :: pointer(1)
      text = trim(value)//c_null_char
      pointer(1) = c_loc(text)
      call put_attribute(place, name, file%text_type, file%single, c_loc(pointer), status)
   end subroutine put_text

   !> Creates an attribute of an open object, or opens the one of that name, and writes it.
   subroutine put_attribute(place, name, data_type, space, data, status)
      integer(hid_t), intent(in) :: place, data_type, space
      character(*), intent(in) :: name
      type(c_ptr), intent(in) :: data
      integer, intent(out) :: status
      integer(hid_t) :: attribute
      integer :: close_status
      call h5acreate_f(place, name, data_type, space, attribute, status)
      if (status < 0) call h5aopen_f(place, name, attribute, status) ! it exists
      if (status < 0) return
      call h5awrite_f(attribute, data_type, data, status)
      call h5aclose_f(attribute, close_status)
   end subroutine put_attribute

   !> Data space of fixed extents; a scalar one when `dims` is empty. The caller closes it.
   subroutine hdf5_space(dims, space, status)
      integer(hsize_t), intent(in) :: dims(:)
      integer(hid_t), intent(out) :: space
      integer, intent(out) :: status
      if (size(dims) == 0) then
         call h5screate_f(h5s_scalar_f, space, status)
      else
         call h5screate_simple_f(size(dims), dims, space, status)
      end if
   end subroutine hdf5_space
end module hdf5_attributes
