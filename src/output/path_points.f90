!> Points of the path of the steps that a result file has, and the names by which a user may call them.
!>
!> A point is called by its number in the listing, from 1, or by the label of a special point and its number among those of that
!> label: LP1 is the first limit point of the path. Where there is only one, the number may be left out.
module path_points
   use hdf5, only: hid_t, hsize_t, h5f_acc_rdonly_f, h5fopen_f, h5fclose_f, h5dopen_f, h5dread_f, h5dclose_f, h5dget_space_f, &
      & h5sget_simple_extent_npoints_f, h5sclose_f, h5tclose_f, h5t_native_double
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text, upper
   use printable_text, only: quoted
   use hdf5_datasets, only: hdf5_text_type
   implicit none
   private
   public :: path_points_t, read_path_points, point_called

   integer, parameter :: label_length = 2          !! bytes of /path/label

   !> The points of a path.
   type :: path_points_t
      character(:), allocatable :: file            !! name of the result file
      real(wp), allocatable :: load_factor(:)      !! (points)
      character(label_length), allocatable :: label(:) !! (points) blank: no special point
   end type path_points_t

contains

   !> Reads the points of the path from a result file. The error says that it has none.
   subroutine read_path_points(path, points, error)
      character(*), intent(in) :: path             !! a result file of unilat
      type(path_points_t), intent(out) :: points
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: file, dataset, space, text_type
      integer(hsize_t) :: n
      integer :: status, close_status, i
      points%file = path
      call h5fopen_f(path, h5f_acc_rdonly_f, file, status)
      n = 0
      call h5dopen_f(file, '/path/load_factor', dataset, status)
      if (status >= 0) then
         call h5dget_space_f(dataset, space, status)
         call h5sget_simple_extent_npoints_f(space, n, status)
         allocate (points%load_factor(n), points%label(n))
         call h5dread_f(dataset, h5t_native_double, points%load_factor, [n], status)
         call h5sclose_f(space, close_status)
         call h5dclose_f(dataset, close_status)
      end if
      if (status >= 0) call h5dopen_f(file, '/path/label', dataset, status)
      if (status >= 0) then
         call hdf5_text_type(label_length, text_type, status)
         call h5dread_f(dataset, text_type, points%label, [n], status)
         call h5tclose_f(text_type, close_status)
         call h5dclose_f(dataset, close_status)
      end if
      call h5fclose_f(file, close_status)
      if (status < 0 .or. n == 0) call fail(error, path//' has no points of a path')
      if (allocated(error)) return
      do i = 1, size(points%label)
         if (points%label(i) (1:1) == char(0)) points%label(i) = ''
      end do
   end subroutine read_path_points

   !> The point with a name. The error lists the names that there are.
   subroutine point_called(points, name, point, error)
      type(path_points_t), intent(in) :: points
      character(*), intent(in) :: name             !! number of a point, or label and number of a special point
      integer, intent(out) :: point                !! row of the path, from 1
      type(error_t), allocatable, intent(out) :: error
      character(label_length) :: label
      integer :: digits, number, status, i, passed
      point = 0
      digits = verify(name, '0123456789', back=.true.) + 1
      number = 0
      status = 0
      if (digits <= len(name)) read (name(digits:), *, iostat=status) number
      if (digits == 1 .and. status == 0) then
         if (number >= 1 .and. number <= size(points%label)) point = number
      else if (digits - 1 <= label_length .and. status == 0) then
         label = upper(name(:digits - 1))
         passed = count(points%label == label)
         if (digits > len(name) .and. passed == 1) number = 1
         passed = 0
         do i = 1, size(points%label)
            if (points%label(i) /= label .or. label == '') cycle
            passed = passed + 1
            if (passed == number) point = i
         end do
      end if
      if (point == 0) call fail(error, 'there is no point '''//quoted(name)//''' on the path of '//points%file//': it has '// &
         & names(points))
   end subroutine point_called

   !> The names of all points, in words.
   function names(points)
      type(path_points_t), intent(in) :: points
      character(:), allocatable :: names
      integer :: i
      names = 'the points 1 to '//to_text(size(points%label))
      if (all(points%label == '')) return
      names = names//', of which some are'
      do i = 1, size(points%label)
         if (points%label(i) == '') cycle
         names = names//' '//trim(points%label(i))//to_text(count(points%label(:i) == points%label(i)))//' ('//to_text(i)//')'
      end do
   end function names
end module path_points
