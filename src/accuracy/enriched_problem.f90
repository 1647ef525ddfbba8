!> The enriched problem: the same structure on the same nodes with one more Gauss point in every element. Error estimates are
!> computed with it.
!>
!> The error of an element with s Gauss points is O(h^(2s)); with s + 1 points it is two orders smaller. The difference between the
!> two solutions therefore estimates the error of the original one. All parts that depend on the order of an element are enriched:
!> foundations inside the element, the conforming element on the track of its obstacle, touchdown points at its ends, and the rod
!> profile, from which gaps and monitors between nodes are computed. At some states no error can be estimated in this way;
!> why_no_bars gives the reason.
module enriched_problem
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use element_families, only: collocates
   use rod_state, only: state_t
   use rod_geometry, only: geometry_t, new_geometry, with_other_stages
   use ge_element, only: ge_size
   use conforming_element, only: conforming_size
   use gauss_tableau, only: raised_values
   use ground, only: new_ground
   use system_type, only: system_t
   use ground_segments, only: any_cut
   use ground_cuts, only: find_cuts, marked
   use node_contact_functional, only: is_stop
   implicit none
   private
   public :: enriched_problem_t, provide_finer_problem, new_finer_problem, new_finer_state, why_no_bars

   !> An enriched problem. It is kept from point to point of the path, because to construct it costs as much as to solve it.
   type :: enriched_problem_t
      type(problem_t), allocatable :: problem    !! the enriched problem; not allocated: the original problem has changed
      type(geometry_t) :: geometry               !! geometry at the last state of the enriched problem
      type(system_t), allocatable :: system      !! storage for the equations of the enriched problem, while no point uses it
   contains
      procedure :: forget
   end type enriched_problem_t

