!> Independent checks of contact at a point: positions, signs of reactions, complementarity, laws of foundations. The same
!> procedures add the contact forces to the sums for the checks of balance.
module contact_checks
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, node_position, candidate_gap, candidate_opening
   use contact_set, only: gap_tolerance, sign_slack
   use contact_spans, only: initial_share
   use force_law, only: foundation_reaction
   use span_forces, only: span_totals
   use track_nodes, only: rolled_t, rolled
   use conforming_span, only: conforming_state_t, conforming_forces, density_samples, smooth_parts
   use deck_nodes, only: deck_gaps, deck_displacements, find_node
   use rod_profile, only: profile_t, new_profile, mend_ends, profile_error_bound
   use path_record, only: accuracy_t, place_t, note_worst, check_penetration, check_tension, check_complementarity, &
      & check_foundation
   implicit none
   private
   public :: span_sums_t, sum_spans, measure_spans, measure_contact

   real(wp), parameter :: line_slack = 1.0e-5_wp !! accepted tension of densities times the structure's size, over the largest
   !! force. It is larger than for forces, because densities are derivatives of the solution
   real(wp), parameter :: least_reaction = 1.0e-6_wp !! smallest reference value for tension: tension is divided by the largest
   !! reaction, or by this part of the largest force if that is larger

   !> Forces of the contact spans of a state, and the displacements from which gaps are measured.
   type :: span_sums_t
      real(wp) :: middle(2) = 0.0_wp             !! middle of the structure, the reference point of the moments
      real(wp), allocatable :: force(:, :, :)    !! (3, contacts, obstacles) force in x, force in y, sum of normal forces
      real(wp), allocatable :: moment(:)         !! (obstacles) moment, > 0 anticlockwise
      real(wp), allocatable :: push(:) !! (candidates) concentrated forces, see span_totals; not allocated: there are no contact
      !! spans
      real(wp), allocatable :: u(:, :) !! (3, deck's nodes) from deck_displacements; not allocated: there are no contact spans
      real(wp), allocatable :: gap(:), place(:, :) !! gaps at the deck's contact nodes and places, both from deck_gaps; not
      !! allocated: there are no contact spans
   end type span_sums_t

contains

   !> Sums the forces of the contact spans, and finds the displacements and gaps of the deck's nodes. Without contact spans the
   !> forces are zero.
   function sum_spans(problem, state) result(spans)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_sums_t) :: spans
      integer :: c
      spans%middle = 0.5_wp * (maxval(state%geometry%x, 2) + minval(state%geometry%x, 2))
      allocate (spans%force(3, size(problem%model%contact), size(problem%model%obstacle)), source=0.0_wp)
      allocate (spans%moment(size(problem%model%obstacle)), source=0.0_wp)
      if (.not. problem%has_spans()) return
      allocate (spans%push(problem%candidates%n))
      call span_totals(problem, state, spans%middle, spans%force, spans%moment, spans%push)
      spans%u = deck_displacements(problem, state, [(c, c=1, problem%deck%mesh%n_nodes)])
      call deck_gaps(problem, state, spans%u, spans%gap, spans%place)
   end function sum_spans

   !> Checks positions and signs of contact spans, and adds their forces to the balances.
   subroutine measure_spans(problem, state, spans, at, scale, accuracy, total, left, touches_in)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_sums_t), intent(in) :: spans     !! forces of the contact spans
      type(place_t), intent(in) :: at
      real(wp), intent(in) :: scale              !! largest force so far
      type(accuracy_t), intent(inout) :: accuracy
      real(wp), intent(inout) :: total(3)        !! total force (x, y) and moment about the middle
      real(wp), intent(inout) :: left(:, :)      !! (3, nodes) unbalanced forces and moments
      integer, intent(in), optional :: touches_in !! element in which a contact span begins at this point; 0: none
      real(wp) :: gap, normal(2), bend, local(3), x(2), angle, density, tau, counted(2)
      type(rolled_t) :: roll
      type(conforming_state_t) :: kept
      type(profile_t) :: profile
      integer :: c, e, i, parts, mesh_node, row
      total = total + [sum(spans%force(1, :, :)), sum(spans%force(2, :, :)), sum(spans%moment)]
      accuracy%reaction = max(accuracy%reaction, maxval(abs(sum(spans%force(3, :, :), 2))))
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         call candidate_gap(problem, state, c, gap, normal, bend)
         roll = rolled(problem, state, c)
         if (abs(roll%way) > 0.0_wp) normal = roll%normal
         associate (node => problem%candidates%node(c), push => spans%push(c))
            left(:, node) = left(:, node) - push * [normal, roll%arm(1) * normal(2) - roll%arm(2) * normal(1)]
            ! If a support of the node carries a part of the force, this part is contained in the support reaction.
            counted = merge(push * normal, 0.0_wp, problem%model%fixed(1:2, node))
            x = node_position(state, node) + roll%arm - spans%middle
            total = total - [counted, x(1) * counted(2) - x(2) * counted(1)]
            call note_worst(accuracy, check_penetration, abs(gap - roll%rise) / problem%size, at, &
               & node=problem%model%mesh%node_label(node))
            call note_worst(accuracy, check_tension, (-push - least_push(problem, state, c) - sign_slack * scale) / &
               & max(accuracy%reaction, least_reaction * scale), at, node=problem%model%mesh%node_label(node))
         end associate
      end do
      ! Signs of the densities along line contacts are checked first; then penetration at the deck's nodes, which need not be nodes
      ! of the mesh.
      do e = 1, problem%model%mesh%n_elements
         if (problem%conforms(e) == 0) cycle
         parts = density_samples * smooth_parts(problem, state, e, 1.0_wp)
         do i = 0, parts
            tau = real(i, wp) / parts
            call conforming_forces(problem, state, e, tau, local, x, angle, density, kept=kept)
            call note_worst(accuracy, check_tension, (-density * problem%size - line_slack * scale) / max(accuracy%reaction, &
               & least_reaction * scale), at, element=problem%model%mesh%element_label(e))
         end do
      end do
      row = 0
      do c = 1, size(problem%deck%contact)
         associate (node => problem%deck%contact(c)%node)
            do i = 1, size(node)
               row = row + 1
               if (.not. problem%deck%contact(c)%spans) cycle
               gap = spans%gap(row)
               if (-gap / problem%size <= accuracy%worst(check_penetration)%value) cycle
               call find_node(problem, state, node(i), mesh_node, e, tau)
               ! Where a contact span begins, the gap of its node on the mesh with this contact is used. That gap is more accurate
               ! than the gap from the polynomial of this mesh.
               if (begins_at(e, mesh_node)) cycle
               if (e > 0 .and. gap < 0.0_wp) gap = gap + place_error(problem, state, e, tau, profile)
               call note_worst(accuracy, check_penetration, -gap / problem%size, at, node=problem%deck%mesh%node_label(node(i)))
            end do
         end associate
      end do

   contains

      !> True if a contact span begins at this point of the path, in the element or in an element at the mesh node.
      pure logical function begins_at(element, mesh_node)
         integer, intent(in) :: element, mesh_node !! of a node of the deck, see find_node
         begins_at = present(touches_in)
         if (begins_at) begins_at = touches_in > 0
         if (begins_at) begins_at = element == touches_in .or. any(problem%model%mesh%node(:, touches_in) == mesh_node)
      end function begins_at
   end subroutine measure_spans

   !> Accepted tension [force, > 0] at a line contact's node on a support that fixes the rotation (a symmetry plane). A tension T
   !> lifts the rod over the length 3/2 T/r, with the pressure r (lifted_node). T is accepted if this length is below the shortest
   !> length of a line contact.
   real(wp) function least_push(problem, state, c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      real(wp) :: density, local(3), x(2), angle
      integer :: side, e
      least_push = 0.0_wp
      if (.not. problem%model%fixed(3, problem%candidates%node(c))) return
      do side = 1, 2
         e = problem%candidates%element(side, c)
         if (e == 0) cycle
         if (problem%conforms(e) == 0) cycle
         call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local, x, angle, density)
         least_push = least_push + 2.0_wp / 3.0_wp * max(density, 0.0_wp) * initial_share * &
            & problem%layout%rod_segment(problem%rod_segment(e))%length
      end do
   end function least_push

   !> Bound of the interpolation error of a position between nodes; a penetration counts only as far as it exceeds this bound.
   real(wp) function place_error(problem, state, e, tau, profile) result(error)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      type(profile_t), intent(inout) :: profile !! rod profile of the element of the last call, corrected at its ends (mend_ends);
      !! it is made anew for another element
      if (profile%element /= e) then
         profile = new_profile(problem, state, e)
         if (problem%conforms(e) == 0) call mend_ends(problem, state, profile, 2)
      end if
      error = profile_error_bound(profile, tau)
   end function place_error

   !> Checks signs, complementarity and laws of contact at nodes, and adds the forces of this contact to the balances.
   subroutine measure_contact(problem, state, at, scale, middle, accuracy, total, left)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(place_t), intent(in) :: at
      real(wp), intent(in) :: scale              !! largest force so far
      real(wp), intent(in) :: middle(2)          !! reference point of the moments
      type(accuracy_t), intent(inout) :: accuracy
      real(wp), intent(inout) :: total(3)        !! total force (x, y) and moment
      real(wp), intent(inout) :: left(:, :)      !! (3, nodes) unbalanced forces and moments
      real(wp), parameter :: let_in = 10.0_wp * gap_tolerance ! accepted penetration of an open node, over the structure's size
      real(wp) :: x(2), force(2), gap, normal(2), bend, largest, push, spring, depth, unsettled, uncertain
      integer :: c, i, node, label
      logical :: rigid, coupled
      if (problem%candidates%n == 0) return
      accuracy%reaction = max(accuracy%reaction, maxval(abs(state%reaction)))
      ! The sign of a reaction within rounding means nothing, so that tension is related to a reaction above rounding.
      largest = max(accuracy%reaction, least_reaction * scale)
      unsettled = max(sign_slack, 10.0_wp * problem%model%step(problem%step)%tolerance) * scale
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) > 0) cycle
         node = problem%candidates%node(c)
         label = problem%model%mesh%node_label(node)
         rigid = problem%model%obstacle(problem%candidates%obstacle(c))%rigid
         coupled = problem%coupling%entry(c) > 0
         call candidate_gap(problem, state, c, gap, normal, bend)
         x = node_position(state, node) - middle
         force = state%reaction(c) * normal
         left(1:2, node) = left(1:2, node) - force
         ! If a support of the node carries a component of the force, the support reaction contains this component.
         do i = 1, 2
            if (problem%model%fixed(i, node)) force(i) = 0.0_wp
         end do
         total = total + [force, x(1) * force(2) - x(2) * force(1)]
         if (coupled) gap = candidate_opening(problem, state, c)
         if (rigid .or. coupled) then
            ! At a bilateral obstacle, or on the settled surface of coupled ground, a gap of either sign is an error.
            depth = -gap
            if (problem%candidates%bilateral(c) .or. (state%active(c) .and. coupled)) depth = abs(gap)
            if (state%active(c) .or. .not. problem%candidates%bilateral(c)) call note(check_penetration, depth / problem%size)
            call note(check_complementarity, abs(state%reaction(c) * gap) / (largest * problem%size))
            if (coupled .and. state%active(c)) call note(check_foundation, &
               & (abs(gap) - rounding_gap(problem)) / problem%coupling%local(problem%coupling%entry(c)) / largest)
         else
            if (.not. problem%candidates%bilateral(c) .and. state%reaction(c) > 0.0_wp .and. gap > 0.0_wp) &
               & call note(check_complementarity, state%reaction(c) * gap / (largest * problem%size))
            call foundation_response(problem, c, gap, push, spring)
            ! An open node may penetrate until its reaction would exceed the tolerance of equilibrium, the accuracy with which the
            ! onset of contact is located.
            uncertain = rounding_gap(problem)
            if (.not. state%active(c)) uncertain = let_in * problem%size
            call note(check_foundation, (abs(state%reaction(c) - push) - spring * uncertain - &
               & merge(unsettled, 0.0_wp, push <= 0.0_wp .or. .not. state%active(c))) / largest)
         end if
         if (problem%candidates%bilateral(c)) cycle
         call note(check_tension, (-state%reaction(c) - unsettled) / largest)
      end do

   contains

      !> Stores the value of a check at candidate `c` if it is worse than all values before.
      subroutine note(check, value)
         integer, intent(in) :: check
         real(wp), intent(in) :: value
         call note_worst(accuracy, check, value, at, node=label)
      end subroutine note
   end subroutine measure_contact

   !> Force of a foundation at a node for a given gap.
   pure subroutine foundation_response(problem, candidate, gap, push, spring)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: gap
      real(wp), intent(out) :: push, spring    !! force; its derivative by the penetration
      real(wp) :: penetration
      penetration = -gap
      if (.not. problem%candidates%bilateral(candidate)) penetration = max(penetration, 0.0_wp)
      call foundation_reaction(problem%model, problem%model%obstacle(problem%candidates%obstacle(candidate)), penetration, push, &
         & spring)
      push = push * problem%candidates%tributary(candidate)
      spring = spring * problem%candidates%tributary(candidate)
   end subroutine foundation_response
end module contact_checks
