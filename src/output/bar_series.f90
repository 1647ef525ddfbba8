!> Growing datasets of the monitors, and of the error bars of load factor and monitors.
module bar_series
   use kinds, only: wp
   use model, only: model_t
   use model_words, only: monitor_units, monitor_description
   use error_bar, only: error_bar_t, error_bars_t
   use result_tables, only: link_name
   use error_text, only: stored_bar, stored_correction, bar_description, corrected_description
   use hdf5_file, only: hdf5_file_t, hdf5_group
   use hdf5_series, only: series_set_t, series_real, series_append
   implicit none
   private
   public :: bar_series_t, open_bars, append_bars, open_monitor_series

   !> Numbers of the datasets in their set; 0: the file has no such dataset. Error bars of load factor and monitors, and the
   !> corrected values.
   type :: bar_series_t
      integer :: error = 0, corrected = 0
      integer, allocatable :: monitor_error(:), monitor_corrected(:)
   end type bar_series_t

   integer, parameter :: number(0) = 0            ! a row is a single number

contains

   !> Creates the datasets of error bars next to those of the values.
   subroutine open_bars(id, set, file, model, group, few)
      type(bar_series_t), intent(out) :: id
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! group of the points
      logical, intent(in) :: few                  !! true: hardly more than ten rows are expected
      call series_real(set, file, id%error, group//'/error', number, '1', bar_description, few=few)
      call series_real(set, file, id%corrected, group//'/corrected', number, '1', corrected_description, few=few)
      call open_monitor_series(id%monitor_error, set, file, model, group//'/monitor_error', few=few)
      call open_monitor_series(id%monitor_corrected, set, file, model, group//'/monitor_corrected', few=few)
   end subroutine open_bars

   !> Appends the error bars of one point, if they have datasets.
   subroutine append_bars(set, id, load_factor, monitor, bars)
      type(series_set_t), intent(inout) :: set
      type(bar_series_t), intent(in) :: id
      real(wp), intent(in) :: load_factor, monitor(:)
      type(error_bars_t), intent(in), optional :: bars !! if not allocated, they count as absent
      type(error_bar_t) :: none
      integer :: i
      if (id%error == 0) return
      if (.not. present(bars)) then
         call append_bar(id%error, id%corrected, load_factor, none)
      else
         call append_bar(id%error, id%corrected, load_factor, bars%load)
      end if
      do i = 1, size(id%monitor_error)
         if (present(bars)) then
            call append_bar(id%monitor_error(i), id%monitor_corrected(i), monitor(i), bars%monitor(i))
         else
            call append_bar(id%monitor_error(i), id%monitor_corrected(i), monitor(i), none)
         end if
      end do

   contains

      subroutine append_bar(error_id, corrected_id, value, bar)
         integer, intent(in) :: error_id, corrected_id
         real(wp), intent(in) :: value
         type(error_bar_t), intent(in) :: bar
         call series_append(set, error_id, stored_bar(bar))
         call series_append(set, corrected_id, stored_correction(value, bar))
      end subroutine append_bar
   end subroutine append_bars

   !> A group with one series for every monitor, in the deck's order.
   subroutine open_monitor_series(id, set, file, model, group, few)
      integer, allocatable, intent(out) :: id(:)  !! number of each monitor's series in the set
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! full path of the group to create
      logical, intent(in) :: few                  !! true: hardly more than ten rows are expected
      integer :: i
      call hdf5_group(file, group)
      allocate (id(size(model%monitor)))
      do i = 1, size(model%monitor)
         associate (monitor => model%monitor(i))
            call series_real(set, file, id(i), group//'/'//link_name(monitor%name), number, &
               & monitor_units(monitor), monitor_description(monitor, model), few=few)
         end associate
      end do
   end subroutine open_monitor_series
end module bar_series
