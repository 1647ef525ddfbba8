!> Obstacles carried by nodes: bodies without mass that move with the displacements and the rotation of a node. The supports,
!> springs and loads of this node (the carrier) determine their motion.
!>
!> The unknowns of a node in contact with such an obstacle are its displacements relative to the obstacle. Let x be these unknowns
!> in the node's axes A, and d the displacements and rotation of the carrier. The node moves by A x + B d. For nodes of a line
!> contact B is B_rigid, the rigid motion of the body at the node. For a point contact B d is along the normal, and the obstacle
!> slides along the rod: the rod is then not strained, and the stiffness of the body is not a difference of large numbers. If a
!> support or a second obstacle fixes the node in a direction, B d has the other direction. The gap never changes.
!> The forces on all nodes in contact, each times B^T, act on the carrier, which is in equilibrium together with these nodes. This
!> equilibrium contains neither contact forces nor derivatives of the contact's geometry. Conforming elements and the terms of
!> contact depend on the displacements relative to the obstacle, w = A x + (B - B_rigid) d.
!>
!> A body that turns by the angle f about its pivot moves a node in contact by f J r + w, with the arm r from the pivot to the node
!> and the quarter turn J. The second variation of this motion, 2 f J w - f^2 r, times the force on the node is a term of the
!> tangent.
module carried_obstacles
   use kinds, only: wp
   use problem, only: problem_t, dof, carried_by
   use rod_state, only: state_t, node_position, element_load, pose_of
   use rod_load, only: ge_load_t, line_at_stage
   use obstacle_pose, only: pose_t, rigid_motion, about_pivot
   use obstacle_track, only: track_t
   use conforming_span, only: conforming_state_t, conforming_track
   use system_type, only: system_t
   use node_axes, only: own_axes
   implicit none
   private
   public :: set_carried, add_carried_loads, load_on_carrier, with_carrier

