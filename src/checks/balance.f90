!> Independent checks of an equilibrium point: global and nodal balance, signs of reactions, complementarity, laws of foundations.
!> The assembled residual is not used: loads, support reactions and contact forces are summed from their definitions.
module balance
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use obstacle_pose, only: pose_t, about_pivot
   use rod_state, only: state_t, node_position, pose_of, candidate_gap, candidate_opening, &
      & is_stress_free
   use contact_set, only: gap_tolerance, sign_slack
   use contact_spans, only: line_share
   use force_law, only: foundation_reaction
   use tied_nodes, only: turned_arm
   use node_loads, only: node_push_t, dead_node_load, node_pushes
   use section_forces, only: end_forces
   use span_forces, only: span_totals, end_force
   use track_nodes, only: rolled_t, rolled
   use conforming_span, only: conforming_state_t, conforming_forces, density_samples, smooth_parts
   use deck_nodes, only: deck_contact_gaps, find_node
   use element_foundation, only: foundation_forces
   use rod_profile, only: profile_t, new_profile, mend_ends, profile_error_bound
   use ground_segments, only: gap_rounding, gap_uncertainty, segment_stiffness, follows, gap_in_state
   use force_law, only: segment_unknown
   use inner_forces, only: inner_forces_t
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use run_accuracy, only: accuracy_t, place_t, note_worst, check_residual, check_penetration, check_tension, &
      & check_complementarity, check_foundation, check_force_balance, check_moment_balance, check_node_balance
   implicit none
   private
   public :: span_sums_t, sum_spans, measure_balance

   real(wp), parameter :: line_slack = 1.0e-5_wp !! part of the structure's size: error of forces from densities, which are
   !! derivatives of the solution
   real(wp), parameter :: least_reaction = 1.0e-6_wp !! smallest reaction, over the largest force, to which the sign of a reaction
   !! is related

   !> Forces of the contact spans of a state.
   type :: span_sums_t
      real(wp) :: middle(2) = 0.0_wp             !! middle of the structure, the reference point of the moments
      real(wp), allocatable :: force(:, :, :)    !! (3, contacts, obstacles) force in x, force in y, sum of normal forces
      real(wp), allocatable :: moment(:)         !! (obstacles) moment, > 0 anticlockwise
   end type span_sums_t

