!> Changes of the contact spans along a path: the change is located at the zero of a test, a quantity that is not negative while the
!> contact set is valid. Then the contact set is changed, the structure is remeshed, and the path continues in the sense in which
!> the new contact or free span grows. The steps:
!>
!>   find_change     the test that is zero first, and where (span_events, span_location)
!>   close_spans     the set without free spans that vanish there, at its onset (closing_spans, set_onset)
!>   try_sets        otherwise the first neighbour of the set that all tests accept (contact_trials); which neighbours are tried
!>                   for which test, and in which order, is the table in neighbours
!>   find_vanished   where a length vanishes at a node that a load pulls or at a support: the exact place (vanished_length)
!>   other_ways      other sets with which the path may go on, if several contacts change at once (contact_ways)
!>   record_change   the point, labelled as contact gained, lost or neither
!>   begin_located   the first equilibrium of the set, from which the path continues (continuing_with_set, entering_contact_set)
module span_changes
   use kinds, only: wp
   use model, only: step_t, method_load
   use text, only: to_text
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use test_kinds, only: span_test_t, any_may_fail, test_words, is_length, test_gap, test_force, &
      & test_vanishing
   use closing_spans, only: about_to_close, close_spans
   use contact_change_types, only: step_interval_t, change_t, new_interval, change_none, change_missed, change_located, &
      & place_within, place_here, place_ahead
   use other_set, only: other_set_t, copy_other_set, on_next_mesh
   use span_events, only: find_change
   use minima_of_tests, only: check_between
   use simultaneous_tests, only: coming_next
   use span_candidates, only: present_contact_spans
   use beginning_place, only: on_other_obstacle
   use entering_contact_set, only: go_to_next
   use remeshing, only: request_finer_mesh
   use span_mesh, only: request_double_mesh
   use continuing_with_set, only: begin_located
   use vanished_length, only: find_vanished
   use contact_trials, only: try_sets
   use contact_ways, only: other_ways
   use step_control, only: too_short
   use tried_sets, only: change_place_t, tried_set_t, next_set_t, new_change_place
   use event_recording, only: new_critical, announce
   use critical_points, only: critical_point_t
   use path_point, only: path_point_t, evaluate_span_tests
   use path_state, only: path_state_t, path_tangent_of, difference_load, new_critical_point
   use settle_findings, only: arrival_t
   use path_acceptance, only: accept
   use corner_limit, only: check_return
   use trial_request, only: request_t
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_point, tolerance_at
   implicit none
   private
   public :: check_contact_change

   ! With half or twice each of these values none of 146 decks of the tests changes.
   integer, parameter :: most_doublings = 4 !! largest number of finer meshes tried to determine which contact changes first. Each
   !! has twice the elements of the mesh before it; error bars of the fourth order fall to 16^-4
   real(wp), parameter :: widest = 10.0_wp !! largest allowed ratio of the next change's error bar to that of the located change:
   !! tests that become zero within this many bars of the located change are examined

