!> Result and cost of an increment.
module increment_report
   use kinds, only: wp
   implicit none
   private
   public :: increment_t, effort_of

   !> Result of the correction to the end of an increment, and its cost.
   type :: increment_t
      logical :: converged = .false.
      integer :: iterations = 0
      real(wp) :: effort = 0.0_wp              !! fractional number of iterations, see effort_of
      real(wp) :: residual = 0.0_wp
      real(wp) :: left = 0.0_wp !! expected next correction, extrapolated from the last ones: displacements and load factor over
      !! their changes in the increment, touchdown points over the lengths of the spans beside them
      integer :: lcp_size = 0, lcp_pivots = 0    !! size of the largest LCP; number of pivots of all LCPs
      character(:), allocatable :: message     !! reason of the failure; not allocated: no failure
      logical :: hopeless = .false. !! true: a shorter increment fails, too, because to first order its equations are the same
   end type increment_t

contains

   !> Fractional number of iterations until the corrections are small, interpolated in the logarithm between the last correction
   !> that is not small and the next. A correction is small if it is below the square root of the tolerance, because the next
   !> correction is about its square. The size of a correction is its largest component, which does not depend on the mesh.
   pure real(wp) function effort_of(corrections, small) result(effort)
      real(wp), intent(in) :: corrections(:)   !! sizes of the steps in their order; huge where only the contact set changed
      real(wp), intent(in) :: small            !! size of a correction after which no further one is needed
      real(wp) :: next
      integer :: last                          ! index of the last correction that is not small
      last = findloc(corrections > small, .true., dim=1, back=.true.)
      effort = last + 1
      if (last == 0) return
      associate (c => corrections(last))
         next = 0.0_wp
         if (last < size(corrections)) then
            next = corrections(last + 1)
         else if (last > 1) then
            ! Extrapolated by the quadratic convergence of Newton's method, which squares the ratio of corrections.
            next = c * (min(c, corrections(last - 1)) / max(corrections(last - 1), tiny(c)))**2
         end if
         if (next < small) effort = last + (log(c) - log(small)) / (log(c) - log(max(next, tiny(next))))
      end associate
   end function effort_of
end module increment_report