contains

   !> Sets the blocks A^-1 B and A^-1 (B - B_rigid) of all nodes that may touch carried obstacles. For nodes without contact the
   !> blocks are zero.
   pure subroutine set_carried(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! in: with constraints and node axes; out: with the blocks
      integer :: c, node
      do node = 1, size(problem%ties%follows)
         if (problem%ties%follows(node)) cycle
         system%tie_block(:, :, problem%ties%first(node):problem%ties%first(node + 1) - 1) = 0.0_wp
         system%slip_block(:, :, problem%ties%first(node):problem%ties%first(node + 1) - 1) = 0.0_wp
      end do
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         if (problem%model%obstacle(problem%candidates%obstacle(c))%carrier == 0) cycle
         call set_blocks_of(problem, state, c, system)
      end do
   end subroutine set_carried

   !> Sets the blocks of one node that touches a carried obstacle.
   pure subroutine set_blocks_of(problem, state, candidate, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(system_t), intent(inout) :: system
      real(wp) :: motion(3, 3), rigid(3, 3), slip(3, 3), n(2), track(2), other(2), along(2), push(3)
      integer :: i, k, block
      associate (node => problem%candidates%node(candidate), fixed => problem%model%fixed, ties => problem%ties, &
         & carrier => problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier)
         n = system%normal(:, candidate)
         track = [n(2), -n(1)]
         rigid = rigid_motion(system%arm(:, candidate))
         push = matmul(n, rigid(1:2, :))
         ! If a support fixes the rotation of the node, the gap depends on the node's rotation relative to the track (`lean`).
         if (fixed(3, node)) push = push - system%lean(node) * (rigid(3, :) + system%bend(candidate) * matmul(track, rigid(1:2, :)))
         motion = 0.0_wp
         k = second_contact(problem, state, system, candidate)
         ! If the contact eliminates no unknown, supports or a parallel obstacle fix the node along the normal.
         if (system%unknown(candidate) > 0) then
            along = n
            if (any(fixed(1:2, node))) then
               i = merge(2, 1, fixed(1, node))
               along = 0.0_wp
               along(i) = 1.0_wp / n(i)
            else if (k > 0) then
               ! The gap to the second obstacle does not change either.
               other = system%normal(:, k)
               along = [other(2), -other(1)] / (n(1) * other(2) - n(2) * other(1))
            end if
            do i = 1, 3
               motion(1:2, i) = along * push(i)
            end do
            if (problem%candidates%follows(candidate) .and. k == 0 .and. .not. any(fixed(1:2, node))) motion(1:2, :) = rigid(1:2, :)
         end if
         slip = motion - rigid
         if (problem%candidates%contact_span(candidate) > 0 .and. .not. fixed(3, node) .and. &
            & (problem%candidates%follows(candidate) .or. k == 0)) then
            ! The rotation of the node follows the direction of the track along which the node slides.
            slip(3, :) = -system%bend(candidate) * matmul(track, slip(1:2, :))
            motion(3, :) = slip(3, :) + rigid(3, :)
         end if
         block = ties%first(node) - 1 + findloc(ties%of(ties%first(node):ties%first(node + 1) - 1), carrier, 1)
         system%tie_block(:, :, block) = in_unknowns(system, node, motion)
         system%slip_block(:, :, block) = in_unknowns(system, node, slip)
      end associate
   end subroutine set_blocks_of

   !> Index of a second candidate at the same node that is in contact and eliminates another unknown of this node. Its obstacle has
   !> another carrier or none. 0: there is no such candidate.
   pure integer function second_contact(problem, state, system, candidate) result(second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      second = candidate
      do
         second = problem%candidates%twin(second)
         if (second == candidate) exit
         if (state%active(second) .and. problem%model%obstacle(problem%candidates%obstacle(second))%carrier /= &
            & problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier .and. system%unknown(second) > 0) return
      end do
      second = 0
   end function second_contact

   !> Transforms displacements and rotations of a node (rows, global axes) to the unknowns of the node.
   pure function in_unknowns(system, node, motion) result(x)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      real(wp), intent(in) :: motion(3, 3)
      real(wp) :: x(3, 3)
      x = motion
      if (.not. system%turned(node)) return
      associate (a => system%axis(:, node))
         x(1, :) = a(1) * motion(1, :) + a(2) * motion(2, :)
         x(3, :) = motion(3, :) - system%roll(node) * x(1, :)
         x(2, :) = a(1) * motion(2, :) - a(2) * motion(1, :) - system%lean(node) * x(3, :)
      end associate
   end function in_unknowns

   !> Adds the loads on conforming elements to the forces on the carriers of their obstacles. Conforming elements have end forces
   !> along the track only, whereas dead loads and pressures also act on the body as a whole.
   subroutine add_carried_loads(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system !! in: residual and load contain the elements; out: with the loads on carriers
      real(wp) :: force(3), rate(3), k(9, 9)
      integer :: e, d, carrier
      if (size(problem%ties%carrier) == 0) return
      do e = 1, problem%model%mesh%n_elements
         carrier = carried_by(problem, e)
         if (carrier == 0) cycle
         call load_on_carrier(problem, state, system, e, element_load(problem, state, e), force, rate, k)
         d = dof(problem, carrier, 1)
         system%residual(d:d + 2) = system%residual(d:d + 2) - force
         system%load(d:d + 2) = system%load(d:d + 2) + rate
         call system%at_nodes%append([carrier, problem%model%mesh%node(:, e)], k, relative=.true.)
      end do
   end subroutine add_carried_loads

   !> Force and moment, about the pivot of the obstacle, of the loads on a conforming element, and their tangent. The internal
   !> residuals of the element are eliminated: the stages of the element move along the track with its ends, with the load factor,
   !> and with the rotation of the obstacle.
   subroutine load_on_carrier(problem, state, system, e, load, force, rate, k)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: e                 !! index of a conforming element on a carried obstacle
      type(ge_load_t), intent(in) :: load
      real(wp), intent(out) :: force(3), rate(3) !! force and moment; their derivative by the load factor
      real(wp), intent(out) :: k(9, 9) !! minus the derivative of the force by the unknowns of the carrier and of both nodes, in the
      !! nodes' axes; the matrix is symmetric. Displacements of the element's nodes are relative to the obstacle
      type(conforming_state_t) :: kept
      type(track_t) :: track
      type(pose_t) :: pose
      real(wp) :: line(2), line_rate(2), arm(2), ends(2, 2), p, by_place, axes(3, 3), half(3, 3)
      integer :: i, at
      force = 0.0_wp
      rate = 0.0_wp
      k = 0.0_wp
      pose = pose_of(problem, state, problem%candidates%obstacle(problem%conforms(e)))
      associate (tab => problem%tableau(problem%model%mesh%stages(e)), node => problem%model%mesh%node(:, e), &
         & h => state%geometry%element(e)%length)
         do i = 1, tab%stages
            call conforming_track(problem, state, e, tab%c(i), kept, track, p)
            call line_at_stage(load, i, line, line_rate)
            line = h * tab%b(i) * line
            line_rate = h * tab%b(i) * line_rate
            arm = pose%arm(track%place)
            by_place = track%tangent(1) * line(2) - track%tangent(2) * line(1)
            associate (along => system%op(1 + tab%stages + i, :, e))
               force = force + about_pivot(arm, line) + [0.0_wp, 0.0_wp, by_place * along(size(along) - 1)]
               rate = rate + about_pivot(arm, line_rate) + [0.0_wp, 0.0_wp, by_place * along(size(along))]
               k(3, 3) = k(3, 3) + dot_product(arm, line) - by_place * along(3)
               k(3, [4, 5, 7, 8]) = k(3, [4, 5, 7, 8]) - by_place * along([1, 2, 4, 5])
            end associate
            ! The positions of the stages are measured from the first end of the element.
            associate (n => system%normal(:, problem%conforms(e)))
               k(3, 4:5) = k(3, 4:5) - by_place * [n(2), -n(1)]
            end associate
         end do
         do i = 1, 2
            at = 3 * i + 1
            ends(:, i) = pose%arm(node_position(state, node(i)))
            ! The assembled tangent of a pressure is symmetric: the skew part at an end of an element, p/2 times a quarter turn,
            ! cancels that of the neighbouring element and is left out. The symmetric part is half of the derivative of the
            ! resultant force and moment of the pressure on the element.
            p = merge(-0.5_wp, 0.5_wp, i == 1) * load%pressure
            half(:, 1:2) = -p * reshape([0.0_wp, 1.0_wp, ends(1, i), -1.0_wp, 0.0_wp, ends(2, i)], [3, 2])
            half(:, 3) = 0.0_wp
            k(1:3, at:at + 2) = k(1:3, at:at + 2) + half
            k(1:2, 3) = k(1:2, 3) + p * ends(:, i)
            k(3, 1:2) = k(1:2, 3)
            axes = own_axes(system, node(i))
            k(1:3, at:at + 2) = matmul(k(1:3, at:at + 2), axes)
            k(at:at + 2, 1:3) = transpose(k(1:3, at:at + 2))
         end do
         line = ends(:, 2) - ends(:, 1)
         half(:, 1) = [-line(2), line(1), 0.5_wp * (dot_product(ends(:, 2), ends(:, 2)) - dot_product(ends(:, 1), ends(:, 1)))]
         force = force + load%pressure * half(:, 1)
         rate = rate + load%pressure_rate * half(:, 1)
      end associate
   end subroutine load_on_carrier

   !> Matrix of a contact with a carried obstacle for the unknowns of the contact's node and of the carrier. The matrix includes the
   !> second variation of the node's motion with the body.
   pure function with_carrier(problem, system, candidate, matrix, pull) result(k)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: matrix(3, 3)     !! matrix of the contact for displacements relative to the obstacle, node axes
      real(wp), intent(in) :: pull(2)          !! force of the obstacle on the node (contact_pull), or its derivative; global axes
      real(wp) :: k(6, 6), axes(3, 3)
      k = 0.0_wp
      k(:3, :3) = matrix
      axes = own_axes(system, problem%candidates%node(candidate))
      k(6, :3) = pull(2) * axes(1, :) - pull(1) * axes(2, :)
      k(:3, 6) = k(6, :3)
      k(6, 6) = -dot_product(pull, system%arm(:, candidate))
   end function with_carrier
end module carried_obstacles
