!> Makes one increment from the last accepted point: predicts and corrects it, and compares the trial with the recent path. The
!> increment may be repeated on another mesh, with a smaller residual, with another contact set, or half as long. An attempt
!> (attempt_t) is the last trial increment from a point, with the counters of all trials from that point.
module increment_trials
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use path_continuity, only: relation_t, relate, same_path, turned_over, too_far, at_corner
   use corner_turning, only: corner_t, find_corner_ahead, is_too_near
   use path_point, only: advance, path_point_t
   use path_state, only: path_state_t, copy_path_state, path_tangent_of
   use known_path, only: retraces_path
   use span_start, only: begin_spans
   use stiffness_homotopy, only: is_stiff_start, take_stiff_start
   use path_outcome, only: outcome_t
   use continuing_with_set, only: find_other_set
   use span_mesh, only: refine_mesh
   use path_record, only: recorder_t
   use path_control, only: increment_between
   use corrector, only: increment_t
   use trial_request, only: request_t
   implicit none
   private
   public :: try_increment, retry_refined, try_another_set, attempt_t, start_from, leads_on, note_change, &
      & ended

   real(wp), parameter :: sharper = 0.01_wp !! residual tolerance of the repetition over that of the failed trial; with 0.001 and
   !! with 0.1 one deck in input has other results

   !> Attempts to make an increment from one point of the path.
   type :: attempt_t
      ! The point from which the attempts are made:
      integer :: point = -1                      !! number of accepted points of the step before this point
      real(wp) :: first_increment = 0.0_wp       !! size of the first increment tried from this point
      logical :: changed = .false.               !! true: a contact change was made at the point while the trial was examined
      ! The last increment:
      type(path_point_t) :: trial                !! end of the increment, in equilibrium if report%converged
      type(increment_t) :: report                !! report of the correction to the trial
      type(request_t) :: request !! requirements of the trial before the path can continue (shorter increment, another mesh, smaller
      !! residual)
      type(relation_t) :: relation               !! comparison of the trial with the point: directions, distances
      type(corner_t) :: corner                   !! corner of the path between the point and the trial, if one is predicted
      logical :: off_path = .false.                !! true: the trial is in equilibrium, but not on the path ahead of the point
      logical :: begins = .false.                !! true: with this increment contact at nodes becomes contact spans
      logical :: has_trial = .false. !! true: the next trial exists already and is in equilibrium: it was transferred from another
      !! mesh, or found together with a new contact set
      logical :: stiff_start = .false. !! true: the path starts on foundations too stiff for the elements, so that the stiffness is
      !! increased in steps (take_stiff_start)
      real(wp) :: planned = 0.0_wp !! increment to return to after this trial, which comes from a change of contact and has an
      !! increment of its own; 0: none
      logical :: finished = .false.              !! true: the step ended at an event within the increment
      ! Counters:
      integer :: cuts = 0                        !! failed increments from the point
      integer :: failures = 0 !! increments that ended on other paths, since the last increment that succeeded at the first attempt
      integer :: searches = 0                    !! halvings of the increment that were made to separate events
      integer :: meshes = 0                      !! number of meshes made because of the increment's errors
      integer :: corner_meshes = 0               !! meshes made because of the errors at a corner of the contact set
      integer :: doubled_at = -1                 !! number of the point at which the mesh density was doubled last; -1: none
      real(wp) :: searched_to = -1.0_wp             !! arc length up to which another contact set has been searched for; -1: none
   end type attempt_t

