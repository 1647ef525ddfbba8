!> Converts contact sets to coordinates along whole rods, and back. In a problem contact spans are divided at segment boundaries,
!> where loads and supports act. This module joins these pieces to contacts on a continuous rod (a strip): a sequence of rod
!> segments that continue one another. The edits of contact sets (contact_set_edits) then need no rule for contacts that cross a
!> boundary. In a set on continuous rods, component `rod_segment` of a contact span is the index of the continuous rod, and `at` are
!> coordinates along this rod.
module rod_strips
   use kinds, only: wp
   use rod_layout, only: layout_t
   use contact_spans, only: contact_span_t, sort_contact_spans, point_share, initial_share
   implicit none
   private
   public :: strip_t, find_strips, on_strips, on_segments, strip_place, brought_near, coincide, same_kind

   !> A strip is a continuous rod: rod segments that continue one another.
   type :: strip_t
      integer, allocatable :: rod_segment(:)   !! indices into layout%rod_segment, in their order along the rod
      real(wp), allocatable :: start(:) !! (segments + 1) coordinates of the segment boundaries; the last one is the length of the
      !! continuous rod
      logical :: closed = .false.              !! true: the rod ends where it begins, so that coordinates are periodic
   contains
      procedure :: length => strip_length
      procedure :: ends => strip_ends
      procedure :: at_boundary
      procedure :: cell
   end type strip_t

