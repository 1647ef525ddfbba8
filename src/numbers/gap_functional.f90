!> Gap between an obstacle and a point inside an element as a functional.
module gap_functional
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, pose_of
   use rod_profile, only: new_profile, profile_place
   use obstacle_pose, only: pose_t, about_pivot
   use linear_system, only: system_t
   use bordered_system, only: unknowns_of
   use displacement_functional, only: add_place
   use state_functional, only: functional_t
   implicit none
   private
   public :: new_place_gap_functional

contains

   !> The gap with its linearisation: displacement of the point relative to the obstacle along the normal, minus the closing of the
   !> gap.
   type(functional_t) function new_place_gap_functional(problem, state, system, contact, e, tau, gap, normal) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: contact            !! index into model%contact
      integer, intent(in) :: e                  !! index of the element
      real(wp), intent(in) :: tau               !! place in the element, 0 to 1
      real(wp), intent(in) :: gap, normal(2)    !! gap at this place; unit gradient of the gap
      real(wp) :: by_node(3, problem%model%mesh%n_nodes)
      type(pose_t) :: pose
      by_node = 0.0_wp
      number%value = gap
      call add_place(problem, state, system, e, tau, [normal, 0.0_wp], by_node, number)
      associate (carrier => problem%model%obstacle(problem%model%contact(contact)%obstacle)%carrier)
         pose = pose_of(problem, state, problem%model%contact(contact)%obstacle)
         if (carrier > 0) by_node(:, carrier) = by_node(:, carrier) - about_pivot(pose%arm(profile_place(problem, &
            & new_profile(problem, state, e), tau)), normal)
      end associate
      number%by_unknown = unknowns_of(problem, system, by_node)
      associate (o => problem%model%contact(contact)%obstacle, load => problem%model%step(problem%step)%load)
         number%by_load = number%by_load - dot_product(normal, load%motion(:, o)) - load%closing(o) - &
            & load%resolved(o) * problem%overlap(contact)
      end associate
   end function new_place_gap_functional
end module gap_functional
