!> Ends of contact with foundations, and corners of their laws, as points of a rod.
!>
!> The force of a foundation is continuous there, its derivative is not: an element that spans such a point errs by a low order of
!> its length, whatever its own order is. A mesh that has a node there, which goes along with the point, keeps the order.
module ground_mark
   use kinds, only: wp
   use force_law, only: segment_unknown
   implicit none
   private
   public :: mark_t, cut_t

   !> Where the gap of a contact takes a value at which the law of its foundation has a corner: a node of a mesh.
   type :: mark_t
      integer :: node = 0
      integer :: candidate(2) = 0            !! of the foundations' chain: before the element on each side
      real(wp) :: level = 0.0_wp             !! the gap
      integer :: segment(2) = segment_unknown !! of the law, before and after it along the stretch
   end type mark_t

   !> The same along a stretch, whatever the mesh is.
   type :: cut_t
      integer :: stretch = 0
      integer :: contact = 0                 !! index into model%contact
      real(wp) :: at = 0.0_wp                !! coordinate along the stretch
      logical :: at_end = .false.            !! it is next to an end of the stretch, where no mark can follow it, and counts as
      !! there: elements beside it are to be as short as beside a mark
      real(wp) :: level = 0.0_wp             !! the gap
      integer :: segment(2) = segment_unknown !! of the law, before and after it
      real(wp) :: layer(2) = 0.0_wp          !! length over which a rod on the foundation as it is before and after forgets
      !! what it is bent by, (EI/k)^(1/4); 0: there is none
   end type cut_t
end module ground_mark
