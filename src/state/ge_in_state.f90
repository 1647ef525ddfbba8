!> A geometrically exact element in a state of the structure.
module ge_in_state
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_compliance, element_load
   use element_families, only: collocates
   use gauss_tableau, only: max_stages
   use ge_stages, only: ge_direction_changes, ge_data_t
   use ge_fields, only: ge_end_forces
   implicit none
   private
   public :: ge_at, ge_end, ge_here_t, keep_ge

   !> Element in one state with the directions of its cross sections, evaluated once and stored for several results.
   type :: ge_here_t
      integer :: element = 0                      !! index of the element; 0: undefined
      type(ge_data_t) :: ge                       !! the element with its loads, displacements and stored unknowns
      real(wp) :: change(2, max_stages) = 0.0_wp !! (2, stages) changes of `rho` since the stress-free state; not set without
      !! collocation
      real(wp) :: rho(2, max_stages) = 0.0_wp !! (2, stages) directions of the rod axis at the stages, with its stretch
      !! (ge_directions)
   end type ge_here_t

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

   !> Evaluates an element for a sequence of results in one state. A call with the same element as before does nothing.
   pure subroutine keep_ge(problem, state, e, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e               !! element that is not in line contact
      type(ge_here_t), intent(inout) :: here !! element of the same state, or undefined
      if (here%element == e) return
      here%element = e
      here%ge = ge_at(problem, state, e)
      if (.not. collocates(problem%model%mesh%family(e))) return
      associate (s => problem%model%mesh%stages(e))
         here%change = ge_direction_changes(problem%tableau(s), here%ge)
         here%rho(:, :s) = here%change(:, :s) + here%ge%g%tangent(:, :s)
      end associate
   end subroutine keep_ge

   !> Force and moment at one end of a GE element, global axes, without the forces of foundations along the element.
   pure subroutine ge_end(problem, state, e, side, n, m, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side         !! index of a GE element; side 1: first end, 2: second end
      real(wp), intent(out) :: n(2), m !! force (x, y) and moment
      type(ge_here_t), intent(inout), optional :: here !! element of the same state, or undefined, see keep_ge
      real(wp) :: first(3), second(3)
      n = state%z(1:2, e)
      m = state%z(3, e)
      if (side == 1) return
      associate (tab => problem%tableau(problem%model%mesh%stages(e)))
         if (present(here)) then
            call keep_ge(problem, state, e, here)
            call ge_end_forces(tab, here%ge, first, second, rho=here%rho)
         else
            call ge_end_forces(tab, ge_at(problem, state, e), first, second)
         end if
      end associate
      n = second(1:2)
      m = second(3)
   end subroutine ge_end
end module ge_in_state
