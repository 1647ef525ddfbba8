!> Bordered system: the linearised equilibrium equations with a constraint row and a load column. It is factored once and solved for
!> any right-hand side.
!>
!>   K x - load y = rhs      row.x + corner y = path
!>
!> K is the tangent: the band matrix minus the excess stiffness of coupled ground (active_coupling). x and y are the increments of
!> the unknowns and of the load factor. `load` is the derivative of the loads by the load factor, and rhs the forces to be balanced.
!> The second equation is the linearised path constraint, with `path` as its right-hand side. The constraint row makes the system
!> regular at limit points, where K is singular.
module bordered_system
   use kinds, only: wp
   use state_functional, only: functional_t
   use element_families, only: collocates
   use problem, only: problem_t, carried_by
   use rod_state, only: state_t
   use linear_system, only: system_t, assemble, to_node, to_global, row_times
   use node_axes, only: relative_increments
   use tied_nodes, only: spread_force
   use axial_rigidity, only: rigidity_t, rigidity_rounds, stretched, shrinking_forces
   use band_matrix, only: band_times, factorise, solve_factored
   use rolling_rods, only: set_rolling, without_rolling
   use active_coupling, only: factor_excess, add_excess_response
   use timing, only: timing_start, timing_stop, count_up, phase_factorisation, phase_solution, &
      & counter_factorisation, counter_solution
   implicit none
   private
   public :: linearise, factor_system, set_path_row, linear_functional, unknowns_of, solve_bordered, solve_effective, &
      & solve_all_effective, &
      & with_stretch, held_force_change, apply_increment, resultant_rates, all_to_global

