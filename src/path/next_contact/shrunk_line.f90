!> What is left of a line of contact, or of a point's way to a breakpoint, that is taken for none. It had a length still: without it
!> the equilibrium is a little another.
module shrunk_line
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: control_t, path_length
   use flat_points, only: leave_flat_point
   use path_state, only: path_state_t
   use corrector, only: increment_t, correct
   implicit none
   private
   public :: come_to_rest

   !> Times the reach that a flat point may be away: where a line's length is zero its moments tell, where a point is flat its
   !> curvature, and a mesh errs in these on its own.
   real(wp), parameter :: farther = 10.0_wp

contains

   !> The run in equilibrium with what a line has become. A point is just beyond where it is as curved as the obstacle; of a line,
   !> and of a point at a breakpoint, it is the equilibrium at the same load. It stays where none is found nearby.
   subroutine come_to_rest(problem, run, candidate, reach, leaves)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: candidate           !! of what the contact has become, 0: it has become nothing of its own
      real(wp), intent(in) :: reach              !! along the path
      logical, intent(out) :: leaves             !! it is such a point, which becomes more curved further on
      type(control_t) :: here
      type(increment_t) :: report
      type(state_t) :: state
      real(wp) :: away
      logical :: found
      leaves = .false.
      if (candidate == 0) return
      state = run%state
      if (problem%contact_span(problem%candidates%contact_span(candidate))%line .or. .not. problem%candidates%moves(candidate)) then
         here%method = method_load
         here%whole = run%state%load_factor
         call correct(problem, run%state, here, .true., state, run%system, report)
         found = report%converged
         if (found) found = path_length(problem, run%state, state) <= reach
      else
         call leave_flat_point(problem, run, candidate, reach, state, away, found)
         if (found) found = away <= farther * reach
         leaves = found
      end if
      if (found) run%state = state
      call linearise(problem, run%state, run%state, run%system)
   end subroutine come_to_rest
end module shrunk_line
