!> The free spans of the rods: what lies between two touches of a stretch, or between a touch and a breakpoint, or two of these.
module free_span
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   implicit none
   private
   public :: free_span_t, free_spans, span_ends

   type :: free_span_t
      integer :: stretch = 0
      integer :: element(2) = 0             !! the first and the last
      integer :: touch(2) = 0               !! before and after it, indices into problem%touch; 0: a breakpoint without one
      integer :: contact(2) = 0             !! of these, indices into model%contact
   end type free_span_t

contains

   !> All of them in their order along the stretches; the same ones for all states of a problem.
   pure function free_spans(problem) result(span)
      type(problem_t), intent(in) :: problem
      type(free_span_t), allocatable :: span(:)
      integer :: j, k, before, first
      allocate (span(0))
      do j = 1, size(problem%layout%stretch)
         before = 0
         first = problem%element_first(j)
         do k = 1, size(problem%touch)
            if (problem%touch(k)%stretch /= j) cycle
            call add(problem%touch(k)%element(1) - 1, k)
            first = problem%touch(k)%element(2) + 1
            before = k
         end do
         call add(problem%element_last(j), 0)
      end do

   contains

      pure subroutine add(last, after)
         integer, intent(in) :: last, after
         ! A touch at a breakpoint has none on its side.
         if (last < first) return
         span = [span, free_span_t(j, [first, last], [before, after])]
         associate (new => span(size(span)))
            if (before > 0) new%contact(1) = problem%touch(before)%contact
            if (after > 0) new%contact(2) = problem%touch(after)%contact
         end associate
      end subroutine add
   end function free_spans

   !> Coordinates of its ends along the stretch.
   pure function span_ends(problem, state, span) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(free_span_t), intent(in) :: span
      real(wp) :: at(2)
      integer :: side
      at = [(state%geometry%element(span%element(side))%s(side) + problem%origin(span%element(side)), side=1, 2)]
   end function span_ends
end module free_span
