!> Interface points of a mesh (mark_t): points of the rod at which the gap of a foundation has the value of a corner of its law.
!>
!> At the equilibrium position of an interface point the reaction is equal on both sides. The position has therefore no first-order
!> effect on forces, and the tangent with fixed interface points is exact at a solution, and symmetric. A point at the distance d
!> from this position leaves an unbalanced force dk (g - g_0) d, with the jump dk of the law's stiffness, the gap g at the point and
!> the gap g_0 at the corner of the law. By Newton's method d = -(g - g_0 + n.du) / g', with the slope g' of the gap along the rod,
!> the normal n and the displacement du of the point's node. The force is then that of a spring at the node, of stiffness dk (g -
!> g_0) / g' along the normal, plus a constant force. With both terms the iteration is Newton's method for displacements and
!> interface points together, for any stiffness of the foundation. Without them a point would move per iteration at most by the
!> length (EI/k)^(1/4) over which a foundation of stiffness k bends a rod. The boundary layer of this length moves with the point,
!> see ground_following.
module ground_marks
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, chain_gap, gap_slope, closing_rate
   use node_rates, only: rod_rate
   use ground_segments, only: segment_stiffness
   use force_law, only: segment_unknown
   use rod_state, only: rounding_steps
   implicit none
   private
   public :: mark_spring, mark_step, is_live

contains

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
      real(wp), intent(out), optional :: normal(2) !! unit normal of the obstacle at the point
      real(wp) :: gap, n(2), bend, rate(2), turn, way(2)
      associate (mark => problem%mark(m), c => problem%mark(m)%candidate(2), chain => problem%ground%chain)
         call chain_gap(problem, state, chain, c, gap, n, bend)
         error = gap - mark%level
         call rod_rate(problem, state, chain%element(2, c), rate, turn, way)
         slope = gap_slope(problem, chain, c, state%geometry%x(:, mark%node), n, rate, way)
      end associate
      if (present(normal)) normal = n
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
end module ground_marks
