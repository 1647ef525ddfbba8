!> The eigenvalues of largest magnitude of an operator that is given only by its products with vectors.
!>
!> Block Krylov subspaces with full orthogonalisation, Rayleigh-Ritz projection, and restarts with the Ritz vectors. Blocks find
!> every eigenvalue with its multiplicity (Saad, Numerical Methods for Large Eigenvalue Problems, ch. 6).
module block_krylov
   use kinds, only: wp
   use errors, only: error_t, fail
   use lapack, only: dgeev, dsyev
   use random_numbers, only: random_t, new_random, next_random
   use ordering, only: ascending
   implicit none
   private
   public :: operator_t, spectrum_t, largest_eigenvalues

   !> The operator, and the inner product of the projection.
   type, abstract :: operator_t
      integer :: n = 0
      logical :: symmetric = .true.            !! true: the operator is self-adjoint in the inner product and has real eigenvalues
      real(wp), allocatable :: weight(:)       !! (n) weights of the inner product, >= 0, not all zero
   contains
      procedure(apply_operator), deferred :: apply
   end type operator_t

   abstract interface
      !> Computes y = Op x for each column of x.
      subroutine apply_operator(self, x, y)
         import :: operator_t, wp
         class(operator_t), intent(inout) :: self
         real(wp), intent(in) :: x(:, :)       !! (n, columns) vectors
         real(wp), intent(out) :: y(:, :)
      end subroutine apply_operator
   end interface

   !> The eigenvalues found, with their eigenvectors.
   type :: spectrum_t
      integer :: n = 0 !! number of eigenvalues found: the number requested, or all eigenvalues of the operator
      real(wp), allocatable :: value(:)        !! eigenvalues, in descending order of magnitude
      real(wp), allocatable :: vector(:, :)    !! (n, found), of norm 1 in the inner product
      real(wp), allocatable :: residual(:)     !! norm of (Op v - value v) over |value|
   end type spectrum_t

   integer, parameter :: max_restarts = 4
   real(wp), parameter :: rounding = 1.0e-13_wp
   real(wp), parameter :: dependent = 1.0e-10_wp !! a vector counts as linearly dependent if orthogonalisation leaves less than this
   !! part of its norm

