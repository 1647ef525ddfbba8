!> Datasets of fixed size in a result file. A failure is stored in the file, see hdf5_file.
module hdf5_datasets
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_null_char
   use hdf5, only: hid_t, hsize_t, size_t, h5sclose_f, h5dcreate_f, h5dwrite_f, h5dclose_f, h5tcopy_f, h5tclose_f, &
      & h5tset_cset_f, h5tset_size_f, h5tset_strpad_f, h5t_cset_utf8_f, h5t_str_nullpad_f, h5t_fortran_s1, &
      & h5t_native_double, h5t_native_integer, h5pcreate_f, h5pclose_f, h5pset_chunk_f, h5p_dataset_create_f, &
      & h5dopen_f, h5dset_extent_f, h5screate_simple_f, h5s_unlimited_f
   use kinds, only: wp
   use hdf5_file, only: hdf5_file_t, hdf5_ok, hdf5_failed, hdf5_remove, hdf5_has
   use hdf5_attributes, only: hdf5_describe, hdf5_space
   implicit none
   private
   public :: hdf5_write, hdf5_write_data, hdf5_overwrite, hdf5_text_type, padded

   integer(hsize_t), parameter :: few_integers = 64_hsize_t, part_of_row = 2048_hsize_t !! smallest and largest chunk length of the
   !! datasets of hdf5_overwrite

   !> hdf5_write(file, name, value, units, description): a dataset of fixed size. `name` is its full path,
   !> the group must exist.
   interface hdf5_write
      module procedure write_real_0, write_real_1, write_real_2, write_real_3
      module procedure write_integer_1, write_integer_2, write_text_1
   end interface hdf5_write

