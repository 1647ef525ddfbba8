!> Dense systems that are too small for LAPACK: those of elements (at most a dozen unknowns), for which a call costs more than the
!> elimination itself, and Cholesky factors of up to a few hundred columns.
module small_dense
   use kinds, only: wp, parallel
   implicit none
   private
   public :: solve_small, factor_positive, find_dependent_row

contains

   !> Solves A X = B by Gauss elimination with row pivoting. Both arrays are transposed: an equation is a column, which is
   !> contiguous in memory.
   !>
   !> If the equations have different units, `weight` makes them comparable, so that the choice of pivots does not depend on the
   !> units.
   pure subroutine solve_small(n, a, b, singular, weight)
      integer, intent(in) :: n             !! number of unknowns
      real(wp), contiguous, intent(inout) :: a(:, :) !! (>= n, >= n) transposed matrix; destroyed
      real(wp), contiguous, intent(inout) :: b(:, :) !! (right-hand sides, >= n) in: transposed right-hand sides; out: solutions
      logical, intent(out) :: singular     !! true: a pivot was exactly zero or not finite; B is then undefined
      real(wp), intent(inout), optional :: weight(:) !! (>= n) factor > 0 of each equation in the comparison of pivots; out: in the
      !! order of the exchanged equations
      integer, parameter :: frequent = 8   !! number of right-hand sides of most systems (ge_equations): with a constant the
      !! compiler makes code without loops
      real(wp) :: part, best
      integer :: i, j, k, p
      singular = .false.
      do k = 1, n
         p = k
         best = abs(a(k, k))
         if (present(weight)) best = weight(k) * best
         do i = k + 1, n
            part = abs(a(k, i))
            if (present(weight)) part = weight(i) * part
            if (part > best) then
               p = i
               best = part
            end if
         end do
         if (.not. abs(a(k, p)) > 0.0_wp) then
            singular = .true.
            return
         end if
         if (p /= k) then
            if (present(weight)) weight(p) = weight(k)
            do j = k, n
               part = a(j, k); a(j, k) = a(j, p); a(j, p) = part
            end do
            do j = 1, size(b, 1)
               part = b(j, k); b(j, k) = b(j, p); b(j, p) = part
            end do
         end if
         do i = k + 1, n
            part = a(k, i) / a(k, k)
            if (.not. abs(part) > 0.0_wp) cycle
            call take_off(n - k, part, a(k + 1:n, k), a(k + 1:n, i))
            if (size(b, 1) == frequent) then
               call take_off(frequent, part, b(:, k), b(:, i))
            else
               call take_off(size(b, 1), part, b(:, k), b(:, i))
            end if
         end do
      end do
      do k = n, 1, -1
         b(:, k) = b(:, k) / a(k, k)
         do i = 1, k - 1
            if (size(b, 1) == frequent) then
               call take_off(frequent, a(k, i), b(:, k), b(:, i))
            else
               call take_off(size(b, 1), a(k, i), b(:, k), b(:, i))
            end if
         end do
      end do

   contains

      !> Subtracts a multiple of one equation from another; the two arrays do not overlap.
      pure subroutine take_off(n, factor, equation, from)
         integer, intent(in) :: n
         real(wp), intent(in) :: factor, equation(n)
         real(wp), intent(inout) :: from(n)
         from = from - factor * equation
      end subroutine take_off
   end subroutine solve_small

   !> Cholesky factors L of a symmetric positive definite matrix A = L L^T, in the storage of LAPACK's dpotrf.
   pure subroutine factor_positive(n, a, positive)
      integer, intent(in) :: n             !! order of the matrix
      real(wp), intent(inout) :: a(n, n)   !! in: A; out: its lower triangle is L; the upper triangle is not used
      logical, intent(out) :: positive     !! false: A is not positive definite, and L is undefined
      real(wp) :: row(4)
      integer :: j, k
      do j = 1, n
         do k = 1, j - 4, 4
            row = a(j, k:k + 3)
            call take_off(n + 1 - j, row, a(j, k), a(j, j))
         end do
         do k = j - modulo(j - 1, 4), j - 1
            a(j:, j) = a(j:, j) - a(j, k) * a(j:, k)
         end do
         positive = a(j, j) > 0.0_wp
         if (.not. positive) return
         a(j:, j) = a(j:, j) / sqrt(a(j, j))
      end do
      positive = .true.

   contains

      !> Subtracts multiples of four columns from another one. Together they take half the memory accesses of one after the other.
      pure subroutine take_off(m, factor, columns, from)
         integer, intent(in) :: m
         real(wp), intent(in) :: factor(4), columns(n, *)
         real(wp), intent(inout) :: from(m)
         from = from - factor(1) * columns(:m, 1) - factor(2) * columns(:m, 2) - factor(3) * columns(:m, 3) - &
            & factor(4) * columns(:m, 4)
      end subroutine take_off
   end subroutine factor_positive

   !> Finds a row of a symmetric positive semi-definite matrix that is a linear combination of the others, by elimination with
   !> diagonal pivots.
   pure subroutine find_dependent_row(matrix, row, null_vector)
      real(wp), intent(in) :: matrix(:, :)
      integer, intent(out) :: row                    !! index of the row; 0: the matrix is regular
      real(wp), intent(out), optional :: null_vector(:) !! (rows) 1 at this row, with zero product with the matrix; zero if there is
      !! no such vector, or more than one
      real(wp), parameter :: tolerance = parallel**2 !! squares of direction cosines
      real(wp) :: a(size(matrix, 1), size(matrix, 1)), scale
      logical :: used(size(matrix, 1))
      integer :: order(size(matrix, 1)), n, i, p
      row = 0
      if (present(null_vector)) null_vector = 0.0_wp
      if (size(used) == 0) return
      a = matrix
      scale = 0.0_wp
      do i = 1, size(used)
         scale = scale + a(i, i)
      end do
      scale = 3.0_wp * scale / size(used)
      used = .false.
      do n = 1, size(used)
         p = 0
         do i = 1, size(used)
            if (used(i)) cycle
            if (p == 0) p = i
            if (a(i, i) > a(p, p)) p = i
         end do
         if (.not. a(p, p) > tolerance * scale) then
            row = p
            exit
         end if
         order(n) = p
         used(p) = .true.
         do i = 1, size(used)
            if (.not. used(i)) a(i, :) = a(i, :) - a(i, p) / a(p, p) * a(p, :)
         end do
      end do
      if (row == 0 .or. count(.not. used) > 1 .or. .not. present(null_vector)) return
      null_vector(row) = 1.0_wp
      do i = n - 1, 1, -1
         p = order(i)
         null_vector(p) = -dot_product(a(p, :), null_vector) / a(p, p)
      end do
   end subroutine find_dependent_row
end module small_dense
