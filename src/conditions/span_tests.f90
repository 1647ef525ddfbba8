!> What must hold for a set of contact spans to be the right one: test functions, smooth along a path on which the set stays,
!> positive while it holds. Their zeros are where contact begins, ends, spreads or splits.
!>
!> state -> tests -> the first that vanishes on an increment (span_events) -> where (span_location, vanishing_span,
!> predicted_contact_set)
!>   -> recorded (span_changes) -> the next set (span_rules, contact_set_edits) -> its mesh (span_mesh) -> the way on (span_set,
!>   entering_contact_set)
module span_tests
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use free_span, only: free_span_t, free_spans, span_ends
   use free_span_gap, only: least_gap
   use line_pressure, only: least_pressure
   use contact_spans, only: contact_span_t, shortest
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, any_fails, test_slack, well_below, test_gap, test_curvature, test_pressure, test_length, &
      & test_vanishing, test_crossing
   use point_tests, only: tests_of_points
   implicit none
   private
   public :: run_span_tests, spans_hold

contains

   !> All tests of a converged state; in the same order for all states of one problem.
   function run_span_tests(problem, state, scale, only) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! of forces
      integer, intent(in), optional :: only !! number of the one whose value is wanted, 0: those of points; others' gaps and
      !! pressures are not looked at
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t), allocatable :: points(:), gaps(:), lengths(:)
      integer :: k, i
      logical :: pressed
      points = tests_of_points(problem, state, scale)
      gaps = gap_tests(problem, state, points, .not. present(only))
      if (present(only)) then
         if (needs_gaps(only)) gaps = gap_tests(problem, state, points, .true.)
      end if
      lengths = length_tests(problem, state)
      pressed = .not. present(only)
      if (present(only)) pressed = only > size(gaps) + size(points) + size(lengths)
      tests = [gaps, points, lengths, pressure_tests(problem, state, scale, pressed)]
      do k = 1, size(tests)
         if (tests(k)%kind /= test_curvature) cycle
         if (any([(is_closed(tests(i)) .and. any(tests(i)%beside == tests(k)%touch), i=1, size(tests))])) &
            & tests(k)%value = max(tests(k)%value, 0.0_wp)
      end do

   contains

      !> True for a gap, and for a curvature: what counts of that hangs on the gap beside it.
      pure logical function needs_gaps(which)
         integer, intent(in) :: which
         needs_gaps = which > 0 .and. which <= size(gaps)
         if (which > size(gaps) .and. which <= size(gaps) + size(points)) needs_gaps = &
            & points(which - size(gaps))%kind == test_curvature
      end function needs_gaps

      !> True for a free span with next to no gap, as where it has just opened: what curvature there is at its ends is what an
      !> iteration leaves.
      pure logical function is_closed(test)
         type(span_test_t), intent(in) :: test
         is_closed = test%kind == test_vanishing .and. abs(test%value) * problem%size <= rounding_gap(problem)
      end function is_closed
   end function run_span_tests
   !> Free spans: are they outside, and is there anything of them left?
   function gap_tests(problem, state, points, valued) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: points(:) !! tests of these
      logical, intent(in) :: valued              !! false: gaps are not looked at, values are 0
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t) :: test
      type(free_span_t), allocatable :: span(:)
      logical, dimension(problem%model%mesh%n_nodes) :: touched, fails
      real(wp) :: largest
      integer :: k, i
      allocate (tests(0))
      touched = .false.
      touched(pack(problem%candidates%node, problem%candidates%touch > 0)) = .true.
      span = free_spans(problem)
      do k = 1, size(problem%deck%contact)
         if (.not. problem%deck%contact(k)%spans) cycle
         fails = failing(k)
         do i = 1, size(span)
            if (.not. problem%covered(span(i)%stretch, k)) cycle
            test = span_test_t(kind=test_gap, contact=k, stretch=span(i)%stretch)
            largest = 0.0_wp
            if (valued) call least_gap(problem, state, span(i)%element, k, touched, fails, test%value, test%at, largest)
            test%value = test%value / problem%size
            tests = [tests, test]
            test%beside = merge(span(i)%touch, 0, span(i)%contact == k)
            if (all(test%beside == 0)) cycle
            test%kind = test_vanishing
            test%value = largest / problem%size
            test%ends = span_ends(problem, state, span(i))
            ! A gap of the sixth power of its length is gone long before a span between two contacts is.
            if (abs(largest) <= rounding_gap(problem)) test%value = rounding_gap(problem) / problem%size * &
               & ((test%ends(2) - test%ends(1)) / problem%layout%stretch(test%stretch)%length - shortest)
            tests = [tests, test]
         end do
      end do

   contains

      !> Nodes whose touch is no longer right.
      function failing(contact) result(fails)
         integer, intent(in) :: contact
         logical :: fails(problem%model%mesh%n_nodes)
         integer :: k
         fails = .false.
         do k = 1, size(points)
            if (problem%candidates%contact(points(k)%candidate) == contact .and. points(k)%value < &
               & -well_below * test_slack(points(k)%kind)) fails(problem%candidates%node(points(k)%candidate)) = .true.
         end do
      end function failing
   end function gap_tests

   !> Lines that shrink to points, free spans that close between a contact and an end of its stretch.
   function length_tests(problem, state) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t) :: test
      type(contact_span_t), allocatable :: now(:)
      type(free_span_t), allocatable :: span(:)
      integer :: k, side
      allocate (tests(0))
      now = present_contact_spans(problem, state)
      do k = 1, size(now)
         if (now(k)%line) call add(span_test_t(kind=test_length, touch=k, stretch=now(k)%stretch, at=0.5_wp * sum(now(k)%at)), &
            & now(k)%at)
      end do
      span = free_spans(problem)
      do k = 1, size(span)
         side = findloc(span(k)%touch > 0, .true., 1)
         if (count(span(k)%touch > 0) == 1) call add(span_test_t(kind=test_crossing, touch=span(k)%touch(side), &
            & stretch=span(k)%stretch, sense=merge(1.0_wp, -1.0_wp, side == 1)), span_ends(problem, state, span(k)))
      end do

   contains

      subroutine add(new, ends)
         type(span_test_t), intent(in) :: new
         real(wp), intent(in) :: ends(2)
         test = new
         test%value = (ends(2) - ends(1) - shortest * problem%layout%stretch(test%stretch)%length) / problem%size
         tests = [tests, test]
      end subroutine add
   end function length_tests

   !> Lines: are they pushed all along?
   function pressure_tests(problem, state, scale, valued) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! of forces
      logical, intent(in) :: valued         !! false: pressures are not looked at, values are 0
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t) :: test
      type(contact_span_t), allocatable :: now(:)
      integer :: k, side
      allocate (tests(0))
      now = present_contact_spans(problem, state)
      do k = 1, size(problem%touch)
         if (.not. problem%touch(k)%line) cycle
         test = span_test_t(kind=test_pressure, touch=k)
         side = 0
         test%value = 0.0_wp
         if (valued) call least_pressure(problem, state, now(k), test%value, test%at, side)
         test%value = max(test%value, -scale / problem%size) * problem%size / scale
         test%sense = real(side, wp)
         tests = [tests, test]
      end do
   end function pressure_tests

   !> True for a converged state whose contact spans are the right ones.
   logical function spans_hold(problem, state, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale              !! of forces
      spans_hold = .not. any_fails(run_span_tests(problem, state, max(scale, tiny(scale))))
   end function spans_hold
end module span_tests
