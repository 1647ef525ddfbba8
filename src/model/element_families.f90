!> What the kinds of elements can do, for all that asks before there is an element: the one table where a new kind says so. How it
!> does it is in its rod (rod_elements has the list).
module element_families
   use text, only: to_text
   use model, only: family_ul2, family_ge
   implicit none
   private
   public :: collocates, follows_curves, conforms, element_kind, family_name

   type :: family_t
      logical :: collocates       !! equations at Gauss points: resultants of its own as unknowns, so that it can be kept from
      !! stretching; a polynomial between its nodes, on which foundations act; one more point tells its error
      logical :: follows_curves   !! exact on a curve that a card generates, else straight from node to node
      logical :: conforms         !! contact spans may move its nodes and lay it on an obstacle, from two Gauss points on
   end type family_t

   type(family_t), parameter :: family(2) = [ &
      & family_t(collocates=.false., follows_curves=.false., conforms=.false.), & ! family_ul2
      & family_t(collocates=.true., follows_curves=.true., conforms=.true.)] ! family_ge

contains

   elemental logical function collocates(number)
      integer, intent(in) :: number               !! as in mesh_t
      collocates = family(number)%collocates
   end function collocates

   elemental logical function follows_curves(number)
      integer, intent(in) :: number
      follows_curves = family(number)%follows_curves
   end function follows_curves

   elemental logical function conforms(number)
      integer, intent(in) :: number
      conforms = family(number)%conforms
   end function conforms

   !> The kind that a deck's word stands for, and its Gauss points.
   pure subroutine element_kind(word, number, stages)
      character(*), intent(in) :: word            !! one that the card table accepts
      integer, intent(out) :: number, stages
      number = family_ge
      select case (word)
      case ('GE2')
         stages = 1
      case ('GE4')
         stages = 2
      case ('GE6')
         stages = 3
      case ('GE8')
         stages = 4
      case default
         number = family_ul2
         stages = 0
      end select
   end subroutine element_kind

   !> The word of a kind.
   pure function family_name(number, stages) result(name)
      integer, intent(in) :: number, stages       !! as in mesh_t
      character(:), allocatable :: name
      if (number == family_ul2) then
         name = 'UL2'
      else
         name = 'GE'//to_text(2 * stages)
      end if
   end function family_name
end module element_families
