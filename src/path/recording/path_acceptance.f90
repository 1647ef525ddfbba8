!> Acceptance of a converged increment: its events are located and recorded, then the trial, which becomes the last accepted point.
!>
!>   find_events (event_search) -> duplicates, does a shorter increment resolve more? (better_from_nearer)
!>   -> check of each event, error bars, mesh request (settle_events) -> the same for the trial (settle_trial)
!>   -> events in their order (record_events) -> the trial (record_trial), its labels (announce_contact) -> path state (arrive)
module path_acceptance
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use path_control, only: path_length
   use corrector, only: increment_t
   use path_point, only: path_point_t, evaluate_tests
   use trial_request, only: request_t
   use path_state, only: path_state_t, arrived_t, keep_critical_point
   use step_control, only: stop_met
   use contact_labels, only: contact_words
   use path_events, only: event_stop, event_bifurcation
   use known_path, only: check_closure
   use event_search, only: findings_t, find_events, better_from_nearer, hides_release, turns_by_rounding, check_limit_shift, &
      & check_single_path, duplicates_of, beside, count_before, same_place
   use ordering, only: ascending
   use event_recording, only: record_event, announce, new_critical, go_to
   use path_outcome, only: outcome_t, note_bracketed
   use point_recording, only: record
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_event, bars_at_point, note_error, tolerance_at
   use corner_limit, only: report_turned_load
   use remeshing, only: request_mesh_at_event, request_finer_mesh, request_coarser_mesh, sizes_there
   use path_record, only: recorder_t, place_t
   implicit none
   private
   public :: arrival_t, accept

   !> What the caller knows about a trial.
   type :: arrival_t
      type(increment_t) :: report                !! report of the correction to the trial
      logical :: can_cut = .false.             !! true: the caller can repeat the increment with a shorter one
      integer, allocatable :: tries !! number of meshes made because of this increment's errors; not allocated: another mesh cannot
      !! be requested. If another mesh is requested, no point is recorded
      character(2) :: label = ''               !! C+ or C- if the trial is a contact change with this label
      integer :: times = 1                     !! multiplicity of the contact change at the trial
      logical :: bracketed = .false.           !! true: the contact change was not located; it lies somewhere before the trial
      real(wp), allocatable :: since !! bracketed: load factor from which on it may lie; not allocated: that of the last point
      logical :: divides = .false.             !! C-: the contact span is divided, and parts of it stay in contact on both sides
      logical :: changes = .false.             !! true: the contact set changes at the trial, with or without a label
      logical, allocatable :: changing(:) !! (candidates) true: contact at the node begins or ends at the trial; not allocated: no
      !! such nodes known
      type(error_bars_t), allocatable :: bars  !! error bars of the trial at a change of contact spans; not allocated: unknown
   end type arrival_t

