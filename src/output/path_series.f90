!> Growing datasets of one path: its points, critical points, contact regions and fields.
!>
!> Those of the path of the steps are at the root of the result file, those of branch k in /branch/<k>; the layout is the same.
module path_series
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp
   use model, only: model_t, obstacles_move
   use path_record, only: point_t, critical_t
   use bar_series, only: bar_series_t, open_bars, append_bars, open_monitor_series
   use error_text, only: stored_bar, stored_correction
   use force_series, only: force_series_t, open_forces, append_forces
   use columns, only: whole
   use hdf5_file, only: hdf5_file_t, hdf5_group, hdf5_has, hdf5_remove
   use hdf5_datasets, only: hdf5_write
   use hdf5_series, only: series_set_t, series_real, series_integer, series_text, series_append, series_row_size, series_length
   implicit none
   private
   public :: path_series_t, open_path_series, append_point, append_critical, write_null_vectors

   integer, parameter :: note_length = 120        !! length of the notes on critical points; longer notes are cut
   character(*), parameter :: label_words = 'LP limit point, BP bifurcation, TP turning point of a monitor, ' &
      & //'C+ contact gained, C- contact lost, UZ user value, EP end'
   integer, parameter :: number(0) = 0            ! a row is a single number

   !> Numbers of the growing datasets in their set; 0: the file has no such dataset.
   type :: point_series_t
      integer :: load_factor = 0, arc_length = 0, step = 0, iterations = 0, residual = 0, negative_pivots = 0, free_pivots = 0
      integer :: active_contacts = 0, lcp_size = 0, lcp_pivots = 0, label = 0
      integer, allocatable :: monitor(:)
      integer :: load_rate = 0
      integer, allocatable :: monitor_rate(:)
      type(bar_series_t) :: bars
   end type point_series_t

   type :: contact_series_t
      integer :: count = 0, start = 0, end = 0, angle_start = 0, angle_end = 0, contact = 0, reaction_total = 0
      integer :: obstacle_force = 0, obstacle_shift = 0
      integer :: start_error = 0, end_error = 0, start_corrected = 0, end_corrected = 0
   end type contact_series_t

   type :: field_series_t
      integer :: point = 0, displacement = 0, section_forces = 0, reaction = 0, reaction_density = 0, gap = 0, contact_point = 0
   end type field_series_t

   type :: critical_series_t
      integer :: label = 0, load_factor = 0, point = 0, step = 0, located = 0, multiplicity = 0, note = 0
      integer, allocatable :: monitor(:)
      type(bar_series_t) :: bars
   end type critical_series_t

   !> All series of one path.
   type :: path_series_t
      private
      character(:), allocatable :: group          !! '' for the root, or '/branch/<k>'
      integer :: n_points = 0, n_critical = 0     !! rows appended so far
      type(point_series_t) :: path
      type(critical_series_t) :: critical
      type(contact_series_t) :: contact
      type(field_series_t) :: field
      type(force_series_t) :: force
   end type path_series_t

