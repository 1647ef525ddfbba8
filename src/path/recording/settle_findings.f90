!> Decides about the events found on an increment before any of them is recorded: which are real, which error bars they have, and
!> whether a shorter increment, another mesh or a smaller residual is required first.
module settle_findings
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use corrector, only: increment_t
   use path_point, only: path_point_t
   use trial_request, only: request_t
   use path_state, only: path_state_t
   use step_control, only: stop_met
   use path_events, only: event_stop
   use event_search, only: findings_t, better_from_nearer, hides_release, turns_by_rounding, check_limit_shift, check_single_path, &
      & duplicates_of, beside
   use path_outcome, only: outcome_t
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_event, bars_at_point, note_error, tolerance_at
   use remeshing, only: request_mesh_at_event, request_finer_mesh, request_coarser_mesh, sizes_there
   use path_record, only: place_t
   implicit none
   private
   public :: arrival_t, settle

   !> Facts about a trial, the point at the end of an increment, that the caller knows.
   type :: arrival_t
      type(increment_t) :: report                !! report of the correction to the trial
      logical :: can_cut = .false.             !! true: the caller can replace the increment by a shorter one
      integer, allocatable :: tries !! number of meshes made because of this increment's errors; not allocated: another mesh cannot
      !! be requested. If another mesh is requested, no point is recorded
      character(2) :: label = ''               !! C+ or C- if the trial is a contact change with this label
      integer :: times = 1                     !! count of contacts that are gained or lost at the trial
      logical :: bracketed = .false.           !! true: the contact change was not located; it lies somewhere before the trial
      real(wp), allocatable :: since !! first load factor at which a bracketed change may lie; not allocated: that of the last point
      logical :: divides = .false.             !! C-: the contact span is divided, and parts of it stay in contact on both sides
      logical :: changes = .false.             !! true: the contact set changes at the trial, with or without a label
      logical, allocatable :: changing(:) !! (candidates) true: contact at the node begins or ends at the trial; not allocated: no
      !! such nodes known
      type(error_bars_t), allocatable :: bars  !! error bars of the trial at a change of contact spans; not allocated: unknown
   end type arrival_t

