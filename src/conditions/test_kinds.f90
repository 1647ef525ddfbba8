!> One test of a set of contact spans: kind, position and value. The value is >= 0 while the contact set is valid.
module test_kinds
   use kinds, only: wp
   implicit none
   private
   public :: span_test_t, any_fails, any_may_fail, any_crosses, crosses, another_fails, with_scale, test_slack, well_below, &
      & test_words, is_length
   public :: test_gap, test_force, test_curvature, test_pressure, test_length, test_vanishing, test_boundary_span, test_slope, &
      & test_leaving, test_couple

   ! Kinds of tests:
   integer, parameter :: test_gap = 1       !! least gap of a free span, or between a line contact and another obstacle
   integer, parameter :: test_force = 2     !! concentrated force of a point contact, or of a line contact at a segment boundary
   integer, parameter :: test_curvature = 3 !! relative curvature of a point contact: curvature of the rod minus that of the
   !! obstacle, > 0 away from the obstacle
   integer, parameter :: test_pressure = 4  !! least density of force along a line contact
   integer, parameter :: test_length = 5    !! length of a line contact
   integer, parameter :: test_vanishing = 6 !! largest gap of a free span beside a contact; if this gap is below rounding, the
   !! length of the free span
   integer, parameter :: test_boundary_span = 7  !! length of a free span between a contact span and a segment boundary
   integer, parameter :: test_slope = 8     !! slope of the gap beside a contact at the end of a rod or at a corner
   integer, parameter :: test_leaving = 9 !! point contact at a segment boundary: its force moves along the rod when the rod turns.
   !! A turn that counts as zero, minus the magnitude of the turn
   integer, parameter :: test_couple = 10 !! minus the magnitude of the couple that acts on a line contact's node at a segment
   !! boundary

   !> For each kind of test: what happens where its value is zero.
   character(*), parameter :: test_words(10) = [character(40) :: 'contact begins', 'contact ends', 'a contact point spreads', &
      & 'contact opens inside', 'a contact line shrinks to a point', 'a free span lies down', &
      & 'contact comes to a breakpoint of the rod', 'an end of a rod lies down', &
      & 'contact leaves a breakpoint of the rod', 'a couple lifts a line']

   real(wp), parameter :: inside_elements = 1.0e-9_wp !! error of the solution inside elements, relative

   !> For each kind of test: amount by which its value may be below zero before the test counts as failed.
   real(wp), parameter :: test_slack(10) = [ &
      & inside_elements, & ! gap
      & inside_elements, & ! force
      & inside_elements, & ! curvature
      & 1.0e-6_wp, & ! pressure, a second derivative of the solution
      & 0.0_wp, &    ! length
      & inside_elements, & ! vanishing
      & 0.0_wp, &    ! boundary span
      & inside_elements, & ! slope
      & inside_elements, & ! leaving
      & inside_elements]   ! couple

   real(wp), parameter :: well_below = 10.0_wp !! multiple of a slack, or of the error of a located zero, beyond which a value is
   !! certainly not zero. It is ten, because slack and error are known by their order of magnitude only. Where one test is zero,
   !! another test fails if it is below minus this multiple of its slack

   !> One test of a contact set and its value in one state.
   type :: span_test_t
      integer :: kind = 0
      real(wp) :: value = 0.0_wp !! value of the test, divided by the structure's size, force scale or curvature scale (1/size)
      real(wp) :: error = 0.0_wp            !! gap: bound of the error of `value`; 0 for other kinds
      integer :: contact_span = 0           !! index of the tested contact span in problem%contact_span; 0: the test is one of a gap
      integer :: candidate = 0              !! force, curvature, slope: contact node
      integer :: contact = 0                !! gap, vanishing: index into model%contact
      integer :: rod_segment = 0
      integer :: element(2) = 0 !! gap, vanishing: first and last element of the free span; gap: or of the line contact with another
      !! obstacle
      integer :: beside(2) = 0 !! vanishing: contact spans before and after the free span; 0: no contact span of this contact
      real(wp) :: ends(2) = 0.0_wp          !! vanishing: coordinates of the free span's ends along the rod segment
      real(wp) :: at = 0.0_wp !! gap, pressure: coordinate of the least value along the rod segment; leaving: distance along the rod
      !! from the node to the contact force
      !> Side or direction, by kind of test:
      !>   pressure   at the first end (-1), inside (0), at the last end (1) of the line contact
      !>   curvature  before (-1) or after (1) a support that fixes the rotation; 0: the rotation is free
      !>   boundary span, slope   free span or rod before (-1) or after (1) the contact
      !>   leaving    towards the beginning (-1) or the end (1) of the rod
      real(wp) :: sense = 1.0_wp
   end type span_test_t

contains

   !> True if tests of this kind have a length as value, which vanishes.
   elemental logical function is_length(kind)
      integer, intent(in) :: kind
      is_length = kind == test_length .or. kind == test_boundary_span
   end function is_length

   !> True if any test is below zero by more than the slack of its kind.
   pure logical function any_fails(tests)
      type(span_test_t), intent(in) :: tests(:)
      any_fails = .not. all(tests%value >= -test_slack(tests%kind))
   end function any_fails

   !> True if any test, at the lower bound that the error of its value allows, is below zero by more than the slack of its kind.
   pure logical function any_may_fail(tests)
      type(span_test_t), intent(in) :: tests(:)
      any_may_fail = any(tests%value - tests%error < -test_slack(tests%kind))
   end function any_may_fail

   !> True if a test has failed at the end of an increment: it is below zero by more than the slack of its kind. A pressure test,
   !> whose slack is the largest, also fails if its value was above the slack at the start of the increment and is below zero at the
   !> end.
   elemental logical function crosses(before, after)
      type(span_test_t), intent(in) :: before, after !! the same test at the start and at the end of an increment
      associate (slack => test_slack(after%kind))
         crosses = .not. after%value >= -slack
         if (after%kind == test_pressure) crosses = crosses .or. (after%value < 0.0_wp .and. before%value > slack)
      end associate
   end function crosses

   !> True if any test has failed at the end of an increment, see crosses.
   pure logical function any_crosses(before, after)
      type(span_test_t), intent(in) :: before(:), after(:) !! tests at the beginning and the end of the increment
      any_crosses = any(crosses(before, after))
   end function any_crosses

   !> True if a test, other than the one that is zero, is below zero by more than `well_below` times the slack of its kind.
   pure logical function another_fails(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which               !! index of the test that is zero
      integer :: k
      another_fails = any(tests%value < -well_below * test_slack(tests%kind) .and. [(k, k=1, size(tests))] /= which)
   end function another_fails

   !> The test, with its value related to another scale of forces.
   elemental type(span_test_t) function with_scale(test, ratio) result(scaled)
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: ratio              !! scale of forces of `test` over the scale of forces of the result
      scaled = test
      if (any(test%kind == [test_force, test_pressure, test_couple])) scaled%value = test%value * ratio
   end function with_scale
end module test_kinds
