!> Obstacles that nodes carry: bodies without mass that share the displacements x and y of a node, whose supports, springs and loads
!> say how they move.
!>
!> The unknowns of a node in contact with such an obstacle are its displacements relative to the obstacle. With x the unknowns of
!> the node in its axes A and d the displacement of the node that carries the obstacle, the node moves by A x + B d. B is the unit
!> matrix, so that touching nodes go along with the obstacle, unless a support or a second obstacle holds the node: B d then is what
!> is left free, with the gap unchanged. The forces on all touching nodes, B^T times each, then act on the carrier: it is in
!> equilibrium together with what touches the obstacle. Contact forces do not enter, nor derivatives of the contact's geometry.
!> Conforming elements and the terms of contact depend on the displacements relative to the obstacle alone, A x + (B - 1) d.
module carried_obstacles
   use kinds, only: wp
   use problem, only: problem_t, dof, carried_by
   use rod_state, only: state_t, node_position, element_load
   use rod_load, only: ge_load_t, sum_line
   use tied_nodes, only: add_matrix, node_unknowns, spread_force
   use band_matrix, only: band_t
   use system_type, only: system_t
   use node_axes, only: own_axes
   implicit none
   private
   public :: set_carried, add_carried_loads, apply_carried_loads, add_at_contact, apply_at_contact

