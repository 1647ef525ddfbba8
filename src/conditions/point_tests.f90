!> Tests of contact nodes. A valid contact set satisfies three conditions: forces at point contacts, and at ends of line contacts at
!> segment boundaries, are compressive; at a point contact the rod bends away from the obstacle (positive relative curvature);
!> beside a contact at the end of a rod or at a corner, the gap increases with the distance from the contact.
module point_tests
   use kinds, only: wp, parallel
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, candidate_gap, may_react
   use track_nodes, only: rolled_t, rolled, excess_curvature, node_track, track_sense, track_rotation
   use conforming_span, only: conforming_forces
   use touchdown_points, only: point_force
   use breakpoint_forces, only: breakpoint_force, at_breakpoint, left_over, breakpoint_couple
   use contact_spans, only: initial_share
   use test_kinds, only: span_test_t, test_force, test_curvature, test_slope, test_leaving, test_couple
   use lifted_node, only: inside_line, lifted_beside, lifted_at_mirror, stays_in_contact
   implicit none
   private
   public :: tests_of_points

   real(wp), parameter :: parallel_enough = sqrt(epsilon(1.0_wp)) !! [rad] largest angle between rod and obstacle at a support that
   !! fixes the rotation at which the rod still counts as parallel to the obstacle

contains

   !> Tests of all contact nodes of a converged state, in the order of the candidates.
   function tests_of_points(problem, state, scale) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! scale of forces, see system_t
      type(span_test_t), allocatable :: tests(:)
      integer :: c
      logical :: kept, fixed
      allocate (tests(0))
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         kept = .not. problem%candidates%moves(c)
         fixed = problem%model%fixed(3, problem%candidates%node(c))
         if (.not. kept .or. at_breakpoint(problem, c)) tests = [tests, new_test(problem, c, test_force, push(problem, state, &
            & scale, c))]
         if (fixed) call test_beside_support(tests)
         if (problem%contact_span(problem%candidates%contact_span(c))%line) then
            if (kept .and. at_breakpoint(problem, c)) tests = [tests, new_test(problem, c, test_couple, &
               & -lifting_couple(problem, state, c, scale))]
         else if (problem%candidates%rolls(c)) then
            tests = [tests, curvature(problem, state, c)]
            if (kept) tests = [tests, leaving(problem, state, c)]
         else if (.not. fixed) then
            call test_slopes(tests)
         end if
      end do

   contains

      !> Adds the curvature tests beside a support with fixed rotation, one for each side on which the rod is free. A side on which
      !> the rod leaves the obstacle at an angle has no test, because curvature cannot bring it back into contact beside the
      !> support.
      subroutine test_beside_support(tests)
         type(span_test_t), allocatable, intent(inout) :: tests(:)
         integer :: side
         do side = 1, 2
            if (.not. rests_beside(problem, c, side)) cycle
            if (rise(problem, state, c, side) <= parallel_enough) tests = [tests, curvature(problem, state, c, side)]
         end do
      end subroutine test_beside_support

      !> Adds the slope tests at the end of a rod or at a corner of the obstacle: the gap must increase with the distance from the
      !> node.
      subroutine test_slopes(tests)
         type(span_test_t), allocatable, intent(inout) :: tests(:)
         type(span_test_t) :: test
         integer :: side
         do side = 1, 2
            if (problem%candidates%element(side, c) == 0) cycle
            test = new_test(problem, c, test_slope, rise(problem, state, c, side))
            test%sense = merge(1.0_wp, -1.0_wp, side == 2)
            tests = [tests, test]
         end do
      end subroutine test_slopes
   end function tests_of_points

   !> New test of kind `kind` of the contact span at a candidate.
   pure type(span_test_t) function new_test(problem, c, kind, value) result(test)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c              !! candidate
      integer, intent(in) :: kind
      real(wp), intent(in) :: value
      test = span_test_t(kind=kind, value=value, contact_span=problem%candidates%contact_span(c), candidate=c)
   end function new_test

   !> Derivative of the gap with respect to the distance from a contact node on one side of it; > 0 if the gap increases away from
   !> the node.
   real(wp) function rise(problem, state, c, side)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      integer, intent(in) :: side           !! side of the node: 1: before it, 2: after it
      rise = merge(1.0_wp, -1.0_wp, side == 2) * track_rotation(problem, state, c, side) * &
         & track_sense(problem, state, c, node_track(problem, state, c), side)
   end function rise

   !> Test of the relative curvature (excess_curvature, > 0 if valid) of a point contact, or on one side of a support that fixes the
   !> rotation.
   type(span_test_t) function curvature(problem, state, c, side) result(test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      integer, intent(in), optional :: side
      real(wp) :: excess, extension
      call excess_curvature(problem, state, c, excess, extension, side)
      test = new_test(problem, c, test_curvature, excess * problem%size)
      test%sense = 0.0_wp
      if (present(side)) test%sense = real(2 * side - 3, wp)
   end function curvature

   !> Test of a point contact at a segment boundary. If the rod turns relative to the obstacle, its contact force moves to the
   !> distance turn / (relative curvature) from the node. The test value is a negligible distance times the relative curvature,
   !> minus the magnitude of the turn. If it is negative, the point contact leaves the boundary. Unlike the distance, this value is
   !> finite where the relative curvature vanishes.
   type(span_test_t) function leaving(problem, state, c) result(test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      type(rolled_t) :: roll
      real(wp) :: excess, extension, turn
      integer :: side
      roll = rolled(problem, state, c)
      call excess_curvature(problem, state, c, excess, extension)
      turn = track_rotation(problem, state, c)
      test = new_test(problem, c, test_leaving, 0.0_wp)
      test%at = roll%way
      test%sense = -sign(1.0_wp, turn) * track_sense(problem, state, c, node_track(problem, state, c))
      side = merge(2, 1, test%sense > 0.0_wp)
      test%value = initial_share * problem%layout%rod_segment(problem%rod_segment(problem%candidates%element(side, c)))%length * &
         & excess - abs(turn)
   end function leaving

   !> Concentrated contact force at a candidate over the scale of forces; > 0: the obstacle presses. Minus the gap over the
   !> structure's size, if the contact is open.
   real(wp) function push(problem, state, scale, c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! scale of forces, see system_t
      integer, intent(in) :: c
      real(wp) :: lift, normal(2), bend
      type(rolled_t) :: roll
      if (problem%candidates%moves(c)) then
         push = point_force(problem, state, c) / scale
         return
      end if
      push = breakpoint_force(problem, state, c) / scale
      ! At a node of a line contact the force is set to zero if it is a residual, or lifts only a negligible length. The force of a
      ! point contact is not set to zero, because it may pass through zero.
      if (problem%contact_span(problem%candidates%contact_span(c))%line .and. (abs(push) <= left_over(problem) .or. &
         & uplift_is_negligible(problem, state, c, push, scale))) push = 0.0_wp
      ! A support or another obstacle may prescribe the position of the node, so that this contact does not constrain the node. If
      ! the gap is open then, the test fails.
      if (closes_gap(problem, state, c)) return
      call candidate_gap(problem, state, c, lift, normal, bend)
      roll = rolled(problem, state, c)
      if (lift - roll%rise > rounding_gap(problem)) push = -lift / problem%size
   end function push

   !> True if the rod continues on the given side of a contact node and is not in line contact there.
   pure logical function rests_beside(problem, c, side)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c              !! candidate
      integer, intent(in) :: side           !! side of the candidate: 1: before it, 2: after it
      associate (e => problem%candidates%element(side, c))
         rests_beside = e > 0
         if (rests_beside) rests_beside = problem%conforms(e) == 0
      end associate
   end function rests_beside

   !> True if the contact constrains its node, because neither a support nor an active candidate before it in the list constrains
   !> the node in the same direction.
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

   !> Magnitude of the couple of the obstacle on a line contact's node at a segment boundary, over force scale times structure's
   !> size. Zero if the couple is within the residual of equilibrium or lifts only a negligible length.
   real(wp) function lifting_couple(problem, state, c, scale) result(couple)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp), intent(in) :: scale         !! scale of forces, see system_t
      couple = abs(breakpoint_couple(problem, state, c)) / (scale * problem%size)
      if (couple <= left_over(problem)) couple = 0.0_wp
      if (.not. couple > 0.0_wp) return
      if (inside_line(problem, c)) then
         if (any(lifts_negligibly(problem, state, c))) couple = 0.0_wp
      else if (end_stays_in_contact(problem, state, c)) then
         couple = 0.0_wp
      end if
   end function lifting_couple

   !> (before, after) true: force and couple on a node inside a line contact lift only a negligible length of the rod on this side
   !> of the node.
   function lifts_negligibly(problem, state, c) result(negligible)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      logical :: negligible(2)
      negligible = lifted_beside(problem, state, c) <= initial_share * problem%layout%rod_segment(problem%rod_segment( &
         & problem%beside(:, problem%candidates%node(c))))%length
   end function lifts_negligibly

   !> True if a couple on the node at which a line contact ends together with its rod lifts only a negligible length or height.
   logical function end_stays_in_contact(problem, state, c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      real(wp) :: density
      integer :: e
      call find_line_end(problem, state, c, e, density)
      end_stays_in_contact = e > 0
      if (end_stays_in_contact) end_stays_in_contact = stays_in_contact(problem, e, breakpoint_couple(problem, state, c), density)
   end function end_stays_in_contact

   !> True if a force away from the obstacle lifts only a negligible length: the force acts on a node inside a line contact, or on a
   !> node with fixed rotation at which both a line contact and its rod end (symmetry plane).
   logical function uplift_is_negligible(problem, state, c, push, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp), intent(in) :: push          !! contact force over the scale of forces; > 0: the obstacle presses
      real(wp), intent(in) :: scale         !! scale of forces, see system_t
      real(wp) :: density
      integer :: e
      uplift_is_negligible = push < 0.0_wp
      if (.not. uplift_is_negligible) return
      if (inside_line(problem, c)) then
         uplift_is_negligible = all(lifts_negligibly(problem, state, c))
         return
      end if
      uplift_is_negligible = problem%model%fixed(3, problem%candidates%node(c))
      if (.not. uplift_is_negligible) return
      call find_line_end(problem, state, c, e, density)
      uplift_is_negligible = e > 0
      if (uplift_is_negligible) uplift_is_negligible = lifted_at_mirror(-push * scale, density) <= initial_share * &
         & problem%layout%rod_segment(problem%rod_segment(e))%length
   end function uplift_is_negligible

   !> Finds the element of a line contact at a candidate at which both the line contact and the rod end; also the density of the
   !> obstacle's force there.
   subroutine find_line_end(problem, state, c, e, density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      integer, intent(out) :: e             !! element; 0: the candidate is not the end of both a line contact and a rod
      real(wp), intent(out) :: density
      real(wp) :: local(3)
      integer :: side
      density = 0.0_wp
      e = 0
      if (count(problem%candidates%element(:, c) > 0) /= 1) return
      side = findloc(problem%candidates%element(:, c) > 0, .true., 1)
      if (problem%conforms(problem%candidates%element(side, c)) == 0) return
      e = problem%candidates%element(side, c)
      call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local, density=density)
   end subroutine find_line_end
end module point_tests
