!> Records that the path loop passes to the listing and the result file: one for each point, one for each critical point.
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

   !> One connected contact region. A point contact has start = end.
   type :: region_t
      integer :: contact = 0                  !! index into model%contact
      real(wp) :: start = 0.0_wp, end = 0.0_wp !! stress-free arc length along the candidates' chain
      real(wp) :: angle_start = 0.0_wp, angle_end = 0.0_wp !! [degrees] from the obstacle's reference direction; NaN for lines
      integer :: contact_span(2) = 0          !! numbers of the contact spans in which the region begins and ends, see
      !! contact_spans; 0: contact at nodes, with a foundation, or not yet numbered
      logical :: line = .false.               !! true: both ends are touchdown points of a line contact
      type(error_bar_t) :: bar(2)             !! error bars of start and end
   end type region_t

   !> One accepted equilibrium point.
   type, extends(record_t) :: point_t
      integer :: step = 0                     !! 1, 2, ... as in the deck
      character(2) :: label = ''              !! blank, or LP, BP, TP, C+, C-, UZ, EP
      real(wp) :: load_factor = 0.0_wp
      real(wp) :: arc_length = 0.0_wp         !! sum of the dimensionless arc lengths from the start
      integer :: iterations = 0
      real(wp) :: residual = 0.0_wp           !! relative
      integer :: negative_pivots = 0          !! number of negative pivots of the tangent on the null space of the active
      !! constraints
      integer :: free_pivots = 0              !! negative pivots after contacts that carry no force are released
      integer :: active_contacts = 0
      integer :: lcp_size = 0, lcp_pivots = 0 !! largest LCP and all pivots of this increment
      character(:), allocatable :: warning    !! one sentence, if the results become doubtful at this point
      real(wp), allocatable :: monitor(:)
      real(wp), allocatable :: rate(:)        !! (1 + monitors) d(load factor), d(monitors) / d(arc length); not allocated: the path
      !! may have a kink there
      type(error_bars_t), allocatable :: bars !! discretisation errors; not allocated: not requested
      type(region_t), allocatable :: region(:)        !! allocated only if the model has contacts
      real(wp), allocatable :: reaction_total(:)      !! (n_contacts) sum of the normal reactions
      real(wp), allocatable :: obstacle_force(:, :)   !! (2, n_obstacles) total force of each obstacle on the structure
      real(wp), allocatable :: obstacle_shift(:, :)   !! (2, n_obstacles) displacement of the obstacles, if one moves
      real(wp), allocatable :: obstacle_turn(:)       !! (n_obstacles) rotation of the obstacles [rad], if one moves
      ! Fields: allocated only if the deck requests them at this point.
      real(wp), allocatable :: displacement(:, :)     !! (3, n_nodes)
      real(wp), allocatable :: section_forces(:, :, :) !! (3, 2, n_elements) N, Q, M at both ends
      real(wp), allocatable :: reaction(:)            !! (nodes of all contacts, in the deck's order) contact reaction of the node
      real(wp), allocatable :: reaction_density(:)    !! (as reaction) reaction per length of the rod [force/length]
      real(wp), allocatable :: gap(:)                 !! (as reaction) gap of the node
      real(wp), allocatable :: contact_point(:, :)    !! (2, as reaction) position of reaction and gap: contact nodes move along the
      !! rod
      real(wp), allocatable :: contact_force(:, :)    !! (6, forces) of contact spans at points and ends of lines, see span_pushes
      real(wp), allocatable :: contact_pressure(:, :) !! (6, samples) contact pressure along line contacts, see span_pushes
   end type point_t

   !> A located critical point.
   type, extends(record_t) :: critical_t
      character(2) :: label = ''
      integer :: step = 0
      integer :: point = 0                    !! row of its point in /path, from 1
      real(wp) :: load_factor = 0.0_wp
      logical :: located = .true.             !! false: bracketed, but not found to the tolerance
      real(wp), allocatable :: monitor(:)
      type(error_bars_t), allocatable :: bars !! discretisation errors; not allocated: not requested
      character(:), allocatable :: note       !! remark in words, for the listing
      real(wp), allocatable :: null_vector(:, :, :) !! (3, n_nodes, multiplicity) BP only: largest displacement 1
   end type critical_t

   !> Start of a path: the branch, or the path of the steps, to which the following points belong, and the bifurcation at which the
   !> branch leaves its parent path.
   type, extends(record_t) :: branch_start_t
      integer :: branch = 0                   !! number in the result file, from 1; 0: back on the path of the steps
      character(name_length) :: name = ''
      integer :: step = 0                     !! step of the deck
      integer :: of = 0                       !! branch from which this one starts, 0: the path of the steps
      integer :: bifurcation = 0              !! number of the bifurcation (BP) on that path within the step
      integer :: mode = 0                     !! number of the null vector
      integer :: side = 0                     !! 1: in its direction, -1: in the opposite direction
      integer :: point = 0                    !! row of that bifurcation in the other path, from 1
   end type branch_start_t

   !> Results of a buckling step.
   type, extends(record_t) :: buckling_t
      integer :: step = 0
      real(wp), allocatable :: load_factor(:) !! (modes) factors on the step's loads, smallest magnitude first
      real(wp), allocatable :: residual(:)    !! (modes) relative residual of the eigenvalue problem, computed independently
      real(wp), allocatable :: mode(:, :, :)  !! (3, n_nodes, modes) largest displacement 1
      type(error_bar_t), allocatable :: bar(:) !! (modes) errors of the load factors; not allocated: not requested
      character(:), allocatable :: unbarred   !! reason why there are no error bars, in words
   end type buckling_t

   !> One limit point of a limit curve.
   type, extends(record_t) :: limit_point_t
      integer :: step = 0
      integer :: curve = 0                    !! index into step%limit_curve
      real(wp) :: parameter = 0.0_wp
      logical :: rigid = .false.              !! true: the obstacle was rigid (parameter: infinity)
      real(wp) :: load_factor = 0.0_wp
      integer :: iterations = 0               !! Newton iterations of all its corrections
      real(wp) :: residual = 0.0_wp           !! relative, of equilibrium
      real(wp) :: load_rate = 0.0_wp          !! d(load factor)/d(arc length), zero at the limit point, over its starting value
      real(wp), allocatable :: monitor(:)
      type(error_bars_t), allocatable :: bars !! discretisation errors; not allocated: not requested
      character(2) :: label = ''              !! blank; TP: the parameter turns back; EP: end of the curve
   end type limit_point_t

   !> Receiver of points as the path loop finds them; the path loop knows only this interface.
   type, abstract :: recorder_t
   contains
      procedure(take_record), deferred :: take
      procedure(want_state), deferred :: wants_state
      procedure(take_state), deferred :: state
   end type recorder_t

   abstract interface
      !> Receives a record. A point is received before a critical point at it, and the bifurcation at which a branch starts is
      !> received before the start of the branch. All points and critical points after that start belong to the branch.
      subroutine take_record(self, record, error)
         import :: recorder_t, record_t, error_t
         class(recorder_t), intent(inout) :: self
         class(record_t), intent(in) :: record
         type(error_t), allocatable, intent(out) :: error !! the record could not be written: the run must stop
      end subroutine take_record

      !> True if a checkpoint of the run is to be written.
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
