!> Around a corner of the path where contact at nodes changes: there, accepted as a point, and on with the new contact set.
module corner_turning
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use contact_corner, only: find_corner, leave_corner
   use contact_regions, only: find_regions
   use path_continuity, only: path_tangent_t
   use path_control, only: is_arc_length
   use corrector, only: increment_t
   use path_state, only: path_state_t, path_tangent_of
   use path_events, only: new_test_values
   use path_acceptance, only: arrival_t, accept
   use remeshing, only: wants_another
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   implicit none
   private
   public :: turn_corner

   real(wp), parameter :: least_load = 0.01_wp  !! of the load factor, that an increment after a corner may add

contains

   !> Tries whether the contact set changes at a corner just ahead; if so, goes there and around it.
   subroutine turn_corner(problem, step, run, meshes, recorder, turned, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the last point, on return too
      integer, intent(in) :: meshes              !! that the corner has had for its errors' sake, see arrival_t; where it wants
      !! another one nothing has changed
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: turned             !! the path stands at the corner, with its new contact set
      logical, intent(out) :: finished           !! the step ended before
      type(outcome_t), intent(inout) :: outcome
      type(state_t) :: place
      integer, allocatable :: corner(:)          ! candidates that change there
      logical, allocatable :: active(:)          ! contact set behind it
      type(increment_t) :: report
      type(arrival_t) :: arrival
      real(wp) :: load
      integer :: k
      logical :: shorter
      finished = .false.
      turned = .false.
      if (problem%candidates%n == 0) return
      call find_corner(problem, run%state, run%control, place, corner, run%system, report, turned)
      if (.not. turned) then
         call linearise(problem, run%state, run%state, run%system)
         return
      end if
      active = place%active
      do k = 1, size(corner)
         active(corner(k)) = .not. place%active(corner(k))
      end do
      load = abs(run%last_load)
      arrival%report = report
      arrival%tries = meshes
      arrival%label = corner_label(problem, place, active)
      arrival%changing = active .neqv. place%active
      call accept(problem, step, run, place, path_tangent_of(problem, run, place), arrival, recorder, shorter, finished, outcome)
      if (finished .or. allocated(outcome%why) .or. wants_another(run)) return
      load = max(load, abs(run%last_load), least_load * abs(run%state%load_factor))
      call leave_corner(problem, corner, run%state, run%system, run%heading, turned)
      run%probe = new_test_values(problem, run%state, run%system, run%heading%load)
      if (.not. turned) then
         outcome%why = 'no way on from where the contact set changes'
      else if (is_arc_length(run%control%method)) then
         ! A structure that has become stiff there is not to be loaded faster than before.
         if (load < abs(run%heading%load) * run%control%increment) run%control%increment = load / abs(run%heading%load)
      else
         call look_whether_back(problem, run, outcome)
      end if
   end subroutine turn_corner

   !> C+ or C-. One node more or less at the end of a region is the mesh's affair, not an event.
   character(2) function corner_label(problem, place, active) result(label)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: place         !! with the contact set before
      logical, intent(in) :: active(:)           !! the one behind
      type(state_t) :: beyond
      integer :: regions
      beyond = place
      beyond%active = active
      regions = size(find_regions(problem, beyond)) - size(find_regions(problem, place))
      label = ''
      if (regions > 0) label = 'C+'
      if (regions < 0) label = 'C-'
   end function corner_label

   !> Whether the path goes on against what the control prescribes.
   subroutine look_whether_back(problem, run, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run             !! at the corner, with its heading behind it
      type(outcome_t), intent(inout) :: outcome
      type(path_tangent_t) :: prescribed
      prescribed = path_tangent_of(problem, run, run%state)
      outcome%turns = run%heading%load * prescribed%load < 0.0_wp
      if (outcome%turns) outcome%why = 'the path turns back where the contact set changes: '// &
         & trim(merge('load control        ', 'displacement control', run%control%method == method_load))// &
         & ' cannot follow it (an arc-length METHOD can)'
   end subroutine look_whether_back
end module corner_turning
