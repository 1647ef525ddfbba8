!> What foundations do to one element: a quadrature of their forces over the part of it that is in contact.
!>
!> Gauss points fill the parts in contact (element_gap), so that they move with their ends. As the force vanishes there, it is a
!> smooth function of the displacements: Newton finds contact and equilibrium together, no reaction hops from point to point, and
!> nothing oscillates. A multi-linear law is cut at its corners likewise. Where the state settles the segment of the law all of the
!> element is on it, whatever its gap (ground_segments).
module element_foundation
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, closing_rate, unknown_push, rounding_steps
   use element_gap, only: element_gap_t, ground_gap, gap_look, gap_parts, gap_crossings, most_crossings, most_parts
   use force_law, only: foundation_reaction, carries, segment_open, segment_unknown
   use gauss_tableau, only: stage_basis
   use ground_segments, only: follows
   use inner_forces, only: inner_forces_t, clear_forces, add_force
   implicit none
   private
   public :: foundation_forces

contains

   !> Quadrature of the forces of all foundations on an element; none where it does not touch.
   subroutine foundation_forces(problem, state, e, list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(inout) :: list
      call clear_forces(list)
      if (problem%ground%founded(e)) call find_forces(problem, state, e, list)
   end subroutine foundation_forces

   !> The same where there are foundations: what this works with takes time to set up.
   subroutine find_forces(problem, state, e, list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(inout) :: list !! empty on entry
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
         gap = ground_gap(problem, state, c)
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

      !> Places in the element where the gap passes a corner of a multi-linear law, in order.
      subroutine find_corners()
         real(wp) :: found(most_crossings), next
         integer :: side, a, b, m
         corner = [real(wp) ::]
         associate (at => problem%model%law(problem%model%obstacle(obstacle)%law)%penetration)
            do side = -1, merge(1, -1, problem%ground%chain%bilateral(c)), 2
               do a = 2, size(at) - 1
                  call gap_crossings(problem, gap, side * at(a), m, found)
                  corner = [corner, found(:m)]
               end do
            end do
         end associate
         corners = size(corner)
         do a = 2, corners
            next = corner(a)
            do b = a - 1, 1, -1
               if (corner(b) <= next) exit
               corner(b + 1) = corner(b)
            end do
            corner(b + 1) = next
         end do
      end subroutine find_corners

      !> Gauss points of a part of the element, all of it in contact.
      subroutine fill(first, last)
         real(wp), intent(in) :: first, last
         real(wp) :: length
         integer :: q
         length = last - first
         if (length <= 1.0e-12_wp) return
         ! One point more than stages would ask long elements to be as straight between their stages as the surface is: what their
         ! polynomials miss of that would be multiplied by the stiffness.
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
         integer, intent(in) :: number           ! in its part
         real(wp), intent(in) :: tau, weight
         real(wp) :: value, normal(2), bend, push, spring, t(2), x(2)
         integer :: q
         call gap_look(problem, gap, tau, x, value, normal, bend)
         call foundation_reaction(problem%model, problem%model%obstacle(obstacle), -value, push, spring, state%segment(c))
         if (carries(state%segment(c)) .and. state%push(number, c) < unknown_push) &
            & push = min(max(state%push(number, c), push - spring * rounding), push + spring * rounding)
         t = [normal(2), -normal(1)]
         call add_force(list, q)
         list%tau(q) = tau
         list%weight(q) = weight
         call stage_basis(problem%tableau(s), tau, list%basis(:, q))
         list%force(:, q) = push * normal
         list%spring(q) = spring
         list%sway(:, 1, q) = -(push * bend) * t * t(1)
         list%sway(:, 2, q) = -(push * bend) * t * t(2)
         associate (motion => problem%model%step(problem%step)%load%motion(:, obstacle))
            list%approach(q) = dot_product(normal, motion) + closing_rate(problem, problem%ground%chain, c)
            list%rate(:, q) = matmul(list%sway(:, :, q), motion)
         end associate
         list%source(q) = c
         list%normal(:, q) = normal
         list%pressure(q) = push
         list%bend(q) = bend
         list%x(:, q) = x
      end subroutine add_point
   end subroutine find_forces
end module element_foundation
