!> Monitors: the numbers that the deck observes (displacements, reactions of supports and springs, contact forces, section
!> quantities), their values, and their linearisations (functionals).
module monitors
   use kinds, only: wp
   use model, only: quantity_displacement, quantity_contact, quantity_section
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use state_functional, only: functional_t, section_place_t, new_functional
   use section_quantities, only: watched_section, new_section_functional
   use displacement_functional, only: watched_displacement, new_displacement_functional
   use reaction_functional, only: reaction_sum, new_reaction_functional
   use node_contact_functional, only: acts_at_nodes, holds_node, reaction_total, new_reactions_functional
   use span_force_functional, only: span_force_sum, span_force_rate, new_span_force_functional
   use foundation_force_functional, only: has_foundation, foundation_force_sum, new_foundation_force_functional
   implicit none
   private
   public :: monitor_values, monitor_rate, new_monitor_functional

contains

   !> Values of all monitors, with factor and offset, at a converged state; `system` is assembled there.
   function monitor_values(problem, state, system) result(values)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: values(size(problem%model%monitor)), total
      type(section_place_t) :: place
      integer :: m
      do m = 1, size(problem%model%monitor)
         associate (monitor => problem%deck%monitor(m))
            if (monitor%quantity == quantity_displacement) then
               values(m) = watched_displacement(problem, state, m)
               cycle
            end if
            if (monitor%quantity == quantity_section) then
               call watched_section(problem, state, monitor, total, place)
            else if (monitor%quantity == quantity_contact) then
               associate (o => monitor%obstacle, component => monitor%component)
                  total = reaction_total(state, system, acts_at_nodes(problem, state, o), component)
                  if (problem%has_spans()) total = total + span_force_sum(problem, state, o, component)
                  if (problem%ground%chain%n > 0) total = total + foundation_force_sum(problem, state, system, o, component)
               end associate
            else
               total = support_force_sum(problem, state, system, m)
            end if
            values(m) = monitor%offset + monitor%factor * total
         end associate
      end do
   end function monitor_values

   !> Sum of the forces of supports and springs on the nodes of a monitor, without those of obstacles on supported nodes.
   pure real(wp) function support_force_sum(problem, state, system, m) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled at `state`
      integer, intent(in) :: m                 !! index into model%monitor of a reaction monitor
      integer, allocatable :: node(:)
      integer :: i
      total = reaction_sum(problem, state, system, m)
      node = held_nodes(problem, system, m)
      total = total - sum([(reaction_total(state, system, holds_node(problem, system, node(i)), &
         & problem%deck%monitor(m)%component), i=1, size(node))])
   end function support_force_sum

   !> Linearisation of support_force_sum.
   type(functional_t) function new_support_force_functional(problem, state, system, m) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled at `state`
      integer, intent(in) :: m                 !! index into model%monitor of a reaction monitor
      integer, allocatable :: node(:)
      integer :: i
      number = new_reaction_functional(problem, state, system, m)
      node = held_nodes(problem, system, m)
      do i = 1, size(node)
         call number%add(-1.0_wp, new_reactions_functional(problem, state, system, holds_node(problem, system, node(i)), &
            & problem%deck%monitor(m)%component))
      end do
   end function new_support_force_functional

   !> Nodes of a reaction monitor at which a support holds the monitor's component (x or y) and a rigid obstacle acts as well.
   pure function held_nodes(problem, system, m) result(node)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! assembled
      integer, intent(in) :: m                 !! index into model%monitor of a reaction monitor
      integer, allocatable :: node(:)
      integer :: i
      associate (monitor => problem%deck%monitor(m))
         node = [(problem%mesh_node(monitor%node(i)), i=1, size(monitor%node))]
         if (monitor%component > 2) node = [integer ::]
         node = pack(node, node > 0)
         associate (n => problem%candidates%n)
            node = pack(node, [(problem%model%fixed(monitor%component, node(i)) .and. any(problem%candidates%node(:n) == node(i) &
               & .and. system%unknown(:n) > 0), i=1, size(node))])
         end associate
      end associate
   end function held_nodes

   !> Derivative of a monitor along the path with respect to the load factor.
   real(wp) function monitor_rate(problem, m, state, system) result(rate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                 !! index into model%monitor
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      type(functional_t) :: number
      associate (monitor => problem%deck%monitor(m))
         if (monitor%quantity == quantity_contact) then
            number = new_fixed_contact_functional(problem, state, system, monitor%obstacle, monitor%component)
            rate = number%change(system%tangent, 1.0_wp)
            if (problem%has_spans()) rate = rate + span_force_rate(problem, state, system, monitor%obstacle, monitor%component)
            rate = monitor%factor * rate
         else
            number = new_monitor_functional(problem, state, system, m)
            rate = number%change(system%tangent, 1.0_wp)
         end if
      end associate
   end function monitor_rate

   !> A monitor as a functional (value and linearisation).
   type(functional_t) function new_monitor_functional(problem, state, system, m) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled and factored at `state`
      integer, intent(in) :: m                   !! index into model%monitor
      associate (monitor => problem%deck%monitor(m))
         if (monitor%quantity == quantity_displacement) then
            number = new_displacement_functional(problem, state, system, m)
            return
         end if
         number = new_functional(system%n)
         number%value = monitor%offset
         if (monitor%quantity == quantity_section) then
            call number%add(monitor%factor, new_section_functional(problem, state, system, monitor))
         else if (monitor%quantity == quantity_contact) then
            call number%add(monitor%factor, new_contact_functional(problem, state, system, monitor%obstacle, monitor%component))
         else
            call number%add(monitor%factor, new_support_force_functional(problem, state, system, m))
         end if
      end associate
   end function new_monitor_functional

   !> Linearisation of the sum of all forces of an obstacle on the structure.
   type(functional_t) function new_contact_functional(problem, state, system, obstacle, component) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      number = new_fixed_contact_functional(problem, state, system, obstacle, component)
      if (.not. problem%has_spans() .or. problem%model%obstacle(obstacle)%at_nodes) return
      number%estimated = .not. (any(acts_at_nodes(problem, state, obstacle)) .or. has_foundation(problem, obstacle))
      call number%add(1.0_wp, new_span_force_functional(problem, state, system, obstacle, component))
   end function new_contact_functional

   !> Linearisation of the sum of an obstacle's forces except those on contact spans: forces at nodes, and distributed foundation
   !> forces. Only forces of stops, on nodes that the deck names, have an error estimate. The ends of all other such contact depend
   !> on the mesh or are inside elements.
   type(functional_t) function new_fixed_contact_functional(problem, state, system, obstacle, component) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      number = new_functional(system%n)
      associate (acts => acts_at_nodes(problem, state, obstacle))
         if (any(acts)) call number%add(1.0_wp, new_reactions_functional(problem, state, system, acts, component))
      end associate
      if (has_foundation(problem, obstacle)) &
         & call number%add(1.0_wp, new_foundation_force_functional(problem, state, system, obstacle, component))
      number%estimated = problem%model%obstacle(obstacle)%at_nodes
   end function new_fixed_contact_functional
end module monitors
