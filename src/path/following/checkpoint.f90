!> Checkpoint: the state of a run between two points, stored as an archive, and its restoration. A run restarted from a checkpoint
!> has the same results to the last bit.
!>
!> A checkpoint contains everything on which the further path depends: the problem with its mesh, the state, factors, control,
!> counters of the attempts from the last point, and critical points (module run_archive stores every component of these types). It
!> begins with a frame, which identifies the path and stores the results of earlier paths. The frame of a step's path has the
!> perfect model and the buckling modes found so far. The frame of a branch also has the path of its step and the critical points of
!> the branches before it, the frame of a limit curve the path of its step (limit_curves).
!>
!> A run can be continued with another deck if only the cards that control how steps are followed differ (why_not_with).
module checkpoint
   use kinds, only: wp
   use errors, only: error_t
   use archive, only: archive_t, archive_one, archive_reset
   use run_archive, only: exchange_problem_t, exchange_path_state_t, exchange_outcome_t, exchange_attempt_t, &
      & exchange_critical_points_t, exchange_model_t, exchange_buckling_t
   use model, only: model_t, step_t
   use problem, only: problem_t
   use critical_points, only: critical_points_t
   use path_state, only: path_state_t
   use step_control, only: change_control
   use increment_trials, only: attempt_t
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t, buckling_t
   use text, only: to_text
   implicit none
   private
   public :: saved_run_t, on_step, on_branch, on_curve, exchange_step, exchange_branch, save_run, restore_run, clear_end, &
      & change_steps, take_steps, continue_from_point, not_again, why_not_with

   integer, parameter :: on_step = 1, on_branch = 2, on_curve = 3 !! kinds of path
   character(*), parameter :: not_again = 'the run that was made again up to the point does not find the points in the file: '// &
      & 'another program, another machine, or pieces with several decks made it'

   !> A restart: a checkpoint that is read part by part, or a run that is repeated up to a point.
   type :: saved_run_t
      type(archive_t) :: archive
      integer :: kind = 0 !! kind of path on which the checkpoint was written: on_step, on_branch, on_curve; 0: no checkpoint
      logical :: changed = .false. !! true: the deck has changed, and a path that was complete continues with the changed deck
      integer :: from = 0 !! row of the results up to which the run is repeated, without checkpoints, before it continues with
      !! `steps`; 0: no such row, or the run has reached it
      integer :: branch = 0                      !! number of the branch to which row `from` belongs; 0: the path of the steps
      type(step_t), allocatable :: steps(:)      !! steps of the changed deck
      real(wp), allocatable :: load_factor(:)    !! (rows) load factors of the points in the result file
   contains
      procedure :: pause
      procedure :: renews
   end type saved_run_t

