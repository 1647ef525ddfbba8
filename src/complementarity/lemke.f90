!> Lemke's complementary pivoting for the linear complementarity problem  w = q + M z,  w >= 0,  z >= 0,  z.w = 0.
!>
!> An artificial variable z0 makes the negative rows feasible (w = q + M z + d z0, d > 0 the covering vector) and is then driven
!> out: the variable that enters the basis is always the complement of the variable that has just left. The inverse of the basis is
!> explicit and updated by rank one. The values and the entering column are computed anew from M and q at each pivot, O(n**2)
!> operations per pivot. If M is positive definite, all pairs with a wrong sign are first exchanged at once, repeatedly: this takes
!> a dozen sweeps instead of hundreds of pivots.
!>
!> Measures for reliability:
!>   scaling     M and q become R M C and R q, R and C diagonal powers of two, so that nothing is rounded. R = C where
!>               |M| is symmetric: compliances and their principal pivotal transforms. Positive R /= C keep a P-matrix
!>               as well, and for any other matrix the path is that of another covering vector.
!>   ties        are broken by the lexicographic order of the rows of the inverse, so degenerate problems do not cycle.
!>               Numbers count as equal relative to the terms they were summed from.
!>   the answer  uses only the set of active pairs from the pivoting. The values are solved from M and q by LU factors (Cholesky's
!>               where M is symmetric and positive definite) with one refinement, then tested. If many pairs have z = w = 0
!>               and M is ill-conditioned, the signs of their values are rounding: then the method starts again from the
!>               set found.
module lemke
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: wp
   use lapack, only: dgetrf, dgetrs, dpotrs
   use small_dense, only: factor_positive
   use minimum_search, only: golden
   use lcp_basis, only: scaled_lcp_t, basis_t, start, invert, exchange, evaluate_basis, least_row, blocking_row
   implicit none
   private
   public :: solve_lcp, outcome_name
   public :: lcp_solved, lcp_ray, lcp_pivot_limit, lcp_breakdown

   integer, parameter :: lcp_solved = 0
   !> The path of this covering vector ends on a ray. If M is positive semidefinite (copositive-plus), no solution exists; with a
   !> P-matrix a ray cannot occur; for other matrices another covering vector may lead to a solution. The outcome is the same if
   !> rounding hides the ray: the computed forces are then so large that they balance without q, and all digits of q are lost.
   integer, parameter :: lcp_ray = 1
   integer, parameter :: lcp_pivot_limit = 2
   !> The basis is singular to rounding, the values repeatedly violate a sign or an equation, or an argument is invalid:
   integer, parameter :: lcp_breakdown = 3

   integer, parameter :: max_starts = 30 !! largest number of starts; a problem of 400 pairs, of which 130 had z = w = 0, needed
   !! about 15

   !> Accepted relative violation of a solution, over n. LU factors with one refinement leave a much smaller one.
   real(wp), parameter :: answer_tolerance = 16.0_wp * epsilon(1.0_wp)

   !> Difference of two entries of M, of magnitude 1, that counts as rounding: Cholesky's method is used if M is symmetric up to it.
   real(wp), parameter :: symmetry_tolerance = 4.0_wp * epsilon(1.0_wp)

   !> Relative size of q, over n, below which M z = -q equals M z = 0 to rounding. The rounding errors of the path reach a sixth of
   !> this value.
   real(wp), parameter :: ray_tolerance = 128.0_wp * epsilon(1.0_wp)

