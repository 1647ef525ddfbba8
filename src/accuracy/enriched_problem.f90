!> The enriched problem: the same structure on the same nodes with one more Gauss point in every element. It serves error estimates.
!>
!> The error of an element with s Gauss points is O(h^(2s)); with s + 1 points it is two orders smaller. The difference between the
!> two solutions therefore estimates the error of the first. All parts that depend on the order of an element are enriched:
!> foundations inside the element, the conforming element on the track of its obstacle, touchdown points at its ends, and the rod
!> profile, from which gaps and monitors between nodes are computed.
module enriched_problem
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use element_families, only: collocates
   use rod_state, only: state_t
   use rod_geometry, only: geometry_t, new_geometry, with_other_stages
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use ge_element, only: ge_size
   use conforming_element, only: conforming_size
   use ground, only: new_ground
   use system_type, only: system_t
   implicit none
   private
   public :: enriched_problem_t, provide_finer_problem, new_finer_problem, new_finer_state

   !> An enriched problem, kept from point to point because its construction costs as much as its solution.
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
      type(problem_t), intent(in) :: problem !! original problem; unchanged since the last call (except for its step), unless
      !! `forget` was called
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

   !> Makes the enriched problem. UL2 elements stay the same.
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
            ! In elements with one stage (Gauss point) the shear compliance is not that of the section; the enriched element has the
            ! section's.
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

   !> Transfers a state to the enriched problem: the displacements at the nodes, and the stress resultants by the collocation
   !> polynomials. The residuals of the enriched elements are then the discretisation errors of the state.
   subroutine new_finer_state(problem, state, finer, new, known)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(problem_t), intent(in) :: finer
      type(state_t), intent(out) :: new
      type(geometry_t), intent(in), optional :: known !! geometry of the enriched problem at another state, which saves its
      !! computation
      class(rod_element_t), pointer :: rod
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
         rod => rod_at(problem, e)
         new%z(:finer%z_size(e), e) = rod%finer_unknowns(problem, state, finer, e)
      end do
   end subroutine new_finer_state
end module enriched_problem
