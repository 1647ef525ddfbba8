!> Forces along an element that depend on the position of its points: the forces of a foundation on a rod between two nodes.
module inner_forces
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   implicit none
   private
   public :: inner_forces_t, clear_forces, add_force

   !> Quadrature of the force by stress-free length. For the increments dl of the load factor and dx of a point's position the force
   !> is
   !>   force + normal * dp + rate * dl - sway * dx,   dp = spring * (approach * dl - normal.dx)
   type :: inner_forces_t
      integer :: n = 0
      real(wp), allocatable :: tau(:)             !! (n) position, 0 to 1 of the stress-free length
      real(wp), allocatable :: weight(:)          !! (n) quadrature weight, as part of the element's length
      real(wp), allocatable :: basis(:, :)        !! (max_stages, n) values of stage_basis at the point
      real(wp), allocatable :: force(:, :)        !! (2, n) force by stress-free length [force/length]
      real(wp), allocatable :: normal(:, :)       !! (2, n) unit normal of the surface
      real(wp), allocatable :: spring(:)          !! (n) derivative of the pressure (force along the normal) by the penetration
      real(wp), allocatable :: approach(:) !! (n) derivative of the penetration by the load factor at a fixed point of the rod
      real(wp), allocatable :: sway(:, :, :)      !! (2, 2, n) symmetric stiffness in addition to that of the spring
      real(wp), allocatable :: rate(:, :) !! (2, n) derivative of the force by the load factor, without the contribution of the
      !! spring
      ! For reports only; the element does not use them:
      integer, allocatable :: source(:)           !! (n) candidate whose contact exerts the force
      real(wp), allocatable :: x(:, :)            !! (2, n) deformed position of the point
      real(wp), allocatable :: pressure(:)        !! (n) component of the force along the normal
      real(wp), allocatable :: bend(:)            !! (n) curvature of the gap function along the surface
   end type inner_forces_t

contains

   !> Removes all forces from a list; the storage is kept.
   pure subroutine clear_forces(list)
      type(inner_forces_t), intent(inout) :: list
      list%n = 0
   end subroutine clear_forces

   !> Adds space for one more point and returns the index of this point; the caller sets its values.
   subroutine add_force(list, number)
      type(inner_forces_t), intent(inout) :: list
      integer, intent(out) :: number
      if (.not. allocated(list%tau)) call resize(16)
      if (list%n == size(list%tau)) call resize(2 * list%n)
      list%n = list%n + 1
      number = list%n

   contains

      subroutine resize(m)
         integer, intent(in) :: m
         type(inner_forces_t) :: old
         integer :: n
         n = list%n
         if (n > 0) old = list
         if (allocated(list%tau)) deallocate (list%tau, list%weight, list%basis, list%force, list%normal, list%spring, &
            & list%approach, list%sway, list%rate, list%source, list%pressure, list%bend, list%x)
         allocate (list%tau(m), list%weight(m), list%basis(max_stages, m), list%force(2, m), list%sway(2, 2, m), &
            & list%spring(m), list%approach(m))
         allocate (list%rate(2, m), list%source(m), list%normal(2, m), list%pressure(m), list%bend(m), list%x(2, m))
         if (n == 0) return
         list%tau(:n) = old%tau(:n)
         list%weight(:n) = old%weight(:n)
         list%basis(:, :n) = old%basis(:, :n)
         list%force(:, :n) = old%force(:, :n)
         list%sway(:, :, :n) = old%sway(:, :, :n)
         list%rate(:, :n) = old%rate(:, :n)
         list%spring(:n) = old%spring(:n)
         list%approach(:n) = old%approach(:n)
         list%source(:n) = old%source(:n)
         list%normal(:, :n) = old%normal(:, :n)
         list%pressure(:n) = old%pressure(:n)
         list%bend(:n) = old%bend(:n)
         list%x(:, :n) = old%x(:, :n)
      end subroutine resize
   end subroutine add_force
end module inner_forces
