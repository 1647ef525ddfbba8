!> The group /restart of a result file: the checkpoint of a run, from which another run can continue.
!>
!>    state    words of the checkpoint (path/following/checkpoint), compressed by leave_out_zeros; none: the run stands at its start
!>    rows     numbers of rows, at the checkpoint, of the tables named in the attribute tables; later rows are newer than the
!>             checkpoint. Three more numbers: branch being followed, branches so far, words of the state as written
!>    attribute layout: layout of the types of which the words consist
!>
!> A restart may also begin at a named point of the path (find_named_point). The name of a point is its number in the listing, from
!> 1, or the label of a special point and its number among the points with this label: LP1 is the first limit point of the path. If
!> there is only one such point, the number may be omitted. The number of a branch and a colon before the name mean a point of this
!> branch: 2:LP1.
module restart_file
   use errors, only: error_t, fail
   use archive, only: with_zeros
   use file_items, only: items_t, data_of, place_of, integers_in, text_in, reals_in, texts_in
   use result_file, only: result_file_t, put_group, put_data, put_attribute, is_result
   use hdf5_contents, only: read_items
   use run_archive, only: archive_layout
   use kinds, only: wp
   use text, only: to_text, upper
   use printable_text, only: quoted
   implicit none
   private
   public :: restart_t, put_restart, read_restart, find_named_point

   !> Checkpoint of a run in its result file.
   type :: restart_t
      integer :: kind = 0                         !! kind of path on which the checkpoint was written; 0: no checkpoint
      logical :: own = .true. !! true: the run to come has the deck with which the checkpoint was made, and goes on from there;
      !! without a checkpoint it begins
      character(:), allocatable :: path           !! name of the result file
      character(:), allocatable :: deck           !! text of the deck
      integer, allocatable :: state(:) !! words of the checkpoint; compressed if they are to be written. Size 0: the run stands at
      !! its start; not allocated: unknown
      character(:), allocatable :: tables         !! names of the tables whose numbers of rows are stored, see table_rows
      integer, allocatable :: rows(:)
      integer :: on_branch = 0                    !! branch that the run was following; 0: the path of the steps
      integer :: branches = 0                     !! number of branches so far
      type(items_t) :: items                      !! contents of the result file
   end type restart_t

   integer, parameter :: label_length = 2          !! number of bytes of /path/label

contains

   !> Stores the group /restart, if it is known from where another run can continue.
   subroutine put_restart(file, restart)
      type(result_file_t), intent(inout) :: file
      type(restart_t), intent(in) :: restart
      if (.not. allocated(restart%state)) return
      call put_group(file, '/restart')
      call put_attribute(file, '/restart', 'layout', data_of(archive_layout))
      call put_attribute(file, '/restart', 'tables', data_of(restart%tables))
      call put_data(file, '/restart/rows', data_of([restart%rows, restart%on_branch, restart%branches, size(restart%state)]), '1', &
         & 'rows of the tables that belong to the state; the branch that the run stands on, 0: none; branches so far; words')
      call put_data(file, '/restart/state', data_of(restart%state), '1', &
         & 'where the run stands, for unilat --restart; only the version that wrote it can read it')
   end subroutine put_restart

   !> Reads a result file with its deck and checkpoint. The error message explains why no run can continue from the file.
   subroutine read_restart(path, deck_only, restart, error)
      character(*), intent(in) :: path
      logical, intent(in) :: deck_only            !! true: no checkpoint is needed
      type(restart_t), intent(out) :: restart
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: numbers(:), words(:)
      integer :: n
      logical :: exists
      restart%path = path
      inquire (file=path, exist=exists)
      if (.not. exists) then
         call fail(error, 'there is no result file '//path)
      else if (.not. is_result(path)) then
         call fail(error, path//' is no result file of unilat, or it is damaged')
      end if
      if (allocated(error)) return
      call read_items(path, restart%items, exists)
      restart%deck = text_in(restart%items, '', 'deck')
      if (deck_only) return
      if (place_of(restart%items, '/restart', '') == 0) then
         call fail(error, path//' does not say where its run stood: run its deck again')
         return
      end if
      restart%tables = text_in(restart%items, '/restart', 'tables')
      if (text_in(restart%items, '/restart', 'layout') /= archive_layout .or. restart%tables == '') then
         call fail(error, path//' was written by another version of unilat, which has to go on with it: run its deck again')
         return
      end if
      numbers = integers_in(restart%items, '/restart/rows')
      words = integers_in(restart%items, '/restart/state')
      n = size(numbers)
      if (n >= 3) then
         restart%rows = numbers(:n - 3)
         restart%on_branch = numbers(n - 2)
         restart%branches = numbers(n - 1)
         if (numbers(n) == size(words)) restart%state = with_zeros(words)
      end if
      if (.not. allocated(restart%state)) then
         call fail(error, path//' is damaged: where its run stood is not all there')
      else if (size(restart%state) > 0) then
         restart%kind = 1
      end if
   end subroutine read_restart

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
end module restart_file
