!> Line contacts without pressure (force-free), as of a straight rod along a straight wall: equilibrium is the same with and without
!> such a contact.
!>
!> In the reduced problem each force-free line contact is replaced by two osculating point contacts (gap, slope and relative
!> curvature zero) at its ends. The rod between them is free. To first order the rod rotates at these point contacts as little as at
!> the ends of the line contact. If the tangent of the reduced problem has a zero eigenvalue, the rod may leave the wall. A rod of
!> length l between ends of fixed position and direction leaves the wall at the thrust 4 pi^2 EI/l^2. No test of the contact spans
!> detects this load, because gap and pressure are zero along the whole line contact.
module force_free_contact
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, pose_of, node_position
   use obstacle_geometry, only: obstacle_gap
   use obstacle_pose, only: pose_t
   use obstacle_track, only: track_t
   use contact_spans, only: contact_span_t
   use track_nodes, only: node_track
   use conforming_span, only: conforming_state_t, conforming_forces, density_samples, smooth_parts
   use span_problem, only: new_span_problem
   use span_candidates, only: present_contact_spans
   use touchdown_points, only: carry_forces
   use breakpoint_forces, only: breakpoint_force
   use past_breakpoints, only: beyond, end_node
   use state_transfer, only: carried
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   implicit none
   private
   public :: any_force_free, remove_force_free_lines, isolate_force_free_lines, count_opening, free_rotations, line_opening

   real(wp), parameter :: nothing = 1.0e-7_wp !! forces below this part of the force scale (the scale of forces in the structure)
   !! count as zero; with values from 1E-8 to 1E-6 every deck in input has the same results
   real(wp), parameter :: unsettled = 100.0_wp !! assumed error of the thrust over the tolerance of the residual; with values from
   !! 10 to 1000 every deck in input has the same results

