!> One test of a set of contact spans: of what, where, and what its value means.
module test_kinds
   use kinds, only: wp
   implicit none
   private
   public :: span_test_t, any_fails, any_crosses, crosses, another_fails, test_slack, well_below, test_words
   public :: test_gap, test_force, test_curvature, test_pressure, test_length, test_vanishing, test_crossing, test_slope, &
      & test_leaving, test_couple

   ! What is tested.
   integer, parameter :: test_gap = 1       !! least gap of a free span
   integer, parameter :: test_force = 2     !! concentrated force of a point, or of a line at a breakpoint
   integer, parameter :: test_curvature = 3 !! of a point contact against the obstacle's
   integer, parameter :: test_pressure = 4  !! least density along a line
   integer, parameter :: test_length = 5    !! of a line
   integer, parameter :: test_vanishing = 6 !! largest gap of a free span beside a contact; where that is gone, the span's length
   integer, parameter :: test_crossing = 7  !! length of a free span between a contact and a breakpoint of the rod
   integer, parameter :: test_slope = 8     !! of the gap inwards from an end of a rod, or a corner, that touches
   integer, parameter :: test_leaving = 9   !! how far from a breakpoint of the rod a point that is held there belongs
   integer, parameter :: test_couple = 10   !! that would have to hold a line's node at a breakpoint of the rod: minus its size

   !> What its zero means.
   character(*), parameter :: test_words(10) = [character(40) :: 'contact begins', 'contact ends', 'a contact point spreads', &
      & 'contact opens inside', 'a contact line shrinks to a point', 'a free span lies down', &
      & 'contact comes to a breakpoint of the rod', 'an end of a rod lies down', &
      & 'contact leaves a breakpoint of the rod', 'a couple lifts a line']

   !> What a test may fall below zero by before it is taken for violated: what the dense output errs by.
   real(wp), parameter :: test_slack(10) = [ &
      & 1.0e-9_wp, & ! gap
      & 1.0e-9_wp, & ! force
      & 1.0e-9_wp, & ! curvature
      & 1.0e-6_wp, & ! pressure, a second derivative of what is solved for
      & 0.0_wp, &    ! length
      & 1.0e-9_wp, & ! vanishing
      & 0.0_wp, &    ! crossing
      & 1.0e-9_wp, & ! slope
      & 0.0_wp, &    ! leaving
      & 1.0e-9_wp]   ! couple

   real(wp), parameter :: well_below = 10.0_wp !! slacks, at a place where a test is zero

   type :: span_test_t
      integer :: kind = 0
      real(wp) :: value = 0.0_wp            !! over its own scale: lengths, forces and curvatures of the structure
      integer :: touch = 0                  !! index into problem%touch; 0: none yet
      integer :: candidate = 0              !! force, curvature, slope: which node
      integer :: contact = 0                !! gap, vanishing: index into model%contact
      integer :: stretch = 0
      integer :: beside(2) = 0              !! vanishing: the touches before and after it; 0: none of this contact
      real(wp) :: ends(2) = 0.0_wp          !! vanishing: of the span along the stretch
      real(wp) :: at = 0.0_wp               !! gap, pressure: where along the stretch
      !> Which way, by kind:
      !>   pressure   at the line's first end (-1), inside (0), at its last (1)
      !>   curvature  before (-1) or after (1) a support that holds the rotation, 0: the rod turns there
      !>   crossing, slope   the free span, or the rod, lies before the touch (-1), or after it
      !>   leaving    towards the rod's beginning (-1), or its end
      real(wp) :: sense = 1.0_wp
   end type span_test_t

contains

   !> True where some test is below zero by more than it errs by.
   pure logical function any_fails(tests)
      type(span_test_t), intent(in) :: tests(:)
      any_fails = .not. all(tests%value >= -test_slack(tests%kind))
   end function any_fails

   !> True for a test that is below zero by more than it errs by. A pressure has the widest slack, an increment may end in it: one
   !> that has come from above the slack to below zero was zero between.
   elemental logical function crosses(before, after)
      type(span_test_t), intent(in) :: before, after !! one test at both ends of an increment
      associate (slack => test_slack(after%kind))
         crosses = .not. after%value >= -slack
         if (after%kind == test_pressure) crosses = crosses .or. (after%value < 0.0_wp .and. before%value > slack)
      end associate
   end function crosses

   !> True where some test is zero on an increment.
   pure logical function any_crosses(before, after)
      type(span_test_t), intent(in) :: before(:), after(:) !! at its ends
      any_crosses = any(crosses(before, after))
   end function any_crosses

   !> True where a test other than the one that is zero is well below.
   pure logical function another_fails(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which               !! index of the one that is
      integer :: k
      another_fails = any(tests%value < -well_below * test_slack(tests%kind) .and. [(k, k=1, size(tests))] /= which)
   end function another_fails
end module test_kinds
