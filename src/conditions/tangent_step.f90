!> Two states next to each other on the tangent of a path: what a number differs by from one to the other is its slope.
module tangent_step
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: apply_increment
   use contact_response, only: reaction_rate
   implicit none
   private
   public :: states_along

   real(wp), parameter :: little = 1.0e-6_wp !! of the structure, or rad: what is left of a slope is as good as the root of rounding

contains

   !> A state, and the one that a small increment of the load factor leads to.
   subroutine states_along(problem, system, state, load, here, ahead, step)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored at the state
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: load               !! its sign: whether the load grows or falls on the way ahead
      type(state_t), intent(out) :: here, ahead
      real(wp), intent(out) :: step              !! of the load factor, of that sign
      integer :: c
      step = sign(small_load(problem, system, state%load_factor), load)
      ! On a new mesh forces are in balance after the next iteration only, which both make.
      here = state
      ahead = state
      call apply_increment(problem, system, 0.0_wp * system%tangent, 0.0_wp, here)
      call apply_increment(problem, system, step * system%tangent, step, ahead)
      do c = 1, problem%candidates%n
         if (state%active(c)) ahead%reaction(c) = state%reaction(c) + step * reaction_rate(problem, system, c)
      end do
   end subroutine states_along

   !> A step of the load factor that moves nothing by more than a little, nor turns it by more than that; where nothing moves it is
   !> the whole load, or 1.
   pure real(wp) function small_load(problem, system, load) result(step)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: load               !! factor
      real(wp) :: rate
      integer :: node, d
      rate = tiny(rate)
      do node = 1, problem%model%mesh%n_nodes
         d = dof(problem, node, 1)
         associate (u => system%tangent(d:d + 2))
            rate = max(rate, maxval(abs(u(1:2))) / problem%size, abs(u(3)))
         end associate
      end do
      step = min(little / rate, max(abs(load), 1.0_wp))
   end function small_load
end module tangent_step
