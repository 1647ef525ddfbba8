!> Zero of a function in a bracket by Chandrupatla's rule: inverse quadratic interpolation if the last three points allow it,
!> bisection otherwise (Chandrupatla 1997, Adv. Eng. Software 28).
module bracketing
   use kinds, only: wp
   implicit none
   private
   public :: bracket_t, new_bracket, next_guess, take_value

   !> A bracket: two ends between which a function has a zero, and the function's values at them.
   type :: bracket_t
      real(wp) :: low = 0.0_wp, high = 1.0_wp
      real(wp) :: f_low = 0.0_wp, f_high = 0.0_wp
      real(wp) :: scale = 0.0_wp                 !! scale of function values: the larger magnitude of the first two
      logical, private :: latest_low = .false.   !! true: the low end was replaced last
      real(wp), private :: dropped = 0.0_wp, f_dropped = 0.0_wp !! argument that was replaced last, and the function's value there
      logical, private :: fresh = .true.         !! true: neither end has been replaced yet
   end type bracket_t

contains

   !> A bracket with the function's values at both ends.
   pure type(bracket_t) function new_bracket(f_low, f_high, low, high) result(bracket)
      real(wp), intent(in) :: f_low, f_high       !! values at the two ends, of opposite sign
      real(wp), intent(in), optional :: low, high !! ends, low < high; default: 0 and 1
      if (present(low)) bracket%low = low
      if (present(high)) bracket%high = high
      bracket%f_low = f_low
      bracket%f_high = f_high
      bracket%scale = max(abs(f_low), abs(f_high))
   end function new_bracket

   !> True if the function must be evaluated at a further point `at`; false if the bracket is narrower than `narrow`.
   logical function next_guess(bracket, narrow, at)
      type(bracket_t), intent(in) :: bracket
      real(wp), intent(in) :: narrow             !! width of the bracket at which the search ends
      real(wp), intent(out) :: at                !! argument at which the function must be evaluated next
      at = bracket_guess(bracket)
      next_guess = bracket%high - bracket%low > narrow
   end function next_guess

   !> Next guess of the zero; the middle if the values at both ends have the same sign.
   pure real(wp) function bracket_guess(bracket) result(at)
      type(bracket_t), intent(in) :: bracket
      real(wp) :: x(3), f(3), xi, phi, part, width, margin
      width = bracket%high - bracket%low
      at = bracket%low + 0.5_wp * width
      if (bracket%f_low * bracket%f_high >= 0.0_wp) return
      if (bracket%fresh) then
         at = bracket%low + width * bracket%f_low / (bracket%f_low - bracket%f_high)
      else
         ! The three points are 1: the end replaced last, 2: the opposite end, 3: the point that was replaced.
         x = [bracket%high, bracket%low, bracket%dropped]
         f = [bracket%f_high, bracket%f_low, bracket%f_dropped]
         if (bracket%latest_low) x(1:2) = [bracket%low, bracket%high]
         if (bracket%latest_low) f(1:2) = [bracket%f_low, bracket%f_high]
         xi = (x(1) - x(2)) / (x(3) - x(2))
         phi = (f(1) - f(2)) / (f(3) - f(2))
         if (phi**2 < xi .and. (1.0_wp - phi)**2 < 1.0_wp - xi) then
            part = f(1) / (f(2) - f(1)) * f(3) / (f(2) - f(3)) + &
               & (x(3) - x(1)) / (x(2) - x(1)) * f(1) / (f(3) - f(1)) * f(2) / (f(3) - f(2))
            at = x(1) + part * (x(2) - x(1))
         end if
      end if
      ! The guess has at least the distance of rounding from both ends.
      margin = min(2.0_wp * epsilon(at) * max(1.0_wp, abs(bracket%low), abs(bracket%high)), 0.25_wp * width)
      at = min(max(at, bracket%low + margin), bracket%high - margin)
   end function bracket_guess

   !> Replaces an end of the bracket by a new point.
   subroutine take_value(bracket, at, f, low_moved)
      type(bracket_t), intent(inout) :: bracket
      real(wp), intent(in) :: at, f               !! new argument and the function's value there
      logical, intent(out), optional :: low_moved !! true: the low end was replaced
      logical :: low
      low = f * bracket%f_low > 0.0_wp
      if (low) then
         bracket%dropped = bracket%low
         bracket%f_dropped = bracket%f_low
         bracket%low = at
         bracket%f_low = f
      else
         bracket%dropped = bracket%high
         bracket%f_dropped = bracket%f_high
         bracket%high = at
         bracket%f_high = f
      end if
      bracket%latest_low = low
      if (present(low_moved)) low_moved = low
      bracket%fresh = .false.
   end subroutine take_value
end module bracketing
