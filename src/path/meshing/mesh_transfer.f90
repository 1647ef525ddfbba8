!> Transfers points of the path to other meshes with the same contact set, and finds their equilibrium there.
module mesh_transfer
   use kinds, only: wp
   use model, only: method_load, method_displacement
   use problem, only: problem_t, copy_problem
   use rod_state, only: is_stress_free, state_t
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use span_problem, only: new_span_problem
   use span_candidates, only: present_contact_spans
   use mesh_change, only: carry_over
   use mesh_density, only: mesh_density_t
   use ground_cuts, only: find_cuts
   use path_control, only: control_t, is_arc_length, metric
   use osculating_contacts, only: turn_at_least_curvature
   use path_continuity, only: path_tangent_at, normal_plane, angle_between, largest_turn
   use path_point, only: path_point_t, move_to, evaluate_tests
   use path_state, only: path_state_t, small_load, copy_path_state, forget_mesh
   use corrector, only: increment_t, correct
   use mesh_request, only: stays_within
   use timing, only: count_up, counter_remeshed
   use touchdown_points, only: touchdown_steps
   use tangent_step, only: states_along
   use sized_equilibrium, only: solve_sized
   implicit none
   private
   public :: stand_on, rebalance, refine_point, move_to_mesh

contains

   !> Transfers the run's last point to another mesh with the same contact set; nothing changes if no equilibrium is found there.
   subroutine stand_on(next, problem, run, done)
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
   end subroutine stand_on

   !> Finds the equilibrium of the run's last point on the mesh to which it was transferred.
   subroutine rebalance(problem, run, done)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run              !! unchanged without success
      logical, intent(out) :: done                          !! true: an equilibrium was found
      type(path_point_t) :: better
      type(control_t) :: hold
      type(increment_t) :: report
      logical :: behind_flat
      done = run%last%system%ok
      if (.not. done) return
      behind_flat = .false.
      better = run%last
      if (.not. (run%fresh .or. is_stress_free(run%last%state))) then
         ! The constraint keeps the quantity prescribed by load or displacement control; with other strategies it is the plane
         ! normal to the path, which has an equilibrium at limit points as well.
         hold = normal_plane(problem, run%last%state, run%last%tangent)
         if (any(run%control%method == [method_load, method_displacement])) hold = run%control
         hold%increment = 0.0_wp
         call bring_to_balance()
         ! If the difference between the meshes exceeds all displacements so far, the result is another equilibrium.
         if (done) done = stays_within(problem, run%last%state, better%state, run%motion)
         if (.not. done) return
      end if
      associate (before => run%last%tangent, pivots => run%last%test_values%negative_pivots, system => better%system)
         better%tangent = path_tangent_at(problem, system, before%u, before%load)
         ! On a coarse mesh the displacements may differ so much that they do not give the direction of travel. It then follows from
         ! the load rate, which changes its sign together with the stability.
         if (system%negative_pivots == pivots .and. better%tangent%load * before%load < 0.0_wp) then
            if (angle_between(problem, before%u, better%tangent%u) > largest_turn) &
               & better%tangent = path_tangent_at(problem, system, 0.0_wp * before%u, before%load)
         end if
         ! A mesh change that changes both direction of travel and stability is rejected.
         if (.not. run%fresh .and. system%negative_pivots /= pivots) &
            & done = angle_between(problem, before%u, better%tangent%u) <= largest_turn
      end associate
      if (.not. done) return
      run%mesh%change_behind = behind_flat
      call evaluate_tests(problem, better)
      associate (old => run%last%test_values, new => better%test_values)
         ! The number of directions that open force-free line contacts is the same on all meshes.
         new%weak = old%weak
         new%opening = old%opening
         ! An event between the positions of the point on both meshes must be reported once: contact with a foundation that begins
         ! or ends, a bifurcation, a limit point. Just after a contact change there is no path behind on which the load rate could
         ! have changed its sign.
         new%grounded = old%grounded
         if (.not. run%fresh) new%negative_pivots = old%negative_pivots
         if (.not. run%fresh .and. run%arc_length > run%since_change%at .and. new%load_rate * old%load_rate < 0.0_wp) &
            & new%load_rate = old%load_rate
      end associate
      run%last = better

   contains

      !> Fixes the touchdown point that moves fastest, if any. Near a limit point the end of a line contact may move far while the
      !> rest hardly moves; a mesh with a lower limit load then has no equilibrium in the plane normal to the path.
      subroutine bring_to_balance()
         integer :: fastest
         real(wp) :: rate
         fastest = 0
         if (is_arc_length(run%control%method)) call find_fastest(problem, run%last, fastest, rate)
         done = .false.
         ! A touchdown point that moves by the structure's size while the structure moves by its whole displacement is fixed.
         if (fastest > 0) then
            if (rate * abs(hold%tangent_load) * sqrt(metric(problem, run%last%state%u, run%last%state%u)) > problem%size) &
               & call stay_in_place(problem, run, fastest, better, done)
         end if
         if (done) return
         better%state = run%last%state
         call correct(problem, run%last%state, hold, .true., better%state, better%system, report)
         done = better%system%ok .and. report%converged
         if (done) return
         better%state = run%last%state
         call turn_at_least_curvature(problem, run%last%state, hold, better%state, done)
         behind_flat = done
         if (done) call move_to(problem, better%state, better)
      end subroutine bring_to_balance
   end subroutine rebalance

   !> Transfers an equilibrium that is not the run's last point, but that of another contact set, to a finer mesh.
   subroutine refine_point(problem, run, point, density, done)
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(in) :: run          !! on the mesh of `problem`
      type(path_point_t), intent(inout) :: point     !! with its path tangent and test values
      type(mesh_density_t), intent(in) :: density(:) !! (rod segments) requested
      logical, intent(out) :: done                   !! false: no equilibrium was found, nothing has changed
      type(problem_t) :: asked
      type(path_state_t) :: there
      call copy_problem(problem, asked)
      asked%demand = density
      call copy_path_state(run, there)
      there%last = point
      call stand_on(new_span_problem(asked, present_contact_spans(problem, point%state), point%state, find_cuts(problem, &
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
      call linearise(problem, run%last%state, run%last%state, run%last%system)
   end subroutine move_to_mesh

   !> Finds the touchdown point whose position changes fastest with the load.
   subroutine find_fastest(problem, point, fastest, rate)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      integer, intent(out) :: fastest            !! candidate, 0: none moves
      real(wp), intent(out) :: rate              !! along the rod, per unit of load factor
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
      integer, intent(in) :: fastest             !! candidate
      type(path_point_t), intent(inout) :: point !! a guess on entry
      logical, intent(out) :: found
      type(state_t) :: state
      type(control_t) :: load
      state = point%state
      load%whole = state%load_factor
      call solve_sized(problem, [fastest, 0], point%system, load, small_load(run), state, found)
      if (found) call move_to(problem, state, point)
      found = found .and. point%system%ok
   end subroutine stay_in_place
end module mesh_transfer
