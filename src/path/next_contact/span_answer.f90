!> What follows where a test of the contact spans is zero: the next set, and what is told of it.
module span_answer
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t
   implicit none
   private
   public :: answer_t, numbers, stretch_length

   !> What follows, and what is told of it.
   type :: answer_t
      type(contact_span_t), allocatable :: contact_span(:) !! the new set, but for what begins (beginning_together)
      integer :: between(2) = 0                   !! numbers of the touches between which a free span begins, 0: a breakpoint; both
      !! the same: a line of contact begins, between its own ends
      integer, allocatable :: crosses(:, :)       !! (2, spans) the same of spans behind breakpoints, that which begins last first
      character(2) :: label = '  '                !! contact gained or lost; where it only spreads or shrinks, nothing
      logical :: divides = .false.                !! of the contact that is lost a part stays on both sides
      character(:), allocatable :: no_rule        !! there is none, and contact at nodes has to tell (ask_nodes): where that is
   end type answer_t

contains

   !> Numbers of two touches of a set.
   pure function numbers(set, at) result(number)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: at(2)                 !! indices, 0: none
      integer :: number(2), i
      number = 0
      do i = 1, 2
         if (at(i) > 0) number(i) = set(at(i))%number
      end do
   end function numbers

   !> Length of the stretch of a touch.
   pure real(wp) function stretch_length(problem, contact_span) result(length)
      type(problem_t), intent(in) :: problem
      type(contact_span_t), intent(in) :: contact_span
      length = problem%layout%rod_segment(contact_span%rod_segment)%length
   end function stretch_length
end module span_answer
