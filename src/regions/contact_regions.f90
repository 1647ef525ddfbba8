!> Contact regions of contact at nodes: connected lengths of contact and their ends. An end lies between nodes and is located to
!> within a small part of an element.
!>
!> A rod leaves a rigid obstacle smoothly: its curvature equals the obstacle's up to the lift-off point and changes about linearly
!> beyond it. The end of contact is the point at which the curvature of the open element beside it, extrapolated backwards, equals
!> that of the obstacle. This point may be on either side of the last node in contact. On a foundation the end is the zero of the
!> gap. On coupled ground the reaction of the last node shows which part of the length that belongs to this node is under pressure.
module contact_regions
   use kinds, only: wp
   use obstacle_types, only: obstacle_line, obstacle_circle, ground_half_space
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_position, pose_of, candidate_offset, element_load, rod_direction
   use rod_load, only: ge_load_t
   use obstacle_pose, only: pose_t
   use obstacle_geometry, only: obstacle_gap, contact_angle, turns_forward, unwrap_angle, contact_curvature
   use rod_equations, only: local_forces
   use rod_profile, only: new_profile
   use element_gap, only: element_gap_t, new_element_gap, gap_parts, most_parts
   use ground_regions, only: find_ground_regions, chain_place
   use path_record, only: region_t
   implicit none
   private
   public :: find_regions, resolved_contact, region_of

   real(wp), parameter :: unresolved = 8.0_wp !! number of elements: an open length shorter than this does not divide a region

