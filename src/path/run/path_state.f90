!> State of a run along a path: the last accepted point, and the history on which later increments depend. An event located inside
!> an increment is kept with its state (located_event_t).
module path_state
   use kinds, only: wp
   use archive, only: archive_t
   use model, only: method_load, method_displacement, step_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use mesh_density, only: mesh_density_t
   use path_control, only: control_t, displacement_between, path_length
   use error_bar, only: error_bars_t
   use enriched_problem, only: enriched_problem_t
   use mesh_request, only: refinement_t
   use critical_points, only: critical_point_t, critical_points_t
   use displacement_functional, only: monitor_change
   use path_continuity, only: path_tangent_t, path_tangent_at, chord_between
   use path_record, only: region_t
   use path_point, only: path_point_t
   use linear_system, only: system_t
   use path_events, only: event_t
   use corrector, only: increment_t
   implicit none
   private
   public :: path_state_t, recent_path_t, trail_part_t, slopes_t, onset_t, since_change_t, point_on_mesh_t, mesh_history_t, &
      & arrived_t, copy_path_state, path_tangent_of, new_critical_point, append_recent_part, forget_mesh, rest_of_mesh, &
      & difference_load, located_event_t, note_balance

   integer, parameter :: rest_of_mesh = 10 !! number of accepted points after a refinement during which no coarser mesh is tried

   !> The path between two neighbouring accepted points, with the path tangents at both ends.
   type :: recent_path_t
      type(state_t) :: from, to
      real(wp), allocatable :: chord(:, :)       !! (3, nodes) difference of the displacements at the two points
      type(path_tangent_t) :: first, last
   end type recent_path_t

   !> A stored part of the path. It is allocatable, so that it moves in the list without a copy.
   type :: trail_part_t
      type(recent_path_t), allocatable :: way
   end type trail_part_t

   integer, parameter :: trail_length = 3 !! number of stored parts of the recent path; a path that reverses meets the latest parts
   !! first

   !> A point of the path together with the problem (mesh and contact set) for which it was computed.
   type :: point_on_mesh_t
      type(problem_t) :: problem
      type(path_point_t) :: point
   end type point_on_mesh_t

   !> The mesh at the last accepted point: its error estimates, and the meshes before and after it.
   type :: mesh_history_t
      type(enriched_problem_t) :: enriched       !! enriched problem, from which error estimates are computed
      type(refinement_t) :: refinement           !! results of the refinements tried for the present point
      type(mesh_density_t), allocatable :: coarser(:) !! (rod segments) density of a coarser mesh that is accurate enough for the
      !! last point; not allocated: none
      type(point_on_mesh_t), allocatable :: before_coarsening !! problem and point to which the run returns if no point is accepted
      !! on the coarser mesh
      integer :: points_to_keep = 0              !! number of further points for which the mesh must not be coarsened
      logical :: change_behind = .false. !! true: on the present mesh a point contact becomes a line contact before the last
      !! accepted point
   end type mesh_history_t

   !> Derivatives of the test values of contact spans by arc length.
   type :: slopes_t
      real(wp), allocatable :: here(:)           !! derivatives at the last accepted point; not allocated: unknown
      real(wp), allocatable :: ahead(:)          !! derivatives at the trial point
      integer :: closer = 0 !! number of times that the increment from the last accepted point was shortened to obtain these
      !! derivatives
      logical :: rough = .false. !! true: several shortenings were not enough, because the tests are not smooth along the path
   end type slopes_t

   !> Effects of the last contact change on the following points.
   type :: since_change_t
      logical :: shrunk = .false. !! true: a line contact has just become a point contact, and the stored test values are still
      !! those of the line contact. An eigenvalue may have changed its sign at this change; smooth_zero finds it. The flag is set by
      !! continuing_with_set and valid until the next point (event_recording)
      real(wp) :: at = 0.0_wp                    !! arc length at the last contact change
   end type since_change_t

   !> Path tangent with which the path arrives at the last accepted point if the contact changes there. The path leaves this point
   !> with another tangent, so that the load may turn there (corner_limit).
   type :: arrived_t
      integer :: point = 0 !! row of the point in the results; 0: no contact change at the point, or its limit point is already
      !! reported
      real(wp) :: load_rate = 0.0_wp             !! d(load factor)/d(arc length) with which the path arrives
      real(wp) :: load_factor = 0.0_wp
      real(wp), allocatable :: monitor(:)
      type(error_bars_t), allocatable :: bars    !! error bars of the point; not allocated: unknown
   end type arrived_t

   !> A point contact that begins at the next point of the path.
   type :: onset_t
      type(region_t), allocatable :: region      !! region of the new contact; not allocated: no contact begins
      integer :: element = 0                     !! element in which the contact begins; 0: none
   end type onset_t

   !> State of a run along a path. One type contains all data of this state, so that the procedures of the path loop have short
   !> argument lists.
   type :: path_state_t
      type(path_point_t) :: last                 !! the last accepted point
      type(control_t) :: control                 !! constraint of the next increment
      real(wp) :: arc_length = 0.0_wp            !! arc length since the start of the run
      integer :: branch = 0 !! index of the present branch in the result file; 0: the run is on the path of the steps
      integer :: points = 0                      !! points recorded so far, in all steps
      real(wp) :: recorded_load = 0.0_wp !! load factor of the point recorded last; after a remeshing last%state may have another
      !! load factor
      integer :: step_points = 0                 !! points accepted in this step
      integer :: spans_begun = 0 !! number of contact spans that have begun so far; it is also the identity number of the newest
      !! contact span
      type(onset_t) :: onset                     !! point contact that begins at the next point
      logical :: on_bifurcation = .false. !! true: the last point is a recorded bifurcation, and the signs of its vanishing pivots
      !! are rounding
      type(since_change_t) :: since_change       !! effects of the last contact change that still hold
      real(wp) :: motion(2) = 0.0_wp             !! largest displacement [length] and largest rotation [rad] of a node so far
      type(mesh_history_t) :: mesh
      real(wp) :: last_length = 0.0_wp, last_load = 0.0_wp !! arc length and load change of the last increment
      type(arrived_t) :: arrived                 !! tangent with which the path arrives at the last accepted point
      type(slopes_t) :: slopes
      type(trail_part_t), allocatable :: trail(:)   !! parts of the path before the last accepted point, the latest part first
      logical :: fresh = .false. !! true: the last point is an unloaded start. Its contacts carry no force and are kept closed in
      !! its tangent
      type(critical_points_t), pointer :: home => null() !! critical points of the parent path, if the run is on a branch; on the
      !! path of a step, the critical points of this path itself
      real(wp) :: left_at = 0.0_wp               !! arc length at the start of the branch or step
      type(critical_points_t), pointer :: critical_points => null() !! critical points of this step or branch, in the order of the
      !! path
      type(archive_t), pointer :: frame => null() !! frame of the checkpoints of the present path (see module checkpoint)
   end type path_state_t

   !> An event inside an increment, before and after it is located.
   type :: located_event_t
      type(event_t) :: event
      type(path_point_t) :: point              !! located point, or the nearest one found
      type(increment_t) :: report !! report of the correction to the point, or of the residual of an interpolated state
      real(wp) :: fraction = 1.0_wp            !! position of the event between the last accepted point and the trial, 0 to 1
      type(error_bars_t), allocatable :: bars  !! error bars of the event; not allocated: the deck requests none
      logical :: located = .false.               !! true: the event was located; false: it is only bracketed
      real(wp) :: tangent_turn = 0.0_wp !! bifurcation: turn of the path tangent, between the two points that enclose the
      !! bifurcation, by a unit force along the null vector; a small imperfection makes it a smooth turn of the path
      logical :: later = .false. !! bifurcation: true: it lies behind the trial, whose vanishing pivots have the signs of rounding
   end type located_event_t

