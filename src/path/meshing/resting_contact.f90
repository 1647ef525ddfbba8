!> Finds the touchdown point that moves fastest along its rod, and the equilibrium on another mesh with this point at its old
!> position: near a limit point one touchdown point may move far while the rest hardly moves.
module resting_contact
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_point, only: path_point_t, move_to
   use path_state, only: path_state_t
   use touchdown_points, only: touchdown_steps
   use tangent_step, only: states_along
   use path_control, only: control_t
   use sized_equilibrium, only: solve_sized
   use set_begins, only: small_load
   implicit none
   private
   public :: find_fastest, stay_in_place

contains

   !> Finds the touchdown point with the largest rate of position by load.
   subroutine find_fastest(problem, point, fastest, rate)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      integer, intent(out) :: fastest            !! candidate, 0: none moves
      real(wp), intent(out) :: rate              !! along the rod, per unit of load factor
      real(wp) :: rates(problem%candidates%n), step
      type(state_t) :: ahead, here
      fastest = 0
      rate = 0.0_wp
      associate (moves => problem%candidates%moves(:size(rates)))
         if (.not. any(moves)) return
         call states_along(problem, point%system, point%state, 1.0_wp, here, ahead, step)
         rates = abs(touchdown_steps(problem, point%state, ahead) - touchdown_steps(problem, point%state, here)) / step
         fastest = maxloc(rates, 1, moves)
      end associate
      rate = rates(fastest)
   end subroutine find_fastest

   !> Finds the equilibrium with one touchdown point fixed at its present position.
   subroutine stay_in_place(problem, run, fastest, point, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      integer, intent(in) :: fastest             !! candidate
      type(path_point_t), intent(inout) :: point !! a guess on entry
      logical, intent(out) :: found
      type(state_t) :: state
      type(control_t) :: load
      state = point%state
      load%whole = state%load_factor
      call solve_sized(problem, [fastest, 0], point%system, load, small_load(run), state, found)
      if (found) call move_to(problem, state, point)
      found = found .and. point%system%ok
   end subroutine stay_in_place
end module resting_contact
