!> Changes of contact that the mesh is too coarse to show.
!>
!> Contact with a foundation may have opened undetected between two points of certain contact (may_be_open).
!>
!> An element on a foundation may be several characteristic lengths long. If its polynomial is accurate enough, an opening inside is
!> visible in its gap between the nodes. If the sign of this gap is uncertain, contact may have opened undetected, and only shorter
!> elements can show the opening. An element too long to resolve its foundation gives only a mean gap, plus waves of the gap that
!> begin at its nodes and decay into the element.
!>
!> Contact may have begun undetected in free spans whose gaps the mesh is too coarse to compute (may_touch). The error bars of the
!> reported numbers need not show such a contact. For example, the force with which the ground supports a ring is the weight of the
!> ring on any mesh.
module hidden_contacts
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_record, only: region_t
   use element_gap, only: element_gap_t, gap_value, gap_extreme, most_samples
   use rod_profile, only: profile_error_bound
   use ground_regions, only: find_ground_regions, part_of_range, rounds
   use ground_segments, only: gap_uncertainty, follows, gap_in_state, mean_gap_and_waves, gap_rounding
   use span_tests, only: run_span_tests
   use test_kinds, only: span_test_t, test_gap
   use state_transfer, only: kept_t, point_displacement
   use error_bar, only: resolved
   implicit none
   private
   public :: may_be_open, may_touch

   real(wp), parameter :: compared(2) = [1.0_wp / 3.0_wp, 0.5_wp] !! places in an element, 0 to 1, at which the original and the
   !! enriched polynomial are compared. Two places, because at a single one the difference between polynomials of neighbouring
   !! orders may vanish

contains

   !> (elements) true: contact may have opened undetected in the element. Elements whose gap is uncertain only because of rounding
   !> do not count.
   function may_be_open(problem, state) result(doubtful)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      logical :: doubtful(problem%model%mesh%n_elements)
      type(region_t), allocatable :: regions(:)
      type(element_gap_t) :: gap
      real(wp) :: range(2), known, settled, wave(2), waves, peak, at, rounding
      real(wp), dimension(0:most_samples) :: place, value, uncertainty ! samples in an element: place, gap, its largest error
      logical :: waits(problem%model%mesh%n_elements)   ! true: the element is in the list `waiting`
      integer :: waiting(problem%model%mesh%n_elements) ! elements passed since the last place of certain contact
      integer :: n_waiting, k, c, j, e, round, last
      logical :: certain                         ! true: a place of certain contact was found before in this region
      logical :: rounds_off                      ! true: the uncertainty of the gap is only rounding
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
               if (.not. part_of_range(problem, state, regions(k)%contact, c, round, regions(k)%start, regions(k)%end, range)) cycle
               if (problem%ground%chain%bilateral(c)) cycle
               e = problem%ground%chain%element(2, c)
               if (.not. follows(problem, state, c)) then
                  call mean_gap_and_waves(problem, state, c, settled, wave)
                  call check_decayed_wave(wave(1))
                  call check_decayed_wave(0.0_wp)
                  call check_decayed_wave(wave(2))
                  cycle
               end if
               gap = gap_in_state(problem, state, c)
               known = gap_uncertainty(gap, rounding)
               rounds_off = known < 2.0_wp * rounding
               last = gap%samples
               do j = 0, last
                  place(j) = range(1) + (range(2) - range(1)) * j / last
                  value(j) = gap_value(problem, gap, place(j))
                  uncertainty(j) = max(known, profile_error_bound(gap%profile, place(j)))
               end do
               ! Second differences bound what the gap exceeds its samples by. Where that leaves contact certain, the largest gap
               ! between the samples is not needed.
               waves = maxval(abs(value(:last - 2) - 2.0_wp * value(1:last - 1) + value(2:last)))
               at = range(1)
               if (maxval(value(:last)) + waves >= -maxval(uncertainty(:last))) &
                  & call gap_extreme(problem, gap, .true., range(1), range(2), peak, at)
               do j = 0, last
                  call classify(value(j), uncertainty(j))
                  if (at > place(j) .and. at < place(min(j + 1, last))) &
                     & call classify(peak, max(known, profile_error_bound(gap%profile, at)))
               end do
            end do
         end do
      end do

   contains

      !> Classifies one place of an element too long for its foundation: an end, with the amplitude of the wave there, or the
      !> middle, where the waves have decayed.
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

   !> True if a least gap between rod and obstacle is no larger than the structure's motion and differs between the original and the
   !> enriched problem by more than the part `resolved` of this motion: contact may then have begun undetected.
   logical function may_touch(problem, state, scale, motion, finer, solved) result(may)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      real(wp), intent(in) :: scale              !! scale of forces
      real(wp), intent(in) :: motion             !! largest displacement of a node [length]
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: solved        !! state of the enriched problem at the same point of the path
      type(span_test_t), allocatable :: gap(:), other(:)
      may = .false.
      if (.not. problem%has_spans()) return
      ! The displacements are compared first, because they cost much less than the least gaps.
      if (position_error(problem, state, finer, solved) <= resolved * motion) return
      gap = run_span_tests(problem, state, scale, only=1)
      other = run_span_tests(finer, solved, scale, only=1)
      may = any(gap%kind == test_gap .and. abs(gap%value) * problem%size <= motion .and. &
         & abs(other%value - gap%value) * problem%size > resolved * motion)
   end function may_touch

   !> Largest difference between the displacements of the original and the enriched problem, at nodes and inside elements [length].
   real(wp) function position_error(problem, state, finer, solved) result(error)
      type(problem_t), intent(in) :: problem, finer
      type(state_t), intent(in) :: state, solved
      type(kept_t) :: kept, other
      real(wp) :: u(3), v(3)
      integer :: e, k
      error = maxval(norm2(solved%u(1:2, :) - state%u(1:2, :), 1))
      do e = 1, problem%model%mesh%n_elements
         if (problem%conforms(e) > 0) cycle
         do k = 1, size(compared)
            call point_displacement(problem, state, e, compared(k), kept, u)
            call point_displacement(finer, solved, e, compared(k), other, v)
            error = max(error, norm2(v(1:2) - u(1:2)))
         end do
      end do
   end function position_error
end module hidden_contacts
