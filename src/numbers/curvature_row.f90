!> How much more a rod is curved at a point contact than its obstacle, as a function of the unknowns. Held, it leads along the path
!> to where that is none: there nothing turns the point any more, and free spans beside it may be about to buckle, so that neither
!> the load nor displacements tell points of the path.
module curvature_row
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use touchdown_points, only: excess_ahead
   implicit none
   private
   public :: curvature_row_t, new_curvature_row

   !> Value and derivatives.
   type :: curvature_row_t
      real(wp) :: excess = 0.0_wp               !! > 0: the rod bends away; per unit stress-free length
      real(wp), allocatable :: node(:, :)       !! (3, nodes) by the displacements, global axes
      real(wp) :: load = 0.0_wp                 !! by the load factor
      real(wp) :: defect = 0.0_wp               !! change when the elements close their own defects
   end type curvature_row_t

   real(wp), parameter :: little = 1.0e-6_wp    !! of the size, or rad: forces and moments are linear in these

contains

   !> The row at a state, by differences: displacements, and what the elements beside the point answer to them.
   function new_curvature_row(problem, state, system, candidate) result(row)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled there
      integer, intent(in) :: candidate          !! of a point contact
      type(curvature_row_t) :: row
      type(state_t) :: other
      real(wp) :: step
      integer :: element(2), nodes(3), i, k, side
      element = problem%candidates%element(:, candidate)
      row%excess = value(state)
      allocate (row%node(3, problem%model%mesh%n_nodes), source=0.0_wp)
      nodes = [problem%candidates%node(candidate), 0, 0]
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
            row%node(k, nodes(i)) = (value(other) - row%excess) / step
            other%u(k, nodes(i)) = state%u(k, nodes(i))
         end do
      end do
      call answer(0, 7, 1.0_wp)
      row%defect = value(other) - row%excess
      step = little * max(abs(state%load_factor), 1.0_wp)
      other%load_factor = state%load_factor + step
      call answer(0, 8, step)
      row%load = (value(other) - row%excess) / step

   contains

      real(wp) function value(at)
         type(state_t), intent(in) :: at
         value = excess_ahead(problem, state, at, candidate)
      end function value

      !> Forces and moments of the elements beside the point.
      subroutine answer(node, column, step)
         integer, intent(in) :: node             !! that is moved; 0: none
         integer, intent(in) :: column           !! by which of its displacements; 7: by closing defects, 8: by the load factor
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
   end function new_curvature_row
end module curvature_row
