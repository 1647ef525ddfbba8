!> Follows a path point by point: predict, correct, adapt the increment, recover from failures.
!>
!>   increment (increment_trials) -> on the path? -> no: recovery (step_recovery)
!>                                                -> yes: contact changes (span_changes) -> accepted (path_acceptance)
!>   -> repeat (increment_retries), or the next increment
module path_follower
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_continuity, only: path_tangent_t
   use path_control, only: is_arc_length, set_tangent
   use path_state, only: path_state_t
   use step_control, only: begin_arc_length, go_by_load, may_rest, next_increment, shorten_to_stop
   use attempt, only: attempt_t, start_from, leads_on, ended
   use increment_trials, only: try_increment
   use checkpoint, only: keep_standing
   use step_recovery, only: try_recovery
   use increment_retries, only: retry_refined, retry_by_nodes, retry_closer
   use path_acceptance, only: arrival_t, accept
   use corner_limit, only: report_turned_load
   use remeshing, only: wants_another
   use path_outcome, only: outcome_t, must_end
   use span_changes, only: pass_change, set_changed, go_nearer, other_mesh
   use minima_of_tests, only: note_slopes
   use span_mesh, only: renew_mesh, coarsen_mesh
   use path_record, only: recorder_t
   implicit none
   private
   public :: follow_points

   integer, parameter :: max_searches = 4       !! halvings of an increment to separate events

