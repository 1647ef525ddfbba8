!> Linear systems that may be singular or nearly singular: the solution of least norm among those of least residual.
module least_norm
   use kinds, only: wp
   use lapack, only: dgelsd
   implicit none
   private
   public :: solve_least

contains

   !> Solves A x = b by singular values (dgelsd of LAPACK). Directions in which the equations change by less than a given part of
   !> the largest change are ignored.
   subroutine solve_least(a, b, share, x, ok)
      real(wp), intent(in) :: a(:, :)      !! (equations, unknowns) matrix, square
      real(wp), intent(in) :: b(:)         !! (equations) right-hand side
      real(wp), intent(in) :: share        !! singular values below this share of the largest one count as zero
      real(wp), intent(out) :: x(:)        !! (unknowns) solution
      logical, intent(out) :: ok           !! false: the singular values were not found, or a number is not finite
      real(wp) :: matrix(size(b), size(b)), right(size(b), 1), values(size(b)), size_of_work(1)
      real(wp), allocatable :: work(:)
      integer, allocatable :: integers(:)
      integer :: n, rank, info, size_of_integers(1)
      n = size(b)
      matrix = a
      right(:, 1) = b
      ok = all(abs(a) < huge(a)) .and. all(abs(b) < huge(b))
      x = 0.0_wp
      if (.not. ok) return
      call dgelsd(n, n, 1, matrix, n, right, n, values, share, rank, size_of_work, -1, size_of_integers, info)
      allocate (work(nint(size_of_work(1))), integers(size_of_integers(1)))
      call dgelsd(n, n, 1, matrix, n, right, n, values, share, rank, work, size(work), integers, info)
      ok = info == 0
      if (ok) x = right(:, 1)
   end subroutine solve_least
end module least_norm
