!> States at which the enriched problem (one more Gauss point in each element) gives no error estimate.
module accuracy_limits
   use kinds, only: wp
   use problem, only: problem_t
   use element_families, only: collocates
   use rod_state, only: state_t
   use ground_segments, only: is_cut, gap_rounding
   use ground_cuts, only: find_cuts, marked
   use node_contact_functional, only: is_stop
   implicit none
   private
   public :: why_no_bars

contains

   !> Reason why no error can be estimated at a converged state, in words; '' if an estimate is possible.
   !>
   !> Solutions without kinks inside elements converge with the order of the elements. Contact at nodes causes a kink at each end of
   !> a contact. An end of contact with a foundation, or a corner of the foundation's law, should be an interface point of the mesh.
   !> If it is not, the kink lies inside an element and has an error estimate of its own (element_errors). The UL2 element has no
   !> enriched form.
   function why_no_bars(problem, state, keeps_mesh, smallest) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in), optional :: keeps_mesh !! true: the mesh is not refined because of these kinks
      real(wp), intent(in), optional :: smallest !! smallest gap that location could resolve at an end of foundation contact, see
      !! element_cuts
      character(:), allocatable :: why
      real(wp) :: rounding
      integer :: c
      why = ''
      if (any(.not. collocates(problem%model%mesh%family))) why = 'the mesh has UL2 elements'
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) > 0 .or. .not. state%active(c)) cycle
         ! The force of a stop makes a kink of the solution at a node that every mesh has, and never inside an element, so that an
         ! error can be estimated.
         if (is_stop(problem, c)) cycle
         if (size(problem%model%contact(problem%candidates%contact(c))%node) > 1) why = 'contact is at the nodes of the mesh'
      end do
      if (present(keeps_mesh)) then
         if (keeps_mesh) return
      end if
      if (problem%ground%chain%n > 0) rounding = gap_rounding(state)
      do c = 1, problem%ground%chain%n
         if (problem%ground%chain%element(2, c) == 0) cycle
         if (.not. is_cut(problem, state, c, rounding, smallest)) cycle
         if (.not. marked(problem, state, find_cuts(problem, state))) &
            & why = 'contact with a foundation ends, or its law has a corner, inside an element'
         exit
      end do
   end function why_no_bars
end module accuracy_limits
