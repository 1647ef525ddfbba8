!> Independent measures of an equilibrium point: global balance of forces and moments, signs and complementarity.
!> Nothing here uses the assembled residual: loads, support and contact reactions are summed from their definitions.
module balance
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t
   use rod_state, only: state_t, node_position, element_displacement, element_load, candidate_gap
   use section_forces, only: end_forces
   use ge_element, only: ge_load_t
   use gauss_tableau, only: max_stages
   use path_record, only: accuracy_t
   implicit none
   private
   public :: measure_balance

contains

   !> Raises the worst values in `accuracy` by those of one converged state.
   subroutine measure_balance(problem, state, residual, accuracy)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: residual
      type(accuracy_t), intent(inout) :: accuracy
      real(wp), parameter :: negligible = 1.0e-6_wp !! of the force scale: where contact ends, all there is may be rounding
      real(wp), allocatable :: support(:, :)
      real(wp) :: total(3), scale, first(3), second(3), x(2), force(3), gap, normal(2), bend, size_, largest
      integer :: e, i, node, c

      size_ = problem%size
      accuracy%residual = max(accuracy%residual, residual)
      allocate (support(3, problem%model%mesh%n_nodes), source=0.0_wp)
      total = 0.0_wp
      scale = problem%force_floor
      elements: do e = 1, problem%model%mesh%n_elements
         call end_forces(problem, state, e, first, second)
         associate (a => problem%model%mesh%node(1, e), b => problem%model%mesh%node(2, e))
            support(:, a) = support(:, a) - first
            support(:, b) = support(:, b) + second
         end associate
         scale = max(scale, maxval(abs(first(1:2))), maxval(abs(second(1:2))), abs(first(3)) / size_, abs(second(3)) / size_)
         force = element_load_sum(problem, state, e)
         total = total + force
      end do elements
      nodes: do node = 1, problem%model%mesh%n_nodes
         x = node_position(state, node)
         force = problem%constant%node_force(:, node) + &
            & state%load_factor * problem%model%step(problem%step)%load%node_force(:, node)
         total = total + [force(1:2), force(3) + x(1) * force(2) - x(2) * force(1)]
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
      do c = 1, problem%candidates%n
         node = problem%candidates%node(c)
         call candidate_gap(problem, state, c, gap, normal, bend)
         x = node_position(state, node)
         force(1:2) = state%reaction(c) * normal
         ! What the support of the same node already counted is not counted twice.
         do i = 1, 2
            if (problem%model%fixed(i, node)) force(i) = 0.0_wp
         end do
         total = total + [force(1:2), x(1) * force(2) - x(2) * force(1)]
         if (problem%model%obstacle(problem%candidates%obstacle(c))%rigid) then
            ! A bilateral obstacle is left on neither side.
            if (state%active(c) .or. .not. problem%candidates%bilateral(c)) &
               & accuracy%penetration = max(accuracy%penetration, merge(abs(gap), -gap, problem%candidates%bilateral(c)) / size_)
            if (largest > 0.0_wp) accuracy%complementarity = max(accuracy%complementarity, &
               & abs(state%reaction(c) * gap) / (largest * size_))
         else if (.not. problem%candidates%bilateral(c) .and. state%reaction(c) > 0.0_wp .and. gap > 0.0_wp .and. &
            & largest > 0.0_wp) then
            accuracy%complementarity = max(accuracy%complementarity, state%reaction(c) * gap / (largest * size_))
         end if
         if (largest > 0.0_wp .and. .not. problem%candidates%bilateral(c)) &
            & accuracy%tension = max(accuracy%tension, -state%reaction(c) / max(largest, negligible * scale))
      end do
      accuracy%force_balance = max(accuracy%force_balance, norm2(total(1:2)) / scale)
      accuracy%moment_balance = max(accuracy%moment_balance, abs(total(3)) / (scale * size_))
   end subroutine measure_balance

   !> Resultant force and moment about the origin of the load on an element.
   function element_load_sum(problem, state, e) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: total(3), x(2, 2), u(6), phi, nn(2), t(2), nu(2), rho(2), position(2), direction(2, max_stages), force(2)
      type(ge_load_t) :: load
      integer :: i, s
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (all(abs(load%line) <= 0.0_wp) .and. abs(load%pressure) <= 0.0_wp) return
      do i = 1, 2
         x(:, i) = node_position(state, problem%model%mesh%node(i, e))
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
               phi = u(3) + h * problem%compliance(e)%bending * dot_product(tab%a(i, :s), z(4:3 + s))
               nn = z(1:2) - tab%c(i) * h * load%line
               if (problem%pressurised(e)) nn = z(2 + s + 2 * i:3 + s + 2 * i)
               t = [cos(state%geometry%element(e)%angle(i) + phi), sin(state%geometry%element(e)%angle(i) + phi)]
               nu = [-t(2), t(1)]
               rho = (1.0_wp + dot_product(nn, t) * problem%compliance(e)%axial) * t + &
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
