!> Equilibria with an osculating contact, that is, a point contact with the curvature of its obstacle. Such a contact occurs where a
!> point contact becomes a line contact or divides, a line contact has become a point, or two points merge.
module flat_points
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use contact_spans, only: shortest
   use conforming_span, only: flat_excess, excess_curvature
   use touchdown_points, only: point_force
   use state_functional, only: functional_t
   use relative_curvature, only: new_relative_curvature
   use path_control, only: control_t, path_length
   use path_point, only: path_point_t
   use linear_system, only: system_t, new_system
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: find_flat_point, leave_flat_point, turn_flattest, curving_rate

contains

   !> Locates an osculating contact. At osculation the equation of a touchdown point, least gap, is singular. The node therefore
   !> follows the obstacle's direction, like the end of a line contact, its position is given by continuity of the moment, and the
   !> relative curvature is prescribed. Other points that become osculating nearby, for instance mirror images, are treated
   !> likewise.
   subroutine find_flat_point(problem, candidate, too, place, found)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      integer, intent(in) :: too(:)              !! candidates of the other points
      type(state_t), intent(inout) :: place      !! a nearby state on entry
      logical, intent(out) :: found
      type(problem_t) :: turning
      integer :: k
      call copy_problem(problem, turning)
      turning%candidates%follows([candidate, too]) = problem%candidates%rolls([candidate, too])
      call go_to_excess(turning, candidate, 0.0_wp, least_told(problem), place, found)
      if (.not. found) return
      do k = 1, size(too)
         place%reaction(too(k)) = point_force(problem, place, too(k))
      end do
      if (problem%candidates%moves(candidate)) place%reaction(candidate) = point_force(problem, place, candidate)
   end subroutine find_flat_point

   !> Finds the equilibrium in which the point contact with the least relative curvature may have negative relative curvature, for
   !> instance if it becomes a line earlier on another mesh: its node follows the obstacle's direction.
   subroutine turn_flattest(problem, from, control, state, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from          !! origin of `control`
      type(control_t), intent(in) :: control
      type(state_t), intent(inout) :: state      !! a guess on entry
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
   end subroutine turn_flattest

   !> Finds the equilibrium just beyond the point where a line contact has become a point contact. At this point the contact is
   !> osculating, its rotational stiffness is unbounded, and free spans beside it may buckle, so that the load is a poor parameter;
   !> relative curvature is prescribed instead.
   subroutine leave_flat_point(problem, candidate, reach, place, away, found)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: reach              !! largest path distance of the equilibrium
      type(state_t), intent(inout) :: place      !! in: the state of the line contact
      real(wp), intent(out) :: away  !! path distance; above `reach` if no nearer equilibrium can be resolved
      logical, intent(out) :: found
      real(wp), parameter :: nearer = 0.125_wp
      type(state_t) :: line
      real(wp) :: excess
      line = place
      excess = of_no_line(problem, line, candidate)
      do
         call go_to_excess(problem, candidate, excess, excess, place, found)
         ! Solved twice: if spans may buckle, the residual is small before the error is.
         if (found) call go_to_excess(problem, candidate, excess, excess, place, found)
         away = huge(away)
         if (found) away = path_length(problem, line, place)
         if (away <= reach .or. excess <= least_told(problem)) return
         if (.not. found) place = line
         excess = max(nearer * excess, least_told(problem))
      end do
   end subroutine leave_flat_point

   !> Rate of the relative curvature of a point contact along the path, per unit of load factor.
   real(wp) function curving_rate(problem, point, candidate) result(rate)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      integer, intent(in) :: candidate
      type(functional_t) :: curvature
      curvature = new_relative_curvature(problem, point%state, point%system, candidate)
      rate = curvature%change(point%system%tangent, 1.0_wp)
   end function curving_rate

   !> Small relative curvature: a share of the curvature change that the point's contact force produces along the least line length.
   real(wp) function of_no_line(problem, state, candidate) result(excess)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), parameter :: part = 0.25_wp
      integer :: e
      e = maxval(problem%candidates%element(:, candidate))
      excess = max(part * abs(point_force(problem, state, candidate)) * problem%compliance(e)%bending * shortest * &
         & problem%layout%rod_segment(problem%rod_segment(e))%length, least_told(problem))
   end function of_no_line

   !> Least relative curvature that differs significantly from zero.
   pure real(wp) function least_told(problem) result(excess)
      type(problem_t), intent(in) :: problem
      excess = 10.0_wp * flat_excess / problem%size
   end function least_told

   !> Finds the equilibrium at which a point contact has a given relative curvature.
   subroutine go_to_excess(problem, candidate, excess, whole, state, found)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: excess
      real(wp), intent(in) :: whole              !! scale for the tolerance of the relative curvature
      type(state_t), intent(inout) :: state      !! a guess on entry
      logical, intent(out) :: found
      type(control_t) :: curved
      type(state_t) :: start
      type(system_t) :: system
      type(increment_t) :: report
      curved%flat = candidate
      curved%increment = excess
      curved%whole = whole
      start = state
      system = new_system(problem)
      call correct(problem, start, curved, .true., state, system, report)
      found = report%converged
   end subroutine go_to_excess
end module flat_points
