!> An event of an increment and where it was found.
module located_events
   use kinds, only: wp
   use model, only: step_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use path_continuity, only: path_tangent_t
   use path_events, only: event_t
   use corrector, only: increment_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: located_event_t, note_balance

   type :: located_event_t
      type(event_t) :: event
      type(state_t) :: place                   !! the located point, or the nearest one found
      type(path_tangent_t) :: heading               !! tangent there
      type(increment_t) :: report
      real(wp) :: fraction = 1.0_wp            !! of the way to the trial
      type(error_bars_t), allocatable :: bars  !! not allocated where the deck does not want them
      logical :: located = .false.
      real(wp) :: swerve = 0.0_wp              !! bifurcation: what a unit force on its null vector turns the tangent by at the
      !! points that it was interpolated from
      logical :: passes = .false.              !! bifurcation: none; the trial is on a stabler path too near to be told apart
      logical :: later = .false.               !! bifurcation: it comes after the trial, whose pivots have the sign of rounding
   end type located_event_t

contains

   !> Notes what a place that no iteration has ended at leaves of balance, and whether that is as little as at any other point.
   pure subroutine note_balance(step, system, report, balanced)
      type(step_t), intent(in) :: step
      type(system_t), intent(in) :: system      !! assembled there
      type(increment_t), intent(inout) :: report
      logical, intent(out) :: balanced
      report%residual = max(system%force_residual, system%defect_residual)
      balanced = report%residual <= max(step%tolerance, system%round_off)
   end subroutine note_balance
end module located_events
