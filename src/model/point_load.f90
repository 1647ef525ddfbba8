!> A force on one node that depends on the node's position: the common part of all such loads.
!>
!> A new kind extends point_load_t in a module of its own and implements `push` for a unit magnitude. Growth with the load factor,
!> constant loads after a step, other meshes, tangent, buckling and balance checks then include it. The force must have a potential,
!> because the tangent is symmetric: a follower force at a node is not possible.
module point_load
   use kinds, only: wp
   implicit none
   private
   public :: point_load_t, point_load_item_t

   !> A load on one node that depends on the node's position and rotation.
   type, abstract :: point_load_t
      integer :: node = 0
      real(wp) :: magnitude = 0.0_wp   !! at load factor 1
   contains
      procedure(unit_push), deferred :: push
   end type point_load_t

   abstract interface
      !> Force, couple and stiffness of magnitude 1 on a node at the given position.
      pure subroutine unit_push(self, place, force, stiffness, sound)
         import :: point_load_t, wp
         class(point_load_t), intent(in) :: self
         real(wp), intent(in) :: place(3)          !! x, y and the rotation since the start [rad]
         real(wp), intent(out) :: force(3)         !! in x, in y, and the couple (anticlockwise)
         real(wp), intent(out) :: stiffness(3, 3)  !! minus its derivatives by the place, symmetric
         logical, intent(out) :: sound             !! false: the direction is undefined there; force and stiffness are zero
      end subroutine unit_push
   end interface

   !> A load of any kind.
   type :: point_load_item_t
      class(point_load_t), allocatable :: load
   end type point_load_item_t
end module point_load
