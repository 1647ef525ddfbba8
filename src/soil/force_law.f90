!> Laws of foundations: force by length of rod, proportional to the penetration or piecewise linear.
!>
!> Segments of a law are its straight pieces, numbered from the first one, which begins at zero penetration. In tension the law is
!> the same as in pressure, on segments with negative numbers; only the first segment, which passes through zero, has the same
!> number for both.
module force_law
   use kinds, only: wp
   use model, only: model_t, law_t
   use obstacle_types, only: obstacle_t
   implicit none
   private
   public :: foundation_reaction, law_segment, first_corner, segment_slope, carries, segment_open, segment_unknown

   integer, parameter :: segment_open = 0               !! number for: no contact
   integer, parameter :: segment_unknown = -huge(1)     !! number for: the segment has to be determined from the gap

contains

   !> True if a segment number prescribes contact; false for segment_open and segment_unknown.
   elemental logical function carries(segment)
      integer, intent(in) :: segment
      carries = segment /= segment_open .and. segment /= segment_unknown
   end function carries

   !> Force by length of a foundation in contact, and its derivative by the penetration.
   pure subroutine foundation_reaction(model, obstacle, penetration, push, spring, segment)
      type(model_t), intent(in) :: model
      type(obstacle_t), intent(in) :: obstacle         !! obstacle with a modulus or a law
      real(wp), intent(in) :: penetration              !! penetration [length]; < 0: tension
      real(wp), intent(out) :: push, spring            !! force by length of rod; its derivative by the penetration
      integer, intent(in), optional :: segment !! segment of the law; absent or segment_unknown: it follows from the penetration
      integer :: on
      if (obstacle%law == 0) then
         push = obstacle%modulus * penetration
         spring = obstacle%modulus
         return
      end if
      associate (law => model%law(obstacle%law))
         on = segment_unknown
         if (present(segment)) on = segment
         if (on == segment_unknown) on = law_segment(law, penetration)
         call segment_reaction(law, on, penetration, push, spring)
      end associate
      push = obstacle%width * push
      spring = obstacle%width * spring
   end subroutine foundation_reaction

   !> Segment of a law at a penetration; at a corner the segment with the larger penetration.
   pure integer function law_segment(law, penetration) result(segment)
      type(law_t), intent(in) :: law
      real(wp), intent(in) :: penetration !! penetration [length]; < 0: tension
      integer :: i
      segment = 1
      do i = 2, size(law%penetration) - 1
         if (abs(penetration) >= law%penetration(i)) segment = i
      end do
      if (penetration < 0.0_wp .and. segment > 1) segment = -segment
   end function law_segment

   !> First corner of a law between two segments, in the order from one to the other: index of the law's point; negative if the
   !> corner is in tension.
   pure integer function first_corner(from, to) result(corner)
      integer, intent(in) :: from, to          !! different segments in contact
      logical :: outwards
      outwards = abs(to) > abs(from) .and. (from * to > 0 .or. abs(from) == 1)
      corner = abs(from) + merge(1, 0, outwards)
      if (merge(to, from, outwards) < 0) corner = -corner
   end function first_corner

   !> Derivative of the force by the penetration on a segment.
   pure real(wp) function segment_slope(law, segment) result(slope)
      type(law_t), intent(in) :: law
      integer, intent(in) :: segment           !! segment in contact
      associate (p => law%penetration, f => law%force, k => abs(segment))
         slope = (f(k + 1) - f(k)) / (p(k + 1) - p(k))
      end associate
   end function segment_slope

   !> Force and slope on a segment, extrapolated beyond its ends.
   pure subroutine segment_reaction(law, segment, penetration, force, slope)
      type(law_t), intent(in) :: law
      integer, intent(in) :: segment           !! segment in contact
      real(wp), intent(in) :: penetration
      real(wp), intent(out) :: force, slope
      real(wp) :: sense
      sense = real(sign(1, segment), wp)
      slope = segment_slope(law, segment)
      force = sense * (law%force(abs(segment)) + slope * (sense * penetration - law%penetration(abs(segment))))
   end subroutine segment_reaction
end module force_law
