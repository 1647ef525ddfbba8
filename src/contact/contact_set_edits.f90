!> What may happen to a contact set: each change a function from one set of touches to another. New touches come last and have
!> no number yet.
module contact_set_edits
   use kinds, only: wp
   use contact_spans, only: contact_span_t
   implicit none
   private
   public :: begun, lost, spread_out, parted, shrunk, extended, joined, laid_down, merged, end_moved, moved, opened, &
      & continued, numbered, same_set

contains

   !> One point contact more.
   pure function begun(set, contact, stretch, at) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: contact, stretch   !! as contact_span_t has them
      real(wp), intent(in) :: at
      type(contact_span_t), allocatable :: new(:)
      new = [set, contact_span_t(contact=contact, stretch=stretch, at=[at, at])]
   end function begun

   !> Contact k less.
   pure function lost(set, k) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      type(contact_span_t), allocatable :: new(:)
      new = [set(:k - 1), set(k + 1:)]
   end function lost

   !> Contact k a line that reaches further on both sides, up to the ends of its stretch.
   pure function spread_out(set, k, by, whole) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: by                !! on each side
      real(wp), intent(in) :: whole             !! length of its stretch
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%line = .true.
      new(k)%at = [max(set(k)%at(1) - by, 0.0_wp), min(set(k)%at(2) + by, whole)]
   end function spread_out

   !> Point k two points.
   pure function parted(set, k, apart) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: apart             !! their distance
      type(contact_span_t), allocatable :: new(:)
      new = begun(set, set(k)%contact, set(k)%stretch, set(k)%at(2) + 0.5_wp * apart)
      new(k)%at = set(k)%at - 0.5_wp * apart
   end function parted

   !> Contact k a point.
   pure function shrunk(set, k, at) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: at
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%line = .false.
      new(k)%at = at
   end function shrunk

   !> Contact k a line up to a place.
   pure function extended(set, k, to) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: to
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%line = .true.
      new(k)%at = [min(set(k)%at(1), to), max(set(k)%at(2), to)]
   end function extended

   !> Contact k a line up to another one of its stretch and over it.
   pure function joined(set, k, other) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k, other
      type(contact_span_t), allocatable :: new(:)
      new = lost(extended(extended(set, k, set(other)%at(1)), k, set(other)%at(2)), other)
   end function joined

   !> A line over a free span, from the contacts beside it.
   pure function laid_down(set, beside, ends) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: beside(2)          !! contacts before and after it, 0 for one: none
      real(wp), intent(in) :: ends(2)           !! of the span
      type(contact_span_t), allocatable :: new(:)
      integer :: side
      if (all(beside > 0)) then
         new = joined(set, beside(1), beside(2))
      else
         side = findloc(beside > 0, .true., 1)
         new = extended(set, beside(side), ends(3 - side))
      end if
   end function laid_down

   !> Points k and another one of its stretch a point between them.
   pure function merged(set, k, other) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k, other
      type(contact_span_t), allocatable :: new(:)
      new = lost(shrunk(set, k, 0.5_wp * (set(k)%at(1) + set(other)%at(1))), other)
   end function merged

   !> One end of contact k elsewhere; a point goes there with both.
   pure function end_moved(set, k, side, to) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      integer, intent(in) :: side               !! 1: its first end, 2: its last
      real(wp), intent(in) :: to
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%at(side) = to
      if (.not. set(k)%line) new(k)%at = to
   end function end_moved

   !> Contact k elsewhere, on any stretch.
   pure function moved(set, k, stretch, at) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k, stretch
      real(wp), intent(in) :: at(2)
      type(contact_span_t), allocatable :: new(:)
      new = set
      new(k)%stretch = stretch
      new(k)%at = at
   end function moved

   !> Line k two lines, free between two places inside.
   pure function opened(set, k, from, to) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k
      real(wp), intent(in) :: from, to
      type(contact_span_t), allocatable :: new(:)
      new = [set, contact_span_t(contact=set(k)%contact, stretch=set(k)%stretch, at=[to, set(k)%at(2)], line=.true.)]
      new(k)%at(2) = from
   end function opened

   !> Contact k with another part on another stretch.
   pure function continued(set, k, stretch, at) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: k, stretch
      real(wp), intent(in) :: at(2)
      type(contact_span_t), allocatable :: new(:)
      new = [set, contact_span_t(contact=set(k)%contact, stretch=stretch, at=at, line=set(k)%line)]
   end function continued

   !> The new ones with numbers.
   pure function numbered(set, last) result(new)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: last               !! number given last
      type(contact_span_t), allocatable :: new(:)
      integer :: k
      new = set
      do k = 1, size(new)
         if (new(k)%number == 0) new(k)%number = last + count(set(:k)%number == 0)
      end do
   end function numbered

   !> True for sets that are one and the same but for their numbers.
   pure logical function same_set(one, other) result(same)
      type(contact_span_t), intent(in) :: one(:), other(:)
      integer :: k
      same = size(one) == size(other)
      if (.not. same) return
      do k = 1, size(one)
         same = same .and. one(k)%contact == other(k)%contact .and. one(k)%stretch == other(k)%stretch .and. &
            & (one(k)%line .eqv. other(k)%line) .and. all(abs(one(k)%at - other(k)%at) <= 0.0_wp)
      end do
   end function same_set
end module contact_set_edits
