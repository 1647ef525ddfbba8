!> An event inside an increment, with the state at which it was located.
module located_events
   use kinds, only: wp
   use model, only: step_t
   use linear_system, only: system_t
   use path_point, only: path_point_t
   use path_events, only: event_t
   use corrector, only: increment_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: located_event_t, note_balance

   !> An event inside an increment, before and after it is located.
   type :: located_event_t
      type(event_t) :: event
      type(path_point_t) :: point              !! located point, or the nearest one found
      type(increment_t) :: report !! report of the correction to the point, or of the residual of an interpolated state
      real(wp) :: fraction = 1.0_wp            !! position of the event between the last accepted point and the trial, 0 to 1
      type(error_bars_t), allocatable :: bars  !! error bars of the event; not allocated: the deck requests none
      logical :: located = .false.               !! true: the event was located; false: it is only bracketed
      real(wp) :: tangent_turn = 0.0_wp !! bifurcation: change of the path tangent caused by a unit force on the null vector, at the
      !! points between which the bifurcation is interpolated
      logical :: later = .false. !! bifurcation: true: it lies behind the trial, whose vanishing pivots have the signs of rounding
   end type located_event_t

contains

   !> Computes the residual of a state that was interpolated, not iterated. `balanced` is true if the residual is within tolerance
   !> or rounding.
   pure subroutine note_balance(step, system, report, balanced)
      type(step_t), intent(in) :: step
      type(system_t), intent(in) :: system      !! assembled at the interpolated state
      type(increment_t), intent(inout) :: report
      logical, intent(out) :: balanced !! true: the residual is within tolerance or rounding
      report%residual = max(system%force_residual, system%defect_residual)
      balanced = report%residual <= max(step%tolerance, system%round_off)
   end subroutine note_balance
end module located_events
