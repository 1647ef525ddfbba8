!> Closing of free spans: the gap of a free span vanishes all along, or its length becomes zero. When it closes, a point contact
!> beside the span can shift along the rod without resistance, so that increments with the present set may not converge nearby. The
!> equations of the sets without the span are regular. Of those sets whose tests are satisfied just beyond the closing, the path
!> takes the one that begins first, at its onset (the point of the path where a set begins). If a change is located on the
!> increment, it comes before an onset beyond the increment.
module closing_spans
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t, rounding_gap
   use contact_spans, only: closed_share
   use test_kinds, only: span_test_t, any_fails, test_vanishing, test_force, test_pressure, test_couple, test_slack, well_below
   use edit_places, only: places_of_tests
   use rod_strips, only: find_strips
   use path_record, only: recorder_t
   use contact_change_types, only: step_interval_t
   use step_control, only: too_short, largest_growth
   use trial_request, only: request_t
   use other_set, only: other_set_t, tests_of
   use set_validity, only: step_ahead
   use tried_sets, only: next_set_t, new_change_place
   use contact_trials, only: try_sets
   use entering_contact_set, only: passes_value
   use continuing_with_set, only: begin_set
   use path_control, only: control_t
   use corrector, only: increment_t
   use path_point, only: path_point_t, advance, span_tests_at
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   implicit none
   private
   public :: about_to_close, close_spans

