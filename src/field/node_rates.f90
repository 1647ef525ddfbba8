!> Derivatives of a rod's position and direction at the nodes of a GE element. They follow from the differential equations of the
!> rod and are as accurate as the section forces at the node.
module node_rates
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_load, node_position, rod_direction
   use reference_curve, only: curve_point, curve_bend
   use rod_load, only: ge_load_t, line_at
   use ge_in_state, only: ge_end, ge_here_t, keep_ge
   use ge_stages, only: find_stage_force
   use conforming_span, only: conforming_state_t, conforming_resultant, foundation_density
   use gauss_tableau, only: max_stages, end_values
   implicit none
   private
   public :: rod_rate, rod_derivatives, rotation_rates, resultants_on_ground, resultant_slopes, goes_on, next_along

   !> Cross section at an end of an element.
   type :: end_section_t
      type(ge_load_t) :: load
      real(wp) :: n(2) = 0.0_wp, m = 0.0_wp            !! force (n_x, n_y) and moment of the cross section, global axes
      real(wp) :: t(2) = 0.0_wp, nu(2) = 0.0_wp !! unit normal of the cross section; unit vector at a quarter turn to the left of it
      real(wp) :: along = 1.0_wp, across = 0.0_wp !! derivative of the position by stress-free length: components along t and along
      !! nu
   end type end_section_t

