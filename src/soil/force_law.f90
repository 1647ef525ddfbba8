!> What foundations answer per unit length of rod: in proportion to the penetration, or piecewise linear.
!>
!> Segments are numbered from the first one, which begins at zero; what is pulled answers as what is pushed, on segments of the
!> other sign but for the first, which goes through zero.
module force_law
   use kinds, only: wp
   use model, only: model_t, law_t
   use obstacle_types, only: obstacle_t
   implicit none
   private
   public :: foundation_reaction, law_segment, segment_slope, carries, segment_open, segment_unknown

   integer, parameter :: segment_open = 0               !! no contact
   integer, parameter :: segment_unknown = -huge(1)     !! it is looked for

contains

   !> True for a segment that is known to be in contact.
   elemental logical function carries(segment)
      integer, intent(in) :: segment
      carries = segment /= segment_open .and. segment /= segment_unknown
   end function carries

   !> Force per length of what is in contact with a foundation, and its derivative by the penetration.
   pure subroutine foundation_reaction(model, obstacle, penetration, push, spring, segment)
      type(model_t), intent(in) :: model
      type(obstacle_t), intent(in) :: obstacle         !! with a modulus or a law
      real(wp), intent(in) :: penetration              !! negative: pulled
      real(wp), intent(out) :: push, spring
      integer, intent(in), optional :: segment         !! that it is on; without, or unknown: the penetration's
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

   !> The segment that a penetration lies on; at a kink the one beyond.
   pure integer function law_segment(law, penetration) result(segment)
      type(law_t), intent(in) :: law
      real(wp), intent(in) :: penetration
      integer :: i
      segment = 1
      do i = 2, size(law%penetration) - 1
         if (abs(penetration) >= law%penetration(i)) segment = i
      end do
      if (penetration < 0.0_wp .and. segment > 1) segment = -segment
   end function law_segment

   !> Derivative of the force by the penetration on a segment.
   pure real(wp) function segment_slope(law, segment) result(slope)
      type(law_t), intent(in) :: law
      integer, intent(in) :: segment           !! one that carries
      associate (p => law%penetration, f => law%force, k => abs(segment))
         slope = (f(k + 1) - f(k)) / (p(k + 1) - p(k))
      end associate
   end function segment_slope

   !> Force and slope of a segment, which goes on beyond both of its ends.
   pure subroutine segment_reaction(law, segment, penetration, force, slope)
      type(law_t), intent(in) :: law
      integer, intent(in) :: segment           !! one that carries
      real(wp), intent(in) :: penetration
      real(wp), intent(out) :: force, slope
      real(wp) :: sense
      sense = real(sign(1, segment), wp)
      slope = segment_slope(law, segment)
      force = sense * (law%force(abs(segment)) + slope * (sense * penetration - law%penetration(abs(segment))))
   end subroutine segment_reaction
end module force_law
