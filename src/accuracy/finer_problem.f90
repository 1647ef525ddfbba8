!> The same structure on the same nodes with one more Gauss point in every element: what discretisation errors are told by.
!>
!> With s points an element errs by O(h^(2s)), with s + 1 by two orders less, so that the difference of the two is the error of
!> the first. Everything that an element has by its order has a counterpart: foundations inside it, its obstacle's track, the
!> touchdown points at its ends, the profile that tells gaps and monitors between nodes.
module finer_problem
   use kinds, only: wp
   use problem, only: problem_t
   use element_families, only: collocates
   use rod_state, only: state_t
   use rod_geometry, only: new_geometry, with_other_stages
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use ge_element, only: ge_compliance, forbid_stretch, ge_size
   use conforming_element, only: conforming_size
   use ground, only: new_ground
   implicit none
   private
   public :: new_finer_problem, new_finer_state

contains

   !> The finer problem. UL2 elements stay as they are.
   subroutine new_finer_problem(problem, finer)
      type(problem_t), intent(in) :: problem
      type(problem_t), intent(out) :: finer
      integer :: e
      finer = problem
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
   subroutine new_finer_state(problem, state, finer, new)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(problem_t), intent(in) :: finer
      type(state_t), intent(out) :: new
      class(rod_element_t), pointer :: rod
      integer :: e
      new = state
      new%geometry = with_other_stages(finer%model, finer%tableau, state%geometry)
      deallocate (new%z)
      allocate (new%z(maxval(finer%z_size), size(finer%z_size)), source=0.0_wp)
      do e = 1, problem%model%mesh%n_elements
         rod => rod_at(problem, e)
         new%z(:finer%z_size(e), e) = rod%finer_unknowns(problem, state, finer, e)
      end do
   end subroutine new_finer_state
end module finer_problem
