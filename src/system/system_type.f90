!> Type of the equations linearised with the present contact set.
!>
!> Each node has three unknowns, in the axes of the node (node axes) and in the order of the band. At an active rigid contact the
!> second axis is the normal of the obstacle, and the second unknown is eliminated. In a contact span the first unknown displaces
!> the node along the track, the curve on which the rod's axis lies in contact. The third unknown is the rotation relative to the
!> track; at nodes that have the direction of the track it is eliminated. The border of the band matrix is described in
!> bordered_system.
module system_type
   use kinds, only: wp
   use problem, only: problem_t, carried_unknowns
   use ge_element, only: ge_columns
   use band_matrix, only: band_t, factor_t, new_band
   use active_coupling, only: active_coupling_t
   use axial_rigidity, only: rigidity_t, new_rigidity
   use node_matrices, only: node_matrices_t
   use rod_load, only: inner_forces_t
   implicit none
   private
   public :: system_t, new_system

   !> The linearised equations at one state, and quantities measured at this state.
   type :: system_t
      integer :: n = 0                          !! number of unknowns
      type(band_t) :: k !! band matrix: tangent in node axes, without elimination, with the excess stiffness of coupled ground
      type(node_matrices_t) :: at_nodes         !! all parts of the tangent except elements and interface points, node axes
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling           !! coupled ground, with the excess stiffness that it has in the band matrix
      real(wp), allocatable :: residual(:)      !! (n) internal minus external forces, with the element unknowns eliminated
      real(wp), allocatable :: raw(:) !! (n) residual from the stored section forces, without elimination of the element unknowns
      real(wp), allocatable :: load(:)          !! (n) minus the derivative of `residual` by the load factor
      logical, allocatable :: fixed(:)          !! (n) true: eliminated by a support, tie or rigid contact
      real(wp), allocatable :: value(:)         !! (n) for a fixed unknown: increment that brings it to its prescribed value
      real(wp), allocatable :: rate(:)          !! (n) for a fixed unknown: derivative of its prescribed value by the load factor
      real(wp), allocatable :: axis(:, :)       !! (2, nodes) unit vector of the node's first axis
      logical, allocatable :: turned(:)         !! (nodes) true: the axes of the node are not the global axes
      real(wp), allocatable :: roll(:) !! (nodes) rotation that a unit displacement along the first axis causes in addition to the
      !! third unknown: curvature of the track
      real(wp), allocatable :: lean(:) !! (nodes) displacement along the second axis that a unit rotation causes in addition to the
      !! second unknown: at a point contact at a segment boundary the force acts beside the node
      real(wp), allocatable :: tie_block(:, :, :) !! (3, 3, ties) blocks of the derivative dT/dq; u = T(q) are the displacements of
      !! tied nodes as functions of the unknowns q, see tied_nodes
      real(wp), allocatable :: arm(:, :) !! (2, candidates) vector from the point about which the obstacle turns to the
      !! candidate's node; zero if the obstacle is not carried by a node
      real(wp), allocatable :: slip_block(:, :, :) !! (3, 3, ties) blocks of the displacements relative to carried obstacles, see
      !! carried_obstacles
      type(rigidity_t) :: rigidity              !! linear maps of inextensible elements
      real(wp), allocatable :: tangent_stretch(:, :) !! (2, inextensible elements) artificial extension that was corrected in
      !! `tangent`
      ! Contact; the last or only dimension is over the candidates:
      real(wp), allocatable :: gap(:), normal(:, :), bend(:)
      real(wp), allocatable :: opening(:) !! gap to the surface of coupled ground as it has settled under the reactions at other
      !! candidates
      real(wp), allocatable :: motion(:, :)     !! (2, candidates) derivative of the obstacle's displacement by the load factor
      real(wp), allocatable :: closing(:)       !! decrease of the gap by the load factor, in addition to that by `motion`
      integer, allocatable :: unknown(:)        !! eliminated unknown of an active rigid contact; 0: none
      real(wp), allocatable :: slope(:)         !! derivative of the gap by the eliminated unknown
      integer, allocatable :: partner(:) !! second active rigid contact at the same node in a corner; 0: the candidate has no
      !! partner, or is itself the second contact
      logical, allocatable :: soft(:)           !! true: the candidate is on a foundation; false: on a rigid obstacle
      real(wp), allocatable :: spring(:) !! stiffness of the foundation: tangent stiffness if active; on coupled ground the spring
      !! in the band matrix; 0 for a rigid obstacle
      real(wp), allocatable :: push(:)          !! reaction of the foundation at the present gap of an active candidate
      ! Element data: stiffness ek, end forces ef if the equations inside the element are satisfied, end forces eraw for the stored
      ! section forces as they are, load derivatives el, update operators op of the stored unknowns:
      real(wp), allocatable :: ek(:, :, :), ef(:, :), eraw(:, :), el(:, :), op(:, :, :)
      type(inner_forces_t), allocatable :: inner(:) !! (elements) forces of foundations inside the element
      real(wp), allocatable :: eshift(:, :, :) !! (6, 2, elements) element matrix times a unit translation in x and in y, node axes
      ! Border of the equations: load column and constraint row, see bordered_system:
      real(wp), allocatable :: tangent(:)       !! (n) path tangent: derivative of the unknowns by the load factor, node axes
      real(wp), allocatable :: tangent_load(:) !! (n) forces to which `tangent` is the response of the band matrix: `load` plus the
      !! correction for inextensible elements
      real(wp), allocatable :: path_row(:)      !! (n) constraint row, node axes
      real(wp) :: path_corner = 0.0_wp
      integer :: negative_pivots = 0 !! number of negative pivots of the tangent on the null space of the active constraints,
      !! without those counted by `hinges`
      integer :: hinges = 0 !! number of negative pivots that do not indicate instability. They belong to clamps that are hinges in
      !! the tangent (rolling_rods), and to point contacts at which the rod is more curved than the obstacle
      ! Rod that may roll along a wall (rolling_rods):
      integer :: roll_at = 0                    !! unknown that has the spring against rolling; 0: none
      real(wp) :: roll_rate = 0.0_wp            !! change of this unknown by the material length rolled
      real(wp), allocatable :: roll_row(:)      !! (n) displacements of the rolling motion, from the exact shape of the rod
      real(wp) :: roll_by = 0.0_wp !! material length by which the rod must roll so that the line contacts before and after the
      !! clamp have equal lengths
      real(wp) :: roll_range = 0.0_wp           !! material length by which the rod may roll in each direction
      real(wp), allocatable :: rolled(:)        !! (n) rolling motion as it follows from the tangent, by the length rolled
      ! Measures of the residual and of rounding at the state:
      real(wp) :: force_residual = 0.0_wp !! residual of forces, computed from the stored section forces, divided by the force scale
      real(wp) :: defect_residual = 0.0_wp !! largest residual inside elements: rotation [rad], position over the structure's size,
      !! force over force_scale
      real(wp) :: force_scale = 0.0_wp !! largest force in the structure, to which residuals and reactions are related
      real(wp) :: gap_error = 0.0_wp            !! rounding error of gaps to foundations [length]
      real(wp) :: gap_noise = 0.0_wp            !! error of forces caused by `gap_error`, divided by the force scale
      real(wp) :: round_off = 0.0_wp            !! rounding error of force_residual that comes from stiff springs and UL2 elements
      logical :: ok = .true.                    !! false: an element or the tangent is singular
   end type system_t