contains

   !> Follows the path from the last accepted point, with the control set, to the stop condition. Checkpoints are passed to the
   !> recorder on the way and at the end.
   subroutine follow_points(problem, step, run, recorder, outcome, before)
      type(problem_t), intent(inout) :: problem  !! its mesh changes with contact spans
      type(step_t), intent(in) :: step           !! step of the deck, or its copy for a branch
      type(path_state_t), intent(inout) :: run
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(attempt_t), intent(in), optional :: before !! restart: attempts already made from the last accepted point
      type(attempt_t) :: attempt
      if (present(before)) attempt = before
      if (.not. attempt%finished) call go_on(problem, step, run, attempt, recorder, outcome)
      outcome%dead_end = allocated(outcome%why) .and. outcome%deck_line == 0 .and. .not. (outcome%turns .or. outcome%home .or. &
         & outcome%wrong .or. outcome%used_up .or. outcome%ended)
      if (.not. outcome%ended) call report_turned_load(problem, step, run, recorder, outcome)
      call keep_standing(problem, run, attempt, recorder, outcome, .true.)
   end subroutine follow_points

   !> Loop over the increments of a path.
   subroutine go_on(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      integer :: result
      logical :: shorter
      do
         if (must_end(outcome)) return
         call keep_standing(problem, run, attempt, recorder, outcome, .false.)
         if (allocated(outcome%why)) return
         if (run%step_points >= step%max_points) then
            outcome%used_up = size(step%stop) > 0
            if (outcome%used_up) outcome%why = 'the allowed number of points was used up before the stop condition'
            return
         end if
         if (run%behind_flat) then
            call catch_up(problem, step, run, attempt, recorder, outcome)
            if (ended(attempt, outcome)) return
         end if
         call start_from(run, attempt)
         call set_control(problem, step, run)
         call try_increment(problem, step, run, attempt)
         if (.not. leads_on(attempt)) then
            call try_recovery(problem, step, run, attempt, recorder, outcome)
            if (ended(attempt, outcome)) return
            cycle
         end if
         if (attempt%cuts == 0) attempt%failures = 0
         attempt%cuts = 0
         if (problem%has_spans() .and. .not. attempt%begins) then
            call pass_change(problem, step, run, attempt%trial, attempt%ahead, .false., attempt%meshes, recorder, result, &
               & attempt%finished, outcome)
            if (ended(attempt, outcome)) return
            attempt%changed = result == set_changed
            if (result == other_mesh) call retry_refined(problem, run, attempt, .true.)
            if (any(result == [set_changed, go_nearer, other_mesh])) cycle
         end if
         if (allocated(run%stuck)) then
            call retry_by_nodes(problem, step, run, attempt, recorder, outcome)
            if (.not. (attempt%changed .or. ended(attempt, outcome))) outcome%why = run%stuck
            if (ended(attempt, outcome)) return
            cycle
         end if
         call accept_trial(problem, step, run, attempt, recorder, shorter, outcome)
         if (ended(attempt, outcome)) return
         if (shorter) then
            call retry_closer(problem, run, attempt)
         else if (wants_another(run)) then
            call retry_refined(problem, run, attempt, .true.)
         else
            attempt%searches = 0
            call look_at_mesh(problem, run)
            call choose_increment(problem, step, attempt, run, outcome)
            if (ended(attempt, outcome)) return
         end if
      end do
   end subroutine go_on

   !> Makes a contact change that, on a new mesh, lies before the last accepted point: at that point.
   subroutine catch_up(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(state_t) :: here
      type(path_tangent_t) :: ahead
      integer :: result
      run%behind_flat = .false.
      here = run%state
      ahead = run%heading
      call pass_change(problem, step, run, here, ahead, .false., huge(1), recorder, result, attempt%finished, outcome)
      attempt%changed = result == set_changed
      if (attempt%changed) attempt%has_trial = .false.
   end subroutine catch_up

   !> Accepts the trial as a point of the path, unless its events or errors require another trial.
   subroutine accept_trial(problem, step, run, attempt, recorder, shorter, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: shorter            !! nothing was recorded: the increment is to be halved
      type(outcome_t), intent(inout) :: outcome
      type(arrival_t) :: arrival
      arrival%report = attempt%report
      arrival%can_cut = attempt%searches < max_searches
      arrival%tries = attempt%meshes
      call accept(problem, step, run, attempt%trial, attempt%ahead, arrival, recorder, shorter, attempt%finished, outcome)
   end subroutine accept_trial

   !> Sets the controlled quantity and limits the increment.
   subroutine set_control(problem, step, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      call go_by_load(step, run)
      if (is_arc_length(run%control%method)) &
         & call set_tangent(problem, run%system, run%heading%u, run%heading%load, run%control)
      call shorten_to_stop(step, run)
      call note_slopes(problem, run)
   end subroutine set_control

   !> Remeshes at an accepted point: finer where the required mesh density has grown, coarser where the mesh is better than
   !> necessary.
   subroutine look_at_mesh(problem, run)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      run%slopes%closer = 0
      if (allocated(run%slopes%ahead)) call move_alloc(run%slopes%ahead, run%slopes%here)
      if (allocated(run%before_coarsening)) deallocate (run%before_coarsening)
      call renew_mesh(problem, run)
      if (allocated(run%spare)) call coarsen_mesh(problem, run)
   end subroutine look_at_mesh

   !> Chooses the increment from an accepted point. Under an arc-length strategy load increments are made until the arc length has a
   !> scale, and while nothing moves.
   subroutine choose_increment(problem, step, attempt, run, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(in) :: attempt     !! the attempt that led to the point
      type(path_state_t), intent(inout) :: run
      type(outcome_t), intent(inout) :: outcome
      logical :: scaled
      if (is_arc_length(step%method) .and. .not. is_arc_length(run%control%method)) then
         call begin_arc_length(problem, step, run, scaled)
         if (scaled) return
         if (.not. run%control%load_scale > 0.0_wp) then
            ! The structure has not moved: an obstacle at a distance, or in first contact, approaches in increments like the first.
            run%control%increment = step%increment
            if (.not. (run%last_length > 0.0_wp .or. may_rest(step))) &
               & outcome%why = 'the first increment moved nothing: the arc length has no scale'
            return
         end if
      end if
      if (allocated(run%control%tangent)) run%control%previous = run%control%tangent
      call next_increment(step, attempt%report, attempt%relation, problem%moves_nodes(), run%control)
   end subroutine choose_increment
end module path_follower
