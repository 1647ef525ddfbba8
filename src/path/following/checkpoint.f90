!> Where a run stands between two points, as bytes, and back: from there it goes on to the bit as if it had never stopped.
!>
!> All that decides about the way on is in it: problem with its mesh, state, factors, control, what the attempts of the increment
!> have come to, critical_points (run_archive takes every component of these types). The frame, with which a path begins, says which
!> path it is and what the paths before it have left: for the path of a step the perfect model and the modes found so far, for a
!> branch the path that it leaves, too.
module checkpoint
   use errors, only: error_t
   use archive, only: archive_t, archive_one, archive_reset
   use run_archive, only: exchange_problem_t, exchange_path_state_t, exchange_outcome_t, exchange_attempt_t, &
      & exchange_critical_points_t, exchange_model_t, exchange_buckling_t
   use model, only: model_t
   use problem, only: problem_t
   use critical_points, only: critical_points_t
   use path_state, only: path_state_t
   use attempt, only: attempt_t
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t, buckling_t
   implicit none
   private
   public :: standing_t, on_step, on_branch, exchange_step, exchange_branch, keep_standing, take_standing

   integer, parameter :: on_step = 1, on_branch = 2 !! which path it is

   !> A run that goes on: what an archive says of it, part by part.
   type :: standing_t
      type(archive_t) :: archive
      integer :: kind = 0                        !! on_step, on_branch; 0: it begins
      logical :: changed = .false.               !! the deck is another one: also a path that has come to its end goes on
   end type standing_t

contains

   !> The frame of the path of a step: the archive's first part.
   subroutine exchange_step(a, kind, step, n_branches, perfect, buckled)
      type(archive_t), intent(inout) :: a
      integer, intent(inout) :: kind             !! on_step, or on_branch, where exchange_branch follows
      integer, intent(inout) :: step, n_branches
      type(model_t), intent(inout) :: perfect
      type(buckling_t), intent(inout) :: buckled(:)
      integer :: k
      call archive_one(a, kind)
      call archive_one(a, step)
      call archive_one(a, n_branches)
      call exchange_model_t(a, perfect)
      do k = 1, size(buckled)
         call exchange_buckling_t(a, buckled(k))
      end do
   end subroutine exchange_step

   !> What a branch adds: the path of its step, and those of the branches up to this one.
   subroutine exchange_branch(a, branch, first, own, found)
      type(archive_t), intent(inout) :: a
      integer, intent(inout) :: branch           !! of the step
      integer, intent(inout) :: first            !! branches before those of the step
      type(critical_points_t), intent(inout) :: own
      type(critical_points_t), intent(inout) :: found(:) !! (branches of the step)
      integer :: k
      call archive_one(a, branch)
      call archive_one(a, first)
      call exchange_critical_points_t(a, own)
      do k = 1, branch - 1
         call exchange_critical_points_t(a, found(k))
      end do
   end subroutine exchange_branch

   !> Hands the recorder where the run stands.
   subroutine keep_standing(problem, run, attempt, recorder, outcome, now)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical, intent(in) :: now                 !! even when the recorder does not ask for it
      type(error_t), allocatable :: error
      integer :: n
      if (.not. associated(run%frame)) return
      if (.not. (now .or. recorder%wants_state())) return
      n = run%frame%n
      call exchange_path(run%frame, problem, run, attempt, outcome)
      call recorder%state(run%frame%bytes(:run%frame%n), error)
      call archive_reset(run%frame, n)
      if (allocated(error) .and. .not. allocated(outcome%why)) outcome%why = error%message
   end subroutine keep_standing

   !> Takes out where the run stood; its critical_points must be associated. What ended it is forgotten.
   subroutine take_standing(standing, problem, run, attempt, outcome)
      type(standing_t), intent(inout) :: standing
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(out) :: attempt
      type(outcome_t), intent(inout) :: outcome
      call exchange_path(standing%archive, problem, run, attempt, outcome)
      if (allocated(outcome%why)) deallocate (outcome%why)
      outcome%complete = .false.
      outcome%turns = .false.
      outcome%home = .false.
      outcome%used_up = .false.
      outcome%ended = .false.
      outcome%dead_end = .false.
      if (standing%changed) attempt%finished = .false.
   end subroutine take_standing

   subroutine exchange_path(a, problem, run, attempt, outcome)
      type(archive_t), intent(inout) :: a
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      type(outcome_t), intent(inout) :: outcome
      call exchange_problem_t(a, problem)
      call exchange_path_state_t(a, run)
      call exchange_attempt_t(a, attempt)
      call exchange_outcome_t(a, outcome)
      call exchange_critical_points_t(a, run%critical_points)
   end subroutine exchange_path
end module checkpoint
