!> Starts free spans and line contacts of zero length. At zero length the equations of their touchdown points are singular; the
!> touchdown points are therefore fixed, and the load and the position are found at which the contact conditions are satisfied
!> (held_touchdown).
module held_openings
   use kinds, only: wp
   use contact_spans, only: first_length
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t
   use model, only: method_load
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use path_point, only: path_point_t, move_to
   use path_state, only: path_state_t
   use touchdown_points, only: with_held, opening_misfit, touchdown_steps
   use span_candidates, only: touch_place
   use tangent_step, only: states_along
   use held_touchdown, only: solve_held
   implicit none
   private
   public :: begin_span, rest_held, spread_ahead, held_steps, held_load, &
      & spreading_rate

contains

   !> Opens a span between two touchdown points: with their distance fixed, the load and the common position are found at which both
   !> satisfy their contact conditions.
   subroutine begin_span(problem, run, opened, ok, others)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! numbers of contact spans; both equal: a line contact, between its own ends
      logical, intent(out) :: ok
      integer, intent(in), optional :: others(:, :) !! (2, spans) spans that open as well: fixed until the load is found
      type(problem_t) :: frozen
      type(state_t) :: state, start
      type(system_t) :: system
      type(control_t) :: here
      type(increment_t) :: report
      integer :: ends(2), k, c
      ends = opening_ends(problem, opened)
      state = run%last%state
      system = run%last%system
      call copy_problem(problem, frozen)
      if (present(others)) then
         do k = 1, size(others, 2)
            frozen = with_held(frozen, opening_ends(problem, others(:, k)))
         end do
      end if
      call solve_held(frozen, ends, system, all(ends > 0), held_steps(problem, run), state, ok)
      if (.not. ok) then
         ! Another span starts here with zero length: all touchdown points are fixed, and the load is found first.
         state = run%last%state
         call copy_problem(problem, frozen)
         call solve_held(problem, [maxval(ends), 0], system, .false., held_steps(problem, run), state, ok, &
            & [(c, c=1, problem%candidates%n)])
         if (.not. ok) return
         here%method = method_load
         call correct(problem, state, here, .true., state, system, report)
         ok = report%converged
      end if
      if (.not. ok) return
      if (any(frozen%candidates%held .neqv. problem%candidates%held)) then
         start = state
         here%method = method_load
         call correct(problem, start, here, .true., state, system, report)
         ok = report%converged
         if (.not. ok) return
      end if
      call move_to(problem, state, run%last)
      ok = run%last%system%ok
   end subroutine begin_span

   !> Finds the equilibrium at the run's load with the touchdown points of an opening span fixed; the misfits of their contact
   !> conditions give the sense in which the touchdown points will move. Without an equilibrium the state is unchanged.
   subroutine rest_held(problem, run, opened)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! numbers of contact spans, as in begin_span
      type(state_t) :: state
      type(system_t) :: system
      type(control_t) :: here
      type(increment_t) :: report
      state = run%last%state
      system = run%last%system
      here%method = method_load
      call correct(with_held(problem, opening_ends(problem, opened)), run%last%state, here, .true., state, system, report)
      if (report%converged) call move_to(problem, state, run%last)
   end subroutine rest_held

   !> Moves a line contact of zero length, in equilibrium with fixed ends, to the load at which it has its initial length, by the
   !> rate at which it grows. Fixed ends may have no equilibrium: at straight walls with little resistance along the wall, the
   !> positions of the ends are determined by equilibrium. The state is unchanged if no equilibrium is found.
   subroutine spread_ahead(problem, run, opened, ok)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! numbers of contact spans, as in begin_span
      logical, intent(out) :: ok
      type(state_t) :: state
      type(system_t) :: system
      type(control_t) :: ahead
      type(increment_t) :: report
      real(wp) :: rate
      integer :: ends(2)
      ends = opening_ends(problem, opened)
      rate = spreading_rate(problem, run%last, opened)
      ok = all(ends > 0) .and. abs(rate) > 0.0_wp
      if (.not. ok) return
      ahead%method = method_load
      ahead%increment = (touch_place(problem, run%last%state, ends(2)) - touch_place(problem, run%last%state, ends(1))) / rate
      state = run%last%state
      system = run%last%system
      call correct(problem, run%last%state, ahead, .true., state, system, report, far_off=.true.)
      ok = report%converged
      if (ok) call move_to(problem, state, run%last)
   end subroutine spread_ahead

   !> Steps of the load factor and of the position [length] for finite differences.
   pure function held_steps(problem, run) result(step)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp) :: step(2)
      step = [held_load(run), 1.0e-2_wp * first_length * maxval(problem%layout%rod_segment%length)]
   end function held_steps

   !> Step of the load factor for finite differences.
   pure real(wp) function held_load(run) result(step)
      type(path_state_t), intent(in) :: run
      step = 1.0e-4_wp * max(abs(run%last_load), 1.0e-3_wp * abs(run%last%state%load_factor))
   end function held_load

   !> Free candidates at the ends of an opening span: both ends of a line contact, or the facing ends of two contacts; 0: none.
   pure function opening_ends(problem, opened) result(ends)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: opened(2)
      integer :: ends(2), k, side
      ends = 0
      do side = 1, 2
         k = findloc(problem%contact_span%number, opened(side), 1)
         if (k > 0) ends(side) = problem%contact_span(k)%candidate(merge(side, 3 - side, opened(1) == opened(2)))
         if (ends(side) == 0) cycle
         if (.not. problem%candidates%moves(ends(side))) ends(side) = 0
      end do
   end function opening_ends

   !> Rate at which the new span grows along the path, per unit of load factor: for the end of a line contact by the misfit of its
   !> condition, for a point contact by the change of its position.
   real(wp) function spreading_rate(problem, point, opened) result(rate)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      integer, intent(in) :: opened(2)           !! numbers of contact spans, as in begin_span
      type(state_t) :: ahead, here
      real(wp) :: step, misfit(2), place(problem%candidates%n), change
      integer :: ends(2), k
      ends = opening_ends(problem, opened)
      call states_along(problem, point%system, point%state, 1.0_wp, here, ahead, step)
      misfit = opening_misfit(problem, ends, ahead) - opening_misfit(problem, ends, here)
      place = touchdown_steps(problem, point%state, ahead) - touchdown_steps(problem, point%state, here)
      rate = 0.0_wp
      do k = 1, 2
         if (ends(k) == 0) cycle
         change = place(ends(k))
         if (problem%candidates%follows(ends(k))) change = misfit(k) * problem%size
         rate = rate + merge(-1.0_wp, 1.0_wp, k == 1) * change
      end do
      rate = rate / step
   end function spreading_rate
end module held_openings
