!> Sliding contact nodes between two points of the path.
!>
!> When the node of a contact point has moved over more than half an element the next one takes over at the same material
!> point and the first one goes home; a node that lost its contact goes home, too. The state is carried over and brought
!> back to equilibrium; nothing but the discretisation changes.
module sliding_nodes
   use kinds, only: wp
   use model, only: method_linearised
   use problem, only: problem_t
   use rod_state, only: state_t
   use rod_geometry, only: slide_node
   use contact_slides, only: ends_contact, reach
   use contact_hand_over, only: hand_over, carry_over, offset_from_home, touches_another
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent, is_arc_length
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: rehome_nodes, move_node

contains

   !> Moves nodes home or hands contacts over where due. The system ends up factored at the new state.
   subroutine rehome_nodes(problem, control, direction, direction_load, state, system, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: direction(:, :), direction_load !! last increment: fixes the sense of the tangent
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! factored at `state` on entry and on return
      type(timers_t), intent(inout) :: timers
      type(state_t) :: moved
      real(wp) :: offset, home
      integer :: c, side
      logical :: changed, done

      if (.not. any(problem%candidates%may_slide)) return
      moved = state
      changed = .false.
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%may_slide(c)) cycle
         associate (element => problem%candidates%element(:, c))
            offset = offset_from_home(problem, moved, c)
            if (.not. abs(offset) > 0.0_wp) cycle
            ! It may slide on another obstacle.
            if (touches_another(problem, moved, c)) cycle
            side = merge(2, 1, offset > 0.0_wp)
            home = problem%model%mesh%s(2, element(side)) - problem%model%mesh%s(1, element(side))
            if (ends_contact(problem, moved%active, c)) then
               if (abs(offset) < reach(problem, moved%active, c, side) * home) cycle
               ! A node that does not slide would take the contact away from where it is.
               if (.not. problem%candidates%may_slide(problem%candidates%neighbour(side, c))) cycle
               call hand_over(problem, c, side, state, moved, done)
               if (.not. done) cycle
            else
               call slide_node(problem%model, problem%tableau, moved%geometry, element, -offset)
            end if
            changed = .true.
         end associate
      end do
      if (.not. changed) return

      ! Should it fail the node goes on sliding; when its element runs out, the increment says so.
      call take_over(problem, control, direction, direction_load, .false., moved, state, system, done, timers)
   end subroutine rehome_nodes

   !> Moves the node of an open candidate along the rod to where a contact is about to begin.
   subroutine move_node(problem, control, direction, direction_load, candidate, shift, state, system, ok, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: direction(:, :), direction_load
      integer, intent(in) :: candidate
      real(wp), intent(in) :: shift              !! of nominal coordinate, less than an element
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! factored at `state` on entry and on return
      logical, intent(out) :: ok                 !! false: the state is as it was
      type(timers_t), intent(inout) :: timers
      type(state_t) :: moved
      ok = .true.
      if (.not. abs(shift) > 0.0_wp) return
      moved = state
      call slide_node(problem%model, problem%tableau, moved%geometry, problem%candidates%element(:, candidate), shift)
      call take_over(problem, control, direction, direction_load, .true., moved, state, system, ok, timers)
   end subroutine move_node

   !> Carries the solution over to the moved nodes of `moved`, restores equilibrium, and makes it the state if that works.
   subroutine take_over(problem, control, direction, direction_load, keep_contact, moved, state, system, ok, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: direction(:, :), direction_load
      logical, intent(in) :: keep_contact
      type(state_t), intent(inout) :: moved
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      type(state_t) :: base
      type(control_t) :: hold
      type(increment_t) :: report
      call carry_over(problem, state, moved)
      hold = control
      hold%increment = 0.0_wp
      if (is_arc_length(control%method)) then
         hold%method = method_linearised
         call set_tangent(problem, system, direction, direction_load, hold)
      end if
      base = moved
      call correct(problem, base, hold, keep_contact, moved, system, report, timers, moved=.true.)
      ok = report%converged
      if (ok) then
         state = moved
      else
         call linearise(problem, state, state, system, timers)
      end if
   end subroutine take_over
end module sliding_nodes
