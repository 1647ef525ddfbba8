!> State of the structure: all data that change along the path. An assignment copies the whole state.
module rod_state
   use kinds, only: wp, parallel
   use problem, only: problem_t, rounding_gap, touching_gap
   use rod_geometry, only: geometry_t, new_geometry
   use candidates, only: candidates_t
   use obstacle_geometry, only: moved_gap, obstacle_gap
   use obstacle_pose, only: pose_t
   use ground_coupling, only: settlement
   use rod_load, only: ge_load_t
   use ge_stages, only: ge_stiffness_t, ge_compliance
   use load_pattern, only: load_t
   use cross_section, only: section_t, varies
   use rod_samples, only: stage_section, add_line_loads
   use gauss_tableau, only: max_stages
   use force_law, only: segment_unknown
   implicit none
   private
   public :: state_t, new_state, element_displacement, element_load, element_compliance, end_pressures, node_position, &
      & rod_direction, candidate_position, pose_of, candidate_gap, candidate_opening, chain_gap, gap_at, gap_slope, &
      & candidate_offset, obstacle_offset, closing_rate, may_react, is_stress_free, unknown_push, rounding_steps

   real(wp), parameter :: rounding_steps = 32.0_wp !! bound of the rounding errors of displacements that are summed along an
   !! element, in rounding units
   real(wp), parameter :: unknown_push = huge(1.0_wp)

   !> State of the structure at one point of the path.
   type :: state_t
      real(wp) :: load_factor = 0.0_wp
      real(wp), allocatable :: u(:, :)        !! (3, nodes) displacements and rotation, global axes
      real(wp), allocatable :: z(:, :)        !! (largest z_size, elements) stored unknowns of the elements: section forces
      logical, allocatable :: active(:)       !! (candidates) true: in contact
      real(wp), allocatable :: reaction(:)    !! (candidates) normal reaction, > 0 in compression
      real(wp), allocatable :: couple(:) !! (candidates) couple on a node that has the direction of its track, without the couples
      !! of the elements on the track
      logical, allocatable :: grounded(:) !! (elements) true: at the last converged point a distributed foundation was in contact
      !! with the element
      integer, allocatable :: segment(:) !! (candidates of the foundations' chain) segment of the force law on the element after the
      !! candidate, see force_law and ground_segments
      real(wp), allocatable :: push(:, :) !! (max_stages + 1, candidates of the foundations' chain) pressures of foundations on the
      !! element after the candidate, see ground_pressures; unknown_push: the pressure follows from the gap
      type(geometry_t) :: geometry !! stress-free geometry; it changes only if a touchdown point or an end of a foundation's contact
      !! moves
   end type state_t

contains

   !> Stress-free initial state. Bilateral candidates and candidates without gap are active if they may have a reaction, because
   !> they may be the only supports of the structure. If several candidates at one node are on rigid obstacles with parallel
   !> normals, only the first is active. Candidates of contact spans are always active.
   function new_state(problem) result(state)
      type(problem_t), intent(in) :: problem
      type(state_t) :: state
      real(wp) :: gap, normal(2), bend, held(2, problem%model%mesh%n_nodes)
      integer :: c, e, side
      held = 0.0_wp
      allocate (state%u(3, problem%model%mesh%n_nodes), source=0.0_wp)
      allocate (state%z(maxval(problem%z_size), problem%model%mesh%n_elements), source=0.0_wp)
      allocate (state%active(problem%candidates%n), source=.false.)
      allocate (state%reaction(problem%candidates%n), source=0.0_wp)
      allocate (state%couple(problem%candidates%n), source=0.0_wp)
      allocate (state%grounded(problem%model%mesh%n_elements), source=.false.)
      allocate (state%segment(problem%ground%chain%n), source=segment_unknown)
      allocate (state%push(max_stages + 1, problem%ground%chain%n), source=unknown_push)
      state%geometry = new_geometry(problem%model)
      do c = 1, problem%candidates%n
         call candidate_gap(problem, state, c, gap, normal, bend)
         state%active(c) = (problem%candidates%bilateral(c) .or. gap <= touching_gap(problem)) .and. may_react(problem, c, normal)
         if (.not. state%active(c) .or. .not. problem%model%obstacle(problem%candidates%obstacle(c))%rigid) cycle
         associate (first => held(:, problem%candidates%node(c)))
            if (abs(normal(1) * first(2) - normal(2) * first(1)) < parallel .and. norm2(first) > 0.0_wp) then
               state%active(c) = .false.
            else
               first = normal
            end if
         end associate
      end do
      state%active = state%active .or. problem%candidates%contact_span(:problem%candidates%n) > 0
      do c = 1, problem%ground%chain%n
         call chain_gap(problem, state, problem%ground%chain, c, gap, normal, bend)
         if (.not. (problem%ground%chain%bilateral(c) .or. gap <= touching_gap(problem))) cycle
         do side = 1, 2
            e = problem%ground%chain%element(side, c)
            if (e > 0) state%grounded(e) = .true.
         end do
      end do
   end function new_state

   !> True for the initial state, in which displacements and section forces are zero.
   pure logical function is_stress_free(state)
      type(state_t), intent(in) :: state
      is_stress_free = all(abs(state%u) <= 0.0_wp) .and. all(abs(state%z) <= 0.0_wp)
   end function is_stress_free

   !> Displacements and rotations of an element's two nodes.
   pure function element_displacement(problem, state, e) result(u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: u(6)
      u(1:3) = state%u(:, problem%model%mesh%node(1, e))
      u(4:6) = state%u(:, problem%model%mesh%node(2, e))
   end function element_displacement

   !> Compliance of an element, with its variation between the stages if the section varies.
   pure function element_compliance(problem, state, e) result(compliance)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(ge_stiffness_t) :: compliance
      compliance = problem%compliance(e)
      if (.not. allocated(state%geometry%sample)) return
      if (varies(problem%model%section(problem%model%mesh%section(e)))) call vary_compliance(problem, state, e, compliance)
   end function element_compliance

   !> Sets the compliances of the cross sections at the stages of an element.
   pure subroutine vary_compliance(problem, state, e, compliance)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(ge_stiffness_t), intent(inout) :: compliance
      type(section_t) :: section
      type(ge_stiffness_t) :: stage
      integer :: i, s
      s = problem%model%mesh%stages(e)
      do i = 1, s
         section = stage_section(problem%model, state%geometry, e, i)
         stage = ge_compliance(s, state%geometry%element(e)%length, section%ea, section%ei, section%ga, section%shear_rigid)
         if (compliance%axial > 0.0_wp) compliance%part(1, i) = stage%axial / compliance%axial
         compliance%part(2, i) = stage%bending / compliance%bending
         if (compliance%shear > 0.0_wp) compliance%part(3, i) = stage%shear / compliance%shear
      end do
   end subroutine vary_compliance

   !> Distributed loads on an element at the load factor of the state.
   pure function element_load(problem, state, e) result(load)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(ge_load_t) :: load
      real(wp) :: x(2)
      logical :: varies
      integer :: s
      associate (step => problem%model%step(problem%step)%load)
         load%line_rate = step%line_force(:, e)
         load%line = problem%constant%line_force(:, e) + state%load_factor * load%line_rate
         if (size(step%line_load) + size(problem%constant%line_load) > 0) then
            s = max(1, problem%model%mesh%stages(e))
            allocate (load%more)
            varies = .false.
            call add_line_loads(problem%model, state%geometry, e, step, load%more%line_rate(:, :s), varies)
            call add_line_loads(problem%model, state%geometry, e, problem%constant, load%more%line(:, :s), varies)
            load%more%line = load%more%line + state%load_factor * load%more%line_rate
            if (.not. varies) deallocate (load%more)
         end if
         load%gradient_rate = step%gradient(:, e)
         load%gradient = problem%constant%gradient(:, e) + state%load_factor * load%gradient_rate
         load%pressure_rate = step%pressure(e)
         load%pressure = problem%constant%pressure(e) + state%load_factor * load%pressure_rate
         if (problem%immersed(e)) then
            x = node_position(state, problem%model%mesh%node(1, e))
            load%pressure = load%pressure + dot_product(load%gradient, x)
            load%pressure_rate = load%pressure_rate + dot_product(load%gradient_rate, x)
         end if
         load%strain_rate = step%strain(e)
         load%strain = problem%constant%strain(e) + state%load_factor * load%strain_rate
         load%curvature_rate = step%curvature(e)
         load%curvature = problem%constant%curvature(e) + state%load_factor * load%curvature_rate
      end associate
   end function element_load

   !> Follower pressure of a load pattern at both ends of all elements.
   pure function end_pressures(problem, state, load) result(pressure)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(load_t), intent(in) :: load
      real(wp) :: pressure(2, size(load%pressure))
      integer :: e, i
      pressure = spread(load%pressure, 1, 2)
      do e = 1, size(load%pressure)
         if (.not. problem%immersed(e)) cycle
         do i = 1, 2
            pressure(i, e) = pressure(i, e) + dot_product(load%gradient(:, e), node_position(state, problem%model%mesh%node(i, e)))
         end do
      end do
   end function end_pressures

   !> Deformed position of a node.
   pure function node_position(state, node) result(x)
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      real(wp) :: x(2)
      x = state%geometry%x(:, node) + state%u(1:2, node)
   end function node_position

   !> Tangent angle of the deformed rod at end `side` of an element.
   pure real(wp) function rod_direction(problem, state, e, side) result(angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      angle = state%geometry%element(e)%end_angle(side) + state%u(3, problem%model%mesh%node(side, e))
   end function rod_direction

   !> Present position of an obstacle. An obstacle carried by a node has the displacements of the node, and its rotation about the
   !> node.
   pure type(pose_t) function pose_of(problem, state, obstacle) result(pose)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: obstacle
      pose%shift = problem%constant%motion(:, obstacle) + &
         & state%load_factor * problem%model%step(problem%step)%load%motion(:, obstacle)
      associate (carrier => problem%model%obstacle(obstacle)%carrier)
         if (carrier == 0) return
         pose%shift = pose%shift + state%u(1:2, carrier)
         pose%pivot = state%geometry%x(:, carrier)
         pose%turn = state%u(3, carrier)
      end associate
   end function pose_of

   !> Offset added to the distance of a candidate (of contact or of a foundation) from its obstacle: parameter GAP of the deck, plus
   !> the part of the initial overlap that is not yet removed, minus the prescribed closing so far.
   pure real(wp) function candidate_offset(problem, state, list, candidate) result(offset)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate
      offset = obstacle_offset(problem, state, list%obstacle(candidate), list%gap_offset(candidate), list%overlap(candidate))
   end function candidate_offset

   !> Offset added to the distance between an obstacle and any place of a rod; its parts are explained at candidate_offset.
   pure real(wp) function obstacle_offset(problem, state, obstacle, gap, overlap) result(offset)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: obstacle
      real(wp), intent(in) :: gap              !! parameter GAP of the deck [length]
      real(wp), intent(in) :: overlap          !! initial overlap [length]
      associate (kept => problem%constant, load => problem%model%step(problem%step)%load)
         offset = gap + overlap * (1.0_wp - kept%resolved(obstacle)) - kept%closing(obstacle) - state%load_factor * &
            & (load%closing(obstacle) + load%resolved(obstacle) * overlap)
      end associate
   end function obstacle_offset

   !> Amount per unit of the load factor by which a candidate's gap closes, without the displacement of the obstacle.
   pure real(wp) function closing_rate(problem, list, candidate) result(rate)
      type(problem_t), intent(in) :: problem
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate
      associate (load => problem%model%step(problem%step)%load, o => list%obstacle(candidate))
         rate = load%closing(o) + load%resolved(o) * list%overlap(candidate)
      end associate
   end function closing_rate

   !> Position of a candidate in the axes of its obstacle, which may have moved.
   pure function candidate_position(problem, state, candidate) result(x)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: x(2)
      type(pose_t) :: pose
      pose = pose_of(problem, state, problem%candidates%obstacle(candidate))
      x = pose%own_place(node_position(state, problem%candidates%node(candidate)))
   end function candidate_position

   !> Gap of a candidate, gradient of the gap, and curvature of the gap along the obstacle.
   pure subroutine candidate_gap(problem, state, candidate, gap, normal, bend)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(out) :: gap, normal(2), bend
      call chain_gap(problem, state, problem%candidates, candidate, gap, normal, bend)
   end subroutine candidate_gap

   !> Gap of a candidate, gradient of the gap, and curvature of the gap along the obstacle. The candidate is in one of two lists:
   !> problem%candidates, or problem%ground%chain (foundations).
   pure subroutine chain_gap(problem, state, list, candidate, gap, normal, bend)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate
      real(wp), intent(out) :: gap, normal(2), bend
      associate (node => list%node(candidate))
         call gap_at(problem, state, list, candidate, state%geometry%x(:, node), state%u(1:2, node), gap, normal, bend)
      end associate
   end subroutine chain_gap

   !> Gap, gradient and curvature as in chain_gap, at a point of the element after a candidate.
   pure subroutine gap_at(problem, state, list, candidate, home, displacement, gap, normal, bend)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate
      real(wp), intent(in) :: home(2), displacement(2) !! stress-free position and displacement of the point
      real(wp), intent(out) :: gap, normal(2), bend
      real(wp) :: at_home
      type(pose_t) :: pose
      associate (obstacle => list%obstacle(candidate), offset => list%gap_offset(candidate))
         pose = pose_of(problem, state, obstacle)
         call moved_gap(problem%model%obstacle(obstacle), home, pose%own_motion(home, displacement), at_home, gap, normal, bend)
         normal = pose%direction(normal)
         ! The initial gap is taken as exactly zero for a rod on its obstacle, and for a foundation with tension, which has no force
         ! at the start.
         at_home = at_home + offset
         if (problem%model%obstacle(obstacle)%bilateral .or. abs(at_home) <= rounding_gap(problem)) at_home = 0.0_wp
         gap = gap + at_home + (candidate_offset(problem, state, list, candidate) - offset)
      end associate
   end subroutine gap_at

   !> Derivative of a candidate's gap along its rod. The gap of a bilateral contact is measured from that of the stress-free axis,
   !> so that the slope of this axis against the surface is subtracted. On a curved surface the two slopes refer to different
   !> normals.
   pure real(wp) function gap_slope(problem, list, candidate, home, normal, rate, way) result(slope)
      type(problem_t), intent(in) :: problem
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate
      real(wp), intent(in) :: home(2)        !! stress-free position of the point
      real(wp), intent(in) :: normal(2)      !! normal of the obstacle at the present position of the point
      real(wp), intent(in) :: rate(2), way(2) !! derivatives of position and displacement by the coordinate along the rod
      real(wp) :: gap, at_home(2), bend
      slope = dot_product(normal, rate)
      if (.not. list%bilateral(candidate)) return
      call obstacle_gap(problem%model%obstacle(list%obstacle(candidate)), home, gap, at_home, bend)
      slope = dot_product(normal, way) + dot_product(normal - at_home, rate - way)
   end function gap_slope

   !> Gap of a candidate to the surface as it has settled under the reactions. On a surface that does not settle it is the usual
   !> gap.
   real(wp) function candidate_opening(problem, state, candidate) result(opening)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: normal(2), bend
      call candidate_gap(problem, state, candidate, opening, normal, bend)
      opening = opening + settlement(problem%coupling, candidate, state%reaction)
   end function candidate_opening

   !> True if a rigid obstacle with this normal can exert a reaction on the candidate's node. False if supports of the node carry
   !> the whole reaction, or if the node is tied to another node, which then has the contact. For a foundation always true, because
   !> its reaction depends on its gap.
   pure logical function may_react(problem, candidate, normal)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: normal(2)
      associate (fixed => problem%model%fixed(1:2, problem%candidates%node(candidate)))
         may_react = (any(.not. fixed .and. abs(normal) > parallel) .and. &
            & .not. any(problem%ties%tied(1:2, problem%candidates%node(candidate)))) .or. &
            & .not. problem%model%obstacle(problem%candidates%obstacle(candidate))%rigid
      end associate
   end function may_react
end module rod_state