contains

   !> Checks whether the contact set is valid at the end of an increment. If not, the run moves to the place where the first test
   !> fails and continues with the next contact set (request%set_changed), or the request states what is required first: a shorter
   !> increment or another mesh.
   subroutine check_contact_change(problem, step, run, trial, stuck, tries, recorder, request, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(inout) :: trial !! out: with the tests of its contact spans
      logical, intent(in) :: stuck  !! true: no increment converges; the trial is the last point, and a change just ahead is sought
      integer, intent(in) :: tries               !! number of meshes made so far because of this increment's errors
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request  !! requirements of the trial; none: the contact set is valid at the trial
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(step_interval_t) :: interval
      type(change_t) :: change
      type(span_test_t), allocatable :: closing(:)    ! tests of free spans that close
      logical :: asked
      finished = .false.
      call request%begin_trial()
      call evaluate_span_tests(problem, trial)
      interval = new_interval(problem, run, trial, stuck)
      call find_change(problem, step, run, interval, change)
      if (change%kind == change_missed) then
         call request%locate_nearer(step, run%control, interval%after(change%which))
         return
      end if
      call check_inside(problem, step, run, interval, change, request)
      if (request%shorter) return
      if (change%kind == change_located) then
         call pass_change(problem, step, run, interval, tries, change, recorder, request, finished, outcome)
      else
         if (any_may_fail(trial%span_tests)) then
            ! A test is satisfied by less than its error: the mesh does not show whether it fails.
            call request_resolving_mesh(problem, run, tries, request, asked)
            if (asked) return
         end if
         closing = about_to_close(problem, interval, .false.)
         if (size(closing) > 0) call close_spans(problem, step, run, interval%to, interval, closing, recorder, request, &
            & finished, outcome)
      end if
      if (.not. request%set_changed) return
      run%since_change%at = run%arc_length
      if (.not. (finished .or. allocated(outcome%why) .or. allocated(request%no_set))) &
         & call check_return(problem, step, run, outcome)
   end subroutine check_contact_change

   !> Looks for a test that fails inside the increment: before the located change or, if there is none, before the end. The slopes
   !> of the tests at both ends show it (minima_of_tests).
   subroutine check_inside(problem, step, run, interval, change, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(request_t), intent(inout) :: request
      type(step_interval_t) :: before
      if (interval%stuck) return
      if (change%kind == change_located .and. change%where == place_within) then
         before = interval
         before%to = change%point
         before%after = change%tests
         call check_between(problem, step, run, before, change%which, request%shorter)
      else if (change%kind == change_none) then
         call check_between(problem, step, run, interval, 0, request%shorter)
      end if
   end subroutine check_inside

   !> Passes a located change: trials find the next contact set at its place, and the path continues with this set.
   subroutine pass_change(problem, step, run, interval, tries, change, recorder, request, finished, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: tries
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(change_place_t) :: here
      type(span_test_t), allocatable :: closing(:)    ! tests of free spans that close
      type(next_set_t) :: next
      type(other_set_t) :: without                    ! the set without a length that vanishes, at the exact place of the change
      type(tried_set_t), allocatable :: way(:)        ! other sets with which the path may go on
      type(state_t), allocatable :: beyond            ! equilibrium of the present set beyond the change; not allocated: none
      logical :: vanishes, asked
      finished = .false.
      if (change%too_coarse) then
         call request_resolving_mesh(problem, run, tries, request, asked)
         if (asked) return
      end if
      change%label = label_of(problem, change%tests(change%which))
      if (change%label == '  ') then
         ! Where a free span vanishes, other tests may fail only for this reason; the set without the span is therefore tried first.
         closing = [pack(change%zero, change%zero%kind == test_vanishing), about_to_close(problem, interval, .true.)]
         if (size(closing) > 0) call close_spans(problem, step, run, change%point, interval, closing, recorder, request, &
            & finished, outcome)
         if (request%set_changed .or. request%shorter) return
      end if
      if (.not. (interval%stuck .or. change%where == place_ahead)) beyond = interval%to%state
      here = new_change_place(problem, step, run, change%point, change%zero, beyond)
      call try_sets(step, run, here, next)
      ! A set may be found from the end of a shorter increment.
      if (.not. next%found .and. next%too_far .and. .not. too_short(step, run%control, 0.5_wp)) then
         request%shorter = .true.
         return
      end if
      if (next%found) then
         change%label = next%first%label
         change%divides = next%first%divides
      end if
      vanishes = is_length(change%tests(change%which)%kind) .and. change%label /= '  '
      if (vanishes) call find_vanished(problem, change%point%state, change%tests(change%which), difference_load(run), &
         & step%locate_tolerance, without, vanishes)
      if (next%found .and. next%first%test > 0) then
         ! The set begins at a corner of the path: its tangent there is turned back to the side from which the path arrives.
         vanishes = .true.
         call copy_other_set(next%first, without)
         if ((without%state%load_factor - change%point%state%load_factor) * without%tangent%load < 0.0_wp) then
            without%tangent%u = -without%tangent%u
            without%tangent%load = -without%tangent%load
         end if
      end if
      if (vanishes) then
         without%label = change%label
         without%divides = change%divides
         change%label = '  '
         call request_mesh_at_onset(problem, step, run, without, tries, outcome, request)
         if (request%repeats_increment()) return
      end if
      ! The other ways are sought at the change itself, without the equilibrium beyond it.
      if (allocated(here%beyond)) deallocate (here%beyond)
      if (next%found) call other_ways(step, run, here, next%first, way)
      call record_change(problem, step, run, interval, tries, change, recorder, request, finished, outcome)
      if (.not. request%set_changed .or. finished .or. allocated(outcome%why)) return
      if (next%found) call keep_other_ways(problem, run, change, way, recorder, outcome)
      if (allocated(outcome%why)) return
      if (vanishes) then
         call go_to_next(problem, step, run, without, recorder, finished, outcome)
         if (finished .or. allocated(outcome%why)) return
      end if
      if (next%found) then
         call begin_located(problem, step, run, change%tests(change%which), next, recorder, request, finished, outcome)
      else
         request%no_set = no_set_at(problem, change)
      end if
   end subroutine pass_change

   !> If the path has several ways on behind a contact change, reports the change as a bifurcation, too, and keeps it for branches.
   subroutine keep_other_ways(problem, run, change, way, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run   !! at the change, which is recorded
      type(change_t), intent(in) :: change
      type(tried_set_t), intent(in) :: way(:)    !! valid sets of the other ways
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(critical_point_t) :: kept
      integer :: k
      if (size(way) == 0) return
      kept = new_critical_point(problem, run, 'BP', change%point%state, change%point%system%negative_pivots)
      kept%multiplicity = size(way)
      if (allocated(change%bars)) kept%bars = change%bars
      allocate (kept%way(size(way)))
      do k = 1, size(way)
         call copy_problem(way(k)%set%problem, kept%way(k)%problem)
         kept%way(k)%state = way(k)%there%state
         kept%way(k)%tangent = way(k)%there%tangent
      end do
      call run%critical_points%keep(kept)
      call announce(problem, run, new_critical('BP', 'bifurcation, '//to_text(size(way) + 1)// &
         & ' ways on: several contacts change at once', change%bars), change%point, .true., recorder, outcome)
   end subroutine keep_other_ways

   !> Requests a finer mesh if the error of the load at which a length vanishes exceeds the tolerance.
   subroutine request_mesh_at_onset(problem, step, run, without, tries, outcome, request)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(other_set_t), intent(in) :: without        !! the set without the length that vanishes, at its onset
      integer, intent(in) :: tries
      type(outcome_t), intent(in) :: outcome
      type(request_t), intent(inout) :: request
      type(path_state_t) :: on
      type(error_bars_t), allocatable :: bars
      type(path_point_t) :: there
      on = on_next_mesh(problem, run, without)
      there = without%path_point_t
      there%tangent = path_tangent_of(without%problem, on, there)
      call bars_at_point(without%problem, step, on, there, without%label, .false., without%test, bars)
      call request_finer_mesh(without%problem, step, run, without%state, without%system%force_scale, bars, .true., tries, &
         & outcome, request)
   end subroutine request_mesh_at_onset

   !> Label of a change (C+, C-) if the kind of its test determines the label; else empty.
   pure character(2) function label_of(problem, test) result(label)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test      !! the test that is zero
      label = '  '
      if (test%kind == test_gap) label = 'C+'
      if (test%kind == test_force) label = merge('  ', 'C-', problem%contact_span(max(test%contact_span, 1))%line)
   end function label_of

   !> Reason of a stop at a change for which no contact set is found.
   function no_set_at(problem, change) result(why)
      type(problem_t), intent(in) :: problem
      type(change_t), intent(in) :: change
      character(:), allocatable :: why
      associate (test => change%zero(1))
         why = trim(test_words(test%kind))
         if (test%kind /= test_gap) return
         if (on_other_obstacle(present_contact_spans(problem, change%point%state), test)) why = 'no contact set leads on from '// &
            & 'where the rod lies on one obstacle and meets '// &
            & trim(problem%model%obstacle(problem%model%contact(test%contact)%obstacle)%name)//', which may hold it fast'
      end associate
   end function no_set_at

   !> Moves the run to the place of a change and records it, unless another event comes first.
   subroutine record_change(problem, step, run, interval, tries, change, recorder, request, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: tries               !! number of meshes made so far because of this increment's errors
      type(change_t), intent(inout) :: change
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request  !! set_changed: the change is recorded
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(arrival_t) :: arrival
      real(wp) :: increment
      logical :: asked
      finished = .false.
      increment = run%control%increment
      ! Under load control the increment is extended to a change beyond its end, because events are located by fractions of the
      ! increment.
      if (change%where == place_ahead .and. run%control%method == method_load) &
         & run%control%increment = change%point%state%load_factor - run%last%state%load_factor
      if (.not. allocated(change%bars)) then
         if (change%where == place_here) then
            call bars_at_point(problem, step, run, change%point, change%label, .false., change%which, change%bars, &
               & ahead=interval%to%state)
         else
            call bars_at_point(problem, step, run, change%point, change%label, .false., change%which, change%bars)
         end if
      end if
      if (change%label /= '  ' .and. order_is_uncertain(problem, step, run, interval, change)) then
         call request_resolving_mesh(problem, run, tries, request, asked)
         run%control%increment = increment
         if (asked) return
      end if
      ! The run's point is recorded already. A second change at this point needs no other record if it has no label.
      if (.not. (change%where == place_here .and. change%label == '  ')) then
         arrival%report = change%report
         arrival%can_cut = .not. interval%stuck
         arrival%tries = tries
         arrival%label = change%label
         arrival%divides = change%divides
         arrival%changes = .true.
         if (allocated(change%bars)) arrival%bars = change%bars
         if (allocated(change%since) .and. change%label /= '  ') then
            arrival%since = change%since
            arrival%bracketed = abs(change%since - change%point%state%load_factor) > max(step%locate_tolerance, &
               & tolerance_at(problem, step, change%label)) * abs(change%point%state%load_factor)
         end if
         call accept(problem, step, run, change%point, arrival, recorder, request, finished, outcome)
      end if
      run%control%increment = increment
      if (allocated(run%onset%region)) deallocate (run%onset%region)
      run%onset%element = 0
      if (request%repeats_increment()) return
      request%set_changed = .not. request%shorter
      if (request%set_changed) return
      request%shorter = .false.
      if (change%where == place_ahead) then
         if (.not. interval%stuck) call check_between(problem, step, run, interval, 0, request%shorter)
      else
         ! An earlier event is located more reliably on a shorter increment.
         call request%locate_nearer(step, run%control, interval%after(change%which))
      end if
   end subroutine record_change

   !> Requests a mesh twice as fine, on which tests may be decided that the present mesh leaves open.
   subroutine request_resolving_mesh(problem, run, tries, request, asked)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      integer, intent(in) :: tries               !! number of meshes made so far because of this increment's errors
      type(request_t), intent(inout) :: request
      logical, intent(out) :: asked              !! false: no such mesh is allowed
      asked = tries < most_doublings
      if (asked) call request_double_mesh(problem, run%last%state, request, asked)
   end subroutine request_resolving_mesh

   !> True if the order of two changes is uncertain: their distance is less than the sum of their error bars.
   logical function order_is_uncertain(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(in) :: change
      type(error_bars_t), allocatable :: bars
      real(wp) :: fall(size(change%tests)), way
      integer, allocatable :: next(:)
      integer :: k
      order_is_uncertain = .false.
      if (.not. allocated(change%bars) .or. change%which == 0) return
      way = abs(interval%to%state%load_factor - interval%from%load_factor)
      if (.not. (change%bars%load%estimated .and. change%bars%load%bounded .and. way > 0.0_wp)) return
      fall = interval%before%value - interval%after%value
      next = coming_next(change%tests, change%which, fall, widest * change%bars%load%bar / way)
      do k = 1, size(next)
         call bars_at_point(problem, step, run, change%point, 'C+', .false., next(k), bars)
         if (.not. allocated(bars)) return
         if (.not. (bars%load%estimated .and. bars%load%bounded)) cycle
         order_is_uncertain = change%tests(next(k))%value * way <= (change%bars%load%bar + bars%load%bar) * fall(next(k))
         if (order_is_uncertain) return
      end do
   end function order_is_uncertain
end module span_changes