contains

   !> Completes the findings of an increment. If the request is not empty on return, the increment must be repeated.
   subroutine settle(problem, step, run, trial, arrival, findings, outcome, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run   !! the enriched problem stored in it is used again and updated
      type(path_point_t), intent(in) :: trial    !! end of the increment
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings !! in: events from find_events; out: complete
      type(outcome_t), intent(inout) :: outcome  !! receives the largest error of all points so far
      type(request_t), intent(inout) :: request  !! in: empty
      call reject_node_corners(run, trial, findings)
      findings%duplicate = duplicates_of(run, trial, arrival%label /= '' .or. arrival%changes, findings%seen)
      request%shorter = arrival%can_cut .and. better_from_nearer(problem, run, trial, findings)
      if (request%shorter) return
      request%events_located = any(findings%seen%located .and. .not. findings%duplicate)
      call note_conditions(problem, step, run, trial, arrival, findings)
      call settle_events(problem, step, run, trial, arrival, findings, outcome, request)
      if (request%shorter .or. request%repeats_increment()) return
      call settle_trial(problem, step, run, trial, arrival, findings, outcome, request)
   end subroutine settle

   !> Finds the contact changes at which the load turns (corners of the path). If contact at nodes changes within the increment, a
   !> limit point at a corner without a reported contact change is rejected: nodes that come into contact one after the other cause
   !> such corners, and other meshes do not have these corners.
   subroutine reject_node_corners(run, trial, findings)
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(findings_t), intent(inout) :: findings
      integer :: i
      findings%beside = beside(findings%seen)
      if (all(run%last%state%active .eqv. trial%state%active)) return
      do i = 1, size(findings%seen)
         associate (event => findings%seen(i)%event)
            if (.not. event%corner .or. event%law%candidate > 0 .or. findings%beside(i) > 0) cycle
            findings%seen(i)%located = .false.
            event%corner = .false.
            event%note = 'limit point of the load'
         end associate
      end do
   end subroutine reject_node_corners

   !> Notes two conditions on which error bars depend: whether the trial is the end of the step, and whether the mesh may be
   !> refined.
   subroutine note_conditions(problem, step, run, trial, arrival, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      findings%stops = stop_met(step, run%last%test_values, trial%test_values)
      ! The mesh is not refined if the deck gives it, or if a mesh was already made anew for this increment: a second mesh made at
      ! the trial would lack nodes at the interface points of the first mesh. (The mesh of the next increment, which begins at a
      ! point before the event, has these nodes.)
      findings%keeps_mesh = .not. any(problem%layout%rod_segment%placed)
      if (allocated(arrival%tries)) findings%keeps_mesh = findings%keeps_mesh .or. arrival%tries > 0
   end subroutine note_conditions

   !> Checks each located event and computes its error bars. It stops at the first event that requires another increment.
   subroutine settle_events(problem, step, run, trial, arrival, findings, outcome, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      type(outcome_t), intent(inout) :: outcome
      type(request_t), intent(inout) :: request
      integer :: i
      do i = 1, size(findings%seen)
         if (findings%duplicate(i) .or. findings%beside(i) > 0) cycle
         if (.not. findings%seen(i)%located) then
            findings%duplicate(i) = turns_by_rounding(problem, step, run, trial, findings%seen(i))
            cycle
         end if
         call settle_event(problem, step, run, trial, arrival, findings, outcome, request, i)
         if (request%shorter .or. request%repeats_increment()) return
      end do
   end subroutine settle_events

   !> Decides about one located event: it is rejected as spurious, accepted with error bars, or located again on a shorter
   !> increment or another mesh.
   subroutine settle_event(problem, step, run, trial, arrival, findings, outcome, request, i)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      type(outcome_t), intent(inout) :: outcome
      type(request_t), intent(inout) :: request
      integer, intent(in) :: i               ! index into findings%seen
      associate (located_event => findings%seen(i))
         findings%duplicate(i) = turns_by_rounding(problem, step, run, trial, located_event)
         if (findings%duplicate(i)) return
         ! An event at which a branch closes already has error bars: those of the same point on the parent path.
         if (allocated(located_event%bars)) return
         request%shorter = arrival%can_cut .and. located_event%event%kind == event_stop .and. hides_release(problem, run, &
            & findings, i)
         if (request%shorter) return
         call bars_at_event(problem, step, run, trial, located_event%event, located_event%point, located_event%bars, &
            & findings%keeps_mesh)
         ! The error bars may show that the rounding error is larger than assumed before.
         findings%duplicate(i) = turns_by_rounding(problem, step, run, trial, located_event)
         if (findings%duplicate(i)) return
         call check_limit_shift(problem, run, trial, located_event)
         if (allocated(arrival%tries)) &
            & call request_mesh_at_event(problem, step, run, located_event, arrival%tries, outcome, request)
         if (request%repeats_increment()) return
         call check_single_path(located_event)
         request%shorter = arrival%can_cut .and. .not. located_event%located
      end associate
   end subroutine settle_event

   !> Computes the error bars of the trial, if the deck requests them or a mesh request depends on them.
   subroutine settle_trial(problem, step, run, trial, arrival, findings, outcome, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      type(outcome_t), intent(inout) :: outcome
      type(request_t), intent(inout) :: request
      logical :: behind_end, critical, can_remesh
      if (allocated(arrival%bars)) findings%bars = arrival%bars
      ! A trial that lies after the end of the step is not a point of the step and gets no error bars.
      behind_end = any(findings%seen%located .and. findings%seen%event%kind == event_stop .and. .not. findings%duplicate)
      critical = arrival%label /= '' .or. findings%stops
      can_remesh = allocated(arrival%tries)
      if (.not. (allocated(findings%bars) .or. behind_end)) &
         & call bars_at_point(problem, step, run, trial, merge('  ', arrival%label, arrival%bracketed), findings%stops, 0, &
         & findings%bars, wanted=step%asked_of_path > 0.0_wp .and. any(problem%layout%rod_segment%placed), &
         & changing=arrival%changing, keeps_mesh=findings%keeps_mesh .and. critical)
      if (behind_end .or. .not. allocated(findings%bars)) return
      if (can_remesh) call request_finer_mesh(problem, step, run, trial%state, trial%system%force_scale, findings%bars, &
         & critical, arrival%tries, outcome, request)
      if (request%repeats_increment()) return
      if (.not. critical) call note_error(problem, step, findings%bars, sizes_there(problem, step, run, trial%state, &
         & trial%system%force_scale, tolerance_at(problem, step, ''), outcome), '', place_t(run%branch, problem%step, &
         & run%points + 1, trial%state%load_factor), outcome%accuracy)
      if (can_remesh .and. .not. (critical .or. any(findings%seen%located))) call request_coarser_mesh(problem, step, run, &
         & trial%state, trial%system%force_scale, findings%bars, arrival%tries, outcome)
      if (.not. (critical .or. step%bars_everywhere)) deallocate (findings%bars)
   end subroutine settle_trial
end module settle_findings
