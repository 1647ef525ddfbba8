!> Acceptance of a converged increment: its events are located and recorded, then the trial, which becomes the last accepted point.
!>
!>   find_events (event_search) -> which of them are real, error bars, does the increment have to be repeated? (settle_findings)
!>   -> events in their order (record_events) -> the trial (record_trial), its labels (announce_contact) -> path state (arrive)
module path_acceptance
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use path_point, only: path_point_t, evaluate_tests
   use trial_request, only: request_t
   use path_state, only: path_state_t, arrived_t, new_critical_point
   use contact_labels, only: contact_words
   use path_events, only: event_stop, event_bifurcation
   use known_path, only: check_closure
   use event_search, only: findings_t, find_events, count_before, same_place
   use settle_findings, only: arrival_t, settle
   use ordering, only: ascending
   use event_recording, only: record_event, announce, new_critical, go_to
   use path_outcome, only: outcome_t, cut_short, note_bracketed
   use point_recording, only: record
   use error_bar, only: error_bars_t
   use corner_limit, only: report_turned_load
   use path_record, only: recorder_t
   implicit none
   private
   public :: accept

contains

   !> Locates, orders and records the events of a converged increment and then the trial, which becomes the last accepted point. If
   !> the increment must be repeated, or the run was cut short, no point is recorded.
   subroutine accept(problem, step, run, trial, arrival, recorder, request, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(inout) :: trial !! its test values are set
      type(arrival_t), intent(in) :: arrival
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request !! out: requirements of the trial; if one of them is another trial, no point was
      !! recorded
      logical, intent(out) :: finished           !! true: the step is complete
      type(outcome_t), intent(inout) :: outcome
      type(findings_t) :: findings
      finished = .false.
      call request%begin_trial()
      call evaluate_tests(problem, trial)
      call find_events(problem, step, run, trial, findings)
      call settle(problem, step, run, trial, arrival, findings, outcome, request)
      if (cut_short(outcome)) return
      if (request%shorter .or. request%repeats_increment()) return
      call report_turned_load(problem, step, run, recorder, outcome)
      if (allocated(outcome%why)) return
      call record_events(problem, step, run, trial, findings, recorder, finished, outcome)
      if (finished .or. allocated(outcome%why)) return
      finished = findings%stops
      if (arrival%label /= '') call check_closure(problem, run, trial%state, arrival%label, outcome)
      if (allocated(outcome%why)) return
      call record_trial(problem, run, trial, arrival, findings, recorder, outcome)
      if (allocated(outcome%why)) return
      call announce_missed(problem, run, trial, findings, recorder, finished, outcome)
      if (arrival%label /= '') call announce_contact(problem, run, trial, arrival, findings, recorder, outcome)
      ! The contact change is kept only to detect whether the path comes back to it; no branch starts from a contact change.
      if (arrival%label /= '' .or. arrival%changes) call run%critical_points%keep(new_critical_point(problem, run, arrival%label, &
         & trial%state, trial%test_values%negative_pivots))
      if (finished) call announce(problem, run, new_critical('EP', 'end of the step', findings%bars), trial, .true., &
         & recorder, outcome)
      if (allocated(outcome%why)) return
      call arrive(problem, run, trial, arrival, findings)
   end subroutine accept

   !> Records the located events in their order, up to the event that ends the step.
   subroutine record_events(problem, step, run, trial, findings, recorder, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      logical, intent(inout) :: finished
      type(outcome_t), intent(inout) :: outcome
      integer, allocatable :: order(:)
      integer :: i, k
      order = ascending(findings%seen%fraction)
      do i = 1, size(order)
         k = order(i)
         if (findings%duplicate(k) .or. findings%beside(k) > 0 .or. .not. findings%seen(k)%located) cycle
         call record_event(problem, step, run, trial, findings%seen(k), count_before(run, findings%seen, findings%duplicate, &
            & findings%seen(k)%fraction), recorder, finished, outcome)
         if (.not. allocated(outcome%why)) call announce_beside(problem, run, findings, k, recorder, outcome)
         if (finished .or. allocated(outcome%why)) return
      end do
   end subroutine record_events

   !> Reports the limit point at which the load turns at a contact change, a corner of the path. (The contact change is the point
   !> recorded last.)
   subroutine announce_beside(problem, run, findings, change, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
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
   subroutine record_trial(problem, run, trial, arrival, findings, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      integer :: pivots
      ! At a contact change the tangent may be singular, for example if a point contact has zero relative curvature and the free
      ! span beside it is in neutral equilibrium. The number of negative pivots just before the change is used.
      pivots = trial%system%negative_pivots
      if (arrival%changes) pivots = count_before(run, findings%seen, findings%duplicate, 1.0_wp)
      call record(problem, run, trial, merge('EP', arrival%label, findings%stops), arrival%report, recorder, outcome, &
         & arrival%changing, findings%bars, smooth=.true., pivots=pivots)
   end subroutine record_trial

   !> Reports events that were not located. They are reported at the trial, the next point of the path.
   subroutine announce_missed(problem, run, trial, findings, recorder, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      logical, intent(inout) :: finished
      type(outcome_t), intent(inout) :: outcome
      integer :: i
      do i = 1, size(findings%seen)
         if (findings%duplicate(i) .or. findings%seen(i)%located) cycle
         associate (event => findings%seen(i)%event)
            call announce(problem, run, new_critical(event%label, event%note), trial, .false., recorder, outcome)
            call note_bracketed(outcome, event%note, run%last%state%load_factor, trial%state%load_factor)
            finished = finished .or. event%kind == event_stop
            ! The point is kept only to detect whether the path comes back to it; no branch can start from a point that was not
            ! located.
            call run%critical_points%keep(new_critical_point(problem, run, event%label, trial%state, &
               & trial%test_values%negative_pivots))
         end associate
      end do
   end subroutine announce_missed

   !> Reports the contact change at the trial; the caller gives the label and the count of contacts that change.
   subroutine announce_contact(problem, run, trial, arrival, findings, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(in) :: findings
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
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
   end subroutine announce_contact

   !> Makes the trial the last point of the run. The trial's count of negative pivots is corrected for bifurcations that lie only
   !> after the trial.
   subroutine arrive(problem, run, trial, arrival, findings)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(arrival_t), intent(in) :: arrival
      type(findings_t), intent(in) :: findings
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
end module path_acceptance
