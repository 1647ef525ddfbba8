!> A force on a node, of constant magnitude, whose line of action passes through a fixed point, its pole (a cable to an anchor). Its
!> potential is its magnitude times the distance to the pole, so that its tangent is symmetric.
module pole_load
   use kinds, only: wp
   implicit none
   private
   public :: pole_load_t

   !> A load of constant magnitude towards a fixed point, its pole.
   type :: pole_load_t
      integer :: node = 0
      real(wp) :: magnitude = 0.0_wp   !! magnitude at load factor 1; a positive force pulls the node towards the pole
      real(wp) :: pole(2) = 0.0_wp
   contains
      procedure :: push
   end type pole_load_t

contains

   !> Force, couple and stiffness for magnitude 1 on a node at a given position. The force is e = d/|d| with the vector d from the
   !> node to the pole; minus its derivative by the position is (1 - e e^T)/|d|.
   pure subroutine push(self, place, force, stiffness, sound)
      class(pole_load_t), intent(in) :: self
      real(wp), intent(in) :: place(3)          !! position x, y of the node, and its rotation since the start [rad]
      real(wp), intent(out) :: force(3)         !! force in x, force in y, couple (> 0 anticlockwise)
      real(wp), intent(out) :: stiffness(3, 3)  !! minus the derivatives of the force by the position, symmetric
      logical, intent(out) :: sound             !! false: the node is at the pole; force and stiffness are zero
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
