!> Force and couple of an obstacle on a rod at a segment boundary, where loads, springs and supports act on the same node.
module breakpoint_forces
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, may_react
   use obstacle_track, only: track_t
   use track_nodes, only: node_track, track_sense
   use conforming_span, only: conforming_forces
   implicit none
   private
   public :: at_breakpoint, is_supported, breakpoint_force, breakpoint_couple, left_over

contains

   !> True for a contact node at a segment boundary of its rod.
   pure logical function at_breakpoint(problem, candidate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      associate (e => problem%beside(:, problem%candidates%node(candidate)))
         at_breakpoint = any(e == 0)
         if (.not. at_breakpoint) at_breakpoint = problem%rod_segment(e(1)) /= problem%rod_segment(e(2)) .or. &
            & e(1) == problem%element_last(problem%rod_segment(e(1)))
      end associate
   end function at_breakpoint

   !> True if a support carries the whole force that the obstacle could exert on a contact node, because it fixes the node with and
   !> without contact.
   pure logical function is_supported(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(track_t) :: track
      track = node_track(problem, state, candidate)
      is_supported = .not. may_react(problem, candidate, [-track%tangent(2), track%tangent(1)])
   end function is_supported

   !> Concentrated force of the obstacle at a segment boundary, > 0 in compression: the reaction that balances free elements, loads
   !> and springs, plus the jump of Q between elements on the track. Zero if supports carry the whole force.
   real(wp) function breakpoint_force(problem, state, candidate) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(track_t) :: track
      real(wp) :: local(3), sense
      integer :: side, e
      track = node_track(problem, state, candidate)
      force = 0.0_wp
      if (.not. may_react(problem, candidate, [-track%tangent(2), track%tangent(1)])) return
      sense = track_sense(problem, state, candidate, track)
      force = state%reaction(candidate)
      do side = 1, 2
         e = problem%candidates%element(side, candidate)
         if (e == 0) cycle
         if (problem%conforms(e) == 0) cycle
         call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local)
         force = force + sense * merge(1.0_wp, -1.0_wp, side == 1) * local(2)
      end do
   end function breakpoint_force

   !> Couple that the obstacle would have to exert on a line contact's node at a segment boundary, where the rod has the direction
   !> of the track: the unbalanced couple of loads, springs and free elements, plus the jump of the moment between elements on the
   !> track; > 0 counterclockwise. No obstacle exerts a couple; it is therefore zero in a valid contact set. Zero if a support
   !> carries the couple.
   real(wp) function breakpoint_couple(problem, state, candidate) result(couple)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: local(3)
      integer :: side, e
      couple = 0.0_wp
      associate (node => problem%candidates%node(candidate))
         if (.not. problem%candidates%follows(candidate) .or. problem%model%fixed(3, node)) return
         couple = state%couple(candidate)
         do side = 1, 2
            e = problem%beside(side, node)
            if (e == 0) cycle
            if (problem%conforms(e) == 0) cycle
            call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local)
            couple = couple + merge(1.0_wp, -1.0_wp, side == 1) * local(3)
         end do
      end associate
   end function breakpoint_couple

   !> Bound, over the force scale, of forces that may be residuals of the Newton iteration.
   pure real(wp) function left_over(problem)
      type(problem_t), intent(in) :: problem
      left_over = max(10.0_wp * problem%model%step(problem%step)%tolerance, 1.0e-10_wp)
   end function left_over
end module breakpoint_forces
