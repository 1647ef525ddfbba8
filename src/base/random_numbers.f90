!> Random numbers that are the same on every machine: L'Ecuyer's combination of two multiplicative generators
!> (Communications of the ACM 31, 1988), in 64-bit integers that cannot overflow.
module random_numbers
   use kinds, only: wp, i8
   implicit none
   private
   public :: random_t, new_random, next_random

   !> State of a generator.
   type :: random_t
      private
      integer(i8) :: first = 1, second = 1
   end type random_t

   integer(i8), parameter :: modulus_1 = 2147483563_i8, factor_1 = 40014_i8
   integer(i8), parameter :: modulus_2 = 2147483399_i8, factor_2 = 40692_i8
   integer, parameter :: n_discarded = 16 !! count of numbers that are discarded at first, so that neighbouring seeds give unrelated
   !! sequences

contains

   !> A generator for a seed; neighbouring seeds give unrelated numbers.
   pure type(random_t) function new_random(seed) result(generator)
      integer, intent(in) :: seed !! any integer
      real(wp) :: number
      integer :: i
      generator%first = 1 + modulo(int(seed, i8) * 48271_i8, modulus_1 - 1)
      generator%second = 1 + modulo(int(seed, i8) * 69621_i8, modulus_2 - 1)
      do i = 1, n_discarded
         call next_random(generator, number)
      end do
   end function new_random

   !> The next number, uniform between 0 and 1, both excluded.
   pure subroutine next_random(generator, number)
      type(random_t), intent(inout) :: generator
      real(wp), intent(out) :: number
      integer(i8) :: mixed
      generator%first = mod(factor_1 * generator%first, modulus_1)
      generator%second = mod(factor_2 * generator%second, modulus_2)
      mixed = modulo(generator%first - generator%second, modulus_1 - 1)
      if (mixed == 0) mixed = modulus_1 - 1
      number = real(mixed, wp) / real(modulus_1, wp)
   end subroutine next_random
end module random_numbers