contains

   !> Creates the groups and datasets of a path; a failure is stored in the file.
   subroutine open_path_series(series, set, file, model, group)
      type(path_series_t), intent(out) :: series
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! group of the path: '' for the root, else an existing group
      integer :: k
      series%group = group
      call open_points(series%path, set, file, model, group//'/path')
      call open_critical(series%critical, set, file, model, group//'/critical')
      if (size(model%contact) > 0) call open_contact(series%contact, set, file, model, group//'/contact')
      call open_fields(series%field, set, file, model, group//'/fields')
      call open_forces(series%force, set, file, model, group)
      ! If a file is continued, these are its numbers of rows at the checkpoint; later null vectors are removed.
      series%n_points = series_length(set, series%path%label)
      series%n_critical = series_length(set, series%critical%label)
      k = series%n_critical + 1
      do while (hdf5_has(file, group//'/critical/null_vector/'//whole(k)))
         call hdf5_remove(file, group//'/critical/null_vector/'//whole(k))
         k = k + 1
      end do
   end subroutine open_path_series

   !> Appends one accepted point to every dataset for which the point has a value.
   subroutine append_point(series, set, point)
      type(path_series_t), intent(inout) :: series
      type(series_set_t), intent(inout) :: set
      type(point_t), intent(in) :: point          !! as many monitors and reaction totals as the model has
      integer :: i
      series%n_points = series%n_points + 1
      associate (id => series%path)
         call series_append(set, id%load_factor, point%load_factor)
         call series_append(set, id%arc_length, point%arc_length)
         call series_append(set, id%step, point%step)
         call series_append(set, id%iterations, point%iterations)
         call series_append(set, id%residual, point%residual)
         call series_append(set, id%negative_pivots, point%negative_pivots)
         call series_append(set, id%free_pivots, point%free_pivots)
         call series_append(set, id%active_contacts, point%active_contacts)
         call series_append(set, id%lcp_size, point%lcp_size)
         call series_append(set, id%lcp_pivots, point%lcp_pivots)
         call series_append(set, id%label, point%label)
         do i = 1, size(id%monitor)
            call series_append(set, id%monitor(i), point%monitor(i))
         end do
         call append_rates(set, id, point)
         call append_bars(set, id%bars, point%load_factor, point%monitor, point%bars)
      end associate
      if (series%contact%count > 0) call append_contact(set, series%contact, point)
      if (allocated(point%displacement) .or. allocated(point%section_forces) .or. allocated(point%reaction) &
         & .or. allocated(point%gap)) call append_fields(set, series%field, point, series%n_points)
      call append_forces(series%force, set, point, series%n_points)
   end subroutine append_point

   !> Appends the derivatives of load factor and monitors by arc length; NaN if they are unknown.
   subroutine append_rates(set, id, point)
      type(series_set_t), intent(inout) :: set
      type(point_series_t), intent(in) :: id
      type(point_t), intent(in) :: point
      real(wp) :: rate(1 + size(point%monitor))
      integer :: i
      rate = ieee_value(rate, ieee_quiet_nan)
      if (allocated(point%rate)) rate = point%rate
      call series_append(set, id%load_rate, rate(1))
      do i = 1, size(id%monitor_rate)
         call series_append(set, id%monitor_rate(i), rate(1 + i))
      end do
   end subroutine append_rates

   !> Appends one critical point without its null vectors.
   subroutine append_critical(series, set, critical)
      type(path_series_t), intent(inout) :: series
      type(series_set_t), intent(inout) :: set
      type(critical_t), intent(in) :: critical    !! as many monitors as the model has
      integer :: i, multiplicity
      series%n_critical = series%n_critical + 1
      multiplicity = 0
      if (allocated(critical%null_vector)) multiplicity = size(critical%null_vector, 3)
      associate (id => series%critical)
         call series_append(set, id%label, critical%label)
         call series_append(set, id%load_factor, critical%load_factor)
         call series_append(set, id%point, critical%point)
         call series_append(set, id%step, critical%step)
         call series_append(set, id%located, merge(1, 0, critical%located))
         call series_append(set, id%multiplicity, multiplicity)
         if (allocated(critical%note)) then
            call series_append(set, id%note, critical%note)
         else
            call series_append(set, id%note, '')
         end if
         do i = 1, size(id%monitor)
            call series_append(set, id%monitor(i), critical%monitor(i))
         end do
         call append_bars(set, id%bars, critical%load_factor, critical%monitor, critical%bars)
      end associate
   end subroutine append_critical

   !> Writes the null vectors of the critical point appended last, named by its row number.
   subroutine write_null_vectors(series, file, null_vector)
      type(path_series_t), intent(in) :: series
      type(hdf5_file_t), intent(inout) :: file
      real(wp), intent(in), contiguous :: null_vector(:, :, :) !! (3, nodes, multiplicity)
      call hdf5_write(file, series%group//'/critical/null_vector/'//whole(series%n_critical), null_vector, &
         & '1, 1, radian / length', 'null vectors u, v and rotation of every node, the largest translation is 1')
   end subroutine write_null_vectors

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
         if (id%start_error > 0) then
            call series_append(set, id%start_error, stored_bar(region%bar(1)))
            call series_append(set, id%end_error, stored_bar(region%bar(2)))
            call series_append(set, id%start_corrected, stored_correction(region%start, region%bar(1)))
            call series_append(set, id%end_corrected, stored_correction(region%end, region%bar(2)))
         end if
      end associate
      call series_append(set, id%reaction_total, point%reaction_total)
      call append_field(set, id%obstacle_force, size(point%obstacle_force), point%obstacle_force)
      if (allocated(point%obstacle_shift)) call append_field(set, id%obstacle_shift, size(point%obstacle_shift), &
         & point%obstacle_shift)
   end subroutine append_contact

   !> Appends one row to every field dataset, NaN if the point has no such field.
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
      call append_field(set, id%reaction_density, series_row_size(set, id%reaction_density), point%reaction_density)
      call append_field(set, id%gap, series_row_size(set, id%gap), point%gap)
      call append_field(set, id%contact_point, series_row_size(set, id%contact_point), point%contact_point)
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

   ! Creating the datasets -----------------------------------------------------------------------------------------

   subroutine open_points(id, set, file, model, group)
      type(point_series_t), intent(out) :: id
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group
      call hdf5_group(file, group)
      call series_real(set, file, id%load_factor, group//'/load_factor', number, '1', 'load factor of the step')
      call series_real(set, file, id%arc_length, group//'/arc_length', number, '1', &
         & 'sum of the dimensionless arc lengths from the start of the path')
      call series_integer(set, file, id%step, group//'/step', number, '1', 'step of the deck, from 1')
      call series_integer(set, file, id%iterations, group//'/iterations', number, '1', 'Newton iterations')
      call series_real(set, file, id%residual, group//'/residual', number, '1', 'relative residual')
      call series_integer(set, file, id%negative_pivots, group//'/negative_pivots', number, '1', &
         & 'negative pivots of the tangent on the null space of the active constraints')
      call series_integer(set, file, id%free_pivots, group//'/free_pivots', number, '1', &
         & 'the same, without contacts that carry no force')
      call series_integer(set, file, id%active_contacts, group//'/active_contacts', number, '1', &
         & 'candidates in contact')
      call series_integer(set, file, id%lcp_size, group//'/lcp_size', number, '1', 'largest LCP of the increment')
      call series_integer(set, file, id%lcp_pivots, group//'/lcp_pivots', number, '1', &
         & 'pivots of all LCPs of the increment')
      call series_text(set, file, id%label, group//'/label', 2, '1', 'blank, or '//label_words)
      call open_monitor_series(id%monitor, set, file, model, group//'/monitor', few=.false.)
      call series_real(set, file, id%load_rate, group//'/load_rate', number, '1', &
         & 'd(load factor)/d(arc length); NaN where the path may have a corner')
      call open_monitor_series(id%monitor_rate, set, file, model, group//'/monitor_rate', few=.false.)
      if (any(model%step%error_bars .and. model%step%n_modes == 0)) &
         & call open_bars(id%bars, set, file, model, group, few=.false.)
   end subroutine open_points

   subroutine open_critical(id, set, file, model, group)
      type(critical_series_t), intent(out) :: id
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group
      call hdf5_group(file, group)
      call series_text(set, file, id%label, group//'/label', 2, '1', label_words, few=.true.)
      call series_real(set, file, id%load_factor, group//'/load_factor', number, '1', 'load factor of the step', &
         & few=.true.)
      call series_integer(set, file, id%point, group//'/point', number, '1', 'its point of the path, from 1', few=.true.)
      call series_integer(set, file, id%step, group//'/step', number, '1', 'step of the deck, from 1', few=.true.)
      call series_integer(set, file, id%located, group//'/located', number, '1', &
         & '1: found to the tolerance asked for, 0: bracketed only', few=.true.)
      call series_integer(set, file, id%multiplicity, group//'/multiplicity', number, '1', &
         & 'null vectors of a bifurcation, in null_vector/<row from 1>; 0: none are stored', few=.true.)
      call series_text(set, file, id%note, group//'/note', note_length, '1', 'remark', few=.true.)
      call open_monitor_series(id%monitor, set, file, model, group//'/monitor', few=.true.)
      if (any(model%step%error_bars .and. model%step%n_modes == 0)) &
         & call open_bars(id%bars, set, file, model, group, few=.true.)
      call hdf5_group(file, group//'/null_vector')
   end subroutine open_critical

   subroutine open_contact(id, set, file, model, group)
      type(contact_series_t), intent(out) :: id
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group
      character(*), parameter :: along = 'stress-free arc length along the candidates at the ', &
         & angle = 'angle from the reference direction of the obstacle at the ', &
         & bar_of = 'error bar (NaN: no estimate, infinite: the mesh is too coarse to tell) of the '
      call hdf5_group(file, group)
      call series_integer(set, file, id%count, group//'/count', number, '1', 'number of contact regions')
      call series_real(set, file, id%start, group//'/start', [1], 'length', along//'start of each region', ragged=.true.)
      call series_real(set, file, id%end, group//'/end', [1], 'length', along//'end of each region', ragged=.true.)
      call series_real(set, file, id%angle_start, group//'/angle_start', [1], 'degree', angle//'start of each region', &
         & ragged=.true.)
      call series_real(set, file, id%angle_end, group//'/angle_end', [1], 'degree', angle//'end of each region', &
         & ragged=.true.)
      call series_integer(set, file, id%contact, group//'/contact', [1], '1', &
         & 'contact that each region belongs to, from 1; 0: no such region', ragged=.true.)
      if (any(model%contact%along) .and. any(model%step%error_bars .and. model%step%n_modes == 0)) then
         call series_real(set, file, id%start_error, group//'/start_error', [1], 'length', bar_of//'start of each region', &
            & ragged=.true.)
         call series_real(set, file, id%end_error, group//'/end_error', [1], 'length', bar_of//'end of each region', ragged=.true.)
         call series_real(set, file, id%start_corrected, group//'/start_corrected', [1], 'length', &
            & 'start less its estimated error', ragged=.true.)
         call series_real(set, file, id%end_corrected, group//'/end_corrected', [1], 'length', &
            & 'end less its estimated error', ragged=.true.)
      end if
      call series_real(set, file, id%reaction_total, group//'/reaction_total', [size(model%contact)], 'force', &
         & 'sum of the normal reactions of each contact')
      call series_real(set, file, id%obstacle_force, group//'/obstacle_force', [2, size(model%obstacle)], 'force', &
         & 'sum of the forces (x, y) of each obstacle on the structure, in the order of the deck')
      if (obstacles_move(model)) call series_real(set, file, id%obstacle_shift, group//'/obstacle_shift', &
         & [2, size(model%obstacle)], 'length', 'how far each obstacle has moved, in the order of the deck')
   end subroutine open_contact

   !> Creates the datasets of the fields that at least one step of the deck requests.
   subroutine open_fields(id, set, file, model, group)
      type(field_series_t), intent(out) :: id
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group
      integer :: n_candidates, i
      logical :: displacement, section_forces, reaction, gap
      n_candidates = sum([(size(model%contact(i)%node), i=1, size(model%contact))])
      displacement = any(model%step%field_every > 0 .and. model%step%field_displacement)
      section_forces = any(model%step%field_every > 0 .and. model%step%field_section_forces)
      reaction = any(model%step%field_every > 0 .and. model%step%field_reaction) .and. n_candidates > 0
      gap = any(model%step%field_every > 0 .and. model%step%field_gap) .and. n_candidates > 0
      if (.not. (displacement .or. section_forces .or. reaction .or. gap)) return
      call hdf5_group(file, group)
      call series_integer(set, file, id%point, group//'/point', number, '1', 'point of the path of each row, from 1')
      if (displacement) call series_real(set, file, id%displacement, group//'/displacement', &
         & [3, model%mesh%n_nodes], 'length, length, radian', 'displacements u, v and rotation of every node of the deck')
      if (section_forces) call series_real(set, file, id%section_forces, group//'/section_forces', &
         & [3, 2, model%mesh%n_elements], 'force, force, moment', 'N, Q, M at both ends of every element')
      if (reaction) call series_real(set, file, id%reaction, group//'/reaction', [n_candidates], 'force', &
         & 'normal reaction at every candidate; its share where reactions are distributed')
      if (reaction) call series_real(set, file, id%reaction_density, group//'/reaction_density', [n_candidates], &
         & 'force/length', 'normal reaction per stress-free length; reactions at nodes: over half of both elements')
      if (gap) call series_real(set, file, id%gap, group//'/gap', [n_candidates], 'length', 'gap at every candidate')
      if (reaction .or. gap) call series_real(set, file, id%contact_point, group//'/contact_point', [2, n_candidates], 'length', &
         & 'where reaction and gap of every candidate are: its node, or the contact point that it follows along the rod')
   end subroutine open_fields
end module path_series
