!> The equilibrium equations at a state, assembled about the present contact set.
!>
!> Unknowns: three a node in band order, in axes of the node (turned so that the second is the obstacle's normal where a
!> rigid contact is active; that unknown is then eliminated). In a contact span the third is the rotation less that of the
!> track there, on which the first one moves the node: a node that follows the track keeps it at zero. The border of this
!> band is in bordered_system.
module linear_system
   use kinds, only: wp
   use model, only: joint_spring_t
   use problem, only: problem_t, dof
   use rod_state, only: state_t, element_displacement, element_load, candidate_gap, closing_rate, may_react, parallel
   use node_loads, only: node_push_t, dead_node_load, node_pushes
   use force_law, only: law_reaction
   use ge_element, only: ge_directions, ge_load_t, ge_columns
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use conforming_span, only: track_rotation, track_bend_rate, touchdown_spring, touchdown_couple
   use ground_marks, only: mark_spring
   use inner_forces, only: inner_forces_t
   use band_matrix, only: band_t, factor_t, new_band
   use gauss_tableau, only: max_stages
   use active_coupling, only: active_coupling_t, set_active, coupled_answer, add_forces, excess_row
   use tied_nodes, only: set_blocks, tie_value, tie_swing, node_unknowns, spread_force, add_matrix
   use axial_rigidity, only: rigidity_t, new_rigidity
   use timing, only: timers_t, timing_start, timing_stop, phase_elements, phase_assembly
   implicit none
   private
   public :: system_t, new_system, assemble, sum_elements, contact_tangent, spring_tangent, add_swings, apply_joints, &
      & matrix_to_node, turn_pair, to_node, to_global, row_times, contact_reaction, worst_round_off

   real(wp), parameter :: worst_round_off = 1.0e-6_wp !! a residual above it is no equilibrium, whatever its reason
   real(wp), parameter :: near_balance = 0.01_wp      !! residual from which on the marks of foundations take part

   type :: system_t
      integer :: n = 0                          !! unknowns of the band
      type(band_t) :: k                         !! tangent, node axes, nothing eliminated, ground too stiff by its excess
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling           !! with the excess
      real(wp), allocatable :: residual(:)      !! (n) condensed internal minus external forces
      real(wp), allocatable :: raw(:)           !! (n) the same from the stored resultants, without element defects
      real(wp), allocatable :: load(:)          !! (n) minus its derivative by the load factor
      logical, allocatable :: fixed(:)          !! (n) eliminated: supports and rigid contacts
      real(wp), allocatable :: value(:)         !! (n) increment of a fixed unknown that closes its own error
      real(wp), allocatable :: rate(:)          !! (n) its derivative by the load factor
      real(wp), allocatable :: axis(:, :)       !! (2, nodes) direction of the node's first axis
      logical, allocatable :: turned(:)         !! (nodes) the axes differ from the global ones
      real(wp), allocatable :: roll(:)          !! (nodes) rotation per displacement along the first axis that the third unknown
      !! does not count: the curvature of the track of a contact span
      real(wp), allocatable :: tie_block(:, :, :) !! see tied_nodes
      type(rigidity_t) :: rigidity              !! inextensible elements
      real(wp), allocatable :: tangent_stretch(:, :) !! (2, inextensible elements) what is given back to them in `tangent`
      real(wp), allocatable :: swing(:)         !! (ties) what their forces add to the stiffness against rotation of their turners
      ! Contact, one entry a candidate.
      real(wp), allocatable :: gap(:), normal(:, :), bend(:)
      real(wp), allocatable :: opening(:)       !! gap to the surface as other reactions have settled it
      real(wp), allocatable :: motion(:, :)     !! (2, candidates) of the obstacle, per unit of load factor
      real(wp), allocatable :: closing(:)       !! (candidates) of the gap besides that, per unit of load factor
      integer, allocatable :: unknown(:)        !! eliminated unknown of an active rigid contact, 0 otherwise
      real(wp), allocatable :: slope(:)         !! gap per unit of that unknown
      integer, allocatable :: partner(:)        !! second active rigid contact of the same node, in a corner; 0: none, or it is one
      logical, allocatable :: soft(:)           !! on a foundation, not a rigid obstacle
      real(wp), allocatable :: spring(:)        !! soft: reaction per gap, at the present one where active, or the band's
      !! share of a ground that couples; 0 for rigid
      real(wp), allocatable :: push(:)          !! soft: the reaction that belongs to the gap of an active one
      ! Elements.
      real(wp), allocatable :: ek(:, :, :), ef(:, :), eraw(:, :), el(:, :), op(:, :, :)
      integer, allocatable :: grip(:)           !! (elements) quadrature points of its foundations: which parts touch
      real(wp), allocatable :: eshift(:, :, :) !! (6, 2, elements) element matrix times unit translations in x and y, node axes
      ! Border.
      real(wp), allocatable :: tangent(:)       !! (n) derivative along the path by the load factor
      real(wp), allocatable :: path_row(:)      !! (n) node axes
      real(wp) :: path_corner = 0.0_wp
      integer :: negative_pivots = 0            !! of the tangent on the null space of the active constraints
      ! Measures of the state itself.
      real(wp) :: force_residual = 0.0_wp       !! relative, from the stored resultants
      real(wp) :: defect_residual = 0.0_wp      !! internal: rotations [rad], positions over the size, forces over force_scale
      real(wp) :: force_scale = 0.0_wp
      real(wp) :: gap_error = 0.0_wp            !! of the gaps to foundations, by rounding [length]
      real(wp) :: gap_noise = 0.0_wp            !! what that makes of the forces, relative
      real(wp) :: round_off = 0.0_wp            !! of force_residual, from stiff springs and UL2 elements
      logical :: marks_act = .true.             !! the marks of foundations are unknowns, too: near equilibrium
      logical :: ok = .true.                    !! false: an element or the matrix was singular
   end type system_t

