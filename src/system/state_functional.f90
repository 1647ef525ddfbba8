!> Functionals: quantities that are functions of the state, linearised at a state.
!>
!> A functional has four uses. Its gradient is the row of a path constraint (set_path_row). Its derivative along the path is the
!> slope of a test function or a monitor. Its zero is located by an iteration on the bordered system. The solution of the transposed
!> equations for its gradient gives the elements' contributions to its error bar (error_contributions).
!>
!> Kinds of functionals. Each has a function new_..._functional(problem, state, system, ...):
!> load                load factor (this module; linear_functional of bordered_system with other unknowns)
!> displacement        displacement monitor, and displacement of a point inside an element (displacement_functional)
!> reaction            sum of support reactions and spring forces (reaction_functional)
!> contact force, gap  reaction and gap of a candidate, sum of the reactions at nodes (node_contact_functional)
!> span force          sum of the forces on contact spans (span_force_functional)
!> foundation force    sum of the forces of distributed foundations (foundation_force_functional)
!> monitor             any of these sums with the deck's factor and offset (monitors)
!> place               position of a touchdown point (place_functional)
!> section quantity    section force, strain or stress at a point (section_quantities)
!> gap at a point      gap between an obstacle and a point inside an element (displacement_functional)
!> relative curvature  curvature of the rod minus that of the obstacle at a point contact (place_functional)
module state_functional
   use kinds, only: wp
   implicit none
   private
   public :: functional_t, inner_place_t, section_place_t, new_functional, new_load_functional

   !> A point inside an element on which a functional depends through the displacements and rotation of the element's polynomial.
   type :: inner_place_t
      integer :: element = 0
      real(wp) :: tau = 0.0_wp                   !! place in the element, 0 to 1
      real(wp) :: weight(3) = 0.0_wp !! derivatives of the functional with respect to displacements and rotation of the point,
      !! global axes
   end type inner_place_t

   !> A point inside an element on which a functional depends through a section quantity (section_quantities).
   type :: section_place_t
      integer :: element = 0
      real(wp) :: tau = 0.0_wp                   !! place in the element, 0 to 1
      real(wp) :: s = 0.0_wp                     !! arc length along the elements of the monitor
      integer :: quantity = 0
      real(wp) :: sense(2) = 1.0_wp !! signs of N and M in strain and stress; for a section force the first entry is the sign of N,
      !! Q or M
      real(wp) :: factor = 1.0_wp                !! derivative of the functional with respect to the section quantity
   end type section_place_t

   !> A functional (a quantity that is a function of the state), with its value and derivatives at a state.
   type :: functional_t
      logical :: estimated = .true. !! false: element errors do not determine the error of the functional: no error bar
      real(wp) :: value = 0.0_wp                 !! value of the functional at the state
      real(wp), allocatable :: by_unknown(:)     !! (unknowns) gradient of the functional, node axes
      real(wp) :: by_load = 0.0_wp !! derivative of the functional with respect to the load factor at constant unknowns
      real(wp) :: defect = 0.0_wp                !! change of the functional by the elimination of the elements' internal residuals
      real(wp), allocatable :: by_force(:) !! (unknowns) derivatives of the functional with respect to the residuals of fixed
      !! unknowns (for reactions); not allocated: zero
      real(wp), allocatable :: by_element(:, :) !! (6, elements) derivatives of the functional with respect to the end forces of
      !! each element, at constant unknowns and residuals; not allocated: zero
      type(inner_place_t), allocatable :: inner(:) !! points inside elements on whose displacements the functional depends; not
      !! allocated: there are no such points
      type(section_place_t), allocatable :: section(:) !! sections on which the functional depends; not allocated: there are no such
      !! sections
   contains
      procedure :: change
      procedure :: add
   end type functional_t

contains

   !> A functional with the value and all derivatives zero.
   pure type(functional_t) function new_functional(unknowns) result(number)
      integer, intent(in) :: unknowns            !! count of unknowns
      allocate (number%by_unknown(unknowns), source=0.0_wp)
   end function new_functional

   !> The load factor as a functional.
   pure type(functional_t) function new_load_functional(unknowns, load) result(number)
      integer, intent(in) :: unknowns            !! count of unknowns
      real(wp), intent(in) :: load               !! load factor of the state
      number = new_functional(unknowns)
      number%value = load
      number%by_load = 1.0_wp
   end function new_load_functional

   !> Linear change of the functional for increments of the unknowns and of the load factor. With system%tangent and 1 as increments
   !> the change is the derivative along the path by the load factor.
   pure real(wp) function change(self, x, y)
      class(functional_t), intent(in) :: self
      real(wp), intent(in) :: x(:)               !! (unknowns) increments, node axes
      real(wp), intent(in) :: y                  !! increment of the load factor
      change = dot_product(self%by_unknown, x) + self%by_load * y
   end function change

   !> Adds a multiple of another functional of the same state.
   pure subroutine add(self, factor, other)
      class(functional_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(functional_t), intent(in) :: other
      type(section_place_t), allocatable :: added(:)
      self%estimated = self%estimated .and. other%estimated
      self%value = self%value + factor * other%value
      self%by_unknown = self%by_unknown + factor * other%by_unknown
      self%by_load = self%by_load + factor * other%by_load
      self%defect = self%defect + factor * other%defect
      if (allocated(other%section)) then
         added = other%section
         added%factor = factor * added%factor
         if (allocated(self%section)) added = [self%section, added]
         call move_alloc(added, self%section)
      end if
      if (allocated(other%by_force)) then
         if (.not. allocated(self%by_force)) allocate (self%by_force, source=0.0_wp * other%by_force)
         self%by_force = self%by_force + factor * other%by_force
      end if
      if (allocated(other%by_element)) then
         if (.not. allocated(self%by_element)) allocate (self%by_element, source=0.0_wp * other%by_element)
         self%by_element = self%by_element + factor * other%by_element
      end if
   end subroutine add
end module state_functional
