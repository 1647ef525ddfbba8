!> Dual displacements of functionals on the path: an out-of-balance force (internal minus external) on an unknown changes a number
!> by the work of the force on the number's dual displacement, if the path constraint remains satisfied. Each number needs one
!> back-substitution.
module path_duals
   use kinds, only: wp
   use problem, only: problem_t
   use linear_system, only: system_t
   use bordered_system, only: solve_effective, solve_all_effective
   use band_matrix, only: band_times
   use null_directions, only: new_null_directions, leave_out, free_of
   use state_functional, only: functional_t
   implicit none
   private
   public :: solve_path_duals

contains

   !> Dual displacements of all given functionals.
   subroutine solve_path_duals(problem, system, held, number, modes, dual, by_held, ok)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      type(functional_t), intent(in) :: held     !! the functional that the path constraint prescribes
      type(functional_t), intent(in) :: number(:)
      real(wp), intent(in) :: modes(:, :) !! (n, multiplicity) null vectors of a bifurcation; no columns at other points. Components
      !! of displacements along them are removed, because these are rounding divided by a vanishing eigenvalue
      real(wp), intent(out) :: dual(:, :)        !! (n, numbers) node axes
      real(wp), intent(out) :: by_held(:) !! (numbers) derivative of each number along the path with respect to the prescribed
      !! quantity
      logical, intent(out) :: ok                 !! false: the prescribed quantity is constant along the path, and nothing is set
      real(wp), dimension(system%n) :: tangent, known, push, of_load
      real(wp) :: response(system%n, 0:size(number)), along
      real(wp), allocatable :: direction(:, :)
      integer :: m
      direction = new_null_directions(problem, system, modes)
      tangent = system%tangent
      call leave_out(problem, modes, direction, tangent)
      along = held%change(tangent, 1.0_wp)
      ok = abs(along) > 0.0_wp
      if (.not. ok) return
      known = merge(system%rate, 0.0_wp, system%fixed)
      push = 0.0_wp
      if (any(abs(known) > 0.0_wp)) call band_times(system%k, known, push)
      push = merge(0.0_wp, system%load - push, system%fixed)
      response(:, 0) = free_force(held%by_unknown)
      do m = 1, size(number)
         response(:, m) = free_force(number(m)%by_unknown)
      end do
      call solve_all_effective(system, response)
      do m = 0, size(number)
         call leave_out(problem, modes, direction, response(:, m))
      end do
      of_load = response(:, 0) / along
      do m = 1, size(number)
         by_held(m) = number(m)%change(tangent, 1.0_wp) / along
         call combine(number(m), response(:, m), by_held(m), dual(:, m))
      end do

   contains

      !> Dual displacements of one number. At a limit point their two parts, at constant load and due to the change of the load, are
      !> unbounded, and the difference loses digits. It is therefore corrected by means of the residuals of the equations and of the
      !> load.
      subroutine combine(number, response, by_held, dual)
         type(functional_t), intent(in) :: number
         real(wp), intent(in) :: response(:)     !! (n) response of the structure to the gradient of the number
         real(wp), intent(in) :: by_held
         real(wp), intent(out) :: dual(:)        !! (n) dual displacements, node axes
         real(wp) :: lost, left(system%n), more(system%n)
         lost = sqrt(epsilon(lost)) * maxval(abs(response))
         dual = by_held * along * of_load - response
         dual = dual + load_residual(number, by_held, dual) * of_load
         ! The band matrix does not contain the stiffness of coupled ground, so that the residual cannot be computed from it.
         if (maxval(abs(dual)) > lost .or. system%coupling%n > 0) return
         call band_times(system%k, dual, left)
         left = free_force(by_held * held%by_unknown - number%by_unknown - left)
         call solve_effective(system, left, more)
         call leave_out(problem, modes, direction, more)
         dual = dual + more
         dual = dual + load_residual(number, by_held, dual) * of_load
      end subroutine combine

      !> Residual of the dual equation of the load factor.
      pure real(wp) function load_residual(number, by_held, dual) result(residual)
         type(functional_t), intent(in) :: number
         real(wp), intent(in) :: by_held, dual(:)
         residual = number%change(known, 1.0_wp) - dot_product(push, dual) - by_held * held%change(known, 1.0_wp)
      end function load_residual

      !> Forces on the free unknowns, without components along null vectors.
      function free_force(force) result(free)
         real(wp), intent(in) :: force(:)
         real(wp) :: free(size(force))
         free = merge(0.0_wp, free_of(problem, modes, merge(0.0_wp, force, system%fixed)), system%fixed)
      end function free_force
   end subroutine solve_path_duals
end module path_duals
