!> Which contact set follows where a test of the present one vanishes: one rule a test.
module span_rules
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_touch, only: touch_t, line_share, shortest
   use touch_edits, only: lost, spread_out, parted, moved, continued, numbered
   use line_pressure, only: virtual_pressure
   use lifted_node, only: lifted_at_mirror, stays_down
   use passages, only: pass_breakpoints, is_turned, behind
   use span_test, only: span_test_t, test_words, test_gap, test_force, test_curvature, test_pressure, test_length, &
      & test_crossing, test_slope, test_leaving, test_couple, test_slack
   use point_tests, only: rests_beside
   use conforming_span, only: flat_excess, excess_curvature, node_track, track_sense, rod_angle, ge_end
   use obstacle_track, only: track_t
   use touchdown_points, only: point_force
   use breakpoint_forces, only: stands, held_force
   use held_openings, only: first_length
   use rolling_rods, only: nearly_flat
   use touch_candidates, only: present_touches
   implicit none
   private
   public :: answer_t, answer_to, beginning_together, would_press

   !> What follows, and what is told of it.
   type :: answer_t
      type(touch_t), allocatable :: touch(:)      !! the new set, but for what begins (beginning_together)
      integer :: opens(2) = 0                     !! numbers of the touches between which a span opens, 0: a breakpoint; both the
      !! same: a line, between its own ends
      integer, allocatable :: crosses(:, :)       !! (2, spans) the same of spans behind breakpoints, that which opens last first
      character(2) :: label = '  '                !! contact gained or lost; where it only spreads or shrinks, nothing
      logical :: divides = .false.                !! of the contact that is lost a part stays on both sides
      character(:), allocatable :: why            !! there is no rule: the reason
   end type answer_t

