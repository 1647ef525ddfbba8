!> How a rod goes on from the nodes of a GE element: by its differential equations, as exact as the resultants of the node.
module node_rates
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_load, element_displacement
   use reference_curve, only: curve_point, curve_bend
   use ge_element, only: ge_load_t, ge_end_forces
   use gauss_tableau, only: max_stages
   implicit none
   private
   public :: rod_rate, rod_derivatives, force_on_ground

contains

   !> Rates of position and direction, per unit of the nominal coordinate.
   pure subroutine rod_rate(problem, state, e, rate, turn)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e               !! GE, on a curve
      real(wp), intent(out) :: rate(2)       !! of the deformed position
      real(wp), intent(out) :: turn          !! of the direction of the section
      real(wp) :: t(2), angle, x(2), speed, bend
      type(ge_load_t) :: load
      load = element_load(problem, state, e)
      associate (g => state%geometry%element(e), z => state%z(:, e), compliance => problem%compliance(e), &
         & curve => problem%model%curve(problem%model%mesh%curve(e)))
         call curve_point(curve, problem%model%imperfection, g%s(1), x, angle, speed)
         call curve_bend(curve, problem%model%imperfection, g%s(1), bend)
         angle = g%end_angle(1) + state%u(3, problem%model%mesh%node(1, e))
         t = [cos(angle), sin(angle)]
         rate = speed * ((1.0_wp + load%strain + compliance%axial * dot_product(z(1:2), t)) * t + &
            & (compliance%shear * (t(1) * z(2) - t(2) * z(1))) * [-t(2), t(1)])
         turn = speed * (bend + load%curvature + compliance%bending * z(3))
      end associate
   end subroutine rod_rate

   !> Derivatives of the deformed position by the stress-free length at an end of a GE element. Where a foundation pushes, only of
   !> rods that do not shear: its force is not known here, only what comes of it in the resultants.
   pure subroutine rod_derivatives(problem, state, e, side, x, rotation)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      real(wp), intent(out) :: x(2, 3)       !! first, second, third
      real(wp), intent(out) :: rotation(2)   !! and of the rotation: first, second
      type(ge_load_t) :: load
      real(wp), dimension(2) :: n, dn, ddn, t, nu
      real(wp) :: m, angle, bend, bend_rate, turn, turn_rate, along(0:2), across(0:2)
      load = element_load(problem, state, e)
      call end_resultants(problem, state, e, side, n, m)
      associate (g => state%geometry%element(e), compliance => problem%compliance(e), c => problem%model%mesh%curve(e))
         angle = g%end_angle(side) + state%u(3, problem%model%mesh%node(side, e))
         bend = 0.0_wp
         bend_rate = 0.0_wp
         if (c > 0) call curve_bend(problem%model%curve(c), problem%model%imperfection, g%s(side), bend, bend_rate)
         t = [cos(angle), sin(angle)]
         nu = [-t(2), t(1)]
         turn = bend + load%curvature + compliance%bending * m
         ! x' = along t + across nu, and t' = turn nu, nu' = -turn t.
         along(0) = 1.0_wp + load%strain + compliance%axial * dot_product(n, t)
         across(0) = compliance%shear * dot_product(n, nu)
         rotation(1) = load%curvature + compliance%bending * m
         x(:, 1) = along(0) * t + across(0) * nu
         dn = -load%line - load%pressure * [-x(2, 1), x(1, 1)]
         along(1) = compliance%axial * (dot_product(dn, t) + turn * dot_product(n, nu))
         across(1) = compliance%shear * (dot_product(dn, nu) - turn * dot_product(n, t))
         x(:, 2) = (along(1) - turn * across(0)) * t + (across(1) + turn * along(0)) * nu
         ddn = -load%pressure * [-x(2, 2), x(1, 2)]
         rotation(2) = -compliance%bending * (x(1, 1) * n(2) - x(2, 1) * n(1))
         turn_rate = bend_rate + rotation(2)
         along(2) = compliance%axial * (dot_product(ddn, t) + 2.0_wp * turn * dot_product(dn, nu) + &
            & turn_rate * dot_product(n, nu) - turn**2 * dot_product(n, t))
         across(2) = compliance%shear * (dot_product(ddn, nu) - 2.0_wp * turn * dot_product(dn, t) - &
            & turn_rate * dot_product(n, t) - turn**2 * dot_product(n, nu))
         x(:, 3) = (along(2) - 2.0_wp * turn * across(1) - turn_rate * across(0) - turn**2 * along(0)) * t + &
            & (across(2) + 2.0_wp * turn * along(1) + turn_rate * along(0) - turn**2 * across(0)) * nu
      end associate
   end subroutine rod_derivatives

   !> (n_x, n_y) and m at an end of a GE element, in global axes.
   pure subroutine end_resultants(problem, state, e, side, n, m)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      real(wp), intent(out) :: n(2), m
      real(wp) :: first(3), second(3)
      n = state%z(1:2, e)
      m = state%z(3, e)
      if (side == 1) return
      associate (g => state%geometry%element(e))
         call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), g%length, g%scale, g%angle, problem%compliance(e), &
            & element_load(problem, state, e), element_displacement(problem, state, e), state%z(:problem%z_size(e), e), first, &
            & second)
      end associate
      n = second(1:2)
      m = second(3)
      if (problem%ground%founded(e)) n = force_on_ground(problem, state, e, 1.0_wp)
   end subroutine end_resultants

   !> n at a place of an element on a foundation, whose force is in no sum: the polynomial through its values at the stages and at
   !> the ends. That at the second end is what the next element begins with: a node that goes nowhere changes nothing.
   pure function force_on_ground(problem, state, e, tau) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      real(wp) :: force(2)
      real(wp) :: at(0:max_stages + 1), value(2, 0:max_stages + 1), weight
      integer :: i, j, n, next
      n = problem%model%mesh%stages(e)
      at(0) = 0.0_wp
      at(1:n) = problem%tableau(n)%c(:n)
      value(:, 0) = state%z(1:2, e)
      value(:, 1:n) = reshape(state%z(4 + n:3 + 3 * n, e), [2, n])
      next = problem%beside(2, problem%model%mesh%node(2, e))
      if (next > 0) then
         if (problem%stretch(next) == problem%stretch(e) .and. &
            & next /= problem%along(problem%element_first(problem%stretch(e)))) then
            n = n + 1
            at(n) = 1.0_wp
            value(:, n) = state%z(1:2, next)
         end if
      end if
      force = 0.0_wp
      do i = 0, n
         weight = 1.0_wp
         do j = 0, n
            if (j /= i) weight = weight * (tau - at(j)) / (at(i) - at(j))
         end do
         force = force + weight * value(:, i)
      end do
   end function force_on_ground
end module node_rates
