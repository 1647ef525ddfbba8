!> What the linearised equations about the present contact set consist of.
!>
!> Unknowns: three a node in band order, in axes of the node (turned so that the second is the obstacle's normal where a
!> rigid contact is active; that unknown is then eliminated). In a contact span the third is the rotation less that of the
!> track there, on which the first one moves the node: a node that follows the track keeps it at zero. The border of this
!> band is in bordered_system.
module system_type
   use kinds, only: wp
   use problem, only: problem_t
   use ge_element, only: ge_columns
   use band_matrix, only: band_t, factor_t, new_band
   use active_coupling, only: active_coupling_t
   use axial_rigidity, only: rigidity_t, new_rigidity
   implicit none
   private
   public :: system_t, new_system

   type :: system_t
      integer :: n = 0                          !! unknowns of the band
      type(band_t) :: k                         !! tangent, node axes, nothing eliminated, ground too stiff by its excess
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling           !! with the excess
      real(wp), allocatable :: residual(:)      !! (n) condensed internal minus external forces
      real(wp), allocatable :: raw(:)           !! (n) the same from the stored resultants, without element defects
      real(wp), allocatable :: load(:)          !! (n) minus its derivative by the load factor
      logical, allocatable :: fixed(:)          !! (n) eliminated: supports and rigid contacts
      real(wp), allocatable :: value(:)         !! (n) increment of a fixed unknown that closes its own error
      real(wp), allocatable :: rate(:)          !! (n) its derivative by the load factor
      real(wp), allocatable :: axis(:, :)       !! (2, nodes) direction of the node's first axis
      logical, allocatable :: turned(:)         !! (nodes) the axes differ from the global ones
      real(wp), allocatable :: roll(:)          !! (nodes) rotation per displacement along the first axis that the third unknown
      !! does not count: the curvature of the track of a contact span
      real(wp), allocatable :: lean(:)          !! (nodes) displacement along the second axis per rotation by the third unknown that
      !! the second does not count: a point contact held at its node has its force beside it
      real(wp), allocatable :: tie_block(:, :, :) !! see tied_nodes
      type(rigidity_t) :: rigidity              !! inextensible elements
      real(wp), allocatable :: tangent_stretch(:, :) !! (2, inextensible elements) what is given back to them in `tangent`
      real(wp), allocatable :: swing(:)         !! (ties) what their forces add to the stiffness against rotation of their turners
      ! Contact, one entry a candidate.
      real(wp), allocatable :: gap(:), normal(:, :), bend(:)
      real(wp), allocatable :: opening(:)       !! gap to the surface as other reactions have settled it
      real(wp), allocatable :: motion(:, :)     !! (2, candidates) of the obstacle, per unit of load factor
      real(wp), allocatable :: closing(:)       !! (candidates) of the gap besides that, per unit of load factor
      integer, allocatable :: unknown(:)        !! eliminated unknown of an active rigid contact, 0 otherwise
      real(wp), allocatable :: slope(:)         !! gap per unit of that unknown
      integer, allocatable :: partner(:)        !! second active rigid contact of the same node, in a corner; 0: none, or it is one
      logical, allocatable :: soft(:)           !! on a foundation, not a rigid obstacle
      real(wp), allocatable :: spring(:)        !! soft: reaction per gap, at the present one where active, or the band's
      !! share of a ground that couples; 0 for rigid
      real(wp), allocatable :: push(:)          !! soft: the reaction that belongs to the gap of an active one
      ! Elements.
      real(wp), allocatable :: ek(:, :, :), ef(:, :), eraw(:, :), el(:, :), op(:, :, :)
      integer, allocatable :: grip(:)           !! (elements) quadrature points of its foundations: which parts touch
      real(wp), allocatable :: eshift(:, :, :) !! (6, 2, elements) element matrix times unit translations in x and y, node axes
      ! Border.
      real(wp), allocatable :: tangent(:)       !! (n) derivative along the path by the load factor
      real(wp), allocatable :: tangent_load(:)  !! (n) forces that the band answers with it: `load`, and what makes inextensible
      !! elements as short as they are
      real(wp), allocatable :: path_row(:)      !! (n) node axes
      real(wp) :: path_corner = 0.0_wp
      integer :: negative_pivots = 0            !! of the tangent on the null space of the active constraints, without those of
      !! the hinges
      integer :: hinges = 0                     !! clamps that are hinges in the tangent, each with a negative pivot of its own
      !! (neutral_spans), and points more curved than their obstacles, which have one, too
      ! A rod that may roll (rolling_rods).
      integer :: roll_at = 0                    !! unknown that a spring holds, 0: none
      real(wp) :: roll_rate = 0.0_wp            !! of that unknown, per unit of material length that the rod rolls
      real(wp), allocatable :: roll_row(:)      !! (n) displacements in which it rolls, of the exact rod
      real(wp) :: roll_by = 0.0_wp              !! so far must it roll that the lines beside the clamp are of one length
      real(wp) :: roll_range = 0.0_wp           !! that far either way it may [length]
      real(wp), allocatable :: rolled(:)        !! (n) the motion in which it rolls, per unit
      ! Measures of the state itself.
      real(wp) :: force_residual = 0.0_wp       !! relative, from the stored resultants
      real(wp) :: defect_residual = 0.0_wp      !! internal: rotations [rad], positions over the size, forces over force_scale
      real(wp) :: force_scale = 0.0_wp
      real(wp) :: gap_error = 0.0_wp            !! of the gaps to foundations, by rounding [length]
      real(wp) :: gap_noise = 0.0_wp            !! what that makes of the forces, relative
      real(wp) :: round_off = 0.0_wp            !! of force_residual, from stiff springs and UL2 elements
      logical :: ok = .true.                    !! false: an element or the matrix was singular
   end type system_t

contains

   !> Storage for one problem, reused for every linearisation.
   function new_system(problem) result(system)
      type(problem_t), intent(in) :: problem
      type(system_t) :: system
      integer :: n, nodes, elements, z, c
      n = problem%n_unknowns
      nodes = problem%model%mesh%n_nodes
      elements = problem%model%mesh%n_elements
      z = maxval(problem%z_size)
      system%n = n
      system%k = new_band(n, problem%numbering%half_bandwidth)
      allocate (system%residual(n), system%raw(n), system%load(n), source=0.0_wp)
      allocate (system%value(n), system%rate(n), system%path_row(n), source=0.0_wp)
      allocate (system%fixed(n), source=.false.)
      allocate (system%axis(2, nodes), source=0.0_wp)
      allocate (system%turned(nodes), source=.false.)
      allocate (system%roll(nodes), system%lean(nodes), source=0.0_wp)
      allocate (system%tie_block(3, 3, size(problem%ties%of)), source=0.0_wp)
      system%rigidity = new_rigidity(problem)
      allocate (system%tangent_stretch(2, system%rigidity%n), source=0.0_wp)
      allocate (system%swing(size(problem%model%tie)), source=0.0_wp)
      allocate (system%ek(6, 6, elements), system%ef(6, elements), system%eraw(6, elements), system%el(6, elements))
      allocate (system%op(z, ge_columns, elements))
      allocate (system%grip(elements), source=0)
      allocate (system%eshift(6, 2, merge(elements, 0, any(problem%ground%founded))))
      associate (list => problem%candidates)
         allocate (system%gap(list%n), system%normal(2, list%n), system%bend(list%n), system%slope(list%n))
         allocate (system%opening(list%n))
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
