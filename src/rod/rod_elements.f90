!> The kinds of elements there are: the list where a new one is put down.
module rod_elements
   use model, only: family_ul2
   use problem, only: problem_t
   use rod_element, only: rod_element_t
   use ge_rod, only: ge_rod_t
   use ul2_rod, only: ul2_rod_t
   use conforming_rod, only: conforming_rod_t
   implicit none
   private
   public :: rod_at

   ! They have no data: nothing in them can change.
   type(ge_rod_t), target, save :: ge = ge_rod_t()
   type(ul2_rod_t), target, save :: ul2 = ul2_rod_t()
   type(conforming_rod_t), target, save :: conforming = conforming_rod_t()

contains

   !> The kind of an element, as contact spans have it now.
   function rod_at(problem, e) result(rod)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: e
      class(rod_element_t), pointer :: rod
      if (problem%conforms(e) > 0) then
         rod => conforming
      else if (problem%model%mesh%family(e) == family_ul2) then
         rod => ul2
      else
         rod => ge
      end if
   end function rod_at
end module rod_elements
