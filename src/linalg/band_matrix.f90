!> Symmetric band matrices: LAPACK's Cholesky while they are positive definite, its pivoting LU where they are not.
module band_matrix
   use kinds, only: wp
   use lapack, only: dpbtrf, dpbtrs, dgbtrf, dgbtrs, dsbmv
   implicit none
   private
   public :: band_t, factor_t, new_band, band_times, factorise, solve_factored, spring_forces

   !> Lower band storage of LAPACK: a(1 + i - j, j) = A(i, j), j <= i <= j + kd.
   type :: band_t
      integer :: n = 0, kd = 0
      real(wp), allocatable :: a(:, :)   !! (kd + 1, n)
   end type band_t

   !> Factors of a symmetric band matrix.
   type :: factor_t
      integer :: n = 0, kd = 0
      logical :: positive = .false.      !! true: Cholesky's method succeeded
      logical :: deficient = .false.     !! true: the matrix was exactly singular and springs were added to its diagonal, see
      !! spring_forces
      integer :: negative_pivots = 0     !! number of negative pivots of L D L^T = number of negative eigenvalues (Sylvester)
      real(wp), allocatable :: cholesky(:, :) !! (kd + 1, n)
      real(wp), allocatable :: lu(:, :)       !! (3 kd + 1, n), allocated at the first indefinite matrix
      integer, allocatable :: pivot(:)
      real(wp), allocatable :: unit(:)        !! (n) scale of each unknown for LU, which factors diag(unit) A diag(unit)
      real(wp), allocatable :: spring(:)      !! (n) stiffness of the springs added to a singular matrix for LU, in the units of A
   end type factor_t

