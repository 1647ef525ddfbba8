!> Monitors as functionals: displacements, reactions of supports and springs, forces of stops and of contact spans.
!>
!> The reaction of a support is the residual of its fixed unknown; the force of a spring is proportional to its displacement.
module monitor_functional
   use kinds, only: wp
   use model, only: quantity_displacement, quantity_contact
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, to_node
   use element_products, only: element_unknowns
   use band_matrix, only: band_times
   use state_functional, only: functional_t
   use displacement_functional, only: new_displacement_functional
   use contact_totals, only: contact_sum_known, contact_sum_defect, contact_sum_gradient
   use stop_forces, only: stop_force_gradient, stop_force_defect
   implicit none
   private
   public :: new_monitor_functional

contains

   !> A monitor with its linearisation. `known` is false for contact forces that include forces other than those of contact spans.
   function new_monitor_functional(problem, state, system, m) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: m                   !! index into model%monitor
      type(functional_t) :: number
      real(wp) :: along(3), spring(system%n)
      integer :: i, d, node
      associate (monitor => problem%deck%monitor(m))
         number%known = .true.
         if (monitor%quantity == quantity_displacement) then
            number = new_displacement_functional(problem, state, system, m)
            return
         end if
         allocate (number%by_unknown(system%n), number%by_force(system%n), source=0.0_wp)
         allocate (number%by_element(6, problem%model%mesh%n_elements), source=0.0_wp)
         if (watches_stops(problem, m)) then
            call stop_force_gradient(problem, state, system, m, spring, number%by_load, number%by_force)
            call through_equations()
            number%defect = stop_force_defect(problem, state, system, m)
            return
         else if (monitor%quantity == quantity_contact) then
            number%known = contact_sum_known(problem, state, m)
            if (.not. number%known) return
            call contact_sum_gradient(problem, state, system, m, number%by_unknown, number%by_load, number%by_force, &
               & number%by_element)
            ! The sum consists of nodal forces at touchdown points: the polynomials between nodes do not enter.
            number%defect = contact_sum_defect(problem, state, system, m)
            return
         end if
         ! The reaction of a support is the residual of its fixed unknown; the force of a spring follows from its displacement.
         spring = 0.0_wp
         do i = 1, size(monitor%node)
            node = problem%mesh_node(monitor%node(i))
            if (node == 0) cycle
            d = dof(problem, node, 1)
            along = 0.0_wp
            along(monitor%component) = monitor%factor
            call to_node(system, node, along)
            if (problem%model%fixed(monitor%component, node)) then
               number%by_force(d:d + 2) = number%by_force(d:d + 2) + along
            else
               spring(d:d + 2) = spring(d:d + 2) - problem%spring(monitor%component, node) * along
            end if
         end do
         call through_equations()
      end associate

   contains

      !> Linearises the residual by the unknowns, the load factor and the end forces of the elements.
      subroutine through_equations()
         integer :: e
         call band_times(system%k, number%by_force, number%by_unknown)
         number%by_unknown = number%by_unknown + spring
         number%by_load = number%by_load - dot_product(number%by_force, system%load)
         do e = 1, problem%model%mesh%n_elements
            number%by_element(:, e) = element_unknowns(problem, system, number%by_force, e)
         end do
      end subroutine through_equations
   end function new_monitor_functional

   !> True for a monitor of the contact force of stops.
   pure logical function watches_stops(problem, m)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                   !! index into model%monitor
      associate (monitor => problem%deck%monitor(m))
         watches_stops = monitor%quantity == quantity_contact
         if (watches_stops) watches_stops = problem%model%obstacle(monitor%obstacle)%at_nodes
      end associate
   end function watches_stops
end module monitor_functional
