!> Passes a corner of the path where contact at nodes changes: the corner is accepted as a point, and the path continues with the
!> new contact set.
module corner_turning
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_corner, only: find_corner, leave_corner
   use contact_regions, only: find_regions
   use path_control, only: is_arc_length
   use corrector, only: increment_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t, path_tangent_of
   use path_acceptance, only: arrival_t, accept
   use corner_limit, only: look_whether_back
   use trial_request, only: request_t
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: turn_corner

   real(wp), parameter :: least_load = 0.01_wp  !! part of the load factor that an increment after a corner may add

contains

   !> Searches for a change of the contact set at a corner just ahead; if there is one, accepts the corner and continues behind it.
   subroutine turn_corner(problem, step, run, meshes, recorder, request, turned, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: meshes              !! meshes made for the corner's errors, see arrival_t; if another mesh is
      !! requested, nothing has changed
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request  !! requirements of the corner as a trial
      logical, intent(out) :: turned             !! the path is at the corner, with its new contact set
      logical, intent(out) :: finished           !! the step ended before
      type(outcome_t), intent(inout) :: outcome
      type(path_point_t) :: place
      integer, allocatable :: corner(:)          ! candidates that change at the corner
      logical, allocatable :: active(:)          ! contact set behind the corner
      type(increment_t) :: report
      type(arrival_t) :: arrival
      real(wp) :: load
      integer :: k
      finished = .false.
      turned = .false.
      call request%begin_trial()
      if (problem%candidates%n == 0) return
      call find_corner(problem, run%last, run%control, place, corner, report, turned)
      if (.not. turned) return
      place%tangent = path_tangent_of(problem, run, place)
      active = place%state%active
      do k = 1, size(corner)
         active(corner(k)) = .not. active(corner(k))
      end do
      load = abs(run%last_load)
      arrival%report = report
      arrival%tries = meshes
      arrival%label = corner_label(problem, place%state, active)
      arrival%changing = active .neqv. place%state%active
      call accept(problem, step, run, place, arrival, recorder, request, finished, outcome)
      if (finished .or. allocated(outcome%why) .or. request%remeshes()) return
      load = max(load, abs(run%last_load), least_load * abs(run%last%state%load_factor))
      call leave_corner(problem, corner, run%last, turned)
      if (.not. turned) then
         outcome%why = 'no way on from where the contact set changes'
      else if (is_arc_length(run%control%method)) then
         ! A structure that has become stiff at the corner must not be loaded faster than before.
         if (load < abs(run%last%tangent%load) * run%control%increment) run%control%increment = load / abs(run%last%tangent%load)
      else
         call look_whether_back(problem, step, run, outcome)
      end if
   end subroutine turn_corner

   !> Label of a corner: C+ or C- if the number of contact regions changes; '' for one node more or less at the end of a region,
   !> which depends on the mesh.
   character(2) function corner_label(problem, place, active) result(label)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: place         !! state at the corner, with the contact set before it
      logical, intent(in) :: active(:)           !! contact set behind the corner
      type(state_t) :: beyond
      integer :: regions
      beyond = place
      beyond%active = active
      regions = size(find_regions(problem, beyond)) - size(find_regions(problem, place))
      label = ''
      if (regions > 0) label = 'C+'
      if (regions < 0) label = 'C-'
   end function corner_label
end module corner_turning
