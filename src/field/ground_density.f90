!> Force of foundations per length of a rod, at one point of an element.
module ground_density
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, gap_at, gap_slope
   use reference_curve, only: curve_point, curve_abscissa
   use force_law, only: foundation_reaction, carries, segment_open
   implicit none
   private
   public :: foundation_density, home_at

contains

   !> Force of the foundations at a point of an element by stress-free length, in global axes, and the derivative of this force with
   !> respect to the stress-free length for a constant direction of the force.
   pure function foundation_density(problem, state, e, tau, place, rate) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! index of an element on a curve
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(in) :: place(2)              !! deformed position of the point
      real(wp), intent(in) :: rate(2)               !! derivative of the deformed position with respect to the stress-free length
      real(wp) :: density(2, 0:1), home(2), angle, gap, normal(2), bend, push, spring, way(2)
      integer :: i
      density = 0.0_wp
      if (.not. problem%ground%founded(e)) return
      call home_at(problem, state, e, tau, home, angle)
      associate (chain => problem%ground%chain)
         do i = problem%ground%first(e), problem%ground%first(e + 1) - 1
            associate (c => problem%ground%candidate(i))
               if (state%segment(c) == segment_open) cycle
               call gap_at(problem, state, chain, c, home, place - home, gap, normal, bend)
               if (gap >= 0.0_wp .and. .not. (chain%bilateral(c) .or. carries(state%segment(c)))) cycle
               call foundation_reaction(problem%model, problem%model%obstacle(chain%obstacle(c)), -gap, push, spring, &
                  & state%segment(c))
               way = rate - [cos(angle), sin(angle)]
               density(:, 0) = density(:, 0) + push * normal
               density(:, 1) = density(:, 1) - (spring * gap_slope(problem, chain, c, home, normal, rate, way)) * normal
            end associate
         end do
      end associate
   end function foundation_density

   !> Stress-free position and tangent angle inside an element.
   pure subroutine home_at(problem, state, e, tau, x, angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! index of an element on a curve
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(out) :: x(2), angle          !! stress-free position; tangent angle [rad]
      real(wp) :: speed
      associate (curve => problem%model%curve(problem%model%mesh%curve(e)), g => state%geometry%element(e))
         call curve_point(curve, problem%model%imperfection, curve_abscissa(curve, problem%model%imperfection, g%s(1), &
            & tau * g%length, g%excess), x, angle, speed)
      end associate
   end subroutine home_at
end module ground_density
