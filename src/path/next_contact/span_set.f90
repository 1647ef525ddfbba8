!> Change of the contact set at the zero of a test function by a rule, and the path tangent with which the run continues: the sense
!> in which the new contact or free span grows.
module span_set
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use node_contact_functional, only: reaction_rate
   use contact_spans, only: contact_span_t, shortest
   use span_candidates, only: present_contact_spans, touch_place, rolls_at
   use free_span_gap, only: gap_at
   use test_kinds, only: span_test_t, test_words, test_gap, test_force, test_length, test_crossing
   use span_answer, only: answer_t
   use span_mesh, only: mesh_for_spans
   use held_openings, only: begin_span
   use tangent_step, only: states_along
   use shrunk_line, only: come_to_rest
   use flat_points, only: curving_rate
   use path_control, only: control_t, is_arc_length
   use path_continuity, only: path_tangent_at
   use path_point, only: path_point_t, move_to, evaluate_tests
   use path_state, only: path_state_t, path_tangent_of
   use corrector, only: increment_t, correct
   use touchdown_points, only: point_force
   implicit none
   private
   public :: change_set, add_contact_spans, new_contact_at

contains

   !> Continues with the set that the test's rule gives, in the sense in which the new contact or free span grows.
   subroutine change_set(problem, run, test, begins, answer, reach, why)
      type(problem_t), intent(inout) :: problem  !! undefined if no equilibrium is found
      type(path_state_t), intent(inout) :: run   !! in: at the zero of the test; undefined if no equilibrium is found
      type(span_test_t), intent(in) :: test      !! the test at this zero
      type(span_test_t), intent(in) :: begins(:) !! gaps that close there, that of `test` last; empty if `test` is no gap
      type(answer_t), intent(in) :: answer       !! rule's answer to the test
      real(wp), intent(in) :: reach              !! largest path distance to the equilibrium with the new set
      character(:), allocatable, intent(out) :: why !! reason why no equilibrium was found; not allocated: it was found
      type(contact_span_t) :: old, now(size(problem%contact_span))
      integer :: pivots
      logical :: ok, leaves
      now = present_contact_spans(problem, run%last%state)
      if (test%contact_span > 0) old = now(test%contact_span)
      pivots = run%last%test_values%negative_pivots
      call stand_with(problem, run, test, begins, answer, old, reach, ok, leaves)
      if (.not. ok) then
         why = 'no way on from where '//trim(test_words(test%kind))
         return
      end if
      call take_sense(problem, run, test, old, leaves)
      call evaluate_tests(problem, run%last)
      ! Where a line contact has become a point contact, a free span beside it may be in neutral equilibrium, so that its pivot has
      ! no certain sign; the pivot count with the line contact is kept.
      run%since_change%shrunk = test%kind == test_length
      if (run%since_change%shrunk) run%last%test_values%negative_pivots = pivots
      run%since_change%arrives = any(test%kind == [test_length, test_crossing])
   end subroutine change_set

   !> Finds the equilibrium of the run with the next contact spans.
   subroutine stand_with(problem, run, test, begins, answer, old, reach, ok, leaves)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run          !! in: at the zero of the test
      type(span_test_t), intent(in) :: test
      type(span_test_t), intent(in) :: begins(:)
      type(answer_t), intent(in) :: answer
      type(contact_span_t), intent(in) :: old           !! contact span of the test
      real(wp), intent(in) :: reach
      logical, intent(out) :: ok                 !! false: no equilibrium was found
      logical, intent(out) :: leaves             !! true: a line contact became a point, and the run has moved past this point
      leaves = .false.
      if (test%kind == test_gap) then
         call add_contact_spans(problem, run, begins, ok)
      else
         run%spans_begun = max(run%spans_begun, maxval(answer%contact_span%number))
         call mesh_for_spans(problem, run, answer%contact_span)
         ok = run%last%system%ok
      end if
      if (.not. ok) return
      if (size(answer%crosses, 2) > 0) then
         call begin_span(problem, run, answer%crosses(:, 1), ok, answer%crosses(:, 2:))
      else if (any(test%kind == [test_length, test_crossing])) then
         call come_to_rest(problem, run, candidate_of(problem, old%number), reach, leaves)
      end if
   end subroutine stand_with

   !> Sets the path tangent to the sense in which the new contact or free span grows.
   subroutine take_sense(problem, run, test, old, leaves)
      type(problem_t), intent(in) :: problem     !! problem with the contact spans of the answer
      type(path_state_t), intent(inout) :: run
      type(span_test_t), intent(in) :: test      !! test that was zero
      type(contact_span_t), intent(in) :: old           !! contact span of the test, before the change
      logical, intent(in) :: leaves              !! true: a line contact became a point, and the run has moved past this point
      real(wp) :: rate
      select case (test%kind)
      case (test_gap)
         rate = 1.0_wp
         if (candidate_of(problem, run%spans_begun) > 0) rate = reaction_rate(problem, run%last%state, &
            & run%last%system, candidate_of(problem, run%spans_begun))
         call head_for(problem, run, rate)
      case (test_force)
         call head_for(problem, run, opening_rate(problem, run%last, old))
      case default
         if (leaves) then
            call head_for(problem, run, curving_rate(problem, run%last, candidate_of(problem, old%number)))
         else if (is_arc_length(run%control%method)) then
            run%last%tangent = path_tangent_at(problem, run%last%system, run%last%tangent%u, run%last%tangent%load)
         else
            run%last%tangent = path_tangent_of(problem, run, run%last)
         end if
      end select
   end subroutine take_sense

   !> Sets the path tangent to the sense in which a quantity with the given rate (per unit of load factor) grows.
   subroutine head_for(problem, run, rate)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      real(wp), intent(in) :: rate               !! rate of the quantity per unit of load factor
      run%last%tangent = path_tangent_at(problem, run%last%system, 0.0_wp * run%last%state%u, sign(1.0_wp, rate))
   end subroutine head_for

   !> Adds a contact span at each place where the gap of a free span is zero. The load is that at which the contact force of the
   !> last added span is zero.
   subroutine add_contact_spans(problem, run, begins, ok)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run  !! in: at the zero of the gaps; out: in equilibrium, the last new span having the
      !! number `spans_begun`
      type(span_test_t), intent(in) :: begins(:)
      logical, intent(out) :: ok                 !! false: no force-free equilibrium near this state
      integer, parameter :: most = 8             ! iterations; more let the position of a force-free point contact drift
      type(contact_span_t) :: new(size(begins))
      type(control_t) :: control
      type(increment_t) :: report
      type(state_t) :: base, first
      real(wp) :: rate
      integer :: c, try, k
      do k = 1, size(begins)
         run%spans_begun = run%spans_begun + 1
         new(k) = contact_span_t(number=run%spans_begun, contact=begins(k)%contact, rod_segment=begins(k)%rod_segment, &
            & at=spread(beginning_place(problem, begins(k)), 1, 2))
      end do
      call mesh_for_spans(problem, run, [present_contact_spans(problem, run%last%state), new])
      ok = run%last%system%ok
      if (.not. ok) return
      c = candidate_of(problem, run%spans_begun)
      ! At a segment boundary the gap was measured at a node.
      if (c == 0) return
      if (.not. problem%candidates%moves(c)) return
      first = run%last%state
      control%method = method_load
      control%increment = 0.0_wp
      ! Rounding of the residual is measured by the load, because the increment may be arbitrarily small.
      control%whole = run%last%state%load_factor
      do try = 1, most
         base = run%last%state
         call correct(problem, base, control, .true., run%last%state, run%last%system, report)
         ok = report%converged
         if (.not. ok) exit
         rate = reaction_rate(problem, run%last%state, run%last%system, c)
         ok = abs(rate) > 0.0_wp
         if (.not. ok) exit
         control%increment = -point_force(problem, run%last%state, c) / rate
         if (abs(control%increment) <= 10.0_wp * epsilon(rate) * abs(run%last%state%load_factor)) return
      end do
      ok = ok .and. abs(control%increment) <= sqrt(epsilon(rate)) * abs(run%last%state%load_factor)
      if (ok) return
      call move_to(problem, first, run%last)
   end subroutine add_contact_spans

   !> Position along the rod segment where a contact span begins: the place of the gap, or a segment boundary that allows rolling if
   !> it is closer than `shortest`.
   pure real(wp) function beginning_place(problem, test) result(at)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test
      at = test%at
      associate (length => problem%layout%rod_segment(test%rod_segment)%length)
         if (test%at <= shortest * length) then
            if (rolls_at(problem, test%contact, test%rod_segment, 1)) at = 0.0_wp
         else if (test%at >= (1.0_wp - shortest) * length) then
            if (rolls_at(problem, test%contact, test%rod_segment, 2)) at = length
         end if
      end associate
   end function beginning_place

   !> Candidate at the beginning of a contact span; 0: this candidate belongs to another contact span.
   pure integer function candidate_of(problem, number) result(c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: number
      integer :: k
      c = 0
      k = findloc(problem%contact_span%number, number, 1)
      if (k > 0) c = problem%contact_span(k)%candidate(1)
      if (c > 0) then
         if (problem%candidates%contact_span(c) /= k) c = 0
      end if
   end function candidate_of

   !> The gap tests `begins` at the positions of the contact spans that add_contact_spans has added.
   pure function new_contact_at(problem, run, begins) result(there)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(span_test_t), intent(in) :: begins(:)
      type(span_test_t) :: there(size(begins))
      integer :: k, c
      there = begins
      do k = 1, size(begins)
         c = candidate_of(problem, run%spans_begun - size(begins) + k)
         if (c > 0) there(k)%at = touch_place(problem, run%last%state, c)
      end do
   end function new_contact_at

   !> Rate at which the gap of a lost contact grows along the path, per unit of load factor.
   real(wp) function opening_rate(problem, point, lost) result(rate)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      type(contact_span_t), intent(in) :: lost
      type(state_t) :: ahead, here
      real(wp) :: step
      call states_along(problem, point%system, point%state, 1.0_wp, here, ahead, step)
      rate = gap_at(problem, ahead, lost%contact, lost%rod_segment, lost%at(1)) - &
         & gap_at(problem, here, lost%contact, lost%rod_segment, lost%at(1))
   end function opening_rate
end module span_set
