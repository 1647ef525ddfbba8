!> The run: step by step, point by point. Predict, correct, look for events, locate them, record, adapt.
module path_loop
   use kinds, only: wp
   use errors, only: error_t
   use model, only: step_t, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t, new_state
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use support_check, only: unheld_part
   use path_control, only: is_arc_length, set_tangent, path_length
   use corrector, only: increment_t, take_increment
   use path_run, only: run_t, probe_at
   use first_contact, only: presume_contact
   use step_control, only: start_control, begin_arc_length, next_increment, smallest, shorten_to_stop, &
      & shorten_to_reach, stop_met
   use path_events, only: probe_t, event_t, new_probe, detect_events, event_stop, event_bifurcation
   use event_location, only: locate
   use contact_set, only: reaction_rate
   use contact_corner, only: corner_t, contact_begins, find_corner, leave_corner
   use contact_regions, only: find_regions
   use sliding_nodes, only: rehome_nodes
   use point_report, only: report_point
   use balance, only: measure_balance
   use path_record, only: recorder_t, point_t, critical_t, accuracy_t
   use timing, only: timers_t, timing_start, timing_stop, count_up, phase_path, counter_points, counter_rejected, &
      & counter_cut, counter_located
   implicit none
   private
   public :: follow_path, outcome_t

   !> How a run ended.
   type :: outcome_t
      logical :: complete = .false.
      character(:), allocatable :: why           !! not complete: the reason, one sentence
      type(accuracy_t) :: accuracy
   end type outcome_t

   integer, parameter :: max_cuts = 40          !! halvings of one increment
   integer, parameter :: cuts_before_corner = 2 !! failures after which the path may have a corner

