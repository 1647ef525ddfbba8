!> Whether a mesh is too coarse to say that contact with a foundation goes on between its ends.
!>
!> An element on a foundation may be some layers long; what lifts off inside of it is seen by its gap between the nodes, as well as
!> its polynomial tells that. (Elements that are too long to follow their foundation tell nothing of it between their nodes.)
module hidden_openings
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use path_record, only: region_t
   use ground_regions, only: find_ground_regions, inner_opening, smallest_ground_gap
   use ground_segments, only: gap_uncertainty, follows
   implicit none
   private
   public :: may_be_open

contains

   !> True where the largest gap inside some region of contact is as near to zero as the gap is known there.
   logical function may_be_open(problem, state) result(open)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(region_t), allocatable :: regions(:)
      real(wp) :: opening, known
      integer :: k, candidate
      open = .false.
      if (.not. any(problem%ground%founded)) return
      regions = find_ground_regions(problem, state)
      do k = 1, size(regions)
         associate (at => regions(k))
            opening = inner_opening(problem, state, at%contact, at%start, at%end, candidate)
            if (candidate == 0) cycle
            if (problem%ground%chain%bilateral(candidate) .or. .not. follows(problem, state, candidate)) cycle
            known = gap_uncertainty(problem, state, candidate)
            ! What is nowhere deeper than that, or than places are rounded, is as good as no contact.
            if (smallest_ground_gap(problem, state, at%contact, at%start, at%end) < -max(known, rounding_gap(problem))) &
               & open = open .or. opening > -known
         end associate
      end do
   end function may_be_open
end module hidden_openings
