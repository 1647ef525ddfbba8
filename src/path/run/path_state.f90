!> State of a path: the last accepted point, its tangent and test values, and the history that later increments need.
module path_state
   use kinds, only: wp
   use archive, only: archive_t
   use model, only: method_load, method_displacement
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t
   use state_transfer, only: carried_field
   use mesh_density, only: mesh_density_t
   use path_control, only: control_t, displacement_between
   use error_bar, only: error_bars_t
   use enriched_problem, only: enriched_problem_t
   use mesh_request, only: refinement_t
   use critical_points, only: critical_point_t, critical_points_t
   use displacement_functional, only: monitor_change
   use path_continuity, only: path_tangent_t, path_tangent_at, chord_between, goes_back, stands_still
   use path_record, only: region_t
   use path_events, only: test_values_t, new_test_values
   implicit none
   private
   public :: path_state_t, recent_path_t, slopes_t, trial_request_t, onset_t, since_change_t, finer_mesh_t, arrived_t
   public :: copy_path_state
   public :: path_tangent_of, test_values_at, keep_critical_point, leave_trail, turned_back, forget_mesh, rest_of_mesh

   integer, parameter :: rest_of_mesh = 10       !! accepted points after a refinement during which no coarser mesh is tried

   !> The path between two neighbouring accepted points, with the path tangents at both ends.
   type :: recent_path_t
      type(state_t) :: from, to
      real(wp), allocatable :: chord(:, :)       !! (3, nodes) displacement between the two points
      type(path_tangent_t) :: first, last
   end type recent_path_t

   integer, parameter :: trail_length = 3        !! number of parts kept: a path that turns round meets its most recent points first

   !> State before the mesh was coarsened, to return to if the coarser mesh fails; or before a contact change.
   type :: finer_mesh_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(path_tangent_t) :: heading
      type(test_values_t) :: test_values
   end type finer_mesh_t

   !> Derivatives of the tests of contact spans by arc length.
   type :: slopes_t
      real(wp), allocatable :: here(:)           !! at the last accepted point; not allocated: unknown
      real(wp), allocatable :: ahead(:)          !! at the trial point
      integer :: closer = 0 !! times that the increment from the last accepted point was shortened for these derivatives
      logical :: rough = .false. !! still requested after several shortenings: the tests are not smooth along the path
   end type slopes_t

   !> Consequences of the last contact change for the following points.
   type :: since_change_t
      logical :: shrunk = .false. !! a line contact has just become a point contact: the test values are those of the line, and an
      !! eigenvalue may have changed its sign there. Set by span_set, valid until the next point (event_recording); zero_at_end and
      !! smooth_zero find the zero there
      logical :: arrives = .false. !! a line contact has become a point, or a point contact has reached a segment boundary that
      !! stops it: its relative curvature is zero or still slightly negative. Set by span_set, reset by span_events, which excuses
      !! the violated test until then
      logical :: rises = .false. !! negative relative curvatures increase along the path from the last accepted point
      real(wp) :: at = 0.0_wp                    !! arc length of that change
   end type since_change_t

   !> Last accepted point as the path arrived there, if the contact changes at that point: the path leaves it with another tangent
   !> (corner_limit).
   type :: arrived_t
      integer :: point = 0 !! row in the results; 0: no contact change there, or the limit point is reported already
      real(wp) :: load_rate = 0.0_wp             !! d(load factor)/d(arc length) on arrival
      real(wp) :: load_factor = 0.0_wp
      real(wp), allocatable :: monitor(:)
      type(error_bars_t), allocatable :: bars    !! error bars; not allocated: unknown
   end type arrived_t

   !> Requirements of a trial whose errors exceed the tolerance. The trial is not recorded: the increment is repeated from the last
   !> accepted point.
   type :: trial_request_t
      logical :: smaller_residual = .false.      !! the iteration must end with a smaller residual
      type(mesh_density_t), allocatable :: density(:) !! (rod segments) required mesh density; not allocated: it is high enough
      logical :: at_last_point = .false.         !! the mesh is made for the last accepted point, not for the trial
      type(mesh_density_t), allocatable :: density_before(:) !! (rod segments) mesh density up to the last accepted point,
      !! before the mesh was made for the trial
      logical :: events_located = .false.        !! events were located between the last accepted point and the trial
   end type trial_request_t

   !> A point contact that begins at the next point.
   type :: onset_t
      type(region_t), allocatable :: region      !! not allocated: no contact begins
      integer :: element = 0                     !! element in which the contact begins; 0: none
   end type onset_t

   !> State of a path; a single type, so that the procedures of the path loop have short argument lists.
   type :: path_state_t
      type(state_t) :: state                     !! the last accepted point
      type(system_t) :: system                   !! factored at the point named by each procedure
      type(control_t) :: control                 !! constraint of the next increment
      type(test_values_t) :: test_values         !! test values at the last accepted point
      real(wp) :: arc_length = 0.0_wp            !! arc length since the start of the run
      integer :: branch = 0                      !! number of the branch in the result file; 0: the path of the steps
      integer :: points = 0                      !! points recorded so far, in all steps
      integer :: step_points = 0                 !! points accepted in this step
      integer :: spans_begun = 0                 !! contact spans begun so far: the last identity number given
      character(:), allocatable :: stuck         !! failure of a contact change: the step ends with this reason
      type(onset_t) :: onset                     !! point contact that begins at the next point
      logical :: on_bifurcation = .false.        !! the last point is a recorded bifurcation: its pivots have the sign of rounding
      type(since_change_t) :: since_change       !! consequences of the last contact change that are still active
      real(wp) :: motion(2) = 0.0_wp             !! largest displacement and rotation so far
      type(enriched_problem_t) :: finer             !! enriched problem, from which error estimates are computed
      type(refinement_t) :: refinement           !! results of the refinements tried for the present point
      type(trial_request_t) :: request           !! requirements of the last trial before it can be accepted
      type(mesh_density_t), allocatable :: spare(:) !! (rod segments) coarser mesh that is accurate enough for the last point
      logical :: behind_flat = .false. !! on the new mesh a point contact becomes a line contact before the last accepted point
      type(finer_mesh_t), allocatable :: before_coarsening !! state to return to until a point is accepted on the coarser mesh
      type(finer_mesh_t), allocatable :: before_change !! the last contact change that a rule made: the contact set before it, see
      !! contact_trials
      integer :: kept_meshes = 0                 !! number of further points for which the mesh is not coarsened
      real(wp) :: last_length = 0.0_wp, last_load = 0.0_wp !! arc length and load change of the last increment
      type(arrived_t) :: arrived                 !! arrival at the last accepted point
      type(slopes_t) :: slopes
      type(recent_path_t), allocatable :: trail(:)   !! parts of the path before the last accepted point, the latest first
      type(path_tangent_t) :: heading                 !! path tangent at the last accepted point, in the direction of travel
      logical :: fresh = .false. !! the last point is an unloaded start: its contacts carry no force and are kept closed in its
      !! tangent
      type(critical_points_t), pointer :: home => null() !! critical points of the parent path of a branch; on the path of a step,
      !! its own
      real(wp) :: left_at = 0.0_wp               !! arc length at the start of the branch or step
      type(critical_points_t), pointer :: critical_points => null() !! critical points of this step or branch, in their order
      type(archive_t), pointer :: frame => null() !! data with which the present path began, see checkpoint
   end type path_state_t

