!> Reads HDF5 files for tests, with nothing of the modules under test.
module hdf5_reading
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char, c_f_pointer, c_associated
   use, intrinsic :: iso_fortran_env, only: real64
   use hdf5
   implicit none
   private
   public :: reader_t, open_reader, close_reader, exists, extents, reals, integers, text, text_attribute, real_attribute
   public :: integer_attribute

   !> An open file.
   type :: reader_t
      integer(hid_t) :: file = -1_hid_t
   end type reader_t

contains

   !> Opens a file for reading.
   subroutine open_reader(reader, path)
      type(reader_t), intent(out) :: reader
      character(*), intent(in) :: path
      integer :: status
      call h5open_f(status)
      call h5fopen_f(path, h5f_acc_rdonly_f, reader%file, status)
      if (status < 0) error stop 'the test cannot open its result file'
   end subroutine open_reader

   subroutine close_reader(reader)
      type(reader_t), intent(inout) :: reader
      integer :: status
      call h5fclose_f(reader%file, status)
      reader%file = -1_hid_t
   end subroutine close_reader

   !> True when the file has a group or dataset of that name; all groups above must exist.
   logical function exists(reader, name)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: name
      integer :: status
      call h5lexists_f(reader%file, name, exists, status)
   end function exists

   !> Extents of a dataset, the Fortran way; empty for a scalar.
   function extents(reader, name)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: name
      integer, allocatable :: extents(:)
      integer(hid_t) :: dataset, space
      integer(hsize_t), allocatable :: dims(:), limits(:)
      integer :: rank, status
      call h5dopen_f(reader%file, name, dataset, status)
      call h5dget_space_f(dataset, space, status)
      call h5sget_simple_extent_ndims_f(space, rank, status)
      allocate (dims(rank), limits(rank))
      if (rank > 0) call h5sget_simple_extent_dims_f(space, dims, limits, status)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
      extents = int(dims)
   end function extents

   !> All numbers of a real dataset in Fortran's order.
   function reals(reader, name)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: name
      real(real64), allocatable, target :: reals(:)
      type(c_ptr) :: place                      ! the library's interface wants a variable
      integer(hid_t) :: dataset
      integer :: status
      allocate (reals(product(extents(reader, name))))
      call h5dopen_f(reader%file, name, dataset, status)
      place = c_loc(reals)
      call h5dread_f(dataset, h5t_native_double, place, status)
      call h5dclose_f(dataset, status)
   end function reals

   !> All numbers of an integer dataset in Fortran's order.
   function integers(reader, name)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: name
      integer, allocatable, target :: integers(:)
      type(c_ptr) :: place
      integer(hid_t) :: dataset
      integer :: status
      allocate (integers(product(extents(reader, name))))
      call h5dopen_f(reader%file, name, dataset, status)
      place = c_loc(integers)
      call h5dread_f(dataset, h5t_native_integer, place, status)
      call h5dclose_f(dataset, status)
   end function integers

   !> One element (from 1) of a dataset of fixed-length texts, null characters as blanks.
   function text(reader, name, element)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: name
      integer, intent(in) :: element
      character(:), allocatable :: text
      character(:), allocatable, target :: all
      type(c_ptr) :: place
      integer(hid_t) :: dataset, text_type
      integer(size_t) :: length
      integer :: i, status
      call h5dopen_f(reader%file, name, dataset, status)
      call h5dget_type_f(dataset, text_type, status)
      call h5tget_size_f(text_type, length, status)
      allocate (character(int(length) * product(extents(reader, name))) :: all)
      place = c_loc(all)
      call h5dread_f(dataset, text_type, place, status)
      call h5tclose_f(text_type, status)
      call h5dclose_f(dataset, status)
      text = all((element - 1) * int(length) + 1:element * int(length))
      do i = 1, len(text)
         if (text(i:i) == c_null_char) text(i:i) = ' '
      end do
      text = trim(text)
   end function text

   !> A text attribute of variable length.
   function text_attribute(reader, object, name) result(value)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: object, name
      character(:), allocatable :: value
      type(c_ptr), target :: pointer(1)
      type(c_ptr) :: place
      character(1, c_char), pointer :: letter(:)
      integer, parameter :: longest = 1000000
      integer(hid_t) :: attribute, text_type
      integer :: status, i
      value = ''
      call h5aopen_by_name_f(reader%file, object, name, attribute, status)
      if (status < 0) return
      call h5aget_type_f(attribute, text_type, status)
      place = c_loc(pointer)
      call h5aread_f(attribute, text_type, place, status)
      call h5tclose_f(text_type, status)
      call h5aclose_f(attribute, status)
      if (.not. c_associated(pointer(1))) return
      call c_f_pointer(pointer(1), letter, [longest])
      i = 0
      do while (letter(i + 1) /= c_null_char)
         i = i + 1
      end do
      value = repeat(' ', i)
      do i = 1, len(value)
         value(i:i) = letter(i)
      end do
   end function text_attribute

   !> The n numbers of a real attribute in Fortran's order.
   function real_attribute(reader, object, name, n) result(value)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: object, name
      integer, intent(in) :: n
      real(real64) :: value(n)
      real(real64), target :: copy(n)
      type(c_ptr) :: place
      integer(hid_t) :: attribute
      integer :: status
      call h5aopen_by_name_f(reader%file, object, name, attribute, status)
      place = c_loc(copy)
      call h5aread_f(attribute, h5t_native_double, place, status)
      call h5aclose_f(attribute, status)
      value = copy
   end function real_attribute

   !> An integer attribute; -huge(1) when it is not there.
   integer function integer_attribute(reader, object, name) result(value)
      type(reader_t), intent(in) :: reader
      character(*), intent(in) :: object, name
      integer, target :: copy
      type(c_ptr) :: place
      integer(hid_t) :: attribute
      integer :: status
      value = -huge(1)
      call h5aopen_by_name_f(reader%file, object, name, attribute, status)
      if (status < 0) return
      place = c_loc(copy)
      call h5aread_f(attribute, h5t_native_integer, place, status)
      call h5aclose_f(attribute, status)
      value = copy
   end function integer_attribute
end module hdf5_reading
