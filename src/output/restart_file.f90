!> The group /restart of a result file: the checkpoint of a run, from which another run can continue.
!>
!>    state    words of the checkpoint (path/following/checkpoint), compressed by leave_out_zeros
!>    rows     numbers of rows, at the checkpoint, of the tables named in the attribute tables; later rows are newer than the
!>             checkpoint. Three more numbers: branch being followed, branches so far, words of the state as written
!>    attribute layout: layout of the types of which the words consist
module restart_file
   use errors, only: error_t, fail
   use archive, only: with_zeros
   use file_items, only: items_t, data_of, place_of, integers_in, text_in
   use result_file, only: result_file_t, put_group, put_data, put_attribute
   use hdf5_contents, only: read_items
   use former_file, only: is_result
   use run_archive, only: archive_layout
   implicit none
   private
   public :: restart_t, put_restart, read_restart

   !> Checkpoint of a run in its result file.
   type :: restart_t
      integer :: kind = 0                         !! kind of path on which the checkpoint was written; 0: no checkpoint
      character(:), allocatable :: path           !! name of the result file
      character(:), allocatable :: deck           !! text of the deck
      integer, allocatable :: state(:)            !! words of the checkpoint; compressed if they are to be written
      character(:), allocatable :: tables         !! names of the tables whose numbers of rows are stored, see table_rows
      integer, allocatable :: rows(:)
      integer :: on_branch = 0                    !! branch that the run was following; 0: the path of the steps
      integer :: branches = 0                     !! number of branches so far
      type(items_t) :: items                      !! contents of the result file
   end type restart_t

contains

   !> Stores the group /restart, if there is a checkpoint.
   subroutine put_restart(file, restart)
      type(result_file_t), intent(inout) :: file
      type(restart_t), intent(in) :: restart
      if (restart%kind == 0) return
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
      restart%kind = 1
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
      if (.not. allocated(restart%state)) call fail(error, path//' is damaged: where its run stood is not all there')
   end subroutine read_restart
end module restart_file
