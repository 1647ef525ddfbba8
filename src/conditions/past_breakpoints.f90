!> Contact spans that continue past segment boundaries.
module past_breakpoints
   use problem, only: problem_t
   implicit none
   private
   public :: beyond, across

contains

   !> Rod segment on which a contact span continues past an end of its own segment, if the same contact covers that segment and no
   !> support acts at the boundary. (Without a support, force passes from the contact span to the free span there.) 0: none.
   pure integer function beyond(problem, contact_span, way) result(rod_segment)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact_span      !! index into problem%contact_span
      integer, intent(in) :: way               !! -1: past the first end, 1: past the last end
      rod_segment = across(problem, contact_span, way)
      if (any(problem%model%fixed(:, end_node(problem, contact_span, way)))) rod_segment = 0
   end function beyond

   !> Rod segment beyond the end of a contact span's own segment, if the same contact covers it; a support may act at the boundary.
   !> 0: none.
   pure integer function across(problem, contact_span, way) result(rod_segment)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact_span      !! index into problem%contact_span
      integer, intent(in) :: way               !! -1: past the first end, 1: past the last end
      integer :: e
      rod_segment = 0
      e = problem%beside(merge(1, 2, way < 0), end_node(problem, contact_span, way))
      if (e == 0) return
      if (problem%covered(problem%rod_segment(e), problem%contact_span(contact_span)%contact)) rod_segment = problem%rod_segment(e)
   end function across

   !> Node at one end of the rod segment of a contact span.
   pure integer function end_node(problem, contact_span, way) result(node)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact_span, way !! index of the contact span; way -1: first end, 1: last end of its rod segment
      associate (own => problem%contact_span(contact_span)%rod_segment)
         if (way < 0) then
            node = problem%model%mesh%node(1, problem%element_first(own))
         else
            node = problem%model%mesh%node(2, problem%element_last(own))
         end if
      end associate
   end function end_node
end module past_breakpoints
