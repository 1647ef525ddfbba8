!> Ends of a spline in the deck, of an obstacle or of a rod: closed, or with a direction at which its mirror image continues it.
module spline_ends
   use kinds, only: wp, degree
   use obstacle_shapes, only: mirrored
   use checked_deck, only: checked_deck_t
   implicit none
   private
   public :: end_spline

contains

   !> Adds the points behind the ends that parameters ENDS, START and END of a card request; errors are added to the deck.
   subroutine end_spline(deck, point, closed, ok)
      type(checked_deck_t), intent(inout) :: deck       !! deck, with the position at the last line of the card
      real(wp), allocatable, intent(inout) :: point(:, :) !! (2, points) points; neighbouring points are different
      logical, intent(out) :: closed                    !! true: the last point equals the first
      logical, intent(out) :: ok                        !! false: there is an error
      logical :: at(2)
      real(wp) :: angle(2)
      integer :: n
      n = size(point, 2)
      ok = .false.
      closed = deck%word('ENDS') == 'CLOSED'
      at = [deck%given('START'), deck%given('END')]
      angle = 0.0_wp
      if (at(1)) angle(1) = deck%real('START') * degree
      if (at(2)) angle(2) = deck%real('END') * degree
      if (closed) then
         if (any(at)) then
            call deck%wrong(trim(merge('START', 'END  ', at(1))), 'a closed spline has no ends')
         else if (n < 3) then
            call deck%wrong('ENDS', 'a closed spline has 3 points or more')
         else if (norm2(point(:, n) - point(:, 1)) <= 0.0_wp) then
            call deck%wrong_line('the point is the first one again, to which a closed spline goes on')
         else
            ok = .true.
            point = reshape([point, point(:, 1)], [2, n + 1])
         end if
      else if (at(1) .and. dot_product(point(:, 2) - point(:, 1), [cos(angle(1)), sin(angle(1))]) <= 0.0_wp) then
         call deck%wrong('START', 'the curve does not leave its first point in this direction: the second is behind')
      else if (at(2) .and. dot_product(point(:, n) - point(:, n - 1), [cos(angle(2)), sin(angle(2))]) <= 0.0_wp) then
         call deck%wrong('END', 'the curve does not come to its last point in this direction: the one before is ahead')
      else
         ok = .true.
         if (.not. any(at)) return
         point = mirrored(point, at, angle, closed)
         ok = closed .or. .not. all(at)
         if (.not. ok) call deck%wrong('END', 'mirror images beyond START and END do not close the curve: the mirrors '// &
            'must meet at a whole part of 180 degrees, or be one')
      end if
   end subroutine end_spline
end module spline_ends
