!> The model that the deck describes; it does not change while a path is followed.
!>
!> Lengths, forces and moments have the consistent units of the deck. Degrees of freedom of a node are always (u, v, rotation):
!> components 1, 2, 3 of every nodal array; rotations are positive anticlockwise.
module model
   use kinds, only: wp, name_length
   use obstacle_types, only: obstacle_t
   use length_table, only: length_table_t
   use load_pattern, only: load_t, new_load
   use distribution, only: distribution_t
   use cross_section, only: section_t
   implicit none
   private
   public :: model_t, mesh_t, curve_t, path_t, imperfection_t, section_t, node_set_t, load_t, law_t, contact_t
   public :: tie_t, joint_spring_t, release_t, contact_print_t, contact_part_t, obstacle_of, elements_among
   public :: monitor_t, step_t, threshold_t, branch_t, mode_offset_t, limit_curve_t
   public :: family_ul2, family_ge
   public :: shape_none, shape_sine, shape_cosine, shape_clamped, shape_nodal
   public :: quantity_displacement, quantity_reaction, quantity_contact, quantity_section
   public :: method_words, parameter_words, same_component, supports
   public :: method_load, method_displacement, method_cylindrical, method_spherical, method_linearised, &
      & method_minimum_residual, method_variable_load, method_generalised, method_largest
   public :: parameter_modulus, parameter_gap, parameter_imperfection, parameter_ea, parameter_ei, parameter_constant_load
   public :: new_load, obstacles_move, empty_lists

   ! Element families (words of the deck: UL2, GE2, GE4, GE6, GE8):
   integer, parameter :: family_ul2 = 1 !! straight updated-Lagrangian element of Silveira & Goncalves (2001)
   integer, parameter :: family_ge = 2  !! geometrically exact, Gauss collocation with `stages` points

   ! Shapes of imperfections, see imperfection_t:
   integer, parameter :: shape_none = 0, shape_sine = 1, shape_cosine = 2, shape_clamped = 3, shape_nodal = 4

   integer, parameter :: quantity_displacement = 1, quantity_reaction = 2, quantity_contact = 3, quantity_section = 4

   !> Increment strategies. The deck names them by these words, in the order of the numbers.
   character(*), parameter :: method_words = 'LOAD|DISPLACEMENT|CYLINDRICAL|SPHERICAL|LINEARISED|MINIMUM RESIDUAL|'// &
      & 'VARIABLE LOAD|GENERALISED DISPLACEMENT|LARGEST DISPLACEMENT'
   integer, parameter :: method_load = 1, method_displacement = 2, method_cylindrical = 3, &
      & method_spherical = 4, method_linearised = 5, method_minimum_residual = 6, method_variable_load = 7, &
      & method_generalised = 8, method_largest = 9

   !> Parameters of limit curves, see limit_curve_t. The deck names them by these words, in the order of the numbers.
   character(*), parameter :: parameter_words = 'MODULUS|GAP|IMPERFECTION|EA|EI|CONSTANT LOAD'
   integer, parameter :: parameter_modulus = 1, parameter_gap = 2, parameter_imperfection = 3, parameter_ea = 4, &
      & parameter_ei = 5, parameter_constant_load = 6

   !> The spline that a nominal curve follows. It is rotated, scaled and moved to the curve's first point.
   type :: path_t
      type(obstacle_t) :: shape         !! obstacle with the shape of the spline: its track at distance 0 is the spline
      real(wp) :: start = 0.0_wp        !! arc length of the spline at the first point of the curve
      real(wp) :: scale = 1.0_wp        !! lengths along the nominal curve over lengths along the spline
      real(wp) :: point(2) = 0.0_wp     !! point of the spline at arc length `start`
      real(wp) :: angle = 0.0_wp        !! direction of the spline at this point [rad]
   end type path_t

   !> A nominal (perfect) stress-free curve: straight if curvature = 0, else a circular arc; or a spline.
   type :: curve_t
      real(wp) :: origin(2) = 0.0_wp    !! first point of the curve (x, y)
      real(wp) :: angle = 0.0_wp        !! direction of the tangent at the first point [rad]
      real(wp) :: curvature = 0.0_wp    !! d(angle)/ds, positive if the curve turns anticlockwise [1/length]
      real(wp) :: length = 0.0_wp
      integer :: imperfection = 0       !! index into model%imperfection; 0: none
      real(wp) :: offset = 0.0_wp       !! coordinate of the first point along the chain of the imperfection
      integer :: table = 0              !! index into the length tables of the imperfection
      type(path_t), allocatable :: path !! the spline, if the curve is neither a line nor an arc; curvature is then not used
   end type curve_t

   !> A stress-free offset w(s) of the axis to the left of the nominal curve; s is the coordinate from 0 to `length` along its
   !> chain.
   !>   sine:    sum a_k sin(n_k pi s/L + p_k)        cosine: sum a_k cos(n_k pi s/L + p_k)
   !>   clamped: a_1 sin^2(pi s/L) + a_2 (3 sqrt(3)/2) sin^2(pi s/L) cos(pi s/L)   (two values)
   !>   nodal:   quintic spline through (knot, value), odd at its ends or, on a closed chain, periodic
   type :: imperfection_t
      integer :: shape = shape_none
      real(wp) :: length = 0.0_wp
      real(wp), allocatable :: amplitude(:)   !! amplitudes a_k; for `nodal` the offsets at the knots
      real(wp), allocatable :: half_waves(:)  !! numbers of half waves n_k (sine, cosine)
      real(wp), allocatable :: phase(:)       !! phases p_k [rad] (sine, cosine)
      real(wp), allocatable :: knot(:)        !! chain coordinates of the knots (nodal)
      real(wp), allocatable :: slope(:), bend(:) !! first and second derivatives at the knots (nodal)
      type(length_table_t), allocatable :: table(:) !! length tables, one for each curvature of the nominal curves; see
      !! measure_curves
   end type imperfection_t

   !> Nodes, elements and the stress-free geometry on which they lie.
   type :: mesh_t
      integer :: n_nodes = 0, n_elements = 0
      integer, allocatable :: node_label(:)     !! number of each node in the deck
      real(wp), allocatable :: x(:, :)          !! (2, n_nodes) stress-free positions, imperfections included
      real(wp), allocatable :: x_nominal(:, :)  !! (2, n_nodes) positions on the perfect geometry
      integer, allocatable :: element_label(:)
      integer, allocatable :: node(:, :)        !! (2, n_elements) indices of the first and second node
      integer, allocatable :: family(:)         !! (n_elements) family_ul2 or family_ge
      integer, allocatable :: stages(:) !! (n_elements) number of Gauss points of GE elements, half of their order; 0 for UL2
      integer, allocatable :: section(:)        !! (n_elements) index into model%section
      integer, allocatable :: curve(:)          !! (n_elements) index into model%curve; 0: straight between its nodes
      real(wp), allocatable :: s(:, :)          !! (2, n_elements) coordinates of both ends on the nominal curve
      logical, allocatable :: placed(:) !! (n_elements) true: the deck leaves the number of elements open. The program then computes
      !! with its own mesh; these elements only define where output is given
   end type mesh_t

   !> A displacement or rotation that depends on others: u = sum of factor u_k + [(R - 1) arm], with the rotation matrix R of node
   !> `turner`.
   !>
   !> A tie may depend on nodes tied by earlier ties, but not by later ones: the values can be computed in the order of the ties.
   type :: tie_t
      integer :: node = 0, component = 0        !! node and component that the tie determines
      integer, allocatable :: of(:), part(:)    !! (terms) nodes and components u_k on which it depends
      real(wp), allocatable :: factor(:)        !! (terms) factor of each u_k
      integer :: turner = 0                     !! node whose rotation rotates the arm; 0: none
      real(wp) :: arm(2) = 0.0_wp               !! stress-free arm [length]; it enters components 1 and 2
   end type tie_t

   !> A linear spring between the same component of two nodes; its force is zero at the start.
   type :: joint_spring_t
      integer :: node(2) = 0
      integer :: component = 0
      real(wp) :: stiffness = 0.0_wp
   end type joint_spring_t

   !> Element ends at a node that do not have all displacements of the node: they get a node of their own.
   type :: release_t
      integer :: node = 0                       !! the node in the deck
      integer :: own = 0                        !! the node of the released element ends
      logical :: free(3) = .false.              !! true for components that are independent of the deck's node
   end type release_t

   !> A named set of nodes.
   type :: node_set_t
      character(name_length) :: name = ''
      integer, allocatable :: node(:)           !! indices (not labels) of the nodes, in the deck's order
   end type node_set_t

   !> Reaction of a foundation as a function of the penetration: piecewise linear, the first point is (0, 0).
   type :: law_t
      character(name_length) :: name = ''
      real(wp), allocatable :: penetration(:), force(:) !! penetrations, increasing [length]; reactions at these penetrations
      !! [force/area]
   end type law_t

   !> Contact with one of several obstacles that form a wall.
   type :: contact_part_t
      integer :: obstacle = 0
      integer, allocatable :: node(:)           !! indices of the candidate nodes
   end type contact_part_t

   !> A contact of the deck: candidate nodes for contact with one obstacle.
   type :: contact_t
      integer :: obstacle = 0
      integer, allocatable :: node(:)           !! indices of the candidate nodes, in the deck's order
      real(wp) :: gap = 0.0_wp !! parameter GAP, added to the geometric gap (half the depth of the rod: negative) [length]
      logical :: along = .false. !! true: rigid obstacle with which contact is possible anywhere along the rod, so that there are
      !! contact spans (choose_spans)
      logical :: distributed = .false.          !! true: foundation whose reactions act along the elements, not at the nodes
      logical :: spans = .false. !! true: the contact has contact spans at present; false: it acts at nodes or with a foundation
      character(:), allocatable :: needs !! property that is missing for contact along the rod, if contact acts at nodes although
      !! the deck does not request this; not allocated: none
      type(contact_part_t), allocatable :: part(:) !! pieces of a wall of several obstacles (wall_pieces); not allocated: a single
      !! obstacle
   end type contact_t

   !> A column of the listing: beginning or end of a region of contact with an obstacle.
   type :: contact_print_t
      integer :: obstacle = 0
      logical :: at_end = .false.               !! true: end of the region; false: its beginning
      logical :: angle = .false. !! true: the place is shown as an angle about the obstacle's centre [degrees]; false: as an arc
      !! length
      integer :: region = 1                     !! number of the region, counted along the rods
   end type contact_print_t

   !> A monitor: a number that the deck observes along the path.
   type :: monitor_t
      character(name_length) :: name = ''
      integer :: quantity = quantity_displacement
      integer :: component = 1 !! 1, 2, 3: u, v, rotation, or the corresponding reaction (contact force: in x, in y, normal);
      !! section quantity: row of the table section_kind
      integer :: obstacle = 0                   !! contact force: index of the obstacle whose reactions are summed
      integer, allocatable :: node(:) !! displacement: nodes over which the mean is taken; reaction: nodes over which the sum is
      !! taken
      integer, allocatable :: element(:)        !! section quantity: elements of a set, in the order of the set
      real(wp) :: place = 0.0_wp                !! section quantity: arc length along the elements, unless `largest`
      logical :: largest = .false.              !! section quantity: true: the largest magnitude along the elements
      logical :: where = .false.                !! section quantity: true: the number is the position of the largest magnitude
      real(wp) :: factor = 1.0_wp, offset = 0.0_wp !! value = offset + factor * quantity
   end type monitor_t

   !> A stop or a located point: the load factor (monitor 0) or a monitor reaches a value.
   type :: threshold_t
      integer :: monitor = 0
      real(wp) :: value = 0.0_wp
      logical :: rising = .true. !! for stops only: true: the value must be passed upwards (ABOVE); false: downwards (BELOW)
   end type threshold_t

   !> A path that starts at a bifurcation of another path.
   type :: branch_t
      character(name_length) :: name = ''
      integer :: of = 0 !! path that is left: 0: the step's own path; else index into step%branch, smaller than the index of this
      !! branch
      integer :: bifurcation = 1                !! number of the bifurcation (BP) on that path, counted within the step
      integer :: mode = 1                       !! number of the null vector (a multiple bifurcation has several)
      integer :: side = 1                       !! 1: the branch starts along the null vector; -1: against it
      logical :: both = .false. !! true: the card requests both sides; the branch on the opposite side is another entry
      integer :: max_points = 0
      real(wp) :: increment = 0.0_wp            !! arc length of the first increment; 0: the program chooses it (see branches)
      type(threshold_t), allocatable :: stop(:)
   end type branch_t

   !> A buckling mode as stress-free offset: the normal component of the mode, scaled so that its largest value is `amplitude`.
   type :: mode_offset_t
      integer :: step = 0                       !! number of an earlier step, a buckling step that computes the mode
      integer :: mode = 0
      real(wp) :: amplitude = 0.0_wp            !! largest offset, with its sign [length]
      integer, allocatable :: element(:)        !! elements of a chain of generated curves, in their order
      integer :: line = 0                       !! line of the offset's card in the deck
   end type mode_offset_t

   !> A limit curve: a limit point of this step is followed while a second parameter varies.
   type :: limit_curve_t
      character(name_length) :: name = ''
      integer :: limit_point = 1                !! number of the limit point (LP) on the step's own path
      integer :: parameter = parameter_modulus
      integer :: obstacle = 0 !! parameters modulus and gap: index into model%obstacle (gap: of all contacts with it)
      character(name_length) :: set = '' !! parameters EA, EI, and imperfection (factor on its amplitudes): element set that the
      !! card names
      integer, allocatable :: element(:)        !! elements of this set
      logical :: logarithmic = .false.          !! true: increments are those of the parameter's decimal logarithm
      logical :: to_rigid = .false. !! parameter modulus: true: after the last value the limit point with a rigid obstacle is
      !! computed, too
      real(wp) :: increment = 0.0_wp            !! first increment of the parameter, with its sign
      real(wp) :: last = 0.0_wp                 !! value of the parameter at which the curve ends
      real(wp) :: largest = 0.0_wp              !! largest increment of the parameter
      real(wp), allocatable :: at(:)            !! values of the parameter at which a limit point is computed
      integer :: max_points = 0
   end type limit_curve_t

   !> One *STEP of the deck. Its constant loads are those that previous steps left.
   type :: step_t
      character(name_length) :: name = ''
      type(load_t) :: load                      !! loads that are multiplied by the load factor
      integer :: method = method_cylindrical
      integer :: monitor = 0                    !! displacement control: index into model%monitor of the controlled monitor
      real(wp) :: increment = 0.0_wp            !! first increment of the load factor; under displacement control of the monitor
      real(wp) :: smallest = 0.0_wp, largest = 0.0_wp !! limits of the increment; with arc-length strategies of the arc length [-]
      logical :: smallest_given = .false.       !! true: the deck gives the smallest increment
      integer :: n_modes = 0                    !! number of buckling modes; > 0: a buckling step, which follows no path
      integer :: tangent_updates = huge(1) !! number of new tangents in an increment after the predictor: huge: full Newton, 0:
      !! modified Newton, 1: one update
      logical :: paper_loop = .false.           !! true: contact is solved by the loop in Fig. 2 of Silveira & Goncalves (2001)
      real(wp) :: tolerance = 0.0_wp !! relative residual at which the iteration ends (defaults are in the card table only)
      real(wp) :: sharper = 1.0_wp !! part of the tolerance that the requested errors need; it is reduced as far as rounding allows
      logical :: tolerance_given = .false.      !! true: the deck gives the tolerance, which the program then never changes
      real(wp) :: locate_tolerance = 0.0_wp     !! tolerance of located events, relative
      integer :: max_iterations = 0
      integer :: desired_iterations = 0
      integer :: max_points = 0
      logical :: error_bars = .true.            !! true: critical points and the end of the step get error bars
      logical :: bars_everywhere = .false.      !! true: all points get error bars
      real(wp) :: widest_bar = 0.0_wp !! largest accepted error bar over the magnitude of its value; a run with a wider one fails
      real(wp) :: asked = 0.0_wp !! requested relative error at critical points and at the end of the step, for which meshes are
      !! made; 0: none
      real(wp) :: asked_of_path = 0.0_wp        !! requested relative error at all other points; 0: none
      integer, allocatable :: asked_of(:)       !! monitors to which the requested error applies; 0: the load factor
      type(threshold_t), allocatable :: stop(:), locate(:)
      integer, allocatable :: turning(:)        !! monitors whose turning points are located
      type(branch_t), allocatable :: branch(:)
      type(limit_curve_t), allocatable :: limit_curve(:)
      type(mode_offset_t), allocatable :: mode_offset(:) !! size > 0: the step starts from the stress-free structure with these
      !! imperfections
      integer :: field_every = 0                !! fields are stored at every n-th point; 0: never
      logical :: field_displacement = .false., field_section_forces = .false.
      logical :: field_reaction = .false., field_gap = .false.
   end type step_t

   !> The whole model, see the header of this module.
   type :: model_t
      character(:), allocatable :: title        !! heading lines, newline separated
      character(:), allocatable :: job          !! parameter JOB of *HEADING; '' if the deck does not give it
      character(:), allocatable :: length_unit, force_unit !! units from *UNITS, for labels only; '' if the deck does not give them
      type(mesh_t) :: mesh
      type(curve_t), allocatable :: curve(:)
      type(imperfection_t), allocatable :: imperfection(:)
      type(distribution_t), allocatable :: distribution(:)
      type(section_t), allocatable :: section(:)
      type(node_set_t), allocatable :: node_set(:)
      logical, allocatable :: fixed(:, :)       !! (3, n_nodes) true: a support fixes the degree of freedom
      integer, allocatable :: relative(:, :) !! (3, motions) node whose displacement is a relative motion (*GAP, *SPRING), fixed
      !! where the motion is not used; the two nodes between which the motion is measured, the second one 0: the ground
      real(wp), allocatable :: spring(:, :)     !! (3, n_nodes) stiffness of springs between node and ground
      type(tie_t), allocatable :: tie(:)
      type(joint_spring_t), allocatable :: joint_spring(:)
      type(release_t), allocatable :: release(:)
      type(law_t), allocatable :: law(:)
      type(obstacle_t), allocatable :: obstacle(:)
      type(contact_t), allocatable :: contact(:)
      type(monitor_t), allocatable :: monitor(:)
      type(contact_print_t), allocatable :: contact_print(:)
      type(step_t), allocatable :: step(:)
   end type model_t

