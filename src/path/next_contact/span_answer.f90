!> Answer of a rule (span_rules) to a contact test that is zero: the next contact set and its properties.
module span_answer
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t
   implicit none
   private
   public :: answer_t, numbers, segment_length

   !> Next contact set and its properties.
   type :: answer_t
      type(contact_span_t), allocatable :: contact_span(:) !! next set, without contacts that begin (beginning_together)
      integer, allocatable :: crosses(:, :)  !! (2, spans) numbers of the contact spans beside new free spans at segment boundaries,
      !! 0: the boundary; the last to begin comes first
      character(2) :: label = '  '                !! contact gained (C+) or lost (C-); empty if contact only spreads or shrinks
      character(:), allocatable :: no_rule  !! allocated if there is no rule: names the change; contact at nodes is used
   end type answer_t

contains

   !> Identity numbers, which stay the same along the path, of two contact spans given by their indices in a set.
   pure function numbers(set, at) result(number)
      type(contact_span_t), intent(in) :: set(:)
      integer, intent(in) :: at(2)                 !! indices, 0: none
      integer :: number(2), i
      number = 0
      do i = 1, 2
         if (at(i) > 0) number(i) = set(at(i))%number
      end do
   end function numbers

   !> Length of the rod segment of a contact span.
   pure real(wp) function segment_length(problem, contact_span) result(length)
      type(problem_t), intent(in) :: problem
      type(contact_span_t), intent(in) :: contact_span
      length = problem%layout%rod_segment(contact_span%rod_segment)%length
   end function segment_length
end module span_answer
