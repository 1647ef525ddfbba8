!> Contacts that carry no force: the state is in balance with them and without.
!>
!> A rod pressed flat against a straight wall touches it between the ends of the contact without any reaction. Held there
!> it may be stable while nothing but its stiffness keeps it from leaving: its tangent without these contacts tells, and
!> where that has a zero eigenvalue other paths leave, to the side on which the contacts open.
module weak_contacts
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use contact_set, only: inside_region, weak_reaction
   use timing, only: timers_t
   implicit none
   private
   public :: release_weak, count_released, opening_sense

contains

   !> A state without the contacts inside regions that carry no force.
   subroutine release_weak(problem, state, system, released, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      type(state_t), intent(out) :: released
      logical, intent(out) :: any_weak           !! false: there are none
      real(wp), parameter :: margin = 10.0_wp    ! over what no contact may pull with
      logical :: weak
      integer :: c
      released = state
      any_weak = .false.
      do c = 1, problem%candidates%n
         if (.not. problem%model%obstacle(problem%candidates%obstacle(c))%rigid .or. problem%candidates%bilateral(c)) cycle
         weak = inside_region(problem, state, c) .and. &
            & abs(state%reaction(c)) <= margin * weak_reaction(problem) * system%force_scale
         if (.not. weak) cycle
         released%active(c) = .false.
         released%reaction(c) = 0.0_wp
         any_weak = .true.
      end do
   end subroutine release_weak

   !> Negative pivots of the tangent without weak contacts.
   subroutine count_released(problem, state, system, pivots, any_weak, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled and factored at `state`
      integer, intent(out) :: pivots             !! without any: those of the system
      logical, intent(out) :: any_weak
      type(timers_t), intent(inout) :: timers
      type(state_t) :: released
      type(system_t) :: other
      pivots = system%negative_pivots
      any_weak = .false.
      if (problem%candidates%n == 0) return
      call release_weak(problem, state, system, released, any_weak)
      if (.not. any_weak) return
      other = new_system(problem)
      call linearise(problem, released, released, other, timers)
      ! A contact point between spans that both are straight has a coordinate without energy, whose sign is rounding.
      if (other%ok) pivots = max(other%negative_pivots, 0)
   end subroutine count_released

   !> The sense in which a mode opens all contacts that were released: 1 along it, -1 against it, 0 neither.
   pure integer function opening_sense(problem, state, released, mode) result(sense)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state, released
      real(wp), intent(in) :: mode(:, :)         !! (3, nodes) global axes
      real(wp), parameter :: closed = 1.0e-3_wp  ! of the largest opening
      real(wp) :: gap, normal(2), bend, opening, most, least
      integer :: c
      most = 0.0_wp
      least = 0.0_wp
      do c = 1, problem%candidates%n
         if (state%active(c) .eqv. released%active(c)) cycle
         call candidate_gap(problem, state, c, gap, normal, bend)
         opening = dot_product(normal, mode(1:2, problem%candidates%node(c)))
         most = max(most, opening)
         least = min(least, opening)
      end do
      sense = 0
      if (-least <= closed * most .and. most > 0.0_wp) sense = 1
      if (most <= -closed * least .and. least < 0.0_wp) sense = -1
   end function opening_sense
end module weak_contacts
