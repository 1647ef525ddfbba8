!> Records that the path loop passes to the listing and the result file: one for each point, one for each critical point, and
!> others.
module path_record
   use kinds, only: wp, name_length
   use errors, only: error_t
   use error_bar, only: error_bar_t, error_bars_t
   implicit none
   private
   public :: record_t, point_t, region_t, critical_t, branch_start_t, buckling_t, limit_point_t, recorder_t

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
end module path_record
