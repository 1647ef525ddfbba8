!> Records located events: the point, the message, and the data from which branches and limit curves start.
module event_recording
   use kinds, only: wp
   use errors, only: error_t
   use text, only: to_text
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t, candidate_opening
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise, all_to_global
   use located_zero, only: as_zero
   use tangent_modes, only: modes_t, null_vectors, choose_null_vectors, deck_mode
   use force_free_contact, only: remove_force_free_lines, free_rotations, line_opening
   use path_control, only: path_length, displacement_between
   use state_transfer, only: carried_field
   use path_point, only: path_point_t
   use path_state, only: path_state_t, new_critical_point, append_recent_part, located_event_t
   use critical_points, only: critical_point_t
   use known_path, only: is_known_bifurcation, check_closure
   use contact_labels, only: contact_gained
   use path_events, only: event_t, event_stop, event_bifurcation, event_release, event_limit
   use event_search, only: same_place
   use path_outcome, only: outcome_t
   use point_recording, only: record
   use error_bar, only: error_bars_t
   use error_report, only: note_error, tolerance_at
   use mesh_request, only: motion_sizes
   use remeshing, only: sizes_there
   use path_record, only: recorder_t, critical_t, place_t
   use timing, only: count_up, counter_located
   implicit none
   private
   public :: record_event, announce, new_critical, go_to

   character(*), parameter :: imperfect = ', but for an imperfection too small to tell here'

