!> Transfers points of the path to other meshes with the same contact set, and finds the equilibrium of each point on its new mesh.
!> The first guess of the equilibrium is the state itself, carried over to the new mesh (carry_over).
module mesh_transfer
   use kinds, only: wp
   use model, only: method_load, method_displacement
   use problem, only: problem_t, copy_problem
   use rod_state, only: is_stress_free, state_t
   use linear_system, only: new_system
   use span_problem, only: new_span_problem
   use span_candidates, only: present_contact_spans
   use mesh_density, only: mesh_density_t
   use ground_cuts, only: find_cuts
   use path_control, only: control_t, is_arc_length, metric
   use osculating_contacts, only: turn_at_least_curvature
   use path_continuity, only: path_tangent_at, normal_plane, angle_between, largest_turn
   use path_point, only: path_point_t, move_to, renew, evaluate_tests
   use path_state, only: path_state_t, difference_load, copy_path_state, forget_mesh
   use corrector, only: increment_t, correct
   use mesh_request, only: stays_within
   use timing, only: count_up, counter_remeshed
   use touchdown_points, only: touchdown_steps, carry_forces
   use tangent_step, only: states_along
   use sized_equilibrium, only: solve_sized
   use ground_segments, only: assign_segments
   use state_transfer, only: carried, carried_field
   implicit none
   private
   public :: transfer_and_solve, rebalance, refine_point, carry_over