contains

   !> Row of the results at which a path must pause, because the run continues from there with other steps; 0: none.
   pure integer function pause(saved, branch)
      class(saved_run_t), intent(in) :: saved
      integer, intent(in) :: branch              !! number of the path's branch; 0: the path of the steps
      pause = merge(saved%from, 0, branch == saved%branch)
   end function pause

   !> True if paths that begin now use the steps of the changed deck.
   pure logical function renews(saved)
      class(saved_run_t), intent(in) :: saved
      renews = saved%changed .and. saved%from == 0
   end function renews

   !> Stores or reads the frame of the path of a step, the first part of the checkpoint.
   subroutine exchange_step(a, kind, step, n_branches, perfect, buckled)
      type(archive_t), intent(inout) :: a
      integer, intent(inout) :: kind !! kind of path: on_step, on_branch or on_curve; tells which parts of the checkpoint follow
      integer, intent(inout) :: step, n_branches !! number of the step; count of branches of all previous steps
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

   !> Stores or reads the part of the frame that a branch adds: the critical points of the step's path and of the branches before
   !> this one.
   subroutine exchange_branch(a, branch, first, own, found)
      type(archive_t), intent(inout) :: a
      integer, intent(inout) :: branch           !! index of the branch in the step
      integer, intent(inout) :: first            !! number of branches of all previous steps
      type(critical_points_t), intent(inout) :: own
      type(critical_points_t), intent(inout) :: found(:) !! (branches of the step) critical points of each branch
      integer :: k
      call archive_one(a, branch)
      call archive_one(a, first)
      call exchange_critical_points_t(a, own)
      do k = 1, branch - 1
         call exchange_critical_points_t(a, found(k))
      end do
   end subroutine exchange_branch

   !> Stores a checkpoint and passes it to the recorder, if the recorder requests a checkpoint.
   subroutine save_run(problem, run, attempt, recorder, outcome, now)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical, intent(in) :: now                 !! true: stored even if the recorder does not request a checkpoint
      type(error_t), allocatable :: error
      integer :: n
      if (.not. associated(run%frame)) return
      if (.not. (now .or. recorder%wants_state())) return
      n = run%frame%n
      call exchange_path(run%frame, problem, run, attempt, outcome)
      call recorder%state(run%frame%words(:run%frame%n), error)
      call archive_reset(run%frame, n)
      if (allocated(error) .and. .not. allocated(outcome%why)) outcome%why = error%message
   end subroutine save_run

   !> Restores the run from a checkpoint; run%critical_points must be associated. The stored reasons why the run ended are cleared.
   subroutine restore_run(saved, problem, run, attempt, outcome)
      type(saved_run_t), intent(inout) :: saved
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(out) :: attempt
      type(outcome_t), intent(inout) :: outcome
      call exchange_path(saved%archive, problem, run, attempt, outcome)
      call run%mesh%enriched%forget()
      call clear_end(outcome)
      if (saved%changed) call change_path(saved, problem, run, attempt)
   end subroutine restore_run

   !> Clears the reasons why a run ended, before it is continued.
   subroutine clear_end(outcome)
      type(outcome_t), intent(inout) :: outcome
      if (allocated(outcome%why)) deallocate (outcome%why)
      outcome%complete = .false.
      outcome%turns = .false.
      outcome%home = .false.
      outcome%used_up = .false.
      outcome%ended = .false.
      outcome%dead_end = .false.
   end subroutine clear_end

   !> Continues with the steps of the changed deck from the last repeated point of the run.
   subroutine continue_from_point(saved, problem, run, attempt, outcome)
      type(saved_run_t), intent(inout) :: saved
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      type(outcome_t), intent(inout) :: outcome  !! why: set if the repeated run does not find the points that the result file has
      logical :: again
      again = run%points <= size(saved%load_factor)
      if (again) again = .not. abs(run%recorded_load - saved%load_factor(run%points)) > 0.0_wp
      saved%from = 0
      if (outcome%ended) return
      call clear_end(outcome)
      if (.not. again) outcome%why = not_again
      if (saved%changed) call change_path(saved, problem, run, attempt)
   end subroutine continue_from_point

   !> Continues a path from its last accepted point with the steps of the changed deck.
   subroutine change_path(saved, problem, run, attempt)
      type(saved_run_t), intent(in) :: saved
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt
      integer :: method
      method = problem%model%step(problem%step)%method
      call change_steps(saved%steps, problem)
      attempt%finished = .false.
      associate (step => problem%model%step(problem%step))
         if (step%method == method) return
         call change_control(problem, step, run)
      end associate
      attempt = attempt_t()
   end subroutine change_path

   !> Replaces the steps of a problem by those of the changed deck.
   subroutine change_steps(new, problem)
      type(step_t), intent(in) :: new(:)
      type(problem_t), intent(inout) :: problem
      call take_steps(new, problem%model%step)
      call take_steps(new, problem%deck%step)
   end subroutine change_steps

   !> Replaces steps by those of the changed deck. Loads are kept as they are distributed on the mesh. The factor on the residual
   !> tolerance that the run found necessary (`sharper`) is kept if the tolerances are equal.
   subroutine take_steps(new, steps)
      type(step_t), intent(in) :: new(:)
      type(step_t), intent(inout) :: steps(:)    !! in: steps of the old deck; out: as many steps of the changed deck
      type(step_t) :: one
      integer :: i
      do i = 1, size(steps)
         one = new(i)
         one%load = steps(i)%load
         ! The factor by which residuals must be smaller than the deck's tolerance was found during the run.
         if (.not. (abs(one%tolerance - steps(i)%tolerance) > 0.0_wp .or. abs(one%asked - steps(i)%asked) > 0.0_wp)) &
            & one%sharper = steps(i)%sharper
         steps(i) = one
      end do
   end subroutine take_steps

   !> Stores or reads the part of the checkpoint that describes the present path.
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

   !> Message that explains why a run of deck `old` cannot be continued with deck `new`; empty if it can.
   function why_not_with(old, new) result(why)
      type(model_t), intent(in) :: old, new
      character(:), allocatable :: why
      why = ''
      if (size(old%step) /= size(new%step)) then
         why = 'the deck has '//to_text(size(new%step))//' steps, that of the results has '//to_text(size(old%step))
      else if (.not. same(structure(old), structure(new))) then
         why = 'the deck is that of another structure, or has other loads: only *STATIC, *CONTROLS, *ACCURACY, *STOP, *LOCATE, ' &
            & //'*TURNING POINTS, *FIELD OUTPUT and the ends of branches may be others'
      end if
   end function why_not_with

   !> Archive of a model without title, job name and the cards that control how steps are followed.
   function structure(model) result(a)
      type(model_t), intent(in) :: model
      type(archive_t) :: a
      type(model_t) :: bare
      type(step_t) :: nothing
      integer :: i, k
      bare = model
      if (allocated(bare%title)) deallocate (bare%title)
      if (allocated(bare%job)) deallocate (bare%job)
      do i = 1, size(bare%step)
         bare%step(i) = nothing
         bare%step(i)%load = model%step(i)%load
         bare%step(i)%branch = model%step(i)%branch
         do k = 1, size(bare%step(i)%branch)
            bare%step(i)%branch(k)%max_points = 0
            deallocate (bare%step(i)%branch(k)%stop)
         end do
         bare%step(i)%limit_curve = model%step(i)%limit_curve
         bare%step(i)%n_modes = model%step(i)%n_modes
      end do
      call exchange_model_t(a, bare)
   end function structure

   !> True if two archives have the same words.
   logical function same(a, b)
      type(archive_t), intent(in) :: a, b
      same = a%n == b%n
      if (same) same = all(a%words(:a%n) == b%words(:b%n))
   end function same
end module checkpoint
