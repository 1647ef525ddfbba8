!> Motions of rods along straight walls that equilibrium does not determine: rolling of closed rods, and shifts of free spans.
!>
!> Closed rods that may roll along a straight wall are fixed only by a clamp inside a line contact.
!>
!> Consider a uniform rod that lies on the wall on both sides of the clamp, with loads that are the same for all its material
!> points. Such a rod may shift along itself: its free part keeps the shape while other material points come into contact with the
!> wall. At every load this motion is a null vector of the tangent, and the loads do no work on it. Equilibrium does not determine
!> how far the rod has rolled, until the clamp is at an end of the contact. The program computes the path in the middle, with equal
!> contact lengths before and after the clamp. A spring without force makes the tangent regular against rolling, and the rolling
!> motion is removed from all solutions.
!>
!> EI k^2/2 + n.t (curvature k, force n in the section, unit tangent t) is constant along a rod without forces along it, also
!> through smooth contacts. At the clamp n.t changes by the clamp's force along the wall, which is zero if all obstacles are
!> parallel. The curvature of the rod is therefore equal on both sides of the clamp, whatever its shape elsewhere, and vanishes on
!> both sides at the same load.
!>
!> Neutral free spans may shift along themselves. They lie between a clamp and the end of a line contact on a straight
!> wall parallel to the clamp.
!>
!> A uniform, straight rod without loads along the span has a first integral: EI k^2/2 + n.t is constant, with the curvature k, the
!> force n in the section and the unit tangent t. At the end of the line contact k = 0 and t has the direction of the wall. At the
!> clamp t is the same, so that k^2 = 0 there as well, a double root. A shift of the whole curve along itself, u = t(s) - t(0) with
!> the rotation k, then satisfies all supports to first order, and the tangent matrix is singular at every load. The root is simple
!> if the equations require a zero couple at the clamp instead of a zero rotation: a clamp beside a neutral span is therefore
!> replaced by a hinge. By the first integral the rod still has the direction of the clamp there. The tangent of the hinged rod has
!> one more negative eigenvalue than that of the clamped rod, apart from the null vector of the clamped rod.
module rolling_rods
   use kinds, only: wp, pi, parallel
   use obstacle_types, only: obstacle_line
   use problem, only: problem_t, dof
   use rod_state, only: state_t, rod_direction
   use system_type, only: system_t
   use track_nodes, only: excess_curvature, rod_angle
   use ge_in_state, only: ge_end
   use node_axes, only: to_node
   use band_matrix, only: solve_factored
   use reference_curve, only: is_straight
   implicit none
   private
   public :: find_rolling, constrain_rolling, set_rolling, without_rolling, free_clamps

   real(wp), parameter :: smooth = parallel !! largest kink [rad], and largest relative change of curvature, of a smooth rod

   real(wp), parameter :: exactly_parallel = 1.0e-12_wp !! largest sine of the angle between two directions that count as parallel

