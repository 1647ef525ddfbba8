!> The run: step by step, point by point. Predict, correct, look for events, locate them, record, adapt.
module path_loop
   use kinds, only: wp
   use errors, only: error_t
   use model, only: step_t, method_load, method_displacement, method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t, new_state
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_control, only: control_t, is_arc_length, set_tangent, metric, path_length
   use corrector, only: increment_t, take_increment
   use path_events, only: probe_t, event_t, new_probe, detect_events, event_value, event_stop, event_value_reached, &
      & event_bifurcation
   use point_report, only: report_point
   use sliding_nodes, only: rehome_nodes
   use contact_corner, only: find_corner, leave_corner
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

   !> What one step of the run needs at hand; kept together so that procedures have short argument lists.
   type :: run_t
      type(state_t) :: state                     !! the last accepted point
      type(system_t) :: system
      type(control_t) :: control
      type(probe_t) :: probe
      real(wp) :: arc_length = 0.0_wp            !! travelled since the start of the run
      integer :: points = 0                      !! recorded so far, all steps
      integer :: step_points = 0                 !! accepted in this step
      real(wp), allocatable :: direction(:, :)   !! last increment of the displacements
      real(wp) :: direction_load = 0.0_wp        !! and of the load factor
   end type run_t

   integer, parameter :: max_cuts = 40          !! halvings of one increment
   integer, parameter :: cuts_before_corner = 3 !! failures after which the path may have a corner
   real(wp), parameter :: growth = 2.0_wp       !! largest ratio of consecutive increments

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
      run%step_points = 0
      call linearise(problem, run%state, run%state, run%system, timers)
      if (.not. run%system%ok) then
         outcome%why = 'the tangent at the start is singular: supports and touching obstacles do not hold the structure'
         return
      end if
      if (problem%step == 1 .and. run%system%negative_pivots > 0) then
         outcome%why = 'the stress-free start is not stable: supports and touching obstacles do not hold the structure'
         return
      end if
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
      logical :: finished
      integer :: cuts
      real(wp) :: ratio

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
         call shorten_to_stop(problem, step, run)
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
            if (cuts < cuts_before_corner .or. .not. is_arc_length(run%control%method)) cycle points
            call turn_corner(problem, run, recorder, outcome, timers)
            if (allocated(outcome%why)) return
            cycle points
         end if
         cuts = 0
         call accept(problem, step, run, trial, report, recorder, finished, outcome, timers)
         if (finished .or. allocated(outcome%why)) return
         if (is_arc_length(step%method) .and. .not. is_arc_length(run%control%method)) then
            call begin_arc_length(problem, step, run, outcome)
            if (allocated(outcome%why)) return
            cycle points
         end if
         ! Crisfield's rule: the increment follows the root of desired over needed iterations.
         ratio = sqrt(real(step%desired_iterations, wp) / max(report%iterations, 1))
         run%control%increment = run%control%increment * min(max(ratio, 0.25_wp), growth)
         if (abs(run%control%increment) > step%largest) &
            & run%control%increment = sign(step%largest, run%control%increment)
      end do points
   end subroutine follow_step

   !> First increment: load control, also for the arc-length methods, whose scale it sets.
   subroutine start_control(problem, step, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      run%control%method = merge(method_load, step%method, is_arc_length(step%method))
      run%control%monitor = step%monitor
      run%control%increment = step%increment
      run%direction = 0.0_wp * run%state%u
      run%direction_load = sign(1.0_wp, step%increment)
      if (step%method == method_displacement .and. .not. allocated(run%control%tangent)) &
         & allocate (run%control%tangent(3, problem%model%mesh%n_nodes), source=0.0_wp)
   end subroutine start_control

   !> Switches from the first, load-controlled increment to the arc length it made.
   subroutine begin_arc_length(problem, step, run, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(outcome_t), intent(inout) :: outcome
      real(wp) :: length
      length = sqrt(metric(problem, run%direction, run%direction))
      if (.not. length > 0.0_wp .or. .not. abs(run%direction_load) > 0.0_wp) then
         outcome%why = 'the first increment moved nothing: the arc length has no scale'
         return
      end if
      run%control%method = step%method
      run%control%load_scale = length / abs(run%direction_load)
      run%control%increment = length
      if (step%method /= method_cylindrical) run%control%increment = sqrt(2.0_wp) * length
      run%control%increment = min(run%control%increment, step%largest)
   end subroutine begin_arc_length

   !> Smallest increment worth trying.
   pure real(wp) function smallest(step, control)
      type(step_t), intent(in) :: step
      type(control_t), intent(in) :: control
      smallest = step%smallest
      ! The load-controlled start of an arc-length step has no limit of its own in the deck.
      if (is_arc_length(step%method) .and. .not. is_arc_length(control%method)) smallest = 1.0e-9_wp * abs(step%increment)
   end function smallest

   !> Load and displacement control end exactly on their stop value.
   subroutine shorten_to_stop(problem, step, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      real(wp) :: now, left
      integer :: i, watched
      if (is_arc_length(step%method)) return
      watched = 0
      now = run%state%load_factor
      if (step%method == method_displacement) then
         watched = step%monitor
         now = run%probe%monitor(watched)
      end if
      do i = 1, size(step%stop)
         if (step%stop(i)%monitor /= watched) cycle
         left = step%stop(i)%value - now
         if (left * run%control%increment <= 0.0_wp) cycle
         ! A last crumb shorter than half an increment is taken along.
         if (abs(run%control%increment) >= abs(left)) run%control%increment = left * (1.0_wp + 4.0_wp * epsilon(left))
      end do
      if (watched > size(problem%model%monitor)) return
   end subroutine shorten_to_stop

   !> Tries whether the path turns at a change of the contact set just ahead; if so, goes to the corner and around it.
   subroutine turn_corner(problem, run, recorder, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(state_t) :: corner
      type(increment_t) :: report
      type(critical_t) :: critical
      real(wp) :: direction(3, problem%model%mesh%n_nodes), direction_load
      integer :: candidate
      logical :: ok
      if (problem%candidates%n == 0) return
      call find_corner(problem, run%state, run%control, corner, candidate, run%system, report, ok, timers)
      if (ok) call leave_corner(problem, run%control, candidate, corner, run%system, direction, direction_load, ok, timers)
      if (.not. ok) then
         call linearise(problem, run%state, run%state, run%system, timers)
         return
      end if
      critical%label = merge('C+', 'C-', corner%active(candidate))
      critical%note = 'contact '//trim(merge('gained', 'lost  ', corner%active(candidate)))
      call record(problem, run, corner, critical%label, report, recorder, outcome, timers)
      if (allocated(outcome%why)) return
      critical%step = problem%step
      critical%point = run%points
      critical%load_factor = corner%load_factor
      run%arc_length = run%arc_length + path_length(problem, run%state, corner)
      run%state = corner
      run%direction = direction
      run%direction_load = direction_load
      run%probe = new_probe(problem, run%state, run%system, direction_load)
      critical%monitor = run%probe%monitor
      call hand_over(recorder, critical, outcome, timers)
      run%step_points = run%step_points + 1
   end subroutine turn_corner

   !> Looks for events up to a converged trial point, records them and the point, and goes there.
   subroutine accept(problem, step, run, trial, report, recorder, finished, outcome, timers)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(inout) :: trial
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(event_t), allocatable :: events(:)
      type(probe_t) :: probe
      type(state_t), allocatable :: places(:)
      type(increment_t), allocatable :: reports(:)
      real(wp), allocatable :: fraction(:)
      logical, allocatable :: located(:)
      integer :: i, k
      type(critical_t) :: critical

      finished = .false.
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
         call linearise(problem, places(k), places(k), run%system, timers)
         call record(problem, run, places(k), events(k)%label, reports(k), recorder, outcome, timers)
         if (allocated(outcome%why)) return
         call count_up(timers, counter_located)
         critical%label = events(k)%label
         critical%step = problem%step
         critical%point = run%points
         critical%load_factor = places(k)%load_factor
         critical%located = located(k)
         critical%note = events(k)%note
         probe = new_probe(problem, places(k), run%system, 0.0_wp)
         critical%monitor = probe%monitor
         call hand_over(recorder, critical, outcome, timers)
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
      call record(problem, run, trial, '', report, recorder, outcome, timers)
      if (allocated(outcome%why)) return
      run%step_points = run%step_points + 1
      run%direction = trial%u - run%state%u
      run%direction_load = trial%load_factor - run%state%load_factor
      run%arc_length = run%arc_length + path_length(problem, run%state, trial)
      run%state = trial
      run%probe = probe
      call rehome_nodes(problem, run%control, run%direction, run%direction_load, run%state, run%system, timers)
      finished = stop_met(step, run%probe)
   end subroutine accept

   !> Load and displacement control stop on the value itself, where no sign changes any more.
   pure logical function stop_met(step, probe)
      type(step_t), intent(in) :: step
      type(probe_t), intent(in) :: probe
      real(wp) :: value
      integer :: i
      stop_met = .false.
      if (is_arc_length(step%method)) return
      do i = 1, size(step%stop)
         value = probe%load_factor
         if (step%stop(i)%monitor > 0) value = probe%monitor(step%stop(i)%monitor)
         stop_met = stop_met .or. abs(value - step%stop(i)%value) <= 1.0e-12_wp * abs(step%stop(i)%value)
      end do
   end function stop_met

   !> Probe at a converged state at which the system is factored; the direction comes from the last accepted point.
   type(probe_t) function probe_at(problem, run, state) result(probe)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(state_t), intent(in) :: state
      type(control_t) :: control
      control%method = method_cylindrical
      call set_tangent(problem, run%system, state%u - run%state%u, state%load_factor - run%state%load_factor, control)
      probe = new_probe(problem, state, run%system, control%tangent_load)
   end function probe_at

   !> Finds the zero of an event's function between the last accepted point and the trial by the Illinois rule on the
   !> length of the increment; an event of counts only by bisection.
   subroutine locate(problem, step, run, trial, event, place, report, fraction, located, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(event_t), intent(in) :: event
      type(state_t), intent(out) :: place           !! the located point, or the nearest one found
      type(increment_t), intent(out) :: report
      real(wp), intent(out) :: fraction             !! of the increment
      logical, intent(out) :: located
      type(timers_t), intent(inout) :: timers
      integer, parameter :: max_tries = 60
      type(control_t) :: control
      type(state_t) :: here, below, above
      type(probe_t) :: probe
      real(wp) :: low, high, f_low, f_high, f, scale
      integer :: try, side
      control = run%control
      low = 0.0_wp
      high = 1.0_wp
      f_low = event%before
      f_high = event%after
      scale = max(abs(f_low), abs(f_high))
      below = run%state
      above = trial
      place = trial
      fraction = 1.0_wp
      located = abs(f_high) <= step%locate_tolerance * scale
      side = 0
      search: do try = 1, max_tries
         if (located) exit search
         if (event%kind == event_bifurcation .or. f_low * f_high >= 0.0_wp) then
            fraction = 0.5_wp * (low + high)
         else
            fraction = (low * f_high - high * f_low) / (f_high - f_low)
            ! Stay off the ends: a kink may pin the rule there.
            fraction = min(max(fraction, low + 1.0e-3_wp * (high - low)), high - 1.0e-3_wp * (high - low))
         end if
         control%increment = fraction * run%control%increment
         call linearise(problem, run%state, run%state, run%system, timers)
         call take_increment(problem, run%state, control, here, run%system, report, timers)
         if (.not. report%converged) exit search
         probe = probe_at(problem, run, here)
         f = event_value(problem, event, here, probe)
         place = here
         if (event%kind /= event_bifurcation) located = abs(f) <= step%locate_tolerance * scale
         if (located) exit search
         if (f * f_low > 0.0_wp) then
            low = fraction
            f_low = f
            below = here
            if (side == -1) f_high = 0.5_wp * f_high
            side = -1
         else
            high = fraction
            f_high = f
            above = here
            if (side == 1) f_low = 0.5_wp * f_low
            side = 1
         end if
         if (high - low <= step%locate_tolerance) then
            place = above
            fraction = high
            located = .true.
            exit search
         end if
      end do search
      ! Where the contact set changes, pivot counts may jump without a bifurcation.
      if (event%kind == event_bifurcation .and. located .and. size(below%active) > 0) &
         & located = all(below%active .eqv. above%active)
   end subroutine locate

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
      point = report_point(problem, state, run%system, run%points)
      point%label = label
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
