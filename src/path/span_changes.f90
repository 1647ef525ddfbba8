!> Changes of the contact spans along a path: where a test function has its zero the path stops, the set is changed, the mesh
!> made anew, and the path goes on where what is new grows.
module span_changes
   use kinds, only: wp
   use model, only: step_t, method_load, method_linearised
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise, apply_increment
   use contact_set, only: reaction_rate
   use contact_touch, only: touch_t
   use span_problem, only: new_span_problem, hold_touches, present_touches, outgrown
   use state_transfer, only: carried
   use span_regions, only: beginning_region
   use span_tests, only: span_test_t, run_span_tests, touch_place, gap_at, virtual_pressure, test_slack, test_gap, test_force, &
      & test_curvature, test_pressure, test_length, test_closing, test_crossing, test_slope, shortest, beyond
   use path_control, only: control_t, is_arc_length, path_length, displacement_between
   use path_continuity, only: heading_t, heading_at, between
   use path_events, only: event_t, new_probe, detect_events
   use path_run, only: run_t, heading_of, forget_mesh
   use path_acceptance, only: accept, outcome_t
   use increment_points, only: division_t, new_division, point_within
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_update
   use corrector, only: increment_t, correct
   use step_control, only: smallest
   use touchdown_points, only: opening_misfit, point_force
   use held_touchdown, only: solve_held
   use span_opening, only: open_line
   use span_lie_down, only: lie_down, beside_free_span, span_gap, vanished
   use conforming_span, only: flat_excess, excess_curvature, track_sense, track_rotation, node_track
   use path_record, only: recorder_t
   use timing, only: timers_t
   implicit none
   private
   public :: pass_change, renew_mesh, spans_hold

   integer, parameter :: max_tries = 40
   real(wp), parameter :: near_by = 0.1_wp     !! of an increment: what a better place may differ by
   real(wp), parameter :: first_length = 4.0e-3_wp !! of a stretch: what opens from nothing begins with that
   real(wp), parameter :: longest_length = 0.1_wp  !! and with not more than some times that, where it is too flat to tell its ends

