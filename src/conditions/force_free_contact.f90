!> Lines of contact without pressure, as on a straight wall: the state is in balance with them and without.
!>
!> Without such a line the rod between its ends is free, and at its ends it touches in two points that are flat: to first order
!> they turn no more than the line's ends do. Where the tangent of that problem has a zero eigenvalue, with ends that keep
!> place and direction where the thrust is 4 pi^2 EI/l^2, the rod may leave the wall. No test of the spans tells: gap and pressure
!> are zero all along.
module force_free_contact
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, obstacle_shift, node_position
   use obstacle_geometry, only: obstacle_gap
   use obstacle_track, only: track_t
   use contact_spans, only: contact_span_t
   use conforming_span, only: conforming_forces, node_track
   use span_problem, only: new_span_problem
   use span_candidates, only: present_contact_spans
   use touchdown_points, only: carry_forces
   use breakpoint_forces, only: breakpoint_force
   use past_breakpoints, only: beyond
   use state_transfer, only: carried
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   implicit none
   private
   public :: remove_force_free_lines, count_released, let_turn, line_opening

   integer, parameter :: samples = 4            !! of the pressure in an element
   real(wp), parameter :: nothing = 1.0e-7_wp   !! of the structure's forces: no force
   real(wp), parameter :: unsettled = 100.0_wp  !! times the tolerance of the residuals: what they may make of the thrust

