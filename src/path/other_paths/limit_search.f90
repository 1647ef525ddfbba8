!> Searches for one limit point of a limit curve: the surface of equilibria next to the last limit point, and the zero of the load
!> rate on that surface (see limit_curves).
module limit_search
   use kinds, only: wp
   use model, only: step_t, limit_curve_t, method_linearised, method_cylindrical, parameter_modulus, parameter_ea, parameter_ei
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent
   use corrector, only: increment_t, correct
   use second_parameter, only: present_value, problem_at, carry_state
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   implicit none
   private
   public :: follower_t, curve_trace_t, copy_follower, trial_t, set_follower_tangent, scale_rate, evaluate_rate, search, &
      & as_coordinate
   public :: as_value, small_drop

   integer, parameter :: max_searches = 40 !! largest number of evaluations of the load rate h for one limit point; with values from
   !! 20 to 80 every deck in input has the same results
   real(wp), parameter :: first_move = 0.01_wp !! first step of a search, in units of the two coordinates (arc length a, parameter)
   real(wp), parameter :: longest_move = 3.0_wp !! longest step of a search, in units of the two coordinates; with values up to 30
   !! every deck in input has the same results; with 0.3 one deck has other results
   real(wp), parameter :: narrow = 1.0e-10_wp !! distance, in units of the two coordinates, below which two points count as the same
   !! point; with values from 1E-11 to 1E-9 every deck in input has the same results
   real(wp), parameter :: small_drop = 0.01_wp !! relative decrease of the load over one unit of arc length, measured from the limit
   !! point

   !> The last limit point of a limit curve, with the data needed to find equilibria near it.
   type :: follower_t
      type(problem_t) :: base                        !! problem with the value of the parameter from the deck
      type(problem_t) :: problem                     !! problem at the last limit point
      type(limit_curve_t) :: curve
      type(state_t) :: state                     !! state at the last limit point
      type(system_t) :: system                   !! storage for the assembled equations
      type(control_t) :: control !! control of the corrector; its tangent is the path tangent at the last limit point
      real(wp) :: coordinate = 0.0_wp                !! coordinate of the curve: the parameter, or its decimal logarithm
      real(wp) :: unit(2) = 1.0_wp                   !! units of the arc length a and of the coordinate
      real(wp) :: rate_scale = 1.0_wp                !! reference value of the load rate h
   end type follower_t

   !> Progress of a run along a limit curve between two limit points. It contains all data on which the next limit point depends.
   type :: curve_trace_t
      type(follower_t) :: follower
      integer :: number = 0                      !! index of the curve in its step
      integer :: points = 0                      !! number of limit points found so far
      integer :: cuts = 0                        !! number of halvings of the step since the last limit point
      real(wp) :: way(2) = 0.0_wp !! unit direction of the next step along the curve (arc length, parameter), in the units of the
      !! follower
      real(wp) :: distance = 0.0_wp              !! length of the next step, in the units of the follower
      real(wp) :: start = 0.0_wp                 !! coordinate of the curve at its first limit point
      real(wp) :: turned_at = 0.0_wp             !! value of the parameter where the curve last turned back
   end type curve_trace_t

   !> One evaluation of the load rate h on the surface of equilibria.
   type :: trial_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(increment_t) :: report
      real(wp) :: rate = 0.0_wp                      !! h, the load rate along the path
      real(wp) :: slope = 0.0_wp                     !! dh/da by the unit of a; 0: unknown
      integer :: iterations = 0                  !! number of Newton iterations
   end type trial_t

