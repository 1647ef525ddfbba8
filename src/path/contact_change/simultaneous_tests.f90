!> Tests of contact spans that become zero at one point of the path, for instance those of mirror images, or soon after each other.
module simultaneous_tests
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: initial_share
   use test_kinds, only: span_test_t, test_gap, test_force, test_slack, well_below
   implicit none
   private
   public :: beginning_together, coming_next, zero_too

contains

   !> Indices of gaps that close at the same point of the path, for instance those of mirror images: the gap of the test comes last.
   pure function beginning_together(problem, tests, which, falling) result(begins)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical, intent(in) :: falling(:)            !! (tests)
      integer, allocatable :: begins(:)
      logical :: closed(size(tests))
      integer :: k, i
      begins = [which]
      closed = tests%kind == test_gap .and. falling .and. at_zero(tests, which)
      closed(which) = .false.
      do k = 1, size(tests)
         if (.not. closed(k)) cycle
         if (any([(one_contact(problem, tests(begins(i)), tests(k)), i=1, size(begins))])) cycle
         begins = [k, begins]
      end do
   end function beginning_together

   !> Tests that become zero soon after a located change, because another contact begins or ends there.
   pure function coming_next(tests, which, fall, reach) result(next)
      type(span_test_t), intent(in) :: tests(:)    !! tests at the change's place
      integer, intent(in) :: which                 !! index of the zero test
      real(wp), intent(in) :: fall(:)              !! (tests) decrease of each over an increment
      real(wp), intent(in) :: reach                !! search distance as a share of the increment
      integer, allocatable :: next(:)
      integer :: k
      next = pack([(k, k=1, size(tests))], (tests%kind == test_gap .or. tests%kind == test_force) .and. fall > 0.0_wp .and. &
         & .not. at_zero(tests, which) .and. tests%value <= reach * fall)
   end function coming_next

   !> True if two gap tests belong to one contact: both gaps close at the same place, or at the same segment boundary from its two
   !> sides.
   pure logical function one_contact(problem, a, b)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: a, b
      integer :: i, j
      one_contact = .false.
      if (a%contact /= b%contact) return
      one_contact = a%rod_segment == b%rod_segment .and. abs(a%at - b%at) <= initial_share * &
         & problem%layout%rod_segment(a%rod_segment)%length
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

   !> Other tests that are zero at the same point of the path as the located one.
   pure function zero_too(tests, which, falling) result(others)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical, intent(in) :: falling(:)            !! (tests) the test decreases along the path
      type(span_test_t), allocatable :: others(:)
      logical :: zero(size(tests))
      zero = falling .and. at_zero(tests, which)
      zero(which) = .false.
      others = pack(tests, zero)
   end function zero_too

   !> (tests) true: the test is zero at the same point of the path as the located one. The located test is accurate to its own value
   !> there, the others to a few times this value.
   pure function at_zero(tests, which)
      type(span_test_t), intent(in) :: tests(:)
      integer, intent(in) :: which
      logical :: at_zero(size(tests))
      at_zero = tests%value <= max(test_slack(tests%kind), well_below * abs(tests(which)%value))
   end function at_zero
end module simultaneous_tests
