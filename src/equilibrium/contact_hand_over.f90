!> Hand-over of a contact point from one node to the next.
!>
!> The node of a point contact follows the contact point along the rod, and so do the nodes at the ends of a contact
!> region: no force ever hops from node to node. Where such a node would leave its element the next one takes its place, at
!> the same material point, and the first one goes home. The solution is carried over by the collocation polynomials.
module contact_hand_over
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use rod_geometry, only: slide_node, node_reference
   use reference_curve, only: curve_length, curve_abscissa
   use ge_element, only: ge_interior
   implicit none
   private
   public :: hand_over, carry_over, offset_from_home, touches_another

contains

   !> Changes nodes and contact set of `moved` so that the next node on one side has the contact of a candidate. A node that
   !> does not slide takes it at its own place, and has it until the reaction there vanishes or the rod touches beyond it.
   subroutine hand_over(problem, candidate, side, from, moved, done)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate      !! at the end of a region, or alone
      integer, intent(in) :: side           !! 1: to the one before, 2: to the one after
      type(state_t), intent(in) :: from
      type(state_t), intent(inout) :: moved !! its solution is left to carry_over
      logical, intent(out) :: done          !! false: there is no next node, or it is in use; nothing changes
      real(wp) :: offset, home, target
      integer :: other, inner
      done = .false.
      other = problem%candidates%neighbour(side, candidate)
      inner = problem%candidates%neighbour(3 - side, candidate)
      if (other == 0 .or. inner == 0) return
      offset = offset_from_home(problem, from, candidate)
      target = 0.0_wp
      if (problem%candidates%may_slide(other)) then
         if (touches_another(problem, moved, other)) return
         associate (element => problem%candidates%element(side, candidate))
            home = problem%model%mesh%s(2, element) - problem%model%mesh%s(1, element)
         end associate
         if (side == 1) home = -home
         ! The other end of a short region stays where it is.
         if (abs(offset_from_home(problem, moved, other)) > 0.0_wp) then
            if (.not. from%active(other)) return
         else
            if (offset * home <= 0.0_wp) return
            target = offset - home
         end if
      end if
      ! Growing region: its old end node stays behind in contact. Shrinking or a single point: it opens.
      moved%active(candidate) = .not. from%active(other) .and. from%active(inner)
      moved%active(other) = .true.
      if (.not. from%active(other)) moved%reaction(other) = from%reaction(candidate)
      if (.not. moved%active(candidate)) moved%reaction(candidate) = 0.0_wp
      if (abs(offset) > 0.0_wp) call slide_node(problem%model, problem%tableau, moved%geometry, &
         & problem%candidates%element(:, candidate), -offset)
      if (abs(target) > 0.0_wp) call slide_node(problem%model, problem%tableau, moved%geometry, &
         & problem%candidates%element(:, other), target)
      done = .true.
   end subroutine hand_over

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

   !> The old solution at nominal coordinate s, on element `near` or the one next to it that contains s. Where a contact point
   !> or a load makes the resultants jump: beyond it.
   subroutine old_solution(problem, from, near, s, position, rotation, resultant)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from
      integer, intent(in) :: near
      real(wp), intent(in) :: s
      real(wp), intent(out) :: position(2), rotation, resultant(3)
      real(wp) :: u(6), tau, span(2)
      real(wp), parameter :: at_end = 1.0e-9_wp
      real(wp) :: at
      integer :: e, c, k
      e = near
      at = s
      ! A node moves less than one element, so two steps along the curve are enough.
      do k = 1, 2
         if (at < from%geometry%element(e)%s(1)) then
            call go_to(next_element(-1), 1)
         else if (at > from%geometry%element(e)%s(2) - at_end * (from%geometry%element(e)%s(2) - &
            & from%geometry%element(e)%s(1))) then
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
end module contact_hand_over
