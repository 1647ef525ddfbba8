!> Points of a path in a result file, and the names by which a user may refer to them.
!>
!> The name of a point is its number in the listing, from 1, or the label of a special point and its number among the points with
!> this label: LP1 is the first limit point of the path. If there is only one such point, the number may be omitted. The number of a
!> branch and a colon before the name mean a point of this branch: 2:LP1.
module path_points
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text, upper
   use printable_text, only: quoted
   use file_items, only: items_t, reals_in, texts_in
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
   subroutine find_named_point(items, file, name, branch, point, load_factor, error)
      type(items_t), intent(in) :: items           !! contents of a result file of unilat
      character(*), intent(in) :: file             !! its name
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
         call take_path_points(items, file, branch, points, error)
      else
         call fail(error, ''''//quoted(name)//''' names no point: before the colon is the number of a branch, as in 2:LP1')
      end if
      if (.not. allocated(error)) call point_called(points, name(colon + 1:), point, error)
      if (.not. allocated(error)) call move_alloc(points%load_factor, load_factor)
   end subroutine find_named_point

   !> Takes the points of a path from the contents of a result file. An error is returned if there is no path.
   subroutine take_path_points(items, file, branch, points, error)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: file             !! name of the result file
      integer, intent(in) :: branch                !! number of the branch; 0: the path of the steps
      type(path_points_t), intent(out) :: points
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: group
      group = '/path'
      points%path = 'the path of '//file
      if (branch > 0) then
         group = '/branch/'//to_text(branch)//group
         points%path = 'branch '//to_text(branch)//' of '//file
      end if
      points%load_factor = reals_in(items, group//'/load_factor')
      points%label = texts_in(items, group//'/label', label_length)
      if (size(points%label) == 0 .or. size(points%label) /= size(points%load_factor)) call fail(error, points%path// &
         & ' has no points')
   end subroutine take_path_points

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
