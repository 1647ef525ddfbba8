!> A geometrically exact element with its loads and displacements: all data on which its equations depend, apart from the Gauss
!> points and foundations.
module ge_data
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   use rod_geometry, only: element_geometry_t
   use rod_load, only: ge_load_t
   use rod_compliance, only: ge_stiffness_t
   implicit none
   private
   public :: ge_data_t

   !> The element in one state. Notation and equations are those of ge_element.
   type :: ge_data_t
      type(element_geometry_t) :: g               !! stress-free geometry; its length is h, its scale is the factor C
      type(ge_stiffness_t) :: compliance
      type(ge_load_t) :: load
      real(wp) :: u(6) = 0.0_wp                   !! node displacements (u, v, rotation) at the first and the second node
      integer :: unknowns = 0                     !! number of stored unknowns, see ge_size
      real(wp) :: z(3 + 3 * max_stages) = 0.0_wp  !! (unknowns) stored unknowns; entries behind the last one are zero
   end type ge_data_t
end module ge_data