contains

   !> Makes the increment of the controlled quantity, unless the trial exists already. Sets attempt%off_path if the trial is not on
   !> the path ahead of the last accepted point.
   subroutine try_increment(problem, step, run, attempt)
      type(problem_t), intent(inout) :: problem !! its mesh changes if contact spans begin, or if the path starts on stiff
      !! foundations
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run   !! transferred to the mesh of the trial if the mesh changes
      type(attempt_t), intent(inout) :: attempt
      attempt%begins = .false.
      if (attempt%has_trial) then
         call check_continuity(problem, step, run, attempt)
      else if (problem%is_sampled()) then
         call begin_with_spans(problem, step, run, attempt)
      else
         attempt%stiff_start = is_stiff_start(problem, run) .or. (attempt%stiff_start .and. run%fresh)
         ! A trial on stiff foundations leaves a mesh with interface points where contact ended in this trial. If an increment on
         ! this mesh fails, a shorter increment begins on softer foundations again.
         if (is_stiff_start(problem, run) .or. (attempt%stiff_start .and. .not. leads_on(attempt))) then
            call take_stiff_start(problem, run, attempt%trial, attempt%report, attempt%has_trial)
         else
            call advance(problem, run%last, run%control, attempt%trial, attempt%report)
         end if
         call check_continuity(problem, step, run, attempt)
      end if
      attempt%has_trial = .false.
   end subroutine try_increment

   !> Makes the increment with which contact at nodes becomes contact spans. If the increment leaves the path, problem and run are
   !> restored: a shorter increment may lead to another set of contact spans.
   subroutine begin_with_spans(problem, step, run, attempt)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      type(problem_t) :: sampled
      type(path_state_t) :: unbegun
      call copy_problem(problem, sampled)
      call copy_path_state(run, unbegun)
      call begin_spans(problem, run, attempt%trial, attempt%report)
      attempt%begins = attempt%report%converged
      call check_continuity(problem, step, run, attempt)
      if (.not. attempt%off_path) return
      call copy_problem(sampled, problem)
      call copy_path_state(unbegun, run)
   end subroutine begin_with_spans

   !> Determines the path tangent at the trial, and sets attempt%off_path if the trial lies on another path or the increment went
   !> backwards.
   subroutine check_continuity(problem, step, run, attempt)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(attempt_t), intent(inout) :: attempt
      type(relation_t) :: before
      attempt%off_path = .false.
      if (attempt%cuts == 0) then
         attempt%relation%comparable = .false.
         attempt%corner = corner_t()
      end if
      if (.not. attempt%report%converged) return
      attempt%trial%tangent = path_tangent_of(problem, run, attempt%trial)
      before = attempt%relation
      attempt%relation = relate(problem, run%last%state, attempt%trial%state, run%last%tangent, attempt%trial%tangent, run%fresh)
      attempt%off_path = .not. same_path(attempt%relation)
      ! A corner inside the increment is sought only for contact at nodes. A change of contact spans is located, and the next
      ! increment starts behind it.
      if (attempt%off_path .and. .not. problem%has_spans()) then
         call find_corner_ahead(problem, run, attempt%trial, attempt%corner)
         attempt%off_path = .not. (around_corner(before, attempt) .or. is_too_near(problem, step, run, attempt%corner))
      else
         attempt%corner = corner_t()
      end if
      ! If the contact has changed at the last accepted point, the length of the increment is not checked.
      if (.not. attempt%changed) attempt%off_path = attempt%off_path .or. too_far(problem, run%control, attempt%relation)
      if (attempt%off_path) then
         attempt%report%message = 'what equilibrium there is ahead lies on another path, or behind a loop of this one'
      else
         attempt%off_path = retraces_path(problem, run, attempt%trial)
         if (attempt%off_path) attempt%report%message = 'the path turns round and leads back over the points that it has passed'
      end if
      ! A trial that was transferred from another mesh has been compared with the path on that mesh and remains accepted: on the new
      ! mesh the last accepted point may not be in equilibrium, so that another comparison could fail.
      if (attempt%has_trial .and. .not. turned_over(attempt%relation)) attempt%off_path = .false.
   end subroutine check_continuity

   !> True if the trial lies behind a corner of the path that longer, failed increments have predicted.
   pure logical function around_corner(before, attempt) result(around)
      type(relation_t), intent(in) :: before     !! relation between the last accepted point and the previous trial
      type(attempt_t), intent(in) :: attempt
      around = attempt%cuts > 0 .and. attempt%corner%goes_around
      if (around) around = attempt%corner%length >= 0.0_wp .or. at_corner(before, attempt%relation)
   end function around_corner

   !> Prepares the repetition that the trial requires: a smaller residual or another mesh.
   subroutine retry_refined(problem, run, attempt, settled)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      logical, intent(in) :: settled             !! true: the trial is in equilibrium
      logical :: done
      attempt%cuts = 0
      attempt%meshes = attempt%meshes + 1
      if (attempt%request%smaller_residual) then
         attempt%request%smaller_residual = .false.
         problem%model%step(problem%step)%sharper = sharper * problem%model%step(problem%step)%sharper
         problem%deck%step(problem%step)%sharper = problem%model%step(problem%step)%sharper
         if (allocated(attempt%request%density)) deallocate (attempt%request%density)
         return
      end if
      call refine_mesh(problem, run, attempt%trial, settled, attempt%request, attempt%has_trial, done)
      ! If no mesh can be made, the counter is set to its limit, so that the present mesh is accepted.
      if (.not. done) attempt%meshes = huge(attempt%meshes) - 1
   end subroutine retry_refined

   !> Finds another contact set by trials if no increment succeeds with the present set. This is done
   !> once at each position along the path. attempt%changed is true if another set is found; otherwise the set is unchanged.
   subroutine try_another_set(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      ! Points that differ only in their contact set are at the same position.
      attempt%changed = problem%has_spans() .and. run%arc_length - run%left_at > attempt%searched_to
      if (.not. attempt%changed) return
      attempt%searched_to = place()
      call find_other_set(problem, step, run, attempt%first_increment, recorder, attempt%changed, attempt%finished, outcome)
      ! At the position where a set was found, no other set is searched for again.
      attempt%searched_to = place()
      if (.not. attempt%changed) return
      run%control%increment = sign(attempt%first_increment, run%control%increment)
      attempt%cuts = 0

   contains

      !> Arc length of the run's last point since the start of the step or branch, enlarged by the location tolerance: all points up
      !> to this arc length are at the same position.
      real(wp) function place()
         place = (1.0_wp + step%locate_tolerance) * (run%arc_length - run%left_at)
      end function place
   end subroutine try_another_set

   !> Begins the attempts at the last accepted point of the path. The counters of meshes are reset if this point is new.
   subroutine start_from(run, attempt)
      type(path_state_t), intent(in) :: run
      type(attempt_t), intent(inout) :: attempt
      logical :: moved
      moved = run%step_points /= attempt%point
      if (moved) then
         attempt%meshes = 0
         attempt%corner_meshes = 0
      end if
      if (moved .or. .not. attempt%first_increment > 0.0_wp) attempt%first_increment = abs(run%control%increment)
      attempt%point = run%step_points
   end subroutine start_from

   !> True if the increment ends in equilibrium on the path ahead of the point.
   pure logical function leads_on(attempt)
      type(attempt_t), intent(in) :: attempt
      leads_on = attempt%report%converged .and. .not. attempt%off_path
   end function leads_on

   !> Records whether the contact set was changed at the point while the trial was examined. If the path of the next set is known up
   !> to an equilibrium, this equilibrium is the next trial.
   subroutine note_change(problem, run, attempt)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run   !! its increment becomes that of the trial
      type(attempt_t), intent(inout) :: attempt
      attempt%changed = attempt%request%set_changed .and. .not. allocated(attempt%request%no_set)
      if (.not. allocated(attempt%request%ahead)) return
      attempt%trial = attempt%request%ahead
      attempt%report = increment_t(converged=.true.)
      attempt%has_trial = .true.
      attempt%planned = run%control%increment
      run%control%increment = increment_between(problem, run%control, run%last%state, attempt%trial%state)
   end subroutine note_change

   !> True if the step is complete or the run cannot continue.
   pure logical function ended(attempt, outcome)
      type(attempt_t), intent(in) :: attempt
      type(outcome_t), intent(in) :: outcome
      ended = attempt%finished .or. allocated(outcome%why)
   end function ended
end module increment_trials