contains

   !> Tests of free spans that have closed on an increment or, if another test fails or no increment converges, that seem to close
   !> ahead: within the longest next increment if their gaps go on falling as on this increment.
   function about_to_close(problem, interval, fails) result(closing)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      logical, intent(in) :: fails               !! true: another test fails on the increment
      type(span_test_t), allocatable :: closing(:)
      logical :: near(size(interval%after))
      integer :: k
      do k = 1, size(near)
         associate (before => interval%before(k), after => interval%after(k))
            near(k) = after%kind == test_vanishing
            if (near(k)) near(k) = (is_gone(problem, after) .and. is_shorter(interval, k)) .or. ((interval%stuck .or. fails) &
               & .and. after%value <= largest_growth * (before%value - after%value))
         end associate
      end do
      closing = pack(interval%after, near)
   end function about_to_close

   !> Passes to the contact set without the given free spans at its onset, which lies on the increment or, if no increment
   !> converges, just ahead. Events before the onset come first, with the present set. A shorter increment is therefore requested
   !> while a value that the deck asks for lies before the onset, or the onset of a set without only some of the spans.
   subroutine close_spans(problem, step, run, point, interval, closing, recorder, request, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: point    !! a point with the present set, near the onset
      type(step_interval_t), intent(in) :: interval
      type(span_test_t), intent(in) :: closing(:) !! tests of the free spans that close, at least one
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request !! set_changed: the path goes on without the spans; unchanged: no set without the
      !! spans was found, or the set found begins later
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(next_set_t) :: next
      logical :: begins, too_far, can_cut
      finished = .false.
      can_cut = .not. interval%stuck .and. .not. too_short(step, run%control, 0.5_wp)
      call try_sets(step, run, new_change_place(problem, step, run, point, closing=closing), next)
      if (.not. next%found) return
      too_far = .false.
      associate (first => next%first, onset => next%first%state%load_factor, end => interval%to%state%load_factor)
         if (begins_beyond(onset)) return
         if (interval%stuck) then
            begins = .not. stays_valid(problem, run, onset)
         else
            begins = .not. passes_value(problem, step, run, first, .false.)
            too_far = .not. begins
            if (begins .and. can_cut) too_far = .not. all_begin(next)
         end if
      end associate
      if (too_far) then
         call request%locate_nearer(step, run%control, closing(1))
      else if (begins) then
         request%set_changed = .true.
         call begin_set(problem, step, run, next, recorder, finished, outcome)
      end if

   contains

      !> True if an onset lies beyond the located change or the end of the increment, whichever is farther. The place where a gap
      !> closes is known to the accuracy of located places, and to the distance on which the gap falls by the slack of its test. If
      !> no increment converges, the onset may lie as far ahead as the closing was sought (about_to_close).
      pure logical function begins_beyond(onset)
         real(wp), intent(in) :: onset           !! load factor
         real(wp) :: sense, reach
         integer :: k
         associate (from => interval%from%load_factor, end => interval%to%state%load_factor)
            sense = sign(1.0_wp, end - from)
            reach = largest_growth
            if (.not. interval%stuck) reach = maxval([(test_slack(closing(k)%kind) / max(fall_of(interval, closing(k)), &
               & sqrt(tiny(reach))), k=1, size(closing))])
            begins_beyond = sense * (onset - end) - max(0.0_wp, sense * (point%state%load_factor - end)) > reach * abs(end - from) &
               & + max(step%locate_tolerance, min(step%asked, step%asked_of_path)) * abs(onset)
         end associate
      end function begins_beyond
   end subroutine close_spans

   !> True if all contacts that a set without free spans gains begin at its onset: at the onset the pressure or force of each
   !> contact is zero and grows. (On a node inside a line contact no force may act at all.) The result is also false if the onset
   !> was not located at a zero of a test: the set may become valid only when another span has closed.
   logical function all_begin(next)
      type(next_set_t), intent(in) :: next            !! the set, whose first equilibrium is its onset
      type(span_test_t), allocatable :: tests(:), later(:)
      associate (first => next%first)
         all_begin = first%times == 1 .and. first%test > 0
         if (all_begin .or. first%test == 0) return
         tests = tests_of(first)
         later = tests_of(next%onward)
         if (size(later) /= size(tests)) return
         tests = pack(tests, any_of_forces(tests%kind) .and. tests%value <= well_below * test_slack(tests%kind) .and. &
            & later%value > tests%value)
         all_begin = size(places_of_tests(first%problem, first%state, find_strips(first%problem%layout), tests, &
            & first%system%force_scale)) >= first%times
      end associate

   contains

      impure elemental logical function any_of_forces(kind)
         integer, intent(in) :: kind
         any_of_forces = any(kind == [test_force, test_pressure, test_couple])
      end function any_of_forces
   end function all_begin

   !> True if the present set is still valid just beyond the onset of another set. Both sets are then valid within the slack
   !> (allowed error) of their tests, and the contact changes only where the present set fails.
   logical function stays_valid(problem, run, onset)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: onset              !! load factor
      type(control_t) :: control
      type(path_point_t) :: there
      type(increment_t) :: report
      control%method = method_load
      control%increment = (1.0_wp + step_ahead(1)) * (onset - run%last%state%load_factor)
      stays_valid = abs(control%increment) > 0.0_wp
      if (.not. stays_valid) return
      call advance(problem, run%last, control, there, report)
      stays_valid = report%converged
      if (stays_valid) stays_valid = .not. any_fails(span_tests_at(problem, there))
   end function stays_valid

   !> Decrease of the largest gap of a free span on the increment.
   pure real(wp) function fall_of(interval, closing) result(fall)
      type(step_interval_t), intent(in) :: interval
      type(span_test_t), intent(in) :: closing   !! test of the free span
      integer :: k
      fall = 0.0_wp
      do k = 1, size(interval%after)
         associate (after => interval%after(k))
            if (after%kind == closing%kind .and. after%contact == closing%contact .and. all(after%beside == closing%beside)) &
               & fall = interval%before(k)%value - after%value
         end associate
      end do
   end function fall_of

   !> True if the span has become shorter on the interval.
   pure logical function is_shorter(interval, which)
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test of the span
      is_shorter = length(interval%after(which)) < length(interval%before(which))

   contains

      pure real(wp) function length(test)
         type(span_test_t), intent(in) :: test
         length = test%ends(2) - test%ends(1)
      end function length
   end function is_shorter

   !> True if a free span has closed: its gap is zero everywhere within rounding, or its length is below the least length.
   pure elemental logical function is_gone(problem, test) result(gone)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! test of the free span
      gone = abs(test%value) * problem%size <= rounding_gap(problem) .or. &
         & test%ends(2) - test%ends(1) < closed_share * problem%layout%rod_segment(test%rod_segment)%length
   end function is_gone

end module closing_spans
