!> The branches of a step: each from the bifurcation where it leaves its path to its own end.
module branches
   use kinds, only: wp
   use text, only: to_text
   use errors, only: error_t
   use model, only: step_t, branch_t
   use problem, only: problem_t, copy_problem
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use path_control, only: is_arc_length
   use path_state, only: path_state_t
   use critical_points, only: critical_points_t
   use point_recording, only: record
   use path_outcome, only: outcome_t, note_trouble
   use path_follower, only: follow_points
   use branch_switching, only: switch_branch
   use corrector, only: increment_t
   use path_record, only: recorder_t, branch_start_t
   implicit none
   private
   public :: follow_branches

   real(wp), parameter :: first_distance = 0.02_wp !! arc length tried first where neither deck nor strategy sets one

contains

   !> Follows all branches of a step. What cannot be found is noted in outcome%trouble; the others are followed still.
   subroutine follow_branches(step, own, numbered, recorder, outcome)
      type(step_t), intent(in) :: step
      type(critical_points_t), intent(in), target :: own   !! of the step's own path
      integer, intent(inout) :: numbered             !! branches in the results so far
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome      !! why: only when the results cannot be written
      type(critical_points_t), target :: found(size(step%branch))
      type(critical_points_t), pointer :: left
      type(branch_start_t) :: start
      type(error_t), allocatable :: error
      integer :: number_in_file(0:size(step%branch)), b, first

      first = numbered
      number_in_file = 0
      do b = 1, size(step%branch)
         allocate (found(b)%list(0))
         numbered = first + b
         number_in_file(b) = numbered
         associate (branch => step%branch(b))
            start%of = number_in_file(branch%of)
            left => own
            if (branch%of > 0) left => found(branch%of)
            call follow_branch(step, branch, left, start, numbered, found(b), recorder, outcome)
         end associate
         if (allocated(outcome%why)) return
      end do
      if (size(step%branch) == 0) return
      start = branch_start_t()
      call recorder%branch(start, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine follow_branches

   !> One branch.
   subroutine follow_branch(step, branch, home, start, number, found, recorder, outcome)
      type(step_t), intent(in) :: step
      type(branch_t), intent(in) :: branch
      type(critical_points_t), intent(in), target :: home  !! of the path that it leaves
      type(branch_start_t), intent(inout) :: start
      integer, intent(in) :: number                  !! in the results
      type(critical_points_t), intent(inout), target :: found !! of the branch
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(problem_t) :: problem
      type(path_state_t) :: run
      type(step_t) :: as_branch
      type(increment_t) :: report, nothing
      type(error_t), allocatable :: error
      character(:), allocatable :: called
      real(wp) :: distance
      integer :: i, at, passed

      called = 'branch '//trim(branch%name)//trim(merge(' (plus) ', ' (minus)', branch%side > 0))
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
         call note_trouble(outcome, called//': the bifurcation was bracketed, but not located')
         return
      else if (branch%mode > home%list(at)%multiplicity) then
         call note_trouble(outcome, called//': the bifurcation has '//to_text(home%list(at)%multiplicity)// &
            & ' null vector(s), not '//to_text(branch%mode))
         return
      end if
      call copy_problem(home%list(at)%problem, problem)
      start%branch = number
      start%name = branch%name
      start%step = problem%step
      start%bifurcation = branch%bifurcation
      start%mode = branch%mode
      start%side = branch%side
      start%point = home%list(at)%point
      call recorder%branch(start, error)
      if (allocated(error)) then
         outcome%why = error%message
         return
      end if

      as_branch = step
      as_branch%stop = branch%stop
      as_branch%max_points = branch%max_points
      run%system = new_system(problem)
      run%branch = number
      run%critical_points => found
      run%state = home%list(at)%state
      if (size(problem%touch) > 0) run%touches = maxval(problem%touch%number)
      run%arc_length = home%list(at)%arc_length
      run%left_at = run%arc_length
      run%home => home
      call linearise(problem, run%state, run%state, run%system)
      run%system%negative_pivots = home%list(at)%pivots
      call record(problem, run, run%state, 'BP', nothing, recorder, outcome)
      if (allocated(outcome%why)) return
      distance = branch%increment
      if (.not. distance > 0.0_wp) then
         distance = first_distance
         if (is_arc_length(step%method)) distance = min(distance, step%largest)
      end if
      call switch_branch(problem, as_branch, home%list(at), branch%mode, branch%side, distance, run, report)
      if (.not. report%converged) then
         call note_trouble(outcome, called//': '//report%message)
         return
      end if
      call record(problem, run, run%state, '', report, recorder, outcome)
      if (allocated(outcome%why)) return
      run%step_points = 1
      call follow_points(problem, as_branch, run, recorder, outcome)
      if (allocated(outcome%why)) then
         call note_trouble(outcome, called//': '//outcome%why)
         deallocate (outcome%why)
      end if
   end subroutine follow_branch
end module branches
