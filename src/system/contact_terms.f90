!> Terms of contact at nodes in the equations: reactions and stiffness of foundations, coupled ground, and the geometric stiffness
!> of curved obstacles under their reactions.
module contact_terms
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use force_law, only: foundation_reaction
   use ground_following, only: mark_spring
   use track_nodes, only: track_bend_rate, touchdown_spring, touchdown_couple
   use active_coupling, only: set_active, coupled_response, add_forces
   use tied_nodes, only: spread_force, add_matrix
   use system_type, only: system_t
   use node_axes, only: to_node, turn_pair, own_axes
   use carried_obstacles, only: with_carrier
   use eliminated_unknowns, only: contact_reaction
   implicit none
   private
   public :: set_foundation, set_coupling, add_contact, add_marks, contact_pull

contains

   !> Sets reaction and stiffness of a foundation at a candidate's present gap. For an open candidate the stiffness is that at first
   !> contact.
   pure subroutine set_foundation(problem, state, candidate, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(system_t), intent(inout) :: system  !! in: contains the candidate's gap
      real(wp) :: penetration, share
      associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(candidate)), push => system%push(candidate), &
         & spring => system%spring(candidate))
         if (problem%coupling%entry(candidate) > 0) return
         penetration = merge(-system%gap(candidate), 0.0_wp, state%active(candidate))
         if (obstacle%law == 0) then
            push = spring * penetration
         else
            share = problem%candidates%tributary(candidate)
            call foundation_reaction(problem%model, obstacle, penetration, push, spring)
            push = share * push
            spring = share * spring
         end if
      end associate
   end subroutine set_foundation

   !> Sets the reactions of coupled ground at the present gaps, and the openings: gaps of open candidates to the ground's surface as
   !> it has settled under the reactions.
   subroutine set_coupling(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! in: contains the gaps of all candidates
      real(wp) :: none(size(system%gap))
      system%opening = system%gap
      if (problem%coupling%n == 0) return
      none = 0.0_wp
      call set_active(problem%coupling, state%active, system%coupling)
      call coupled_response(problem%coupling, system%coupling, none, system%opening, system%push)
   end subroutine set_coupling

   !> Adds foundations and the geometric stiffness of curved obstacles. A prescribed displacement of an obstacle acts like the
   !> opposite displacement of the nodes in contact. A prescribed closing of the gap acts like a displacement of the nodes against a
   !> constant normal. For carried obstacles, which are rigid, neither term is added.
   subroutine add_contact(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: c, d
      real(wp) :: force(2), k(3, 3), motion(3), normal(3), pull(2)
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         associate (node => problem%candidates%node(c), carrier => problem%model%obstacle(problem%candidates%obstacle(c))%carrier)
            d = dof(problem, node, 1)
            call contact_tangent(problem, state, system, c, force, k)
            if (system%soft(c)) call spread_force(problem, system%tie_block, node, -[force, 0.0_wp], system%residual)
            ! If the contact force acts beside the node (`lean`), the third unknown already contains the distance of the force from
            ! the node.
            if (problem%candidates%contact_span(c) > 0 .and. .not. problem%candidates%follows(c) .and. &
               & (problem%candidates%moves(c) .or. .not. system%turned(node))) then
               system%residual(d + 2) = system%residual(d + 2) + touchdown_couple(problem, state, c)
            end if
            if (carrier > 0) then
               pull = contact_pull(problem, system, c, node_reaction(problem, state, system, c), system%residual(d + 2), system%ef)
               call system%at_nodes%append([node, carrier], with_carrier(problem, system, c, k, pull), relative=.true.)
               cycle
            end if
            call system%at_nodes%append([node], k)
            motion = [system%motion(:, c), 0.0_wp]
            normal = [system%normal(:, c), 0.0_wp]
            if (system%turned(node)) call turn_pair(system%axis(:, node), motion(1:2))
            if (system%turned(node)) call turn_pair(system%axis(:, node), normal(1:2))
            motion(3) = -system%roll(node) * motion(1)
            motion(2) = motion(2) - system%lean(node) * motion(3)
            call spread_force(problem, system%tie_block, node, &
               & matmul(k, motion) + (system%spring(c) * system%closing(c)) * normal, system%load)
         end associate
      end do
      call place_coupling(problem, system)
   end subroutine add_contact

   !> Adds the forces of interface points that are not at their equilibrium positions. These forces are not physical, and the stored
   !> section forces do not contain them.
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

   !> Sets the unknowns and normals of the candidates on coupled ground. Adds those loads from the prescribed motion of this ground
   !> that the band matrix does not contain.
   subroutine place_coupling(problem, system)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(inout) :: system
      real(wp) :: away(system%coupling%n)      ! (coupled candidates) decrease of the gap by the load factor
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

   !> Force of an active contact on its node, and the tangent of this force: stiffness of the foundation, curvature of the obstacle
   !> under the reaction, and rotational stiffness of a point contact that rolls (touchdown_spring).
   pure subroutine contact_tangent(problem, state, system, candidate, force, k)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! contains gaps and normals of the state
      integer, intent(in) :: candidate
      real(wp), intent(out) :: force(2), k(3, 3) !! force and tangent, node axes
      real(wp) :: n(2), t(2), r, kn
      integer :: d
      n = system%normal(:, candidate)
      associate (node => problem%candidates%node(candidate))
         if (system%turned(node)) call turn_pair(system%axis(:, node), n)
      end associate
      t = [n(2), -n(1)]
      kn = system%spring(candidate)
      r = node_reaction(problem, state, system, candidate)
      if (system%soft(candidate)) r = system%push(candidate)
      force = r * n
      k = 0.0_wp
      k(1:2, 1) = kn * n * n(1) - (r * system%bend(candidate)) * t * t(1)
      k(1:2, 2) = kn * n * n(2) - (r * system%bend(candidate)) * t * t(2)
      if (problem%candidates%contact_span(candidate) == 0) return
      if (.not. problem%candidates%follows(candidate)) k(3, 3) = touchdown_spring(problem, state, candidate)
      associate (node => problem%candidates%node(candidate))
         if (.not. system%turned(node)) return
         ! If the curvature of the track varies, the node's rotation is a nonlinear function of its displacement.
         d = dof(problem, node, 3)
         k(1, 1) = k(1, 1) + system%residual(d) * track_bend_rate(problem, state, candidate)
      end associate
   end subroutine contact_tangent

   !> Force of a contact on its node. At the end of a line contact it is the force that balances the free element; the force of the
   !> obstacle inside the line contact belongs to the conforming elements.
   pure real(wp) function node_reaction(problem, state, system, candidate) result(reaction)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      reaction = state%reaction(candidate)
      if (problem%candidates%follows(candidate) .and. system%unknown(candidate) > 0) &
         & reaction = contact_reaction(system, candidate, system%residual)
   end function node_reaction

   !> Force that a rigid obstacle, together with the conforming elements on the obstacle, exerts on the node of a contact; global
   !> axes.
   pure function contact_pull(problem, system, candidate, reaction, couple, ends) result(pull)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: reaction         !! reaction from node_reaction, or its derivative
      real(wp), intent(in) :: couple           !! force on the node's third unknown, or its derivative
      real(wp), intent(in) :: ends(:, :)       !! (6, elements) end forces in node axes, or their derivatives
      real(wp) :: pull(2), along(2), axes(3, 3)
      integer :: side
      along = 0.0_wp
      associate (list => problem%candidates, node => problem%candidates%node(candidate), n => system%normal(:, candidate))
         ! The first unknown of the node also rotates the node (`roll`); the third unknown also displaces the node along the normal
         ! (`lean`).
         pull = reaction * n - system%roll(node) * (couple - system%lean(node) * reaction) * [n(2), -n(1)]
         do side = 1, 2
            associate (e => list%element(side, candidate))
               if (e == 0) cycle
               if (problem%conforms(e) == 0) cycle
               if (list%obstacle(problem%conforms(e)) == list%obstacle(candidate)) &
                  & along = along + ends(7 - 3 * side:8 - 3 * side, e)
            end associate
         end do
         axes = own_axes(system, node)
         pull = pull - matmul(axes(1:2, 1:2), along)
      end associate
   end function contact_pull
end module contact_terms
