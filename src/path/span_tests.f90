!> What must hold for a set of contact spans to be the right one: test functions, smooth along a path on which the set stays,
!> positive while it holds. Their zeros are where contact begins, ends, spreads or splits.
!>
!>   state -> tests -> the first that vanishes on an increment (span_events) -> where (span_location, vanishing_span, span_beyond)
!>   -> recorded (span_changes) -> the next set (span_rules, touch_edits) -> its mesh (span_mesh) -> the way on (span_set,
!>   span_arrival)
module span_tests
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, candidate_gap, may_react, parallel
   use free_span, only: free_span_t, free_spans, span_ends
   use free_span_gap, only: least_gap
   use line_pressure, only: least_pressure
   use conforming_span, only: conforming_forces, rolled_t, rolled, excess_curvature, node_track, track_sense, track_rotation
   use touchdown_points, only: point_force
   use breakpoint_forces, only: held_force, held_couple, at_breakpoint, left_over
   use lifted_node, only: inside_line, lifted_beside, lifted_at_mirror, stays_down
   use contact_touch, only: touch_t, shortest, line_share
   use touch_candidates, only: present_touches
   implicit none
   private
   public :: span_test_t, run_span_tests, rests_beside, spans_hold, any_fails, another_fails, test_slack, well_below, &
      & test_words
   public :: test_gap, test_force, test_curvature, test_pressure, test_length, test_flat, test_crossing, test_slope, test_leaving, &
      & test_couple
   public :: shortest, line_share

   ! What is tested.
   integer, parameter :: test_gap = 1       !! least gap of a free span
   integer, parameter :: test_force = 2     !! concentrated force of a point, or of a line at a breakpoint
   integer, parameter :: test_curvature = 3 !! of a point contact against the obstacle's
   integer, parameter :: test_pressure = 4  !! least density along a line
   integer, parameter :: test_length = 5    !! of a line
   integer, parameter :: test_flat = 6      !! largest gap of a free span beside a contact; where that is gone, the span's length
   integer, parameter :: test_crossing = 7  !! length of a free span between a contact and a breakpoint of the rod
   integer, parameter :: test_slope = 8     !! of the gap inwards from an end of a rod, or a corner, that touches
   integer, parameter :: test_leaving = 9   !! how far from a breakpoint of the rod a point that is held there belongs
   integer, parameter :: test_couple = 10   !! that would have to hold a line's node at a breakpoint of the rod: minus its size

   !> What its zero means.
   character(*), parameter :: test_words(10) = [character(40) :: 'contact begins', 'contact ends', 'a contact point spreads', &
      & 'contact opens inside', 'a contact line shrinks to a point', 'a free span lies down', &
      & 'contact comes to a breakpoint of the rod', 'an end of a rod lies down', &
      & 'contact leaves a breakpoint of the rod', 'a couple lifts a line']

   !> What a test may fall below zero by before it is taken for violated: what the dense output errs by.
   real(wp), parameter :: test_slack(10) = [1.0e-9_wp, 1.0e-9_wp, 1.0e-9_wp, 1.0e-6_wp, 0.0_wp, 1.0e-9_wp, 0.0_wp, 1.0e-9_wp, &
      & 0.0_wp, 1.0e-9_wp]

   real(wp), parameter :: parallel_enough = sqrt(epsilon(1.0_wp)) !! [rad] what a support keeps is that as good as rounding
   real(wp), parameter :: well_below = 10.0_wp !! slacks, at a place where a test is zero

   type :: span_test_t
      integer :: kind = 0
      real(wp) :: value = 0.0_wp            !! over its own scale: lengths, forces and curvatures of the structure
      integer :: touch = 0                  !! index into problem%touch; 0: none yet
      integer :: candidate = 0              !! force, curvature, slope: which node
      integer :: contact = 0                !! gap, flat: index into model%contact
      integer :: stretch = 0
      integer :: beside(2) = 0              !! flat: the touches before and after it; 0: none of this contact
      real(wp) :: ends(2) = 0.0_wp          !! flat: of the span along the stretch
      real(wp) :: at = 0.0_wp               !! gap, pressure: where along the stretch
      real(wp) :: sense = 1.0_wp            !! pressure: at the first end (-1), inside (0), at the last (1); crossing: before
      !! the touch, after it; slope: likewise; leaving: which way; curvature: on which side of a support that holds the rotation, 0:
      !! the rod turns there
   end type span_test_t

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
      points = point_tests(problem, state, scale)
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
         is_closed = test%kind == test_flat .and. abs(test%value) * problem%size <= rounding_gap(problem)
      end function is_closed
   end function run_span_tests

   !> Points, and ends of lines at breakpoints: are they pushed, are points less curved than the obstacle?
   function point_tests(problem, state, scale) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! of forces
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t) :: test
      integer :: c, side
      allocate (tests(0))
      do c = 1, problem%candidates%n
         if (problem%candidates%touch(c) == 0) cycle
         test = span_test_t(touch=problem%candidates%touch(c), candidate=c)
         associate (node => problem%candidates%node(c), moves => problem%candidates%moves(c))
            if (moves .or. at_breakpoint(problem, c)) then
               test%kind = test_force
               test%value = push(c)
               tests = [tests, test]
            end if
            if (problem%model%fixed(3, node)) then
               do side = 1, 2
                  if (.not. rests_beside(problem, c, side)) cycle
                  ! Where it leaves the obstacle at an angle that the support keeps no curvature brings it back.
                  if (rise(side) <= parallel_enough) tests = [tests, curvature(side)]
               end do
            end if
            if (problem%touch(test%touch)%line) then
               if (moves .or. .not. at_breakpoint(problem, c)) cycle
               test%kind = test_couple
               test%value = -turned(c)
               tests = [tests, test]
            else if (problem%candidates%rolls(c)) then
               tests = [tests, curvature()]
               if (.not. moves) tests = [tests, leaving(c)]
            else if (.not. problem%model%fixed(3, node)) then
               ! An end of a rod, or a corner: what lies beside it must rise from the obstacle.
               do side = 1, 2
                  if (problem%candidates%element(side, c) == 0) cycle
                  test%kind = test_slope
                  test%sense = merge(1.0_wp, -1.0_wp, side == 2)
                  test%value = rise(side)
                  tests = [tests, test]
               end do
            end if
         end associate
      end do

   contains

      !> Slope of the gap from a touched node on.
      real(wp) function rise(side)
         integer, intent(in) :: side
         rise = merge(1.0_wp, -1.0_wp, side == 2) * track_rotation(problem, state, c, side) * &
            & track_sense(problem, state, c, node_track(problem, state, c), side)
      end function rise

      !> Of a point, or beside a support that takes the moment.
      type(span_test_t) function curvature(side)
         integer, intent(in), optional :: side
         real(wp) :: stretch
         curvature = test
         curvature%kind = test_curvature
         curvature%sense = 0.0_wp
         if (present(side)) curvature%sense = real(2 * side - 3, wp)
         call excess_curvature(problem, state, c, curvature%value, stretch, side)
         curvature%value = curvature%value * problem%size
      end function curvature

      !> The force of a point goes along the rod as that turns: how far, against what is taken for none.
      type(span_test_t) function leaving(c)
         integer, intent(in) :: c
         type(rolled_t) :: roll
         real(wp) :: reach
         integer :: side
         leaving = span_test_t(kind=test_leaving, touch=problem%candidates%touch(c), candidate=c)
         roll = rolled(problem, state, c)
         leaving%sense = sign(1.0_wp, roll%way)
         side = merge(2, 1, roll%way > 0.0_wp)
         reach = line_share * problem%layout%stretch(problem%stretch(problem%candidates%element(side, c)))%length
         leaving%value = (reach - abs(roll%way)) / problem%size
      end function leaving

      !> Couple on a line's node over scale and size: none where it is left over, or lifts as little as is taken for none.
      real(wp) function turned(c)
         integer, intent(in) :: c
         integer :: side, e
         real(wp) :: length(2)
         turned = abs(held_couple(problem, state, c)) / (scale * problem%size)
         if (turned <= left_over(problem)) turned = 0.0_wp
         if (.not. turned > 0.0_wp) return
         if (.not. inside_line(problem, c)) then
            if (ends_down(c)) turned = 0.0_wp
            return
         end if
         length = lifted_beside(problem, state, c)
         do side = 1, 2
            e = problem%beside(side, problem%candidates%node(c))
            if (length(side) <= line_share * problem%layout%stretch(problem%stretch(e))%length) turned = 0.0_wp
         end do
      end function turned

      !> True for the node at a line's end that a couple lifts by as little as is taken for none.
      logical function ends_down(c)
         integer, intent(in) :: c
         real(wp) :: density
         integer :: e
         call look_at_end(c, e, density)
         ends_down = e > 0
         if (ends_down) ends_down = stays_down(problem, e, held_couple(problem, state, c), density)
      end function ends_down

      !> True for a line's node on a mirror that a force lifts by as little as is taken for none.
      logical function lifts_little(c, push)
         integer, intent(in) :: c
         real(wp), intent(in) :: push          !! over the scale
         real(wp) :: density
         integer :: e
         lifts_little = push < 0.0_wp .and. problem%model%fixed(3, problem%candidates%node(c))
         if (.not. lifts_little) return
         call look_at_end(c, e, density)
         lifts_little = e > 0
         if (lifts_little) lifts_little = lifted_at_mirror(-push * scale, density) <= line_share * &
            & problem%layout%stretch(problem%stretch(e))%length
      end function lifts_little

      !> The element of a line that ends at a node where its rod does, and the density of the obstacle's force there.
      subroutine look_at_end(c, e, density)
         integer, intent(in) :: c
         integer, intent(out) :: e             !! 0: there is none
         real(wp), intent(out) :: density
         real(wp) :: local(3), place(2), angle
         integer :: side
         density = 0.0_wp
         e = 0
         if (count(problem%candidates%element(:, c) > 0) /= 1) return
         side = findloc(problem%candidates%element(:, c) > 0, .true., 1)
         if (problem%conforms(problem%candidates%element(side, c)) == 0) return
         e = problem%candidates%element(side, c)
         call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local, place, angle, density)
      end subroutine look_at_end

      !> Concentrated force over the scale.
      real(wp) function push(c)
         integer, intent(in) :: c
         real(wp) :: lift, normal(2), bend
         type(rolled_t) :: roll
         if (problem%candidates%moves(c)) then
            push = point_force(problem, state, c) / scale
            return
         end if
         push = held_force(problem, state, c) / scale
         ! Where a line goes on nothing is held, and what is left is what equilibrium leaves. A point's force has its zero there.
         if (problem%touch(problem%candidates%touch(c))%line .and. (abs(push) <= left_over(problem) .or. lifts_little(c, push))) &
            & push = 0.0_wp
         ! A support that leaves takes the node along, and so does another obstacle.
         if (closes_gap(problem, state, c)) return
         call candidate_gap(problem, state, c, lift, normal, bend)
         roll = rolled(problem, state, c)
         if (lift - roll%rise > rounding_gap(problem)) push = -lift / problem%size
      end function push
   end function point_tests

   !> True for a side of a touched breakpoint on which the rod leaves the obstacle at once.
   pure logical function rests_beside(problem, c, side)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c              !! candidate
      integer, intent(in) :: side           !! 1: before it, 2: after it
      associate (e => problem%candidates%element(side, c))
         rests_beside = e > 0
         if (rests_beside) rests_beside = problem%conforms(e) == 0
      end associate
   end function rests_beside

   !> True for a touch that holds its node. Where that is a support says, or what acts before it on the same node and in the
   !> same way; see eliminated_unknowns.
   pure logical function closes_gap(problem, state, c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp) :: normal(2), other(2), gap, bend
      integer :: k
      call candidate_gap(problem, state, c, gap, normal, bend)
      closes_gap = may_react(problem, c, normal)
      do k = 1, c - 1
         if (problem%candidates%node(k) /= problem%candidates%node(c) .or. .not. state%active(k)) cycle
         call candidate_gap(problem, state, k, gap, other, bend)
         if (.not. may_react(problem, k, other)) cycle
         if (any(problem%model%fixed(1:2, problem%candidates%node(c))) .or. &
            & abs(normal(1) * other(2) - normal(2) * other(1)) < parallel) closes_gap = .false.
      end do
   end function closes_gap

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
            test%kind = test_flat
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
      type(touch_t), allocatable :: now(:)
      type(free_span_t), allocatable :: span(:)
      integer :: k, side
      allocate (tests(0))
      now = present_touches(problem, state)
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
      type(touch_t), allocatable :: now(:)
      integer :: k, side
      allocate (tests(0))
      now = present_touches(problem, state)
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

   !> True where some test is below zero by more than it errs by.
   pure logical function any_fails(tests)
      type(span_test_t), intent(in) :: tests(:)
      any_fails = .not. all(tests%value >= -test_slack(tests%kind))
   end function any_fails

   !> True where a test other than the one that is zero is well below.
   pure logical function another_fails(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which               !! index of the one that is
      integer :: k
      another_fails = any(tests%value < -well_below * test_slack(tests%kind) .and. [(k, k=1, size(tests))] /= which)
   end function another_fails
end module span_tests
