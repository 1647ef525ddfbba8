!> Interface points of foundations: points of a rod at which contact ends or a force law has a corner.
!>
!> At an interface point the force of a foundation is continuous, but its derivative is not. An element that contains the point has
!> an error of low order in its length, whatever the order of the method. A mesh with a node that moves with the point has the full
!> order.
module ground_mark
   use kinds, only: wp
   use force_law, only: segment_unknown
   implicit none
   private
   public :: mark_t, cut_t

   !> Interface point of a mesh: a node at which the gap of a contact has the value of a corner of its foundation's law.
   type :: mark_t
      integer :: node = 0
      integer :: candidate(2) = 0 !! candidates whose elements are before and after the point, indices into the foundations' chain
      real(wp) :: level = 0.0_wp             !! gap at the corner of the law
      integer :: segment(2) = segment_unknown !! segments of the law before and after the point along the rod
   end type mark_t

   !> Interface point as a position along a rod segment, independent of any mesh.
   type :: cut_t
      integer :: rod_segment = 0
      integer :: contact = 0                 !! index into model%contact
      real(wp) :: at = 0.0_wp                !! coordinate along the rod segment
      logical :: at_end = .false. !! true: the point is so close to an end of the segment that no mesh node can move with it. It is
      !! placed at the end; elements beside it are as short as beside other interface points
      real(wp) :: level = 0.0_wp             !! gap at the corner of the law
      integer :: segment(2) = segment_unknown !! segments of the law before and after the point along the rod
      real(wp) :: layer(2) = 0.0_wp !! length over which displacements decay on the foundation (decay_length), before and after the
      !! point; 0: no foundation force there
   end type cut_t
end module ground_mark