contains

   !> Copies a path state. The copy is a procedure, because the compiler would otherwise write out the copies of all components at
   !> each assignment.
   subroutine copy_path_state(from, to)
      type(path_state_t), intent(in) :: from
      type(path_state_t), intent(inout) :: to
      to = from
   end subroutine copy_path_state

   !> Path tangent, in the direction of travel, at a point whose state and system are known. The direction of travel is that of the
   !> chord from the last accepted point. Under load or displacement control it is instead the direction in which the change of the
   !> controlled quantity has the sign of the increment.
   type(path_tangent_t) function path_tangent_of(problem, run, point) result(tangent)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: point
      real(wp) :: ahead
      associate (state => point%state, system => point%system)
         select case (run%control%method)
         case (method_load)
            tangent = path_tangent_at(problem, system, 0.0_wp * state%u, run%control%increment)
         case (method_displacement)
            ahead = monitor_change(problem, run%control%monitor, state, system, system%tangent, 1.0_wp)
            tangent = path_tangent_at(problem, system, 0.0_wp * state%u, sign(1.0_wp, ahead * run%control%increment))
         case default
            tangent = path_tangent_at(problem, system, displacement_between(problem, run%last%state, state), &
               & state%load_factor - run%last%state%load_factor)
         end select
      end associate
   end function path_tangent_of

   !> Adds the part of the path between the last accepted point and a new point to the stored recent path. At a contact change the
   !> path has a corner and two tangents; the stored tangents belong to the part that is added.
   subroutine append_recent_part(problem, run, point)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: point    !! the new point; its tangent belongs to the path before it
      type(trail_part_t), allocatable :: longer(:)
      integer :: k
      if (.not. allocated(run%trail)) allocate (run%trail(0))
      allocate (longer(min(size(run%trail) + 1, trail_length)))
      do k = 2, size(longer)
         call move_alloc(run%trail(k - 1)%way, longer(k)%way)
      end do
      allocate (longer(1)%way)
      associate (way => longer(1)%way)
         way%from = run%last%state
         way%to = point%state
         way%chord = chord_between(problem, run%last%state, point%state)
         way%first = run%last%tangent
         way%last = point%tangent
      end associate
      call move_alloc(longer, run%trail)
   end subroutine append_recent_part

   !> Discards all data that refer to the nodes of the previous mesh.
   subroutine forget_mesh(run)
      type(path_state_t), intent(inout) :: run
      if (allocated(run%control%tangent)) deallocate (run%control%tangent)
      if (allocated(run%control%previous)) deallocate (run%control%previous)
      if (allocated(run%trail)) deallocate (run%trail)
      run%slopes = slopes_t(closer=run%slopes%closer)
      call run%mesh%enriched%forget()
      if (allocated(run%mesh%before_coarsening)) deallocate (run%mesh%before_coarsening)
   end subroutine forget_mesh

   !> Makes a critical point at a place between the last accepted point and the next one. It gets the number of the point recorded
   !> last, and the data that all critical points have. The caller adds the data of its kind (see critical_point_t) and stores it.
   function new_critical_point(problem, run, label, place, pivots) result(critical_point)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      character(*), intent(in) :: label !! LP, BP, C+ or C-; '': a contact change without label
      type(state_t), intent(in) :: place
      integer, intent(in) :: pivots              !! number of negative pivots before the critical point
      type(critical_point_t) :: critical_point
      critical_point%label = label
      call copy_problem(problem, critical_point%problem)
      critical_point%state = place
      critical_point%point = run%points
      critical_point%pivots = pivots
      critical_point%arc_length = run%arc_length + path_length(problem, run%last%state, place)
      critical_point%direction = displacement_between(problem, run%last%state, place)
      critical_point%direction_load = place%load_factor - run%last%state%load_factor
      critical_point%drift = 0.0_wp * critical_point%direction
      critical_point%control = run%control
   end function new_critical_point

   !> Change of the load factor that finite differences use.
   pure real(wp) function difference_load(run) result(step)
      type(path_state_t), intent(in) :: run
      step = 1.0e-4_wp * max(abs(run%last_load), 1.0e-3_wp * abs(run%last%state%load_factor))
   end function difference_load

   !> Computes the residual of a state that was interpolated, not iterated. `balanced` is true if the residual is within tolerance
   !> or rounding.
   pure subroutine note_balance(step, system, report, balanced)
      type(step_t), intent(in) :: step
      type(system_t), intent(in) :: system      !! assembled at the interpolated state
      type(increment_t), intent(inout) :: report
      logical, intent(out) :: balanced !! true: the residual is within tolerance or rounding
      report%residual = max(system%force_residual, system%defect_residual)
      balanced = report%residual <= max(step%tolerance, system%round_off)
   end subroutine note_balance
end module path_state
