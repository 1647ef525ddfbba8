!> Makes one increment from the last accepted point: predicts and corrects it, and compares the trial with the recent path.
module increment_trials
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use path_continuity, only: relation_t, relate, same_path, turned_over, too_far, at_corner
   use corner_ahead, only: corner_t, find_corner_ahead, is_near
   use path_point, only: advance
   use path_state, only: path_state_t, copy_path_state, path_tangent_of, turned_back
   use span_start, only: begin_spans
   use stiffness_homotopy, only: is_stiff_start, take_stiff_start
   use attempt, only: attempt_t, leads_on
   implicit none
   private
   public :: try_increment

contains

   !> Makes the increment of the control, unless its trial exists already. Sets attempt%off_path if the trial is not on the path
   !> ahead of the last accepted point.
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
         ! The mesh that a trial on stiff foundations leaves has its interface points where contact ends in that trial. Where an
         ! increment on it fails, a shorter one begins on softer foundations again.
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
   !> restored: for a shorter increment another set of contact spans may be right.
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
      attempt%relation = relate(problem, run%last%state, attempt%trial%state, run%last%tangent, &
         & attempt%trial%tangent, run%fresh)
      attempt%off_path = .not. same_path(attempt%relation)
      ! With contact spans a corner of the path is a located contact change, and the path tangent is that behind the change.
      if (attempt%off_path .and. .not. problem%has_spans()) then
         call find_corner_ahead(problem, run, attempt%trial, attempt%corner)
         attempt%off_path = .not. (around_corner(before, attempt) .or. is_near(problem, step, run, attempt%corner))
      else
         attempt%corner = corner_t()
      end if
      ! If the contact has changed at the last accepted point, the length of the increment is not checked.
      if (.not. attempt%changed) attempt%off_path = attempt%off_path .or. too_far(problem, run%control, attempt%relation)
      if (attempt%off_path) then
         attempt%report%message = 'what equilibrium there is ahead lies on another path, or behind a loop of this one'
      else
         attempt%off_path = turned_back(problem, run, attempt%trial)
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
end module increment_trials
