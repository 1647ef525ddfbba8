!> Independent checks of an equilibrium point: balance of all forces, balance at each node, and the checks of contact
!> (contact_checks). They do not use the assembled residual: loads, support reactions and contact forces are summed from their
!> definitions.
module balance
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use obstacle_pose, only: pose_t, about_pivot
   use rod_state, only: state_t, node_position, pose_of, candidate_gap, is_stress_free
   use force_law, only: segment_unknown
   use tied_nodes, only: turned_arm
   use node_loads, only: node_push_t, dead_node_load, node_pushes
   use element_foundation, only: foundation_forces
   use ground_segments, only: gap_rounding, gap_uncertainty, segment_stiffness, follows, gap_in_state
   use rod_load, only: inner_forces_t
   use rod_equations, only: cancelling_force, end_forces
   use load_sums, only: load_on_rod
   use path_record, only: accuracy_t, place_t, note_worst, check_residual, check_tension, check_force_balance, &
      & check_moment_balance, check_node_balance
   use contact_checks, only: span_sums_t, measure_spans, measure_contact
   implicit none
   private
   public :: measure_balance

contains

   !> Computes the errors of balance of a converged state, and stores those that are worse than the worst so far in `accuracy`.
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
         scale = max(scale, cancelling_force(problem, state, e))
         force = load_on_rod(problem, state, e, middle)
         ! A load that a foundation carries need not pass through any cross section, so that loads enter the scale of forces, too.
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
         ! A body that turns about a pin may carry nothing but couples, so that moments enter the scale of forces, too.
         scale = max(scale, maxval(abs(force(1:2))), abs(force(3)) / size_)
         total = total + [force(1:2), force(3) + x(1) * force(2) - x(2) * force(1)]
      end do nodes
      if (problem%candidates%n > 0) scale = max(scale, maxval(abs(state%reaction)))
      call measure_contact(problem, state, at, scale, middle, accuracy, total, left)
      if (problem%ground%chain%n > 0) call add_foundations()
      if (problem%has_spans()) call measure_spans(problem, state, spans, at, scale, accuracy, total, left, touches_in)
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

      !> Adds the forces of springs between nodes and of ties (couplings of a node's displacement component to other nodes). Each
      !> tie balances its component, and acts with the opposite force on the nodes to which the component is tied.
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

      !> Adds the forces of foundations that act inside elements, from their pressures, and checks the pressures for tension.
      subroutine add_foundations()
         type(inner_forces_t) :: inner
         real(wp) :: push(2), most, least, shortest, rounding, error
         integer :: q, pulled, source              ! source: candidate for which `error`, of the pressure, is known
         rounding = gap_rounding(state)
         shortest = minval(state%geometry%element%length, mask=problem%ground%founded)
         most = 0.0_wp
         least = 0.0_wp
         pulled = 0
         do e = 1, problem%model%mesh%n_elements
            if (.not. problem%ground%founded(e)) cycle
            call foundation_forces(problem, state, e, inner)
            source = 0
            do q = 1, inner%n
               push = (state%geometry%element(e)%length * inner%at(q)%weight * inner%at(q)%pressure) * inner%at(q)%normal
               total = total + [push, (inner%at(q)%x(1) - middle(1)) * push(2) - (inner%at(q)%x(2) - middle(2)) * push(1)]
               if (problem%ground%chain%bilateral(inner%at(q)%source)) cycle
               most = max(most, inner%at(q)%pressure)
               push(1) = inner%at(q)%pressure
               ! On an element too long to resolve its foundation only the integral of the pressure over the element has a meaning.
               if (.not. follows(problem, state, inner%at(q)%source)) push(1) = sum(inner%at(:inner%n)%weight * &
                  & inner%at(:inner%n)%pressure, mask=inner%at(:inner%n)%source == inner%at(q)%source)
               if (state%segment(inner%at(q)%source) /= segment_unknown) then
                  ! All points of one foundation on an element are neighbours in the list, so that the error is computed once for
                  ! them.
                  if (inner%at(q)%source /= source) error = segment_stiffness(problem, inner%at(q)%source, &
                     & state%segment(inner%at(q)%source)) * gap_uncertainty(gap_in_state(problem, state, inner%at(q)%source), &
                     & rounding)
                  source = inner%at(q)%source
                  push(1) = min(0.0_wp, push(1) + error)
               end if
               if (push(1) < least) pulled = e
               least = min(least, push(1))
            end do
         end do
         if (most > noise / shortest .and. pulled > 0) call note_worst(accuracy, check_tension, -least / most, at, &
            & element=problem%model%mesh%element_label(pulled))
      end subroutine add_foundations
   end subroutine measure_balance

   !> The part of an error by which it exceeds the rounding error `noise`; else zero.
   pure real(wp) function beyond(error, noise)
      real(wp), intent(in) :: error, noise
      beyond = max(error - noise, 0.0_wp)
   end function beyond

end module balance
