!> The result file: what it holds and when it is written. README.md describes its layout.
!>
!> The file is complete but for its rows as soon as it is open, with the status "running". Rows are collected in
!> memory and written in one go, then flushed, by the first point that comes 0.2 s or more after the last flush: every
!> dataset in the file then has all rows, and a run that is killed loses a few points that took 0.2 s at most to find.
!> The final status is the last thing written.
module results
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp, i8
   use errors, only: error_t
   use timing, only: timers_t
   use model, only: model_t
   use model_words, only: monitor_units, monitor_description
   use path_record, only: point_t, critical_t, accuracy_t
   use result_tables, only: write_root, write_status, write_mesh, write_obstacles, write_performance, write_accuracy, &
      & link_name
   use hdf5_file, only: hdf5_file_t, hdf5_create, hdf5_group, hdf5_flush, hdf5_close, hdf5_error
   use hdf5_datasets, only: hdf5_write
   use hdf5_series, only: series_set_t, series_real, series_integer, series_text, series_append, series_write, &
      & series_buffered, series_row_size
   implicit none
   private
   public :: results_t, results_open, results_point, results_critical, results_close

   real(wp), parameter :: flush_seconds = 0.2_wp  !! longest time a row waits in memory while points are coming
   integer, parameter :: flush_bytes = 8000000    !! and the most that may wait (fields)
   integer, parameter :: note_length = 120        !! of the notes on critical points; longer ones are cut

   !> Numbers of the growing datasets in the set below; 0: the file has no such dataset.
   type :: path_series_t
      integer :: load_factor = 0, arc_length = 0, step = 0, iterations = 0, residual = 0, negative_pivots = 0
      integer :: active_contacts = 0, lcp_size = 0, lcp_pivots = 0, label = 0
      integer, allocatable :: monitor(:)
   end type path_series_t

   type :: contact_series_t
      integer :: count = 0, start = 0, end = 0, angle_start = 0, angle_end = 0, contact = 0, reaction_total = 0
   end type contact_series_t

   type :: field_series_t
      integer :: point = 0, displacement = 0, section_forces = 0, reaction = 0, gap = 0
   end type field_series_t

   type :: critical_series_t
      integer :: label = 0, load_factor = 0, point = 0, step = 0, located = 0, note = 0
      integer, allocatable :: monitor(:)
   end type critical_series_t

   !> An open result file.
   type :: results_t
      private
      type(hdf5_file_t), public :: file           !! for further datasets of fixed size
      type(series_set_t) :: set
      type(path_series_t) :: path
      type(contact_series_t) :: contact
      type(field_series_t) :: field
      type(critical_series_t) :: critical
      integer :: n_points = 0
      integer(i8) :: flushed = 0_i8               !! clock at the last flush
      integer(i8) :: flush_ticks = 0_i8           !! flush_seconds in clock ticks
   end type results_t

