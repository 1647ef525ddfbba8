!> The result file: its contents and the times at which it is written. input/manual/output.md describes its layout.
!>
!> The contents are kept in memory. The first point found 0.2 s or more after the last flush causes a flush: the file is replaced as
!> a whole (result_file), so a killed run loses at most the points of the last 0.2 s. Large files take longer to write and are
!> written less often: writing never takes more than a twentieth of the run. Until the first flush a former file of this name is
!> unchanged. The status is "running" until the last flush.
module results
   use kinds, only: wp, i8
   use errors, only: error_t
   use model, only: model_t
   use path_record, only: record_t, point_t, critical_t, branch_start_t, buckling_t, limit_point_t, accuracy_t
   use rod_geometry, only: geometry_t, new_geometry
   use result_tables, only: write_root, write_mesh, write_obstacles, write_candidates, write_branch, &
      & branch_group, write_buckling, write_performance, write_accuracy
   use model_tables, only: write_supports, write_loads, write_sets
   use path_series, only: path_series_t, open_path_series, append_point, append_critical, limit_series_t, open_limit_series, &
      & append_limit_point
   use file_items, only: data_of, place_of, remove_items
   use result_file, only: result_file_t, file_create, put_group, put_attribute, file_flush, file_close, file_error
   use growing_tables, only: continue_tables, table_rows, check_tables
   use archive, only: leave_out_zeros
   use restart_file, only: restart_t, put_restart
   implicit none
   private
   public :: results_t, results_open, results_parameter, results_leave, results_close
   public :: results_due, results_state, results_record

   real(wp), parameter :: flush_seconds = 0.2_wp  !! least time [s] between flushes while points are found; a row stays in memory so
   !! long
   integer(i8), parameter :: rest_of_flush = 20_i8 !! least time between flushes, over the duration of the last flush
   integer(i8), parameter :: patience = 5_i8      !! factor on the least time: a flush due at a point waits so long for a
   !! checkpoint, from which a run can continue

   !> An open result file.
   type :: results_t
      private
      type(result_file_t), public :: file         !! its contents
      type(model_t) :: model                      !! needed for the groups of branches, which are created when a branch starts
      type(path_series_t) :: path(0:1)            !! the path of the steps, and the branch that started last
      integer :: current = 0                      !! index of the path to which rows are appended
      integer :: n_branches = 0                   !! number of branches started so far
      type(restart_t) :: checkpoint                 !! last checkpoint of the run
      logical :: has_states = .false.             !! true: flushes contain a checkpoint, and wait for the next one, see patience
      type(limit_series_t) :: limit_curves
      integer(i8) :: flushed = 0_i8               !! clock at the last flush
      integer(i8) :: stated = 0_i8                !! clock at the last checkpoint, from which results_due counts. Counted from the
      !! last flush, slow points would be written before their checkpoint is made, and the checkpoint would then not be due
      integer(i8) :: flush_ticks = 0_i8           !! flush_seconds in clock ticks
      integer(i8) :: last_took = 0_i8             !! ticks of the last flush
   end type results_t

