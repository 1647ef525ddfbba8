!> Starts free spans of zero length. At zero length the equations of their touchdown points are singular; the
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
   use path_point, only: move_to
   use path_state, only: path_state_t
   use touchdown_points, only: with_held
   use held_touchdown, only: solve_held
   implicit none
   private
   public :: begin_span, held_steps, held_load

contains

   !> Opens a span between two touchdown points: with their distance fixed, the load and the common position are found at which both
   !> satisfy their contact conditions.
   subroutine begin_span(problem, run, opened, ok, others)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: opened(2)           !! numbers of contact spans before and after it, 0: none
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

   !> Free candidates at the ends of an opening span, the facing ends of two contacts; 0: none.
   pure function opening_ends(problem, opened) result(ends)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: opened(2)
      integer :: ends(2), k, side
      ends = 0
      do side = 1, 2
         k = findloc(problem%contact_span%number, opened(side), 1)
         if (k > 0) ends(side) = problem%contact_span(k)%candidate(3 - side)
         if (ends(side) == 0) cycle
         if (.not. problem%candidates%moves(ends(side))) ends(side) = 0
      end do
   end function opening_ends

end module held_openings
