!> Equilibrium after a small remaining length is set to zero: a line contact shorter than the least length has become a point
!> contact, or a point contact nearer than this length to a segment boundary is placed at the boundary.
module shrunk_line
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use path_control, only: control_t, path_length
   use flat_points, only: leave_flat_point
   use path_point, only: move_to
   use path_state, only: path_state_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: come_to_rest

   !> An osculating contact is accepted up to this multiple of the path distance `reach`: the end of a line contact is located by
   !> moments, an osculating contact by curvature, and the mesh errors of both differ.
   real(wp), parameter :: farther = 10.0_wp

contains

   !> Finds the equilibrium of the run after a line contact has shrunk or a point contact has come to a segment boundary. If a line
   !> contact has become a free point contact: the equilibrium just beyond osculation. Otherwise: the equilibrium at the same load.
   !> The run is unchanged if no equilibrium is found within `reach`.
   subroutine come_to_rest(problem, run, candidate, reach, leaves)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: candidate           !! candidate of the remaining contact, 0: none remains
      real(wp), intent(in) :: reach              !! largest path distance
      logical, intent(out) :: leaves  !! true: point contact just beyond osculation, with increasing relative curvature
      type(control_t) :: here
      type(increment_t) :: report
      type(state_t) :: state
      type(system_t) :: system
      real(wp) :: away
      logical :: found
      leaves = .false.
      if (candidate == 0) return
      state = run%last%state
      if (problem%contact_span(problem%candidates%contact_span(candidate))%line .or. .not. problem%candidates%moves(candidate)) then
         here%method = method_load
         here%whole = run%last%state%load_factor
         system = run%last%system
         call correct(problem, run%last%state, here, .true., state, system, report)
         found = report%converged
         if (found) found = path_length(problem, run%last%state, state) <= reach
      else
         call leave_flat_point(problem, candidate, reach, state, away, found)
         if (found) found = away <= farther * reach
         leaves = found
      end if
      if (found) call move_to(problem, state, run%last)
   end subroutine come_to_rest
end module shrunk_line
