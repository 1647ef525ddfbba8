!> Properties of the kinds of elements, for code that needs them before elements exist. It is the only table to be extended for a
!> new kind. The equations of a kind are in rod_equations.
module element_families
   use text, only: to_text
   use model, only: family_ul2, family_ge
   implicit none
   private
   public :: collocates, follows_curves, conforms, element_kind, family_name

   !> Properties of the families, indexed by family_ul2, family_ge:
   logical, parameter :: collocates(2) = [.false., .true.] !! true: equations at Gauss points: the section forces are internal
   !! unknowns, so that the element may be inextensible; foundations act on its polynomial between the nodes; one more Gauss point
   !! gives an error estimate
   logical, parameter :: follows_curves(2) = [.false., .true.] !! true: exact on a curve that a card generates; false: straight
   !! between its nodes
   logical, parameter :: conforms(2) = [.false., .true.] !! true: contact spans may move its nodes and make it conform to an
   !! obstacle, if it has two or more Gauss points

contains

   !> Family and number of Gauss points that a word of the deck stands for.
   pure subroutine element_kind(word, number, stages)
      character(*), intent(in) :: word            !! word that the card table accepts
      integer, intent(out) :: number, stages
      number = merge(family_ul2, family_ge, word == 'UL2')
      stages = index('2468', word(3:3))
      if (number == family_ul2) stages = 0
   end subroutine element_kind

   !> Word of the deck for a family with a number of Gauss points.
   pure function family_name(number, stages) result(name)
      integer, intent(in) :: number, stages       !! family and number of Gauss points, see mesh_t
      character(:), allocatable :: name
      if (number == family_ul2) then
         name = 'UL2'
      else
         name = 'GE'//to_text(2 * stages)
      end if
   end function family_name
end module element_families
