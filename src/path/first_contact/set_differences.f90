!> Differences between the present contact set and one found by contact at nodes: the label of the change, and the numbers of the
!> contacts that continue. (Sets found by edits need no comparison, see edit_labels.)
!>
!> Contacts are compared along strips, where a line contact that passes a segment boundary is one contact. A contact of one set
!> continues one of the other set if both touch the same obstacle and overlap or are near.
module set_differences
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use rod_strips, only: strip_t, find_strips, on_strips, strip_place, brought_near
   use span_candidates, only: present_contact_spans
   use other_set, only: other_set_t
   use edit_labels, only: edit_count_t, set_label, contacts_of
   implicit none
   private
   public :: label_and_number

contains

   !> Labels the change from the present contact set to the next one, and numbers the contacts of the next set. Contact is gained
   !> (C+) where a contact of the next set continues no present contact, or several that merge. Contact is lost (C-) where no
   !> contact continues a present one, or several do (it splits). A contact that only moves gives no label.
   subroutine label_and_number(problem, state, near, last, next)
      type(problem_t), intent(in) :: problem       !! with the present set
      type(state_t), intent(in) :: state           !! of `problem`, at the change
      real(wp), intent(in) :: near                 !! distance within which one contact continues another / length of the strip
      integer, intent(in) :: last                  !! last number given to a contact span
      type(other_set_t), intent(inout) :: next     !! receives the label; its contact spans get their numbers
      type(strip_t), allocatable :: strip(:)
      type(contact_span_t), allocatable :: before(:), after(:)
      logical, allocatable :: same(:, :)
      integer :: split
      strip = find_strips(problem%layout)
      call number_contacts(strip, near, on_strips(strip, present_contact_spans(problem, state)), last, next)
      before = contacts_of(strip, problem, state)
      after = contacts_of(strip, next%problem, next%state)
      same = continued(strip, near, before, after)
      split = sum(max(count(same, 2) - 1, 0))
      call set_label(edit_count_t(gained=count(.not. any(same, 1)) + sum(max(count(same, 1) - 1, 0)), &
         & lost=count(.not. any(same, 2)) + split, split=split), next)
   end subroutine label_and_number

   !> Numbers the contacts of the next set. A contact that continues another keeps its number; if several continue one contact, the
   !> first keeps the number. All other contacts are new.
   subroutine number_contacts(strip, near, before, last, next)
      type(strip_t), intent(in) :: strip(:)
      real(wp), intent(in) :: near
      type(contact_span_t), intent(in) :: before(:) !! present contacts on strips
      integer, intent(in) :: last                  !! last number given
      type(other_set_t), intent(inout) :: next
      type(contact_span_t), allocatable :: spans(:), now(:)
      logical, allocatable :: same(:, :)
      integer :: j, k, on
      real(wp) :: place, along(1)
      spans = present_contact_spans(next%problem, next%state)
      now = on_strips(strip, spans)
      same = continued(strip, near, before, now)
      do k = 1, size(now)
         now(k)%number = last + k
         j = findloc(same(:, k), .true., 1)
         if (j == 0) cycle
         now(k)%number = before(j)%number
         same(j, :) = .false.
      end do
      ! All pieces of a contact, one in each rod segment, have its number.
      do j = 1, size(spans)
         call strip_place(strip, spans(j)%rod_segment, 0.5_wp * sum(spans(j)%at), on, place)
         do k = 1, size(now)
            if (now(k)%contact /= spans(j)%contact .or. now(k)%rod_segment /= on) cycle
            along = brought_near(strip(on), [place], 0.5_wp * sum(now(k)%at))
            if (along(1) >= now(k)%at(1) .and. along(1) <= now(k)%at(2)) next%problem%contact_span(j)%number = now(k)%number
         end do
      end do
   end subroutine number_contacts

   !> Matrix (before, now), true: the contact of the set `now` continues that of the set `before`. For this comparison the contacts
   !> of either set are widened at both ends by `near`, at most to the middle between two contacts of the same set.
   function continued(strip, near, before, now) result(same)
      type(strip_t), intent(in) :: strip(:)
      real(wp), intent(in) :: near                 !! distance within which one contact continues another / length of the strip
      type(contact_span_t), intent(in) :: before(:), now(:) !! contacts on strips
      logical :: same(size(before), size(now))
      same = overlap(before, now) .or. transpose(overlap(now, before))

   contains

      !> (set, other) true: a widened contact of one set overlaps a contact of the other set.
      function overlap(set, other)
         type(contact_span_t), intent(in) :: set(:), other(:)
         logical :: overlap(size(set), size(other))
         real(wp) :: at(2), reach(2)
         integer :: j, k
         overlap = .false.
         do j = 1, size(set)
            associate (one => set(j), on => strip(set(j)%rod_segment))
               reach = near * on%length()
               do k = 1, size(set)
                  if (k == j .or. .not. same_contact_and_strip(set(k), one)) cycle
                  at = brought_near(on, set(k)%at, 0.5_wp * sum(one%at))
                  if (at(2) < one%at(1)) reach(1) = min(reach(1), 0.5_wp * (one%at(1) - at(2)))
                  if (at(1) > one%at(2)) reach(2) = min(reach(2), 0.5_wp * (at(1) - one%at(2)))
               end do
               do k = 1, size(other)
                  if (.not. same_contact_and_strip(other(k), one)) cycle
                  at = brought_near(on, other(k)%at, 0.5_wp * sum(one%at))
                  overlap(j, k) = at(1) <= one%at(2) + reach(2) .and. one%at(1) - reach(1) <= at(2)
               end do
            end associate
         end do
      end function overlap

      !> True if two contact spans belong to the same contact and the same strip.
      pure logical function same_contact_and_strip(one, other)
         type(contact_span_t), intent(in) :: one, other
         same_contact_and_strip = one%contact == other%contact .and. one%rod_segment == other%rod_segment
      end function same_contact_and_strip
   end function continued
end module set_differences
