!> Corners of the path at which contact with foundations begins or ends. For example, a free end that reaches stiff soil stops
!> moving almost at once.
!>
!> A halved increment never ends close to such a corner. But the tangents at the two ends of an increment across the corner
!> intersect near the corner and give its distance. The next increment therefore ends at the corner, and the following one passes
!> it.
module corner_ahead
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_continuity, only: relate, same_path, length_to_corner
   use path_control, only: path_length
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use step_control, only: smallest
   use displacement_functional, only: watched_displacement
   implicit none
   private
   public :: corner_t, find_corner_ahead, is_near, part_before, differ

   !> Corner of the path, predicted by the trial increments from one point.
   type :: corner_t
      real(wp) :: length = -1.0_wp               !! arc length from the point to the corner by the last trial; negative: no corner
      real(wp) :: before = -1.0_wp !! arc length from the point to the corner by the previous trial; negative: no corner
      real(wp) :: chord = 0.0_wp                 !! chord length of the last trial
      logical :: goes_around = .false. !! true: the last trial would be on the path if the corner were at the last accepted point
   end type corner_t

contains

   !> Searches for a corner between the last accepted point and a trial.
   subroutine find_corner_ahead(problem, run, trial, corner)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial    !! converged, on the mesh of the last accepted point
      type(corner_t), intent(inout) :: corner
      corner%before = corner%length
      corner%length = -1.0_wp
      associate (from => run%last%state, to => trial%state, before => run%last%tangent, after => trial%tangent)
         corner%chord = path_length(problem, from, to)
         if (.not. run%fresh .and. (differ(from%active, to%active) .or. differ(from%grounded, to%grounded))) &
            & corner%length = length_to_corner(problem, from, to, before, after)
         corner%goes_around = same_path(relate(problem, from, to, before, after, .true.))
      end associate
   end subroutine find_corner_ahead

   !> True if the corner is closer than the smallest increment.
   pure logical function is_near(problem, step, run, corner)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(corner_t), intent(in) :: corner
      is_near = corner%length >= 0.0_wp
      if (is_near) is_near = increment_for(problem, run, corner%length) < smallest(step, run%control)
   end function is_near

   !> Part of a failed increment that is tried next: a half, or the part up to the corner. If an increment up to the corner fails,
   !> the next one is shorter by the uncertainty of the corner's position. If the corner is closer than this uncertainty, increments
   !> are halved, and the tangents of the shorter trials show whether there is a corner.
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

   !> Increment of the controlled quantity that corresponds to an arc length along the tangent at the last accepted point.
   pure real(wp) function increment_for(problem, run, length) result(increment)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: length             !! arc length
      type(state_t) :: there
      increment = length
      if (run%control%method == method_load) increment = length * abs(run%last%tangent%load)
      if (run%control%method /= method_displacement) return
      there = run%last%state
      there%u = there%u + length * run%last%tangent%u
      increment = abs(watched_displacement(problem, there, run%control%monitor) - &
         & watched_displacement(problem, run%last%state, run%control%monitor))
   end function increment_for

   !> True if two contact sets have the same number of candidates but not the same contacts. Sets of different size belong to
   !> different meshes and are not compared.
   pure logical function differ(one, other)
      logical, intent(in) :: one(:), other(:)
      differ = size(one) == size(other)
      if (differ) differ = any(one .neqv. other)
   end function differ
end module corner_ahead
