!> Where a path stands: the last accepted point and what is known about it.
module path_state
   use kinds, only: wp
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
   use monitor_rows, only: monitor_change
   use path_continuity, only: path_tangent_t, path_tangent_at, chord_between, goes_back, stands_still
   use path_record, only: region_t
   use path_events, only: test_values_t, new_test_values
   implicit none
   private
   public :: path_state_t, copy_path_state, checkpoint_t, path_tangent_of, test_values_at, keep_critical_point, leave_trail, &
      & turned_back, forget_mesh, rest_of_mesh

   integer, parameter :: rest_of_mesh = 10       !! points after one that took a finer mesh, for which no coarser one is tried

   !> The path between two neighbouring points, with the tangents at its ends.
   type :: recent_path_t
      type(state_t) :: from, to
      real(wp), allocatable :: chord(:, :)       !! (3, nodes) between them
      type(path_tangent_t) :: first, last
   end type recent_path_t

   integer, parameter :: trail_length = 3        !! kept: a path that turns round meets the last ones first

   !> What the run stood on before its mesh became coarser.
   type :: checkpoint_t
      type(problem_t) :: problem
      type(state_t) :: state
      type(path_tangent_t) :: heading
      type(test_values_t) :: probe
   end type checkpoint_t

   !> How fast the tests of contact spans change along the path, by its length.
   type :: slopes_t
      real(wp), allocatable :: here(:)           !! at the run's point; not allocated: not known
      real(wp), allocatable :: ahead(:)          !! and at the trial
      integer :: closer = 0                      !! shorter increments from the run's point that slopes have asked for
      logical :: rough = .false.                 !! there they had not to: tests are not smooth along the path
   end type slopes_t

   !> What the last change of the contact spans leaves for the points behind it.
   type :: since_change_t
      logical :: shrunk = .false.                !! a line of contact has just become a point: its probe is the line's, and an
      !! eigenvalue may have gone through zero as it did. Set by span_set, until the next point (event_recording); zero_at_end and
      !! smooth_zero find the zero there
      logical :: arrives = .false.               !! a line has become a point, or a point has come to a breakpoint that stops
      !! it: it is as curved there as its obstacle, or still a little more. Set by span_set, until it is not (span_events), which
      !! excuses it
      logical :: rises = .false.                 !! and less along the path from where the run stands (minima_of_tests)
      real(wp) :: at = 0.0_wp                    !! arc length where it was
   end type since_change_t

   !> Kept together so that the procedures of the path loop have short argument lists.
   type :: path_state_t
      type(state_t) :: state                     !! the last accepted point
      type(system_t) :: system
      type(control_t) :: control
      type(test_values_t) :: probe
      real(wp) :: arc_length = 0.0_wp            !! travelled since the start of the run
      integer :: branch = 0                      !! number in the result file; 0: the path of the steps
      integer :: points = 0                      !! recorded so far, all steps
      integer :: step_points = 0                 !! accepted in this step
      integer :: touches = 0                     !! contacts that have begun so far: their numbers
      character(:), allocatable :: stuck         !! what contact spans could not do: the step ends with that reason
      type(region_t), allocatable :: beginning   !! a point contact that begins at the next point
      integer :: beginning_in = 0                !! the element that it begins in, or 0
      logical :: on_bifurcation = .false.        !! the last point is one that was recorded: its pivots have the sign of rounding
      type(since_change_t) :: since_change       !! what of its last change the run has not left behind yet
      real(wp) :: motion(2) = 0.0_wp             !! largest displacement and rotation so far
      type(enriched_problem_t) :: finer             !! what errors on the mesh are told by
      type(refinement_t) :: refinement           !! what the meshes of the point have been worth
      logical :: unsettled = .false.             !! the last trial wants smaller residuals, and nothing was recorded
      type(mesh_density_t), allocatable :: wanted(:)   !! (stretches) the mesh that the last trial asks for, of which nothing was
      !! recorded; not allocated: it is as good as the deck asks
      logical :: from_point = .false.            !! it is for the way from the run's point: kinks of the trial are not there
      logical :: has_events = .false.            !! on the way to the last trial, located from the run's point
      type(mesh_density_t), allocatable :: before(:)   !! (stretches) the mesh of the way, before it was made for the trial
      type(mesh_density_t), allocatable :: spare(:)    !! (stretches) a coarser mesh that would have done for the last point
      logical :: behind_flat = .false.           !! on the mesh that it has got a point has become a line before the run's point
      type(checkpoint_t), allocatable :: footing    !! to go back to, until a point stands on the coarser mesh
      integer :: kept_meshes = 0                 !! points for which the mesh does not become coarser
      real(wp) :: last_length = 0.0_wp, last_load = 0.0_wp !! of the last increment: arc length, load factor
      type(slopes_t) :: slopes
      type(recent_path_t), allocatable :: trail(:)   !! the way up to the last accepted point, the latest first
      type(path_tangent_t) :: heading                 !! tangent at the last accepted point, in the sense of the run
      logical :: fresh = .false.                 !! that point is a start whose contacts carry nothing: held in its tangent
      type(critical_points_t), pointer :: home => null() !! the critical points of the path that a branch left, or its own
      real(wp) :: left_at = 0.0_wp               !! arc_length where the branch left, or the step began
      type(critical_points_t), pointer :: critical_points => null() !! of this step or branch, in order
   end type path_state_t

