!> A value that varies along a chain of rods, given by a table or a formula: the intensity of a load or a dimension of a section.
module distribution
   use kinds, only: wp, name_length
   use formula, only: evaluate
   implicit none
   private
   public :: distribution_t, distributed_t

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
      procedure :: bends_at
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

   !> True if, at a point of a curve, the value has a corner or jump, or begins or ends.
   pure logical function bends_at(self, curve, coordinate, tolerance)
      class(distribution_t), intent(in) :: self
      integer, intent(in) :: curve            !! index of the curve, > 0
      real(wp), intent(in) :: coordinate      !! nominal coordinate of the point on the curve
      real(wp), intent(in) :: tolerance       !! distance below which two coordinates count as equal
      associate (range => self%range(:, curve))
         bends_at = range(2) > range(1) .and. coordinate >= range(1) - tolerance .and. coordinate <= range(2) + tolerance
         if (bends_at) bends_at = any(abs(self%at - (coordinate + self%offset(curve))) <= tolerance)
      end associate
   end function bends_at
end module distribution
