!> Ways on from a point that no increment has led on from, in their order: past a change of contact just ahead, on the finer mesh
!> that was there before, on a mesh twice as fine, around a corner, by a shorter increment. A way is not tried where its reason is
!> not there yet; one is `done` where nothing else is to be tried now: it has led on, or the run ends.
module step_recovery
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use bordered_system, only: linearise
   use corner_ahead, only: part_before, differ
   use corner_turning, only: turn_corner
   use path_state, only: path_state_t, checkpoint_t
   use step_control, only: smallest
   use remeshing, only: wants_another
   use path_outcome, only: outcome_t
   use span_changes, only: pass_change, set_holds, set_changed
   use span_mesh, only: step_back, ask_for_twice
   use attempt, only: attempt_t, ended
   use increment_retries, only: retry_refined, retry_by_nodes
   use stop_reasons, only: why_stuck
   use path_record, only: recorder_t
   use timing, only: count_up, counter_rejected, counter_cut
   implicit none
   private
   public :: try_recovery

   integer, parameter :: max_cuts = 40          !! of one increment
   integer, parameter :: cuts_before_corner = 2 !! after which the path may have a corner
   integer, parameter :: cuts_before_change = 3 !! after which a change of contact spans is looked for ahead
   integer, parameter :: cuts_before_mesh = 6   !! or failures, after which the mesh may be the reason

contains

   !> The first way that leads on, or none: the run ends.
   subroutine try_recovery(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored anywhere on entry, at its point on return
      type(attempt_t), intent(inout) :: attempt  !! whose increment has not led on
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical :: done
      call count_up(counter_rejected)
      attempt%cuts = attempt%cuts + 1
      if (attempt%astray) attempt%failures = attempt%failures + 1
      call linearise(problem, run%state, run%state, run%system)
      call go_past_change(problem, step, run, attempt, recorder, done, outcome)
      if (.not. done) call go_back_to_finer_mesh(problem, run, attempt, done)
      if (.not. done) call double_mesh(problem, step, run, attempt, done)
      if (.not. done) call go_around_corner(problem, step, run, attempt, recorder, done, outcome)
      if (.not. done) call cut_increment(problem, step, run, attempt, recorder, outcome)
   end subroutine try_recovery

   !> A change of contact spans just ahead may be the reason.
   subroutine go_past_change(problem, step, run, attempt, recorder, done, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at its point
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: done
      type(outcome_t), intent(inout) :: outcome
      integer :: result
      done = .false.
      if (.not. (problem%has_spans() .and. attempt%cuts == cuts_before_change .and. allocated(run%trail))) return
      attempt%trial = run%state
      attempt%ahead = run%heading
      call pass_change(problem, step, run, attempt%trial, attempt%ahead, .true., huge(1), recorder, result, &
         & attempt%finished, outcome)
      done = ended(attempt, outcome)
      if (done) return
      if (allocated(run%stuck)) deallocate (run%stuck)
      attempt%changed = result == set_changed
      done = result /= set_holds
      if (done) then
         attempt%cuts = 0
      else
         call linearise(problem, run%state, run%state, run%system)
      end if
   end subroutine go_past_change

   !> What was spared of the mesh may be the reason.
   subroutine go_back_to_finer_mesh(problem, run, attempt, done)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      logical, intent(out) :: done
      type(checkpoint_t), allocatable :: finer
      done = attempt%cuts > cuts_before_change .and. allocated(run%footing)
      if (.not. done) return
      call move_alloc(run%footing, finer)
      call step_back(finer, problem, run)
      run%control%increment = sign(attempt%first_increment, run%control%increment)
      attempt%cuts = 0
   end subroutine go_back_to_finer_mesh

   !> Perhaps a mesh that the program has made is too coarse for any increment: once at each point.
   subroutine double_mesh(problem, step, run, attempt, done)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      logical, intent(out) :: done
      done = .false.
      if (attempt%doubled_at == run%step_points) return
      if (max(attempt%cuts, attempt%failures) <= cuts_before_mesh .and. .not. too_short(step, run, 0.5_wp)) return
      attempt%doubled_at = run%step_points
      attempt%failures = 0
      call ask_for_twice(problem, run, done)
      if (.not. done) return
      if (too_short(step, run, 0.5_wp)) run%control%increment = sign(attempt%first_increment, run%control%increment)
      call retry_refined(problem, run, attempt, .false.)
   end subroutine double_mesh

   !> A path turns at once where the contact set changes.
   subroutine go_around_corner(problem, step, run, attempt, recorder, done, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at its point, on return too
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: done
      type(outcome_t), intent(inout) :: outcome
      logical :: turned
      done = .false.
      if (attempt%cuts <= cuts_before_corner .and. .not. (attempt%astray .and. differ(run%state%active, attempt%trial%active))) &
         & return
      call turn_corner(problem, step, run, attempt%corner_meshes, recorder, turned, attempt%finished, outcome)
      done = ended(attempt, outcome)
      if (done) return
      if (wants_another(run)) then
         attempt%corner_meshes = attempt%corner_meshes + 1
         call retry_refined(problem, run, attempt, .false.)
         done = .true.
         return
      end if
      if (turned) attempt%cuts = 0
      done = turned
   end subroutine go_around_corner

   !> Half of the increment, or what leads up to a corner of foundations; where that is not worth trying, what nodes say. The run
   !> ends if that is nothing new.
   subroutine cut_increment(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      real(wp) :: part
      part = 0.5_wp
      if (attempt%astray) part = part_before(problem, step, run, attempt%corner)
      run%control%increment = part * run%control%increment
      if (attempt%report%hopeless) then
         outcome%why = 'no first point: '//attempt%report%message
      else if (attempt%cuts > max_cuts .or. too_short(step, run, 1.0_wp)) then
         if (.not. allocated(attempt%report%message)) attempt%report%message = 'no equilibrium'
         call retry_by_nodes(problem, step, run, attempt, recorder, outcome)
         if (attempt%changed .or. ended(attempt, outcome)) return
         call why_stuck(problem, step, run, attempt%report, outcome%why, outcome%turns)
      else
         call count_up(counter_cut)
         ! A shorter increment may ask for a mesh of its own.
         attempt%meshes = 0
      end if
   end subroutine cut_increment

   !> True where a part of the increment is not worth trying.
   pure logical function too_short(step, run, part)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: part
      too_short = part * abs(run%control%increment) < smallest(step, run%control)
   end function too_short
end module step_recovery
