!> What happens at the deck's nodes, wherever the nodes of the mesh are: contact nodes move along the rod, but what the deck asks
!> for belongs to the material points that it names.
module deck_nodes
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use rod_geometry, only: element_geometry_t, slid_pair
   use linear_system, only: system_t
   use section_forces, only: local_forces, inner_local_forces
   use rod_profile, only: profile_t, new_profile, profile_on, profile_displacement, profile_rate, element_place
   implicit none
   private
   public :: deck_node_displacement, deck_section_forces, node_gradient_t, deck_node_gradient

   !> Derivatives of displacement and rotation of a deck's node that lies inside an element now.
   type :: node_gradient_t
      integer :: node(2) = 0                    !! of the mesh: ends of the element
      real(wp) :: ends(3, 3, 2) = 0.0_wp        !! (of component, by component of an end, end)
      real(wp) :: load(3) = 0.0_wp              !! by the load factor
      real(wp), allocatable :: slide(:, :)      !! (3, n_slides) by the coordinates of the sliding nodes
      real(wp) :: defect(3) = 0.0_wp            !! change when the element closes its own defects
   end type node_gradient_t

contains

   !> Displacements and rotation of a deck's node, counted from the stress-free position in the state's problem.
   pure function deck_node_displacement(problem, state, node) result(u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      real(wp) :: u(3)
      integer :: e
      real(wp) :: s
      u = state%u(:, node)
      call find_node(problem, state, node, e, s)
      if (e == 0) return
      u = profile_displacement(problem, new_profile(problem, state, e), &
         & element_place(problem, state%geometry%element(e), e, s))
   end function deck_node_displacement

   !> (N, Q, M) at both ends of an element of the deck, as local_forces; a contact force acts where its node is now.
   subroutine deck_section_forces(problem, state, e, local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: local(3, 2)
      integer :: side, holder
      real(wp) :: s
      call local_forces(problem, state, e, local)
      do side = 1, 2
         call find_node(problem, state, problem%model%mesh%node(side, e), holder, s)
         if (holder > 0) local(:, side) = inner_local_forces(problem, state, holder, &
            & element_place(problem, state%geometry%element(holder), holder, s))
      end do
   end subroutine deck_section_forces

   !> How displacement and rotation of a deck's node change with the unknowns, where its own node has moved away.
   subroutine deck_node_gradient(problem, state, system, node, gradient, inside)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: node
      type(node_gradient_t), intent(out) :: gradient
      logical, intent(out) :: inside            !! false: node and mesh node are one, no gradient is set
      type(profile_t) :: profile
      type(element_geometry_t) :: pair(2)
      real(wp) :: s, tau, du(6), none(6), moved(3, 2), step, x(2), angle, start(2)
      integer :: e, k, i, way, z
      call find_node(problem, state, node, e, s)
      inside = e > 0
      if (.not. inside) return
      z = problem%z_size(e)
      profile = new_profile(problem, state, e)
      tau = element_place(problem, state%geometry%element(e), e, s)
      gradient%node = problem%model%mesh%node(:, e)
      none = 0.0_wp
      do k = 1, 6
         du = 0.0_wp
         du(k) = 1.0_wp
         gradient%ends(:, modulo(k - 1, 3) + 1, (k + 2) / 3) = &
            & profile_rate(problem, state, profile, tau, du, system%op(:z, k, e), 0.0_wp)
      end do
      gradient%load = profile_rate(problem, state, profile, tau, none, system%op(:z, 8, e), 1.0_wp)
      gradient%defect = profile_rate(problem, state, profile, tau, none, system%op(:z, 7, e), 0.0_wp)
      allocate (gradient%slide(3, system%n_slides), source=0.0_wp)
      do k = 1, system%n_slides
         associate (element => problem%candidates%element(:, system%slide(k)))
            i = findloc(element, e, 1)
            if (i == 0) cycle
            gradient%slide(:, k) = profile_rate(problem, state, profile, tau, none, system%slide_op(:z, i, k), 0.0_wp)
            ! The geometry's part is a central difference, as in the columns of the sliding nodes.
            step = 1.0e-4_wp * minval(state%geometry%element(element)%length)
            do way = 1, 2
               call slid_pair(problem%model, problem%tableau, state%geometry, element, merge(-step, step, way == 1), pair, x, angle)
               start = x
               if (i == 1) start = state%geometry%x(:, gradient%node(1))
               moved(:, way) = profile_displacement(problem, profile_on(problem, state, e, pair(i), start), &
                  & element_place(problem, pair(i), e, s))
            end do
            gradient%slide(:, k) = gradient%slide(:, k) + (moved(:, 2) - moved(:, 1)) / (2.0_wp * step)
         end associate
      end do
   end subroutine deck_node_gradient

   !> The element that holds the material point of a deck's node whose own node has moved along the rod.
   pure subroutine find_node(problem, state, node, e, s)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      integer, intent(out) :: e                 !! 0: the node is at its material point
      real(wp), intent(out) :: s                !! nominal coordinate of the point in that element
      integer :: side
      ! The one that ends at the node when that has moved forwards, or the one that begins there.
      do side = 1, 2
         e = problem%beside(side, node)
         if (e == 0) cycle
         s = problem%model%mesh%s(3 - side, e)
         if (side == 1 .and. state%geometry%element(e)%s(2) > s) return
         if (side == 2 .and. state%geometry%element(e)%s(1) < s) return
      end do
      e = 0
   end subroutine find_node
end module deck_nodes
