!> Quantities of a state at the nodes of the deck. A node of the deck is a fixed material point, whereas nodes of the mesh may move
!> along the rods.
module deck_nodes
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap, carried_by
   use rod_state, only: state_t, pose_of
   use obstacle_geometry, only: moved_gap
   use obstacle_pose, only: pose_t, rigid_motion
   use linear_system, only: system_t, to_global
   use state_transfer, only: find_point, kept_t, point_displacement
   use conforming_span, only: conforming_state_t, conforming_displacement
   use rod_equations, only: local_forces, inner_local_forces
   use rod_profile, only: profile_t, new_profile, keep_profile, profile_rate, profile_place
   use ge_in_state, only: ge_here_t
   use node_axes, only: relative_increments
   implicit none
   private
   public :: deck_displacements, deck_section_forces, deck_gaps, deck_node_rates, place_rate, find_node

contains

   !> Finds the position on the mesh of a node of the deck.
   pure subroutine find_node(problem, state, node, mesh_node, e, tau, near)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node               !! node of the deck
      integer, intent(out) :: mesh_node         !! mesh node at the same material point; 0: no such node
      integer, intent(out) :: e                 !! element that contains the point in its interior; 0: no such element
      real(wp), intent(out) :: tau              !! place in this element, 0 to 1
      integer, intent(inout), optional :: near  !! index with which the search starts, see find_point
      e = 0
      tau = 0.0_wp
      mesh_node = problem%mesh_node(node)
      if (mesh_node > 0) return
      call find_point(problem, state, problem%layout%node_rod_segment(node), problem%layout%node_at(node), e, tau, near)
      if (tau > 0.0_wp .and. tau < 1.0_wp) return
      mesh_node = problem%model%mesh%node(merge(1, 2, tau <= 0.0_wp), e)
      e = 0
   end subroutine find_node

   !> Displacements and rotations of nodes of the deck, relative to their stress-free positions in the problem.
   pure function deck_displacements(problem, state, nodes) result(u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: nodes(:) !! nodes of the deck
      real(wp) :: u(3, size(nodes))
      type(kept_t) :: kept
      integer :: i, e, mesh_node, near
      real(wp) :: tau
      near = 0
      do i = 1, size(nodes)
         call find_node(problem, state, nodes(i), mesh_node, e, tau, near)
         if (e == 0) then
            u(:, i) = state%u(:, mesh_node)
         else
            call point_displacement(problem, state, e, tau, kept, u(:, i))
         end if
      end do
   end function deck_displacements

   !> Section forces (N, Q, M) at both ends of every element of the deck. Where they jump, each end has the value on its own
   !> element's side. A contact force acts at the present position of its node.
   function deck_section_forces(problem, state) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: local(3, 2, problem%deck%mesh%n_elements)
      integer, dimension(2 * problem%deck%mesh%n_elements) :: holder
      real(wp) :: tau(size(holder)), forces(3, size(holder)), ends(3, 2), there
      integer :: place(2, size(local, 3)), e, side, n, i, last, element, near
      ! The ends are processed in the order of the deck, because neighbouring elements share a position, and many positions are in
      ! one element of the mesh.
      n = 0
      near = 0
      do e = 1, size(place, 2)
         do side = 1, 2
            call find_point(problem, state, problem%layout%rod_segment_of(e), problem%deck%mesh%s(side, e) + &
               & problem%layout%origin(e), element, there, near)
            if (side == 2 .and. there <= 0.0_wp) then
               ! At a mesh node the element that ends there is used.
               element = problem%beside(1, problem%model%mesh%node(1, element))
               there = 1.0_wp
            end if
            place(side, e) = n
            if (n > 0) then
               if (element == holder(n) .and. abs(there - tau(n)) <= 0.0_wp) cycle
            end if
            n = n + 1
            place(side, e) = n
            holder(n) = element
            tau(n) = there
         end do
      end do
      last = 0
      do while (last < n)
         i = last + 1
         last = i
         do while (last < n)
            if (holder(last + 1) /= holder(i)) exit
            last = last + 1
         end do
         associate (inside => tau(i:last) > 0.0_wp .and. tau(i:last) < 1.0_wp)
            if (any(inside)) forces(:, i:last) = inner_local_forces(problem, state, holder(i), tau(i:last))
            if (all(inside)) cycle
         end associate
         call local_forces(problem, state, holder(i), ends)
         do i = i, last
            if (tau(i) <= 0.0_wp) forces(:, i) = ends(:, 1)
            if (tau(i) >= 1.0_wp) forces(:, i) = ends(:, 2)
         end do
      end do
      do e = 1, size(place, 2)
         local(:, :, e) = forces(:, place(:, e))
      end do
   end function deck_section_forces

   !> Computes gaps and deformed positions at the deck's nodes of all contacts, contact after contact.
   pure subroutine deck_gaps(problem, state, u, gap, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: u(:, :)           !! (3, deck's nodes) from deck_displacements
      real(wp), allocatable, intent(out) :: gap(:), place(:, :) !! (rows) gaps; (2, rows) deformed positions
      integer :: k, n
      n = sum([(size(problem%deck%contact(k)%node), k=1, size(problem%deck%contact))])
      allocate (gap(n), place(2, n))
      n = 0
      do k = 1, size(problem%deck%contact)
         associate (node => problem%deck%contact(k)%node)
            call deck_contact_gaps(problem, state, k, u(:, node), gap(n + 1:n + size(node)), place(:, n + 1:n + size(node)))
            n = n + size(node)
         end associate
      end do
   end subroutine deck_gaps

   !> Computes gaps and deformed positions at the deck's nodes of a contact.
   pure subroutine deck_contact_gaps(problem, state, contact, u, gap, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact            !! index into model%contact
      real(wp), intent(in) :: u(:, :)           !! (3, nodes of the contact in the deck) from deck_displacements
      real(wp), intent(out) :: gap(:)           !! (nodes of the contact in the deck) gaps
      real(wp), intent(out) :: place(:, :)      !! (2, nodes of the contact in the deck) deformed positions
      real(wp) :: at_home, home_offset, later, normal(2), bend
      type(pose_t) :: pose
      integer :: i
      associate (list => problem%deck%contact(contact), o => problem%deck%contact(contact)%obstacle, kept => problem%constant, &
         & overlap => problem%overlap(contact), load => problem%model%step(problem%step)%load)
         pose = pose_of(problem, state, o)
         ! Part of the gap that is the same at all nodes: initial overlap that is not yet removed, minus prescribed closing.
         later = overlap * (1.0_wp - kept%resolved(o)) - kept%closing(o) - &
            & state%load_factor * (load%closing(o) + load%resolved(o) * overlap)
         do i = 1, size(list%node)
            associate (home => problem%deck%mesh%x(:, list%node(i)), obstacle => problem%deck%obstacle(o))
               place(:, i) = home + u(1:2, i)
               call moved_gap(obstacle, home, pose%own_motion(home, u(1:2, i)), at_home, gap(i), normal, bend)
               home_offset = list%gap
               if (obstacle%at_nodes) home_offset = list%gap - at_home
               if (obstacle%bilateral) home_offset = -at_home
               at_home = at_home + home_offset
               if (abs(at_home) <= rounding_gap(problem)) at_home = 0.0_wp
               gap(i) = gap(i) + at_home + later
            end associate
         end do
      end associate
   end subroutine deck_contact_gaps

   !> Derivatives of displacements and rotations of all nodes of the deck, for an increment of the unknowns at constant load factor.
   function deck_node_rates(problem, state, system, x) result(rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      real(wp), intent(in) :: x(:)              !! (n) increments of the unknowns, node axes
      real(wp) :: rate(3, size(problem%mesh_node))
      type(profile_t) :: profile
      type(pose_t) :: pose
      real(wp) :: du(6), tau, carried(3)
      integer :: node, mesh_node, e, z
      do node = 1, size(rate, 2)
         call find_node(problem, state, node, mesh_node, e, tau)
         if (e == 0) then
            rate(:, node) = to_global(problem, system, x, mesh_node)
            cycle
         end if
         if (carried_by(problem, e) > 0) then
            du = relative_increments(problem, system, x, e)
         else
            associate (ends => problem%model%mesh%node(:, e))
               du = [to_global(problem, system, x, ends(1)), to_global(problem, system, x, ends(2))]
            end associate
         end if
         z = problem%z_size(e)
         call place_rate(problem, state, e, tau, profile, du, matmul(system%op(:z, :6, e), du), 0.0_wp, rate(:, node))
         if (carried_by(problem, e) == 0) cycle
         ! A point inside a conforming element moves with the obstacle of the element.
         pose = pose_of(problem, state, problem%candidates%obstacle(problem%conforms(e)))
         carried = to_global(problem, system, x, carried_by(problem, e))
         rate(:, node) = rate(:, node) + matmul(rigid_motion(pose%arm(profile_place(problem, &
            & new_profile(problem, state, e), tau))), carried)
      end do
   end function deck_node_rates

   !> Change of displacement and rotation at a place in an element, with fixed stress-free geometry.
   pure subroutine place_rate(problem, state, e, tau, profile, du, dz, load_change, rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau               !! place in the element, 0 to 1
      type(profile_t), intent(inout) :: profile !! profile of the element used last, see keep_profile
      real(wp), intent(in) :: du(6) !! changes of the nodes' displacements; for an element on a carried obstacle the changes from
      !! relative_increments
      real(wp), intent(in) :: dz(:)             !! (z_size) changes of the stored unknowns
      real(wp), intent(in) :: load_change       !! change of the load factor
      real(wp), intent(out) :: rate(3)          !! change of displacement (x, y) and rotation, global axes
      real(wp) :: step, moved(3, 2), part
      type(state_t) :: beside
      type(conforming_state_t) :: kept
      type(ge_here_t) :: here
      integer :: way, i
      if (problem%conforms(e) == 0) then
         call keep_profile(problem, state, e, profile, here)
         rate = profile_rate(problem, state, profile, tau, du, dz, load_change)
         return
      end if
      ! For a conforming element the derivative is a central difference. The step of the difference, relative to the element's
      ! length or to its forces and loads, balances truncation and rounding errors.
      step = epsilon(step)**(1.0_wp / 3.0_wp)
      part = max(maxval(abs(du([1, 2, 4, 5]))), maxval(abs(dz(size(dz) - problem%model%mesh%stages(e) + 1:))))
      if (part > 0.0_wp) step = step * state%geometry%element(e)%length / part
      beside = state
      do way = 1, 2
         part = merge(-step, step, way == 1)
         do i = 1, 2
            associate (node => problem%model%mesh%node(i, e))
               beside%u(1:2, node) = state%u(1:2, node) + part * du(3 * i - 2:3 * i - 1)
            end associate
         end do
         beside%z(:size(dz), e) = state%z(:size(dz), e) + part * dz
         beside%load_factor = state%load_factor + part * load_change
         kept = conforming_state_t()
         call conforming_displacement(problem, beside, e, tau, kept, moved(:, way))
      end do
      rate = (moved(:, 2) - moved(:, 1)) / (2.0_wp * step)
   end subroutine place_rate
end module deck_nodes
