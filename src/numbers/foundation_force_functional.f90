!> Sum of an obstacle's distributed foundation forces as a functional.
!>
!> The forces act inside elements and depend on the polynomial of the rod between the nodes. Errors of this polynomial change the
!> sum, in addition to the errors of the elements' end forces; the sum therefore has no error estimate.
module foundation_force_functional
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: resultant_rates, unknowns_of
   use ge_in_state, only: ge_at
   use ge_stages, only: ge_stages_t, find_stages, ge_direction_rates
   use gauss_tableau, only: max_stages, stage_basis
   use ground_regions, only: foundation_totals
   use conforming_span, only: conforming_state_t, conforming_track
   use obstacle_track, only: track_t
   use track_nodes, only: node_track
   use small_dense, only: solve_small
   use state_functional, only: functional_t
   implicit none
   private
   public :: has_foundation, foundation_force_sum, new_foundation_force_functional

contains

   !> True if the obstacle is a foundation whose forces are distributed along elements.
   pure logical function has_foundation(problem, obstacle)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: obstacle
      has_foundation = any(problem%ground%chain%obstacle == obstacle)
   end function has_foundation

   !> Sum of an obstacle's distributed foundation forces: one component, or the sum of the normal forces.
   real(wp) function foundation_force_sum(problem, state, system, obstacle, component) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      real(wp) :: founded(3, size(problem%model%obstacle))
      call foundation_totals(problem, state, system%inner, founded)
      total = founded(component, obstacle)
   end function foundation_force_sum

   !> Linearisation of the sum of an obstacle's foundation forces.
   function new_foundation_force_functional(problem, state, system, obstacle, component) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled and factored at `state`
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      type(functional_t) :: number
      real(wp) :: by_node(3, problem%model%mesh%n_nodes) ! (3, nodes) gradient, global axes
      real(wp) :: by_load(size(state%z, 1), problem%model%mesh%n_elements), none(system%n), du(6), part
      type(ge_stages_t) :: stages
      integer :: e, i, q, z
      number%estimated = .false.
      none = 0.0_wp
      by_load = resultant_rates(problem, system, none, 1.0_wp)
      by_node = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         if (system%inner(e)%n == 0) cycle
         if (.not. any(problem%ground%chain%obstacle(system%inner(e)%at(:system%inner(e)%n)%source) == obstacle)) cycle
         do q = 1, system%inner(e)%n
            associate (at => system%inner(e)%at(q))
               if (problem%ground%chain%obstacle(at%source) == obstacle) number%value = number%value + &
                  & state%geometry%element(e)%length * at%weight * merge(at%force(min(component, 2)), at%pressure, component < 3)
            end associate
         end do
         if (problem%conforms(e) == 0) call find_stages(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), &
            & stages)
         z = problem%z_size(e)
         do i = 1, 6
            du = 0.0_wp
            du(i) = 1.0_wp
            call change_in_element(du, system%op(:z, i, e), 0.0_wp, part)
            associate (derivative => by_node(1 + modulo(i - 1, 3), problem%model%mesh%node((i + 2) / 3, e)))
               derivative = derivative + part
            end associate
         end do
         du = 0.0_wp
         call change_in_element(du, by_load(:z, e), 1.0_wp, part)
         number%by_load = number%by_load + part
         call change_in_element(du, system%op(:z, 7, e), 0.0_wp, part)
         number%defect = number%defect + part
      end do
      number%by_unknown = unknowns_of(problem, system, by_node)

   contains

      !> Change of the foundation force on one element, for changes of the element's unknowns and of the load factor.
      subroutine change_in_element(du, dz, y, change)
         real(wp), intent(in) :: du(6), dz(:) !! changes of the displacements of the element's two nodes (global axes); changes of
         !! the element's stored unknowns
         real(wp), intent(in) :: y               !! change of the load factor
         real(wp), intent(out) :: change
         real(wp) :: rho(2, max_stages), force(2)
         type(conforming_state_t) :: kept
         integer :: q, s
         s = problem%model%mesh%stages(e)
         change = 0.0_wp
         associate (g => state%geometry%element(e))
            if (problem%conforms(e) == 0) rho = ge_direction_rates(stages, du, dz, y)
            do q = 1, system%inner(e)%n
               associate (at => system%inner(e)%at(q))
                  if (problem%ground%chain%obstacle(at%source) /= obstacle) cycle
                  if (problem%conforms(e) > 0) then
                     call conforming_change(problem, state, e, at%tau, kept, du, dz, y, force)
                  else
                     force = du(1:2) + g%length * g%scale * matmul(rho(:, :s), at%basis(:s))
                  end if
                  force = y * at%rate - matmul(at%sway, force) + &
                     & (at%spring * (y * at%approach - dot_product(at%normal, force))) * at%normal
                  if (component < 3) then
                     change = change + g%length * at%weight * force(component)
                  else
                     change = change + g%length * at%weight * dot_product(at%normal, force)
                  end if
               end associate
            end do
         end associate
      end subroutine change_in_element
   end function new_foundation_force_functional

   !> Change of the displacement at a point inside a conforming element, for given changes of the element's unknowns and of the load
   !> factor.
   pure subroutine conforming_change(problem, state, e, tau, kept, du, dz, y, change)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau !! place in the element, 0 to 1 of its stress-free length
      type(conforming_state_t), intent(inout) :: kept
      real(wp), intent(in) :: du(6), dz(:) !! changes of the displacements of the element's two nodes; changes of its stored
      !! unknowns
      real(wp), intent(in) :: y                     !! change of the load factor
      real(wp), intent(out) :: change(2)            !! change of the displacement in x and y
      type(track_t) :: first, track
      real(wp) :: force, basis(max_stages), rise(1, max_stages), system(max_stages, max_stages)
      logical :: singular
      associate (s => problem%model%mesh%stages(e), tab => problem%tableau(problem%model%mesh%stages(e)), &
         & motion => y * problem%model%step(problem%step)%load%motion(:, problem%candidates%obstacle(problem%conforms(e))))
         call conforming_track(problem, state, e, tau, kept, track, force)
         first = node_track(problem, state, problem%conforms(e))
         ! The changes at the stages, divided by the matrix of the collocation method, are coefficients of the stage polynomials.
         system = transpose(tab%a)
         rise(1, :s) = dz(2 + s:1 + 2 * s)
         call solve_small(s, system, rise, singular)
         call stage_basis(tab, tau, basis)
         change = motion + (dot_product(first%tangent, du(1:2) - motion) + dot_product(basis(:s), rise(1, :s))) * track%tangent
      end associate
   end subroutine conforming_change
end module foundation_force_functional
