!> The contact set just after a stress-free start.
!>
!> To first order the structure and its contacts answer proportionally to any small load, so the LCP of one gives
!> the set that every first increment of that sense begins with. Displacement control needs it beforehand: what touches
!> at the start would hold the very displacement that is to be prescribed.
module first_contact
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use contact_set, only: contact_step_t, solve_contact_step
   use path_control, only: control_t, control_row
   use monitor_rows, only: monitor_change
   implicit none
   private
   public :: presume_contact

contains

   !> Replaces the touching candidates of a stress-free state by those in contact under a small load that moves the
   !> controlled monitor the right way. Left as it was when no such set is found: the first increment then says why.
   subroutine presume_contact(problem, monitor, increment, state, system)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: monitor             !! index into model%monitor
      real(wp), intent(in) :: increment          !! its sign counts
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! assembled and factored at `state` on entry and on return
      integer, parameter :: max_rounds = 30
      real(wp), parameter :: small = sqrt(epsilon(1.0_wp)) !! load factor: what is open by more than rounding stays open
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
   end subroutine presume_contact
end module first_contact