contains

   !> The problem and the state without lines that carry no force.
   subroutine remove_force_free_lines(problem, state, system, free, released, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      type(problem_t), intent(out) :: free
      type(state_t), intent(out) :: released    !! on its mesh
      logical, intent(out) :: any_weak          !! false: there are none, and neither problem nor state are set
      type(contact_span_t), allocatable :: touch(:), rest(:)
      logical :: weak(size(problem%touch))
      real(wp) :: none
      integer :: k, side, n
      any_weak = .false.
      if (.not. problem%has_spans()) return
      none = nothing * max(system%force_scale, tiny(none))
      weak = [(problem%touch(k)%line, k=1, size(weak))]
      do k = 1, size(weak)
         if (weak(k)) weak(k) = .not. is_pressed(problem, state, k, unsettled * problem%model%step(problem%step)%tolerance * &
            & system%force_scale, none / problem%size)
      end do
      any_weak = any(weak)
      if (.not. any_weak) return
      touch = present_contact_spans(problem, state)
      rest = pack(touch, .not. weak)
      n = maxval(touch%number)
      do k = 1, size(weak)
         if (.not. weak(k)) cycle
         do side = 1, 2
            if (ends_nowhere(problem, touch, k, side) .and. .not. (side == 2 .and. pressed_end(k))) cycle
            rest = [rest, touch(k)]
            associate (point => rest(size(rest)))
               point%line = .false.
               point%at = touch(k)%at(side)
               if (side == 2) then
                  n = n + 1
                  point%number = n
               end if
            end associate
         end do
      end do
      free = new_span_problem(problem, rest)
      ! Breakpoints have the same nodes on all meshes.
      free%hinge = problem%hinge
      free%rolling = problem%rolling
      free%model%fixed(3, free%hinge) = .false.
      released = carried(problem, state, free)
      call carry_forces(problem, state, free, released)
      do k = 1, free%candidates%n
         if (free%candidates%touch(k) == 0) cycle
         associate (number => free%touch(free%candidates%touch(k))%number)
            if (any(weak .and. touch%number == number) .or. number > maxval(touch%number)) free%candidates%follows(k) = .true.
         end associate
      end do

   contains

      !> True where a force presses the node at which a line goes on as the next one.
      logical function pressed_end(k)
         integer, intent(in) :: k
         integer :: c
         c = problem%touch(k)%candidate(2)
         pressed_end = .not. problem%candidates%moves(c)
         if (pressed_end) pressed_end = breakpoint_force(problem, state, c) > none
      end function pressed_end
   end subroutine remove_force_free_lines

   !> Negative pivots of the tangent without lines that carry no force.
   subroutine count_released(problem, state, system, pivots, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled and factored at `state`
      integer, intent(out) :: pivots            !! without any such line: those of the system
      logical, intent(out) :: any_weak
      type(problem_t) :: free
      type(state_t) :: released
      type(system_t) :: other
      pivots = system%negative_pivots
      call remove_force_free_lines(problem, state, system, free, released, any_weak)
      if (.not. any_weak) return
      other = new_system(free)
      call linearise(free, released, released, other)
      if (other%ok) pivots = other%negative_pivots
   end subroutine count_released

   !> The released problem as one of a path that leaves the lines: where they ended the rod may turn.
   pure subroutine let_turn(free)
      type(problem_t), intent(inout) :: free
      integer :: c
      do c = 1, free%candidates%n
         if (free%candidates%touch(c) > 0) free%candidates%follows(c) = free%touch(free%candidates%touch(c))%line
      end do
   end subroutine let_turn

   !> True for an end of a line that goes on as another one, or ends with its rod.
   pure logical function ends_nowhere(problem, touch, k, side)
      type(problem_t), intent(in) :: problem
      type(contact_span_t), intent(in) :: touch(:)     !! as they are now
      integer, intent(in) :: k, side
      integer :: next, node, way
      real(wp) :: end
      way = merge(-1, 1, side == 1)
      end = merge(0.0_wp, problem%layout%stretch(touch(k)%stretch)%length, side == 1)
      ends_nowhere = .false.
      if (abs(touch(k)%at(side) - end) > 0.0_wp) return
      if (side == 1) then
         node = problem%model%mesh%node(1, problem%element_first(touch(k)%stretch))
      else
         node = problem%model%mesh%node(2, problem%element_last(touch(k)%stretch))
      end if
      ends_nowhere = problem%beside(side, node) == 0
      next = beyond(problem, k, way)
      if (next == 0) return
      end = merge(problem%layout%stretch(next)%length, 0.0_wp, side == 1)
      ends_nowhere = any(touch%line .and. touch%stretch == next .and. touch%contact == touch(k)%contact .and. &
         & abs(touch%at(3 - side) - end) <= 0.0_wp)
   end function ends_nowhere

   !> True where the density of the obstacle's force along a line, in size, is somewhere above a bound and what the thrust errs by
   !> round the obstacle's curve: on a straight one loads and the rod's shape give it, however far an iteration has gone.
   logical function is_pressed(problem, state, touch, thrust_error, bound)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: touch              !! index into problem%touch
      real(wp), intent(in) :: thrust_error
      real(wp), intent(in) :: bound
      real(wp) :: local(3), place(2), angle, density, noise
      integer :: e, i
      is_pressed = .true.
      do e = problem%touch(touch)%element(1), problem%touch(touch)%element(2)
         noise = thrust_error * max(bend(problem%conforms(e)), bend(problem%candidates%neighbour(2, problem%conforms(e))))
         do i = 0, samples
            call conforming_forces(problem, state, e, real(i, wp) / samples, local, place, angle, density)
            if (abs(density) - noise > bound) return
         end do
      end do
      is_pressed = .false.

   contains

      !> Of the track at a candidate.
      real(wp) function bend(candidate)
         integer, intent(in) :: candidate
         type(track_t) :: track
         track = node_track(problem, state, candidate)
         bend = abs(track%curvature)
      end function bend
   end function is_pressed

   !> The sense in which a mode of the released problem opens the lines that are gone: 1 along it, -1 against it, 0 neither.
   integer function line_opening(problem, state, free, released, mode) result(sense)
      type(problem_t), intent(in) :: problem, free
      type(state_t), intent(in) :: state, released
      real(wp), intent(in) :: mode(:, :)        !! (3, nodes of `free`) global axes
      real(wp), parameter :: closed = 1.0e-3_wp ! of the largest opening
      type(contact_span_t), allocatable :: touch(:)
      real(wp) :: gap, normal(2), bend, opening, most, least, at
      integer :: k, e, node, obstacle
      touch = present_contact_spans(problem, state)
      most = 0.0_wp
      least = 0.0_wp
      do k = 1, size(touch)
         if (.not. touch(k)%line) cycle
         obstacle = problem%model%contact(touch(k)%contact)%obstacle
         do e = free%element_first(touch(k)%stretch), free%element_last(touch(k)%stretch)
            if (free%conforms(e) > 0) cycle
            at = released%geometry%element(e)%s(1) + free%origin(e)
            if (at <= touch(k)%at(1) .or. at >= touch(k)%at(2)) cycle
            node = free%model%mesh%node(1, e)
            call obstacle_gap(problem%model%obstacle(obstacle), node_position(released, node) - &
               & obstacle_shift(problem, state, obstacle), gap, normal, bend)
            opening = dot_product(normal, mode(1:2, node))
            most = max(most, opening)
            least = min(least, opening)
         end do
      end do
      sense = 0
      if (-least <= closed * most .and. most > 0.0_wp) sense = 1
      if (most <= -closed * least .and. least < 0.0_wp) sense = -1
   end function line_opening
end module force_free_contact
