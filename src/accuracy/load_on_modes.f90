!> Work of the load on the null vectors of a bifurcation: it tells one from two paths that pass each other.
!>
!> Along a path K x' = q lambda', so a mode phi with the eigenvalue mu has phi.q lambda' = mu phi.M x'. Where mu is zero and the
!> load goes on phi.q is zero, too. Where it is not, no path goes through: two pass by each other, and what looked like one of them
!> has gone over to the other.
module load_on_modes
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: solve_effective
   use tangent_modes, only: modes_t, lowest_modes, apply_tangent
   use axial_rigidity, only: shrinking_forces
   use null_directions, only: likeness, times_metric
   use timing, only: timers_t
   implicit none
   private
   public :: load_on

   integer, parameter :: eigenvalues_looked_at = 5

contains

   !> |phi.q| over the null space, and what of it may be rounding.
   subroutine load_on(problem, state, system, given, work, rounding, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored there
      real(wp), intent(in) :: given(:, :)        !! (unknowns, multiplicity) null vectors here, or of elements of another order
      real(wp), intent(out) :: work              !! per load factor, of modes that have length 1 in the metric
      real(wp), intent(out) :: rounding          !! likewise
      type(timers_t), intent(inout) :: timers
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      real(wp) :: mode(system%n), force(system%n), left(system%n), form, length
      integer :: i, k
      work = 0.0_wp
      rounding = 0.0_wp
      call lowest_modes(problem, state, system, eigenvalues_looked_at, modes, error, timers)
      ! K t is q for the tangent t of the path, but for rounding.
      call apply_tangent(problem, state, system, merge(0.0_wp, system%tangent, system%fixed), force, form)
      left = 0.0_wp
      if (system%rigidity%n > 0) call shrinking_forces(system%rigidity, system%tangent_stretch, left)
      left = merge(0.0_wp, left + system%load - force, system%fixed)
      do i = 1, modes%n
         if (sum([(likeness(problem, given(:, k), modes%x(:, i))**2, k=1, size(given, 2))]) < 0.5_wp) cycle
         ! The mode is as good as its iteration was left; one step more, as near to a singular tangent, makes it exact.
         call solve_effective(system, merge(0.0_wp, times_metric(problem, modes%x(:, i)), system%fixed), mode, timers)
         length = sqrt(likeness(problem, mode, mode))
         work = hypot(work, dot_product(mode, merge(0.0_wp, system%load, system%fixed)) / length)
         rounding = hypot(rounding, dot_product(mode, left) / length)
      end do
   end subroutine load_on
end module load_on_modes
