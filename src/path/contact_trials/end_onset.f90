!> Onset of a contact set that holds a contact at an end of a rod or at a corner. The contact has come there along the rod, and the
!> length between it and the end has vanished. A length is located only down to the least length that a mesh can have; the set that
!> holds the contact begins where the gap's slope at the end is zero, which is the exact place. The path has a corner there: length
!> and slope are complementary, like gap and force.
module end_onset
   use kinds, only: wp
   use test_kinds, only: span_test_t, is_length, test_slope
   use span_candidates, only: present_contact_spans
   use contact_spans, only: contact_span_t
   use other_set, only: other_set_t, copy_other_set
   use test_zero, only: quantity_t, find_test_zero
   use tried_sets, only: change_place_t
   implicit none
   private
   public :: go_to_end_onset

   !> Slope of the gap beside a contact that is held at an end.
   type, extends(quantity_t) :: end_slope_t
      integer :: candidate = 0                   !! candidate at the end
   contains
      procedure :: evaluate
      procedure :: number_of
   end type end_slope_t

contains

   !> Moves a set to the equilibrium at which it begins, if it holds a contact at an end that the contact has reached by a change of
   !> length. The index of the slope's test becomes `next%test`; otherwise the set is unchanged.
   subroutine go_to_end_onset(here, next)
      type(change_place_t), intent(in) :: here   !! the present set, at a located change
      type(other_set_t), intent(inout) :: next   !! the neighbour, in equilibrium near the change
      type(contact_span_t), allocatable :: now(:)
      type(span_test_t), allocatable :: tests(:)
      type(other_set_t) :: onset
      type(end_slope_t) :: slope
      integer :: k
      logical :: found
      associate (change => here%zero(1))
         if (.not. is_length(change%kind)) return
         now = present_contact_spans(here%problem, here%state)
         k = findloc(next%problem%contact_span%number, now(change%contact_span)%number, 1)
         if (k == 0) return
         slope%candidate = next%problem%contact_span(k)%candidate(merge(1, 2, change%sense < 0.0_wp))
      end associate
      call copy_other_set(next, onset)
      call find_test_zero(onset, slope, here%small_load, here%locate_tolerance, found, tests)
      if (.not. found) return
      onset%test = slope%number_of(tests)
      call copy_other_set(onset, next)
   end subroutine go_to_end_onset

   !> Computes the slope.
   subroutine evaluate(self, set, tests, value, found)
      class(end_slope_t), intent(in) :: self
      type(other_set_t), intent(in) :: set
      type(span_test_t), intent(in) :: tests(:)
      real(wp), intent(out) :: value
      logical, intent(out) :: found
      integer :: number
      number = self%number_of(tests)
      found = number > 0 .and. set%system%ok
      value = 0.0_wp
      if (found) value = tests(number)%value
   end subroutine evaluate

   !> Index of the slope's test; 0: the contact is not at an end.
   pure integer function number_of(self, tests) result(number)
      class(end_slope_t), intent(in) :: self
      type(span_test_t), intent(in) :: tests(:)
      number = findloc(tests%candidate == self%candidate .and. tests%kind == test_slope, .true., 1)
   end function number_of
end module end_onset
