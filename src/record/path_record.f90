!> Records that the path loop passes to the listing and the result file: one for each point, one for each critical point, and
!> others. The worst values of a run's own checks are recorded with the point and the node or element at which they occur
!> (accuracy_t).
module path_record
   use kinds, only: wp, name_length
   use errors, only: error_t
   use error_bar, only: error_bar_t, error_bars_t
   implicit none
   private
   public :: record_t, point_t, region_t, critical_t, branch_start_t, buckling_t, limit_point_t, recorder_t, accuracy_t, worst_t, &
      & place_t, check_t, checks_of, note_worst, begin_point, take_point, check_residual, check_penetration, check_tension, &
      & check_complementarity, check_foundation, check_mesh, check_rounding, check_error_bar, check_rolling, check_strain, &
      & check_force_balance, check_moment_balance, check_node_balance

   !> A record of a path: an accepted point, a critical point, the start of a branch, and others.
   type, abstract :: record_t
   end type record_t

   !> One connected region of contact. A point contact has start = end.
   type :: region_t
      integer :: contact = 0                  !! index into model%contact
      real(wp) :: start = 0.0_wp, end = 0.0_wp !! stress-free arc lengths along the candidates' chain [length]
      real(wp) :: angle_start = 0.0_wp, angle_end = 0.0_wp !! angles from the obstacle's reference direction [degrees]; NaN for
      !! obstacles without angles
      integer :: contact_span(2) = 0 !! numbers of the contact spans in which the region begins and ends, see contact_spans; 0:
      !! contact at nodes, with a foundation, or not yet numbered
      logical :: moves(2) = .true.            !! false: the start or end is held at a segment boundary
      logical :: line = .false.               !! true: both ends are touchdown points of a line contact
      type(error_bar_t) :: bar(2)             !! error bars of start and end
   end type region_t

   !> One accepted equilibrium point.
   type, extends(record_t) :: point_t
      integer :: step = 0                     !! number of the step, as in the deck
      character(2) :: label = ''              !! label of the point: blank, LP, BP, TP, C+, C-, UZ or EP
      real(wp) :: load_factor = 0.0_wp
      real(wp) :: arc_length = 0.0_wp         !! sum of the dimensionless arc lengths of all increments since the start
      integer :: iterations = 0
      real(wp) :: residual = 0.0_wp           !! relative residual
      integer :: negative_pivots = 0          !! number of negative pivots of the tangent on the null space of the active
      !! constraints
      integer :: free_pivots = 0              !! number of negative pivots after contacts that carry no force are released
      integer :: active_contacts = 0
      integer :: lcp_size = 0, lcp_pivots = 0 !! size of the largest LCP, and number of pivots of all LCPs, in this increment
      character(:), allocatable :: warning    !! one sentence, if the results are doubtful at this point
      real(wp), allocatable :: monitor(:)
      real(wp), allocatable :: rate(:) !! (1 + monitors) derivatives of the load factor and of the monitors by arc length; not
      !! allocated: the path may have a corner there
      type(error_bars_t), allocatable :: bars !! discretisation errors; not allocated: not requested
      type(region_t), allocatable :: region(:)        !! allocated only if the model has contacts
      real(wp), allocatable :: reaction_total(:)      !! (n_contacts) sum of the normal reactions
      real(wp), allocatable :: obstacle_force(:, :)   !! (2, n_obstacles) total force of each obstacle on the structure
      real(wp), allocatable :: obstacle_shift(:, :)   !! (2, n_obstacles) displacement of the obstacles, if one moves
      real(wp), allocatable :: obstacle_turn(:)       !! (n_obstacles) rotation of the obstacles [rad], if one moves
      ! Fields; they are allocated only if the deck requests them at this point:
      real(wp), allocatable :: displacement(:, :)     !! (3, n_nodes) displacements in x and y, rotation
      real(wp), allocatable :: section_forces(:, :, :) !! (3, 2, n_elements) N, Q, M at both ends
      real(wp), allocatable :: reaction(:)            !! (nodes of all contacts, in the deck's order) contact reaction at the node
      real(wp), allocatable :: reaction_density(:)    !! (nodes of all contacts) reaction by length of the rod [force/length]
      real(wp), allocatable :: gap(:)                 !! (nodes of all contacts) gap at the node
      real(wp), allocatable :: contact_point(:, :) !! (2, nodes of all contacts) position of reaction and gap: contact nodes move
      !! along the rod
      real(wp), allocatable :: contact_force(:, :)    !! (6, forces) of contact spans at points and ends of lines, see span_forces
      real(wp), allocatable :: contact_pressure(:, :) !! (6, samples) contact pressure along line contacts, see span_forces
   end type point_t

   !> A located critical point.
   type, extends(record_t) :: critical_t
      character(2) :: label = ''
      integer :: step = 0
      integer :: point = 0                    !! row of the point in /path of the result file, from 1
      real(wp) :: load_factor = 0.0_wp
      logical :: located = .true.             !! true: located to the tolerance; false: only bracketed
      real(wp), allocatable :: monitor(:)
      type(error_bars_t), allocatable :: bars !! discretisation errors; not allocated: not requested
      character(:), allocatable :: note       !! remark in words, for the listing
      real(wp), allocatable :: null_vector(:, :, :) !! (3, n_nodes, multiplicity) for BP only: null vectors, with a largest
      !! displacement of 1
   end type critical_t

   !> Start of a path: the branch, or the path of the steps, to which all following points belong, and the bifurcation at which a
   !> branch leaves its parent path.
   type, extends(record_t) :: branch_start_t
      integer :: branch = 0                   !! number of the branch in the result file, from 1; 0: back on the path of the steps
      character(name_length) :: name = ''
      integer :: step = 0                     !! number of the step in the deck
      integer :: of = 0                       !! branch from which this one starts; 0: the path of the steps
      integer :: bifurcation = 0              !! number of the bifurcation (BP) on the parent path, counted within the step
      integer :: mode = 0                     !! number of the null vector along which the branch starts
      integer :: side = 0                     !! 1: in the direction of the null vector; -1: in the opposite direction
      integer :: point = 0                    !! row of the bifurcation in the results of the parent path, from 1
   end type branch_start_t

   !> Results of a buckling step.
   type, extends(record_t) :: buckling_t
      integer :: step = 0
      real(wp), allocatable :: load_factor(:) !! (modes) factors on the step's loads, in ascending order of magnitude
      real(wp), allocatable :: residual(:)    !! (modes) relative residual of the eigenvalue problem, computed independently
      real(wp), allocatable :: mode(:, :, :)  !! (3, n_nodes, modes) modes, with a largest displacement of 1
      type(error_bar_t), allocatable :: bar(:) !! (modes) errors of the load factors; not allocated: not requested
      character(:), allocatable :: unbarred   !! reason, in words, why there are no error bars
   end type buckling_t

   !> One limit point of a limit curve.
   type, extends(record_t) :: limit_point_t
      integer :: step = 0
      integer :: curve = 0                    !! index into step%limit_curve
      real(wp) :: parameter = 0.0_wp
      logical :: rigid = .false.              !! true: the obstacle was rigid (parameter: infinity)
      real(wp) :: load_factor = 0.0_wp
      integer :: iterations = 0               !! number of Newton iterations in all corrections for this point
      real(wp) :: residual = 0.0_wp           !! relative residual of equilibrium
      real(wp) :: load_rate = 0.0_wp !! d(load factor)/d(arc length), which is zero at the limit point, over its starting value
      real(wp), allocatable :: monitor(:)
      type(error_bars_t), allocatable :: bars !! discretisation errors; not allocated: not requested
      character(2) :: label = ''              !! label: blank; TP: the parameter turns back; EP: end of the curve
   end type limit_point_t

   !> Receiver of points as the path loop finds them. The path loop knows receivers only by this interface.
   type, abstract :: recorder_t
   contains
      procedure(take_record), deferred :: take
      procedure(want_state), deferred :: wants_state
      procedure(take_state), deferred :: state
   end type recorder_t

   abstract interface
      !> Receives a record. A point is passed before a critical point at the same place, and the bifurcation at which a branch
      !> starts before the start of the branch. All points and critical points that follow this start belong to the branch.
      subroutine take_record(self, record, error)
         import :: recorder_t, record_t, error_t
         class(recorder_t), intent(inout) :: self
         class(record_t), intent(in) :: record
         type(error_t), allocatable, intent(out) :: error !! allocated: the record could not be written, and the run must stop
      end subroutine take_record

      !> True if a checkpoint of the run must be written.
      logical function want_state(self)
         import :: recorder_t
         class(recorder_t), intent(inout) :: self
      end function want_state

      !> Receives a checkpoint: the state of the run, with all records so far, from which another run of the program can continue.
      subroutine take_state(self, words, error)
         import :: recorder_t, error_t
         class(recorder_t), intent(inout) :: self
         integer, intent(in), contiguous :: words(:)
         type(error_t), allocatable, intent(out) :: error
      end subroutine take_state
   end interface

   !> Position of a measured value in a run. Labels are those of the deck; 0: the whole structure.
   type :: place_t
      integer :: branch = 0                   !! number of the branch in the result file; 0: the path of the steps
      integer :: step = 0
      integer :: point = 0                    !! row in the results of this path, from 1
      real(wp) :: load_factor = 0.0_wp
      integer :: node = 0
      integer :: element = 0
   end type place_t

   !> Worst value of one check so far, and its position.
   type :: worst_t
      real(wp) :: value = 0.0_wp
      type(place_t) :: at                     !! position of the value; point 0: no value yet
   end type worst_t

   !> Checks of a run, in the order of the listing:
   enum, bind(c)
      enumerator :: check_residual = 1   !! largest relative residual
      enumerator :: check_penetration    !! largest penetration of a rigid obstacle over the structure's size
      enumerator :: check_tension        !! largest tensile reaction beyond the tolerance, over the largest reaction
      enumerator :: check_complementarity !! largest |reaction * gap| over (largest reaction * size)
      enumerator :: check_foundation     !! foundations at nodes: largest |reaction - reaction by the law for the gap|, over the
      !! largest reaction
      enumerator :: check_mesh           !! measure of element length over its limit, see mesh_adequacy
      enumerator :: check_rounding       !! rounding error over the stiffness along the path, see tangent_rounding
      enumerator :: check_error_bar      !! widest error bar of a critical load, over the largest load factor of its step
      enumerator :: check_rolling !! range of rolling in both directions that the loads leave undetermined, over the structure's
      !! size, see rolling_rods
      enumerator :: check_strain         !! largest strain of the rods, see largest_strain
      enumerator :: check_force_balance  !! |loads + supports + contact| over the force scale
      enumerator :: check_moment_balance !! |sum of moments about the structure's middle| over the force scale and the structure's
      !! size
      enumerator :: check_node_balance !! largest sum of the forces on a node (or of the moments over the structure's size), without
      !! components that supports carry, over the force scale
   end enum
   integer, parameter :: n_checks = check_node_balance
   logical, parameter :: of_point(n_checks) = [.true., .true., .true., .true., .true., .false., .false., .false., .false., &
      & .false., .true., .true., .true.] !! true: the check is measured at a single point

   !> Worst values over all accepted points. The routines that compute them share no code with the solver.
   type :: accuracy_t
      type(worst_t) :: worst(n_checks)        !! worst value of each check, indexed by check_...
      character(:), allocatable :: strain_words !! message about the strain; allocated if the strain is not small
      character(:), allocatable :: rolling_words !! position and kind of rolling; allocated if a point exists at which a rod can
      !! roll
      character(:), allocatable :: undetermined_words !! monitors that rolling leaves undetermined; allocated if there are any
      character(:), allocatable :: bar_words !! name of the critical load with the widest bar; allocated if the bar is wider than
      !! the deck allows
      character(:), allocatable :: mesh_words !! elements, reason and remedy; allocated if the measure of element length is above
      !! its limit
      real(wp) :: force = 0.0_wp              !! largest force of the run so far: reference value of the balances
      real(wp) :: load = 0.0_wp               !! largest magnitude of the load factor in a step so far
      integer :: load_step = 0                !! step in which the largest load factor occurred
      real(wp) :: reaction = 0.0_wp           !! largest reaction at a node of the run so far
      real(wp) :: asked = 0.0_wp              !! tolerance of displacements that the deck requests, over the structure's size
      real(wp) :: stiffness = 0.0_wp !! stiffness along the path at the last point without a label: reference value of
      !! check_rounding
      character(:), allocatable :: rounding_words !! message about rounding and its remedy; allocated if rounding is too large
   end type accuracy_t

   !> One check of a run, for listing and result file.
   type :: check_t
      character(15) :: name = ''              !! name of the check in the result file
      character(38) :: head = ''              !! heading of the check in the listing
      character(200) :: description = ''
      type(worst_t) :: worst
      logical :: of_contact = .false.         !! true: structures without contact do not have this check
      logical :: if_found = .false.           !! true: the check is shown only if some point has a value
   end type check_t

   !> Words and properties of each check in listing and result file.
   type(check_t), parameter :: check(n_checks) = [ &
      & check_t('residual', 'relative residual', 'largest relative residual of all points'), &
      & check_t('penetration', 'penetration / size of the structure', 'largest penetration of a rigid obstacle over the '// &
      & 'size of the structure', of_contact=.true.), &
      & check_t('tension', 'tension / largest reaction', 'largest tensile reaction over the largest reaction', &
      & of_contact=.true.), &
      & check_t('complementarity', 'complementarity violation', 'largest |reaction * gap| over largest reaction * size of '// &
      & 'the structure', of_contact=.true.), &
      & check_t('foundation', 'reactions and law of foundations', 'largest difference between a reaction of a foundation '// &
      & 'at a node and that of its gap over the largest reaction', of_contact=.true.), &
      & check_t('mesh', 'mesh: longest element / allowed', 'longest element beside or in contact: N h^2/EI, or the error '// &
      & 'that it makes, over what the mesh can carry', of_contact=.true.), &
      & check_t('rounding', 'rounding / stiffness along the path', 'largest part of the stiffness along the path that is '// &
      & 'rounding'), &
      & check_t('error_bar', 'error bar of a critical load / load', 'widest error bar of a critical load over the largest '// &
      & 'load factor of its step so far; point 0: there is none', if_found=.true.), &
      & check_t('rolling', 'roll left open / size of the structure', 'largest way over the size of the structure that a '// &
      & 'rod may roll about its clamp, either way, as the loads do not tell; displacements are those in the middle; point '// &
      & '0: it may not', if_found=.true.), &
      & check_t('strain', 'largest strain of the rods', 'largest strain of the rods without heat, with that of bending '// &
      & 'where the shape of the section is given; the rod theory assumes that it is small; point 0: there is none', &
      & if_found=.true.), &
      & check_t('force_balance', 'balance of forces', 'largest |loads + supports + contact| over the force scale'), &
      & check_t('moment_balance', 'balance of moments', 'largest sum of all moments about the middle of the structure '// &
      & 'over the moment scale'), &
      & check_t('node_balance', 'balance of every node', 'largest force, or moment over the size, that is left at a node '// &
      & 'without its supports, over the force scale')]

contains

   !> All checks with their worst values, in the order of the listing.
   function checks_of(accuracy) result(list)
      type(accuracy_t), intent(in) :: accuracy
      type(check_t) :: list(n_checks)
      list = check
      list%worst = accuracy%worst
   end function checks_of

   !> Stores a value if it is worse than all values before.
   pure subroutine note_worst(accuracy, check, value, place, node, element)
      type(accuracy_t), intent(inout) :: accuracy
      integer, intent(in) :: check            !! index of the check, check_...
      real(wp), intent(in) :: value
      type(place_t), intent(in) :: place
      integer, intent(in), optional :: node, element !! labels of the node and the element to which the value belongs
      associate (worst => accuracy%worst(check))
         if (value <= worst%value) return
         worst%value = value
         worst%at = place
         if (present(node)) worst%at%node = node
         if (present(element)) worst%at%element = element
      end associate
   end subroutine note_worst

   !> Accuracy record for a single point: reference forces are those of the run so far, measured values are zero.
   pure function begin_point(accuracy) result(here)
      type(accuracy_t), intent(in) :: accuracy
      type(accuracy_t) :: here
      here = accuracy
      where (of_point) here%worst = worst_t()
   end function begin_point

   !> Replaces the worst values by those of a point, where these are worse; they were measured in the record from begin_point.
   pure subroutine take_point(accuracy, here)
      type(accuracy_t), intent(inout) :: accuracy
      type(accuracy_t), intent(in) :: here
      accuracy%force = here%force
      accuracy%reaction = here%reaction
      where (here%worst%value > accuracy%worst%value) accuracy%worst = here%worst
   end subroutine take_point
end module path_record
