!> Rule for an osculating contact, that is, a point contact with the curvature of its obstacle:
!>
!>   loads along the rod and on the point press           a line                                  lay_down_points
!>   a force lifts the point at a symmetry plane          a line behind the lifted length         lay_down_behind
!>   else                                                 two points, or one beside a support     divide_point
!>
!> A contact that spreads from a clamp on the obstacle is reported as gained (C+), a contact that divides as lost (C-). Other
!> osculating contacts at the same point of the path change in the same way. If no equilibrium is found, the rule is evaluated again
!> (answer_trials): with more points that become lines (`more`), or with a larger distance of the two points (`apart`).
module flat_point_rule
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t, line_share, first_length
   use contact_set_edits, only: spread_out, parted
   use line_pressure, only: virtual_pressure
   use lifted_node, only: lifted_at_mirror
   use passages, only: behind
   use test_kinds, only: span_test_t, test_curvature, test_force, test_slack
   use point_tests, only: rests_beside
   use conforming_span, only: flat_excess, excess_curvature
   use touchdown_points, only: point_force
   use breakpoint_forces, only: stands, breakpoint_force
   use rolling_rods, only: nearly_flat
   use span_answer, only: answer_t, segment_length
   implicit none
   private
   public :: answer_flat_point, would_press

contains

   !> Determines the next contact set after a zero of the curvature test of a point contact.
   subroutine answer_flat_point(problem, state, tests, which, fall, answer, more, apart)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: tests(:)    !! tests of this state
      integer, intent(in) :: which                 !! index of the curvature test that is zero
      real(wp), intent(in) :: fall(:)              !! (tests) decrease of each along the path
      type(answer_t), intent(inout) :: answer      !! in: with the contact spans of the state
      integer, intent(in), optional :: more        !! number of further points that become lines, those with the nearest zeros
      real(wp), intent(in), optional :: apart  !! initial distance of the points of a divided contact / length of rod segment
      real(wp) :: share, lifted
      logical :: pressed, too(problem%candidates%n)
      integer :: c
      too = .false.
      if (present(more)) too = flat_next(problem, tests, which, fall, more)
      associate (test => tests(which))
         ! Zero pressure counts as pressed: a uniform straight rod at a straight wall has no contact pressure.
         pressed = would_press(problem, state, test%candidate, test%sense)
         lifted = pulled_off(problem, state, test%candidate, test%sense)
         if (pressed) then
            call lay_down_points(problem, state, test, too, answer)
         else if (lifted > 0.0_wp .and. lifted <= first_length * segment_length(problem, &
            & answer%contact_span(test%contact_span))) then
            call lay_down_behind(problem, state, test, lifted, answer)
         else
            share = first_length
            if (present(apart)) share = apart
            call divide_point(problem, state, test, share, answer)
            ! At the end of a rod only one point contact results.
            answer%divides = all(problem%beside(:, problem%candidates%node(test%candidate)) > 0)
            if (answer%divides) answer%label = 'C-'
         end if
         if (any([(stands(problem, state, c) .and. any(flat_sides(problem, state, c, test, pressed)), c=1, &
            & problem%candidates%n)])) then
            ! The contact starts to spread from a clamp that lies on the obstacle: contact is gained.
            answer%label = 'C+'
            answer%divides = .false.
         end if
      end associate
   end subroutine answer_flat_point

   !> Replaces the point of the test, and others that become lines at the same point of the path, by line contacts. The ends of a
   !> line contact have contact forces, so Newton's method finds their positions from any nearby positions.
   subroutine lay_down_points(problem, state, test, too, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      logical, intent(in) :: too(:)                !! (candidates) others that become lines
      type(answer_t), intent(inout) :: answer
      integer :: c, point, beside(2)
      real(wp) :: whole
      logical :: flat(2)
      do c = 1, problem%candidates%n
         flat = flat_sides(problem, state, c, test, .true.)
         if (too(c)) flat = would_press(problem, state, c, 0.0_wp)
         if (.not. any(flat)) cycle
         if (problem%candidates%moves(c)) then
            point = problem%candidates%contact_span(c)
            beside = point
            whole = segment_length(problem, answer%contact_span(point))
            answer%contact_span = spread_out(answer%contact_span, point, 0.5_wp * line_share * whole, [0.0_wp, whole])
         else
            call go_beside(problem, c, flat, line_share, .true., answer, beside)
         end if
         if (c == test%candidate) answer%between = beside(merge(1, 2, beside(1) > 0 .and. test%sense <= 0.0_wp))
      end do
   end subroutine lay_down_points

   !> Replaces a point contact on a symmetry plane, which a force lifts while the rod beside the point is pressed, by a line contact
   !> that begins behind the lifted length.
   subroutine lay_down_behind(problem, state, test, lifted, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: lifted               !! length that the force lifts off
      type(answer_t), intent(inout) :: answer
      integer :: beside(2), side
      associate (c => test%candidate)
         call go_beside(problem, c, flat_sides(problem, state, c, test, .false.), first_length, .true., answer, beside)
      end associate
      do side = 1, 2
         if (beside(side) == 0) cycle
         answer%between = beside(side)
         answer%contact_span(beside(side))%at = answer%contact_span(beside(side))%at + merge(-lifted, lifted, side == 1)
      end do
   end subroutine lay_down_behind

   !> Divides a point contact into two; on a symmetry plane, or if a support fixes the rotation, into one point on each osculating
   !> side.
   subroutine divide_point(problem, state, test, share, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: share                !! distance of the two points as a share of the rod segment
      type(answer_t), intent(inout) :: answer
      associate (c => test%candidate, k => test%contact_span)
         if (problem%candidates%moves(c)) then
            answer%contact_span = parted(answer%contact_span, k, share * segment_length(problem, answer%contact_span(k)))
            answer%between = [k, size(answer%contact_span)]
         else
            call go_beside(problem, c, flat_sides(problem, state, c, test, .false.), 0.5_wp * share, .false., answer, &
               & answer%between)
         end if
      end associate
   end subroutine divide_point

   !> Replaces a point contact at a segment boundary by contact spans beside the boundary, on the sides `goes`. Beside a clamp the
   !> point contact remains as well if the rod on the other side rests on the clamp.
   subroutine go_beside(problem, c, goes, share, line, answer, beside)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c                     !! candidate
      logical, intent(in) :: goes(2)               !! sides of the boundary on which contact continues: before, after
      real(wp), intent(in) :: share                !! share of the longest rod segment: length of a line, or distance of a point
      logical, intent(in) :: line
      type(answer_t), intent(inout) :: answer
      integer, intent(out) :: beside(2)            !! contact spans before and after the boundary, 0: none
      type(contact_span_t) :: contact_span
      integer :: side, rod_segment(2), k
      real(wp) :: length
      logical :: stays
      rod_segment = 0
      length = 0.0_wp
      do side = 1, 2
         if (problem%candidates%element(side, c) == 0) cycle
         rod_segment(side) = problem%rod_segment(problem%candidates%element(side, c))
         if (goes(side)) length = max(length, share * problem%layout%rod_segment(rod_segment(side))%length)
      end do
      k = problem%candidates%contact_span(c)
      stays = answer%contact_span(k)%line .or. .not. line .and. any(rod_segment > 0 .and. .not. goes)
      beside = 0
      do side = 1, 2
         if (.not. goes(side)) cycle
         contact_span = contact_span_t(contact=answer%contact_span(k)%contact, rod_segment=rod_segment(side), line=line, &
            & at=behind(problem, rod_segment(side), 2 * side - 3, length, line))
         if (stays .or. any(beside > 0)) then
            answer%contact_span = [answer%contact_span, contact_span]
            beside(side) = size(answer%contact_span)
         else
            contact_span%number = answer%contact_span(k)%number
            answer%contact_span(k) = contact_span
            beside(side) = k
         end if
      end do
   end subroutine go_beside

   !> (sides before, after) true: an osculating contact at the node changes its kind on this side. Besides the test's node these are
   !> nodes that are osculating at the same point of the path and would also be pressed (or pulled): if they were left unchanged,
   !> their positions would be in neutral equilibrium.
   function flat_sides(problem, state, c, test, pressed) result(flat)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      type(span_test_t), intent(in) :: test
      logical, intent(in) :: pressed
      logical :: flat(2)
      real(wp) :: excess, extension, sense
      integer :: side
      flat = .false.
      if (problem%candidates%contact_span(c) == 0) return
      associate (clamped => problem%model%fixed(3, problem%candidates%node(c)), moves => problem%candidates%moves(c))
         if (c == test%candidate .and. .not. clamped) then
            flat = moves .or. problem%candidates%element(:, c) > 0
         else if (clamped .or. moves .and. .not. problem%contact_span(problem%candidates%contact_span(c))%line) then
            do side = 1, 2
               if (.not. (moves .or. rests_beside(problem, c, side))) cycle
               sense = merge(0.0_wp, real(2 * side - 3, wp), moves)
               flat(side) = c == test%candidate .and. test%sense * sense > 0.0_wp
               if (flat(side)) cycle
               call excess_curvature(problem, state, c, excess, extension, side)
               ! The relative curvature of the located point is accurate to flat_excess, that of others to a few times this value.
               flat(side) = excess * problem%size <= 10.0_wp * flat_excess
               if (problem%candidates%node(c) == problem%rolling) flat(side) = excess * problem%size <= nearly_flat(problem)
               if (flat(side)) flat(side) = would_press(problem, state, c, sense) .eqv. pressed
            end do
            ! At a rolling point both sides have the same curvature up to errors of second order in the curvatures.
            if (problem%candidates%node(c) == problem%rolling) flat = any(flat)
         end if
      end associate
   end function flat_sides

   !> Other free point contacts with decreasing relative curvature, those with the nearest zeros by linear extrapolation.
   pure function flat_next(problem, tests, which, fall, more) result(next)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which                 !! index of the osculating point's test
      real(wp), intent(in) :: fall(:)              !! (tests) decrease of each along the path
      integer, intent(in) :: more                  !! largest number of points
      logical :: next(problem%candidates%n)
      logical :: comes(size(tests))
      integer :: k
      next = .false.
      comes = .false.
      do k = 1, size(tests)
         if (tests(k)%kind /= test_curvature .or. k == which .or. .not. fall(k) > 0.0_wp) cycle
         comes(k) = problem%candidates%moves(tests(k)%candidate) .and. .not. problem%contact_span(tests(k)%contact_span)%line
      end do
      do while (count(next) < more .and. any(comes))
         k = minloc(tests%value / merge(fall, 1.0_wp, comes), 1, comes)
         comes(k) = .false.
         next(tests(k)%candidate) = .true.
      end do
   end function flat_next

   !> True if a line contact that begins at an osculating contact would be pressed by the loads along the rod and, at a segment
   !> boundary, by the loads on the boundary's node.
   logical function would_press(problem, state, c, sense)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      real(wp), intent(in) :: sense  !! side of a support that fixes the rotation: before (-1), after (1); 0: no such support
      !! (span_test_t)
      real(wp) :: lifted
      would_press = density_beside(problem, state, c, sense) >= 0.0_wp
      if (.not. would_press) return
      ! A tensile force may lift no more than the length that counts as zero.
      lifted = pulled_off(problem, state, c, sense)
      would_press = lifted <= &
         & line_share * problem%layout%rod_segment(problem%contact_span(problem%candidates%contact_span(c))%rod_segment)%length
   end function would_press

   !> Density of the obstacle's force beside a point contact; positive in compression.
   real(wp) function density_beside(problem, state, c, sense) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      real(wp), intent(in) :: sense  !! side of a support that fixes the rotation: before (-1), after (1); 0: no such support
      !! (span_test_t)
      if (abs(sense) > 0.0_wp) then
         density = virtual_pressure(problem, state, c, merge(1, 2, sense < 0.0_wp))
      else
         density = virtual_pressure(problem, state, c)
      end if
   end function density_beside

   !> Length that the load on a contact node at a segment boundary would lift off beside the node if there were a line contact; huge
   !> if no line contact is possible, 0 without a lifting load.
   real(wp) function pulled_off(problem, state, c, sense) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      real(wp), intent(in) :: sense  !! side of a support that fixes the rotation: before (-1), after (1); 0: no such support
      !! (span_test_t)
      real(wp) :: force, jump
      length = 0.0_wp
      if (problem%candidates%moves(c) .or. stands(problem, state, c)) return
      force = breakpoint_force(problem, state, c)
      jump = point_force(problem, state, c)
      ! The obstacle's force in excess of the rod's comes from an external load, which presses.
      if (jump - force <= test_slack(test_force) * abs(force)) return
      length = huge(length)
      if (.not. problem%model%fixed(3, problem%candidates%node(c))) return
      length = lifted_at_mirror(jump - force, density_beside(problem, state, c, sense))
   end function pulled_off
end module flat_point_rule
