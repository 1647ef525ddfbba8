!> Force per unit length of rod over penetration, piecewise linear.
module force_law
   use kinds, only: wp
   use model, only: law_t
   implicit none
   private
   public :: law_reaction

contains

   !> Force and its derivative; the last segment goes on beyond its end, and what is pulled answers as what is pushed.
   pure subroutine law_reaction(law, penetration, force, slope)
      type(law_t), intent(in) :: law
      real(wp), intent(in) :: penetration      !! negative: pulled
      real(wp), intent(out) :: force, slope    !! at a kink: the slope beyond it
      integer :: i, k
      k = 2
      do i = 3, size(law%penetration)
         if (abs(penetration) >= law%penetration(i - 1)) k = i
      end do
      associate (p => law%penetration, f => law%force)
         slope = (f(k) - f(k - 1)) / (p(k) - p(k - 1))
         force = sign(f(k - 1) + slope * (abs(penetration) - p(k - 1)), penetration)
      end associate
   end subroutine law_reaction
end module force_law
