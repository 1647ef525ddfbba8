!> Forces of foundations on one element, by a quadrature over the part of the element that is in contact.
!>
!> The Gauss points are in the parts of the element in contact (element_gap) and move with the ends of these parts. The force is
!> zero at the ends, so that the integral is a smooth function of the displacements: Newton's method finds contact and equilibrium
!> together, without jumps of reactions between points and without oscillation. In the same way the corners of a multi-linear law
!> divide the element. If the state prescribes a segment of the law, this segment applies to the whole element, whatever the gap
!> (ground_segments).
module element_foundation
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, closing_rate, unknown_push, rounding_steps
   use element_gap, only: element_gap_t, ground_gap, gap_and_gradient, gap_parts, gap_crossings, most_crossings, most_parts
   use rod_profile, only: new_profile
   use force_law, only: foundation_reaction, carries, segment_open, segment_unknown
   use gauss_tableau, only: stage_basis
   use ground_segments, only: follows
   use rod_load, only: inner_forces_t, clear_forces, add_force
   use ordering, only: ascending
   implicit none
   private
   public :: foundation_forces, all_foundation_forces

contains

   !> Quadrature of the forces of all foundations on an element; it has no points if the element is not in contact.
   subroutine foundation_forces(problem, state, e, list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(inout) :: list
      call clear_forces(list)
      if (problem%ground%founded(e)) call find_forces(problem, state, e, list)
   end subroutine foundation_forces

   !> Quadratures of the forces of all foundations on all elements.
   function all_foundation_forces(problem, state) result(list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(inner_forces_t) :: list(problem%model%mesh%n_elements)
      integer :: e
      do e = 1, size(list)
         call foundation_forces(problem, state, e, list(e))
      end do
   end function all_foundation_forces

   !> Computes the quadrature for an element on which foundations act. A separate procedure, because its work arrays take time to
   !> set up.
   subroutine find_forces(problem, state, e, list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(inout) :: list !! in: empty; out: quadrature of the forces
      type(element_gap_t) :: gap
      real(wp) :: part(2, most_parts), from, rounding
      real(wp), allocatable :: corner(:)
      integer :: i, j, k, c, s, obstacle, n, corners

      s = problem%model%mesh%stages(e)
      rounding = rounding_steps * epsilon(rounding) * maxval(abs(state%u(1:2, problem%model%mesh%node(:, e))))
      do i = problem%ground%first(e), problem%ground%first(e + 1) - 1
         c = problem%ground%candidate(i)
         obstacle = problem%ground%chain%obstacle(c)
         if (state%segment(c) == segment_open) cycle
         gap = ground_gap(problem, state, c, new_profile(problem, state, e))
         call gap_parts(problem, gap, n, part)
         if (n == 0) cycle
         corners = 0
         if (problem%model%obstacle(obstacle)%law > 0 .and. state%segment(c) == segment_unknown) call find_corners()
         do k = 1, n
            from = part(1, k)
            do j = 1, corners
               if (corner(j) <= from .or. corner(j) >= part(2, k)) cycle
               call fill(from, corner(j))
               from = corner(j)
            end do
            call fill(from, part(2, k))
         end do
      end do

   contains

      !> Positions in the element at which the gap passes a corner of a multi-linear law, in ascending order.
      subroutine find_corners()
         real(wp) :: found(most_crossings)
         integer :: side, a, m
         corner = [real(wp) ::]
         associate (at => problem%model%law(problem%model%obstacle(obstacle)%law)%penetration)
            do side = -1, merge(1, -1, problem%ground%chain%bilateral(c)), 2
               do a = 2, size(at) - 1
                  call gap_crossings(problem, gap, side * at(a), m, found)
                  corner = [corner, found(:m)]
               end do
            end do
         end associate
         corner = corner(ascending(corner))
         corners = size(corner)
      end subroutine find_corners

      !> Adds the Gauss points of a part of the element that is entirely in contact.
      subroutine fill(first, last)
         real(wp), intent(in) :: first, last
         real(wp) :: length
         integer :: q
         length = last - first
         if (length <= 1.0e-12_wp) return
         ! An element too long for its foundation has as many quadrature points as stages. With one point more it would follow the
         ! surface between its stages, and the error of its polynomial there would be multiplied by the stiffness.
         if (carries(state%segment(c)) .and. .not. follows(problem, state, c)) then
            do q = 1, s
               call add_point(q, first + problem%tableau(s)%c(q) * length, problem%tableau(s)%b(q) * length)
            end do
            return
         end if
         do q = 1, s + 1
            call add_point(q, first + problem%ground%rule_place(q, s) * length, problem%ground%rule_weight(q, s) * length)
         end do
      end subroutine fill

      subroutine add_point(number, tau, weight)
         integer, intent(in) :: number           ! index of the point in this part of the element
         real(wp), intent(in) :: tau, weight
         real(wp) :: value, normal(2), bend, push, spring, t(2), x(2)
         integer :: q
         call gap_and_gradient(problem, gap, tau, x, value, normal, bend)
         call foundation_reaction(problem%model, problem%model%obstacle(obstacle), -value, push, spring, state%segment(c))
         if (carries(state%segment(c)) .and. state%push(number, c) < unknown_push) &
            & push = min(max(state%push(number, c), push - spring * rounding), push + spring * rounding)
         t = [normal(2), -normal(1)]
         ! An element that is in contact as a whole has one point more than stages.
         call add_force(list, s + 1, q)
         list%at(q)%tau = tau
         list%at(q)%weight = weight
         call stage_basis(problem%tableau(s), tau, list%at(q)%basis)
         list%at(q)%force = push * normal
         list%at(q)%spring = spring
         list%at(q)%sway(:, 1) = -(push * bend) * t * t(1)
         list%at(q)%sway(:, 2) = -(push * bend) * t * t(2)
         associate (motion => problem%model%step(problem%step)%load%motion(:, obstacle))
            list%at(q)%approach = dot_product(normal, motion) + closing_rate(problem, problem%ground%chain, c)
            list%at(q)%rate = matmul(list%at(q)%sway, motion)
         end associate
         list%at(q)%source = c
         list%at(q)%normal = normal
         list%at(q)%pressure = push
         list%at(q)%bend = bend
         list%at(q)%x = x
      end subroutine add_point
   end subroutine find_forces
end module element_foundation
