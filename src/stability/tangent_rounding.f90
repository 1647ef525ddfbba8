!> The part of the tangent that is rounding error.
!>
!> Axial stiffness exceeds bending stiffness by EA L^2/EI times the square of the number of elements. If this ratio approaches the
!> inverse of the machine precision, the assembled tangent K has no digits of bending left. The slope of the path, the pivots and
!> the points that are located by slope or pivots are then wrong. The forces in equilibrium remain right, because they are stored
!> unknowns, not EA times a difference. Products of the element matrices with the path tangent t (element_products) are accurate: K
!> t should equal the load. Therefore t.(load - K t)/<t, t>, with the arc-length metric <t, t>, estimates the rounding error of
!> eigenvalues whose modes are similar to t. This estimate is finite where K becomes singular. If K is exactly singular, the
!> factorisation adds artificial springs, whose forces do not count as rounding.
module tangent_rounding
   use kinds, only: wp
   use problem, only: problem_t, unknown_weights
   use rod_state, only: state_t
   use axial_rigidity, only: shrinking_forces
   use band_matrix, only: spring_forces
   use linear_system, only: system_t
   use bordered_system, only: solve_effective
   use tangent_modes, only: apply_tangent
   implicit none
   private
   public :: path_stiffness, is_rounding, rounding_cure

contains

   !> Stiffness along the path, t.K t/<t, t> for the path tangent t, and its rounding error; both are a force times a length.
   subroutine path_stiffness(problem, state, system, stiffness, rounding)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(out) :: stiffness       !! absolute value of the stiffness; zero at limit points, and if no node moves
      real(wp), intent(out) :: rounding        !! rounding error of the stiffness
      real(wp) :: force(system%n), left(system%n), work, length
      stiffness = 0.0_wp
      rounding = 0.0_wp
      associate (t => system%tangent)
         length = sum(unknown_weights(problem) * t**2)
         if (.not. length > 0.0_wp) return
         call apply_tangent(problem, state, system, t, force, work)
         call shrinking_forces(system%rigidity, system%tangent_stretch, left)
         left = left + system%load - force - spring_forces(system%factor, t)
         stiffness = abs(work) / length
         rounding = abs(dot_product(t, merge(0.0_wp, left, system%fixed))) / length
      end associate
   end subroutine path_stiffness

   !> True if the factored tangent is to a large part rounding: in its response to a line load along x or y, the work of the load
   !> minus the element forces exceeds half of the work of the element forces. (Line loads also bend structures that the loads of
   !> the step only compress.)
   logical function is_rounding(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), dimension(system%n) :: weight, load, answer, force, shrinking
      real(wp) :: work, stretch(2, system%rigidity%n)
      integer :: axis
      is_rounding = .false.
      weight = unknown_weights(problem)
      do axis = 1, 2
         load = 0.0_wp
         load(axis::3) = weight(axis::3)
         where (system%fixed) load = 0.0_wp
         call solve_effective(system, load, answer, stretch)
         call apply_tangent(problem, state, system, answer, force, work)
         call shrinking_forces(system%rigidity, stretch, shrinking)
         force = merge(0.0_wp, load + shrinking - force - spring_forces(system%factor, answer), system%fixed)
         if (.not. abs(dot_product(answer, force)) <= 0.5_wp * abs(work)) is_rounding = .true.
      end do
   end function is_rounding

   !> Advice against rounding, in words: fewer elements; or, as an alternative, a smaller EA if elements are stiffer axially than
   !> in bending. The rounding error of bending alone grows with the fourth power of the number of elements.
   pure function rounding_cure(problem, state) result(words)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      character(:), allocatable :: words
      real(wp) :: stretching
      integer :: e
      stretching = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         stretching = max(stretching, problem%compliance(e)%bending * state%geometry%element(e)%length**2 / &
            & (12.0_wp * (problem%compliance(e)%axial + problem%compliance(e)%give)))
      end do
      words = 'fewer elements are needed'
      if (stretching > 1.0_wp) words = 'fewer elements or a smaller EA are needed'
   end function rounding_cure
end module tangent_rounding
