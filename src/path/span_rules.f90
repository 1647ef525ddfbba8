!> Which contact set follows where a test of the present one vanishes: one rule a test. The same rules correct a set of which
!> several tests fail at once.
module span_rules
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_touch, only: touch_t
   use touch_edits, only: begun, lost, spread_out, parted, shrunk, joined, end_moved, moved, continued, numbered
   use line_pressure, only: virtual_pressure
   use past_breakpoints, only: beyond, across
   use span_tests, only: span_test_t, test_gap, test_force, test_curvature, test_length, test_closing, test_crossing, test_slope
   use conforming_span, only: flat_excess, excess_curvature
   use span_merging, only: closing_point
   implicit none
   private
   public :: answer_t, answer_to

   !> What follows.
   type :: answer_t
      type(touch_t), allocatable :: touch(:)      !! the new set
      integer :: opens(2) = 0                     !! numbers of the touches between which a span opens, 0: a breakpoint; both the
      !! same: a line, between its own ends
      integer :: crosses(2) = 0                   !! the same of a span behind a breakpoint
      character(:), allocatable :: why            !! there is no rule: the reason
   end type answer_t

contains

   !> The answer to a test that is zero, or below.
   function answer_to(problem, state, test, set, last, line_share, point_share) result(answer)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test       !! of this state
      type(touch_t), intent(in) :: set(:)         !! what touches, if other tests have been answered before; all have numbers
      integer, intent(in) :: last                 !! number given last
      real(wp), intent(in) :: line_share          !! of its stretch, that a line begins with,
      real(wp), intent(in) :: point_share         !! and of two points the distance
      type(answer_t) :: answer
      integer :: opens(2), crosses(2)             ! indices into the new set
      integer :: k
      real(wp) :: whole
      opens = 0
      crosses = 0
      answer%touch = set
      k = 0
      if (test%touch > 0) then
         k = index_of(test%touch)
         ! Gone by the answer to another test.
         if (k == 0) return
      end if
      whole = problem%layout%stretch(max(test%stretch, 1))%length
      if (k > 0) whole = problem%layout%stretch(set(k)%stretch)%length
      select case (test%kind)
      case (test_gap)
         answer%touch = begun(set, test%contact, test%stretch, test%at)
      case (test_force)
         if (set(k)%line) then
            answer%why = 'a line contact lifts off at its end'
         else
            answer%touch = lost(set, k)
         end if
      case (test_curvature)
         ! Against a straight wall a uniform rod lies without pressure.
         if (virtual_pressure(problem, state, test%candidate) >= 0.0_wp) then
            call lay_down_points()
            opens = k
         else if (closing_point(problem, state, test%candidate) > 0) then
            answer%why = 'two contact points come together'
         else if (problem%candidates%moves(test%candidate)) then
            answer%touch = parted(set, k, point_share * whole)
            opens = [k, size(answer%touch)]
         else
            ! On a mirror, or where a support holds the rotation.
            associate (half => 0.5_wp * point_share * whole)
               answer%touch = shrunk(set, k, merge(half, whole - half, set(k)%at(1) <= 0.0_wp))
            end associate
            call go_on_behind(test%touch, k, point_share * whole, opens)
         end if
      case (test_length)
         call shrink()
      case (test_crossing)
         call cross(nint(test%sense))
      case (test_slope)
         call lie_down_from_end(nint(test%sense))
      case (test_closing)
         if (index_of(test%touch + 1) > 0) answer%touch = joined(set, k, index_of(test%touch + 1))
      case default
         answer%why = 'a line contact lifts off inside'
      end select
      answer%touch = numbered(answer%touch, last)
      answer%opens = numbers(opens)
      answer%crosses = numbers(crosses)

   contains

      !> Where one of the problem's touches is in the set.
      pure integer function index_of(touch)
         integer, intent(in) :: touch
         index_of = findloc(set%number, problem%touch(touch)%number, 1)
      end function index_of

      pure function numbers(of) result(number)
         integer, intent(in) :: of(2)
         integer :: number(2), i
         number = 0
         do i = 1, 2
            if (of(i) > 0) number(i) = answer%touch(of(i))%number
         end do
      end function numbers

      !> The point, and others that lie down at the same place of the path, lines. Their ends have forces, so Newton's method finds
      !> their places from any nearby.
      subroutine lay_down_points()
         integer :: c, point, behind(2)
         real(wp) :: long
         do c = 1, problem%candidates%n
            if (c /= test%candidate) then
               if (.not. as_flat(c)) cycle
            end if
            point = index_of(problem%candidates%touch(c))
            if (point == 0) cycle
            long = problem%layout%stretch(set(point)%stretch)%length
            answer%touch = spread_out(answer%touch, point, 0.5_wp * line_share * long, long)
            if (.not. problem%candidates%moves(c)) &
               & call go_on_behind(problem%candidates%touch(c), point, line_share * long, behind)
         end do
      end subroutine lay_down_points

      !> True for another point that lies down at the same place of the path: held as a point it would be neutral.
      logical function as_flat(c)
         integer, intent(in) :: c
         real(wp) :: excess, stretch
         as_flat = problem%candidates%touch(c) > 0
         if (as_flat) as_flat = .not. problem%touch(problem%candidates%touch(c))%line .and. (problem%candidates%moves(c) .or. &
            & problem%model%fixed(3, problem%candidates%node(c)))
         if (.not. as_flat) return
         call excess_curvature(problem, state, c, excess, stretch)
         ! The place is known to that for the one that was looked for, to a few times that for others.
         as_flat = excess * problem%size <= 10.0_wp * flat_excess
         if (as_flat) as_flat = virtual_pressure(problem, state, c) >= 0.0_wp
      end function as_flat

      !> What was a point at a breakpoint is a touch beside it, and another one on the other side, where the rod goes on.
      subroutine go_on_behind(touch, point, length, beside)
         integer, intent(in) :: touch          !! index into problem%touch
         integer, intent(in) :: point          !! the same in the set
         real(wp), intent(in) :: length        !! of what opens, or touches, on both sides together
         integer, intent(out) :: beside(2)     !! the touches before and after the breakpoint, 0: there the rod ends
         integer :: way, other
         way = merge(-1, 1, answer%touch(point)%at(1) < &
            & 0.5_wp * problem%layout%stretch(answer%touch(point)%stretch)%length)
         other = across(problem, touch, way)
         beside = [point, 0]
         if (other > 0) then
            answer%touch = continued(answer%touch, point, other, behind(other, way, 0.5_wp * length, answer%touch(point)%line))
            beside(2) = size(answer%touch)
         end if
         if (way < 0) beside = beside([2, 1])
      end subroutine go_on_behind

      !> What lies on a stretch behind a breakpoint: a line from there on, or a point.
      pure function behind(stretch, way, length, line) result(at)
         integer, intent(in) :: stretch
         integer, intent(in) :: way            !! -1: before the breakpoint, 1: after it
         real(wp), intent(in) :: length        !! of the line, or distance of the point
         logical, intent(in) :: line
         real(wp) :: at(2)
         associate (end => problem%layout%stretch(stretch)%length)
            at = merge(length, end - length, way > 0)
            if (line) at(merge(2, 1, way < 0)) = merge(end, 0.0_wp, way < 0)
         end associate
      end function behind

      !> A line that has become as short as none: what is left is a point, or, where it goes on past a breakpoint, the line there.
      subroutine shrink()
         integer :: way, next, side, stretch
         real(wp) :: end
         do way = -1, 1, 2
            side = merge(2, 1, way < 0)
            stretch = beyond(problem, test%touch, way)
            if (stretch == 0) cycle
            end = merge(problem%layout%stretch(stretch)%length, 0.0_wp, way < 0)
            next = findloc(set%line .and. set%stretch == stretch .and. set%contact == set(k)%contact .and. &
               & abs(set%at(side) - end) <= 0.0_wp, .true., 1)
            if (next == 0) cycle
            if (abs(set(k)%at(3 - side) - merge(0.0_wp, whole, way < 0)) > 0.0_wp) cycle
            answer%touch = lost(end_moved(set, next, side, end + way * line_share * problem%layout%stretch(stretch)%length), k)
            crosses(3 - side) = merge(next - 1, next, next > k)
            return
         end do
         if (set(k)%at(1) <= 0.0_wp) then
            answer%touch = shrunk(set, k, 0.0_wp)
         else if (set(k)%at(2) >= whole) then
            answer%touch = shrunk(set, k, whole)
         else
            answer%touch = shrunk(set, k, test%at)
         end if
      end subroutine shrink

      !> An end of a rod that touched is tangent to the obstacle: where the rod, which has no moment there, is curved away from it
      !> the point leaves the end; else a line begins with it.
      subroutine lie_down_from_end(way)
         integer, intent(in) :: way            !! -1: the rod lies before its end, 1: after it
         real(wp) :: inside, excess, stretch
         inside = set(k)%at(1) + way * line_share * whole
         call excess_curvature(problem, state, test%candidate, excess, stretch)
         answer%touch(k)%line = excess * problem%size <= flat_excess
         answer%touch = end_moved(answer%touch, k, merge(2, 1, way > 0), inside)
         crosses(merge(1, 2, way > 0)) = k
      end subroutine lie_down_from_end

      !> What comes to a breakpoint goes on behind it: a point is there, a line gets another part there. At the end of a rod, or at
      !> a support, it stays.
      subroutine cross(way)
         integer, intent(in) :: way            !! -1: before the touch, 1: after it
         integer :: stretch, side
         real(wp) :: length
         side = merge(1, 2, way < 0)
         stretch = beyond(problem, test%touch, way)
         if (stretch == 0 .or. set(k)%line) answer%touch = end_moved(set, k, side, merge(0.0_wp, whole, way < 0))
         if (stretch == 0) return
         length = line_share * problem%layout%stretch(stretch)%length
         if (set(k)%line) then
            answer%touch = continued(answer%touch, k, stretch, behind(stretch, way, length, .true.))
            crosses(3 - side) = size(answer%touch)
         else
            answer%touch = moved(set, k, stretch, behind(stretch, way, length, .false.))
            crosses(2) = k
         end if
      end subroutine cross
   end function answer_to
end module span_rules