contains

   !> Sets the blocks A^-1 B and A^-1 (B - 1) of all nodes that may touch carried obstacles; zero for nodes that do not.
   pure subroutine set_carried(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! in: with constraints and node axes
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

   !> Sets the blocks of a node that touches a carried obstacle.
   pure subroutine set_blocks_of(problem, state, candidate, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(system_t), intent(inout) :: system
      real(wp) :: motion(3, 3), slip(3, 3), n(2), other(2), det
      integer :: i, k, block
      associate (node => problem%candidates%node(candidate), fixed => problem%model%fixed, ties => problem%ties, &
         & carrier => problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier)
         n = system%normal(:, candidate)
         motion = 0.0_wp
         ! Where the contact eliminates no unknown, supports or a parallel obstacle hold the node.
         if (system%unknown(candidate) > 0 .and. .not. any(fixed(1:2, node))) then
            motion(1, 1) = 1.0_wp
            motion(2, 2) = 1.0_wp
            k = second_contact(problem, state, system, candidate)
            if (k > 0) then
               ! The gap to the other obstacle is unchanged, too.
               other = system%normal(:, k)
               det = n(1) * other(2) - n(2) * other(1)
               do i = 1, 2
                  motion(1:2, i) = [other(2), -other(1)] * n(i) / det
               end do
            end if
         else if (system%unknown(candidate) > 0) then
            i = merge(2, 1, fixed(1, node))
            motion(i, 1:2) = n / n(i)
         end if
         slip = motion
         slip(1, 1) = slip(1, 1) - 1.0_wp
         slip(2, 2) = slip(2, 2) - 1.0_wp
         if (problem%candidates%follows(candidate) .and. .not. fixed(3, node)) then
            ! The node turns with the track along which it slips.
            slip(3, :) = -system%bend(candidate) * (n(2) * slip(1, :) - n(1) * slip(2, :))
            motion(3, :) = slip(3, :)
         end if
         block = ties%first(node) - 1 + findloc(ties%of(ties%first(node):ties%first(node + 1) - 1), carrier, 1)
         system%tie_block(:, :, block) = in_unknowns(system, node, motion)
         system%slip_block(:, :, block) = in_unknowns(system, node, slip)
      end associate
   end subroutine set_blocks_of

   !> Second contact that eliminates an unknown of a candidate's node, with an obstacle of another carrier or of none; 0: none.
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

   !> Displacements and rotations of a node in global axes (rows), as its unknowns.
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

   !> Adds the loads on conforming elements to the forces on the nodes that carry their obstacles. The elements have forces along
   !> the track only; dead loads and pressures act on the whole.
   subroutine add_carried_loads(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system  !! in: with the elements in residual, load and band
      type(ge_load_t) :: load
      real(wp) :: line(2), rate(2), chord(2)
      integer :: e, i, d, carrier
      do e = 1, problem%model%mesh%n_elements
         carrier = carried_by(problem, e)
         if (carrier == 0) cycle
         load = element_load(problem, state, e)
         d = dof(problem, carrier, 1)
         associate (tab => problem%tableau(problem%model%mesh%stages(e)), length => state%geometry%element(e)%length, &
            & nodes => problem%model%mesh%node(:, e))
            call sum_line(tab, load, tab%b, line, rate)
            chord = node_position(state, nodes(2)) - node_position(state, nodes(1))
            system%residual(d:d + 1) = system%residual(d:d + 1) - length * line - load%pressure * [-chord(2), chord(1)]
            system%load(d:d + 1) = system%load(d:d + 1) + length * rate + load%pressure_rate * [-chord(2), chord(1)]
            if (.not. abs(load%pressure) > 0.0_wp) cycle
            do i = 1, 2
               call add_matrix(problem, system%tie_block, [carrier, nodes(i)], &
                  & pressure_coupling(system, nodes(i), i, load%pressure), system%k)
            end do
         end associate
      end do
   end subroutine add_carried_loads

   !> Adds the product of the pressures' part of the tangent, that couples the carrier with the ends of conforming elements, and a
   !> vector x; the quadratic form as well.
   pure subroutine apply_carried_loads(problem, system, pressure, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: pressure(:, :)   !! (2, elements) follower pressure at both ends
      real(wp), intent(in) :: x(:)             !! (n)
      real(wp), intent(inout) :: y(:), form
      real(wp) :: moved(6), force(6)
      integer :: e, i, carrier
      do e = 1, problem%model%mesh%n_elements
         carrier = carried_by(problem, e)
         if (carrier == 0 .or. .not. abs(pressure(1, e)) > 0.0_wp) cycle
         do i = 1, 2
            associate (node => problem%model%mesh%node(i, e))
               moved = [node_unknowns(problem, system%tie_block, carrier, x), node_unknowns(problem, system%tie_block, node, x)]
               force = matmul(pressure_coupling(system, node, i, pressure(1, e)), moved)
               call spread_force(problem, system%tie_block, carrier, force(:3), y)
               call spread_force(problem, system%tie_block, node, force(4:), y)
               form = form + dot_product(moved, force)
            end associate
         end do
      end do
   end subroutine apply_carried_loads

   !> Adds the matrix of a contact at its node, which depends on the displacement relative to the obstacle, to the band.
   subroutine add_at_contact(problem, system, candidate, matrix, band)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: matrix(3, 3)     !! node axes
      type(band_t), intent(inout) :: band
      associate (node => problem%candidates%node(candidate))
         if (problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier > 0) then
            call add_matrix(problem, system%slip_block, [node], matrix, band)
         else
            call add_matrix(problem, system%tie_block, [node], matrix, band)
         end if
      end associate
   end subroutine add_at_contact

   !> Adds the product of the matrix of a contact at its node and a vector x; the quadratic form as well.
   pure subroutine apply_at_contact(problem, system, candidate, matrix, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: matrix(3, 3)     !! node axes
      real(wp), intent(in) :: x(:)             !! (n)
      real(wp), intent(inout) :: y(:), form
      real(wp) :: moved(3), force(3)
      associate (node => problem%candidates%node(candidate))
         if (problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier > 0) then
            moved = node_unknowns(problem, system%slip_block, node, x)
            force = matmul(matrix, moved)
            call spread_force(problem, system%slip_block, node, force, y)
         else
            moved = node_unknowns(problem, system%tie_block, node, x)
            force = matmul(matrix, moved)
            call spread_force(problem, system%tie_block, node, force, y)
         end if
      end associate
      form = form + dot_product(moved, force)
   end subroutine apply_at_contact

   !> Matrix of the carrier and a node of a conforming element under pressure p. The tangent of a pressure is symmetric: as in
   !> element_products, its skew part at the ends of free elements, p/2 times a quarter turn, cancels that of the neighbours. Of the
   !> derivative of the pressure's resultant half is left.
   pure function pressure_coupling(system, node, side, pressure) result(k)
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      integer, intent(in) :: side              !! 1: first node of the element, 2: second node
      real(wp), intent(in) :: pressure
      real(wp) :: k(6, 6)                      !! unknowns of the carrier, then of the node in its axes
      real(wp) :: axes(3, 3), turn
      axes = own_axes(system, node)
      turn = merge(0.5_wp, -0.5_wp, side == 1) * pressure
      k = 0.0_wp
      k(1, 4:6) = -turn * axes(2, :)
      k(2, 4:6) = turn * axes(1, :)
      k(4:6, 1:2) = transpose(k(1:2, 4:6))
   end function pressure_coupling
end module carried_obstacles