contains

   !> The file type of fixed-length UTF-8 text, padded with null characters. The caller closes it.
   subroutine hdf5_text_type(length, text_type, status)
      integer, intent(in) :: length             !! bytes, at least 1
      integer(hid_t), intent(out) :: text_type
      integer, intent(out) :: status            !! negative if it failed
      call h5tcopy_f(h5t_fortran_s1, text_type, status)
      if (status >= 0) call h5tset_size_f(text_type, int(length, size_t), status)
      if (status >= 0) call h5tset_strpad_f(text_type, h5t_str_nullpad_f, status)
      if (status >= 0) call h5tset_cset_f(text_type, h5t_cset_utf8_f, status)
   end subroutine hdf5_text_type

   !> Text whose trailing blanks are replaced by null characters, cut or padded to a length.
   pure function padded(text, length) result(field)
      character(*), intent(in) :: text
      integer, intent(in) :: length
      character(length) :: field
      integer :: used
      used = min(len_trim(text), length)
      field = text(:used)//repeat(c_null_char, length - used)
   end function padded

   subroutine write_real_0(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      real(wp), intent(in) :: value
      call write_reals(file, name, 1, [value], [integer(hsize_t) ::], units, description)
   end subroutine write_real_0

   subroutine write_real_1(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      real(wp), intent(in), contiguous :: value(:)
      call write_reals(file, name, size(value), value, shape(value, hsize_t), units, description)
   end subroutine write_real_1

   subroutine write_real_2(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      real(wp), intent(in), contiguous :: value(:, :)
      call write_reals(file, name, size(value), value, shape(value, hsize_t), units, description)
   end subroutine write_real_2

   subroutine write_real_3(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      real(wp), intent(in), contiguous :: value(:, :, :)
      call write_reals(file, name, size(value), value, shape(value, hsize_t), units, description)
   end subroutine write_real_3

   subroutine write_integer_1(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      integer, intent(in), contiguous :: value(:)
      call write_integers(file, name, size(value), value, shape(value, hsize_t), units, description)
   end subroutine write_integer_1

   subroutine write_integer_2(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      integer, intent(in), contiguous :: value(:, :)
      call write_integers(file, name, size(value), value, shape(value, hsize_t), units, description)
   end subroutine write_integer_2

   subroutine write_text_1(file, name, value, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      character(*), intent(in) :: value(:)      !! stored as text of the length of its longest element
      character(:), allocatable, target :: text
      type(c_ptr) :: data                       ! c_loc(text) as an argument makes gfortran 12 mix up the text lengths
      integer(hid_t) :: text_type
      integer :: length, i, status
      if (.not. hdf5_ok(file)) return
      length = 1
      if (size(value) > 0) length = max(1, maxval(len_trim(value)))
      allocate (character(length * size(value)) :: text)
      do i = 1, size(value)
         text((i - 1) * length + 1:i * length) = padded(value(i), length)
      end do
      data = c_loc(text)
      call hdf5_text_type(length, text_type, status)
      if (status >= 0) then
         call hdf5_write_data(file, name, text_type, shape(value, hsize_t), data, units, description)
         call h5tclose_f(text_type, status)
      end if
      if (status < 0) call hdf5_failed(file, 'write '//name)
   end subroutine write_text_1

   subroutine write_reals(file, name, n, value, dims, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      integer, intent(in) :: n
      real(wp), intent(in), target :: value(n)
      integer(hsize_t), intent(in) :: dims(:)
      call hdf5_write_data(file, name, h5t_native_double, dims, c_loc(value), units, description)
   end subroutine write_reals

   subroutine write_integers(file, name, n, value, dims, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      integer, intent(in) :: n
      integer, intent(in), target :: value(n)
      integer(hsize_t), intent(in) :: dims(:)
      call hdf5_write_data(file, name, h5t_native_integer, dims, c_loc(value), units, description)
   end subroutine write_integers

   !> Writes a row of integers whose length may change if it is written again; the dataset keeps its place and leaves no gaps in the
   !> file.
   subroutine hdf5_overwrite(file, name, value, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, description
      integer, intent(in), contiguous :: value(:)
      integer(hid_t) :: space, layout, dataset
      integer :: status
      if (.not. hdf5_ok(file)) return
      if (hdf5_has(file, name)) then
         call h5dopen_f(file%handle, name, dataset, status)
         if (status >= 0) call h5dset_extent_f(dataset, shape(value, hsize_t), status)
      else
         call h5pcreate_f(h5p_dataset_create_f, layout, status)
         call h5pset_chunk_f(layout, 1, [max(few_integers, min(part_of_row, size(value, kind=hsize_t)))], status)
         call h5screate_simple_f(1, shape(value, hsize_t), space, status, [h5s_unlimited_f])
         call h5dcreate_f(file%handle, name, h5t_native_integer, space, dataset, status, layout)
         if (status >= 0) call hdf5_describe(dataset, '1', description, status)
         call h5sclose_f(space, status)
         call h5pclose_f(layout, status)
      end if
      if (status >= 0) call write_all(size(value), value)
      if (status < 0) call hdf5_failed(file, 'write '//name)
      call h5dclose_f(dataset, status)

   contains

      subroutine write_all(n, copy)
         integer, intent(in) :: n
         integer, intent(in), target :: copy(n)
         call h5dwrite_f(dataset, h5t_native_integer, c_loc(copy), status)
      end subroutine write_all
   end subroutine hdf5_overwrite

   !> Dataset of any type and rank; a dataset with an empty dimension is created without data.
   subroutine hdf5_write_data(file, name, data_type, dims, data, units, description)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      integer(hid_t), intent(in) :: data_type   !! type in the file and in memory
      integer(hsize_t), intent(in) :: dims(:)   !! extents, as Fortran orders them; none: a single value
      type(c_ptr), intent(in) :: data           !! the values
      integer(hid_t) :: space, dataset
      integer :: status, close_status
      call hdf5_remove(file, name)
      if (.not. hdf5_ok(file)) return
      call hdf5_space(dims, space, status)
      if (status >= 0) then
         call h5dcreate_f(file%handle, name, data_type, space, dataset, status)
         call h5sclose_f(space, close_status)
      end if
      if (status >= 0) then
         if (product(dims) > 0) call h5dwrite_f(dataset, data_type, data, status)
         if (status >= 0) call hdf5_describe(dataset, units, description, status)
         call h5dclose_f(dataset, close_status)
      end if
      if (status < 0) call hdf5_failed(file, 'write '//name)
   end subroutine hdf5_write_data
end module hdf5_datasets
