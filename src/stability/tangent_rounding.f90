!> How much of the slope of the path is rounding.
!>
!> Stretching is stiffer than bending by EA L^2/EI times the square of the number of elements: when that comes near the
!> inverse of the machine's precision, the assembled tangent is rounding as far as bending goes, and so are the slope of the
!> path, pivots and all that is located by them, while the forces in balance (stored, not taken from EA times a difference)
!> stay right. One step of iterative refinement tells: the elements' own products with the tangent (element_products) know
!> what the assembled band does not, and the correction that their residual asks for is the error.
module tangent_rounding
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: solve_effective
   use tangent_modes, only: apply_tangent
   use timing, only: timers_t
   implicit none
   private
   public :: slope_error, rounding_cure

contains

   !> Slope d(load factor)/d(arc length) and how wrong rounding may make it.
   subroutine slope_error(problem, state, system, slope, error, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(out) :: slope           !! its size; 0 where nothing moves
      real(wp), intent(out) :: error           !! of the slope
      type(timers_t), intent(inout) :: timers
      real(wp) :: residual(system%n), correction(system%n), shift(system%n_slides), none(system%n_slides), form, length
      integer :: k
      slope = 0.0_wp
      error = 0.0_wp
      length = size_of(system%tangent)
      if (.not. length > 0.0_wp) return
      call apply_tangent(problem, state, system, system%tangent, system%slide_rate, residual, form)
      residual = system%load - residual
      do k = 1, system%n_slides
         residual = residual + system%slide_rate(k) * system%slide_column(:, k)
      end do
      where (system%fixed) residual = 0.0_wp
      none = 0.0_wp
      call solve_effective(problem, system, residual, none, correction, shift, timers)
      slope = 1.0_wp / length
      error = min(size_of(correction) / length, 1.0_wp) * slope
   contains
      !> Length of a displacement in the metric of the arc length.
      pure real(wp) function size_of(x) result(norm)
         real(wp), intent(in) :: x(:)
         integer :: node, d
         norm = 0.0_wp
         do node = 1, size(problem%weight)
            d = dof(problem, node, 1)
            norm = norm + problem%weight(node) * (x(d)**2 + x(d + 1)**2)
         end do
         norm = sqrt(norm)
      end function size_of
   end subroutine slope_error

   !> What to do about it: elements are stiffer in stretching than in bending, or so short that bending alone, the fourth power
   !> of their number, is too much.
   pure function rounding_cure(problem, state) result(words)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      character(:), allocatable :: words
      real(wp) :: stretching
      integer :: e
      stretching = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         stretching = max(stretching, problem%compliance(e)%bending * state%geometry%element(e)%length**2 / &
            & (12.0_wp * problem%compliance(e)%axial))
      end do
      words = 'fewer elements are needed'
      if (stretching > 1.0_wp) words = 'fewer elements or a smaller EA are needed'
   end function rounding_cure
end module tangent_rounding
