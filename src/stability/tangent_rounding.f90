!> Part of the tangent that is rounding.
!>
!> Axial stiffness exceeds bending stiffness by EA L^2/EI times the square of the number of elements. If this ratio approaches the
!> inverse of the machine precision, the assembled tangent K has no digits of bending left. The slope of the path, the pivots and
!> the points located by them are then wrong. The forces in equilibrium remain right, because they are stored unknowns instead of EA
!> times a difference. Products of the element matrices with the path tangent t (element_products) are accurate: K t should be the
!> load, and t.(load - K t)/<t, t> is the change by rounding of eigenvalues of modes like t. The value is finite where K becomes
!> singular; at an exactly singular K the load on the artificial springs of the factors is not counted as rounding.
module tangent_rounding
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use axial_rigidity, only: shrinking_forces
   use band_matrix, only: spring_forces
   use linear_system, only: system_t
   use tangent_modes, only: apply_tangent, bending_stiffness
   implicit none
   private
   public :: path_stiffness, load_rate_share, rounding_cure

   real(wp), parameter :: soft = 1.0e-3_wp     !! stiffness along a path, over that of bending, below which its tangent lacks digits

contains

   !> Stiffness along the path, t.K t/<t, t> for its tangent t, and the part of it that is rounding: force times length.
   subroutine path_stiffness(problem, state, system, stiffness, rounding)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(out) :: stiffness       !! absolute value of the stiffness; zero at limit points, and if nothing moves
      real(wp), intent(out) :: rounding
      real(wp) :: left, work, length
      stiffness = 0.0_wp
      rounding = 0.0_wp
      call find_works(problem, state, system, work, left, length)
      if (.not. length > 0.0_wp) return
      stiffness = abs(work) / length
      rounding = abs(left) / length
   end subroutine path_stiffness

   !> Load rate over that of the path tangent t. Where K is almost singular, the length of t has few digits or none, but not its
   !> direction: what K t lacks to the load is known, and so is the part of the load that the direction is in equilibrium with.
   real(wp) function load_rate_share(problem, state, system) result(share)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp) :: work, left, length, force(system%n)
      share = 1.0_wp
      call find_works(problem, state, system, work, left, length)
      ! What moves by rounding only is not soft.
      if (.not. length > 0.0_wp .or. abs(work) > soft * bending_stiffness(problem) * length) return
      ! Loads and prescribed displacements do this work together with what is left.
      if (any(abs(system%rate) > 0.0_wp)) call apply_tangent(problem, state, system, merge(0.0_wp, system%tangent, system%fixed), &
         & force, work)
      if (abs(work + left) > 0.0_wp) share = work / (work + left)
   end function load_rate_share

   !> Work of K t along the path tangent t, and of what is missing in it to the load, by rounding; and the square <t, t>.
   subroutine find_works(problem, state, system, work, left, length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp), intent(out) :: work, left, length
      real(wp) :: force(system%n), missing(system%n)
      integer :: node, d
      associate (t => system%tangent)
         length = 0.0_wp
         do node = 1, size(problem%weight)
            d = dof(problem, node, 1)
            length = length + problem%weight(node) * (t(d)**2 + t(d + 1)**2)
         end do
         call apply_tangent(problem, state, system, t, force, work)
         call shrinking_forces(system%rigidity, system%tangent_stretch, missing)
         missing = missing + system%load - force - spring_forces(system%factor, t)
         left = dot_product(t, merge(0.0_wp, missing, system%fixed))
      end associate
   end subroutine find_works

   !> Advice against rounding: fewer elements, or a smaller EA if elements are stiffer axially than in bending. Bending alone has a
   !> rounding error by the fourth power of the number of elements.
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
