!> What may happen to contact spans on an increment.
module span_change
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use span_tests, only: span_test_t, run_span_tests
   use path_continuity, only: heading_t
   use path_run, only: run_t
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use error_bar, only: error_bars_t
   use timing, only: timers_t
   implicit none
   private
   public :: leg_t, change_t, next_t, new_leg, go_to_load
   public :: change_none, change_missed, change_by_rule, change_opening, change_vanishing
   public :: place_within, place_here, place_ahead

   ! What happens first on an increment; where it is, and how it is located:
   integer, parameter :: change_none = 0    !! the set holds up to its end
   integer, parameter :: change_missed = 1  !! a test fails there, and its zero was not found
   integer, parameter :: change_by_rule = 2 !! a test is zero, and tells what follows (span_rules): by a bracket; where a point is
   !! as curved as its obstacle by Newton's method with the point held (held_openings)
   integer, parameter :: change_opening = 3 !! likewise of a line's force, which lifts off: the laws of what opens (span_opening)
   integer, parameter :: change_vanishing = 4 !! a free span is gone: where the set without it begins to hold (vanishing_span)

   ! Where.
   integer, parameter :: place_within = 0   !! on the increment
   integer, parameter :: place_here = 1     !! where the run stands
   integer, parameter :: place_ahead = 2    !! beyond the end of the increment

   !> The increment that is looked at.
   type :: leg_t
      type(state_t) :: from, to                   !! its ends; where it is stuck, the last increment that was not
      type(heading_t) :: ahead                    !! tangent at its end
      logical :: stuck = .false.                  !! no increment converges from its end, which is where the run stands
      real(wp) :: scale = 0.0_wp                  !! of forces
      type(span_test_t), allocatable :: before(:), after(:) !! tests at both ends
   end type leg_t

   !> The equilibrium with another set, known before the run goes there: its next point.
   type :: next_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(system_t) :: system                    !! factored there
      type(heading_t) :: heading                  !! of the path that arrives there; without displacements: the run's own way
      real(wp) :: rate = 0.0_wp                   !! of a line that has lain down: of its least pressure, per unit of load factor;
      !! 0: the path goes on as it came
      type(increment_t) :: report = increment_t(converged=.true.)
      character(2) :: label = '  '                !! what is told there: contact gained or lost
      logical :: divides = .false.                !! of the contact that is lost a part stays on both sides
      integer :: times = 1                        !! so often
      type(error_bars_t), allocatable :: bars
      character(:), allocatable :: trouble        !! what of it could not be told
   end type next_t

   type :: change_t
      integer :: kind = change_none
      integer :: where = place_within
      integer :: which = 0                        !! index into the tests; 0: none of them tells
      type(span_test_t), allocatable :: tests(:)  !! at the place
      type(state_t) :: place
      type(heading_t) :: heading                  !! of the path that arrives there
      type(increment_t) :: report                 !! of the way there
      type(next_t) :: next                        !! what opens, or holds where a free span is gone
      type(error_bars_t), allocatable :: bars     !! of the place, where they are known with it
   end type change_t

contains

   !> The increment from where the run stands to a trial, with the tests at its ends.
   function new_leg(problem, run, trial, ahead, stuck) result(leg)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run              !! its system is factored at the trial
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead        !! tangent there
      logical, intent(in) :: stuck                !! the trial is the run's state
      type(leg_t) :: leg
      leg%to = trial
      leg%ahead = ahead
      leg%stuck = stuck
      leg%from = run%state
      if (stuck) leg%from = run%trail(1)%from
      leg%scale = max(run%system%force_scale, tiny(leg%scale))
      leg%after = run_span_tests(problem, leg%to, leg%scale)
      leg%before = run_span_tests(problem, leg%from, leg%scale)
   end function new_leg

   !> The next set at another load factor, and its tests there. Its state stays where there is no equilibrium: no tests.
   subroutine go_to_load(next, load, tests, timers)
      type(next_t), intent(inout) :: next
      real(wp), intent(in) :: load
      type(span_test_t), allocatable, intent(out) :: tests(:)
      type(timers_t), intent(inout) :: timers
      type(control_t) :: control
      type(increment_t) :: report
      type(state_t) :: start
      start = next%state
      control%method = method_load
      control%increment = load - start%load_factor
      call correct(next%problem, start, control, .true., next%state, next%system, report, timers)
      if (report%converged) then
         tests = run_span_tests(next%problem, next%state, max(next%system%force_scale, tiny(1.0_wp)))
      else
         next%state = start
      end if
   end subroutine go_to_load
end module span_change
