!> Continues the path with another contact set. At a located change, trials have found this set. Where they found none, or where no
!> increment converges, neighbours of the present set are tried: sets that differ from it by one edit or two (contact_trials).
module continuing_with_set
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use test_kinds, only: span_test_t, any_fails, is_length, test_length, test_pressure
   use other_set, only: other_set_t, copy_other_set, go_to_load, tests_of
   use vanished_length, only: find_vanished
   use tried_sets, only: next_set_t, new_change_place
   use contact_trials, only: try_sets
   use rod_strips, only: same_kind
   use step_off, only: tangent_along
   use entering_contact_set, only: go_to_next, replace_set, passes_value
   use path_point, only: span_tests_at
   use path_continuity, only: relate, same_path
   use mesh_transfer, only: transfer_and_solve
   use trial_request, only: request_t
   use path_state, only: path_state_t, copy_path_state, difference_load
   use corner_limit, only: check_return
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: find_other_set, begin_located, begin_set

   real(wp), parameter :: nearer_by = 0.8_wp !! factor on the load distance from a change to a set's first equilibrium, if this
   !! equilibrium must come nearer. The new span is short there, so it follows only small changes of the load. With 0.6 and 0.9 none
   !! of 146 decks of the tests changes

contains

   !> Searches for another contact set if no increment converges or no set was found at a change, and continues the path with that
   !> set.
   subroutine find_other_set(problem, step, run, reach, recorder, changed, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      real(wp), intent(in) :: reach              !! size of the increment that failed
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: changed            !! false: no other set was found
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(next_set_t) :: next
      finished = .false.
      call try_sets(step, run, new_change_place(problem, step, run, run%last, reach=reach), next)
      changed = next%found
      if (.not. changed) return
      call leave_recorded(problem, run, next%first)
      call begin_set(problem, step, run, next, recorder, finished, outcome)
      if (.not. (finished .or. allocated(outcome%why))) call check_return(problem, step, run, outcome)
   end subroutine find_other_set

   !> Takes a contact out of the label of the next set if the last point has recorded this contact already. A change is recorded
   !> where it is located, even if its new set is found only later, when increments fail.
   subroutine leave_recorded(problem, run, next)
      type(problem_t), intent(in) :: problem     !! with the present set
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(inout) :: next   !! its label counts the contacts gained or lost against the present set
      integer :: n
      n = size(run%critical_points%list)
      if (n == 0) return
      associate (change => run%critical_points%list(n))
         if (change%label /= next%label .or. next%label == '' .or. change%point /= run%points) return
         if (.not. same_kind(problem%layout, change%problem%contact_span, problem%contact_span)) return
         next%times = next%times - 1
         if (next%times == 0) next%label = '  '
      end associate
   end subroutine leave_recorded

   !> Continues from the run's point, a recorded change of contact, with the set that trials found there. Two equilibria of this set
   !> are known: `first` is nearest to the change, and increments can be made from `onward`. If one increment leads from `first` to
   !> `onward`, the run moves to `first`, and `onward` is the next trial: events between the two are then located like those on any
   !> increment. Otherwise the run goes on from `onward`, which is not recorded. `onward` is moved nearer to the change if a value
   !> that the deck asks for lies on the way; if the value still lies on the way, `onward` is recorded as a point.
   subroutine begin_located(problem, step, run, test, next, recorder, request, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(span_test_t), intent(in) :: test      !! the test that is zero at the change
      type(next_set_t), intent(inout) :: next    !! the set, found at the change
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request  !! receives `onward` as the next trial, if the run moves to `first`
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      logical :: passes, leads
      integer :: pivots
      finished = .false.
      pivots = run%last%test_values%negative_pivots
      call begin_nearer(problem, step, run, next%first, next%onward, request, leads)
      if (.not. leads) then
         call come_before_values(problem, step, run, test%kind == test_pressure, next%onward, passes)
         if (passes) then
            call go_to_next(problem, step, run, next%onward, recorder, finished, outcome)
            return
         end if
         call replace_set(problem, run, next%onward)
      end if
      ! Where a line contact has become a point contact, a free span beside it may be in neutral equilibrium, so that the sign of
      ! its pivot is uncertain. The count of negative pivots found with the line contact is therefore kept.
      run%since_change%shrunk = test%kind == test_length
      if (run%since_change%shrunk) run%last%test_values%negative_pivots = pivots
   end subroutine begin_located

   !> Moves the run to a set's equilibrium `first`, on the mesh of its equilibrium `onward`, if one increment leads from `first` to
   !> `onward`. Otherwise nothing changes: the length of a contact or free span may begin as a power of the load, and the path then
   !> turns too fast for an increment.
   subroutine begin_nearer(problem, step, run, first, onward, request, leads)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(other_set_t), intent(in) :: first, onward !! equilibria of the set: the nearest to the change, and one further along the
      !! path
      type(request_t), intent(inout) :: request  !! receives `onward` as the next trial
      logical, intent(out) :: leads
      type(problem_t) :: on
      type(path_state_t) :: there
      leads = abs(onward%state%load_factor - first%state%load_factor) > 0.0_wp
      if (leads) leads = .not. passes_value(problem, step, run, first, .true.)
      if (.not. leads) return
      call copy_problem(problem, on)
      call copy_path_state(run, there)
      call replace_set(on, there, first)
      call transfer_and_solve(onward%problem, on, there, leads)
      if (leads) leads = .not. any_fails(span_tests_at(on, there%last))
      if (leads) leads = same_path(relate(on, there%last%state, onward%state, there%last%tangent, onward%tangent, .false.))
      if (.not. leads) return
      call copy_problem(on, problem)
      call copy_path_state(there, run)
      request%ahead = onward%path_point_t
   end subroutine begin_nearer

   !> Moves the first equilibrium of a set towards the run's point until no value that the deck asks for lies between this
   !> equilibrium and the run's point.
   subroutine come_before_values(problem, step, run, smooth, first, passes)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      logical, intent(in) :: smooth              !! true: the path has no corner at the run's point
      type(other_set_t), intent(inout) :: first       !! with its path tangent
      logical, intent(out) :: passes !! true: a value still lies between them, because the set has no valid equilibrium nearer to
      !! the run's point
      type(other_set_t) :: nearer
      type(span_test_t), allocatable :: tests(:)
      do
         passes = passes_value(problem, step, run, first, smooth)
         if (.not. passes) return
         call copy_other_set(first, nearer)
         call go_to_load(nearer, run%last%state%load_factor + nearer_by * (first%state%load_factor - &
            & run%last%state%load_factor), tests)
         if (.not. allocated(tests)) return
         if (any_fails(tests) .or. .not. abs(nearer%state%load_factor - first%state%load_factor) > 0.0_wp) return
         nearer%tangent = tangent_along(nearer, first%tangent%u, first%tangent%load)
         call copy_other_set(nearer, first)
      end do
   end subroutine come_before_values

   !> Continues with a set found by trials: first to its equilibrium at its onset, then to a later equilibrium, at which all its
   !> tests are satisfied on other meshes, too. If the set begins where a length vanishes, its first equilibrium is that of the set
   !> without this length.
   subroutine begin_set(problem, step, run, next, recorder, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(next_set_t), intent(inout) :: next    !! the set, with its onset
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      call complete_onset(step, run, next%first)
      call go_to_next(problem, step, run, next%first, recorder, finished, outcome)
      if (finished .or. allocated(outcome%why)) return
      call go_to_next(problem, step, run, next%onward, recorder, finished, outcome)
   end subroutine begin_set

   !> Moves a set to the exact place of its onset, the point of the path where it begins, if a length vanishes there. If this place
   !> is not found, the onset is known only to lie between two points.
   subroutine complete_onset(step, run, first)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(inout) :: first !! out: the set without the length; unchanged if its test is not one of a length;
      !! with test 0 if the place is not found
      type(span_test_t), allocatable :: tests(:)
      type(other_set_t) :: without
      logical :: found
      if (first%test == 0) return
      tests = tests_of(first)
      if (.not. is_length(tests(first%test)%kind)) return
      call find_vanished(first%problem, first%state, tests(first%test), difference_load(run), &
         & step%locate_tolerance, without, found)
      if (.not. found) then
         first%test = 0
         return
      end if
      without%label = first%label
      without%divides = first%divides
      without%times = first%times
      call copy_other_set(without, first)
   end subroutine complete_onset
end module continuing_with_set
