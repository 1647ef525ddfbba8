!> Search in a list of increasing numbers.
module ordered_knots
   use kinds, only: wp
   implicit none
   private
   public :: piece_at, shortest_piece

contains

   !> Index of the interval between neighbouring knots that contains a number. A knot belongs to the interval that begins at it;
   !> numbers beyond the ends belong to the first or last interval.
   pure integer function piece_at(knot, place) result(piece)
      real(wp), intent(in) :: knot(:)         !! knots, not decreasing; 2 or more
      real(wp), intent(in) :: place           !! number to be found
      integer :: right, middle
      piece = 1
      right = size(knot)
      if (place >= knot(right)) piece = right - 1
      if (place <= knot(1) .or. place >= knot(right)) return
      ! If all intervals have the same length, the first guess is right.
      middle = min(1 + int((place - knot(1)) / (knot(right) - knot(1)) * (right - 1)), right - 1)
      if (knot(middle) > place) then
         right = middle
      else
         piece = middle
         if (knot(middle + 1) > place) right = middle + 1
      end if
      do while (right - piece > 1)
         middle = (piece + right) / 2
         if (knot(middle) > place) then
            right = middle
         else
            piece = middle
         end if
      end do
   end function piece_at

   !> Length of the shortest interval between neighbouring knots that overlaps a given interval.
   pure real(wp) function shortest_piece(knot, from, to) result(length)
      real(wp), intent(in) :: knot(:)         !! knots, not decreasing; 2 or more
      real(wp), intent(in) :: from, to        !! ends of the given interval, increasing
      integer :: first, last
      first = piece_at(knot, from)
      last = piece_at(knot, to)
      length = minval(knot(first + 1:last + 1) - knot(first:last))
   end function shortest_piece
end module ordered_knots