contains

   !> Follows all steps of the deck. Returns when the last step is complete or nothing helps any more.
   subroutine follow_path(problem, recorder, outcome, timers)
      type(problem_t), intent(inout) :: problem
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(out) :: outcome
      type(timers_t), intent(inout) :: timers
      type(run_t) :: run
      type(increment_t) :: nothing
      integer :: k
      call timing_start(timers, phase_path)
      run%state = new_state(problem)
      run%system = new_system(problem)
      steps: do k = 1, size(problem%model%step)
         problem%step = k
         call begin_step(problem, run, outcome, timers)
         if (allocated(outcome%why)) exit steps
         if (k == 1) call record(problem, run, run%state, '', nothing, recorder, outcome, timers)
         if (allocated(outcome%why)) exit steps
         call follow_step(problem, problem%model%step(k), run, recorder, outcome, timers)
         if (allocated(outcome%why)) exit steps
         call freeze_loads(problem, run%state)
      end do steps
      outcome%complete = .not. allocated(outcome%why)
      call timing_stop(timers, phase_path)
   end subroutine follow_path

   !> Linearises at the start of a step and checks that something holds the structure.
   subroutine begin_step(problem, run, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      character(*), parameter :: unheld = 'supports and touching obstacles do not hold the structure'
      character(:), allocatable :: part
      run%step_points = 0
      if (problem%step == 1) then
         part = unheld_part(problem, run%state)
         if (part /= '') then
            outcome%why = part//': '//unheld
            return
         end if
      end if
      call linearise(problem, run%state, run%state, run%system, timers)
      if (.not. run%system%ok) then
         outcome%why = 'the tangent at the start is singular: '//unheld
         return
      end if
      if (problem%step == 1 .and. run%system%negative_pivots > 0) then
         outcome%why = 'the stress-free start is not stable: '//unheld
         return
      end if
      associate (step => problem%model%step(problem%step))
         if (problem%step == 1 .and. step%method == method_displacement) &
            & call presume_contact(problem, step%monitor, step%increment, run%state, run%system, timers)
      end associate
      run%probe = new_probe(problem, run%state, run%system, 0.0_wp)
   end subroutine begin_step

   !> One *STEP from its first increment to its stop condition.
   subroutine follow_step(problem, step, run, recorder, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(state_t) :: trial
      type(increment_t) :: report
      logical :: finished, scaled, limited, turned
      integer :: cuts
      real(wp) :: full

      call start_control(problem, step, run)
      finished = .false.
      cuts = 0
      points: do
         if (run%step_points >= step%max_points) then
            if (size(step%stop) > 0) outcome%why = 'the allowed number of points was used up before the stop condition'
            return
         end if
         if (is_arc_length(run%control%method)) &
            & call set_tangent(problem, run%system, run%direction, run%direction_load, run%control)
         call shorten_to_stop(step, run)
         full = run%control%increment
         ! At the stress-free start no reaction marks where a contact ends.
         if (run%step_points > 0 .or. problem%step > 1) call shorten_to_reach(problem, run)
         limited = abs(run%control%increment) < abs(full)
         call take_increment(problem, run%state, run%control, trial, run%system, report, timers)
         if (.not. report%converged) then
            call count_up(timers, counter_rejected)
            cuts = cuts + 1
            run%control%increment = 0.5_wp * run%control%increment
            if (cuts > max_cuts .or. abs(run%control%increment) < smallest(step, run%control)) then
               outcome%why = 'no further point: '//report%message
               return
            end if
            call count_up(timers, counter_cut)
            call linearise(problem, run%state, run%state, run%system, timers)
            if (cuts < cuts_before_corner) cycle points
            call turn_corner(problem, step, run, recorder, turned, finished, outcome, timers)
            if (finished .or. allocated(outcome%why)) return
            cycle points
         end if
         cuts = 0
         if (contact_begins(problem, run%state, trial)) then
            call linearise(problem, run%state, run%state, run%system, timers)
            call turn_corner(problem, step, run, recorder, turned, finished, outcome, timers)
            if (finished .or. allocated(outcome%why)) return
            if (turned) cycle points
            call linearise(problem, trial, run%state, run%system, timers)
         end if
         call accept(problem, step, run, trial, '  ', report, recorder, finished, outcome, timers)
         if (finished .or. allocated(outcome%why)) return
         if (is_arc_length(step%method) .and. .not. is_arc_length(run%control%method)) then
            call begin_arc_length(step, run, scaled)
            if (.not. scaled) outcome%why = 'the first increment moved nothing: the arc length has no scale'
            if (.not. scaled) return
            cycle points
         end if
         if (limited) run%control%increment = full
         if (.not. limited) call next_increment(step, report%iterations, run%control)
      end do points
   end subroutine follow_step

   !> Tries whether the contact set changes at a corner just ahead; if so, goes there and around it.
   subroutine turn_corner(problem, step, run, recorder, turned, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the last point, on return too
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: turned             !! the path stands at the corner, with its new contact set
      logical, intent(out) :: finished           !! the step ended before
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(state_t) :: place, beyond
      type(corner_t) :: corner
      type(increment_t) :: report
      character(2) :: label
      integer :: regions
      finished = .false.
      turned = .false.
      if (problem%candidates%n == 0 .or. .not. is_arc_length(run%control%method)) return
      call find_corner(problem, run%state, run%control, place, corner, run%system, report, turned, timers)
      if (.not. turned) then
         call linearise(problem, run%state, run%state, run%system, timers)
         return
      end if
      beyond = place
      beyond%active(corner%candidate) = .not. place%active(corner%candidate)
      ! One node more or less at the end of a region is the mesh's affair, not an event.
      regions = size(find_regions(problem, beyond)) - size(find_regions(problem, place))
      label = ''
      if (regions > 0) label = 'C+'
      if (regions < 0) label = 'C-'
      call accept(problem, step, run, place, label, report, recorder, finished, outcome, timers)
      if (finished .or. allocated(outcome%why)) return
      call leave_corner(problem, run%control, corner, run%state, run%system, run%direction, run%direction_load, turned, timers)
      if (.not. turned) outcome%why = 'no way on from where the contact set changes'
      run%probe = new_probe(problem, run%state, run%system, run%direction_load)
   end subroutine turn_corner

   !> Looks for events up to a converged trial point, records them and the point, and goes there.
   subroutine accept(problem, step, run, trial, label, report, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(inout) :: trial
      character(2), intent(in) :: label          !! C+ or C- when the point is known to be one
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(event_t), allocatable :: events(:), missed(:)
      type(probe_t) :: probe
      type(state_t), allocatable :: places(:)
      type(increment_t), allocatable :: reports(:)
      real(wp), allocatable :: fraction(:)
      real(wp) :: rate
      logical, allocatable :: located(:)
      integer :: i, k

      finished = .false.
      allocate (missed(0))
      probe = probe_at(problem, run, trial)
      if (run%step_points == 0) run%probe%load_rate = probe%load_rate
      call detect_events(problem, step, run%probe, probe, run%state, trial, events)
      allocate (places(size(events)), reports(size(events)), fraction(size(events)), located(size(events)))
      do i = 1, size(events)
         call locate(problem, step, run, trial, events(i), places(i), reports(i), fraction(i), located(i), timers)
      end do
      do while (any(fraction <= 1.0_wp))
         i = minloc(fraction, 1)
         if (fraction(i) > 1.0_wp) exit
         k = i
         fraction(k) = huge(1.0_wp)
         ! A jump of the pivot count where the contact set changes is no bifurcation.
         if (.not. located(k) .and. events(k)%kind == event_bifurcation) cycle
         if (.not. located(k) .and. events(k)%kind /= event_stop) then
            missed = [missed, events(k)]
            cycle
         end if
         call linearise(problem, places(k), places(k), run%system, timers)
         call record(problem, run, places(k), events(k)%label, reports(k), recorder, outcome, timers)
         if (allocated(outcome%why)) return
         call count_up(timers, counter_located)
         probe = new_probe(problem, places(k), run%system, 0.0_wp)
         call announce(events(k)%label, events(k)%note, places(k), probe, located(k))
         if (allocated(outcome%why)) return
         if (events(k)%kind == event_stop) then
            finished = .true.
            run%state = places(k)
            run%probe = probe
            return
         end if
      end do
      if (size(events) > 0) call linearise(problem, trial, trial, run%system, timers)
      probe = probe_at(problem, run, trial)
      finished = stop_met(step, run%probe, probe)
      call record(problem, run, trial, merge('EP', label, finished), report, recorder, outcome, timers)
      if (allocated(outcome%why)) return
      do i = 1, size(missed)
         call announce(missed(i)%label, missed(i)%note, trial, probe, .false.)
         if (allocated(outcome%why)) return
      end do
      if (label == 'C+') call announce(label, 'contact gained', trial, probe, .true.)
      if (label == 'C-') call announce(label, 'contact lost', trial, probe, .true.)
      if (finished) call announce('EP', 'end of the step', trial, probe, .true.)
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
      if (label == '') call rehome_nodes(problem, run%control, run%direction, run%direction_load, run%state, run%system, &
         & timers)

   contains

      !> Reports the point recorded last as a critical one.
      subroutine announce(label, note, state, values, exact)
         character(*), intent(in) :: label, note
         type(state_t), intent(in) :: state
         type(probe_t), intent(in) :: values
         logical, intent(in) :: exact
         type(critical_t) :: critical
         critical%label = label
         critical%step = problem%step
         critical%point = run%points
         critical%load_factor = state%load_factor
         critical%located = exact
         critical%note = note
         critical%monitor = values%monitor
         call hand_over(recorder, critical, outcome, timers)
      end subroutine announce
   end subroutine accept

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
      point = report_point(problem, state, run%system, run%points, label)
      point%iterations = report%iterations
      point%residual = max(report%residual, run%system%force_residual)
      point%lcp_size = report%lcp_size
      point%lcp_pivots = report%lcp_pivots
      point%arc_length = run%arc_length + path_length(problem, run%state, state)
      ! At the stress-free start there is no force to measure a residual against.
      if (report%iterations == 0 .and. run%points == 0) point%residual = 0.0_wp
      call measure_balance(problem, state, point%residual, outcome%accuracy)
      run%points = run%points + 1
      call count_up(timers, counter_points)
      call recorder%point(point, timers, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine record

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

   !> The step's loads become constant; the load factor starts again from zero.
   subroutine freeze_loads(problem, state)
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      associate (load => problem%model%step(problem%step)%load, kept => problem%constant, factor => state%load_factor)
         kept%node_force = kept%node_force + factor * load%node_force
         kept%line_force = kept%line_force + factor * load%line_force
         kept%pressure = kept%pressure + factor * load%pressure
         kept%displacement = kept%displacement + factor * load%displacement
      end associate
      state%load_factor = 0.0_wp
   end subroutine freeze_loads
end module path_loop
