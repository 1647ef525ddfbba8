!> Spans that open from nothing: there the touchdown points' own equations have no slope.
!> With the points held, load and place are found at which they are where they belong (held_touchdown).
module held_openings
   use kinds, only: wp
   use contact_spans, only: first_length
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use model, only: method_load
   use path_control, only: control_t
   use corrector, only: increment_t, correct
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

   !> Opens a span between two touchdown points: with their distance held the load, and the place of both, are found at which
   !> they are where they belong.
   subroutine begin_span(problem, run, opened, ok, others)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! numbers of touches; both the same: a line, between its own ends
      logical, intent(out) :: ok
      integer, intent(in), optional :: others(:, :) !! (2, spans) that open before: they hold as they are until the load is found
      type(problem_t) :: frozen
      type(state_t) :: state, start
      type(control_t) :: here
      type(increment_t) :: report
      integer :: ends(2), k, c
      ends = opening_ends(problem, opened)
      state = run%state
      call copy_problem(problem, frozen)
      if (present(others)) then
         do k = 1, size(others, 2)
            frozen = with_held(frozen, opening_ends(problem, others(:, k)))
         end do
      end if
      call solve_held(frozen, ends, run%system, all(ends > 0), held_steps(problem, run), state, ok)
      if (.not. ok) then
         ! At this load what begins at the same place has no length: held, too, it comes to a load at which it has one.
         state = run%state
         call copy_problem(problem, frozen)
         call solve_held(problem, [maxval(ends), 0], run%system, .false., held_steps(problem, run), state, ok, &
            & [(c, c=1, problem%candidates%n)])
         if (.not. ok) return
         here%method = method_load
         call correct(problem, state, here, .true., state, run%system, report)
         ok = report%converged
      end if
      if (.not. ok) return
      if (any(frozen%candidates%held .neqv. problem%candidates%held)) then
         start = state
         here%method = method_load
         call correct(problem, start, here, .true., state, run%system, report)
         ok = report%converged
         if (.not. ok) return
      end if
      run%state = state
      call linearise(problem, run%state, run%state, run%system)
      ok = run%system%ok
   end subroutine begin_span

   !> Brings a span that is about to open to equilibrium at the load where the run stands, its touchdown points held: what they
   !> want there tells where they go. The state stays where there is none.
   subroutine rest_held(problem, run, opened)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! as begin_span
      type(state_t) :: state
      type(control_t) :: here
      type(increment_t) :: report
      state = run%state
      here%method = method_load
      call correct(with_held(problem, opening_ends(problem, opened)), run%state, here, .true., state, run%system, report)
      if (report%converged) run%state = state
      call linearise(problem, run%state, run%state, run%system)
   end subroutine rest_held

   !> Brings a line that is about to open, at rest with its ends held, to the equilibrium further on where it has the length that it
   !> begins with, by the rate at which it grows. With its ends held there may be none: spans on straight walls that next to nothing
   !> keeps from going along them end where they have to, not where they are held. The state stays where it is not found.
   subroutine spread_ahead(problem, run, opened, ok)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! as begin_span
      logical, intent(out) :: ok
      type(state_t) :: state
      type(control_t) :: ahead
      type(increment_t) :: report
      real(wp) :: rate
      integer :: ends(2)
      ends = opening_ends(problem, opened)
      rate = spreading_rate(problem, run, opened)
      ok = all(ends > 0) .and. abs(rate) > 0.0_wp
      if (.not. ok) return
      ahead%method = method_load
      ahead%increment = (touch_place(problem, run%state, ends(2)) - touch_place(problem, run%state, ends(1))) / rate
      state = run%state
      call correct(problem, run%state, ahead, .true., state, run%system, report, far_off=.true.)
      ok = report%converged
      if (ok) run%state = state
      call linearise(problem, run%state, run%state, run%system)
   end subroutine spread_ahead

   !> Steps of load factor and place for differences.
   pure function held_steps(problem, run) result(step)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp) :: step(2)
      step = [held_load(run), 1.0e-2_wp * first_length * maxval(problem%layout%rod_segment%length)]
   end function held_steps

   !> That of the load factor.
   pure real(wp) function held_load(run) result(step)
      type(path_state_t), intent(in) :: run
      step = 1.0e-4_wp * max(abs(run%last_load), 1.0e-3_wp * abs(run%state%load_factor))
   end function held_load

   !> Candidates at the ends of an opening span, those that move: of one line both, of two contacts the ends that face each other.
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

   !> How the new span grows along the path, per unit of load factor: lines by the misfit of their ends, points by where the better
   !> told of moment and curvature has them.
   real(wp) function spreading_rate(problem, run, opened) result(rate)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run             !! its system factored
      integer, intent(in) :: opened(2)           !! as begin_span
      type(state_t) :: ahead, here
      real(wp) :: step, misfit(2), place(problem%candidates%n), change
      integer :: ends(2), k
      ends = opening_ends(problem, opened)
      call states_along(problem, run%system, run%state, 1.0_wp, here, ahead, step)
      misfit = opening_misfit(problem, ends, ahead) - opening_misfit(problem, ends, here)
      place = touchdown_steps(problem, run%state, ahead) - touchdown_steps(problem, run%state, here)
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
