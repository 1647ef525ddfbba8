!> Locates an event that was detected inside an increment, and verifies that the located state is that event.
module event_location
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use displacement_functional, only: monitor_change
   use path_control, only: path_length, is_arc_length, can_be_prescribed, prescribed_change
   use path_continuity, only: between, lies_between, alike, largest_distance
   use increment_points, only: increment_measure_t, new_measure, point_within, chord_fraction, part_of_increment
   use corrector, only: increment_t, correct
   use contact_labels, only: contact_gained
   use contact_regions, only: region_of
   use path_events, only: event_t, event_value, note_of_corner, event_bifurcation, event_release, event_contact, event_limit, &
      & event_turning, event_value_reached, event_stop, law_corner_t, corner_between
   use contact_set, only: sign_slack
   use smooth_zero, only: locate_smooth, take_beginning
   use zero_search, only: zero_eigenvalue
   use path_point, only: path_point_t, evaluate_tests
   use path_state, only: path_state_t, copy_path_state, path_tangent_of, located_event_t, note_balance
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use force_law, only: segment_open, segment_unknown
   implicit none
   private
   public :: locate_event, value_rate

contains

   !> Finds the zero of the event function between the last accepted point and the trial. The event counts as located if the zero is
   !> within tolerance, lies on the path between the two points, and satisfies the definition of the event's kind.
   subroutine locate_event(problem, step, run, trial, located_event)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(inout) :: located_event !! in: the detected event; out: also its position and state
      type(increment_measure_t) :: measure
      real(wp) :: before
      measure = new_measure(problem, run, trial, located_event%event%steady_load)
      located_event%point = trial
      located_event%fraction = 1.0_wp
      if (passed_by_mesh(run, located_event%event)) then
         before = located_event%event%before
         if (located_event%event%kind == event_limit) located_event%event%before = run%last%tangent%load
         call look_behind()
         located_event%event%before = before
         if (located_event%located) return
         ! The event may be placed at the last accepted point only if this point is in equilibrium on the present mesh.
         call note_balance(step, run%last%system, located_event%report, located_event%located)
         if (.not. located_event%located) return
         located_event%point = run%last
         located_event%fraction = 0.0_wp
         return
      end if
      call locate_by_prescribing()
      if (located_event%located) return
      call locate_by_function()
      if (.not. located_event%located) return
      if (measure%smooth) then
         located_event%located = satisfies_definition()
         ! After a line contact has just become a point contact the load may be constant: its rate then changes sign by rounding
         ! only.
         if (located_event%event%kind == event_limit .and. run%since_change%shrunk .and. .not. located_event%located) &
            & call take_beginning(step, run, located_event)
      else if (measure%length > 0.0_wp .and. is_arc_length(run%control%method)) then
         ! The event's fraction of the load and displacement increments equals its fraction of the controlled quantity's change,
         ! which is not zero even if no node moves.
         located_event%fraction = chord_fraction(problem, run, measure, located_event%point%state)
      end if

   contains

      !> Locates the point at which the load factor or a monitor has a given value. The value is the constraint of a correction that
      !> starts from a point interpolated between the ends of the increment. The event is not located in three cases: the value
      !> cannot be prescribed; the quantity is not monotonic within the increment, so that two points may have the value; or the
      !> corrected point is not between the ends.
      subroutine locate_by_prescribing()
         type(path_point_t) :: here
         real(wp) :: part
         associate (event => located_event%event, from => run%last, report => located_event%report)
            if (.not. (measure%smooth .and. any(event%kind == [event_value_reached, event_stop]))) return
            if (.not. (can_be_prescribed(problem, event%monitor) .and. event%before * event%after < 0.0_wp)) return
            if (any(event%before * [value_rate(problem, event%monitor, from), &
               & value_rate(problem, event%monitor, trial)] >= 0.0_wp)) return
            part = event%before / (event%before - event%after)
            here%state = between(problem, from%state, trial%state, from%tangent, trial%tangent, part)
            here%system = from%system
            call correct(problem, from%state, prescribed_change(event%monitor, -event%before), .false., here%state, &
               & here%system, report, exact=problem%model%step(problem%step)%locate_tolerance)
            if (.not. report%converged) return
            if (.not. alike(problem, from%state, here%state)) return
            if (.not. lies_between(problem, from%state, trial%state, measure%chord, from%tangent, trial%tangent, &
               & here%state)) return
            here%tangent = path_tangent_of(problem, run, here)
            call evaluate_tests(problem, here)
            located_event%point = here
            located_event%fraction = part_of_increment(problem, run, trial, measure, here%state)
            located_event%located = .true.
            event%prescribed = .true.
         end associate
      end subroutine locate_by_prescribing

      !> Locates the zero of the event function from corrected points inside the increment.
      subroutine locate_by_function()
         type(law_corner_t) :: law
         law = corner_between(problem, run%last%state, trial%state)
         if (located_event%event%kind == event_bifurcation .or. (measure%smooth .and. (located_event%event%kind == &
            & event_turning .or. (located_event%event%kind == event_limit .and. law%candidate == 0)))) then
            call locate_smooth(problem, step, run, trial, measure, located_event)
         else
            call bracket_zero(problem, step, run, trial, measure, located_event)
            if (located_event%located .and. any(located_event%event%kind == [event_value_reached, event_stop])) &
               & call meet_value(problem, run, located_event)
         end if
      end subroutine locate_by_function

      !> Searches for the event before the last accepted point, on the present mesh. The secant of the event function over the
      !> increment is extrapolated to its zero, but not beyond the start of the step or branch. If the event is not located there,
      !> nothing changes.
      subroutine look_behind()
         type(located_event_t) :: found
         type(increment_measure_t) :: part
         type(path_state_t) :: behind
         type(path_point_t) :: point
         real(wp) :: fall, fraction
         fall = located_event%event%before - located_event%event%after
         if (.not. located_event%event%before * fall < 0.0_wp) return
         ! The search covers twice the extrapolated distance, so that the zero is bracketed.
         fraction = 2.0_wp * located_event%event%before / fall
         if (-fraction * measure%length > run%arc_length - run%left_at) return
         call copy_path_state(run, behind)
         if (located_event%event%ground%contact > 0) call reset_segments(problem, located_event%event, behind%last%state)
         part = measure
         call point_within(problem, behind, trial, part, fraction, .true., .false., point, found%report)
         if (.not. found%report%converged) return
         behind%last = point
         behind%last%tangent = path_tangent_of(problem, run, point)
         call evaluate_tests(problem, behind%last)
         found%event = located_event%event
         found%event%after = located_event%event%before
         found%event%before = event_value(problem, found%event, behind%last%state, behind%last%test_values)
         if (.not. found%event%before * found%event%after < 0.0_wp) return
         behind%control%increment = -fraction * run%control%increment
         part = new_measure(problem, behind, run%last, found%event%steady_load)
         found%point = run%last
         call bracket_zero(problem, step, behind, run%last, part, found)
         if (.not. found%located) return
         found%event%before = located_event%event%before
         found%event%after = located_event%event%after
         found%fraction = 0.0_wp
         located_event = found
      end subroutine look_behind

      !> True if the located state lies on the path between both ends of the increment. For a limit point, its load must also not be
      !> below (maximum) or above (minimum) the loads of both ends.
      logical function satisfies_definition() result(right)
         right = run%fresh .or. .not. alike(problem, run%last%state, located_event%point%state)
         if (.not. right) right = lies_between(problem, run%last%state, trial%state, measure%chord, run%last%tangent, &
            & trial%tangent, located_event%point%state)
         if (located_event%event%kind == event_limit) right = right .and. is_extreme(step, run%last%state%load_factor, &
            & trial%state%load_factor, located_event)
      end function satisfies_definition
   end subroutine locate_event

   !> Derivative of the load factor or of a monitored displacement by arc length.
   real(wp) function value_rate(problem, monitor, point) result(rate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: monitor               !! index of the monitor; 0: the load factor
      type(path_point_t), intent(in) :: point
      rate = point%tangent%load
      if (monitor > 0) rate = rate * monitor_change(problem, monitor, point%state, point%system, point%system%tangent, 1.0_wp)
   end function value_rate

   !> True if contact with a foundation began or ended, or the load rate changed its sign, when the last accepted point was
   !> transferred to another mesh. The event then lies at that point within its error bar.
   pure logical function passed_by_mesh(run, event) result(passed)
      type(path_state_t), intent(in) :: run
      type(event_t), intent(in) :: event !! the event; for a limit point event%before is the load rate on the previous mesh
      real(wp) :: there                            ! sign of the event function behind the event
      passed = event%kind == event_limit .and. event%before * run%last%tangent%load < 0.0_wp
      if (passed) return
      passed = event%kind == event_contact .and. event%ground%contact > 0
      if (.not. passed) return
      there = merge(1.0_wp, -1.0_wp, event%label == contact_gained)
      passed = min(there * event%before, there * event%after) > 0.0_wp
   end function passed_by_mesh

   !> Marks as unknown the force-law segments of elements whose contact with a foundation changes at the event. The stored segments
   !> describe the contact on one side of the event only; on the other side the elements determine their segments again.
   pure subroutine reset_segments(problem, event, state)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event           !! contact change with a foundation
      type(state_t), intent(inout) :: state
      real(wp) :: at, closed
      integer :: c
      closed = problem%ground%chain%chain_length(event%ground%contact)
      do c = 1, problem%ground%chain%n
         if (problem%ground%chain%contact(c) /= event%ground%contact .or. state%segment(c) /= segment_open) cycle
         at = problem%ground%chain%s(c)
         if (closed > 0.0_wp) at = event%ground%from + modulo(at - event%ground%from, closed)
         if (at > event%ground%from .and. at < event%ground%to) state%segment(c) = segment_unknown
      end do
   end subroutine reset_segments

   !> Finds the zero of the event function by Chandrupatla's bracketing rule.
   subroutine bracket_zero(problem, step, run, trial, measure, located_event)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(increment_measure_t), intent(inout) :: measure
      type(located_event_t), intent(inout) :: located_event
      type(path_point_t) :: here, below, above
      type(bracket_t) :: bracket
      real(wp) :: f, f_below, f_above, left
      logical :: at_nodes, keeps_contact, low_moved, releases

      associate (event => located_event%event, located => located_event%located)
         releases = event%kind == event_release
         at_nodes = event%kind == event_contact .and. event%ground%contact == 0
         keeps_contact = at_nodes .and. .not. (event%divided .and. event%before < 0.0_wp)
         at_nodes = at_nodes .and. .not. event%divided
         bracket = new_bracket(event%before, event%after)
         if (releases) bracket = new_bracket(zero_eigenvalue(problem, event, run%last), zero_eigenvalue(problem, event, trial))
         f_below = bracket%f_low
         f_above = bracket%f_high
         event%scale = bracket%scale
         below = run%last
         above = trial
         ! The gap at a contact region that is lost may stay zero if a support carries the node. The search therefore keeps the
         ! contact closed; its reaction then changes sign at the event.
         located = abs(bracket%f_high) <= step%locate_tolerance * bracket%scale .and. .not. keeps_contact
         search: do while (.not. located)
            if (.not. next_guess(bracket, step%locate_tolerance, located_event%fraction)) then
               located_event%point = above
               located_event%fraction = bracket%high
               ! The bracket cannot be narrowed further. A continuous event function has nearly equal values at its ends; a function
               ! with a jump has no zero. A contact change is accepted by the length of the bracket alone: the contact force may
               ! begin with any slope, and may jump if one node more or less is in contact.
               if (event%kind == event_limit) call take_corner()
               if (event%corner) exit search
               if (event%kind == event_contact) then
                  located = path_length(problem, below%state, above%state) <= largest_distance * &
                     & path_length(problem, run%last%state, trial%state)
               else
                  located = abs(f_above - f_below) <= sqrt(step%locate_tolerance) * bracket%scale
               end if
               exit search
            end if
            ! With the contact set of the increment's first end the event function of a contact change is smooth through its zero.
            call point_within(problem, run, trial, measure, located_event%fraction, keeps_contact, keeps_contact, here, &
               & located_event%report)
            if (at_nodes .and. located_event%report%converged) call mark_passed_nodes(problem, run%last%state, trial%state, &
               & here, event%marked)
            if (keeps_contact .and. located_event%report%converged) then
               ! If other candidates violate their sign conditions with the contact set of the first end, the complementarity
               ! problem (LCP) determines the set.
               if (.not. holds_elsewhere(problem, here%system, event%marked, here%state)) then
                  keeps_contact = .false.
                  cycle search
               end if
            end if
            if (.not. located_event%report%converged) exit search
            event%pivots = here%system%negative_pivots
            if (releases) then
               f = zero_eigenvalue(problem, event, here)
            else
               f = event_value(problem, event, here%state, here%test_values)
            end if
            located_event%point = here
            ! Change of the load factor between the point and the zero, estimated with the smaller slope of the two secants to the
            ! bracket's ends.
            left = abs(f) * max(abs(above%state%load_factor - here%state%load_factor) / max(abs(f_above - f), tiny(f)), &
               & abs(here%state%load_factor - below%state%load_factor) / max(abs(f - f_below), tiny(f)))
            located = abs(f) <= step%locate_tolerance * bracket%scale .and. left <= step%locate_tolerance * &
               & max(abs(here%state%load_factor), abs(trial%state%load_factor - run%last%state%load_factor))
            if (located) exit search
            call take_value(bracket, located_event%fraction, f, low_moved)
            if (low_moved) then
               below = here
               f_below = f
            else
               above = here
               f_above = f
            end if
         end do search
         ! The eigenvalues may jump across zero without a bifurcation if the contact set changes.
         if (releases .and. located) located = all(below%state%active .eqv. above%state%active)
      end associate

   contains

      !> Accepts a limit point at a corner of the path, if the load has an extremum there. At a corner the load rate jumps from one
      !> sign to the other, because the contact set changes or a penetration passes a corner of its force law.
      subroutine take_corner()
         type(law_corner_t) :: law
         law = corner_between(problem, below%state, above%state)
         if (alike(problem, below%state, above%state) .and. law%candidate == 0) return
         located_event%located = path_length(problem, below%state, above%state) <= largest_distance * path_length(problem, &
            & run%last%state, trial%state) .and. is_extreme(step, run%last%state%load_factor, trial%state%load_factor, &
            & located_event)
         located_event%event%corner = located_event%located
         if (.not. located_event%located) return
         located_event%event%law = law
         located_event%event%note = note_of_corner
      end subroutine take_corner
   end subroutine bracket_zero

   !> Corrects the located state so that it has the prescribed value exactly. If the value cannot be prescribed or the corrector
   !> fails, the state is unchanged, and its error bar contains the difference.
   subroutine meet_value(problem, run, located_event)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(located_event_t), intent(inout) :: located_event !! located
      type(increment_t) :: report
      type(path_point_t) :: there
      real(wp) :: left
      if (.not. can_be_prescribed(problem, located_event%event%monitor)) return
      left = event_value(problem, located_event%event, located_event%point%state, located_event%point%test_values)
      there = located_event%point
      call correct(problem, located_event%point%state, prescribed_change(located_event%event%monitor, -left), .false., &
         & there%state, there%system, report)
      if (.not. report%converged) return
      there%tangent = path_tangent_of(problem, run, there)
      call evaluate_tests(problem, there)
      located_event%event%prescribed = .true.
      located_event%point = there
   end subroutine meet_value

   !> True if the load of a located limit point is above (maximum) or below (minimum) the loads of both ends of the increment, apart
   !> from the errors of these loads.
   pure logical function is_extreme(step, first, last, located_event) result(right)
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: first, last          !! load factors of the increment's first and second end
      type(located_event_t), intent(in) :: located_event
      real(wp) :: noise
      right = .true.
      associate (top => located_event%point%state%load_factor)
         ! The load of a limit point is stationary, so that its error is of the second order in the error of its position. The loads
         ! of the increment's ends have the error that the tolerance of the Newton iteration allows.
         noise = step%locate_tolerance * max(abs(top - first), abs(top - last)) + 4.0_wp * spacing(top) + &
            & step%tolerance * max(abs(first), abs(last))
         if (located_event%event%before > 0.0_wp) right = right .and. top >= max(first, last) - noise
         if (located_event%event%before < 0.0_wp) right = right .and. top <= min(first, last) + noise
      end associate
   end function is_extreme

   !> Extends the marks to the nodes over which a contact that is gained or lost passes within the increment. Such nodes are open at
   !> both ends of the increment and lie beside marked nodes. Between the ends they are in contact, or penetrate if the contact set
   !> is kept.
   subroutine mark_passed_nodes(problem, from, to, between, marked)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      type(path_point_t), intent(in) :: between
      logical, intent(inout) :: marked(:)        !! (candidates) true: the contact changes; out: the nodes passed are marked, too
      logical :: near(size(marked))
      integer :: c
      near = .not. (from%active .or. to%active .or. problem%candidates%bilateral) .and. (between%state%active .or. &
         & between%system%opening < -sign_slack * problem%size)
      near = near .or. marked
      do c = 1, size(marked)
         if (marked(c)) marked = marked .or. region_of(problem, near, c)
      end do
   end subroutine mark_passed_nodes

   !> True if gaps and reactions of all unmarked candidates have the right sign, and the reactions of the marked candidates do not
   !> differ in sign.
   pure logical function holds_elsewhere(problem, system, marked, state) result(holds)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled at `state`
      logical, intent(in) :: marked(:)           !! (candidates) true: sign not checked
      type(state_t), intent(in) :: state
      real(wp) :: least
      least = sign_slack * system%force_scale
      ! A contact region that is kept closed may have tension at one node and pressure at another node. A zero of the sum of these
      ! reactions is not a loss of contact.
      holds = .not. (any(marked .and. state%active .and. state%reaction < -least) .and. &
         & any(marked .and. state%active .and. state%reaction > least))
      if (.not. holds) return
      holds = .not. any(.not. marked .and. .not. problem%candidates%bilateral .and. &
         & merge(state%reaction < -least, system%opening < -sign_slack * problem%size, state%active))
   end function holds_elsewhere
end module event_location
