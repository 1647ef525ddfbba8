!> Relative curvature as a functional: curvature of the rod minus that of the obstacle at a point contact, per unit stress-free
!> length, positive if the rod bends away from the obstacle. As the path constraint it leads to osculation, where the relative
!> curvature is zero. There the contact has no rotational stiffness, and free spans beside it may be about to buckle, so that
!> neither the load nor displacements are parameters of the path.
module relative_curvature
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_functional, only: functional_t
   use linear_system, only: system_t
   use bordered_system, only: unknowns_of
   use touchdown_points, only: excess_ahead
   implicit none
   private
   public :: new_relative_curvature

   real(wp), parameter :: little = 1.0e-6_wp    !! small change for differences, over the size or in rad: forces and moments are
   !! linear for such changes

contains

   !> Gradient of the relative curvature by finite differences: nodes are displaced, and the internal unknowns of the elements
   !> beside the point contact follow from the linear equations.
   function new_relative_curvature(problem, state, system, candidate) result(curvature)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled there
      integer, intent(in) :: candidate          !! candidate of a point contact
      type(functional_t) :: curvature
      type(state_t) :: other
      real(wp) :: step, by_node(3, problem%model%mesh%n_nodes) !! global axes
      integer :: element(2), nodes(4), i, k, side
      element = problem%candidates%element(:, candidate)
      curvature%value = value(state)
      by_node = 0.0_wp
      nodes = [problem%candidates%node(candidate), 0, 0, problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier]
      do side = 1, 2
         if (element(side) > 0) nodes(1 + side) = problem%model%mesh%node(side, element(side))
      end do
      other = state
      do i = 1, size(nodes)
         if (nodes(i) == 0) cycle
         do k = 1, 3
            step = merge(little, little * problem%size, k == 3)
            other%u(k, nodes(i)) = state%u(k, nodes(i)) + step
            call answer(nodes(i), k, step)
            by_node(k, nodes(i)) = (value(other) - curvature%value) / step
            other%u(k, nodes(i)) = state%u(k, nodes(i))
         end do
      end do
      call answer(0, 7, 1.0_wp)
      curvature%defect = value(other) - curvature%value
      step = little * max(abs(state%load_factor), 1.0_wp)
      other%load_factor = state%load_factor + step
      call answer(0, 8, step)
      curvature%by_load = (value(other) - curvature%value) / step
      curvature%by_unknown = unknowns_of(problem, system, by_node)

   contains

      real(wp) function value(at)
         type(state_t), intent(in) :: at
         value = excess_ahead(problem, state, at, candidate)
      end function value

      !> Changes the internal unknowns of the elements beside the point contact in `other`, according to the displacement of a node.
      subroutine answer(node, column, step)
         integer, intent(in) :: node             !! node that is displaced; 0: none
         integer, intent(in) :: column           !! component of its displacement; 7: elimination of internal residuals, 8: load
         !! factor
         real(wp), intent(in) :: step
         integer :: s, e, z, c
         do s = 1, 2
            e = element(s)
            if (e == 0) cycle
            z = problem%z_size(e)
            other%z(:z, e) = state%z(:z, e)
            c = column
            if (node > 0) then
               if (all(problem%model%mesh%node(:, e) /= node)) cycle
               if (problem%model%mesh%node(2, e) == node) c = 3 + column
            end if
            other%z(:z, e) = state%z(:z, e) + step * system%op(:z, c, e)
         end do
      end subroutine answer
   end function new_relative_curvature
end module relative_curvature
