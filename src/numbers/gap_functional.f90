!> Gap between an obstacle and a place inside an element as a functional.
module gap_functional
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: unknowns_of
   use displacement_functional, only: add_place
   use state_functional, only: functional_t
   implicit none
   private
   public :: new_place_gap_functional

contains

   !> Change of the gap with the displacements: that of the place along the obstacle's normal.
   type(functional_t) function new_place_gap_functional(problem, state, system, e, tau, normal) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: e                  !! element
      real(wp), intent(in) :: tau               !! place in the element, 0 to 1
      real(wp), intent(in) :: normal(2)         !! gradient of the gap by the displacement of the place
      real(wp) :: by_node(3, problem%model%mesh%n_nodes)
      by_node = 0.0_wp
      call add_place(problem, state, system, e, tau, [normal, 0.0_wp], by_node, number)
      number%by_unknown = unknowns_of(problem, system, by_node)
   end function new_place_gap_functional
end module gap_functional
