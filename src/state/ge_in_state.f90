!> A geometrically exact element in a state of the structure.
module ge_in_state
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_compliance, element_load
   use ge_data, only: ge_data_t
   use ge_fields, only: ge_end_forces
   implicit none
   private
   public :: ge_at, ge_end

contains

   !> The geometrically exact element with its loads, displacements and stored unknowns.
   pure type(ge_data_t) function ge_at(problem, state, e) result(element)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e               !! index of a GE element
      element%g = state%geometry%element(e)
      element%compliance = element_compliance(problem, state, e)
      element%load = element_load(problem, state, e)
      element%u = element_displacement(problem, state, e)
      element%unknowns = problem%z_size(e)
      element%z(:element%unknowns) = state%z(:element%unknowns, e)
   end function ge_at

   !> Force and moment at one end of a GE element, global axes, without the forces of foundations along the element.
   pure subroutine ge_end(problem, state, e, side, n, m)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side         !! index of a GE element; side 1: first end, 2: second end
      real(wp), intent(out) :: n(2), m
      real(wp) :: first(3), second(3)
      n = state%z(1:2, e)
      m = state%z(3, e)
      if (side == 1) return
      call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), first, second)
      n = second(1:2)
      m = second(3)
   end subroutine ge_end
end module ge_in_state
