!> From contact at many nodes to contact spans: what the complementarity problem found at the start, as points and lines.
module span_start
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use contact_touch, only: touch_t, covers
   use touch_edits, only: begun, extended, end_moved, opened, united, numbered, same_set
   use span_problem, only: new_span_problem, new_sampled_problem, chain_starts, present_touches, touch_place
   use span_tests, only: run_span_tests, span_test_t, any_fails, test_slack, test_gap, test_force, test_curvature, test_pressure, &
      & test_closing
   use span_rules, only: answer_t, answer_to, index_of
   use nodal_touches, only: touches_at_nodes, along
   use span_lie_down, only: beside_free_span, span_gap, laid_down
   use state_transfer, only: carried
   use path_control, only: control_t, displacement_between, is_arc_length, set_tangent
   use path_run, only: run_t, forget_mesh
   use path_continuity, only: heading_at
   use path_events, only: new_probe
   use corrector, only: increment_t, correct
   use touchdown_points, only: with_held
   use rod_geometry, only: geometry_t, new_geometry
   use obstacle_geometry, only: obstacle_gap
   use timing, only: timers_t
   implicit none
   private
   public :: prepare_spans, enter_spans

   integer, parameter :: open_nodes(3) = [1, 4, 16]
   real(wp), parameter :: begins = 0.02_wp  !! of a stretch: where nodes say less than that, contact begins with it
   real(wp), parameter :: opens = 0.2_wp    !! of a line
   integer, parameter :: max_rounds = 20 !! corrections of what the nodes say
   integer, parameter :: max_tries = 30  !! increments with contact at nodes

contains

   !> The problem that a path with contact spans starts with: without spans where nothing touches yet, else with nodes that find
   !> out what does. Unchanged where the deck has no contact that spans describe.
   subroutine prepare_spans(problem)
      type(problem_t), intent(inout) :: problem      !! of the deck
      type(touch_t), allocatable :: clamp(:)
      real(wp) :: gap, normal(2), bend
      logical :: touches
      integer :: k, i
      if (.not. any(problem%deck%contact%along)) return
      allocate (problem%covered(size(problem%layout%stretch), size(problem%deck%contact)))
      do k = 1, size(problem%deck%contact)
         problem%covered(:, k) = covers(problem%deck, problem%layout, k)
      end do
      problem%chain_start = chain_starts(problem)
      touches = .false.
      allocate (clamp(0))
      do k = 1, size(problem%deck%contact)
         associate (contact => problem%deck%contact(k))
            if (.not. contact%along) cycle
            do i = 1, size(contact%node)
               call obstacle_gap(problem%deck%obstacle(contact%obstacle), problem%deck%mesh%x(:, contact%node(i)), gap, normal, &
                  & bend)
               if (gap + contact%gap + problem%overlap(k) > 1.0e-10_wp * problem%size) cycle
               if (clamped_along(problem, k, contact%node(i), normal)) then
                  clamp = [clamp, touch_at_end(problem, k, contact%node(i), size(clamp) + 1)]
               else
                  touches = .true.
               end if
            end do
         end associate
      end do
      if (touches) then
         problem = new_sampled_problem(problem)
      else
         problem = new_span_problem(problem, clamp)
      end if
   end subroutine prepare_spans

   !> True for the end of a rod that a support clamps along the obstacle: contact may spread from there, but does not carry
   !> anything yet.
   logical function clamped_along(problem, contact, node, normal) result(clamped)
      type(problem_t), intent(in) :: problem         !! of the deck
      integer, intent(in) :: contact, node
      real(wp), intent(in) :: normal(2)              !! of the obstacle there
      type(geometry_t) :: home
      real(wp) :: angle
      integer :: e, side
      clamped = problem%model%fixed(3, node) .and. count(problem%beside(:, node) > 0) == 1 .and. &
         & all(problem%model%fixed(1:2, node) .or. abs(normal) <= along)
      if (.not. clamped) return
      side = merge(1, 2, problem%beside(2, node) > 0)
      e = problem%beside(3 - side, node)
      home = new_geometry(problem%model, problem%tableau)
      angle = home%element(e)%end_angle(side)
      clamped = problem%covered(problem%stretch(e), contact) .and. abs(dot_product(normal, [cos(angle), sin(angle)])) <= along
   end function clamped_along

   !> A point contact at such an end.
   type(touch_t) function touch_at_end(problem, contact, node, number) result(touch)
      type(problem_t), intent(in) :: problem         !! of the deck
      integer, intent(in) :: contact, node, number
      touch%contact = contact
      touch%number = number
      touch%stretch = problem%stretch(maxval(problem%beside(:, node)))
      if (problem%beside(1, node) > 0) touch%at = problem%layout%stretch(touch%stretch)%length
   end function touch_at_end

   !> Takes a converged state of contact at nodes for one of contact spans, and the run with it. What the nodes say is corrected
   !> until all tests of the spans hold; where that fails the run goes on with contact at nodes, and tries again later.
   subroutine enter_spans(problem, run, trial, entered, timers)
      type(problem_t), intent(inout) :: problem      !! sampled on entry
      type(run_t), intent(inout) :: run
      type(state_t), intent(inout) :: trial
      logical, intent(out) :: entered
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: next
      type(system_t) :: system
      type(state_t) :: state
      type(increment_t) :: report
      type(control_t) :: here
      type(touch_t), allocatable :: touch(:), first(:), better(:)
      type(span_test_t), allocatable :: tests(:)
      character(:), allocatable :: why
      integer :: round, wave, k
      entered = .false.
      here%method = method_load
      ! From what the nodes say to what they may mean.
      waves: do wave = 1, size(open_nodes)
         touch = touches_at_nodes(problem, trial, open_nodes(wave))
         if (wave > 1) then
            if (same_set(touch, first)) cycle waves
         end if
         first = touch
         call settle()
         if (entered) call lay_flat_spans()
         if (entered) exit waves
      end do waves
      if (.not. entered) then
         run%span_tries = run%span_tries + 1
         if (run%span_tries > max_tries) run%stuck = 'contact at nodes did not turn into points and lines along the rod: '//why
         call linearise(problem, trial, run%state, run%system, timers)
         return
      end if
      run%span_tries = 0
      do k = 1, size(next%touch)
         next%touch(k)%number = run%touches + k
      end do
      run%touches = run%touches + size(next%touch)
      run%state = carried(problem, run%state, next)
      run%system = system
      problem = next
      trial = state
      call forget_mesh(run)
      run%heading = heading_at(problem, run%system, displacement_between(problem, run%state, trial), &
         & trial%load_factor - run%state%load_factor)
      if (is_arc_length(run%control%method)) &
         & call set_tangent(problem, run%system, run%heading%u, run%heading%load, run%control)
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)

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
               if (entered .and. count(next%conforms == 0) < count(kept%conforms == 0)) then
                  c = 0
                  exit
               end if
               entered = .true.
               next = kept
               state = kept_state
               system = kept_system
            end do
            c = c + 1
         end do
      end subroutine lay_flat_spans

      !> Corrects the touches until they hold.
      subroutine settle()
         entered = .false.
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
            entered = .not. any_fails(tests)
            if (entered) exit tries
            why = 'contact did not settle'
            call correct_touches(next, state, tests, better)
            if (.not. allocated(better)) exit tries
            if (same_set(better, touch)) exit tries
            touch = better
         end do tries
      end subroutine settle
   end subroutine enter_spans

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
end module span_start
