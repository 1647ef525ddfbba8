!> From contact at many nodes, where the complementarity problem finds what touches, to points and lines along the rod.
module nodes_to_spans
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use contact_touch, only: touch_t
   use touch_edits, only: begun, extended, end_moved, opened, united, numbered, same_set
   use span_problem, only: new_span_problem, present_touches, touch_place
   use span_tests, only: run_span_tests, span_test_t, any_fails, test_slack, test_gap, test_force, test_curvature, test_pressure, &
      & test_closing
   use span_rules, only: answer_t, answer_to, index_of
   use nodal_touches, only: touches_at_nodes
   use span_lie_down, only: beside_free_span, span_gap, laid_down
   use state_transfer, only: carried
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use touchdown_points, only: with_held
   use timing, only: timers_t
   implicit none
   private
   public :: find_spans

   integer, parameter :: open_nodes(3) = [1, 4, 16]
   real(wp), parameter :: begins = 0.02_wp  !! of a stretch: where nodes say less than that, contact begins with it
   real(wp), parameter :: opens = 0.2_wp    !! of a line
   integer, parameter :: max_rounds = 20 !! corrections of what the nodes say

contains

   !> The problem of contact spans, and its equilibrium at the same load, that a converged state of contact at nodes means. What the
   !> nodes say is corrected until all tests of the spans hold.
   subroutine find_spans(problem, trial, next, state, system, found, why, timers)
      type(problem_t), intent(in) :: problem     !! sampled
      type(state_t), intent(in) :: trial
      type(problem_t), intent(out) :: next       !! its touches have the numbers 1, 2, ...
      type(state_t), intent(out) :: state
      type(system_t), intent(out) :: system      !! factored there
      logical, intent(out) :: found
      character(:), allocatable, intent(out) :: why !! not found: the reason
      type(timers_t), intent(inout) :: timers
      type(increment_t) :: report
      type(control_t) :: here
      type(touch_t), allocatable :: touch(:), first(:), better(:)
      type(span_test_t), allocatable :: tests(:)
      integer :: round, wave, k
      found = .false.
      here%method = method_load
      ! From what the nodes say to what they may mean.
      waves: do wave = 1, size(open_nodes)
         touch = touches_at_nodes(problem, trial, open_nodes(wave))
         if (wave > 1) then
            if (same_set(touch, first)) cycle waves
         end if
         first = touch
         call settle()
         if (found) call lay_flat_spans()
         if (found) exit waves
      end do waves

   contains

      !> A free span that as good as lies on the obstacle does so where the line holds, too: its ends carry nothing, and would be
      !> anywhere.
      subroutine lay_flat_spans()
         type(problem_t) :: kept
         type(system_t) :: kept_system
         type(state_t) :: kept_state
         integer :: c, side
         c = 1
         do while (c <= next%candidates%n)
            do side = 1, 2
               if (.not. beside_free_span(next, c, side)) cycle
               if (abs(span_gap(next, state, c, side)) > test_slack(test_gap) * next%size) cycle
               kept = next
               kept_state = state
               kept_system = system
               touch = laid_down(next, state, c, side)
               call settle()
               if (found .and. count(next%conforms == 0) < count(kept%conforms == 0)) then
                  c = 0
                  exit
               end if
               found = .true.
               next = kept
               state = kept_state
               system = kept_system
            end do
            c = c + 1
         end do
      end subroutine lay_flat_spans

      !> Corrects the touches until they hold.
      subroutine settle()
         found = .false.
         tries: do round = 1, max_rounds
            touch%number = [(k, k=1, size(touch))]
            next = new_span_problem(problem, touch)
            state = carried(problem, trial, next)
            system = new_system(next)
            ! Touchdown points move where they are told by forces in equilibrium.
            call correct(with_held(next, [(k, k=1, next%candidates%n)]), state, here, .true., state, system, report, timers)
            if (report%converged) call correct(next, state, here, .true., state, system, report, timers, far_off=.true.)
            why = 'equilibrium was not found'
            if (.not. report%converged) exit tries
            tests = run_span_tests(next, state, max(system%force_scale, tiny(1.0_wp)))
            found = .not. any_fails(tests)
            if (found) exit tries
            why = 'contact did not settle'
            call correct_touches(next, state, tests, better)
            if (.not. allocated(better)) exit tries
            if (same_set(better, touch)) exit tries
            touch = better
         end do tries
      end subroutine settle
   end subroutine find_spans

   !> Another set where some tests of one do not hold: contact where the rod is inside an obstacle, none where it would have to be
   !> pulled. Not allocated where nothing is known to help.
   subroutine correct_touches(problem, state, tests, better)
      type(problem_t), intent(in) :: problem         !! of spans
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: tests(:)
      type(touch_t), allocatable, intent(out) :: better(:)
      type(touch_t), allocatable :: set(:), before(:)
      type(answer_t) :: answer
      logical :: answered(size(problem%touch))       ! one test each
      integer :: k, i
      before = present_touches(problem, state)
      set = before
      answered = .false.
      do i = 1, size(tests)
         associate (test => tests(i))
            if (test%value >= -test_slack(test%kind)) cycle
            k = test%touch
            if (test%kind == test_gap) k = at_tip(test)
            if (k > 0) then
               if (answered(k)) cycle
               answered(k) = .true.
            end if
            ! Beside a point that is to spread the rod is inside the obstacle for that reason.
            if (test%kind == test_gap) then
               if (spreads_beside(test)) cycle
            end if
            if (test%kind == test_gap .and. k > 0) then
               ! The end of a rod that has turned flat lies down from there.
               set = extended(set, index_of(problem, set, k), test%at)
            else if (test%kind == test_pressure) then
               call lift(index_of(problem, set, k), test%at, nint(test%sense))
            else if (test%kind == test_force .and. problem%touch(max(k, 1))%line) then
               call lift(index_of(problem, set, k), 0.0_wp, &
                  & merge(1, -1, touch_place(problem, state, test%candidate) > 0.5_wp * sum(before(k)%at)))
            else
               answer = answer_to(problem, state, test, set, maxval([0, set%number]), begins, begins)
               if (allocated(answer%why)) cycle
               set = answer%touch
               if (test%kind == test_closing) answered(k + 1) = .true.
            end if
         end associate
      end do
      if (.not. same_set(set, before)) better = united(set)

   contains

      !> True for a span next to a point contact that is less curved than its obstacle.
      pure logical function spreads_beside(test) result(beside)
         type(span_test_t), intent(in) :: test
         integer :: i
         beside = .false.
         do i = 1, size(tests)
            if (tests(i)%kind /= test_curvature .or. tests(i)%value >= -test_slack(test_curvature)) cycle
            beside = beside .or. any(problem%candidates%element(:, tests(i)%candidate) == test%first) .or. &
               & any(problem%candidates%element(:, tests(i)%candidate) == test%last)
         end do
      end function spreads_beside

      !> The point contact at the end of its rod that a span inside an obstacle leads to; 0: none.
      pure integer function at_tip(test) result(k)
         type(span_test_t), intent(in) :: test
         integer :: c, node
         do c = 1, problem%candidates%n
            k = problem%candidates%touch(c)
            if (k == 0) cycle
            node = problem%candidates%node(c)
            if (problem%touch(k)%line .or. problem%touch(k)%contact /= test%contact .or. all(problem%beside(:, node) > 0)) cycle
            if (any(problem%beside(:, node) == test%first .or. problem%beside(:, node) == test%last)) return
         end do
         k = 0
      end function at_tip

      !> A line that is not pressed somewhere: inside it becomes two; at an end it ends before, and its last point stays where the
      !> rod is pressed on.
      subroutine lift(k, at, side)
         integer, intent(in) :: k
         real(wp), intent(in) :: at                  !! inside
         integer, intent(in) :: side                 !! -1: at its first end, 0: inside, 1: at its last
         real(wp) :: part, whole
         integer :: end
         whole = problem%layout%stretch(set(k)%stretch)%length
         part = opens * (set(k)%at(2) - set(k)%at(1))
         if (side == 0) then
            part = 0.5_wp * min(part, 2.0_wp * opens * (at - set(k)%at(1)), 2.0_wp * opens * (set(k)%at(2) - at))
            set = numbered(opened(set, k, at - part, at + part), maxval(set%number))
            return
         end if
         end = merge(1, 2, side < 0)
         associate (from => set(k)%at(end))
            if (from > 0.0_wp .and. from < whole) &
               & set = numbered(begun(set, set(k)%contact, set(k)%stretch, from), maxval(set%number))
         end associate
         set = end_moved(set, k, end, set(k)%at(end) - side * part)
      end subroutine lift
   end subroutine correct_touches
end module nodes_to_spans
