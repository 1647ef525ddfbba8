!> Replaces contact sets that are wrong or cannot be continued: the set of the last change if it was wrong from its beginning, or
!> the present set where no increment converges or no set was found. Neighbours of the set are tried first
!> (contact_trials); if none is valid, contact at many nodes gives the set (contact_in_doubt).
module set_mending
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use test_kinds, only: span_test_t, test_slack, test_length, well_below
   use contact_change_types, only: step_interval_t, change_t, change_missed, change_opening, place_here
   use next_spans, only: next_t
   use set_begins, only: go_back
   use contact_trials, only: try_sets
   use contact_in_doubt, only: ask_nodes
   use entering_contact_set, only: go_to_next, adopt, passes_value
   use path_state, only: path_state_t, copy_path_state, forget_mesh
   use corner_limit, only: look_whether_back
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: keep_set_before, mend_last_change, find_other_set, begin_located

contains

   !> Keeps the run's point, at a contact change, with the contact set before the change. If several changes follow each other at
   !> one place, the set before the first of them is kept: rules gave the sets between, which may be wrong.
   subroutine keep_set_before(problem, run)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      if (allocated(run%before_change)) then
         if (run%arc_length <= run%since_change%at) return
      else
         allocate (run%before_change)
      end if
      call copy_problem(problem, run%before_change%problem)
      run%before_change%point = run%last
   end subroutine keep_set_before

   !> Replaces the set of the last contact change if it was wrong from its beginning: no point was accepted since, and a test is far
   !> below zero at the run's point already.
   subroutine mend_last_change(problem, step, run, interval, change, recorder, mended, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: mended
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(next_t) :: first, next
      finished = .false.
      ! Excluded: a point contact that begins where the rod is more curved than the obstacle becomes a line contact at once, which
      ! is a change of its own.
      mended = any(change%kind == [change_missed, change_opening]) .and. change%where == place_here .and. change%which > 0
      if (.not. mended) return
      associate (test => interval%before(change%which))
         mended = test%value < -well_below * test_slack(test%kind)
      end associate
      if (mended) call try_at_change(problem, step, run, first, next, mended)
      if (mended) call begin_set(problem, step, run, first, next, recorder, finished, outcome)
   end subroutine mend_last_change

   !> Searches for another contact set if no increment converges or no rule gives the next set, and continues with it.
   subroutine find_other_set(problem, step, run, reach, recorder, changed, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      real(wp), intent(in) :: reach              !! size of the increment that failed
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: changed            !! false: no other set was found
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(next_t) :: first, next
      finished = .false.
      call try_at_change(problem, step, run, first, next, changed)
      if (.not. changed) call try_sets(problem, step, run, first, next, changed)
      if (changed) then
         call begin_set(problem, step, run, first, next, recorder, finished, outcome)
      else
         call ask_nodes(problem, run, reach, next, changed)
         if (.not. changed) return
         call go_to_next(problem, step, run, next, recorder, finished, outcome)
      end if
      if (.not. (finished .or. allocated(outcome%why))) call look_whether_back(problem, step, run, outcome)
   end subroutine find_other_set

   !> Tries neighbours of the set before the last contact change, or before the first of several changes at one place
   !> (keep_set_before), if no point was accepted since: the set that the rule gave is wrong.
   subroutine try_at_change(problem, step, run, first, next, found)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run   !! out: at the place of the change if a set is found, else unchanged
      type(next_t), intent(out) :: first, next  !! first equilibrium of the set and a later one at which all its tests are
      !! satisfied, see try_sets
      logical, intent(out) :: found
      type(path_state_t) :: before
      found = allocated(run%before_change) .and. run%arc_length <= run%since_change%at
      if (.not. found) return
      call copy_path_state(run, before)
      call forget_mesh(before)
      before%last = run%before_change%point
      found = before%last%system%ok
      if (found) call try_sets(run%before_change%problem, step, before, first, next, found)
      if (.not. found) return
      call copy_problem(run%before_change%problem, problem)
      call copy_path_state(before, run)
   end subroutine try_at_change

   !> Continues from the run's point, a recorded change of contact, with the set that trials found there. Its first equilibrium is
   !> near that point and is not recorded; if a value that the deck asks for lies on the way, it is moved nearer.
   subroutine begin_located(problem, step, run, test, first, recorder, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(span_test_t), intent(in) :: test      !! the test that is zero there
      type(next_t), intent(inout) :: first       !! first equilibrium of the set, see try_sets
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      logical :: passes
      integer :: pivots
      finished = .false.
      pivots = run%last%test_values%negative_pivots
      first%label = '  '
      passes = passes_value(problem, step, run, first)
      if (passes) then
         call go_back(run%last%state%load_factor, first)
         passes = passes_value(problem, step, run, first)
      end if
      if (passes) then
         call go_to_next(problem, step, run, first, recorder, finished, outcome)
      else
         call adopt(problem, run, first)
         run%since_change%arrives = .true.
         ! Where a line contact has become a point contact, a free span beside it may be in neutral equilibrium, so that its pivot
         ! has no certain sign; the pivot count with the line contact is kept.
         run%since_change%shrunk = test%kind == test_length
         if (run%since_change%shrunk) run%last%test_values%negative_pivots = pivots
      end if
   end subroutine begin_located

   !> Continues with a set found by trials: to its first equilibrium, and from there to a point at which all its tests are
   !> satisfied.
   subroutine begin_set(problem, step, run, first, next, recorder, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(next_t), intent(inout) :: first, next  !! first equilibrium of the set and a later one at which all its tests are
      !! satisfied, see try_sets
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      call go_to_next(problem, step, run, first, recorder, finished, outcome)
      if (finished .or. allocated(outcome%why)) return
      call go_to_next(problem, step, run, next, recorder, finished, outcome)
   end subroutine begin_set
end module set_mending
