!> Sums of the forces of stops at single nodes, as functions of the unknowns.
!>
!> The force of a rigid stop is the unbalanced force on the unknown that it fixes, as for a support; that of an elastic stop follows
!> from its law, as for a spring. Neither has a discretisation error between nodes.
module stop_forces
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, to_node, contact_reaction
   implicit none
   private
   public :: is_stop, stop_force_gradient, stop_force_defect

contains

   !> True for a stop at a node that the deck names; the node exists on every mesh.
   pure elemental logical function is_stop(problem, c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c                   !! candidate
      is_stop = problem%model%obstacle(problem%candidates%obstacle(c))%at_nodes
   end function is_stop

   !> Derivatives of a monitored sum by the unknowns and by the load factor, both through the laws of elastic stops only, and by the
   !> unbalanced forces. Node axes.
   subroutine stop_force_gradient(problem, state, system, m, by_unknown, by_load, by_force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m                   !! index into model%monitor, of the force of a stop
      real(wp), intent(out) :: by_unknown(:), by_force(:) !! (n)
      real(wp), intent(out) :: by_load
      real(wp) :: along(3), weight
      integer :: c, d, p
      by_unknown = 0.0_wp
      by_force = 0.0_wp
      by_load = 0.0_wp
      do c = 1, problem%candidates%n
         if (.not. counts(problem, state, m, c)) cycle
         weight = weight_of(problem, system, m, c)
         if (system%unknown(c) > 0) then
            d = system%unknown(c)
            by_force(d) = by_force(d) + weight / system%slope(c)
            ! Two stops at one node, see contact_reaction.
            p = system%partner(c)
            if (p == 0) cycle
            d = system%unknown(p)
            by_force(d) = by_force(d) - weight * dot_product(system%normal(:, c), system%normal(:, p)) / system%slope(p)
         else if (system%soft(c)) then
            weight = weight * system%spring(c)
            along = [system%normal(:, c), 0.0_wp]
            call to_node(system, problem%candidates%node(c), along)
            d = dof(problem, problem%candidates%node(c), 1)
            by_unknown(d:d + 2) = by_unknown(d:d + 2) - weight * along
            by_load = by_load + weight * (dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c))
         end if
      end do
   end subroutine stop_force_gradient

   !> Change of the sum if the stored reactions are replaced by those of the equations.
   real(wp) function stop_force_defect(problem, state, system, m) result(defect)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m
      real(wp) :: force
      integer :: c
      defect = 0.0_wp
      do c = 1, problem%candidates%n
         if (.not. counts(problem, state, m, c)) cycle
         force = state%reaction(c)
         if (system%unknown(c) > 0) then
            force = contact_reaction(system, c, system%residual)
         else if (system%soft(c)) then
            force = system%push(c)
         end if
         defect = defect + weight_of(problem, system, m, c) * (force - state%reaction(c))
      end do
   end function stop_force_defect

   !> True for an active stop of the monitor.
   pure logical function counts(problem, state, m, c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m, c
      counts = problem%candidates%obstacle(c) == problem%deck%monitor(m)%obstacle .and. state%active(c)
   end function counts

   !> Factor of a reaction in the monitor: its component along an axis, or the whole reaction.
   pure real(wp) function weight_of(problem, system, m, c) result(weight)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: m, c
      associate (monitor => problem%deck%monitor(m))
         weight = monitor%factor
         if (monitor%component < 3) weight = weight * system%normal(monitor%component, c)
      end associate
   end function weight_of
end module stop_forces
