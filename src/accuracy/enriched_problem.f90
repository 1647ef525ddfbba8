!> The same structure on the same nodes with one more Gauss point in every element: what discretisation errors are told by.
!>
!> With s points an element errs by O(h^(2s)), with s + 1 by two orders less, so that the difference of the two is the error of
!> the first. Everything that an element has by its order has a counterpart: foundations inside it, its obstacle's track, the
!> touchdown points at its ends, the profile that tells gaps and monitors between nodes.
module enriched_problem
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use element_families, only: collocates
   use rod_state, only: state_t
   use rod_geometry, only: geometry_t, new_geometry, with_other_stages
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use ge_element, only: ge_compliance, forbid_stretch, ge_size
   use conforming_element, only: conforming_size
   use ground, only: new_ground
   use system_type, only: system_t
   implicit none
   private
   public :: enriched_problem_t, provide_finer_problem, new_finer_problem, new_finer_state

   !> A finer problem that is kept from point to point: to make it takes as long as to solve it.
   type :: enriched_problem_t
      type(problem_t), allocatable :: problem    !! not allocated: the problem has changed since
      type(geometry_t) :: geometry               !! of its last state
      type(system_t), allocatable :: system      !! storage for its equations, while no point of it has that
   contains
      procedure :: forget
   end type enriched_problem_t

contains

   !> Sees to it that there is one for a problem.
   subroutine provide_finer_problem(problem, finer)
      type(problem_t), intent(in) :: problem     !! that of the last time, or forgotten since, or in another step
      type(enriched_problem_t), intent(inout) :: finer
      if (allocated(finer%problem)) then
         if (finer%problem%step == problem%step) return
         call finer%forget()
      end if
      allocate (finer%problem)
      call new_finer_problem(problem, finer%problem)
   end subroutine provide_finer_problem

   !> The problem has changed.
   subroutine forget(finer)
      class(enriched_problem_t), intent(inout) :: finer
      if (allocated(finer%problem)) deallocate (finer%problem)
      if (allocated(finer%geometry%element)) deallocate (finer%geometry%element)
      if (allocated(finer%system)) deallocate (finer%system)
   end subroutine forget

   !> The finer problem. UL2 elements stay as they are.
   subroutine new_finer_problem(problem, finer)
      type(problem_t), intent(in) :: problem
      type(problem_t), intent(out) :: finer
      integer :: e
      call copy_problem(problem, finer)
      where (collocates(finer%model%mesh%family)) finer%model%mesh%stages = finer%model%mesh%stages + 1
      if (any(problem%ground%founded)) then
         finer%ground = new_ground(finer%model, finer%tableau, new_geometry(finer%model, finer%tableau))
         finer%ground%chain = problem%ground%chain
         finer%ground%tabled = problem%ground%tabled
      end if
      associate (mesh => finer%model%mesh)
         do e = 1, mesh%n_elements
            if (.not. collocates(mesh%family(e))) cycle
            associate (section => finer%model%section(mesh%section(e)))
               ! The length counts for one stage only.
               finer%compliance(e) = ge_compliance(mesh%stages(e), 0.0_wp, section%ea, section%ei, section%ga, &
                  & section%shear_rigid)
               if (section%inextensible) call forbid_stretch(finer%compliance(e), finer%size)
            end associate
            if (finer%conforms(e) > 0) then
               finer%z_size(e) = conforming_size(mesh%stages(e))
            else
               finer%z_size(e) = ge_size(mesh%stages(e), finer%pressurised(e) .or. finer%ground%founded(e))
            end if
         end do
      end associate
   end subroutine new_finer_problem

   !> A state of the problem as one of the finer problem: the displacements of the nodes, and of the resultants the collocation
   !> polynomial. Its elements are out of balance by what the first ones err.
   subroutine new_finer_state(problem, state, finer, new, known)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(problem_t), intent(in) :: finer
      type(state_t), intent(out) :: new
      type(geometry_t), intent(in), optional :: known !! of another state of the finer problem
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
