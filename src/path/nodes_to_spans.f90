!> From contact at many nodes, where the complementarity problem finds what touches, to points and lines along the rod.
module nodes_to_spans
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use contact_touch, only: touch_t
   use touch_edits, only: same_set, laid_down
   use span_problem, only: new_span_problem, present_touches
   use span_tests, only: span_test_t, run_span_tests, spans_hold, test_slack, test_flat
   use nodal_touches, only: touches_at_nodes
   use state_transfer, only: carried
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use touchdown_points, only: with_held
   use timing, only: timers_t
   implicit none
   private
   public :: find_spans

   integer, parameter :: open_nodes(3) = [1, 4, 16]

contains

   !> The problem of contact spans that a converged state of contact at nodes means, and its equilibrium at the same load. Not found
   !> where their tests do not hold: then nodes say more a little further on.
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
      type(touch_t), allocatable :: touch(:), first(:)
      integer :: wave, k, c
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
         type(span_test_t), allocatable :: tests(:)
         tests = run_span_tests(next, state, system%force_scale)
         k = 1
         do while (k <= size(tests))
            if (tests(k)%kind == test_flat .and. abs(tests(k)%value) <= test_slack(test_flat)) then
               kept = next
               kept_state = state
               kept_system = system
               touch = laid_down(present_touches(next, state), tests(k)%beside, tests(k)%ends)
               call settle()
               if (found .and. count(next%conforms == 0) < count(kept%conforms == 0)) then
                  tests = run_span_tests(next, state, system%force_scale)
                  k = 0
               else
                  found = .true.
                  next = kept
                  state = kept_state
                  system = kept_system
               end if
            end if
            k = k + 1
         end do
      end subroutine lay_flat_spans

      !> Equilibrium with these touches, and whether it holds.
      subroutine settle()
         found = .false.
         touch%number = [(c, c=1, size(touch))]
         next = new_span_problem(problem, touch)
         state = carried(problem, trial, next)
         system = new_system(next)
         ! Touchdown points move where they are told by forces in equilibrium.
         call correct(with_held(next, [(c, c=1, next%candidates%n)]), state, here, .true., state, system, report, timers)
         if (report%converged) call correct(next, state, here, .true., state, system, report, timers, far_off=.true.)
         why = 'equilibrium was not found'
         if (.not. report%converged) return
         found = spans_hold(next, state, system%force_scale)
         if (.not. found) why = 'contact did not settle'
      end subroutine settle
   end subroutine find_spans
end module nodes_to_spans
