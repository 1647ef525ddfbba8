!> Next contact set by contact at many nodes, the last resort: used if no increment converges with the present contact spans and no
!> test gives the next set.
!>
!> Increments with contact at nodes begin with the present contact set (at_touches) and are not recorded. They continue until the
!> contact corresponds to points and lines that pass their tests (find_spans_ahead); the path then goes back to the first point with
!> this contact set (go_back). This point must be near (is_near); contacts lost and gained are determined by comparison
!> (tell_differences).
module contact_in_doubt
   use kinds, only: wp
   use model, only: method_load, method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: new_system
   use contact_spans, only: contact_span_t
   use span_problem, only: new_sampled_problem
   use span_candidates, only: present_contact_spans
   use nodes_to_spans, only: find_spans_ahead
   use next_spans, only: next_t
   use set_onset, only: go_back
   use state_transfer, only: carried, carried_field
   use path_control, only: control_t, is_arc_length, displacement_between, path_length
   use path_continuity, only: path_tangent_at
   use path_state, only: path_state_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: ask_nodes, tell_differences

   real(wp), parameter :: turning = 2.0_wp      !! largest rate of displacement, over the path's own rate, at a contact change;
   !! no input deck changes from 0.2 to 20

   !> Numbers of contacts lost, gained, divided and merged from one contact set to the next.
   type :: differences_t
      integer :: lost = 0, gained = 0, divided = 0, merged = 0
   end type differences_t

