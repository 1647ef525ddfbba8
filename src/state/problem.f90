!> Data of the problem that are constant as long as mesh, contact set and step do not change: the model on a mesh, its numbering,
!> and constants derived from both.
!>
!> The working mesh is the deck's mesh or another mesh (remeshed_problem): `deck` is the model on the deck's mesh, `model` the same
!> model on the working mesh. Cards of the deck refer to material points. A material point is given by a rod segment of the layout
!> and a coordinate along this segment.
module problem
   use kinds, only: wp
   use model, only: model_t, load_t, new_load
   use rod_samples, only: middle_section
   use element_families, only: collocates
   use rod_layout, only: layout_t, new_layout
   use mesh_density, only: mesh_density_t, new_demands
   use remeshed_model, only: division_t, new_remeshed_model
   use numbering, only: numbering_t, new_numbering
   use tie_pattern, only: tie_pattern_t, new_tie_pattern, coupled_pairs
   use gauss_tableau, only: tableau_t, max_stages, new_tableau
   use ge_stages, only: ge_stiffness_t, ge_compliance, forbid_stretch
   use ge_element, only: ge_size
   use ul2_element, only: ul2_size
   use rod_geometry, only: geometry_t, new_geometry
   use reference_curve, only: curve_length
   use candidates, only: candidates_t, new_candidates
   use initial_overlap, only: deepest_overlap, deepest_start
   use contact_spans, only: contact_span_t
   use obstacle_geometry, only: obstacle_gap
   use ground, only: ground_t, new_ground
   use ground_mark, only: mark_t
   use ground_coupling, only: coupling_t, new_coupling
   implicit none
   private
   public :: problem_t, new_problem, remeshed_problem, derive_problem, rounding_gap, touching_gap, same_place, dof, &
      & unknown_weights, moments_as_forces, copy_problem, carried_unknowns, carried_by
   public :: mesh_sampled, mesh_of_marks, mesh_of_spans

   ! Kinds of meshes, by the points of the rod to which nodes are attached:
   integer, parameter :: mesh_fixed = 0                  !! nodes are fixed material points
   integer, parameter :: mesh_sampled = 1                !! nodes are fixed material points, close enough to detect contact at the
   !! start
   integer, parameter :: mesh_of_marks = 2               !! nodes follow interface points: ends of foundation contact and corners of
   !! foundation laws
   integer, parameter :: mesh_of_spans = 3               !! nodes follow touchdown points of contact spans and interface points of
   !! foundations

   !> Data of the problem, see the header of this module.
   type :: problem_t
      ! The two models are polymorphic, although they are always of type model_t: the compiler then calls procedures that copy and
      ! release a model, and does not expand both with all components in each procedure that has a problem. A model must be
      ! deallocated before another is assigned to it; otherwise the memory of its components is lost.
      class(model_t), allocatable :: model               !! the model on the working mesh
      class(model_t), allocatable :: deck                !! the model on the deck's mesh
      type(layout_t) :: layout                           !! rod segments of the deck
      type(mesh_density_t), allocatable :: demand(:)           !! (rod segments) mesh density of the next mesh
      logical :: deck_mesh = .true.                      !! true: the working mesh is the deck's mesh, with the same nodes
      integer, allocatable :: rod_segment(:)             !! (elements) rod segment to which the element belongs
      real(wp), allocatable :: origin(:) !! (elements) coordinate along the rod segment minus nominal coordinate of the same point
      integer, allocatable :: along(:)                   !! (elements) all elements in order, segment by segment
      integer, allocatable :: element_first(:)           !! (rod segments) index in `along` of the segment's first element
      integer, allocatable :: element_last(:) !! (rod segments) index in `along` of the segment's last element; except on the deck's
      !! mesh along(i) = i
      integer, allocatable :: mesh_node(:) !! (deck's nodes) mesh node at the same point if the deck's node is a segment boundary;
      !! else 0
      type(numbering_t) :: numbering
      type(tie_pattern_t) :: ties                        !! tied nodes and the nodes that they follow
      type(candidates_t) :: candidates                   !! candidates of contact at nodes
      type(coupling_t) :: coupling                       !! ground that couples candidates: its compliance between candidates
      type(ground_t) :: ground                           !! foundations that act inside elements
      type(tableau_t) :: tableau(max_stages)
      type(ge_stiffness_t), allocatable :: compliance(:) !! (elements) compliances of the element
      logical, allocatable :: pressurised(:)             !! (elements) true: a pressure acts in some step
      logical, &
         & allocatable :: immersed(:)                !! (elements) true: a pressure that depends on the position acts in some step
      integer, allocatable :: z_size(:)                  !! (elements) number of stored unknowns
      type(mark_t), allocatable :: mark(:) !! interface points: ends of foundations' contact, and corners of foundation laws
      real(wp), allocatable :: chain_start(:, :) !! (rod segments, contacts) coordinate along the chain of the contact at which the
      !! segment begins
      real(wp), allocatable :: chain_length(:) !! (contacts) length of the chain of the contact if it is closed; 0: it is open
      logical, allocatable :: covered(:, :) !! (rod segments, contacts) true: contact spans are allowed on the whole segment; false:
      !! nowhere on it
      integer :: mesh_kind = mesh_fixed
      type(contact_span_t), allocatable :: contact_span(:) !! contact spans in their order along the rods; the positions of their
      !! ends are those for which this mesh was made
      integer, allocatable :: conforms(:) !! (elements) candidate at the first node of an element that lies on a track; 0: the
      !! element is free
      integer, allocatable :: hinge(:) !! nodes of clamps that are hinges in the tangent, because a free span in neutral equilibrium
      !! is beside them (rolling_rods)
      integer :: rolling = 0                             !! node of a clamp about which a closed rod may roll; 0: none
      real(wp), allocatable :: overlap(:) !! (contacts) distance by which the obstacle is withdrawn at the start [length], the same
      !! on every mesh
      real(wp), allocatable :: coordinates(:, :) !! (2, deck's nodes) coordinates at the start, to which stored displacements refer
      integer, allocatable :: beside(:, :) !! (2, nodes) element that ends at the node and element that begins there; 0: none
      type(load_t) :: constant                           !! constant loads that the steps before this one left
      integer :: step = 1
      integer :: n_unknowns = 0                          !! number of unknowns, three for each node
      real(wp) :: size = 1.0_wp                          !! diagonal of the bounding box of the structure
      logical :: resting = .false.                       !! true: all tensionless foundations touch the structure at the start
      real(wp) :: force_floor = 0.0_wp                   !! lower bound of the force scale: rounding of EI/size^2
      real(wp), allocatable :: weight(:) !! (nodes) share of the rod's length over size^2, the weight of the node in the arc-length
      !! metric
   contains
      procedure :: has_spans
      procedure :: moves_nodes
      procedure :: is_sampled
   end type problem_t

contains

   !> True if the nodes of the mesh follow contact spans.
   pure logical function has_spans(problem)
      class(problem_t), intent(in) :: problem
      has_spans = problem%mesh_kind == mesh_of_spans
   end function has_spans

   !> True if nodes of the mesh move along the rods.
   pure logical function moves_nodes(problem)
      class(problem_t), intent(in) :: problem
      moves_nodes = problem%mesh_kind == mesh_of_spans .or. problem%mesh_kind == mesh_of_marks
   end function moves_nodes

   !> True for the mesh at the start of a path whose nodes detect contact.
   pure logical function is_sampled(problem)
      class(problem_t), intent(in) :: problem
      is_sampled = problem%mesh_kind == mesh_sampled
   end function is_sampled

   !> Copies a problem. The copy is a procedure, because the compiler would otherwise write out the copies of all components at each
   !> assignment.
   pure subroutine copy_problem(from, to)
      type(problem_t), intent(in) :: from
      type(problem_t), intent(inout) :: to
      to = from
   end subroutine copy_problem

   !> Problem of a checked model on the mesh of this model.
   function new_problem(model) result(problem)
      type(model_t), intent(in) :: model
      type(problem_t) :: problem
      integer :: e, j, n
      problem%model = model
      problem%deck = model
      problem%layout = new_layout(model)
      problem%demand = new_demands(problem%layout)
      problem%rod_segment = problem%layout%rod_segment_of
      problem%origin = problem%layout%origin
      allocate (problem%along(model%mesh%n_elements))
      allocate (problem%element_first(size(problem%layout%rod_segment)), problem%element_last(size(problem%layout%rod_segment)))
      n = 0
      do j = 1, size(problem%layout%rod_segment)
         associate (element => problem%layout%rod_segment(j)%element)
            problem%element_first(j) = n + 1
            problem%along(n + 1:n + size(element)) = element
            n = n + size(element)
            problem%element_last(j) = n
         end associate
      end do
      problem%mesh_node = merge([(e, e=1, model%mesh%n_nodes)], 0, problem%layout%breakpoint)
      problem%constant = new_load(model%mesh%n_nodes, model%mesh%n_elements, size(model%obstacle))
      problem%coordinates = model%mesh%x
      allocate (problem%contact_span(0), problem%hinge(0), problem%mark(0))
      call derive_problem(problem)
   end function new_problem

   !> Problem on another mesh; step, constant loads, overlaps and metric are copied from `problem`.
   function remeshed_problem(problem, division, spans) result(new)
      type(problem_t), intent(in) :: problem
      type(division_t), intent(in) :: division(:)   !! (rod segments) divisions, as new_remeshed_model requires
      logical, intent(in), optional :: spans !! true: the deck's contacts are represented by contact spans; false: by contact at
      !! nodes; absent: by the same of the two as in `problem`
      type(problem_t) :: new
      integer, allocatable :: node(:)
      integer :: e, i, j
      new%deck = problem%deck
      if (present(spans)) new%deck%contact%spans = new%deck%contact%along .and. spans
      new%layout = problem%layout
      new%tableau = problem%tableau
      new%demand = problem%demand
      if (allocated(problem%chain_start)) new%chain_start = problem%chain_start
      if (allocated(problem%chain_length)) new%chain_length = problem%chain_length
      if (allocated(problem%covered)) new%covered = problem%covered
      allocate (new%contact_span(0), new%hinge(0), new%mark(0))
      new%deck_mesh = .false.
      new%model = new_remeshed_model(new%deck, problem%layout, division)
      associate (mesh => new%model%mesh)
         new%along = [(e, e=1, mesh%n_elements)]
         allocate (new%rod_segment(mesh%n_elements), new%origin(mesh%n_elements))
         allocate (new%element_first(size(division)), new%element_last(size(division)))
         e = 0
         do j = 1, size(division)
            new%element_first(j) = e + 1
            do i = 1, size(division(j)%at) - 1
               e = e + 1
               new%rod_segment(e) = j
               new%origin(e) = division(j)%at(i) - mesh%s(1, e)
               if (i == 1) cycle
               ! All elements of a curve get exactly the same value; computed one by one the values would differ by rounding.
               if (mesh%curve(e) == mesh%curve(e - 1) .and. abs(mesh%s(1, e) - mesh%s(2, e - 1)) <= 0.0_wp) &
                  & new%origin(e) = new%origin(e - 1)
            end do
            new%element_last(j) = e
         end do
         allocate (new%mesh_node(problem%deck%mesh%n_nodes), source=0)
         allocate (node(mesh%n_nodes), source=0)
         i = 0
         do j = 1, problem%deck%mesh%n_nodes
            if (.not. problem%layout%breakpoint(j)) cycle
            i = i + 1
            new%mesh_node(j) = i
            node(i) = problem%mesh_node(j)
         end do
      end associate
      new%constant = problem%constant%mapped(node, problem%along(problem%element_first(new%rod_segment)))
      new%step = problem%step
      new%coordinates = problem%coordinates
      new%overlap = problem%overlap
      call derive_problem(new)
      new%weight = new%weight * (new%size / problem%size)**2
      new%size = problem%size
      new%force_floor = problem%force_floor
      call count_from_deck(new, new%candidates)
      call count_from_deck(new, new%ground%chain)
   end function remeshed_problem

   !> Makes the arc coordinates of a closed chain begin at the contact's first node in the deck. The mesh may have no node there.
   subroutine count_from_deck(problem, list)
      type(problem_t), intent(in) :: problem
      type(candidates_t), intent(inout) :: list
      real(wp) :: ahead
      integer :: c, e
      do c = 1, list%n
         if (c > 1) then
            if (list%contact(c) == list%contact(c - 1)) cycle
         end if
         e = list%element(1, c)
         if (e == 0) cycle
         associate (mesh => problem%model%mesh, at => problem%layout%node_at(problem%deck%contact(list%contact(c))%node(1)))
            if (mesh%curve(e) == 0) cycle
            ! The deck's first node lies inside the element that ends at the mesh's first node, or coincides with the mesh's first
            ! node.
            ahead = problem%origin(e) + mesh%s(2, e) - at
            if (ahead < 0.0_wp .or. ahead >= mesh%s(2, e) - mesh%s(1, e)) cycle
            ahead = curve_length(problem%model%curve(mesh%curve(e)), problem%model%imperfection, mesh%s(2, e) - ahead, mesh%s(2, e))
         end associate
         where (list%contact == list%contact(c)) list%s = list%s + ahead
      end do
   end subroutine count_from_deck

   !> Sets all data that follow from the model on the working mesh.
   subroutine derive_problem(problem)
      type(problem_t), intent(inout) :: problem !! in: deck, model, layout, coordinates along the segments and constant loads are
      !! set; out: all data are set
      type(geometry_t) :: home
      integer :: e, i, k
      real(wp) :: softest
      associate (model => problem%model)
         problem%ties = new_tie_pattern(model%tie, carriers(model), touching(model, carriers(model)))
         problem%numbering = new_numbering(model%mesh, any(model%fixed, 1), &
            & coupled_pairs(model%mesh, problem%ties, model%joint_spring))
         if (problem%tableau(1)%stages == 0) problem%tableau = [(new_tableau(i), i=1, max_stages)]
         home = new_geometry(model)
         problem%candidates = new_candidates(model, home, distributed=.false.)
         problem%coupling = new_coupling(model, problem%candidates, home)
         problem%ground = new_ground(model, problem%tableau, home)
         problem%n_unknowns = 3 * model%mesh%n_nodes
         associate (x => home%x) ! diagonal of the bounding box
            problem%size = hypot(maxval(x(1, :)) - minval(x(1, :)), maxval(x(2, :)) - minval(x(2, :)))
         end associate
         problem%resting = rests(problem, problem%candidates, home) .and. rests(problem, problem%ground%chain, home)
         problem%beside = spread([0, 0], 2, model%mesh%n_nodes)
         problem%z_size = spread(ul2_size, 1, model%mesh%n_elements)
         problem%conforms = spread(0, 1, model%mesh%n_elements)
         problem%pressurised = spread(.false., 1, model%mesh%n_elements)
         problem%immersed = problem%pressurised
         problem%weight = spread(0.0_wp, 1, model%mesh%n_nodes)
         if (allocated(problem%compliance)) deallocate (problem%compliance)
         allocate (problem%compliance(model%mesh%n_elements))
         do k = 1, size(model%step)
            problem%pressurised = problem%pressurised .or. model%step(k)%load%presses()
            problem%immersed = problem%immersed .or. any(abs(model%step(k)%load%gradient) > 0.0_wp, 1)
         end do
         softest = huge(1.0_wp)
         do e = 1, model%mesh%n_elements
            associate (section => middle_section(model, home, e))
               problem%compliance(e) = ge_compliance(model%mesh%stages(e), home%element(e)%length, section%ea, section%ei, &
                  & section%ga, section%shear_rigid)
               if (section%inextensible) call forbid_stretch(problem%compliance(e), problem%size)
               softest = min(softest, section%ei)
            end associate
            if (collocates(model%mesh%family(e))) &
               & problem%z_size(e) = ge_size(model%mesh%stages(e), problem%pressurised(e) .or. problem%ground%founded(e))
            do i = 1, 2
               associate (node => model%mesh%node(i, e))
                  problem%beside(3 - i, node) = e
                  problem%weight(node) = problem%weight(node) + 0.5_wp * home%element(e)%length
               end associate
            end do
         end do
      end associate
      problem%weight = problem%weight / (sum(home%element%length) * problem%size**2)
      problem%force_floor = 1.0e-12_wp * softest / problem%size**2
      ! On any mesh the overlaps are those of the deck's mesh. Gaps up to rounding count as contact in any case.
      if (problem%deck_mesh) then
         problem%overlap = [(deepest_overlap(problem%deck, problem%deck%contact(k)), k=1, size(problem%deck%contact))]
         where (problem%overlap <= touching_gap(problem)) problem%overlap = 0.0_wp
         ! A foundation yields to a small overlap. The deck allows a larger one only if the obstacle pushes the structure out in a
         ! step.
         where (.not. (pushed_out(problem%deck) .or. (problem%overlap <= deepest_start(problem%deck) .and. &
            & problem%deck%obstacle(problem%deck%contact%obstacle)%rigid))) problem%overlap = 0.0_wp
      end if
      problem%candidates%overlap = problem%overlap(problem%candidates%contact)
      problem%ground%chain%overlap = problem%overlap(problem%ground%chain%contact)
   end subroutine derive_problem

   !> (contacts) true: a step has *CONTACT INTERFERENCE, SHRINK for the obstacle.
   pure function pushed_out(model) result(pushed)
      type(model_t), intent(in) :: model
      logical :: pushed(size(model%contact))
      integer :: i
      pushed = .false.
      do i = 1, size(model%step)
         pushed = pushed .or. abs(model%step(i)%load%resolved(model%contact%obstacle)) > 0.0_wp
      end do
   end function pushed_out

   !> Nodes that carry obstacles, each once.
   pure function carriers(model) result(carrier)
      type(model_t), intent(in) :: model
      integer, allocatable :: carrier(:)
      integer :: o
      allocate (carrier(0))
      do o = 1, size(model%obstacle)
         associate (own => model%obstacle(o)%carrier)
            if (own > 0 .and. .not. any(carrier == own)) carrier = [carrier, own]
         end associate
      end do
   end function carriers

   !> Marks the nodes that may touch an obstacle carried by a given node.
   pure function touching(model, carrier)
      type(model_t), intent(in) :: model
      integer, intent(in) :: carrier(:)
      logical :: touching(size(carrier), model%mesh%n_nodes)
      integer :: c, k
      touching = .false.
      do c = 1, size(model%contact)
         do k = 1, size(carrier)
            if (model%obstacle(model%contact(c)%obstacle)%carrier == carrier(k)) touching(k, model%contact(c)%node) = .true.
         end do
      end do
   end function touching

   !> Node that carries the obstacle on which a conforming element lies; 0 for all other elements.
   pure integer function carried_by(problem, e) result(carrier)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: e
      carrier = 0
      if (problem%conforms(e) > 0) carrier = problem%model%obstacle(problem%candidates%obstacle(problem%conforms(e)))%carrier
   end function carried_by

   !> Unknowns of nodes that carry obstacles, which form the border of the band matrix; all three of each node.
   pure function carried_unknowns(problem) result(unknown)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: unknown(:)
      integer :: k
      allocate (unknown(0))
      do k = 1, size(problem%ties%carrier)
         associate (node => problem%ties%carrier(k))
            unknown = [unknown, dof(problem, node, 1), dof(problem, node, 2), dof(problem, node, 3)]
         end associate
      end do
   end function carried_unknowns

   !> True if all candidates of a list that are on tensionless foundations touch these foundations at the start.
   pure logical function rests(problem, list, home)
      type(problem_t), intent(in) :: problem   !! problem whose `size` is set
      type(candidates_t), intent(in) :: list
      type(geometry_t), intent(in) :: home
      real(wp) :: gap, normal(2), bend
      integer :: c
      rests = .true.
      do c = 1, list%n
         associate (obstacle => problem%model%obstacle(list%obstacle(c)))
            if (obstacle%rigid .or. obstacle%bilateral) cycle
            call obstacle_gap(obstacle, home%x(:, list%node(c)), gap, normal, bend)
            rests = rests .and. abs(gap + list%gap_offset(c)) <= rounding_gap(problem)
         end associate
      end do
   end function rests

   !> Index of the equation of a nodal unknown (component 1, 2 or 3).
   pure integer function dof(problem, node, component)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: node, component
      dof = 3 * (problem%numbering%position(node) - 1) + component
   end function dof

   !> (unknowns) Weights of the path metric: weight of the node for displacements, zero for rotations.
   pure function unknown_weights(problem) result(weight)
      type(problem_t), intent(in) :: problem
      real(wp) :: weight(problem%n_unknowns)
      weight = 0.0_wp
      weight(3 * problem%numbering%position - 2) = problem%weight
      weight(3 * problem%numbering%position - 1) = problem%weight
   end function unknown_weights

   !> (unknowns) Forces and moments; the moments are divided by the structure's size.
   pure function moments_as_forces(problem, x) result(force)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: x(:)             !! (unknowns) forces and moments
      real(wp) :: force(size(x))
      force = x
      force(3::3) = x(3::3) / problem%size
   end function moments_as_forces

   !> Bound of the rounding error of a gap [length].
   pure real(wp) function rounding_gap(problem)
      type(problem_t), intent(in) :: problem
      rounding_gap = 8.0_wp * epsilon(rounding_gap) * problem%size
   end function rounding_gap

   !> Largest initial gap that counts as contact in the stress-free structure [length]: a deck may round coordinates to ten digits.
   pure real(wp) function touching_gap(problem)
      type(problem_t), intent(in) :: problem
      touching_gap = 1.0e-10_wp * problem%size
   end function touching_gap

   !> True if two coordinates along a rod differ by no more than rounding, 1e-12 of the structure's size.
   elemental logical function same_place(size, one, other)
      real(wp), intent(in) :: size             !! size of the structure
      real(wp), intent(in) :: one, other       !! coordinates along the rod [length]
      same_place = abs(one - other) <= 1.0e-12_wp * size
   end function same_place
end module problem
