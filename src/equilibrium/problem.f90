!> What stays fixed while a step is followed: the model, its numbering and the constants derived from them.
module problem
   use kinds, only: wp
   use model, only: model_t, load_t, family_ge, new_load
   use numbering, only: numbering_t, new_numbering
   use gauss_tableau, only: tableau_t, max_stages, new_tableau
   use ge_element, only: ge_stiffness_t, ge_compliance, ge_size
   use ul2_element, only: ul2_size
   use rod_geometry, only: geometry_t, new_geometry
   use candidates, only: candidates_t, new_candidates
   use obstacle_geometry, only: obstacle_gap
   use ground, only: ground_t, new_ground
   use ground_coupling, only: coupling_t, new_coupling
   implicit none
   private
   public :: problem_t, new_problem, structure_size, rounding_gap, dof

   type :: problem_t
      type(model_t) :: model
      type(numbering_t) :: numbering
      type(candidates_t) :: candidates                   !! of contact at nodes
      type(coupling_t) :: coupling                       !! how obstacles carry load from candidate to candidate
      type(ground_t) :: ground                           !! foundations that act inside elements
      type(tableau_t) :: tableau(max_stages)
      type(ge_stiffness_t), allocatable :: compliance(:) !! (elements)
      real(wp), allocatable :: spring(:, :)              !! (3, nodes) stiffness of springs to the ground
      logical, allocatable :: pressurised(:)             !! (elements) a pressure acts in some step
      integer, allocatable :: z_size(:)                  !! (elements) stored unknowns
      real(wp), allocatable :: coordinates(:, :)         !! (2, nodes) of the deck: what stored displacements count from
      integer, allocatable :: beside(:, :)               !! (2, nodes) an element that ends there, one that begins; 0: none
      type(load_t) :: constant                           !! left behind by the steps before this one
      integer :: step = 1
      integer :: n_unknowns = 0                          !! three a node
      real(wp) :: size = 1.0_wp                          !! diagonal of the box around the structure
      logical :: resting = .false.                       !! what foundations act on lies on them, or is bilateral: no gap at home
      real(wp) :: force_floor = 0.0_wp                   !! smallest force scale: rounding of EI/size^2
      real(wp), allocatable :: weight(:)                 !! (nodes) share of the rod's length over size^2: the arc-length metric
   end type problem_t

contains

   !> Derives everything from a checked model.
   function new_problem(model) result(problem)
      type(model_t), intent(in) :: model
      type(problem_t) :: problem
      type(geometry_t) :: home
      integer :: e, i, k
      real(wp) :: softest
      problem%model = model
      problem%numbering = new_numbering(model%mesh, any(model%fixed, 1))
      do i = 1, max_stages
         problem%tableau(i) = new_tableau(i)
      end do
      home = new_geometry(model, problem%tableau)
      problem%candidates = new_candidates(model, home, distributed=.false.)
      problem%coupling = new_coupling(model, problem%candidates, home)
      problem%ground = new_ground(model, problem%tableau, home)
      allocate (problem%spring(3, model%mesh%n_nodes), source=0.0_wp)
      if (allocated(model%spring)) problem%spring = model%spring
      problem%constant = new_load(model%mesh%n_nodes, model%mesh%n_elements, size(model%obstacle))
      problem%n_unknowns = 3 * model%mesh%n_nodes
      problem%size = structure_size(home%x)
      problem%coordinates = model%mesh%x
      problem%resting = rests(problem, problem%candidates, home) .and. rests(problem, problem%ground%chain, home)
      allocate (problem%beside(2, model%mesh%n_nodes), source=0)
      allocate (problem%compliance(model%mesh%n_elements), problem%z_size(model%mesh%n_elements))
      allocate (problem%pressurised(model%mesh%n_elements), source=.false.)
      allocate (problem%weight(model%mesh%n_nodes), source=0.0_wp)
      do k = 1, size(model%step)
         problem%pressurised = problem%pressurised .or. abs(model%step(k)%load%pressure) > 0.0_wp
      end do
      softest = huge(1.0_wp)
      do e = 1, model%mesh%n_elements
         associate (section => model%section(model%mesh%section(e)))
            problem%compliance(e) = ge_compliance(model%mesh%stages(e), home%element(e)%length, section%ea, section%ei, &
               & section%ga, section%shear_rigid)
            softest = min(softest, section%ei)
         end associate
         problem%z_size(e) = ul2_size
         if (model%mesh%family(e) == family_ge) &
            & problem%z_size(e) = ge_size(model%mesh%stages(e), problem%pressurised(e) .or. problem%ground%founded(e))
         do i = 1, 2
            associate (node => model%mesh%node(i, e))
               problem%beside(3 - i, node) = e
               problem%weight(node) = problem%weight(node) + 0.5_wp * home%element(e)%length
            end associate
         end do
      end do
      problem%weight = problem%weight / (sum(home%element%length) * problem%size**2)
      problem%force_floor = 1.0e-12_wp * softest / problem%size**2
   end function new_problem

   !> True when no foundation of a list of candidates begins with a gap.
   pure logical function rests(problem, list, home)
      type(problem_t), intent(in) :: problem   !! with its size
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

   !> Diagonal of the box around a set of points.
   pure real(wp) function structure_size(x)
      real(wp), intent(in) :: x(:, :)   !! (2, points)
      structure_size = hypot(maxval(x(1, :)) - minval(x(1, :)), maxval(x(2, :)) - minval(x(2, :)))
   end function structure_size

   !> Place of a nodal unknown (component 1, 2, 3) in the band.
   pure integer function dof(problem, node, component)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: node, component
      dof = 3 * (problem%numbering%position(node) - 1) + component
   end function dof
   !> What the rounding of positions may make of a gap.
   pure real(wp) function rounding_gap(problem)
      type(problem_t), intent(in) :: problem
      rounding_gap = 8.0_wp * epsilon(rounding_gap) * problem%size
   end function rounding_gap
end module problem