contains

   !> Finds the next set of contact spans by contact at nodes, and its equilibrium ahead of the present point, at the nearest point
   !> at which the set is valid.
   subroutine ask_nodes(problem, run, reach, next, found)
      type(problem_t), intent(in) :: problem       !! problem with the present contact spans
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: reach                !! size of the increment that failed
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      type(problem_t) :: nodes
      type(path_state_t) :: on
      type(state_t) :: here, ahead
      type(control_t) :: control
      type(increment_t) :: report
      character(:), allocatable :: why
      real(wp), allocatable :: onward(:, :)
      real(wp) :: first, apart
      nodes = new_sampled_problem(problem)
      here = carried(problem, run%last%state, nodes)
      here%active = at_touches(nodes, here, present_contact_spans(problem, run%last%state))
      onward = carried_field(problem, run%last%state, run%last%tangent%u, nodes, here)
      control%method = method_load
      on%last%system = new_system(nodes)
      on%last%state = here
      ! First the equilibrium with the present contact set, whose forces at nodes are still unknown.
      call correct(nodes, here, control, .true., on%last%state, on%last%system, report)
      apart = 0.0_wp
      if (report%converged) apart = path_length(nodes, here, on%last%state)
      if (report%converged) here = on%last%state
      on%last%state = here
      call correct(nodes, here, control, .false., on%last%state, on%last%system, report)
      found = report%converged
      if (.not. found) return
      on%last%tangent = path_tangent_at(nodes, on%last%system, onward, run%last%tangent%load)
      on%control%method = merge(method_cylindrical, run%control%method, is_arc_length(run%control%method))
      on%control%monitor = run%control%monitor
      on%control%increment = sign(reach, run%control%increment)
      call find_spans_ahead(problem, run, nodes, on, next, first, found, report, why)
      if (.not. found) return
      ahead = next%state
      call go_back(run%last%state%load_factor, next)
      found = is_near(problem, run, next, apart)
      if (.not. found) return
      here = next%state
      if (path_length(next%problem, here, ahead) <= 0.0_wp) here = carried(problem, run%last%state, next%problem)
      next%tangent = path_tangent_at(next%problem, next%system, displacement_between(next%problem, here, ahead), &
         & ahead%load_factor - here%load_factor)
      call tell_differences(problem, run, present_contact_spans(problem, run%last%state), nodes%layout%rod_segment%length / &
         & (nodes%element_last - nodes%element_first + 1), nodes%candidates%chain_length, next)
      ! The changes are between the present point and this one, and there may be other sets between.
      next%located = next%times == 0
   end subroutine ask_nodes

   !> Determines the contacts lost or gained by comparing the next set with the present one; they are reported at the next set's
   !> first point.
   subroutine tell_differences(problem, run, before, spacing, round, next)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(contact_span_t), intent(in) :: before(:) !! the present contact spans
      real(wp), intent(in) :: spacing(:)           !! (rod segments) distance within which a contact continues
      real(wp), intent(in) :: round(:)             !! (contacts) length of a closed chain, 0 for an open chain
      type(next_t), intent(inout) :: next          !! its contacts get their numbers
      type(differences_t) :: differences
      integer :: begun, ended
      call compare_sets(before, run%spans_begun, spacing, problem%chain_start, round, &
         & present_contact_spans(next%problem, next%state), next%problem%contact_span, differences)
      begun = differences%gained + differences%merged
      ended = differences%lost + differences%divided
      if (begun > 0) next%label = 'C+'
      if (ended > 0) next%label = 'C-'
      next%times = begun + ended
      next%divides = differences%divided > 0 .and. differences%lost == 0
   end subroutine tell_differences

   !> True if the next equilibrium is near enough to be on the same path: its distance agrees with the path's rate over the change
   !> of load, apart from the difference of the meshes.
   logical function is_near(problem, run, next, apart) result(near)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: next
      real(wp), intent(in) :: apart  !! path distance from the present point to the equilibrium with the same contact at nodes
      real(wp) :: rise, jump
      rise = next%state%load_factor - run%last%state%load_factor
      jump = path_length(next%problem, carried(problem, run%last%state, next%problem), next%state)
      near = (jump - max(apart, sqrt(epsilon(rise)) * problem%size)) * abs(run%last%tangent%load) <= turning * abs(rise)
   end function is_near

   !> (candidates) true: the node lies on a line contact, or next to a point contact.
   function at_touches(nodes, state, contact_span) result(active)
      type(problem_t), intent(in) :: nodes
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: contact_span(:)
      logical :: active(nodes%candidates%n)
      real(wp) :: at(2)
      integer :: c, side, e, k
      active = .false.
      do c = 1, nodes%candidates%n
         do side = 1, 2
            e = nodes%candidates%element(side, c)
            if (e == 0) cycle
            ! The half of the element next to the node belongs to the node.
            at = state%geometry%element(e)%s + nodes%origin(e)
            at(side) = 0.5_wp * sum(at)
            do k = 1, size(contact_span)
               if (contact_span(k)%rod_segment /= nodes%rod_segment(e) .or. contact_span(k)%contact /= &
                  & nodes%candidates%contact(c)) cycle
               active(c) = active(c) .or. (contact_span(k)%at(2) >= at(1) .and. contact_span(k)%at(1) <= at(2))
            end do
         end do
      end do
   end function at_touches

   !> Continuing contacts keep their numbers: contact spans of both sets that overlap, or are no farther apart than the spacing of
   !> the nodes that detected them. The others are new. Parts of a line contact on both sides of a segment boundary are one contact,
   !> and a contact that crosses a boundary continues.
   pure subroutine compare_sets(before, last, spacing, start, round, now, contact_span, differences)
      type(contact_span_t), intent(in) :: before(:)
      integer, intent(in) :: last                  !! last number given
      real(wp), intent(in) :: spacing(:)           !! (rod segments) distance of the nodes that detected the contact
      real(wp), intent(in) :: start(:, :)          !! (rod segments, contacts) coordinate of the segment's beginning along the chain
      real(wp), intent(in) :: round(:)             !! (contacts) length of a closed chain, 0 for an open chain
      type(contact_span_t), intent(in) :: now(:)
      type(contact_span_t), intent(inout) :: contact_span(:) !! contact spans of `now`, to receive the numbers
      type(differences_t), intent(out) :: differences
      logical :: over(size(before), size(now)), both(size(before), size(now))
      integer :: k, j, part(size(before)), part_now(size(now))
      do k = 1, size(now)
         over(:, k) = [(apart(before(j), now(k)) <= 0.0_wp, j=1, size(before))]
      end do
      do k = 1, size(now)
         if (any(over(:, k))) cycle
         do j = 1, size(before)
            if (any(over(j, :)) .or. apart(before(j), now(k)) > spacing(now(k)%rod_segment)) cycle
            over(j, k) = .true.
            exit
         end do
      end do
      do k = 1, size(now)
         contact_span(k)%number = last + k
         j = findloc(over(:, k) .and. before%rod_segment == now(k)%rod_segment, .true., 1)
         if (j == 0) j = findloc(over(:, k), .true., 1)
         ! If a contact has divided, its first part keeps the number.
         if (j > 0) then
            if (findloc(over(j, :) .and. (now%rod_segment == before(j)%rod_segment .or. .not. any(over(j, :) .and. &
               & now%rod_segment == &
               & before(j)%rod_segment)), .true., 1) == k) contact_span(k)%number = before(j)%number
         end if
      end do
      part = first_parts(before)
      part_now = first_parts(now)
      both = .false.
      do k = 1, size(now)
         do j = 1, size(before)
            if (over(j, k)) both(part(j), part_now(k)) = .true.
         end do
      end do
      associate (whole => part == [(j, j=1, size(part))], whole_now => part_now == [(k, k=1, size(part_now))])
         differences%lost = count(whole .and. .not. any(both, 2))
         differences%gained = count(whole_now .and. .not. any(both, 1))
         differences%divided = sum(max(count(both, 2) - 1, 0))
         differences%merged = sum(max(count(both, 1) - 1, 0))
      end associate

   contains

      !> Distance of two contact spans along the rod, < 0 if they overlap; huge for different contacts.
      pure real(wp) function apart(one, other)
         type(contact_span_t), intent(in) :: one, other
         real(wp) :: a(2), b(2)
         apart = huge(apart)
         if (one%contact /= other%contact) return
         a = one%at + start(one%rod_segment, one%contact)
         b = other%at + start(other%rod_segment, other%contact)
         apart = max(a(1) - b(2), b(1) - a(2))
         ! On a closed chain the distance in the other direction may be shorter.
         if (round(one%contact) > 0.0_wp) apart = min(apart, round(one%contact) + min(a(1) - b(2), b(1) - a(2)))
      end function apart
   end subroutine compare_sets

   !> For each contact span the first one of the same contact: parts of a line contact share the candidate at the segment boundary
   !> between them.
   pure function first_parts(set) result(first)
      type(contact_span_t), intent(in) :: set(:)
      integer :: first(size(set)), k, j
      first = [(k, k=1, size(set))]
      do k = 2, size(set)
         do j = 1, k - 1
            if (any(set(k)%candidate == set(j)%candidate([2, 1]))) where (first == first(k)) first = first(j)
         end do
      end do
   end function first_parts
end module contact_in_doubt
