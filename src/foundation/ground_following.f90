!> Rods in contact with foundations during Newton iterations: nodes move along the curved surface, and the boundary layer beside an
!> end of contact moves with this end.
!>
!> A Newton step is straight. A node that slides by d on a foundation with radius of curvature r would leave the surface by d^2/(2
!> r), and a stiff foundation would exert forces unrelated to the solution. An interface point may move by more than the boundary
!> layer length (EI/k)^(1/4) over which a foundation of stiffness k bends the rod; if the nodes then took the displacements of their
!> new material points, the boundary layer would not move with the interface point. Gap and angle between rod and surface are small
!> and determine the reaction. They are therefore changed by their linear parts in the step; the position along the surface and the
!> direction of the rod follow the surface.
!>
!> Interface points of a mesh (mark_t) are points of the rod at which the gap of a foundation has the value of a corner of its law.
!>
!> At the equilibrium position of an interface point the reaction is equal on both sides. The position has therefore no first-order
!> effect on forces, and the tangent with fixed interface points is exact at a solution, and symmetric. A point at the distance d
!> from this position leaves an unbalanced force dk (g - g_0) d, with the jump dk of the law's stiffness, the gap g at the point and
!> the gap g_0 at the corner of the law. By Newton's method d = -(g - g_0 + n.du) / g', with the slope g' of the gap along the rod,
!> the normal n and the displacement du of the point's node. The force is then that of a spring at the node, of stiffness dk (g -
!> g_0) / g' along the normal, plus a constant force. With both terms the iteration is Newton's method for displacements and
!> interface points together, for any stiffness of the foundation. Without them a point would move per iteration at most by the
!> length (EI/k)^(1/4) over which a foundation of stiffness k bends a rod. The boundary layer of this length moves with the point.
module ground_following
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, rod_direction, chain_gap, gap_slope, closing_rate, rounding_steps
   use node_rates, only: rod_rate, resultant_slopes, goes_on, next_along
   use conforming_span, only: conforming_slopes
   use force_law, only: carries, segment_unknown
   use gauss_tableau, only: max_stages
   use ground_segments, only: segment_stiffness
   implicit none
   private
   public :: follow_surface, in_moving_layers, move_layers, mark_spring, mark_step, is_live

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

   !> (elements) true for elements in contact whose section forces move_layers sets: all of them if a node of one moves, else none.
   pure function in_moving_layers(problem, before, shift) result(lying)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before        !! state before the nodes move
      real(wp), intent(in) :: shift(:)           !! (nodes) motion along the rod
      logical :: lying(problem%model%mesh%n_elements)
      logical :: moves
      integer :: c
      lying = .false.
      moves = .false.
      do c = 1, problem%ground%chain%n
         if (.not. pressed(before, c)) cycle
         associate (e => problem%ground%chain%element(2, c))
            lying(e) = .true.
            moves = moves .or. any(abs(shift(problem%model%mesh%node(:, e))) > 0.0_wp)
         end associate
      end do
      lying = lying .and. moves
   end function in_moving_layers

   !> Moves boundary layers with interface points: gaps, angles and section forces in the contact change linearly with the motion of
   !> the nodes along the rod; the rates are those on the contact side.
   subroutine move_layers(problem, before, shift, lying, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before        !! state before the nodes move
      real(wp), intent(in) :: shift(:)           !! (nodes) motion along the rod, in the nominal coordinate
      logical, intent(in) :: lying(:)            !! (elements) from in_moving_layers, at least one true
      type(state_t), intent(inout) :: state !! in: transferred to the new positions of the nodes; out: with moved boundary layers
      real(wp) :: gap(2), normal(2, 2), bend(2), rate(2), bow, lift, twist, way(2)
      real(wp), dimension(3, 0:max_stages + 1) :: slope, last ! slopes of an element and of the one before it
      integer :: c, e, i, known
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
      known = 0
      do i = 1, size(lying)
         e = problem%along(i)
         if (.not. lying(e)) cycle
         call find_slopes(e, slope)
         associate (first => problem%model%mesh%node(1, e), beside => problem%beside(1, problem%model%mesh%node(1, e)))
            if (joins(beside, e)) then
               if (known /= beside) call find_slopes(beside, last)
               ! The mean of both sides of a node, because the errors of polynomials have opposite signs at the ends of an element.
               slope(:, 0) = 0.5_wp * (slope(:, 0) + last(:, problem%model%mesh%stages(beside) + 1))
            end if
         end associate
         call move_stored(e)
         known = e
         last = slope
      end do

   contains

      !> Slopes along an element: those of its section forces, or of place and force on the track.
      subroutine find_slopes(element, slope)
         integer, intent(in) :: element
         real(wp), intent(out) :: slope(3, 0:max_stages + 1)
         if (problem%conforms(element) > 0) then
            call conforming_slopes(problem, before, element, slope(2:3, :))
            slope(1, :) = 0.0_wp
         else
            call resultant_slopes(problem, before, element, slope)
         end if
      end subroutine find_slopes

      !> True if what an element stores goes on in the next one.
      pure logical function joins(element, next)
         integer, intent(in) :: element, next   ! element: 0: none
         joins = .false.
         if (element == 0) return
         if (.not. problem%ground%founded(element) .or. next_along(problem, element) /= next) return
         joins = problem%conforms(element) == 0 .and. problem%conforms(next) == 0
         if (joins) joins = goes_on(problem, element)
         if (min(problem%conforms(element), problem%conforms(next)) > 0) joins = problem%candidates%obstacle( &
            & problem%conforms(element)) == problem%candidates%obstacle(problem%conforms(next))
      end function joins

      !> Moves what an element stores with its first end and its stages.
      subroutine move_stored(element)
         integer, intent(in) :: element
         real(wp) :: ends(2), by(3)
         logical :: on_track
         integer :: k, s
         s = problem%model%mesh%stages(element)
         on_track = problem%conforms(element) > 0
         ends = shift(problem%model%mesh%node(:, element))
         associate (z => state%z(:, element), first => ends(1) * slope(:, 0))
            z = before%z(:, element)
            if (on_track) then
               z(1) = z(1) + first(3)
            else
               z(:3) = z(:3) + first
            end if
            do k = 1, s
               by = (ends(1) + problem%tableau(s)%c(k) * (ends(2) - ends(1))) * slope(:, k)
               if (on_track) then
                  z(1 + k) = z(1 + k) + by(3)
                  z(1 + s + k) = z(1 + s + k) + by(2) - first(2)
               else
                  z(3 + k) = z(3 + k) + by(3)
                  z(2 + s + 2 * k:3 + s + 2 * k) = z(2 + s + 2 * k:3 + s + 2 * k) + by(1:2)
               end if
            end do
         end associate
      end subroutine move_stored
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
      angle = rod_direction(problem, state, problem%ground%chain%element(side, candidate), 3 - side)
   end function direction

   !> Angle between two unit vectors, > 0 counterclockwise.
   pure real(wp) function turn(pair)
      real(wp), intent(in) :: pair(2, 2)         !! (components, vectors) two unit vectors
      turn = atan2(pair(1, 1) * pair(2, 2) - pair(2, 1) * pair(1, 2), dot_product(pair(:, 1), pair(:, 2)))
   end function turn

   !> True for an interface point that Newton's method moves: the state prescribes different segments of the law on its two sides.
   pure logical function is_live(problem, state, m)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m
      associate (c => problem%mark(m)%candidate)
         is_live = all(state%segment(c) /= segment_unknown) .and. state%segment(c(1)) /= state%segment(c(2))
      end associate
   end function is_live

   !> Gap at an interface point minus gap at its corner of the law, and derivative of the gap with respect to the nominal
   !> coordinate.
   pure subroutine mark_error(problem, state, m, error, slope, normal)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m
      real(wp), intent(out) :: error, slope
      real(wp), intent(out) :: normal(2)     !! unit normal of the obstacle at the point
      real(wp) :: gap, bend, rate(2), turn, way(2)
      associate (mark => problem%mark(m), c => problem%mark(m)%candidate(2), chain => problem%ground%chain)
         call chain_gap(problem, state, chain, c, gap, normal, bend)
         error = gap - mark%level
         call rod_rate(problem, state, chain%element(2, c), rate, turn, way)
         slope = gap_slope(problem, chain, c, state%geometry%x(:, mark%node), normal, rate, way)
      end associate
   end subroutine mark_error

   !> Effect on its node of an interface point that is not at its equilibrium position: a spring along the normal, an unbalanced
   !> force, and the derivative of this force by the load factor. All are zero at the equilibrium position.
   pure subroutine mark_spring(problem, state, m, spring, force, rate, normal)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m
      real(wp), intent(out) :: spring        !! stiffness of the spring [force/length]
      real(wp), intent(out) :: force, rate   !! force along the normal; minus its derivative by the load factor
      real(wp), intent(out) :: normal(2)     !! unit normal of the obstacle at the node
      real(wp) :: error, slope, jump
      spring = 0.0_wp
      force = 0.0_wp
      rate = 0.0_wp
      normal = 0.0_wp
      if (.not. is_live(problem, state, m)) return
      call mark_error(problem, state, m, error, slope, normal)
      associate (c => problem%mark(m)%candidate, chain => problem%ground%chain)
         if (.not. abs(slope) > 0.0_wp) return
         jump = segment_stiffness(problem, c(2), state%segment(c(2))) - segment_stiffness(problem, c(1), state%segment(c(1)))
         spring = jump * error / slope
         force = spring * error
         rate = spring * (dot_product(normal, problem%model%step(problem%step)%load%motion(:, chain%obstacle(c(2)))) + &
            & closing_rate(problem, chain, c(2)))
      end associate
   end subroutine mark_spring

   !> Distance by which an interface point moves along its rod in a Newton step, in the nominal coordinate. It follows from the
   !> linear equations in the header of this module.
   pure real(wp) function mark_step(problem, before, after, m) result(distance)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before, after !! states before and after the step, with the same nodes
      integer, intent(in) :: m
      real(wp) :: error, slope, normal(2)
      distance = 0.0_wp
      if (.not. is_live(problem, after, m)) return
      call mark_error(problem, before, m, error, slope, normal)
      if (.not. abs(slope) > 0.0_wp) return
      associate (mark => problem%mark(m), chain => problem%ground%chain, load => problem%model%step(problem%step)%load)
         error = error + dot_product(normal, after%u(1:2, mark%node) - before%u(1:2, mark%node)) - &
            & (after%load_factor - before%load_factor) * (closing_rate(problem, chain, mark%candidate(2)) + &
            & dot_product(normal, load%motion(:, chain%obstacle(mark%candidate(2)))))
      end associate
      ! If the gap deviates from its value at the corner by rounding only, the interface point is not moved.
      if (abs(error) > rounding_steps * epsilon(error) * norm2(after%u(1:2, problem%mark(m)%node))) distance = -error / slope
   end function mark_step
end module ground_following
