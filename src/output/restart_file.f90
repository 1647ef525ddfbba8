!> The group /restart of a result file: the checkpoint of a run, from which another run can continue.
!>
!>    state    words of the checkpoint (path/following/checkpoint), compressed by leave_out_zeros
!>    rows     numbers of rows, at the checkpoint, of the tables named in the attribute tables; later rows are newer than the
!>             checkpoint. Three more numbers: branch being followed, branches so far, words of the state as written
!>    attribute layout: layout of the types of which the words consist
module restart_file
   use hdf5, only: hid_t, hsize_t, h5eset_auto_f, h5f_acc_rdonly_f, h5open_f, h5fopen_f, h5fclose_f, h5dopen_f, h5dread_f, &
      & h5dclose_f, h5dget_space_f, h5sget_simple_extent_npoints_f, h5sclose_f, h5oopen_f, h5oclose_f, &
      & h5t_native_integer, h5lexists_f
   use errors, only: error_t, fail
   use archive, only: with_zeros
   use hdf5_file, only: hdf5_file_t, hdf5_group
   use hdf5_attributes, only: hdf5_attribute
   use hdf5_datasets, only: hdf5_overwrite
   use former_file, only: is_result, text_attribute
   use run_archive, only: archive_layout
   implicit none
   private
   public :: restart_t, write_restart, read_restart

   !> Checkpoint of a run in its result file.
   type :: restart_t
      integer :: kind = 0                         !! kind of path on which the checkpoint was written; 0: no checkpoint
      character(:), allocatable :: path           !! name of the result file
      character(:), allocatable :: deck           !! text of the deck
      integer, allocatable :: state(:)            !! words of the checkpoint; compressed if they are to be written
      character(:), allocatable :: tables         !! names of the tables whose numbers of rows are stored, see series_rows
      character(:), allocatable :: written        !! names of the tables that are already in the file
      integer, allocatable :: rows(:)
      integer :: on_branch = 0                    !! branch that the run was following; 0: the path of the steps
      integer :: branches = 0                     !! number of branches so far
   end type restart_t

contains

   !> Writes or overwrites the group /restart, if there is a new checkpoint.
   subroutine write_restart(file, restart)
      type(hdf5_file_t), intent(inout) :: file
      type(restart_t), intent(inout) :: restart   !! out: its kind is 0, because the checkpoint has been written
      if (restart%kind == 0) return
      if (.not. allocated(restart%written)) restart%written = ''
      call hdf5_group(file, '/restart')
      ! Overwriting a text leaves a gap of its length in the file.
      if (restart%tables /= restart%written) then
         call hdf5_attribute(file, '/restart', 'layout', archive_layout)
         call hdf5_attribute(file, '/restart', 'tables', restart%tables)
         restart%written = restart%tables
      end if
      call hdf5_overwrite(file, '/restart/rows', [restart%rows, restart%on_branch, restart%branches, size(restart%state)], &
         & 'rows of the tables that belong to the state; the branch that the run stands on, 0: none; branches so far; words')
      call hdf5_overwrite(file, '/restart/state', restart%state, &
         & 'where the run stands, for unilat --restart; only the version that wrote it can read it')
      restart%kind = 0
   end subroutine write_restart

   !> Reads the deck and the checkpoint from a result file. The error message explains why no run can continue from the file.
   subroutine read_restart(path, deck_only, restart, error)
      character(*), intent(in) :: path
      logical, intent(in) :: deck_only            !! true: only the deck is read, not the checkpoint
      type(restart_t), intent(out) :: restart
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: file, place
      integer, allocatable :: numbers(:)
      integer :: status, n, words
      logical :: exists
      restart%path = path
      call h5open_f(status)
      call h5eset_auto_f(0, status)
      inquire (file=path, exist=exists)
      if (.not. exists) then
         call fail(error, 'there is no result file '//path)
      else if (.not. is_result(path)) then
         call fail(error, path//' is no result file of unilat, or it is damaged')
      end if
      if (allocated(error)) return
      call h5fopen_f(path, h5f_acc_rdonly_f, file, status)
      call h5oopen_f(file, '/', place, status)
      restart%deck = text_attribute(place, 'deck')
      call h5oclose_f(place, status)
      call h5lexists_f(file, '/restart', exists, status)
      if (deck_only) then
         restart%kind = 0
      else if (.not. exists) then
         call fail(error, path//' does not say where its run stood: run its deck again')
      else
         call h5oopen_f(file, '/restart', place, status)
         restart%tables = text_attribute(place, 'tables')
         if (text_attribute(place, 'layout') /= archive_layout .or. restart%tables == '') &
            & call fail(error, path//' was written by another version of unilat, which has to go on with it: run its deck again')
         call h5oclose_f(place, status)
         call read_integers(file, '/restart/rows', numbers)
         n = size(numbers)
         restart%rows = numbers(:n - 3)
         restart%on_branch = numbers(n - 2)
         restart%branches = numbers(n - 1)
         words = numbers(n)
         call read_integers(file, '/restart/state', numbers)
         if (words /= size(numbers)) call fail(error, path//' is damaged: where its run stood is not all there')
         if (.not. allocated(error)) restart%state = with_zeros(numbers)
         restart%kind = 1
      end if
      call h5fclose_f(file, status)
   end subroutine read_restart

   !> Reads a data set of integers.
   subroutine read_integers(file, name, numbers)
      integer(hid_t), intent(in) :: file
      character(*), intent(in) :: name
      integer, allocatable, intent(out) :: numbers(:)
      integer(hid_t) :: dataset, space
      integer(hsize_t) :: n
      integer :: status
      call h5dopen_f(file, name, dataset, status)
      call h5dget_space_f(dataset, space, status)
      call h5sget_simple_extent_npoints_f(space, n, status)
      allocate (numbers(n))
      call h5dread_f(dataset, h5t_native_integer, numbers, [n], status)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
   end subroutine read_integers
end module restart_file
