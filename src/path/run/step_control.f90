!> Control of the increments of one step: size of the first increment, adaptation, shortening to stop values.
module step_control
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement, method_cylindrical
   use problem, only: problem_t, rounding_gap
   use path_control, only: control_t, is_arc_length, constraint_tolerance
   use path_continuity, only: relation_t, largest_turn, stands_still
   use path_events, only: test_values_t
   use path_state, only: path_state_t, path_tangent_of
   use corrector, only: increment_t
   implicit none
   private
   public :: start_control, change_control, begin_arc_length, go_by_load, may_rest, next_increment, smallest, too_short
   public :: shorten_to_stop, stop_met, largest_growth, least_part

   real(wp), parameter :: safety = 0.7_wp !! fraction of the largest permitted turn of the tangent that an increment is planned to
   !! use
   real(wp), parameter :: least_part = 1.0e-6_wp !! smallest arc length over that of the first increment; with values from 1E-7 to
   !! 1E-5 every deck in input has the same results
   real(wp), parameter :: least_load = 1.0e-9_wp !! smallest load increment of an arc-length step, divided by the first one: a
   !! smaller increment changes the forces by less than the default tolerance of their residual
   real(wp), parameter :: largest_growth = 2.0_wp, shrinkage = 0.25_wp !! largest and smallest ratio of consecutive increments

