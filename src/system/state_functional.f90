!> A number of the state, linearised there: load factor, displacement, reaction, contact force, place of a touchdown point, relative
!> curvature.
!>
!> One number has four uses: its gradient is the row of a path constraint (set_path_row), its rate along the path is the slope of a
!> test function or a monitor, its zero is located by an iteration on the bordered system, and the solution of the transposed
!> equations for its gradient weighs the elements' error contributions in its error bar.
module state_functional
   use kinds, only: wp
   implicit none
   private
   public :: functional_t

   type :: functional_t
      logical :: known = .false.                 !! false: there is no linearisation of this number
      real(wp) :: value = 0.0_wp                 !! at the state, where the kind has it
      real(wp), allocatable :: by_unknown(:)     !! (unknowns) gradient, node axes
      real(wp) :: by_load = 0.0_wp               !! derivative by the load factor, the unknowns held
      real(wp) :: defect = 0.0_wp                !! change when the elements eliminate their internal residuals
      real(wp), allocatable :: by_force(:)       !! (unknowns) by the residual of held unknowns, for reactions; not allocated: none
      real(wp), allocatable :: by_element(:, :)  !! (6, elements) by the end forces of each element; not allocated: none
   contains
      procedure :: change
   end type functional_t

contains

   !> Linear change of the number under an increment of the unknowns and of the load factor; its rate along the path is that of
   !> the system's tangent and 1.
   pure real(wp) function change(self, x, y)
      class(functional_t), intent(in) :: self
      real(wp), intent(in) :: x(:)               !! (unknowns) node axes
      real(wp), intent(in) :: y                  !! of the load factor
      change = dot_product(self%by_unknown, x) + self%by_load * y
   end function change
end module state_functional