contains

   !> Transfers the run's last point to another mesh with the same contact set. If no equilibrium is found there, nothing changes.
   subroutine transfer_and_solve(next, problem, run, done)
      type(problem_t), intent(in) :: next
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      logical, intent(out) :: done !! true: an equilibrium was found
      type(problem_t) :: kept
      type(path_state_t) :: before
      call copy_problem(problem, kept)
      call copy_path_state(run, before)
      call move_to_mesh(next, problem, run)
      call rebalance(problem, run, done)
      if (done) return
      call copy_problem(kept, problem)
      call copy_path_state(before, run)
   end subroutine transfer_and_solve

   !> Finds the equilibrium of the run's last point on the mesh to which it was transferred.
   subroutine rebalance(problem, run, done)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run !! in: its last point is transferred to the mesh; out: in equilibrium there, or
      !! unchanged if none was found
      logical, intent(out) :: done                          !! true: an equilibrium was found
      type(path_point_t) :: better
      type(control_t) :: constraint
      type(increment_t) :: report
      logical :: behind_flat
      done = run%last%system%ok
      if (.not. done) return
      behind_flat = .false.
      better = run%last
      if (.not. (run%fresh .or. is_stress_free(run%last%state))) then
         ! Under load or displacement control the constraint keeps the controlled quantity. Under other strategies the constraint is
         ! the plane normal to the path, which contains an equilibrium at limit points as well.
         constraint = normal_plane(problem, run%last%state, run%last%tangent)
         if (any(run%control%method == [method_load, method_displacement])) constraint = run%control
         constraint%increment = 0.0_wp
         call bring_to_balance()
         ! If the two equilibria differ by more than all displacements so far, they are different solutions, and the new one is
         ! rejected.
         if (done) done = stays_within(problem, run%last%state, better%state, run%motion)
         if (.not. done) return
      end if
      associate (before => run%last%tangent, pivots => run%last%test_values%negative_pivots, system => better%system)
         better%tangent = path_tangent_at(problem, system, before%u, before%load)
         ! The displacement rates of a coarse mesh may differ so much that they do not determine the direction of travel. The sign
         ! of the load rate then determines it, because this sign changes only together with the stability.
         if (system%negative_pivots == pivots .and. better%tangent%load * before%load < 0.0_wp) then
            if (angle_between(problem, before%u, better%tangent%u) > largest_turn) &
               & better%tangent = path_tangent_at(problem, system, 0.0_wp * before%u, before%load)
         end if
         ! If the direction of travel as well as the stability change with the mesh, the new mesh is rejected.
         if (.not. run%fresh .and. system%negative_pivots /= pivots) &
            & done = angle_between(problem, before%u, better%tangent%u) <= largest_turn
      end associate
      if (.not. done) return
      run%mesh%change_behind = behind_flat
      call evaluate_tests(problem, better)
      associate (old => run%last%test_values, new => better%test_values)
         ! The count of unstable directions that open force-free line contacts does not depend on the mesh, so it is kept.
         new%weak = old%weak
         new%opening = old%opening
         ! If an event lies between the positions of the point on the two meshes, it must be reported exactly once: the beginning or
         ! end of contact with a foundation, a bifurcation, or a limit point. Just after a contact change there is no path behind
         ! the point on which the load rate could have changed its sign.
         new%grounded = old%grounded
         if (.not. run%fresh) new%negative_pivots = old%negative_pivots
         if (.not. run%fresh .and. run%arc_length > run%since_change%at .and. new%load_rate * old%load_rate < 0.0_wp) &
            & new%load_rate = old%load_rate
      end associate
      run%last = better

   contains

      !> Finds the equilibrium, first with the fastest touchdown point fixed if one moves fast. Near a limit point the end of a line
      !> contact may move far while the rest of the structure hardly moves. A mesh with a lower limit load then has no equilibrium
      !> in the plane normal to the path.
      subroutine bring_to_balance()
         integer :: fastest
         real(wp) :: rate
         fastest = 0
         if (is_arc_length(run%control%method)) call find_fastest(problem, run%last, fastest, rate)
         done = .false.
         ! A touchdown point counts as fast if it moves by the structure's size while the structure moves by its whole displacement.
         if (fastest > 0) then
            if (rate * abs(constraint%tangent_load) * sqrt(metric(problem, run%last%state%u, run%last%state%u)) > problem%size) &
               & call stay_in_place(problem, run, fastest, better, done)
         end if
         if (done) return
         better%state = run%last%state
         better%system = run%last%system
         call correct(problem, run%last%state, constraint, .true., better%state, better%system, report, linearised=.true.)
         done = better%system%ok .and. report%converged
         if (done) return
         better%state = run%last%state
         call turn_at_least_curvature(problem, run%last%state, constraint, better%state, done)
         behind_flat = done
         if (done) call move_to(problem, better%state, better)
      end subroutine bring_to_balance
   end subroutine rebalance

   !> Transfers a point to a finer mesh. The point has another contact set than the run's last point.
   subroutine refine_point(problem, run, point, density, done)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(in) :: run          !! its last point is on the mesh of `problem`
      type(path_point_t), intent(inout) :: point     !! point with its path tangent and test values
      type(mesh_density_t), intent(in) :: density(:) !! (rod segments) requested mesh density
      logical, intent(out) :: done                   !! false: no equilibrium was found, and nothing has changed
      type(problem_t) :: asked
      type(path_state_t) :: there
      call copy_problem(problem, asked)
      asked%demand = density
      call copy_path_state(run, there)
      there%last = point
      call transfer_and_solve(new_span_problem(asked, present_contact_spans(problem, point%state), point%state, find_cuts(problem, &
         & point%state)), problem, there, done)
      if (.not. done) return
      point = there%last
      call count_up(counter_remeshed)
   end subroutine refine_point

   !> Transfers the run to the mesh of another problem.
   subroutine move_to_mesh(next, problem, run)
      type(problem_t), intent(in) :: next
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      call carry_over(problem, next, run%last%state, run%last%tangent%u)
      call forget_mesh(run)
      call copy_problem(next, problem)
      run%last%system = new_system(problem)
      call renew(problem, run%last)
   end subroutine move_to_mesh

   !> Finds the touchdown point whose position changes fastest with the load.
   subroutine find_fastest(problem, point, fastest, rate)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      integer, intent(out) :: fastest            !! candidate of the touchdown point; 0: none moves
      real(wp), intent(out) :: rate !! derivative of the position of this point along the rod with respect to the load factor
      real(wp) :: rates(problem%candidates%n), step
      type(state_t) :: ahead, here
      fastest = 0
      rate = 0.0_wp
      associate (moves => problem%candidates%moves(:size(rates)))
         if (.not. any(moves)) return
         call states_along(problem, point%system, point%state, 1.0_wp, here, ahead, step)
         rates = abs(touchdown_steps(problem, point%state, ahead) - touchdown_steps(problem, point%state, here)) / step
         fastest = maxloc(rates, 1, moves)
      end associate
      rate = rates(fastest)
   end subroutine find_fastest

   !> Finds the equilibrium with one touchdown point fixed at its present position.
   subroutine stay_in_place(problem, run, fastest, point, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      integer, intent(in) :: fastest             !! candidate of the touchdown point that is fixed
      type(path_point_t), intent(inout) :: point !! in: first guess; out: equilibrium, if found
      logical, intent(out) :: found
      type(state_t) :: state
      type(control_t) :: load
      state = point%state
      load%whole = state%load_factor
      call solve_sized(problem, [fastest, 0], point%system, load, difference_load(run), state, found)
      if (found) call move_to(problem, state, point)
      found = found .and. point%system%ok
   end subroutine stay_in_place

   !> Transfers a state and a displacement direction to another mesh. Forces of contacts that exist on both meshes are transferred,
   !> too.
   subroutine carry_over(problem, next, state, direction)
      type(problem_t), intent(in) :: problem, next  !! problems of the same deck
      type(state_t), intent(inout) :: state         !! in: state of `problem`, in equilibrium; out: state of `next`
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacement direction; out: at the nodes of `next`
      type(state_t) :: there
      there = carried(problem, state, next)
      call assign_segments(next, there, carried=.true.)
      call carry_forces(problem, state, next, there)
      direction = carried_field(problem, state, direction, next, there)
      state = there
   end subroutine carry_over
end module mesh_transfer
