!> Force per unit length of rod over penetration, piecewise linear.
!>
!> Segments are numbered from the first one, which begins at zero; what is pulled is on those of the other sign.
module force_law
   use kinds, only: wp
   use model, only: law_t
   implicit none
   private
   public :: law_reaction, law_segment, segment_reaction, segment_open, segment_unknown

   integer, parameter :: segment_open = 0               !! no contact
   integer, parameter :: segment_unknown = -huge(1)     !! it is looked for

contains

   !> Force and its derivative; the last segment goes on beyond its end, and what is pulled answers as what is pushed.
   pure subroutine law_reaction(law, penetration, force, slope)
      type(law_t), intent(in) :: law
      real(wp), intent(in) :: penetration      !! negative: pulled
      real(wp), intent(out) :: force, slope    !! at a kink: the slope beyond it
      call segment_reaction(law, law_segment(law, penetration), penetration, force, slope)
   end subroutine law_reaction

   !> The segment that a penetration lies on; at a kink the one beyond.
   pure integer function law_segment(law, penetration) result(segment)
      type(law_t), intent(in) :: law
      real(wp), intent(in) :: penetration
      integer :: i
      segment = 1
      do i = 2, size(law%penetration) - 1
         if (abs(penetration) >= law%penetration(i)) segment = i
      end do
      if (penetration < 0.0_wp) segment = -segment
   end function law_segment

   !> Force and slope of a segment, which goes on beyond both of its ends.
   pure subroutine segment_reaction(law, segment, penetration, force, slope)
      type(law_t), intent(in) :: law
      integer, intent(in) :: segment           !! not 0
      real(wp), intent(in) :: penetration
      real(wp), intent(out) :: force, slope
      real(wp) :: sense
      associate (p => law%penetration, f => law%force, k => abs(segment))
         sense = real(sign(1, segment), wp)
         slope = (f(k + 1) - f(k)) / (p(k + 1) - p(k))
         force = sense * (f(k) + slope * (sense * penetration - p(k)))
      end associate
   end subroutine segment_reaction
end module force_law