contains

   !> Looks whether the contact spans of an increment still hold at its end. Where they do not the run goes to where they
   !> first fail and on from there with those that hold.
   subroutine pass_change(problem, step, run, trial, ahead, stuck, recorder, changed, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the trial, or at its new state where changed
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead       !! tangent there
      logical, intent(in) :: stuck               !! no increment converges: the trial is the run's state, what may be ahead of it?
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: changed
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(span_test_t), allocatable :: before(:), after(:), there(:)
      type(increment_t) :: report
      type(problem_t) :: kept, laid
      type(run_t) :: kept_run
      type(state_t) :: place, earlier, start
      type(system_t) :: system
      type(heading_t) :: heading
      real(wp) :: scale, fraction, at, rate, length, increment
      logical :: shorter, found, lies, looked_ahead, shallow, divides, standing
      character(:), allocatable :: why
      character(2) :: label
      integer :: k, first
      finished = .false.
      increment = run%control%increment
      scale = max(run%system%force_scale, tiny(scale))
      after = run_span_tests(problem, trial, scale)
      earlier = run%state
      if (stuck) earlier = run%trail(1)%from
      before = run_span_tests(problem, earlier, scale)
      changed = any(after%value < -test_slack(after%kind))
      there = after
      first = 0
      looked_ahead = .false.
      if (.not. changed) then
         call look_ahead(merge(20.0_wp, 2.0_wp, stuck), first)
         if (first > 0) then
            there = run_span_tests(problem, place, scale)
            changed = .not. any(there%value < -10.0_wp * test_slack(after%kind) .and. [(k, k=1, size(there))] /= first)
         end if
         if (.not. changed) then
            call linearise(problem, trial, run%state, run%system, timers)
            return
         end if
         looked_ahead = .not. stuck
         call linearise(problem, place, run%state, run%system, timers)
         heading = heading_of(problem, run, place)
         ! What happens on the way there is looked for in parts of the increment.
         if (run%control%method == method_load) run%control%increment = place%load_factor - run%state%load_factor
      end if
      lies = .false.
      standing = .false.
      if (first == 0) call pass_flat_span()
      if (.not. lies) then
         call locate_first(found)
         if (.not. found) return
         if (opens_line(after(first))) then
            ! Here nothing tells yet where the span that opens ends; a little further on it does.
            call open_line(problem, trial, after(first), run%touches + 1, laid, start, system, found, timers)
            if (.not. found) then
               call go_less_far()
               return
            end if
         end if
         if (there(first)%kind == test_gap) call sharpen()
         if (after(first)%kind == test_gap) run%beginning = beginning_region(problem, place, there(first)%contact, &
            & there(first)%stretch, there(first)%at)
         if (.not. opens_line(after(first))) &
            & call lie_down(problem, earlier, place, held_load(run), laid, start, system, rate, lies, timers)
         ! There the span is neutral, and its pivot has the sign of rounding; the line's are definite.
         if (lies) run%system%negative_pivots = system%negative_pivots
      end if
      label = '  '
      if (first > 0) label = change_label(after(first))
      divides = .false.
      if (first > 0 .and. .not. lies) then
         if (opens_line(there(first))) divides = size(laid%touch) > size(problem%touch)
      end if
      shorter = .false.
      ! Two changes at once, of which the first has its point: where contact only spreads Newton's method has yet to follow.
      if (.not. (standing .and. label == '  ')) &
         & call accept(problem, step, run, place, heading, label, report, looked_ahead, recorder, shorter, finished, outcome, &
         & timers, divides=divides)
      run%control%increment = increment
      if (allocated(run%beginning)) deallocate (run%beginning)
      if (shorter) then
         ! Something lies before it that is better found from nearer.
         changed = .false.
         call linearise(problem, trial, run%state, run%system, timers)
         return
      end if
      if (finished .or. allocated(outcome%why)) return
      if (lies) then
         call take_line()
         return
      end if
      if (opens_line(there(first))) then
         call go_beyond()
         return
      end if
      kept = problem
      kept_run = run
      length = first_length
      do
         call change_set(problem, run, there(first), length, shallow, timers)
         if (allocated(run%stuck) .or. .not. shallow .or. length > longest_length) exit
         length = 4.0_wp * length
         problem = kept
         run = kept_run
      end do
      if (.not. allocated(run%stuck)) return
      ! Back to where it was still right.
      why = run%stuck
      problem = kept
      run = kept_run
      run%stuck = why

   contains

      !> A shorter increment may tell.
      subroutine go_less_far()
         call linearise(problem, run%state, run%state, run%system, timers)
         run%control%increment = 0.5_wp * run%control%increment
         if (abs(run%control%increment) < smallest(step, run%control)) run%stuck = 'where '//test_words(after(first))// &
            & ' was not found'
      end subroutine go_less_far

      !> True where a line lifts off inside, or at an end that a breakpoint of the rod holds.
      pure logical function opens_line(test)
         type(span_test_t), intent(in) :: test
         opens_line = test%kind == test_pressure
         if (test%kind == test_force) opens_line = problem%touch(test%touch)%line .and. .not. &
            & problem%candidates%moves(test%candidate)
      end function opens_line

      !> From where a span opens, where the run stands, to the equilibrium with the open span: as near as it takes for nothing
      !> else to happen before.
      subroutine go_beyond()
         type(problem_t) :: nearer
         type(state_t) :: opened, between_them
         type(system_t) :: near_system
         type(control_t) :: control
         type(run_t) :: next
         type(event_t), allocatable :: events(:)
         real(wp) :: part
         opened = start
         part = 1.0_wp
         do
            next = run
            next%state = carried(problem, run%state, laid)
            call hold_touches(laid, next%state%active)
            next%system = system
            call forget_mesh(next)
            next%heading = heading_at(laid, system, displacement_between(laid, next%state, opened), &
               & opened%load_factor - next%state%load_factor)
            next%probe = new_probe(laid, next%state, system, next%heading%load)
            heading = heading_of(laid, next, opened)
            call detect_events(laid, step, next%probe, new_probe(laid, opened, system, heading%load), next%state, opened, events)
            if (size(events) == 0) exit
            part = 0.5_wp * part
            between_them = between(problem, run%state, trial, run%heading, ahead, part)
            control%method = method_load
            control%increment = between_them%load_factor - run%state%load_factor
            call correct(problem, run%state, control, .true., between_them, run%system, report, timers)
            if (.not. report%converged) exit
            call open_line(problem, between_them, there(first), run%touches + 1, nearer, start, near_system, found, timers)
            if (.not. found) exit
            laid = nearer
            system = near_system
            opened = start
         end do
         problem = laid
         run = next
         run%touches = run%touches + 1
         call accept(problem, step, run, opened, heading, '  ', report, .false., recorder, shorter, finished, outcome, timers)
      end subroutine go_beyond

      !> The first change along the path: what is located may turn out to come after another one.
      subroutine locate_first(found)
         logical, intent(out) :: found
         integer :: round, k, next
         found = .true.
         do round = 1, size(after)
            if (.not. any(after%value < -test_slack(after%kind))) exit
            next = 0
            fraction = 1.0_wp
            do k = 1, size(after)
               if (there(k)%value >= -test_slack(after(k)%kind)) cycle
               at = max(before(k)%value, 0.0_wp) / max(before(k)%value - after(k)%value, tiny(at))
               if (next > 0 .and. at >= fraction) cycle
               next = k
               fraction = at
            end do
            if (next == 0) exit
            first = next
            call locate_change(first, found)
            if (.not. found) then
               call go_less_far()
               return
            end if
            if (.not. any(there%value < -10.0_wp * test_slack(after%kind) .and. [(k, k=1, size(there))] /= first)) exit
         end do
      end subroutine locate_first

      !> A free span whose gap is gone somewhere on the way lies down there. Where exactly the increments of the old set cannot
      !> tell, for the place of its point is neutral; the line will.
      subroutine pass_flat_span()
         type(division_t) :: division
         type(bracket_t) :: bracket
         real(wp) :: gap, from
         logical :: low_moved
         integer :: c, side, try
         do c = 1, problem%candidates%n
            do side = 1, 2
               if (.not. beside_free_span(problem, c, side)) cycle
               from = span_gap(problem, run%state, c, side)
               gap = span_gap(problem, trial, c, side)
               if (.not. (from > 0.0_wp .and. gap < 0.0_wp)) cycle
               division = new_division(problem, run, trial, ahead, .false.)
               bracket = new_bracket((1.0_wp - 0.5_wp * vanished) * from, gap - 0.5_wp * vanished * from)
               do try = 1, max_tries
                  fraction = bracket_guess(bracket)
                  call point_within(problem, run, trial, ahead, division, fraction, .false., .true., place, report, timers)
                  if (.not. report%converged) exit
                  gap = span_gap(problem, place, c, side)
                  if (gap > 0.0_wp .and. gap <= vanished * from) then
                     there = run_span_tests(problem, place, scale)
                     ! Another change may come first; the tests of this span are all gone, as far as the place is known.
                     if (any(there%value < -max(10.0_wp * test_slack(after%kind), vanished * before%value))) exit
                     call lie_down(problem, run%state, place, held_load(run), laid, start, system, rate, lies, timers)
                     exit
                  end if
                  call bracket_update(bracket, fraction, gap - 0.5_wp * vanished * from, low_moved)
                  ! What touches somewhere inside is not gone all along.
                  if (bracket%high - bracket%low <= 0.1_wp * vanished) exit
               end do
               if (.not. lies) cycle
               heading = heading_of(problem, run, place)
               return
            end do
         end do
         place = run%state
         there = after
      end subroutine pass_flat_span

      !> Goes on with the line of a span that has lain down.
      subroutine take_line()
         problem = laid
         run%state = start
         run%system = system
         run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, rate))
         run%probe = new_probe(problem, run%state, run%system, run%heading%load)
         call forget_mesh(run)
      end subroutine take_line

      !> Where contact begins: the gap is as good as the dense output, the touch itself as good as the nodes.
      subroutine sharpen()
         type(run_t) :: touched
         type(problem_t) :: next
         type(state_t) :: better
         type(control_t) :: control
         type(increment_t) :: anew
         touched = run
         touched%state = place
         touched%heading = heading
         next = problem
         call begin_touch(next, touched, there(first), found, timers)
         if (.not. found) return
         control%method = method_load
         control%increment = touched%state%load_factor - place%load_factor
         control%whole = place%load_factor
         better = place
         call correct(problem, place, control, .true., better, run%system, anew, timers)
         if (.not. anew%converged) return
         ! Where the path turns back the load tells nothing.
         if (path_length(problem, place, better) > near_by * path_length(problem, run%state, trial)) return
         place = better
         report%iterations = report%iterations + anew%iterations
         report%residual = anew%residual
         heading = heading_of(problem, run, place)
         there = run_span_tests(problem, place, scale)
         there(first)%at = touched_at(next, touched)
      end subroutine sharpen

      !> A point contact that is about to become as curved as its obstacle: no increment may get there.
      subroutine look_ahead(ahead, which)
         real(wp), intent(in) :: ahead           !! stretches like the last one, over which a straight line tells enough
         integer, intent(out) :: which           !! test, 0: none is near its zero
         do which = 1, size(after)
            if (after(which)%kind /= test_curvature) cycle
            if (.not. problem%candidates%moves(after(which)%candidate)) cycle
            if (after(which)%value <= 0.0_wp .or. after(which)%value > ahead * (before(which)%value - after(which)%value)) cycle
            place = trial
            call find_flat_point(problem, run, after(which)%candidate, place, found, timers)
            if (found) found = abs(place%load_factor - trial%load_factor) <= &
               & 2.0_wp * ahead * abs(trial%load_factor - earlier%load_factor)
            if (found) return
         end do
         which = 0
      end subroutine look_ahead

      !> The zero of a test between both ends.
      subroutine locate_change(which, found)
         integer, intent(in) :: which
         logical, intent(out) :: found
         type(division_t) :: division
         type(bracket_t) :: bracket
         real(wp) :: f, tolerance
         integer :: try
         logical :: low_moved
         found = .true.
         place = run%state
         heading = run%heading
         there = before
         tolerance = 0.5_wp * step%locate_tolerance * max(before(which)%value, -after(which)%value)
         standing = before(which)%value <= tolerance
         if (standing) return
         if (after(which)%kind == test_curvature) then
            if (problem%candidates%moves(after(which)%candidate)) then
               if (before(which)%value > -after(which)%value) place = trial
               call find_flat_point(problem, run, after(which)%candidate, place, found, timers)
               if (found) found = path_length(problem, run%state, place) <= path_length(problem, run%state, trial)
               if (found) then
                  report = increment_t(converged=.true.)
                  call linearise(problem, place, run%state, run%system, timers)
                  heading = heading_of(problem, run, place)
                  there = run_span_tests(problem, place, scale)
                  return
               end if
               place = run%state
               there = before
            end if
         end if
         division = new_division(problem, run, trial, ahead, .false.)
         ! Found on the side that it is reached from: beyond it the set does not hold.
         bracket = new_bracket(before(which)%value - tolerance, after(which)%value - tolerance)
         found = .false.
         do try = 1, max_tries
            fraction = bracket_guess(bracket)
            call point_within(problem, run, trial, ahead, division, fraction, .false., .true., place, report, timers)
            if (.not. report%converged) return
            heading = heading_of(problem, run, place)
            there = run_span_tests(problem, place, scale)
            f = there(which)%value - tolerance
            found = abs(f) <= tolerance .or. bracket%high - bracket%low <= epsilon(f)
            if (found) return
            call bracket_update(bracket, fraction, f, low_moved)
         end do
         found = abs(bracket%f_high - bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
      end subroutine locate_change
   end subroutine pass_change

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
      real(wp) :: place(problem%candidates%n), rate
      integer :: c, try
      do c = 1, problem%candidates%n
         place(c) = touch_place(problem, run%state, c)
      end do
      new = touch_t(contact=test%contact, stretch=test%stretch, at=[test%at, test%at])
      new%number = run%touches + 1
      run%touches = new%number
      call take_touches(problem, run, [present_touches(problem, place), new], timers)
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

   !> True for a converged state whose contact spans are the right ones.
   logical function spans_hold(problem, state, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale              !! of forces
      type(span_test_t), allocatable :: tests(:)
      tests = run_span_tests(problem, state, max(scale, tiny(scale)))
      spans_hold = all(tests%value >= -test_slack(tests%kind))
   end function spans_hold

   !> What is told of a change: contact gained or lost; where it only spreads, nothing.
   pure function change_label(test) result(label)
      type(span_test_t), intent(in) :: test
      character(2) :: label
      label = '  '
      if (any(test%kind == [test_gap, test_closing])) label = 'C+'
      if (any(test%kind == [test_force, test_pressure])) label = 'C-'
   end function change_label

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
      real(wp) :: place(problem%candidates%n), rate, length, whole
      integer :: opened(2)                       ! numbers of the touches that a new span opens between; 0: none
      integer :: crossed(2)                      ! the same of one that is behind a breakpoint now: its last node, its first
      integer :: c, k
      logical :: ok
      do c = 1, problem%candidates%n
         place(c) = touch_place(problem, run%state, c)
      end do
      touch = present_touches(problem, place)
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
            touch(k)%line = .true.
            ! Its ends have forces, so Newton's method finds their places from any nearby.
            touch(k)%at = [max(touch(k)%at(1) - 0.5_wp * length, 0.0_wp), min(touch(k)%at(2) + 0.5_wp * length, whole)]
         else if (problem%candidates%moves(test%candidate)) then
            new = touch(k)
            new%number = run%touches + 1
            run%touches = new%number
            new%at = new%at + 0.5_wp * length
            touch(k)%at = touch(k)%at - 0.5_wp * length
            touch = [touch, new]
            opened = [touch(k)%number, new%number]
         else
            ! On a mirror, where the rod ends.
            touch(k)%at = merge(0.5_wp * length, whole - 0.5_wp * length, touch(k)%at <= 0.0_wp)
            opened = [0, touch(k)%number]
            if (touch(k)%at(1) > 0.5_wp * whole) opened = [touch(k)%number, 0]
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
            run%heading = heading_at(problem, run%system, run%heading%u, run%heading%load)
         else
            rate = spreading_rate(problem, run, opened)
            run%heading = heading_at(problem, run%system, 0.0_wp * run%state%u, sign(1.0_wp, rate))
            ! What has opened is not to grow manifold at once: a point contact has its place where the gap is least as long as
            ! the curvatures differ as they do now.
            length = 0.5_wp * share * whole / max(abs(rate * run%heading%load), tiny(rate))
         end if
      case default
         run%heading = heading_at(problem, run%system, run%heading%u, run%heading%load)
      end select
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
      if (is_arc_length(run%control%method)) then
         if (any(opened > 0)) run%control%increment = min(run%control%increment, length)
      else if (any(opened > 0) .and. run%control%method == method_load) then
         run%control%increment = sign(min(abs(run%control%increment), length * abs(run%heading%load)), run%control%increment)
      end if

   contains

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

   !> Opens a span between two touchdown points: with their distance held the load, and the place of both, are found at which
   !> they are where they belong.
   subroutine open_span(problem, run, opened, ok, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! numbers of touches; both the same: a line, between its own ends
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      type(state_t) :: state
      problem%opening = opening_ends(problem, opened)
      state = run%state
      call solve_held(problem, run%system, all(problem%opening > 0), held_steps(problem, run), opening_misfit, state, ok, timers)
      problem%opening = 0
      if (.not. ok) return
      run%state = state
      call linearise(problem, run%state, run%state, run%system, timers)
      ok = run%system%ok
   end subroutine open_span

   !> True where the points between which a span has opened are no more curved than their obstacle.
   logical function too_flat(problem, state, opened) result(flat)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: opened(2)
      real(wp) :: excess, stretch
      integer :: ends(2), i
      ends = opening_ends(problem, opened)
      flat = .false.
      do i = 1, 2
         if (ends(i) == 0) cycle
         call excess_curvature(problem, state, ends(i), excess, stretch)
         flat = flat .or. excess * problem%size <= flat_excess
      end do
   end function too_flat

   !> Steps of load factor and place for differences.
   pure function held_steps(problem, run) result(step)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      real(wp) :: step(2)
      step = [held_load(run), 1.0e-2_wp * first_length * maxval(problem%layout%stretch%length)]
   end function held_steps

   !> That of the load factor.
   pure real(wp) function held_load(run) result(step)
      type(run_t), intent(in) :: run
      step = 1.0e-4_wp * max(abs(run%last_load), 1.0e-3_wp * abs(run%state%load_factor))
   end function held_load

   !> Where a point contact is as curved as its obstacle: there its own equation, that of the least gap, has no slope. With it
   !> held load and place are found at which both are right.
   subroutine find_flat_point(problem, run, candidate, place, ok, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      integer, intent(in) :: candidate
      type(state_t), intent(inout) :: place      !! a state nearby on entry
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      problem%opening = [candidate, 0]
      call solve_held(problem, run%system, .true., held_steps(problem, run), flatness, place, ok, timers)
      problem%opening = 0
   end subroutine find_flat_point

   !> Rotation of a held point against the obstacle, and its excess of curvature over the size, which is to stay above zero.
   function flatness(problem, state) result(left)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: left(2), excess, stretch
      left(1) = track_rotation(problem, state, problem%opening(1))
      call excess_curvature(problem, state, problem%opening(1), excess, stretch)
      left(2) = excess * problem%size - 0.1_wp * flat_excess
   end function flatness

   !> Candidates at the ends of an opening span.
   function opening_ends(problem, opened) result(ends)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: opened(2)
      integer :: ends(2), c
      ends = 0
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%moves(c)) cycle
         associate (number => problem%touch(problem%candidates%touch(c))%number)
            if (opened(1) == opened(2)) then
               if (number /= opened(1)) cycle
               ! The first end of the line is the one that a line follows.
               if (problem%candidates%neighbour(2, c) > 0) ends(1) = c
               if (problem%candidates%neighbour(2, c) == 0) ends(2) = c
            else
               ! The last node of the first, the first node of the second.
               if (number == opened(1)) ends(1) = c
               if (number == opened(2) .and. ends(2) == 0) ends(2) = c
            end if
         end associate
      end do
   end function opening_ends

   !> A step of the load factor that moves nothing by more than a millionth of the structure's size, nor turns it by more than that.
   pure real(wp) function small_load(problem, run) result(step)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run             !! its system factored
      real(wp) :: rate
      integer :: node, d
      rate = tiny(rate)
      do node = 1, problem%model%mesh%n_nodes
         d = dof(problem, node, 1)
         associate (u => run%system%tangent(d:d + 2))
            rate = max(rate, maxval(abs(u(1:2))) / problem%size, abs(u(3)))
         end associate
      end do
      step = 1.0e-6_wp / rate
   end function small_load

   !> How the new span grows along the path, per unit of load factor.
   real(wp) function spreading_rate(problem, run, opened) result(rate)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(in) :: run             !! its system factored
      integer, intent(in) :: opened(2)
      type(state_t) :: ahead, here
      real(wp) :: step, change(2), excess, stretch
      integer :: k
      problem%opening = opening_ends(problem, opened)
      step = small_load(problem, run)
      here = run%state
      ahead = run%state
      call apply_increment(problem, run%system, 0.0_wp * run%system%tangent, [0.0_wp], here)
      call apply_increment(problem, run%system, step * run%system%tangent, [step], ahead)
      change = opening_misfit(problem, ahead) - opening_misfit(problem, here)
      rate = 0.0_wp
      do k = 1, 2
         if (problem%opening(k) == 0) cycle
         if (.not. problem%candidates%follows(problem%opening(k))) then
            ! A rotation against the obstacle moves a point by that over the curvature it has more.
            call excess_curvature(problem, run%state, problem%opening(k), excess, stretch)
            change(k) = -change(k) * track_sense(problem, run%state, problem%opening(k), &
               & node_track(problem, run%state, problem%opening(k))) / excess
         end if
         rate = rate + merge(-1.0_wp, 1.0_wp, k == 1) * change(k) * merge(problem%size, 1.0_wp, &
            & problem%candidates%follows(problem%opening(k)))
      end do
      rate = rate / step
      problem%opening = 0
   end function spreading_rate

   !> A finer mesh for spans that have grown, at the point where the run stands; nothing changes where no equilibrium is found on
   !> it.
   subroutine renew_mesh(problem, run, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: kept
      type(state_t) :: place, better
      type(heading_t) :: heading
      type(control_t) :: hold
      type(increment_t) :: report
      type(touch_t), allocatable :: touch(:)
      integer :: c
      touch = present_touches(problem, [(touch_place(problem, run%state, c), c=1, problem%candidates%n)])
      if (.not. outgrown(problem, touch)) return
      kept = problem
      place = run%state
      heading = run%heading
      call take_touches(problem, run, touch, timers)
      if (run%system%ok) then
         ! Across the path: at a limit point, too.
         hold%method = method_linearised
         hold%tangent = run%heading%u
         hold%whole = 1.0_wp
         better = run%state
         call correct(problem, run%state, hold, .true., better, run%system, report, timers)
      end if
      if (run%system%ok .and. report%converged) then
         run%state = better
         run%heading = heading_at(problem, run%system, run%heading%u, run%heading%load)
         run%probe = new_probe(problem, run%state, run%system, run%heading%load)
         return
      end if
      problem = kept
      run%state = place
      run%heading = heading
      run%system = new_system(problem)
      call linearise(problem, run%state, run%state, run%system, timers)
   end subroutine renew_mesh

   !> The run on the mesh of another set of touches.
   subroutine take_touches(problem, run, touch, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      type(touch_t), intent(in) :: touch(:)
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: next
      type(state_t) :: state
      next = new_span_problem(problem, touch)
      state = carried(problem, run%state, next)
      call hold_touches(next, state%active)
      run%heading%u = carried_field(problem, run%state, run%heading%u, next, state)
      call forget_mesh(run)
      problem = next
      run%state = state
      run%system = new_system(problem)
      call linearise(problem, run%state, run%state, run%system, timers)
   end subroutine take_touches

   !> A field of rates on another mesh: the difference of two states carried there.
   function carried_field(from, state, field, to, there) result(new)
      type(problem_t), intent(in) :: from, to
      type(state_t), intent(in) :: state, there
      real(wp), intent(in) :: field(:, :)
      real(wp) :: new(3, to%model%mesh%n_nodes)
      type(state_t) :: ahead
      real(wp) :: step
      step = 1.0e-6_wp * from%size / max(maxval(abs(field(1:2, :))), tiny(step))
      ahead = state
      ahead%u = state%u + step * field
      ahead = carried(from, ahead, to)
      new = (ahead%u - there%u) / step
   end function carried_field

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
      call apply_increment(problem, run%system, 0.0_wp * run%system%tangent, [0.0_wp], here)
      call apply_increment(problem, run%system, step * run%system%tangent, [step], ahead)
      rate = gap_at(problem, ahead, lost%contact, lost%stretch, lost%at(1)) - &
         & gap_at(problem, here, lost%contact, lost%stretch, lost%at(1))
   end function opening_rate
end module span_changes
