!> The run on another mesh: of another set of touches, or finer where spans have grown.
module span_mesh
   use kinds, only: wp
   use model, only: method_linearised
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use contact_touch, only: touch_t
   use span_problem, only: new_span_problem, hold_touches, present_touches, outgrown
   use touchdown_points, only: carry_forces
   use state_transfer, only: carried, carried_field
   use path_control, only: control_t
   use path_continuity, only: heading_t, heading_at
   use path_events, only: probe_t, new_probe
   use path_run, only: run_t, forget_mesh
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: renew_mesh, take_touches

contains

   !> A finer mesh for spans that have grown, at the point where the run stands; nothing changes where no equilibrium is found on
   !> it.
   subroutine renew_mesh(problem, run, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: kept
      type(state_t) :: place, better
      type(heading_t) :: heading
      type(control_t) :: hold
      type(increment_t) :: report
      type(touch_t), allocatable :: touch(:)
      type(probe_t) :: probe
      if (.not. outgrown(problem, run%state)) return
      touch = present_touches(problem, run%state)
      kept = problem
      place = run%state
      heading = run%heading
      call take_problem(new_span_problem(problem, touch, run%state), problem, run, timers)
      if (run%system%ok) then
         ! Across the path: at a limit point, too.
         hold%method = method_linearised
         hold%tangent = run%heading%u
         hold%whole = 1.0_wp
         better = run%state
         call correct(problem, run%state, hold, .true., better, run%system, report, timers)
      end if
      if (run%system%ok .and. report%converged) then
         run%state = better
         run%heading = heading_at(problem, run%system, run%heading%u, run%heading%load)
         probe = new_probe(problem, run%state, run%system, run%heading%load)
         ! What lines without pressure tell does not hang on the mesh.
         probe%weak = run%probe%weak
         probe%free_pivots = run%probe%free_pivots
         run%probe = probe
         return
      end if
      problem = kept
      run%state = place
      run%heading = heading
      run%system = new_system(problem)
      call linearise(problem, run%state, run%state, run%system, timers)
   end subroutine renew_mesh

   !> The run on the mesh of another set of touches.
   subroutine take_touches(problem, run, touch, timers)
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      type(touch_t), intent(in) :: touch(:)
      type(timers_t), intent(inout) :: timers
      call take_problem(new_span_problem(problem, touch), problem, run, timers)
   end subroutine take_touches

   !> The run on the mesh of another problem.
   subroutine take_problem(next, problem, run, timers)
      type(problem_t), intent(in) :: next
      type(problem_t), intent(inout) :: problem
      type(run_t), intent(inout) :: run
      type(timers_t), intent(inout) :: timers
      type(state_t) :: state
      state = carried(problem, run%state, next)
      call hold_touches(next, state%active)
      call carry_forces(problem, run%state, next, state)
      run%heading%u = carried_field(problem, run%state, run%heading%u, next, state)
      call forget_mesh(run)
      problem = next
      run%state = state
      run%system = new_system(problem)
      call linearise(problem, run%state, run%state, run%system, timers)
   end subroutine take_problem
end module span_mesh