contains

   !> A run, copied out of line as copy_problem does.
   subroutine copy_path_state(from, to)
      type(path_state_t), intent(in) :: from
      type(path_state_t), intent(inout) :: to
      to = from
   end subroutine copy_path_state

   !> Tangent at a converged state at which the system is factored, pointing the way the run goes: that of the chord from the
   !> last accepted point, or what the strategy prescribes, for increments of load or displacement must be of their sign.
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

   !> Probe at a converged state at which the system is factored.
   type(test_values_t) function test_values_at(problem, run, state, heading) result(probe)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: state
      type(path_tangent_t), intent(in) :: heading     !! tangent there
      probe = new_test_values(problem, state, run%system, heading%load)
   end function test_values_at

   !> Adds the stretch from the run's last point to a new one. A corner turns the path there: the tangents are those inside.
   subroutine leave_trail(problem, run, place, heading)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: place
      type(path_tangent_t), intent(in) :: heading     !! of the path that arrives there
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

   !> What belongs to the nodes of the mesh that the run leaves.
   subroutine forget_mesh(run)
      type(path_state_t), intent(inout) :: run
      if (allocated(run%control%tangent)) deallocate (run%control%tangent)
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      if (allocated(run%trail)) deallocate (run%trail)
      run%slopes = slopes_t(closer=run%slopes%closer)
      call run%finer%forget()
      if (allocated(run%footing)) deallocate (run%footing)
   end subroutine forget_mesh

   !> True for a trial point on the way that the run has come.
   logical function turned_back(problem, run, trial, ahead)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! tangent there
      integer :: k
      turned_back = .false.
      if (.not. allocated(run%trail)) return
      ! Where nothing moves the tangent is rounding.
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
      & released)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      character(*), intent(in) :: label
      type(state_t), intent(in) :: state
      type(state_t), intent(in) :: trial         !! the next point
      real(wp), intent(in) :: part               !! of the way there
      real(wp), intent(in) :: arc_length
      integer, intent(in) :: pivots              !! negative ones before it
      integer, intent(in) :: multiplicity
      real(wp), intent(in), optional :: scale    !! see event_t
      type(error_bars_t), allocatable, intent(in), optional :: bars
      type(problem_t), intent(in), optional :: free  !! what leaves it does so without contacts that carry no force: the problem
      type(state_t), intent(in), optional :: released !! and the state there without them
      type(critical_point_t) :: landmark
      landmark%label = label
      call copy_problem(problem, landmark%problem)
      landmark%state = state
      landmark%point = run%points
      landmark%pivots = pivots
      landmark%multiplicity = multiplicity
      landmark%arc_length = arc_length
      landmark%direction = displacement_between(problem, run%state, state)
      landmark%drift = landmark%direction - part * displacement_between(problem, run%state, trial)
      landmark%direction_load = state%load_factor - run%state%load_factor
      landmark%control = run%control
      if (present(scale)) landmark%scale = scale
      if (present(bars)) landmark%bars = bars
      if (present(free)) then
         landmark%direction = carried_field(problem, state, landmark%direction, free, released)
         landmark%drift = carried_field(problem, state, landmark%drift, free, released)
         call copy_problem(free, landmark%problem)
         landmark%state = released
      end if
      call run%critical_points%keep(landmark)
   end subroutine keep_critical_point
end module path_state
