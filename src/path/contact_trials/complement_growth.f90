!> Growth of gaps and contact forces after a change of contact. Gap and force of a contact are complementary: if the contact is
!> closed, its force must grow from zero along the path; if it is open, its gap must.
module complement_growth
   use kinds, only: wp
   use contact_spans, only: contact_span_t
   use rod_strips, only: strip_place, coincide
   use span_candidates, only: present_contact_spans
   use free_span_gap, only: gap_at
   use span_forces, only: end_force
   use beginning_contacts, only: candidate_of
   use neighbours, only: edit_add, edit_remove
   use test_kinds, only: span_test_t, test_gap, test_force
   use other_set, only: other_set_t
   use tried_sets, only: change_place_t, tried_set_t
   implicit none
   private
   public :: complement_grows

contains

   !> True unless a contact that has begun is pulled, or the gap of an open contact closes. Several gaps or forces may be zero at
   !> the change; the gaps of contacts that stay open must grow, too. Growth is measured from the set's first equilibrium, because
   !> gaps and forces are not exactly zero there: it is solved on another mesh, and the error of a gap inside an element exceeds the
   !> change of this gap over the step.
   logical function complement_grows(here, trial, there) result(grows)
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(in) :: trial
      type(other_set_t), intent(in) :: there  !! the set, at another point of its path
      type(contact_span_t), allocatable :: before(:)
      integer :: k, number                    ! number of the contact span at the place of a test; 0: the gap is open at this place
      grows = .true.
      if (.not. here%at_change() .or. trial%edits > 1) return
      before = present_contact_spans(here%problem, here%state)
      do k = 1, size(here%zero)
         associate (zero => here%zero(k))
            if (zero%kind == test_gap .and. trial%edit == edit_add) then
               number = contact_begun(here, trial, zero)
               if (number == 0) grows = grows .and. gap_grows(zero%contact, zero%rod_segment, zero%at)
            else if (zero%kind == test_force .and. trial%edit == edit_remove) then
               associate (former => before(zero%contact_span))
                  number = merge(former%number, 0, any(trial%set%problem%contact_span%number == former%number))
                  if (number == 0) grows = grows .and. gap_grows(former%contact, former%rod_segment, former%at(1))
               end associate
            else
               cycle
            end if
            if (number > 0) grows = grows .and. force_grows(candidate_of(trial%set%problem, number))
         end associate
      end do

   contains

      !> True if the force of a point contact grows.
      logical function force_grows(c)
         integer, intent(in) :: c !! candidate of the contact; 0: none, because another contact holds this breakpoint, too
         force_grows = c == 0
         if (c > 0) force_grows = end_force(there%problem, there%state, c) > end_force(there%problem, trial%set%state, c)
      end function force_grows

      !> True if the gap grows at a place of the rod.
      logical function gap_grows(contact, rod_segment, at)
         integer, intent(in) :: contact, rod_segment
         real(wp), intent(in) :: at              !! coordinate along the rod segment
         gap_grows = gap_at(there%problem, there%state, contact, rod_segment, at) > gap_at(there%problem, trial%set%state, &
            & contact, rod_segment, at)
      end function gap_grows
   end function complement_grows

   !> Number of the contact that an edit has begun where a gap is zero, 0: none. (The contact may move along the rod until its force
   !> is zero.)
   integer function contact_begun(here, trial, gap) result(number)
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(in) :: trial
      type(span_test_t), intent(in) :: gap
      real(wp) :: along
      integer :: k, on
      number = 0
      call strip_place(here%strip, gap%rod_segment, gap%at, on, along)
      do k = 1, size(trial%edited)
         associate (one => trial%edited(k))
            if (one%number <= here%spans_begun .or. one%contact /= gap%contact .or. one%rod_segment /= on) cycle
            if (coincide(here%strip(on), one%at(1), along)) number = one%number
         end associate
      end do
   end function contact_begun
end module complement_growth
