!> Symmetric band matrices with a border. A positive definite band matrix is factored by LAPACK's Cholesky method, any other by
!> LAPACK's LU factorisation with pivoting.
!>
!> The border consists of a few unknowns that may be coupled with every other unknown. With the band A of the other unknowns, the
!> columns B of the border and the matrix C between border unknowns, the matrix is [A B; B^T C]. Its factors are those of A and of
!> the Schur complement C - B^T A^-1 B. By Haynsworth's theorem the number of its negative eigenvalues is that of A plus that of the
!> Schur complement.
module band_matrix
   use kinds, only: wp
   use lapack, only: dpbtrf, dpbtrs, dgbtrf, dgbtrs, dsytrf, dsytrs
   implicit none
   private
   public :: band_t, factor_t, new_band, add_entry, band_sum, band_times, row_product, add_row, factorise, solve_factored, &
      & spring_forces, factor_symmetric

   !> Lower band storage of LAPACK: a(1 + i - j, j) = A(i, j), j <= i <= j + kd. The matrix is the sum of the band and of the rows
   !> and columns of the border.
   type :: band_t
      integer :: n = 0, kd = 0
      real(wp), allocatable :: a(:, :)   !! (kd + 1, n)
      integer, allocatable :: border(:)  !! indices of the border unknowns
      real(wp), allocatable :: beside(:, :) !! (n, border) columns of the border; entries between two border unknowns are stored in
      !! both columns
   end type band_t

   !> Factors of a symmetric band matrix.
   type :: factor_t
      integer :: n = 0, kd = 0
      logical :: positive = .false.      !! true: Cholesky's method succeeded
      logical :: deficient = .false. !! true: the matrix was exactly singular, and springs were added to its diagonal, see
      !! spring_forces
      integer :: negative_pivots = 0 !! number of negative pivots of L D L^T, equal to the number of negative eigenvalues
      !! (Sylvester)
      real(wp), allocatable :: cholesky(:, :) !! (kd + 1, n)
      real(wp), allocatable :: lu(:, :)       !! (3 kd + 1, n) allocated when the first indefinite matrix is factored
      integer, allocatable :: pivot(:)
      real(wp), allocatable :: unit(:)        !! (n) scale of each unknown: LU factors diag(unit) A diag(unit)
      real(wp), allocatable :: spring(:) !! (n) stiffness of the springs added to a singular matrix before LU, in the units of A
      integer, allocatable :: border(:)       !! border unknowns that are not fixed
      real(wp), allocatable :: column(:, :)   !! (n, border) B; 0 at fixed unknowns and at border unknowns
      real(wp), allocatable :: response(:, :) !! (n, border) A^-1 B
      real(wp), allocatable :: schur(:, :)    !! (border, border) factors of C - B^T A^-1 B
      integer, allocatable :: order(:)        !! (border) pivot rows of these factors
   end type factor_t

