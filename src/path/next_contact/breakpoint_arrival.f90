!> Arrival of the end of a line contact at a segment boundary of its rod. The remaining free span becomes too short for a mesh
!> before it vanishes, so the arrival is found with the set in which the contact ends at the boundary: there the boundary is fixed to
!> the obstacle, and the fixing couple is zero at the arrival.
module breakpoint_arrival
   use kinds, only: wp
   use problem, only: problem_t
   use bordered_system, only: linearise
   use breakpoint_forces, only: breakpoint_couple
   use contact_set_edits, only: end_moved
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_couple
   use next_spans, only: next_t, new_next, go_to_load, tests_of
   use path_point, only: path_point_t
   implicit none
   private
   public :: find_arrival

   integer, parameter :: most = 8            !! loads of the secant method
   real(wp), parameter :: exact = 1.0e-12_wp !! change of the load in its last step / load

contains

   !> Finds the equilibrium at which the end of a line contact has arrived at a segment boundary, slightly ahead of a point at which
   !> the remaining span is very short.
   subroutine find_arrival(problem, point, test, step, next, found)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point    !! equilibrium of `problem`
      type(span_test_t), intent(in) :: test      !! its test of the length of the remaining span
      real(wp), intent(in) :: step               !! first step of the load factor
      type(next_t), intent(out) :: next          !! the set with the end at the boundary; its test is the couple's
      logical, intent(out) :: found              !! false: no line contact, or no such equilibrium
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: load(2), couple(2)
      integer :: k, side, c, try
      side = merge(1, 2, test%sense < 0.0_wp)
      k = test%contact_span
      found = problem%contact_span(k)%line
      if (.not. found) return
      next = new_next(problem, point%state, end_moved(present_contact_spans(problem, point%state), k, side, &
         & merge(0.0_wp, problem%layout%rod_segment(test%rod_segment)%length, side == 1)))
      k = findloc(next%problem%contact_span%number, problem%contact_span(k)%number, 1)
      c = next%problem%contact_span(k)%candidate(side)
      load(1) = point%state%load_factor
      call look_at(load(1), couple(1))
      load(2) = load(1) + step
      do try = 1, most
         if (found) call look_at(load(2), couple(2))
         if (found) found = abs(couple(2) - couple(1)) > 0.0_wp
         if (.not. found) return
         if (abs(load(2) - load(1)) <= exact * abs(load(2))) exit
         load = [load(2), load(2) - couple(2) * (load(2) - load(1)) / (couple(2) - couple(1))]
         couple(1) = couple(2)
      end do
      found = try <= most
      if (.not. found) return
      call linearise(next%problem, next%state, next%state, next%system)
      found = next%system%ok
      tests = tests_of(next)
      next%test = findloc(tests%kind == test_couple .and. tests%candidate == c, .true., 1)

   contains

      !> Computes the couple that fixes the boundary at a load factor.
      subroutine look_at(load, couple)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: couple
         call go_to_load(next, load, tests)
         found = allocated(tests)
         couple = 0.0_wp
         if (found) couple = breakpoint_couple(next%problem, next%state, c)
      end subroutine look_at
   end subroutine find_arrival
end module breakpoint_arrival
