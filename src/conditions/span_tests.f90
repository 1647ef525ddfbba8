!> Tests whether a set of contact spans is the right one. The test functions are smooth along the path while the set is unchanged,
!> and >= 0 while the set is valid. Where a test function is zero, contact begins, ends, spreads or splits. The header of module
!> span_changes lists the steps with which the program passes a change of contact; the first step evaluates these tests.
module span_tests
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use free_span_gap, only: least_gap, gap_minimum_t
   use rod_profile, only: profile_t
   use line_pressure, only: least_pressure
   use contact_spans, only: contact_span_t, closed_share, point_share, initial_share
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, any_fails, test_slack, well_below, test_gap, test_curvature, test_pressure, test_length, &
      & test_vanishing, test_boundary_span
   use point_tests, only: tests_of_points
   implicit none
   private
   public :: run_span_tests, gaps_as_low, spans_hold, least_length

   !> A part of a rod segment without contact.
   type :: free_span_t
      integer :: rod_segment = 0
      integer :: element(2) = 0             !! first and last element
      integer :: contact_span(2) = 0 !! contact spans before and after the free span, indices into problem%contact_span; 0: none. If
      !! the free span ends at a segment boundary, the contact span that begins there in the next segment is stored. But both
      !! entries are 0 for a free span that fills its whole segment
      integer :: contact(2) = 0             !! contacts to which the two contact spans belong, indices into model%contact; 0: none
   end type free_span_t