contains

   !> Records a located event. If the event ends the step, the last point of the run becomes the event.
   subroutine record_event(problem, step, run, trial, located_event, pivots, recorder, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(in) :: located_event
      integer, intent(in) :: pivots              !! number of negative pivots before the event
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished           !! true: the step ends at this event
      type(outcome_t), intent(inout) :: outcome
      type(critical_t) :: critical
      integer :: before
      logical :: smooth
      finished = .false.
      associate (event => located_event%event, point => located_event%point)
         smooth = any(event%kind == [event_bifurcation, event_limit])
         if (run%branch == 0 .and. smooth) outcome%home = is_known_bifurcation(problem, run, point%state)
         if (outcome%home) outcome%why = 'the path comes back to a bifurcation of its own at load factor '// &
            & to_text(point%state%load_factor)//': beyond lies what it has passed'
         if (event%kind == event_limit .and. .not. outcome%home) call check_closure(problem, run, point%state, event%label, outcome)
         if (outcome%home) return
         critical = new_critical(event%label, event%note, located_event%bars)
         ! At a corner, the tangents before and after the event have different counts of negative pivots: the count before the event
         ! is recorded.
         before = merge(pivots, point%system%negative_pivots, smooth)
         call record(problem, run, point, event%label, located_event%report, recorder, outcome, first_touch(problem, event, &
            & point%state), located_event%bars, smooth=.not. event%corner, pivots=before)
         if (allocated(outcome%why)) return
         call count_up(counter_located)
         call keep_start()
         call announce(problem, run, critical, point, .true., recorder, outcome)
         if (allocated(outcome%why)) return
         if (smooth) then
            if (is_known_bifurcation(problem, run, point%state)) then
               finished = .true.
               critical = new_critical('EP', 'back on the path it left, at a bifurcation', located_event%bars)
            else if (event%meets .and. run%branch > 0) then
               finished = .true.
               critical = new_critical('EP', 'at a bifurcation, behind which the branch has its other half', located_event%bars)
            end if
            if (finished) call announce(problem, run, critical, point, .true., recorder, outcome)
         else if (event%kind == event_stop) then
            finished = .true.
            call go_to(problem, run, point)
         end if
      end associate

   contains

      !> Stores a critical point with its null vectors, from which branches and limit curves start, and completes its message.
      subroutine keep_start()
         type(modes_t) :: modes
         type(problem_t) :: free
         type(state_t) :: released
         type(system_t) :: other
         type(critical_point_t) :: kept
         real(wp) :: sense
         integer :: opens
         logical :: weak
         associate (event => located_event%event, place => located_event%point%state, system => located_event%point%system)
            if (.not. any(event%kind == [event_bifurcation, event_release, event_limit])) return
            kept = new_critical_point(problem, run, event%label, place, pivots)
            if (event%kind /= event_limit) kept%drift = kept%direction - located_event%fraction * &
               & displacement_between(problem, run%last%state, trial%state)
            select case (event%kind)
            case (event_bifurcation)
               call find_null_vectors(problem, step, system, place, event, critical, modes)
               if (allocated(located_event%bars)) then
                  if (located_event%bars%unfolding > 0.0_wp) critical%note = critical%note//imperfect
               end if
               kept%multiplicity = size(critical%null_vector, 3)
               kept%scale = event%scale
               if (allocated(located_event%bars)) kept%bars = located_event%bars
            case (event_release)
               call remove_force_free_lines(problem, place, system, free, released, weak)
               other = new_system(free)
               call linearise(free, released, released, other)
               call find_null_vectors(free, step, other, released, event, critical, modes)
               critical%note = event%note
               opens = line_opening(problem, place, free, released, all_to_global(free, other, modes%x(:, 1)))
               if (opens == 0) &
                  & critical%note = 'bifurcation without contacts that carry no force; none of its directions opens them all'
               call free_rotations(free)
               call deck_mode(free, released, other, modes%x(:, 1), critical%null_vector(:, :, 1), sense)
               kept%multiplicity = 1
               kept%opens = nint(opens * sense)
               ! A branch starts without the force-free contacts, so its start is stored on the problem without them.
               kept%direction = carried_field(problem, place, kept%direction, free, released)
               kept%drift = carried_field(problem, place, kept%drift, free, released)
               call copy_problem(free, kept%problem)
               kept%state = released
            case (event_limit)
               kept%corner = event%corner
            end select
            call run%critical_points%keep(kept)
         end associate
      end subroutine keep_start
   end subroutine record_event

   !> Makes a given point the last point of the run.
   subroutine go_to(problem, run, point)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: point
      call append_recent_part(problem, run, point)
      run%last_length = path_length(problem, run%last%state, point%state)
      run%arc_length = run%arc_length + run%last_length
      run%last = point
      run%motion = max(run%motion, motion_sizes(problem, point%state%u))
      run%fresh = .false.
      run%since_change%shrunk = .false.
      run%arrived%point = 0
   end subroutine go_to

   !> (candidates) true: contact at this node begins at the event. Only the candidate with the smallest gap is marked, because it is
   !> the first to carry force; no candidate is marked at other events.
   function first_touch(problem, event, place) result(touching)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: place
      logical :: touching(problem%candidates%n)
      real(wp) :: opening, least
      integer :: c, nearest
      touching = .false.
      if (event%label /= contact_gained .or. event%ground%contact > 0) return
      if (any(event%marked .and. place%active)) return
      nearest = 0
      least = huge(least)
      do c = 1, problem%candidates%n
         if (.not. event%marked(c)) cycle
         opening = candidate_opening(problem, place, c)
         if (opening >= least) cycle
         least = opening
         nearest = c
      end do
      if (nearest > 0) touching(nearest) = .true.
   end function first_touch

   !> Reports a critical point: the point recorded last, or the point in a given row of the results.
   subroutine announce(problem, run, critical, point, exact, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(critical_t), intent(in) :: critical !! label, note and null vectors of the critical point, and its row in the results
      !! (`point`); 0: the row recorded last
      type(path_point_t), intent(in) :: point
      logical, intent(in) :: exact               !! true: the point was located; false: only bracketed
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(critical_t) :: full
      type(place_t) :: at
      type(error_t), allocatable :: error
      full = critical
      full%step = problem%step
      if (full%point == 0) full%point = run%points
      full%load_factor = point%state%load_factor
      full%located = exact
      full%monitor = point%test_values%monitor
      if (allocated(full%bars)) then
         at = place_t(run%branch, problem%step, full%point, full%load_factor)
         associate (step => problem%model%step(problem%step))
            call note_error(problem, step, full%bars, sizes_there(problem, step, run, point%state, point%system%force_scale, &
               & tolerance_at(problem, step, full%label), outcome), full%label, at, outcome%accuracy)
         end associate
      end if
      call recorder%take(full, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine announce

   !> Finds the null vectors of a bifurcation, that is, the modes of the tangent with vanishing eigenvalues, on the mesh and at the
   !> deck's nodes.
   subroutine find_null_vectors(problem, step, system, state, event, point, modes)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(system_t), intent(in) :: system       !! factored at `state`
      type(state_t), intent(in) :: state
      type(event_t), intent(in) :: event
      type(critical_t), intent(inout) :: point !! out: has the null vectors at the deck's nodes, and a note that states their count
      type(modes_t), intent(out) :: modes        !! the first modes are the null vectors on the mesh
      type(error_t), allocatable :: error
      real(wp) :: sense
      integer :: n, j
      call null_vectors(problem, state, system, min(max(1.0e3_wp * step%locate_tolerance, same_place), as_zero) * event%scale, &
         & modes, n, error)
      n = max(n, 1)
      call choose_null_vectors(problem, state, system, n, modes)
      allocate (point%null_vector(3, problem%deck%mesh%n_nodes, n))
      do j = 1, n
         call deck_mode(problem, state, system, modes%x(:, j), point%null_vector(:, :, j), sense)
      end do
      point%note = 'bifurcation, simple'
      if (n == 2) point%note = 'bifurcation, double'
      if (n > 2) point%note = 'bifurcation, '//to_text(n)//'-fold'
   end subroutine find_null_vectors

   !> Critical point with label and note. (gfortran 12 loses the length of a deferred-length component in a structure constructor.)
   function new_critical(label, note, bars) result(critical)
      character(*), intent(in) :: label, note !! label (LP, BP, ...) and remark in words
      type(error_bars_t), intent(in), optional :: bars
      type(critical_t) :: critical
      critical%label = label
      critical%note = note
      if (present(bars)) critical%bars = bars
   end function new_critical
end module event_recording
