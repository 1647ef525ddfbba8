!> A value that varies along a chain of rods: a load's intensity or a dimension of a section, as a table or a formula.
module distribution
   use kinds, only: wp, name_length
   use formula, only: evaluate
   implicit none
   private
   public :: distribution_t, distributed_t

   character(*), parameter :: formula_names = 's|x|y' !! what a formula may name: arc length along the chain, stress-free position

   !> The value as a function of the arc length s, counted along the perfect axis from the beginning of the chain.
   type :: distribution_t
      character(name_length) :: name = ''
      real(wp), allocatable :: at(:)          !! s of the table's lines, not decreasing from 0 to the length; twice the same: a jump
      real(wp), allocatable :: value(:)       !! their values, linear between; no lines: the formula
      character(:), allocatable :: formula
      real(wp), allocatable :: range(:, :)    !! (2, curves) nominal coordinates between which a curve belongs to the chain; equal:
      !! it does not
      real(wp), allocatable :: offset(:)      !! (curves) s less the nominal coordinate
      real(wp) :: least = 0.0_wp, mean = 0.0_wp !! along the chain; the mean for scales only
   contains
      procedure :: value_at
      procedure :: contains_place
      procedure :: bends_at
   end type distribution_t

   !> A number, or one that varies.
   type :: distributed_t
      real(wp) :: value = 0.0_wp              !! the number; of one that varies its mean over the chain, for scales
      integer :: distribution = 0             !! index into model%distribution, 0: it does not vary
   contains
      procedure :: local
   end type distributed_t

contains

   !> The number at a place where the distributions have given values.
   pure real(wp) function local(self, sample)
      class(distributed_t), intent(in) :: self
      real(wp), intent(in) :: sample(:)       !! (distributions) their values there
      local = self%value
      if (self%distribution > 0) local = sample(self%distribution)
   end function local

   !> The value at a place of the chain. A table goes on beyond its ends with constant values.
   subroutine value_at(self, s, x, value, wrong)
      class(distribution_t), intent(in) :: self
      real(wp), intent(in) :: s, x(2)         !! arc length along the chain, stress-free position
      real(wp), intent(out) :: value
      character(:), allocatable, intent(out) :: wrong !! reason why the formula has no value there; '': it has one
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

   !> True if a place of a curve belongs to the chain.
   pure logical function contains_place(self, curve, coordinate)
      class(distribution_t), intent(in) :: self
      integer, intent(in) :: curve            !! 0: none
      real(wp), intent(in) :: coordinate      !! nominal coordinate on the curve
      contains_place = curve > 0
      if (contains_place) contains_place = coordinate > self%range(1, curve) .and. coordinate < self%range(2, curve)
   end function contains_place

   !> True if the value has a corner or jump at a place of a curve, or begins or ends there.
   pure logical function bends_at(self, curve, coordinate, tolerance)
      class(distribution_t), intent(in) :: self
      integer, intent(in) :: curve            !! > 0
      real(wp), intent(in) :: coordinate      !! nominal coordinate on the curve
      real(wp), intent(in) :: tolerance       !! smaller distances are rounding
      associate (range => self%range(:, curve))
         bends_at = range(2) > range(1) .and. coordinate >= range(1) - tolerance .and. coordinate <= range(2) + tolerance
         if (bends_at) bends_at = any(abs(self%at - (coordinate + self%offset(curve))) <= tolerance)
      end associate
   end function bends_at
end module distribution
