!> Tables of the limit curves in the result file, to which rows are added: /limit_curve/<name>, one row for each limit point.
module limit_series
   use model, only: model_t, parameter_words
   use text, only: word_at
   use model_words, only: parameter_units, parameter_object
   use path_record, only: limit_point_t
   use bar_series, only: value_columns_t, open_values, put_values, put_bars
   use result_tables, only: link_name
   use file_items, only: data_of
   use result_file, only: result_file_t, put_group, put_attribute
   use growing_tables, only: begin_table, end_definition, begin_row, put_value
   implicit none
   private
   public :: limit_series_t, open_limit_series, append_limit_point

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
end module limit_series
