!> Edits of a contact set: each function makes a new set of contact spans from a given one. Added contact spans are at the end of
!> the new set; their identity number is 0 until `numbered` gives them one.
module contact_set_edits
   use kinds, only: wp
   use contact_spans, only: contact_span_t
   implicit none
   private
   public :: begun, lost, spread_out, parted, shrunk, extended, laid_down, merged, end_moved, opened, numbered, same_set

contains

   !> Adds a point contact to the set.
   pure function begun(set, contact, rod_segment, at) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: contact, rod_segment !! index of the contact, index of the rod segment
      real(wp), intent(in) :: at                  !! coordinate along the rod segment
      type(contact_span_t), allocatable :: new(:)
      new = [set, contact_span_t(contact=contact, rod_segment=rod_segment, at=[at, at])]
   end function begun

   !> Removes contact span k from the set.
   pure function lost(set, k) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      type(contact_span_t), allocatable :: new(:)
      new = [set(:k - 1), set(k + 1:)]
   end function lost

   !> Makes contact span k a line contact and extends it on both sides within its rod segment.
   pure function spread_out(set, k, by, ends) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: by                !! length by which the contact is extended on each side
      real(wp), intent(in) :: ends(2)           !! coordinates of the ends of the rod segment or strip
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%line = .true.
      new(k)%at = [max(set(k)%at(1) - by, ends(1)), min(set(k)%at(2) + by, ends(2))]
   end function spread_out

   !> Replaces point contact k by two point contacts.
   pure function parted(set, k, apart) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: apart             !! distance between the two point contacts
      type(contact_span_t), allocatable :: new(:)
      new = begun(set, set(k)%contact, set(k)%rod_segment, set(k)%at(2) + 0.5_wp * apart)
      new(k)%at = set(k)%at - 0.5_wp * apart
   end function parted

   !> Replaces contact span k by a point contact.
   pure function shrunk(set, k, at) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: at !! coordinate along the rod segment
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%line = .false.
      new(k)%at = at
   end function shrunk

   !> Extends contact span k to a coordinate of its rod segment and makes it a line contact.
   pure function extended(set, k, to) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: to !! coordinate along the rod segment
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%line = .true.
      new(k)%at = [min(set(k)%at(1), to), max(set(k)%at(2), to)]
   end function extended

   !> Makes a free span, together with the contact spans beside it, a line contact. If there is a contact span on both sides, the
   !> one before the free span is extended over the free span and over the one behind, which is removed.
   pure function laid_down(set, beside, ends) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: beside(2) !! contact spans before and after the free span; 0: no contact span on this side (at most one
      !! may be 0)
      real(wp), intent(in) :: ends(2)           !! coordinates of the two ends of the free span
      type(contact_span_t), allocatable :: new(:)
      integer :: side
      if (all(beside > 0)) then
         associate (first => beside(1), second => beside(2))
            new = lost(extended(extended(set, first, set(second)%at(1)), first, set(second)%at(2)), second)
         end associate
      else
         side = findloc(beside > 0, .true., 1)
         new = extended(set, beside(side), ends(3 - side))
      end if
   end function laid_down

   !> Replaces two point contacts, k and `other`, of a rod segment by one point contact in the middle between them.
   pure function merged(set, k, other) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k, other
      type(contact_span_t), allocatable :: new(:)
      new = lost(shrunk(set, k, 0.5_wp * (set(k)%at(1) + set(other)%at(1))), other)
   end function merged

   !> Moves one end of contact span k. If k is a point contact, the whole contact moves.
   pure function end_moved(set, k, side, to) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      integer, intent(in) :: side               !! 1: first end, 2: last end
      real(wp), intent(in) :: to                !! coordinate along the rod segment
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%at(side) = to
      if (.not. set(k)%line) new(k)%at = to
   end function end_moved

   !> Divides line contact k into two line contacts with a free span between them.
   pure function opened(set, k, from, to) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: from, to !! coordinates of the ends of the free span
      type(contact_span_t), allocatable :: new(:)
      new = [set, contact_span_t(contact=set(k)%contact, rod_segment=set(k)%rod_segment, at=[to, set(k)%at(2)], line=.true.)]
      new(k)%at(2) = from
   end function opened

   !> Gives identity numbers to the new contact spans of a set.
   pure function numbered(set, last) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: last               !! largest identity number given so far
      type(contact_span_t), allocatable :: new(:)
      integer :: k
      new = set
      do k = 1, size(new)
         if (new(k)%number == 0) new(k)%number = last + count(set(:k)%number == 0)
      end do
   end function numbered

   !> True if two sets are the same, apart from the identity numbers of their contact spans.
   pure logical function same_set(one, other) result(same)
      type(contact_span_t), intent(in) :: one(:), other(:)
      integer :: k
      same = size(one) == size(other)
      if (.not. same) return
      do k = 1, size(one)
         same = same .and. one(k)%contact == other(k)%contact .and. one(k)%rod_segment == other(k)%rod_segment .and. &
            & (one(k)%line .eqv. other(k)%line) .and. all(abs(one(k)%at - other(k)%at) <= 0.0_wp)
      end do
   end function same_set
end module contact_set_edits
