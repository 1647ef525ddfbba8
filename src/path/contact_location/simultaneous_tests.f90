!> Tests of contact spans that become zero at one point of the path, for instance tests of mirror images, or become zero soon after
!> each other.
module simultaneous_tests
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: initial_share
   use test_kinds, only: span_test_t, test_gap, test_force, test_vanishing, test_slack, well_below
   implicit none
   private
   public :: zero_tests, coming_next

contains

   !> Tests that are zero at one point of the path: the known tests, then others. Of several gaps that belong to one contact only
   !> one is kept. The gap of a free span is left out if the largest gap of this span is zero, too: the whole span comes into
   !> contact, and if it does not, its gap need not grow.
   pure function zero_tests(problem, tests, which, falling, known) result(zero)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)    !! all tests at the point
      integer, intent(in) :: which                 !! index of the located test
      logical, intent(in) :: falling(:)            !! (tests) the test decreases along the path
      type(span_test_t), intent(in) :: known(:)    !! tests known to be zero there, the located test first
      type(span_test_t), allocatable :: zero(:), other(:), closed(:)
      logical :: too(size(tests))
      integer :: k, i
      zero = known
      too = falling .and. at_zero(tests, which)
      too(which) = .false.
      other = pack(tests, too)
      closed = pack(tests, tests%kind == test_vanishing .and. at_zero(tests, which))
      do k = 1, size(other)
         if (other(k)%kind == test_gap) then
            if (any([(one_contact(problem, zero(i), other(k)), i=1, size(zero))])) cycle
            if (any([(is_inside(other(k), closed(i)), i=1, size(closed))])) cycle
         end if
         zero = [zero, other(k)]
      end do
   end function zero_tests

   !> Tests that become zero soon after a located change, because another contact begins or ends there.
   pure function coming_next(tests, which, fall, reach) result(next)
      type(span_test_t), intent(in) :: tests(:)    !! tests at the change's place
      integer, intent(in) :: which                 !! index of the test that is zero at the change
      real(wp), intent(in) :: fall(:)              !! (tests) decrease of each test over the increment
      real(wp), intent(in) :: reach                !! search distance as a share of the increment
      integer, allocatable :: next(:)
      integer :: k
      next = pack([(k, k=1, size(tests))], (tests%kind == test_gap .or. tests%kind == test_force) .and. fall > 0.0_wp .and. &
         & .not. at_zero(tests, which) .and. tests%value <= reach * fall)
   end function coming_next

   !> True if a test and a gap test belong to one contact: both are gaps of one free span, or close at the same place, or at the
   !> same segment boundary from its two sides.
   pure logical function one_contact(problem, a, b)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: a           !! any test
      type(span_test_t), intent(in) :: b           !! a gap test
      integer :: i, j
      one_contact = .false.
      if (a%kind /= test_gap .or. a%contact /= b%contact) return
      one_contact = all(a%element == b%element) .or. (a%rod_segment == b%rod_segment .and. abs(a%at - b%at) <= initial_share * &
         & problem%layout%rod_segment(a%rod_segment)%length)
      associate (first => problem%layout%rod_segment(a%rod_segment), second => problem%layout%rod_segment(b%rod_segment))
         do i = 1, 2
            do j = 1, 2
               if (first%node(i) /= second%node(j)) cycle
               one_contact = one_contact .or. abs(a%at - merge(0.0_wp, first%length, i == 1)) <= initial_share * first%length &
                  & .and. abs(b%at - merge(0.0_wp, second%length, j == 1)) <= initial_share * second%length
            end do
         end do
      end associate
   end function one_contact

   !> True if a gap test and a test of the largest gap (test_vanishing) belong to the same free span.
   pure logical function is_inside(gap, vanishing)
      type(span_test_t), intent(in) :: gap, vanishing
      is_inside = gap%contact == vanishing%contact .and. all(gap%element == vanishing%element)
   end function is_inside

   !> (tests) true: the test is zero at the same point of the path as the located one. The value of the located test shows how
   !> accurate the point is; the other tests may differ from zero by a few times this value.
   pure function at_zero(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical :: at_zero(size(tests))
      at_zero = tests%value <= max(test_slack(tests%kind), well_below * abs(tests(which)%value))
   end function at_zero
end module simultaneous_tests
