!> Follows a path point by point. The method is the loop of follow_points:
!>
!>   prepare       controlled quantity, increment and path tangent (set_control)
!>   solve         Newton's method with the constraint of the control (increment_trials, corrector); its first step, from the
!>                 equations factored at the last point, is the predictor
!>   compare       is the trial on the path ahead? (increment_trials), else a remedy (step_recovery)
!>   on the way    changes of the contact set (span_changes); limit points, bifurcations, contact, values (path_acceptance)
!>   record        events and the trial (path_acceptance), unless the increment must be repeated (trial_request, increment_trials)
!>   mesh, step    mesh density from the errors of the point; next increment (go_to_next_increment)
module path_follower
   use kinds, only: wp
   use model, only: step_t, method_generalised, method_displacement
   use problem, only: problem_t, rounding_gap
   use path_control, only: is_arc_length, set_tangent
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use step_control, only: begin_arc_length, go_by_load, may_rest, next_increment, shorten_to_stop
   use increment_trials, only: try_increment, retry_refined, try_another_set, attempt_t, start_from, leads_on, &
      & note_change, ended
   use checkpoint, only: save_run
   use step_recovery, only: try_recovery
   use settle_findings, only: arrival_t
   use path_acceptance, only: accept
   use corner_limit, only: report_turned_load
   use path_outcome, only: outcome_t, must_end, cut_short
   use span_changes, only: check_contact_change
   use minima_of_tests, only: note_slopes
   use missing_equilibrium, only: why_no_equilibrium
   use span_mesh, only: renew_mesh, coarsen_mesh
   use path_record, only: recorder_t
   use timing, only: count_up, counter_cut
   implicit none
   private
   public :: follow_points

   integer, parameter :: max_searches = 4 !! largest number of halvings of an increment that separate events; with values from 2 to
   !! 8 every deck in input has the same results

