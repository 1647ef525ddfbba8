!> Makes one increment: predictor and Newton iterations from a converged point to the next one. A linear complementarity problem
!> (LCP) determines which candidates at nodes are in contact.
module corrector
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t, control_row, follow_nodes
   use state_transfer, only: kept_t
   use contact_set, only: contact_step_t
   use increment_report, only: increment_t
   use converged_state, only: contact_holds
   use newton_iteration, only: iterate, solve_step, move
   implicit none
   private
   public :: increment_t, take_increment, correct

   integer, parameter :: max_contact_loops = 12 !! largest number of outer loops in the scheme of Silveira & Goncalves (2001)

contains

   !> Makes the increment of the control from `start`. On success `state` is the new point, and `system` is assembled and factored
   !> there; on failure `state` is undefined, and the factors in `system` belong to no point of the path.
   subroutine take_increment(problem, start, control, state, system, report, keep_contact)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! in: assembled and factored at `start`
      type(increment_t), intent(out) :: report
      logical, intent(in), optional :: keep_contact !! true: the contact set of `start` is kept, even if gaps or reactions have the
      !! wrong sign
      type(contact_step_t) :: step
      integer :: loop
      real(wp) :: rhs
      logical :: frozen

      state = start
      frozen = .false.
      if (present(keep_contact)) frozen = keep_contact
      call control_row(problem, control, start, state, system, rhs)
      if (frozen .or. .not. problem%model%step(problem%step)%paper_loop) then
         call iterate(problem, start, control, state, system, rhs, frozen, problem%model%step(problem%step)%tangent_updates, report)
         return
      end if
      ! Fig. 2 of Silveira & Goncalves (2001): LCP at the predictor, equilibrium with the contact set fixed, comparison, repetition.
      do loop = 1, max_contact_loops
         call solve_step(problem, state, system, rhs, .false., step, report)
         if (allocated(report%message)) return
         if (.not. step%flipped) call move(problem, system, step, state)
         state%active = step%active
         state%reaction = step%reaction
         call linearise(problem, state, start, system)
         if (.not. system%ok) exit
         call control_row(problem, control, start, state, system, rhs)
         call iterate(problem, start, control, state, system, rhs, .true., problem%model%step(problem%step)%tangent_updates, report)
         if (.not. report%converged) return
         if (contact_holds(problem, state, system)) return
         report%converged = .false.
         call control_row(problem, control, start, state, system, rhs)
      end do
      report%message = 'the contact set did not settle in the outer loop'
   end subroutine take_increment

   !> Corrects a predictor to equilibrium by Newton's method with a new tangent in each iteration. The distance of the equilibrium
   !> from `base` is the increment of the control.
   subroutine correct(problem, base, control, keep_contact, state, system, report, far_off, linearised, exact)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: base !! state from which the increment is measured: a converged state, or the predictor itself
      type(control_t), intent(in) :: control     !! control; its tangent must be set if its method uses the tangent
      logical, intent(in) :: keep_contact !! true: the contact set of `state` is kept, even if gaps or reactions have the wrong sign
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      type(increment_t), intent(out) :: report
      logical, intent(in), optional :: far_off   !! true: touchdown points may be far from their final positions
      logical, intent(in), optional :: linearised !! true: `system` is assembled and factored at `state`, which equals `base`
      real(wp), intent(in), optional :: exact !! largest relative size of the next correction (increment_t%left). If it is larger,
      !! the iteration goes on once more, because the residual of a soft structure is small before the point is accurate
      real(wp) :: rhs
      integer :: pass
      logical :: known
      type(state_t) :: origin
      type(control_t) :: seen
      type(kept_t) :: kept(1)
      known = .false.
      if (present(linearised)) known = linearised
      if (.not. known) call linearise(problem, state, base, system)
      if (.not. system%ok) then
         report%message = 'the tangent is singular'
         return
      end if
      origin = base
      seen = control
      do pass = 1, 2
         if (problem%moves_nodes()) call follow_nodes(problem, base, control, state, kept, origin, seen)
         call control_row(problem, seen, origin, state, system, rhs)
         call iterate(problem, base, control, state, system, rhs, keep_contact, huge(1), report, far_off)
         if (pass == 2 .or. .not. (report%converged .and. present(exact))) return
         if (report%left <= exact) return
         report%converged = .false.
      end do
   end subroutine correct
end module corrector
