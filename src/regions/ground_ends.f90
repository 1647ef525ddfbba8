!> Ends of a foundation's chain that are fixed by supports on the foundation's surface, so that the gap is zero there at every load.
!>
!> If the contact beside such an end is lost, its length shrinks to zero. The least gap then tends to zero with the power 3/2 of the
!> slope at the end and remains zero after the loss: it does not change its sign, so that the loss could not be located by it. The
!> gap divided by the distance from the end (or by the square of the distance, if the support also fixes the slope) is smooth, and
!> changes its sign where the slope (or the curvature) is zero.
module ground_ends
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, chain_gap
   use element_families, only: collocates
   use node_rates, only: rod_derivatives
   use element_gap, only: gap_root_t
   implicit none
   private
   public :: root_orders, chain_roots

contains

   !> Orders of the gap's roots at the first and the last end of a contact's chain; 0: no root inside the given range.
   function root_orders(problem, state, contact, from, to) result(order)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact          !! index of a contact that has a chain
      real(wp), intent(in) :: from, to        !! range of arc lengths along the chain
      integer :: order(2)
      real(wp) :: gap, slope, bend
      integer :: side, c, e
      order = 0
      if (problem%ground%chain%chain_length(contact) > 0.0_wp) return
      do side = 1, 2
         call chain_end(problem, contact, side, c, e)
         if (c == 0) cycle
         if (problem%ground%chain%s(c) < from .or. problem%ground%chain%s(c) > to) cycle
         associate (node => problem%ground%chain%node(c), mesh => problem%model%mesh)
            if (.not. all(problem%model%fixed(1:2, node)) .or. .not. collocates(mesh%family(e))) cycle
            call gap_at_rod_end(problem, state, side, c, e, gap, slope, bend)
            if (abs(gap) > rounding_gap(problem)) cycle
            order(side) = 1
            if (problem%model%fixed(3, node) .and. abs(slope) * problem%size <= rounding_gap(problem)) order(side) = 2
         end associate
      end do
   end function root_orders

   !> Roots and their positions as arc lengths of the chain; empty if all orders are 0.
   function chain_roots(problem, state, contact, order) result(root)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      integer, intent(in) :: order(2)         !! orders of the roots at the first and last end; 0: no root at this end
      type(gap_root_t) :: root(count(order > 0))
      real(wp) :: gap, slope, bend
      integer :: side, c, e, n
      n = 0
      do side = 1, 2
         if (order(side) == 0) cycle
         n = n + 1
         call chain_end(problem, contact, side, c, e)
         call gap_at_rod_end(problem, state, side, c, e, gap, slope, bend)
         root(n)%at = problem%ground%chain%s(c)
         root(n)%order = order(side)
         root(n)%scale = problem%size
         root(n)%limit = slope * problem%size
         if (order(side) == 2) root(n)%limit = 0.5_wp * bend * problem%size**2
      end do
   end function chain_roots

   !> Finds the candidate at an end of an open chain, and the element beside it; 0: none.
   pure subroutine chain_end(problem, contact, side, candidate, element)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, side    !! index of the contact; side 1: first end, 2: last end of its chain
      integer, intent(out) :: candidate, element
      associate (chain => problem%ground%chain)
         candidate = findloc(chain%contact == contact .and. chain%element(side, :) == 0 .and. chain%element(3 - side, :) > 0, &
            & .true., 1, back=side == 2)
         element = 0
         if (candidate > 0) element = chain%element(3 - side, candidate)
      end associate
   end subroutine chain_end

   !> Computes the gap at an end of a rod and its first and second derivatives with respect to the stress-free distance from the
   !> end.
   subroutine gap_at_rod_end(problem, state, side, candidate, e, gap, slope, bend)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: side, candidate, e
      real(wp), intent(out) :: gap, slope, bend
      real(wp) :: normal(2), x(2, 3), curvature
      call chain_gap(problem, state, problem%ground%chain, candidate, gap, normal, curvature)
      call rod_derivatives(problem, state, e, side, x)
      slope = merge(1.0_wp, -1.0_wp, side == 1) * dot_product(normal, x(:, 1))
      bend = dot_product(normal, x(:, 2)) + curvature * (normal(1) * x(2, 1) - normal(2) * x(1, 1))**2
   end subroutine gap_at_rod_end
end module ground_ends
