!> A force on one node that depends on where the node is: what all such loads have in common.
!>
!> A new one extends point_load_t in a module of its own and says what a unit of it does (`push`); growing with the load factor,
!> staying behind after a step, other meshes, tangent, buckling and balance then know it. It must have a potential: the
!> tangent is symmetric, so a follower force at a node is none of these.
module point_load
   use kinds, only: wp
   implicit none
   private
   public :: point_load_t, point_load_item_t

   type, abstract :: point_load_t
      integer :: node = 0
      real(wp) :: magnitude = 0.0_wp   !! at load factor 1
   contains
      procedure(unit_push), deferred :: push
   end type point_load_t

   abstract interface
      !> What magnitude 1 does to the node at a place.
      pure subroutine unit_push(self, place, force, stiffness, sound)
         import :: point_load_t, wp
         class(point_load_t), intent(in) :: self
         real(wp), intent(in) :: place(3)          !! x, y and the rotation since the start [rad]
         real(wp), intent(out) :: force(3)         !! in x, in y, and the couple (anticlockwise)
         real(wp), intent(out) :: stiffness(3, 3)  !! minus its derivatives by the place, symmetric
         logical, intent(out) :: sound             !! false: it has no direction there; force and stiffness are zero
      end subroutine unit_push
   end interface

   !> One of any kind.
   type :: point_load_item_t
      class(point_load_t), allocatable :: load
   end type point_load_item_t
end module point_load