contains

   !> Solves  w = q + M z,  w >= 0,  z >= 0,  z.w = 0.
   !>
   !> z and w are defined on return for every outcome: z = 0 and w = q unless the problem is solved. If it is solved, no value is
   !> negative, and in each pair z(i) or w(i) is exactly zero. M and q are taken as exact: no entry is neglected because it is
   !> small.
   subroutine solve_lcp(m, q, z, w, outcome, pivots, cover, max_pivots)
      real(wp), intent(in) :: m(:, :)            !! (n, n) matrix, in any units
      real(wp), intent(in) :: q(:)               !! (n) right-hand side; n = 0 is allowed
      real(wp), intent(out) :: z(:)              !! (n) solution z
      real(wp), intent(out) :: w(:)              !! (n) solution w
      integer, intent(out) :: outcome            !! lcp_solved, lcp_ray, lcp_pivot_limit or lcp_breakdown
      integer, intent(out) :: pivots             !! number of exchanges of a basic variable, over all starts
      real(wp), intent(in), optional :: cover(:) !! (n) covering vector, in units of w, all > 0; default: default_cover
      integer, intent(in), optional :: max_pivots !! largest number of pivots; default: 1000 + 50 n

      type(scaled_lcp_t) :: problem
      type(basis_t) :: basis
      real(wp) :: d(size(q))
      logical :: active(size(q)), other(size(q)), ok, ray
      integer :: n, limit, attempt

      n = size(q)
      z = 0.0_wp
      w = 0.0_wp
      pivots = 0
      outcome = lcp_breakdown
      if (size(m, 1) /= n .or. size(m, 2) /= n .or. size(z) /= n .or. size(w) /= n) return
      w = q
      if (.not. (all(ieee_is_finite(m)) .and. all(ieee_is_finite(q)))) return
      if (present(cover)) then
         if (size(cover) /= n) return
         if (.not. all(ieee_is_finite(cover))) return
         if (.not. all(cover > 0.0_wp)) return
      end if
      if (all(q >= 0.0_wp)) then
         outcome = lcp_solved
         return
      end if

      call equilibrate(m, q, problem)
      d = default_cover(n, 0)
      if (present(cover)) then
         d = scale(cover, problem%row_exponent)
         d = d / maxval(d)
      end if
      limit = 1000 + 50 * n
      if (present(max_pivots)) limit = max_pivots

      if (.not. (present(cover) .or. present(max_pivots))) then
         call exchange_signs(problem, z, w, ok, pivots)
         outcome = lcp_solved
         if (ok) return
      end if

      active = .false.
      starts: do attempt = 1, max_starts
         if (attempt > 1) then
            ! All values of the wrong sign in the set found are near zero: from now on the signs are used instead of the
            ! lexicographic order of ties. Another covering vector and, in every second start, the omission of pairs with negative z
            ! lead to another set.
            basis%ties = .false.
            d = default_cover(n, attempt)
            if (modulo(attempt, 2) == 0) active = active .and. z > 0.0_wp
         end if
         call start(problem, active, d, basis, ok)
         if (ok) call follow_pivots(problem, basis, d, limit, active, outcome, pivots)
         if (.not. ok) outcome = lcp_breakdown
         select case (outcome)
         case (lcp_solved)
            call solve_active(problem, active, z, w, ok, ray, other)
            if (ray) then
               outcome = lcp_ray
               exit
            end if
            if (ok) return
            outcome = lcp_breakdown
         case (lcp_ray)
            if (attempt == 1) exit
         case (lcp_breakdown)
            active = .false.
         case default
            exit
         end select
      end do starts
      z = 0.0_wp
      w = q
   end subroutine solve_lcp

   !> Exchanges all pairs with a wrong sign at once, repeatedly, until there is none: Newton's method for min(z, w) = 0
   !> (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2003) 865-888). It is used if M is positive definite, so that the solution is
   !> unique.
   subroutine exchange_signs(problem, z, w, ok, exchanges)
      type(scaled_lcp_t), intent(inout) :: problem
      real(wp), intent(out) :: z(:), w(:)      !! solution as returned by solve_active
      logical, intent(out) :: ok               !! false: M is not positive definite, or wrong signs remain
      integer, intent(inout) :: exchanges
      !> Lemke's method takes about 10 n**3 operations for n pivots, one exchange of all wrong signs at most 2/3 n**3.
      integer, parameter :: max_sweeps = 15
      real(wp) :: a(problem%n, problem%n)
      logical :: active(problem%n), next(problem%n), ray, positive
      integer :: sweep
      a = problem%m + transpose(problem%m)
      call factor_positive(problem%n, a, positive)
      problem%symmetric = positive .and. all(abs(problem%m - transpose(problem%m)) <= symmetry_tolerance)
      ok = .false.
      active = .false.
      next = problem%q < 0.0_wp
      do sweep = 1, merge(max_sweeps, 0, positive)
         exchanges = exchanges + count(next .neqv. active)
         active = next
         call solve_active(problem, active, z, w, ok, ray, next)
         ok = ok .and. .not. ray
         if (ok) exit
      end do
   end subroutine exchange_signs

   !> Name of an outcome, for listings and messages.
   pure function outcome_name(outcome) result(name)
      integer, intent(in) :: outcome
      character(:), allocatable :: name
      select case (outcome)
      case (lcp_solved)
         name = 'solved'
      case (lcp_ray)
         name = 'ray'
      case (lcp_pivot_limit)
         name = 'pivot limit'
      case (lcp_breakdown)
         name = 'breakdown'
      case default
         name = 'unknown outcome'
      end select
   end function outcome_name

   !> Covering vector of the scaled problem: multiples of the golden ratio modulo 1, spread evenly over (0.1, 1); neighbouring
   !> entries differ strongly. The compliances of beams are smooth: with (1, ..., 1) neighbours become basic together, and most of
   !> them must leave again (2300 pivots if all 400 pairs end active). With this vector the number of pivots is little above the
   !> number of active pairs.
   pure function default_cover(n, shift) result(d)
      integer, intent(in) :: n
      integer, intent(in) :: shift !! number of the vector: each value gives a different one
      real(wp) :: d(n)
      integer :: i
      d = [(0.1_wp + 0.9_wp * modulo(golden * real(i + 2 * shift, wp), 1.0_wp), i=1, n)]
   end function default_cover

   !> Scales rows and columns so that the largest entry of each is near 1. Diagonal entries that are positive are scaled first; a
   !> positive definite matrix needs no further scaling. Rows and columns of zeros keep their scale.
   subroutine equilibrate(m, q, problem)
      real(wp), intent(in) :: m(:, :)
      real(wp), intent(in) :: q(:) !! (n) right-hand side, not all zero
      type(scaled_lcp_t), intent(out) :: problem
      integer, parameter :: max_sweeps = 20
      real(wp) :: row_size(size(q)), column_size(size(q))
      integer :: row_change(size(q)), column_change(size(q)), j, n, sweep

      n = size(q)
      problem%n = n
      problem%m = m
      row_change = [(balancing_exponent(max(m(j, j), 0.0_wp)), j=1, n)]
      column_change = row_change
      problem%row_exponent = row_change
      problem%column_exponent = column_change
      sweeps: do sweep = 1, max_sweeps
         row_size = 0.0_wp
         do j = 1, n
            problem%m(:, j) = scale(problem%m(:, j), row_change + column_change(j))
            column_size(j) = maxval(abs(problem%m(:, j)))
            row_size = max(row_size, abs(problem%m(:, j)))
         end do
         row_change = balancing_exponent(row_size)
         column_change = balancing_exponent(column_size)
         if (sweep == max_sweeps .or. all(row_change == 0 .and. column_change == 0)) exit
         problem%row_exponent = problem%row_exponent + row_change
         problem%column_exponent = problem%column_exponent + column_change
      end do sweeps

      problem%q = scale(q, problem%row_exponent)
      problem%q_exponent = exponent(maxval(abs(problem%q)))
      problem%q = scale(problem%q, -problem%q_exponent)
   end subroutine equilibrate

   !> The k for which 4**k a is in [1/2, 2), so that row and column are each multiplied by 2**k; 0 for a = 0.
   elemental integer function balancing_exponent(a)
      real(wp), intent(in) :: a
      balancing_exponent = -(exponent(a) - modulo(exponent(a), 2)) / 2
   end function balancing_exponent

   !> Exchanges variables by complementary pivots, from one almost complementary basis to the next, until the artificial variable z0
   !> leaves.
   subroutine follow_pivots(problem, basis, d, limit, active, outcome, pivots)
      type(scaled_lcp_t), intent(in) :: problem
      type(basis_t), intent(inout) :: basis
      real(wp), intent(in) :: d(:)
      integer, intent(in) :: limit
      logical, intent(inout) :: active(:) !! (n) true for the active pairs of the complementary basis found; unchanged unless the
      !! problem is solved
      integer, intent(out) :: outcome
      integer, intent(inout) :: pivots
      integer :: n, z0, entering, leaving, row
      logical :: ok

      n = problem%n
      z0 = 2 * n + 1
      entering = z0
      call evaluate_basis(problem, entering, basis)
      row = least_row(basis, basis%value, d, [(.true., row=1, n)])
      outcome = lcp_pivot_limit
      exchanges: do
         if (pivots >= limit) return
         pivots = pivots + 1
         leaving = basis%variable(row)
         call exchange(basis, row, entering)
         if (leaving == z0) exit
         entering = merge(leaving + n, leaving - n, leaving <= n)
         call evaluate_basis(problem, entering, basis)
         row = blocking_row(basis, z0)
         if (row > 0) cycle
         ! A ray is accepted only if it is confirmed by an inverse computed anew, without the accumulated rounding of the pivots.
         call invert(problem, basis, ok)
         if (ok) call evaluate_basis(problem, entering, basis)
         outcome = lcp_breakdown
         if (.not. ok .or. .not. all(ieee_is_finite(basis%column))) return
         row = blocking_row(basis, z0)
         outcome = lcp_ray
         if (row == 0) return
         outcome = lcp_pivot_limit
      end do exchanges
      outcome = lcp_solved
      active = .true.
      do row = 1, n
         if (basis%variable(row) <= n) active(basis%variable(row)) = .false.
      end do
   end subroutine follow_pivots

   !> Solves w = 0 for the active pairs and z = 0 for all others, from M and q and with one refinement.
   subroutine solve_active(problem, active, z, w, ok, ray, next)
      type(scaled_lcp_t), intent(in) :: problem
      logical, intent(in) :: active(:)
      real(wp), intent(out) :: z(:), w(:) !! (n) solution in the units of the caller; no value is negative
      logical, intent(out) :: ok          !! true: z and w are finite and satisfy all equations to rounding
      logical, intent(out) :: ray !! true: there is a y >= 0 with M y = 0 to rounding and y.q < 0, so that no solution exists
      logical, intent(out) :: next(:)     !! (n) active pairs after the exchange of all pairs with a wrong sign
      real(wp), allocatable :: lu(:, :), x(:), residual(:)
      real(wp) :: s(problem%n), tolerance
      integer, allocatable :: set(:), pivot(:)
      integer :: j, k, info

      set = pack([(j, j=1, problem%n)], active)
      k = size(set)
      lu = problem%m(set, set)
      x = -problem%q(set)
      residual = x
      z = 0.0_wp
      w = max(problem%q, 0.0_wp)
      allocate (pivot(k))
      if (problem%symmetric) then
         call factor_positive(k, lu, ok)
      else
         call dgetrf(k, k, lu, max(1, k), pivot, info)
         ok = info == 0
      end if
      ray = .false.
      next = active
      if (.not. ok) return
      call solve(x)
      do j = 1, k
         residual = residual - problem%m(set, set(j)) * x(j)
      end do
      call solve(residual)

      x = x + residual
      ray = is_ray(problem, set, x)
      next = problem%q + matmul(problem%m(:, set), x) < 0.0_wp
      next(set) = x > 0.0_wp

      ! Negative values are set to zero before the test: even a small value may matter in the balance of a stiff neighbour.
      z(set) = max(x, 0.0_wp)
      w = problem%q
      s = abs(problem%q)
      do j = 1, k
         w = w + problem%m(:, set(j)) * z(set(j))
         s = s + abs(problem%m(:, set(j)) * z(set(j)))
      end do
      tolerance = answer_tolerance * real(max(problem%n, 8), wp)
      ok = all(w >= -tolerance * s) .and. all(abs(w(set)) <= tolerance * s(set))
      w = max(w, 0.0_wp)
      w(set) = 0.0_wp
      z = scale(z, problem%column_exponent + problem%q_exponent)
      w = scale(w, problem%q_exponent - problem%row_exponent)
      ok = ok .and. all(ieee_is_finite(z)) .and. all(ieee_is_finite(w))

   contains

      !> Solves with the factors of the matrix of the active pairs.
      subroutine solve(b)
         real(wp), intent(inout) :: b(k, 1)
         if (problem%symmetric) then
            call dpotrs('L', k, 1, lu, max(1, k), b, max(1, k), info)
         else
            call dgetrs('N', k, 1, lu, max(1, k), pivot, b, max(1, k), info)
         end if
      end subroutine solve
   end subroutine solve_active

   !> True for a ray: M x = -q on the set, with q at rounding, has a solution x whose values all have the same sign. The forces y =
   !> |x| then have no effect on w.
   pure logical function is_ray(problem, set, x)
      type(scaled_lcp_t), intent(in) :: problem
      integer, intent(in) :: set(:)
      real(wp), intent(in) :: x(:) !! (n) solution on the set
      real(wp) :: s(size(set))
      integer :: j
      is_ray = .false.
      if (size(set) == 0) return
      if (.not. (all(x > 0.0_wp) .or. all(x < 0.0_wp))) return
      s = abs(problem%q(set))
      do j = 1, size(set)
         s = s + abs(problem%m(set, set(j)) * x(j))
      end do
      is_ray = all(abs(problem%q(set)) <= ray_tolerance * real(max(problem%n, 8), wp) * s) .and. &
         dot_product(problem%q(set), abs(x)) < 0.0_wp
   end function is_ray
end module lemke
