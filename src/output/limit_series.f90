!> Growing datasets of the limit curves: /limit_curve/<name>, one row for each limit point.
module limit_series
   use model, only: model_t, limit_curve_t
   use model_words, only: parameter_name, parameter_units, parameter_object
   use path_record, only: limit_point_t
   use bar_series, only: bar_series_t, open_bars, append_bars, open_monitor_series
   use result_tables, only: link_name
   use hdf5_file, only: hdf5_file_t, hdf5_group
   use hdf5_attributes, only: hdf5_attribute
   use hdf5_series, only: series_set_t, series_real, series_integer, series_text, series_append
   implicit none
   private
   public :: limit_series_t, open_limit_series, append_limit_point

   !> Numbers of one curve's datasets in their set.
   type :: curve_series_t
      integer :: step = 0, curve = 0              !! step of the curve, and its index there
      integer :: parameter = 0, rigid = 0, load_factor = 0, iterations = 0, residual = 0, load_rate = 0, label = 0
      integer, allocatable :: monitor(:)
      type(bar_series_t) :: bars
   end type curve_series_t

   !> All limit curves of the deck.
   type :: limit_series_t
      private
      type(curve_series_t), allocatable :: curve(:)
   end type limit_series_t

contains

   !> Creates the groups and datasets of all limit curves; does nothing if the deck has none. A failure is stored in the file.
   subroutine open_limit_series(series, set, file, model)
      type(limit_series_t), intent(out) :: series
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer :: i, k, n
      allocate (series%curve(sum([(size(model%step(i)%limit_curve), i=1, size(model%step))])))
      if (size(series%curve) == 0) return
      call hdf5_group(file, '/limit_curve')
      n = 0
      do i = 1, size(model%step)
         do k = 1, size(model%step(i)%limit_curve)
            n = n + 1
            series%curve(n)%step = i
            series%curve(n)%curve = k
            call open_curve(series%curve(n), set, file, model, model%step(i)%limit_curve(k))
         end do
      end do
   end subroutine open_limit_series

   subroutine open_curve(id, set, file, model, curve)
      type(curve_series_t), intent(inout) :: id
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(limit_curve_t), intent(in) :: curve
      integer, parameter :: number(0) = 0         ! a row is a single number
      character(:), allocatable :: group
      group = '/limit_curve/'//link_name(curve%name)
      call hdf5_group(file, group)
      call hdf5_attribute(file, group, 'step', id%step)
      call hdf5_attribute(file, group, 'parameter', parameter_name(curve%parameter))
      call hdf5_attribute(file, group, 'of', parameter_object(curve, model))
      call hdf5_attribute(file, group, 'limit_point', curve%limit_point)
      call series_real(set, file, id%parameter, group//'/parameter', number, parameter_units(curve%parameter), &
         & 'what is varied; infinity where the obstacle is rigid')
      call series_integer(set, file, id%rigid, group//'/rigid', number, '1', '1: with a rigid obstacle, 0: else')
      call series_real(set, file, id%load_factor, group//'/load_factor', number, '1', &
         & 'load factor of the step at the limit point')
      call series_integer(set, file, id%iterations, group//'/iterations', number, '1', &
         & 'Newton iterations of all its corrections')
      call series_real(set, file, id%residual, group//'/residual', number, '1', 'relative residual of equilibrium')
      call series_real(set, file, id%load_rate, group//'/load_rate', number, '1', &
         & 'change of the load factor with arc length, zero at a limit point, over its value at the start of the path')
      call series_text(set, file, id%label, group//'/label', 2, '1', 'blank, or TP the parameter turns back, EP end')
      call open_monitor_series(id%monitor, set, file, model, group//'/monitor', few=.false.)
      if (model%step(id%step)%error_bars) call open_bars(id%bars, set, file, model, group, few=.false.)
   end subroutine open_curve

   !> Adds one limit point to its curve.
   subroutine append_limit_point(series, set, limit_point)
      type(limit_series_t), intent(in) :: series
      type(series_set_t), intent(inout) :: set
      type(limit_point_t), intent(in) :: limit_point !! of a curve of the model, as many monitors as the model has
      integer :: i, k
      do k = 1, size(series%curve)
         associate (id => series%curve(k))
            if (id%step /= limit_point%step .or. id%curve /= limit_point%curve) cycle
            call series_append(set, id%parameter, limit_point%parameter)
            call series_append(set, id%rigid, merge(1, 0, limit_point%rigid))
            call series_append(set, id%load_factor, limit_point%load_factor)
            call series_append(set, id%iterations, limit_point%iterations)
            call series_append(set, id%residual, limit_point%residual)
            call series_append(set, id%load_rate, limit_point%load_rate)
            call series_append(set, id%label, limit_point%label)
            do i = 1, size(id%monitor)
               call series_append(set, id%monitor(i), limit_point%monitor(i))
            end do
            call append_bars(set, id%bars, limit_point%load_factor, limit_point%monitor, limit_point%bars)
         end associate
      end do
   end subroutine append_limit_point
end module limit_series
