!> Forces along an element that depend on where its points are: what a foundation does to a rod between two nodes.
module inner_forces
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   implicit none
   private
   public :: inner_forces_t, clear_forces, add_force

   !> A quadrature of the force per stress-free length. With dl the increment of the load factor and dx that of the point's place
   !> it becomes
   !>   force + normal * dp + rate * dl - sway * dx,   dp = spring * (approach * dl - normal.dx)
   type :: inner_forces_t
      integer :: n = 0
      real(wp), allocatable :: tau(:)             !! (n) place, 0 to 1 of the stress-free length
      real(wp), allocatable :: weight(:)          !! (n) of the element's length
      real(wp), allocatable :: basis(:, :)        !! (max_stages, n) stage_basis at the place
      real(wp), allocatable :: force(:, :)        !! (2, n) [force/length]
      real(wp), allocatable :: normal(:, :)       !! (2, n) unit
      real(wp), allocatable :: spring(:)          !! (n) of the pressure, the force along the normal, by the penetration
      real(wp), allocatable :: approach(:)        !! (n) of the penetration, besides what the point moves
      real(wp), allocatable :: sway(:, :, :)      !! (2, 2, n) symmetric: what does not come of the spring
      real(wp), allocatable :: rate(:, :)         !! (2, n) likewise
      ! For reports; the element does not look at them.
      integer, allocatable :: source(:)           !! (n) who pushes
      real(wp), allocatable :: x(:, :)            !! (2, n) where the point is
      real(wp), allocatable :: pressure(:)        !! (n) component of the force along the normal
      real(wp), allocatable :: bend(:)            !! (n) curvature of the gap function along the surface
   end type inner_forces_t

contains

   !> No forces; keeps the storage.
   pure subroutine clear_forces(list)
      type(inner_forces_t), intent(inout) :: list
      list%n = 0
   end subroutine clear_forces

   !> Makes room for one more point and returns its number; the caller fills it in.
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
