!> Label of a change of contact, from the edits that lead to the next contact set. An edit keeps the number of each contact that
!> continues, however far this contact moves until the set's first equilibrium; new contacts get new numbers. The kind of the edit
!> tells whether a new contact is gained or split off, and whether a contact that is missing was lost or merged with another one. A
!> missing contact has merged, too, if another contact has spread over its place.
module edit_labels
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use rod_strips, only: strip_t, on_strips, brought_near
   use span_candidates, only: present_contact_spans
   use breakpoint_forces, only: is_supported
   use other_set, only: other_set_t
   use contact_labels, only: contact_label, contact_lost
   use neighbours, only: edit_part, edit_leave, edit_ends, edit_open, edit_end_off, edit_jump, edit_rise, edit_lie_down, edit_merge
   implicit none
   private
   public :: edit_count_t, counted, set_label, contacts_of

   !> Numbers of contacts that edits have gained and lost.
   type :: edit_count_t
      integer :: gained = 0                      !! new contacts, and merges of two contacts
      integer :: lost = 0                        !! contacts that ended, and splits of a contact
      integer :: split = 0                       !! splits only
   end type edit_count_t

contains

   !> Adds to a count what one more edit has gained and lost.
   pure type(edit_count_t) function counted(before_edit, strip, edit, parent, beside, before, after) result(number)
      type(edit_count_t), intent(in) :: before_edit
      type(strip_t), intent(in) :: strip(:)
      integer, intent(in) :: edit                !! kind of the edit (neighbours)
      integer, intent(in) :: parent              !! number of the contact that the edit has changed, 0: none
      integer, intent(in) :: beside(2) !! numbers of the contacts beside a free span that closes, 0: none: if one of two is missing,
      !! it has merged with the other
      type(contact_span_t), intent(in) :: before(:), after(:) !! contacts on strips, before the edit and after it
      integer :: k, new, missing, covered, changed ! contacts that begin; that are missing, and among them those that have merged;
      ! that lie on another obstacle
      logical :: closes                   ! the free span lies between two contacts
      new = count([(.not. any(before%number == after(k)%number), k=1, size(after))])
      missing = count([(.not. any(after%number == before(k)%number), k=1, size(before))])
      closes = any(before%number == beside(1)) .and. any(before%number == beside(2))
      covered = count([(.not. any(after%number == before(k)%number) .and. ((closes .and. any(beside == before(k)%number)) .or. &
         & any(overlap(before(k), after))), k=1, size(before))])
      changed = count([(any(before%number == after(k)%number .and. before%contact /= after(k)%contact), k=1, size(after))])
      number = before_edit
      select case (edit)
      case (edit_part, edit_leave, edit_ends, edit_open, edit_end_off, edit_jump)
         if (any(before%number == parent)) then
            number%split = number%split + max(new - missing, 0)
            number%lost = number%lost + abs(new - missing)
         else
            ! The new contact has come off a clamped node, which is no contact by itself.
            number%gained = number%gained + new
            number%lost = number%lost + missing
         end if
      case (edit_rise)
         number%split = number%split + new / 2
         number%lost = number%lost + new / 2
         number%gained = number%gained + new - new / 2
      case (edit_lie_down, edit_merge)
         number%gained = number%gained + new + missing
      case default
         number%gained = number%gained + new + changed + covered
         number%lost = number%lost + missing + changed - covered
      end select

   contains

      !> True if a contact lies at the place of another one with the same obstacle.
      elemental logical function overlap(one, other)
         type(contact_span_t), intent(in) :: one, other
         real(wp) :: at(2)
         overlap = one%contact == other%contact .and. one%rod_segment == other%rod_segment
         if (.not. overlap) return
         at = brought_near(strip(one%rod_segment), other%at, 0.5_wp * sum(one%at))
         overlap = at(1) <= one%at(2) .and. at(2) >= one%at(1)
      end function overlap
   end function counted

   !> Labels a set as contact gained (C+) or lost (C-); if contacts are gained and lost at once, the larger number counts.
   pure subroutine set_label(number, next)
      type(edit_count_t), intent(in) :: number
      type(other_set_t), intent(inout) :: next
      next%label = contact_label(number%gained, number%lost)
      next%times = max(number%gained, number%lost)
      next%divides = next%label == contact_lost .and. number%lost == number%split
   end subroutine set_label

   !> Contacts of a state along the strips. A node clamped on an obstacle, without contact beside it, is no contact.
   function contacts_of(strip, problem, state) result(set)
      type(strip_t), intent(in) :: strip(:)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), allocatable :: set(:)
      integer :: k
      set = on_strips(strip, present_contact_spans(problem, state))
      set = pack(set, set%line .or. .not. [(is_supported(problem, state, set(k)%candidate(1)), k=1, size(set))])
   end function contacts_of
end module edit_labels
