!> Elements in which contact with a foundation may have opened undetected: the mesh is too coarse to show whether contact is
!> continuous between two points of certain contact.
!>
!> An element on a foundation may be several characteristic lengths long. If its polynomial is accurate enough, an opening inside is
!> visible in its gap between the nodes. If the sign of this gap is uncertain, contact may have opened undetected, and only shorter
!> elements can show it. An element too long to resolve its foundation gives only a mean gap, on which waves are superimposed that
!> decay from its nodes.
module hidden_openings
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_record, only: region_t
   use element_gap, only: element_gap_t, gap_value, gap_extreme
   use rod_profile, only: profile_error_bound
   use ground_regions, only: find_ground_regions, part_of_range, rounds
   use ground_segments, only: gap_uncertainty, follows, gap_in_state, mean_gap_and_waves, gap_rounding
   implicit none
   private
   public :: may_be_open

contains

   !> Marks the elements in which contact may have opened undetected. Places that are certainly open, or uncertain only because of
   !> rounding, do not count.
   function may_be_open(problem, state) result(doubtful)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      logical :: doubtful(problem%model%mesh%n_elements)
      type(region_t), allocatable :: regions(:)
      type(element_gap_t) :: gap
      real(wp) :: range(2), known, settled, waves(2), peak, at, place
      real(wp) :: rounding
      logical :: waits(problem%model%mesh%n_elements)   ! true: the element is in the list `waiting`
      integer :: waiting(problem%model%mesh%n_elements) ! elements without certain contact since the last place of certain contact
      integer :: n_waiting, k, c, j, e, round
      logical :: certain                         ! true: certain contact was found at an earlier place
      logical :: rounds_off                      ! true: the uncertainty is caused by rounding
      doubtful = .false.
      if (.not. any(problem%ground%founded)) return
      rounding = gap_rounding(state)
      waits = .false.
      n_waiting = 0
      regions = find_ground_regions(problem, state)
      do k = 1, size(regions)
         certain = .false.
         call clear_waiting()
         do round = 0, rounds(problem, regions(k)%contact)
            do c = 1, problem%ground%chain%n
               if (.not. part_of_range(problem, state, regions(k)%contact, c, round, regions(k)%start, regions(k)%end, range)) &
                  & cycle
               if (problem%ground%chain%bilateral(c)) cycle
               e = problem%ground%chain%element(2, c)
               if (.not. follows(problem, state, c)) then
                  call mean_gap_and_waves(problem, state, c, settled, waves)
                  call check_decayed_wave(waves(1))
                  call check_decayed_wave(0.0_wp)
                  call check_decayed_wave(waves(2))
                  cycle
               end if
               gap = gap_in_state(problem, state, c)
               known = gap_uncertainty(gap, rounding)
               rounds_off = known < 2.0_wp * rounding
               call gap_extreme(problem, gap, .true., range(1), range(2), peak, at)
               do j = 0, gap%samples
                  place = range(1) + (range(2) - range(1)) * j / gap%samples
                  if (j > 0 .and. at > range(1) + (range(2) - range(1)) * (j - 1) / gap%samples .and. at < place) &
                     & call classify(peak, max(known, profile_error_bound(gap%profile, at)))
                  call classify(gap_value(problem, gap, place), max(known, profile_error_bound(gap%profile, place)))
               end do
            end do
         end do
      end do

   contains

      !> Checks one end of an element too long for its foundation, or its middle, where the wave from the end has decayed.
      subroutine check_decayed_wave(wave)
         real(wp), intent(in) :: wave            !! amplitude of the wave
         rounds_off = wave < 2.0_wp * rounding
         call classify(settled, max(wave, rounding))
      end subroutine check_decayed_wave

      !> Classifies a place in an element. If elements without certain contact lie between two places of certain contact, they may
      !> have opened.
      subroutine classify(value, uncertainty)
         real(wp), intent(in) :: value           !! gap at the place
         real(wp), intent(in) :: uncertainty           !! largest error of the gap
         if (value < -uncertainty) then
            doubtful(waiting(:n_waiting)) = .true.
            call clear_waiting()
            certain = .true.
         else if (certain .and. .not. (rounds_off .or. waits(e))) then
            n_waiting = n_waiting + 1
            waiting(n_waiting) = e
            waits(e) = .true.
         end if
      end subroutine classify

      !> Empties the list of elements in `waiting`.
      subroutine clear_waiting()
         waits(waiting(:n_waiting)) = .false.
         n_waiting = 0
      end subroutine clear_waiting
   end function may_be_open
end module hidden_openings
