!> Equilibrium equations at a state, assembled with the present contact set.
!>
!> This module re-exports procedures of its parts: system_type has the data, node_axes the axes of the unknowns, eliminated_unknowns
!> the constraints, contact_terms and joint_stiffness the terms of contacts and joints. The module itself computes the residual of
!> the equations and the part of the residual that may be rounding. It also computes the matrices with which axial_rigidity corrects
!> solutions for inextensible elements (set_rigidity).
module linear_system
   use kinds, only: wp
   use problem, only: problem_t, carried_by, moments_as_forces
   use obstacle_pose, only: pose_t
   use rod_state, only: state_t, node_position, pose_of, candidate_gap, closing_rate, may_react, element_load
   use track_nodes, only: rolled_t, rolled, touchdown_spring
   use node_loads, only: node_push_t, dead_node_load, node_pushes
   use rod_equations, only: evaluate_rod, cancelling_force, displaced_force
   use band_matrix, only: row_product, add_row
   use active_coupling, only: excess_row, subtract_excess
   use tied_nodes, only: set_blocks, spread_force, add_matrix
   use system_type, only: system_t, new_system
   use node_axes, only: to_node, turn_force, turn_pair, matrix_to_node, to_global, spread_element, own_axes
   use carried_obstacles, only: set_carried, add_carried_loads
   use eliminated_unknowns, only: set_constraints, contact_reaction, reaction_weights
   use contact_terms, only: set_foundation, set_coupling, add_contact, add_marks, contact_pull
   use joint_stiffness, only: add_joint_springs, add_links
   use node_matrices, only: add_node_matrices
   use rolling_rods, only: constrain_rolling
   use timing, only: timing_start, timing_stop, count_up, phase_elements, phase_assembly, counter_evaluated
   use ge_in_state, only: ge_at
   use ge_stages, only: ge_directions
   use gauss_tableau, only: max_stages
   use rod_load, only: ge_load_t, largest_line
   implicit none
   private
   public :: system_t, new_system, assemble, sum_elements, contact_pull, matrix_to_node, turn_pair, to_node, to_global, &
      & row_times, rows_times, contact_reaction, reaction_weights, worst_round_off

   real(wp), parameter :: worst_round_off = 1.0e-6_wp !! a residual above this bound is not accepted as rounding

