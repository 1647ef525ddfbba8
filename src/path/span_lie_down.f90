!> A free span that lies down all at once: as its point contact becomes as curved as the obstacle the whole span beside it does,
!> an arc under pressure or a straight rod against a wall. There the place of the point is neutral and no increment of the
!> old set gets beyond; the line of the new set is regular, and begins where its pressure is zero.
module span_lie_down
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use contact_touch, only: touch_t
   use touch_edits, only: extended, joined
   use section_forces, only: end_forces
   use conforming_span, only: conforming_forces
   use span_problem, only: new_span_problem, present_touches, touch_place
   use free_span_gap, only: gap_at
   use span_tests, only: span_test_t, run_span_tests, another_fails, test_slack, test_pressure, shortest
   use state_transfer, only: carried
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use path_control, only: control_t, path_length
   use path_continuity, only: largest_distance
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: lie_down, laid_down, beside_free_span, free_span, span_gap

   integer, parameter :: samples = 16          !! of the gap over a span
   integer, parameter :: max_tries = 12

contains

   !> The set in which a free span lies down, and the state where its line begins to press.
   subroutine lie_down(problem, earlier, state, step, next, start, system, rate, lies, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: earlier       !! the point of the path before
      type(state_t), intent(in) :: state         !! where a test of the set is zero
      real(wp), intent(in) :: step               !! of the load, for differences
      type(problem_t), intent(out) :: next
      type(state_t), intent(out) :: start        !! of `next`, its system factored there
      type(system_t), intent(out) :: system
      real(wp), intent(out) :: rate              !! of the line's least pressure, per unit of load factor
      logical, intent(out) :: lies               !! false: no span lies down
      type(timers_t), intent(inout) :: timers
      type(span_test_t), allocatable :: tests(:)
      logical :: closed
      real(wp) :: left, come
      integer :: c, side
      lies = .false.
      do c = 1, problem%candidates%n
         do side = 1, 2
            if (.not. beside_free_span(problem, c, side)) cycle
            ! Not some other equilibrium: the path has come further than what is left, of the gap and of the way. A span that
            ! closes has no gap to tell it, and may have closed before.
            closed = closes(problem, state, c, side)
            left = span_gap(problem, state, c, side)
            come = span_gap(problem, earlier, c, side)
            if (abs(left) > max(abs(come - left), rounding_gap(problem)) .and. .not. closed) cycle
            next = new_span_problem(problem, laid_down(problem, state, c, side))
            call find_begin(problem, next, earlier%load_factor, state, step, closed, start, system, rate, lies, timers)
            ! A straight obstacle presses a straight line at no load: then only a gap that is gone tells.
            if (lies .and. .not. (closed .or. abs(rate) > 0.0_wp)) lies = abs(left) <= rounding_gap(problem)
            if (.not. lies) cycle
            lies = path_length(next, carried(problem, state, next), start) <= path_length(problem, earlier, state)
            if (lies .and. .not. (closed .or. abs(left) <= rounding_gap(problem))) lies = gone_there(left, come, &
               & start%load_factor - earlier%load_factor, state%load_factor - earlier%load_factor)
            if (lies) call look_at_ends(next, start, max(system%force_scale, tiny(rate)), lies)
            if (.not. lies) cycle
            tests = run_span_tests(next, start, max(system%force_scale, tiny(rate)))
            lies = .not. another_fails(tests, 0)
            if (lies) return
         end do
      end do
   end subroutine lie_down

   !> True where a gap that falls as it did is gone at the load at which the line begins, as far as paths are followed as straight.
   pure logical function gone_there(left, come, load, whole)
      real(wp), intent(in) :: left, come         !! gap at the state, and at the point before
      real(wp), intent(in) :: load, whole        !! from that point to the line's beginning, and to the state
      gone_there = abs(load * (come - left) - whole * come) <= largest_distance * abs(whole * (come - left))
   end function gone_there

   !> True for a free span between two touches that is as short as none.
   pure logical function closes(problem, state, candidate, side)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      real(wp) :: span(2)
      call free_span(problem, state, candidate, side, span)
      associate (touch => problem%touch(problem%candidates%touch(candidate)))
         closes = span(2) - span(1) < shortest * problem%layout%stretch(touch%stretch)%length
      end associate
   end function closes

   !> Where a line ends at a breakpoint, or with its rod, nothing gives the couple that the obstacle's curvature may want: the
   !> moment is that of the free part beyond, or none.
   subroutine look_at_ends(problem, state, scale, balanced)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale              !! of forces
      logical, intent(out) :: balanced
      real(wp) :: local(3), ends(3, 2), place(2), angle
      integer :: e, side, beyond
      balanced = .true.
      do e = 1, problem%model%mesh%n_elements
         if (problem%conforms(e) == 0) cycle
         do side = 1, 2
            associate (node => problem%model%mesh%node(side, e))
               if (problem%model%fixed(3, node)) cycle
               if (any(problem%candidates%moves .and. problem%candidates%node == node)) cycle
               beyond = problem%beside(side, node)
            end associate
            ends = 0.0_wp
            if (beyond > 0) then
               if (problem%conforms(beyond) > 0) cycle
               call end_forces(problem, state, beyond, ends(:, 1), ends(:, 2))
            end if
            call conforming_forces(problem, state, e, real(side - 1, wp), local, place, angle)
            balanced = balanced .and. abs(local(3) - ends(3, 3 - side)) <= sqrt(epsilon(scale)) * scale * problem%size
         end do
      end do
   end subroutine look_at_ends

   !> Where the new line begins to press: its least pressure is zero, or just above it.
   subroutine find_begin(problem, next, earlier, trial, step, closed, state, system, rate, found, timers)
      type(problem_t), intent(in) :: problem, next
      real(wp), intent(in) :: earlier            !! load factor of the point of the path before
      type(state_t), intent(in) :: trial         !! of `problem`
      real(wp), intent(in) :: step               !! of the load, to begin with
      logical, intent(in) :: closed              !! the line may press already: then that is the state
      type(state_t), intent(out) :: state        !! of `next`
      type(system_t), intent(out) :: system
      real(wp), intent(out) :: rate              !! of the least pressure, per unit of load factor
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      real(wp), parameter :: slack = 1.0e-3_wp * test_slack(test_pressure)
      type(bracket_t) :: bracket
      type(state_t) :: there
      real(wp) :: loads(2), pressure(2), part
      integer :: try
      logical :: ok
      system = new_system(next)
      state = carried(problem, trial, next)
      rate = 0.0_wp
      found = .false.
      loads = trial%load_factor
      call look_at(loads(2), pressure(2), ok)
      if (.not. ok) return
      found = closed .and. pressure(2) >= 0.0_wp
      if (found) return
      if (pressure(2) > slack .and. abs(earlier - trial%load_factor) > 0.0_wp) then
         ! Where it is least may be elsewhere than where the line has closed, and have another slope.
         there = state
         call look_at(earlier, pressure(1), ok)
         if (ok .and. pressure(1) < 0.0_wp) then
            bracket = new_bracket(pressure(1) - 0.5_wp * slack, pressure(2) - 0.5_wp * slack)
            do while (next_guess(bracket, epsilon(part), part))
               loads(1) = earlier + part * (trial%load_factor - earlier)
               call look_at(loads(1), pressure(1), ok)
               if (.not. ok) exit
               call take_value(bracket, part, pressure(1) - 0.5_wp * slack)
               ! What the iteration leaves of forces makes pressures go to and fro.
               found = pressure(1) >= 0.0_wp .and. (pressure(1) <= slack .or. (bracket%high - bracket%low <= sqrt(slack) .and. &
                  & pressure(1) <= test_slack(test_pressure)))
               if (found) exit
            end do
            rate = (bracket%f_high - bracket%f_low) / ((bracket%high - bracket%low) * (trial%load_factor - earlier))
            if (found) return
         end if
         state = there
      end if
      do try = 1, max_tries
         loads(1) = loads(2)
         pressure(1) = pressure(2)
         loads(2) = loads(2) + step
         if (try > 1) loads(2) = loads(1) - (pressure(1) - 0.5_wp * slack) / rate
         ! No load tells them apart.
         if (.not. abs(loads(2) - loads(1)) > 0.0_wp) return
         call look_at(loads(2), pressure(2), ok)
         if (.not. ok) return
         rate = (pressure(2) - pressure(1)) / (loads(2) - loads(1))
         found = pressure(2) >= 0.0_wp .and. pressure(2) <= slack
         if (found .or. .not. abs(rate) > 0.0_wp) return
      end do

   contains

      !> The state at a load factor, and its least pressure.
      subroutine look_at(load, least, converged)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: least
         logical, intent(out) :: converged
         type(control_t) :: control
         type(increment_t) :: report
         type(state_t) :: start
         type(span_test_t), allocatable :: tests(:)
         control%method = method_load
         control%increment = load - state%load_factor
         start = state
         call correct(next, start, control, .true., state, system, report, timers)
         converged = report%converged
         least = 0.0_wp
         if (.not. converged) return
         tests = run_span_tests(next, state, max(system%force_scale, tiny(1.0_wp)))
         least = minval(tests%value, mask=tests%kind == test_pressure)
      end subroutine look_at
   end subroutine find_begin

   !> The free span on one side of a point contact, along the stretch; of no length where there is none.
   pure subroutine free_span(problem, state, candidate, side, span)
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

   !> True for a touched node with a free span on one side.
   pure logical function beside_free_span(problem, candidate, side) result(free)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate, side     !! 1 before, 2 after
      free = problem%candidates%touch(candidate) > 0 .and. problem%candidates%element(side, candidate) > 0
      if (free) free = problem%conforms(problem%candidates%element(side, candidate)) == 0
   end function beside_free_span

   !> Gap where it is largest, be it to the inside, over a free span to the obstacle of the contact at its end.
   real(wp) function span_gap(problem, state, candidate, side) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side     !! as beside_free_span
      real(wp) :: span(2), here
      integer :: i
      gap = 0.0_wp
      call free_span(problem, state, candidate, side, span)
      associate (touch => problem%touch(problem%candidates%touch(candidate)))
         do i = 1, samples - 1
            here = gap_at(problem, state, touch%contact, touch%stretch, span(1) + (span(2) - span(1)) * i / samples)
            if (abs(here) > abs(gap)) gap = here
         end do
      end associate
   end function span_gap

   !> The touches with a line from a contact to the end of the free span on one side, and what touches there.
   function laid_down(problem, state, candidate, side) result(touch)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      type(touch_t), allocatable :: touch(:)
      real(wp) :: span(2)
      integer :: c, k, other
      touch = present_touches(problem, state)
      call free_span(problem, state, candidate, side, span)
      k = problem%candidates%touch(candidate)
      other = 0
      do c = 1, size(touch)
         if (c == k .or. touch(c)%stretch /= touch(k)%stretch .or. touch(c)%contact /= touch(k)%contact) cycle
         if (side == 1 .and. touch(c)%at(2) >= span(1) .and. touch(c)%at(2) < span(2)) other = c
         if (side == 2 .and. touch(c)%at(1) <= span(2) .and. touch(c)%at(1) > span(1)) other = c
      end do
      touch = extended(touch, k, span(side))
      if (other > 0) touch = joined(touch, k, other)
   end function laid_down
end module span_lie_down