contains

   !> Finds the clamp about which the rod may roll, and stores it in problem%rolling.
   subroutine find_rolling(problem)
      type(problem_t), intent(inout) :: problem   !! problem with its contact spans and candidates
      integer :: c, node
      integer, allocatable :: held(:)
      problem%rolling = 0
      held = rod_nodes(problem)
      held = pack(held, any(problem%model%fixed(:, held), 1))
      if (size(held) /= 1) return
      node = held(1)
      if (.not. all(problem%model%fixed(:, node))) return
      c = findloc(problem%candidates%node == node .and. problem%candidates%contact_span > 0, .true., 1)
      if (c == 0) return
      if (.not. touches_walls_only(problem, problem%candidates%obstacle(c))) return
      if (is_alike_all_along(problem, wall_direction(problem, problem%candidates%obstacle(c)))) problem%rolling = node
   end subroutine find_rolling

   !> True for a single closed rod that is uniform, has no kinks, and has the same loads on all its material points. Nodal forces on
   !> contact nodes are allowed if they act normal to the walls.
   pure logical function is_alike_all_along(problem, way) result(alike)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: way(2)              !! unit vector along the walls
      real(wp) :: angle(2)
      integer :: n, i, e(2)
      integer, allocatable :: of_rod(:)
      of_rod = rod_nodes(problem)
      associate (model => problem%model, mesh => problem%model%mesh)
         alike = all(problem%beside(:, of_rod) > 0) .and. size(of_rod) == mesh%n_elements .and. size(model%tie) == 0 .and. &
            & size(model%joint_spring) == 0 .and. all(problem%model%spring(:, of_rod) <= 0.0_wp) .and. all(mesh%curve > 0) .and. &
            & all(model%contact%spans)
         if (.not. alike) return
         do n = 1, size(of_rod)
            associate (node => of_rod(n))
               e = problem%beside(:, node)
               do i = 1, 2
                  associate (curve => model%curve(mesh%curve(e(i))))
                     angle(i) = curve%angle + curve%curvature * mesh%s(3 - i, e(i))
                     alike = alike .and. curve%imperfection == 0 .and. .not. allocated(curve%path)
                  end associate
               end do
               associate (a => model%curve(mesh%curve(e(1))), b => model%curve(mesh%curve(e(2))))
                  alike = alike .and. abs(modulo(angle(2) - angle(1) + pi, 2.0_wp * pi) - pi) <= smooth .and. &
                     & abs(a%curvature - b%curvature) <= smooth * abs(a%curvature)
               end associate
               associate (a => model%section(mesh%section(e(1))), b => model%section(mesh%section(e(2))))
                  alike = alike .and. abs(a%ea - b%ea) <= 0.0_wp .and. abs(a%ei - b%ei) <= 0.0_wp
               end associate
               do i = 1, size(model%step)
                  associate (load => model%step(i)%load)
                     alike = alike .and. load%same_on(e(1), e(2)) .and. .not. load%turns(node)
                     if (.not. load%acts_at(node)) cycle
                     alike = alike .and. any(problem%candidates%node == node .and. problem%candidates%contact_span > 0) .and. &
                        & all(abs(load%displacement(:, node)) <= 0.0_wp) .and. &
                        & abs(dot_product(way, load%node_force(1:2, node))) <= exactly_parallel * norm2(load%node_force(1:2, node))
                  end associate
               end do
            end associate
         end do
      end associate
   end function is_alike_all_along

   !> Indices of the nodes that belong to an element; all other nodes are bodies beside the rod that carry obstacles.
   pure function rod_nodes(problem) result(node)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: node(:)
      integer :: n
      node = pack([(n, n=1, size(problem%beside, 2))], any(problem%beside > 0, 1))
   end function rod_nodes

   !> True if all obstacles in contact are parallel to one straight wall, and all line loads act normal to this wall.
   pure logical function touches_walls_only(problem, wall) result(only)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: wall                 !! index into model%obstacle
      real(wp) :: d(2), other(2), q(2)
      integer :: k, i
      associate (model => problem%model)
         only = model%obstacle(wall)%kind == obstacle_line
         if (.not. only) return
         d = wall_direction(problem, wall)
         do k = 1, size(problem%contact_span)
            associate (obstacle => model%contact(problem%contact_span(k)%contact)%obstacle)
               only = only .and. model%obstacle(obstacle)%kind == obstacle_line
               if (.not. only) return
               other = wall_direction(problem, obstacle)
               only = abs(d(1) * other(2) - d(2) * other(1)) <= exactly_parallel
            end associate
         end do
         do i = 1, size(model%step)
            only = only .and. size(model%step(i)%load%line_load) == 0
            q = model%step(i)%load%line_force(:, 1)
            only = only .and. abs(dot_product(d, q)) <= exactly_parallel * norm2(q)
         end do
      end associate
   end function touches_walls_only

   !> Unit vector along a straight obstacle.
   pure function wall_direction(problem, wall) result(way)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: wall                 !! index into model%obstacle of a straight obstacle
      real(wp) :: way(2)
      associate (point => problem%model%obstacle(wall)%point)
         way = (point(:, 2) - point(:, 1)) / norm2(point(:, 2) - point(:, 1))
      end associate
   end function wall_direction

   !> Nodes that must stay in contact while the rod rolls: the clamp, and nodes at which forces act.
   pure function fixed_contacts(problem) result(node)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: node(:), of_rod(:)
      logical, allocatable :: loaded(:)
      integer :: n, i
      of_rod = rod_nodes(problem)
      loaded = [(any([(problem%model%step(i)%load%acts_at(of_rod(n)), i=1, size(problem%model%step))]), n=1, size(of_rod))]
      node = [problem%rolling, pack(of_rod, loaded .and. of_rod /= problem%rolling)]
   end function fixed_contacts

   !> Length of the line contact on one side of a node (a clamp, or a node at which forces act). Without a line contact the result
   !> is minus the length by which the rod must roll until a line contact begins, where the relative curvature of the rod vanishes.
   !> It is zero if a line contact without force was released there, because the relative curvature is then zero.
   real(wp) function lying(problem, state, node, side) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      integer, intent(in) :: side                 !! side of the node, 1: before it, 2: after it
      real(wp) :: excess, extension, n(2), m, angle
      integer :: c, k, e
      length = 0.0_wp
      c = findloc(problem%candidates%node == node .and. problem%candidates%contact_span > 0, .true., 1)
      if (c == 0) return
      e = problem%beside(side, node)
      if (problem%conforms(e) == 0) then
         call excess_curvature(problem, state, c, excess, extension, side)
         call ge_end(problem, state, e, 3 - side, n, m)
         angle = rod_angle(problem, state, c)
         length = -excess / max(problem%compliance(e)%bending * abs(cos(angle) * n(2) - sin(angle) * n(1)), tiny(length))
         return
      end if
      do k = 1, size(problem%contact_span)
         associate (contact_span => problem%contact_span(k))
            if (.not. contact_span%line .or. contact_span%candidate(3 - side) /= c) cycle
            length = length + sum([(state%geometry%element(e)%s(2) - state%geometry%element(e)%s(1), &
               & e=contact_span%element(1), contact_span%element(2))])
         end associate
      end do
   end function lying

   !> Adds a spring against rolling at the unknown that rolling displaces most. If touchdown points are fixed at their material
   !> points, this unknown is fixed instead of sprung. Its force is zero when the touchdown points are at their equilibrium
   !> positions.
   subroutine constrain_rolling(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system     !! in: assembled; out: with the spring
      real(wp) :: clamp(2), most, shift(3)
      real(wp), allocatable :: lies(:, :)
      integer, allocatable :: stands(:)
      integer :: e, side, i
      system%roll_at = 0
      system%roll_range = 0.0_wp
      system%roll_row = 0.0_wp
      if (problem%rolling == 0) return
      stands = fixed_contacts(problem)
      allocate (lies(2, size(stands)))
      do i = 1, size(stands)
         lies(:, i) = [(lying(problem, state, stands(i), side), side=1, 2)]
      end do
      ! For a curvature k beside the clamp, the stiffness against rolling is k^2 in units of EI and the size. The residual then
      ! rolls the rod by tolerance/k^2. If k is below the third root of the tolerance, this distance exceeds k, the distance to the
      ! point of zero curvature, and rolling is undetermined.
      if (any(lies < -problem%model%step(problem%step)%tolerance**(1.0_wp / 3.0_wp) * problem%size)) return
      clamp = tangent(problem%beside(2, problem%rolling), 1)
      most = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         do side = 1, 2
            associate (node => problem%model%mesh%node(side, e))
               shift = [tangent(e, side) - clamp, 0.0_wp]
               call to_node(system, node, shift)
               do i = 1, 2
                  if (.not. system%fixed(dof(problem, node, i))) system%roll_row(dof(problem, node, i)) = shift(i)
                  if (system%fixed(dof(problem, node, i)) .or. abs(shift(i)) <= most) cycle
                  most = abs(shift(i))
                  system%roll_rate = shift(i)
                  system%roll_at = dof(problem, node, i)
               end do
            end associate
         end do
      end do
      if (system%roll_at == 0) return
      if (any(problem%candidates%held)) then
         ! Touchdown points fixed at their material points determine how far the rod has rolled: rolling is then prevented.
         system%fixed(system%roll_at) = .true.
         system%roll_at = 0
         return
      end if
      system%roll_by = 0.5_wp * (lies(2, 1) - lies(1, 1))
      system%roll_range = max(minval(lies), 0.0_wp)
      ! The spring gets the stiffness of the elements at the node.
      system%k%a(1, system%roll_at) = 2.0_wp * system%k%a(1, system%roll_at)

   contains

      pure function tangent(e, side) result(t)
         integer, intent(in) :: e, side
         real(wp) :: t(2), angle
         angle = rod_direction(problem, state, e, side)
         t = [cos(angle), sin(angle)]
      end function tangent
   end subroutine constrain_rolling

   !> Computes the rolling motion: the response to a force at the unknown that has the spring.
   subroutine set_rolling(system)
      type(system_t), intent(inout) :: system     !! factored
      real(wp) :: motion(system%n, 1)
      if (system%roll_at == 0) return
      motion = 0.0_wp
      motion(system%roll_at, 1) = 1.0_wp
      call solve_factored(system%factor, motion)
      system%rolled = motion(:, 1) * (system%roll_rate / motion(system%roll_at, 1))
   end subroutine set_rolling

   !> Removes the rolling motion from the displacements of a solution.
   pure function without_rolling(system, x) result(rest)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)                !! (n) solution, node axes
      real(wp) :: rest(size(x))
      rest = x
      if (system%roll_at == 0) return
      rest = x - system%rolled * (dot_product(system%roll_row, x) / dot_product(system%roll_row, system%rolled))
   end function without_rolling

   !> Replaces all clamps beside neutral spans by hinges and records them in problem%hinge.
   subroutine free_clamps(problem)
      type(problem_t), intent(inout) :: problem   !! problem with its contact spans; out: with the hinges
      integer :: k, side, node, e
      do k = 1, size(problem%contact_span)
         if (.not. problem%contact_span(k)%line) cycle
         do side = 1, 2
            if (.not. last_of_its_segment(problem, k, side)) cycle
            e = problem%element_first(problem%contact_span(k)%rod_segment)
            if (side == 2) e = problem%element_last(problem%contact_span(k)%rod_segment)
            node = problem%model%mesh%node(side, e)
            if (.not. clamps(problem, node, side)) cycle
            if (.not. runs_along(problem, k)) cycle
            problem%model%fixed(3, node) = .false.
            problem%hinge = [problem%hinge, node]
         end do
      end do
   end subroutine free_clamps

   !> True if there is only one free span, and no other contact, between an end of a contact span and the end of its rod segment.
   pure logical function last_of_its_segment(problem, k, side) result(last)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k, side              !! index of the contact span; side 1: before the span, 2: after the span
      integer :: next
      associate (contact_span => problem%contact_span(k))
         if (side == 1) last = contact_span%at(1) > 0.0_wp
         if (side == 2) last = contact_span%at(2) < problem%layout%rod_segment(contact_span%rod_segment)%length
         next = k + merge(-1, 1, side == 1)
         if (next < 1 .or. next > size(problem%contact_span)) return
         last = last .and. problem%contact_span(next)%rod_segment /= contact_span%rod_segment
      end associate
   end function last_of_its_segment

   !> True if a rod is clamped at its end (rotation and at least one displacement fixed), and no step rotates this clamp or applies
   !> a couple to it.
   pure logical function clamps(problem, node, side)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: node, side           !! node at an end of a rod; side 1: beginning of the rod, 2: its end
      integer :: i
      clamps = problem%beside(side, node) == 0 .and. problem%model%fixed(3, node) .and. any(problem%model%fixed(1:2, node))
      do i = 1, size(problem%model%step)
         associate (load => problem%model%step(i)%load)
            clamps = clamps .and. .not. load%turns(node)
         end associate
      end do
   end function clamps

   !> True if the rod is straight and parallel to the straight obstacle of a contact span, and no load on the rod segment would bend
   !> it.
   pure logical function runs_along(problem, k) result(along)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k                    !! index of the contact span
      real(wp) :: d(2)
      integer :: e, i, first, last
      associate (contact_span => problem%contact_span(k), mesh => problem%model%mesh)
         first = problem%element_first(contact_span%rod_segment)
         last = problem%element_last(contact_span%rod_segment)
         associate (wall => problem%model%contact(contact_span%contact)%obstacle)
            along = problem%model%obstacle(wall)%kind == obstacle_line
            if (.not. along) return
            d = wall_direction(problem, wall)
         end associate
         do e = first, last
            associate (curve => problem%model%curve(mesh%curve(e)))
               along = along .and. is_straight(curve) .and. &
                  & abs(d(1) * sin(curve%angle) - d(2) * cos(curve%angle)) <= exactly_parallel
            end associate
         end do
         do i = 1, size(problem%model%step)
            associate (load => problem%model%step(i)%load)
               along = along .and. .not. load%bends(first, last)
            end associate
         end do
      end associate
   end function runs_along
end module rolling_rods
