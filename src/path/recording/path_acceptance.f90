!> What happens when an increment has converged: events up to the new point are located and recorded, then the point, and
!> the run goes there.
!>
!>   find_events (event_search) -> told by others? (event_order) -> does a shorter increment tell better? (spurious_events)
!>   -> what each event is, its errors, the mesh that they ask for (settle_events) -> those of the trial (settle_trial)
!>   -> events in their order (record_events) -> the trial (record_trial), its words (announce_trial) -> there (arrive)
module path_acceptance
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: path_length
   use path_continuity, only: path_tangent_t
   use corrector, only: increment_t
   use path_state, only: path_state_t, keep_critical_point
   use step_control, only: stop_met
   use path_events, only: event_stop, event_bifurcation
   use branch_closure, only: check_closure
   use event_search, only: findings_t, find_events
   use spurious_events, only: better_from_nearer, hides_release, turns_by_rounding, doubt_limit, doubt_bifurcation
   use event_order, only: duplicates_of, count_before, by_fraction, same_place
   use event_recording, only: record_event, announce, new_critical, go_to
   use path_outcome, only: outcome_t, note_bracketed
   use point_recording, only: record
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_event, bars_at_point, note_error, asked_at
   use remeshing, only: wants_another, ask_at_event, ask_for_mesh, ask_for_less, sizes_there
   use path_record, only: recorder_t
   use run_accuracy, only: place_t
   implicit none
   private
   public :: arrival_t, accept

   integer, parameter :: mesh_has_to_do = -1    !! tries: no other one is asked for

   !> What whoever has found a trial tells of it.
   type :: arrival_t
      type(increment_t) :: report
      logical :: can_cut = .false.             !! a shorter increment can be tried instead
      integer :: tries = mesh_has_to_do        !! meshes that the same increment has had for its errors' sake. Where this one does
      !! not do, either, run%wanted is allocated, and nothing recorded
      character(2) :: label = ''               !! C+ or C- when the trial is known to be one
      integer :: times = 1                     !! how often that happens there
      logical :: bracketed = .false.           !! it happens somewhere on the way there
      logical :: divides = .false.             !! at a C-: of the contact a part stays on both sides
      logical :: changes = .false.             !! the contact set is about to change there, with a label or without
      logical, allocatable :: changing(:)      !! (candidates) whose contact at a node begins or ends there; not allocated: none is
      !! known of
      type(error_bars_t), allocatable :: bars  !! at a change of contact spans, where they are known
   end type arrival_t