contains

   !> A zero matrix of order n and half bandwidth kd.
   pure function new_band(n, kd, border) result(band)
      integer, intent(in) :: n, kd     !! order n, half bandwidth kd
      integer, intent(in) :: border(:) !! unknowns that may be coupled with every other unknown, each once
      type(band_t) :: band
      band%n = n
      band%kd = min(kd, max(n - 1, 0))
      band%border = border
      allocate (band%a(band%kd + 1, n), band%beside(n, size(border)), source=0.0_wp)
   end function new_band

   !> Adds a number to A(i, j) and to A(j, i).
   pure subroutine add_entry(band, i, j, number)
      type(band_t), intent(inout) :: band
      integer, intent(in) :: i, j      !! row and column, i >= j; within the bandwidth unless one of them is a border unknown
      real(wp), intent(in) :: number
      integer :: of_i, of_j
      if (size(band%border) > 0) then
         of_i = findloc(band%border, i, 1)
         of_j = findloc(band%border, j, 1)
         if (of_i > 0) band%beside(j, of_i) = band%beside(j, of_i) + number
         if (of_j > 0 .and. i /= j) band%beside(i, of_j) = band%beside(i, of_j) + number
         if (of_i > 0 .or. of_j > 0) return
      end if
      band%a(1 + i - j, j) = band%a(1 + i - j, j) + number
   end subroutine add_entry

   !> The matrix p A + q B, for matrices A and B of the same form.
   pure function band_sum(p, a, q, b) result(total)
      real(wp), intent(in) :: p, q
      type(band_t), intent(in) :: a, b
      type(band_t) :: total
      total = a
      total%a = p * a%a + q * b%a
      total%beside = p * a%beside + q * b%beside
   end function band_sum

   !> Computes y = A x. Entries of x that are zero cost nothing: prescribed displacements are zero at almost all unknowns.
   subroutine band_times(band, x, y)
      type(band_t), intent(in) :: band
      real(wp), intent(in) :: x(:)     !! (n)
      real(wp), intent(inout) :: y(:)  !! (n)
      real(wp) :: below
      integer :: i, j, k, last, next(band%n) ! index of the next entry of x that is not zero
      next(band%n) = band%n + 1
      do j = band%n, 2, -1
         next(j - 1) = merge(next(j), j, abs(x(j)) <= 0.0_wp)
      end do
      y = 0.0_wp
      do j = 1, band%n
         last = min(band%n, j + band%kd)
         if (.not. abs(x(j)) <= 0.0_wp) then
            do i = j, last
               y(i) = y(i) + x(j) * band%a(1 + i - j, j)
            end do
         end if
         if (next(j) > last) cycle
         below = 0.0_wp
         do i = next(j), last
            below = below + band%a(1 + i - j, j) * x(i)
         end do
         y(j) = y(j) + below
      end do
      do k = 1, size(band%border)
         y = y + x(band%border(k)) * band%beside(:, k)
         y(band%border(k)) = y(band%border(k)) + dot_product(band%beside(:, k), x) - &
            & dot_product(band%beside(band%border, k), x(band%border))
      end do
   end subroutine band_times

   !> Row i of A times x.
   pure real(wp) function row_product(band, i, x) result(product)
      type(band_t), intent(in) :: band
      integer, intent(in) :: i
      real(wp), intent(in) :: x(band%n)
      integer :: j
      product = 0.0_wp
      do j = max(1, i - band%kd), i
         product = product + band%a(1 + i - j, j) * x(j)
      end do
      do j = i + 1, min(band%n, i + band%kd)
         product = product + band%a(1 + j - i, i) * x(j)
      end do
      do j = 1, size(band%border)
         product = product + band%beside(i, j) * x(band%border(j))
         if (band%border(j) == i) product = product + dot_product(band%beside(:, j), x) - &
            & dot_product(band%beside(band%border, j), x(band%border))
      end do
   end function row_product

   !> Adds a multiple of row i of A to a vector.
   pure subroutine add_row(band, i, weight, row)
      type(band_t), intent(in) :: band
      integer, intent(in) :: i
      real(wp), intent(in) :: weight
      real(wp), intent(inout) :: row(:) !! (n)
      integer :: j
      do j = max(1, i - band%kd), i
         row(j) = row(j) + band%a(1 + i - j, j) * weight
      end do
      do j = i + 1, min(band%n, i + band%kd)
         row(j) = row(j) + band%a(1 + j - i, i) * weight
      end do
      do j = 1, size(band%border)
         if (band%border(j) == i) then
            row = row + weight * band%beside(:, j)
         else if (.not. any(band%border == i)) then
            row(band%border(j)) = row(band%border(j)) + weight * band%beside(i, j)
         end if
      end do
   end subroutine add_row

   !> Factors the matrix A in which the rows and columns of the fixed unknowns are replaced by those of the identity.
   subroutine factorise(band, fixed, factor)
      type(band_t), intent(in) :: band
      logical, intent(in) :: fixed(:)      !! (n) true: fixed
      type(factor_t), intent(inout) :: factor !! out: the factors; its storage is reused in further calls
      logical :: held(band%n)
      integer :: info
      factor%n = band%n
      factor%kd = band%kd
      held = fixed
      held(band%border) = .true.
      if (.not. allocated(factor%cholesky)) allocate (factor%cholesky(band%kd + 1, band%n))
      call copy_masked(band, held, factor%cholesky)
      call dpbtrf('L', band%n, band%kd, factor%cholesky, band%kd + 1, info)
      factor%positive = info == 0
      factor%deficient = .false.
      factor%negative_pivots = 0
      if (.not. factor%positive) then
         if (.not. allocated(factor%lu)) allocate (factor%lu(3 * band%kd + 1, band%n), factor%pivot(band%n))
         call copy_masked(band, held, factor%cholesky)
         call measure_unknowns(factor)
         call to_general(factor)
         factor%negative_pivots = count_negative(factor%n, factor%kd, factor%cholesky)
         call factor_general(factor)
      end if
      call factor_border(band, fixed, held, factor)
   end subroutine factorise

   !> Factors the Schur complement of the border. A zero pivot is replaced by that of a weak spring, as in factor_general.
   subroutine factor_border(band, fixed, held, factor)
      type(band_t), intent(in) :: band
      logical, intent(in) :: fixed(:)      !! (n) true: fixed
      logical, intent(in) :: held(:)       !! (n) true: fixed or border unknown
      type(factor_t), intent(inout) :: factor !! in: contains the factors of the band; out: complete
      real(wp) :: unit(band%n), row(band%n), weak
      integer :: k, negative, zero
      factor%border = pack(band%border, .not. fixed(band%border))
      if (size(factor%border) == 0) return
      if (allocated(factor%column)) deallocate (factor%column, factor%response, factor%schur, factor%order)
      allocate (factor%column(band%n, size(factor%border)), factor%schur(size(factor%border), size(factor%border)))
      allocate (factor%order(size(factor%border)))
      do k = 1, size(factor%border)
         unit = 0.0_wp
         unit(factor%border(k)) = 1.0_wp
         call band_times(band, unit, row)
         factor%schur(:, k) = row(factor%border)
         factor%column(:, k) = merge(0.0_wp, row, held)
      end do
      factor%response = factor%column
      weak = max(sqrt(epsilon(weak)) * max(maxval(abs(band%a)), maxval(abs(factor%schur))), tiny(weak))
      call solve_band(factor, factor%response)
      factor%schur = factor%schur - matmul(transpose(factor%column), factor%response)
      call factor_symmetric(factor%schur, factor%order, weak, negative, zero)
      factor%negative_pivots = factor%negative_pivots + negative
      if (zero == 0) return
      factor%deficient = .true.
      if (.not. allocated(factor%spring)) allocate (factor%spring(band%n), source=0.0_wp)
      if (factor%positive) factor%spring = 0.0_wp
      factor%spring(factor%border(zero)) = weak
   end subroutine factor_border

   !> Factors a small symmetric matrix, L D L^T with pivoting, in place, and counts its negative eigenvalues. A zero pivot is
   !> replaced by a small positive number.
   subroutine factor_symmetric(matrix, pivot, small, negative, zero)
      real(wp), intent(inout) :: matrix(:, :) !! in: lower triangle; out: factors as dsytrs needs them
      integer, intent(out) :: pivot(:)
      real(wp), intent(in) :: small        !! number that replaces a zero pivot, > 0
      integer, intent(out) :: negative     !! number of negative eigenvalues
      integer, intent(out) :: zero         !! row of the last zero pivot; 0: none
      real(wp) :: work(64 * size(matrix, 1))
      integer :: i, n, info
      n = size(matrix, 1)
      call dsytrf('L', n, matrix, n, pivot, work, size(work), info)
      ! A pivot block of order 2 has one positive and one negative eigenvalue.
      negative = count(pivot < 0) / 2
      zero = 0
      do i = 1, n
         if (pivot(i) < 0) cycle
         if (matrix(i, i) < 0.0_wp) negative = negative + 1
         if (abs(matrix(i, i)) > 0.0_wp) cycle
         matrix(i, i) = small
         zero = i
      end do
   end subroutine factor_symmetric

   !> LU factors of the scaled matrix. A zero pivot means that the unknown can move, together with preceding unknowns, without any
   !> force; a spring added at the unknown resists this motion. The stiffness of the spring is the square root of the rounding unit
   !> times the largest entry: a regular bordered system then keeps half of its digits.
   subroutine factor_general(factor)
      type(factor_t), intent(inout) :: factor  !! in: scaled matrix in `lu`; out: its LU factors
      real(wp) :: largest, weak
      integer :: info, diagonal
      diagonal = 2 * factor%kd + 1
      if (.not. allocated(factor%spring)) allocate (factor%spring(factor%n))
      factor%spring = 0.0_wp
      largest = maxval(abs(factor%cholesky))
      weak = max(sqrt(epsilon(weak)) * largest, tiny(weak))
      do
         call dgbtrf(factor%n, factor%n, factor%kd, factor%kd, factor%lu, 3 * factor%kd + 1, factor%pivot, info)
         if (info <= 0) exit
         factor%deficient = .true.
         ! The same unknown has a zero pivot again only if its spring is below the rounding of larger entries: then the spring is
         ! doubled.
         if (factor%spring(info) <= largest) then
            factor%spring(info) = factor%spring(info) + max(weak, factor%spring(info))
         else
            ! The row of this unknown has become the pivot row of an earlier unknown: all unknowns up to this one get a spring.
            factor%spring(:info) = factor%spring(:info) + weak
         end if
         call to_general(factor)
         factor%lu(diagonal, :) = factor%lu(diagonal, :) + factor%spring
      end do
      factor%spring = factor%spring / factor%unit**2
   end subroutine factor_general

   !> Forces of the springs that were added to an exactly singular matrix: the solution x of solve_factored satisfies A x +
   !> spring_forces = b.
   pure function spring_forces(factor, x) result(forces)
      type(factor_t), intent(in) :: factor
      real(wp), intent(in) :: x(:)             !! (n)
      real(wp) :: forces(size(x))              !! (n) zero if the matrix is regular
      forces = 0.0_wp
      if (factor%deficient) forces = factor%spring * x
   end function spring_forces

   !> Copies A, with the rows and columns of the identity at the fixed unknowns.
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

   !> Scales each unknown by a power of two so that the diagonal is about 1. The choice of pivots in LU then does not depend on the
   !> units of displacements and rotations. (Cholesky's method does not choose pivots.)
   subroutine measure_unknowns(factor)
      type(factor_t), intent(inout) :: factor  !! in: masked matrix; out: scaled matrix and the scales
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
      real(wp), allocatable :: own(:, :)
      integer :: info
      if (size(factor%border) > 0) own = b(factor%border, :)
      call solve_band(factor, b)
      if (.not. allocated(own)) return
      own = own - matmul(transpose(factor%column), b)
      call dsytrs('L', size(own, 1), size(own, 2), factor%schur, size(own, 1), factor%order, own, size(own, 1), info)
      b = b - matmul(factor%response, own)
      b(factor%border, :) = own
   end subroutine solve_factored

   !> Solves with the band alone; the rows of the border unknowns are replaced by those of the identity.
   subroutine solve_band(factor, b)
      type(factor_t), intent(in) :: factor
      real(wp), intent(inout) :: b(:, :)  !! (n, right-hand sides)
      integer :: info, j
      if (factor%positive) then
         call dpbtrs('L', factor%n, factor%kd, size(b, 2), factor%cholesky, factor%kd + 1, b, factor%n, info)
      else
         do j = 1, size(b, 2)
            b(:, j) = factor%unit * b(:, j)
         end do
         call dgbtrs('N', factor%n, factor%kd, factor%kd, size(b, 2), factor%lu, 3 * factor%kd + 1, factor%pivot, b, factor%n, info)
         do j = 1, size(b, 2)
            b(:, j) = factor%unit * b(:, j)
         end do
      end if
   end subroutine solve_band

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

   !> Number of negative pivots of L D L^T without pivoting (a Sturm count).
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
         ! A zero pivot counts as a positive pivot of the size of rounding.
         if (abs(d) <= 0.0_wp) d = max(epsilon(d) * maxval(abs(a(:last + 1, j))), tiny(d))
         do i = 1, last
            a(:last + 1 - i, j + i) = a(:last + 1 - i, j + i) - (a(1 + i, j) / d) * a(1 + i:last + 1, j)
         end do
      end do
   end function count_negative
end module band_matrix
