!> Contact spans that continue past segment boundaries.
module past_breakpoints
   use problem, only: problem_t
   implicit none
   private
   public :: beyond, end_node

contains

   !> Rod segment into which a contact span can continue past an end of its own rod segment; 0: none. The same contact must cover
   !> this rod segment, and no support may act at the boundary. (Without a support, the force of the contact span passes to the free
   !> span behind the boundary.)
   pure integer function beyond(problem, contact_span, way) result(rod_segment)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact_span      !! index into problem%contact_span
      integer, intent(in) :: way               !! -1: past the first end, 1: past the last end
      integer :: e, node
      rod_segment = 0
      node = end_node(problem, contact_span, way)
      e = problem%beside(merge(1, 2, way < 0), node)
      if (e == 0 .or. any(problem%model%fixed(:, node))) return
      if (problem%covered(problem%rod_segment(e), problem%contact_span(contact_span)%contact)) rod_segment = problem%rod_segment(e)
   end function beyond

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
