!> A cross section: its stiffnesses, which are given or follow from a shape and a material; constant along its rods or varying.
module cross_section
   use kinds, only: wp, pi, name_length
   use distribution, only: distributed_t
   implicit none
   private
   public :: section_t, varies, local_section, outer_fibre

   !> A cross section. If it varies, ea, ei, ga and mass are those of the mean dimensions, as scales; see local_section.
   type :: section_t
      character(name_length) :: name = ''       !! element set of the section
      real(wp) :: ea = 0.0_wp, ei = 0.0_wp      !! axial [force] and bending [force length^2] stiffness
      logical :: inextensible = .false.         !! true: 1/EA is zero, and ea is not used
      real(wp) :: ga = 0.0_wp                   !! shear stiffness [force]; not used if shear_rigid is true
      logical :: shear_rigid = .true.
      real(wp) :: mass = 0.0_wp                 !! mass per unit stress-free length (self-weight)
      real(wp) :: expansion = 0.0_wp            !! thermal strain by temperature change
      character(12) :: shape = 'STIFFNESS'      !! word of the deck for the shape
      type(distributed_t) :: dimension(4) !! dimensions of the shape in the order of the deck's data line; for STIFFNESS: EA, EI,
      !! GA, mass
      real(wp) :: young = 0.0_wp, rigidity = 0.0_wp, density = 0.0_wp !! Young's modulus, shear modulus and density of the material;
      !! not used by STIFFNESS and INEXTENSIBLE
   end type section_t

contains

   !> True if the section varies along its rods.
   elemental logical function varies(section)
      type(section_t), intent(in) :: section
      varies = any(section%dimension%distribution > 0)
   end function varies

   !> The section at one place of a rod: EA, EI, GA and mass that follow from the dimensions there.
   pure function local_section(section, sample) result(local)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: sample(:) !! (distributions) values of the distributions at the place; size 0: the mean dimensions are
      !! used
      type(section_t) :: local
      real(wp) :: a(4), area, inertia, shear_area
      integer :: i
      local = section
      a = section%dimension%value
      if (size(sample) > 0) a = [(section%dimension(i)%local(sample), i=1, 4)]
      local%dimension%value = a
      select case (section%shape)
      case ('RECT')
         area = a(1) * a(2)
         inertia = a(1) * a(2)**3 / 12
         shear_area = area * 5 / 6
      case ('CIRC')
         area = pi * a(1)**2
         inertia = pi * a(1)**4 / 4
         shear_area = 0.9_wp * area
      case ('PIPE')
         ! The differences of powers are written without cancellation for thin walls.
         area = pi * a(2) * (2 * a(1) - a(2))
         inertia = area * (a(1)**2 + (a(1) - a(2))**2) / 4
         shear_area = 0.5_wp * area
      case ('GENERAL')
         area = a(1)
         inertia = a(2)
         shear_area = a(3)
      case default
         if (.not. section%inextensible) local%ea = a(1)
         local%ei = a(2)
         local%ga = a(3)
         local%mass = a(4)
         return
      end select
      local%ea = section%young * area
      local%ei = section%young * inertia
      local%ga = section%rigidity * shear_area
      local%mass = section%density * area
   end function local_section

   !> Distance of the outermost fibres from the axis of a section (from local_section); 0 if the deck gives no shape.
   pure real(wp) function outer_fibre(section)
      type(section_t), intent(in) :: section
      select case (section%shape)
      case ('RECT')
         outer_fibre = 0.5_wp * section%dimension(2)%value
      case ('CIRC', 'PIPE')
         outer_fibre = section%dimension(1)%value
      case default
         outer_fibre = 0.0_wp
      end select
   end function outer_fibre
end module cross_section