contains

   !> Sets the control of the first increment. An arc-length strategy begins with an increment of the load factor, from which the
   !> scale between load and displacements follows.
   subroutine start_control(problem, step, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      run%control%method = merge(method_load, step%method, is_arc_length(step%method))
      run%control%monitor = step%monitor
      run%control%load_scale = 0.0_wp
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      run%control%increment = step%increment
      run%last%tangent = path_tangent_of(problem, run, run%last)
      run%last%test_values%load_rate = run%last%tangent%load
      if (step%method == method_displacement .and. .not. allocated(run%control%tangent)) &
         & allocate (run%control%tangent(3, problem%model%mesh%n_nodes), source=0.0_wp)
   end subroutine start_control

   !> Continues with another strategy from the last accepted point, in the direction of travel. If both strategies use the arc
   !> length, only the constraint changes and the increment is kept. Otherwise the new strategy begins as at the start of a step.
   subroutine change_control(problem, step, run)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step           !! the step with the new strategy
      type(path_state_t), intent(inout) :: run
      real(wp) :: load
      if (is_arc_length(step%method) .and. is_arc_length(run%control%method)) then
         run%control%method = step%method
         run%control%increment = min(run%control%increment, step%largest)
         return
      end if
      load = run%last%tangent%load
      if (is_arc_length(step%method) .and. allocated(run%control%tangent)) deallocate (run%control%tangent)
      call start_control(problem, step, run)
      ! Behind a limit point the load decreases in the direction of travel.
      if (run%control%method /= method_load .or. .not. abs(load) > 0.0_wp) return
      run%control%increment = sign(step%increment, load)
      run%last%tangent = path_tangent_of(problem, run, run%last)
      run%last%test_values%load_rate = run%last%tangent%load
   end subroutine change_control

   !> Switches from load increments to arc length. The scale between load and displacements follows from the first load increment
   !> that displaces the structure.
   subroutine begin_arc_length(problem, step, run, scaled)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      logical, intent(out) :: scaled            !! false: the displacements are rounding only, and no arc length is defined
      real(wp) :: length, moved
      length = run%last_length
      ! If the path tangent has no displacements, the difference between the points is only the convergence error of the last
      ! increment.
      moved = length
      if (.not. any(abs(run%last%tangent%u) > 0.0_wp)) moved = 0.0_wp
      if (moved * abs(run%last%tangent%load) > abs(run%last_load)) moved = abs(run%last_load / run%last%tangent%load)
      scaled = moved > rounding_gap(problem) * sqrt(sum(problem%weight)) .and. abs(run%last_load) > 0.0_wp
      if (run%control%load_scale > 0.0_wp) then
         scaled = .not. stands_still(run%last%tangent, step%increment)
         length = run%control%load_scale * abs(step%increment)
      end if
      if (.not. scaled) return
      run%control%method = step%method
      if (.not. run%control%load_scale > 0.0_wp) run%control%load_scale = length / abs(run%last_load)
      run%control%increment = length
      if (step%method /= method_cylindrical) run%control%increment = sqrt(2.0_wp) * length
      run%control%increment = min(run%control%increment, step%largest)
   end subroutine begin_arc_length

   !> True if a step can be completed without any displacement: it has a load stop value, moves obstacles or closes their gaps.
   pure logical function may_rest(step)
      type(step_t), intent(in) :: step
      may_rest = .false.
      if (size(step%stop) > 0) may_rest = any(step%stop%monitor == 0)
      if (allocated(step%load%motion)) may_rest = may_rest .or. any(abs(step%load%motion) > 0.0_wp)
      if (allocated(step%load%closing)) may_rest = may_rest .or. any(abs(step%load%closing) > 0.0_wp)
   end function may_rest

   !> Returns to load increments if no node moves any more, for example if the load acts directly on a contact: increments then have
   !> no arc length. Load increments begin with the deck's first increment and continue until a node moves.
   subroutine go_by_load(step, run)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      if (.not. is_arc_length(run%control%method) .or. .not. stands_still(run%last%tangent, step%increment)) return
      ! A structure that has hardly moved since the start of the step keeps its arc-length increment.
      if (.not. run%control%load_scale > 0.0_wp) return
      if (stands_still(1.0_wp / run%control%load_scale, step%increment)) return
      run%control%method = method_load
      run%control%increment = sign(step%increment, run%last%tangent%load)
   end subroutine go_by_load

   !> Adapts the increment by Crisfield's rule. The increment is multiplied by the square root of desired over needed iterations,
   !> and limited so that the path tangent does not turn more than allowed. With contact spans, about one iteration serves only to
   !> locate the touchdown points and is not counted. The count is then the fractional one of effort_of, which is interpolated
   !> between iterations so that it does not jump from mesh to mesh, and the ratio of iterations is squared; no root is taken.
   subroutine next_increment(step, report, relation, spans, control)
      type(step_t), intent(in) :: step
      type(increment_t), intent(in) :: report   !! report of the increment just made
      type(relation_t), intent(in) :: relation  !! relation of the two ends of the increment
      logical, intent(in) :: spans              !! true: the problem has contact spans, whose touchdown points moved
      type(control_t), intent(inout) :: control
      real(wp) :: ratio
      integer :: desired
      desired = step%desired_iterations
      ! Modified Newton iteration converges linearly and needs many iterations in short increments, too.
      if (step%tangent_updates < huge(1)) desired = max(desired, (2 * step%max_iterations) / 3)
      ratio = sqrt(real(desired, wp) / max(report%iterations, 1))
      if (spans) ratio = (real(desired, wp) / max(report%effort - 1.0_wp, 1.0_wp))**2
      if (relation%comparable) ratio = min(ratio, safety * largest_turn / max(relation%turn, epsilon(ratio)))
      control%increment = control%increment * min(max(ratio, shrinkage), largest_growth)
      ! Load increments of an arc-length step are not limited by the largest arc length.
      if (is_arc_length(step%method) .and. .not. is_arc_length(control%method)) return
      if (abs(control%increment) > step%largest) control%increment = sign(step%largest, control%increment)
   end subroutine next_increment

   !> Smallest increment that the step may try, in the units of the controlled quantity.
   pure real(wp) function smallest(step, control)
      type(step_t), intent(in) :: step
      type(control_t), intent(in) :: control
      smallest = step%smallest
      ! A structure that is stiff at first needs short arc lengths at the start of the step.
      if (is_arc_length(control%method) .and. .not. step%smallest_given .and. control%load_scale > 0.0_wp) &
         & smallest = min(smallest, least_part * control%load_scale * abs(step%increment))
      ! The deck has no limit for the load increments at the start of an arc-length step.
      if (is_arc_length(step%method) .and. .not. is_arc_length(control%method)) smallest = least_load * abs(step%increment)
   end function smallest

   !> True if the fraction `part` of the present increment is below the smallest increment of the step.
   pure logical function too_short(step, control, part)
      type(step_t), intent(in) :: step
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: part
      too_short = part * abs(control%increment) < smallest(step, control)
   end function too_short

   !> Shortens the next increment of load or displacement control so that it ends at the stop value.
   subroutine shorten_to_stop(step, run)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      real(wp) :: now, left
      integer :: i, watched
      if (is_arc_length(step%method)) return
      watched = 0
      now = run%last%state%load_factor
      if (step%method == method_displacement) then
         watched = step%monitor
         now = run%last%test_values%monitor(watched)
      end if
      do i = 1, size(step%stop)
         if (step%stop(i)%monitor /= watched) cycle
         left = step%stop(i)%value - now
         if (left * run%control%increment <= 0.0_wp .or. (step%stop(i)%rising .neqv. left > 0.0_wp)) cycle
         if (abs(run%control%increment) >= abs(left)) run%control%increment = left
      end do
   end subroutine shorten_to_stop

   !> True if load or displacement control has arrived at its stop value, within the accuracy of the constraint. The value is met,
   !> not passed, so that no test value changes its sign.
   pure logical function stop_met(step, before, now)
      type(step_t), intent(in) :: step
      type(test_values_t), intent(in) :: before, now  !! test values at the last accepted point and at the present point
      real(wp) :: value, from
      integer :: i
      stop_met = .false.
      if (is_arc_length(step%method)) return
      do i = 1, size(step%stop)
         value = now%load_factor
         from = before%load_factor
         if (step%stop(i)%monitor > 0) value = now%monitor(step%stop(i)%monitor)
         if (step%stop(i)%monitor > 0) from = before%monitor(step%stop(i)%monitor)
         stop_met = stop_met .or. (abs(value - step%stop(i)%value) <= 1.0e-11_wp * abs(step%stop(i)%value) + &
            & constraint_tolerance(step) * abs(value - from) .and. (value > from .eqv. step%stop(i)%rising))
      end do
   end function stop_met
end module step_control
