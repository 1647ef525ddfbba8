!> Compliances of one rod element.
module rod_compliance
   use kinds, only: wp
   use gauss_tableau, only: max_stages
   implicit none
   private
   public :: ge_stiffness_t, ge_compliance, forbid_stretch

   !> Compliances of an element; zero means rigid. If the section varies along the element, the values at its middle are scales.
   type :: ge_stiffness_t
      real(wp) :: axial = 0.0_wp   !! 1/EA
      real(wp) :: bending = 0.0_wp !! 1/EI
      real(wp) :: shear = 0.0_wp   !! 1/GA, exactly zero for shear-rigid rods
      real(wp) :: give = 0.0_wp !! axial compliance of the tangent of an inextensible element (1/EA = 0), whose tangent would
      !! otherwise be singular if the element is straight
      real(wp) :: part(3, max_stages) = 1.0_wp !! axial, bending and shear compliance at the stages, over the compliances above
   end type ge_stiffness_t

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
end module rod_compliance
