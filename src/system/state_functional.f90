!> A number that is a function of the state, linearised at the state: load factor, displacement, reaction, contact force, place of a
!> touchdown point, relative curvature.
!>
!> Uses of such a functional: its gradient is the row of a path constraint (set_path_row); its rate along the path is the slope of a
!> test function or a monitor; its zero is located by an iteration on the bordered system; the solution of the transposed equations
!> for its gradient weighs the elements' error contributions in its error bar.
module state_functional
   use kinds, only: wp
   implicit none
   private
   public :: functional_t

   type :: functional_t
      logical :: known = .false.                 !! false: there is no linearisation of this number
      real(wp) :: value = 0.0_wp                 !! value at the state, for kinds of functionals that set it
      real(wp), allocatable :: by_unknown(:)     !! (unknowns) gradient, node axes
      real(wp) :: by_load = 0.0_wp               !! derivative by the load factor at constant unknowns
      real(wp) :: defect = 0.0_wp                !! change of the number by the elimination of the elements' internal residuals
      real(wp), allocatable :: by_force(:)       !! (unknowns) derivatives by the residuals of fixed unknowns, for reactions; not
      !! allocated: none
      real(wp), allocatable :: by_element(:, :)  !! (6, elements) derivatives by the end forces of each element; not allocated: none
   contains
      procedure :: change
   end type functional_t

contains

   !> Linear change of the number for an increment of the unknowns and of the load factor. The system's tangent and 1 as increments
   !> give the rate along the path per unit of load factor.
   pure real(wp) function change(self, x, y)
      class(functional_t), intent(in) :: self
      real(wp), intent(in) :: x(:)               !! (unknowns) node axes
      real(wp), intent(in) :: y                  !! increment of the load factor
      change = dot_product(self%by_unknown, x) + self%by_load * y
   end function change
end module state_functional
