!> Growing tables of the result file: a path has its points, critical points, contact regions, fields and contact forces.
!>
!> Those of the path of the steps are at the root of the result file, those of branch k in /branch/<k>; the layout is the same. For
!> each table one procedure both defines the columns and stores a row (growing_tables). The limit curves have such tables, too:
!> /limit_curve/<name>, one row for each limit point.
module path_series
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp
   use text, only: to_text, word_at
   use model, only: model_t, obstacles_move, parameter_words
   use path_record, only: point_t, critical_t, limit_point_t
   use bar_series, only: value_columns_t, open_values, put_values, put_bars
   use error_text, only: stored_bar, stored_correction
   use file_items, only: data_of, row_of, place_of, remove_items
   use result_file, only: result_file_t, put_group, put_data, put_attribute
   use growing_tables, only: begin_table, end_definition, begin_row, put_value, table_length
   use model_words, only: parameter_units, parameter_object
   use result_tables, only: link_name
   implicit none
   private
   public :: path_series_t, open_path_series, append_point, append_critical, limit_series_t, open_limit_series, &
      & append_limit_point

   integer, parameter :: note_length = 120        !! length of the notes on critical points; longer notes are cut
   character(*), parameter :: label_words = 'LP limit point, BP bifurcation, TP turning point of a monitor, ' &
      & //'C+ contact gained, C- contact lost, UZ user value, EP end'

   !> Quantities that a path has because of its model.
   type :: contents_t
      type(value_columns_t) :: values             !! load factor, monitors and their error bars
      integer :: n_contacts = 0, n_obstacles = 0, n_candidates = 0, n_nodes = 0, n_elements = 0
      logical :: place_bars = .false.             !! true: places of contact have error bars
      logical :: moving = .false.                 !! true: obstacles move
      logical :: displacement = .false., section_forces = .false., reaction = .false., gap = .false. !! true: some step stores this
      !! field
   end type contents_t

   !> All tables of one path.
   type :: path_series_t
      private
      character(:), allocatable :: group          !! '' for the root, or '/branch/<k>'
      integer :: path = 0, critical = 0, contact = 0, field = 0, force = 0, pressure = 0 !! numbers of the tables; 0: the file has
      !! no such table
      type(contents_t) :: has
   end type path_series_t

   !> Table of one limit curve.
   type :: curve_series_t
      integer :: step = 0, curve = 0              !! number of the curve's step; index of the curve in the step
      integer :: table = 0                        !! number of the curve's table
      character(:), allocatable :: units          !! units of the parameter
      type(value_columns_t) :: values
   end type curve_series_t

   !> All limit curves of the deck.
   type :: limit_series_t
      private
      type(curve_series_t), allocatable :: curve(:)
   end type limit_series_t

