!> Where a run stands: the last accepted point and what is known about it.
module path_run
   use kinds, only: wp
   use model, only: method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use path_control, only: control_t, set_tangent
   use path_events, only: probe_t, new_probe
   implicit none
   private
   public :: run_t, probe_at

   !> Kept together so that the procedures of the path loop have short argument lists.
   type :: run_t
      type(state_t) :: state                     !! the last accepted point
      type(system_t) :: system
      type(control_t) :: control
      type(probe_t) :: probe
      real(wp) :: arc_length = 0.0_wp            !! travelled since the start of the run
      integer :: points = 0                      !! recorded so far, all steps
      integer :: step_points = 0                 !! accepted in this step
      real(wp) :: last_length = 0.0_wp, last_load = 0.0_wp !! of the last increment: arc length, load factor
      real(wp), allocatable :: direction(:, :)   !! last increment of the displacements
      real(wp) :: direction_load = 0.0_wp        !! and of the load factor
   end type run_t

contains

   !> Probe at a converged state at which the system is factored; the direction comes from the last accepted point.
   type(probe_t) function probe_at(problem, run, state) result(probe)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(state_t), intent(in) :: state
      type(control_t) :: control
      control%method = method_cylindrical
      call set_tangent(problem, run%system, state%u - run%state%u, state%load_factor - run%state%load_factor, control)
      probe = new_probe(problem, state, run%system, control%tangent_load)
   end function probe_at
end module path_run
