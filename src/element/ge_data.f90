!> A geometrically exact element with its loads and displacements: all data on which its equations depend, apart from the Gauss
!> points and foundations.
module ge_data
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   use rod_geometry, only: element_geometry_t
   use rod_load, only: ge_load_t
   implicit none
   private
   public :: ge_data_t, ge_stiffness_t, ge_compliance, forbid_stretch

   !> Compliances of an element; zero means rigid. If the section varies along the element, the values at its middle are scales.
   type :: ge_stiffness_t
      real(wp) :: axial = 0.0_wp   !! 1/EA
      real(wp) :: bending = 0.0_wp !! 1/EI
      real(wp) :: shear = 0.0_wp   !! 1/GA, exactly zero for shear-rigid rods
      real(wp) :: give = 0.0_wp !! axial compliance of the tangent of an inextensible element (1/EA = 0), whose tangent would
      !! otherwise be singular if the element is straight
      real(wp) :: part(3, max_stages) = 1.0_wp !! axial, bending and shear compliance at the stages, over the compliances above
   end type ge_stiffness_t

   !> The element in one state. Notation and equations are those of ge_element.
   type :: ge_data_t
      type(element_geometry_t) :: g               !! stress-free geometry; its length is h, its scale is the factor C
      type(ge_stiffness_t) :: compliance
      type(ge_load_t) :: load
      real(wp) :: u(6) = 0.0_wp                   !! node displacements (u, v, rotation) at the first and the second node
      integer :: unknowns = 0                     !! number of stored unknowns, see ge_size
      real(wp) :: z(3 + 3 * max_stages) = 0.0_wp  !! (unknowns) stored unknowns; entries behind the last one are zero
   end type ge_data_t

contains

   !> Compliances of an element with the stiffnesses EA, EI and, if it shears, GA.
   pure function ge_compliance(stages, h, ea, ei, ga, shear_rigid) result(compliance)
      integer, intent(in) :: stages
      real(wp), intent(in) :: h, ea, ei, ga   !! stress-free length; stiffnesses EA, EI and GA
      logical, intent(in) :: shear_rigid      !! true: the element has no shear flexibility, and GA is not used
      type(ge_stiffness_t) :: compliance
      compliance%axial = 1.0_wp / ea
      compliance%bending = 1.0_wp / ei
      if (.not. shear_rigid) compliance%shear = 1.0_wp / ga
      if (stages == 1) compliance%shear = compliance%shear + h**2 / (12.0_wp * ei)
   end function ge_compliance

   !> Makes an element inextensible. Its tangent gets an axial compliance of size**2/EI times the root of the rounding unit. Two
   !> errors are then equally small: the rounding error multiplied by the remaining stiffness, and the artificial extension left in
   !> a solution.
   pure subroutine forbid_stretch(compliance, size)
      type(ge_stiffness_t), intent(inout) :: compliance
      real(wp), intent(in) :: size             !! size of the structure [length]
      compliance%axial = 0.0_wp
      compliance%give = sqrt(epsilon(size)) * size**2 * compliance%bending
   end subroutine forbid_stretch
end module ge_data