contains

   !> Makes the reduced problem and its state: each force-free line contact is replaced by two osculating point contacts at its
   !> ends; all other contact spans are unchanged.
   subroutine remove_force_free_lines(problem, state, system, free, released, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      type(problem_t), intent(inout) :: free !! out: the reduced problem. (The argument is not intent(out), because to clear it at
      !! each call would cost more than the test for force-free contacts)
      type(state_t), intent(inout) :: released  !! out: `state` transferred to the mesh of `free`
      logical, intent(out) :: any_weak          !! false: no line contact is force-free, and `free` and `released` are unchanged
      type(contact_span_t), allocatable :: contact_span(:), rest(:)
      logical :: weak(size(problem%contact_span))
      integer :: k, side, n
      any_weak = .false.
      if (.not. problem%has_spans()) return
      weak = force_free(problem, state, system)
      any_weak = any(weak)
      if (.not. any_weak) return
      contact_span = present_contact_spans(problem, state)
      rest = pack(contact_span, .not. weak)
      n = maxval(contact_span%number)
      do k = 1, size(weak)
         if (.not. weak(k)) cycle
         do side = 1, 2
            if (needs_no_point(problem, contact_span, k, side) .and. .not. (side == 2 .and. pressed_end(k))) cycle
            rest = [rest, contact_span(k)]
            associate (point => rest(size(rest)))
               point%line = .false.
               point%at = contact_span(k)%at(side)
               if (side == 2) then
                  n = n + 1
                  point%number = n
               end if
            end associate
         end do
      end do
      free = new_span_problem(problem, rest)
      ! Node numbers of clamps (`hinge`, `rolling`) are copied, because segment boundaries have the same node numbers on all meshes.
      free%hinge = problem%hinge
      free%rolling = problem%rolling
      free%model%fixed(3, free%hinge) = .false.
      released = carried(problem, state, free)
      call carry_forces(problem, state, free, released)
      do k = 1, free%candidates%n
         if (free%candidates%contact_span(k) == 0) cycle
         ! The pieces of a line contact on several rod segments have one number, and some of them may carry pressure.
         associate (one => free%contact_span(free%candidates%contact_span(k)))
            if (.not. one%line .and. (any(weak .and. contact_span%number == one%number) .or. &
               & one%number > maxval(contact_span%number))) free%candidates%follows(k) = .true.
         end associate
      end do

   contains

      !> True if a contact force acts on the node at the last end of line contact `k`, which the next line contact shares.
      logical function pressed_end(k)
         integer, intent(in) :: k
         integer :: c
         c = problem%contact_span(k)%candidate(2)
         pressed_end = .not. problem%candidates%moves(c)
         if (pressed_end) pressed_end = breakpoint_force(problem, state, c) > no_force(system)
      end function pressed_end
   end subroutine remove_force_free_lines

   !> True if any line contact has no pressure.
   logical function any_force_free(problem, state, system) result(weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      weak = problem%has_spans()
      if (weak) weak = any(force_free(problem, state, system))
   end function any_force_free

   !> (contact spans) true for line contacts without pressure.
   function force_free(problem, state, system) result(weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      logical :: weak(size(problem%contact_span))
      integer :: k
      weak = [(problem%contact_span(k)%line, k=1, size(weak))]
      do k = 1, size(weak)
         if (weak(k)) weak(k) = .not. is_pressed(problem, state, k, unsettled * problem%model%step(problem%step)%tolerance * &
            & system%force_scale, no_force(system) / problem%size)
      end do
   end function force_free

   !> Force below which the force of a contact counts as zero.
   pure real(wp) function no_force(system)
      type(system_t), intent(in) :: system
      no_force = nothing * max(system%force_scale, tiny(no_force))
   end function no_force

   !> Makes the reduced problem as remove_force_free_lines does, and fixes all nodes except those of the rods between the ends of
   !> the former force-free line contacts. To first order the rest of the structure does not move with these rods, because their
   !> ends keep position and direction. The negative eigenvalues of this problem belong to directions that open force-free contacts.
   !> They are counted in addition to the negative eigenvalues of the structure with all its contacts.
   subroutine isolate_force_free_lines(problem, state, system, free, released, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      type(problem_t), intent(inout) :: free
      type(state_t), intent(inout) :: released  !! out: `state` transferred to the mesh of `free`
      logical, intent(out) :: any_weak          !! false: no line contact is force-free, and `free` and `released` are unchanged
      type(contact_span_t), allocatable :: contact_span(:)
      logical, allocatable :: moves(:)          ! (nodes of `free`) true: the node may move
      integer :: k, e
      real(wp) :: at
      call remove_force_free_lines(problem, state, system, free, released, any_weak)
      if (.not. any_weak) return
      contact_span = pack(present_contact_spans(problem, state), force_free(problem, state, system))
      allocate (moves(free%model%mesh%n_nodes), source=.false.)
      do k = 1, size(contact_span)
         do e = free%element_first(contact_span(k)%rod_segment), free%element_last(contact_span(k)%rod_segment)
            at = 0.5_wp * sum(released%geometry%element(e)%s) + free%origin(e)
            if (at > contact_span(k)%at(1) .and. at < contact_span(k)%at(2)) moves(free%model%mesh%node(:, e)) = .true.
         end do
      end do
      moves(pack(free%candidates%node, free%candidates%contact_span > 0 .and. free%candidates%follows)) = .false.
      free%model%fixed = free%model%fixed .or. spread(.not. moves, 1, 3)
      free%hinge = [integer ::]
   end subroutine isolate_force_free_lines

   !> Counts the unstable directions that open force-free contacts.
   subroutine count_opening(problem, state, system, opening, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled and factored at `state`
      integer, intent(out) :: opening !! number of unstable directions that open force-free contacts; 0 if the reduced system is
      !! singular
      logical, intent(out) :: any_weak          !! true: a line contact is force-free
      opening = 0
      any_weak = any_force_free(problem, state, system)
      if (any_weak) call count_isolated(problem, state, system, opening)
   end subroutine count_opening

   !> Counts the negative pivots of the rods that lie on force-free line contacts, with these contacts released and all other nodes
   !> fixed. This is a separate procedure, so that the reduced problem takes memory only when it is needed.
   subroutine count_isolated(problem, state, system, pivots)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(inout) :: pivots          !! unchanged if the reduced system is singular
      type(problem_t) :: free
      type(state_t) :: released
      type(system_t) :: other
      logical :: any_weak
      call isolate_force_free_lines(problem, state, system, free, released, any_weak)
      if (.not. any_weak) return
      other = new_system(free)
      call linearise(free, released, released, other)
      if (other%ok) pivots = other%negative_pivots
   end subroutine count_isolated

   !> Prepares the reduced problem for a path that leaves the wall: at the osculating contacts the rod becomes free to rotate, as at
   !> ordinary point contacts.
   pure subroutine free_rotations(free)
      type(problem_t), intent(inout) :: free
      integer :: c
      do c = 1, free%candidates%n
         if (free%candidates%contact_span(c) > 0) free%candidates%follows(c) = &
            & free%contact_span(free%candidates%contact_span(c))%line
      end do
   end subroutine free_rotations

   !> True if the reduced problem needs no point contact at one end of a line contact: the rod ends there, or another line contact
   !> continues this one.
   pure logical function needs_no_point(problem, contact_span, k, side)
      type(problem_t), intent(in) :: problem
      type(contact_span_t), intent(in) :: contact_span(:) !! contact spans before the reduction
      integer, intent(in) :: k, side
      integer :: next, way
      real(wp) :: end
      way = merge(-1, 1, side == 1)
      end = merge(0.0_wp, problem%layout%rod_segment(contact_span(k)%rod_segment)%length, side == 1)
      needs_no_point = .false.
      if (abs(contact_span(k)%at(side) - end) > 0.0_wp) return
      needs_no_point = problem%beside(side, end_node(problem, k, way)) == 0
      next = beyond(problem, k, way)
      if (next == 0) return
      end = merge(problem%layout%rod_segment(next)%length, 0.0_wp, side == 1)
      needs_no_point = any(contact_span%line .and. contact_span%rod_segment == next .and. &
         & contact_span%contact == contact_span(k)%contact .and. abs(contact_span%at(3 - side) - end) <= 0.0_wp)
   end function needs_no_point

   !> True if the magnitude of the obstacle's force density along a line contact exceeds `bound` anywhere, by more than its error.
   !> The error of the density is the error of the thrust times the curvature of the track (the curve on which the rod's axis lies
   !> in contact). On a straight obstacle this error is zero, because the density follows from loads and shape alone.
   logical function is_pressed(problem, state, contact_span, thrust_error, bound)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact_span       !! index into problem%contact_span
      real(wp), intent(in) :: thrust_error, bound
      real(wp) :: local(3), density, noise
      type(conforming_state_t) :: kept
      integer :: e, i, parts
      is_pressed = .true.
      do e = problem%contact_span(contact_span)%element(1), problem%contact_span(contact_span)%element(2)
         noise = thrust_error * max(bend(problem%conforms(e)), bend(problem%candidates%neighbour(2, problem%conforms(e))))
         parts = density_samples * smooth_parts(problem, state, e, 1.0_wp)
         do i = 0, parts
            call conforming_forces(problem, state, e, real(i, wp) / parts, local, density=density, kept=kept)
            if (abs(density) - noise > bound) return
         end do
      end do
      is_pressed = .false.

   contains

      !> Magnitude of the curvature of the track at a candidate.
      real(wp) function bend(candidate)
         integer, intent(in) :: candidate
         type(track_t) :: track
         track = node_track(problem, state, candidate)
         bend = abs(track%curvature)
      end function bend
   end function is_pressed

   !> Direction of a mode of the reduced problem in which the rod lifts off the former force-free line contacts: 1 along the mode,
   !> -1 against it; 0 if the mode opens the gap at some points and closes it at others.
   integer function line_opening(problem, state, free, released, mode) result(sense)
      type(problem_t), intent(in) :: problem, free
      type(state_t), intent(in) :: state, released
      real(wp), intent(in) :: mode(:, :)        !! (3, nodes of `free`) the mode, global axes
      real(wp), parameter :: closed = 1.0e-3_wp ! motion below this part of the largest counts as zero; with values from
      ! 1E-4 to 0.01 every deck in input has the same results
      type(contact_span_t), allocatable :: contact_span(:)
      real(wp) :: gap, normal(2), bend, opening, most, least, at
      type(pose_t) :: pose
      integer :: k, e, node, obstacle
      contact_span = present_contact_spans(problem, state)
      most = 0.0_wp
      least = 0.0_wp
      do k = 1, size(contact_span)
         if (.not. contact_span(k)%line) cycle
         obstacle = problem%model%contact(contact_span(k)%contact)%obstacle
         pose = pose_of(problem, state, obstacle)
         do e = free%element_first(contact_span(k)%rod_segment), free%element_last(contact_span(k)%rod_segment)
            if (free%conforms(e) > 0) cycle
            at = released%geometry%element(e)%s(1) + free%origin(e)
            if (at <= contact_span(k)%at(1) .or. at >= contact_span(k)%at(2)) cycle
            node = free%model%mesh%node(1, e)
            call obstacle_gap(problem%model%obstacle(obstacle), pose%own_place(node_position(released, node)), gap, normal, bend)
            opening = dot_product(pose%direction(normal), mode(1:2, node))
            most = max(most, opening)
            least = min(least, opening)
         end do
      end do
      sense = 0
      if (-least <= closed * most .and. most > 0.0_wp) sense = 1
      if (most <= -closed * least .and. least < 0.0_wp) sense = -1
   end function line_opening
end module force_free_contact