contains

   !> Derivatives of position and direction with respect to the nominal coordinate, at the first end of an element.
   pure subroutine rod_rate(problem, state, e, rate, turn, way)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e               !! GE element or conforming element on a curve
      real(wp), intent(out) :: rate(2)       !! derivative of the deformed position
      real(wp), intent(out) :: turn          !! derivative of the angle of the cross section [rad/length]
      real(wp), intent(out) :: way(2)        !! derivative of the displacement
      real(wp) :: t(2), angle, x(2), speed, bend, force(3)
      type(ge_load_t) :: load
      type(conforming_state_t) :: kept
      load = element_load(problem, state, e)
      force = state%z(1:3, e)
      if (problem%conforms(e) > 0) call conforming_resultant(problem, state, e, 0.0_wp, kept, force)
      associate (g => state%geometry%element(e), compliance => problem%compliance(e), &
         & curve => problem%model%curve(problem%model%mesh%curve(e)))
         call curve_point(curve, problem%model%imperfection, g%s(1), x, angle, speed)
         call curve_bend(curve, problem%model%imperfection, g%s(1), bend)
         way = -speed * [cos(angle), sin(angle)]
         angle = rod_direction(problem, state, e, 1)
         t = [cos(angle), sin(angle)]
         rate = speed * ((1.0_wp + load%strain + compliance%axial * dot_product(force(1:2), t)) * t + &
            & (compliance%shear * (t(1) * force(2) - t(2) * force(1))) * [-t(2), t(1)])
         way = way + rate
         turn = speed * (bend + load%curvature + compliance%bending * force(3))
      end associate
   end subroutine rod_rate

   !> Derivatives of the deformed position with respect to the stress-free length at an end of a GE element.
   pure subroutine rod_derivatives(problem, state, e, side, x, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      real(wp), intent(out) :: x(2, 3)       !! first, second, third derivative
      type(ge_here_t), intent(inout), optional :: here !! element of the same state, or undefined, see keep_ge
      type(end_section_t) :: section
      real(wp), dimension(2) :: dn, ddn, line, line_slope
      real(wp) :: ground(2, 0:1), pressure, bend, bend_rate, turn, turn_rate, along(0:2), across(0:2)
      call find_section(problem, state, e, side, section, here)
      associate (load => section%load, n => section%n, t => section%t, nu => section%nu, compliance => problem%compliance(e), &
         & c => problem%model%mesh%curve(e))
         bend = 0.0_wp
         bend_rate = 0.0_wp
         if (c > 0) call curve_bend(problem%model%curve(c), problem%model%imperfection, state%geometry%element(e)%s(side), bend, &
            & bend_rate)
         turn = bend + load%curvature + compliance%bending * section%m
         pressure = load%pressure
         if (side == 2) pressure = pressure + dot_product(load%gradient, node_position(state, problem%model%mesh%node(2, e)) - &
            & node_position(state, problem%model%mesh%node(1, e)))
         ! Derivatives along the rod: x' = along t + across nu, t' = turn nu, nu' = -turn t.
         along(0) = section%along
         across(0) = section%across
         x(:, 1) = along(0) * t + across(0) * nu
         call line_at(problem%tableau(problem%model%mesh%stages(e)), load, side - 1.0_wp, line, line_slope)
         ground = 0.0_wp
         if (problem%ground%founded(e) .and. c > 0) ground = foundation_density(problem, state, e, side - 1.0_wp, &
            & node_position(state, problem%model%mesh%node(side, e)), x(:, 1))
         dn = -line - ground(:, 0) - pressure * [-x(2, 1), x(1, 1)]
         along(1) = compliance%axial * (dot_product(dn, t) + turn * dot_product(n, nu))
         across(1) = compliance%shear * (dot_product(dn, nu) - turn * dot_product(n, t))
         x(:, 2) = (along(1) - turn * across(0)) * t + (across(1) + turn * along(0)) * nu
         ddn = -line_slope / state%geometry%element(e)%length - ground(:, 1) - pressure * [-x(2, 2), x(1, 2)] - &
            & dot_product(load%gradient, x(:, 1)) * [-x(2, 1), x(1, 1)]
         turn_rate = bend_rate - compliance%bending * (x(1, 1) * n(2) - x(2, 1) * n(1))
         along(2) = compliance%axial * (dot_product(ddn, t) + 2.0_wp * turn * dot_product(dn, nu) + &
            & turn_rate * dot_product(n, nu) - turn**2 * dot_product(n, t))
         across(2) = compliance%shear * (dot_product(ddn, nu) - 2.0_wp * turn * dot_product(dn, t) - &
            & turn_rate * dot_product(n, t) - turn**2 * dot_product(n, nu))
         x(:, 3) = (along(2) - 2.0_wp * turn * across(1) - turn_rate * across(0) - turn**2 * along(0)) * t + &
            & (across(2) + 2.0_wp * turn * along(1) + turn_rate * along(0) - turn**2 * across(0)) * nu
      end associate
   end subroutine rod_derivatives

   !> First and second derivatives of the rotation with respect to the stress-free length at an end of a GE element.
   pure subroutine rotation_rates(problem, state, e, side, rates, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      real(wp), intent(out) :: rates(2)
      type(ge_here_t), intent(inout), optional :: here !! element of the same state, or undefined, see keep_ge
      type(end_section_t) :: section
      real(wp) :: x(2)
      call find_section(problem, state, e, side, section, here)
      associate (flexibility => problem%compliance(e)%bending, n => section%n)
         x = section%along * section%t + section%across * section%nu
         rates = [section%load%curvature + flexibility * section%m, -flexibility * (x(1) * n(2) - x(2) * n(1))]
      end associate
   end subroutine rotation_rates

   !> Cross section at an end of a GE element.
   pure subroutine find_section(problem, state, e, side, section, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      type(end_section_t), intent(out) :: section
      type(ge_here_t), intent(inout), optional :: here !! element of the same state, or undefined, see keep_ge
      real(wp) :: angle
      section%load = element_load(problem, state, e)
      call end_resultants(problem, state, e, side, section%n, section%m, here)
      angle = rod_direction(problem, state, e, side)
      section%t = [cos(angle), sin(angle)]
      section%nu = [-section%t(2), section%t(1)]
      section%along = 1.0_wp + section%load%strain + problem%compliance(e)%axial * dot_product(section%n, section%t)
      section%across = problem%compliance(e)%shear * dot_product(section%n, section%nu)
   end subroutine find_section

   !> Forces (n_x, n_y) and moment at an end of a GE element, global axes.
   pure subroutine end_resultants(problem, state, e, side, n, m, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      real(wp), intent(out) :: n(2), m
      type(ge_here_t), intent(inout), optional :: here !! see keep_ge
      real(wp) :: resultant(3)
      call ge_end(problem, state, e, side, n, m, here)
      if (side == 1 .or. .not. problem%ground%founded(e)) return
      ! The stored forces include those of foundations, and so does the moment computed from them; the sum of loads does not.
      resultant = resultants_on_ground(problem, state, e, 1.0_wp)
      n = resultant(1:2)
   end subroutine end_resultants

   !> Force and moment (n_x, n_y, m) inside an element on a foundation, from polynomials through the values at the stages and ends,
   !> because the sum of loads does not include the foundation's force. At the second end the result equals the values with which
   !> the next element begins, so that a transfer between equal meshes changes nothing.
   pure function resultants_on_ground(problem, state, e, tau) result(resultant)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau !! place in the element, 0 to 1 of its stress-free length
      real(wp) :: resultant(3), at(0:max_stages + 1), weight(0:max_stages + 1), end(3)
      integer :: i, j, n, s
      logical :: continued
      s = problem%model%mesh%stages(e)
      n = s
      continued = goes_on(problem, e)
      if (continued) then
         n = s + 1
         at(n) = 1.0_wp
         end = state%z(1:3, next_along(problem, e))
         if (tau >= 1.0_wp) then
            resultant = end
            return
         end if
      end if
      at(0) = 0.0_wp
      at(1:s) = problem%tableau(s)%c(:s)
      do i = 0, n
         weight(i) = 1.0_wp
         do j = 0, n
            if (j /= i) weight(i) = weight(i) * (tau - at(j)) / (at(i) - at(j))
         end do
      end do
      associate (z => state%z(:, e))
         resultant = weight(0) * z(1:3)
         do i = 1, s
            resultant = resultant + weight(i) * [z(2 + s + 2 * i), z(3 + s + 2 * i), z(3 + i)]
         end do
      end associate
      if (continued) resultant = resultant + weight(n) * end
   end function resultants_on_ground

   !> The next element of the same rod segment; 0: none.
   pure integer function next_along(problem, e) result(next)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: e
      next = problem%beside(2, problem%model%mesh%node(2, e))
      if (next == 0) return
      ! The last element of a closed segment is followed by the first one.
      if (problem%rod_segment(next) /= problem%rod_segment(e) .or. &
         & next == problem%along(problem%element_first(problem%rod_segment(e)))) next = 0
   end function next_along

   !> True if the section forces at the second end of an element are those with which the next element of its segment begins.
   pure logical function goes_on(problem, e)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: e
      goes_on = next_along(problem, e) > 0
      ! At a node of a contact span the force of the obstacle acts in addition.
      if (goes_on .and. problem%has_spans()) goes_on = .not. any(problem%candidates%node == problem%model%mesh%node(2, e) .and. &
         & problem%candidates%contact_span > 0)
   end function goes_on

   !> Derivatives of force and moment (n_x, n_y, m) by the nominal coordinate in a GE element on a foundation. That of the force
   !> belongs to the polynomial of resultants_on_ground; that of the moment follows from force and direction at the stages.
   pure subroutine resultant_slopes(problem, state, e, slope)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: slope(3, 0:max_stages + 1) !! at the first end (0), at the stages, and behind the last stage at the
      !! second end, if the section forces go on there (goes_on)
      real(wp), dimension(0:max_stages + 1) :: at, lever
      real(wp) :: force(2, 0:max_stages + 1)
      type(ge_here_t) :: here
      integer :: i, j, n, s
      s = problem%model%mesh%stages(e)
      call keep_ge(problem, state, e, here)
      associate (tab => problem%tableau(s), g => here%ge%g)
         at(0) = 0.0_wp
         at(1:s) = tab%c(:s)
         force(:, 0) = state%z(1:2, e)
         slope = 0.0_wp
         do i = 1, s
            call find_stage_force(tab, here%ge, i, force(:, i))
            slope(3, i) = -g%length * g%scale * (here%rho(1, i) * force(2, i) - here%rho(2, i) * force(1, i))
         end do
         slope(3, [0, s + 1]) = end_values(tab, slope(3, 1:s))
         n = s
         if (goes_on(problem, e)) then
            n = s + 1
            at(n) = 1.0_wp
            force(:, n) = state%z(1:2, next_along(problem, e))
         end if
         ! Derivatives of Lagrange's polynomials at their own points.
         do i = 0, n
            lever(i) = 1.0_wp
            do j = 0, n
               if (j /= i) lever(i) = lever(i) * (at(i) - at(j))
            end do
         end do
         do i = 0, n
            do j = 0, n
               if (j /= i) slope(1:2, i) = slope(1:2, i) + lever(i) / (lever(j) * (at(i) - at(j))) * (force(:, j) - force(:, i))
            end do
         end do
         slope = slope / (g%s(2) - g%s(1))
      end associate
   end subroutine resultant_slopes
end module node_rates