contains

   !> Computes the `wanted` eigenvalues of largest magnitude and their eigenvectors.
   subroutine largest_eigenvalues(operator, wanted, tolerance, spectrum, error)
      class(operator_t), intent(inout) :: operator
      integer, intent(in) :: wanted            !! number of eigenvalues that are requested, at least 1
      real(wp), intent(in) :: tolerance        !! largest relative residual of an eigenvector
      type(spectrum_t), intent(out) :: spectrum
      type(error_t), allocatable, intent(out) :: error !! allocated: no convergence, or complex eigenvalues among those requested
      real(wp), allocatable :: v(:, :), w(:, :), heavy(:, :), t(:, :) ! basis v, Op v, v times the weights, and the projection
      ! heavy^T w
      real(wp), allocatable :: theta(:), imaginary(:), ritz(:, :), residual(:, :), size_of(:), start(:, :)
      integer :: block, largest, k, found, restart, i, projected ! projected: number of columns of the basis that are already in t
      real(wp), allocatable :: last(:)
      real(wp) :: last_size
      logical :: exhausted

      allocate (last(0))
      last_size = huge(1.0_wp)
      block = min(wanted + 1, operator%n)
      largest = min(operator%n, max(6 * block, 40))
      allocate (v(operator%n, largest + block), w(operator%n, largest + block), heavy(operator%n, largest + block))
      allocate (t(largest + block, largest + block))
      k = 0
      projected = 0
      start = random_block(operator%n, block)
      where (spread(operator%weight, 2, block) <= 0.0_wp) start = 0.0_wp
      call add_block(operator, start, v, heavy, k, exhausted)
      if (k == 0) then
         call fail(error, 'the inner product of the eigenvalue problem is zero')
         return
      end if
      call operator%apply(v(:, :k), w(:, :k))
      restarts: do restart = 1, max_restarts
         grow: do
            call take_ritz_values()
            if ((all(size_of <= tolerance) .and. k > wanted) .or. exhausted .or. k == operator%n) exit restarts
            ! More vectors do not help if the residual is the rounding of the operator.
            if (found == size(last)) then
               if (all(abs(theta(:found) - last) <= tolerance * abs(last)) .and. maxval(size_of) > 0.5_wp * last_size) exit restarts
            end if
            last = theta(:found)
            last_size = maxval(size_of)
            if (k + block > largest) exit grow
            call extend(w(:, max(k - block, 0) + 1:k))
         end do grow
         ! The iteration is restarted with the best Ritz vectors and their residuals.
         i = min(k, 2 * block)
         w(:, :i) = combined(w(:, :k), ritz(:, :i))
         v(:, :i) = combined(v(:, :k), ritz(:, :i))
         k = i
         call orthonormalise_pair(operator, v, w, k)
         heavy(:, :k) = spread(operator%weight, 2, k) * v(:, :k)
         projected = 0
         call extend(residual)
         if (restart == max_restarts) call take_ritz_values()
      end do restarts
      spectrum%n = found
      spectrum%value = theta(:found)
      ! Op v may have nonzero entries in unknowns of weight zero, unlike v.
      spectrum%vector = combined(w(:, :k), ritz(:, :found))
      spectrum%residual = size_of
      do i = 1, found
         if (operator%symmetric) call remove_larger(i)
         if (norm(operator, spectrum%vector(:, i)) > 0.0_wp) &
            & spectrum%vector(:, i) = spectrum%vector(:, i) / norm(operator, spectrum%vector(:, i))
      end do
      if (any(abs(imaginary(:found)) > sqrt(tolerance) * abs(theta(:found)))) then
         call fail(error, 'some of the eigenvalues are complex')
      else if (.not. all(size_of <= 1.0e3_wp * tolerance)) then
         call fail(error, 'the eigenvalues did not converge')
      end if

   contains

      !> Orthogonalises an eigenvector against those of larger eigenvalues. Rounding leaves components along these; they are
      !> multiplied by the ratio of the eigenvalues and may become as large as the eigenvector itself.
      subroutine remove_larger(i)
         integer, intent(in) :: i
         integer :: j, pass
         associate (x => spectrum%vector)
            do pass = 1, 2
               do j = 1, i - 1
                  x(:, i) = x(:, i) - sum(x(:, j) * operator%weight * x(:, i)) * x(:, j)
               end do
            end do
         end associate
      end subroutine remove_larger

      !> Computes the Ritz values of the present basis and their residuals.
      subroutine take_ritz_values()
         integer :: i, j
         do j = projected + 1, k
            do i = 1, k
               t(i, j) = dot_product(heavy(:, i), w(:, j))
               if (i <= projected) t(j, i) = dot_product(heavy(:, j), w(:, i))
            end do
         end do
         projected = k
         call find_ritz(operator%symmetric, t(:k, :k), theta, imaginary, ritz)
         found = min(wanted, k)
         residual = combined(w(:, :k), ritz(:, :found)) - combined(v(:, :k), ritz(:, :found) * spread(theta(:found), 1, k))
         ! Smaller eigenvalues have the rounding error of the largest one.
         size_of = [(max(norm(operator, residual(:, j)) - rounding * abs(theta(1)), 0.0_wp) / max(abs(theta(j)), tiny(1.0_wp)), &
            & j=1, found)]
      end subroutine take_ritz_values

      !> Adds vectors to the basis, and their products with the operator.
      subroutine extend(more)
         real(wp), intent(in) :: more(:, :)
         integer :: old
         old = k
         call add_block(operator, more, v, heavy, k, exhausted)
         if (k > old) call operator%apply(v(:, old + 1:k), w(:, old + 1:k))
      end subroutine extend
   end subroutine largest_eigenvalues

   !> Orthonormalises the columns of `more` against the basis and adds those that are independent of it.
   subroutine add_block(operator, more, v, heavy, k, exhausted)
      class(operator_t), intent(in) :: operator
      real(wp), intent(in) :: more(:, :)
      real(wp), intent(inout) :: v(:, :)
      real(wp), intent(inout) :: heavy(:, :)   !! columns of v times the weights
      integer, intent(inout) :: k              !! number of columns of the basis
      logical, intent(out) :: exhausted        !! true: no vector was independent, so that the basis is invariant
      real(wp) :: x(size(more, 1)), before, after
      integer :: i, j, pass, old
      old = k
      do i = 1, size(more, 2)
         if (k == size(v, 2) .or. k == operator%n) exit
         x = more(:, i)
         before = norm(operator, x)
         if (.not. before > 0.0_wp) cycle
         x = x / before
         do pass = 1, 2
            do j = 1, k
               x = x - dot_product(heavy(:, j), x) * v(:, j)
            end do
         end do
         after = norm(operator, x)
         if (after < dependent) cycle
         k = k + 1
         v(:, k) = x / after
         heavy(:, k) = operator%weight * v(:, k)
      end do
      exhausted = k == old
   end subroutine add_block

   !> Orthonormalises the columns of v, and transforms w in the same way.
   subroutine orthonormalise_pair(operator, v, w, k)
      class(operator_t), intent(in) :: operator
      real(wp), intent(inout) :: v(:, :), w(:, :)
      integer, intent(inout) :: k              !! number of columns; dependent columns are dropped
      real(wp) :: along, length
      integer :: i, j, kept, pass
      kept = 0
      do i = 1, k
         v(:, kept + 1) = v(:, i)
         w(:, kept + 1) = w(:, i)
         do pass = 1, 2
            do j = 1, kept
               along = sum(v(:, j) * operator%weight * v(:, kept + 1))
               v(:, kept + 1) = v(:, kept + 1) - along * v(:, j)
               w(:, kept + 1) = w(:, kept + 1) - along * w(:, j)
            end do
         end do
         length = norm(operator, v(:, kept + 1))
         if (length < dependent) cycle
         kept = kept + 1
         v(:, kept) = v(:, kept) / length
         w(:, kept) = w(:, kept) / length
      end do
      k = kept
   end subroutine orthonormalise_pair

   !> Eigenvalues of the projected operator, in descending order of magnitude, with the coefficients of their Ritz vectors.
   subroutine find_ritz(symmetric, projection, theta, imaginary, ritz)
      logical, intent(in) :: symmetric
      real(wp), intent(in) :: projection(:, :)
      real(wp), allocatable, intent(out) :: theta(:), imaginary(:), ritz(:, :)
      real(wp), allocatable :: t(:, :), work(:), left(:, :), found(:), found_imaginary(:), vectors(:, :)
      integer, allocatable :: order(:)
      integer :: k, info
      k = size(projection, 1)
      t = projection
      allocate (work(max(8 * k, 64)), found(k), found_imaginary(k), vectors(k, k), left(1, 1))
      found_imaginary = 0.0_wp
      if (symmetric) then
         vectors = 0.5_wp * (t + transpose(t))
         call dsyev('V', 'L', k, vectors, k, found, work, size(work), info)
      else
         call dgeev('N', 'V', k, t, k, found, found_imaginary, left, 1, vectors, k, work, size(work), info)
      end if
      order = ascending(-hypot(found, found_imaginary))
      theta = found(order)
      imaginary = found_imaginary(order)
      ritz = vectors(:, order)
   end subroutine find_ritz

   !> Sums of vectors times coefficients, one sum for each column of coefficients. (matmul changes its algorithm with the number of
   !> unknowns, so that its cost is not proportional to this number.)
   pure function combined(x, coefficient) result(y)
      real(wp), intent(in) :: x(:, :), coefficient(:, :)
      real(wp) :: y(size(x, 1), size(coefficient, 2))
      integer :: i, j
      y = 0.0_wp
      do j = 1, size(coefficient, 2)
         do i = 1, size(x, 2)
            y(:, j) = y(:, j) + coefficient(i, j) * x(:, i)
         end do
      end do
   end function combined

   pure real(wp) function norm(operator, x)
      class(operator_t), intent(in) :: operator
      real(wp), intent(in) :: x(:)
      norm = sqrt(sum(operator%weight * x**2))
   end function norm

   !> Pseudorandom start vectors, the same on every machine.
   function random_block(n, columns) result(x)
      integer, intent(in) :: n, columns
      real(wp), allocatable :: x(:, :)
      type(random_t) :: generator
      integer :: i, j
      allocate (x(n, columns))
      generator = new_random(1)
      do j = 1, columns
         do i = 1, n
            call next_random(generator, x(i, j))
         end do
      end do
      x = x - 0.5_wp
   end function random_block
end module block_krylov
