!> Removes the components along the null vectors from a solution at a bifurcation. These components are arbitrary, because they are
!> rounding divided by a vanishing eigenvalue.
!>
!> Let v be a null vector, K the factored tangent, and M the diagonal matrix of the arc-length metric. The arbitrary component has
!> the direction K^-1 M v. This direction differs from v, because K may be the tangent of the enriched problem, or contain rounding.
!> To subtract a multiple of v instead would leave large axial strains and forces in slender rods.
module null_directions
   use kinds, only: wp
   use problem, only: problem_t, dof, unknown_weights
   use linear_system, only: system_t
   use bordered_system, only: solve_effective, all_to_global
   use small_dense, only: solve_small
   use path_control, only: metric
   use path_continuity, only: path_tangent_t
   implicit none
   private
   public :: new_null_directions, leave_out, response_without, tangent_without, free_of, likeness

contains

   !> K^-1 M v for every null vector v, normalised to length 1.
   function new_null_directions(problem, system, modes) result(direction)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: modes(:, :) !! (unknowns, number of null vectors) null vectors, orthonormal in the metric, node axes
      real(wp), allocatable :: direction(:, :)   !! (unknowns, number of null vectors) directions, node axes
      integer :: k
      allocate (direction, mold=modes)
      do k = 1, size(modes, 2)
         call solve_effective(system, merge(0.0_wp, unknown_weights(problem) * modes(:, k), system%fixed), direction(:, k))
         direction(:, k) = direction(:, k) / norm2([tiny(1.0_wp), direction(:, k)])
      end do
   end function new_null_directions

   !> Subtracts multiples of the directions from x, so that no component along the null vectors remains.
   pure subroutine leave_out(problem, modes, direction, x)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: modes(:, :), direction(:, :) !! (unknowns, number of null vectors) null vectors; the directions that
      !! new_null_directions gives for them
      real(wp), intent(inout) :: x(:)            !! (unknowns) solution, node axes
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

   !> Displacements per unit load factor without component along the null vectors of a bifurcation, (unknowns) node axes.
   function response_without(problem, system, modes) result(response)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: modes(:, :) !! (unknowns, number of null vectors) null vectors, orthonormal in the metric, node axes
      real(wp) :: response(system%n)
      response = system%tangent
      call leave_out(problem, modes, new_null_directions(problem, system, modes), response)
   end function response_without

   !> Unit tangent, at a bifurcation, of the path that has no component along the null vectors, in the sense of increasing load
   !> factor.
   function tangent_without(problem, system, modes) result(heading)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: modes(:, :) !! (unknowns, number of null vectors) null vectors, orthonormal in the metric, node axes
      type(path_tangent_t) :: heading
      heading%u = all_to_global(problem, system, response_without(problem, system, modes))
      heading%load = 1.0_wp / sqrt(metric(problem, heading%u, heading%u))
      heading%u = heading%load * heading%u
   end function tangent_without

   !> Forces f without their parts along the null vectors v: f - sum of (v . f) M v, with the metric M. The solution of K x = f then
   !> has no part along the null vectors, which would be rounding over a vanishing pivot; its other part is unchanged.
   pure function free_of(problem, modes, force) result(free)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: modes(:, :)        !! (unknowns, number of null vectors) null vectors, orthonormal in the metric
      real(wp), intent(in) :: force(:)           !! (unknowns) forces, node axes
      real(wp) :: free(size(force))
      integer :: k
      free = force
      do k = 1, size(modes, 2)
         free = free - dot_product(modes(:, k), force) * unknown_weights(problem) * modes(:, k)
      end do
   end function free_of

   !> Component of a vector along a mode, by the inner product of the metric.
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
