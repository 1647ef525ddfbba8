!> Two neighbouring states on the path tangent, from which derivatives along the path are computed by differences.
module tangent_step
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: apply_increment
   use node_contact_functional, only: reaction_rate
   implicit none
   private
   public :: states_along

   real(wp), parameter :: little = 1.0e-6_wp !! largest displacement in the step, over the structure's size, and largest rotation
   !! [rad]; differences over such a step keep half of the digits

contains

   !> The state at a point of the path, and the state after a small increment of the load factor along the path tangent.
   subroutine states_along(problem, system, state, load, here, ahead, step, size_step)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored at the state
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: load               !! only its sign is used: > 0 if the load factor increases along the path
      type(state_t), intent(out) :: here, ahead
      real(wp), intent(out) :: step              !! increment of the load factor, with the sign of `load`
      real(wp), intent(in), optional :: size_step !! largest displacement over the structure's size, or largest rotation [rad], in
      !! the step
      integer :: c
      step = little
      if (present(size_step)) step = size_step
      step = sign(small_load(problem, system, state%load_factor, step), load)
      ! On a new mesh the state is in equilibrium only after one more iteration. Both states include the change by this iteration,
      ! so that it cancels in differences.
      here = state
      ahead = state
      call apply_increment(problem, system, 0.0_wp * system%tangent, 0.0_wp, here)
      call apply_increment(problem, system, step * system%tangent, step, ahead)
      do c = 1, problem%candidates%n
         if (state%active(c)) ahead%reaction(c) = state%reaction(c) + step * reaction_rate(problem, state, system, c)
      end do
   end subroutine states_along

   !> Increment of the load factor along the tangent that displaces and rotates no node by more than `most`, and does not exceed the
   !> magnitude of the load factor (or 1, if this is larger).
   pure real(wp) function small_load(problem, system, load, most) result(step)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      real(wp), intent(in) :: load               !! load factor
      real(wp), intent(in) :: most               !! largest displacement over the structure's size, and largest rotation [rad]
      real(wp) :: rate
      associate (u => system%tangent)
         rate = max(tiny(rate), maxval(abs(u(1::3))) / problem%size, maxval(abs(u(2::3))) / problem%size, maxval(abs(u(3::3))))
      end associate
      step = min(most / rate, max(abs(load), 1.0_wp))
   end function small_load
end module tangent_step
