!> The almost complementary basis of Lemke's method: its inverse, the exchange of a variable, and the ratio test.
!>
!> The inverse is stored explicitly and updated by rank one at each pivot. The basic values and the entering column are computed
!> from M and q at each pivot, together with the sum of the magnitudes of their terms. Pivots, ties and zeros are compared with this
!> sum, not with an absolute number.
module lcp_basis
   use kinds, only: wp
   use lapack, only: dgetrf, dgetri
   implicit none
   private
   public :: scaled_lcp_t, basis_t
   public :: start, invert, exchange, evaluate_basis, least_row, blocking_row

   ! The rounding error of a sum of n terms is about sqrt(n) eps times the sum of their magnitudes, and rarely n eps times it.
   real(wp), parameter :: pivot_tolerance = 16.0_wp * epsilon(1.0_wp)
   real(wp), parameter :: tie_tolerance = 8.0_wp * epsilon(1.0_wp)

   !> The problem in scaled form; the largest |q| is between 1/2 and 1.
   type :: scaled_lcp_t
      integer :: n = 0
      real(wp), allocatable :: m(:, :)            !! R M C
      real(wp), allocatable :: q(:)               !! R q / 2**q_exponent
      real(wp), allocatable :: artificial(:)      !! column of the artificial variable z0 in w - M z + artificial z0 = q
      integer, allocatable :: row_exponent(:)     !! R = diag(2**row_exponent)
      integer, allocatable :: column_exponent(:)  !! C = diag(2**column_exponent)
      integer :: q_exponent = 0
      logical :: symmetric = .false.              !! true: M is symmetric, apart from rounding, and positive definite
   end type scaled_lcp_t

   !> A basis B of  w - M z + artificial z0 = q. Variables have the numbers 1..n: w, n+1..2n: z, 2n+1: z0.
   type :: basis_t
      integer, allocatable :: variable(:)         !! (n) number of the variable that is basic in each row
      integer, allocatable :: row_of_w(:)         !! (n) row in which w(j) is basic; 0: it is not basic
      real(wp), allocatable :: inverse(:, :)      !! (n, n) inverse of B
      real(wp), allocatable :: row_size(:)        !! (n) 1-norm of the rows of the inverse
      real(wp), allocatable :: value(:)           !! (n) values of the basic variables: inverse times q
      real(wp), allocatable :: value_size(:)      !! (n) |inverse| times |q|, the sum of magnitudes in `value`
      real(wp), allocatable :: column(:)          !! (n) inverse times the column of the variable that enters
      logical :: ties = .true. !! true: values that differ by rounding count as equal; false: only identical values do
   end type basis_t

