!> Places of changes at which a length vanishes: the free span between a line contact and a segment boundary of its rod, or between
!> two line contacts on both sides of the boundary; a line contact at a support on the obstacle. The length becomes too short for a
!> mesh before it vanishes, so the place is found with the set without this length. Where ends of contacts arrive at a boundary, the
!> boundary node is fixed to the obstacle by a couple, and this couple is zero at the change. (If two ends arrive and no couple
!> acts, the fixing force is zero.) Where contact is lost at a support, the curvature or slope of the rod relative to the obstacle
!> is zero at the support.
module vanished_length
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use breakpoint_forces, only: breakpoint_couple, breakpoint_force, left_over, is_supported
   use past_breakpoints, only: beyond
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: end_moved, shrunk
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_couple, test_force, test_curvature, test_slope, test_length
   use other_set, only: other_set_t, new_other_set
   use test_zero, only: find_test_zero, quantity_t
   implicit none
   private
   public :: find_vanished

   !> Force, couple, curvature or slope at the node where the length has vanished.
   type, extends(quantity_t) :: vanished_t
      integer :: candidate = 0                   !! candidate at the boundary or support; 0: none
      logical :: at_support = .false.            !! contact beside a support on the obstacle is lost
      logical :: meets = .false.                 !! two line contacts meet at the boundary
   contains
      procedure :: evaluate
      procedure :: number_of
   end type vanished_t

contains

   !> Finds the equilibrium at which a length has vanished, ahead of a state at which the length is short.
   subroutine find_vanished(problem, state, test, step, tolerance, next, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! equilibrium of `problem`
      type(span_test_t), intent(in) :: test      !! test of the length that vanishes, of kind test_length or test_boundary_span
      real(wp), intent(in) :: step !! first step of the load factor in the secant method; it is prescribed, so a small one does not
      !! show convergence
      real(wp), intent(in) :: tolerance          !! largest last step of the secant method, as a share of the load factor
      type(other_set_t), intent(out) :: next          !! the set without the length, with the index of the test that is zero
      logical, intent(out) :: found              !! false: no such length, or no such equilibrium
      type(vanished_t) :: vanished
      type(span_test_t), allocatable :: tests(:)
      vanished%at_support = test%kind == test_length
      call set_without(problem, state, test, next, vanished%candidate, vanished%meets)
      found = vanished%candidate > 0
      if (found) call find_test_zero(next, vanished, step, tolerance, found, tests)
      if (found) next%test = vanished%number_of(next, tests)
   end subroutine find_vanished

   !> Computes the quantity that is zero at the change.
   subroutine evaluate(self, set, tests, value, found)
      class(vanished_t), intent(in) :: self
      type(other_set_t), intent(in) :: set
      type(span_test_t), intent(in) :: tests(:)
      real(wp), intent(out) :: value
      logical, intent(out) :: found
      integer :: number
      value = 0.0_wp
      number = self%number_of(set, tests)
      found = number > 0
      if (.not. found) return
      value = tests(number)%value
      if (tests(number)%kind == test_couple) value = breakpoint_couple(set%problem, set%state, self%candidate)
   end subroutine evaluate

   !> Index of the test that is zero at the change; of several tests at the support, the one nearest to zero.
   integer function number_of(self, set, tests) result(number)
      class(vanished_t), intent(in) :: self
      type(other_set_t), intent(in) :: set
      type(span_test_t), intent(in) :: tests(:)
      logical :: mine(size(tests))
      mine = tests%candidate == self%candidate
      if (self%at_support) then
         mine = mine .and. (tests%kind == test_curvature .or. tests%kind == test_slope)
      else
         mine = mine .and. tests%kind == merge(test_force, test_couple, lifted_by_force())
      end if
      number = minloc(abs(tests%value), 1, mask=mine)

   contains

      !> True if two line contacts meet and no couple acts at the boundary.
      logical function lifted_by_force()
         lifted_by_force = self%meets
         if (lifted_by_force) lifted_by_force = abs(breakpoint_couple(set%problem, set%state, self%candidate)) <= &
            & left_over(set%problem) * abs(breakpoint_force(set%problem, set%state, self%candidate)) * set%problem%size
      end function lifted_by_force
   end function number_of

   !> Makes the contact set without the length.
   subroutine set_without(problem, state, test, next, c, meets)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(in) :: test
      type(other_set_t), intent(out) :: next
      integer, intent(out) :: c                  !! candidate at the boundary or support; 0: none
      logical, intent(out) :: meets              !! true: two line contacts meet at the boundary
      type(contact_span_t), allocatable :: set(:)
      integer :: k, side
      logical :: at_support                      ! contact beside a support on the obstacle is lost
      c = 0
      meets = .false.
      set = present_contact_spans(problem, state)
      at_support = test%kind == test_length
      k = test%contact_span
      if (at_support) then
         side = findloc([is_supported(problem, state, set(k)%candidate(1)), is_supported(problem, state, &
            & set(k)%candidate(2))], .true., 1)
         if (side == 0) return
         set = shrunk(set, k, set(k)%at(side))
      else
         side = merge(1, 2, test%sense < 0.0_wp)
         if (.not. set(k)%line) return
         call bring_to_boundary(problem, k, side, set, meets)
      end if
      next = new_other_set(problem, state, set)
      if (at_support) next%label = 'C-'
      c = next%problem%contact_span(k)%candidate(side)
   end subroutine set_without

   !> Moves the end of a line contact to the boundary of its rod segment. If another line contact arrives at this boundary from the
   !> other side, its end is moved there, too.
   subroutine bring_to_boundary(problem, k, side, set, meets)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k, side             !! index of the line contact in `set`, and its end: 1 first, 2 last
      type(contact_span_t), allocatable, intent(inout) :: set(:)
      logical, intent(out) :: meets              !! true: another line contact arrives from the other side
      integer :: other, rod_segment
      set = end_moved(set, k, side, merge(0.0_wp, problem%layout%rod_segment(set(k)%rod_segment)%length, side == 1))
      rod_segment = beyond(problem, k, merge(-1, 1, side == 1))
      other = findloc(problem%contact_span%rod_segment == rod_segment .and. problem%contact_span%contact == set(k)%contact, &
         & .true., 1, back=side == 1)
      meets = other > 0
      if (meets) meets = set(other)%line .and. problem%candidates%moves(set(other)%candidate(3 - side))
      if (meets) set = end_moved(set, other, 3 - side, merge(problem%layout%rod_segment(rod_segment)%length, 0.0_wp, side == 1))
   end subroutine bring_to_boundary
end module vanished_length
