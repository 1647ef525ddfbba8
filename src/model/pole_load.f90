!> A force of constant magnitude whose line of action passes through a fixed point, its pole: a cable to an anchor. Its potential is
!> its magnitude times the distance.
module pole_load
   use kinds, only: wp
   use point_load, only: point_load_t
   implicit none
   private
   public :: pole_load_t

   !> A load of constant magnitude towards a fixed point, its pole.
   type, extends(point_load_t) :: pole_load_t
      real(wp) :: pole(2) = 0.0_wp     !! a positive force pulls the node towards it
   contains
      procedure :: push
   end type pole_load_t

contains

   !> Unit force e = d/|d| towards the pole, d the vector from the node to the pole; minus its derivatives are (1 - e e^T)/|d|.
   pure subroutine push(self, place, force, stiffness, sound)
      class(pole_load_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: force(3)
      real(wp), intent(out) :: stiffness(3, 3)
      logical, intent(out) :: sound          !! false: the node is at the pole
      real(wp) :: d(2), across(2), distance
      force = 0.0_wp
      stiffness = 0.0_wp
      d = self%pole - place(1:2)
      distance = norm2(d)
      sound = distance > 0.0_wp
      if (.not. sound) return
      force(1:2) = d / distance
      across = [-force(2), force(1)]
      stiffness(1:2, 1) = across * (across(1) / distance)
      stiffness(1:2, 2) = across * (across(2) / distance)
   end subroutine push
end module pole_load