contains

   !> A zero matrix of order n and half bandwidth kd.
   pure function new_band(n, kd) result(band)
      integer, intent(in) :: n, kd
      type(band_t) :: band
      band%n = n
      band%kd = min(kd, max(n - 1, 0))
      allocate (band%a(band%kd + 1, n), source=0.0_wp)
   end function new_band

   !> y = A x.
   subroutine band_times(band, x, y)
      type(band_t), intent(in) :: band
      real(wp), intent(in) :: x(:)     !! (n)
      real(wp), intent(inout) :: y(:)  !! (n)
      call dsbmv('L', band%n, band%kd, 1.0_wp, band%a, band%kd + 1, x, 1, 0.0_wp, y, 1)
   end subroutine band_times

   !> Factors A with the rows and columns of the fixed unknowns replaced by those of the identity.
   subroutine factorise(band, fixed, factor)
      type(band_t), intent(in) :: band
      logical, intent(in) :: fixed(:)      !! (n) true: fixed
      type(factor_t), intent(inout) :: factor !! storage is kept between calls
      integer :: info
      factor%n = band%n
      factor%kd = band%kd
      if (.not. allocated(factor%cholesky)) allocate (factor%cholesky(band%kd + 1, band%n))
      call copy_masked(band, fixed, factor%cholesky)
      call dpbtrf('L', band%n, band%kd, factor%cholesky, band%kd + 1, info)
      factor%positive = info == 0
      factor%deficient = .false.
      factor%negative_pivots = 0
      if (factor%positive) return
      if (.not. allocated(factor%lu)) allocate (factor%lu(3 * band%kd + 1, band%n), factor%pivot(band%n))
      call copy_masked(band, fixed, factor%cholesky)
      call measure_unknowns(factor)
      call to_general(factor)
      factor%negative_pivots = count_negative(factor%n, factor%kd, factor%cholesky)
      call factor_general(factor)
   end subroutine factorise

   !> LU factors of the scaled matrix. A zero pivot means that the unknown can move, together with unknowns before it, without any
   !> force; a spring at the unknown resists this motion. Its stiffness is the root of the rounding unit times the largest entry, so
   !> that a bordered system that is regular keeps half of its digits.
   subroutine factor_general(factor)
      type(factor_t), intent(inout) :: factor  !! in: scaled matrix in `lu`; out: its factors
      real(wp) :: weak
      integer :: info, diagonal
      diagonal = 2 * factor%kd + 1
      if (.not. allocated(factor%spring)) allocate (factor%spring(factor%n))
      factor%spring = 0.0_wp
      weak = max(sqrt(epsilon(weak)) * maxval(abs(factor%cholesky)), tiny(weak))
      do
         call dgbtrf(factor%n, factor%n, factor%kd, factor%kd, factor%lu, 3 * factor%kd + 1, factor%pivot, info)
         if (info <= 0) exit
         factor%deficient = .true.
         ! The same unknown has a zero pivot again only if the spring is below the rounding of larger entries: then it is doubled.
         factor%spring(info) = factor%spring(info) + max(weak, factor%spring(info))
         call to_general(factor)
         factor%lu(diagonal, :) = factor%lu(diagonal, :) + factor%spring
      end do
      factor%spring = factor%spring / factor%unit**2
   end subroutine factor_general

   !> Forces of the springs added to an exactly singular matrix: the x of solve_factored satisfies A x + spring_forces = b.
   pure function spring_forces(factor, x) result(forces)
      type(factor_t), intent(in) :: factor
      real(wp), intent(in) :: x(:)             !! (n)
      real(wp) :: forces(size(x))              !! zero where the matrix is regular
      forces = 0.0_wp
      if (factor%deficient) forces = factor%spring * x
   end function spring_forces

   !> Copies A with identity rows and columns at the fixed unknowns.
   subroutine copy_masked(band, fixed, a)
      type(band_t), intent(in) :: band
      logical, intent(in) :: fixed(:)
      real(wp), intent(inout) :: a(:, :)
      integer :: i, j, last
      a = band%a
      do j = 1, band%n
         if (.not. fixed(j)) cycle
         last = min(band%kd, band%n - j)
         a(1, j) = 1.0_wp
         a(2:last + 1, j) = 0.0_wp
         do i = max(1, j - band%kd), j - 1
            a(1 + j - i, i) = 0.0_wp
         end do
      end do
   end subroutine copy_masked

   !> Scales each unknown by a power of two so that the diagonal is about 1: the choice of pivots of LU then does not depend on the
   !> units of displacements and rotations. (Cholesky's method chooses no pivots.)
   subroutine measure_unknowns(factor)
      type(factor_t), intent(inout) :: factor  !! in: masked matrix; out: the matrix scaled, and the scales
      integer :: i, j
      if (.not. allocated(factor%unit)) allocate (factor%unit(factor%n))
      do i = 1, factor%n
         factor%unit(i) = 1.0_wp
         if (abs(factor%cholesky(1, i)) > 0.0_wp) factor%unit(i) = scale(1.0_wp, -exponent(factor%cholesky(1, i)) / 2)
      end do
      do j = 1, factor%n
         do i = j, min(factor%n, j + factor%kd)
            factor%cholesky(1 + i - j, j) = factor%unit(i) * factor%cholesky(1 + i - j, j) * factor%unit(j)
         end do
      end do
   end subroutine measure_unknowns

   !> Solves A X = B in place.
   subroutine solve_factored(factor, b)
      type(factor_t), intent(in) :: factor
      real(wp), intent(inout) :: b(:, :)  !! (n, right-hand sides)
      integer :: info, j
      if (factor%positive) then
         call dpbtrs('L', factor%n, factor%kd, size(b, 2), factor%cholesky, factor%kd + 1, b, factor%n, info)
      else
         do j = 1, size(b, 2)
            b(:, j) = factor%unit * b(:, j)
         end do
         call dgbtrs('N', factor%n, factor%kd, factor%kd, size(b, 2), factor%lu, 3 * factor%kd + 1, &
            & factor%pivot, b, factor%n, info)
         do j = 1, size(b, 2)
            b(:, j) = factor%unit * b(:, j)
         end do
      end if
   end subroutine solve_factored

   !> Copies the masked symmetric matrix to LAPACK's general band storage.
   subroutine to_general(factor)
      type(factor_t), intent(inout) :: factor
      integer :: j, i, kd
      kd = factor%kd
      factor%lu = 0.0_wp
      do j = 1, factor%n
         do i = j, min(factor%n, j + kd)
            factor%lu(2 * kd + 1 + i - j, j) = factor%cholesky(1 + i - j, j)
            factor%lu(2 * kd + 1 + j - i, i) = factor%cholesky(1 + i - j, j)
         end do
      end do
   end subroutine to_general

   !> Negative pivots of L D L^T without pivoting (a Sturm count).
   pure integer function count_negative(n, kd, band)
      integer, intent(in) :: n, kd
      real(wp), intent(in) :: band(kd + 1, n)  !! lower band storage
      real(wp) :: a(kd + 1, n), d
      integer :: j, i, last
      a = band
      count_negative = 0
      do j = 1, n
         d = a(1, j)
         if (d < 0.0_wp) count_negative = count_negative + 1
         last = min(kd, n - j)
         ! A zero pivot counts as a positive one of rounding size.
         if (abs(d) <= 0.0_wp) d = max(epsilon(d) * maxval(abs(a(:last + 1, j))), tiny(d))
         do i = 1, last
            a(:last + 1 - i, j + i) = a(:last + 1 - i, j + i) - (a(1 + i, j) / d) * a(1 + i:last + 1, j)
         end do
      end do
   end function count_negative
end module band_matrix
