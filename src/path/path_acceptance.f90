!> What happens when an increment has converged: events up to the new point are located and recorded, then the point, and
!> the run goes there.
module path_acceptance
   use kinds, only: wp
   use errors, only: error_t
   use text, only: to_text
   use model, only: step_t
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use tangent_modes, only: modes_t, lowest_modes, choose_null_vectors, nodal_mode
   use weak_contacts, only: release_weak, count_released, opening_sense
   use path_control, only: path_length
   use corrector, only: increment_t
   use path_run, only: run_t, probe_at, keep_landmark
   use step_control, only: stop_met
   use path_events, only: probe_t, event_t, new_probe, detect_events, event_stop, event_bifurcation, event_release, event_limit, &
      & event_contact, event_value_reached, event_turning
   use event_location, only: locate
   use contact_set, only: reaction_rate
   use sliding_nodes, only: rehome_nodes
   use point_report, only: report_point
   use balance, only: measure_balance
   use path_record, only: recorder_t, point_t, critical_t, accuracy_t
   use timing, only: timers_t, count_up, counter_points, counter_located
   implicit none
   private
   public :: accept, record, note_trouble, outcome_t

   !> How a run ended.
   type :: outcome_t
      logical :: complete = .false.
      character(:), allocatable :: why           !! the run cannot go on: the reason, one sentence
      integer :: deck_line = 0                   !! and the deck is at fault: the line of the card; 0: it is not
      character(:), allocatable :: trouble       !! what could not be done beside the path of the steps: branches, limit curves
      type(accuracy_t) :: accuracy
   end type outcome_t

   integer, parameter :: most_null_vectors = 4
   real(wp), parameter :: loosest = 1.0e-4_wp    !! eigenvalues below this part of what they were count as zero
   real(wp), parameter :: same_place = 1.0e-5_wp !! of an increment: located events nearer than that are one

