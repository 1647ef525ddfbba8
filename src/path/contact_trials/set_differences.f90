!> Contacts that continue from one contact set to the next and keep their numbers, and those that are lost, gained, divided or
!> merged.
module set_differences
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t
   use span_candidates, only: present_contact_spans
   use next_spans, only: next_t
   use path_state, only: path_state_t
   implicit none
   private
   public :: number_contacts

   !> Numbers of contacts lost, gained, divided and merged from one contact set to the next.
   type :: differences_t
      integer :: lost = 0, gained = 0, divided = 0, merged = 0
   end type differences_t

contains

   !> Determines the contacts lost or gained by comparing the next set with the present one; they are reported at the next set's
   !> first point.
   subroutine number_contacts(problem, run, before, next)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(contact_span_t), intent(in) :: before(:) !! the present contact spans
      type(next_t), intent(inout) :: next          !! its contacts get their numbers
      type(differences_t) :: differences
      integer :: begun, ended
      call compare_sets(before, run%spans_begun, problem%chain_start, &
         & present_contact_spans(next%problem, next%state), next%problem%contact_span, differences)
      begun = differences%gained + differences%merged
      ended = differences%lost + differences%divided
      if (begun > 0) next%label = 'C+'
      if (ended > 0) next%label = 'C-'
      next%times = begun + ended
      next%divides = differences%divided > 0 .and. differences%lost == 0
   end subroutine number_contacts

   !> Gives numbers to contacts: those that overlap a contact of the former set continue it and keep its number. The others are new.
   !> Parts of a line contact on both sides of a segment boundary are one contact, and a contact that crosses a boundary continues.
   pure subroutine compare_sets(before, last, start, now, contact_span, differences)
      type(contact_span_t), intent(in) :: before(:)
      integer, intent(in) :: last                  !! last number given
      real(wp), intent(in) :: start(:, :)          !! (rod segments, contacts) coordinate of the segment's beginning along the chain
      type(contact_span_t), intent(in) :: now(:)
      type(contact_span_t), intent(inout) :: contact_span(:) !! contact spans of `now`, to receive the numbers
      type(differences_t), intent(out) :: differences
      logical :: over(size(before), size(now)), both(size(before), size(now))
      integer :: k, j, part(size(before)), part_now(size(now))
      do k = 1, size(now)
         over(:, k) = [(apart(before(j), now(k)) <= 0.0_wp, j=1, size(before))]
      end do
      do k = 1, size(now)
         contact_span(k)%number = last + k
         j = findloc(over(:, k) .and. before%rod_segment == now(k)%rod_segment, .true., 1)
         if (j == 0) j = findloc(over(:, k), .true., 1)
         ! If a contact has divided, its first part keeps the number.
         if (j > 0) then
            if (findloc(over(j, :) .and. (now%rod_segment == before(j)%rod_segment .or. .not. any(over(j, :) .and. &
               & now%rod_segment == &
               & before(j)%rod_segment)), .true., 1) == k) contact_span(k)%number = before(j)%number
         end if
      end do
      part = first_parts(before)
      part_now = first_parts(now)
      both = .false.
      do k = 1, size(now)
         do j = 1, size(before)
            if (over(j, k)) both(part(j), part_now(k)) = .true.
         end do
      end do
      associate (whole => part == [(j, j=1, size(part))], whole_now => part_now == [(k, k=1, size(part_now))])
         differences%lost = count(whole .and. .not. any(both, 2))
         differences%gained = count(whole_now .and. .not. any(both, 1))
         differences%divided = sum(max(count(both, 2) - 1, 0))
         differences%merged = sum(max(count(both, 1) - 1, 0))
      end associate

   contains

      !> Distance of two contact spans along the rod, < 0 if they overlap; huge for different contacts.
      pure real(wp) function apart(one, other)
         type(contact_span_t), intent(in) :: one, other
         real(wp) :: a(2), b(2)
         apart = huge(apart)
         if (one%contact /= other%contact) return
         a = one%at + start(one%rod_segment, one%contact)
         b = other%at + start(other%rod_segment, other%contact)
         apart = max(a(1) - b(2), b(1) - a(2))
      end function apart
   end subroutine compare_sets

   !> For each contact span the first one of the same contact: parts of a line contact share the candidate at the segment boundary
   !> between them.
   pure function first_parts(set) result(first)
      type(contact_span_t), intent(in) :: set(:)
      integer :: first(size(set)), k, j
      first = [(k, k=1, size(set))]
      do k = 2, size(set)
         do j = 1, k - 1
            if (any(set(k)%candidate == set(j)%candidate([2, 1]))) where (first == first(k)) first = first(j)
         end do
      end do
   end function first_parts
end module set_differences
