!> Smallest gap of contact at nodes, including the gaps between the nodes. Between nodes the gap follows from the rod profile, whose
!> derivatives at the nodes have the full order of the element (mend_ends).
module gap_profile
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_opening
   use element_families, only: collocates
   use rod_profile, only: mend_ends
   use element_gap, only: element_gap_t, new_element_gap, gap_extreme
   implicit none
   private
   public :: smallest_gap

contains

   !> Smallest gap along the elements between marked candidates. On coupled ground only the gaps at nodes count, and they are
   !> measured to the settled surface.
   real(wp) function smallest_gap(problem, state, marked) result(least)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: marked(:)     !! (candidates) true: the elements beside this candidate are included
      type(element_gap_t) :: gap
      real(wp) :: value, place
      integer :: c, next
      least = huge(1.0_wp)
      do c = 1, problem%candidates%n
         next = problem%candidates%neighbour(2, c)
         if (next == 0 .or. problem%coupling%entry(c) > 0) then
            if (marked(c)) least = min(least, candidate_opening(problem, state, c))
         else if (marked(c) .or. marked(next)) then
            gap = new_element_gap(problem, state, problem%candidates, c)
            if (collocates(problem%model%mesh%family(gap%profile%element))) call mend_ends(problem, state, gap%profile, 2)
            call gap_extreme(problem, gap, .false., 0.0_wp, 1.0_wp, value, place)
            least = min(least, value)
         end if
      end do
   end function smallest_gap
end module gap_profile
