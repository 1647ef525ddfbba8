!> An event of an increment and where it was found.
module sightings
   use kinds, only: wp
   use rod_state, only: state_t
   use path_continuity, only: heading_t
   use path_events, only: event_t
   use corrector, only: increment_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: sighting_t

   type :: sighting_t
      type(event_t) :: event
      type(state_t) :: place                   !! the located point, or the nearest one found
      type(heading_t) :: heading               !! tangent there
      type(increment_t) :: report
      real(wp) :: fraction = 1.0_wp            !! of the way to the trial
      type(error_bars_t), allocatable :: bars  !! not allocated where the deck does not want them
      logical :: located = .false.
      real(wp) :: swerve = 0.0_wp              !! bifurcation: what a unit force on its null vector turns the tangent by at the
      !! points that it was interpolated from
      logical :: passes = .false.              !! bifurcation: none; the trial is on a stabler path too near to be told apart
      logical :: later = .false.               !! bifurcation: it comes after the trial, whose pivots have the sign of rounding
   end type sighting_t
end module sightings
