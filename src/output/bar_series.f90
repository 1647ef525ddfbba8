!> Columns of a table for the monitors, and for the error bars of load factor and monitors.
module bar_series
   use kinds, only: wp
   use model, only: model_t
   use model_words, only: monitor_units, monitor_description
   use error_bar, only: error_bar_t, error_bars_t
   use result_tables, only: link_name
   use error_text, only: stored_bar, stored_correction, bar_description, corrected_description
   use file_items, only: data_of
   use result_file, only: result_file_t, put_group
   use growing_tables, only: put_value
   implicit none
   private
   public :: value_columns_t, open_values, put_values, put_bars

   !> Words of the column of one monitor.
   type :: words_t
      character(:), allocatable :: name, units, description
   end type words_t

   !> Columns of load factor and monitors.
   type :: value_columns_t
      private
      logical, public :: with_bars = .false.      !! true: load factor and monitors have error bars
      type(words_t), allocatable :: monitor(:)    !! words of each monitor's column, in the deck's order
   end type value_columns_t

contains

   !> Collects the words of the columns, and creates their groups inside the group of a table.
   subroutine open_values(values, file, model, group)
      type(value_columns_t), intent(inout) :: values !! in: with_bars is set
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! full path of the table
      integer :: i
      call put_group(file, group//'/monitor')
      if (values%with_bars) call put_group(file, group//'/monitor_error')
      if (values%with_bars) call put_group(file, group//'/monitor_corrected')
      values%monitor = [(words_t(link_name(model%monitor(i)%name), monitor_units(model%monitor(i)), &
         & monitor_description(model%monitor(i), model)), i=1, size(model%monitor))]
   end subroutine open_values

   !> A column for each monitor.
   subroutine put_values(file, values, group, value)
      type(result_file_t), intent(inout) :: file
      type(value_columns_t), intent(in) :: values
      character(*), intent(in) :: group           !! group of the columns, inside that of the table
      real(wp), intent(in) :: value(:)            !! (monitors) values
      integer :: i
      do i = 1, size(values%monitor)
         associate (words => values%monitor(i))
            call put_value(file, group//'/'//words%name, data_of(value(i)), words%units, words%description)
         end associate
      end do
   end subroutine put_values

   !> Adds columns of the error bars and corrected values, if there are any.
   subroutine put_bars(file, values, load_factor, monitor, bars)
      type(result_file_t), intent(inout) :: file
      type(value_columns_t), intent(in) :: values
      real(wp), intent(in) :: load_factor, monitor(:)
      type(error_bars_t), intent(in), optional :: bars !! error bars; if not allocated, they count as missing
      type(error_bar_t) :: load, bar(size(monitor))
      if (.not. values%with_bars) return
      if (present(bars)) then
         load = bars%load
         bar = bars%monitor
      end if
      call put_value(file, 'error', data_of(stored_bar(load)), '1', bar_description)
      call put_value(file, 'corrected', data_of(stored_correction(load_factor, load)), '1', corrected_description)
      call put_values(file, values, 'monitor_error', stored_bar(bar))
      call put_values(file, values, 'monitor_corrected', stored_correction(monitor, bar))
   end subroutine put_bars
end module bar_series