contains

   !> Creates the result file and writes everything known before the first point.
   subroutine results_open(results, path, model, deck, version, error)
      type(results_t), intent(out) :: results
      character(*), intent(in) :: path            !! name of the file; one that exists is replaced
      type(model_t), intent(in) :: model
      character(*), intent(in) :: deck            !! full text of the deck
      character(*), intent(in) :: version         !! of the program
      type(error_t), allocatable, intent(out) :: error !! names the path and says why
      integer(i8) :: rate
      call hdf5_create(results%file, path)
      call write_root(results%file, model, deck, version)
      call write_mesh(results%file, model)
      if (size(model%obstacle) > 0) call write_obstacles(results%file, model%obstacle)
      call open_path(results, model)
      call open_critical(results, model)
      if (size(model%contact) > 0) call open_contact(results, model)
      call open_fields(results, model)
      call hdf5_flush(results%file)
      call system_clock(results%flushed, rate)
      results%flush_ticks = int(flush_seconds * real(rate, wp), i8)
      call hdf5_error(results%file, error)
      if (allocated(error)) call hdf5_close(results%file)
   end subroutine results_open

   !> Adds one accepted point.
   subroutine results_point(results, point, error)
      type(results_t), intent(inout) :: results
      type(point_t), intent(in) :: point          !! as many monitors and reaction totals as the model has
      type(error_t), allocatable, intent(out) :: error !! the file could not be written (at this or an earlier call)
      integer :: i
      results%n_points = results%n_points + 1
      associate (set => results%set, id => results%path)
         call series_append(set, id%load_factor, point%load_factor)
         call series_append(set, id%arc_length, point%arc_length)
         call series_append(set, id%step, point%step)
         call series_append(set, id%iterations, point%iterations)
         call series_append(set, id%residual, point%residual)
         call series_append(set, id%negative_pivots, point%negative_pivots)
         call series_append(set, id%active_contacts, point%active_contacts)
         call series_append(set, id%lcp_size, point%lcp_size)
         call series_append(set, id%lcp_pivots, point%lcp_pivots)
         call series_append(set, id%label, point%label)
         do i = 1, size(id%monitor)
            call series_append(set, id%monitor(i), point%monitor(i))
         end do
      end associate
      if (results%contact%count > 0) call append_contact(results%set, results%contact, point)
      if (allocated(point%displacement) .or. allocated(point%section_forces) .or. allocated(point%reaction) &
         & .or. allocated(point%gap)) call append_fields(results%set, results%field, point, results%n_points)
      call write_when_due(results, error)
   end subroutine results_point

   !> Adds one critical point.
   subroutine results_critical(results, critical, error)
      type(results_t), intent(inout) :: results
      type(critical_t), intent(in) :: critical    !! as many monitors as the model has
      type(error_t), allocatable, intent(out) :: error !! the file could not be written (at this or an earlier call)
      integer :: i
      associate (set => results%set, id => results%critical)
         call series_append(set, id%label, critical%label)
         call series_append(set, id%load_factor, critical%load_factor)
         call series_append(set, id%point, critical%point)
         call series_append(set, id%step, critical%step)
         call series_append(set, id%located, merge(1, 0, critical%located))
         if (allocated(critical%note)) then
            call series_append(set, id%note, critical%note)
         else
            call series_append(set, id%note, '')
         end if
         do i = 1, size(id%monitor)
            call series_append(set, id%monitor(i), critical%monitor(i))
         end do
      end associate
      call write_when_due(results, error)
   end subroutine results_critical

   !> Writes what is still in memory, the cost and the accuracy, then the final status, and closes the file.
   subroutine results_close(results, status, timers, accuracy, error)
      type(results_t), intent(inout) :: results
      character(*), intent(in) :: status          !! 'complete', or 'stopped: why'
      type(timers_t), intent(in) :: timers
      type(accuracy_t), intent(in) :: accuracy
      type(error_t), allocatable, intent(out) :: error !! something could not be written; the file is closed, too
      call series_write(results%set, results%file)
      call write_performance(results%file, timers)
      call write_accuracy(results%file, accuracy)
      call hdf5_flush(results%file)
      call write_status(results%file, status)
      call hdf5_close(results%file)
      call hdf5_error(results%file, error)
   end subroutine results_close

   !> Writes and flushes when the last flush is long ago or much is waiting.
   subroutine write_when_due(results, error)
      type(results_t), intent(inout) :: results
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: now
      call system_clock(now)
      if (now - results%flushed >= results%flush_ticks .or. series_buffered(results%set) > flush_bytes) then
         call series_write(results%set, results%file)
         call hdf5_flush(results%file)
         call system_clock(results%flushed)
      end if
      call hdf5_error(results%file, error)
   end subroutine write_when_due

   subroutine append_contact(set, id, point)
      type(series_set_t), intent(inout) :: set
      type(contact_series_t), intent(in) :: id
      type(point_t), intent(in) :: point
      associate (region => point%region)
         call series_append(set, id%count, size(region))
         call series_append(set, id%start, region%start)
         call series_append(set, id%end, region%end)
         call series_append(set, id%angle_start, region%angle_start)
         call series_append(set, id%angle_end, region%angle_end)
         call series_append(set, id%contact, region%contact)
      end associate
      call series_append(set, id%reaction_total, point%reaction_total)
   end subroutine append_contact

   !> One row in every field dataset, NaN where the point has no such field.
   subroutine append_fields(set, id, point, row)
      type(series_set_t), intent(inout) :: set
      type(field_series_t), intent(in) :: id
      type(point_t), intent(in) :: point
      integer, intent(in) :: row                  !! the point's number, from 1
      if (id%point == 0) return
      call series_append(set, id%point, row)
      ! Fields that are not allocated count as absent arguments.
      call append_field(set, id%displacement, series_row_size(set, id%displacement), point%displacement)
      call append_field(set, id%section_forces, series_row_size(set, id%section_forces), point%section_forces)
      call append_field(set, id%reaction, series_row_size(set, id%reaction), point%reaction)
      call append_field(set, id%gap, series_row_size(set, id%gap), point%gap)
   end subroutine append_fields

   subroutine append_field(set, id, n, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id, n
      real(wp), intent(in), optional :: value(n)
      real(wp), allocatable :: nothing(:)
      if (id == 0) return
      if (present(value)) then
         call series_append(set, id, value)
      else
         allocate (nothing(n), source=ieee_value(0.0_wp, ieee_quiet_nan))
         call series_append(set, id, nothing)
      end if
   end subroutine append_field

   subroutine open_path(results, model)
      type(results_t), intent(inout) :: results
      type(model_t), intent(in) :: model
      integer, parameter :: number(0) = 0         ! a row is one number
      call hdf5_group(results%file, '/path')
      associate (file => results%file, set => results%set, id => results%path)
         call series_real(set, file, id%load_factor, '/path/load_factor', number, '1', 'load factor of the step')
         call series_real(set, file, id%arc_length, '/path/arc_length', number, '1', &
            & 'sum of the dimensionless arc lengths from the start of the path')
         call series_integer(set, file, id%step, '/path/step', number, '1', 'step of the deck, from 1')
         call series_integer(set, file, id%iterations, '/path/iterations', number, '1', 'Newton iterations')
         call series_real(set, file, id%residual, '/path/residual', number, '1', 'relative residual')
         call series_integer(set, file, id%negative_pivots, '/path/negative_pivots', number, '1', &
            & 'negative pivots of the tangent on the null space of the active constraints')
         call series_integer(set, file, id%active_contacts, '/path/active_contacts', number, '1', &
            & 'candidates in contact')
         call series_integer(set, file, id%lcp_size, '/path/lcp_size', number, '1', 'largest LCP of the increment')
         call series_integer(set, file, id%lcp_pivots, '/path/lcp_pivots', number, '1', &
            & 'pivots of all LCPs of the increment')
         call series_text(set, file, id%label, '/path/label', 2, '1', 'blank, ' &
            & //'or LP limit point, BP bifurcation, C+ contact gained, C- contact lost, UZ user value, EP end')
      end associate
      call open_monitors(results, model, '/path/monitor', results%path%monitor, few=.false.)
   end subroutine open_path

   !> A group with one series for every monitor, in the deck's order.
   subroutine open_monitors(results, model, group, id, few)
      type(results_t), intent(inout) :: results
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group
      integer, allocatable, intent(out) :: id(:)
      logical, intent(in) :: few                  !! hardly more than ten rows will come
      integer, parameter :: number(0) = 0
      integer :: i
      call hdf5_group(results%file, group)
      allocate (id(size(model%monitor)))
      do i = 1, size(model%monitor)
         associate (monitor => model%monitor(i))
            call series_real(results%set, results%file, id(i), group//'/'//link_name(monitor%name), number, &
               & monitor_units(monitor), monitor_description(monitor, model%mesh), few=few)
         end associate
      end do
   end subroutine open_monitors

   subroutine open_critical(results, model)
      type(results_t), intent(inout) :: results
      type(model_t), intent(in) :: model
      integer, parameter :: number(0) = 0
      call hdf5_group(results%file, '/critical')
      associate (file => results%file, set => results%set, id => results%critical)
         call series_text(set, file, id%label, '/critical/label', 2, '1', &
            & 'LP limit point, BP bifurcation, C+ contact gained, C- contact lost, UZ user value, EP end', few=.true.)
         call series_real(set, file, id%load_factor, '/critical/load_factor', number, '1', 'load factor of the step', &
            & few=.true.)
         call series_integer(set, file, id%point, '/critical/point', number, '1', 'its point of the path, from 1', &
            & few=.true.)
         call series_integer(set, file, id%step, '/critical/step', number, '1', 'step of the deck, from 1', few=.true.)
         call series_integer(set, file, id%located, '/critical/located', number, '1', &
            & '1: found to the tolerance asked for, 0: bracketed only', few=.true.)
         call series_text(set, file, id%note, '/critical/note', note_length, '1', 'remark', few=.true.)
      end associate
      call open_monitors(results, model, '/critical/monitor', results%critical%monitor, few=.true.)
   end subroutine open_critical

   subroutine open_contact(results, model)
      type(results_t), intent(inout) :: results
      type(model_t), intent(in) :: model
      integer, parameter :: number(0) = 0
      integer :: i, k
      call hdf5_group(results%file, '/contact')
      associate (file => results%file, set => results%set, id => results%contact, contact => model%contact)
         call hdf5_write(file, '/contact/candidates', &
            & [(model%mesh%node_label(contact(i)%node), i=1, size(contact))], '1', &
            & 'node numbers (of the deck) of the candidates, contact after contact')
         call hdf5_write(file, '/contact/candidate_contact', &
            & [((i, k=1, size(contact(i)%node)), i=1, size(contact))], '1', 'contact of each candidate, from 1')
         call hdf5_write(file, '/contact/obstacle', model%obstacle(contact%obstacle)%name, '1', &
            & 'name of the obstacle of each contact')
         call series_integer(set, file, id%count, '/contact/count', number, '1', 'number of contact regions')
         call series_real(set, file, id%start, '/contact/start', [1], 'length', &
            & 'stress-free arc length along the candidates at the start of each region', ragged=.true.)
         call series_real(set, file, id%end, '/contact/end', [1], 'length', &
            & 'stress-free arc length along the candidates at the end of each region', ragged=.true.)
         call series_real(set, file, id%angle_start, '/contact/angle_start', [1], 'degree', &
            & 'angle of the start of each region from the reference direction of the obstacle', ragged=.true.)
         call series_real(set, file, id%angle_end, '/contact/angle_end', [1], 'degree', &
            & 'angle of the end of each region from the reference direction of the obstacle', ragged=.true.)
         call series_integer(set, file, id%contact, '/contact/contact', [1], '1', &
            & 'contact that each region belongs to, from 1; 0: no such region', ragged=.true.)
         call series_real(set, file, id%reaction_total, '/contact/reaction_total', [size(contact)], 'force', &
            & 'sum of the normal reactions of each contact')
      end associate
   end subroutine open_contact

   !> The fields that at least one step of the deck asks for.
   subroutine open_fields(results, model)
      type(results_t), intent(inout) :: results
      type(model_t), intent(in) :: model
      integer, parameter :: number(0) = 0
      integer :: n_candidates, i
      logical :: displacement, section_forces, reaction, gap
      n_candidates = sum([(size(model%contact(i)%node), i=1, size(model%contact))])
      displacement = any(model%step%field_every > 0 .and. model%step%field_displacement)
      section_forces = any(model%step%field_every > 0 .and. model%step%field_section_forces)
      reaction = any(model%step%field_every > 0 .and. model%step%field_reaction) .and. n_candidates > 0
      gap = any(model%step%field_every > 0 .and. model%step%field_gap) .and. n_candidates > 0
      if (.not. (displacement .or. section_forces .or. reaction .or. gap)) return
      call hdf5_group(results%file, '/fields')
      associate (file => results%file, set => results%set, id => results%field)
         call series_integer(set, file, id%point, '/fields/point', number, '1', 'point of the path of each row, from 1')
         if (displacement) call series_real(set, file, id%displacement, '/fields/displacement', &
            & [3, model%mesh%n_nodes], 'length, length, radian', 'displacements u, v and rotation of every node')
         if (section_forces) call series_real(set, file, id%section_forces, '/fields/section_forces', &
            & [3, 2, model%mesh%n_elements], 'force, force, moment', 'N, Q, M at both ends of every element')
         if (reaction) call series_real(set, file, id%reaction, '/fields/reaction', [n_candidates], 'force', &
            & 'normal reaction at every candidate')
         if (gap) call series_real(set, file, id%gap, '/fields/gap', [n_candidates], 'length', &
            & 'gap at every candidate')
      end associate
   end subroutine open_fields
end module results
