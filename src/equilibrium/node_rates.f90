!> How a rod goes on from the first node of a GE element: by its differential equations, as exact as the resultants of the node.
module node_rates
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_load
   use reference_curve, only: curve_point, curve_bend
   use ge_element, only: ge_load_t
   implicit none
   private
   public :: rod_rate

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
end module node_rates
