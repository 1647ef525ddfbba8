!> Branches of a step, each followed from the bifurcation where it leaves its parent path to its own end.
module branches
   use kinds, only: wp
   use text, only: to_text
   use errors, only: error_t
   use model, only: step_t, branch_t
   use problem, only: problem_t, copy_problem
   use path_point, only: point_at, evaluate_tests
   use path_control, only: is_arc_length
   use archive, only: archive_t, archive_reset
   use attempt, only: attempt_t
   use checkpoint, only: saved_run_t, on_branch, exchange_branch, restore_run, continue_from_point, change_steps
   use path_state, only: path_state_t
   use critical_points, only: critical_points_t
   use point_recording, only: record
   use path_outcome, only: outcome_t, note_trouble
   use path_follower, only: follow_points
   use branch_switching, only: switch_branch, take_way
   use corrector, only: increment_t
   use path_record, only: recorder_t, branch_start_t
   implicit none
   private
   public :: follow_branches

   real(wp), parameter :: first_distance = 0.02_wp !! arc length tried first if neither deck nor strategy sets one; with values from
   !! 0.002 to 0.2 every deck in input has the same results

contains

   !> Follows all branches of a step. Failures are appended to outcome%trouble, and the other branches are still followed.
   subroutine follow_branches(former, step, own, numbered, before, saved, recorder, outcome)
      type(step_t), intent(in) :: former             !! the step up to the point where the run continues
      type(step_t), intent(in) :: step
      type(critical_points_t), intent(inout), target :: own !! critical points of the step's own path
      integer, intent(inout) :: numbered             !! number of branches in the results so far
      type(archive_t), intent(inout), target :: before !! frame of the checkpoints with the results of the step's path (see module
      !! checkpoint): the beginning of the frame of each branch
      type(saved_run_t), intent(inout) :: saved    !! restart; on_branch: the restart continues a branch of this step
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome      !! why: set only if the results cannot be written or the run must end
      type(critical_points_t), target :: found(size(step%branch))
      type(critical_points_t), pointer :: left
      type(branch_start_t) :: start
      type(error_t), allocatable :: error
      integer :: number_in_file(0:size(step%branch)), b, first, first_branch, words, this

      first = numbered
      first_branch = 1
      words = before%n
      number_in_file = 0
      if (saved%kind == on_branch) then
         call exchange_branch(saved%archive, first_branch, first, own, found)
         number_in_file(1:) = [(first + b, b=1, size(step%branch))]
      end if
      do b = first_branch, size(step%branch)
         if (allocated(found(b)%list)) deallocate (found(b)%list)
         allocate (found(b)%list(0))
         numbered = first + b
         number_in_file(b) = numbered
         start%of = number_in_file(step%branch(b)%of)
         left => own
         if (step%branch(b)%of > 0) left => found(step%branch(b)%of)
         this = b
         call archive_reset(before, words)
         call exchange_branch(before, this, first, own, found)
         if (saved%from > 0) then
            call follow_branch(former, b, left, start, numbered, before, saved, found(b), recorder, outcome)
         else
            call follow_branch(step, b, left, start, numbered, before, saved, found(b), recorder, outcome)
         end if
         saved%kind = 0
         if (allocated(outcome%why)) return
      end do
      if (size(step%branch) == 0) return
      start = branch_start_t()
      call recorder%take(start, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine follow_branches

   !> Follows one branch.
   subroutine follow_branch(step, b, home, start, number, frame, saved, found, recorder, outcome)
      type(step_t), intent(in) :: step
      integer, intent(in) :: b                       !! index of the branch in the step
      type(critical_points_t), intent(in), target :: home  !! critical points of the parent path
      type(branch_start_t), intent(inout) :: start
      integer, intent(in) :: number                  !! number of the branch in the results
      type(archive_t), intent(inout), target :: frame
      type(saved_run_t), intent(inout) :: saved    !! restart; on_branch: the restart continues this branch
      type(critical_points_t), intent(inout), target :: found !! critical points of the branch
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(problem_t) :: problem
      type(path_state_t) :: run
      type(branch_t) :: branch
      type(step_t) :: as_branch
      type(increment_t) :: report, nothing
      type(error_t), allocatable :: error
      type(attempt_t) :: attempt
      character(:), allocatable :: called
      real(wp) :: distance
      integer :: i, at, passed

      outcome%wrong = .false.
      branch = step%branch(b)
      called = 'branch '//trim(branch%name)//trim(merge(' (plus) ', ' (minus)', branch%side > 0))
      as_branch = followed_as_branch(step, b)
      if (saved%kind == on_branch) then
         run%critical_points => found
         call restore_run(saved, problem, run, attempt, outcome)
         run%home => home
         run%frame => frame
         call follow_points(problem, as_branch, run, recorder, outcome, attempt, 0)
         call note_end()
         return
      end if
      at = 0
      passed = 0
      do i = 1, size(home%list)
         if (home%list(i)%label /= 'BP') cycle
         passed = passed + 1
         if (passed == branch%bifurcation) at = i
      end do
      if (at == 0) then
         call note_trouble(outcome, called//': its path has '//to_text(passed)//' bifurcation(s), not '// &
            & to_text(branch%bifurcation))
         return
      end if
      if (home%list(at)%multiplicity == 0) then
         call note_trouble(outcome, called//': no path leaves the bifurcation in another direction, or it was not located')
         return
      else if (branch%mode > home%list(at)%multiplicity) then
         call note_trouble(outcome, called//': the bifurcation has '//to_text(home%list(at)%multiplicity)// &
            & ' null vector(s) or other way(s) on, not '//to_text(branch%mode))
         return
      else if (home%list(at)%opens /= 0 .and. home%list(at)%opens /= branch%side) then
         ! A one-sided bifurcation has only one branch: no path leaves it on the opposite side.
         if (.not. branch%both) call note_trouble(outcome, called//': contact closes this side of the bifurcation; SIDE='// &
            & trim(merge('PLUS ', 'MINUS', home%list(at)%opens > 0))//' is the side that opens')
         return
      else if (allocated(home%list(at)%way) .and. branch%side < 0) then
         if (.not. branch%both) call note_trouble(outcome, called//': each way on from this contact change has one side, SIDE=PLUS')
         return
      end if
      call copy_problem(home%list(at)%problem, problem)
      if (saved%renews()) call change_steps(saved%steps, problem)
      start%branch = number
      start%name = branch%name
      start%step = problem%step
      start%bifurcation = branch%bifurcation
      start%mode = branch%mode
      start%side = branch%side
      start%point = home%list(at)%point
      call recorder%take(start, error)
      if (allocated(error)) then
         outcome%why = error%message
         return
      end if

      if (saved%from == 0) run%frame => frame
      run%branch = number
      run%critical_points => found
      if (size(problem%contact_span) > 0) run%spans_begun = maxval(problem%contact_span%number)
      run%arc_length = home%list(at)%arc_length
      run%left_at = run%arc_length
      run%home => home
      run%last = point_at(problem, home%list(at)%state)
      call evaluate_tests(problem, run%last)
      call record(problem, run, run%last, 'BP', nothing, recorder, outcome, pivots=home%list(at)%pivots)
      call note_end()
      if (allocated(outcome%why) .or. outcome%wrong) return
      distance = branch%increment
      if (.not. distance > 0.0_wp) then
         distance = first_distance
         if (is_arc_length(step%method)) distance = min(distance, step%largest)
      end if
      if (allocated(home%list(at)%way)) then
         call take_way(problem, as_branch, home%list(at), branch%mode, run)
         report%converged = .true.
      else
         call switch_branch(problem, as_branch, home%list(at), branch%mode, branch%side, distance, run, report)
      end if
      if (.not. report%converged) then
         call note_trouble(outcome, called//': '//report%message)
         return
      end if
      call record(problem, run, run%last, '', report, recorder, outcome)
      call note_end()
      if (allocated(outcome%why) .or. outcome%wrong) return
      run%step_points = 1
      call follow_points(problem, as_branch, run, recorder, outcome, attempt, saved%pause(number))
      if (saved%pause(number) > 0 .and. run%points >= saved%from) then
         call continue_from_point(saved, problem, run, attempt, outcome)
         run%frame => frame
         as_branch = followed_as_branch(problem%model%step(problem%step), b)
         if (.not. (allocated(outcome%why) .or. outcome%ended)) &
            & call follow_points(problem, as_branch, run, recorder, outcome, attempt, 0)
      end if
      call note_end()

   contains

      !> Appends the reason why a branch ended to the notes, so that the other branches are followed. The run itself ends after a
      !> signal or at a time limit.
      subroutine note_end()
         if (.not. allocated(outcome%why) .or. outcome%ended) return
         call note_trouble(outcome, called//': '//outcome%why)
         deallocate (outcome%why)
      end subroutine note_end
   end subroutine follow_branch

   !> Copy of the step with the stop conditions and the number of points of one of its branches.
   function followed_as_branch(step, b) result(as_branch)
      type(step_t), intent(in) :: step
      integer, intent(in) :: b                       !! index of the branch in the step
      type(step_t) :: as_branch
      as_branch = step
      as_branch%stop = step%branch(b)%stop
      as_branch%max_points = step%branch(b)%max_points
   end function followed_as_branch
end module branches