contains

   !> Storage for one problem, reused for every linearisation.
   function new_system(problem) result(system)
      type(problem_t), intent(in) :: problem
      type(system_t) :: system
      integer :: n, nodes, elements, z, c
      n = problem%n_unknowns
      nodes = problem%model%mesh%n_nodes
      elements = problem%model%mesh%n_elements
      z = maxval(problem%z_size)
      system%n = n
      system%k = new_band(n, problem%numbering%half_bandwidth)
      allocate (system%residual(n), system%raw(n), system%load(n), source=0.0_wp)
      allocate (system%value(n), system%rate(n), system%path_row(n), source=0.0_wp)
      allocate (system%fixed(n), source=.false.)
      allocate (system%axis(2, nodes), source=0.0_wp)
      allocate (system%turned(nodes), source=.false.)
      allocate (system%roll(nodes), source=0.0_wp)
      allocate (system%tie_block(3, 3, size(problem%ties%of)), source=0.0_wp)
      system%rigidity = new_rigidity(problem)
      allocate (system%tangent_stretch(2, system%rigidity%n), source=0.0_wp)
      allocate (system%swing(size(problem%model%tie)), source=0.0_wp)
      allocate (system%ek(6, 6, elements), system%ef(6, elements), system%eraw(6, elements), system%el(6, elements))
      allocate (system%op(z, ge_columns, elements))
      allocate (system%grip(elements), source=0)
      allocate (system%eshift(6, 2, merge(elements, 0, any(problem%ground%founded))))
      associate (list => problem%candidates)
         allocate (system%gap(list%n), system%normal(2, list%n), system%bend(list%n), system%slope(list%n))
         allocate (system%opening(list%n))
         allocate (system%motion(2, list%n), system%closing(list%n), source=0.0_wp)
         allocate (system%unknown(list%n), system%partner(list%n), source=0)
         allocate (system%spring(list%n), system%push(list%n), source=0.0_wp)
         allocate (system%soft(list%n), source=.false.)
         do c = 1, list%n
            system%slope(c) = 1.0_wp
            associate (obstacle => problem%model%obstacle(list%obstacle(c)))
               system%soft(c) = .not. obstacle%rigid
               if (system%soft(c)) system%spring(c) = obstacle%modulus * list%tributary(c)
            end associate
            if (problem%coupling%entry(c) > 0) system%spring(c) = 1.0_wp / problem%coupling%local(problem%coupling%entry(c))
         end do
      end associate
      allocate (system%tangent(n), source=0.0_wp)
   end function new_system

   !> Assembles at `state`; `base` is the last converged configuration, which the UL2 element refers to.
   subroutine assemble(problem, state, base, system, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state, base
      type(system_t), intent(inout) :: system
      type(timers_t), intent(inout) :: timers
      integer :: e, c
      logical :: ok
      real(wp) :: defect(3), worst(3), shift(6, 2)
      class(rod_element_t), pointer :: rod
      type(inner_forces_t) :: inner

      call timing_start(timers, phase_elements)
      system%ok = .true.
      worst = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         rod => rod_at(problem, e)
         call rod%evaluate(problem, state, base, e, system%ef(:, e), system%eraw(:, e), system%ek(:, :, e), &
            & system%el(:, e), system%op(:, :, e), defect, ok, inner, shift)
         if (size(system%eshift, 3) > 0) system%eshift(:, :, e) = shift
         system%grip(e) = inner%n
         system%ok = system%ok .and. ok
         worst = max(worst, defect)
      end do
      call timing_stop(timers, phase_elements)
      if (.not. system%ok) return

      call timing_start(timers, phase_assembly)
      do c = 1, problem%candidates%n
         call candidate_gap(problem, state, c, system%gap(c), system%normal(:, c), system%bend(c))
         if (system%soft(c)) call set_foundation(problem, state, c, system)
         system%closing(c) = closing_rate(problem, problem%candidates, c)
         system%motion(:, c) = problem%model%step(problem%step)%load%motion(:, problem%candidates%obstacle(c))
         if (.not. state%active(c)) system%slope(c) = merge(1.0_wp, 0.0_wp, may_react(problem, c, system%normal(:, c)))
      end do
      call set_coupling(problem, state, system)
      call set_constraints(problem, state, system)
      call set_blocks(problem, state%u, system%turned, system%axis, system%roll, system%tie_block)
      call sum_elements(problem, system)
      call set_rigidity(problem, state, system)
      call add_node_loads(problem, state, system)
      call add_node_pushes(problem, state, system)
      call add_springs(problem, state, system)
      call add_joint_springs(problem, state, system)
      call add_contact(problem, state, system)
      call set_swings(problem, state, system)
      call add_swings(problem, system, system%swing, system%k)
      call measure_residual(problem, state, system)
      system%defect_residual = max(worst(1), worst(2) / system%force_scale, worst(3) / problem%size)
      system%marks_act = max(system%force_residual, system%defect_residual) <= near_balance
      if (system%marks_act) call add_marks(problem, state, system)
      call timing_stop(timers, phase_assembly)
   end subroutine assemble

   !> Reaction and stiffness of a foundation; those of the first touch where a candidate is open.
   pure subroutine set_foundation(problem, state, candidate, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(system_t), intent(inout) :: system  !! with the gap
      real(wp) :: penetration, share
      associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(candidate)), push => system%push(candidate), &
         & spring => system%spring(candidate))
         if (problem%coupling%entry(candidate) > 0) return
         penetration = merge(-system%gap(candidate), 0.0_wp, state%active(candidate))
         if (obstacle%law == 0) then
            push = spring * penetration
         else
            share = obstacle%width * problem%candidates%tributary(candidate)
            call law_reaction(problem%model%law(obstacle%law), penetration, push, spring)
            push = share * push
            spring = share * spring
         end if
      end associate
   end subroutine set_foundation

   !> Reactions of the ground that couples candidates, and the openings that are left.
   subroutine set_coupling(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! with all gaps
      real(wp) :: none(size(system%gap))
      system%opening = system%gap
      if (problem%coupling%n == 0) return
      none = 0.0_wp
      call set_active(problem%coupling, state%active, system%coupling)
      call coupled_answer(problem%coupling, system%coupling, none, system%opening, system%push)
   end subroutine set_coupling

   !> Which unknowns are eliminated, and the axes of the nodes.
   subroutine set_constraints(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: node, i, c, d, other, first(problem%model%mesh%n_nodes)
      real(wp) :: target, along
      system%fixed = .false.
      system%value = 0.0_wp
      system%rate = 0.0_wp
      system%turned = .false.
      system%roll = 0.0_wp
      associate (step => problem%model%step(problem%step)%load, fixed => problem%model%fixed)
         do node = 1, problem%model%mesh%n_nodes
            do i = 1, 3
               if (.not. fixed(i, node)) cycle
               d = dof(problem, node, i)
               target = problem%constant%displacement(i, node) + state%load_factor * step%displacement(i, node)
               system%fixed(d) = .true.
               system%value(d) = target - state%u(i, node)
               system%rate(d) = step%displacement(i, node)
            end do
         end do
         do i = 1, size(problem%model%tie)
            associate (tie => problem%model%tie(i))
               d = dof(problem, tie%node, tie%component)
               system%fixed(d) = .true.
               system%value(d) = tie_value(tie, state%u) - state%u(tie%component, tie%node)
            end associate
         end do
         first = 0
         system%partner = 0
         do c = 1, problem%candidates%n
            system%unknown(c) = 0
            if (.not. state%active(c) .or. system%soft(c)) cycle
            node = problem%candidates%node(c)
            if (problem%candidates%touch(c) > 0) then
               if (.not. may_react(problem, c, system%normal(:, c))) then
                  ! A support holds the node of a line where it is.
                  call follow_track(c, node)
                  cycle
               end if
            end if
            if (first(node) > 0) then
               ! In a corner of two obstacles the second one holds the node along the first; more can hold nothing.
               system%slope(c) = dot_product(system%normal(:, c), system%axis(:, node))
               if (any(fixed(1:2, node)) .or. system%partner(first(node)) > 0 .or. abs(system%slope(c)) < parallel) cycle
               d = dof(problem, node, 1)
               along = dot_product(system%normal(:, c), system%normal(:, first(node)))
               system%partner(first(node)) = c
               system%unknown(c) = d
               system%fixed(d) = .true.
               system%value(d) = -(system%gap(c) + along * system%value(d + 1)) / system%slope(c)
               system%rate(d) = (dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c) - &
                  & along * system%rate(d + 1)) / system%slope(c)
               cycle
            end if
            first(node) = c
            ! A support leaves one direction in which the obstacle can act, or none.
            if (fixed(1, node)) then
               if (fixed(2, node)) cycle
               i = 2
               system%slope(c) = system%normal(2, c)
            else if (fixed(2, node)) then
               i = 1
               system%slope(c) = system%normal(1, c)
            else
               i = 2
               system%slope(c) = 1.0_wp
               system%turned(node) = .true.
               system%axis(:, node) = [system%normal(2, c), -system%normal(1, c)]
            end if
            d = dof(problem, node, i)
            system%unknown(c) = d
            system%fixed(d) = .true.
            system%value(d) = -system%gap(c) / system%slope(c)
            system%rate(d) = (dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c)) / system%slope(c)
            if (problem%candidates%touch(c) > 0) call follow_track(c, node)
            if (.not. any(fixed(1:2, node))) cycle
            ! A support that moves takes the gap along.
            other = dof(problem, node, 3 - i)
            system%value(d) = system%value(d) - system%normal(3 - i, c) * system%value(other) / system%slope(c)
            system%rate(d) = system%rate(d) - system%normal(3 - i, c) * system%rate(other) / system%slope(c)
         end do
      end associate

   contains

      !> The third unknown of a node of a contact span. What the obstacle moves along itself turns nothing by itself.
      subroutine follow_track(c, node)
         integer, intent(in) :: c, node
         real(wp) :: along
         along = dot_product([system%normal(2, c), -system%normal(1, c)], system%motion(:, c))
         if (system%turned(node)) system%roll(node) = -system%bend(c)
         if (.not. problem%candidates%follows(c) .or. problem%model%fixed(3, node)) return
         d = dof(problem, node, 3)
         system%fixed(d) = .true.
         system%value(d) = -track_rotation(problem, state, c)
         system%rate(d) = system%bend(c) * along
      end subroutine follow_track
   end subroutine set_constraints

   !> Reaction of an active rigid contact that answers a force of the structure on the unknowns. Where a corner holds the
   !> node the second reaction answers along the first obstacle, and the first one the rest.
   pure real(wp) function contact_reaction(system, candidate, force) result(reaction)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate         !! with an eliminated unknown
      real(wp), intent(in) :: force(:)         !! (n) node axes
      integer :: p
      reaction = force(system%unknown(candidate)) / system%slope(candidate)
      p = system%partner(candidate)
      if (p == 0) return
      reaction = reaction - dot_product(system%normal(:, candidate), system%normal(:, p)) * &
         & force(system%unknown(p)) / system%slope(p)
   end function contact_reaction

   !> Sums the elements into the band and the residual.
   subroutine sum_elements(problem, system)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(inout) :: system
      integer :: e, i, j, a, b, p(2), node(2)
      system%k%a = 0.0_wp
      system%residual = 0.0_wp
      system%load = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         node = problem%model%mesh%node(:, e)
         p = 3 * (problem%numbering%position(node) - 1)
         if (size(system%eshift, 3) > 0) then
            do i = 1, 2
               if (.not. system%turned(node(i))) cycle
               do j = 1, 2
                  call turn_pair(system%axis(:, node(i)), system%eshift(3 * i - 2:3 * i - 1, j, e))
               end do
            end do
         end if
         do i = 1, 2
            if (system%turned(node(i))) call turn_element(system%axis(:, node(i)), system%roll(node(i)), 3 * i - 2, &
               & system%ek(:, :, e), system%ef(:, e), system%eraw(:, e), system%el(:, e))
         end do
         if (any(problem%ties%follows(node))) then
            do i = 1, 2
               call spread_force(problem, system%tie_block, node(i), system%ef(3 * i - 2:3 * i, e), system%residual)
               call spread_force(problem, system%tie_block, node(i), system%el(3 * i - 2:3 * i, e), system%load)
            end do
            call add_matrix(problem, system%tie_block, node, system%ek(:, :, e), system%k)
            cycle
         end if
         do a = 1, 2
            system%residual(p(a) + 1:p(a) + 3) = system%residual(p(a) + 1:p(a) + 3) + system%ef(3 * a - 2:3 * a, e)
            system%load(p(a) + 1:p(a) + 3) = system%load(p(a) + 1:p(a) + 3) + system%el(3 * a - 2:3 * a, e)
            do j = 1, 3
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

   !> Turns the unknowns from row `first` of an element into a node's axes.
   pure subroutine turn_element(axis, roll, first, k, f, raw, fl)
      real(wp), intent(in) :: axis(2), roll
      integer, intent(in) :: first
      real(wp), intent(inout) :: k(6, 6), f(6), raw(6), fl(6)
      integer :: j
      call turn_force(axis, roll, f(first:first + 2))
      call turn_force(axis, roll, raw(first:first + 2))
      call turn_force(axis, roll, fl(first:first + 2))
      do j = 1, 6
         call turn_force(axis, roll, k(first:first + 2, j))
      end do
      do j = 1, 6
         call turn_force(axis, roll, k(j, first:first + 2))
      end do
   end subroutine turn_element

   !> Force and moment on a node in its axes: what works on the first unknown turns the node along the track, too.
   pure subroutine turn_force(axis, roll, force)
      real(wp), intent(in) :: axis(2), roll
      real(wp), intent(inout) :: force(3)
      call turn_pair(axis, force(1:2))
      force(1) = force(1) + roll * force(3)
   end subroutine turn_force

   !> The same for whatever works on displacements and rotation of a node: loads, rows of constraints.
   pure subroutine to_node(system, node, force)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp), intent(inout) :: force(3)      !! global axes on entry, those of the node on return
      if (system%turned(node)) call turn_force(system%axis(:, node), system%roll(node), force)
   end subroutine to_node

   !> Components of a vector along `axis` and its left normal.
   pure subroutine turn_pair(axis, v)
      real(wp), intent(in) :: axis(2)
      real(wp), intent(inout) :: v(2)
      v = [axis(1) * v(1) + axis(2) * v(2), axis(1) * v(2) - axis(2) * v(1)]
   end subroutine turn_pair

   !> Loads of nodes that do not depend on the state.
   subroutine add_node_loads(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: node
      real(wp) :: load(3), rate(3)
      do node = 1, problem%model%mesh%n_nodes
         call dead_node_load(problem, state, node, load, rate)
         call to_node(system, node, load)
         call to_node(system, node, rate)
         call spread_force(problem, system%tie_block, node, -load, system%residual)
         call spread_force(problem, system%tie_block, node, rate, system%load)
      end do
   end subroutine add_node_loads

   !> Those that do: forces and stiffness.
   subroutine add_node_pushes(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
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
         call add_matrix(problem, system%tie_block, [push(n)%node], push(n)%stiffness, system%k)
      end do
   end subroutine add_node_pushes

   !> Springs between nodes and ground, which follow the displacements since the stress-free start.
   subroutine add_springs(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: node
      real(wp) :: force(3)
      do node = 1, problem%model%mesh%n_nodes
         if (.not. any(problem%spring(:, node) > 0.0_wp)) cycle
         force = problem%spring(:, node) * state%u(:, node)
         call to_node(system, node, force)
         call spread_force(problem, system%tie_block, node, force, system%residual)
         call add_matrix(problem, system%tie_block, [node], spring_tangent(problem, system, node), system%k)
      end do
   end subroutine add_springs

   !> Springs between two nodes, which follow the difference of their displacements.
   subroutine add_joint_springs(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: k(6, 6), row(6), force
      integer :: i, j
      do i = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(i))
            row = joint_row(system, spring)
            force = spring%stiffness * (state%u(spring%component, spring%node(2)) - state%u(spring%component, spring%node(1)))
            do j = 1, 2
               call spread_force(problem, system%tie_block, spring%node(j), force * row(3 * j - 2:3 * j), system%residual)
            end do
            do j = 1, 6
               k(:, j) = (spring%stiffness * row(j)) * row
            end do
            call add_matrix(problem, system%tie_block, spring%node, k, system%k)
         end associate
      end do
   end subroutine add_joint_springs

   !> The stretch of a spring between two nodes by increments of these (node_unknowns).
   pure function joint_row(system, spring) result(row)
      type(system_t), intent(in) :: system     !! gives the axes
      type(joint_spring_t), intent(in) :: spring
      real(wp) :: row(6)
      integer :: j
      row = 0.0_wp
      row(spring%component) = -1.0_wp
      row(3 + spring%component) = 1.0_wp
      do j = 1, 2
         call to_node(system, spring%node(j), row(3 * j - 2:3 * j))
      end do
   end function joint_row

   !> The maps of inextensible elements, from their tangents in node axes.
   subroutine set_rigidity(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: part(3, 3), t(2, max_stages), axes(2, 2)
      integer :: i, j, e, n, b, k, s
      do i = 1, system%rigidity%n
         e = system%rigidity%element(i)
         n = system%rigidity%first(i)
         s = problem%model%mesh%stages(e)
         associate (rigidity => system%rigidity, g => state%geometry%element(e), tab => problem%tableau(s), ties => problem%ties, &
            & nodes => problem%model%mesh%node(:, e))
            call ge_directions(tab, g%length, g%angle, problem%compliance(e), element_load(problem, state, e), &
               & element_displacement(problem, state, e), state%z(:problem%z_size(e), e), t(:, :s))
            rigidity%give(:, :, i) = 0.0_wp
            do j = 1, s
               t(:, j) = t(:, j) / norm2(t(:, j))
               do k = 1, 2
                  rigidity%give(:, k, i) = rigidity%give(:, k, i) + (g%length * g%scale * tab%b(j) * problem%compliance(e)%give * &
                     & t(k, j)) * t(:, j)
               end do
            end do
            rigidity%shifted(:, :, i) = system%op(1:2, 4:5, e)
            rigidity%load(:, i) = system%op(1:2, 8, e)
            axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
            do k = 1, 2
               if (system%turned(nodes(2))) call turn_pair(system%axis(:, nodes(2)), axes(:, k))
            end do
            do j = 1, 2
               do b = ties%first(nodes(j)), max(ties%first(nodes(j)), ties%first(nodes(j) + 1) - 1)
                  part = own_axes(system, nodes(j))
                  if (ties%follows(nodes(j))) part = system%tie_block(:, :, b)
                  rigidity%force(:, n:n + 2) = matmul(system%op(1:2, 3 * j - 2:3 * j, e), part)
                  rigidity%push(:, n:n + 2) = transpose(matmul(system%ek(3 * j - 2:3 * j, 4:5, e), axes))
                  if (ties%follows(nodes(j))) rigidity%push(:, n:n + 2) = matmul(rigidity%push(:, n:n + 2), part)
                  n = n + 3
               end do
            end do
         end associate
      end do
   end subroutine set_rigidity

   !> Displacements and rotation of a node by its unknowns.
   pure function own_axes(system, node) result(matrix)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp) :: matrix(3, 3)
      matrix = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      if (.not. system%turned(node)) return
      associate (a => system%axis(:, node))
         matrix(1:2, 1) = a
         matrix(1:2, 2) = [-a(2), a(1)]
         matrix(3, 1) = system%roll(node)
      end associate
   end function own_axes

   !> The stiffness of rigid links through their forces.
   pure subroutine set_swings(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! with the residual, which at a tied component is the force in its tie
      integer :: i
      do i = 1, size(system%swing)
         associate (tie => problem%model%tie(i))
            system%swing(i) = tie_swing(tie, state%u, system%residual(dof(problem, tie%node, tie%component)))
         end associate
      end do
   end subroutine set_swings

   !> Adds stiffnesses of rigid links to a band.
   pure subroutine add_swings(problem, system, swing, band)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: swing(:)         !! (ties) as of set_swings
      type(band_t), intent(inout) :: band
      real(wp) :: k(3, 3)
      integer :: i
      do i = 1, size(swing)
         if (.not. abs(swing(i)) > 0.0_wp) cycle
         k = 0.0_wp
         k(3, 3) = swing(i)
         call matrix_to_node(system, problem%model%tie(i)%turner, k)
         call add_matrix(problem, system%tie_block, [problem%model%tie(i)%turner], k, band)
      end do
   end subroutine add_swings

   !> Products of springs between nodes and of rigid links with a vector.
   pure subroutine apply_joints(problem, system, swing, springs, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: swing(:)         !! (ties) as of set_swings
      logical, intent(in) :: springs           !! true: with the springs
      real(wp), intent(in) :: x(:)             !! (n) node axes
      real(wp), intent(inout) :: y(:)          !! (n) their products are added
      real(wp), intent(inout) :: form          !! and x^T times these
      real(wp) :: row(6), du(3), stretch
      integer :: i, j
      do i = 1, size(swing)
         if (.not. abs(swing(i)) > 0.0_wp) cycle
         associate (node => problem%model%tie(i)%turner)
            row(:3) = [0.0_wp, 0.0_wp, 1.0_wp]
            call to_node(system, node, row(:3))
            du = node_unknowns(problem, system%tie_block, node, x)
            stretch = dot_product(row(:3), du)
            call spread_force(problem, system%tie_block, node, (swing(i) * stretch) * row(:3), y)
            form = form + swing(i) * stretch**2
         end associate
      end do
      if (.not. springs) return
      do i = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(i))
            row = joint_row(system, spring)
            stretch = 0.0_wp
            do j = 1, 2
               stretch = stretch + dot_product(row(3 * j - 2:3 * j), &
                  & node_unknowns(problem, system%tie_block, spring%node(j), x))
            end do
            do j = 1, 2
               call spread_force(problem, system%tie_block, spring%node(j), (spring%stiffness * stretch) * row(3 * j - 2:3 * j), y)
            end do
            form = form + spring%stiffness * stretch**2
         end associate
      end do
   end subroutine apply_joints

   !> Stiffness of a node's springs in the node's axes.
   pure function spring_tangent(problem, system, node) result(k)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! gives the axes
      integer, intent(in) :: node
      real(wp) :: k(3, 3)
      integer :: i
      k = 0.0_wp
      do i = 1, 3
         k(i, i) = problem%spring(i, node)
      end do
      call matrix_to_node(system, node, k)
   end function spring_tangent

   !> The same as to_node for a stiffness at a node.
   pure subroutine matrix_to_node(system, node, k)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp), intent(inout) :: k(3, 3)
      integer :: i
      do i = 1, 3
         call to_node(system, node, k(:, i))
      end do
      do i = 1, 3
         call to_node(system, node, k(i, :))
      end do
   end subroutine matrix_to_node

   !> Foundations, and the curvature of the obstacles under the reactions. An obstacle that moves does to its contacts
   !> what their moving the other way would do; a closing gap does what their moving against the normal would do, but that
   !> the normal stays.
   subroutine add_contact(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: c, d
      real(wp) :: force(2), k(3, 3), motion(3), normal(3)
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         associate (node => problem%candidates%node(c))
            d = dof(problem, node, 1)
            call contact_tangent(problem, state, system, c, force, k)
            if (system%soft(c)) call spread_force(problem, system%tie_block, node, -[force, 0.0_wp], system%residual)
            if (problem%candidates%touch(c) > 0 .and. .not. problem%candidates%follows(c)) then
               system%residual(d + 2) = system%residual(d + 2) + touchdown_couple(problem, state, c)
            end if
            call add_matrix(problem, system%tie_block, [node], k, system%k)
            motion = [system%motion(:, c), 0.0_wp]
            normal = [system%normal(:, c), 0.0_wp]
            if (system%turned(node)) call turn_pair(system%axis(:, node), motion(1:2))
            if (system%turned(node)) call turn_pair(system%axis(:, node), normal(1:2))
            motion(3) = -system%roll(node) * motion(1)
            call spread_force(problem, system%tie_block, node, &
               & matmul(k, motion) + (system%spring(c) * system%closing(c)) * normal, system%load)
         end associate
      end do
      call place_coupling(problem, system)
   end subroutine add_contact

   !> What marks that are not where they belong do. That is no force: the stored resultants know nothing of it.
   subroutine add_marks(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: spring, force, rate, normal(3), k(3, 3)
      integer :: m, i
      do m = 1, size(problem%mark)
         normal = 0.0_wp
         call mark_spring(problem, state, m, spring, force, rate, normal(1:2))
         if (.not. abs(spring) > 0.0_wp) cycle
         associate (node => problem%mark(m)%node)
            call to_node(system, node, normal)
            do i = 1, 3
               k(:, i) = spring * normal * normal(i)
            end do
            call spread_force(problem, system%tie_block, node, force * normal, system%residual)
            call spread_force(problem, system%tie_block, node, rate * normal, system%load)
            call add_matrix(problem, system%tie_block, [node], k, system%k)
         end associate
      end do
   end subroutine add_marks

   !> Unknowns and directions of the ground that couples candidates; and what its moving does beside the band.
   subroutine place_coupling(problem, system)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(inout) :: system
      real(wp) :: away(system%coupling%n)      ! what the gap loses per unit of load factor
      integer :: i, c, node
      do i = 1, system%coupling%n
         c = system%coupling%candidate(i)
         node = problem%candidates%node(c)
         system%coupling%row(i) = dof(problem, node, 1)
         system%coupling%direction(:, i) = system%normal(:, c)
         if (system%turned(node)) call turn_pair(system%axis(:, node), system%coupling%direction(:, i))
         away(i) = dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c)
      end do
      if (any(abs(away) > 0.0_wp)) call add_forces(system%coupling, -matmul(system%coupling%excess, away), system%load)
   end subroutine place_coupling

   !> Force of an active contact on its node, and what it adds to the tangent: the foundation's spring, the curvature of the
   !> obstacle under the reaction, and that a point contact moves along the rod (touchdown_spring).
   pure subroutine contact_tangent(problem, state, system, candidate, force, k)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! its gaps and normals are those of the state
      integer, intent(in) :: candidate
      real(wp), intent(out) :: force(2), k(3, 3) !! node axes
      real(wp) :: n(2), t(2), r, kn
      integer :: d
      n = system%normal(:, candidate)
      associate (node => problem%candidates%node(candidate))
         if (system%turned(node)) call turn_pair(system%axis(:, node), n)
      end associate
      t = [n(2), -n(1)]
      kn = system%spring(candidate)
      r = state%reaction(candidate)
      if (system%soft(candidate)) r = system%push(candidate)
      force = r * n
      k = 0.0_wp
      k(1:2, 1) = kn * n * n(1) - (r * system%bend(candidate)) * t * t(1)
      k(1:2, 2) = kn * n * n(2) - (r * system%bend(candidate)) * t * t(2)
      if (problem%candidates%touch(candidate) == 0) return
      associate (node => problem%candidates%node(candidate))
         if (.not. system%turned(node)) return
         ! The track turns the node by more the further it goes where its curvature changes.
         d = dof(problem, node, 3)
         ! The force that the free part ends with; what the obstacle does inside the line is in its elements.
         if (problem%candidates%follows(candidate)) k(1, 1) = k(1, 1) + &
            & (r - system%residual(system%unknown(candidate))) * system%bend(candidate)
         k(1, 1) = k(1, 1) + system%residual(d) * track_bend_rate(problem, state, candidate)
         if (.not. problem%candidates%follows(candidate)) k(3, 3) = touchdown_spring(problem, state, candidate)
      end associate
   end subroutine contact_tangent

   !> Equilibrium of the free unknowns from the stored end forces, relative to the largest force or moment over size.
   subroutine measure_residual(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: worst, scale, noise, moved, carried
      type(ge_load_t) :: load
      type(node_push_t), allocatable :: push(:)
      class(rod_element_t), pointer :: rod
      integer :: e, i, d, node
      system%raw = system%residual
      scale = problem%force_floor
      do e = 1, problem%model%mesh%n_elements
         do i = 1, 2
            node = problem%model%mesh%node(i, e)
            call spread_force(problem, system%tie_block, node, system%eraw(3 * i - 2:3 * i, e) - system%ef(3 * i - 2:3 * i, e), &
               & system%raw)
         end do
         scale = max(scale, maxval(abs(system%eraw(1:2, e))), maxval(abs(system%eraw(4:5, e))), &
            & abs(system%eraw(3, e)) / problem%size, abs(system%eraw(6, e)) / problem%size)
         rod => rod_at(problem, e)
         scale = max(scale, rod%force_scale(problem, state, e))
      end do
      scale = max(scale, maxval(abs(state%reaction), mask=state%active))
      scale = max(scale, maxval(problem%spring(1:2, :) * abs(state%u(1:2, :))), &
         & maxval(problem%spring(3, :) * abs(state%u(3, :))) / problem%size)
      do e = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(e))
            scale = max(scale, spring%stiffness * maxval(abs(state%u(spring%component, spring%node))) / &
               & merge(problem%size, 1.0_wp, spring%component == 3))
         end associate
      end do
      ! Loads of several steps may cancel; what is left is known to the rounding of the parts.
      associate (rate => problem%model%step(problem%step)%load)
         scale = max(scale, maxval(abs(problem%constant%node_force(1:2, :))), &
            & abs(state%load_factor) * maxval(abs(rate%node_force(1:2, :))))
      end associate
      push = node_pushes(problem, state)
      do i = 1, size(push)
         scale = max(scale, norm2(push(i)%force(1:2)))
      end do
      if (problem%spans) then
         ! An obstacle may carry a load that no section feels.
         carried = 0.0_wp
         do e = 1, problem%model%mesh%n_elements
            if (problem%conforms(e) == 0) cycle
            load = element_load(problem, state, e)
            carried = carried + (norm2(load%line) + abs(load%pressure)) * state%geometry%element(e)%length
         end do
         scale = max(scale, carried)
      end if
      if (any(problem%ground%founded)) then
         ! A foundation may carry a load that no section feels.
         do e = 1, problem%model%mesh%n_elements
            load = element_load(problem, state, e)
            scale = max(scale, maxval(abs(load%line)) * state%geometry%element(e)%length)
         end do
      end if
      worst = 0.0_wp
      do node = 1, problem%model%mesh%n_nodes
         do i = 1, 3
            d = dof(problem, node, i)
            if (system%fixed(d)) cycle
            if (i < 3) then
               worst = max(worst, abs(system%raw(d)))
            else
               worst = max(worst, abs(system%raw(d)) / problem%size)
            end if
         end do
      end do
      system%force_scale = scale
      ! UL2 takes N from displacements, a foundation its reaction from a gap: no better than their rounding times stiffness.
      moved = max(maxval(abs(state%u(1:2, :))), maxval(abs(state%u(3, :))) * problem%size)
      system%gap_error = 2.0_wp * epsilon(noise) * merge(moved, problem%size, problem%resting)
      noise = maxval([problem%ground%stiffest, system%spring]) * merge(moved, problem%size, problem%resting)
      system%gap_noise = 2.0_wp * epsilon(noise) * noise / scale
      noise = max(noise, moved * maxval(problem%spring(1:2, :)), moved * maxval(problem%spring(3, :)) / problem%size**2)
      do e = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(e))
            noise = max(noise, moved * spring%stiffness / merge(problem%size**2, 1.0_wp, spring%component == 3))
         end associate
      end do
      do e = 1, problem%model%mesh%n_elements
         rod => rod_at(problem, e)
         noise = max(noise, rod%force_noise(problem, state, e, moved))
      end do
      system%round_off = min(2.0_wp * epsilon(noise) * noise / scale, worst_round_off)
      system%force_residual = worst / scale
   end subroutine measure_residual

   !> Row i of the tangent times x.
   pure real(wp) function row_times(system, i, x)
      type(system_t), intent(in) :: system
      integer, intent(in) :: i
      real(wp), intent(in) :: x(:)
      integer :: j
      row_times = 0.0_wp
      do j = max(1, i - system%k%kd), i
         row_times = row_times + system%k%a(1 + i - j, j) * x(j)
      end do
      do j = i + 1, min(system%n, i + system%k%kd)
         row_times = row_times + system%k%a(1 + j - i, i) * x(j)
      end do
      if (system%coupling%n > 0) row_times = row_times - excess_row(system%coupling, i, x)
   end function row_times

   !> Increment of a node in global axes.
   pure function to_global(problem, system, x, node) result(du)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: node
      real(wp) :: du(3)
      integer :: d
      du = node_unknowns(problem, system%tie_block, node, x)
      if (.not. system%turned(node)) return
      d = dof(problem, node, 1)
      associate (a => system%axis(:, node))
         du(1:2) = [a(1) * x(d) - a(2) * x(d + 1), a(2) * x(d) + a(1) * x(d + 1)]
         du(3) = du(3) + system%roll(node) * x(d)
      end associate
   end function to_global

end module linear_system
