!> Data of the equations linearised with the present contact set.
!>
!> Each node has three unknowns, in node axes and in the order of the band. At an active rigid contact the second axis is the
!> obstacle's normal, and the second unknown is eliminated. In a contact span the first unknown displaces the node along the track,
!> and the third is the rotation relative to the track; at nodes with the direction of the track the third unknown is eliminated.
!> The border of the band is in bordered_system.
module system_type
   use kinds, only: wp
   use problem, only: problem_t, carried_unknowns
   use ge_element, only: ge_columns
   use band_matrix, only: band_t, factor_t, new_band
   use active_coupling, only: active_coupling_t
   use axial_rigidity, only: rigidity_t, new_rigidity
   implicit none
   private
   public :: system_t, new_system

   !> The linearised equations at one state, and quantities measured there.
   type :: system_t
      integer :: n = 0                          !! number of unknowns
      type(band_t) :: k                         !! tangent in node axes, without elimination, with the excess stiffness of coupled
      !! ground
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling           !! coupled ground, with its excess stiffness
      real(wp), allocatable :: residual(:)      !! (n) internal less external forces, element unknowns eliminated
      real(wp), allocatable :: raw(:)           !! (n) residual from the stored section forces, without element defects
      real(wp), allocatable :: load(:)          !! (n) minus the derivative of `residual` by the load factor
      logical, allocatable :: fixed(:)          !! (n) true: eliminated by a support, tie or rigid contact
      real(wp), allocatable :: value(:)         !! (n) increment of a fixed unknown that brings it to its prescribed value
      real(wp), allocatable :: rate(:)          !! (n) derivative of a fixed unknown by the load factor
      real(wp), allocatable :: axis(:, :)       !! (2, nodes) direction of the node's first axis
      logical, allocatable :: turned(:)         !! (nodes) true: the axes are not the global axes
      real(wp), allocatable :: roll(:)          !! (nodes) rotation per displacement along the first axis, which is not part of the
      !! third unknown: curvature of the track
      real(wp), allocatable :: lean(:)          !! (nodes) displacement along the second axis per rotation, which is not part of the
      !! second unknown: at a point contact at a segment boundary the force acts beside the node
      real(wp), allocatable :: tie_block(:, :, :) !! blocks of T', see tied_nodes
      real(wp), allocatable :: arm(:, :)        !! (2, candidates) position of the node minus that of the pivot of the obstacle;
      !! zero if no node carries it
      real(wp), allocatable :: laid(:, :, :)    !! (9, 9, elements) tangent of loads on conforming elements (carried_obstacles); no
      !! elements if no obstacle is carried
      real(wp), allocatable :: slip_block(:, :, :) !! blocks of the displacements relative to the obstacle, see carried_obstacles
      type(rigidity_t) :: rigidity              !! maps of inextensible elements
      real(wp), allocatable :: tangent_stretch(:, :) !! (2, inextensible elements) artificial extension corrected in `tangent`
      real(wp), allocatable :: swing(:)         !! (ties) geometric stiffness: contribution of the tie force to the rotational
      !! stiffness of the turning node
      ! Contact, one entry for each candidate.
      real(wp), allocatable :: gap(:), normal(:, :), bend(:)
      real(wp), allocatable :: opening(:)       !! (candidates) gap to the surface as it has settled under the other reactions
      real(wp), allocatable :: motion(:, :)     !! (2, candidates) displacement of the obstacle per unit of load factor
      real(wp), allocatable :: closing(:)       !! (candidates) closing of the gap per unit of load factor, without `motion`
      integer, allocatable :: unknown(:)        !! eliminated unknown of an active rigid contact, 0 otherwise
      real(wp), allocatable :: slope(:)         !! derivative of the gap by that unknown
      integer, allocatable :: partner(:)        !! second active rigid contact of the same node in a corner; 0: none, or the
      !! candidate is the second
      logical, allocatable :: soft(:)           !! true: on a foundation, not on a rigid obstacle
      real(wp), allocatable :: spring(:)        !! foundation: stiffness, tangent value if active; on coupled ground the band's
      !! spring; 0 for a rigid obstacle
      real(wp), allocatable :: push(:)          !! foundation: reaction at the present gap of an active candidate
      ! Element data: stiffness ek, end forces ef, end forces without defects eraw, load derivatives el, operators op of the
      ! stored unknowns.
      real(wp), allocatable :: ek(:, :, :), ef(:, :), eraw(:, :), el(:, :), op(:, :, :)
      integer, allocatable :: grip(:)           !! (elements) number of quadrature points of foundations in the element's part that
      !! is in contact
      real(wp), allocatable :: eshift(:, :, :) !! (6, 2, elements) element matrix times unit translations in x and y, node axes
      ! Border of the equations: load column and constraint row, see bordered_system.
      real(wp), allocatable :: tangent(:)       !! (n) path tangent: derivative of the unknowns by the load factor
      real(wp), allocatable :: tangent_load(:)  !! (n) forces whose response in the band is `tangent`: `load` and the correction for
      !! inextensible elements
      real(wp), allocatable :: path_row(:)      !! (n) constraint row, node axes
      real(wp) :: path_corner = 0.0_wp
      integer :: negative_pivots = 0            !! number of negative pivots of the tangent on the null space of the active
      !! constraints, without `hinges`
      integer :: hinges = 0                     !! number of spurious negative pivots: clamps that are hinges in the tangent
      !! (neutral_spans), and point contacts more curved than their obstacles
      ! Rod that may roll (rolling_rods).
      integer :: roll_at = 0                    !! unknown with the spring against rolling, 0: none
      real(wp) :: roll_rate = 0.0_wp            !! change of that unknown per unit of material length rolled
      real(wp), allocatable :: roll_row(:)      !! (n) displacements of rolling, from the exact shape of the rod
      real(wp) :: roll_by = 0.0_wp              !! material length by which the rod must roll to make the line contacts before and
      !! after the clamp equal
      real(wp) :: roll_range = 0.0_wp           !! material length by which the rod may roll in either direction
      real(wp), allocatable :: rolled(:)        !! (n) rolling motion from the tangent, per unit of length
      ! Measures of the residual and of rounding in the state.
      real(wp) :: force_residual = 0.0_wp       !! relative residual of forces, from the stored section forces
      real(wp) :: defect_residual = 0.0_wp      !! largest residual inside elements: rotation [rad], position over size, force over
      !! force_scale
      real(wp) :: force_scale = 0.0_wp
      real(wp) :: gap_error = 0.0_wp            !! rounding error of gaps to foundations [length]
      real(wp) :: gap_noise = 0.0_wp            !! relative error of forces by `gap_error`
      real(wp) :: round_off = 0.0_wp            !! rounding error of force_residual, from stiff springs and UL2 elements
      logical :: ok = .true.                    !! false: an element or the matrix is singular
   end type system_t

contains

   !> Allocates the data for one problem; each linearisation reuses them.
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
      allocate (system%swing(size(problem%model%tie)), source=0.0_wp)
      allocate (system%ek(6, 6, elements), system%ef(6, elements), system%eraw(6, elements), system%el(6, elements))
      allocate (system%op(z, ge_columns, elements))
      allocate (system%grip(elements), source=0)
      allocate (system%eshift(6, 2, merge(elements, 0, any(problem%ground%founded .or. problem%immersed))))
      associate (list => problem%candidates)
         allocate (system%gap(list%n), system%normal(2, list%n), system%bend(list%n), system%slope(list%n))
         allocate (system%opening(list%n))
         allocate (system%arm(2, list%n), source=0.0_wp)
         allocate (system%laid(9, 9, merge(elements, 0, size(problem%ties%carrier) > 0)), source=0.0_wp)
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
