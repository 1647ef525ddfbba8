!> Settlement w of a Pasternak foundation under point forces. It consists of springs connected by a shear layer, k w - G w'' = p,
!> with the modulus k, the shear stiffness G of the layer, and the force p by length.
!>
!> Between two points of the same rod the springs are lumped at both points and the layer is straight, just as the rod's reaction is
!> lumped at its nodes. The error is of second order in the distance of the points, and G = 0 gives the Winkler foundation.
!> Elsewhere the ground has no load, and the solution between rods and towards infinity is exact. A point far from others settles by
!> 1/(2 sqrt(k G)) under a unit force (A. P. S. Selvadurai, Elastic Analysis of Soil-Foundation Interaction, 1979), and so does the
!> end of a rod, which has a concentrated reaction. A mean over the tributary lengths would have a first-order error under such an
!> end.
module shear_layer
   use kinds, only: wp
   use lapack, only: dptsv
   implicit none
   private
   public :: layer_compliance

contains

   !> Settlement of each point under a unit force at each point.
   subroutine layer_compliance(place, joined, modulus, shear, compliance, ok)
      real(wp), intent(in) :: place(:)           !! (n) coordinates of the points along the surface, increasing [length]
      logical, intent(in) :: joined(:)           !! (n - 1) true: a rod connects the point with the next point
      real(wp), intent(in) :: modulus, shear     !! k [force/length^2] and G [force], both multiplied by the width of the rod
      real(wp), intent(out) :: compliance(:, :)  !! (n, n) settlement of each point under a unit force at each point [length/force]
      logical, intent(out) :: ok                 !! false: the system is singular
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
