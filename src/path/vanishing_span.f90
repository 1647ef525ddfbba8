!> A free span that vanishes: its gap to the obstacle of the contact beside it is gone all along, or it is as short as none. There
!> the place of a point beside it is neutral, and no increment of the old set gets beyond; the set without the span is regular, and
!> is found where it begins to hold.
!>
!> Either the whole span lies down, an arc under pressure, a straight rod against a wall, what is left between two contacts: where
!> the line begins to press. Or it was the wave between two points, whose curvatures against the obstacle vanish with the square of
!> their distance; where the obstacle would have to pull to hold the rod down they become one: where that is as curved as the
!> obstacle, the way back of a point that divides.
module vanishing_span
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use contact_touch, only: touch_t
   use touch_edits, only: laid_down, merged
   use section_forces, only: end_forces
   use conforming_span, only: conforming_forces
   use line_pressure, only: virtual_pressure
   use span_problem, only: new_span_problem, present_touches
   use span_tests, only: span_test_t, run_span_tests, another_fails, test_slack, test_pressure, shortest
   use span_change, only: leg_t, next_t
   use span_location, only: turns, leads_to_next, reach_of
   use held_openings, only: find_flat_point, held_load
   use state_transfer, only: carried
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use path_control, only: control_t, path_length
   use path_continuity, only: largest_distance
   use path_run, only: run_t
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: locate_vanishing

   integer, parameter :: max_tries = 12

contains

   !> The set without a span, and its equilibrium where it begins to hold, if the path leads there.
   subroutine locate_vanishing(problem, run, leg, which, fails, next, found, wave, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: which               !! the test of the span
      logical, intent(in) :: fails               !! another test does at the end of the leg, and may come first
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      logical, intent(out) :: wave               !! what does not lie down is one between two points
      type(timers_t), intent(inout) :: timers
      call lie_down(problem, run, leg, which, next, found, timers)
      if (found) found = comes_next()
      wave = .false.
      if (.not. found) wave = is_wave(problem, leg%to, leg%after(which))
      if (.not. wave .or. turns(run, leg)) return
      call become_one(problem, run, leg, which, next, found, timers)
      if (found) found = leads_to_next(problem, run, next)
      if (found) found = comes_next()

   contains

      !> True for an equilibrium that holds and lies as far ahead as something may be that is looked for.
      logical function comes_next()
         real(wp) :: scale
         scale = max(next%system%force_scale, tiny(scale))
         comes_next = path_length(next%problem, carried(problem, leg%to, next%problem), next%state) <= reach_of(leg) * &
            & path_length(problem, leg%from, leg%to)
         if (comes_next) call look_at_ends(next%problem, next%state, scale, comes_next)
         if (comes_next) comes_next = .not. another_fails(run_span_tests(next%problem, next%state, scale), 0)
         associate (load => next%state%load_factor, here => run%state%load_factor, from => leg%from%load_factor, &
            & to => leg%to%load_factor)
            comes_next = comes_next .and. (load - here) * (to - from) >= 0.0_wp .and. &
               & (.not. fails .or. (load - here) * (load - to) <= 0.0_wp)
         end associate
      end function comes_next
   end subroutine locate_vanishing

   !> The line in which a free span lies down, and its equilibrium where it begins to press.
   subroutine lie_down(problem, run, leg, which, next, lies, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: which               !! the test of the span
      type(next_t), intent(out) :: next
      logical, intent(out) :: lies
      type(timers_t), intent(inout) :: timers
      real(wp) :: left, come
      logical :: closed, gone
      associate (test => leg%after(which))
         left = test%value
         come = leg%before(which)%value
         closed = test%ends(2) - test%ends(1) < shortest * problem%layout%stretch(test%stretch)%length
         gone = closed .or. abs(left) * problem%size <= rounding_gap(problem)
         next%problem = new_span_problem(problem, laid_down(present_touches(problem, leg%to), test%beside, test%ends))
      end associate
      call find_begin(problem, next%problem, leg%from%load_factor, leg%to, held_load(run), closed, next%state, next%system, &
         & next%rate, lies, timers)
      if (.not. lies) return
      ! A straight obstacle presses a straight line at no load: then only a gap that is gone tells. Else not some other equilibrium:
      ! a gap that falls as it did is gone there, as far as paths are followed as straight.
      associate (load => next%state%load_factor - leg%from%load_factor, whole => leg%to%load_factor - leg%from%load_factor)
         if (.not. gone) lies = abs(next%rate) > 0.0_wp .and. abs(load * (come - left) - whole * come) <= &
            & largest_distance * abs(whole * (come - left))
      end associate
   end subroutine lie_down

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

   !> True for a span between two points where the obstacle would have to pull to hold the rod down.
   logical function is_wave(problem, state, test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test      !! of the span
      is_wave = all(test%beside > 0)
      if (is_wave) is_wave = .not. any(problem%touch(test%beside)%line)
      if (.not. is_wave) return
      is_wave = virtual_pressure(problem, state, problem%touch(test%beside(1))%candidate(1)) < 0.0_wp
   end function is_wave

   !> The equilibrium at which the two points beside a span are one.
   subroutine become_one(problem, run, leg, which, next, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: which               !! the test of the span, a wave
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(run_t) :: on
      integer :: k
      associate (beside => leg%after(which)%beside)
         next%problem = new_span_problem(problem, merged(present_touches(problem, leg%to), beside(1), beside(2)))
         k = findloc(next%problem%touch%number, problem%touch(beside(1))%number, 1)
      end associate
      on = run
      on%system = new_system(next%problem)
      next%state = carried(problem, leg%to, next%problem)
      call find_flat_point(next%problem, on, next%problem%touch(k)%candidate(1), next%state, found, timers)
      if (.not. found) return
      next%system = on%system
      call linearise(next%problem, next%state, next%state, next%system, timers)
      found = next%system%ok
   end subroutine become_one
end module vanishing_span
