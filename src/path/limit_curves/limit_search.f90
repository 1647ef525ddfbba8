!> The search for one limit point of a limit curve: the surface of equilibria next to the last limit point, and the zero
!> of the rate of the load on it (see limit_curves).
module limit_search
   use kinds, only: wp
   use model, only: step_t, limit_curve_t, method_linearised, method_cylindrical, parameter_modulus, parameter_ea, &
      & parameter_ei
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent
   use corrector, only: increment_t, correct
   use second_parameter, only: present_value, problem_at, carry_state
   implicit none
   private
   public :: follower_t, copy_follower, trial_t, stand_here, scale_rate, evaluate, search, as_coordinate, as_value, small_drop

   integer, parameter :: max_searches = 40          !! evaluations of h for one limit point
   real(wp), parameter :: small_drop = 0.01_wp      !! of the load, over one unit of arc length from the limit point

   !> The last limit point and what is needed to move from it.
   type :: follower_t
      type(problem_t) :: base                        !! the deck's
      type(problem_t) :: problem                     !! at the last limit point
      type(limit_curve_t) :: curve
      type(state_t) :: state
      type(system_t) :: system
      type(control_t) :: control                     !! tangent of the path at the last limit point
      real(wp) :: coordinate = 0.0_wp                !! the parameter, or its decimal logarithm
      real(wp) :: unit(2) = 1.0_wp                   !! of a and of the coordinate
      real(wp) :: rate_scale = 1.0_wp                !! what h is small against
   end type follower_t

   !> One evaluation of h.
   type :: trial_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(increment_t) :: report
      real(wp) :: rate = 0.0_wp                      !! h
      real(wp) :: slope = 0.0_wp                     !! dh/da per unit of a, 0 when the search did not tell
      integer :: iterations = 0
   end type trial_t

