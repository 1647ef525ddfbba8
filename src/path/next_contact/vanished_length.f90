!> Places of changes at which a length vanishes: the free span between a line contact and a segment boundary of its rod, or a line
!> contact at a support on its obstacle. The length becomes too short for a mesh before it vanishes, so the place is found with the
!> set without this length. Where the end of a contact arrives at a boundary, the boundary is fixed to the obstacle and the fixing
!> couple is zero; where a line contact vanishes, the relative curvature or slope of the rod at the support is zero.
module vanished_length
   use kinds, only: wp
   use problem, only: problem_t
   use bordered_system, only: linearise
   use breakpoint_forces, only: breakpoint_couple, stands
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: end_moved, shrunk
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_couple, test_curvature, test_slope, test_crossing, test_length
   use next_spans, only: next_t, new_next, go_to_load, tests_of
   use path_point, only: path_point_t
   implicit none
   private
   public :: find_vanished

   integer, parameter :: most = 8            !! loads of the secant method
   real(wp), parameter :: exact = 1.0e-12_wp !! change of the load in its last step / load

contains

   !> Finds the equilibrium at which a length has vanished, slightly ahead of a point at which the length is very short.
   subroutine find_vanished(problem, point, test, step, next, found)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point    !! equilibrium of `problem`
      type(span_test_t), intent(in) :: test      !! its test of the length
      real(wp), intent(in) :: step               !! first step of the load factor
      type(next_t), intent(out) :: next          !! the set without the length; its test is the one that is zero
      logical, intent(out) :: found              !! false: no such length, or no such equilibrium
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: load(2), value(2)
      integer :: c, try
      call set_without(problem, point, test, next, c)
      found = c > 0
      if (.not. found) return
      load(1) = point%state%load_factor
      call look_at(load(1), value(1))
      load(2) = load(1) + step
      do try = 1, most
         if (found) call look_at(load(2), value(2))
         if (found) found = abs(value(2) - value(1)) > 0.0_wp
         if (.not. found) return
         if (abs(load(2) - load(1)) <= exact * abs(load(2))) exit
         load = [load(2), load(2) - value(2) * (load(2) - load(1)) / (value(2) - value(1))]
         value(1) = value(2)
      end do
      found = try <= most
      if (.not. found) return
      call linearise(next%problem, next%state, next%state, next%system)
      found = next%system%ok
      tests = tests_of(next)
      next%test = number_of(tests)

   contains

      !> Computes the quantity that is zero at the change, at a load factor.
      subroutine look_at(load, value)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: value
         call go_to_load(next, load, tests)
         value = 0.0_wp
         found = allocated(tests)
         if (found) found = number_of(tests) > 0
         if (.not. found) return
         value = tests(number_of(tests))%value
         if (tests(number_of(tests))%kind == test_couple) value = breakpoint_couple(next%problem, next%state, c)
      end subroutine look_at

      !> Number of the test that is zero at the change: of several at the support, the one nearest to zero.
      pure integer function number_of(tests) result(number)
         type(span_test_t), intent(in) :: tests(:)
         logical :: mine(size(tests))
         mine = tests%candidate == c
         if (test%kind == test_crossing) mine = mine .and. tests%kind == test_couple
         if (test%kind == test_length) mine = mine .and. (tests%kind == test_curvature .or. tests%kind == test_slope)
         number = minloc(abs(tests%value), 1, mask=mine)
      end function number_of
   end subroutine find_vanished

   !> Makes the contact set without the length.
   subroutine set_without(problem, point, test, next, c)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      type(span_test_t), intent(in) :: test
      type(next_t), intent(out) :: next
      integer, intent(out) :: c                  !! candidate at the boundary or support; 0: none
      type(contact_span_t), allocatable :: set(:)
      integer :: k, side
      c = 0
      k = test%contact_span
      if (.not. problem%contact_span(k)%line) return
      set = present_contact_spans(problem, point%state)
      if (test%kind == test_crossing) then
         side = merge(1, 2, test%sense < 0.0_wp)
         set = end_moved(set, k, side, merge(0.0_wp, problem%layout%rod_segment(test%rod_segment)%length, side == 1))
      else
         side = findloc([stands(problem, point%state, set(k)%candidate(1)), stands(problem, point%state, set(k)%candidate(2))], &
            & .true., 1)
         if (side == 0) return
         set = shrunk(set, k, set(k)%at(side))
      end if
      next = new_next(problem, point%state, set)
      k = findloc(next%problem%contact_span%number, problem%contact_span(k)%number, 1)
      c = next%problem%contact_span(k)%candidate(side)
   end subroutine set_without
end module vanished_length