contains

   !> All regions of contact at nodes, in the order of the candidates, followed by the regions of distributed foundations.
   function find_regions(problem, state) result(regions)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(region_t), allocatable :: regions(:)
      integer :: c
      logical, allocatable :: seen(:), touching(:)
      logical :: forward                       ! true: angles on the obstacle increase along the rod
      allocate (regions(0))
      forward = .true.
      touching = resolved_contact(problem, state)
      seen = .not. touching .or. problem%candidates%contact_span > 0
      do c = 1, problem%candidates%n
         if (seen(c)) cycle
         if (previous(c) > 0) cycle
         regions = [regions, follow(c)]
      end do
      ! All candidates that remain belong to closed chains that are in contact all round.
      do c = 1, problem%candidates%n
         if (.not. seen(c)) regions = [regions, follow(c)]
      end do
      regions = [regions, find_ground_regions(problem, state)]

   contains

      !> The candidate before the given one, if it is active; 0: none.
      integer function previous(candidate)
         integer, intent(in) :: candidate
         previous = problem%candidates%neighbour(1, candidate)
         if (previous == 0) return
         if (.not. touching(previous)) previous = 0
      end function previous

      !> Region that begins at a candidate.
      type(region_t) function follow(first) result(region)
         integer, intent(in) :: first
         integer :: last, next
         last = first
         seen(first) = .true.
         do
            next = problem%candidates%neighbour(2, last)
            if (next == 0) exit
            if (seen(next)) exit
            last = next
            seen(last) = .true.
         end do
         region%contact = problem%candidates%contact(first)
         if (first == last) then
            call set_end(first, 0, region%start, region%angle_start)
            region%end = region%start
            region%angle_end = region%angle_start
         else
            call set_end(first, 1, region%start, region%angle_start)
            call set_end(last, 2, region%end, region%angle_end)
            associate (closed => problem%candidates%chain_length(region%contact))
               if (region%end < region%start) region%end = region%end + closed
               if (problem%candidates%neighbour(2, last) == first) then
                  region%end = region%start + closed
                  region%angle_end = region%angle_start
               end if
            end associate
            associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(first)))
               call unwrap_angle(obstacle, region%end - region%start, forward, region%angle_start, region%angle_end)
            end associate
         end if
      end function follow

      !> Computes coordinate and angle of a region's end at a candidate; side 1: the region's end is before the candidate, 2: after
      !> it, 0: at its node.
      subroutine set_end(candidate, side, s, angle)
         integer, intent(in) :: candidate, side
         real(wp), intent(out) :: s, angle
         real(wp) :: beyond, direction, x(2), t(2), theta
         type(pose_t) :: pose
         integer :: e
         beyond = 0.0_wp
         direction = 0.0_wp
         if (side > 0) then
            direction = merge(-1.0_wp, 1.0_wp, side == 1)
            if (problem%candidates%neighbour(side, candidate) > 0) beyond = overhang(problem, state, candidate, side)
         end if
         s = chain_place(problem, state, problem%candidates, candidate) + direction * beyond
         associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(candidate)))
            e = problem%candidates%element(1, candidate)
            if (e > 0) then
               theta = rod_direction(problem, state, e, 2)
            else
               e = problem%candidates%element(2, candidate)
               theta = 0.0_wp
               if (e > 0) theta = rod_direction(problem, state, e, 1)
            end if
            pose = pose_of(problem, state, problem%candidates%obstacle(candidate))
            t = pose%own_direction([cos(theta), sin(theta)])
            x = candidate_position(problem, state, candidate) + direction * beyond * t
            angle = contact_angle(obstacle, x)
            forward = turns_forward(obstacle, x, t)
         end associate
      end subroutine set_end
   end function find_regions

   !> (candidates) true: in contact, within the resolution of the mesh.
   !>
   !> Reactions act at nodes only, so that the computed axis of a rod on a rigid obstacle is wavy. Some nodes therefore lift off by
   !> a gap far below the resolution of the mesh. An open length between two contacts counts as contact if it is not longer than
   !> eight of the elements around it.
   function resolved_contact(problem, state) result(touching)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, allocatable :: touching(:)
      integer :: c, k, e, steps
      real(wp) :: span, widest
      touching = state%active
      do c = 1, problem%candidates%n
         if (.not. state%active(c) .or. problem%candidates%contact_span(c) > 0) cycle
         if (.not. problem%model%obstacle(problem%candidates%obstacle(c))%rigid) cycle
         span = 0.0_wp
         widest = problem%candidates%tributary(c)
         k = c
         steps = 0
         do
            e = problem%candidates%element(2, k)
            if (e == 0) exit
            span = span + state%geometry%element(e)%length
            k = problem%candidates%neighbour(2, k)
            widest = max(widest, problem%candidates%tributary(k))
            steps = steps + 1
            if (state%active(k) .or. span > unresolved * widest) exit
         end do
         if (.not. state%active(k) .or. steps < 2 .or. k == c) cycle
         if (span > unresolved * widest) cycle
         k = problem%candidates%neighbour(2, c)
         do while (.not. state%active(k))
            touching(k) = .true.
            k = problem%candidates%neighbour(2, k)
         end do
      end do
   end function resolved_contact

   !> Distance along the rod from the last candidate in contact to the end of the contact, > 0 outwards.
   real(wp) function overhang(problem, state, candidate, side) result(beyond)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      if (problem%candidates%bilateral(candidate)) then
         ! A bilateral contact never opens. If the next node is not active, a support holds it there, and the contact extends to
         ! this node.
         beyond = state%geometry%element(problem%candidates%element(side, candidate))%length
      else if (problem%model%obstacle(problem%candidates%obstacle(candidate))%rigid) then
         beyond = rigid_overhang(problem, state, candidate, side)
      else if (problem%coupling%entry(candidate) > 0) then
         beyond = patch_overhang(problem, state, candidate, side)
      else
         beyond = winkler_overhang(problem, state, candidate, side)
      end if
   end function overhang

   !> The overhang on a rigid obstacle: the root of a parabola for the difference between the curvatures of rod and obstacle in the
   !> open element. The parabola has the differences at the two ends of this element, and the slope at the far end.
   real(wp) function rigid_overhang(problem, state, candidate, side) result(beyond)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      real(wp) :: local(3, 2), near, far, slope, h, direction, a, b, root, other
      type(ge_load_t) :: load
      integer :: e, inner, outer
      e = problem%candidates%element(side, candidate)
      load = element_load(problem, state, e)
      inner = merge(2, 1, side == 1)
      outer = 3 - inner
      direction = merge(-1.0_wp, 1.0_wp, side == 1)
      h = state%geometry%element(e)%length
      call local_forces(problem, state, e, local)
      near = misfit(inner, candidate)
      far = misfit(outer, problem%candidates%neighbour(side, candidate))
      slope = -direction * problem%compliance(e)%bending * local(2, outer) - obstacle_slope()
      ! misfit(d) = far + slope (d - h) + a (d - h)^2, with the distance d from the candidate, positive outwards.
      a = (near - far + slope * h) / h**2
      beyond = 0.0_wp
      root = slope**2 - 4.0_wp * a * far
      if (root < 0.0_wp) return
      b = slope + sign(sqrt(root), slope)
      if (.not. abs(b) > 0.0_wp) return
      beyond = h - 2.0_wp * far / b
      ! On a short free span the moment may have its maximum inside this element; the contact then ends at the other root.
      if (abs(a) > 0.0_wp) then
         other = h - 0.5_wp * b / a
         if (abs(other) < abs(beyond)) beyond = other
      end if
      beyond = min(max(beyond, -h), h)

   contains

      !> Curvature of the rod at end k of the element, minus curvature of a rod with the same extension ratio that lies on the
      !> obstacle.
      real(wp) function misfit(k, c)
         integer, intent(in) :: k, c
         real(wp) :: stretch
         stretch = 1.0_wp + load%strain + local(1, k) * problem%compliance(e)%axial
         associate (g => state%geometry%element(e))
            misfit = (g%end_angle(2) - g%end_angle(1)) / g%length + load%curvature
         end associate
         misfit = misfit + local(3, k) * problem%compliance(e)%bending - stretch * obstacle_curvature(k, c, 0.0_wp)
      end function misfit

      !> Curvature of a rod that lies on the obstacle, at the point of the obstacle nearest to a candidate that is moved along the
      !> rod.
      real(wp) function obstacle_curvature(k, c, moved) result(curvature)
         integer, intent(in) :: k, c      !! end of the element (1 or 2) and the candidate at this end
         real(wp), intent(in) :: moved
         real(wp) :: x(2), t(2), theta, gap, normal(2), bend
         type(pose_t) :: pose
         theta = rod_direction(problem, state, e, k)
         pose = pose_of(problem, state, problem%candidates%obstacle(c))
         t = pose%own_direction([cos(theta), sin(theta)])
         associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(c)))
            x = candidate_position(problem, state, c) + moved * t
            call obstacle_gap(obstacle, x, gap, normal, bend)
            curvature = contact_curvature(obstacle, x - (gap + candidate_offset(problem, state, problem%candidates, c)) * normal, t)
         end associate
      end function obstacle_curvature

      !> Derivative of the obstacle's curvature along the rod at the far end of the open element, positive outwards.
      real(wp) function obstacle_slope() result(change)
         real(wp), parameter :: part = 1.0e-4_wp
         integer :: c
         c = problem%candidates%neighbour(side, candidate)
         change = 0.0_wp
         if (any(problem%model%obstacle(problem%candidates%obstacle(c))%kind == [obstacle_line, obstacle_circle])) return
         change = direction * (obstacle_curvature(outer, c, part * h) - obstacle_curvature(outer, c, -part * h)) &
            & / (2.0_wp * part * h)
      end function obstacle_slope
   end function rigid_overhang

   !> The overhang on a Winkler foundation (each point acts for itself): distance to the place in the open element at which the gap
   !> changes its sign.
   real(wp) function winkler_overhang(problem, state, candidate, side) result(beyond)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      type(element_gap_t) :: gap
      real(wp) :: part(2, most_parts)
      integer :: first, n
      first = candidate
      if (side == 1) first = problem%candidates%neighbour(1, candidate)
      associate (e => problem%candidates%element(2, first))
         gap = new_element_gap(problem, state, problem%candidates, first, new_profile(problem, state, e))
      end associate
      call gap_parts(problem, gap, n, part)
      beyond = 0.0_wp
      if (n == 0) return
      if (side == 2 .and. part(1, 1) <= 0.0_wp) beyond = part(2, 1)
      if (side == 1 .and. part(2, n) >= 1.0_wp) beyond = 1.0_wp - part(1, n)
      beyond = beyond * state%geometry%element(problem%candidates%element(side, candidate))%length
   end function winkler_overhang

   !> The overhang on coupled ground. The pressure is extrapolated from the two nodes before the last one. The end of contact is
   !> where this pressure, summed over a part of the length that belongs to the last node, gives the reaction of this node. On a
   !> half-space the pressure decreases to zero with the square root of the distance from the end.
   real(wp) function patch_overhang(problem, state, candidate, side) result(beyond)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      real(wp) :: pressure, inner(2), half(2), distance(2), fall, filled
      integer :: c(2), e(2), k
      beyond = 0.0_wp
      inner = 0.0_wp
      do k = 1, 2
         c(k) = problem%candidates%neighbour(3 - side, merge(candidate, c(1), k == 1))
         if (c(k) == 0) exit
         if (.not. state%active(c(k))) exit
         e(k) = problem%candidates%element(3 - side, merge(candidate, c(1), k == 1))
         distance(k) = state%geometry%element(e(k))%length
         inner(k) = state%reaction(c(k)) / problem%candidates%tributary(c(k))
      end do
      if (.not. inner(1) > 0.0_wp) return
      half = 0.5_wp * [distance(1), state%geometry%element(problem%candidates%element(side, candidate))%length]
      pressure = inner(1)
      fall = 0.0_wp
      if (inner(2) > 0.0_wp) then
         pressure = inner(1) + (inner(1) - inner(2)) * distance(1) / distance(2)
         if (problem%model%obstacle(problem%candidates%obstacle(candidate))%ground == ground_half_space) &
            & fall = (inner(2)**2 - inner(1)**2) / distance(2)
      end if
      if (fall > 0.0_wp) then
         filled = (1.5_wp * state%reaction(candidate) / sqrt(fall))**(2.0_wp / 3.0_wp)
      else
         if (pressure <= 0.5_wp * inner(1)) pressure = inner(1) ! such a small extrapolated value is not used
         filled = state%reaction(candidate) / pressure
      end if
      beyond = min(max(filled, 0.0_wp), sum(half)) - half(1)
   end function patch_overhang

   !> (candidates) true: in contact, and in the same contact region as `candidate`.
   function region_of(problem, active, candidate) result(member)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:) !! (candidates) true: in contact
      integer, intent(in) :: candidate
      logical, allocatable :: member(:)
      integer :: side, c
      allocate (member(size(active)), source=.false.)
      if (.not. active(candidate)) return
      member(candidate) = .true.
      do side = 1, 2
         c = problem%candidates%neighbour(side, candidate)
         do while (c > 0)
            if (member(c) .or. .not. active(c)) exit
            member(c) = .true.
            c = problem%candidates%neighbour(side, c)
         end do
      end do
   end function region_of
end module contact_regions
