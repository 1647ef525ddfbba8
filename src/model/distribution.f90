!> A value that varies along a chain of rods, given by a table or a formula: the intensity of a load or a dimension of a section.
module distribution
   use kinds, only: wp, name_length
   use formula, only: evaluate
   implicit none
   private
   public :: distribution_t, distributed_t, same_length

   real(wp), parameter :: same_length = 1.0e-9_wp !! parts of a length below this are rounding of the numbers in a deck
   character(*), parameter :: formula_names = 's|x|y' !! names that a formula may contain: arc length along the chain, stress-free
   !! position

   !> The value as a function of the arc length s, measured along the perfect axis from the beginning of the chain.
   type :: distribution_t
      character(name_length) :: name = ''
      real(wp), allocatable :: at(:) !! arc lengths s of the table's lines, not decreasing, from 0 to the length; twice the same s:
      !! a jump
      real(wp), allocatable :: value(:)       !! values at these arc lengths, linear between them; size 0: the formula is used
      character(:), allocatable :: formula
      real(wp), allocatable :: range(:, :) !! (2, curves) nominal coordinates between which a curve belongs to the chain; equal: the
      !! curve does not belong to it
      real(wp), allocatable :: offset(:)      !! (curves) s minus the nominal coordinate of the same point
      real(wp) :: least = 0.0_wp, mean = 0.0_wp !! smallest value along the chain; mean value, used for scales only
   contains
      procedure :: value_at
      procedure :: contains_place
      procedure :: contains_element
      procedure :: continues
   end type distribution_t

   !> A number, or a value that varies along a chain.
   type :: distributed_t
      real(wp) :: value = 0.0_wp              !! the number; for a varying value its mean over the chain, as a scale
      integer :: distribution = 0             !! index into model%distribution; 0: the value does not vary
   contains
      procedure :: local
   end type distributed_t

contains

   !> The number at a place at which the distributions have given values.
   pure real(wp) function local(self, sample)
      class(distributed_t), intent(in) :: self
      real(wp), intent(in) :: sample(:)       !! (distributions) values of the distributions at this place
      local = self%value
      if (self%distribution > 0) local = sample(self%distribution)
   end function local

   !> The value at a place of the chain. A table is continued beyond its ends with constant values.
   subroutine value_at(self, s, x, value, wrong)
      class(distribution_t), intent(in) :: self
      real(wp), intent(in) :: s, x(2)         !! arc length along the chain; stress-free position (x, y)
      real(wp), intent(out) :: value
      character(:), allocatable, intent(out) :: wrong !! reason why the formula has no value at this place; '': it has a value
      integer :: i
      wrong = ''
      if (size(self%at) == 0) then
         call evaluate(self%formula, formula_names, [s, x], value, wrong)
         return
      end if
      do i = 2, size(self%at) - 1
         if (s < self%at(i)) exit
      end do
      value = self%value(i)
      if (self%at(i) > self%at(i - 1)) value = self%value(i - 1) + (self%value(i) - self%value(i - 1)) * &
         & max(0.0_wp, min(1.0_wp, (s - self%at(i - 1)) / (self%at(i) - self%at(i - 1))))
   end subroutine value_at

   !> True if a point of a curve belongs to the chain.
   pure logical function contains_place(self, curve, coordinate)
      class(distribution_t), intent(in) :: self
      integer, intent(in) :: curve            !! index of the curve; 0: no curve
      real(wp), intent(in) :: coordinate      !! nominal coordinate of the point on the curve
      contains_place = curve > 0
      if (contains_place) contains_place = coordinate > self%range(1, curve) .and. coordinate < self%range(2, curve)
   end function contains_place

   !> True if an element that begins on a curve belongs to the chain. Where the rod goes on without a breakpoint the element may
   !> end on the next curve, whose coordinates extend those of this one; and its nodes may have moved beyond the curve's ends. The
   !> part on the curve decides: no element extends over a breakpoint, and the chain begins and ends at breakpoints.
   pure logical function contains_element(self, curve, ends, length)
      class(distribution_t), intent(in) :: self
      integer, intent(in) :: curve            !! index of the curve, > 0
      real(wp), intent(in) :: ends(2)         !! nominal coordinates of the element's ends
      real(wp), intent(in) :: length          !! nominal length of the curve
      real(wp) :: middle
      middle = 0.5_wp * sum(max(0.0_wp, min(length, ends)))
      associate (range => self%range(:, curve))
         contains_element = range(2) > range(1) .and. middle >= range(1) .and. middle <= range(2)
      end associate
   end function contains_element

   !> True if the value passes a common end of two elements without a corner or a jump, by the arc length on either side: neither
   !> begins nor ends there. Also true if neither element belongs to the chain.
   pure logical function continues(self, curve, before, after)
      class(distribution_t), intent(in) :: self
      integer, intent(in) :: curve(2)         !! indices of the curves of both elements, > 0
      real(wp), intent(in) :: before(2)       !! nominal coordinates of the ends of the element that ends there
      real(wp), intent(in) :: after(2)        !! and of the one that begins there
      real(wp) :: s(2), tolerance
      logical :: inside(2)
      inside = [self%contains_place(curve(1), 0.5_wp * sum(before)), self%contains_place(curve(2), 0.5_wp * sum(after))]
      continues = .not. any(inside)
      if (.not. all(inside)) return
      s = [before(2), after(1)] + self%offset(curve)
      tolerance = same_length * maxval(abs(self%range(:, curve)) + abs(spread(self%offset(curve), 1, 2)))
      continues = abs(s(2) - s(1)) <= tolerance .and. .not. any(abs(self%at - s(1)) <= tolerance)
   end function continues
end module distribution
