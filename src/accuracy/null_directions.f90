!> Takes out of a solution what goes along null vectors of a tangent at a bifurcation: over a vanishing eigenvalue rounding makes
!> any share of it.
!>
!> What a factored tangent K adds to a solution there is along its own direction of least resistance, K^-1 M v for a null vector v
!> and the metric M, not along v: of the finer problem, or as rounding has it. Of slender rods the difference would be stretched
!> with a stiffness that makes forces of it.
module null_directions
   use kinds, only: wp
   use problem, only: problem_t, dof
   use linear_system, only: system_t
   use bordered_system, only: solve_effective
   use small_dense, only: solve_small
   implicit none
   private
   public :: new_null_directions, leave_out, free_of, likeness, times_metric

contains

   !> K^-1 M v of every null vector, with length 1 along it.
   function new_null_directions(problem, system, modes) result(direction)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: modes(:, :)        !! (unknowns, any number) null vectors, orthonormal in the metric, node axes
      real(wp), allocatable :: direction(:, :)   !! (unknowns, as many)
      integer :: k
      allocate (direction, mold=modes)
      do k = 1, size(modes, 2)
         call solve_effective(system, merge(0.0_wp, times_metric(problem, modes(:, k)), system%fixed), direction(:, k))
         direction(:, k) = direction(:, k) / norm2([tiny(1.0_wp), direction(:, k)])
      end do
   end function new_null_directions

   !> x without null vectors: what is left has no part along them.
   pure subroutine leave_out(problem, modes, direction, x)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: modes(:, :), direction(:, :) !! (unknowns, any number) of the null vectors, see above
      real(wp), intent(inout) :: x(:)            !! (unknowns) node axes
      real(wp) :: a(size(modes, 2), size(modes, 2)), b(1, size(modes, 2))
      logical :: singular
      integer :: i, j
      if (size(modes, 2) == 0) return
      do i = 1, size(modes, 2)
         do j = 1, size(modes, 2)
            a(j, i) = likeness(problem, modes(:, i), direction(:, j))
         end do
         b(1, i) = likeness(problem, modes(:, i), x)
      end do
      call solve_small(size(modes, 2), a, b, singular)
      if (singular) return
      x = x - matmul(direction, b(1, :))
   end subroutine leave_out

   !> Forces less M v times their work on every null vector v: a solution has the same part across these directions, and no other
   !> that would leave its rounding there.
   pure function free_of(problem, modes, force) result(free)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: modes(:, :)        !! (unknowns, any number) null vectors, orthonormal in the metric
      real(wp), intent(in) :: force(:)           !! (unknowns) node axes
      real(wp) :: free(size(force))
      integer :: k
      free = force
      do k = 1, size(modes, 2)
         free = free - dot_product(modes(:, k), force) * times_metric(problem, modes(:, k))
      end do
   end function free_of

   !> M x.
   pure function times_metric(problem, x) result(weighted)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: x(:)               !! (unknowns) node axes
      real(wp) :: weighted(size(x))
      integer :: node, d
      weighted = 0.0_wp
      do node = 1, size(problem%weight)
         d = dof(problem, node, 1)
         weighted(d:d + 1) = problem%weight(node) * x(d:d + 1)
      end do
   end function times_metric

   !> The part of a vector that is a mode.
   pure real(wp) function likeness(problem, mode, x)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: mode(:), x(:)      !! (unknowns) node axes; the mode has length 1 in the metric
      integer :: node, d
      likeness = 0.0_wp
      do node = 1, size(problem%weight)
         d = dof(problem, node, 1)
         likeness = likeness + problem%weight(node) * dot_product(mode(d:d + 1), x(d:d + 1))
      end do
   end function likeness
end module null_directions
