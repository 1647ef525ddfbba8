!> Free spans: the parts of rods between two contact spans of a rod segment, between a contact span and a segment boundary, or
!> between two segment boundaries.
module free_span
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   implicit none
   private
   public :: free_span_t, free_spans, span_ends

   !> A part of a rod segment without contact.
   type :: free_span_t
      integer :: rod_segment = 0
      integer :: element(2) = 0             !! first and last element
      integer :: contact_span(2) = 0  !! contact spans before and after the free span, indices into problem%contact_span; beside one
      !! contact of the segment, that of the next segment at their boundary counts, too. 0: segment boundary without contact
      integer :: contact(2) = 0             !! contacts of these contact spans, indices into model%contact; 0: none
   end type free_span_t

contains

   !> All free spans in their order along the rod segments; the list is the same for all states of a problem.
   pure function free_spans(problem) result(span)
      type(problem_t), intent(in) :: problem
      type(free_span_t), allocatable :: span(:)
      integer :: j, k, before, first
      allocate (span(0))
      do j = 1, size(problem%layout%rod_segment)
         before = 0
         first = problem%element_first(j)
         do k = 1, size(problem%contact_span)
            if (problem%contact_span(k)%rod_segment /= j) cycle
            call add(problem%contact_span(k)%element(1) - 1, k)
            first = problem%contact_span(k)%element(2) + 1
            before = k
         end do
         call add(problem%element_last(j), 0)
      end do

   contains

      !> Contact span at a node, 0: none.
      pure integer function contact_at(node) result(k)
         integer, intent(in) :: node
         integer :: c
         k = 0
         c = findloc(problem%candidates%node == node .and. problem%candidates%contact_span > 0, .true., 1)
         if (c > 0) k = problem%candidates%contact_span(c)
      end function contact_at

      pure subroutine add(last, after)
         integer, intent(in) :: last, after
         ! Between a contact span at a segment boundary and this boundary there is no free span.
         if (last < first) return
         span = [span, free_span_t(j, [first, last], [before, after])]
         if (before == 0 .and. after > 0) span(size(span))%contact_span(1) = contact_at(problem%model%mesh%node(1, first))
         if (after == 0 .and. before > 0) span(size(span))%contact_span(2) = contact_at(problem%model%mesh%node(2, last))
         associate (new => span(size(span)))
            where (new%contact_span > 0) new%contact = problem%contact_span(max(new%contact_span, 1))%contact
         end associate
      end subroutine add
   end function free_spans

   !> Coordinates of the ends of a free span along its rod segment.
   pure function span_ends(problem, state, span) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(free_span_t), intent(in) :: span
      real(wp) :: at(2)
      integer :: side
      at = [(state%geometry%element(span%element(side))%s(side) + problem%origin(span%element(side)), side=1, 2)]
   end function span_ends
end module free_span