contains

   !> Detects what happened up to a converged trial point, locates it, puts it in order, records it and the point, and goes
   !> there. `shorter` instead, and nothing recorded, when an event was not located and the caller can cut the increment.
   subroutine accept(problem, step, run, trial, ahead, arrival, recorder, shorter, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the trial on entry and on return, else anywhere
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! tangent at the trial
      type(arrival_t), intent(in) :: arrival
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: shorter
      logical, intent(out) :: finished           !! the step has come to its end
      type(outcome_t), intent(inout) :: outcome
      type(findings_t) :: findings
      finished = .false.
      if (allocated(run%wanted)) deallocate (run%wanted)
      run%unsettled = .false.
      call find_events(problem, step, run, trial, ahead, findings)
      findings%told = duplicates_of(run, trial, arrival%label /= '' .or. arrival%changes, findings%seen)
      shorter = arrival%can_cut .and. better_from_nearer(problem, run, trial, findings)
      if (shorter) return
      call begin_asking(problem, step, run, arrival, findings)
      call settle_events(problem, step, run, trial, arrival, findings, shorter, outcome)
      if (shorter .or. wants_another(run)) return
      call settle_trial(problem, step, run, trial, ahead, arrival, findings, outcome)
      if (wants_another(run)) return
      call record_events(problem, step, run, trial, findings, recorder, finished, outcome)
      if (finished .or. allocated(outcome%why)) return
      finished = findings%stops
      if (arrival%label /= '') call check_closure(problem, run, trial, arrival%label, outcome)
      if (allocated(outcome%why)) return
      call record_trial(problem, run, trial, ahead, arrival, findings, recorder, outcome)
      if (allocated(outcome%why)) return
      call announce_missed(problem, run, trial, findings, recorder, finished, outcome)
      if (arrival%label /= '') call announce_contact(problem, run, trial, arrival, findings, recorder, outcome)
      if (finished) call announce(problem, run, new_critical('EP', 'end of the step', findings%bars), trial, findings%probe, &
         & .true., recorder, outcome)
      if (allocated(outcome%why)) return
      call arrive(problem, run, trial, ahead, findings)
   end subroutine accept

   !> What the questions for errors and meshes hang on.
   subroutine begin_asking(problem, step, run, arrival, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      run%has_events = any(findings%seen%located .and. .not. findings%told)
      findings%stops = stop_met(step, run%probe, findings%probe)
      ! A given mesh stays as it is; of another one a second will not have the nodes that the first has not. (A point between has
      ! them at once: the next increment's mesh begins there.)
      findings%as_it_is = .not. any(problem%layout%stretch%placed) .or. arrival%tries > 0
   end subroutine begin_asking

   !> What each located event is, with its error bars. Up to the first one for which the increment is to be another one.
   subroutine settle_events(problem, step, run, trial, arrival, findings, shorter, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run !! its system is factored anywhere on entry, at the trial on return where all are
      !! settled
      type(state_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      logical, intent(out) :: shorter
      type(outcome_t), intent(in) :: outcome
      integer :: i
      shorter = .false.
      do i = 1, size(findings%seen)
         if (findings%told(i) .or. .not. findings%seen(i)%located) cycle
         call settle_event(problem, step, run, trial, arrival, i, findings, shorter, outcome)
         if (shorter .or. wants_another(run)) return
      end do
      if (allocated(findings%at_trial)) run%system = findings%at_trial
   end subroutine settle_events

   !> What one located event is: nothing to tell, or with error bars, or not to be told from this increment or mesh.
   subroutine settle_event(problem, step, run, trial, arrival, i, findings, shorter, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored anywhere on entry, at the event on return
      type(state_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      integer, intent(in) :: i                   !! which of those seen
      type(findings_t), intent(inout) :: findings
      logical, intent(out) :: shorter
      type(outcome_t), intent(in) :: outcome
      shorter = .false.
      associate (sighting => findings%seen(i))
         call linearise(problem, sighting%place, sighting%place, run%system)
         findings%told(i) = turns_by_rounding(problem, step, run, findings%probe, sighting)
         if (findings%told(i)) return
         ! At home they are those of the path that was left, on its mesh.
         if (allocated(sighting%bars)) return
         shorter = arrival%can_cut .and. sighting%event%kind == event_stop .and. hides_release(problem, run, findings, i)
         if (shorter) return
         call bars_at_event(problem, step, run, trial, sighting%event, sighting%place, sighting%heading, sighting%bars, &
            & findings%as_it_is)
         ! Bars may know of more rounding.
         findings%told(i) = turns_by_rounding(problem, step, run, findings%probe, sighting)
         if (findings%told(i)) return
         call doubt_limit(problem, run, trial, sighting)
         if (arrival%tries /= mesh_has_to_do) call ask_at_event(problem, step, run, sighting, arrival%tries, outcome)
         if (wants_another(run)) return
         call doubt_bifurcation(sighting)
         shorter = arrival%can_cut .and. .not. sighting%located
      end associate
   end subroutine settle_event

   !> Error bars of the trial: as far as they are to be shown, or ask for another mesh.
   subroutine settle_trial(problem, step, run, trial, ahead, arrival, findings, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the trial
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(inout) :: findings
      type(outcome_t), intent(inout) :: outcome
      logical :: behind_end, critical, can_ask
      if (allocated(arrival%bars)) findings%bars = arrival%bars
      ! A trial behind the end of the step is no point of it.
      behind_end = any(findings%seen%located .and. findings%seen%event%kind == event_stop .and. .not. findings%told)
      critical = arrival%label /= '' .or. findings%stops
      can_ask = arrival%tries /= mesh_has_to_do
      if (.not. (allocated(findings%bars) .or. behind_end)) &
         & call bars_at_point(problem, step, run, trial, ahead, merge('  ', arrival%label, arrival%bracketed), findings%stops, 0, &
         & findings%bars, wanted=step%asked_of_path > 0.0_wp .and. any(problem%layout%stretch%placed), &
         & changing=arrival%changing, as_it_is=findings%as_it_is .and. critical)
      if (behind_end .or. .not. allocated(findings%bars)) return
      if (can_ask) call ask_for_mesh(problem, step, run, trial, findings%bars, critical, arrival%tries, outcome)
      if (wants_another(run)) return
      if (.not. critical) call note_error(problem, step, findings%bars, sizes_there(problem, step, run, trial, &
         & asked_at(problem, step, ''), outcome), '', place_t(run%branch, problem%step, run%points + 1, trial%load_factor), &
         & outcome%accuracy)
      if (can_ask .and. .not. (critical .or. any(findings%seen%located))) &
         & call ask_for_less(problem, step, run, trial, findings%bars, arrival%tries, outcome)
      if (.not. (critical .or. step%bars_everywhere)) deallocate (findings%bars)
   end subroutine settle_trial

   !> Records the located events in the order in which they come, up to the one that ends the step.
   subroutine record_events(problem, step, run, trial, findings, recorder, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the trial on return, where none ends the step
      type(state_t), intent(in) :: trial
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      integer, allocatable :: order(:)
      integer :: i, k
      finished = .false.
      order = by_fraction(findings%seen%fraction)
      do i = 1, size(order)
         k = order(i)
         if (findings%told(k) .or. .not. findings%seen(k)%located) cycle
         call record_event(problem, step, run, trial, findings%seen(k), count_before(run, findings%seen, findings%told, &
            & findings%seen(k)%fraction), recorder, finished, outcome)
         if (finished .or. allocated(outcome%why)) return
      end do
      if (allocated(findings%at_trial)) run%system = findings%at_trial
   end subroutine record_events

   !> Records the trial as a point.
   subroutine record_trial(problem, run, trial, ahead, arrival, findings, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run          !! its system is factored at the trial
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      ! Where contact changes the tangent may be singular: a point as flat as its wall beside a neutral span.
      if (arrival%changes) run%system%negative_pivots = count_before(run, findings%seen, findings%told, 1.0_wp)
      call record(problem, run, trial, merge('EP', arrival%label, findings%stops), arrival%report, recorder, outcome, &
         & arrival%changing, findings%bars, ahead)
   end subroutine record_trial

   !> Events that were not located are told at the trial, which comes after them.
   subroutine announce_missed(problem, run, trial, findings, recorder, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      logical, intent(inout) :: finished         !! or becomes so, where the end of the step is one of them
      type(outcome_t), intent(inout) :: outcome
      integer :: i
      do i = 1, size(findings%seen)
         if (findings%told(i) .or. findings%seen(i)%located) cycle
         associate (event => findings%seen(i)%event)
            call announce(problem, run, new_critical(event%label, event%note), trial, findings%probe, .false., recorder, outcome)
            call note_bracketed(outcome, event%note, run%state%load_factor, trial%load_factor)
            finished = finished .or. event%kind == event_stop
            ! It counts, though nothing can start there.
            call keep_critical_point(problem, run, event%label, trial, trial, 1.0_wp, &
               & run%arc_length + path_length(problem, run%state, trial), findings%probe%negative_pivots, 0)
         end associate
      end do
   end subroutine announce_missed

   !> What the trial is known to be: contact is gained or lost there.
   subroutine announce_contact(problem, run, trial, arrival, findings, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(error_bars_t), allocatable :: bars    ! of what is bracketed there are none
      character(:), allocatable :: note
      integer :: i
      note = trim(merge('contact gained', 'contact lost  ', arrival%label == 'C+'))
      if (arrival%divides) note = 'a contact region splits'
      if (allocated(findings%bars) .and. .not. arrival%bracketed) bars = findings%bars
      do i = 1, arrival%times
         call announce(problem, run, new_critical(arrival%label, note, bars), trial, findings%probe, .not. arrival%bracketed, &
            & recorder, outcome)
      end do
      if (arrival%bracketed) call note_bracketed(outcome, note, run%state%load_factor, trial%load_factor)
      call keep_critical_point(problem, run, arrival%label, trial, trial, 1.0_wp, run%arc_length + path_length(problem, run%state, &
         & trial), findings%probe%negative_pivots, 0)
   end subroutine announce_contact

   !> The run goes to the trial. Bifurcations that come after it are not among its pivots yet.
   subroutine arrive(problem, run, trial, ahead, findings)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(findings_t), intent(inout) :: findings
      integer :: i
      associate (seen => findings%seen, pivots => findings%probe%negative_pivots)
         do i = 1, size(seen)
            if (seen(i)%later) pivots = pivots - nint(sign(1.0_wp, seen(i)%event%before))
         end do
         run%step_points = run%step_points + 1
         run%last_load = trial%load_factor - run%state%load_factor
         run%on_bifurcation = any(seen%event%kind == event_bifurcation .and. seen%located .and. &
            & seen%fraction >= 1.0_wp - same_place)
      end associate
      call go_to(problem, run, trial, ahead, findings%probe)
   end subroutine arrive
end module path_acceptance
