!> Finds the next contact set by contact at nodes. This is the last resort: it is used if no increment converges with the present
!> contact spans and trials of other sets find no valid one.
!>
!> Increments with contact at nodes begin with the present contact set (active_nodes) and are not recorded. Increments are made
!> until the contact at nodes corresponds to point and line contacts that pass their tests (find_spans_ahead). The path then goes
!> back to the first point at which this contact set is valid (go_back). There the rod must have moved as far as the path moves with
!> the load (moves_at_path_rate). The contacts lost and gained are found by comparison of the two sets (label_and_number).
module set_at_nodes
   use kinds, only: wp
   use model, only: method_load, method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap, may_react
   use linear_system, only: new_system
   use contact_spans, only: contact_span_t
   use span_problem, only: new_sampled_problem
   use span_candidates, only: present_contact_spans
   use nodes_to_spans, only: find_spans_ahead
   use other_set, only: other_set_t
   use set_onset, only: go_back
   use set_differences, only: label_and_number
   use state_transfer, only: carried, carried_field
   use path_control, only: control_t, is_arc_length, displacement_between, path_length
   use path_continuity, only: path_tangent_at
   use path_state, only: path_state_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: find_set_at_nodes

   real(wp), parameter :: most_steeper = 2.0_wp !! largest rate of displacement up to the next set's equilibrium, over the rate of
   !! the path at the present point; with values from 0.2 to 20 every deck in input has the same results

contains

   !> Finds the next set of contact spans by contact at nodes, and its equilibrium at the nearest point ahead of the present one at
   !> which the set is valid.
   subroutine find_set_at_nodes(problem, run, reach, next, found)
      type(problem_t), intent(in) :: problem       !! problem with the present contact spans
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: reach                !! size of the increment that failed, in the units of the controlled quantity
      type(other_set_t), intent(out) :: next
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
      here%active = active_nodes(nodes, here, present_contact_spans(problem, run%last%state))
      onward = carried_field(problem, run%last%state, run%last%tangent%u, nodes, here)
      control%method = method_load
      on%last%system = new_system(nodes)
      on%last%state = here
      ! The first increment finds the equilibrium with the present contact set at nodes, whose forces are not known yet.
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
      found = moves_at_path_rate(problem, run, next, apart)
      if (.not. found) return
      here = next%state
      if (path_length(next%problem, here, ahead) <= 0.0_wp) here = carried(problem, run%last%state, next%problem)
      next%tangent = path_tangent_at(next%problem, next%system, displacement_between(next%problem, here, ahead), &
         & ahead%load_factor - here%load_factor)
      ! The numbers given to contacts found at nodes are no identities; each contact gets the number of the present contact that it
      ! continues, or a new number.
      call label_and_number(problem, run%last%state, 1.0_wp / minval(nodes%element_last - nodes%element_first + 1), &
         & run%spans_begun, next)
   end subroutine find_set_at_nodes

   !> True if the next equilibrium can be on the same path: its distance from the present point is at most twice the distance that
   !> the present rate of the path gives for the change of load. The difference between the meshes is allowed in addition.
   logical function moves_at_path_rate(problem, run, next, apart) result(near)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(other_set_t), intent(in) :: next
      real(wp), intent(in) :: apart !! path distance between the present point and the equilibrium with the same contact set at
      !! nodes
      real(wp) :: rise, jump
      rise = next%state%load_factor - run%last%state%load_factor
      jump = path_length(next%problem, carried(problem, run%last%state, next%problem), next%state)
      near = (jump - max(apart, sqrt(epsilon(rise)) * problem%size)) * abs(run%last%tangent%load) <= most_steeper * abs(rise)
   end function moves_at_path_rate

   !> (candidates) true: the node lies on a line contact, or next to a point contact, and supports let the obstacle push this node.
   function active_nodes(nodes, state, contact_span) result(active)
      type(problem_t), intent(in) :: nodes
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: contact_span(:)
      logical :: active(nodes%candidates%n)
      real(wp) :: at(2), gap, normal(2), bend
      integer :: c, side, e, k
      active = .false.
      do c = 1, nodes%candidates%n
         do side = 1, 2
            e = nodes%candidates%element(side, c)
            if (e == 0) cycle
            ! The half of the element next to a node is assigned to this node.
            at = state%geometry%element(e)%s + nodes%origin(e)
            at(side) = 0.5_wp * sum(at)
            do k = 1, size(contact_span)
               if (contact_span(k)%rod_segment /= nodes%rod_segment(e) .or. contact_span(k)%contact /= &
                  & nodes%candidates%contact(c)) cycle
               active(c) = active(c) .or. (contact_span(k)%at(2) >= at(1) .and. contact_span(k)%at(1) <= at(2))
            end do
         end do
         if (.not. active(c)) cycle
         call candidate_gap(nodes, state, c, gap, normal, bend)
         active(c) = may_react(nodes, c, normal)
      end do
   end function active_nodes
end module set_at_nodes
