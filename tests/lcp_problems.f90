!> Linear complementarity problems for the tests, and their solution by trying all sets.
module lcp_problems
   use kinds, only: wp
   use lapack, only: dgetrf, dgetrs
   use random_numbers, only: random_t, next_random
   implicit none
   private
   public :: beam_compliance, random_vector, random_matrix, exact_pair, scale_units, transform, enumerate_lcp

contains

   !> Deflection at support i under a unit force at support j: n supports evenly spaced in a beam of length 1, EI = 1.
   pure function beam_compliance(n, clamped) result(m)
      integer, intent(in) :: n
      logical, intent(in) :: clamped !! both ends clamped, else simply supported
      real(wp) :: m(n, n)
      real(wp) :: x, a, b
      integer :: i, j
      do j = 1, n
         do i = 1, n
            x = real(min(i, j), wp) / real(n + 1, wp)
            a = real(max(i, j), wp) / real(n + 1, wp)
            b = real(n + 1 - max(i, j), wp) / real(n + 1, wp)
            if (clamped) then
               m(i, j) = x**2 * b**2 * (3.0_wp * a - (3.0_wp * a + b) * x) / 6.0_wp
            else
               m(i, j) = b * x * (1.0_wp - b**2 - x**2) / 6.0_wp
            end if
         end do
      end do
   end function beam_compliance

   !> n numbers between 0 and 1.
   function random_vector(generator, n) result(v)
      type(random_t), intent(inout) :: generator
      integer, intent(in) :: n
      real(wp) :: v(n)
      integer :: i
      do i = 1, n
         call next_random(generator, v(i))
      end do
   end function random_vector

   !> rows x columns numbers between -1 and 1.
   function random_matrix(generator, rows, columns) result(a)
      type(random_t), intent(inout) :: generator
      integer, intent(in) :: rows, columns
      real(wp) :: a(rows, columns)
      a = 2.0_wp * reshape(random_vector(generator, rows * columns), [rows, columns]) - 1.0_wp
   end function random_matrix

   !> A solution (z, w) to build q = w - M z from: `share` of the pairs active, as many at z = w = 0 as `idle` says.
   subroutine exact_pair(generator, share, idle, z, w)
      type(random_t), intent(inout) :: generator
      real(wp), intent(in) :: share, idle !! fractions of 1
      real(wp), intent(out) :: z(:), w(:)
      real(wp) :: choice(size(z)), value(size(z))
      choice = random_vector(generator, size(z))
      value = 0.1_wp + random_vector(generator, size(z))
      z = merge(value, 0.0_wp, choice < share)
      w = merge(value, 0.0_wp, choice > share + idle)
   end subroutine exact_pair

   !> The same problem with other units in each pair:  w -> D w, z -> D**(-1) z.
   pure subroutine scale_units(d, m, q)
      real(wp), intent(in) :: d(:)
      real(wp), intent(inout) :: m(:, :), q(:)
      integer :: j
      do j = 1, size(q)
         m(:, j) = d * m(:, j) * d(j)
      end do
      q = d * q
   end subroutine scale_units

   !> Principal pivotal transform: z and w change places in the pairs of the set, as when the program states the
   !> problem about a current contact set. A P-matrix stays one; a symmetric one gets skew blocks.
   subroutine transform(set, m, q)
      logical, intent(in) :: set(:)
      real(wp), intent(inout) :: m(:, :), q(:)
      real(wp), allocatable :: a(:, :), right(:, :)
      integer, allocatable :: s(:), t(:), pivot(:)
      integer :: i, k, n, info

      n = size(q)
      s = pack([(i, i=1, n)], set)
      t = pack([(i, i=1, n)], .not. set)
      k = size(s)
      allocate (right(k, n + 1), pivot(k))
      a = m(s, s)
      right = 0.0_wp
      do i = 1, k
         right(i, i) = 1.0_wp
      end do
      right(:, k + 1:n) = -m(s, t)
      right(:, n + 1) = -q(s)
      if (k > 0) then
         call dgetrf(k, k, a, k, pivot, info)
         call dgetrs('N', k, n + 1, a, k, pivot, right, k, info)
      end if
      m(t, t) = m(t, t) + matmul(m(t, s), right(:, k + 1:n))
      q(t) = q(t) + matmul(m(t, s), right(:, n + 1))
      m(t, s) = matmul(m(t, s), right(:, :k))
      m(s, s) = right(:, :k)
      m(s, t) = right(:, k + 1:n)
      q(s) = right(:, n + 1)
   end subroutine transform

   !> Tries all 2**n sets; for small problems. Singular sets are left out.
   subroutine enumerate_lcp(m, q, z, w, n_solutions)
      real(wp), intent(in) :: m(:, :), q(:)
      real(wp), intent(out) :: z(:), w(:) !! of the last solution found; 0 if none
      integer, intent(out) :: n_solutions !! sets with z >= 0 and w >= 0 up to 1e-9
      real(wp), allocatable :: a(:, :), x(:)
      real(wp) :: trial(size(q)), gap(size(q))
      integer, allocatable :: s(:), pivot(:)
      integer :: i, k, n, code, info

      n = size(q)
      n_solutions = 0
      z = 0.0_wp
      w = 0.0_wp
      sets: do code = 0, 2**n - 1
         s = pack([(i, i=1, n)], [(btest(code, i - 1), i=1, n)])
         k = size(s)
         trial = 0.0_wp
         if (k > 0) then
            a = m(s, s)
            x = -q(s)
            pivot = s
            call dgetrf(k, k, a, k, pivot, info)
            if (info /= 0) cycle
            call dgetrs('N', k, 1, a, k, pivot, x, k, info)
            trial(s) = x
         end if
         gap = q + matmul(m, trial)
         gap(s) = 0.0_wp
         if (any(trial < -1.0e-9_wp) .or. any(gap < -1.0e-9_wp)) cycle
         n_solutions = n_solutions + 1
         z = trial
         w = gap
      end do sets
   end subroutine enumerate_lcp
end module lcp_problems
