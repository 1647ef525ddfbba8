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
   use weak_lines, only: release_lines, line_opening
   use timing, only: timers_t
   implicit none
   private
   public :: release_weak, count_released, opening_sense

contains

   !> The problem and a state without the contacts inside regions that carry no force.
   subroutine release_weak(problem, state, system, free, released, any_weak)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      type(problem_t), intent(out) :: free       !! with contact spans on a mesh of its own
      type(state_t), intent(out) :: released     !! of that problem
      logical, intent(out) :: any_weak           !! false: there are none, and neither is set
      real(wp), parameter :: margin = 10.0_wp    ! over what no contact may pull with
      logical :: weak
      integer :: c
      any_weak = .false.
      if (problem%spans) then
         call release_lines(problem, state, max(system%force_scale, tiny(1.0_wp)), free, released, any_weak)
         return
      end if
      released = state
      do c = 1, problem%candidates%n
         if (.not. problem%model%obstacle(problem%candidates%obstacle(c))%rigid .or. problem%candidates%bilateral(c)) cycle
         weak = inside_region(problem, state, c) .and. &
            & abs(state%reaction(c)) <= margin * weak_reaction(problem) * system%force_scale
         if (.not. weak) cycle
         released%active(c) = .false.
         released%reaction(c) = 0.0_wp
         any_weak = .true.
      end do
      if (any_weak) free = problem
   end subroutine release_weak

   !> Negative pivots of the tangent without weak contacts.
   subroutine count_released(problem, state, system, pivots, any_weak, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled and factored at `state`
      integer, intent(out) :: pivots             !! without any: those of the system
      logical, intent(out) :: any_weak
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: free
      type(state_t) :: released
      type(system_t) :: other
      pivots = system%negative_pivots
      any_weak = .false.
      if (problem%candidates%n == 0) return
      call release_weak(problem, state, system, free, released, any_weak)
      if (.not. any_weak) return
      other = new_system(free)
      call linearise(free, released, released, other, timers)
      ! A contact point between spans that both are straight has a coordinate without energy, whose sign is rounding.
      if (other%ok) pivots = max(other%negative_pivots, 0)
   end subroutine count_released

   !> The sense in which a mode opens all contacts that were released: 1 along it, -1 against it, 0 neither.
   integer function opening_sense(problem, state, free, released, mode) result(sense)
      type(problem_t), intent(in) :: problem, free
      type(state_t), intent(in) :: state, released !! of the one and of the other
      real(wp), intent(in) :: mode(:, :)         !! (3, nodes of `free`) global axes
      real(wp), parameter :: closed = 1.0e-3_wp  ! of the largest opening
      real(wp) :: gap, normal(2), bend, opening, most, least
      integer :: c
      if (problem%spans) then
         sense = line_opening(problem, state, free, released, mode)
         return
      end if
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
