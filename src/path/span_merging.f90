!> Two contact points that come together: the wave of rod between them grows less until the two are one, as curved as its obstacle.
!>
!> It is the way back of a point that divides. The curvatures of both against the obstacle vanish with the square of their
!> distance, so nothing that belongs to them has a simple zero there. That of the one point that they become has.
module span_merging
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use contact_touch, only: touch_t
   use touch_edits, only: merged
   use span_problem, only: new_span_problem, present_touches
   use line_pressure, only: virtual_pressure
   use span_tests, only: run_span_tests, any_fails, test_slack, test_gap
   use span_lie_down, only: beside_free_span, free_span, span_gap
   use held_openings, only: find_flat_point
   use state_transfer, only: carried
   use path_control, only: path_length
   use path_run, only: run_t
   use timing, only: timers_t
   implicit none
   private
   public :: closing_point, find_merging

contains

   !> The other point of a wave between two that is as good as gone, where the obstacle would have to pull to hold the rod down: the
   !> two become one, not a line. 0: there is none.
   integer function closing_point(problem, state, candidate) result(partner)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate           !! of a point; the result is an index into problem%touch
      real(wp) :: span(2)
      integer :: side, k
      partner = 0
      if (virtual_pressure(problem, state, candidate) >= 0.0_wp) return
      associate (own => problem%touch(problem%candidates%touch(candidate)), now => present_touches(problem, state))
         do side = 1, 2
            if (.not. beside_free_span(problem, candidate, side)) cycle
            call free_span(problem, state, candidate, side, span)
            do k = 1, size(now)
               if (now(k)%line .or. now(k)%number == own%number .or. now(k)%stretch /= own%stretch) cycle
               if (now(k)%contact /= own%contact .or. abs(now(k)%at(1) - span(side)) > 0.0_wp) cycle
               if (abs(span_gap(problem, state, candidate, side)) <= test_slack(test_gap) * problem%size) partner = k
            end do
         end do
      end associate
   end function closing_point

   !> The equilibrium at which two points are one.
   subroutine find_merging(problem, run, near, candidate, far, next, state, system, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(state_t), intent(in) :: near          !! a state of the path where they nearly are
      integer, intent(in) :: candidate           !! one of the two
      real(wp), intent(in) :: far                !! no equilibrium further away from `near` than that is the one, arc length
      type(problem_t), intent(out) :: next
      type(state_t), intent(out) :: state        !! of `next`
      type(system_t), intent(out) :: system      !! factored there
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(touch_t), allocatable :: touch(:)
      type(state_t) :: from
      type(run_t) :: on
      integer :: own, partner, c, number
      found = .false.
      partner = closing_point(problem, near, candidate)
      if (partner == 0) return
      own = problem%candidates%touch(candidate)
      touch = present_touches(problem, near)
      number = touch(own)%number
      next = new_span_problem(problem, merged(touch, own, partner))
      c = findloc(next%candidates%touch, findloc(next%touch%number, number, 1), 1)
      on = run
      on%system = new_system(next)
      from = carried(problem, near, next)
      state = from
      call find_flat_point(next, on, c, state, found, timers)
      if (.not. found) return
      found = path_length(next, from, state) <= far
      if (.not. found) return
      system = on%system
      call linearise(next, state, state, system, timers)
      found = system%ok
      if (found) found = .not. any_fails(run_span_tests(next, state, max(system%force_scale, tiny(far))))
   end subroutine find_merging
end module span_merging
