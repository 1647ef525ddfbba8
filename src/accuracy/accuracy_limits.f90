!> Where one more point in every element says nothing of the error.
module accuracy_limits
   use kinds, only: wp
   use problem, only: problem_t
   use element_families, only: collocates
   use rod_state, only: state_t
   use ground_segments, only: is_cut
   use ground_cuts, only: find_cuts, marked
   use stop_forces, only: is_stop
   implicit none
   private
   public :: why_not_told

contains

   !> The reason why errors are not told at a converged state, in words; '' where they are.
   !>
   !> What has no kink inside an element converges as its order says. Contact at nodes has one wherever a node begins or ceases
   !> to touch. Where contact with a foundation ends, or its law has a corner, the mesh is to have a mark; where it cannot have one,
   !> or will not, there is an error of its own (inner_kinks). The UL2 element is of another kind.
   function why_not_told(problem, state, as_it_is, smallest) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in), optional :: as_it_is  !! no other mesh will be made for that
      real(wp), intent(in), optional :: smallest !! where contact with a foundation begins or ends: what its gap was located to
      character(:), allocatable :: why
      integer :: c
      why = ''
      if (any(.not. collocates(problem%model%mesh%family))) why = 'the mesh has UL2 elements'
      do c = 1, problem%candidates%n
         if (problem%candidates%touch(c) > 0 .or. .not. state%active(c)) cycle
         ! Stops stand at nodes that the deck names.
         if (is_stop(problem, c)) cycle
         if (size(problem%model%contact(problem%candidates%contact(c))%node) > 1) why = 'contact is at the nodes of the mesh'
      end do
      if (present(as_it_is)) then
         if (as_it_is) return
      end if
      do c = 1, problem%ground%chain%n
         if (problem%ground%chain%element(2, c) == 0) cycle
         if (.not. is_cut(problem, state, c, smallest)) cycle
         if (.not. marked(problem, state, find_cuts(problem, state))) &
            & why = 'contact with a foundation ends, or its law has a corner, inside an element'
         exit
      end do
   end function why_not_told
end module accuracy_limits
