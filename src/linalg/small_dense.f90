!> Dense systems of element size (at most a dozen unknowns), where a LAPACK call costs more than the work itself.
module small_dense
   use kinds, only: wp
   implicit none
   private
   public :: solve_small, dependent_row

contains

   !> Solves A X = B by Gauss elimination with row pivoting; A and B are overwritten, X is in B.
   !>
   !> Where rows have different units, `weight` makes them comparable: the choice of pivots must not depend on the units.
   pure subroutine solve_small(n, a, b, singular, weight)
      integer, intent(in) :: n             !! unknowns
      real(wp), intent(inout) :: a(:, :)   !! (>= n, >= n) matrix, destroyed
      real(wp), intent(inout) :: b(:, :)   !! (>= n, right-hand sides), the solution on return
      logical, intent(out) :: singular     !! a pivot was exactly zero or not finite; B is then undefined
      real(wp), intent(in), optional :: weight(:) !! (>= n) of the rows when pivots are compared, positive
      real(wp) :: swap, w(n)
      integer :: i, j, k, p
      singular = .false.
      w = 1.0_wp
      if (present(weight)) w = weight(:n)
      do k = 1, n
         p = k
         do i = k + 1, n
            if (w(i) * abs(a(i, k)) > w(p) * abs(a(p, k))) p = i
         end do
         if (.not. abs(a(p, k)) > 0.0_wp) then
            singular = .true.
            return
         end if
         if (p /= k) then
            w(p) = w(k)
            do j = k, n
               swap = a(k, j); a(k, j) = a(p, j); a(p, j) = swap
            end do
            do j = 1, size(b, 2)
               swap = b(k, j); b(k, j) = b(p, j); b(p, j) = swap
            end do
         end if
         a(k + 1:n, k) = a(k + 1:n, k) / a(k, k)
         do j = k + 1, n
            if (abs(a(k, j)) > 0.0_wp) a(k + 1:n, j) = a(k + 1:n, j) - a(k, j) * a(k + 1:n, k)
         end do
         do j = 1, size(b, 2)
            if (abs(b(k, j)) > 0.0_wp) b(k + 1:n, j) = b(k + 1:n, j) - b(k, j) * a(k + 1:n, k)
         end do
      end do
      do j = 1, size(b, 2)
         do k = n, 1, -1
            b(k, j) = b(k, j) / a(k, k)
            if (abs(b(k, j)) > 0.0_wp) b(:k - 1, j) = b(:k - 1, j) - b(k, j) * a(:k - 1, k)
         end do
      end do
   end subroutine solve_small

   !> A row of a symmetric positive semi-definite matrix that the others determine, by elimination with diagonal pivots; 0: the
   !> matrix is regular.
   pure integer function dependent_row(matrix) result(p)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), parameter :: tolerance = 1.0e-12_wp !! squares of direction cosines: angles of 1e-6 count as parallel
      real(wp) :: a(size(matrix, 1), size(matrix, 1)), scale
      logical :: used(size(matrix, 1))
      integer :: step, i
      p = 0
      if (size(used) == 0) return
      a = matrix
      scale = 0.0_wp
      do i = 1, size(used)
         scale = scale + a(i, i)
      end do
      scale = 3.0_wp * scale / size(used)
      used = .false.
      do step = 1, size(used)
         p = 0
         do i = 1, size(used)
            if (used(i)) cycle
            if (p == 0) p = i
            if (a(i, i) > a(p, p)) p = i
         end do
         if (.not. a(p, p) > tolerance * scale) return
         used(p) = .true.
         do i = 1, size(used)
            if (.not. used(i)) a(i, :) = a(i, :) - a(i, p) / a(p, p) * a(p, :)
         end do
      end do
      p = 0
   end function dependent_row
end module small_dense
