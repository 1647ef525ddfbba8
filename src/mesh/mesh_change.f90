!> Transfer of a state to another mesh, as the first guess of the equilibrium on that mesh.
module mesh_change
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use ground_segments, only: assign_segments
   use state_transfer, only: carried, carried_field
   use touchdown_points, only: carry_forces
   implicit none
   private
   public :: carry_over

contains

   !> Transfers a state and a displacement direction to another mesh. Forces of contacts that exist on both meshes are transferred,
   !> too.
   subroutine carry_over(problem, next, state, direction)
      type(problem_t), intent(in) :: problem, next  !! problems of the same deck
      type(state_t), intent(inout) :: state         !! in: state of `problem`, in equilibrium; out: state of `next`
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacement direction; out: at the nodes of `next`
      type(state_t) :: there
      there = carried(problem, state, next)
      call assign_segments(next, there, carried=.true.)
      call carry_forces(problem, state, next, there)
      direction = carried_field(problem, state, direction, next, there)
      state = there
   end subroutine carry_over
end module mesh_change
