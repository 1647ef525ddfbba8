!> Representation of error bars: as numbers in files, as text in tables.
module error_text
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
   use kinds, only: wp
   use error_bar, only: error_bar_t
   use columns, only: significant, scientific
   implicit none
   private
   public :: stored_bar, stored_correction, bar_text, unbounded_text, corrected_text, bar_description, corrected_description

   character(*), parameter :: bar_description = 'error bar of the load factor: how far the discretisation may have it off; '// &
      & 'NaN: no estimate, infinite: the mesh is too coarse to tell'
   character(*), parameter :: corrected_description = 'load factor less its estimated error'
   integer, parameter :: corrected_digits = 13

contains

   !> Error bar as a number for files: NaN if there is no estimate, infinity if the mesh is too coarse for a bound.
   elemental real(wp) function stored_bar(bar) result(error)
      type(error_bar_t), intent(in) :: bar
      error = ieee_value(error, ieee_quiet_nan)
      if (.not. bar%estimated) return
      error = bar%bar
      if (.not. bar%bounded) error = ieee_value(error, ieee_positive_inf)
   end function stored_bar

   !> Value minus estimated error; NaN if there is no estimate.
   elemental real(wp) function stored_correction(value, bar) result(corrected)
      real(wp), intent(in) :: value
      type(error_bar_t), intent(in) :: bar
      corrected = ieee_value(corrected, ieee_quiet_nan)
      if (bar%estimated) corrected = value + bar%correction
   end function stored_correction

   !> Error bar as text for tables.
   pure function bar_text(bar) result(text)
      type(error_bar_t), intent(in) :: bar
      character(:), allocatable :: text
      if (.not. bar%estimated) then
         text = 'no estimate'
      else if (.not. bar%bar > 0.0_wp) then
         text = 'given'
      else
         text = trim(merge('+-', '> ', bar%bounded))//' '//scientific(bar%bar, 2)
      end if
   end function bar_text

   !> Text behind a value whose bar has no column: empty if the error is bounded.
   pure function unbounded_text(bar) result(text)
      type(error_bar_t), intent(in) :: bar
      character(:), allocatable :: text
      text = ''
      if (bar%estimated .and. .not. bar%bounded) text = ' '//bar_text(bar)
   end function unbounded_text

   !> Value minus estimated error, as text for tables; blank if the error is not bounded.
   pure function corrected_text(value, bar) result(text)
      real(wp), intent(in) :: value
      type(error_bar_t), intent(in) :: bar
      character(:), allocatable :: text
      text = ''
      if (bar%estimated .and. bar%bounded .and. bar%bar > 0.0_wp) text = significant(value + bar%correction, corrected_digits)
   end function corrected_text
end module error_text