contains

   !> The answer to a test that is zero.
   function answer_to(problem, state, tests, which, fall, last, more, apart) result(answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: tests(:)   !! of this state
      integer, intent(in) :: which                !! the one that is zero
      real(wp), intent(in) :: fall(:)             !! (tests) by how much each falls along the path
      integer, intent(in) :: last                 !! number given last to a touch
      integer, intent(in), optional :: more       !! points that lie down with that of the test, of those that come to it next
      real(wp), intent(in), optional :: apart     !! of the stretch, that the points of a divided one begin with
      type(answer_t) :: answer
      type(span_test_t) :: test
      real(wp) :: share, lifted
      logical :: passed, meets, pressed
      logical :: too(problem%candidates%n)
      integer :: k, c
      test = tests(which)
      too = .false.
      if (present(more)) too = flat_next(problem, tests, which, fall, more)
      answer%touch = present_touches(problem, state)
      allocate (answer%crosses(2, 0))
      select case (test%kind)
      case (test_gap)
         answer%label = 'C+'
      case (test_force)
         if (problem%touch(test%touch)%line) then
            ! Without a force the moments do not tell where the end goes; many nodes do (contact_in_doubt), and what is lost.
            answer%why = 'a line contact lifts off at its end'
         else
            answer%label = 'C-'
            call lose_points(problem, tests, which, fall > 0.0_wp, answer)
         end if
      case (test_curvature)
         ! Against a straight wall a uniform rod lies without pressure.
         pressed = would_press(problem, state, test%candidate, test%sense)
         lifted = pulled_off(problem, state, test%candidate, test%sense)
         if (pressed) then
            call lay_down_points(problem, state, test, too, answer)
         else if (lifted > 0.0_wp .and. lifted <= first_length * stretch_length(problem, answer%touch(test%touch))) then
            call lay_down_behind(problem, state, test, lifted, answer)
         else
            share = first_length
            if (present(apart)) share = apart
            call divide_point(problem, state, test, share, answer)
            ! At the end of a rod one point comes of it.
            answer%divides = all(problem%beside(:, problem%candidates%node(test%candidate)) > 0)
            if (answer%divides) answer%label = 'C-'
         end if
         if (any([(stands(problem, state, c) .and. any(flat_sides(problem, state, c, test, pressed)), c=1, &
            & problem%candidates%n)])) then
            ! Contact begins where a clamp stands.
            answer%label = 'C+'
            answer%divides = .false.
         end if
      case (test_length)
         associate (ends => problem%touch(test%touch)%candidate)
            if (stands(problem, state, ends(1)) .or. stands(problem, state, ends(2))) answer%label = 'C-'
         end associate
         call pass_breakpoints(problem, tests, which, fall, answer%touch, answer%crosses, passed, meets)
         if (.not. passed) call shrink_lines(problem, tests, which, fall, answer)
      case (test_crossing)
         call pass_breakpoints(problem, tests, which, fall, answer%touch, answer%crosses, passed, meets)
         if (meets) then
            ! Located with the set that comes after (vanishing_span).
            answer%why = 'two lines of contact meet at a breakpoint of the rod'
         else if (is_turned(problem, state, test)) then
            answer%why = 'contact comes to a node that a couple turns'
         end if
      case (test_slope)
         call lie_down_from_end(problem, state, test, answer)
      case (test_leaving)
         call leave_breakpoint(problem, test, answer)
      case (test_pressure)
         answer%why = 'a line contact lifts off inside'
      case (test_couple)
         answer%why = 'a couple lifts a line contact'
      case default
         ! Vanishing spans are located with the set that comes after (vanishing_span).
         answer%why = trim(test_words(test%kind))
      end select
      answer%touch = numbered(answer%touch, last)
      answer%opens = numbers(answer%touch, answer%opens)
      do k = 1, size(answer%crosses, 2)
         answer%crosses(:, k) = numbers(answer%touch, answer%crosses(:, k))
      end do
   end function answer_to

   !> The gap of a test, which comes last, and others that are closed at the same place of the path: of two that a mirror makes one
   !> of the other neither is the first.
   pure function beginning_together(problem, tests, which, falling) result(begins)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical, intent(in) :: falling(:)            !! (tests)
      type(span_test_t), allocatable :: begins(:)
      logical :: closed(size(tests))
      integer :: k, i
      begins = [tests(which)]
      closed = tests%kind == test_gap .and. falling .and. at_zero(tests, which)
      closed(which) = .false.
      do k = 1, size(tests)
         if (.not. closed(k)) cycle
         if (any([(one_contact(problem, begins(i), tests(k)), i=1, size(begins))])) cycle
         begins = [tests(k), begins]
      end do
   end function beginning_together

   !> True for gaps on both sides of a breakpoint of the rod that are closed there: it is one and the same place that touches.
   pure logical function one_contact(problem, a, b)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: a, b
      integer :: i, j
      one_contact = .false.
      if (a%contact /= b%contact) return
      associate (first => problem%layout%stretch(a%stretch), second => problem%layout%stretch(b%stretch))
         do i = 1, 2
            do j = 1, 2
               if (first%node(i) /= second%node(j)) cycle
               one_contact = one_contact .or. abs(a%at - merge(0.0_wp, first%length, i == 1)) <= line_share * first%length .and. &
                  & abs(b%at - merge(0.0_wp, second%length, j == 1)) <= line_share * second%length
            end do
         end do
      end associate
   end function one_contact

   !> Tests that are as good as zero where one is. The place is known to that for the one that was looked for, to a few times that
   !> for others.
   pure function at_zero(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical :: at_zero(size(tests))
      at_zero = tests%value <= max(test_slack(tests%kind), 10.0_wp * abs(tests(which)%value))
   end function at_zero

   !> The point of a test, and others whose forces vanish at the same place of the path: of two that a mirror makes one of the other
   !> neither is the first.
   subroutine lose_points(problem, tests, which, falling, answer)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical, intent(in) :: falling(:)            !! (tests)
      type(answer_t), intent(inout) :: answer
      logical :: gone(size(answer%touch)), zero(size(tests))
      integer :: k
      gone = .false.
      zero = at_zero(tests, which)
      do k = 1, size(tests)
         if (tests(k)%kind /= test_force) cycle
         gone(tests(k)%touch) = k == which .or. .not. problem%touch(tests(k)%touch)%line .and. falling(k) .and. zero(k)
      end do
      answer%touch = pack(answer%touch, .not. gone)
   end subroutine lose_points

   !> The point of a test, and others that lie down at the same place of the path, lines. Their ends have forces, so Newton's method
   !> finds their places from any nearby.
   subroutine lay_down_points(problem, state, test, too, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      logical, intent(in) :: too(:)                !! (candidates) others that do
      type(answer_t), intent(inout) :: answer
      integer :: c, point, beside(2)
      real(wp) :: whole
      logical :: flat(2)
      do c = 1, problem%candidates%n
         flat = flat_sides(problem, state, c, test, .true.)
         if (too(c)) flat = would_press(problem, state, c, 0.0_wp)
         if (.not. any(flat)) cycle
         if (problem%candidates%moves(c)) then
            point = problem%candidates%touch(c)
            beside = point
            whole = stretch_length(problem, answer%touch(point))
            answer%touch = spread_out(answer%touch, point, 0.5_wp * line_share * whole, whole)
         else
            call go_beside(problem, c, flat, line_share, .true., answer, beside)
         end if
         if (c == test%candidate) answer%opens = beside(merge(1, 2, beside(1) > 0 .and. test%sense <= 0.0_wp))
      end do
   end subroutine lay_down_points

   !> A point on a mirror that a force pulls off while what is beside it is pressed: a line that begins behind the lifted part.
   subroutine lay_down_behind(problem, state, test, lifted, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: lifted               !! length
      type(answer_t), intent(inout) :: answer
      integer :: beside(2), side
      associate (c => test%candidate)
         call go_beside(problem, c, flat_sides(problem, state, c, test, .false.), first_length, .true., answer, beside)
      end associate
      do side = 1, 2
         if (beside(side) == 0) cycle
         answer%opens = beside(side)
         answer%touch(beside(side))%at = answer%touch(beside(side))%at + merge(-lifted, lifted, side == 1)
      end do
   end subroutine lay_down_behind

   !> Of the other points that become less curved along the path those that straight lines have as curved as the obstacle first.
   pure function flat_next(problem, tests, which, fall, more) result(next)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which                 !! index of the test of the point that is
      real(wp), intent(in) :: fall(:)              !! (tests)
      integer, intent(in) :: more                  !! so many, if there are
      logical :: next(problem%candidates%n)
      logical :: comes(size(tests))
      integer :: k
      next = .false.
      comes = .false.
      do k = 1, size(tests)
         if (tests(k)%kind /= test_curvature .or. k == which .or. .not. fall(k) > 0.0_wp) cycle
         comes(k) = problem%candidates%moves(tests(k)%candidate) .and. .not. problem%touch(tests(k)%touch)%line
      end do
      do while (count(next) < more .and. any(comes))
         k = minloc(tests%value / merge(fall, 1.0_wp, comes), 1, comes)
         comes(k) = .false.
         next(tests(k)%candidate) = .true.
      end do
   end function flat_next

   !> On which sides of a touched node the rod is as curved as the obstacle: at the place of a test, and where else it is so, too,
   !> at that place of the path, and would be pressed, or pulled, as well: held as a point it would be neutral.
   function flat_sides(problem, state, c, test, pressed) result(flat)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      type(span_test_t), intent(in) :: test
      logical, intent(in) :: pressed
      logical :: flat(2)
      real(wp) :: excess, stretch, sense
      integer :: side
      flat = .false.
      if (problem%candidates%touch(c) == 0) return
      associate (clamped => problem%model%fixed(3, problem%candidates%node(c)), moves => problem%candidates%moves(c))
         if (c == test%candidate .and. .not. clamped) then
            flat = moves .or. problem%candidates%element(:, c) > 0
         else if (clamped .or. moves .and. .not. problem%touch(problem%candidates%touch(c))%line) then
            do side = 1, 2
               if (.not. (moves .or. rests_beside(problem, c, side))) cycle
               sense = merge(0.0_wp, real(2 * side - 3, wp), moves)
               flat(side) = c == test%candidate .and. test%sense * sense > 0.0_wp
               if (flat(side)) cycle
               call excess_curvature(problem, state, c, excess, stretch, side)
               ! The place is known to that for the one that was looked for, to a few times that for others.
               flat(side) = excess * problem%size <= 10.0_wp * flat_excess
               if (problem%candidates%node(c) == problem%rolling) flat(side) = excess * problem%size <= nearly_flat(problem)
               if (flat(side)) flat(side) = would_press(problem, state, c, sense) .eqv. pressed
            end do
            ! As curved on one side as on the other, but for errors that go with the squares of curvatures.
            if (problem%candidates%node(c) == problem%rolling) flat = any(flat)
         end if
      end associate
   end function flat_sides

   !> True where a line that begins at a flat point would be pressed: by what acts along the rod, and at a breakpoint by what acts
   !> on that.
   logical function would_press(problem, state, c, sense)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      real(wp), intent(in) :: sense                !! of a test of its curvature
      real(wp) :: lifted
      would_press = density_beside(problem, state, c, sense) >= 0.0_wp
      if (.not. would_press) return
      ! What pulls there lifts as little as is taken for none, or more.
      lifted = pulled_off(problem, state, c, sense)
      would_press = lifted <= line_share * problem%layout%stretch(problem%touch(problem%candidates%touch(c))%stretch)%length
   end function would_press

   !> The density of the obstacle's force beside a point.
   real(wp) function density_beside(problem, state, c, sense) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      real(wp), intent(in) :: sense                !! of a test of its curvature
      if (abs(sense) > 0.0_wp) then
         density = virtual_pressure(problem, state, c, merge(1, 2, sense < 0.0_wp))
      else
         density = virtual_pressure(problem, state, c)
      end if
   end function density_beside

   !> Length that what acts on a touched breakpoint would lift off beside it if a line lay there; huge where no line does, 0 where
   !> nothing pulls.
   real(wp) function pulled_off(problem, state, c, sense) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c                     !! candidate
      real(wp), intent(in) :: sense                !! of a test of its curvature
      real(wp) :: force, jump
      length = 0.0_wp
      if (problem%candidates%moves(c) .or. stands(problem, state, c)) return
      force = held_force(problem, state, c)
      jump = point_force(problem, state, c)
      ! What the obstacle holds more than the rod does comes from the outside, and presses.
      if (jump - force <= test_slack(test_force) * abs(force)) return
      length = huge(length)
      if (.not. problem%model%fixed(3, problem%candidates%node(c))) return
      length = lifted_at_mirror(jump - force, density_beside(problem, state, c, sense))
   end function pulled_off

   !> A point two points; on a mirror, or where a support holds the rotation, one on each side that is flat.
   subroutine divide_point(problem, state, test, share, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      real(wp), intent(in) :: share                !! of the stretch, that they are apart
      type(answer_t), intent(inout) :: answer
      associate (c => test%candidate, k => test%touch)
         if (problem%candidates%moves(c)) then
            answer%touch = parted(answer%touch, k, share * stretch_length(problem, answer%touch(k)))
            answer%opens = [k, size(answer%touch)]
         else
            call go_beside(problem, c, flat_sides(problem, state, c, test, .false.), 0.5_wp * share, .false., answer, &
               & answer%opens)
         end if
      end associate
   end subroutine divide_point

   !> What was a point at a breakpoint is a touch beside it, on each side on which it goes there. Beside a clamp it stays as it is
   !> where the rod on the other side rests on it.
   subroutine go_beside(problem, c, goes, share, line, answer, beside)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c                     !! candidate
      logical, intent(in) :: goes(2)               !! before the breakpoint, after it
      real(wp), intent(in) :: share                !! of the longest stretch: length of a line, or distance of a point
      logical, intent(in) :: line
      type(answer_t), intent(inout) :: answer
      integer, intent(out) :: beside(2)            !! the touches before and after it, 0: nothing goes there
      type(touch_t) :: touch
      integer :: side, stretch(2), k
      real(wp) :: length
      logical :: stays
      stretch = 0
      length = 0.0_wp
      do side = 1, 2
         if (problem%candidates%element(side, c) == 0) cycle
         stretch(side) = problem%stretch(problem%candidates%element(side, c))
         if (goes(side)) length = max(length, share * problem%layout%stretch(stretch(side))%length)
      end do
      k = problem%candidates%touch(c)
      stays = answer%touch(k)%line .or. .not. line .and. any(stretch > 0 .and. .not. goes)
      beside = 0
      do side = 1, 2
         if (.not. goes(side)) cycle
         touch = touch_t(contact=answer%touch(k)%contact, stretch=stretch(side), line=line, &
            & at=behind(problem, stretch(side), 2 * side - 3, length, line))
         if (stays .or. any(beside > 0)) then
            answer%touch = [answer%touch, touch]
            beside(side) = size(answer%touch)
         else
            touch%number = answer%touch(k)%number
            answer%touch(k) = touch
            beside(side) = k
         end if
      end do
   end subroutine go_beside

   !> The line of a test, and others that become as short as none before nothing is left of it: of two that a mirror makes one of
   !> the other neither is the first.
   subroutine shrink_lines(problem, tests, which, fall, answer)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      real(wp), intent(in) :: fall(:)              !! (tests)
      type(answer_t), intent(inout) :: answer
      logical :: gone(size(answer%touch))
      real(wp) :: left
      integer :: k
      gone = .false.
      left = shortest * stretch_length(problem, answer%touch(tests(which)%touch)) / problem%size
      do k = 1, size(tests)
         if (tests(k)%kind /= test_length) cycle
         if (k /= which .and. .not. (fall(k) > 0.0_wp .and. tests(k)%value * fall(which) <= left * fall(k))) cycle
         call shrink(problem, tests(k), answer%touch(tests(k)%touch), gone(tests(k)%touch))
      end do
      answer%touch = pack(answer%touch, .not. gone)
   end subroutine shrink_lines

   !> What is left of a line that has become as short as none: a point, or nothing of its own.
   subroutine shrink(problem, test, line, gone)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test        !! of the line's length
      type(touch_t), intent(inout) :: line
      logical, intent(out) :: gone                 !! other contacts have its ends
      real(wp) :: at, whole
      gone = any(others_touch(problem, test%touch))
      if (gone) return
      whole = stretch_length(problem, line)
      at = test%at
      if (line%at(1) <= 0.0_wp) then
         at = 0.0_wp
      else if (line%at(2) >= whole) then
         at = whole
      end if
      line%line = .false.
      line%at = at
   end subroutine shrink

   !> Which ends of a touch are held by another one, too.
   pure function others_touch(problem, k) result(shared)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k                     !! index into problem%touch
      logical :: shared(2)
      integer :: j, side
      shared = .false.
      do j = 1, size(problem%touch)
         if (j == k) cycle
         do side = 1, 2
            shared(side) = shared(side) .or. any(problem%touch(j)%candidate == problem%touch(k)%candidate(side))
         end do
      end do
   end function others_touch

   !> An end of a rod, or a corner, that touched is tangent to the obstacle. Where the rod is curved away from it there, and still
   !> is where the force would go, the point leaves the end. Where it is curved towards it another point begins beside. In between,
   !> as without a moment, a line begins with the end.
   subroutine lie_down_from_end(problem, state, test, answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test        !! its sense: the rod lies before its end (-1), or after it
      type(answer_t), intent(inout) :: answer
      type(touch_t), allocatable :: set(:)
      real(wp) :: excess(2), length
      integer :: k, way, side, stretch, e
      k = test%touch
      way = nint(test%sense)
      side = merge(1, 2, way < 0)
      e = problem%candidates%element(side, test%candidate)
      stretch = problem%stretch(e)
      length = line_share * problem%layout%stretch(stretch)%length
      excess = problem%size * excess_inside(problem, state, test%candidate, side, length)
      set = continued(answer%touch, k, stretch, behind(problem, stretch, way, length, .false.))
      if (excess(1) < -flat_excess .and. .not. stays_down(problem, e, excess(1) / (problem%size * problem%compliance(e)%bending), &
         & virtual_pressure(problem, state, test%candidate, side))) then
         answer%touch = set
         answer%opens = [k, size(set)]
         if (way < 0) answer%opens = answer%opens([2, 1])
         answer%label = 'C+'
         return
      end if
      answer%touch(k)%line = excess(2) <= flat_excess
      if (stands(problem, state, test%candidate)) answer%label = 'C+'
      answer%touch = moved(answer%touch, k, stretch, behind(problem, stretch, way, length, answer%touch(k)%line))
      answer%crosses = reshape(merge([k, 0], [0, k], way > 0), [2, 1])
   end subroutine lie_down_from_end

   !> Excess of curvature where a rod ends, and at a distance inside where the force of the contact goes that is at the end: with
   !> the shear force that the rod has before that, m' = -r' x n.
   function excess_inside(problem, state, candidate, side, distance) result(excess)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(in) :: side                  !! 1: the rod lies before the candidate, 2: after it
      real(wp), intent(in) :: distance             !! stress-free
      real(wp) :: excess(2)
      type(track_t) :: track
      real(wp) :: n(2), m, angle, sense, stretch, way
      integer :: e
      e = problem%candidates%element(side, candidate)
      way = merge(-1.0_wp, 1.0_wp, side == 1)
      call excess_curvature(problem, state, candidate, excess(1), stretch, side)
      call ge_end(problem, state, e, 3 - side, n, m)
      track = node_track(problem, state, candidate)
      n = n + way * held_force(problem, state, candidate) * [-track%tangent(2), track%tangent(1)]
      ! Nor does a support bend what then lies between it and the contact.
      if (stands(problem, state, candidate)) n = dot_product(n, track%tangent) * track%tangent
      angle = rod_angle(problem, state, candidate, side)
      sense = track_sense(problem, state, candidate, track, side)
      excess(2) = excess(1) + way * distance * stretch * (sense * problem%compliance(e)%bending * (sin(angle) * n(1) - &
         & cos(angle) * n(2)) - sense * track%curvature_rate * stretch)
   end function excess_inside

   !> A point that is held at a breakpoint, and belongs beside it, goes there.
   subroutine leave_breakpoint(problem, test, answer)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test        !! its sense: the point belongs before the breakpoint (-1), or after it
      type(answer_t), intent(inout) :: answer
      integer :: way, stretch
      associate (k => test%touch)
         way = nint(test%sense)
         stretch = problem%stretch(problem%candidates%element(merge(1, 2, way < 0), test%candidate))
         answer%touch = moved(answer%touch, k, stretch, behind(problem, stretch, way, &
            & line_share * problem%layout%stretch(stretch)%length, .false.))
         answer%crosses = reshape([0, k], [2, 1])
      end associate
   end subroutine leave_breakpoint

   !> Numbers of two touches of a set.
   pure function numbers(set, at) result(number)
      type(touch_t), intent(in) :: set(:)
      integer, intent(in) :: at(2)                 !! indices, 0: none
      integer :: number(2), i
      number = 0
      do i = 1, 2
         if (at(i) > 0) number(i) = set(at(i))%number
      end do
   end function numbers

   !> Length of the stretch of a touch.
   pure real(wp) function stretch_length(problem, touch) result(length)
      type(problem_t), intent(in) :: problem
      type(touch_t), intent(in) :: touch
      length = problem%layout%stretch(touch%stretch)%length
   end function stretch_length
end module span_rules
