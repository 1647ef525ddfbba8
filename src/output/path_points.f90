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
      character(label_length), allocatable :: label(:) ! (points) labels; blank: not a special point
      character(:), allocatable :: path, group     ! name of the path in messages; its group in the file
      integer :: colon, status
      colon = index(name, ':')
      branch = 0
      point = 0
      status = 0
      if (verify(name(:colon - 1), '0123456789') > 0) status = 1
      if (colon > 0 .and. status == 0) read (name(:colon - 1), *, iostat=status) branch
      if (status /= 0) then
         call fail(error, ''''//quoted(name)//''' names no point: before the colon is the number of a branch, as in 2:LP1')
         return
      end if
      group = '/path'
      path = 'the path of '//file
      if (branch > 0) then
         group = '/branch/'//to_text(branch)//group
         path = 'branch '//to_text(branch)//' of '//file
      end if
      load_factor = reals_in(items, group//'/load_factor')
      label = texts_in(items, group//'/label', label_length)
      if (size(label) == 0 .or. size(label) /= size(load_factor)) then
         call fail(error, path//' has no points')
         return
      end if
      point = point_called(label, name(colon + 1:))
      if (point == 0) call fail(error, 'there is no point '''//quoted(name(colon + 1:))//''' on '//path//': it has '//names(label))
   end subroutine find_named_point

   !> Row of the point with a given name; 0: there is none.
   pure integer function point_called(label, name) result(point)
      character(label_length), intent(in) :: label(:) !! (points) labels; blank: not a special point
      character(*), intent(in) :: name             !! number of a point; or label and number of a special point
      character(label_length) :: wanted
      integer :: digits, number, status, i, passed
      point = 0
      digits = verify(name, '0123456789', back=.true.) + 1
      number = 0
      status = 0
      if (digits <= len(name)) read (name(digits:), *, iostat=status) number
      if (status /= 0) return
      if (digits == 1) then
         if (number >= 1 .and. number <= size(label)) point = number
      else if (digits - 1 <= label_length) then
         wanted = upper(name(:digits - 1))
         if (wanted == '') return
         if (digits > len(name) .and. count(label == wanted) == 1) number = 1
         passed = 0
         do i = 1, size(label)
            if (label(i) /= wanted) cycle
            passed = passed + 1
            if (passed == number) point = i
         end do
      end if
   end function point_called

   !> The names of all points, in words.
   pure function names(label)
      character(label_length), intent(in) :: label(:)
      character(:), allocatable :: names
      integer :: i
      names = 'the points 1 to '//to_text(size(label))
      if (all(label == '')) return
      names = names//', of which some are'
      do i = 1, size(label)
         if (label(i) == '') cycle
         names = names//' '//trim(label(i))//to_text(count(label(:i) == label(i)))//' ('//to_text(i)//')'
      end do
   end function names
end module path_points