contains

   !> Follows the path from the last accepted point to the stop condition or to the row where it must pause; the control must be
   !> set. Passes checkpoints to the recorder between the attempts and, unless the run is cut short, at the end.
   subroutine follow_points(problem, step, run, recorder, outcome, attempt, pause)
      type(problem_t), intent(inout) :: problem  !! its mesh changes with contact spans
      type(step_t), intent(in) :: step           !! step of the deck, or its copy for a branch
      type(path_state_t), intent(inout) :: run
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(attempt_t), intent(inout) :: attempt  !! attempts already made from the last accepted point
      integer, intent(in) :: pause !! row of the results at which the procedure returns, because the caller changes the steps there;
      !! 0: none
      do
         if (cut_short(outcome)) return
         if (pause > 0 .and. run%points >= pause) return
         if (ended(attempt, outcome)) exit
         if (must_end(outcome)) exit
         call save_run(problem, run, attempt, recorder, outcome, .false.)
         if (ended(attempt, outcome) .or. points_used_up() .or. rests_for_ever()) exit
         if (run%mesh%change_behind) call make_change_behind()
         if (ended(attempt, outcome)) exit
         call set_control(problem, step, run)
         call start_from(run, attempt)
         ! Where a contact or free span has just begun, its tests change with powers of its length, so that slopes do not describe
         ! them.
         if (.not. abs(attempt%planned) > 0.0_wp) call note_slopes(problem, run)
         call try_increment(problem, step, run, attempt)
         if (leads_on(attempt)) then
            call take_trial()
            if (.not. ended(attempt, outcome)) call serve_request()
         else
            call try_recovery(problem, step, run, attempt, recorder, outcome)
         end if
      end do
      outcome%dead_end = allocated(outcome%why) .and. outcome%deck_line == 0 .and. .not. (outcome%turns .or. outcome%home .or. &
         & outcome%wrong .or. outcome%used_up .or. outcome%ended)
      if (outcome%dead_end .or. outcome%wrong) call explain_end()
      if (.not. outcome%ended) call report_turned_load(problem, step, run, recorder, outcome)
      call save_run(problem, run, attempt, recorder, outcome, .true.)

   contains

      !> True if the step has as many points as the deck allows; the step has failed then if it has a stop condition, which was not
      !> met.
      logical function points_used_up() result(used_up)
         used_up = run%step_points >= step%max_points
         if (.not. used_up) return
         outcome%used_up = size(step%stop) > 0
         if (outcome%used_up) outcome%why = 'the allowed number of points was used up before the stop condition'
      end function points_used_up

      !> True if nothing moves any more although the load has run so far that the loads at which something moved are its rounding:
      !> for instance where a structure has snapped through and the obstacle that pushed it goes back. The step has failed then.
      logical function rests_for_ever() result(rests)
         real(wp) :: known                       ! largest load factor at which something moved, or that the deck names
         rests = run%points > 1 .and. run%last_length * problem%size <= rounding_gap(problem)
         if (.not. rests) return
         known = max(abs(step%increment), maxval(abs(step%stop%value), mask=step%stop%monitor == 0), &
            & maxval(abs(step%locate%value), mask=step%locate%monitor == 0), &
            & maxval(abs(run%critical_points%list%state%load_factor)))
         rests = sqrt(epsilon(known)) * abs(run%last%state%load_factor) > known
         outcome%used_up = rests
         if (rests) outcome%why = 'nothing moves any more, however far the load goes'
      end function rests_for_ever

      !> Searches for a reason why no equilibrium exists ahead, and puts it in front of the message with which the run ends. The
      !> search goes as far as the step's first increment.
      subroutine explain_end()
         character(:), allocatable :: cause
         associate (last => run%last)
            cause = why_no_equilibrium(problem, last%state, last%system%force_scale, last%state%load_factor + merge(0.0_wp, &
               & sign(step%increment, last%tangent%load), step%method == method_displacement))
         end associate
         if (cause == '') return
         outcome%dead_end = .false.
         outcome%why = cause//': '//outcome%why
      end subroutine explain_end

      !> Makes a contact change at the last accepted point, if remeshing has moved the change to a position before this point.
      subroutine make_change_behind()
         type(path_point_t) :: here
         run%mesh%change_behind = .false.
         here = run%last
         call check_contact_change(problem, step, run, here, .false., huge(1), recorder, attempt%request, attempt%finished, outcome)
         call note_change(problem, run, attempt)
         if (attempt%request%shorter) run%control%increment = 0.5_wp * run%control%increment
         if (attempt%changed) attempt%has_trial = allocated(attempt%request%ahead)
      end subroutine make_change_behind

      !> Makes the contact change between the last accepted point and the trial, if there is one; otherwise accepts the trial as a
      !> point of the path. If the increment must first be repeated, attempt%request contains the requirements.
      subroutine take_trial()
         type(arrival_t) :: arrival
         if (attempt%cuts == 0) attempt%failures = 0
         attempt%cuts = 0
         associate (request => attempt%request)
            if (problem%has_spans() .and. .not. attempt%begins) then
               call check_contact_change(problem, step, run, attempt%trial, .false., attempt%meshes, recorder, request, &
                  & attempt%finished, outcome)
               call note_change(problem, run, attempt)
               if (ended(attempt, outcome) .or. request%set_changed .or. request%shorter .or. request%repeats_increment()) return
            end if
            arrival%report = attempt%report
            arrival%can_cut = attempt%searches < max_searches
            arrival%tries = attempt%meshes
            call accept(problem, step, run, attempt%trial, arrival, recorder, request, attempt%finished, outcome)
            if (.not. request%repeats_increment()) attempt%searches = merge(attempt%searches + 1, 0, request%shorter)
            if (request%shorter) call count_up(counter_cut)
         end associate
      end subroutine take_trial

      !> Prepares the next trial: the same increment, modified as attempt%request requires, or else the next increment.
      subroutine serve_request()
         character(:), allocatable :: no_set
         associate (request => attempt%request)
            if (allocated(request%no_set)) then
               no_set = request%no_set
               if (request%shorter) run%control%increment = 0.5_wp * run%control%increment
               call try_another_set(problem, step, run, attempt, recorder, outcome)
               if (.not. (attempt%changed .or. ended(attempt, outcome))) outcome%why = no_set
            else if (request%set_changed) then
               return
            else if (request%repeats_increment()) then
               call retry_refined(problem, run, attempt, .true.)
            else if (request%shorter) then
               run%control%increment = 0.5_wp * run%control%increment
            else
               call go_to_next_increment(problem, step, attempt, run, outcome)
            end if
         end associate
      end subroutine serve_request
   end subroutine follow_points

   !> Sets the controlled quantity of the next increment and limits the increment.
   subroutine set_control(problem, step, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      call go_by_load(step, run)
      if (is_arc_length(run%control%method)) &
         & call set_tangent(problem, run%last%system, run%last%tangent%u, run%last%tangent%load, run%control)
      call shorten_to_stop(step, run)
   end subroutine set_control

   !> Remeshes at the accepted point and chooses the next increment. The mesh becomes finer where a higher density is required than
   !> before, and coarser where it is finer than required. An arc-length strategy makes load increments until displacements give the
   !> arc length a scale, and while no node moves.
   subroutine go_to_next_increment(problem, step, attempt, run, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(inout) :: attempt  !! the attempt that led to the accepted point
      type(path_state_t), intent(inout) :: run
      type(outcome_t), intent(inout) :: outcome
      logical :: scaled
      run%slopes%closer = 0
      if (allocated(run%slopes%ahead)) call move_alloc(run%slopes%ahead, run%slopes%here)
      if (allocated(run%mesh%before_coarsening)) deallocate (run%mesh%before_coarsening)
      call renew_mesh(problem, run)
      if (allocated(run%mesh%coarser)) call coarsen_mesh(problem, run)
      if (is_arc_length(step%method) .and. .not. is_arc_length(run%control%method)) then
         call begin_arc_length(problem, step, run, scaled)
         if (scaled) return
         if (.not. run%control%load_scale > 0.0_wp) then
            ! No node has moved: an obstacle approaches the structure, or has just come into contact. The first increment is kept.
            run%control%increment = step%increment
            if (.not. (run%last_length > 0.0_wp .or. may_rest(step))) &
               & outcome%why = 'the first increment moved nothing: the arc length has no scale'
            return
         end if
      end if
      if (step%method == method_generalised .and. allocated(run%control%tangent)) run%control%previous = run%control%tangent
      if (abs(attempt%planned) > 0.0_wp) then
         run%control%increment = attempt%planned
         attempt%planned = 0.0_wp
      else
         call next_increment(step, attempt%report, attempt%relation, problem%moves_nodes(), run%control)
      end if
   end subroutine go_to_next_increment
end module path_follower
