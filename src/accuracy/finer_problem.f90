!> The same structure on the same nodes with one more Gauss point in every element: what discretisation errors are told by.
!>
!> With s points an element errs by O(h^(2s)), with s + 1 by two orders less, so that the difference of the two is the error of
!> the first. Everything that an element has by its order has a counterpart: foundations inside it, its obstacle's track, the
!> touchdown points at its ends, the profile that tells gaps and monitors between nodes.
module finer_problem
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t
   use rod_state, only: state_t
   use rod_geometry, only: geometry_t, new_geometry, shift_nodes
   use gauss_tableau, only: tableau_t, max_stages
   use ge_element, only: ge_compliance, forbid_stretch, ge_size
   use conforming_element, only: conforming_size
   use ground, only: new_ground
   implicit none
   private
   public :: new_finer_problem, finer_state

contains

   !> The finer problem. UL2 elements stay as they are.
   function new_finer_problem(problem) result(finer)
      type(problem_t), intent(in) :: problem
      type(problem_t) :: finer
      type(geometry_t) :: home
      integer :: e
      finer = problem
      where (finer%model%mesh%family == family_ge) finer%model%mesh%stages = finer%model%mesh%stages + 1
      home = new_geometry(finer%model, finer%tableau)
      if (any(problem%ground%founded)) then
         finer%ground = new_ground(finer%model, finer%tableau, home)
         finer%ground%chain = problem%ground%chain
      end if
      associate (mesh => finer%model%mesh)
         do e = 1, mesh%n_elements
            if (mesh%family(e) /= family_ge) cycle
            associate (section => finer%model%section(mesh%section(e)))
               finer%compliance(e) = ge_compliance(mesh%stages(e), home%element(e)%length, section%ea, section%ei, section%ga, &
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
   end function new_finer_problem

   !> A state of the problem as one of the finer problem: the displacements of the nodes, and of the resultants the collocation
   !> polynomial. Its elements are out of balance by what the first ones err.
   function finer_state(problem, state, finer) result(new)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(problem_t), intent(in) :: finer
      type(state_t) :: new
      real(wp) :: shift(problem%model%mesh%n_nodes)
      integer :: e, s, node
      new = state
      new%geometry = new_geometry(finer%model, finer%tableau)
      shift = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         node = problem%model%mesh%node(2, e)
         shift(node) = state%geometry%element(e)%s(2) - problem%model%mesh%s(2, e)
      end do
      call shift_nodes(finer%model, finer%tableau, shift, new%geometry)
      deallocate (new%z)
      allocate (new%z(maxval(finer%z_size), size(finer%z_size)), source=0.0_wp)
      do e = 1, problem%model%mesh%n_elements
         if (problem%model%mesh%family(e) /= family_ge) then
            new%z(:problem%z_size(e), e) = state%z(:problem%z_size(e), e)
            cycle
         end if
         s = problem%model%mesh%stages(e)
         associate (z => state%z(:problem%z_size(e), e), n => finer%z_size(e), from => problem%tableau(s), &
            & to => finer%tableau(s + 1))
            if (problem%conforms(e) > 0) then
               new%z(1, e) = z(1)
               new%z(2:2 + s, e) = stage_values(from, to, z(1), z(2:1 + s))
               new%z(3 + s:3 + 2 * s, e) = stage_values(from, to, 0.0_wp, z(2 + s:1 + 2 * s))
               cycle
            end if
            new%z(1:3, e) = z(1:3)
            new%z(4:4 + s, e) = stage_values(from, to, z(3), z(4:3 + s))
            if (n == 4 + s) cycle
            new%z(5 + s:5 + 3 * s:2, e) = stage_values(from, to, z(1), z(4 + s:2 + 3 * s:2))
            new%z(6 + s:6 + 3 * s:2, e) = stage_values(from, to, z(2), z(5 + s:3 + 3 * s:2))
         end associate
      end do
   end function finer_state

   !> Values at the points of another tableau of the polynomial through the first end and the points of the first one.
   pure function stage_values(from, to, first, value) result(new)
      type(tableau_t), intent(in) :: from, to
      real(wp), intent(in) :: first              !! at the first end
      real(wp), intent(in) :: value(:)           !! (stages of `from`)
      real(wp) :: new(to%stages)
      real(wp) :: at(0:max_stages), given(0:max_stages), product
      integer :: i, j, k, s
      s = from%stages
      at(0) = 0.0_wp
      at(1:s) = from%c(:s)
      given(0) = first
      given(1:s) = value
      new = 0.0_wp
      do i = 1, to%stages
         do j = 0, s
            product = given(j)
            do k = 0, s
               if (k /= j) product = product * (to%c(i) - at(k)) / (at(j) - at(k))
            end do
            new(i) = new(i) + product
         end do
      end do
   end function stage_values
end module finer_problem