contains

   !> Creates the result file and writes all data known before the first point.
   subroutine results_open(results, path, model, deck, version, error, force, restart)
      type(results_t), intent(out) :: results
      character(*), intent(in) :: path            !! name of the file; an existing result file is replaced
      type(model_t), intent(in) :: model
      character(*), intent(in) :: deck            !! full text of the deck
      character(*), intent(in) :: version         !! of the program
      type(error_t), allocatable, intent(out) :: error !! contains the path and the reason
      logical, intent(in), optional :: force      !! true: any file of this name is replaced; default: false
      type(restart_t), intent(inout), optional :: restart !! checkpoint that the file continues, whose items move into the file;
      !! default: none
      type(geometry_t) :: home
      integer(i8) :: rate
      logical :: goes_on
      results%model = model
      call file_create(results%file, path, force)
      goes_on = .false.
      if (present(restart)) goes_on = restart%kind > 0
      if (goes_on) call continue_tables(results%file, restart%items, restart%tables, restart%rows)
      call write_root(results%file, model, deck, version)
      home = new_geometry(model)
      call write_mesh(results%file, model, home)
      if (size(model%obstacle) > 0) call write_obstacles(results%file, model)
      call write_supports(results%file, model)
      call write_loads(results%file, model, home)
      call write_sets(results%file, model)
      if (size(model%contact) > 0) call write_candidates(results%file, model, home)
      call open_path_series(results%path(0), results%file, model, '')
      call open_limit_series(results%limit_curves, results%file, model)
      if (any(model%step%n_modes > 0)) call put_group(results%file, '/buckling')
      if (goes_on) call take_up_branches(results, restart)
      call take_up_checkpoint(results, restart)
      call system_clock(results%flushed, rate)
      results%stated = results%flushed
      results%flush_ticks = int(flush_seconds * real(rate, wp), i8)
      call file_error(results%file, error)
      if (allocated(error)) call file_close(results%file)
   end subroutine results_open

   !> Continues the branch that was followed at the checkpoint, and removes the branches that were started after it.
   subroutine take_up_branches(results, restart)
      type(results_t), intent(inout) :: results
      type(restart_t), intent(in) :: restart
      type(branch_start_t) :: start
      results%n_branches = restart%branches
      if (restart%on_branch > 0) then
         start%branch = restart%on_branch
         results%current = 1
         call open_path_series(results%path(1), results%file, results%model, branch_group(start))
      end if
      start%branch = restart%branches + 1
      do while (place_of(results%file%items, branch_group(start), '') > 0)
         call remove_items(results%file%items, branch_group(start))
         start%branch = start%branch + 1
      end do
   end subroutine take_up_branches

   !> Sets the checkpoint of the file until the run makes one: that from which the run continues or, if it begins, its start.
   subroutine take_up_checkpoint(results, restart)
      type(results_t), intent(inout) :: results
      type(restart_t), intent(in), optional :: restart
      if (present(restart)) then
         if (.not. restart%own) return
         if (restart%kind > 0) then
            results%checkpoint%tables = restart%tables
            results%checkpoint%rows = restart%rows
            results%checkpoint%on_branch = restart%on_branch
            results%checkpoint%branches = restart%branches
            call leave_out_zeros(restart%state, results%checkpoint%state)
            return
         end if
      end if
      call table_rows(results%file, results%checkpoint%tables, results%checkpoint%rows)
      allocate (results%checkpoint%state(0))
   end subroutine take_up_checkpoint

   !> True if a checkpoint is to be made now: because the last one is old, or because no run could continue from the file yet.
   logical function results_due(results)
      type(results_t), intent(inout) :: results
      integer(i8) :: now
      call system_clock(now)
      results%has_states = .true.
      results_due = now - results%stated >= max(results%flush_ticks, rest_of_flush * results%last_took) .or. &
         & .not. allocated(results%checkpoint%state)
   end function results_due

   !> Stores a checkpoint, with all rows up to it, for the next flush, and flushes if it is due.
   subroutine results_state(results, words, error)
      type(results_t), intent(inout) :: results
      integer, intent(in), contiguous :: words(:)
      type(error_t), allocatable, intent(out) :: error !! the file could not be written (at this or an earlier call)
      call leave_out_zeros(words, results%checkpoint%state)
      call table_rows(results%file, results%checkpoint%tables, results%checkpoint%rows)
      results%checkpoint%on_branch = merge(results%n_branches, 0, results%current == 1)
      results%checkpoint%branches = results%n_branches
      call write_when_due(results, error, .true.)
      call system_clock(results%stated)
   end subroutine results_state

   !> Stores a parameter of the deck with its value. A failure is returned by the next call.
   subroutine results_parameter(results, name, value, is_number)
      type(results_t), intent(inout) :: results
      character(*), intent(in) :: name, value     !! each name only once
      logical, intent(in) :: is_number            !! false: text
      real(wp) :: number
      call put_group(results%file, '/parameters')
      if (is_number) then
         read (value, *) number
         call put_attribute(results%file, '/parameters', name, data_of(number))
      else
         call put_attribute(results%file, '/parameters', name, data_of(value))
      end if
   end subroutine results_parameter

   !> Adds a point or critical point to the present path, directs the following ones to another path, or adds the modes of a
   !> buckling step or a point of a limit curve.
   subroutine results_record(results, record, error)
      type(results_t), intent(inout) :: results
      class(record_t), intent(in) :: record       !! as many monitors and reaction totals as the model has
      type(error_t), allocatable, intent(out) :: error !! the file could not be written (at this or an earlier call)
      select type (record)
      type is (point_t)
         call append_point(results%path(results%current), results%file, record)
      type is (critical_t)
         call append_critical(results%path(results%current), results%file, record)
      type is (branch_start_t)
         results%current = min(record%branch, 1)
         results%n_branches = max(results%n_branches, record%branch)
         if (record%branch > 0) then
            call put_group(results%file, '/branch')
            call write_branch(results%file, record)
            call open_path_series(results%path(1), results%file, results%model, branch_group(record))
         end if
      type is (buckling_t)
         call write_buckling(results%file, results%model, record)
      type is (limit_point_t)
         call append_limit_point(results%limit_curves, results%file, record)
      end select
      call write_when_due(results, error, .false.)
   end subroutine results_record

   !> Closes a file that contains the model and no path, or only a part of it.
   subroutine results_leave(results, error)
      type(results_t), intent(inout) :: results
      type(error_t), allocatable, intent(out) :: error !! data could not be written; the file is closed nevertheless
      call put_attribute(results%file, '', 'status', data_of('model'))
      call file_close(results%file)
      call file_error(results%file, error)
   end subroutine results_leave

   !> Stores the cost, the accuracy and the final status, writes the file and closes it.
   subroutine results_close(results, status, accuracy, error)
      type(results_t), intent(inout) :: results
      character(*), intent(in) :: status          !! 'complete', or 'stopped: reason'
      type(accuracy_t), intent(in) :: accuracy
      type(error_t), allocatable, intent(out) :: error !! data could not be written; the file is closed nevertheless
      call write_performance(results%file)
      call write_accuracy(results%file, accuracy)
      call put_restart(results%file, results%checkpoint)
      call put_attribute(results%file, '', 'status', data_of(status))
      call check_tables(results%file)
      call file_close(results%file)
      call file_error(results%file, error)
   end subroutine results_close

   !> Flushes if the last flush is long ago.
   subroutine write_when_due(results, error, with_state)
      type(results_t), intent(inout) :: results
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in) :: with_state           !! true: a checkpoint has just been stored
      integer(i8) :: now, due
      call system_clock(now)
      due = max(results%flush_ticks, rest_of_flush * results%last_took)
      if (results%has_states .and. .not. with_state) due = patience * due
      if (now - results%flushed >= due) then
         call put_restart(results%file, results%checkpoint)
         call check_tables(results%file)
         call file_flush(results%file)
         call system_clock(results%flushed)
         results%last_took = results%flushed - now
      end if
      call file_error(results%file, error)
   end subroutine write_when_due
end module results
