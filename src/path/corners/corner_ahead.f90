!> Corners of the path where contact with foundations begins or ends: a free end that comes down on stiff soil stands still at once.
!>
!> No halved increment comes near enough to such a corner to be a small part of what lies behind it. But the tangents at both ends
!> of an increment across it meet there, and tell how far it is: the next increment goes up to it, the one behind around it.
module corner_ahead
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_continuity, only: path_tangent_t, relate, same_path, length_to_corner
   use path_control, only: path_length
   use path_state, only: path_state_t
   use step_control, only: smallest
   use monitor_rows, only: watched_displacement
   implicit none
   private
   public :: corner_t, look_for_corner, is_near, part_before, differ

   !> What trials from one point tell.
   type :: corner_t
      real(wp) :: length = -1.0_wp               !! arc length up to it, of the last trial; negative: none
      real(wp) :: before = -1.0_wp               !! of the one before
      real(wp) :: chord = 0.0_wp                 !! how far the last trial is
      logical :: goes_around = .false.           !! the last trial lies behind the point as it would if that were the corner itself
   end type corner_t

contains

   !> Whether there is one between the run's point and a trial.
   subroutine look_for_corner(problem, run, trial, ahead, corner)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial         !! converged, on the mesh of the run's point
      type(path_tangent_t), intent(in) :: ahead       !! tangent there
      type(corner_t), intent(inout) :: corner
      corner%before = corner%length
      corner%length = -1.0_wp
      corner%chord = path_length(problem, run%state, trial)
      if (.not. run%fresh .and. (differ(run%state%active, trial%active) .or. differ(run%state%grounded, trial%grounded))) &
         & corner%length = length_to_corner(problem, run%state, trial, run%heading, ahead)
      corner%goes_around = same_path(relate(problem, run%state, trial, run%heading, ahead, .true.))
   end subroutine look_for_corner

   !> True for a corner that no increment worth trying leads nearer to.
   pure logical function is_near(problem, step, run, corner)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(corner_t), intent(in) :: corner
      is_near = corner%length >= 0.0_wp
      if (is_near) is_near = increment_for(problem, run, corner%length) < smallest(step, run%control)
   end function is_near

   !> Part of a failed increment to try next: half of it, or up to the corner. Once that has been tried, to this side of it by as
   !> much as is not known of it. As near to the corner as that, half of it again: there increments show that they go around one.
   pure real(wp) function part_before(problem, step, run, corner) result(part)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(corner_t), intent(in) :: corner
      real(wp) :: length, increment
      part = 0.5_wp
      if (corner%length <= 0.0_wp .or. corner%goes_around) return
      length = corner%length
      if (corner%before > 0.0_wp) length = length - max(abs(length - corner%before), corner%chord - length)
      if (length <= 0.0_wp) return
      increment = increment_for(problem, run, length)
      if (increment < abs(run%control%increment) .and. increment >= smallest(step, run%control)) &
         & part = increment / abs(run%control%increment)
   end function part_before

   !> The increment, of what the control prescribes, that goes so far along the tangent at the run's point.
   pure real(wp) function increment_for(problem, run, length) result(increment)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: length             !! arc length
      type(state_t) :: there
      increment = length
      if (run%control%method == method_load) increment = length * abs(run%heading%load)
      if (run%control%method /= method_displacement) return
      there = run%state
      there%u = there%u + length * run%heading%u
      increment = abs(watched_displacement(problem, there, run%control%monitor) - &
         & watched_displacement(problem, run%state, run%control%monitor))
   end function increment_for

   !> True for other contacts of the same mesh. The trial's may be gone, as that of the set before.
   pure logical function differ(one, other)
      logical, intent(in) :: one(:), other(:)
      differ = size(one) == size(other)
      if (differ) differ = any(one .neqv. other)
   end function differ
end module corner_ahead
