!> Branches of a step, each followed from the bifurcation where it leaves its parent path to its own end.
!>
!> The first point of a branch is found as follows. The predictor moves the state along the null vector. The corrector stays in a
!> plane whose normal is the null vector without its component along the known path, so that the corrector cannot return to that
!> path. The first distance is halved until the tangent of the new path hardly turns over this distance, and the load of the new
!> path has no extremum within it.
module branches
   use kinds, only: wp
   use text, only: to_text
   use errors, only: error_t
   use model, only: step_t, branch_t, method_load, method_displacement, method_linearised
   use problem, only: problem_t, copy_problem
   use path_point, only: point_at, evaluate_tests, path_point_t, span_tests_at
   use path_control, only: is_arc_length, control_t, metric, displacement_between
   use archive, only: archive_t, archive_reset
   use increment_trials, only: attempt_t
   use checkpoint, only: saved_run_t, on_branch, exchange_branch, restore_run, continue_from_point, change_steps
   use path_state, only: path_state_t
   use critical_points, only: critical_points_t, critical_point_t
   use point_recording, only: record
   use path_outcome, only: outcome_t, note_trouble
   use path_follower, only: follow_points
   use corrector, only: increment_t, correct
   use path_record, only: recorder_t, branch_start_t
   use rod_state, only: state_t
   use bordered_system, only: apply_increment, all_to_global
   use tangent_modes, only: modes_t, lowest_modes, choose_null_vectors, deck_mode
   use test_kinds, only: span_test_t, test_slack, test_gap
   use state_transfer, only: carried
   use path_continuity, only: path_tangent_at
   implicit none
   private
   public :: follow_branches

   real(wp), parameter :: first_distance = 0.02_wp !! arc length tried first if neither deck nor strategy sets one; with values from
   !! 0.002 to 0.2 every deck in input has the same results

   integer, parameter :: max_tries = 12
   real(wp), parameter :: straight = 0.3_wp !! largest correction as a part of the distance; with values up to 3 every deck in input
   !! has the same results; with 0.03 three decks have other results

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
      integer, intent(in) :: number                  !! index of the branch in the results
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
      integer, allocatable :: bifurcations(:)        ! their indices in the list of critical points of the parent path
      integer :: i, at
      logical :: has_branch

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
      bifurcations = pack([(i, i=1, size(home%list))], home%list%label == 'BP')
      if (size(bifurcations) < branch%bifurcation) then
         call note_trouble(outcome, called//': its path has '//to_text(size(bifurcations))//' bifurcation(s), not '// &
            & to_text(branch%bifurcation))
         return
      end if
      at = bifurcations(branch%bifurcation)
      call check_bifurcation(home%list(at), has_branch)
      if (.not. has_branch) return
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

      !> Finds out whether a bifurcation has the branch that the deck requests. If not, the reason is appended to outcome%trouble,
      !> unless the deck requests both sides and only the other side has a branch.
      subroutine check_bifurcation(bifurcation, has_branch)
         type(critical_point_t), intent(in) :: bifurcation
         logical, intent(out) :: has_branch
         has_branch = .false.
         if (bifurcation%multiplicity == 0) then
            call note_trouble(outcome, called//': no path leaves the bifurcation in another direction, or it was not located')
         else if (branch%mode > bifurcation%multiplicity) then
            call note_trouble(outcome, called//': the bifurcation has '//to_text(bifurcation%multiplicity)// &
               & ' null vector(s) or other way(s) on, not '//to_text(branch%mode))
         else if (bifurcation%opens /= 0 .and. bifurcation%opens /= branch%side) then
            ! A one-sided bifurcation has only one branch: no path leaves it on the opposite side.
            if (.not. branch%both) call note_trouble(outcome, called//': contact closes this side of the bifurcation; SIDE='// &
               & trim(merge('PLUS ', 'MINUS', bifurcation%opens > 0))//' is the side that opens')
         else if (allocated(bifurcation%way) .and. branch%side < 0) then
            if (.not. branch%both) call note_trouble(outcome, called//': each way on from this contact change has one side, '// &
               & 'SIDE=PLUS')
         else
            has_branch = .true.
         end if
      end subroutine check_bifurcation

      !> Appends the reason why a branch ended to outcome%trouble, so that the other branches are followed. The run itself ends only
      !> after a signal or at a time limit.
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

   !> Moves the path state to the first point of the path that crosses the known path at a bifurcation.
   subroutine switch_branch(problem, step, critical_point, mode, side, distance, run, report)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(critical_point_t), intent(in) :: critical_point !! the bifurcation
      integer, intent(in) :: mode               !! index of the null vector, at most the multiplicity
      integer, intent(in) :: side               !! 1 along the null vector, -1 against it (sign convention of tangent_modes)
      real(wp), intent(in) :: distance          !! arc length tried first
      type(path_state_t), intent(inout) :: run  !! in: at the bifurcation; out: at the first point of the new path
      type(increment_t), intent(out) :: report  !! report of the correction to the first point; converged: the point was found
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(path_point_t) :: trial
      type(state_t) :: predicted
      type(control_t) :: plane
      real(wp), allocatable :: shape(:, :), chord(:, :), away(:, :), seen(:, :)
      real(wp) :: length, along, sense, drift
      integer :: try

      if (.not. run%last%system%ok) then
         report%message = 'the tangent at the bifurcation is singular'
         return
      end if
      call lowest_modes(problem, run%last%state, run%last%system, critical_point%multiplicity + 2, modes, error)
      if (modes%n < critical_point%multiplicity) then
         report%message = 'the null vector was not found'
         return
      end if
      call choose_null_vectors(problem, run%last%state, run%last%system, critical_point%multiplicity, modes)
      shape = all_to_global(problem, run%last%system, modes%x(:, mode))
      allocate (seen(3, problem%deck%mesh%n_nodes))
      call deck_mode(problem, run%last%state, run%last%system, modes%x(:, mode), seen, sense)
      sense = side * sense
      plane%method = method_linearised
      plane%tangent = sense * shape
      ! Direction of the known path without its rounding error: that error contains a component of the null vector.
      chord = critical_point%direction - critical_point%drift
      along = metric(problem, chord, chord)
      if (along > 0.0_wp) plane%tangent = plane%tangent - chord * (metric(problem, plane%tangent, chord) / along)
      plane%tangent = plane%tangent / sqrt(metric(problem, plane%tangent, plane%tangent))

      length = distance
      do try = 1, max_tries
         trial = run%last
         call apply_increment(problem, run%last%system, sense * length * modes%x(:, mode), 0.0_wp, trial%state)
         predicted = trial%state
         plane%increment = sense * length * metric(problem, plane%tangent, shape)
         ! The distance is measured from the known path without its rounding error, so that rounding does not move the points.
         drift = metric(problem, plane%tangent, critical_point%drift)
         if (abs(drift) >= 0.1_wp * abs(plane%increment)) drift = 0.0_wp
         plane%increment = plane%increment - drift
         call correct(problem, run%last%state, plane, .false., trial%state, trial%system, report)
         if (report%converged) then
            report%converged = transverse_distance() <= straight * length
            if (.not. report%converged) report%message = 'no other path was found near the bifurcation'
            if (report%converged) call check_penetration()
            if (report%converged) call check_extremum()
            if (report%converged) exit
         end if
         length = 0.5_wp * length
      end do
      if (.not. report%converged) return

      run%last_length = sqrt(metric(problem, away, away))
      run%last_load = trial%state%load_factor - run%last%state%load_factor
      call evaluate_tests(problem, trial)
      run%arc_length = critical_point%arc_length + run%last_length
      call set_increment(problem, step, critical_point, trial, length, run)
      run%last = trial

   contains

      !> Distance of the first point from the predictor, without its component along the known path. (Along the known path the load
      !> may change with the distance.)
      real(wp) function transverse_distance()
         real(wp), allocatable :: correction(:, :)
         correction = displacement_between(problem, predicted, trial%state)
         if (along > 0.0_wp) correction = correction - chord * (metric(problem, correction, chord) / along)
         transverse_distance = sqrt(metric(problem, correction, correction))
      end function transverse_distance

      !> Rejects a first point in which a free span penetrates an obstacle. A penetration means that the first contact of the new
      !> path lies within the distance.
      subroutine check_penetration()
         type(span_test_t), allocatable :: tests(:)
         if (.not. problem%has_spans()) return
         tests = span_tests_at(problem, trial)
         report%converged = all(tests%value >= -test_slack(tests%kind) .or. tests%kind /= test_gap)
         if (.not. report%converged) report%message = 'the other path begins inside an obstacle'
      end subroutine check_penetration

      !> Computes the path tangent at the first point, and rejects the point if the load has an extremum between the bifurcation and
      !> the first point. A load that changes by c a^2 + d a^4 over the distance a has no extremum if its rate times the distance
      !> lies between zero and four times its change.
      subroutine check_extremum()
         real(wp) :: change, rate
         away = trial%state%u - (run%last%state%u - drift * plane%tangent)
         change = trial%state%load_factor - run%last%state%load_factor
         trial%tangent = path_tangent_at(problem, trial%system, away, change)
         if (abs(change) <= step%locate_tolerance * abs(trial%state%load_factor)) return
         rate = trial%tangent%load * sqrt(metric(problem, away, away))
         report%converged = rate * change >= 0.0_wp .and. abs(rate) <= 4.0_wp * abs(change)
         if (.not. report%converged) report%message = 'the other path has a limit point next to the bifurcation'
      end subroutine check_extremum
   end subroutine switch_branch

   !> Moves the path state to the first point of a path with another contact set.
   subroutine take_way(problem, step, critical_point, way, run)
      type(problem_t), intent(inout) :: problem  !! in: problem of the contact change; out: problem of the new path
      type(step_t), intent(in) :: step
      type(critical_point_t), intent(in) :: critical_point !! the contact change from which the new path starts
      integer, intent(in) :: way                 !! index of the new path in critical_point%way
      type(path_state_t), intent(inout) :: run   !! in: at the contact change; out: at the first point of the new path
      type(path_point_t) :: first
      real(wp), allocatable :: away(:, :)
      associate (on => critical_point%way(way))
         away = displacement_between(on%problem, carried(problem, run%last%state, on%problem), on%state)
         run%last_length = sqrt(metric(on%problem, away, away))
         run%last_load = on%state%load_factor - run%last%state%load_factor
         first = point_at(on%problem, on%state)
         first%tangent = on%tangent
         call evaluate_tests(on%problem, first)
         run%arc_length = critical_point%arc_length + run%last_length
         call set_increment(on%problem, step, critical_point, first, critical_point%control%increment, run)
         run%last = first
         call copy_problem(on%problem, problem)
         run%spans_begun = max(run%spans_begun, maxval(problem%contact_span%number))
      end associate
   end subroutine take_way

   !> Sets the strategy of the step and the direction of the branch. The first increment is at most the distance of the branch's
   !> first point from the critical point.
   subroutine set_increment(problem, step, critical_point, first, distance, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(critical_point_t), intent(in) :: critical_point
      type(path_point_t), intent(in) :: first    !! first point of the branch
      real(wp), intent(in) :: distance           !! arc length from the critical point to `first`
      type(path_state_t), intent(inout) :: run   !! state of the run; in: its last accepted point is the critical point
      real(wp) :: change(size(problem%model%monitor))
      run%control = critical_point%control
      run%control%method = step%method
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      if (is_arc_length(step%method)) then
         if (.not. run%control%load_scale > 0.0_wp .and. abs(critical_point%direction_load) > 0.0_wp) &
            & run%control%load_scale = sqrt(metric(problem, critical_point%direction, critical_point%direction)) / &
            & abs(critical_point%direction_load)
         run%control%increment = min(distance, step%largest)
      else if (step%method == method_load) then
         run%control%increment = sign(min(max(abs(run%last_load), step%smallest), abs(step%increment)), run%last_load)
      else if (step%method == method_displacement) then
         change = first%test_values%monitor - run%last%test_values%monitor
         run%control%increment = sign(min(max(abs(change(step%monitor)), step%smallest), abs(step%increment)), change(step%monitor))
      end if
   end subroutine set_increment
end module branches
