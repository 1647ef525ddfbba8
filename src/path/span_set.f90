!> A change of the set of touches where a test function is zero, and the way on from there: where what is new grows.
module span_set
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise, apply_increment
   use contact_set, only: reaction_rate
   use contact_touch, only: touch_t
   use span_problem, only: present_touches, touch_place
   use span_tests, only: span_test_t, gap_at, virtual_pressure, test_gap, test_force, test_curvature, test_pressure, &
      & test_length, test_closing, test_crossing, test_slope, shortest, beyond, across
   use span_mesh, only: take_touches
   use held_openings, only: open_span, rest_held, find_flat_point, too_flat, small_load, spreading_rate
   use path_control, only: control_t, is_arc_length
   use path_continuity, only: heading_at
   use path_events, only: new_probe
   use path_run, only: run_t, heading_of
   use corrector, only: increment_t, correct
   use touchdown_points, only: point_force
   use conforming_span, only: flat_excess, excess_curvature
   use span_merging, only: closing_point
   use timing, only: timers_t
   implicit none
   private
   public :: change_set, begin_touch, touched_at, test_words

contains

   !> Changes the set at a place where a test is zero, and turns the run where what is new grows.
   subroutine change_set(problem, run, test, share, shallow, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run          !! at that place
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: share              !! of its stretch, that a span opens with
      logical, intent(out) :: shallow            !! what has opened is too flat to tell its ends
      type(timers_t), intent(inout) :: timers
      type(touch_t), allocatable :: touch(:)
      type(touch_t) :: new
      real(wp) :: rate, length, whole
      integer :: opened(2)                       ! numbers of the touches that a new span opens between; 0: none
      integer :: crossed(2)                      ! the same of one that is behind a breakpoint now: its last node, its first
      integer :: k, c
      logical :: ok, flat
      touch = present_touches(problem, run%state)
      opened = 0
      crossed = 0
      shallow = .false.
      k = test%touch
      whole = problem%layout%stretch(max(test%stretch, 1))%length
      if (k > 0) whole = problem%layout%stretch(touch(k)%stretch)%length
      select case (test%kind)
      case (test_force)
         new = touch(k)
         if (touch(k)%line) then
            run%stuck = 'a line contact lifts off at its end'
            return
         end if
         touch = [touch(:k - 1), touch(k + 1:)]
      case (test_curvature)
         length = share * whole
         ! Against a straight wall a uniform rod lies without pressure.
         if (virtual_pressure(problem, run%state, test%candidate) >= 0.0_wp) then
            do c = 1, problem%candidates%n
               flat = as_flat(c)
               if (flat .or. c == test%candidate) call become_line(problem%candidates%touch(c), problem%candidates%moves(c))
            end do
         else if (closing_point(problem, run%state, test%candidate) > 0) then
            run%stuck = 'two contact points come together'
            return
         else if (problem%candidates%moves(test%candidate)) then
            new = touch(k)
            new%number = run%touches + 1
            run%touches = new%number
            new%at = new%at + 0.5_wp * length
            touch(k)%at = touch(k)%at - 0.5_wp * length
            touch = [touch, new]
            opened = [touch(k)%number, new%number]
         else
            ! On a mirror, or where a support holds the rotation.
            touch(k)%at = merge(0.5_wp * length, whole - 0.5_wp * length, touch(k)%at <= 0.0_wp)
            call go_on_behind(k, length, opened)
         end if
      case (test_length)
         call shrink()
      case (test_crossing)
         call cross(nint(test%sense))
      case (test_slope)
         call lie_down_from_end(nint(test%sense))
      case (test_closing)
         touch(k)%at(2) = touch(k + 1)%at(2)
         touch(k)%line = .true.
         touch = [touch(:k), touch(k + 2:)]
      end select
      if (test%kind == test_gap) then
         call begin_touch(problem, run, test, ok, timers)
      else
         call take_touches(problem, run, touch, timers)
      end if
      ok = run%system%ok
      if (ok .and. any(opened > 0)) call open_span(problem, run, opened, ok, timers)
      if (ok .and. any(crossed > 0)) call open_span(problem, run, crossed, ok, timers)
      if (ok .and. any(test%kind == [test_length, test_closing]) .and. all(crossed == 0)) call come_to_rest()
      if (.not. ok) then
         run%stuck = 'no way on from where '//test_words(test)
         return
      end if
      if (test%kind == test_curvature .and. any(opened > 0)) shallow = too_flat(problem, run%state, opened)
      select case (test%kind)
      case (test_gap)
         rate = 1.0_wp
         if (newest(problem, run) > 0) rate = reaction_rate(problem, run%system, newest(problem, run))
         run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, rate))
      case (test_force)
         rate = opening_rate(problem, run, new)
         run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, rate))
      case (test_curvature)
         if (all(opened == 0)) then
            call open_span(problem, run, spread(touch(k)%number, 1, 2), ok, timers)
            if (.not. ok) call rest_held(problem, run, spread(touch(k)%number, 1, 2), timers)
            ok = .true.
            rate = spreading_rate(problem, run, spread(touch(k)%number, 1, 2))
            run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, rate))
         else
            rate = spreading_rate(problem, run, opened)
            run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, rate))
            ! What has opened is not to grow manifold at once: a point contact has its place where the gap is least as long as
            ! the curvatures differ as they do now.
            length = 0.5_wp * share * whole / max(abs(rate * run%heading%load), tiny(rate))
         end if
      case default
         if (is_arc_length(run%control%method)) then
            run%heading = heading_at(problem, run%system, run%heading%u, run%heading%load)
         else
            run%heading = heading_of(problem, run, run%state)
         end if
      end select
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
      if (is_arc_length(run%control%method)) then
         if (any(opened > 0)) run%control%increment = min(run%control%increment, length)
      else if (any(opened > 0) .and. run%control%method == method_load) then
         run%control%increment = sign(min(abs(run%control%increment), length * abs(run%heading%load)), run%control%increment)
      end if

   contains

      !> True for another point that lies down at the same place of the path: held as a point it would be neutral.
      logical function as_flat(c)
         integer, intent(in) :: c
         real(wp) :: excess, stretch
         as_flat = problem%candidates%touch(c) > 0
         if (as_flat) as_flat = .not. problem%touch(problem%candidates%touch(c))%line .and. (problem%candidates%moves(c) .or. &
            & problem%model%fixed(3, problem%candidates%node(c)))
         if (.not. as_flat) return
         call excess_curvature(problem, run%state, c, excess, stretch)
         ! The place is known to that for the one that was looked for, to a few times that for others.
         as_flat = excess * problem%size <= 10.0_wp * flat_excess
         if (as_flat) as_flat = virtual_pressure(problem, run%state, c) >= 0.0_wp
      end function as_flat

      !> A point becomes a line. Its ends have forces, so Newton's method finds their places from any nearby.
      subroutine become_line(point, moves)
         integer, intent(in) :: point         !! index into the touches
         logical, intent(in) :: moves         !! false: it stands at a breakpoint
         real(wp) :: long, half
         integer :: numbers(2)
         long = problem%layout%stretch(touch(point)%stretch)%length
         half = shortest * long
         touch(point)%line = .true.
         touch(point)%at = [max(touch(point)%at(1) - half, 0.0_wp), min(touch(point)%at(2) + half, long)]
         if (.not. moves) call go_on_behind(point, 2.0_wp * half, numbers)
      end subroutine become_line

      !> What was a point at a breakpoint is a touch beside it, and another one on the other side, where the rod goes on.
      subroutine go_on_behind(point, length, numbers)
         integer, intent(in) :: point         !! index into the touches
         real(wp), intent(in) :: length       !! of what opens, or touches, on both sides together
         integer, intent(out) :: numbers(2)   !! of the touches before and after the breakpoint, 0: there the rod ends
         integer :: way, other
         real(wp) :: behind
         way = merge(-1, 1, touch(point)%at(1) < 0.5_wp * problem%layout%stretch(touch(point)%stretch)%length)
         other = across(problem, point, way)
         new = touch(point)
         new%number = 0
         if (other > 0) then
            run%touches = run%touches + 1
            new%number = run%touches
            new%stretch = other
            behind = problem%layout%stretch(other)%length
            new%at = merge(0.5_wp * length, behind - 0.5_wp * length, way > 0)
            if (new%line) new%at(merge(2, 1, way < 0)) = merge(behind, 0.0_wp, way < 0)
            touch = [touch, new]
         end if
         numbers = [touch(point)%number, new%number]
         if (way < 0) numbers = numbers([2, 1])
      end subroutine go_on_behind

      !> What was taken for none had a length: without it the equilibrium is a little another. A point is as curved as the obstacle
      !> where the line that it comes from is none; of a line it is that of the same load. It stays where none is found, as at a
      !> limit point.
      subroutine come_to_rest()
         type(control_t) :: here
         type(increment_t) :: report
         type(state_t) :: state
         logical :: found
         integer :: c
         c = findloc(problem%candidates%touch, findloc(problem%touch%number, touch(k)%number, 1), 1)
         if (c == 0) return
         state = run%state
         if (touch(k)%line .or. .not. problem%candidates%moves(c)) then
            here%method = method_load
            here%whole = run%state%load_factor
            call correct(problem, run%state, here, .true., state, run%system, report, timers)
            found = report%converged
         else
            call find_flat_point(problem, run, c, state, found, timers)
         end if
         if (found) run%state = state
         call linearise(problem, run%state, run%state, run%system, timers)
      end subroutine come_to_rest

      !> A line that has become as short as none: what is left is a point, or, where it goes on past a breakpoint, the line there.
      subroutine shrink()
         integer :: way, next, side
         real(wp) :: end
         do way = -1, 1, 2
            next = beyond(problem, k, way)
            if (next == 0) cycle
            end = merge(problem%layout%stretch(next)%length, 0.0_wp, way < 0)
            side = merge(2, 1, way < 0)
            next = findloc(touch%line .and. touch%stretch == next .and. touch%contact == touch(k)%contact .and. &
               & abs(touch%at(side) - end) <= 0.0_wp, .true., 1)
            if (next == 0) cycle
            if (abs(touch(k)%at(3 - side) - merge(0.0_wp, whole, way < 0)) > 0.0_wp) cycle
            touch(next)%at(side) = end + way * 2.0_wp * shortest * problem%layout%stretch(touch(next)%stretch)%length
            crossed(3 - side) = touch(next)%number
            touch = [touch(:k - 1), touch(k + 1:)]
            return
         end do
         touch(k)%line = .false.
         if (touch(k)%at(1) <= 0.0_wp) then
            touch(k)%at = 0.0_wp
         else if (touch(k)%at(2) >= whole) then
            touch(k)%at = whole
         else
            touch(k)%at = test%at
         end if
      end subroutine shrink

      !> An end of a rod that touched is tangent to the obstacle: where the rod, which has no moment there, is curved away from it
      !> the point leaves the end; else a line begins with it.
      subroutine lie_down_from_end(way)
         integer, intent(in) :: way           !! -1: the rod lies before its end, 1: after it
         real(wp) :: inside, excess, stretch
         inside = touch(k)%at(1) + way * 2.0_wp * shortest * whole
         call excess_curvature(problem, run%state, test%candidate, excess, stretch)
         touch(k)%line = excess * problem%size <= flat_excess
         crossed(merge(1, 2, way > 0)) = touch(k)%number
         if (.not. touch(k)%line) then
            touch(k)%at = inside
         else if (way > 0) then
            touch(k)%at(2) = inside
         else
            touch(k)%at(1) = inside
         end if
      end subroutine lie_down_from_end

      !> What comes to a breakpoint goes on behind it: a point is there, a line gets another part there. At the end of a rod, or at
      !> a support, it stays.
      subroutine cross(way)
         integer, intent(in) :: way           !! -1: before the touch, 1: after it
         real(wp) :: end, inside
         new = touch(k)
         new%stretch = beyond(problem, k, way)
         if (new%stretch == 0) then
            if (way < 0 .or. .not. touch(k)%line) touch(k)%at(1) = merge(0.0_wp, whole, way < 0)
            if (way > 0 .or. .not. touch(k)%line) touch(k)%at(2) = merge(0.0_wp, whole, way < 0)
            return
         end if
         end = merge(problem%layout%stretch(new%stretch)%length, 0.0_wp, way < 0)
         inside = end + way * 2.0_wp * shortest * problem%layout%stretch(new%stretch)%length
         if (.not. new%line) then
            new%at = inside
            touch(k) = new
            crossed(2) = new%number
            return
         end if
         new%at = [min(end, inside), max(end, inside)]
         new%number = run%touches + 1
         run%touches = new%number
         crossed(merge(2, 1, way < 0)) = new%number
         if (way < 0) touch(k)%at(1) = 0.0_wp
         if (way > 0) touch(k)%at(2) = whole
         touch = [touch, new]
      end subroutine cross
   end subroutine change_set

   !> The run with one touch more at a place where the gap of a free span is zero, at the load at which it has no force.
   subroutine begin_touch(problem, run, test, ok, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run          !! at that place
      type(span_test_t), intent(in) :: test
      logical, intent(out) :: ok                 !! false: the state is not that one
      type(timers_t), intent(inout) :: timers
      integer, parameter :: most = 8
      type(touch_t) :: new
      type(control_t) :: control
      type(increment_t) :: report
      type(state_t) :: base, first
      real(wp) :: rate
      integer :: c, try
      new = touch_t(contact=test%contact, stretch=test%stretch, at=[test%at, test%at])
      new%number = run%touches + 1
      run%touches = new%number
      call take_touches(problem, run, [present_touches(problem, run%state), new], timers)
      ok = run%system%ok
      if (.not. ok) return
      c = newest(problem, run)
      ! At a breakpoint the gap was that of a node.
      if (c == 0) return
      if (.not. problem%candidates%moves(c)) return
      first = run%state
      control%method = method_load
      control%increment = 0.0_wp
      ! However little is left, rounding is that of the load.
      control%whole = run%state%load_factor
      do try = 1, most
         base = run%state
         call correct(problem, base, control, .true., run%state, run%system, report, timers)
         ok = report%converged
         if (.not. ok) exit
         rate = reaction_rate(problem, run%system, c)
         ok = abs(rate) > 0.0_wp
         if (.not. ok) exit
         control%increment = -point_force(problem, run%state, c) / rate
         if (abs(control%increment) <= 10.0_wp * epsilon(rate) * abs(run%state%load_factor)) return
      end do
      ok = ok .and. abs(control%increment) <= sqrt(epsilon(rate)) * abs(run%state%load_factor)
      if (ok) return
      run%state = first
      call linearise(problem, run%state, run%state, run%system, timers)
   end subroutine begin_touch

   !> The candidate of the touch that has begun last; 0: none.
   pure integer function newest(problem, run) result(c)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      do c = problem%candidates%n, 1, -1
         if (problem%candidates%touch(c) == 0) cycle
         if (problem%touch(problem%candidates%touch(c))%number == run%touches) return
      end do
      c = 0
   end function newest

   !> Its coordinate along the stretch.
   pure real(wp) function touched_at(problem, run) result(at)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      at = touch_place(problem, run%state, newest(problem, run))
   end function touched_at

   !> How the gap at a contact that was lost grows along the path, per unit of load factor.
   real(wp) function opening_rate(problem, run, lost) result(rate)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run             !! its system factored
      type(touch_t), intent(in) :: lost
      type(state_t) :: ahead, here
      real(wp) :: step
      step = small_load(problem, run)
      ! On the new mesh forces are in balance after the next iteration only, which both make.
      here = run%state
      ahead = run%state
      call apply_increment(problem, run%system, 0.0_wp * run%system%tangent, 0.0_wp, here)
      call apply_increment(problem, run%system, step * run%system%tangent, step, ahead)
      rate = gap_at(problem, ahead, lost%contact, lost%stretch, lost%at(1)) - &
         & gap_at(problem, here, lost%contact, lost%stretch, lost%at(1))
   end function opening_rate

   !> A test in words.
   pure function test_words(test) result(words)
      type(span_test_t), intent(in) :: test
      character(:), allocatable :: words
      select case (test%kind)
      case (test_gap)
         words = 'contact begins'
      case (test_force)
         words = 'contact ends'
      case (test_curvature)
         words = 'a contact point spreads'
      case (test_pressure)
         words = 'contact opens inside'
      case (test_length)
         words = 'a contact line shrinks to a point'
      case (test_crossing)
         words = 'contact comes to a breakpoint of the rod'
      case (test_slope)
         words = 'an end of a rod lies down'
      case default
         words = 'two contacts merge'
      end select
   end function test_words
end module span_set
