!> Shortens a Newton step that is far too long because of a foundation.
!>
!> If a structure loses its last contact in an iteration, it has almost no stiffness, and the next step is arbitrarily long. The
!> work of the unbalanced forces along this step changes its sign where the foundations support the structure again. Newton's method
!> converges from the point of this change. The search is made only if a step strongly increases the residual.
module step_search
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, assemble
   implicit none
   private
   public :: shorten_step, step_work

contains

   !> Moves the state back along its last step to the point where the work of the unbalanced forces along the step changes its sign.
   subroutine shorten_step(problem, origin, from, x, work_at_start, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: origin        !! last converged point
      type(state_t), intent(in) :: from          !! state before the step, on the same nodes as after the step
      real(wp), intent(in) :: x(:)               !! step (increment of the unknowns), node axes
      real(wp), intent(in) :: work_at_start      !! step_work before the step
      type(state_t), intent(inout) :: state      !! in: state after the whole step; out: state after a part of the step
      type(system_t), intent(inout) :: system    !! assembled at `state` on entry and on return
      integer, parameter :: max_tries = 40
      real(wp), parameter :: enough = 0.1_wp     !! remaining work, divided by the work before the step, at which the search ends
      real(wp), parameter :: torn = 0.1_wp       !! defect of an element above which its forces are meaningless
      type(state_t) :: whole
      real(wp) :: low, high, work_low, work_high, part, work
      integer :: try
      whole = state
      if (.not. work_at_start < 0.0_wp) return
      low = 0.0_wp
      high = 1.0_wp
      work_low = work_at_start
      work_high = huge(1.0_wp)
      part = 1.0_wp
      do try = 1, max_tries
         work = step_work(system, x)
         if (system%ok .and. system%defect_residual < torn) then
            if (abs(work) <= enough * abs(work_at_start)) return
            ! If the work is still negative at the end of the step and all elements are valid, the whole step is kept.
            if (work < 0.0_wp .and. high >= 1.0_wp) return
         else
            work = huge(1.0_wp)
         end if
         if (work > 0.0_wp) then
            high = part
            work_high = work
         else
            low = part
            work_low = work
         end if
         ! The order of magnitude of the distance to the foundation is unknown: the step is reduced to a tenth several times, then
         ! by secants and bisection.
         if (low <= 0.0_wp .or. work_high > 1.0e10_wp * abs(work_low)) then
            part = max(0.1_wp * high, 0.5_wp * (low + high))
            if (low <= 0.0_wp) part = 0.1_wp * high
         else
            part = (low * work_high - high * work_low) / (work_high - work_low)
            part = min(max(part, low + 0.1_wp * (high - low)), high - 0.1_wp * (high - low))
         end if
         state = between(part)
         call assemble(problem, state, origin, system)
      end do

   contains

      !> State after a part of the step, on the same nodes.
      type(state_t) function between(share)
         real(wp), intent(in) :: share
         between = whole
         between%load_factor = from%load_factor + share * (whole%load_factor - from%load_factor)
         between%u = from%u + share * (whole%u - from%u)
         between%z = from%z + share * (whole%z - from%z)
      end function between
   end subroutine shorten_step

   !> Work of the unbalanced forces (internal minus external) on an increment. The work is negative while the increment reduces the
   !> energy.
   pure real(wp) function step_work(system, x) result(work)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:) !! (n) increment, node axes
      work = sum(system%residual * x, mask=.not. system%fixed)
   end function step_work
end module step_search
