!> Repetition of an increment from the last accepted point: on another mesh, with a smaller residual, with another contact set, or
!> half as long.
module increment_retries
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   use continuing_with_set, only: find_other_set
   use span_mesh, only: refine_mesh
   use attempt, only: attempt_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: retry_refined, try_another_set, shorten_increment

   real(wp), parameter :: sharper = 0.01_wp !! residual tolerance of the repetition over that of the failed trial; with 0.001 and
   !! with 0.1 one deck in input has other results

contains

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

   !> Finds another contact set, by trials or else by contact at nodes, if no increment succeeds with the present set. This is done
   !> once at each position along the path. attempt%changed is true if another set is found; otherwise the set is unchanged.
   subroutine try_another_set(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      ! Points between which only the contact set changes are at the same position.
      attempt%changed = problem%has_spans() .and. run%arc_length - run%left_at > attempt%searched_to
      if (.not. attempt%changed) return
      attempt%searched_to = place()
      call find_other_set(problem, step, run, attempt%first_increment, recorder, attempt%changed, attempt%finished, outcome)
      ! Contact at nodes is not tried again at the position at which the present set was found.
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

   !> Prepares a shorter increment from the last accepted point: half of the increment that failed, or another part of it.
   pure subroutine shorten_increment(run, part)
      type(path_state_t), intent(inout) :: run
      real(wp), intent(in), optional :: part !! part of the increment, 0 to 1; default: a half
      real(wp) :: kept
      kept = 0.5_wp
      if (present(part)) kept = part
      run%control%increment = kept * run%control%increment
   end subroutine shorten_increment
end module increment_retries