contains

   !> All tests of a converged state, in the same order for all states of one problem.
   function run_span_tests(problem, state, scale, only) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! scale of forces, see system_t
      integer, intent(in), optional :: only !! index of the only test whose value is needed; 0: only tests of contact nodes and
      !! lengths are needed. Gaps and pressures that are not needed are then not evaluated and have the value 0
      type(span_test_t), allocatable :: tests(:), points(:), gaps(:), lengths(:)
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
         if (any([(is_closed(tests(i)) .and. any(tests(i)%beside == tests(k)%contact_span), i=1, size(tests))])) &
            & tests(k)%value = max(tests(k)%value, 0.0_wp)
      end do

   contains

      !> True if the value of a test depends on the gaps of free spans: a gap test, or a curvature test, which counts as passed if
      !> the free span beside the contact is closed (is_closed).
      pure logical function needs_gaps(which)
         integer, intent(in) :: which
         needs_gaps = which > 0 .and. which <= size(gaps)
         if (which > size(gaps) .and. which <= size(gaps) + size(points)) needs_gaps = &
            & points(which - size(gaps))%kind == test_curvature
      end function needs_gaps

      !> True if the gap of a free span is below rounding, for example just after the span has opened. The relative curvatures at
      !> the ends of the span are then residuals of the iteration.
      pure logical function is_closed(test)
         type(span_test_t), intent(in) :: test
         is_closed = test%kind == test_vanishing .and. abs(test%value) * problem%size <= rounding_gap(problem)
      end function is_closed
   end function run_span_tests

   !> Tests of gaps: the least gap of each free span, the least gap between each line contact and other obstacles, and the largest
   !> gap of each free span beside a contact span with the same obstacle (the free span closes where this gap is zero).
   function gap_tests(problem, state, points, valued) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: points(:) !! tests of contact nodes
      logical, intent(in) :: valued              !! true: the gaps are evaluated; false: the values are 0
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t) :: test
      type(free_span_t), allocatable :: span(:)
      type(profile_t), allocatable :: profile(:)
      logical, dimension(problem%model%mesh%n_nodes) :: touched, fails
      real(wp) :: largest
      integer :: k, i
      allocate (tests(0), profile(merge(problem%model%mesh%n_elements, 0, valued)))
      touched = touched_nodes(problem)
      span = free_spans(problem)
      do k = 1, size(problem%deck%contact)
         if (.not. problem%deck%contact(k)%spans) cycle
         fails = failing_nodes(problem, points, k)
         do i = 1, size(span)
            if (.not. problem%covered(span(i)%rod_segment, k)) cycle
            call add_gap(span(i)%rod_segment, span(i)%element)
            test%beside = merge(span(i)%contact_span, 0, span(i)%contact == k)
            if (all(test%beside == 0)) cycle
            ! A contact span of the next segment at the boundary counts only if a contact span of this segment, of the same contact,
            ! is at the other end of the free span.
            if (.not. any(test%beside > 0 .and. problem%contact_span(max(test%beside, 1))%rod_segment == span(i)%rod_segment)) cycle
            test%kind = test_vanishing
            test%error = 0.0_wp
            test%value = largest / problem%size
            test%ends = span_ends(problem, state, span(i))
            ! The gap is proportional to the sixth power of the free span's length. It is therefore below rounding when the length
            ! is still large; the test value is then computed from the length.
            if (abs(largest) <= rounding_gap(problem)) test%value = rounding_gap(problem) / problem%size * &
               & ((test%ends(2) - test%ends(1)) / problem%layout%rod_segment(test%rod_segment)%length - closed_share)
            tests = [tests, test]
         end do
         ! A part of a rod in line contact with one obstacle may also touch another obstacle.
         do i = 1, size(problem%contact_span)
            associate (line => problem%contact_span(i))
               if (.not. line%line .or. line%contact == k .or. .not. problem%covered(line%rod_segment, k)) cycle
               call add_gap(line%rod_segment, line%element)
            end associate
         end do
      end do

   contains

      !> Adds the test of the least gap between some elements and the obstacle of contact k, and sets `largest`.
      subroutine add_gap(rod_segment, element)
         integer, intent(in) :: rod_segment, element(2)   ! rod segment; first and last element
         test = span_test_t(kind=test_gap, contact=k, rod_segment=rod_segment, element=element)
         largest = 0.0_wp
         if (valued) call least_gap(problem, state, element, k, touched, fails, profile, test%value, test%at, test%error, largest)
         test%value = test%value / problem%size
         test%error = test%error / problem%size
         tests = [tests, test]
      end subroutine add_gap
   end function gap_tests

   !> For a gap test that is zero: tests of the other local minima of the gap in the same free span that are as low, for instance at
   !> mirror images. Contact begins at these minima at the same point of the path.
   function gaps_as_low(problem, state, tests, which) result(others)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: tests(:)  !! all tests of the state
      integer, intent(in) :: which               !! index of the gap test
      type(span_test_t), allocatable :: others(:)
      type(profile_t) :: profile(problem%model%mesh%n_elements)
      type(gap_minimum_t), allocatable :: low(:)
      real(wp) :: least, at, error, largest
      associate (test => tests(which))
         call least_gap(problem, state, test%element, test%contact, touched_nodes(problem), failing_nodes(problem, &
            & pack(tests, tests%candidate > 0), test%contact), profile, least, at, error, largest, &
            & level=problem%size * max(test_slack(test_gap), well_below * abs(test%value)), low=low)
         low = pack(low, abs(low%at - test%at) > initial_share * problem%layout%rod_segment(test%rod_segment)%length)
         allocate (others(size(low)))
         others = test
         others%value = low%gap / problem%size
         others%at = low%at
      end associate
   end function gaps_as_low

   !> (nodes) true: the node touches any obstacle.
   pure function touched_nodes(problem) result(touched)
      type(problem_t), intent(in) :: problem
      logical :: touched(problem%model%mesh%n_nodes)
      touched = .false.
      touched(pack(problem%candidates%node, problem%candidates%contact_span > 0)) = .true.
   end function touched_nodes

   !> (nodes) true: the node is a contact node of the given contact, and a test of this node clearly fails.
   pure function failing_nodes(problem, points, contact) result(fails)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: points(:) !! tests of contact nodes
      integer, intent(in) :: contact             !! index into model%contact
      logical :: fails(problem%model%mesh%n_nodes)
      integer :: k
      fails = .false.
      do k = 1, size(points)
         if (problem%candidates%contact(points(k)%candidate) == contact .and. points(k)%value < &
            & -well_below * test_slack(points(k)%kind)) fails(problem%candidates%node(points(k)%candidate)) = .true.
      end do
   end function failing_nodes

   !> Tests of lengths: of line contacts that shrink to points, and of free spans that close between a contact span and a segment
   !> boundary.
   function length_tests(problem, state) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), allocatable :: tests(:)
      type(contact_span_t), allocatable :: now(:)
      type(free_span_t), allocatable :: span(:)
      integer :: k, side
      allocate (tests(0))
      now = present_contact_spans(problem, state)
      do k = 1, size(now)
         if (now(k)%line) call add(span_test_t(kind=test_length, contact_span=k, rod_segment=now(k)%rod_segment, &
            & at=0.5_wp * sum(now(k)%at)), now(k)%at)
      end do
      span = free_spans(problem)
      do k = 1, size(span)
         side = findloc(span(k)%contact_span > 0, .true., 1)
         if (count(span(k)%contact_span > 0) == 1) call add(span_test_t(kind=test_boundary_span, &
            & contact_span=span(k)%contact_span(side), rod_segment=span(k)%rod_segment, &
            & sense=merge(1.0_wp, -1.0_wp, side == 1)), span_ends(problem, state, span(k)))
      end do

   contains

      !> Adds the test of the length between two coordinates.
      subroutine add(test, ends)
         type(span_test_t), intent(in) :: test
         real(wp), intent(in) :: ends(2)
         tests = [tests, test]
         tests(size(tests))%value = (ends(2) - ends(1) - least_length(problem, test)) / problem%size
      end subroutine add
   end function length_tests

   !> Length at which the test of a length is zero. A shorter line contact with both ends inside a rod segment is a point contact. A
   !> shorter free span, or a shorter line contact at a segment boundary, does not exist.
   pure elemental real(wp) function least_length(problem, test) result(least)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! of kind test_length or test_boundary_span
      logical :: inside
      inside = test%kind == test_length
      if (inside) inside = all(problem%candidates%moves(problem%contact_span(test%contact_span)%candidate))
      least = merge(point_share, closed_share, inside) * problem%layout%rod_segment(test%rod_segment)%length
   end function least_length

   !> Tests of pressures: the least density of the obstacle's force along each line contact.
   function pressure_tests(problem, state, scale, valued) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! scale of forces, see system_t
      logical, intent(in) :: valued         !! true: the pressures are evaluated; false: the values are 0
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t) :: test
      type(contact_span_t), allocatable :: now(:)
      integer :: k, side
      allocate (tests(0))
      now = present_contact_spans(problem, state)
      do k = 1, size(problem%contact_span)
         if (.not. problem%contact_span(k)%line) cycle
         test = span_test_t(kind=test_pressure, contact_span=k)
         side = 0
         if (valued) call least_pressure(problem, state, now(k), test%value, test%at, side)
         test%value = max(test%value, -scale / problem%size) * problem%size / scale
         test%sense = real(side, wp)
         tests = [tests, test]
      end do
   end function pressure_tests

   !> True if a converged state passes all tests, which means that its set of contact spans is the right one.
   logical function spans_hold(problem, state, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale              !! scale of forces, see system_t
      spans_hold = .not. any_fails(run_span_tests(problem, state, max(scale, tiny(scale))))
   end function spans_hold

   !> All free spans in their order along the rod segments; the list is the same for all states of a problem.
   pure function free_spans(problem) result(span)
      type(problem_t), intent(in) :: problem
      type(free_span_t), allocatable :: span(:)
      integer :: j, k, before, first
      allocate (span(0))
      do j = 1, size(problem%layout%rod_segment)
         before = 0
         first = problem%element_first(j)
         do k = 1, size(problem%contact_span)
            if (problem%contact_span(k)%rod_segment /= j) cycle
            call add(problem%contact_span(k)%element(1) - 1, k)
            ! A point contact at the beginning of a line contact with another obstacle leaves no free span between them.
            if (problem%contact_span(k)%element(2) + 1 < first) cycle
            first = problem%contact_span(k)%element(2) + 1
            before = k
         end do
         call add(problem%element_last(j), 0)
      end do

   contains

      !> Contact span at a node, 0: none.
      pure integer function contact_at(node) result(k)
         integer, intent(in) :: node
         integer :: c
         k = 0
         c = findloc(problem%candidates%node == node .and. problem%candidates%contact_span > 0, .true., 1)
         if (c > 0) k = problem%candidates%contact_span(c)
      end function contact_at

      pure subroutine add(last, after)
         integer, intent(in) :: last, after
         ! If a contact span ends at a segment boundary, there is no free span between the contact span and the boundary.
         if (last < first) return
         span = [span, free_span_t(j, [first, last], [before, after])]
         if (before == 0 .and. after > 0) span(size(span))%contact_span(1) = contact_at(problem%model%mesh%node(1, first))
         if (after == 0 .and. before > 0) span(size(span))%contact_span(2) = contact_at(problem%model%mesh%node(2, last))
         associate (new => span(size(span)))
            where (new%contact_span > 0) new%contact = problem%contact_span(max(new%contact_span, 1))%contact
         end associate
      end subroutine add
   end function free_spans

   !> Coordinates, along its rod segment, of the two ends of a free span.
   pure function span_ends(problem, state, span) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(free_span_t), intent(in) :: span
      real(wp) :: at(2)
      integer :: side
      at = [(state%geometry%element(span%element(side))%s(side) + problem%origin(span%element(side)), side=1, 2)]
   end function span_ends
end module span_tests