contains

   !> Copies a path state; a procedure for the reason given at copy_problem.
   subroutine copy_path_state(from, to)
      type(path_state_t), intent(in) :: from
      type(path_state_t), intent(inout) :: to
      to = from
   end subroutine copy_path_state

   !> Path tangent at a converged state at which the system is factored, in the direction of travel: that of the chord from the last
   !> accepted point, or, under load or displacement control, the direction in which the controlled quantity changes with the sign
   !> of the increment.
   type(path_tangent_t) function path_tangent_of(problem, run, state) result(heading)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: state
      real(wp) :: ahead
      select case (run%control%method)
      case (method_load)
         heading = path_tangent_at(problem, run%system, 0.0_wp * state%u, run%control%increment)
      case (method_displacement)
         ahead = monitor_change(problem, run%control%monitor, state, run%system, run%system%tangent, 1.0_wp)
         heading = path_tangent_at(problem, run%system, 0.0_wp * state%u, sign(1.0_wp, ahead * run%control%increment))
      case default
         heading = path_tangent_at(problem, run%system, displacement_between(problem, run%state, state), &
            & state%load_factor - run%state%load_factor)
      end select
   end function path_tangent_of

   !> Test values at a converged state at which the system is factored.
   type(test_values_t) function test_values_at(problem, run, state, heading) result(test_values)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: state
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `state`
      test_values = new_test_values(problem, state, run%system, heading%load)
   end function test_values_at

   !> Adds the path from the last accepted point to a new one. The path has a corner at a contact change: both tangents are those of
   !> this part of the path.
   subroutine leave_trail(problem, run, place, heading)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: place
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `place`, on this side
      type(recent_path_t), allocatable :: longer(:)
      integer :: kept
      kept = 0
      if (allocated(run%trail)) kept = min(size(run%trail), trail_length - 1)
      allocate (longer(1 + kept))
      longer(1)%from = run%state
      longer(1)%first = run%heading
      longer(1)%to = place
      longer(1)%chord = chord_between(problem, run%state, place)
      longer(1)%last = heading
      if (kept > 0) longer(2:) = run%trail(:kept)
      call move_alloc(longer, run%trail)
   end subroutine leave_trail

   !> Discards all data that refer to the nodes of the previous mesh.
   subroutine forget_mesh(run)
      type(path_state_t), intent(inout) :: run
      if (allocated(run%control%tangent)) deallocate (run%control%tangent)
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      if (allocated(run%trail)) deallocate (run%trail)
      run%slopes = slopes_t(closer=run%slopes%closer)
      call run%finer%forget()
      if (allocated(run%before_coarsening)) deallocate (run%before_coarsening)
   end subroutine forget_mesh

   !> True if a trial point lies on the recent path, which the increment retraces.
   logical function turned_back(problem, run, trial, ahead)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! path tangent at `trial`
      integer :: k
      turned_back = .false.
      if (.not. allocated(run%trail)) return
      ! If only the load changes, the tangent's displacements are rounding.
      if (stands_still(ahead, trial%load_factor - run%state%load_factor)) return
      do k = 1, size(run%trail)
         if (turned_back) return
         associate (way => run%trail(k))
            turned_back = goes_back(problem, way%from, way%to, way%chord, way%first, way%last, trial, ahead)
         end associate
      end do
   end function turned_back

   !> Keeps the critical point recorded last.
   subroutine keep_critical_point(problem, run, label, state, trial, part, arc_length, pivots, multiplicity, scale, bars, free, &
      & released, corner)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      character(*), intent(in) :: label
      type(state_t), intent(in) :: state
      type(state_t), intent(in) :: trial         !! next accepted or trial point
      real(wp), intent(in) :: part               !! position of `state` between the last point and `trial`, 0 to 1
      real(wp), intent(in) :: arc_length
      integer, intent(in) :: pivots              !! negative pivots before the critical point
      integer, intent(in) :: multiplicity
      real(wp), intent(in), optional :: scale    !! scale of the event, see event_t
      type(error_bars_t), allocatable, intent(in), optional :: bars
      type(problem_t), intent(in), optional :: free !! problem without force-free contacts, on which a branch leaves the critical
      !! point
      type(state_t), intent(in), optional :: released !! state of the critical point in that problem
      logical, intent(in), optional :: corner    !! LP: the load turns at a corner of the path
      type(critical_point_t) :: critical_point
      critical_point%label = label
      call copy_problem(problem, critical_point%problem)
      critical_point%state = state
      critical_point%point = run%points
      critical_point%pivots = pivots
      critical_point%multiplicity = multiplicity
      critical_point%arc_length = arc_length
      critical_point%direction = displacement_between(problem, run%state, state)
      critical_point%drift = critical_point%direction - part * displacement_between(problem, run%state, trial)
      critical_point%direction_load = state%load_factor - run%state%load_factor
      critical_point%control = run%control
      if (present(scale)) critical_point%scale = scale
      if (present(bars)) critical_point%bars = bars
      if (present(corner)) critical_point%corner = corner
      if (present(free)) then
         critical_point%direction = carried_field(problem, state, critical_point%direction, free, released)
         critical_point%drift = carried_field(problem, state, critical_point%drift, free, released)
         call copy_problem(free, critical_point%problem)
         critical_point%state = released
      end if
      call run%critical_points%keep(critical_point)
   end subroutine keep_critical_point
end module path_state
