!> Where contact goes on past the breakpoints of its rod.
module past_breakpoints
   use problem, only: problem_t
   implicit none
   private
   public :: beyond, across, end_node

contains

   !> The stretch on which a contact goes on past the end of its own: the obstacle is the same there, and at the breakpoint between
   !> no support holds the rod. Forces pass from the free span to the contact, or back. 0: there is none.
   pure integer function beyond(problem, touch, way) result(stretch)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: touch             !! index into problem%touch
      integer, intent(in) :: way               !! -1: before it, 1: after it
      stretch = across(problem, touch, way)
      if (any(problem%model%fixed(:, end_node(problem, touch, way)))) stretch = 0
   end function beyond

   !> The stretch on the other side of a breakpoint at which the stretch of a touch ends, held there or not, where the contact
   !> covers it. 0: there is none.
   pure integer function across(problem, touch, way) result(stretch)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: touch             !! index into problem%touch
      integer, intent(in) :: way               !! -1: before it, 1: after it
      integer :: e
      stretch = 0
      e = problem%beside(merge(1, 2, way < 0), end_node(problem, touch, way))
      if (e == 0) return
      if (problem%covered(problem%stretch(e), problem%touch(touch)%contact)) stretch = problem%stretch(e)
   end function across

   !> The node at one end of a touch's stretch.
   pure integer function end_node(problem, touch, way) result(node)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: touch, way        !! as in across
      associate (own => problem%touch(touch)%stretch)
         if (way < 0) then
            node = problem%model%mesh%node(1, problem%element_first(own))
         else
            node = problem%model%mesh%node(2, problem%element_last(own))
         end if
      end associate
   end function end_node
end module past_breakpoints
