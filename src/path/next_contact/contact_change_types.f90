!> What may happen to contact spans on an increment.
module contact_change_types
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use test_kinds, only: span_test_t
   use span_tests, only: run_span_tests
   use path_continuity, only: path_tangent_t
   use path_state, only: path_state_t
   use next_spans, only: next_t
   use corrector, only: increment_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: step_interval_t, change_t, new_leg
   public :: change_none, change_missed, change_by_rule, change_opening, change_vanishing
   public :: place_within, place_here, place_ahead

   ! What happens first on an increment; where it is, and how it is located:
   integer, parameter :: change_none = 0    !! the set holds up to its end
   integer, parameter :: change_missed = 1  !! a test fails there, and its zero was not found
   integer, parameter :: change_by_rule = 2 !! a test is zero, and tells what follows (span_rules): by a bracket; where a point is
   !! as curved as its obstacle by Newton's method with that held (flat_points)
   integer, parameter :: change_opening = 3 !! likewise of a line's force, which lifts off: the laws of what opens (span_opening)
   integer, parameter :: change_vanishing = 4 !! a free span is gone: where the set without it begins to hold (vanishing_span)

   ! Where.
   integer, parameter :: place_within = 0   !! on the increment
   integer, parameter :: place_here = 1     !! where the run stands
   integer, parameter :: place_ahead = 2    !! beyond the end of the increment

   !> The increment that is looked at.
   type :: step_interval_t
      type(state_t) :: from, to                   !! its ends; where it is stuck, the last increment that was not
      type(path_tangent_t) :: ahead                    !! tangent at its end
      logical :: stuck = .false.                  !! no increment converges from its end, which is where the run stands
      integer :: pivots = 0                       !! negative ones at its end
      real(wp) :: scale = 0.0_wp                  !! of forces
      type(span_test_t), allocatable :: before(:), after(:) !! tests at both ends
   end type step_interval_t

   type :: change_t
      integer :: kind = change_none
      integer :: where = place_within
      integer :: which = 0                        !! index into the tests; 0: none of them tells
      type(span_test_t), allocatable :: tests(:)  !! at the place
      type(span_test_t), allocatable :: begins(:) !! gaps that are closed there, the one that was looked for last; none where
      !! that is another test
      character(2) :: label = '  '                !! contact gained or lost; where it only spreads, nothing
      logical :: divides = .false.                !! of the contact that is lost a part stays on both sides
      type(state_t) :: place
      type(path_tangent_t) :: heading                  !! of the path that arrives there
      type(increment_t) :: report                 !! of the way there
      type(next_t) :: next                        !! what opens, or holds where a free span is gone
      type(error_bars_t), allocatable :: bars     !! of the place, where they are known with it
   end type change_t

contains

   !> The increment from where the run stands to a trial, with the tests at its ends.
   function new_leg(problem, run, trial, ahead, stuck) result(leg)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run              !! its system is factored at the trial
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead        !! tangent there
      logical, intent(in) :: stuck                !! the trial is the run's state
      type(step_interval_t) :: leg
      leg%to = trial
      leg%ahead = ahead
      leg%stuck = stuck
      leg%from = run%state
      if (stuck) leg%from = run%trail(1)%from
      leg%pivots = run%system%negative_pivots
      leg%scale = max(run%system%force_scale, tiny(leg%scale))
      leg%after = run_span_tests(problem, leg%to, leg%scale)
      leg%before = run_span_tests(problem, leg%from, leg%scale)
   end function new_leg
end module contact_change_types
