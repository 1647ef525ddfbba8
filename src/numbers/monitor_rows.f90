!> Monitors of displacements as functions of the unknowns: value, gradient, change along a solved increment. What is watched is the
!> material point that the deck names, whatever node carries a contact there.
module monitor_rows
   use kinds, only: wp
   use model, only: quantity_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, to_global
   use deck_nodes, only: deck_displacements, node_gradient_t, deck_node_gradient
   implicit none
   private
   public :: monitor_row_t, monitor_row, watched_displacement, monitor_change, left_open

   !> Derivatives of a monitor's value.
   type :: monitor_row_t
      real(wp), allocatable :: node(:, :)       !! (3, nodes) by the displacements, global axes
      real(wp) :: load = 0.0_wp                 !! by the load factor
      real(wp) :: defect = 0.0_wp               !! change when the elements close their own defects
   end type monitor_row_t

contains

   !> Value of a displacement monitor.
   pure real(wp) function watched_displacement(problem, state, m) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m                  !! index into model%monitor, of a displacement
      real(wp) :: u(3, size(problem%deck%monitor(m)%node))
      integer :: i
      associate (monitor => problem%deck%monitor(m))
         u = deck_displacements(problem, state, monitor%node)
         value = 0.0_wp
         do i = 1, size(monitor%node)
            value = value + u(monitor%component, i) / size(monitor%node)
         end do
         value = monitor%offset + monitor%factor * value
      end associate
   end function watched_displacement

   !> Gradient of a displacement monitor.
   subroutine monitor_row(problem, state, system, m, row)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: m                  !! index into model%monitor, of a displacement
      type(monitor_row_t), intent(out) :: row
      type(node_gradient_t) :: gradient
      real(wp) :: weight
      logical :: inside
      integer :: i, k
      allocate (row%node(3, problem%model%mesh%n_nodes), source=0.0_wp)
      associate (monitor => problem%deck%monitor(m))
         weight = monitor%factor / size(monitor%node)
         do i = 1, size(monitor%node)
            associate (at => monitor%node(i), component => monitor%component)
               call deck_node_gradient(problem, state, system, at, gradient, inside)
               if (.not. inside) then
                  row%node(component, gradient%node(1)) = row%node(component, gradient%node(1)) + weight
                  cycle
               end if
               do k = 1, 2
                  row%node(:, gradient%node(k)) = row%node(:, gradient%node(k)) + weight * gradient%ends(component, :, k)
               end do
               row%load = row%load + weight * gradient%load(component)
               row%defect = row%defect + weight * gradient%defect(component)
            end associate
         end do
      end associate
   end subroutine monitor_row

   !> Change of a displacement monitor along a solved increment. Along the path, per unit of load factor: x = system%tangent,
   !> y = 1.
   real(wp) function monitor_change(problem, m, state, system, x, y) result(change)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                  !! index into model%monitor, of a displacement
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      real(wp), intent(in) :: x(:)              !! (n) nodal increments, node axes
      real(wp), intent(in) :: y                 !! of the load factor
      type(monitor_row_t) :: row
      integer :: node
      call monitor_row(problem, state, system, m, row)
      change = row%load * y
      do node = 1, size(row%node, 2)
         if (any(abs(row%node(:, node)) > 0.0_wp)) change = change + &
            & dot_product(row%node(:, node), to_global(problem, system, x, node))
      end do
   end function monitor_change

   !> True for a monitor that loads leave open: it changes, by more than the equilibrium is known to, with how far a rod rolls that
   !> may (rolling_rods). Forces do not.
   logical function left_open(problem, m, state, system)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                  !! index into model%monitor
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! factored at `state`
      associate (monitor => problem%deck%monitor(m))
         left_open = monitor%quantity == quantity_displacement .and. system%roll_range > 0.0_wp
         if (left_open) left_open = abs(monitor_change(problem, m, state, system, system%rolled, 0.0_wp)) * system%roll_range > &
            & sqrt(problem%model%step(problem%step)%tolerance) * abs(monitor%factor) * problem%size
      end associate
   end function left_open
end module monitor_rows
