!> Remeshes a run: for another contact set, for contact spans that have grown, or for the error tolerance.
module span_mesh
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use span_start, only: prepare_spans
   use span_problem, only: new_span_problem
   use span_division, only: present_demand, lasting_demand, outgrown
   use span_candidates, only: present_contact_spans
   use mesh_transfer, only: transfer_and_solve, rebalance
   use mesh_density, only: mesh_density_t
   use ground_mark, only: cut_t
   use ground_cuts, only: find_cuts, marked
   use ground_segments, only: assign_segments
   use state_transfer, only: carried, carried_field
   use path_continuity, only: path_tangent_t
   use path_point, only: path_point_t, point_at
   use trial_request, only: request_t
   use path_state, only: path_state_t, copy_path_state, point_on_mesh_t, forget_mesh, rest_of_mesh
   use timing, only: count_up, counter_remeshed
   implicit none
   private
   public :: prepare_mesh, renew_mesh, refine_mesh, coarsen_mesh, step_back, request_double_mesh

contains

   !> Makes the first mesh of a path.
   subroutine prepare_mesh(problem)
      type(problem_t), intent(inout) :: problem      !! in: on the deck's mesh
      type(contact_span_t) :: none(0)
      if (any(problem%deck%contact%along)) then
         call prepare_spans(problem)
      else if (any(problem%layout%rod_segment%placed)) then
         problem = new_span_problem(problem, none)
      end if
   end subroutine prepare_mesh

   !> Remeshes at the run's last point: finer where contact spans have grown, and with nodes at the interface points of foundations.
   subroutine renew_mesh(problem, run)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      logical :: done
      type(cut_t), allocatable :: cut(:)
      if (any(problem%layout%rod_segment%placed)) problem%demand = lasting_demand(problem, run%last%state)
      cut = find_cuts(problem, run%last%state)
      if (.not. (problem%has_spans() .or. size(cut) > 0 .or. size(problem%mark) > 0)) return
      if (marked(problem, run%last%state, cut)) then
         if (.not. outgrown(problem, run%last%state, cut)) return
      end if
      call transfer_and_solve(new_span_problem(problem, present_contact_spans(problem, run%last%state), run%last%state, cut), &
         & problem, run, done)
   end subroutine renew_mesh

   !> Remeshes as the last trial requires: at the run's last point, from which the increment is then repeated, or else at the trial.
   subroutine refine_mesh(problem, run, trial, settled, request, taken, done)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(inout) :: trial
      logical, intent(in) :: settled                 !! true: the trial is in equilibrium
      type(request_t), intent(inout) :: request      !! in: contains the required mesh density; out: without it
      logical, intent(out) :: taken                  !! true: the trial is in equilibrium on the new mesh
      logical, intent(out) :: done !! false: no equilibrium was found, and nothing has changed; true: the run is on a new mesh,
      !! which may also be the mesh before the last coarsening
      type(problem_t) :: asked, here
      type(point_on_mesh_t), allocatable :: finer
      type(cut_t), allocatable :: cut(:)
      integer :: k
      taken = .false.
      done = .false.
      call move_alloc(run%mesh%before_coarsening, finer)
      call copy_problem(problem, asked)
      asked%demand = request%density
      deallocate (request%density)
      call copy_problem(asked, here)
      here%demand = transferred_density(problem, run%last%state, asked%demand)
      cut = find_cuts(problem, trial%state)
      ! An unloaded start has no ends of contact: the new mesh is made for the trial instead.
      if (settled .and. run%fresh) call remesh_trial(.false.)
      if (.not. taken .and. (problem%has_spans() .or. request%at_last_point .or. marked(problem, trial%state, &
         & cut))) call remesh_last_point()
      ! If contact was just detected at nodes or by elements on foundations, the run's last point does not have the spans of the
      ! trial, and the mesh is made for the trial.
      if (.not. (taken .or. done)) request%density_before = present_demand(problem, run%last%state)
      if (.not. (taken .or. done)) call remesh_trial(request%events_located)
      ! If Newton's method fails on the requested mesh, it may converge on a finer mesh.
      if (.not. (taken .or. done)) then
         do k = 1, size(here%demand)
            here%demand(k)%elements = 2.0_wp * here%demand(k)%elements
         end do
         call remesh_last_point()
      end if
      if (.not. (taken .or. done)) call remesh_trial(.false.)
      done = done .or. taken
      if (.not. done .and. allocated(finer)) then
         ! No requested mesh has given an equilibrium: the mesh before the last coarsening is restored.
         call step_back(finer, problem, run)
         done = .true.
      end if
      if (done) call count_up(counter_remeshed)

   contains

      !> Transfers the run's last point to the requested mesh.
      subroutine remesh_last_point()
         call transfer_and_solve(new_span_problem(here, present_contact_spans(problem, run%last%state), run%last%state, &
            & find_cuts(problem, run%last%state)), problem, run, done)
      end subroutine remesh_last_point

      !> Transfers the trial, in equilibrium, and the run's last point, in equilibrium if possible, to another mesh.
      subroutine remesh_trial(both)
         logical, intent(in) :: both                    !! true: the run's last point, too, must be in equilibrium on the new mesh
         type(problem_t) :: before
         type(path_state_t) :: unmoved
         type(path_point_t) :: start, moved
         type(state_t) :: state
         logical :: fresh, settled
         call copy_problem(problem, before)
         call copy_path_state(run, unmoved)
         start = run%last
         run%last%state = trial%state
         fresh = run%fresh
         run%fresh = .false.
         call transfer_and_solve(new_span_problem(asked, present_contact_spans(problem, trial%state), trial%state, &
            & find_cuts(problem, trial%state)), problem, run, taken)
         run%fresh = fresh
         moved = run%last
         run%last = start
         if (.not. taken) return
         state = carried(before, start%state, problem)
         call assign_segments(problem, state, carried=.true.)
         run%last = point_at(problem, state)
         run%last%tangent = path_tangent_t(carried_field(before, start%state, start%tangent%u, problem, state), start%tangent%load)
         run%last%test_values = start%test_values
         if (.not. fresh) then
            ! Shorter increments may start at the run's last point, and events may be located from there.
            call rebalance(problem, run, settled)
            taken = settled .or. .not. both
            if (.not. taken) then
               call copy_problem(before, problem)
               call copy_path_state(unmoved, run)
               return
            end if
         end if
         trial = moved
      end subroutine remesh_trial
   end subroutine refine_mesh

   !> Mesh density for a trial, transferred to the mesh of another state: the density inside a span moves with the ends of the span.
   function transferred_density(problem, state, demand) result(here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t), intent(in) :: demand(:) !! mesh density by elements of the problem, or by other pieces of the rods
      type(mesh_density_t) :: here(size(demand))
      integer :: k
      here = present_demand(problem, state)
      do k = 1, size(demand)
         if (size(here(k)%elements) == size(demand(k)%elements)) then
            here(k)%elements = demand(k)%elements
         else
            here(k) = demand(k)
         end if
      end do
   end function transferred_density

   !> Coarsens the mesh as far as the errors of the last point permit, if the coarser mesh has fewer elements and an equilibrium
   !> exists on it. Whether increments converge on the coarser mesh is seen at the next trial.
   subroutine coarsen_mesh(problem, run)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(problem_t) :: asked
      type(point_on_mesh_t), allocatable :: before
      logical :: done
      call copy_problem(problem, asked)
      asked%demand = run%mesh%coarser
      deallocate (run%mesh%coarser)
      asked = new_span_problem(asked, present_contact_spans(problem, run%last%state), run%last%state, find_cuts(problem, &
         & run%last%state))
      if (asked%model%mesh%n_elements >= problem%model%mesh%n_elements) then
         ! The spans already have the smallest permitted counts of elements.
         run%mesh%points_to_keep = rest_of_mesh
         return
      end if
      before = point_on_mesh_t(problem, run%last)
      call transfer_and_solve(asked, problem, run, done)
      if (.not. done) return
      ! The coarser mesh is rejected if the load rate changes its sign on it.
      if (run%last%tangent%load * before%point%tangent%load < 0.0_wp) then
         call step_back(before, problem, run)
         return
      end if
      call move_alloc(before, run%mesh%before_coarsening)
      call count_up(counter_remeshed)
   end subroutine coarsen_mesh

   !> Returns the run to its last point before the mesh was coarsened. The finer mesh is then kept for some further points.
   subroutine step_back(finer, problem, run)
      type(point_on_mesh_t), intent(in) :: finer
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      call copy_problem(finer%problem, problem)
      run%last = finer%point
      call forget_mesh(run)
      run%mesh%points_to_keep = rest_of_mesh
   end subroutine step_back

   !> Requests twice the number of elements everywhere.
   subroutine request_double_mesh(problem, state, request, asked)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(request_t), intent(inout) :: request
      logical, intent(out) :: asked                  !! false: the mesh is given by the deck and must not change
      integer :: k
      asked = any(problem%layout%rod_segment%placed) .and. .not. problem%is_sampled()
      if (.not. asked) return
      request%density = present_demand(problem, state)
      do k = 1, size(request%density)
         request%density(k)%elements = 2.0_wp * request%density(k)%elements
      end do
   end subroutine request_double_mesh
end module span_mesh
