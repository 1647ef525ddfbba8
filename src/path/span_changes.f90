!> Changes of the contact spans along a path: where a test function has its zero the path stops, the set is changed, the mesh
!> made anew, and the path goes on where what is new grows.
module span_changes
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use span_problem, only: hold_touches
   use state_transfer, only: carried
   use span_regions, only: beginning_region, find_span_regions
   use span_tests, only: span_test_t, run_span_tests, virtual_pressure, test_slack, test_gap, test_force, test_curvature, &
      & test_pressure, test_closing
   use span_set, only: change_set, begin_touch, touched_at, test_words
   use touchdown_points, only: stands
   use held_openings, only: find_flat_point, held_load, first_length, longest_length
   use span_opening, only: open_line
   use span_lie_down, only: lie_down, beside_free_span, span_gap
   use path_control, only: control_t, path_length, displacement_between
   use path_continuity, only: heading_t, heading_at, between, relate, same_path
   use path_events, only: event_t, new_probe, detect_events
   use path_run, only: run_t, heading_of, forget_mesh
   use path_acceptance, only: accept, outcome_t
   use increment_points, only: division_t, new_division, point_within
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_update
   use corrector, only: increment_t, correct
   use step_control, only: smallest
   use path_record, only: recorder_t
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_point, bars_at_touch
   use timing, only: timers_t
   implicit none
   private
   public :: pass_change, spans_hold

   integer, parameter :: max_tries = 40
   real(wp), parameter :: near_by = 0.1_wp     !! of an increment: what a better place may differ by

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
      logical :: shorter, found, lies, looked_ahead, shallow, divides, standing, violated, merges
      character(:), allocatable :: why
      character(2) :: label
      type(error_bars_t), allocatable :: bars
      integer :: k, first
      finished = .false.
      increment = run%control%increment
      scale = max(run%system%force_scale, tiny(scale))
      after = run_span_tests(problem, trial, scale)
      earlier = run%state
      if (stuck) earlier = run%trail(1)%from
      before = run_span_tests(problem, earlier, scale)
      violated = any(after%value < -test_slack(after%kind))
      changed = violated
      if (.not. changed) call look_for_flat(changed)
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
         heading = arrival()
         ! What happens on the way there is looked for in parts of the increment.
         if (run%control%method == method_load) run%control%increment = place%load_factor - run%state%load_factor
      end if
      lies = .false.
      standing = .false.
      if (first == 0) call pass_flat_span()
      if (.not. (lies .or. violated .or. first > 0)) then
         changed = .false.
         call linearise(problem, trial, run%state, run%system, timers)
         return
      end if
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
      merges = .false.
      if (first == 0) merges = size(find_span_regions(laid, start)) < size(find_span_regions(problem, place))
      divides = .false.
      if (first > 0) then
         label = change_label(after(first))
         if (opens_line(there(first)) .and. .not. lies) then
            divides = size(find_span_regions(laid, start)) > size(find_span_regions(problem, place))
            if (.not. divides) label = '  '
         end if
         if (after(first)%kind == test_curvature .and. .not. (lies .or. standing)) then
            if (stands(problem, place, there(first)%candidate)) then
               ! Contact that begins where a clamp stands.
               label = 'C+'
            else
               divides = virtual_pressure(problem, place, there(first)%candidate) < 0.0_wp
               if (divides) label = 'C-'
            end if
         end if
      end if
      if (first > 0 .and. .not. allocated(bars)) &
         & call bars_at_point(problem, step, run, place, heading, label, .false., first, bars, timers)
      shorter = .false.
      ! Two changes at once, of which the first has its point: where contact only spreads Newton's method has yet to follow.
      if (.not. (standing .and. label == '  ')) &
         & call accept(problem, step, run, place, heading, label, report, looked_ahead, recorder, shorter, finished, outcome, &
         & timers, divides=divides, changes=.true., bars=bars)
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

      !> The path's direction at the place: the chord where the tangent there does not belong to it, as where the set of the next
      !> increment has a neutral span, the tangent of this one thus a null vector.
      function arrival() result(heading)
         type(heading_t) :: heading
         real(wp) :: length
         heading = heading_of(problem, run, place)
         if (same_path(relate(problem, run%state, place, run%heading, heading, run%fresh))) return
         heading%u = displacement_between(problem, run%state, place)
         length = path_length(problem, run%state, place)
         if (.not. length > 0.0_wp) return
         heading%u = heading%u / length
         heading%load = (place%load_factor - run%state%load_factor) / length
      end function arrival

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

      !> True where the gap of some free span is gone, though no test may tell: what is left of the span, too short for its ends to
      !> be told apart, may stay as it is.
      subroutine look_for_flat(any_flat)
         logical, intent(out) :: any_flat
         real(wp) :: gap, from
         integer :: c, side
         any_flat = .false.
         do c = 1, problem%candidates%n
            do side = 1, 2
               if (.not. beside_free_span(problem, c, side)) cycle
               from = span_gap(problem, earlier, c, side)
               gap = span_gap(problem, trial, c, side)
               any_flat = any_flat .or. flattened(from, gap)
            end do
         end do
      end subroutine look_for_flat

      pure logical function flattened(from, to)
         real(wp), intent(in) :: from, to        ! gaps at both ends of the increment
         flattened = from > rounding_gap(problem) .and. to <= rounding_gap(problem)
      end function flattened

      !> A free span whose gap is gone at the end of the increment has lain down on the way. Where exactly the increments of the old
      !> set cannot tell, for the place of its point is neutral; the line does.
      subroutine pass_flat_span()
         logical :: any_flat
         place = run%state
         call look_for_flat(any_flat)
         if (.not. any_flat) return
         call lie_down(problem, run%state, trial, held_load(run), laid, start, system, rate, lies, timers)
         ! Another change may come first.
         if (lies .and. violated) &
            & lies = (start%load_factor - run%state%load_factor) * (start%load_factor - trial%load_factor) <= 0.0_wp
         standing = lies
         if (lies) heading = run%heading
      end subroutine pass_flat_span

      !> Goes on with the line of a span that has lain down. Its first point is one of the path where the
      !> increment came to it, an event where contacts have merged by that.
      subroutine take_line()
         type(state_t) :: before
         before = carried(problem, run%state, laid)
         call hold_touches(laid, before%active)
         problem = laid
         run%system = system
         if (standing) then
            run%state = before
            run%heading = heading_at(problem, system, displacement_between(problem, before, start), &
               & start%load_factor - before%load_factor)
            run%probe = new_probe(problem, before, system, run%heading%load)
            call forget_mesh(run)
            report = increment_t(converged=.true.)
            call accept(problem, step, run, start, heading_of(problem, run, start), merge('C+', '  ', merges), report, .false., &
               & recorder, shorter, finished, outcome, timers)
            if (finished .or. allocated(outcome%why)) return
         end if
         run%state = start
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
         found = anew%converged
         ! Where the path turns back the load tells nothing.
         if (found) found = path_length(problem, place, better) <= near_by * path_length(problem, run%state, trial)
         if (.not. found) then
            call linearise(problem, place, run%state, run%system, timers)
            return
         end if
         place = better
         report%iterations = report%iterations + anew%iterations
         report%residual = anew%residual
         heading = heading_of(problem, run, place)
         there = run_span_tests(problem, place, scale)
         there(first)%at = touched_at(next, touched)
         call bars_at_touch(problem, step, run, place, heading, next, touched, bars, timers)
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
                  heading = arrival()
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
            heading = arrival()
            there = run_span_tests(problem, place, scale)
            f = there(which)%value - tolerance
            found = abs(f) <= tolerance .or. bracket%high - bracket%low <= epsilon(f)
            if (found) return
            call bracket_update(bracket, fraction, f, low_moved)
         end do
         found = abs(bracket%f_high - bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
      end subroutine locate_change
   end subroutine pass_change

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

end module span_changes