contains

   !> All continuous rods of a structure. A closed rod is cut at the beginning of its first segment.
   function find_strips(layout) result(strip)
      type(layout_t), intent(in) :: layout
      type(strip_t), allocatable :: strip(:)
      logical :: taken(size(layout%rod_segment))
      integer :: k
      allocate (strip(0))
      taken = .false.
      ! Open continuous rods begin at nodes at which no segment ends.
      do k = 1, size(taken)
         if (.not. any(layout%rod_segment%node(2) == layout%rod_segment(k)%node(1))) call follow(k)
      end do
      do k = 1, size(taken)
         if (.not. taken(k)) call follow(k)
      end do

   contains

      subroutine follow(first)
         integer, intent(in) :: first
         type(strip_t) :: new
         integer :: at
         allocate (new%rod_segment(0), new%start(1))
         new%start = 0.0_wp
         at = first
         do while (at > 0)
            taken(at) = .true.
            new%rod_segment = [new%rod_segment, at]
            new%start = [new%start, new%start(size(new%start)) + layout%rod_segment(at)%length]
            at = findloc(.not. taken .and. layout%rod_segment%node(1) == layout%rod_segment(at)%node(2), .true., 1)
         end do
         new%closed = layout%rod_segment(first)%node(1) == layout%rod_segment(new%rod_segment(size(new%rod_segment)))%node(2)
         strip = [strip, new]
      end subroutine follow
   end function find_strips

   !> True if two contact sets have the same point and line contacts, and corresponding ends are at the same segment boundaries or
   !> inside the same segments. The places of touchdown points may differ.
   logical function same_kind(layout, one, other) result(same)
      type(layout_t), intent(in) :: layout
      type(contact_span_t), intent(in) :: one(:), other(:) !! contact sets on rod segments
      type(strip_t), allocatable :: strip(:)
      type(contact_span_t), allocatable :: a(:), b(:)
      integer :: k, side
      strip = find_strips(layout)
      a = on_strips(strip, one)
      b = on_strips(strip, other)
      same = size(a) == size(b)
      if (.not. same) return
      do k = 1, size(a)
         same = same .and. a(k)%contact == b(k)%contact .and. a(k)%rod_segment == b(k)%rod_segment .and. (a(k)%line .eqv. b(k)%line)
         if (.not. same) return
         same = all([(strip(a(k)%rod_segment)%cell(a(k)%at(side)) == strip(b(k)%rod_segment)%cell(b(k)%at(side)), side=1, 2)])
         if (.not. same) return
      end do
   end function same_kind

   !> Finds the continuous rod that contains a place on a rod segment, and the coordinate of this place along it.
   pure subroutine strip_place(strip, rod_segment, at, which, along)
      type(strip_t), intent(in) :: strip(:)
      integer, intent(in) :: rod_segment
      real(wp), intent(in) :: at               !! coordinate along the rod segment
      integer, intent(out) :: which            !! index of the continuous rod
      real(wp), intent(out) :: along           !! coordinate along the continuous rod
      integer :: k
      along = at
      do which = 1, size(strip)
         k = findloc(strip(which)%rod_segment, rod_segment, 1)
         if (k == 0) cycle
         along = strip(which)%start(k) + at
         return
      end do
   end subroutine strip_place

   !> Converts a contact set from rod segments to continuous rods, sorted. Line contacts with the same obstacle that meet at a
   !> segment boundary become a single line contact.
   pure function on_strips(strip, contact_span) result(set)
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: contact_span(:) !! contact set on rod segments
      type(contact_span_t), allocatable :: set(:)
      type(contact_span_t) :: all(size(contact_span))
      integer :: k, i, before, behind
      real(wp) :: along(2)
      do k = 1, size(all)
         all(k) = contact_span(k)
         do i = 1, 2
            call strip_place(strip, contact_span(k)%rod_segment, contact_span(k)%at(i), all(k)%rod_segment, along(i))
         end do
         all(k)%at = along
      end do
      call sort_contact_spans(all)
      allocate (set(0))
      do k = 1, size(all)
         ! Beyond the place of the path where it vanishes, a line contact has a negative length. It is then sorted behind the line
         ! contact that continues it.
         before = findloc([(continues(set(i), all(k)), i=1, size(set))], .true., 1)
         behind = findloc([(continues(all(k), set(i)), i=1, size(set))], .true., 1)
         if (before > 0) then
            set(before)%at(2) = all(k)%at(2)
         else if (behind > 0) then
            set(behind)%at(1) = all(k)%at(1)
         else
            set = [set, all(k)]
         end if
      end do
      call join_over_ends

   contains

      !> Joins line contacts that meet where a closed continuous rod is cut.
      pure subroutine join_over_ends
         integer :: j, l
         do j = 1, size(set)
            if (.not. strip(set(j)%rod_segment)%closed .or. set(j)%at(1) > 0.0_wp) cycle
            do l = 1, size(set)
               if (l == j .or. .not. continues(shifted(set(l)), set(j))) cycle
               set(j)%at(1) = set(l)%at(1) - strip(set(l)%rod_segment)%length()
               set = [set(:l - 1), set(l + 1:)]
               return
            end do
         end do
      end subroutine join_over_ends

      !> A contact span with its coordinates reduced by one turn around the closed rod.
      pure type(contact_span_t) function shifted(one)
         type(contact_span_t), intent(in) :: one
         shifted = one
         shifted%at = one%at - strip(one%rod_segment)%length()
      end function shifted

      !> True if line contact `other` begins where line contact `one` with the same obstacle ends.
      pure logical function continues(one, other)
         type(contact_span_t), intent(in) :: one, other
         continues = one%contact == other%contact .and. one%rod_segment == other%rod_segment .and. one%line .and. other%line
         if (continues) continues = abs(other%at(1) - one%at(2)) <= sqrt(epsilon(1.0_wp)) * strip(one%rod_segment)%length()
      end function continues
   end function on_strips

   !> Converts a contact set from continuous rods to rod segments. A line contact is divided at segment boundaries, and its pieces
   !> have the number of the whole contact. The last piece of a line contact is left out if it is shorter than the least length with
   !> which a contact continues behind a boundary.
   subroutine on_segments(strip, covered, set, contact_span, valid)
      type(strip_t), intent(in) :: strip(:)
      logical, intent(in) :: covered(:, :) !! (rod segments, contacts) true: contact spans are allowed on the whole segment; false:
      !! nowhere on it
      type(contact_span_t), intent(in) :: set(:) !! contact set on continuous rods
      type(contact_span_t), allocatable, intent(out) :: contact_span(:)
      logical, intent(out) :: valid !! false: contacts overlap, or lie outside the rod or outside the segments that the contact
      !! covers
      type(contact_span_t) :: piece
      integer :: k, i, n, turn
      real(wp) :: start
      logical :: long
      allocate (contact_span(0))
      valid = .true.
      do k = 1, size(set)
         n = 0
         associate (on => strip(set(k)%rod_segment))
            do turn = merge(-1, 0, on%closed), merge(1, 0, on%closed)
               do i = 1, size(on%rod_segment)
                  piece = set(k)
                  piece%rod_segment = on%rod_segment(i)
                  start = on%start(i) + turn * on%length()
                  associate (length => on%start(i + 1) - on%start(i))
                     piece%at = min(max(set(k)%at - start, 0.0_wp), length)
                     if (set(k)%line) then
                        ! A line contact that extends beyond a boundary by less than its initial length ends there.
                        long = set(k)%at(2) - set(k)%at(1) >= initial_share * length
                        if (piece%at(2) - piece%at(1) < merge(initial_share, point_share, long) * length) cycle
                     else
                        if (set(k)%at(1) < start .or. set(k)%at(1) > start + length .or. n > 0) cycle
                        if (.not. covered(piece%rod_segment, piece%contact)) cycle
                     end if
                  end associate
                  valid = valid .and. covered(piece%rod_segment, piece%contact)
                  contact_span = [contact_span, piece]
                  n = n + 1
               end do
            end do
            associate (ends => on%ends())
               valid = valid .and. n > 0 .and. set(k)%at(1) >= ends(1) .and. set(k)%at(2) <= ends(2) .and. &
                  & set(k)%at(1) <= set(k)%at(2)
            end associate
         end associate
      end do
      valid = valid .and. .not. any([(overlaps(k), k=1, size(set))])

   contains

      !> True if contact k shares a place with another contact of the same obstacle, or is so near to a contact with another
      !> obstacle that a mesh cannot resolve the distance.
      pure logical function overlaps(k)
         integer, intent(in) :: k
         real(wp) :: at(2), apart
         integer :: j
         overlaps = .false.
         associate (on => strip(set(k)%rod_segment))
            apart = initial_share * minval(on%start(2:) - on%start(:size(on%start) - 1))
            ! At a segment boundary a contact may end where a contact with another obstacle begins.
            if (on%at_boundary(set(k)%at(1)) .or. on%at_boundary(set(k)%at(2))) apart = 0.0_wp
            do j = 1, size(set)
               if (j == k .or. set(j)%rod_segment /= set(k)%rod_segment) cycle
               at = brought_near(on, set(j)%at, sum(set(k)%at) / 2)
               if (set(j)%contact == set(k)%contact) then
                  overlaps = overlaps .or. (at(1) <= set(k)%at(2) .and. set(k)%at(1) <= at(2))
               else
                  overlaps = overlaps .or. (at(1) < set(k)%at(2) + apart .and. set(k)%at(1) < at(2) + apart)
               end if
            end do
         end associate
      end function overlaps
   end subroutine on_segments

   !> Coordinates `at`, shifted by whole turns around a closed rod so that their mean is nearest to coordinate `to`.
   pure function brought_near(strip, at, to) result(near)
      type(strip_t), intent(in) :: strip
      real(wp), intent(in) :: at(:), to
      real(wp) :: near(size(at))
      near = at
      if (strip%closed) near = at + strip%length() * anint((to - sum(at) / size(at)) / strip%length())
   end function brought_near

   !> True if two coordinates denote the same place; on a closed rod they may differ by whole turns.
   pure logical function coincide(strip, one, other)
      type(strip_t), intent(in) :: strip
      real(wp), intent(in) :: one, other
      coincide = all(abs(brought_near(strip, [one], other) - other) <= sqrt(epsilon(one)) * strip%length())
   end function coincide

   !> True if a place is at a segment boundary or at an end of the continuous rod.
   pure logical function at_boundary(strip, at)
      class(strip_t), intent(in) :: strip
      real(wp), intent(in) :: at
      integer :: k
      at_boundary = any([(coincide(strip, strip%start(k), at), k=1, size(strip%start))])
   end function at_boundary

   !> Index of the part of the continuous rod that contains a place: 2 i for segment boundary i, 2 i + 1 for the interior between
   !> boundaries i and i + 1. The end of a closed rod is its first boundary.
   pure integer function cell(strip, at)
      class(strip_t), intent(in) :: strip
      real(wp), intent(in) :: at
      integer :: k, last
      real(wp) :: along
      last = size(strip%start)
      along = at
      if (strip%closed) along = modulo(at, strip%length())
      cell = 2 * count(strip%start <= along) + 1
      do k = last, 1, -1
         if (coincide(strip, strip%start(k), at)) cell = 2 * k
      end do
   end function cell

   pure real(wp) function strip_length(strip) result(length)
      class(strip_t), intent(in) :: strip
      length = strip%start(size(strip%start))
   end function strip_length

   !> Coordinates between which a contact may lie; on a closed rod also half a turn before its beginning and behind its end.
   pure function strip_ends(strip) result(ends)
      class(strip_t), intent(in) :: strip
      real(wp) :: ends(2)
      ends = [0.0_wp, strip%length()]
      if (strip%closed) ends = ends + [-0.5_wp, 0.5_wp] * strip%length()
   end function strip_ends
end module rod_strips
