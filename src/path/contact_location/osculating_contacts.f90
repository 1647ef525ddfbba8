!> Equilibria with an osculating contact, that is, a point contact at which the rod has the curvature of its obstacle. The contact
!> osculates where a point contact becomes a line contact or divides, where a line contact has become a point, or where two points
!> merge.
module osculating_contacts
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use track_nodes, only: curvature_slack, excess_curvature, rolled_t, rolled
   use touchdown_points, only: point_force
   use contact_spans, only: initial_share
   use test_kinds, only: well_below
   use path_control, only: control_t
   use linear_system, only: system_t, new_system
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: find_osculating_contact, turn_at_least_curvature

contains

   !> Locates an osculating contact. At osculation the equation that places a touchdown point, least gap, is singular. It is
   !> replaced: the node follows the obstacle's direction, like the end of a line contact; continuity of the moment gives its place;
   !> and the relative curvature is prescribed. Other points that become osculating nearby, for instance mirror images, are treated
   !> likewise.
   subroutine find_osculating_contact(problem, candidate, too, place, residual, found)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      integer, intent(in) :: too(:)              !! candidates of the other points that become osculating nearby
      type(state_t), intent(inout) :: place      !! in: a nearby state; out: the equilibrium, if found
      real(wp), intent(out) :: residual          !! relative residual of these equations
      logical, intent(out) :: found
      type(problem_t) :: turning
      type(control_t) :: flat
      type(state_t) :: start
      type(system_t) :: system
      type(increment_t) :: report
      integer :: k
      call copy_problem(problem, turning)
      turning%candidates%follows([candidate, too]) = problem%candidates%rolls([candidate, too])
      flat%flat = candidate
      flat%increment = 0.0_wp
      flat%whole = least_resolved_curvature(problem)
      start = place
      system = new_system(turning)
      call correct(turning, start, flat, .true., place, system, report)
      residual = report%residual
      found = report%converged
      if (.not. found) return
      do k = 1, size(too)
         place%reaction(too(k)) = point_force(problem, place, too(k))
      end do
      if (problem%candidates%moves(candidate)) then
         place%reaction(candidate) = point_force(problem, place, candidate)
      else
         found = acts_at_node(problem, place, candidate)
      end if
   end subroutine find_osculating_contact

   !> True if the contact force of a point at a segment boundary acts at its node, up to a negligible distance along the rod. If
   !> not, the contact leaves the boundary before it osculates (test_leaving).
   pure logical function acts_at_node(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! with an osculating contact at the candidate
      integer, intent(in) :: candidate
      type(rolled_t) :: roll
      integer, allocatable :: e(:)               ! one element at the end of a rod, else two
      roll = rolled(problem, state, candidate)
      e = pack(problem%candidates%element(:, candidate), problem%candidates%element(:, candidate) > 0)
      acts_at_node = abs(roll%way) <= initial_share * minval(problem%layout%rod_segment(problem%rod_segment(e))%length)
   end function acts_at_node

   !> Finds the equilibrium in which the point contact with the least relative curvature may have negative relative curvature, for
   !> instance if the contact becomes a line earlier on another mesh. The node of this contact then follows the obstacle's
   !> direction.
   subroutine turn_at_least_curvature(problem, from, control, state, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from          !! state from which the increment of `control` is counted
      type(control_t), intent(in) :: control
      type(state_t), intent(inout) :: state      !! in: a guess; out: the equilibrium, if found
      logical, intent(out) :: found
      type(problem_t) :: turning
      type(increment_t) :: report
      type(system_t) :: system
      real(wp) :: excess(problem%candidates%n), extension
      integer :: c
      excess = huge(excess)
      do c = 1, size(excess)
         if (problem%candidates%contact_span(c) == 0) cycle
         if (problem%candidates%moves(c) .and. problem%candidates%rolls(c)) call excess_curvature(problem, state, c, excess(c), &
            & extension)
      end do
      found = any(excess < huge(excess))
      if (.not. found) return
      c = minloc(excess, 1)
      call copy_problem(problem, turning)
      turning%candidates%follows(c) = .true.
      system = new_system(turning)
      call correct(turning, from, control, .true., state, system, report)
      found = report%converged
      if (found) state%reaction(c) = point_force(problem, state, c)
   end subroutine turn_at_least_curvature

   !> Least relative curvature that differs significantly from zero.
   pure real(wp) function least_resolved_curvature(problem) result(excess)
      type(problem_t), intent(in) :: problem
      excess = well_below * curvature_slack / problem%size
   end function least_resolved_curvature
end module osculating_contacts
