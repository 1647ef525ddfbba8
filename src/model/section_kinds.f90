!> The quantities of a cross section that monitors observe: one table of their numbers, words in the deck, names and units.
module section_kinds
   implicit none
   private
   public :: section_kind_t, section_kind, section_words
   public :: section_axial, section_moment, section_strain, section_stress

   !> Numbers of the quantities: rows of the table. The shear force is 2; no procedure treats it by its number. Section forces come
   !> first, in the order in which elements give them.
   integer, parameter :: section_axial = 1, section_moment = 3, section_strain = 4, section_stress = 5

   !> Words of the deck, in the order of the numbers: first those of the quantities, then those of the places where their magnitude
   !> is largest.
   character(*), parameter :: section_words = 'N|Q|M|STRAIN|STRESS|N AT|Q AT|M AT|STRAIN AT|STRESS AT'

   !> A quantity of a cross section.
   type :: section_kind_t
      character(12) :: name
      character(14) :: units
      logical :: of_fibre !! true: the largest value over the fibres of the section, which needs the section's shape; false: a
      !! section force
   end type section_kind_t

   type(section_kind_t), parameter :: section_kind(5) = [ &
      & section_kind_t('normal force', 'force', .false.), &
      & section_kind_t('shear force', 'force', .false.), &
      & section_kind_t('moment', 'moment', .false.), &
      & section_kind_t('strain', '1', .true.), &
      & section_kind_t('stress', 'force/length^2', .true.)]
end module section_kinds