contains

   !> Makes the lists of a model with a mesh empty; nodes have neither supports nor springs. Steps and node sets are not set.
   pure subroutine empty_lists(model)
      type(model_t), intent(inout) :: model
      allocate (model%fixed(3, model%mesh%n_nodes), source=.false.)
      allocate (model%spring(3, model%mesh%n_nodes), source=0.0_wp)
      allocate (model%imperfection(0), model%distribution(0), model%section(0), model%relative(3, 0), model%tie(0))
      allocate (model%joint_spring(0), model%release(0), model%law(0), model%obstacle(0), model%contact(0), model%monitor(0))
      allocate (model%contact_print(0))
   end subroutine empty_lists

   !> Obstacle of a contact at an element: of several obstacles, the one for which both nodes are candidates.
   pure integer function obstacle_of(contact, node) result(obstacle)
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: node(2)            !! nodes of an element, with the numbers of the deck
      integer :: i
      obstacle = contact%obstacle
      if (.not. allocated(contact%part)) return
      do i = 1, size(contact%part)
         associate (part => contact%part(i))
            if (any(part%node == node(1)) .and. any(part%node == node(2))) obstacle = part%obstacle
         end associate
      end do
   end function obstacle_of

   !> (elements) True for the elements with both nodes in a list.
   pure function elements_among(mesh, node) result(among)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node(:)            !! indices of nodes
      logical :: among(mesh%n_elements), listed(mesh%n_nodes)
      listed = .false.
      listed(node) = .true.
      among = listed(mesh%node(1, :)) .and. listed(mesh%node(2, :))
   end function elements_among

   !> (3, nodes) Supports of the deck, without those of nodes that represent relative motions.
   pure function supports(model) result(fixed)
      type(model_t), intent(in) :: model
      logical :: fixed(3, model%mesh%n_nodes)
      fixed = model%fixed
      fixed(:, model%relative(1, :)) = .false.
   end function supports

   !> A tie that makes a component of one node equal to the same component of another node.
   pure type(tie_t) function same_component(node, component, of) result(tie)
      integer, intent(in) :: node, component !! node and component that the tie determines
      integer, intent(in) :: of              !! node to which it is tied
      tie = tie_t(node, component, of=[of], part=[component], factor=[1.0_wp])
   end function same_component

   !> True if any step moves an obstacle, or if a node carries an obstacle.
   pure logical function obstacles_move(model)
      type(model_t), intent(in) :: model
      integer :: s
      obstacles_move = any(model%obstacle%carrier > 0)
      do s = 1, size(model%step)
         obstacles_move = obstacles_move .or. any(abs(model%step(s)%load%motion) > 0.0_wp)
      end do
   end function obstacles_move
end module model