contains

   !> Assembles the equations at `state`. `base` is the last converged state, to which UL2 elements refer.
   subroutine assemble(problem, state, base, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state, base
      type(system_t), intent(inout) :: system
      integer :: e, c
      logical :: ok
      real(wp) :: defect(3), worst(3), shift(6, 2)
      type(rolled_t) :: roll
      type(pose_t) :: pose

      call timing_start(phase_elements)
      system%ok = .true.
      system%hinges = size(problem%hinge)
      worst = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         call evaluate_rod(problem, state, base, e, system%ef(:, e), system%eraw(:, e), system%ek(:, :, e), &
            & system%el(:, e), system%op(:, :, e), defect, ok, system%inner(e), shift)
         if (size(system%eshift, 3) > 0) system%eshift(:, :, e) = shift
         system%ok = system%ok .and. ok
         if (ok) worst = max(worst, defect)
      end do
      call timing_stop(phase_elements)
      call count_up(counter_evaluated, problem%model%mesh%n_elements)
      if (.not. system%ok) return

      call timing_start(phase_assembly)
      do c = 1, problem%candidates%n
         call candidate_gap(problem, state, c, system%gap(c), system%normal(:, c), system%bend(c))
         if (problem%model%obstacle(problem%candidates%obstacle(c))%carrier > 0) then
            pose = pose_of(problem, state, problem%candidates%obstacle(c))
            system%arm(:, c) = pose%arm(node_position(state, problem%candidates%node(c)))
         end if
         if (problem%candidates%rolls(c)) then
            roll = rolled(problem, state, c)
            system%gap(c) = system%gap(c) - roll%rise
            ! The rotational stiffness of a point contact is negative if the rod bends more around the obstacle than the obstacle's
            ! surface does. This stiffness changes its sign through infinity, not through zero: its negative pivot shows no
            ! instability.
            if (state%reaction(c) > 0.0_wp .and. touchdown_spring(problem, state, c) < 0.0_wp .and. &
               & .not. problem%candidates%follows(c)) system%hinges = system%hinges + 1
         end if
         if (system%soft(c)) call set_foundation(problem, state, c, system)
         system%closing(c) = closing_rate(problem, problem%candidates, c)
         system%motion(:, c) = problem%model%step(problem%step)%load%motion(:, problem%candidates%obstacle(c))
         if (.not. state%active(c)) system%slope(c) = merge(1.0_wp, 0.0_wp, may_react(problem, c, system%normal(:, c)))
      end do
      call set_coupling(problem, state, system)
      call set_constraints(problem, state, system)
      call set_carried(problem, state, system)
      call set_blocks(problem, state%u, system%turned, system%axis, system%roll, system%lean, system%tie_block)
      call sum_elements(problem, system)
      call system%at_nodes%clear()
      call add_carried_loads(problem, state, system)
      call set_rigidity(problem, state, system)
      call add_node_loads()
      call add_node_pushes()
      call add_springs()
      call add_joint_springs(problem, state, system)
      call add_contact(problem, state, system)
      call add_links(problem, state, system)
      call add_node_matrices(problem, system%tie_block, system%slip_block, system%at_nodes, system%k)
      call constrain_rolling(problem, state, system)
      call measure_residual(problem, state, system)
      system%defect_residual = max(worst(1), worst(2) / system%force_scale, worst(3) / problem%size)
      call add_marks(problem, state, system)
      call timing_stop(phase_assembly)

   contains

      !> Adds nodal loads that do not depend on the state.
      subroutine add_node_loads()
         integer :: node
         real(wp) :: load(3), rate(3)
         do node = 1, problem%model%mesh%n_nodes
            call dead_node_load(problem, state, node, load, rate)
            if (.not. any(abs(load) > 0.0_wp .or. abs(rate) > 0.0_wp)) cycle
            call to_node(system, node, load)
            call to_node(system, node, rate)
            call spread_force(problem, system%tie_block, node, -load, system%residual)
            call spread_force(problem, system%tie_block, node, rate, system%load)
         end do
      end subroutine add_node_loads

      !> Adds nodal loads that depend on the state: their forces and their stiffness.
      subroutine add_node_pushes()
         type(node_push_t), allocatable :: push(:)
         integer :: n
         push = node_pushes(problem, state)
         do n = 1, size(push)
            system%ok = system%ok .and. push(n)%sound
            call to_node(system, push(n)%node, push(n)%force)
            call to_node(system, push(n)%node, push(n)%rate)
            call matrix_to_node(system, push(n)%node, push(n)%stiffness)
            call spread_force(problem, system%tie_block, push(n)%node, -push(n)%force, system%residual)
            call spread_force(problem, system%tie_block, push(n)%node, push(n)%rate, system%load)
            call system%at_nodes%append([push(n)%node], push(n)%stiffness)
         end do
      end subroutine add_node_pushes

      !> Adds springs between nodes and fixed points. The springs are stress-free at the start.
      subroutine add_springs()
         integer :: node, i
         real(wp) :: force(3), k(3, 3)
         do node = 1, problem%model%mesh%n_nodes
            if (.not. any(problem%model%spring(:, node) > 0.0_wp)) cycle
            force = problem%model%spring(:, node) * state%u(:, node)
            call to_node(system, node, force)
            call spread_force(problem, system%tie_block, node, force, system%residual)
            k = 0.0_wp
            do i = 1, 3
               k(i, i) = problem%model%spring(i, node)
            end do
            call matrix_to_node(system, node, k)
            call system%at_nodes%append([node], k)
         end do
      end subroutine add_springs
   end subroutine assemble

   !> Adds all elements to the band matrix and the residual.
   subroutine sum_elements(problem, system)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(inout) :: system
      integer :: e, i, j, a, b, p(2), node(2)
      system%k%a = 0.0_wp
      system%k%beside = 0.0_wp
      system%residual = 0.0_wp
      system%load = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         node = problem%model%mesh%node(:, e)
         do i = 1, 2
            p(i) = 3 * (problem%numbering%position(node(i)) - 1)
         end do
         if (size(system%eshift, 3) > 0) then
            do i = 1, 2
               if (.not. system%turned(node(i))) cycle
               do j = 1, 2
                  call turn_pair(system%axis(:, node(i)), system%eshift(3 * i - 2:3 * i - 1, j, e))
               end do
            end do
         end if
         do i = 1, 2
            if (system%turned(node(i))) call turn_element(system%axis(:, node(i)), system%roll(node(i)), system%lean(node(i)), &
               & 3 * i - 2, system%ek(:, :, e), system%ef(:, e), system%eraw(:, e), system%el(:, e))
         end do
         if (any(problem%ties%has_blocks(node))) then
            call spread_element(problem, system, e, system%ef(:, e), system%residual)
            call spread_element(problem, system, e, system%el(:, e), system%load)
            if (carried_by(problem, e) > 0) then
               call add_matrix(problem, system%slip_block, node, system%ek(:, :, e), system%k)
            else
               call add_matrix(problem, system%tie_block, node, system%ek(:, :, e), system%k)
            end if
            cycle
         end if
         do a = 1, 2
            do j = 1, 3
               system%residual(p(a) + j) = system%residual(p(a) + j) + system%ef(3 * a - 3 + j, e)
               system%load(p(a) + j) = system%load(p(a) + j) + system%el(3 * a - 3 + j, e)
               do i = j, 3
                  system%k%a(1 + i - j, p(a) + j) = system%k%a(1 + i - j, p(a) + j) + system%ek(3 * a - 3 + i, 3 * a - 3 + j, e)
               end do
            end do
         end do
         a = maxloc(p, 1)
         b = 3 - a
         do j = 1, 3
            do i = 1, 3
               system%k%a(1 + p(a) + i - p(b) - j, p(b) + j) = system%k%a(1 + p(a) + i - p(b) - j, p(b) + j) + &
                  & system%ek(3 * a - 3 + i, 3 * b - 3 + j, e)
            end do
         end do
      end do
   end subroutine sum_elements

   !> Transforms the part of an element's matrix and force vectors that begins at row `first` to the axes of its node.
   pure subroutine turn_element(axis, roll, lean, first, k, f, raw, fl)
      real(wp), intent(in) :: axis(2), roll, lean
      integer, intent(in) :: first
      real(wp), intent(inout) :: k(6, 6), f(6), raw(6), fl(6)
      real(wp) :: row(3)
      integer :: j
      call turn_force(axis, roll, lean, f(first:first + 2))
      call turn_force(axis, roll, lean, raw(first:first + 2))
      call turn_force(axis, roll, lean, fl(first:first + 2))
      do j = 1, 6
         call turn_force(axis, roll, lean, k(first:first + 2, j))
      end do
      do j = 1, 6
         row = k(j, first:first + 2)
         call turn_force(axis, roll, lean, row)
         k(j, first:first + 2) = row
      end do
   end subroutine turn_element

   !> Row i of the tangent times x.
   pure real(wp) function row_times(system, i, x)
      type(system_t), intent(in) :: system
      integer, intent(in) :: i
      real(wp), intent(in) :: x(system%n)
      row_times = row_product(system%k, i, x)
      if (system%coupling%n > 0) row_times = row_times - excess_row(system%coupling, i, x)
   end function row_times

   !> Adds to `row` the rows of the tangent, each of them times its weight.
   pure subroutine rows_times(system, weight, row)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: weight(:)        !! (n) weights of the rows; zero for most unknowns
      real(wp), intent(inout) :: row(:)        !! (n) sum of the weighted rows
      real(wp) :: form
      integer :: i
      do i = 1, system%n
         if (abs(weight(i)) > 0.0_wp) call add_row(system%k, i, weight(i), row)
      end do
      call subtract_excess(system%coupling, weight, row, form)
   end subroutine rows_times

   !> Computes the matrices of inextensible elements (rigidity_t) from the elements' tangents in node axes. In a free element the
   !> artificial extension is caused by the force at its first end, in a conforming element by the force along the track at its
   !> second end.
   subroutine set_rigidity(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: part(3, 3), axes(2, 2)
      integer :: i, j, e, n, b, k
      do i = 1, system%rigidity%n
         e = system%rigidity%element(i)
         n = system%rigidity%first(i)
         associate (rigidity => system%rigidity, ties => problem%ties, nodes => problem%model%mesh%node(:, e), &
            & on_track => problem%conforms(e) > 0)
            axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
            do k = 1, 2
               if (system%turned(nodes(2))) call turn_pair(system%axis(:, nodes(2)), axes(:, k))
            end do
            if (on_track) then
               rigidity%give(:, :, i) = 0.0_wp
               do k = 1, 2
                  rigidity%give(k, k, i) = state%geometry%element(e)%length * problem%compliance(e)%give
               end do
               rigidity%shifted(:, :, i) = matmul(transpose(axes), matmul(system%ek(4:5, 4:5, e), axes))
               rigidity%load(:, i) = -matmul(transpose(axes), system%el(4:5, e))
            else
               rigidity%give(:, :, i) = give_inside(problem, state, e)
               rigidity%shifted(:, :, i) = system%op(1:2, 4:5, e)
               rigidity%load(:, i) = system%op(1:2, 8, e)
            end if
            do j = 1, 2
               ! The index before that of the first tie stands for the node's own unknowns.
               do b = ties%first(nodes(j)) - merge(0, 1, ties%follows(nodes(j))), ties%first(nodes(j) + 1) - 1
                  part = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
                  if (b >= ties%first(nodes(j))) part = system%tie_block(:, :, b)
                  if (b >= ties%first(nodes(j)) .and. carried_by(problem, e) > 0) part = system%slip_block(:, :, b)
                  rigidity%push(:, n:n + 2) = matmul(transpose(matmul(system%ek(3 * j - 2:3 * j, 4:5, e), axes)), part)
                  if (on_track) then
                     rigidity%force(:, n:n + 2) = rigidity%push(:, n:n + 2) ! here `push` and `force` are forces at the second end
                  else
                     rigidity%force(:, n:n + 2) = matmul(system%op(1:2, 3 * j - 2:3 * j, e), &
                        & matmul(own_axes(system, nodes(j)), part))
                  end if
                  n = n + 3
               end do
            end do
         end associate
      end do
   end subroutine set_rigidity

   !> Artificial extension of an element outside contact for a unit force at its first end. The artificial compliance acts along the
   !> tangents of the rod at the element's Gauss points.
   pure function give_inside(problem, state, e) result(give)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: give(2, 2), t(2, max_stages)
      integer :: j, k, s
      s = problem%model%mesh%stages(e)
      give = 0.0_wp
      associate (g => state%geometry%element(e), tab => problem%tableau(s))
         t = ge_directions(tab, ge_at(problem, state, e))
         do j = 1, s
            t(:, j) = t(:, j) / norm2(t(:, j))
            do k = 1, 2
               give(:, k) = give(:, k) + (g%length * g%scale * tab%b(j) * problem%compliance(e)%give * t(k, j)) * t(:, j)
            end do
         end do
      end associate
   end function give_inside

   !> Measures the largest residual of the free unknowns, computed from the stored end forces. A force is divided by the largest
   !> force, a moment by the largest force times the structure's size. The part of the residual that may be rounding is estimated,
   !> too.
   subroutine measure_residual(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: worst, scale, noise, moved, carried, more(6)
      type(ge_load_t) :: load
      type(node_push_t), allocatable :: push(:)
      integer :: e, i
      system%raw = system%residual
      scale = problem%force_floor
      do e = 1, problem%model%mesh%n_elements
         more = system%eraw(:, e) - system%ef(:, e)
         call spread_element(problem, system, e, more, system%raw)
         scale = max(scale, maxval(abs(system%eraw(1:2, e))), maxval(abs(system%eraw(4:5, e))), &
            & abs(system%eraw(3, e)) / problem%size, abs(system%eraw(6, e)) / problem%size)
         scale = max(scale, cancelling_force(problem, state, e))
      end do
      scale = max(scale, maxval(abs(state%reaction), mask=state%active))
      scale = max(scale, maxval(problem%model%spring(1:2, :) * abs(state%u(1:2, :))), &
         & maxval(problem%model%spring(3, :) * abs(state%u(3, :))) / problem%size)
      do e = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(e))
            scale = max(scale, spring%stiffness * maxval(abs(state%u(spring%component, spring%node))) / &
               & merge(problem%size, 1.0_wp, spring%component == 3))
         end associate
      end do
      ! Loads of several steps may cancel; their sum has the rounding errors of all of them.
      associate (rate => problem%model%step(problem%step)%load)
         scale = max(scale, maxval(abs(problem%constant%node_force(1:2, :))), &
            & abs(state%load_factor) * maxval(abs(rate%node_force(1:2, :))))
      end associate
      push = node_pushes(problem, state)
      do i = 1, size(push)
         scale = max(scale, norm2(push(i)%force(1:2)))
      end do
      if (problem%has_spans()) then
         ! An obstacle may balance a load without any section force in the rods.
         carried = 0.0_wp
         do e = 1, problem%model%mesh%n_elements
            if (problem%conforms(e) == 0) cycle
            load = element_load(problem, state, e)
            carried = carried + (norm2(largest_line(load)) + abs(load%pressure)) * state%geometry%element(e)%length
         end do
         scale = max(scale, carried)
      end if
      if (any(problem%ground%founded)) then
         ! A foundation may balance a load without any section force in the rods.
         do e = 1, problem%model%mesh%n_elements
            load = element_load(problem, state, e)
            scale = max(scale, maxval(largest_line(load)) * state%geometry%element(e)%length)
         end do
      end if
      worst = maxval(abs(merge(0.0_wp, moments_as_forces(problem, system%raw), system%fixed)))
      system%force_scale = scale
      ! UL2 elements compute N from displacements, and foundations their reaction from a gap. The rounding error of such a force is
      ! the rounding error of the displacement or gap, times the stiffness.
      moved = max(maxval(abs(state%u(1:2, :))), maxval(abs(state%u(3, :))) * problem%size)
      system%gap_error = 2.0_wp * epsilon(noise) * merge(moved, problem%size, problem%resting)
      noise = maxval([problem%ground%stiffest, system%spring]) * merge(moved, problem%size, problem%resting)
      system%gap_noise = 2.0_wp * epsilon(noise) * noise / scale
      noise = max(noise, moved * maxval(problem%model%spring(1:2, :)), moved * maxval(problem%model%spring(3, :)) / problem%size**2)
      do e = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(e))
            noise = max(noise, moved * spring%stiffness / merge(problem%size**2, 1.0_wp, spring%component == 3))
         end associate
      end do
      do e = 1, problem%model%mesh%n_elements
         noise = max(noise, displaced_force(problem, state, e, moved))
      end do
      system%round_off = min(2.0_wp * epsilon(noise) * noise / scale, worst_round_off)
      system%force_residual = worst / scale
   end subroutine measure_residual
end module linear_system