contains

   !> Sums the forces of the contact spans, which are zero if there are none.
   function sum_spans(problem, state) result(spans)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_sums_t) :: spans
      spans%middle = 0.5_wp * (maxval(state%geometry%x, 2) + minval(state%geometry%x, 2))
      allocate (spans%force(3, size(problem%model%contact), size(problem%model%obstacle)), source=0.0_wp)
      allocate (spans%moment(size(problem%model%obstacle)), source=0.0_wp)
      if (problem%has_spans()) call span_totals(problem, state, spans%middle, spans%force, spans%moment)
   end function sum_spans

   !> Updates the worst values in `accuracy` with those of a converged state.
   !>
   !> Errors are related to the largest force or reaction of the run so far: in a state almost without forces, rounding is a large
   !> part of the forces. Force errors caused by the rounding of positions are subtracted.
   subroutine measure_balance(problem, state, spans, at, residual, accuracy, touches_in)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_sums_t), intent(in) :: spans     !! forces of the contact spans
      type(place_t), intent(in) :: at            !! position of the point in the run
      real(wp), intent(in) :: residual
      type(accuracy_t), intent(inout) :: accuracy
      integer, intent(in), optional :: touches_in !! element in which a contact span begins at this point; 0: none
      real(wp), allocatable :: support(:, :), left(:, :)
      real(wp) :: total(3), scale, first(3), second(3), x(2), force(3), rate(3), size_, noise, middle(2)
      class(rod_element_t), pointer :: rod
      type(node_push_t), allocatable :: push(:)
      integer :: e, i, node

      size_ = problem%size
      ! At the stress-free start there is no equilibrium to check, because initial overlaps may exist.
      if (is_stress_free(state)) return
      call note_worst(accuracy, check_residual, residual, at)
      allocate (support(3, problem%model%mesh%n_nodes), source=0.0_wp)
      middle = spans%middle
      total = 0.0_wp
      ! Rounding error of all foundations' forces, caused by the rounding of positions.
      noise = problem%ground%stiffest * rounding_gap(problem) * count(problem%ground%founded)
      scale = max(problem%force_floor, accuracy%force)
      elements: do e = 1, problem%model%mesh%n_elements
         call end_forces(problem, state, e, first, second)
         associate (a => problem%model%mesh%node(1, e), b => problem%model%mesh%node(2, e))
            support(:, a) = support(:, a) - first
            support(:, b) = support(:, b) + second
         end associate
         scale = max(scale, maxval(abs(first(1:2))), maxval(abs(second(1:2))), abs(first(3)) / size_, abs(second(3)) / size_)
         rod => rod_at(problem, e)
         scale = max(scale, rod%force_scale(problem, state, e))
         force = rod%load_sum(problem, state, e, middle)
         ! The load on a foundation need not pass through any cross section.
         scale = max(scale, maxval(abs(force(1:2))))
         total = total + force
      end do elements
      left = support
      push = node_pushes(problem, state)
      nodes: do node = 1, problem%model%mesh%n_nodes
         x = node_position(state, node) - middle
         call dead_node_load(problem, state, node, force, rate)
         do i = 1, size(push)
            if (push(i)%node == node) force = force + push(i)%force
         end do
         total = total + [force(1:2), force(3) + x(1) * force(2) - x(2) * force(1)]
         left(:, node) = left(:, node) - force + problem%model%spring(:, node) * state%u(:, node)
         where (.not. problem%model%fixed(:, node))
            support(:, node) = 0.0_wp
         elsewhere
            support(:, node) = support(:, node) - force
         end where
         force = support(:, node) - problem%model%spring(:, node) * state%u(:, node)
         scale = max(scale, maxval(abs(force(1:2))))
         total = total + [force(1:2), force(3) + x(1) * force(2) - x(2) * force(1)]
      end do nodes
      if (problem%candidates%n > 0) scale = max(scale, maxval(abs(state%reaction)))
      call measure_contact(problem, state, at, scale, middle, accuracy, total, left)
      if (problem%ground%chain%n > 0) call add_foundations()
      if (problem%has_spans()) call add_spans()
      if (size(problem%ties%carrier) > 0) call add_carried()
      call add_joints()
      accuracy%force = scale
      call note_worst(accuracy, check_force_balance, beyond(norm2(total(1:2)), noise) / scale, at)
      call note_worst(accuracy, check_moment_balance, beyond(abs(total(3)), noise * size_) / (scale * size_), at)
      where (problem%model%fixed) left = 0.0_wp
      left(3, :) = left(3, :) / size_
      node = maxloc(maxval(abs(left), 1), 1)
      call note_worst(accuracy, check_node_balance, beyond(maxval(abs(left(:, node))), noise) / scale, at, &
         & node=problem%model%mesh%node_label(node))

   contains

      !> Adds the forces and moments on the nodes that carry obstacles: the opposites of the forces of these obstacles.
      subroutine add_carried()
         real(wp) :: gap, normal(2), bend, push(3)
         type(pose_t) :: pose
         integer :: c, o, i
         do o = 1, size(problem%model%obstacle)
            associate (carrier => problem%model%obstacle(o)%carrier)
               if (carrier == 0) cycle
               pose = pose_of(problem, state, o)
               push = about_pivot(pose%arm(middle), sum(spans%force(1:2, :, o), 2)) + [0.0_wp, 0.0_wp, spans%moment(o)]
               do c = 1, problem%candidates%n
                  if (problem%candidates%obstacle(c) /= o .or. problem%candidates%contact_span(c) > 0) cycle
                  call candidate_gap(problem, state, c, gap, normal, bend)
                  push = push + about_pivot(pose%arm(node_position(state, problem%candidates%node(c))), state%reaction(c) * normal)
               end do
               do i = 1, 3
                  call act(carrier, i, -push(i))
               end do
            end associate
         end do
      end subroutine add_carried

      !> Adds the forces of springs between nodes and of ties. Each tie balances its own component and acts on the nodes that it
      !> follows.
      subroutine add_joints()
         real(wp) :: push, arm(2)
         integer :: i, k
         do i = 1, size(problem%model%joint_spring)
            associate (spring => problem%model%joint_spring(i), at => problem%model%joint_spring(i)%component)
               push = spring%stiffness * (state%u(at, spring%node(2)) - state%u(at, spring%node(1)))
               call act(spring%node(1), at, push)
               call act(spring%node(2), at, -push)
            end associate
         end do
         do i = size(problem%model%tie), 1, -1
            associate (tie => problem%model%tie(i))
               push = left(tie%component, tie%node)
               ! Rigid links may transmit forces that are not section forces.
               if (tie%component < 3) scale = max(scale, abs(push))
               call act(tie%node, tie%component, push)
               do k = 1, size(tie%of)
                  call act(tie%of(k), tie%part(k), -tie%factor(k) * push)
               end do
               if (tie%turner == 0 .or. tie%component == 3) cycle
               arm = turned_arm(tie, state%u(3, tie%turner))
               call act(tie%turner, 3, -push * merge(-arm(2), arm(1), tie%component == 1))
            end associate
         end do
      end subroutine add_joints

      !> Adds a force or moment on a node, unless a support balances it.
      subroutine act(on, component, push)
         integer, intent(in) :: on, component
         real(wp), intent(in) :: push
         real(wp) :: f(3)
         left(component, on) = left(component, on) - push
         if (problem%model%fixed(component, on)) return
         f = 0.0_wp
         f(component) = push
         x = node_position(state, on) - middle
         total = total + [f(1:2), f(3) + x(1) * f(2) - x(2) * f(1)]
      end subroutine act

      !> Adds the forces of contact spans, and checks the nodes of contact spans.
      subroutine add_spans()
         real(wp) :: push, gap, normal(2), bend, local(3), x(2), angle, density, tau, counted(2)
         type(rolled_t) :: roll
         type(conforming_state_t) :: kept
         type(profile_t) :: profile
         real(wp), allocatable :: gaps(:), place(:, :)
         integer :: c, e, i, parts, mesh_node
         total = total + [sum(spans%force(1, :, :)), sum(spans%force(2, :, :)), sum(spans%moment)]
         accuracy%reaction = max(accuracy%reaction, maxval(abs(sum(spans%force(3, :, :), 2))))
         do c = 1, problem%candidates%n
            if (problem%candidates%contact_span(c) == 0) cycle
            push = end_force(problem, state, c)
            call candidate_gap(problem, state, c, gap, normal, bend)
            roll = rolled(problem, state, c)
            if (abs(roll%way) > 0.0_wp) normal = roll%normal
            associate (node => problem%candidates%node(c))
               left(:, node) = left(:, node) - push * [normal, roll%arm(1) * normal(2) - roll%arm(2) * normal(1)]
               ! If a support of the node carries a part of the force, this part is contained in the support reaction.
               counted = merge(push * normal, 0.0_wp, problem%model%fixed(1:2, node))
               x = node_position(state, node) + roll%arm - middle
               total = total - [counted, x(1) * counted(2) - x(2) * counted(1)]
               call note_worst(accuracy, check_penetration, abs(gap - roll%rise) / problem%size, at, &
                  & node=problem%model%mesh%node_label(node))
               call note_worst(accuracy, check_tension, (-push - least_push(c) - sign_slack * scale) / max(accuracy%reaction, &
                  & least_reaction * scale), at, node=problem%model%mesh%node_label(node))
            end associate
         end do
         ! Signs of the densities along line contacts; then penetration at the deck's nodes, which the mesh may lack.
         do e = 1, problem%model%mesh%n_elements
            if (problem%conforms(e) == 0) cycle
            parts = density_samples * smooth_parts(problem, state, e, 1.0_wp)
            do i = 0, parts
               tau = real(i, wp) / parts
               call conforming_forces(problem, state, e, tau, local, x, angle, density, kept)
               call note_worst(accuracy, check_tension, (-density * problem%size - line_slack * scale) / max(accuracy%reaction, &
                  & least_reaction * scale), at, element=problem%model%mesh%element_label(e))
            end do
         end do
         do c = 1, size(problem%deck%contact)
            if (.not. problem%deck%contact(c)%spans) cycle
            associate (node => problem%deck%contact(c)%node)
               if (allocated(gaps)) deallocate (gaps, place)
               allocate (gaps(size(node)), place(2, size(node)))
               call deck_contact_gaps(problem, state, c, gaps, place)
               do i = 1, size(node)
                  call find_node(problem, state, node(i), mesh_node, e, tau)
                  ! Where a contact span begins, the gap of its node is used, which is more accurate than the polynomial of the
                  ! element.
                  if (present(touches_in) .and. e > 0) then
                     if (e == touches_in) cycle
                  end if
                  ! The interpolation error is needed only if the penetration would be the worst without it.
                  if (-gaps(i) / problem%size <= accuracy%worst(check_penetration)%value) cycle
                  if (e > 0 .and. gaps(i) < 0.0_wp) gaps(i) = gaps(i) + place_error(e, tau, profile)
                  call note_worst(accuracy, check_penetration, -gaps(i) / problem%size, at, &
                     & node=problem%deck%mesh%node_label(node(i)))
               end do
            end associate
         end do
      end subroutine add_spans

      !> Accepted tension [force, > 0] at a line contact's node on a support that fixes the rotation (a symmetry plane). Tension
      !> lifts a length of rod of 3/2 tension over pressure (lifted_node); this length may be as short as the shortest line contact.
      real(wp) function least_push(c)
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
            least_push = least_push + 2.0_wp / 3.0_wp * max(density, 0.0_wp) * line_share * &
               & problem%layout%rod_segment(problem%rod_segment(e))%length
         end do
      end function least_push

      !> Interpolation error of the position between nodes; a penetration below this error is not counted.
      real(wp) function place_error(e, tau, profile) result(doubt)
         integer, intent(in) :: e
         real(wp), intent(in) :: tau
         type(profile_t), intent(inout) :: profile !! profile of the last point, with its ends mended; undefined: none
         if (profile%element /= e) then
            profile = new_profile(problem, state, e)
            if (problem%conforms(e) == 0) call mend_ends(problem, state, profile, 2)
         end if
         doubt = profile_error_bound(profile, tau)
      end function place_error

      !> Adds foundations that act inside elements, from their pressures.
      subroutine add_foundations()
         type(inner_forces_t) :: inner
         real(wp) :: push(2), most, least, shortest, rounding
         integer :: q, pulled
         rounding = gap_rounding(state)
         shortest = minval(state%geometry%element%length, mask=problem%ground%founded)
         most = 0.0_wp
         least = 0.0_wp
         pulled = 0
         do e = 1, problem%model%mesh%n_elements
            if (.not. problem%ground%founded(e)) cycle
            call foundation_forces(problem, state, e, inner)
            do q = 1, inner%n
               push = (state%geometry%element(e)%length * inner%weight(q) * inner%pressure(q)) * inner%normal(:, q)
               total = total + [push, (inner%x(1, q) - middle(1)) * push(2) - (inner%x(2, q) - middle(2)) * push(1)]
               if (problem%ground%chain%bilateral(inner%source(q))) cycle
               most = max(most, inner%pressure(q))
               push(1) = inner%pressure(q)
               ! On an element too long to resolve the pressure only the integral of the pressure has a meaning.
               if (.not. follows(problem, state, inner%source(q))) push(1) = sum(inner%weight(:inner%n) * &
                  & inner%pressure(:inner%n), mask=inner%source(:inner%n) == inner%source(q))
               if (state%segment(inner%source(q)) /= segment_unknown) push(1) = min(0.0_wp, push(1) + segment_stiffness(problem, &
                  & inner%source(q), state%segment(inner%source(q))) * gap_uncertainty( &
                  & gap_in_state(problem, state, inner%source(q)), rounding))
               if (push(1) < least) pulled = e
               least = min(least, push(1))
            end do
         end do
         if (most > noise / shortest .and. pulled > 0) call note_worst(accuracy, check_tension, -least / most, at, &
            & element=problem%model%mesh%element_label(pulled))
      end subroutine add_foundations
   end subroutine measure_balance

   !> Part of an error that exceeds its rounding.
   pure real(wp) function beyond(error, noise)
      real(wp), intent(in) :: error, noise
      beyond = max(error - noise, 0.0_wp)
   end function beyond

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
      ! Reactions that are within rounding have no sign to check.
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
         ! Components carried by a support of the node are contained in the support reaction.
         do i = 1, 2
            if (problem%model%fixed(i, node)) force(i) = 0.0_wp
         end do
         total = total + [force, x(1) * force(2) - x(2) * force(1)]
         if (coupled) gap = candidate_opening(problem, state, c)
         if (rigid .or. coupled) then
            ! At a bilateral obstacle, or on the settled surface of coupled ground, a gap of either sign is an error.
            depth = -gap
            if (problem%candidates%bilateral(c) .or. (state%active(c) .and. coupled)) depth = abs(gap)
            if (state%active(c) .or. .not. problem%candidates%bilateral(c)) &
               & call note(check_penetration, depth / problem%size)
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

      !> Stores a value of the present candidate if it is worse than all values before.
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
end module balance
