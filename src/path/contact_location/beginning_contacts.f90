!> Point contacts that begin where gaps close: at the onset the contact force is zero. The gap inside a free span is only as
!> accurate as the element polynomials; with a node at the new contact the onset is as accurate as nodal values.
module beginning_contacts
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use node_contact_functional, only: reaction_rate
   use contact_spans, only: contact_span_t, closed_share
   use contact_set_edits, only: numbered
   use span_candidates, only: present_contact_spans, touch_place, rolls_at
   use test_kinds, only: span_test_t
   use span_forces, only: end_force
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use other_set, only: other_set_t, copy_other_set, new_other_set
   implicit none
   private
   public :: begin_contacts, release, candidate_of

contains

   !> Adds a point contact at the place of each gap of a free span that is zero, and finds the equilibrium in which the force of the
   !> first new contact is zero.
   subroutine begin_contacts(problem, state, begins, last, next, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! of `problem`, at the zero of the gaps
      type(span_test_t), intent(inout) :: begins(:) !! tests of the gaps; out: at the places of the new contacts
      integer, intent(in) :: last                !! last number given to a contact span
      type(other_set_t), intent(out) :: next !! the set with the new contacts, without path tangent; the new contact spans come last
      logical, intent(out) :: found              !! false: no force-free equilibrium near this state
      type(contact_span_t) :: new(size(begins))
      integer :: k, c
      do k = 1, size(begins)
         new(k) = contact_span_t(contact=begins(k)%contact, rod_segment=begins(k)%rod_segment, &
            & at=spread(place_or_boundary(problem, begins(k)), 1, 2))
      end do
      next = new_other_set(problem, state, numbered([present_contact_spans(problem, state), new], last))
      call release(next, last + 1, found)
      if (.not. found) return
      do k = 1, size(begins)
         c = candidate_of(next%problem, last + k)
         if (c > 0) begins(k)%at = touch_place(next%problem, next%state, c)
      end do
   end subroutine begin_contacts

   !> Moves a set to the load factor at which the force of a point contact is zero.
   subroutine release(next, number, found)
      type(other_set_t), intent(inout) :: next  !! unchanged if there is no such equilibrium
      integer, intent(in) :: number              !! number of the contact span
      logical, intent(out) :: found              !! false: no equilibrium near the state
      integer, parameter :: most_steps = 8 ! Newton steps converge quadratically; with more steps a force-free point contact drifts
      type(control_t) :: control
      type(increment_t) :: report
      type(other_set_t) :: free
      type(state_t) :: base
      real(wp) :: rate
      integer :: c, try
      c = candidate_of(next%problem, number)
      found = .true.
      if (c == 0) return
      call copy_other_set(next, free)
      control%method = method_load
      control%increment = 0.0_wp
      ! The rounding error of the residual is judged relative to the load, because the increment may be arbitrarily small.
      control%whole = next%state%load_factor
      do try = 1, most_steps
         base = free%state
         call correct(free%problem, base, control, .true., free%state, free%system, report)
         found = report%converged
         if (.not. found) exit
         rate = reaction_rate(free%problem, free%state, free%system, c)
         found = abs(rate) > 0.0_wp
         if (.not. found) exit
         control%increment = -end_force(free%problem, free%state, c) / rate
         ! Converged: the correction of the load is at most ten times its rounding. With eight times, one deck of the tests makes a
         ! further correction, in which the contact drifts along the rod.
         if (abs(control%increment) <= 10.0_wp * epsilon(rate) * abs(free%state%load_factor)) exit
      end do
      found = found .and. abs(control%increment) <= sqrt(epsilon(rate)) * abs(free%state%load_factor)
      if (found) call copy_other_set(free, next)
   end subroutine release

   !> Position along the rod segment where a contact begins: the place of the gap, or a segment boundary closer to it than
   !> `closed_share` of the segment. The boundary is taken only if a point contact can roll past it along a smooth rod.
   pure real(wp) function place_or_boundary(problem, test) result(at)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: test
      at = test%at
      associate (length => problem%layout%rod_segment(test%rod_segment)%length)
         if (test%at <= closed_share * length) then
            if (rolls_at(problem, test%contact, test%rod_segment, 1)) at = 0.0_wp
         else if (test%at >= (1.0_wp - closed_share) * length) then
            if (rolls_at(problem, test%contact, test%rod_segment, 2)) at = length
         end if
      end associate
   end function place_or_boundary

   !> Candidate (node) at the beginning of the contact span with a given number; 0: the candidate belongs to another contact span.
   pure integer function candidate_of(problem, number) result(c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: number
      integer :: k
      c = 0
      k = findloc(problem%contact_span%number, number, 1)
      if (k > 0) c = problem%contact_span(k)%candidate(1)
      if (c > 0) then
         if (problem%candidates%contact_span(c) /= k) c = 0
      end if
   end function candidate_of
end module beginning_contacts
