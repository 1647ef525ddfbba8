!> Loads on nodes in one state: constant loads left by earlier steps, and loads of the present step.
module node_loads
   use kinds, only: wp
   use load_pattern, only: pole_load_t
   use problem, only: problem_t
   use rod_state, only: state_t, node_position
   implicit none
   private
   public :: node_push_t, dead_node_load, node_pushes

   !> A point load that depends on the state, evaluated at a state; global axes.
   type :: node_push_t
      integer :: node = 0
      real(wp) :: force(3) = 0.0_wp              !! force in x, force in y, couple
      real(wp) :: rate(3) = 0.0_wp               !! derivative of `force` with respect to the load factor
      real(wp) :: stiffness(3, 3) = 0.0_wp       !! minus the derivatives of `force` with respect to position and rotation
      real(wp) :: stiffness_rate(3, 3) = 0.0_wp  !! derivative of `stiffness` with respect to the load factor
      logical :: sound = .true.                  !! false: the load has no direction in this state; all values are zero
   end type node_push_t

contains

   !> Force and couple on a node by the loads that do not depend on the state, and their derivatives by the load factor.
   pure subroutine dead_node_load(problem, state, node, load, rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      real(wp), intent(out) :: load(3), rate(3) !! force in x, force in y, couple; their derivatives by the load factor
      rate = problem%model%step(problem%step)%load%node_force(:, node)
      load = problem%constant%node_force(:, node) + state%load_factor * rate
   end subroutine dead_node_load

   !> Forces of all point loads that depend on the state.
   pure function node_pushes(problem, state) result(list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(node_push_t), allocatable :: list(:)
      integer :: i, kept
      associate (constant => problem%constant, step => problem%model%step(problem%step)%load)
         kept = size(constant%pole_load)
         allocate (list(kept + size(step%pole_load)))
         do i = 1, kept
            list(i) = pushed(state, constant%pole_load(i), 1.0_wp, 0.0_wp)
         end do
         do i = 1, size(step%pole_load)
            list(kept + i) = pushed(state, step%pole_load(i), state%load_factor, 1.0_wp)
         end do
      end associate
   end function node_pushes

   !> Force of one point load that depends on the state, times a factor. The derivative of this factor by the load factor is `rate`.
   pure function pushed(state, load, factor, rate) result(push)
      type(state_t), intent(in) :: state
      type(pole_load_t), intent(in) :: load
      real(wp), intent(in) :: factor, rate
      type(node_push_t) :: push
      real(wp) :: force(3), stiffness(3, 3)
      push%node = load%node
      call load%push([node_position(state, load%node), state%u(3, load%node)], force, stiffness, push%sound)
      push%force = (factor * load%magnitude) * force
      push%rate = (rate * load%magnitude) * force
      push%stiffness = (factor * load%magnitude) * stiffness
      push%stiffness_rate = (rate * load%magnitude) * stiffness
   end function pushed
end module node_loads