contains

   !> Locates, orders and records the events of a converged increment and then the trial, which becomes the last accepted point. If
   !> the increment must be repeated, no point is recorded.
   subroutine accept(problem, step, run, trial, arrival, recorder, request, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(inout) :: trial !! its test values are set
      type(arrival_t), intent(in) :: arrival
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request !! out: what the trial requires; if it requires another trial, no point was recorded
      logical, intent(out) :: finished           !! true: the step is complete
      type(outcome_t), intent(inout) :: outcome
      type(findings_t) :: findings
      finished = .false.
      call request%begin_trial()
      call evaluate_tests(problem, trial)
      call find_events(problem, step, run, trial, findings)
      call find_corners()
      findings%duplicate = duplicates_of(run, trial, arrival%label /= '' .or. arrival%changes, findings%seen)
      request%shorter = arrival%can_cut .and. better_from_nearer(problem, run, trial, findings)
      if (request%shorter) return
      request%events_located = any(findings%seen%located .and. .not. findings%duplicate)
      call begin_findings()
      call settle_events()
      if (request%shorter .or. request%repeats_increment()) return
      call settle_trial()
      if (request%repeats_increment()) return
      call report_turned_load(problem, step, run, recorder, outcome)
      if (allocated(outcome%why)) return
      call record_events()
      if (finished .or. allocated(outcome%why)) return
      finished = findings%stops
      if (arrival%label /= '') call check_closure(problem, run, trial%state, arrival%label, outcome)
      if (allocated(outcome%why)) return
      call record_trial()
      if (allocated(outcome%why)) return
      call announce_missed()
      if (arrival%label /= '') then
         call announce_contact()
      else if (arrival%changes) then
         call keep_change()
      end if
      if (finished) call announce(problem, run, new_critical('EP', 'end of the step', findings%bars), trial, .true., &
         & recorder, outcome)
      if (allocated(outcome%why)) return
      call arrive()

   contains

      !> Finds the contact changes at which the load turns (corners of the path). If contact at nodes changes within the increment,
      !> a limit point at a corner without a reported contact change is rejected: nodes that come into contact one after the other
      !> cause such corners, which other meshes do not have.
      subroutine find_corners()
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
      end subroutine find_corners

      !> Sets two conditions on which error bars depend: whether the trial is the end of the step, and whether the mesh may be
      !> refined.
      subroutine begin_findings()
         findings%stops = stop_met(step, run%last%test_values, trial%test_values)
         ! The mesh is not refined if the deck gives it, or if it was already made anew for this increment: a second mesh made at
         ! the trial would lack nodes at the interface points of the first mesh. (The mesh of the next increment, which begins at a
         ! point before the event, has these nodes.)
         findings%keeps_mesh = .not. any(problem%layout%rod_segment%placed)
         if (allocated(arrival%tries)) findings%keeps_mesh = findings%keeps_mesh .or. arrival%tries > 0
      end subroutine begin_findings

      !> Checks each located event and computes its error bars, up to the first that requires another increment.
      subroutine settle_events()
         integer :: i
         do i = 1, size(findings%seen)
            if (findings%duplicate(i) .or. findings%beside(i) > 0) cycle
            if (.not. findings%seen(i)%located) then
               findings%duplicate(i) = turns_by_rounding(problem, step, run, trial, findings%seen(i))
               cycle
            end if
            call settle_event(i)
            if (request%shorter .or. request%repeats_increment()) return
         end do
      end subroutine settle_events

      !> Decides about one located event: it is rejected as spurious, accepted with error bars, or located again on a shorter
      !> increment or another mesh.
      subroutine settle_event(i)
         integer, intent(in) :: i               ! index into findings%seen
         associate (located_event => findings%seen(i))
            findings%duplicate(i) = turns_by_rounding(problem, step, run, trial, located_event)
            if (findings%duplicate(i)) return
            ! The closure of a branch already has the error bars of its point on the parent path.
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
      subroutine settle_trial()
         logical :: behind_end, critical, can_remesh
         if (allocated(arrival%bars)) findings%bars = arrival%bars
         ! A trial behind the end of the step is not a point of the step.
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

      !> Records the located events in their order, up to the event that ends the step.
      subroutine record_events()
         integer, allocatable :: order(:)
         integer :: i, k
         order = ascending(findings%seen%fraction)
         do i = 1, size(order)
            k = order(i)
            if (findings%duplicate(k) .or. findings%beside(k) > 0 .or. .not. findings%seen(k)%located) cycle
            call record_event(problem, step, run, trial, findings%seen(k), count_before(run, findings%seen, findings%duplicate, &
               & findings%seen(k)%fraction), recorder, finished, outcome)
            if (.not. allocated(outcome%why)) call announce_beside(k)
            if (finished .or. allocated(outcome%why)) return
         end do
      end subroutine record_events

      !> Reports a limit point at the corner of a contact change. (The point recorded last is the contact change.)
      subroutine announce_beside(change)
         integer, intent(in) :: change              ! index of the contact change in findings%seen
         integer :: i
         associate (seen => findings%seen)
            i = findloc(findings%beside, change, 1)
            if (i == 0) return
            call announce(problem, run, new_critical(seen(i)%event%label, seen(i)%event%note, seen(change)%bars), &
               & seen(change)%point, .true., recorder, outcome)
         end associate
      end subroutine announce_beside

      !> Records the trial as a point.
      subroutine record_trial()
         integer :: pivots
         ! At a contact change the tangent may be singular, for example if a point contact has zero relative curvature and the free
         ! span beside it is in neutral equilibrium. The number of negative pivots just before the change is used.
         pivots = trial%system%negative_pivots
         if (arrival%changes) pivots = count_before(run, findings%seen, findings%duplicate, 1.0_wp)
         call record(problem, run, trial, merge('EP', arrival%label, findings%stops), arrival%report, recorder, outcome, &
            & arrival%changing, findings%bars, smooth=.true., pivots=pivots)
      end subroutine record_trial

      !> Reports events that were not located. They are reported at the trial, the next point of the path.
      subroutine announce_missed()
         integer :: i
         do i = 1, size(findings%seen)
            if (findings%duplicate(i) .or. findings%seen(i)%located) cycle
            associate (event => findings%seen(i)%event)
               call announce(problem, run, new_critical(event%label, event%note), trial, .false., recorder, outcome)
               call note_bracketed(outcome, event%note, run%last%state%load_factor, trial%state%load_factor)
               finished = finished .or. event%kind == event_stop
               ! The point is stored for the closure check; no branch can start from it.
               call keep_critical_point(problem, run, event%label, trial%state, trial%state, 1.0_wp, &
                  & run%arc_length + path_length(problem, run%last%state, trial%state), trial%test_values%negative_pivots, 0)
            end associate
         end do
      end subroutine announce_missed

      !> Reports the contact change at the trial; the caller gives its label and multiplicity.
      subroutine announce_contact()
         type(error_bars_t), allocatable :: bars    ! not allocated if the contact change is only bracketed
         character(:), allocatable :: note
         real(wp) :: from
         integer :: i
         note = contact_words(arrival%label, arrival%divides)
         if (allocated(findings%bars) .and. .not. arrival%bracketed) bars = findings%bars
         do i = 1, arrival%times
            call announce(problem, run, new_critical(arrival%label, note, bars), trial, .not. arrival%bracketed, recorder, outcome)
         end do
         from = run%last%state%load_factor
         if (allocated(arrival%since)) from = arrival%since
         if (arrival%bracketed) call note_bracketed(outcome, note, from, trial%state%load_factor)
         call keep_change()
      end subroutine announce_contact

      !> Stores the contact change for the checks whether the path comes back to it; no branch starts from it.
      subroutine keep_change()
         call keep_critical_point(problem, run, arrival%label, trial%state, trial%state, 1.0_wp, run%arc_length + &
            & path_length(problem, run%last%state, trial%state), trial%test_values%negative_pivots, 0)
      end subroutine keep_change

      !> Makes the trial the last point of the run. Bifurcations behind the trial do not count in its number of negative pivots.
      subroutine arrive()
         real(wp) :: rise
         integer :: i
         rise = trial%state%load_factor - run%last%state%load_factor
         run%on_bifurcation = any(findings%seen%event%kind == event_bifurcation .and. findings%seen%located .and. &
            & findings%seen%fraction >= 1.0_wp - same_place)
         run%step_points = run%step_points + 1
         run%last_load = rise
         call go_to(problem, run, trial)
         associate (seen => findings%seen, pivots => run%last%test_values%negative_pivots)
            do i = 1, size(seen)
               if (seen(i)%later) pivots = pivots - nint(sign(1.0_wp, seen(i)%event%before))
            end do
         end associate
         ! Changes of contact at nodes without a label depend on the mesh and do not count as corners of the path.
         if (arrival%bracketed .or. .not. (arrival%label /= '' .or. arrival%changes)) return
         run%arrived = arrived_t(point=run%points, load_rate=trial%tangent%load, load_factor=trial%state%load_factor, &
            & monitor=trial%test_values%monitor)
         if (allocated(arrival%bars)) then
            run%arrived%bars = arrival%bars
         else if (allocated(findings%bars)) then
            run%arrived%bars = findings%bars
         end if
      end subroutine arrive
   end subroutine accept
end module path_acceptance
