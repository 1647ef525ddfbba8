!> Follows the path by arc length beyond the end of a run, without recording points, to verify messages about the further path.
module unrecorded_path
   use kinds, only: wp
   use model, only: method_cylindrical
   use problem, only: problem_t
   use path_control, only: control_t, set_tangent, displacement_between
   use path_continuity, only: path_tangent_at, relate, same_path
   use path_point, only: path_point_t, advance
   use path_state, only: path_state_t
   use corrector, only: increment_t
   use span_tests, only: spans_hold
   implicit none
   private
   public :: unrecorded_path_t, start_unrecorded, advance_unrecorded, can_continue

   integer, parameter :: most_cuts = 10        !! largest number of halvings of the increment

   !> Data for following the path by arc length without recording.
   type :: unrecorded_path_t
      type(path_point_t) :: here               !! last accepted point of the run, or the last point reached beyond it
      type(control_t) :: control               !! constraint of the increments
      integer :: cuts = 0                      !! number of halvings so far
   end type unrecorded_path_t

contains

   !> Starts at the last accepted point of the run. The increment is the arc length of the run's last increment, or an estimate from
   !> the load increment if no node has moved yet.
   pure function start_unrecorded(run) result(look)
      type(path_state_t), intent(in) :: run
      type(unrecorded_path_t) :: look
      look%control%method = method_cylindrical
      look%control%increment = run%last_length
      if (.not. look%control%increment > 0.0_wp) &
         & look%control%increment = abs(run%control%increment) / max(abs(run%last%tangent%load), tiny(1.0_wp))
      look%here = run%last
   end function start_unrecorded

   !> Goes to the next point of the path, if the corrector converges to a point on the path at which the contact spans remain valid.
   subroutine advance_unrecorded(problem, look, found)
      type(problem_t), intent(in) :: problem
      type(unrecorded_path_t), intent(inout) :: look      !! out: at the next point; unchanged if none was found
      logical, intent(out) :: found            !! true: a next point was found
      type(path_point_t) :: next
      type(increment_t) :: report
      found = .false.
      do while (look%cuts <= most_cuts)
         if (.not. look%here%system%ok) return
         associate (here => look%here)
            call set_tangent(problem, here%system, here%tangent%u, here%tangent%load, look%control)
            call advance(problem, here, look%control, next, report)
            if (report%converged) then
               next%tangent = path_tangent_at(problem, next%system, displacement_between(problem, here%state, next%state), &
                  & next%state%load_factor - here%state%load_factor)
               report%converged = same_path(relate(problem, here%state, next%state, here%tangent, next%tangent, .false.))
            end if
         end associate
         if (report%converged) exit
         look%cuts = look%cuts + 1
         look%control%increment = 0.5_wp * look%control%increment
      end do
      if (look%cuts > most_cuts) return
      ! Contact changes are not made.
      if (problem%has_spans()) report%converged = spans_hold(problem, next%state, next%system%force_scale)
      if (.not. report%converged) return
      found = .true.
      look%here = next
   end subroutine advance_unrecorded

   !> True if an increment by arc length from the last accepted point of the run ends at another point of the path.
   logical function can_continue(problem, run)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(unrecorded_path_t) :: look
      look = start_unrecorded(run)
      call advance_unrecorded(problem, look, can_continue)
   end function can_continue
end module unrecorded_path
