!> Requests another mesh or a smaller residual for a point whose errors exceed the deck's tolerance or are far below it.
module remeshing
   use kinds, only: wp
   use model, only: step_t, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use force_free_contact, only: remove_force_free_lines
   use ground_cuts, only: find_cuts, marked
   use trial_request, only: request_t
   use path_state, only: path_state_t, rest_of_mesh, located_event_t
   use path_events, only: event_release
   use path_outcome, only: outcome_t
   use error_bar, only: error_bars_t
   use mesh_request, only: most_meshes, request_mesh, coarser_mesh, motion_sizes, value_sizes
   implicit none
   private
   public :: request_mesh_at_event, request_finer_mesh, request_coarser_mesh, sizes_there

   real(wp), parameter :: most_sharp = 1.0e-5_wp !! smallest residual tolerance that is requested, over the step's tolerance;
   !! smaller residuals are rounding

contains

   !> Requests a finer mesh if the errors of an event exceed the tolerance. At a detachment, line contacts that carry no force open.
   !> The errors of a detachment are those of the problem without these contacts, so that the mesh of that problem is refined. (The
   !> elements of the line contacts lie on a straight wall and are exact.)
   subroutine request_mesh_at_event(problem, step, run, located_event, tries, outcome, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(located_event_t), intent(in) :: located_event !! the event and the place at which it was located
      integer, intent(in) :: tries                       !! number of meshes made because of the event's errors
      type(outcome_t), intent(in) :: outcome
      type(request_t), intent(inout) :: request
      type(problem_t) :: free
      type(state_t) :: released
      logical :: any_weak
      any_weak = .false.
      associate (place => located_event%point%state, system => located_event%point%system)
         if (located_event%event%kind == event_release) call remove_force_free_lines(problem, place, system, free, released, &
            & any_weak)
         if (any_weak) then
            call request_finer_mesh(free, step, run, released, system%force_scale, located_event%bars, .true., tries, outcome, &
               & request)
         else
            call request_finer_mesh(problem, step, run, place, system%force_scale, located_event%bars, .true., tries, &
               & outcome, request)
         end if
      end associate
   end subroutine request_mesh_at_event

   !> Requests a finer mesh, or a smaller residual, if the errors of a point exceed the tolerance.
   subroutine request_finer_mesh(problem, step, run, place, force_scale, bars, critical, tries, outcome, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: place
      real(wp), intent(in) :: force_scale        !! scale of forces at the point (force_scale of its system)
      type(error_bars_t), allocatable, intent(in) :: bars
      logical, intent(in) :: critical !! true: the point is a critical point, whose error bars must be bounded
      integer, intent(in) :: tries    !! number of meshes made because of the point's errors
      type(outcome_t), intent(in) :: outcome
      type(request_t), intent(inout) :: request
      real(wp) :: asked
      logical :: can_settle
      asked = merge(step%asked, step%asked_of_path, critical)
      if (.not. allocated(bars) .or. .not. asked > 0.0_wp .or. tries > most_meshes) return
      if (tries == 0) call request%begin_increment()
      if (tries > 0 .and. .not. request%at_last_point) then
         ! If the trial's mesh lacks nodes at interface points, the new mesh is made at the last accepted point.
         request%at_last_point = .not. marked(problem, place, find_cuts(problem, place))
         if (request%at_last_point) then
            request%density = problem%demand
            if (allocated(request%density_before)) request%density = request%density_before
            return
         end if
      end if
      can_settle = .not. step%tolerance_given .and. problem%model%step(problem%step)%sharper > most_sharp
      call request_mesh(problem, place, bars, sizes_there(problem, step, run, place, force_scale, asked, outcome), &
         & step%asked_of, asked, &
         & critical, tries, can_settle, run%mesh%refinement, request%smaller_residual, request%density)
      ! If the finer mesh has not reduced the errors, it is coarsened again; otherwise the mesh would be refined at each further
      ! point.
      if (run%mesh%refinement%in_vain) run%mesh%coarser = run%mesh%refinement%demand
      ! The mesh is made for the last accepted point, not for the trial, if a free span that the elements did not resolve may open
      ! after this point, or if the trial's mesh has nodes at all interface points.
      if (allocated(request%density) .and. .not. request%at_last_point) &
         & request%at_last_point = allocated(bars%may_change) .or. marked(problem, place, find_cuts(problem, place))
   end subroutine request_finer_mesh

   !> Requests a coarser mesh if the errors of a point are far below the tolerance.
   subroutine request_coarser_mesh(problem, step, run, place, force_scale, bars, tries, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: place
      real(wp), intent(in) :: force_scale        !! scale of forces at the point (force_scale of its system)
      type(error_bars_t), intent(in) :: bars
      integer, intent(in) :: tries               !! number of meshes made because of the point's errors
      type(outcome_t), intent(in) :: outcome
      if (tries > 0) run%mesh%points_to_keep = rest_of_mesh
      run%mesh%points_to_keep = max(run%mesh%points_to_keep - 1, 0)
      if (run%mesh%points_to_keep > 0 .or. .not. step%asked_of_path > 0.0_wp) return
      call coarser_mesh(problem, place, bars, sizes_there(problem, step, run, place, force_scale, step%asked_of_path, outcome), &
         & step%asked_of, step%asked_of_path, run%mesh%coarser)
   end subroutine request_coarser_mesh

   !> Values to which the errors of a point are related (relative error = error / value): of the load factor, then of the monitors.
   function sizes_there(problem, step, run, place, force_scale, asked, outcome) result(sizes)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: place
      real(wp), intent(in) :: force_scale        !! scale of forces at the point (force_scale of its system)
      real(wp), intent(in) :: asked              !! relative error that is allowed
      type(outcome_t), intent(in) :: outcome
      real(wp) :: sizes(1 + size(problem%deck%monitor)), load
      load = abs(place%load_factor)
      if (outcome%accuracy%load_step == problem%step) load = max(load, outcome%accuracy%load)
      ! The first point may be almost unloaded, so that its values are no reference.
      if (step%method /= method_displacement) load = max(load, abs(step%increment))
      sizes = value_sizes(problem, max(force_scale, outcome%accuracy%force), load, &
         & max(run%motion, motion_sizes(problem, place%u)), asked)
   end function sizes_there
end module remeshing
