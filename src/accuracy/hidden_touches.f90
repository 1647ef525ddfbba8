!> Contact that may have begun undetected, because the mesh is too coarse to compute the gaps of free spans.
!>
!> The bars of the reported numbers need not show this. For example, the force with which the ground supports a ring is the weight
!> of the ring on any mesh.
module hidden_touches
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use span_tests, only: run_span_tests
   use test_kinds, only: span_test_t, test_gap
   use state_transfer, only: kept_t, point_displacement
   use error_bar, only: resolved
   implicit none
   private
   public :: may_touch

   real(wp), parameter :: place(2) = [1.0_wp / 3.0_wp, 0.5_wp] !! places in an element, 0 to 1, at which the two polynomials are
   !! compared; at one place the difference of neighbouring orders may vanish

contains

   !> True if a gap that is not larger than the motion of the structure differs between the two problems by more than a certain part
   !> of this motion (`resolved`), up to which such differences indicate errors.
   logical function may_touch(problem, state, scale, motion, finer, solved) result(may)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      real(wp), intent(in) :: scale              !! scale of forces
      real(wp), intent(in) :: motion             !! largest displacement of a node [length]
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: solved        !! state of the enriched problem at the same point of the path
      type(span_test_t), allocatable :: gap(:), other(:)
      may = .false.
      if (.not. problem%has_spans()) return
      ! The displacements are compared first, because they cost much less than the least gaps.
      if (position_error(problem, state, finer, solved) <= resolved * motion) return
      gap = run_span_tests(problem, state, scale, only=1)
      other = run_span_tests(finer, solved, scale, only=1)
      may = any(gap%kind == test_gap .and. abs(gap%value) * problem%size <= motion .and. &
         & abs(other%value - gap%value) * problem%size > resolved * motion)
   end function may_touch

   !> Largest difference between the displacements of the two problems, at nodes and inside elements [length].
   real(wp) function position_error(problem, state, finer, solved) result(error)
      type(problem_t), intent(in) :: problem, finer
      type(state_t), intent(in) :: state, solved
      type(kept_t) :: kept, other
      real(wp) :: u(3), v(3)
      integer :: e, k
      error = maxval(norm2(solved%u(1:2, :) - state%u(1:2, :), 1))
      do e = 1, problem%model%mesh%n_elements
         if (problem%conforms(e) > 0) cycle
         do k = 1, size(place)
            call point_displacement(problem, state, e, place(k), kept, u)
            call point_displacement(finer, solved, e, place(k), other, v)
            error = max(error, norm2(v(1:2) - u(1:2)))
         end do
      end do
   end function position_error
end module hidden_touches