contains

   !> Looks for events up to a converged trial point, records them and the point, and goes there.
   subroutine accept(problem, step, run, trial, label, report, recorder, finished, outcome, timers, hidden)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(inout) :: trial
      character(2), intent(in) :: label          !! C+ or C- when the point is known to be one
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      logical, intent(inout), optional :: hidden !! true on entry: look whether more happened than the ends tell; then nothing is
      !! recorded, and it stays true
      type(event_t), allocatable :: events(:), missed(:)
      type(probe_t) :: probe
      type(critical_t) :: critical
      type(state_t), allocatable :: places(:)
      type(state_t) :: released
      type(increment_t), allocatable :: reports(:)
      real(wp), allocatable :: fraction(:)
      real(wp) :: rate, limit_at, branching_at, part
      logical, allocatable :: located(:), later(:)
      logical :: told, weak, weak_at_trial
      integer :: i, k, more, unseen, free_pivots

      finished = .false.
      allocate (missed(0))
      probe = probe_at(problem, run, trial)
      call count_released(problem, trial, run%system, free_pivots, weak_at_trial, timers)
      probe%free_pivots = free_pivots
      probe%weak = weak_at_trial
      if (run%step_points == 0) run%probe%load_rate = probe%load_rate
      if (run%step_points == 0) run%probe%monitor_rate = probe%monitor_rate
      call detect_events(problem, step, run%probe, probe, run%state, trial, events)
      allocate (places(size(events)), reports(size(events)), fraction(size(events)), located(size(events)), &
         & later(size(events)))
      do i = 1, size(events)
         call locate(problem, step, run, trial, events(i), places(i), reports(i), fraction(i), located(i), later(i), timers)
      end do
      if (present(hidden)) then
         hidden = hidden .and. (any_hidden() .or. out_of_reach() .or. passed_twice())
         if (hidden) return
      end if
      limit_at = huge(1.0_wp)
      do i = 1, size(events)
         if (events(i)%kind == event_limit .and. located(i)) limit_at = fraction(i)
      end do
      branching_at = huge(1.0_wp)
      more = 0
      unseen = 0
      do while (any(fraction <= 1.0_wp))
         k = minloc(fraction, 1)
         if (fraction(k) > 1.0_wp) exit
         critical = new_critical(events(k)%label, events(k)%note)
         if (events(k)%kind == event_bifurcation) then
            ! A jump of the pivot count where the contact set changes is no bifurcation, nor is the limit point's own change
            ! of sign, and a multiple bifurcation is one.
            told = later(k)
            if (told) then
               unseen = unseen + nint(sign(1.0_wp, events(k)%before))
            else if (run%on_bifurcation .and. fraction(k) <= same_place) then
               told = .true.
            else if (more > 0 .and. abs(fraction(k) - branching_at) <= same_place) then
               more = more - 1
               told = .true.
            else if (abs(fraction(k) - limit_at) <= same_place) then
               limit_at = huge(1.0_wp)
               told = .true.
            else if (.not. located(k)) then
               ! Nor does a count mean anything where a sliding contact ends, its reaction zero.
               told = label /= '' .or. any(run%state%active .neqv. trial%active) .or. any(events%kind == event_contact)
            end if
            if (located(k)) branching_at = fraction(k)
            if (told) fraction(k) = huge(1.0_wp)
            if (told) cycle
         end if
         part = fraction(k)
         fraction(k) = huge(1.0_wp)
         if (.not. located(k) .and. events(k)%kind /= event_stop) then
            missed = [missed, events(k)]
            cycle
         end if
         call linearise(problem, places(k), places(k), run%system, timers)
         call record(problem, run, places(k), events(k)%label, reports(k), recorder, outcome, timers)
         if (allocated(outcome%why)) return
         call count_up(timers, counter_located)
         probe = new_probe(problem, places(k), run%system, 0.0_wp)
         if (events(k)%kind == event_bifurcation) then
            call find_null_vectors(places(k), events(k), step, critical)
            more = size(critical%null_vector, 3) - 1
            call keep_landmark(run, 'BP', places(k), trial, branching_at, &
               & run%arc_length + path_length(problem, run%state, places(k)), more + 1)
         else if (events(k)%kind == event_release) then
            call release_weak(problem, places(k), run%system, released, weak)
            call linearise(problem, released, released, run%system, timers)
            call find_null_vectors(released, events(k), step, critical)
            critical%note = events(k)%note
            if (opening_sense(problem, places(k), released, critical%null_vector(:, :, 1)) == 0) &
               & critical%note = 'bifurcation without contacts that carry no force; none of its directions opens them all'
            call keep_landmark(run, 'BP', released, trial, part, &
               & run%arc_length + path_length(problem, run%state, places(k)), 1)
         else if (events(k)%kind == event_limit) then
            call keep_landmark(run, 'LP', places(k), trial, 0.0_wp, &
               & run%arc_length + path_length(problem, run%state, places(k)), 0)
         end if
         call announce(critical, places(k), probe, located(k))
         if (allocated(outcome%why)) return
         if (events(k)%kind == event_bifurcation .or. events(k)%kind == event_limit) then
            finished = is_home(places(k))
            if (finished) call announce(new_critical('EP', 'back on the path it left, at a bifurcation'), places(k), probe, .true.)
            if (finished) return
         end if
         if (events(k)%kind == event_stop) then
            if (.not. located(k)) call note_trouble(outcome, 'the end of a path was bracketed, but not located')
            finished = .true.
            run%state = places(k)
            run%probe = probe
            return
         end if
      end do
      if (size(events) > 0) call linearise(problem, trial, trial, run%system, timers)
      probe = probe_at(problem, run, trial)
      probe%free_pivots = free_pivots
      probe%weak = weak_at_trial
      finished = stop_met(step, run%probe, probe)
      call record(problem, run, trial, merge('EP', label, finished), report, recorder, outcome, timers)
      if (allocated(outcome%why)) return
      do i = 1, size(missed)
         call announce(new_critical(missed(i)%label, missed(i)%note), trial, probe, .false.)
         if (allocated(outcome%why)) return
         ! It counts, though nothing can start there.
         call keep_landmark(run, missed(i)%label, trial, trial, 1.0_wp, &
            & run%arc_length + path_length(problem, run%state, trial), 0)
      end do
      if (label == 'C+') call announce(new_critical(label, 'contact gained'), trial, probe, .true.)
      if (label == 'C-') call announce(new_critical(label, 'contact lost'), trial, probe, .true.)
      if (finished) call announce(new_critical('EP', 'end of the step'), trial, probe, .true.)
      if (allocated(outcome%why)) return
      run%step_points = run%step_points + 1
      run%last_length = path_length(problem, run%state, trial)
      run%last_load = trial%load_factor - run%state%load_factor
      run%direction = trial%u - run%state%u
      run%direction_load = trial%load_factor - run%state%load_factor
      do i = 1, size(events)
         ! A contact that was met on the way may turn the path; it goes on where the new reaction grows.
         if (events(i)%label /= 'C+') cycle
         rate = 0.0_wp
         do k = 1, size(trial%active)
            if (events(i)%marked(k) .and. trial%active(k)) rate = rate + reaction_rate(problem, run%system, k)
         end do
         run%direction = 0.0_wp
         if (abs(rate) > 0.0_wp) run%direction_load = sign(1.0_wp, rate)
      end do
      run%arc_length = run%arc_length + path_length(problem, run%state, trial)
      run%state = trial
      run%probe = probe
      run%probe%negative_pivots = probe%negative_pivots - unseen
      run%on_bifurcation = abs(branching_at - 1.0_wp) <= same_place
      if (label == '') call rehome_nodes(problem, run%control, run%direction, run%direction_load, run%state, run%system, &
         & timers)

   contains

      !> True when a point between has a pivot count that neither end has: eigenvalues went and came back. Where the contact
      !> set changes on the way, a point before that counts differently from the start.
      pure logical function any_hidden()
         integer :: j
         logical :: same_set
         any_hidden = .false.
         same_set = all(run%state%active .eqv. trial%active)
         do j = 1, size(events)
            if (.not. located(j) .or. all(events(j)%kind /= [event_value_reached, event_stop, event_turning])) cycle
            if (.not. same_set) then
               if (all(run%state%active .eqv. places(j)%active)) &
                  & any_hidden = any_hidden .or. events(j)%pivots /= run%probe%negative_pivots
               cycle
            end if
            any_hidden = any_hidden .or. events(j)%pivots < min(run%probe%negative_pivots, probe%negative_pivots) .or. &
               & events(j)%pivots > max(run%probe%negative_pivots, probe%negative_pivots)
         end do
      end function any_hidden

      !> True when the load passed a value that it is to stop at, or is asked for, on the way to a limit point and on the way back.
      pure logical function passed_twice()
         real(wp) :: top, near
         integer :: j
         passed_twice = .false.
         do j = 1, size(events)
            if (events(j)%kind /= event_limit .or. .not. located(j)) cycle
            top = places(j)%load_factor
            near = run%probe%load_factor
            if (abs(probe%load_factor - top) < abs(near - top)) near = probe%load_factor
            passed_twice = passed_twice .or. any(step%stop%monitor == 0 .and. (step%stop%value - near) * &
               & (step%stop%value - top) < 0.0_wp) .or. any(step%locate%monitor == 0 .and. &
               & (step%locate%value - near) * (step%locate%value - top) < 0.0_wp)
         end do
      end function passed_twice

      !> True when a contact event was not located and contact points slide: the nodes that its search holds reach only so far.
      pure logical function out_of_reach()
         out_of_reach = any(problem%candidates%may_slide) .and. any(events%kind == event_contact .and. .not. located)
      end function out_of_reach

      !> True for a branch at a bifurcation of the path that it left: beyond, it is that path, or itself again.
      logical function is_home(place)
         type(state_t), intent(in) :: place
         real(wp), parameter :: near = 1.0e-4_wp   ! of the branch's length
         real(wp) :: travelled
         integer :: j
         is_home = .false.
         if (.not. allocated(run%home)) return
         travelled = run%arc_length - run%left_at + path_length(problem, run%state, place)
         do j = 1, size(run%home)
            is_home = is_home .or. path_length(problem, run%home(j)%state, place) <= near * travelled
         end do
      end function is_home

      !> Reports the point recorded last as a critical one.
      subroutine announce(point, state, values, exact)
         type(critical_t), intent(in) :: point      !! label, note and null vectors
         type(state_t), intent(in) :: state
         type(probe_t), intent(in) :: values
         logical, intent(in) :: exact
         type(critical_t) :: full
         full = point
         full%step = problem%step
         full%point = run%points
         full%load_factor = state%load_factor
         full%located = exact
         full%monitor = values%monitor
         call hand_over(recorder, full, outcome, timers)
      end subroutine announce

      !> The modes whose eigenvalues vanish at a bifurcation, where the system is factored now.
      subroutine find_null_vectors(state, event, controls, point)
         type(state_t), intent(in) :: state
         type(event_t), intent(in) :: event
         type(step_t), intent(in) :: controls
         type(critical_t), intent(inout) :: point   !! gets its null vectors and a note of their number
         type(modes_t) :: modes
         type(error_t), allocatable :: error
         integer :: n, j
         call lowest_modes(problem, state, run%system, most_null_vectors, modes, error, timers)
         n = max(count(abs(modes%mu) <= min(max(1.0e3_wp * controls%locate_tolerance, same_place), loosest) * event%scale), 1)
         call choose_null_vectors(problem, run%system, n, modes)
         allocate (point%null_vector(3, size(run%state%u, 2), n))
         do j = 1, n
            point%null_vector(:, :, j) = nodal_mode(problem, run%system, modes%x(:, j))
         end do
         point%note = 'bifurcation, simple'
         if (n == 2) point%note = 'bifurcation, double'
         if (n > 2) point%note = 'bifurcation, '//to_text(n)//'-fold'
      end subroutine find_null_vectors
   end subroutine accept

   !> A critical point with its words. (gfortran 12 loses the length of a deferred-length component in a constructor.)
   function new_critical(label, note) result(critical)
      character(*), intent(in) :: label, note
      type(critical_t) :: critical
      critical%label = label
      critical%note = note
   end function new_critical

   !> Hands a converged point to the recorder and to the independent measures.
   subroutine record(problem, run, state, label, report, recorder, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: state
      character(*), intent(in) :: label
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(point_t) :: point
      type(error_t), allocatable :: error
      logical :: weak
      point = report_point(problem, state, run%system, run%points, label)
      point%iterations = report%iterations
      point%residual = max(report%residual, run%system%force_residual)
      point%lcp_size = report%lcp_size
      point%lcp_pivots = report%lcp_pivots
      point%arc_length = run%arc_length + path_length(problem, run%state, state)
      call count_released(problem, state, run%system, point%free_pivots, weak, timers)
      ! At the stress-free start there is no force to measure a residual against.
      if (report%iterations == 0 .and. run%system%force_scale <= max(problem%force_floor, &
         & problem%ground%stiffest * rounding_gap(problem))) point%residual = 0.0_wp
      call measure_balance(problem, state, point%residual, outcome%accuracy)
      run%points = run%points + 1
      call count_up(timers, counter_points)
      call recorder%point(point, timers, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine record

   !> Adds something that could not be done, while the run goes on.
   subroutine note_trouble(outcome, what)
      type(outcome_t), intent(inout) :: outcome
      character(*), intent(in) :: what
      if (allocated(outcome%trouble)) then
         outcome%trouble = outcome%trouble//'; '//what
      else
         outcome%trouble = what
      end if
   end subroutine note_trouble

   !> Hands over a critical point.
   subroutine hand_over(recorder, critical, outcome, timers)
      class(recorder_t), intent(inout) :: recorder
      type(critical_t), intent(in) :: critical
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(error_t), allocatable :: error
      call recorder%critical(critical, timers, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine hand_over
end module path_acceptance
