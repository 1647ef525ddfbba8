!> What an increment cost and whether it succeeded.
module increment_report
   use kinds, only: wp
   implicit none
   private
   public :: increment_t, effort_of

   type :: increment_t
      logical :: converged = .false.
      integer :: iterations = 0
      real(wp) :: effort = 0.0_wp              !! the same as a number that no mesh rounds up, see effort_of
      real(wp) :: residual = 0.0_wp
      integer :: lcp_size = 0, lcp_pivots = 0
      character(:), allocatable :: message     !! why it did not converge
      logical :: hopeless = .false.            !! nor would a shorter one: to first order it is the same problem
   end type increment_t

contains

   !> How many iterations corrections take to become small, as a real number: between the last one that is not small and the next
   !> one by their logarithms. What is left of Newton's residual is of second order, so that corrections are small at the root of
   !> its tolerance. What moves the most does so on any mesh.
   pure real(wp) function effort_of(corrections, small) result(effort)
      real(wp), intent(in) :: corrections(:)   !! sizes of the steps, one after the other, huge where only contact changed
      real(wp), intent(in) :: small            !! a correction that needs no further one
      real(wp) :: next
      integer :: last                          ! that is not small
      last = findloc(corrections > small, .true., dim=1, back=.true.)
      effort = last + 1
      if (last == 0) return
      associate (c => corrections(last))
         next = 0.0_wp
         if (last < size(corrections)) then
            next = corrections(last + 1)
         else if (last > 1) then
            ! Newton's method squares the rate, where there is one.
            next = c * (min(c, corrections(last - 1)) / max(corrections(last - 1), tiny(c)))**2
         end if
         if (next < small) effort = last + (log(c) - log(small)) / (log(c) - log(max(next, tiny(next))))
      end associate
   end function effort_of
end module increment_report