contains

   !> Makes the enriched problem of a problem, unless it exists already.
   subroutine provide_finer_problem(problem, finer)
      type(problem_t), intent(in) :: problem !! original problem. If it has changed since the last call, in more than its step, the
      !! caller must have called `forget`
      type(enriched_problem_t), intent(inout) :: finer
      if (allocated(finer%problem)) then
         if (finer%problem%step == problem%step) return
         call finer%forget()
      end if
      allocate (finer%problem)
      call new_finer_problem(problem, finer%problem)
   end subroutine provide_finer_problem

   !> Discards the enriched problem after a change of the original problem.
   subroutine forget(finer)
      class(enriched_problem_t), intent(inout) :: finer
      if (allocated(finer%problem)) deallocate (finer%problem)
      if (allocated(finer%geometry%element)) deallocate (finer%geometry%element)
      if (allocated(finer%system)) deallocate (finer%system)
   end subroutine forget

   !> Makes the enriched problem of a problem. UL2 elements, which have no Gauss points, are not changed.
   subroutine new_finer_problem(problem, finer)
      type(problem_t), intent(in) :: problem
      type(problem_t), intent(out) :: finer
      integer :: e
      call copy_problem(problem, finer)
      where (collocates(finer%model%mesh%family)) finer%model%mesh%stages = finer%model%mesh%stages + 1
      if (any(problem%ground%founded)) then
         finer%ground = new_ground(finer%model, finer%tableau, new_geometry(finer%model))
         finer%ground%chain = problem%ground%chain
         finer%ground%tabled = problem%ground%tabled
      end if
      associate (mesh => finer%model%mesh)
         do e = 1, mesh%n_elements
            if (.not. collocates(mesh%family(e))) cycle
            ! In elements with one stage (Gauss point) the shear compliance is changed from that of the section. The enriched
            ! element, with two stages, has the shear compliance of the section.
            associate (section => finer%model%section(mesh%section(e)))
               if (mesh%stages(e) == 2) finer%compliance(e)%shear = 0.0_wp
               if (mesh%stages(e) == 2 .and. .not. section%shear_rigid) finer%compliance(e)%shear = 1.0_wp / section%ga
            end associate
            if (finer%conforms(e) > 0) then
               finer%z_size(e) = conforming_size(mesh%stages(e))
            else
               finer%z_size(e) = ge_size(mesh%stages(e), finer%pressurised(e) .or. finer%ground%founded(e))
            end if
         end do
      end associate
   end subroutine new_finer_problem

   !> Transfers a state to the enriched problem: the displacements at the nodes, and the stress resultants by evaluating the
   !> collocation polynomials at the new Gauss points. The residuals of the enriched elements are then the discretisation errors of
   !> the state.
   subroutine new_finer_state(problem, state, finer, new, known)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(problem_t), intent(in) :: finer
      type(state_t), intent(out) :: new
      type(geometry_t), intent(in), optional :: known !! geometry of the enriched problem at another state; parts that do not depend
      !! on the state are taken from it
      type(geometry_t) :: none
      integer :: e
      new = state
      if (present(known)) then
         new%geometry = with_other_stages(finer%model, finer%tableau, state%geometry, known)
      else
         new%geometry = with_other_stages(finer%model, finer%tableau, state%geometry, none)
      end if
      deallocate (new%z)
      allocate (new%z(maxval(finer%z_size), size(finer%z_size)), source=0.0_wp)
      do e = 1, problem%model%mesh%n_elements
         new%z(:finer%z_size(e), e) = finer_unknowns(problem, state, e)
      end do
   end subroutine new_finer_state

   !> Stored unknowns of an element of the enriched problem, from the collocation polynomials of the original element: those of
   !> section forces or, in a conforming element, of force and position. Their residual is the discretisation error of the element.
   pure function finer_unknowns(problem, state, e) result(z)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      integer, intent(in) :: e
      real(wp), allocatable :: z(:)
      associate (s => problem%model%mesh%stages(e), old => state%z(:problem%z_size(e), e), &
         & from => problem%tableau(max(1, problem%model%mesh%stages(e))))
         if (.not. collocates(problem%model%mesh%family(e))) then
            z = old
         else if (problem%conforms(e) > 0) then
            z = [old(1), raised_values(from, old(1), old(2:1 + s)), raised_values(from, 0.0_wp, old(2 + s:1 + 2 * s))]
         else
            z = [old(1:3), raised_values(from, old(3), old(4:3 + s))]
            if (size(old) > 3 + s) z = [z, pairs(raised_values(from, old(1), old(4 + s:2 + 3 * s:2)), &
               & raised_values(from, old(2), old(5 + s:3 + 3 * s:2)))]
         end if
      end associate
   end function finer_unknowns

   !> Merges two sequences of equal length: one(1), other(1), one(2), other(2), ...
   pure function pairs(one, other)
      real(wp), intent(in) :: one(:), other(:)
      real(wp) :: pairs(2 * size(one))
      pairs = reshape(transpose(reshape([one, other], [size(one), 2])), [2 * size(one)])
   end function pairs

   !> Reason why no error can be estimated at a converged state, in words; '' if an estimate is possible.
   !>
   !> Solutions without kinks inside elements converge with the order of the elements. Contact at nodes causes a kink inside an
   !> element at each end of a contact. Where contact with a foundation ends, or the penetration is at a corner of the foundation's
   !> law, the mesh should have an interface point (a node that moves with this place). Without an interface point the kink lies
   !> inside an element, and its error has an estimate of its own (element_errors). The UL2 element has no enriched form.
   function why_no_bars(problem, state, keeps_mesh, smallest) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in), optional :: keeps_mesh !! true: kinks of foundations' forces inside elements are accepted, and are no
      !! reason
      real(wp), intent(in), optional :: smallest !! smallest gap that the location of the event could resolve at an end of
      !! foundation contact, see element_cuts
      character(:), allocatable :: why
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
      if (.not. any_cut(problem, state, smallest)) return
      if (.not. marked(problem, state, find_cuts(problem, state))) &
         & why = 'contact with a foundation ends, or its law has a corner, inside an element'
   end function why_no_bars
end module enriched_problem