contains

   !> Copies a follower_t. The copy is a procedure, because the compiler would otherwise write out the copies of all components at
   !> each assignment.
   pure subroutine copy_follower(from, to)
      type(follower_t), intent(in) :: from
      type(follower_t), intent(inout) :: to
      to = from
   end subroutine copy_follower

   !> Sets the path tangent at the state of the follower, oriented along a given direction.
   subroutine set_follower_tangent(follower, direction, direction_load)
      type(follower_t), intent(inout) :: follower
      real(wp), intent(in) :: direction(:, :), direction_load !! displacements (3, nodes) and load factor of the given direction
      call linearise(follower%problem, follower%state, follower%state, follower%system)
      if (.not. follower%system%ok) return
      follower%control%method = method_cylindrical
      call set_tangent(follower%problem, follower%system, direction, direction_load, follower%control)
      follower%control%method = method_linearised
   end subroutine set_follower_tangent

   !> Sets the unit of arc length, over which the load falls by a hundredth from its limit, and the reference value of the load
   !> rate.
   subroutine scale_rate(follower, trial)
      type(follower_t), intent(inout) :: follower
      type(trial_t), intent(out) :: trial
      integer :: try
      do try = 1, 12
         call evaluate_rate(follower, [1.0_wp, 0.0_wp], trial)
         if (trial%report%converged .and. abs(trial%rate) > 0.0_wp) exit
         follower%unit(1) = 0.5_wp * follower%unit(1)
      end do
      if (.not. abs(trial%rate) > 0.0_wp) return
      ! Near a limit point the load rate is proportional to the arc length from it.
      follower%unit(1) = sqrt(2.0_wp * small_drop * abs(follower%state%load_factor) * follower%unit(1) / abs(trial%rate))
      follower%rate_scale = 2.0_wp * small_drop * abs(follower%state%load_factor) / follower%unit(1)
   end subroutine scale_rate

   !> Evaluates the load rate h at a point on the surface of equilibria.
   subroutine evaluate_rate(follower, place, trial)
      type(follower_t), intent(inout) :: follower
      real(wp), intent(in) :: place(2) !! arc length and coordinate from the last limit point, in follower%unit
      type(trial_t), intent(out) :: trial
      type(state_t) :: start
      type(control_t) :: control
      if (abs(place(2)) > 0.0_wp) then
         trial%problem = problem_at(follower%base, follower%curve, &
            & as_value(follower%curve, follower%coordinate + place(2) * follower%unit(2)))
      else
         call copy_problem(follower%problem, trial%problem)
      end if
      if (present_value(trial%problem, follower%curve) <= 0.0_wp .and. &
         & any(follower%curve%parameter == [parameter_modulus, parameter_ea, parameter_ei])) then
         trial%report%message = 'the parameter would no longer be positive'
         return
      end if
      start = carry_state(follower%problem, trial%problem, follower%state)
      trial%state = start
      ! The band storage of the system depends on which foundation springs act; this changes with the parameter.
      follower%system = new_system(trial%problem)
      control = follower%control
      control%increment = place(1) * follower%unit(1)
      call correct(trial%problem, start, control, .false., trial%state, follower%system, trial%report)
      trial%iterations = trial%iterations + trial%report%iterations
      if (.not. trial%report%converged) return
      control%method = method_cylindrical
      call set_tangent(trial%problem, follower%system, follower%control%tangent, 0.0_wp, control)
      trial%rate = control%tangent_load
   end subroutine evaluate_rate

   !> Searches for h = 0 along a line normal to the limit curve: by secants until the zero is bracketed, then inside the bracket.
   subroutine search(follower, step, place, normal, trial, searches)
      type(follower_t), intent(inout) :: follower
      type(step_t), intent(in) :: step
      real(wp), intent(inout) :: place(2)          !! position (arc length, coordinate); in: predicted, out: the zero of h
      real(wp), intent(in) :: normal(2)            !! unit direction of the search
      type(trial_t), intent(out) :: trial
      integer, intent(out) :: searches !! number of evaluations of h
      type(trial_t) :: next
      type(bracket_t) :: bracket
      real(wp) :: q, h, q_old, h_old, slope
      integer :: total
      logical :: bracketed, open
      call evaluate_rate(follower, place, trial)
      searches = 1
      if (.not. trial%report%converged) return
      total = trial%iterations
      q_old = 0.0_wp
      h_old = trial%rate
      if (.not. abs(h_old) > 0.0_wp) return
      ! The direction in which h decreases is unknown; a small step determines it.
      q = first_move
      bracketed = .false.
      do searches = 2, max_searches
         call evaluate_rate(follower, place + q * normal, next)
         total = total + next%iterations
         if (.not. next%report%converged) then
            ! The next point is half as far away from the last point that converged.
            q = 0.5_wp * (q + q_old)
            if (abs(q - q_old) < narrow) exit
            cycle
         end if
         h = next%rate
         slope = (h - h_old) / (q - q_old)
         trial = next
         open = .true.
         if (bracketed) then
            call take_value(bracket, q, h)
         else if (h * h_old < 0.0_wp) then
            bracketed = .true.
            bracket = new_bracket(merge(h_old, h, q_old < q), merge(h, h_old, q_old < q), min(q, q_old), max(q, q_old))
         end if
         if (bracketed) open = bracket%high - bracket%low > narrow
         ! The load differs from the limit load by h^2 over twice the slope dh/da.
         if (accurate(h, slope) .or. .not. open) then
            if (abs(normal(1)) > 0.7_wp) trial%slope = slope / normal(1)
            place = place + q * normal
            trial%iterations = total
            return
         end if
         q_old = q
         h_old = h
         if (bracketed) then
            open = next_guess(bracket, narrow, q)
         else if (abs(slope) > 0.0_wp) then
            q = min(max(q - h / slope, q - longest_move), q + longest_move)
         else
            q = 2.0_wp * q
         end if
      end do
      trial%report%converged = .false.
      if (.not. allocated(trial%report%message)) trial%report%message = 'the search for the limit point did not converge'

   contains

      !> True if load and load rate are within tolerance of their values at the limit point.
      logical function accurate(rate, by)
         real(wp), intent(in) :: rate, by
         real(wp) :: off
         off = 0.5_wp * rate**2 / max(abs(by), tiny(1.0_wp)) * follower%unit(1)
         accurate = off <= step%locate_tolerance * abs(trial%state%load_factor) .and. abs(rate) <= 1.0e-3_wp * follower%rate_scale
      end function accurate
   end subroutine search

   !> Coordinate of the curve: the parameter or its decimal logarithm.
   pure real(wp) function as_coordinate(curve, value)
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: value !! value of the parameter
      as_coordinate = value
      if (curve%logarithmic) as_coordinate = log10(value)
   end function as_coordinate

   !> Value of the parameter at a coordinate of the curve.
   pure real(wp) function as_value(curve, coordinate)
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: coordinate !! the parameter or its decimal logarithm
      as_value = coordinate
      if (curve%logarithmic) as_value = 10.0_wp**coordinate
   end function as_value
end module limit_search