contains

   !> Creates the groups of a path and defines its tables; a failure is stored in the file.
   subroutine open_path_series(series, file, model, group)
      type(path_series_t), intent(out) :: series
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! group of the path: '' for the root, else an existing group
      type(point_t) :: no_point
      type(critical_t) :: no_critical
      integer :: k
      series%group = group
      series%has = contents(model)
      allocate (no_point%monitor(size(model%monitor)), no_critical%monitor(size(model%monitor)), no_point%region(0))
      call begin_table(file, series%path, group//'/path')
      call put_group(file, group//'/path/monitor_rate')
      call open_values(series%has%values, file, model, group//'/path')
      call put_point(file, series%path, series%has, no_point)
      call end_definition(file, series%path)
      call begin_table(file, series%critical, group//'/critical')
      call open_values(series%has%values, file, model, group//'/critical')
      call put_group(file, group//'/critical/null_vector')
      call put_critical(file, series%critical, series%has, no_critical)
      call end_definition(file, series%critical)
      if (series%has%n_contacts > 0) then
         call begin_table(file, series%contact, group//'/contact')
         call put_contact(file, series%contact, series%has, no_point)
         call end_definition(file, series%contact)
      end if
      if (series%has%displacement .or. series%has%section_forces .or. series%has%reaction .or. series%has%gap) then
         call begin_table(file, series%field, group//'/fields')
         call put_fields(file, series%field, series%has, no_point, 0)
         call end_definition(file, series%field)
      end if
      call open_forces(series, file, model, group)
      ! If a file is continued, its table has the rows up to the checkpoint; later null vectors are removed.
      k = table_length(file, series%critical) + 1
      do while (place_of(file%items, group//'/critical/null_vector/'//to_text(k), '') > 0)
         call remove_items(file%items, group//'/critical/null_vector/'//to_text(k))
         k = k + 1
      end do
   end subroutine open_path_series

   !> Quantities that paths of a model have.
   pure function contents(model) result(has)
      type(model_t), intent(in) :: model
      type(contents_t) :: has
      integer :: i
      has%n_contacts = size(model%contact)
      has%n_obstacles = size(model%obstacle)
      has%n_candidates = sum([(size(model%contact(i)%node), i=1, size(model%contact))])
      has%n_nodes = model%mesh%n_nodes
      has%n_elements = model%mesh%n_elements
      has%values%with_bars = any(model%step%error_bars .and. model%step%n_modes == 0)
      has%place_bars = any(model%contact%along) .and. has%values%with_bars
      has%moving = obstacles_move(model)
      has%displacement = any(model%step%field_every > 0 .and. model%step%field_displacement)
      has%section_forces = any(model%step%field_every > 0 .and. model%step%field_section_forces)
      has%reaction = any(model%step%field_every > 0 .and. model%step%field_reaction) .and. has%n_candidates > 0
      has%gap = any(model%step%field_every > 0 .and. model%step%field_gap) .and. has%n_candidates > 0
   end function contents

   !> Appends one accepted point to every table for which the point has a value.
   subroutine append_point(series, file, point)
      type(path_series_t), intent(in) :: series
      type(result_file_t), intent(inout) :: file
      type(point_t), intent(in) :: point          !! as many monitors and reaction totals as the model has
      call put_point(file, series%path, series%has, point)
      if (series%contact > 0) call put_contact(file, series%contact, series%has, point)
      if (series%field > 0 .and. (allocated(point%displacement) .or. allocated(point%section_forces) .or. &
         & allocated(point%reaction) .or. allocated(point%gap))) &
         & call put_fields(file, series%field, series%has, point, table_length(file, series%path))
      call append_forces(series, file, point)
   end subroutine append_point

   !> Appends one critical point, and stores its null vectors, named by its row number.
   subroutine append_critical(series, file, critical)
      type(path_series_t), intent(in) :: series
      type(result_file_t), intent(inout) :: file
      type(critical_t), intent(in) :: critical    !! as many monitors as the model has
      call put_critical(file, series%critical, series%has, critical)
      if (allocated(critical%null_vector)) call put_data(file, series%group//'/critical/null_vector/'// &
         & to_text(table_length(file, series%critical)), data_of(critical%null_vector), '1, 1, radian / length', &
         & 'null vectors u, v and rotation of every node, the largest translation is 1')
   end subroutine append_critical

   ! The tables -----------------------------------------------------------------------------------------------------

   !> Columns of /path.
   subroutine put_point(file, table, has, point)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: table
      type(contents_t), intent(in) :: has
      type(point_t), intent(in) :: point
      real(wp) :: rate(1 + size(point%monitor))
      rate = ieee_value(rate, ieee_quiet_nan)
      if (allocated(point%rate)) rate = point%rate
      call begin_row(file, table)
      call put_value(file, 'load_factor', data_of(point%load_factor), '1', 'load factor of the step')
      call put_value(file, 'arc_length', data_of(point%arc_length), '1', &
         & 'sum of the dimensionless arc lengths from the start of the path')
      call put_value(file, 'step', data_of(point%step), '1', 'step of the deck, from 1')
      call put_value(file, 'iterations', data_of(point%iterations), '1', 'Newton iterations')
      call put_value(file, 'residual', data_of(point%residual), '1', 'relative residual')
      call put_value(file, 'negative_pivots', data_of(point%negative_pivots), '1', &
         & 'negative pivots of the tangent on the null space of the active constraints')
      call put_value(file, 'free_pivots', data_of(point%free_pivots), '1', &
         & 'the same and those directions in which contacts without force open; 0: stable')
      call put_value(file, 'active_contacts', data_of(point%active_contacts), '1', 'candidates in contact')
      call put_value(file, 'lcp_size', data_of(point%lcp_size), '1', 'largest LCP of the increment')
      call put_value(file, 'lcp_pivots', data_of(point%lcp_pivots), '1', 'pivots of all LCPs of the increment')
      call put_value(file, 'label', data_of(point%label, 2), '1', 'blank, or '//label_words)
      call put_values(file, has%values, 'monitor', point%monitor)
      call put_value(file, 'load_rate', data_of(rate(1)), '1', &
         & 'd(load factor)/d(arc length), zero at a limit point; NaN where the path may have a corner')
      call put_values(file, has%values, 'monitor_rate', rate(2:))
      call put_bars(file, has%values, point%load_factor, point%monitor, point%bars)
   end subroutine put_point

   !> Columns of /critical.
   subroutine put_critical(file, table, has, critical)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: table
      type(contents_t), intent(in) :: has
      type(critical_t), intent(in) :: critical
      character(:), allocatable :: note
      integer :: multiplicity
      note = ''
      if (allocated(critical%note)) note = critical%note
      multiplicity = 0
      if (allocated(critical%null_vector)) multiplicity = size(critical%null_vector, 3)
      call begin_row(file, table)
      call put_value(file, 'label', data_of(critical%label, 2), '1', label_words)
      call put_value(file, 'load_factor', data_of(critical%load_factor), '1', 'load factor of the step')
      call put_value(file, 'point', data_of(critical%point), '1', 'its point of the path, from 1')
      call put_value(file, 'step', data_of(critical%step), '1', 'step of the deck, from 1')
      call put_value(file, 'located', data_of(merge(1, 0, critical%located)), '1', &
         & '1: found to the tolerance asked for, 0: bracketed only')
      call put_value(file, 'multiplicity', data_of(multiplicity), '1', &
         & 'null vectors of a bifurcation, in null_vector/<row from 1>; 0: none are stored')
      call put_value(file, 'note', data_of(note, note_length), '1', 'remark')
      call put_values(file, has%values, 'monitor', critical%monitor)
      call put_bars(file, has%values, critical%load_factor, critical%monitor, critical%bars)
   end subroutine put_critical

   !> Columns of /contact.
   subroutine put_contact(file, table, has, point)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: table
      type(contents_t), intent(in) :: has
      type(point_t), intent(in) :: point
      character(*), parameter :: along = 'stress-free arc length along the candidates at the ', &
         & angle = 'angle from the reference direction of the obstacle at the ', &
         & bar_of = 'error bar (NaN: no estimate, infinite: the mesh is too coarse to tell) of the '
      call begin_row(file, table)
      associate (region => point%region)
         call put_value(file, 'count', data_of(size(region)), '1', 'number of contact regions')
         call put_regions('start', region%start, 'length', along//'start of each region')
         call put_regions('end', region%end, 'length', along//'end of each region')
         call put_regions('angle_start', region%angle_start, 'degree', angle//'start of each region')
         call put_regions('angle_end', region%angle_end, 'degree', angle//'end of each region')
         call put_value(file, 'contact', data_of(region%contact), '1', &
            & 'contact that each region belongs to, from 1; 0: no such region', ragged=.true.)
         if (has%place_bars) then
            call put_regions('start_error', stored_bar(region%bar(1)), 'length', bar_of//'start of each region')
            call put_regions('end_error', stored_bar(region%bar(2)), 'length', bar_of//'end of each region')
            call put_regions('start_corrected', stored_correction(region%start, region%bar(1)), 'length', &
               & 'start less its estimated error')
            call put_regions('end_corrected', stored_correction(region%end, region%bar(2)), 'length', &
               & 'end less its estimated error')
         end if
      end associate
      call put_value(file, 'reaction_total', row_of([has%n_contacts], point%reaction_total), 'force', &
         & 'sum of the normal reactions of each contact')
      call put_value(file, 'obstacle_force', row_of([2, has%n_obstacles], point%obstacle_force), 'force', &
         & 'sum of the forces (x, y) of each obstacle on the structure, in the order of the deck')
      if (.not. has%moving) return
      call put_value(file, 'obstacle_shift', row_of([2, has%n_obstacles], point%obstacle_shift), 'length', &
         & 'how far each obstacle has moved, in the order of the deck')
      call put_value(file, 'obstacle_turn', row_of([has%n_obstacles], point%obstacle_turn), 'radian', &
         & 'how far each obstacle has turned about its pivot')

   contains

      !> A number of each region.
      subroutine put_regions(name, value, units, description)
         character(*), intent(in) :: name, units, description
         real(wp), intent(in) :: value(:)         !! (regions)
         call put_value(file, name, data_of(value), units, description, ragged=.true.)
      end subroutine put_regions
   end subroutine put_contact

   !> Columns of /fields: fields that at least one step of the deck requests. A field that is not allocated counts as an absent
   !> argument.
   subroutine put_fields(file, table, has, point, row)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: table
      type(contents_t), intent(in) :: has
      type(point_t), intent(in) :: point
      integer, intent(in) :: row                  !! the point's number, from 1
      call begin_row(file, table)
      call put_value(file, 'point', data_of(row), '1', 'point of the path of each row, from 1')
      if (has%displacement) call put_value(file, 'displacement', row_of([3, has%n_nodes], point%displacement), &
         & 'length, length, radian', 'displacements u, v and rotation of every node of the deck')
      if (has%section_forces) call put_value(file, 'section_forces', row_of([3, 2, has%n_elements], point%section_forces), &
         & 'force, force, moment', 'N, Q, M at both ends of every element')
      if (has%reaction) then
         call put_value(file, 'reaction', row_of([has%n_candidates], point%reaction), 'force', &
            & 'normal reaction at every candidate; its share where reactions are distributed')
         call put_value(file, 'reaction_density', row_of([has%n_candidates], point%reaction_density), 'force/length', &
            & 'normal reaction per stress-free length; reactions at nodes: over half of both elements')
      end if
      if (has%gap) call put_value(file, 'gap', row_of([has%n_candidates], point%gap), 'length', 'gap at every candidate')
      if (has%reaction .or. has%gap) call put_value(file, 'contact_point', row_of([2, has%n_candidates], point%contact_point), &
         & 'length', 'where reaction and gap of every candidate are: its node, or the contact point that it follows along the rod')
   end subroutine put_fields

   !> Defines both tables if a step stores reactions and the deck has contact along rods.
   subroutine open_forces(series, file, model, group)
      type(path_series_t), intent(inout) :: series
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! group of the path; '': root
      real(wp), parameter :: nothing(6) = 0.0_wp
      if (.not. any(model%contact%along)) return
      if (.not. any(model%step%field_every > 0 .and. model%step%field_reaction)) return
      call begin_table(file, series%force, group//'/contact_force')
      call put_push(file, series%force, 0, nothing, .false.)
      call end_definition(file, series%force)
      call begin_table(file, series%pressure, group//'/contact_pressure')
      call put_push(file, series%pressure, 0, nothing, .true.)
      call end_definition(file, series%pressure)
   end subroutine open_forces

   !> Appends the contact forces of one point.
   subroutine append_forces(series, file, point)
      type(path_series_t), intent(in) :: series
      type(result_file_t), intent(inout) :: file
      type(point_t), intent(in) :: point
      integer :: i
      if (series%force == 0) return
      if (allocated(point%contact_force)) then
         do i = 1, size(point%contact_force, 2)
            call put_push(file, series%force, table_length(file, series%path), point%contact_force(:, i), .false.)
         end do
      end if
      if (allocated(point%contact_pressure)) then
         do i = 1, size(point%contact_pressure, 2)
            call put_push(file, series%pressure, table_length(file, series%path), point%contact_pressure(:, i), .true.)
         end do
      end if
   end subroutine append_forces

   !> Columns of /contact_force and of /contact_pressure.
   subroutine put_push(file, table, row, push, pressure)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: table, row
      real(wp), intent(in) :: push(6)             !! see span_forces
      logical, intent(in) :: pressure             !! true: per length; false: a force
      call begin_row(file, table)
      call put_value(file, 'point', data_of(row), '1', 'point of the path, from 1')
      call put_value(file, 'contact', data_of(nint(push(1))), '1', 'contact of the deck, from 1')
      call put_value(file, 'arc_length', data_of(push(2)), 'length', 'stress-free arc length along the contact')
      call put_value(file, 'place', data_of(push(3:4)), 'length', 'where it acts (x, y), deformed')
      if (pressure) then
         call put_value(file, 'force', data_of(push(5:6)), 'force/length', &
            & 'force (x, y) on the structure per stress-free length of a line of contact: five places at equal distances in '// &
            & 'each part that is smooth, one part after another')
      else
         call put_value(file, 'force', data_of(push(5:6)), 'force', 'force (x, y) on the structure at a point or the end of a line')
      end if
   end subroutine put_push

   !> Defines the tables of all limit curves; does nothing if the deck has none. A failure is stored in the file.
   subroutine open_limit_series(series, file, model)
      type(limit_series_t), intent(out) :: series
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(limit_point_t) :: no_point
      character(:), allocatable :: group
      integer :: i, k, n
      allocate (series%curve(sum([(size(model%step(i)%limit_curve), i=1, size(model%step))])))
      if (size(series%curve) == 0) return
      call put_group(file, '/limit_curve')
      allocate (no_point%monitor(size(model%monitor)))
      n = 0
      do i = 1, size(model%step)
         do k = 1, size(model%step(i)%limit_curve)
            n = n + 1
            associate (id => series%curve(n), curve => model%step(i)%limit_curve(k))
               id%step = i
               id%curve = k
               id%units = trim(parameter_units(curve%parameter))
               id%values%with_bars = model%step(i)%error_bars
               group = '/limit_curve/'//link_name(curve%name)
               call begin_table(file, id%table, group)
               call put_attribute(file, group, 'step', data_of(i))
               call put_attribute(file, group, 'parameter', data_of(word_at(parameter_words, curve%parameter)))
               call put_attribute(file, group, 'of', data_of(parameter_object(curve, model)))
               call put_attribute(file, group, 'limit_point', data_of(curve%limit_point))
               call open_values(id%values, file, model, group)
               call put_limit_point(file, id, no_point)
               call end_definition(file, id%table)
            end associate
         end do
      end do
   end subroutine open_limit_series

   !> Adds one limit point to its curve.
   subroutine append_limit_point(series, file, limit_point)
      type(limit_series_t), intent(in) :: series
      type(result_file_t), intent(inout) :: file
      type(limit_point_t), intent(in) :: limit_point !! limit point on a curve of the model; with as many monitors as the model has
      integer :: k
      do k = 1, size(series%curve)
         if (series%curve(k)%step == limit_point%step .and. series%curve(k)%curve == limit_point%curve) &
            & call put_limit_point(file, series%curve(k), limit_point)
      end do
   end subroutine append_limit_point

   !> Columns of a limit curve.
   subroutine put_limit_point(file, id, point)
      type(result_file_t), intent(inout) :: file
      type(curve_series_t), intent(in) :: id
      type(limit_point_t), intent(in) :: point
      call begin_row(file, id%table)
      call put_value(file, 'parameter', data_of(point%parameter), id%units, 'what is varied; infinity where the obstacle is rigid')
      call put_value(file, 'rigid', data_of(merge(1, 0, point%rigid)), '1', '1: with a rigid obstacle, 0: else')
      call put_value(file, 'load_factor', data_of(point%load_factor), '1', 'load factor of the step at the limit point')
      call put_value(file, 'iterations', data_of(point%iterations), '1', 'Newton iterations of all its corrections')
      call put_value(file, 'residual', data_of(point%residual), '1', 'relative residual of equilibrium')
      call put_value(file, 'load_rate', data_of(point%load_rate), '1', &
         & 'change of the load factor with arc length, zero at a limit point, over its value at the start of the path')
      call put_value(file, 'label', data_of(point%label, 2), '1', 'blank, or TP the parameter turns back, EP end')
      call put_values(file, id%values, 'monitor', point%monitor)
      call put_bars(file, id%values, point%load_factor, point%monitor, point%bars)
   end subroutine put_limit_point
end module path_series