contains

   !> Assembles and factors the system; system%ok becomes false if an element or the matrix is singular. `base` is the last
   !> converged state, to which UL2 elements refer.
   subroutine linearise(problem, state, base, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state, base
      type(system_t), intent(inout) :: system
      call assemble(problem, state, base, system)
      if (system%ok) call factor_system(system)
   end subroutine linearise

   !> Factors the tangent, counts its negative pivots, and solves for the path tangent.
   subroutine factor_system(system)
      type(system_t), intent(inout) :: system
      real(wp) :: shrink(system%n)
      call timing_start(phase_factorisation)
      call factorise(system%k, system%fixed, system%factor)
      call factor_excess(system%coupling, system%factor, system%fixed)
      call count_up(counter_factorisation)
      call timing_stop(phase_factorisation)
      system%ok = .true.
      call set_rolling(system)
      call solve_constrained(system, system%load, system%rate, system%tangent)
      system%tangent_stretch = 0.0_wp
      system%tangent_load = system%load
      if (system%rigidity%n > 0) then
         call take_back_stretches(system, 1.0_wp, system%tangent_stretch, system%tangent)
         call shrinking_forces(system%rigidity, system%tangent_stretch, shrink)
         system%tangent_load = system%load + shrink
      end if
      system%negative_pivots = system%factor%negative_pivots + system%coupling%negative_pivots - system%hinges
   end subroutine factor_system

   !> Copy of a system whose solutions keep the artificial extension of inextensible elements (about 1e-8 of bending). These
   !> solutions are a linear function of the unknowns alone. If the artificial extension is removed, the force in an inextensible
   !> element is an independent variable.
   function with_stretch(system) result(stretching)
      type(system_t), intent(in) :: system     !! factored
      type(system_t) :: stretching             !! factored
      stretching = system
      stretching%rigidity = rigidity_t()
      stretching%tangent_stretch = reshape([real(wp) ::], [2, 0])
      stretching%tangent_load = system%load
      call solve_constrained(stretching, stretching%load, stretching%rate, stretching%tangent)
   end function with_stretch

   !> Change of the force that a support, a rigid contact or a tie exerts on an unknown, for increments x of the unknowns and y of
   !> the load factor (see solve_bordered).
   pure real(wp) function held_force_change(system, d, x, y) result(change)
      type(system_t), intent(in) :: system     !! factored
      integer, intent(in) :: d                 !! index of the unknown
      real(wp), intent(in) :: x(system%n)      !! increments of the unknowns, node axes
      real(wp), intent(in) :: y
      change = row_times(system, d, x) - system%tangent_load(d) * y
   end function held_force_change

   !> Response to forces at constant load factor, with all eliminated unknowns fixed.
   subroutine solve_effective(system, rhs, x, stretch)
      type(system_t), intent(in) :: system     !! factored
      real(wp), intent(in) :: rhs(:)           !! (n) forces, node axes; entries of fixed unknowns are ignored
      real(wp), intent(out) :: x(:)            !! (n) response, node axes
      real(wp), intent(out), optional :: stretch(:, :) !! (2, inextensible elements) artificial extension that was corrected
      real(wp) :: held(system%n), given(2, system%rigidity%n)
      held = 0.0_wp
      call solve_constrained(system, rhs, held, x)
      given = 0.0_wp
      if (system%rigidity%n > 0) call take_back_stretches(system, 0.0_wp, given, x)
      if (present(stretch)) stretch = given
   end subroutine solve_effective

   !> Responses to many force vectors at constant load factor, with all eliminated unknowns fixed.
   subroutine solve_all_effective(system, x)
      type(system_t), intent(in) :: system     !! factored
      real(wp), intent(inout) :: x(:, :)       !! (n, force vectors) in: forces, 0 at fixed unknowns; out: responses
      real(wp) :: given(2, system%rigidity%n)
      integer :: k
      call timing_start(phase_solution)
      call solve_factored(system%factor, x)
      do k = 1, size(x, 2)
         x(:, k) = without_rolling(system, x(:, k))
         if (system%coupling%n > 0) call add_excess_response(system%coupling, x(:, k))
         call count_up(counter_solution)
      end do
      call timing_stop(phase_solution)
      if (system%rigidity%n == 0) return
      do k = 1, size(x, 2)
         given = 0.0_wp
         call take_back_stretches(system, 0.0_wp, given, x(:, k))
      end do
   end subroutine solve_all_effective

   !> Removes the artificial extension of inextensible rods from a solution (see axial_rigidity).
   subroutine take_back_stretches(system, load, stretch, x)
      type(system_t), intent(in) :: system     !! factored, with inextensible rods
      real(wp), intent(in) :: load             !! load factor of the solution
      real(wp), intent(inout) :: stretch(:, :) !! (2, inextensible elements) in: 0; out: artificial extension that was corrected
      real(wp), intent(inout) :: x(:)          !! (n) in: solution with the factored tangent; out: corrected solution
      real(wp) :: first(system%n), force(system%n), held(system%n), last(2, system%rigidity%n)
      integer :: round
      first = x
      held = 0.0_wp
      do round = 1, rigidity_rounds
         last = stretch
         call stretched(system%rigidity, x, load, stretch)
         ! The correction before has left nothing but rounding.
         if (maxval(abs(stretch - last)) <= epsilon(stretch) * maxval(abs(stretch))) exit
         call shrinking_forces(system%rigidity, stretch, force)
         call solve_constrained(system, force, held, x)
         x = first + x
      end do
      ! If only the artificial extension exceeds rounding, the solution is zero.
      if (is_rounding(3) .and. is_rounding(1) .and. is_rounding(2)) x = 0.0_wp

   contains

      !> True if the correction has reduced one component of the displacements of all nodes to the rounding error of the
      !> subtraction.
      pure logical function is_rounding(component)
         integer, intent(in) :: component
         is_rounding = maxval(abs(x(component::3))) <= sqrt(epsilon(x)) * maxval(abs(first(component::3)))
      end function is_rounding
   end subroutine take_back_stretches

   !> Solves K x = rhs; the fixed unknowns have their prescribed values.
   subroutine solve_constrained(system, rhs, prescribed, x)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs(:)         !! (n) forces on the free unknowns
      real(wp), intent(in) :: prescribed(:)  !! (n) values of the fixed unknowns
      real(wp), intent(inout) :: x(:)        !! (n) solution
      real(wp) :: b(system%n, 1), known(system%n)
      call timing_start(phase_solution)
      b(:, 1) = rhs
      known = merge(prescribed, 0.0_wp, system%fixed)
      if (any(abs(known) > 0.0_wp)) then
         call band_times(system%k, known, x)
         b(:, 1) = b(:, 1) - x
      end if
      where (system%fixed) b(:, 1) = known
      call solve_factored(system%factor, b)
      x = without_rolling(system, b(:, 1))
      if (system%coupling%n > 0) call add_excess_response(system%coupling, x)
      call count_up(counter_solution)
      call timing_stop(phase_solution)
   end subroutine solve_constrained

   !> Sets the constraint row so that solve_bordered prescribes the change of a functional.
   pure subroutine set_path_row(system, held)
      type(system_t), intent(inout) :: system
      type(functional_t), intent(in) :: held
      system%path_row = held%by_unknown
      system%path_corner = held%by_load
   end subroutine set_path_row

   !> The functional row.u + by_load * load factor, with the displacements u of the nodes.
   function linear_functional(problem, system, row, by_load) result(linear)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: row(:, :)      !! (3, nodes) coefficients of the displacements, global axes
      real(wp), intent(in) :: by_load        !! derivative of the functional by the load factor
      type(functional_t) :: linear
      linear%by_unknown = unknowns_of(problem, system, row)
      linear%by_load = by_load
   end function linear_functional

   !> Transforms forces on nodes, or coefficients of nodal displacements, to the axes of the unknowns.
   function unknowns_of(problem, system, by_node) result(by_unknown)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: by_node(:, :)  !! (3, nodes) forces or coefficients, global axes
      real(wp) :: by_unknown(system%n)       !! (n) forces or coefficients, node axes
      real(wp) :: part(3)
      integer :: node
      by_unknown = 0.0_wp
      do node = 1, size(by_node, 2)
         part = by_node(:, node)
         call to_node(system, node, part)
         call spread_force(problem, system%tie_block, node, part, by_unknown)
      end do
   end function unknowns_of

   !> Solves the bordered system. `ok` is false if the system is singular: at a bifurcation, or where the tangent is singular
   !> and the row of the constraint is zero, as at a limit point under load control.
   subroutine solve_bordered(system, rhs, prescribed, path_rhs, x, y, ok)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs(:), prescribed(:) !! (n) forces to be balanced; (n) values of the fixed unknowns
      real(wp), intent(in) :: path_rhs              !! right-hand side `path` of the constraint, see the header of this module
      real(wp), intent(inout) :: x(:)               !! (n) increments of the unknowns, node axes
      real(wp), intent(out) :: y                    !! increment of the load factor
      logical, intent(out) :: ok                    !! false: the bordered system is singular
      real(wp) :: pivot
      y = 0.0_wp
      call solve_constrained(system, rhs, prescribed, x)
      if (system%roll_at > 0) x = x + system%roll_by * system%rolled
      pivot = dot_product(system%path_row, system%tangent) + system%path_corner
      ! A constraint row that is zero, as under load control, cannot make a singular tangent regular.
      ok = abs(pivot) > 0.0_wp .and. .not. (system%factor%deficient .and. all(abs(system%path_row) <= 0.0_wp))
      if (.not. ok) return
      y = (path_rhs - dot_product(system%path_row, x)) / pivot
      x = x + y * system%tangent
   end subroutine solve_bordered

   !> Linear change of the stored section forces for increments of the unknowns and of the load factor. The part of a
   !> Newton step that removes the residuals of the equations inside the elements is not included.
   function resultant_rates(problem, system, x, y) result(rate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:), y        !! increments of the unknowns (n) and of the load factor, see solve_bordered
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements)
      rate = rates_of(problem, system, x, all_to_global(problem, system, x), y)
   end function resultant_rates

   !> Linear change of the stored section forces, as resultant_rates, for callers that have the increments of the nodes in global
   !> axes already.
   function rates_of(problem, system, x, du, y) result(rate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)
      real(wp), intent(in) :: du(:, :), y    !! increments of the nodes (3, nodes), global axes; increment of the load factor
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements), own(6)
      integer :: e, k, z
      rate = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         if (.not. collocates(problem%model%mesh%family(e))) cycle
         z = problem%z_size(e)
         if (carried_by(problem, e) > 0) then
            own = relative_increments(problem, system, x, e)
         else
            own = [du(:, problem%model%mesh%node(1, e)), du(:, problem%model%mesh%node(2, e))]
         end if
         do k = 1, 6
            rate(:z, e) = rate(:z, e) + system%op(:z, k, e) * own(k)
         end do
         rate(:z, e) = rate(:z, e) + system%op(:z, 8, e) * y
      end do
      do k = 1, system%rigidity%n
         e = system%rigidity%element(k)
         z = problem%z_size(e)
         rate(:z, e) = rate(:z, e) + matmul(system%op(:z, 4:5, e), y * system%tangent_stretch(:, k))
      end do
   end function rates_of

   !> Increments of the displacements and rotations of all nodes in global axes.
   function all_to_global(problem, system, x) result(du)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)           !! (n) unknowns, node axes
      real(wp) :: du(3, problem%model%mesh%n_nodes)
      integer :: node
      do node = 1, size(du, 2)
         du(:, node) = to_global(problem, system, x, node)
      end do
   end function all_to_global

   !> Adds a solved increment to a state: to its displacements, stored section forces and load factor.
   subroutine apply_increment(problem, system, x, y, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:), y
      type(state_t), intent(inout) :: state
      real(wp) :: du(3, problem%model%mesh%n_nodes), rate(size(state%z, 1), size(state%z, 2))
      integer :: e, z
      du = all_to_global(problem, system, x)
      rate = rates_of(problem, system, x, du, y)
      do e = 1, problem%model%mesh%n_elements
         if (.not. collocates(problem%model%mesh%family(e))) cycle
         z = problem%z_size(e)
         state%z(:z, e) = state%z(:z, e) + rate(:z, e) + system%op(:z, 7, e)
      end do
      state%u = state%u + du
      state%load_factor = state%load_factor + y
   end subroutine apply_increment
end module bordered_system
