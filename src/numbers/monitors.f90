!> Values the deck watches: displacements and support reactions of nodes, contact reactions of obstacles.
module monitors
   use kinds, only: wp
   use model, only: monitor_t, quantity_displacement, quantity_contact
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, to_global
   use contact_response, only: reaction_rate
   use span_forces, only: span_totals
   use bordered_system, only: apply_increment, held_force_change
   use ground_regions, only: foundation_totals, foundation_total_rates
   use displacement_functional, only: watched_displacement, monitor_change
   implicit none
   private
   public :: monitor_values, monitor_rate

contains

   !> Values of all monitors at a converged state at which the system is assembled.
   function monitor_values(problem, state, system) result(values)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: values(size(problem%model%monitor)), total, founded(3, size(problem%model%obstacle)), moment, &
         & pushed(3, size(problem%model%contact))
      integer :: m, i, node
      do m = 1, size(problem%model%monitor)
         associate (monitor => problem%deck%monitor(m))
            if (monitor%quantity == quantity_displacement) then
               values(m) = watched_displacement(problem, state, m)
               cycle
            end if
            total = 0.0_wp
            if (monitor%quantity == quantity_contact) then
               if (problem%has_spans()) then
                  call span_totals(problem, state, [0.0_wp, 0.0_wp], pushed, moment)
                  total = total + sum(pushed(monitor%component, :), mask=problem%model%contact%obstacle == monitor%obstacle)
               end if
               do i = 1, problem%candidates%n
                  if (problem%candidates%obstacle(i) /= monitor%obstacle .or. problem%candidates%contact_span(i) > 0) cycle
                  total = total + state%reaction(i) * share(monitor, system%normal(:, i))
               end do
               if (problem%ground%chain%n > 0) then
                  call foundation_totals(problem, state, founded)
                  total = total + founded(monitor%component, monitor%obstacle)
               end if
            else
               do i = 1, size(monitor%node)
                  ! A supported node is a segment boundary, and so a node of every mesh.
                  node = problem%mesh_node(monitor%node(i))
                  if (node == 0) cycle
                  if (.not. problem%model%fixed(monitor%component, node)) then
                     total = total - problem%spring(monitor%component, node) * state%u(monitor%component, node)
                     cycle
                  end if
                  ! The support reaction is the internal minus the external force.
                  total = total + system%raw(dof(problem, node, monitor%component))
               end do
            end if
            values(m) = monitor%offset + monitor%factor * total
         end associate
      end do
   end function monitor_values

   !> Derivative of a monitor along the path, by the load factor.
   real(wp) function monitor_rate(problem, m, state, system) result(rate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                 !! index into model%monitor
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      real(wp) :: moved(3), founded(3, size(problem%model%obstacle))
      integer :: i, d, node
      associate (monitor => problem%deck%monitor(m))
         rate = 0.0_wp
         if (monitor%quantity == quantity_displacement) then
            rate = monitor_change(problem, m, state, system, system%tangent, 1.0_wp)
         else if (monitor%quantity == quantity_contact) then
            if (problem%has_spans()) rate = monitor%factor * span_rate(monitor%component, monitor%obstacle)
            do i = 1, problem%candidates%n
               if (problem%candidates%obstacle(i) /= monitor%obstacle .or. .not. state%active(i)) cycle
               if (problem%candidates%contact_span(i) > 0) cycle
               rate = rate + monitor%factor * (reaction_rate(problem, system, i) * share(monitor, system%normal(:, i)) &
                  & + state%reaction(i) * turning(i))
            end do
            if (problem%ground%chain%n > 0) then
               call foundation_total_rates(problem, state, system, founded)
               rate = rate + monitor%factor * founded(monitor%component, monitor%obstacle)
            end if
         else
            do i = 1, size(monitor%node)
               node = problem%mesh_node(monitor%node(i))
               if (node == 0) cycle
               if (.not. problem%model%fixed(monitor%component, node)) then
                  moved = to_global(problem, system, system%tangent, node)
                  rate = rate - monitor%factor * problem%spring(monitor%component, node) * moved(monitor%component)
                  cycle
               end if
               d = dof(problem, node, monitor%component)
               rate = rate + monitor%factor * held_force_change(system, d, system%tangent, 1.0_wp)
            end do
         end if
      end associate

   contains

      !> Derivative of an obstacle's forces on contact spans along the path, as a difference.
      real(wp) function span_rate(component, obstacle) result(rate)
         integer, intent(in) :: component, obstacle
         type(state_t) :: ahead, here
         real(wp) :: totals(3, size(problem%model%contact), 2), moment, step
         integer :: c
         step = sqrt(epsilon(step)) * problem%size / max(maxval(abs(system%tangent)), tiny(step))
         here = state
         ahead = state
         call apply_increment(problem, system, 0.0_wp * system%tangent, 0.0_wp, here)
         call apply_increment(problem, system, step * system%tangent, step, ahead)
         ! The reaction at a fixed segment boundary is an unknown of its own.
         do c = 1, problem%candidates%n
            if (problem%candidates%contact_span(c) == 0 .or. system%unknown(c) == 0) cycle
            ahead%reaction(c) = ahead%reaction(c) + step * reaction_rate(problem, system, c)
         end do
         call span_totals(problem, here, [0.0_wp, 0.0_wp], totals(:, :, 1), moment)
         call span_totals(problem, ahead, [0.0_wp, 0.0_wp], totals(:, :, 2), moment)
         rate = sum(totals(component, :, 2) - totals(component, :, 1), mask=problem%model%contact%obstacle == obstacle) / step
      end function span_rate

      !> Change of direction of a contact force: the node moves along the obstacle, which may move itself.
      real(wp) function turning(candidate)
         integer, intent(in) :: candidate
         real(wp) :: step(3), along(2)
         turning = 0.0_wp
         if (problem%deck%monitor(m)%component > 2) return
         step = to_global(problem, system, system%tangent, problem%candidates%node(candidate))
         step(1:2) = step(1:2) - system%motion(:, candidate)
         along = [system%normal(2, candidate), -system%normal(1, candidate)]
         turning = system%bend(candidate) * dot_product(along, step(1:2)) * along(problem%deck%monitor(m)%component)
      end function turning
   end function monitor_rate

   !> Contribution of a unit normal reaction to a monitor of contact reactions.
   pure real(wp) function share(monitor, normal)
      type(monitor_t), intent(in) :: monitor
      real(wp), intent(in) :: normal(2)
      share = 1.0_wp
      if (monitor%component < 3) share = normal(monitor%component)
   end function share
end module monitors
