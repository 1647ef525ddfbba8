!> Differences between two contact sets: the label of the change, and the numbers of the contact spans that continue.
!>
!> Contacts are compared along strips, where a line contact that passes a segment boundary is one contact. A contact after the
!> change continues a contact before it if both touch the same obstacle and overlap or are near. It also continues that contact if
!> the edit of the set kept the contact's number, because it may have moved far since. A node clamped on an obstacle, without
!> contact beside it, is no contact.
module set_differences
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use rod_strips, only: strip_t, find_strips, strip_place, on_strips, brought_near
   use span_candidates, only: present_contact_spans
   use breakpoint_forces, only: is_supported
   use other_set, only: other_set_t
   use contact_labels, only: contact_label, contact_lost
   implicit none
   private
   public :: label_and_number

contains

   !> Labels the change from the present contact set to the next one, and numbers the contact spans of the next set. Contact is
   !> gained (C+) where a contact of the next set continues no present contact, or several that merge. Contact is lost (C-) where no
   !> contact continues a present one, or several do (it splits); if contacts are gained and lost at once, the larger number counts.
   !> A contact that only moves gives no label.
   subroutine label_and_number(problem, state, near, last, now, next)
      type(problem_t), intent(in) :: problem       !! with the present set
      type(state_t), intent(in) :: state           !! of `problem`, at the change
      real(wp), intent(in) :: near                 !! distance within which one contact continues another / length of the strip
      integer, intent(in) :: last                  !! last number given to a contact span
      type(contact_span_t), intent(in) :: now(:)   !! contact spans of the next set, with their ends at the change
      type(other_set_t), intent(inout) :: next     !! receives the label; its contact spans get their numbers
      type(strip_t), allocatable :: strip(:)
      type(contact_span_t), allocatable :: before(:), after(:)
      logical, allocatable :: same(:, :)
      integer :: gained, split, lost
      strip = find_strips(problem%layout)
      before = present_contact_spans(problem, state)
      same = continued(strip, near, placed(strip, before), placed(strip, now)) .or. same_number(before, now)
      call number_spans(problem%contact_span, same, last, next%problem%contact_span)
      before = contacts(strip, problem, state, before)
      after = contacts(strip, next%problem, next%state, now)
      same = continued(strip, near, before, after) .or. same_number(before, after)
      gained = count(.not. any(same, 1)) + sum(max(count(same, 1) - 1, 0))
      split = sum(max(count(same, 2) - 1, 0))
      lost = count(.not. any(same, 2)) + split
      next%label = contact_label(gained, lost)
      next%times = max(gained, lost)
      next%divides = next%label == contact_lost .and. lost == split
   end subroutine label_and_number

   !> Contact spans in coordinates along the strips.
   pure function placed(strip, spans) result(set)
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: spans(:)
      type(contact_span_t) :: set(size(spans))
      real(wp) :: along(2)
      integer :: k, i, on
      set = spans
      do k = 1, size(set)
         do i = 1, 2
            call strip_place(strip, set(k)%rod_segment, set(k)%at(i), on, along(i))
         end do
         set(k)%rod_segment = on
         set(k)%at = along
      end do
   end function placed

   !> Contacts along the strips, without nodes clamped on an obstacle.
   function contacts(strip, problem, state, spans) result(set)
      type(strip_t), intent(in) :: strip(:)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: spans(:) !! contact spans of `problem`
      type(contact_span_t), allocatable :: set(:)
      integer :: k
      set = on_strips(strip, spans)
      set = pack(set, set%line .or. .not. [(is_supported(problem, state, set(k)%candidate(1)), k=1, size(set))])
   end function contacts

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

   !> (before, now) true: the two contacts have the same number. An edit keeps the number of a contact that continues.
   pure function same_number(before, now) result(same)
      type(contact_span_t), intent(in) :: before(:), now(:)
      logical :: same(size(before), size(now))
      integer :: k
      do k = 1, size(now)
         same(:, k) = before%number == now(k)%number .and. now(k)%number > 0
      end do
   end function same_number

   !> Numbers the contact spans of the next set. A span that continues another keeps its number. If several continue one span, the
   !> first on the same rod segment keeps the number. All other spans are new.
   pure subroutine number_spans(before, same, last, now)
      type(contact_span_t), intent(in) :: before(:)
      logical, intent(in) :: same(:, :)            !! (before, now) true: the span continues that before the change
      integer, intent(in) :: last                  !! last number given
      type(contact_span_t), intent(inout) :: now(:)
      logical :: taken(size(before))
      integer :: j, k, round
      taken = .false.
      do k = 1, size(now)
         now(k)%number = last + k
      end do
      do round = 1, 2
         do k = 1, size(now)
            if (now(k)%number <= last) cycle
            j = findloc(same(:, k) .and. .not. taken .and. (before%rod_segment == now(k)%rod_segment .or. round == 2), .true., 1)
            if (j == 0) cycle
            now(k)%number = before(j)%number
            taken(j) = .true.
         end do
      end do
   end subroutine number_spans
end module set_differences
