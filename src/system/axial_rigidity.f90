!> Inextensible rods: corrects solutions for the artificial extension in the factored tangent.
!>
!> The equations inside inextensible elements have 1/EA = 0, so that equilibrium is exact. A straight element would then have an
!> infinite axial stiffness; the tangent therefore has an artificial axial compliance, a small part of the bending compliance
!> (ge_element). Solutions with the factored tangent are corrected here: a stress-free distortion of opposite sign is applied to
!> each element and removes its artificial extension. Each correction reduces the error by the small ratio of the two compliances.
module axial_rigidity
   use kinds, only: wp
   use problem, only: problem_t, dof
   implicit none
   private
   public :: rigidity_t, new_rigidity, stretched, shrinking_forces

   integer, parameter, public :: rigidity_rounds = 2 !! largest number of corrections of a solution; each reduces the error by about
   !! eight digits

   !> Matrices that give the artificial extension of each inextensible element for given unknowns, and the forces that remove it.
   type :: rigidity_t
      integer :: n = 0
      integer, allocatable :: element(:)       !! (n) inextensible elements
      integer, allocatable :: first(:)         !! (n + 1) index of the element's first entry in `unknown`, `force` and `push`
      integer, allocatable :: unknown(:)       !! (entries) index of the unknown
      real(wp), allocatable :: force(:, :) !! (2, entries) derivative by the unknown of the force that causes the extension: the
      !! force at the first end, on an obstacle at the second end
      real(wp), allocatable :: push(:, :) !! (2, entries) force on the unknown that a unit translation of the element's second end
      !! causes
      real(wp), allocatable :: give(:, :, :)   !! (2, 2, n) artificial extension for a unit of this force
      real(wp), allocatable :: shifted(:, :, :) !! (2, 2, n) change of this force for a unit translation of the second end
      real(wp), allocatable :: load(:, :)      !! (2, n) derivative of this force by the load factor
   end type rigidity_t

contains

   !> The inextensible elements of a problem, with entries for all unknowns of their nodes. For tied nodes these are the unknowns of
   !> the nodes that they follow.
   function new_rigidity(problem) result(rigidity)
      type(problem_t), intent(in) :: problem
      type(rigidity_t) :: rigidity
      integer :: e, i, k, n
      rigidity%element = pack([(e, e=1, size(problem%compliance))], problem%compliance%give > 0.0_wp)
      rigidity%n = size(rigidity%element)
      allocate (rigidity%first(rigidity%n + 1))
      associate (ties => problem%ties, node => problem%model%mesh%node)
         n = 0
         do e = 1, rigidity%n
            rigidity%first(e) = n + 1
            do i = 1, 2
               associate (here => node(i, rigidity%element(e)))
                  n = n + 3 * (ties%first(here + 1) - ties%first(here) + merge(0, 1, ties%follows(here)))
               end associate
            end do
         end do
         rigidity%first(rigidity%n + 1) = n + 1
         allocate (rigidity%unknown(n))
         n = 0
         do e = 1, rigidity%n
            do i = 1, 2
               associate (here => node(i, rigidity%element(e)))
                  if (.not. ties%follows(here)) call add(here)
                  do k = ties%first(here), ties%first(here + 1) - 1
                     call add(ties%of(k))
                  end do
               end associate
            end do
         end do
      end associate
      allocate (rigidity%force(2, n), rigidity%push(2, n), source=0.0_wp)
      allocate (rigidity%give(2, 2, rigidity%n), rigidity%shifted(2, 2, rigidity%n), rigidity%load(2, rigidity%n), source=0.0_wp)

   contains

      !> Adds the three unknowns of a node.
      subroutine add(at)
         integer, intent(in) :: at
         rigidity%unknown(n + 1:n + 3) = [dof(problem, at, 1), dof(problem, at, 2), dof(problem, at, 3)]
         n = n + 3
      end subroutine add
   end function new_rigidity

   !> Artificial extension of the inextensible elements in a solution that was computed with the factored tangent.
   pure subroutine stretched(rigidity, x, load, stretch)
      type(rigidity_t), intent(in) :: rigidity
      real(wp), intent(in) :: x(:)             !! (unknowns) the solution
      real(wp), intent(in) :: load             !! load factor of the solution
      real(wp), intent(inout) :: stretch(:, :) !! (2, n) in: extension that is already corrected; out: extension to be corrected
      !! next
      real(wp) :: force(2)
      integer :: i, k
      do i = 1, rigidity%n
         force = load * rigidity%load(:, i) + stretch(1, i) * rigidity%shifted(:, 1, i) + stretch(2, i) * rigidity%shifted(:, 2, i)
         do k = rigidity%first(i), rigidity%first(i + 1) - 1
            force = force + rigidity%force(:, k) * x(rigidity%unknown(k))
         end do
         stretch(:, i) = force(1) * rigidity%give(:, 1, i) + force(2) * rigidity%give(:, 2, i)
      end do
   end subroutine stretched

   !> Forces on the unknowns that shorten the elements by given artificial extensions.
   pure subroutine shrinking_forces(rigidity, stretch, force)
      type(rigidity_t), intent(in) :: rigidity
      real(wp), intent(in) :: stretch(:, :)    !! (2, n) artificial extensions
      real(wp), intent(out) :: force(:)        !! (unknowns) forces, node axes
      integer :: i, k
      force = 0.0_wp
      do i = 1, rigidity%n
         do k = rigidity%first(i), rigidity%first(i + 1) - 1
            associate (at => rigidity%unknown(k))
               force(at) = force(at) - (rigidity%push(1, k) * stretch(1, i) + rigidity%push(2, k) * stretch(2, i))
            end associate
         end do
      end do
   end subroutine shrinking_forces
end module axial_rigidity
