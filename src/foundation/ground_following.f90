!> Rods in contact with foundations during Newton iterations: nodes move along the curved surface, and the boundary layer beside an
!> end of contact moves with this end.
!>
!> A Newton step is straight. A node that slides by d on a foundation with radius of curvature r would leave the surface by d^2/(2
!> r), and a stiff foundation would exert forces unrelated to the solution. An interface point may move by more than the boundary
!> layer length (EI/k)^(1/4) over which a foundation of stiffness k bends the rod; if the nodes then took the displacements of their
!> new material points, the boundary layer would not move with the interface point. Gap and angle between rod and surface are small
!> and determine the reaction. They are therefore changed by their linear parts in the step; the position along the surface and the
!> direction of the rod follow the surface.
module ground_following
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, chain_gap, gap_slope, closing_rate, rounding_steps
   use node_rates, only: rod_rate
   use force_law, only: carries
   use state_transfer, only: carry_stored
   use rod_geometry, only: shift_nodes
   implicit none
   private
   public :: follow_surface, move_layers

   real(wp), parameter :: short = 1.0e-3_wp !! distance over which the boundary layer counts as straight, over the length of an
   !! element

contains

   !> Removes from a Newton step the nonlinear part of the changes of gap and angle at contact nodes.
   subroutine follow_surface(problem, before, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before        !! state before the step, with the same nodes
      type(state_t), intent(inout) :: state      !! state after the step; corrected
      real(wp) :: gap(2), normal(2, 2), bend(2), way(2), wanted, load, linear
      integer :: c
      load = state%load_factor - before%load_factor
      do c = 1, problem%ground%chain%n
         if (.not. lies(problem, before, c)) cycle
         associate (chain => problem%ground%chain, node => problem%ground%chain%node(c))
            call chain_gap(problem, before, chain, c, gap(1), normal(:, 1), bend(1))
            way = state%u(1:2, node) - before%u(1:2, node) - &
               & load * problem%model%step(problem%step)%load%motion(:, chain%obstacle(c))
            wanted = gap(1) + dot_product(normal(:, 1), way) - load * closing_rate(problem, chain, c)
            linear = -bend(1) * (normal(2, 1) * way(1) - normal(1, 1) * way(2))
            ! The effect of a smaller rotation is of second order and below rounding.
            if (abs(linear) <= sqrt(epsilon(linear))) cycle
            call chain_gap(problem, state, chain, c, gap(2), normal(:, 2), bend(2))
            state%u(1:2, node) = state%u(1:2, node) + (wanted - gap(2)) * normal(:, 2)
            state%u(3, node) = state%u(3, node) + turn(normal) - linear
         end associate
      end do
   end subroutine follow_surface

   !> Moves boundary layers with interface points: gaps, angles and section forces in the contact change linearly with the motion of
   !> the nodes along the rod; the rates are those on the contact side.
   subroutine move_layers(problem, before, shift, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before        !! state before the nodes move
      real(wp), intent(in) :: shift(:)           !! (nodes) motion along the rod, in the nominal coordinate
      type(state_t), intent(inout) :: state !! in: transferred to the new positions of the nodes; out: with moved boundary layers
      type(state_t) :: moved(2)
      real(wp) :: part, gap(2), normal(2, 2), bend(2), rate(2), bow, lift, twist, way(2)
      real(wp) :: beside(size(shift))            ! motion along the rod of the nodes of elements in contact
      logical :: lying(problem%model%mesh%n_elements)
      integer :: c, e, side
      part = huge(part)
      do c = 1, problem%ground%chain%n
         if (.not. pressed(before, c)) cycle
         e = problem%ground%chain%element(2, c)
         associate (far => maxval(abs(shift(problem%model%mesh%node(:, e)))), s => before%geometry%element(e)%s)
            if (far > 0.0_wp) part = min(part, short * (s(2) - s(1)) / far)
         end associate
      end do
      if (.not. part < huge(part)) return
      do c = 1, problem%ground%chain%n
         if (.not. lies(problem, before, c)) cycle
         e = problem%ground%chain%element(2, c)
         associate (chain => problem%ground%chain, node => problem%ground%chain%node(c))
            if (e == 0) cycle
            call chain_gap(problem, before, chain, c, gap(1), normal(:, 1), bend(1))
            call chain_gap(problem, state, chain, c, gap(2), normal(:, 2), bend(2))
            call rod_rate(problem, before, e, rate, bow, way)
            bow = bow + bend(1) * (normal(2, 1) * rate(1) - normal(1, 1) * rate(2))
            lift = gap(1) + gap_slope(problem, chain, c, before%geometry%x(:, node), normal(:, 1), rate, way) * shift(node) - gap(2)
            twist = bow * shift(node) - (direction(problem, state, c) - direction(problem, before, c) - turn(normal))
            ! Smaller differences are rounding of positions and directions. All larger ones are applied, even for short motions:
            ! otherwise the interpolation error of transferred polynomials would make the iteration oscillate.
            if (abs(lift) > rounding_steps * epsilon(lift) * problem%size) &
               & state%u(1:2, node) = state%u(1:2, node) + lift * normal(:, 2)
            if (abs(twist) > rounding_steps * epsilon(twist)) state%u(3, node) = state%u(3, node) + twist
         end associate
      end do
      beside = 0.0_wp
      lying = .false.
      do c = 1, problem%ground%chain%n
         if (.not. pressed(before, c)) cycle
         e = problem%ground%chain%element(2, c)
         lying(e) = .true.
         associate (nodes => problem%model%mesh%node(:, e))
            beside(nodes) = part * shift(nodes)
         end associate
      end do
      do side = 1, 2
         moved(side) = before
         call shift_nodes(problem%model, problem%tableau, merge(beside, -beside, side == 1), moved(side)%geometry)
         call carry_stored(problem, before, lying, moved(side))
      end do
      do c = 1, problem%ground%chain%n
         if (.not. pressed(before, c)) cycle
         e = problem%ground%chain%element(2, c)
         ! Central differences are used, because the errors of polynomials have opposite signs at the two ends of an element.
         state%z(:, e) = before%z(:, e) + (moved(1)%z(:, e) - moved(2)%z(:, e)) / (2.0_wp * part)
      end do
   end subroutine move_layers

   !> True if the state prescribes contact for the element after a candidate of the foundations' chain.
   pure logical function pressed(state, candidate)
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      pressed = carries(state%segment(candidate))
   end function pressed

   !> True if the state prescribes contact for an element beside a candidate.
   pure logical function lies(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      lies = pressed(state, candidate)
      associate (last => problem%ground%chain%neighbour(1, candidate))
         if (last > 0) lies = lies .or. pressed(state, last)
      end associate
   end function lies

   !> Tangent angle of the rod at a candidate.
   pure real(wp) function direction(problem, state, candidate) result(angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer :: side
      side = merge(2, 1, problem%ground%chain%element(2, candidate) > 0)
      associate (e => problem%ground%chain%element(side, candidate))
         angle = state%geometry%element(e)%end_angle(3 - side) + state%u(3, problem%ground%chain%node(candidate))
      end associate
   end function direction

   !> Angle between two unit vectors, > 0 counterclockwise.
   pure real(wp) function turn(pair)
      real(wp), intent(in) :: pair(2, 2)         !! (components, vectors) two unit vectors
      turn = atan2(pair(1, 1) * pair(2, 2) - pair(2, 1) * pair(1, 2), dot_product(pair(:, 1), pair(:, 2)))
   end function turn
end module ground_following
