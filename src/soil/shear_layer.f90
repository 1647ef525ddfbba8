!> Settlement of a Pasternak foundation, springs tied by a shear layer, k w - G w'' = p, under forces at points of it.
!>
!> Between two points of the same rod the springs are lumped at both and the layer is straight, as the rod's own reaction is lumped
!> at its nodes: an error of the second order in their distance, and for G = 0 the Winkler foundation. Elsewhere nothing loads
!> the ground, and free stretches and both infinite ends are exact: a point far from others settles by 1/(2 sqrt(k G)) (A. P. S.
!> Selvadurai, Elastic Analysis of Soil-Foundation Interaction, 1979), be it the end of a rod, which carries a concentrated reaction
!> there. A mean over the tributary lengths would be wrong in the first order under such an end.
module shear_layer
   use kinds, only: wp
   use lapack, only: dptsv
   implicit none
   private
   public :: layer_compliance

contains

   !> Settlement of each point under a unit force at each.
   subroutine layer_compliance(place, joined, modulus, shear, compliance, ok)
      real(wp), intent(in) :: place(:)           !! (n) of the points along the surface, rising [length]
      logical, intent(in) :: joined(:)           !! (n - 1) the same rod goes from a point to the next
      real(wp), intent(in) :: modulus, shear     !! k [force/length^2], G [force], both times the width
      real(wp), intent(out) :: compliance(:, :)  !! (n, n) [length/force]
      logical, intent(out) :: ok
      real(wp) :: diagonal(size(place)), beside(size(place)), h, decay, stiff
      integer :: i, n, info
      n = size(place)
      stiff = sqrt(modulus * shear)
      diagonal = 0.0_wp
      beside = 0.0_wp
      diagonal(1) = stiff
      diagonal(n) = diagonal(n) + stiff
      do i = 1, n - 1
         h = place(i + 1) - place(i)
         if (joined(i)) then
            beside(i) = -shear / h
            diagonal(i:i + 1) = diagonal(i:i + 1) + (shear / h + 0.5_wp * modulus * h)
         else
            decay = exp(-h * modulus / stiff)
            beside(i) = -stiff * 2.0_wp * decay / (1.0_wp - decay**2)
            diagonal(i:i + 1) = diagonal(i:i + 1) + stiff * (1.0_wp + decay**2) / (1.0_wp - decay**2)
         end if
      end do
      compliance = 0.0_wp
      do i = 1, n
         compliance(i, i) = 1.0_wp
      end do
      call dptsv(n, n, diagonal, beside, compliance, n, info)
      ok = info == 0
      if (.not. ok) return
      compliance = 0.5_wp * (compliance + transpose(compliance))
   end subroutine layer_compliance
end module shear_layer
