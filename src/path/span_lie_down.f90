!> A free span that lies down all at once: as its point contact becomes as curved as the obstacle the whole span beside it does,
!> an arc under pressure or a straight rod against a wall. There the place of the point is neutral and no increment of the
!> old set gets there; the line of the new set is regular, and begins where its pressure is zero.
module span_lie_down
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use contact_touch, only: touch_t
   use span_problem, only: new_span_problem, hold_touches, present_touches
   use span_tests, only: span_test_t, run_span_tests, touch_place, gap_at, test_slack, test_curvature, test_pressure
   use state_transfer, only: carried
   use path_control, only: control_t, displacement_between
   use path_run, only: run_t, heading_of
   use path_continuity, only: heading_t, heading_at
   use path_events, only: new_probe
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: lie_down

   real(wp), parameter :: ahead = 20.0_wp      !! increments over which a straight line tells when both vanish
   real(wp), parameter :: together = 0.3_wp    !! of that: they do so together
   integer, parameter :: samples = 16          !! of the gap over a span
   integer, parameter :: max_tries = 12

contains

   !> Looks whether a free span is about to lie down. If so the run and the trial are taken to the new set, the trial to where
   !> it begins.
   subroutine lie_down(problem, run, earlier, trial, heading, lies, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run          !! its system factored at the trial, on return too
      type(state_t), intent(in) :: earlier       !! point of the path before the trial
      type(state_t), intent(inout) :: trial
      type(heading_t), intent(inout) :: heading  !! tangent at the trial
      logical, intent(out) :: lies
      type(timers_t), intent(inout) :: timers
      type(span_test_t), allocatable :: before(:), after(:), tests(:)
      type(touch_t), allocatable :: touch(:)
      type(problem_t) :: next
      type(system_t) :: system
      type(state_t) :: state, start
      real(wp) :: scale, left, gaps(2), span(2), load
      integer :: k, side
      lies = .false.
      scale = max(run%system%force_scale, tiny(scale))
      after = run_span_tests(problem, trial, scale)
      if (.not. any(after%kind == test_curvature)) return
      before = run_span_tests(problem, earlier, scale)
      do k = 1, size(after)
         if (after(k)%kind /= test_curvature .or. after(k)%value >= before(k)%value) cycle
         left = after(k)%value / (before(k)%value - after(k)%value)
         if (left > ahead) cycle
         do side = 1, 2
            call free_span(problem, trial, after(k)%candidate, side, span)
            if (.not. span(2) > span(1)) cycle
            gaps(2) = largest_gap(problem, trial, after(k)%candidate, span)
            call free_span(problem, earlier, after(k)%candidate, side, span)
            gaps(1) = largest_gap(problem, earlier, after(k)%candidate, span)
            if (gaps(2) >= gaps(1)) cycle
            if (abs(gaps(2) / (gaps(1) - gaps(2)) - left) > together * left) cycle
            touch = laid_down(problem, trial, after(k)%candidate, side)
            next = new_span_problem(problem, touch)
            load = trial%load_factor + left * (trial%load_factor - earlier%load_factor)
            call find_begin(problem, next, trial, load, trial%load_factor - earlier%load_factor, state, system, lies, timers)
            if (.not. lies) cycle
            tests = run_span_tests(next, state, scale)
            lies = .not. any(tests%value < -10.0_wp * test_slack(tests%kind))
            if (lies) exit
         end do
         if (lies) exit
      end do
      if (.not. lies) return
      start = carried(problem, run%state, next)
      call hold_touches(next, start%active)
      problem = next
      run%state = start
      run%system = system
      trial = state
      if (allocated(run%control%tangent)) deallocate (run%control%tangent)
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      if (allocated(run%trail)) deallocate (run%trail)
      call linearise(problem, trial, trial, run%system, timers)
      run%heading = heading_at(problem, run%system, displacement_between(problem, run%state, trial), &
         & trial%load_factor - run%state%load_factor)
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
      heading = heading_of(problem, run, trial)
   end subroutine lie_down

   !> Where the new line begins to press: its least pressure is zero, or just above it.
   subroutine find_begin(problem, next, trial, load, step, state, system, found, timers)
      type(problem_t), intent(in) :: problem, next
      type(state_t), intent(in) :: trial         !! of `problem`
      real(wp), intent(in) :: load               !! guess
      real(wp), intent(in) :: step               !! the way that the load goes
      type(state_t), intent(out) :: state        !! of `next`
      type(system_t), intent(out) :: system
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(control_t) :: control
      type(increment_t) :: report
      type(state_t) :: start
      real(wp) :: loads(2), pressure(2), guess, slack
      integer :: try
      start = carried(problem, trial, next)
      call hold_touches(next, start%active)
      system = new_system(next)
      control%method = method_load
      state = start
      guess = load
      loads = load
      pressure = 0.0_wp
      found = .false.
      do try = 1, max_tries
         control%increment = guess - state%load_factor
         start = state
         call correct(next, start, control, .true., state, system, report, timers)
         if (.not. report%converged) return
         loads = [loads(2), guess]
         pressure = [pressure(2), least_pressure()]
         slack = 1.0e-3_wp * test_slack(test_pressure)
         found = pressure(2) >= 0.0_wp .and. pressure(2) <= slack
         if (found) return
         if (try == 1) then
            guess = guess + step
         else
            if (.not. abs(pressure(2) - pressure(1)) > 0.0_wp) return
            guess = loads(2) - (pressure(2) - 0.5_wp * slack) * (loads(2) - loads(1)) / (pressure(2) - pressure(1))
         end if
      end do

   contains

      real(wp) function least_pressure()
         type(span_test_t), allocatable :: tests(:)
         tests = run_span_tests(next, state, max(system%force_scale, tiny(1.0_wp)))
         least_pressure = minval(tests%value, mask=tests%kind == test_pressure)
      end function least_pressure
   end subroutine find_begin

   !> The free span on one side of a point contact, along the stretch; of no length where there is none.
   subroutine free_span(problem, state, candidate, side, span)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side     !! 1 before, 2 after
      real(wp), intent(out) :: span(2)
      real(wp) :: at, here
      integer :: c, stretch
      here = touch_place(problem, state, candidate)
      span = here
      stretch = problem%touch(problem%candidates%touch(candidate))%stretch
      span(side) = merge(0.0_wp, problem%layout%stretch(stretch)%length, side == 1)
      do c = 1, problem%candidates%n
         if (problem%candidates%touch(c) == 0 .or. c == candidate) cycle
         if (problem%touch(problem%candidates%touch(c))%stretch /= stretch) cycle
         at = touch_place(problem, state, c)
         if (side == 1 .and. at < here) span(1) = max(span(1), at)
         if (side == 2 .and. at > here) span(2) = min(span(2), at)
      end do
   end subroutine free_span

   !> Largest gap over a span to the obstacle of a point contact.
   real(wp) function largest_gap(problem, state, candidate, span) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(in) :: span(2)
      integer :: i
      gap = 0.0_wp
      associate (touch => problem%touch(problem%candidates%touch(candidate)))
         do i = 0, samples
            gap = max(gap, abs(gap_at(problem, state, touch%contact, touch%stretch, span(1) + (span(2) - span(1)) * i / samples)))
         end do
      end associate
   end function largest_gap

   !> The touches with a line from a point contact to the end of the free span on one side, and what touches there.
   function laid_down(problem, state, candidate, side) result(touch)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      type(touch_t), allocatable :: touch(:)
      real(wp) :: place(problem%candidates%n), span(2)
      integer :: c, k, other
      place = [(touch_place(problem, state, c), c=1, problem%candidates%n)]
      touch = present_touches(problem, place)
      call free_span(problem, state, candidate, side, span)
      k = problem%candidates%touch(candidate)
      other = 0
      do c = 1, size(touch)
         if (c == k .or. touch(c)%stretch /= touch(k)%stretch .or. touch(c)%contact /= touch(k)%contact) cycle
         if (side == 1 .and. touch(c)%at(2) >= span(1) .and. touch(c)%at(2) < span(2)) other = c
         if (side == 2 .and. touch(c)%at(1) <= span(2) .and. touch(c)%at(1) > span(1)) other = c
      end do
      touch(k)%line = .true.
      touch(k)%at = span
      if (other == 0) return
      touch(k)%at = [min(span(1), touch(other)%at(1)), max(span(2), touch(other)%at(2))]
      touch = [touch(:other - 1), touch(other + 1:)]
   end function laid_down
end module span_lie_down
