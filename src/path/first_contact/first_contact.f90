!> Contact set just after a stress-free start.
!>
!> To first order the structure and its contacts respond proportionally to a small load. The linear complementarity problem (LCP)
!> for one small load therefore gives the contact set with which every first increment of the same sign begins. Displacement control
!> needs this set before the increment, because contacts that are closed at the start could prevent the prescribed displacement.
module first_contact
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use contact_set, only: contact_step_t, solve_contact_step
   use path_control, only: control_t, control_row
   use displacement_functional, only: monitor_change
   implicit none
   private
   public :: set_contact_of_start

contains

   !> In a stress-free state, replaces the set of candidates with zero gap by the set in contact under a small load, which moves the
   !> controlled monitor in the direction of the increment. If no such set exists, the state is unchanged, and the first increment
   !> reports the reason.
   subroutine set_contact_of_start(problem, monitor, increment, state, system)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: monitor             !! index into model%monitor
      real(wp), intent(in) :: increment          !! increment of the controlled quantity; only its sign is used
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! in/out: assembled and factored at `state`
      integer, parameter :: max_rounds = 30 ! contact sets tried at most: a few nodes change at a time until the set stays the same
      real(wp), parameter :: small = sqrt(epsilon(1.0_wp)) !! load factor of the small load, under which a gap larger than rounding
      !! does not close; with values from 1.5E-9 to 1.5E-7 every deck in input has the same results
      type(state_t) :: trial
      type(control_t) :: control
      type(contact_step_t) :: step
      real(wp) :: rhs
      integer :: round, sense
      if (.not. any(state%active)) return
      control%method = method_load
      senses: do sense = 1, -1, -2
         control%increment = small * sense
         trial = state
         do round = 1, max_rounds
            call control_row(problem, control, state, trial, system, rhs)
            call solve_contact_step(problem, trial, system, rhs, .false., step)
            if (.not. step%ok) exit
            trial%active = step%active
            if (.not. step%flipped) exit
            call linearise(problem, trial, trial, system)
            if (.not. system%ok) exit
         end do
         if (step%ok .and. .not. step%flipped) then
            if (monitor_change(problem, monitor, trial, system, step%x, step%y) * increment > 0.0_wp) then
               state = trial
               exit senses
            end if
         end if
         call linearise(problem, state, state, system)
      end do senses
      call linearise(problem, state, state, system)
   end subroutine set_contact_of_start
end module first_contact
