!> Points of a path in a result file, and the names by which a user may refer to them.
!>
!> The name of a point is its number in the listing, from 1, or the label of a special point and its number among the points with
!> this label: LP1 is the first limit point of the path. If there is only one such point, the number may be omitted. The number of a
!> branch and a colon before the name mean a point of this branch: 2:LP1.
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
   public :: find_named_point

   integer, parameter :: label_length = 2          !! number of bytes of /path/label

   !> The points of a path.
   type :: path_points_t
      character(:), allocatable :: path            !! name of the path and its result file, for messages
      real(wp), allocatable :: load_factor(:)      !! (points) load factors
      character(label_length), allocatable :: label(:) !! (points) labels; blank: not a special point
   end type path_points_t

contains

   !> Finds the point with a given name. The error message lists the existing names.
   subroutine find_named_point(file, name, branch, point, load_factor, error)
      character(*), intent(in) :: file             !! name of a result file of unilat
      character(*), intent(in) :: name
      integer, intent(out) :: branch               !! number of the branch; 0: the path of the steps
      integer, intent(out) :: point                !! row of the point in the path, from 1
      real(wp), allocatable, intent(out) :: load_factor(:) !! (points of the path) load factors
      type(error_t), allocatable, intent(out) :: error
      type(path_points_t) :: points
      integer :: colon, status
      colon = index(name, ':')
      branch = 0
      status = 0
      if (verify(name(:colon - 1), '0123456789') > 0) status = 1
      if (colon > 0 .and. status == 0) read (name(:colon - 1), *, iostat=status) branch
      if (status == 0) then
         call read_path_points(file, branch, points, error)
      else
         call fail(error, ''''//quoted(name)//''' names no point: before the colon is the number of a branch, as in 2:LP1')
      end if
      if (.not. allocated(error)) call point_called(points, name(colon + 1:), point, error)
      if (.not. allocated(error)) call move_alloc(points%load_factor, load_factor)
   end subroutine find_named_point

   !> Reads the points of a path from a result file. An error is returned if the file has no path.
   subroutine read_path_points(path, branch, points, error)
      character(*), intent(in) :: path             !! name of a result file of unilat
      integer, intent(in) :: branch                !! number of the branch; 0: the path of the steps
      type(path_points_t), intent(out) :: points
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: group
      integer(hid_t) :: file, dataset, space, text_type
      integer(hsize_t) :: n
      integer :: status, close_status, i
      group = '/path'
      points%path = 'the path of '//path
      if (branch > 0) then
         group = '/branch/'//to_text(branch)//group
         points%path = 'branch '//to_text(branch)//' of '//path
      end if
      call h5fopen_f(path, h5f_acc_rdonly_f, file, status)
      n = 0
      call h5dopen_f(file, group//'/load_factor', dataset, status)
      if (status >= 0) then
         call h5dget_space_f(dataset, space, status)
         call h5sget_simple_extent_npoints_f(space, n, status)
         allocate (points%load_factor(n), points%label(n))
         call h5dread_f(dataset, h5t_native_double, points%load_factor, [n], status)
         call h5sclose_f(space, close_status)
         call h5dclose_f(dataset, close_status)
      end if
      if (status >= 0) call h5dopen_f(file, group//'/label', dataset, status)
      if (status >= 0) then
         call hdf5_text_type(label_length, text_type, status)
         call h5dread_f(dataset, text_type, points%label, [n], status)
         call h5tclose_f(text_type, close_status)
         call h5dclose_f(dataset, close_status)
      end if
      call h5fclose_f(file, close_status)
      if (status < 0 .or. n == 0) call fail(error, points%path//' has no points')
      if (allocated(error)) return
      do i = 1, size(points%label)
         if (points%label(i) (1:1) == char(0)) points%label(i) = ''
      end do
   end subroutine read_path_points

   !> The point with a given name. The error message lists the existing names.
   subroutine point_called(points, name, point, error)
      type(path_points_t), intent(in) :: points
      character(*), intent(in) :: name             !! number of a point; or label and number of a special point
      integer, intent(out) :: point                !! row of the point in the path, from 1
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
      if (point == 0) call fail(error, 'there is no point '''//quoted(name)//''' on '//points%path//': it has '//names(points))
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
