!> Monitors of displacements: their values, and their linearisations. (A functional is a number of the state together with its
!> derivatives, see state_functional.) A monitor refers to the material point that the deck names, even if the nodes of a contact
!> span move along the rod. The gap between an obstacle and a point inside an element is also given here as a functional.
module displacement_functional
   use kinds, only: wp
   use model, only: quantity_displacement
   use problem, only: problem_t, carried_by
   use rod_state, only: state_t, node_position, pose_of
   use obstacle_pose, only: pose_t, rigid_motion, about_pivot
   use state_functional, only: functional_t, inner_place_t
   use linear_system, only: system_t
   use bordered_system, only: unknowns_of
   use deck_nodes, only: deck_displacements, find_node, place_rate
   use rod_profile, only: profile_t, new_profile, profile_place
   implicit none
   private
   public :: new_displacement_functional, watched_displacement, monitor_change, left_open, new_place_gap_functional

contains

   !> Value of a displacement monitor: mean displacement or rotation of its nodes, with the monitor's factor and offset.
   pure real(wp) function watched_displacement(problem, state, m) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m                  !! index into model%monitor of a displacement monitor
      real(wp) :: u(3, size(problem%deck%monitor(m)%node))
      integer :: i
      associate (monitor => problem%deck%monitor(m))
         u = deck_displacements(problem, state, monitor%node)
         value = 0.0_wp
         do i = 1, size(monitor%node)
            value = value + u(monitor%component, i) / size(monitor%node)
         end do
         value = monitor%offset + monitor%factor * value
      end associate
   end function watched_displacement

   !> Linearisation of a displacement monitor. The displacements of a point inside an element depend on the element's internal
   !> unknowns. These depend on the load factor and on the residual inside the element, so that the monitor does, too.
   function new_displacement_functional(problem, state, system, m) result(watched)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: m                  !! index into model%monitor of a displacement monitor
      type(functional_t) :: watched
      real(wp) :: weight(3), tau, by_node(3, problem%model%mesh%n_nodes) !! derivatives of the monitor by the displacements of its
      !! point; place of the point in the element; derivatives by the displacements of all nodes, global axes
      integer :: i, node, e
      by_node = 0.0_wp
      allocate (watched%inner(0))
      watched%value = watched_displacement(problem, state, m)
      associate (monitor => problem%deck%monitor(m))
         weight = 0.0_wp
         weight(monitor%component) = monitor%factor / size(monitor%node)
         do i = 1, size(monitor%node)
            call find_node(problem, state, monitor%node(i), node, e, tau)
            if (e == 0) then
               by_node(:, node) = by_node(:, node) + weight
            else
               call add_place(problem, state, system, e, tau, weight, by_node, watched)
               watched%inner = [watched%inner, inner_place_t(e, tau, weight)]
            end if
         end do
      end associate
      watched%by_unknown = unknowns_of(problem, system, by_node)
   end function new_displacement_functional

   !> Adds to the derivatives of a functional those of the displacements and the rotation of a point inside an element, each times
   !> its weight. The value of the functional is not changed.
   subroutine add_place(problem, state, system, e, tau, weight, by_node, number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: e                  !! index of the element
      real(wp), intent(in) :: tau               !! place of the point in the element, 0 to 1
      real(wp), intent(in) :: weight(3)         !! weights of the displacements (x, y) and of the rotation, global axes
      real(wp), intent(inout) :: by_node(:, :)  !! (3, nodes) gradient of the functional, global axes
      type(functional_t), intent(inout) :: number !! functional; its components by_load and defect are changed
      type(profile_t) :: profile
      type(pose_t) :: pose
      real(wp) :: du(6), rate(3), gradient
      integer :: k, z, carrier
      z = problem%z_size(e)
      carrier = carried_by(problem, e)
      if (carrier > 0) pose = pose_of(problem, state, problem%candidates%obstacle(problem%conforms(e)))
      do k = 1, 6
         du = 0.0_wp
         du(k) = 1.0_wp
         call place_rate(problem, state, e, tau, profile, du, system%op(:z, k, e), 0.0_wp, rate)
         gradient = dot_product(weight, rate)
         associate (node => problem%model%mesh%node((k + 2) / 3, e), i => modulo(k - 1, 3) + 1)
            if (carrier > 0 .and. i == 3) then
               by_node(3, carrier) = by_node(3, carrier) + gradient
               cycle
            end if
            by_node(i, node) = by_node(i, node) + gradient
            if (carrier > 0) by_node(:, carrier) = by_node(:, carrier) - gradient * about_pivot(pose%arm(node_position(state, &
               & node)), [2.0_wp - i, i - 1.0_wp])
         end associate
      end do
      ! An obstacle may be attached to a node, which carries it. If the element lies on such an obstacle, the point moves with the
      ! node.
      if (carrier > 0) by_node(:, carrier) = by_node(:, carrier) + matmul(weight, rigid_motion(pose%arm(profile_place(problem, &
         & new_profile(problem, state, e), tau))))
      du = 0.0_wp
      call place_rate(problem, state, e, tau, profile, du, system%op(:z, 8, e), 1.0_wp, rate)
      number%by_load = number%by_load + dot_product(weight, rate)
      call place_rate(problem, state, e, tau, profile, du, system%op(:z, 7, e), 0.0_wp, rate)
      number%defect = number%defect + dot_product(weight, rate)
   end subroutine add_place

   !> Change of a displacement monitor for increments of displacements and load factor. With x = system%tangent and y = 1 the result
   !> is the derivative of the monitor along the path by the load factor.
   real(wp) function monitor_change(problem, m, state, system, x, y) result(change)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                  !! index into model%monitor of a displacement monitor
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      real(wp), intent(in) :: x(:)              !! (n) increments of the unknowns, node axes
      real(wp), intent(in) :: y                 !! increment of the load factor
      type(functional_t) :: watched
      watched = new_displacement_functional(problem, state, system, m)
      change = watched%change(x, y)
   end function monitor_change

   !> True for a displacement monitor that the loads do not determine. A rod that rolls along its wall (rolling_rods) has many
   !> equilibrium positions; the monitor changes between them by more than the square root of the tolerance of equilibrium, relative
   !> to the structure's size. (Force monitors do not change by rolling.)
   logical function left_open(problem, m, state, system)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                  !! index into model%monitor
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! factored at `state`
      associate (monitor => problem%deck%monitor(m))
         left_open = monitor%quantity == quantity_displacement .and. system%roll_range > 0.0_wp
         if (left_open) left_open = abs(monitor_change(problem, m, state, system, system%rolled, 0.0_wp)) * system%roll_range > &
            & sqrt(problem%model%step(problem%step)%tolerance) * abs(monitor%factor) * problem%size
      end associate
   end function left_open

   !> The gap of a point inside an element, with its linearisation. The gap changes by the displacement of the point relative to the
   !> obstacle along the normal, minus the closing that the load prescribes.
   type(functional_t) function new_place_gap_functional(problem, state, system, contact, e, tau, gap, normal) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: contact            !! index into model%contact
      integer, intent(in) :: e                  !! index of the element
      real(wp), intent(in) :: tau               !! place in the element, 0 to 1
      real(wp), intent(in) :: gap, normal(2)    !! gap at this place; unit gradient of the gap
      real(wp) :: by_node(3, problem%model%mesh%n_nodes)
      type(pose_t) :: pose
      by_node = 0.0_wp
      number%value = gap
      call add_place(problem, state, system, e, tau, [normal, 0.0_wp], by_node, number)
      associate (carrier => problem%model%obstacle(problem%model%contact(contact)%obstacle)%carrier)
         pose = pose_of(problem, state, problem%model%contact(contact)%obstacle)
         if (carrier > 0) by_node(:, carrier) = by_node(:, carrier) - about_pivot(pose%arm(profile_place(problem, &
            & new_profile(problem, state, e), tau)), normal)
      end associate
      number%by_unknown = unknowns_of(problem, system, by_node)
      associate (o => problem%model%contact(contact)%obstacle, load => problem%model%step(problem%step)%load)
         number%by_load = number%by_load - dot_product(normal, load%motion(:, o)) - load%closing(o) - &
            & load%resolved(o) * problem%overlap(contact)
      end associate
   end function new_place_gap_functional
end module displacement_functional
