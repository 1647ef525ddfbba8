!> Data of a contact change: the examined increment with its tests; the kind and place of the change and the tests that are zero
!> there.
module contact_change_types
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use test_kinds, only: span_test_t, with_scale
   use span_tests, only: run_span_tests
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use corrector, only: increment_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: step_interval_t, change_t, new_interval
   public :: change_none, change_missed, change_located
   public :: place_within, place_here, place_ahead

   ! Kinds of the first change on an increment, and how each is located:
   integer, parameter :: change_none = 0    !! none: the set is valid up to the end of the increment
   integer, parameter :: change_missed = 1  !! a test fails at the end, but its zero was not found
   integer, parameter :: change_located = 2 !! the zero of a test was found by a bracket, or for an osculating contact by Newton's
   !! method with prescribed relative curvature (osculating_contacts); trials then give the next set (contact_trials)
   ! Places of a change.
   integer, parameter :: place_within = 0   !! the change is on the increment
   integer, parameter :: place_here = 1     !! the change is at the run's point
   integer, parameter :: place_ahead = 2    !! the change is beyond the end of the increment

   !> The examined increment, with the contact tests at its ends.
   type :: step_interval_t
      type(state_t) :: from  !! beginning of the increment; if no increment converges: beginning of the last converged increment
      type(path_point_t) :: to                    !! end of the increment
      logical :: stuck = .false.                  !! true: no increment converges from the end, which is the run's point
      integer :: pivots = 0                       !! number of negative pivots at the end
      real(wp) :: scale = 0.0_wp                  !! scale of forces
      type(span_test_t), allocatable :: before(:), after(:) !! contact tests at both ends
   end type step_interval_t

   !> The first change of the contact set on an increment, and its location.
   type :: change_t
      integer :: kind = change_none
      integer :: where = place_within
      integer :: which = 0                        !! index of the test that is zero; 0: none
      type(span_test_t), allocatable :: tests(:)  !! contact tests at the place of the change
      logical :: too_coarse = .false. !! true: contact begins, but on a mesh with nodes at the new contacts another gap is closed
      !! already; the run's mesh does not show which contact begins first
      type(span_test_t), allocatable :: zero(:) !! the tests that are zero at the change; the test by which it was located comes
      !! first
      character(2) :: label = '  '                !! contact gained (C+) or lost (C-), empty if neither
      logical :: divides = .false.                !! a part of the lost contact remains on both sides
      real(wp), allocatable :: since !! load factor before the run's point at which the contact force of the test was zero. Since
      !! then the force has lifted only a negligible length of rod, and counts as zero; not allocated: the test is zero at the
      !! change itself
      type(path_point_t) :: point                 !! place of the change, with the present set
      type(increment_t) :: report                 !! report of Newton's method at the place of the change
      type(error_bars_t), allocatable :: bars     !! error bars of the change; not allocated: unknown
   end type change_t

contains

   !> The increment from the run's point to a trial, with the tests at its ends.
   function new_interval(problem, run, trial, stuck) result(interval)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial     !! with its contact tests
      logical, intent(in) :: stuck                !! true: the trial is the run's last point
      type(step_interval_t) :: interval
      interval%to = trial
      interval%stuck = stuck
      interval%from = run%last%state
      if (stuck) interval%from = run%trail(1)%way%from
      interval%pivots = trial%system%negative_pivots
      interval%scale = max(trial%system%force_scale, tiny(interval%scale))
      interval%after = trial%span_tests
      if (allocated(run%last%span_tests) .and. .not. stuck) then
         interval%before = with_scale(run%last%span_tests, run%last%system%force_scale / interval%scale)
      else
         interval%before = run_span_tests(problem, interval%from, interval%scale)
      end if
   end function new_interval
end module contact_change_types
