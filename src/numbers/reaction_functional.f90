!> Sums of support reactions and spring forces as functionals, and the linearisation of forces on fixed unknowns.
!>
!> The reaction of a support is the residual (internal minus external force) of the unknown that the support fixes. The force of a
!> spring is proportional to the displacement of its node.
module reaction_functional
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use tied_nodes, only: spread_force
   use linear_system, only: system_t, to_node, rows_times
   use state_functional, only: functional_t, new_functional
   implicit none
   private
   public :: reaction_sum, new_reaction_functional, new_support_functional, add_held_forces

contains

   !> Sum of the support reactions and spring forces of a reaction monitor.
   pure real(wp) function reaction_sum(problem, state, system, m) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m                   !! index into model%monitor of a reaction monitor
      integer :: i, node
      total = 0.0_wp
      associate (monitor => problem%deck%monitor(m))
         do i = 1, size(monitor%node)
            ! A supported node is a segment boundary and thus a node of every mesh. A node of the deck that the mesh lacks therefore
            ! has no support and no reaction.
            node = problem%mesh_node(monitor%node(i))
            if (node == 0) cycle
            if (problem%model%fixed(monitor%component, node)) then
               ! The support reaction is the internal minus the external force.
               total = total + system%raw(dof(problem, node, monitor%component))
            else
               total = total - problem%model%spring(monitor%component, node) * state%u(monitor%component, node)
            end if
         end do
      end associate
   end function reaction_sum

   !> Linearisation of the sum of support reactions and spring forces.
   type(functional_t) function new_reaction_functional(problem, state, system, m) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m                   !! index into model%monitor of a reaction monitor
      real(wp) :: along(3)
      integer :: i, node
      number = new_support_functional(problem, system, m)
      number%value = reaction_sum(problem, state, system, m)
      associate (monitor => problem%deck%monitor(m))
         do i = 1, size(monitor%node)
            node = problem%mesh_node(monitor%node(i))
            if (node == 0) cycle
            if (problem%model%fixed(monitor%component, node)) cycle
            along = 0.0_wp
            along(monitor%component) = -problem%model%spring(monitor%component, node)
            call to_node(system, node, along)
            call spread_force(problem, system%tie_block, node, along, number%by_unknown)
         end do
      end associate
   end function new_reaction_functional

   !> Linearisation of the supports' part of the sum, without the springs, computed from the equations. The value of the functional
   !> is not set.
   type(functional_t) function new_support_functional(problem, system, m) result(number)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled
      integer, intent(in) :: m                   !! index into model%monitor of a reaction monitor
      integer :: i, d, node
      number = new_functional(system%n)
      allocate (number%by_force(system%n), source=0.0_wp)
      associate (monitor => problem%deck%monitor(m))
         do i = 1, size(monitor%node)
            node = problem%mesh_node(monitor%node(i))
            if (node == 0) cycle
            if (.not. problem%model%fixed(monitor%component, node)) cycle
            d = dof(problem, node, monitor%component)
            number%by_force(d) = number%by_force(d) + 1.0_wp
         end do
      end associate
      call add_held_forces(system, number)
   end function new_support_functional

   !> Adds to a functional the linearisation of the forces on fixed unknowns; number%by_force contains the derivatives of the
   !> functional with respect to these forces.
   pure subroutine add_held_forces(system, number)
      type(system_t), intent(in) :: system       !! assembled
      type(functional_t), intent(inout) :: number
      call rows_times(system, number%by_force, number%by_unknown)
      number%by_load = number%by_load - dot_product(number%by_force, system%tangent_load)
      number%defect = number%defect + dot_product(number%by_force, system%residual - system%raw)
   end subroutine add_held_forces
end module reaction_functional