contains

   !> A follower, copied out of line as copy_problem does.
   pure subroutine copy_follower(from, to)
      type(follower_t), intent(in) :: from
      type(follower_t), intent(inout) :: to
      to = from
   end subroutine copy_follower

   !> Takes the tangent of the path at the follower's state; it keeps its sense.
   subroutine stand_here(follower, direction, direction_load)
      type(follower_t), intent(inout) :: follower
      real(wp), intent(in) :: direction(:, :), direction_load
      call linearise(follower%problem, follower%state, follower%state, follower%system)
      if (.not. follower%system%ok) return
      follower%control%method = method_cylindrical
      call set_tangent(follower%problem, follower%system, direction, direction_load, follower%control)
      follower%control%method = method_linearised
   end subroutine stand_here

   !> Sets the unit of arc length: what lowers the load by a hundredth; and the rate of the load there.
   subroutine scale_rate(follower, trial)
      type(follower_t), intent(inout) :: follower
      type(trial_t), intent(out) :: trial
      integer :: try
      do try = 1, 12
         call evaluate(follower, [1.0_wp, 0.0_wp], trial)
         if (trial%report%converged .and. abs(trial%rate) > 0.0_wp) exit
         follower%unit(1) = 0.5_wp * follower%unit(1)
      end do
      if (.not. abs(trial%rate) > 0.0_wp) return
      ! The rate grows in proportion to the arc length.
      follower%unit(1) = sqrt(2.0_wp * small_drop * abs(follower%state%load_factor) * follower%unit(1) / abs(trial%rate))
      follower%rate_scale = 2.0_wp * small_drop * abs(follower%state%load_factor) / follower%unit(1)
   end subroutine scale_rate

   !> h at a place on the surface, both coordinates in their units and counted from the last limit point.
   subroutine evaluate(follower, place, trial)
      type(follower_t), intent(inout) :: follower
      real(wp), intent(in) :: place(2)
      type(trial_t), intent(out) :: trial
      type(state_t) :: start
      type(control_t) :: control
      if (abs(place(2)) > 0.0_wp) then
         trial%problem = problem_at(follower%base, follower%curve, &
            & as_value(follower%curve, follower%coordinate + place(2) * follower%unit(2)))
      else
         call copy_problem(follower%problem, trial%problem)
      end if
      if (present_value(trial%problem, follower%curve) <= 0.0_wp .and. must_be_positive(follower%curve)) then
         trial%report%message = 'the parameter would no longer be positive'
         return
      end if
      start = carry_state(follower%problem, trial%problem, follower%state)
      trial%state = start
      ! Foundation springs belong to the system's storage.
      follower%system = new_system(trial%problem)
      control = follower%control
      control%increment = place(1) * follower%unit(1)
      call correct(trial%problem, start, control, .false., trial%state, follower%system, trial%report)
      trial%iterations = trial%iterations + trial%report%iterations
      if (.not. trial%report%converged) return
      control%method = method_cylindrical
      call set_tangent(trial%problem, follower%system, follower%control%tangent, 0.0_wp, control)
      trial%rate = control%tangent_load
   end subroutine evaluate

   !> Looks for h = 0 from a place along a normal to the curve: secants, kept within a bracket once there is one.
   subroutine search(follower, step, place, normal, trial, searches)
      type(follower_t), intent(inout) :: follower
      type(step_t), intent(in) :: step
      real(wp), intent(inout) :: place(2)          !! predicted on entry, found on return
      real(wp), intent(in) :: normal(2)
      type(trial_t), intent(out) :: trial
      integer, intent(out) :: searches
      type(trial_t) :: next
      real(wp) :: q, h, q_old, h_old, q_new, low, high, h_low, h_high, slope
      integer :: total
      logical :: bracketed
      call evaluate(follower, place, trial)
      searches = 1
      if (.not. trial%report%converged) return
      total = trial%iterations
      q_old = 0.0_wp
      h_old = trial%rate
      if (.not. abs(h_old) > 0.0_wp) return
      slope = follower%rate_scale * sign(1.0_wp, h_old)
      ! Which way the rate falls is not known yet: a small step tells.
      q = 0.01_wp
      bracketed = .false.
      low = 0.0_wp
      high = 0.0_wp
      h_low = 0.0_wp
      h_high = 0.0_wp
      do searches = 2, max_searches
         call evaluate(follower, place + q * normal, next)
         total = total + next%iterations
         if (.not. next%report%converged) then
            ! Nearer to where it was known to work.
            q = 0.5_wp * (q + q_old)
            if (abs(q - q_old) < 1.0e-9_wp) exit
            cycle
         end if
         h = next%rate
         if (h * h_old < 0.0_wp) then
            bracketed = .true.
            low = q_old
            h_low = h_old
            high = q
            h_high = h
         else if (bracketed) then
            if (h * h_low > 0.0_wp) then
               low = q
               h_low = h
            else
               high = q
               h_high = h
            end if
         end if
         slope = (h - h_old) / (q - q_old)
         trial = next
         ! The load is off by h^2 over twice the slope.
         if (accurate(h, slope) .or. (bracketed .and. abs(high - low) < 1.0e-10_wp)) then
            if (abs(normal(1)) > 0.7_wp) trial%slope = slope / normal(1)
            place = place + q * normal
            trial%iterations = total
            return
         end if
         q_new = q - h / slope
         if (.not. abs(slope) > 0.0_wp) q_new = 2.0_wp * q
         if (bracketed) then
            if ((q_new - low) * (q_new - high) >= 0.0_wp) q_new = 0.5_wp * (low + high)
         else
            q_new = min(max(q_new, q - 3.0_wp), q + 3.0_wp)
         end if
         q_old = q
         h_old = h
         q = q_new
      end do
      trial%report%converged = .false.
      if (.not. allocated(trial%report%message)) trial%report%message = 'the search for the limit point did not converge'

   contains

      logical function accurate(rate, by)
         real(wp), intent(in) :: rate, by
         real(wp) :: off
         off = 0.5_wp * rate**2 / max(abs(by), tiny(1.0_wp)) * follower%unit(1)
         accurate = off <= step%locate_tolerance * abs(trial%state%load_factor) .and. &
            & abs(rate) <= 1.0e-3_wp * follower%rate_scale
      end function accurate
   end subroutine search

   !> Moduli and stiffnesses.
   pure logical function must_be_positive(curve)
      type(limit_curve_t), intent(in) :: curve
      must_be_positive = any(curve%parameter == [parameter_modulus, parameter_ea, parameter_ei])
   end function must_be_positive

   pure real(wp) function as_coordinate(curve, value)
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: value
      as_coordinate = value
      if (curve%logarithmic) as_coordinate = log10(value)
   end function as_coordinate

   pure real(wp) function as_value(curve, coordinate)
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: coordinate
      as_value = coordinate
      if (curve%logarithmic) as_value = 10.0_wp**coordinate
   end function as_value
end module limit_search
