!> Numeric kinds and the constants that all parts of the program use.
module kinds
   use, intrinsic :: iso_fortran_env, only: real64, int64
   implicit none
   private
   public :: wp, i8, name_length, pi, degree, parallel

   integer, parameter :: wp = real64          !! working precision
   integer, parameter :: i8 = int64           !! clock ticks and large counters
   integer, parameter :: name_length = 80     !! longest name of a set, monitor or obstacle

   real(wp), parameter :: pi = 3.141592653589793238462643383279502884_wp
   real(wp), parameter :: degree = pi / 180.0_wp !! one degree in radians
   real(wp), parameter :: parallel = 1.0e-6_wp !! angle below which two directions count as parallel [rad]; the coordinates of decks
   !! may have only six digits
end module kinds
