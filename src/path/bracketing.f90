!> A bracketed zero of a function of the increment's length: Illinois' variant of the regula falsi.
module bracketing
   use kinds, only: wp
   implicit none
   private
   public :: bracket_t, new_bracket, bracket_guess, bracket_update

   type :: bracket_t
      real(wp) :: low = 0.0_wp, high = 1.0_wp
      real(wp) :: f_low = 0.0_wp, f_high = 0.0_wp
      real(wp) :: scale = 0.0_wp             !! larger of the first two magnitudes: what the zero is measured against
      integer, private :: side = 0           !! which end stayed last time
   end type bracket_t

contains

   !> The bracket (0, 1) with the function's values at its ends.
   pure type(bracket_t) function new_bracket(f_low, f_high) result(bracket)
      real(wp), intent(in) :: f_low, f_high
      bracket%f_low = f_low
      bracket%f_high = f_high
      bracket%scale = max(abs(f_low), abs(f_high))
   end function new_bracket

   !> Where to look next; the middle when the signs do not differ. Off the ends: a kink may pin the rule there.
   pure real(wp) function bracket_guess(bracket) result(at)
      type(bracket_t), intent(in) :: bracket
      real(wp), parameter :: margin = 1.0e-3_wp
      real(wp) :: width
      at = 0.5_wp * (bracket%low + bracket%high)
      if (bracket%f_low * bracket%f_high >= 0.0_wp) return
      width = bracket%high - bracket%low
      at = (bracket%low * bracket%f_high - bracket%high * bracket%f_low) / (bracket%f_high - bracket%f_low)
      at = min(max(at, bracket%low + margin * width), bracket%high - margin * width)
   end function bracket_guess

   !> Takes a new value in; an end that stays twice gets half its weight. True when it became the low end.
   subroutine bracket_update(bracket, at, f, low_moved)
      type(bracket_t), intent(inout) :: bracket
      real(wp), intent(in) :: at, f
      logical, intent(out) :: low_moved
      low_moved = f * bracket%f_low > 0.0_wp
      if (low_moved) then
         bracket%low = at
         bracket%f_low = f
         if (bracket%side == -1) bracket%f_high = 0.5_wp * bracket%f_high
         bracket%side = -1
      else
         bracket%high = at
         bracket%f_high = f
         if (bracket%side == 1) bracket%f_low = 0.5_wp * bracket%f_low
         bracket%side = 1
      end if
   end subroutine bracket_update
end module bracketing