contains

   !> Starts from the complementary basis of a set of active pairs. The column of z0 is chosen so that, in this basis, it is the
   !> covering vector d.
   subroutine start(problem, active, d, basis, ok)
      type(scaled_lcp_t), intent(inout) :: problem
      logical, intent(in) :: active(:) !! (n) true: z(i) is basic; false: w(i) is basic
      real(wp), intent(in) :: d(:)     !! (n) covering vector, > 0
      type(basis_t), intent(inout) :: basis
      logical, intent(out) :: ok !! false: the basis is singular
      integer :: j, n

      n = problem%n
      if (.not. allocated(basis%inverse)) then
         allocate (basis%inverse(n, n), basis%row_size(n), basis%value(n), basis%value_size(n), basis%column(n))
      end if
      basis%variable = [(merge(n + j, j, active(j)), j=1, n)]
      basis%row_of_w = [(merge(0, j, active(j)), j=1, n)]
      problem%artificial = -d
      do j = 1, n
         if (active(j)) problem%artificial = problem%artificial + d(j) * (problem%m(:, j) + unit_vector(n, j))
      end do
      call invert(problem, basis, ok)
   end subroutine start

   pure function unit_vector(n, j) result(e)
      integer, intent(in) :: n, j
      real(wp) :: e(n)
      e = 0.0_wp
      e(j) = 1.0_wp
   end function unit_vector

   !> Column of a variable in w - M z + artificial z0 = q.
   pure function column_of(problem, variable) result(a)
      type(scaled_lcp_t), intent(in) :: problem
      integer, intent(in) :: variable
      real(wp) :: a(problem%n)
      if (variable <= problem%n) then
         a = unit_vector(problem%n, variable)
      else if (variable <= 2 * problem%n) then
         a = -problem%m(:, variable - problem%n)
      else
         a = problem%artificial
      end if
   end function column_of

   !> Computes the inverse from the columns of the basis.
   subroutine invert(problem, basis, ok)
      type(scaled_lcp_t), intent(in) :: problem
      type(basis_t), intent(inout) :: basis
      logical, intent(out) :: ok !! false: the basis is singular
      integer, parameter :: block = 32
      integer :: i, n, info, pivot(problem%n)
      real(wp) :: work(block * problem%n)

      n = problem%n
      do i = 1, n
         basis%inverse(:, i) = column_of(problem, basis%variable(i))
      end do
      ok = .true.
      if (all(basis%variable == [(i, i=1, n)])) return
      call dgetrf(n, n, basis%inverse, n, pivot, info)
      ok = info == 0
      if (ok) call dgetri(n, basis%inverse, n, pivot, work, size(work), info)
   end subroutine invert

   !> Updates the inverse after the variable in `row` is replaced by `entering`, whose column is in basis%column.
   subroutine exchange(basis, row, entering)
      type(basis_t), intent(inout) :: basis
      integer, intent(in) :: row, entering !! row of the inverse; number of the variable that enters
      real(wp) :: factor
      integer :: i, j, n

      n = size(basis%value)
      do j = 1, n
         if (abs(basis%inverse(row, j)) <= 0.0_wp) cycle
         factor = basis%inverse(row, j) / basis%column(row)
         do i = 1, n
            basis%inverse(i, j) = basis%inverse(i, j) - factor * basis%column(i)
         end do
         basis%inverse(row, j) = factor
      end do
      if (basis%variable(row) <= n) basis%row_of_w(basis%variable(row)) = 0
      basis%variable(row) = entering
      if (entering <= n) then
         basis%row_of_w(entering) = row
         basis%inverse(:, entering) = unit_vector(n, row)
      end if
   end subroutine exchange

   !> Computes the values of the basic variables and the entering column, with the sums of magnitudes that bound their rounding
   !> errors.
   subroutine evaluate_basis(problem, entering, basis)
      type(scaled_lcp_t), intent(in) :: problem
      integer, intent(in) :: entering !! number of the variable
      type(basis_t), intent(inout) :: basis
      real(wp) :: a(problem%n), residual(problem%n), t
      integer :: i, j, n

      n = problem%n
      a = column_of(problem, entering)
      basis%row_size = 0.0_wp
      basis%value = 0.0_wp
      basis%value_size = 0.0_wp
      basis%column = 0.0_wp
      do j = 1, n
         i = basis%row_of_w(j)
         if (i == 0) cycle
         basis%row_size(i) = 1.0_wp
         basis%value(i) = problem%q(j)
         basis%value_size(i) = abs(problem%q(j))
         basis%column(i) = a(j)
      end do
      ! Column j of the inverse is a full vector only if w(j) is not basic; else it is a unit vector.
      do j = 1, n
         if (basis%row_of_w(j) /= 0) cycle
         do i = 1, n
            t = basis%inverse(i, j)
            basis%row_size(i) = basis%row_size(i) + abs(t)
            basis%value(i) = basis%value(i) + t * problem%q(j)
            basis%value_size(i) = basis%value_size(i) + abs(t * problem%q(j))
            basis%column(i) = basis%column(i) + t * a(j)
         end do
      end do
      if (basis%ties) return

      ! The signs of values near zero matter: one step of iterative refinement makes the values satisfy the equations to rounding.
      residual = problem%q
      do i = 1, n
         j = basis%variable(i)
         if (j <= n) then
            residual(j) = residual(j) - basis%value(i)
         else
            residual = residual - column_of(problem, j) * basis%value(i)
         end if
      end do
      do j = 1, n
         basis%value = basis%value + basis%inverse(:, j) * residual(j)
      end do
   end subroutine evaluate_basis

   !> Row of the basic variable that first reaches zero as the entering variable grows; 0: none does.
   integer function blocking_row(basis, z0) result(row)
      type(basis_t), intent(in) :: basis
      integer, intent(in) :: z0 !! number of the artificial variable
      real(wp) :: value(size(basis%value))
      logical :: candidate(size(basis%value))

      row = 0
      candidate = basis%column > pivot_tolerance * basis%row_size
      if (.not. any(candidate)) return
      value = max(basis%value, 0.0_wp)
      call keep_least(value, slack_of(basis, basis%value_size), basis%column, candidate)
      do row = 1, size(candidate)
         if (candidate(row) .and. basis%variable(row) == z0) return
      end do
      row = least_row(basis, value, basis%column, candidate)
   end function blocking_row

   !> Row with the least vector (value, inverse(1), ..., inverse(n))/weight in lexicographic order, among the rows with `mask`.
   integer function least_row(basis, value, weight, mask) result(row)
      type(basis_t), intent(in) :: basis
      real(wp), intent(in) :: value(:)
      real(wp), intent(in) :: weight(:) !! (n) weights, > 0 where `mask` is true
      logical, intent(in) :: mask(:)    !! (n) true for the rows from which one is chosen; at least one
      logical :: candidate(size(mask))
      integer :: j

      candidate = mask
      call keep_least(value, slack_of(basis, basis%value_size), weight, candidate)
      do j = 1, size(mask)
         if (count(candidate) == 1) exit
         call keep_least(basis%inverse(:, j), slack_of(basis, basis%row_size), weight, candidate)
      end do
      row = maxloc(weight, 1, candidate)
   end function least_row

   !> Expected rounding error of sums whose terms have the given magnitudes.
   pure function slack_of(basis, terms) result(slack)
      type(basis_t), intent(in) :: basis
      real(wp), intent(in) :: terms(:)
      real(wp) :: slack(size(terms))
      slack = 0.0_wp
      if (basis%ties) slack = tie_tolerance * terms
   end function slack_of

   !> Of the candidate rows, keeps those whose value/weight is the least or equal to it within rounding.
   pure subroutine keep_least(value, slack, weight, candidate)
      real(wp), intent(in) :: value(:)
      real(wp), intent(in) :: slack(:)  !! rounding errors of the values
      real(wp), intent(in) :: weight(:) !! weights, > 0 for candidate rows
      logical, intent(inout) :: candidate(:)
      real(wp) :: least, least_slack
      integer :: i, first

      first = 0
      least = huge(1.0_wp)
      do i = 1, size(value)
         if (.not. candidate(i)) cycle
         if (value(i) / weight(i) >= least) cycle
         first = i
         least = value(i) / weight(i)
      end do
      if (first == 0) return
      least_slack = slack(first) / weight(first)
      do i = 1, size(value)
         if (.not. candidate(i) .or. i == first) cycle
         candidate(i) = value(i) - least * weight(i) <= slack(i) + least_slack * weight(i)
      end do
   end subroutine keep_least
end module lcp_basis
