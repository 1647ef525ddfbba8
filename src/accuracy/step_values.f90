!> Load factor and monitors after one step of Newton's method, linear in the step: what they are where the step is short, without
!> the equations at its end.
module step_values
   use kinds, only: wp
   use model, only: quantity_displacement, quantity_contact
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, to_global, row_times
   use monitor_rows, only: monitor_row_t, monitor_row, watched_displacement
   implicit none
   private
   public :: values_after, largest_rotation

contains

   !> Load factor and monitors; zero for forces of contact, which errors are not told of where nodes stay.
   function values_after(problem, state, system, x, y) result(value)
      type(problem_t), intent(in) :: problem     !! its nodes stay where they are
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled there
      real(wp), intent(in) :: x(:)               !! (n) the step, node axes
      real(wp), intent(in) :: y                  !! and of the load factor
      real(wp) :: value(1 + size(problem%model%monitor))
      integer :: m
      value(1) = state%load_factor + y
      do m = 1, size(problem%model%monitor)
         select case (problem%deck%monitor(m)%quantity)
         case (quantity_displacement)
            value(1 + m) = displacement(m)
         case (quantity_contact)
            value(1 + m) = 0.0_wp
         case default
            value(1 + m) = support_reaction(m)
         end select
      end do

   contains

      real(wp) function displacement(m)
         integer, intent(in) :: m                !! index into model%monitor
         type(monitor_row_t) :: row
         integer :: node
         call monitor_row(problem, state, system, m, row)
         displacement = watched_displacement(problem, state, m) + row%defect + row%load * y
         do node = 1, size(row%node, 2)
            if (any(abs(row%node(:, node)) > 0.0_wp)) displacement = displacement + &
               & dot_product(row%node(:, node), to_global(problem, system, x, node))
         end do
      end function displacement

      !> What is out of balance there is what the support adds.
      real(wp) function support_reaction(m) result(total)
         integer, intent(in) :: m
         real(wp) :: moved(3)
         integer :: i, d, node
         total = 0.0_wp
         associate (monitor => problem%deck%monitor(m))
            do i = 1, size(monitor%node)
               node = problem%mesh_node(monitor%node(i))
               if (node == 0) cycle
               if (problem%model%fixed(monitor%component, node)) then
                  d = dof(problem, node, monitor%component)
                  total = total + system%residual(d) + row_times(system, d, x) - system%load(d) * y
               else
                  moved = state%u(:, node) + to_global(problem, system, x, node)
                  total = total - problem%spring(monitor%component, node) * moved(monitor%component)
               end if
            end do
            total = monitor%offset + monitor%factor * total
         end associate
      end function support_reaction
   end function values_after

   !> The largest rotation of a node in a step [rad].
   pure real(wp) function largest_rotation(problem, system, x) result(largest)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! gives the axes
      real(wp), intent(in) :: x(:)               !! (n) node axes
      real(wp) :: moved(3)
      integer :: node
      largest = 0.0_wp
      do node = 1, problem%model%mesh%n_nodes
         moved = to_global(problem, system, x, node)
         largest = max(largest, abs(moved(3)))
      end do
   end function largest_rotation
end module step_values
