!> Place of a change at which a gap closes. The place is located once more with a node at the new contact, because nodal values are
!> more accurate than gaps inside elements.
module beginning_place
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t
   use state_transfer, only: find_point
   use span_regions, only: beginning_region
   use test_kinds, only: span_test_t, any_fails, test_gap
   use span_tests, only: run_span_tests
   use contact_change_types, only: step_interval_t, change_t
   use simultaneous_tests, only: zero_tests
   use free_span_gap, only: gap_at
   use contact_spans, only: contact_span_t
   use span_candidates, only: present_contact_spans
   use beginning_contacts, only: begin_contacts
   use other_set, only: other_set_t
   use path_control, only: control_t, path_length
   use path_continuity, only: largest_distance
   use path_point, only: path_point_t
   use path_state, only: path_state_t, path_tangent_of
   use corrector, only: increment_t, correct
   use error_report, only: bars_at_contact_start
   implicit none
   private
   public :: complete_beginning, on_other_obstacle

contains

   !> Completes a located change at which a gap closes: finds the contacts that begin.
   subroutine complete_beginning(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(inout) :: change    !! in: a located change, of which the first zero test is a gap
      real(wp) :: tau
      if (.not. on_other_obstacle(present_contact_spans(problem, change%point%state), change%zero(1))) &
         & call begin_sharply(problem, step, run, interval, change)
      associate (test => change%zero(1))
         run%onset%region = beginning_region(problem, change%point%state, test%contact, test%rod_segment, test%at)
         call find_point(problem, change%point%state, test%rod_segment, test%at, run%onset%element, tau)
      end associate
   end subroutine complete_beginning

   !> Improves the place where contact begins: the gap inside a free span has only the accuracy of the element polynomials; with a
   !> node at the new contact the place has that of nodal values.
   subroutine begin_sharply(problem, step, run, interval, change)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      type(change_t), intent(inout) :: change    !! unchanged if no equilibrium with the new contact is found nearby
      type(other_set_t) :: touched
      type(path_point_t) :: better
      type(control_t) :: control
      type(increment_t) :: anew
      type(span_test_t), allocatable :: begun(:), there(:)
      logical :: found
      integer :: k
      begun = pack(change%zero, change%zero%kind == test_gap)
      call begin_contacts(problem, change%point%state, begun, run%spans_begun, touched, found)
      if (.not. found) return
      there = run_span_tests(touched%problem, touched%state, interval%scale)
      change%too_coarse = any_fails(pack(there, there%kind == test_gap))
      control%method = method_load
      control%increment = touched%state%load_factor - change%point%state%load_factor
      control%whole = change%point%state%load_factor
      better = change%point
      call correct(problem, change%point%state, control, .true., better%state, better%system, anew)
      found = anew%converged
      ! At a limit point the load does not determine the place.
      if (found) found = path_length(problem, change%point%state, better%state) <= largest_distance * path_length(problem, &
         & run%last%state, interval%to%state)
      if (.not. found) return
      better%tangent = path_tangent_of(problem, run, better)
      change%point = better
      change%report%iterations = change%report%iterations + anew%iterations
      change%report%residual = anew%residual
      change%tests = run_span_tests(problem, better%state, interval%scale)
      do k = 1, size(begun)
         begun(k)%value = gap_at(problem, better%state, begun(k)%contact, begun(k)%rod_segment, begun(k)%at) / problem%size
      end do
      change%zero = zero_tests(problem, change%tests, change%which, interval%after%value < interval%before%value, begun)
      call bars_at_contact_start(problem, step, run, better, touched%problem, touched%path_point_t, run%spans_begun + 1, &
         & change%bars)
   end subroutine begin_sharply

   !> True if the place of a gap is on a line contact with another obstacle.
   pure logical function on_other_obstacle(now, test)
      type(contact_span_t), intent(in) :: now(:)  !! the present contact spans
      type(span_test_t), intent(in) :: test
      on_other_obstacle = any(now%line .and. now%rod_segment == test%rod_segment .and. now%at(1) <= test%at .and. &
         & now%at(2) >= test%at)
   end function on_other_obstacle

end module beginning_place
