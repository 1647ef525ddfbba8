!> Linearisation, by finite differences, of a number that depends on a few elements only. Each unknown of the nodes of these
!> elements is changed by a small step. The section forces of the elements change with the unknown as the linear equations
!> prescribe. The nodes of contact spans keep their positions along the rods, as they do in the equations.
module local_differences
   use kinds, only: wp
   use problem, only: problem_t, carried_by
   use rod_state, only: state_t, node_position, pose_of
   use obstacle_pose, only: pose_t, rigid_motion
   use tied_nodes, only: spread_force
   use node_axes, only: own_axes
   use linear_system, only: system_t
   use bordered_system, only: apply_increment
   use state_functional, only: functional_t, new_functional
   implicit none
   private
   public :: local_number_t, linearised

   !> A number that is a function of the state. Each kind of number extends this type by the data that it needs.
   type, abstract :: local_number_t
      integer, allocatable :: element(:)         !! elements on which the number depends
   contains
      procedure(value_of_state), deferred :: value
   end type local_number_t

   abstract interface
      !> Value of the number at a state.
      real(wp) function value_of_state(self, problem, state)
         import :: local_number_t, problem_t, state_t, wp
         class(local_number_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state !! state close to the one at which the equations are assembled, with the nodes at the
         !! same places of the rods
      end function value_of_state
   end interface

   real(wp), parameter :: little = sqrt(epsilon(1.0_wp)) !! step of the finite differences: displacement over the structure's size,
   !! or rotation [rad]

contains

   !> Linearisation of a number (a functional) by finite differences.
   function linearised(problem, state, system, of) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      class(local_number_t), intent(in) :: of
      type(functional_t) :: number
      type(state_t) :: here, moved               ! states after the elimination of the elements' internal residuals
      real(wp) :: none(system%n), axes(3, 3), gradient(3), base, step
      logical :: near(problem%model%mesh%n_nodes)
      integer :: node, i, k
      number = new_functional(system%n)
      none = 0.0_wp
      here = state
      call apply_increment(problem, system, none, 0.0_wp, here)
      base = of%value(problem, here)
      number%value = of%value(problem, state)
      number%defect = base - number%value
      near = .false.
      do k = 1, size(of%element)
         associate (node => problem%model%mesh%node(:, of%element(k)))
            near(node) = .true.
            near(problem%ties%carrier) = near(problem%ties%carrier) .or. any(problem%ties%has_blocks(node))
         end associate
      end do
      moved = here
      do node = 1, size(near)
         if (.not. near(node)) cycle
         axes = own_axes(system, node)
         do i = 1, 3
            step = little * merge(1.0_wp, problem%size, i == 3)
            call displace(step * axes(:, i))
            gradient(i) = (of%value(problem, moved) - base) / step
         end do
         call displace([0.0_wp, 0.0_wp, 0.0_wp])
         call spread_force(problem, system%tie_block, node, gradient, number%by_unknown)
      end do
      step = little * max(abs(state%load_factor), 1.0_wp)
      moved = state
      call apply_increment(problem, system, none, step, moved)
      number%by_load = (of%value(problem, moved) - base) / step

   contains

      !> Displaces node `node` from its position in `here`. The internal unknowns of the elements follow from the linear equations.
      subroutine displace(du)
         real(wp), intent(in) :: du(3)           !! displacement of the node, global axes
         real(wp) :: rate(size(state%z, 1))
         integer :: k, j, side, z
         moved%u(:, node) = here%u(:, node) + du
         do k = 1, size(of%element)
            associate (e => of%element(k))
               side = findloc(problem%model%mesh%node(:, e), node, 1)
               if (side == 0 .and. carried_by(problem, e) /= node) cycle
               z = problem%z_size(e)
               rate = 0.0_wp
               if (carried_by(problem, e) > 0) then
                  rate(:z) = matmul(system%op(:z, :6, e), relative(e, side, du))
               else
                  do j = 1, 3
                     rate(:z) = rate(:z) + system%op(:z, 3 * side - 3 + j, e) * du(j)
                  end do
               end if
               moved%z(:z, e) = state%z(:z, e) + rate(:z) + system%op(:z, 7, e)
            end associate
         end do
      end subroutine displace

      !> For an element on an obstacle that a node carries: displacement increments of the element's nodes relative to the obstacle,
      !> if one node is moved by `du`. This node is one of the element, or the node that carries the obstacle (see
      !> relative_increments).
      pure function relative(e, side, du) result(own)
         integer, intent(in) :: e, side          !! index of the element; side of the node in it, 0: the node carries the obstacle
         real(wp), intent(in) :: du(3)
         real(wp) :: own(6), motion(3, 3)
         type(pose_t) :: pose
         integer :: k
         own = 0.0_wp
         if (side > 0) own(3 * side - 2:3 * side - 1) = du(1:2)
         if (side > 0) return
         pose = pose_of(problem, here, problem%candidates%obstacle(problem%conforms(e)))
         do k = 1, 2
            motion = rigid_motion(pose%arm(node_position(here, problem%model%mesh%node(k, e))))
            own(3 * k - 2:3 * k - 1) = -matmul(motion(1:2, :), du)
         end do
         own(3) = du(3)
      end function relative
   end function linearised
end module local_differences
