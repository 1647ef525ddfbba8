!> Hand-over of sliding contact nodes.
!>
!> The node of a point contact follows the contact point along the rod, and so do the nodes at the ends of a contact
!> region: no force ever hops from node to node. When such a node has moved over more than half an element the next one
!> takes over at the same material point and the first one goes home; a node that lost its contact goes home, too. The
!> state is carried over by the collocation polynomials and brought back to equilibrium; nothing but the discretisation
!> changes.
module sliding_nodes
   use kinds, only: wp
   use model, only: method_linearised
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use rod_geometry, only: slide_node, node_reference
   use reference_curve, only: curve_point, curve_length, curve_abscissa
   use ge_element, only: ge_interior
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent, is_arc_length
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: rehome_nodes, move_node

   real(wp), parameter :: reach = 0.6_wp !! of an element: a node hands over beyond it

contains

   !> Moves nodes home or hands contacts over where due. The system ends up factored at the new state.
   subroutine rehome_nodes(problem, control, direction, direction_load, state, system, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: direction(:, :), direction_load !! last increment: fixes the sense of the tangent
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! factored at `state` on entry and on return
      type(timers_t), intent(inout) :: timers
      type(state_t) :: moved
      real(wp) :: offset, home, target
      integer :: c, side, other, inner
      logical :: changed, done

      if (.not. any(problem%candidates%may_slide)) return
      moved = state
      changed = .false.
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%may_slide(c)) cycle
         associate (element => problem%candidates%element(:, c))
            offset = offset_from_home(problem, state, c)
            if (.not. abs(offset) > 0.0_wp) cycle
            ! It may slide on another obstacle.
            if (touches_another(problem, state, c)) cycle
            side = merge(2, 1, offset > 0.0_wp)
            home = problem%model%mesh%s(2, element(side)) - problem%model%mesh%s(1, element(side))
            other = problem%candidates%neighbour(side, c)
            inner = problem%candidates%neighbour(3 - side, c)
            target = 0.0_wp
            if (state%active(c) .and. .not. (state%active(other) .and. state%active(inner))) then
               if (abs(offset) < reach * home) cycle
               if (.not. problem%candidates%may_slide(other)) cycle
               if (abs(offset_from_home(problem, state, other)) > 0.0_wp) cycle
               target = offset - sign(home, offset)
               ! Growing region: its old end node stays behind in contact. Shrinking or a single point: it opens.
               moved%active(c) = .not. state%active(other) .and. state%active(inner)
               moved%active(other) = .true.
               moved%reaction(other) = state%reaction(c)
               if (.not. moved%active(c)) moved%reaction(c) = 0.0_wp
            end if
            call slide_node(problem%model, problem%tableau, moved%geometry, element, -offset)
            if (abs(target) > 0.0_wp) call slide_node(problem%model, problem%tableau, moved%geometry, &
               & problem%candidates%element(:, other), target)
            changed = .true.
         end associate
      end do
      if (.not. changed) return

      ! Should it fail the node goes on sliding; when its element runs out, the increment says so.
      call take_over(problem, control, direction, direction_load, .false., moved, state, system, done, timers)
   end subroutine rehome_nodes

   !> How far along its curve a candidate's node lies from its place in the mesh.
   pure real(wp) function offset_from_home(problem, state, candidate) result(offset)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate           !! that may slide
      integer :: e
      e = problem%candidates%element(1, candidate)
      offset = state%geometry%element(e)%s(2) - problem%model%mesh%s(2, e)
   end function offset_from_home

   !> True when the node of a candidate is in contact with another obstacle than the candidate's.
   pure logical function touches_another(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer :: c
      touches_another = .false.
      c = problem%candidates%twin(candidate)
      do while (c /= candidate)
         touches_another = touches_another .or. state%active(c)
         c = problem%candidates%twin(c)
      end do
   end function touches_another

   !> Moves the node of an open candidate along the rod to where a contact is about to begin.
   subroutine move_node(problem, control, direction, direction_load, candidate, shift, state, system, ok, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: direction(:, :), direction_load
      integer, intent(in) :: candidate
      real(wp), intent(in) :: shift              !! of nominal coordinate, less than an element
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! factored at `state` on entry and on return
      logical, intent(out) :: ok                 !! false: the state is as it was
      type(timers_t), intent(inout) :: timers
      type(state_t) :: moved
      ok = .true.
      if (.not. abs(shift) > 0.0_wp) return
      moved = state
      call slide_node(problem%model, problem%tableau, moved%geometry, problem%candidates%element(:, candidate), shift)
      call take_over(problem, control, direction, direction_load, .true., moved, state, system, ok, timers)
   end subroutine move_node

   !> Carries the solution over to the moved nodes of `moved`, restores equilibrium, and makes it the state if that works.
   subroutine take_over(problem, control, direction, direction_load, keep_contact, moved, state, system, ok, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: direction(:, :), direction_load
      logical, intent(in) :: keep_contact
      type(state_t), intent(inout) :: moved
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      type(state_t) :: base
      type(control_t) :: hold
      type(increment_t) :: report
      call carry_over(problem, state, moved)
      hold = control
      hold%increment = 0.0_wp
      if (is_arc_length(control%method)) then
         hold%method = method_linearised
         call set_tangent(problem, system, direction, direction_load, hold)
      end if
      base = moved
      call correct(problem, base, hold, keep_contact, moved, system, report, timers)
      ok = report%converged
      if (ok) then
         state = moved
      else
         call linearise(problem, state, state, system, timers)
      end if
   end subroutine take_over

   !> Displacements and stored resultants of `moved` from the solution `from` on the old element ends.
   subroutine carry_over(problem, from, moved)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from
      type(state_t), intent(inout) :: moved    !! its geometry is the new one
      real(wp) :: position(2), rotation, resultant(3), x(2), angle, speed, s, h
      integer :: e, i, node, c, stages
      do e = 1, problem%model%mesh%n_elements
         if (all(abs(moved%geometry%element(e)%s - from%geometry%element(e)%s) <= 0.0_wp)) cycle
         c = problem%model%mesh%curve(e)
         if (c == 0) cycle
         do i = 1, 2
            node = problem%model%mesh%node(i, e)
            call old_solution(problem, from, e, moved%geometry%element(e)%s(i), position, rotation, resultant)
            if (i == 1) moved%z(1:3, e) = resultant
            if (abs(moved%geometry%element(e)%s(i) - from%geometry%element(e)%s(i)) <= 0.0_wp) cycle
            call node_reference(problem%model, moved%geometry, e, i, x, angle, speed)
            moved%u(1:2, node) = position - x
            moved%u(3, node) = rotation
         end do
         stages = problem%model%mesh%stages(e)
         h = moved%geometry%element(e)%length
         do i = 1, stages
            s = curve_abscissa(problem%model%curve(c), problem%model%imperfection, moved%geometry%element(e)%s(1), &
               & problem%tableau(stages)%c(i) * h)
            call old_solution(problem, from, e, s, position, rotation, resultant)
            moved%z(3 + i, e) = resultant(3)
            if (problem%pressurised(e)) moved%z(2 + stages + 2 * i:3 + stages + 2 * i, e) = resultant(1:2)
         end do
      end do
   end subroutine carry_over

   !> The old solution at nominal coordinate s, on element `near` or the one next to it that contains s.
   subroutine old_solution(problem, from, near, s, position, rotation, resultant)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from
      integer, intent(in) :: near
      real(wp), intent(in) :: s
      real(wp), intent(out) :: position(2), rotation, resultant(3)
      real(wp) :: u(6), tau, span(2)
      real(wp) :: at
      integer :: e, c, k
      e = near
      at = s
      ! A node moves less than one element, so two steps along the curve are enough.
      do k = 1, 2
         if (at < from%geometry%element(e)%s(1)) then
            call go_to(next_element(-1), 1)
         else if (at > from%geometry%element(e)%s(2)) then
            call go_to(next_element(1), 2)
         end if
      end do
      c = problem%model%mesh%curve(e)
      tau = curve_length(problem%model%curve(c), problem%model%imperfection, from%geometry%element(e)%s(1), at) &
         & / from%geometry%element(e)%length
      u = element_displacement(problem, from, e)
      associate (element => from%geometry%element(e))
         call ge_interior(problem%tableau(problem%model%mesh%stages(e)), element%length, element%scale, element%angle, &
            & problem%compliance(e), element_load(problem, from, e), u, from%z(:problem%z_size(e), e), tau, span, &
            & rotation, resultant)
      end associate
      position = from%geometry%x(:, problem%model%mesh%node(1, e)) + u(1:2) + span

   contains

      !> On to the element beyond end `side` of this one. Where a curve continues another one coordinates change.
      subroutine go_to(other, side)
         integer, intent(in) :: other, side
         if (other == e) return
         at = at + (from%geometry%element(other)%s(3 - side) - from%geometry%element(e)%s(side))
         e = other
      end subroutine go_to

      !> The element before (-1) or after (1) element e along the rod.
      integer function next_element(way)
         integer, intent(in) :: way
         integer :: i, j
         next_element = e
         do i = 1, problem%candidates%n
            do j = 1, 2
               if (problem%candidates%element(3 - j, i) /= e .or. problem%candidates%element(j, i) == 0) cycle
               if (way == merge(1, -1, j == 2)) next_element = problem%candidates%element(j, i)
            end do
         end do
      end function next_element
   end subroutine old_solution
end module sliding_nodes
