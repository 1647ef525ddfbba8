!> Independent measures of an equilibrium point: balance of all and of every node, signs, complementarity, foundations' laws.
!> Nothing here uses the assembled residual: loads, support and contact reactions are summed from their definitions.
module balance
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, node_position, element_displacement, element_load, candidate_gap, candidate_opening, &
      & candidate_offset, obstacle_shift
   use obstacle_geometry, only: obstacle_gap
   use force_law, only: law_reaction
   use section_forces, only: end_forces
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use ge_element, only: ge_load_t, ge_interior
   use ul2_element, only: ul2_heat_scale
   use gauss_tableau, only: max_stages
   use path_record, only: accuracy_t
   implicit none
   private
   public :: measure_balance

   real(wp), parameter :: least_reaction = 1.0e-6_wp !! that signs are measured against, over the largest force

contains

   !> Raises the worst values in `accuracy` by those of one converged state.
   subroutine measure_balance(problem, state, residual, accuracy)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: residual
      type(accuracy_t), intent(inout) :: accuracy
      real(wp), parameter :: unsettled = 10.0_wp !! tolerances of the step, of the force scale: forces that are as good as none
      real(wp), allocatable :: support(:, :), left(:, :)
      real(wp) :: total(3), scale, first(3), second(3), x(2), force(3), gap, normal(2), bend, size_, largest, noise, middle(2)
      real(wp) :: push, spring
      type(ge_load_t) :: load
      integer :: e, i, node, c

      size_ = problem%size
      accuracy%residual = max(accuracy%residual, residual)
      allocate (support(3, problem%model%mesh%n_nodes), source=0.0_wp)
      middle = 0.5_wp * (maxval(state%geometry%x, 2) + minval(state%geometry%x, 2))
      total = 0.0_wp
      ! A foundation's force is no better than the rounding of its gap.
      noise = problem%ground%stiffest * rounding_gap(problem) * count(problem%ground%founded)
      scale = max(problem%force_floor, noise)
      elements: do e = 1, problem%model%mesh%n_elements
         call end_forces(problem, state, e, first, second)
         associate (a => problem%model%mesh%node(1, e), b => problem%model%mesh%node(2, e))
            support(:, a) = support(:, a) - first
            support(:, b) = support(:, b) + second
         end associate
         scale = max(scale, maxval(abs(first(1:2))), maxval(abs(second(1:2))), abs(first(3)) / size_, abs(second(3)) / size_)
         if (problem%model%mesh%family(e) /= family_ge) then
            load = element_load(problem, state, e)
            scale = max(scale, ul2_heat_scale * abs(load%strain) / problem%compliance(e)%axial)
         end if
         force = element_load_sum(problem, state, e, middle)
         ! What a foundation carries need not pass through any section.
         scale = max(scale, maxval(abs(force(1:2))))
         total = total + force
      end do elements
      left = support
      nodes: do node = 1, problem%model%mesh%n_nodes
         x = node_position(state, node) - middle
         force = problem%constant%node_force(:, node) + &
            & state%load_factor * problem%model%step(problem%step)%load%node_force(:, node)
         total = total + [force(1:2), force(3) + x(1) * force(2) - x(2) * force(1)]
         left(:, node) = left(:, node) - force + problem%spring(:, node) * state%u(:, node)
         where (.not. problem%model%fixed(:, node))
            support(:, node) = 0.0_wp
         elsewhere
            support(:, node) = support(:, node) - force
         end where
         force = support(:, node) - problem%spring(:, node) * state%u(:, node)
         scale = max(scale, maxval(abs(force(1:2))))
         total = total + [force(1:2), force(3) + x(1) * force(2) - x(2) * force(1)]
      end do nodes
      largest = 0.0_wp
      contacts: do c = 1, problem%candidates%n
         largest = max(largest, abs(state%reaction(c)))
      end do contacts
      scale = max(scale, largest)
      ! Reactions that are all rounding have no sign.
      largest = max(largest, least_reaction * scale)
      do c = 1, problem%candidates%n
         node = problem%candidates%node(c)
         call candidate_gap(problem, state, c, gap, normal, bend)
         x = node_position(state, node) - middle
         force(1:2) = state%reaction(c) * normal
         left(1:2, node) = left(1:2, node) - force(1:2)
         ! What the support of the same node already counted is not counted twice.
         do i = 1, 2
            if (problem%model%fixed(i, node)) force(i) = 0.0_wp
         end do
         total = total + [force(1:2), x(1) * force(2) - x(2) * force(1)]
         if (problem%coupling%entry(c) > 0) gap = candidate_opening(problem, state, c)
         if (problem%model%obstacle(problem%candidates%obstacle(c))%rigid .or. problem%coupling%entry(c) > 0) then
            ! A bilateral obstacle is left on neither side, nor the surface of a ground that settles.
            if (state%active(c) .or. .not. problem%candidates%bilateral(c)) &
               & accuracy%penetration = max(accuracy%penetration, merge(abs(gap), -gap, problem%candidates%bilateral(c) .or. &
               & (state%active(c) .and. problem%coupling%entry(c) > 0)) / size_)
            accuracy%complementarity = max(accuracy%complementarity, abs(state%reaction(c) * gap) / (largest * size_))
            if (problem%coupling%entry(c) > 0 .and. state%active(c)) accuracy%foundation = max(accuracy%foundation, &
               & (abs(gap) - rounding_gap(problem)) / problem%coupling%local(problem%coupling%entry(c)) / largest)
         else
            if (.not. problem%candidates%bilateral(c) .and. state%reaction(c) > 0.0_wp .and. gap > 0.0_wp) &
               & accuracy%complementarity = max(accuracy%complementarity, state%reaction(c) * gap / (largest * size_))
            call foundation_answer(problem, c, gap, push, spring)
            accuracy%foundation = max(accuracy%foundation, &
               & (abs(state%reaction(c) - push) - spring * rounding_gap(problem)) / largest)
         end if
         if (.not. problem%candidates%bilateral(c)) &
            & accuracy%tension = max(accuracy%tension, (-state%reaction(c) - &
            & unsettled * problem%model%step(problem%step)%tolerance * scale) / largest)
      end do
      call look_between()
      if (problem%ground%chain%n > 0) call add_foundations()
      ! Nothing but rounding: a structure that lies on its foundation without load.
      if (scale <= noise) return
      accuracy%force_balance = max(accuracy%force_balance, norm2(total(1:2)) / scale)
      accuracy%moment_balance = max(accuracy%moment_balance, abs(total(3)) / (scale * size_))
      where (problem%model%fixed) left = 0.0_wp
      accuracy%node_balance = max(accuracy%node_balance, maxval(abs(left(1:2, :))) / scale, &
         & maxval(abs(left(3, :))) / (scale * size_))

   contains

      !> How deep the middles of elements in contact with a rigid obstacle are behind it: what the mesh does not see.
      subroutine look_between()
         real(wp) :: at(2), turn, resultant(3)
         integer :: next, o
         do c = 1, problem%candidates%n
            next = problem%candidates%neighbour(2, c)
            if (next == 0) cycle
            o = problem%candidates%obstacle(c)
            if (.not. problem%model%obstacle(o)%rigid .or. problem%candidates%bilateral(c)) cycle
            if (.not. (state%active(c) .and. state%active(next))) cycle
            e = problem%candidates%element(2, c)
            if (problem%model%mesh%family(e) /= family_ge) cycle
            associate (g => state%geometry%element(e))
               call ge_interior(problem%tableau(problem%model%mesh%stages(e)), g%length, g%scale, g%angle, &
                  & problem%compliance(e), element_load(problem, state, e), element_displacement(problem, state, e), &
                  & state%z(:problem%z_size(e), e), 0.5_wp, at, turn, resultant)
            end associate
            at = at + node_position(state, problem%model%mesh%node(1, e)) - obstacle_shift(problem, state, o)
            call obstacle_gap(problem%model%obstacle(o), at, gap, normal, bend)
            accuracy%between = max(accuracy%between, -(gap + candidate_offset(problem, state, problem%candidates, c)) / size_)
         end do
      end subroutine look_between

      !> Foundations that act inside elements, from their pressure where it acts.
      subroutine add_foundations()
         type(inner_forces_t) :: inner
         real(wp) :: push(2), most, least, shortest
         integer :: q
         shortest = minval(state%geometry%element%length, mask=problem%ground%founded)
         most = 0.0_wp
         least = 0.0_wp
         do e = 1, problem%model%mesh%n_elements
            if (.not. problem%ground%founded(e)) cycle
            call foundation_forces(problem, state, e, inner)
            do q = 1, inner%n
               push = (state%geometry%element(e)%length * inner%weight(q) * inner%pressure(q)) * inner%normal(:, q)
               total = total + [push, (inner%x(1, q) - middle(1)) * push(2) - (inner%x(2, q) - middle(2)) * push(1)]
               if (problem%ground%chain%bilateral(inner%source(q))) cycle
               most = max(most, inner%pressure(q))
               least = min(least, inner%pressure(q))
            end do
         end do
         if (most > noise / shortest) accuracy%tension = max(accuracy%tension, -least / most)
      end subroutine add_foundations
   end subroutine measure_balance

   !> What a foundation's spring at a node answers to a gap.
   pure subroutine foundation_answer(problem, candidate, gap, push, spring)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: gap
      real(wp), intent(out) :: push, spring    !! force, and its derivative by the penetration
      real(wp) :: penetration
      penetration = -gap
      if (.not. problem%candidates%bilateral(candidate)) penetration = max(penetration, 0.0_wp)
      associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(candidate)))
         if (obstacle%law == 0) then
            push = obstacle%modulus * penetration
            spring = obstacle%modulus
         else
            call law_reaction(problem%model%law(obstacle%law), penetration, push, spring)
            push = obstacle%width * push
            spring = obstacle%width * spring
         end if
      end associate
      push = push * problem%candidates%tributary(candidate)
      spring = spring * problem%candidates%tributary(candidate)
   end subroutine foundation_answer

   !> Resultant force and moment about `middle` of the load on an element.
   function element_load_sum(problem, state, e, middle) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)
      real(wp) :: total(3), x(2, 2), u(6), phi, nn(2), t(2), nu(2), rho(2), position(2), direction(2, max_stages), force(2)
      type(ge_load_t) :: load
      integer :: i, s
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (all(abs(load%line) <= 0.0_wp) .and. abs(load%pressure) <= 0.0_wp) return
      do i = 1, 2
         x(:, i) = node_position(state, problem%model%mesh%node(i, e)) - middle
      end do
      associate (h => state%geometry%element(e)%length)
         if (problem%model%mesh%family(e) /= family_ge) then
            force = h * load%line + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1)]
            position = 0.5_wp * (x(:, 1) + x(:, 2))
            total = [force, position(1) * force(2) - position(2) * force(1)]
            return
         end if
         s = problem%model%mesh%stages(e)
         u = element_displacement(problem, state, e)
         associate (tab => problem%tableau(s), z => state%z(:, e))
            do i = 1, s
               phi = u(3) + h * problem%compliance(e)%bending * dot_product(tab%a(i, :s), z(4:3 + s)) + &
                  & tab%c(i) * h * load%curvature
               nn = z(1:2) - tab%c(i) * h * load%line
               if (problem%pressurised(e) .or. problem%ground%founded(e)) nn = z(2 + s + 2 * i:3 + s + 2 * i)
               t = [cos(state%geometry%element(e)%angle(i) + phi), sin(state%geometry%element(e)%angle(i) + phi)]
               nu = [-t(2), t(1)]
               rho = (1.0_wp + load%strain + dot_product(nn, t) * problem%compliance(e)%axial) * t + &
                  & dot_product(nn, nu) * problem%compliance(e)%shear * nu
               direction(:, i) = state%geometry%element(e)%scale * rho
            end do
            do i = 1, s
               position = x(:, 1) + h * matmul(direction(:, :s), tab%a(i, :s))
               force = h * tab%b(i) * (load%line + load%pressure * [-direction(2, i), direction(1, i)])
               total = total + [force, position(1) * force(2) - position(2) * force(1)]
            end do
         end associate
      end associate
   end function element_load_sum
end module balance
