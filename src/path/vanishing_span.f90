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
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use touch_edits, only: laid_down, merged, lost
   use conforming_span, only: excess_curvature
   use breakpoint_forces, only: stands
   use line_pressure, only: virtual_pressure
   use span_problem, only: present_touches
   use span_tests, only: span_test_t, another_fails, test_slack, test_pressure, shortest, line_share
   use past_breakpoints, only: beyond
   use line_arrival, only: find_arrival
   use span_regions, only: find_span_regions
   use span_change, only: leg_t
   use next_spans, only: next_t, new_next, go_to_load, tests_of
   use lying_ahead, only: turns, leads_to_next, reach_of
   use held_openings, only: find_flat_point, held_load
   use state_transfer, only: carried
   use path_control, only: path_length
   use path_continuity, only: largest_distance
   use path_run, only: run_t
   use timing, only: timers_t
   implicit none
   private
   public :: locate_vanishing

   integer, parameter :: max_tries = 30         !! loads at which a new line is looked at

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
      wave = .false.
      call find_arrival(problem, leg, leg%after(which), next, found, timers)
      if (found) found = comes_next()
      if (.not. found) then
         if (is_passage(problem, leg%after(which))) return
         call lie_down(problem, run, leg, which, next, found, timers)
         if (found) found = comes_next()
      end if
      if (.not. found) wave = is_wave(problem, leg%to, leg%after(which))
      ! As long as there is a gap between them, and both push, they are two.
      if (wave .and. is_gone(problem, leg%after(which)) .and. .not. turns(run, leg)) then
         if (any(clamped_ends(problem, leg%to, leg%after(which)))) then
            call go_into_clamp(problem, run, leg, which, next, found, timers)
         else
            call become_one(problem, run, leg, which, next, found, timers)
         end if
         if (found) found = leads_to_next(problem, run, next)
         if (found) found = comes_next()
      end if
      if (.not. found .or. next%label /= '') return
      if (size(find_span_regions(next%problem, next%state)) < size(find_span_regions(problem, run%state))) next%label = 'C+'

   contains

      !> True for an equilibrium that holds and lies as far ahead as something may be that is looked for.
      logical function comes_next() result(right)
         right = path_length(next%problem, carried(problem, leg%to, next%problem), next%state) <= reach_of(leg) * &
            & path_length(problem, leg%from, leg%to)
         if (right) right = .not. another_fails(tests_of(next), 0)
         associate (load => next%state%load_factor, here => run%state%load_factor, from => leg%from%load_factor, &
            & to => leg%to%load_factor)
            right = right .and. (load - here) * (to - from) >= 0.0_wp .and. &
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
      logical :: gone
      associate (test => leg%after(which))
         left = test%value
         come = leg%before(which)%value
         gone = is_gone(problem, test)
         next = new_next(problem, leg%to, laid_down(present_touches(problem, leg%to), test%beside, test%ends))
      end associate
      call find_begin(run, leg, gone, next, lies, timers)
      if (.not. lies) return
      if (gone) return
      ! A straight obstacle presses a straight line at no load: then only a gap that is gone tells. Else not some other equilibrium:
      ! a gap that has changed its sign on the way was gone there; one that falls as it did is gone where it leads to, as far as
      ! paths are followed as straight.
      associate (load => next%state%load_factor - leg%from%load_factor, whole => leg%to%load_factor - leg%from%load_factor)
         lies = abs(load * (come - left) - whole * come) <= largest_distance * abs(whole * (come - left))
         if (left <= 0.0_wp) lies = load * (load - whole) <= 0.0_wp
         lies = lies .and. abs(next%rate) > 0.0_wp
      end associate
   end subroutine lie_down

   !> Where the new set begins to hold: the least pressure of its line is zero, or just above it, or the excess of curvature beside
   !> a clamp. By secants, within a bracket once there is one. Where nothing is left of the span, and the set holds all the way, it
   !> is where the run stands: meshes differ.
   subroutine find_begin(run, leg, gone, next, found, timers, clamp)
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      logical, intent(in) :: gone                !! nothing is left of the span
      type(next_t), intent(inout) :: next        !! as new_next has it
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      integer, intent(in), optional :: clamp(2)  !! candidate, side: beside it the rod is to be as curved as the obstacle
      real(wp), parameter :: slack = 1.0e-3_wp * test_slack(test_pressure), goal = 0.5_wp * slack
      real(wp) :: load, loads(2), value, values(2)
      integer :: try
      logical :: ok, narrow
      loads = leg%to%load_factor
      call look_at(loads(2), value)
      found = .false.
      if (.not. ok) return
      values = value - goal
      load = loads(2) + held_load(run)
      if (value > slack) then
         call look_at(run%state%load_factor, value)
         found = gone .and. ok .and. value >= 0.0_wp
         if (found) return
         if (ok .and. value < 0.0_wp) load = run%state%load_factor
      end if
      do try = 1, max_tries
         ! No load tells them apart.
         if (.not. abs(load - loads(2)) > 0.0_wp) return
         call look_at(load, value)
         if (.not. ok) return
         ! What the iteration leaves of forces makes pressures go to and fro.
         narrow = abs(load - loads(2)) <= sqrt(slack) * abs(leg%to%load_factor - leg%from%load_factor)
         if (.not. (narrow .and. abs(next%rate) > 0.0_wp)) next%rate = (value - goal - values(2)) / (load - loads(2))
         found = (value >= 0.0_wp .and. value <= slack) .or. (narrow .and. abs(value) <= test_slack(test_pressure))
         if (found .or. .not. abs(next%rate) > 0.0_wp) return
         if (values(1) * values(2) < 0.0_wp .and. (value - goal) * values(2) > 0.0_wp) then
            values(1) = 0.5_wp * values(1)
         else
            loads(1) = loads(2)
            values(1) = values(2)
         end if
         loads(2) = load
         values(2) = value - goal
         load = loads(2) - values(2) * (loads(2) - loads(1)) / (values(2) - values(1))
      end do

   contains

      !> The least pressure, or the excess of curvature, at a load factor.
      subroutine look_at(load, least)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: least
         type(span_test_t), allocatable :: tests(:)
         real(wp) :: excess, stretch
         call go_to_load(next, load, tests, timers)
         ok = allocated(tests)
         least = 0.0_wp
         if (.not. ok) return
         if (present(clamp)) then
            call excess_curvature(next%problem, next%state, clamp(1), excess, stretch, clamp(2))
            least = excess * next%problem%size
         else
            least = minval(tests%value, mask=tests%kind == test_pressure)
         end if
      end subroutine look_at
   end subroutine find_begin

   !> True for a span that nothing is left of.
   pure logical function is_gone(problem, test) result(gone)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! of the span
      gone = abs(test%value) * problem%size <= rounding_gap(problem) .or. &
         & test%ends(2) - test%ends(1) < shortest * problem%layout%stretch(test%stretch)%length
   end function is_gone

   !> True for the last bit before a breakpoint that contact goes on past: it does not lie down, contact passes it (passages).
   pure logical function is_passage(problem, test)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! of the span
      integer :: side
      side = findloc(test%beside > 0, .true., 1)
      is_passage = count(test%beside > 0) == 1 .and. test%ends(2) - test%ends(1) <= line_share * &
         & problem%layout%stretch(test%stretch)%length
      if (is_passage) is_passage = beyond(problem, test%beside(side), merge(1, -1, side == 1)) > 0
   end function is_passage

   !> True for a span between two points where the obstacle would have to pull to hold the rod down.
   logical function is_wave(problem, state, test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test      !! of the span
      logical :: clamped(2)
      integer :: k
      is_wave = all(test%beside > 0)
      if (is_wave) is_wave = .not. any(problem%touch(test%beside)%line)
      if (.not. is_wave) return
      clamped = clamped_ends(problem, state, test)
      do k = 1, 2
         associate (c => problem%touch(test%beside(k))%candidate(1))
            if (clamped(k)) then
               is_wave = virtual_pressure(problem, state, c, 3 - k) < 0.0_wp
            else
               is_wave = virtual_pressure(problem, state, c) < 0.0_wp
            end if
         end associate
         if (is_wave) return
      end do
   end function is_wave

   !> Which points beside a span are clamps that stand on the obstacle.
   function clamped_ends(problem, state, test) result(clamped)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test      !! of the span, between two points
      logical :: clamped(2)
      integer :: k
      do k = 1, 2
         associate (c => problem%touch(test%beside(k))%candidate(1))
            clamped(k) = problem%model%fixed(3, problem%candidates%node(c)) .and. stands(problem, state, c)
         end associate
      end do
   end function clamped_ends

   !> The equilibrium at which the point beside a span has come to the clamp on its other side: there the rod is as curved as the
   !> obstacle, and the clamp holds alone on that side.
   subroutine go_into_clamp(problem, run, leg, which, next, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(leg_t), intent(in) :: leg
      integer, intent(in) :: which               !! the test of the span, a wave
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      integer :: side, k
      associate (beside => leg%after(which)%beside)
         side = findloc(clamped_ends(problem, leg%to, leg%after(which)), .true., 1)
         next = new_next(problem, leg%to, lost(present_touches(problem, leg%to), beside(3 - side)))
         k = findloc(next%problem%touch%number, problem%touch(beside(side))%number, 1)
      end associate
      next%label = 'C-'
      call find_begin(run, leg, .false., next, found, timers, [next%problem%touch(k)%candidate(1), 3 - side])
   end subroutine go_into_clamp

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
         next = new_next(problem, leg%to, merged(present_touches(problem, leg%to), beside(1), beside(2)))
         k = findloc(next%problem%touch%number, problem%touch(beside(1))%number, 1)
      end associate
      on = run
      on%system = next%system
      call find_flat_point(next%problem, on, next%problem%touch(k)%candidate(1), next%state, found, timers)
      if (.not. found) return
      next%system = on%system
      call linearise(next%problem, next%state, next%state, next%system, timers)
      found = next%system%ok
   end subroutine become_one
end module vanishing_span
