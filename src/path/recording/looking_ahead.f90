!> The path ahead of where a run ends, followed by its arc length off the record: what a message says of it has been tried.
module looking_ahead
   use kinds, only: wp
   use model, only: method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: control_t, set_tangent, displacement_between
   use path_continuity, only: path_tangent_t, path_tangent_at, relate, same_path
   use path_state, only: path_state_t
   use corrector, only: increment_t, take_increment
   use span_tests, only: spans_hold
   implicit none
   private
   public :: look_t, look_from, look_on, goes_on

   integer, parameter :: most_cuts = 10        !! of the increments of one look

   !> How far a look has come.
   type :: look_t
      type(state_t) :: here                    !! the run's point, or the one reached last
      type(path_tangent_t) :: heading               !! tangent there, in the sense of the run
      type(control_t) :: control               !! of the increments
      integer :: cuts = 0                      !! halvings so far
   end type look_t

contains

   !> A look that begins where a run stands, with increments as long as the last one was, or would have been.
   pure function look_from(run) result(look)
      type(path_state_t), intent(in) :: run
      type(look_t) :: look
      look%control%method = method_cylindrical
      look%control%increment = run%last_length
      if (.not. look%control%increment > 0.0_wp) &
         & look%control%increment = abs(run%control%increment) / max(abs(run%heading%load), tiny(1.0_wp))
      look%here = run%state
      look%heading = run%heading
   end function look_from

   !> Goes on to the next point of the path, if one is found with the contact spans that there are.
   subroutine look_on(problem, run, look, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run        !! its system is factored at the look's point on return where one is found
      type(look_t), intent(inout) :: look      !! stays where none is found
      logical, intent(out) :: found
      type(state_t) :: next
      type(path_tangent_t) :: ahead
      type(increment_t) :: report
      found = .false.
      do while (look%cuts <= most_cuts)
         call linearise(problem, look%here, look%here, run%system)
         if (.not. run%system%ok) return
         call set_tangent(problem, run%system, look%heading%u, look%heading%load, look%control)
         call take_increment(problem, look%here, look%control, next, run%system, report)
         if (report%converged) then
            ahead = path_tangent_at(problem, run%system, displacement_between(problem, look%here, next), next%load_factor - &
               & look%here%load_factor)
            report%converged = same_path(relate(problem, look%here, next, look%heading, ahead, .false.))
         end if
         if (report%converged) exit
         look%cuts = look%cuts + 1
         look%control%increment = 0.5_wp * look%control%increment
      end do
      if (look%cuts > most_cuts) return
      ! How the path goes on where its contacts change is not known.
      if (problem%has_spans()) report%converged = spans_hold(problem, next, run%system%force_scale)
      if (.not. report%converged) return
      found = .true.
      look%here = next
      look%heading = ahead
   end subroutine look_on

   !> True where an increment by arc length leads on from where a run stands.
   logical function goes_on(problem, run)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run        !! its system is factored anywhere on return
      type(look_t) :: look
      look = look_from(run)
      call look_on(problem, run, look, goes_on)
   end function goes_on
end module looking_ahead