contains

   !> Allocates the arrays of the linearised equations of a problem; later linearisations of the same problem reuse these arrays.
   function new_system(problem) result(system)
      type(problem_t), intent(in) :: problem
      type(system_t) :: system
      integer :: n, nodes, elements, z, c
      n = problem%n_unknowns
      nodes = problem%model%mesh%n_nodes
      elements = problem%model%mesh%n_elements
      z = maxval(problem%z_size)
      system%n = n
      system%k = new_band(n, problem%numbering%half_bandwidth, carried_unknowns(problem))
      allocate (system%residual(n), system%raw(n), system%load(n), source=0.0_wp)
      allocate (system%value(n), system%rate(n), system%path_row(n), source=0.0_wp)
      allocate (system%fixed(n), source=.false.)
      allocate (system%axis(2, nodes), source=0.0_wp)
      allocate (system%turned(nodes), source=.false.)
      allocate (system%roll(nodes), system%lean(nodes), source=0.0_wp)
      allocate (system%tie_block(3, 3, size(problem%ties%of)), source=0.0_wp)
      system%slip_block = system%tie_block
      system%rigidity = new_rigidity(problem)
      allocate (system%tangent_stretch(2, system%rigidity%n), source=0.0_wp)
      allocate (system%ek(6, 6, elements), system%ef(6, elements), system%eraw(6, elements), system%el(6, elements))
      allocate (system%op(z, ge_columns, elements))
      allocate (system%inner(elements))
      allocate (system%eshift(6, 2, merge(elements, 0, any(problem%ground%founded .or. problem%immersed))))
      associate (list => problem%candidates)
         allocate (system%gap(list%n), system%normal(2, list%n), system%bend(list%n), system%slope(list%n))
         allocate (system%opening(list%n))
         allocate (system%arm(2, list%n), source=0.0_wp)
         allocate (system%motion(2, list%n), system%closing(list%n), source=0.0_wp)
         allocate (system%unknown(list%n), system%partner(list%n), source=0)
         allocate (system%spring(list%n), system%push(list%n), source=0.0_wp)
         allocate (system%soft(list%n), source=.false.)
         do c = 1, list%n
            system%slope(c) = 1.0_wp
            associate (obstacle => problem%model%obstacle(list%obstacle(c)))
               system%soft(c) = .not. obstacle%rigid
               if (system%soft(c)) system%spring(c) = obstacle%modulus * list%tributary(c)
            end associate
            if (problem%coupling%entry(c) > 0) system%spring(c) = 1.0_wp / problem%coupling%local(problem%coupling%entry(c))
         end do
      end associate
      allocate (system%tangent(n), system%tangent_load(n), source=0.0_wp)
      allocate (system%rolled(n), system%roll_row(n), source=0.0_wp)
   end function new_system
end module system_type
