!> Contact regions of distributed foundations, which act inside elements; pressures and reactions of these foundations at nodes.
module ground_regions
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp
   use problem, only: problem_t
   use candidates, only: candidates_t
   use rod_state, only: state_t, rounding_steps, pose_of, chain_gap
   use obstacle_pose, only: pose_t
   use obstacle_geometry, only: has_angle, contact_angle, turns_forward, unwrap_angle
   use force_law, only: foundation_reaction
   use rod_layout, only: segment_element
   use rod_profile, only: profile_place, profile_angle
   use ground_segments, only: gap_in_state, pressed_parts
   use element_gap, only: element_gap_t, gap_root_t, gap_value, gap_extreme, root_factor, is_at, most_parts, most_samples
   use reference_curve, only: curve_length
   use rod_load, only: inner_forces_t
   use path_record, only: region_t
   implicit none
   private
   public :: find_ground_regions, smallest_ground_gap, inner_opening, part_of_range, rounds, ground_pressure, ground_reaction, &
      & deck_ground_reaction, foundation_totals, regions_on_moved_nodes, &
      & chain_place

contains

   !> All contact regions of distributed foundations, contact by contact along the chains. (The chain of a contact is the sequence
   !> of its candidates along the rods.)
   function find_ground_regions(problem, state) result(regions)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(region_t), allocatable :: regions(:)
      type(region_t) :: region
      real(wp) :: part(2, most_parts), h
      integer :: c, e, i, n, first, next
      logical :: open_end
      logical :: forward(size(problem%model%contact)) ! (contacts) true: angles on the obstacle increase along the chain of the
      ! contact
      allocate (regions(0))
      forward = .true.
      associate (chain => problem%ground%chain)
         open_end = .false.
         first = 0
         do c = 1, chain%n
            e = chain%element(2, c)
            if (e == 0) then
               open_end = .false.
               cycle
            end if
            if (chain%neighbour(1, c) == 0) open_end = .false.
            ! The chain of a contact on a closed rod begins at the first candidate of the contact.
            if (c == 1) then
               first = 1
            else if (chain%contact(c) /= chain%contact(c - 1)) then
               first = size(regions) + 1
               open_end = .false.
            end if
            h = state%geometry%element(e)%length
            call pressed_parts(problem, state, c, n, part)
            if (n == 0) open_end = .false.
            do i = 1, n
               if (i == 1 .and. open_end .and. part(1, 1) <= 0.0_wp) then
                  call set_end(c, part(2, 1), regions(size(regions))%end, regions(size(regions))%angle_end)
               else
                  region%contact = chain%contact(c)
                  call set_end(c, part(1, i), region%start, region%angle_start)
                  call set_end(c, part(2, i), region%end, region%angle_end)
                  regions = [regions, region]
               end if
               open_end = part(2, i) >= 1.0_wp
            end do
            ! At the end of a closed chain the last region may continue as the first region.
            next = chain%neighbour(2, c)
            if (next >= 1 .and. next <= c .and. open_end .and. size(regions) >= first) then
               if (regions(first)%start <= chain_place(problem, state, chain, next)) then
                  if (size(regions) > first) then
                     regions(first)%start = regions(size(regions))%start
                     regions(first)%angle_start = regions(size(regions))%angle_start
                     regions(first)%end = regions(first)%end + chain%chain_length(chain%contact(c))
                     regions = regions(:size(regions) - 1)
                  else
                     regions(first)%end = regions(first)%start + chain%chain_length(chain%contact(c))
                     regions(first)%angle_end = regions(first)%angle_start
                  end if
               end if
               open_end = .false.
            end if
         end do
         ! Where contact ends at a support, a region of zero length may remain.
         regions = pack(regions, regions%end > regions%start)
         do i = 1, size(regions)
            associate (obstacle => problem%model%obstacle(problem%model%contact(regions(i)%contact)%obstacle))
               call unwrap_angle(obstacle, regions(i)%end - regions(i)%start, forward(regions(i)%contact), &
                  & regions(i)%angle_start, regions(i)%angle_end)
            end associate
         end do
      end associate

   contains

      !> Computes arc length and angle of a place tau (0 to 1) on the element after a candidate.
      subroutine set_end(candidate, tau, s, angle)
         integer, intent(in) :: candidate
         real(wp), intent(in) :: tau
         real(wp), intent(out) :: s, angle
         real(wp) :: x(2), theta
         type(element_gap_t) :: gap
         type(pose_t) :: pose
         s = chain_place(problem, state, problem%ground%chain, candidate) + tau * h
         angle = ieee_value(angle, ieee_quiet_nan)
         associate (obstacle => problem%ground%chain%obstacle(candidate))
            if (.not. has_angle(problem%model%obstacle(obstacle))) return
            gap = gap_in_state(problem, state, candidate)
            pose = pose_of(problem, state, obstacle)
            x = pose%own_place(profile_place(problem, gap%profile, tau))
            theta = profile_angle(problem, state, gap%profile, tau)
            angle = contact_angle(problem%model%obstacle(obstacle), x)
            forward(problem%ground%chain%contact(candidate)) = &
               & turns_forward(problem%model%obstacle(obstacle), x, pose%own_direction([cos(theta), sin(theta)]))
         end associate
      end subroutine set_end
   end function find_ground_regions

   !> Finds the smallest gap in a range of a contact's chain. Where supports keep the gap at zero (its roots), the gap is divided by
   !> a power of the distance from the root. The range may exceed the end of the chain.
   subroutine smallest_ground_gap(problem, state, contact, from, to, root, least, candidate, place, factor)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      real(wp), intent(in) :: from, to !! arc lengths of the range; on a closed chain `to` may lie behind the chain's end, in the
      !! next turn around the chain
      type(gap_root_t), intent(in) :: root(:) !! roots by which the gap is divided, see ground_events; size 0: none
      real(wp), intent(out) :: least
      integer, intent(out) :: candidate !! candidate before the element with the smallest gap; 0: the range is empty
      real(wp), intent(out) :: place    !! place of the smallest gap in this element, 0 to 1
      real(wp), intent(out) :: factor   !! factor by which the division multiplies the gap at this place; 0: the place is a root
      type(gap_root_t) :: there(size(root))
      real(wp) :: range(2), value, tau, h
      integer :: c, round
      least = huge(1.0_wp)
      candidate = 0
      place = 0.0_wp
      factor = 1.0_wp
      do round = 0, rounds(problem, contact)
         do c = 1, problem%ground%chain%n
            if (.not. part_of_range(problem, state, contact, c, round, from, to, range)) cycle
            h = state%geometry%element(problem%ground%chain%element(2, c))%length
            there = root
            there%at = (root%at - chain_place(problem, state, problem%ground%chain, c)) / h
            there%scale = root%scale / h
            call gap_extreme(problem, gap_in_state(problem, state, c), .false., range(1), range(2), value, tau, there)
            if (value >= least) cycle
            least = value
            candidate = c
            place = tau
            factor = merge(0.0_wp, root_factor(tau, there), any(is_at(there, tau)))
         end do
      end do
   end subroutine smallest_ground_gap

   !> Finds the largest local maximum of the gap in a range, with contact on both sides of the maximum. This gap is > 0 if the
   !> maximum divides the region of contact, < 0 if not. If there is no such maximum, the result is the least gap (minus the deepest
   !> penetration). The whole range is searched, because the maximum may move along the rod.
   subroutine inner_opening(problem, state, contact, from, to, opening, candidate, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      real(wp), intent(in) :: from, to
      real(wp), intent(out) :: opening
      integer, intent(out) :: candidate !! candidate before the element with the maximum; 0: the range is empty
      real(wp), intent(out) :: place
      type(element_gap_t) :: between
      real(wp), allocatable :: gap(:), peak(:), tau(:)
      integer, allocatable :: after(:)           ! (samples) candidate before each sample
      real(wp) :: range(2), at(0:most_samples), value(0:most_samples), rounding, bend
      integer :: c, i, n, round, first_contact, last_contact, found
      allocate (gap((most_samples + 1) * (1 + rounds(problem, contact)) * problem%ground%chain%n))
      allocate (peak(size(gap)), tau(size(gap)), after(size(gap)))
      rounding = rounding_steps * epsilon(rounding) * maxval(abs(state%u(1:2, :)))
      n = 0
      do round = 0, rounds(problem, contact)
         do c = 1, problem%ground%chain%n
            if (.not. part_of_range(problem, state, contact, c, round, from, to, range)) cycle
            between = gap_in_state(problem, state, c)
            associate (last => between%samples)
               do i = 0, last
                  at(i) = range(1) + (range(2) - range(1)) * i / last
                  value(i) = gap_value(problem, between, at(i))
               end do
               bend = maxval(abs(value(:last - 2) - 2.0_wp * value(1:last - 1) + value(2:last)))
               do i = merge(1, 0, n > 0), last
                  n = n + 1
                  gap(n) = value(i)
                  peak(n) = value(i)
                  tau(n) = at(i)
                  after(n) = c
                  if (i == 0) cycle
                  peak(n) = max(value(i - 1), value(i))
                  ! Between two samples the gap can have a maximum above rounding only if the samples differ by less than the
                  ! curvature of the gap allows.
                  if (bend > max(abs(value(i) - value(i - 1)), rounding)) &
                     & call gap_extreme(problem, between, .true., at(i - 1), at(i), peak(n), tau(n))
               end do
            end associate
         end do
      end do
      opening = -huge(1.0_wp)
      candidate = 0
      place = 0.0_wp
      if (n == 0) return
      opening = minval(gap(:n))
      found = 0
      ! A maximum that is within rounding of an end of contact does not count.
      first_contact = findloc(gap(:n) < -rounding, .true., 1)
      last_contact = findloc(gap(:n) < -rounding, .true., 1, back=.true.)
      do i = first_contact + 1, last_contact
         ! The maximum is inside the interval before sample i, or at sample i.
         if (peak(i) > max(gap(i - 1), gap(i)) + rounding) then
            if (peak(i) > opening) found = i
            opening = max(opening, peak(i))
         else if (i < last_contact) then
            if (.not. (gap(i) >= gap(i - 1) .and. gap(i) + rounding >= peak(i + 1))) cycle
            if (gap(i) > opening) found = i
            opening = max(opening, gap(i))
         end if
      end do
      if (found == 0) return
      candidate = after(found)
      place = tau(found)
   end subroutine inner_opening

   !> True if a part of the element after a candidate lies in the range `from` to `to` of the chain; `range` is this part.
   logical function part_of_range(problem, state, contact, candidate, round, from, to, range) result(lies)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact, candidate
      integer, intent(in) :: round               !! number of completed turns around a closed chain
      real(wp), intent(in) :: from, to           !! arc lengths of the ends of the range
      real(wp), intent(out) :: range(2)          !! part of the element that lies in the range, 0 to 1
      real(wp) :: s, h
      range = 0.0_wp
      associate (chain => problem%ground%chain)
         lies = chain%contact(candidate) == contact .and. chain%element(2, candidate) > 0
         if (.not. lies) return
         h = state%geometry%element(chain%element(2, candidate))%length
         s = chain_place(problem, state, chain, candidate) + round * chain%chain_length(contact)
         range = [max((from - s) / h, 0.0_wp), min((to - s) / h, 1.0_wp)]
         lies = range(2) > range(1)
      end associate
   end function part_of_range

   !> Arc length of a candidate along its chain, at the position of its node on the rod in `state`.
   pure real(wp) function chain_place(problem, state, list, candidate) result(s)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate
      integer :: e, side
      s = list%s(candidate)
      side = merge(1, 2, list%element(2, candidate) > 0)
      e = list%element(3 - side, candidate)
      if (e == 0) return
      associate (mesh => problem%model%mesh)
         if (mesh%curve(e) > 0) s = s + curve_length(problem%model%curve(mesh%curve(e)), problem%model%imperfection, &
            & mesh%s(side, e), state%geometry%element(e)%s(side))
      end associate
   end function chain_place

   !> Regions of one state, transferred to the node positions of another state on the same mesh: ends of regions that lie at nodes
   !> move with the nodes.
   function regions_on_moved_nodes(problem, from, to, regions) result(moved)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      type(region_t), intent(in) :: regions(:)   !! regions of `from`
      type(region_t) :: moved(size(regions))
      real(wp), allocatable :: place(:), way(:) !! positions of the nodes of a contact along the chain; displacements of the nodes
      !! along the chain
      integer :: c, k, n
      moved = regions
      if (.not. problem%moves_nodes() .or. size(regions) == 0) return
      allocate (place(problem%ground%chain%n), way(problem%ground%chain%n))
      do k = 1, size(regions)
         n = 0
         do c = 1, problem%ground%chain%n
            if (problem%ground%chain%contact(c) /= regions(k)%contact) cycle
            n = n + 1
            place(n) = problem%ground%chain%s(c)
            way(n) = 0.0_wp
            if (problem%ground%chain%element(2, c) == 0) cycle
            place(n) = chain_place(problem, from, problem%ground%chain, c)
            way(n) = chain_place(problem, to, problem%ground%chain, c) - place(n)
         end do
         moved(k)%start = regions(k)%start + way_at(regions(k)%start)
         moved(k)%end = regions(k)%end + way_at(regions(k)%end)
      end do

   contains

      !> Displacement along the chain at an arc length, interpolated between the nodes.
      real(wp) function way_at(s)
         real(wp), intent(in) :: s
         real(wp) :: at
         integer :: i
         at = s
         associate (round => problem%ground%chain%chain_length(regions(k)%contact))
            if (round > 0.0_wp) at = modulo(s, round)
         end associate
         way_at = 0.0_wp
         do i = 1, n - 1
            if (at < place(i) .or. at > place(i + 1) .or. .not. place(i + 1) > place(i)) cycle
            way_at = way(i) + (way(i + 1) - way(i)) * (at - place(i)) / (place(i + 1) - place(i))
            return
         end do
      end function way_at
   end function regions_on_moved_nodes

   !> Number of additional turns around a chain over which a range may extend: 1 for a closed chain, 0 for an open one.
   pure integer function rounds(problem, contact)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact
      rounds = merge(1, 0, problem%ground%chain%chain_length(contact) > 0.0_wp)
   end function rounds

   !> Computes the foundation's force per stress-free length, and the gap, at each node of the foundations' chains.
   subroutine ground_pressure(problem, state, pressure, gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: pressure(:), gap(:) !! (candidates of the foundations' chains) pressure > 0 in compression; gap
      real(wp) :: normal(2), bend
      integer :: c
      do c = 1, problem%ground%chain%n
         call chain_gap(problem, state, problem%ground%chain, c, gap(c), normal, bend)
         pressure(c) = pressure_at(problem, problem%ground%chain%contact(c), gap(c))
      end do
   end subroutine ground_pressure

   !> Computes the distributed reactions of foundations as forces at the nodes of their chains; a force at a point of an element is
   !> distributed linearly to the two nodes of the element.
   subroutine ground_reaction(problem, state, inner, reaction)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(inner_forces_t), intent(in) :: inner(:) !! (elements) forces of foundations at `state`
      real(wp), intent(out) :: reaction(:)       !! (candidates of the foundations' chains) reaction forces
      real(wp) :: share
      integer :: e, q, c
      reaction = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         do q = 1, inner(e)%n
            c = inner(e)%at(q)%source
            share = state%geometry%element(e)%length * inner(e)%at(q)%weight * inner(e)%at(q)%pressure
            reaction(c) = reaction(c) + (1.0_wp - inner(e)%at(q)%tau) * share
            c = problem%ground%chain%neighbour(2, c)
            reaction(c) = reaction(c) + inner(e)%at(q)%tau * share
         end do
      end do
   end subroutine ground_reaction

   !> Computes the distributed reaction of one contact as forces at the deck's nodes of this contact, and the force per stress-free
   !> length at these nodes, which need not be nodes of the mesh.
   subroutine deck_ground_reaction(problem, state, inner, contact, gap, reaction, density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(inner_forces_t), intent(in) :: inner(:) !! (elements) forces of foundations at `state`
      integer, intent(in) :: contact             !! index into model%contact of a contact with distributed reactions
      real(wp), intent(in) :: gap(:)             !! (nodes of the contact in the deck) gaps
      real(wp), intent(out) :: reaction(:), density(:) !! (nodes of the contact in the deck) reaction forces; forces per stress-free
      !! length
      integer :: row(problem%deck%mesh%n_nodes), e, q, i, k
      real(wp) :: at, share, part
      do i = 1, size(gap)
         density(i) = pressure_at(problem, contact, gap(i))
      end do
      row = 0
      row(problem%deck%contact(contact)%node) = [(i, i=1, size(gap))]
      reaction = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         associate (whole => problem%layout%rod_segment(problem%rod_segment(e)), s => state%geometry%element(e)%s)
            do q = 1, inner(e)%n
               if (problem%ground%chain%contact(inner(e)%at(q)%source) /= contact) cycle
               share = state%geometry%element(e)%length * inner(e)%at(q)%weight * inner(e)%at(q)%pressure
               at = s(1) + inner(e)%at(q)%tau * (s(2) - s(1)) + problem%origin(e)
               k = segment_element(whole, at)
               part = (at - whole%at(k)) / (whole%at(k + 1) - whole%at(k))
               do i = 0, 1
                  associate (there => row(problem%deck%mesh%node(1 + i, whole%element(k))))
                     if (there > 0) reaction(there) = reaction(there) + merge(part, 1.0_wp - part, i == 1) * share
                  end associate
               end do
            end do
         end associate
      end do
   end subroutine deck_ground_reaction

   !> Force per stress-free length of a contact's foundation at a given gap.
   pure real(wp) function pressure_at(problem, contact, gap) result(pressure)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact
      real(wp), intent(in) :: gap
      real(wp) :: slope
      pressure = 0.0_wp
      associate (obstacle => problem%model%obstacle(problem%model%contact(contact)%obstacle))
         if (gap >= 0.0_wp .and. .not. obstacle%bilateral) return
         call foundation_reaction(problem%model, obstacle, -gap, pressure, slope)
      end associate
   end function pressure_at

   !> For each obstacle, computes the resultant force (x, y) of its distributed foundations and the sum of their normal reactions.
   subroutine foundation_totals(problem, state, inner, total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(inner_forces_t), intent(in) :: inner(:) !! (elements) forces of foundations at `state`
      real(wp), intent(out) :: total(:, :)       !! (3, obstacles) force in x, force in y, sum of normal reactions
      integer :: e, q
      total = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         do q = 1, inner(e)%n
            associate (sum_here => total(:, problem%ground%chain%obstacle(inner(e)%at(q)%source)))
               sum_here = sum_here + state%geometry%element(e)%length * inner(e)%at(q)%weight * &
                  & [inner(e)%at(q)%force, inner(e)%at(q)%pressure]
            end associate
         end do
      end do
   end subroutine foundation_totals
end module ground_regions
