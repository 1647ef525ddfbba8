!> Relative curvature as a functional: curvature of the rod minus that of the obstacle at a point contact, by stress-free length,
!> positive if the rod bends away from the obstacle. As the path constraint it leads to the osculating contact, at which the
!> relative curvature is zero. There the contact has no rotational stiffness, and free spans beside it may be about to buckle, so
!> that neither the load nor displacements are parameters of the path.
module relative_curvature
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_functional, only: functional_t
   use linear_system, only: system_t
   use local_differences, only: local_number_t, linearised
   use touchdown_points, only: excess_ahead
   implicit none
   private
   public :: new_relative_curvature

   !> Relative curvature at a point contact as a number of the state.
   type, extends(local_number_t) :: relative_curvature_t
      integer :: candidate = 0
      type(state_t) :: before                   !! state in which the node is at the point contact
   contains
      procedure :: value => curvature_of_state
   end type relative_curvature_t

contains

   !> Relative curvature with its linearisation.
   function new_relative_curvature(problem, state, system, candidate) result(curvature)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: candidate          !! candidate of a point contact
      type(functional_t) :: curvature
      type(relative_curvature_t) :: number
      number%candidate = candidate
      number%before = state
      associate (beside => problem%candidates%element(:, candidate))
         number%element = pack(beside, beside > 0)
      end associate
      curvature = linearised(problem, state, system, number)
   end function new_relative_curvature

   !> Relative curvature in a state that has the nodes of `before`.
   real(wp) function curvature_of_state(self, problem, state) result(value)
      class(relative_curvature_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      value = excess_ahead(problem, self%before, state, self%candidate)
   end function curvature_of_state
end module relative_curvature
