!> Values the deck watches: displacements and support reactions of nodes.
module monitors
   use kinds, only: wp
   use model, only: monitor_t, quantity_displacement
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t
   implicit none
   private
   public :: monitor_values

contains

   !> All monitors at a converged state, the system assembled there.
   function monitor_values(problem, state, system) result(values)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: values(size(problem%model%monitor)), total
      integer :: m, i
      do m = 1, size(problem%model%monitor)
         associate (monitor => problem%model%monitor(m))
            total = 0.0_wp
            if (monitor%quantity == quantity_displacement) then
               do i = 1, size(monitor%node)
                  total = total + state%u(monitor%component, monitor%node(i)) / size(monitor%node)
               end do
            else
               do i = 1, size(monitor%node)
                  if (.not. problem%model%fixed(monitor%component, monitor%node(i))) cycle
                  ! Internal minus external force is what the support adds.
                  total = total + system%raw(dof(problem, monitor%node(i), monitor%component))
               end do
            end if
            values(m) = monitor%offset + monitor%factor * total
         end associate
      end do
   end function monitor_values
end module monitors
