!> Elastic ground (half-space, shear layer) in the linearised equations. A force at one contact candidate also moves the ground's
!> surface at the others: the ground couples the candidates.
!>
!> For the active candidates g + T r = 0, with the gaps g, the reactions r and the compliance matrix T (see ground_coupling). The
!> ground is therefore a spring with the full stiffness matrix S = T^-1, r = -S g. The band matrix K contains a stiffer ground
!> instead: independent springs e = 1/d of the candidates (d: coupling_t%local). The excess stiffness W = diag(e) - S is positive
!> definite because T - d is. Solutions are corrected for W (Sherman, Morrison, Woodbury):
!>
!>   (K - N W N^T)^-1 = K^-1 + X (W^-1 - N^T X)^-1 X^T,   X = K^-1 N,   N^T the derivatives of the gaps by the unknowns.
!>
!> The band matrix is regular even if contact alone supports the structure. By Haynsworth's theorem the number of negative
!> eigenvalues of the true tangent is that of the band matrix plus that of the small matrix.
module active_coupling
   use kinds, only: wp
   use ground_coupling, only: coupling_t
   use band_matrix, only: factor_t, solve_factored, factor_symmetric
   use lapack, only: dpotrf, dpotri, dsytrs
   implicit none
   private
   public :: active_coupling_t, set_active, coupled_response, add_forces, &
      & subtract_excess, excess_row, factor_excess, add_excess_response

   !> Candidates on coupled ground that are in contact (active). The symbols are explained in the header of this module.
   type :: active_coupling_t
      integer :: n = 0
      integer, allocatable :: candidate(:) !! (n) index of the candidate in the problem's list of candidates
      integer, allocatable :: entry(:)              !! (n) index of the candidate in the list of coupled candidates (coupling_t)
      integer, allocatable :: row(:)                !! (n) first unknown of the candidate's node
      real(wp), allocatable :: direction(:, :)      !! (2, n) normals in node axes: the entries of N that are not zero
      real(wp), allocatable :: stiffness(:, :)      !! (n, n) S, stiffness of the ground
      real(wp), allocatable :: excess(:, :)         !! (n, n) W, excess stiffness of the ground in the band matrix
      real(wp), allocatable :: excess_inverse(:, :)
      real(wp), allocatable :: column(:, :)         !! (unknowns, n) X; zero at fixed unknowns
      real(wp), allocatable :: small(:, :)          !! (n, n) factors of W^-1 - N^T X
      integer, allocatable :: pivot(:)
      integer :: negative_pivots = 0 !! number of negative eigenvalues of W^-1 - N^T X, to be added to the number of negative
      !! eigenvalues of the band matrix
   end type active_coupling_t

contains

   !> Computes the stiffness of the ground for a contact set, if the set has changed.
   subroutine set_active(coupling, active, set)
      type(coupling_t), intent(in) :: coupling
      logical, intent(in) :: active(:)             !! (candidates) true: in contact
      type(active_coupling_t), intent(inout) :: set
      integer, allocatable :: entry(:)
      integer :: i
      if (coupling%n == 0) return
      entry = pack([(i, i=1, coupling%n)], active(coupling%candidate))
      if (allocated(set%entry)) then
         if (size(entry) == set%n) then
            if (all(entry == set%entry)) return
         end if
      end if
      set%n = size(entry)
      set%entry = entry
      set%candidate = coupling%candidate(entry)
      set%stiffness = inverse(coupling%compliance(entry, entry))
      set%excess = -set%stiffness
      do i = 1, set%n
         set%excess(i, i) = set%excess(i, i) + 1.0_wp / coupling%local(entry(i))
      end do
      set%excess_inverse = inverse(set%excess)
      if (allocated(set%row)) deallocate (set%row, set%direction)
      allocate (set%row(set%n), source=0)
      allocate (set%direction(2, set%n), source=0.0_wp)
   end subroutine set_active

   !> Inverse of a symmetric positive definite matrix.
   function inverse(matrix)
      real(wp), intent(in) :: matrix(:, :)
      real(wp) :: inverse(size(matrix, 1), size(matrix, 1))
      integer :: n, j, info
      n = size(matrix, 1)
      inverse = matrix
      if (n == 0) return
      call dpotrf('L', n, inverse, n, info)
      if (info /= 0) error stop 'the stiffness of a foundation is not positive definite'
      call dpotri('L', n, inverse, n, info)
      do j = 2, n
         inverse(:j - 1, j) = inverse(j, :j - 1)
      end do
   end function inverse

   !> Computes reactions of coupled candidates and their openings (distances from the settled surface) for given gaps. For each
   !> candidate one of the two is prescribed: the opening of active candidates (usually 0), the reaction of inactive ones.
   subroutine coupled_response(coupling, set, given, gap, reaction)
      type(coupling_t), intent(in) :: coupling
      type(active_coupling_t), intent(in) :: set
      real(wp), intent(in) :: given(:) !! (candidates) prescribed opening of active candidates, prescribed reaction of inactive ones
      real(wp), intent(inout) :: gap(:)            !! (candidates) in: gap to the undeformed surface; out: opening
      real(wp), intent(inout) :: reaction(:)       !! (candidates) out: reactions of coupled candidates
      real(wp) :: r(coupling%n), g(coupling%n)
      if (coupling%n == 0) return
      r = given(coupling%candidate)
      r(set%entry) = 0.0_wp
      g = gap(coupling%candidate)
      if (any(abs(r) > 0.0_wp)) g = g + matmul(coupling%compliance, r)
      r(set%entry) = -matmul(set%stiffness, g(set%entry) - given(set%candidate))
      reaction(coupling%candidate) = r
      gap(coupling%candidate) = g + matmul(coupling%compliance(:, set%entry), r(set%entry))
      gap(set%candidate) = given(set%candidate)
   end subroutine coupled_response

   !> Changes N^T x of the gaps for changes x of the unknowns.
   pure function gap_changes(set, x) result(change)
      type(active_coupling_t), intent(in) :: set
      real(wp), intent(in) :: x(:)                 !! (unknowns) node axes
      real(wp) :: change(set%n)
      integer :: i
      do i = 1, set%n
         change(i) = dot_product(set%direction(:, i), x(set%row(i):set%row(i) + 1))
      end do
   end function gap_changes

   !> Adds the contact forces of active candidates on coupled ground (whose surface also moves where it is not pushed) to the forces
   !> y on the unknowns: y = y + N force, with the contact normals N.
   pure subroutine add_forces(set, force, y)
      type(active_coupling_t), intent(in) :: set
      real(wp), intent(in) :: force(:)             !! (n) contact force of each coupled candidate
      real(wp), intent(inout) :: y(:)              !! (unknowns) forces, node axes
      integer :: i
      do i = 1, set%n
         associate (d => set%row(i))
            y(d:d + 1) = y(d:d + 1) + force(i) * set%direction(:, i)
         end associate
      end do
   end subroutine add_forces

   !> Subtracts the excess stiffness from a product with the band matrix: y = y - N W N^T x. Returns x^T N W N^T x in `form`.
   pure subroutine subtract_excess(set, x, y, form)
      type(active_coupling_t), intent(in) :: set
      real(wp), intent(in) :: x(:)                 !! (unknowns) node axes
      real(wp), intent(inout) :: y(:)
      real(wp), intent(out) :: form
      real(wp) :: change(set%n), force(set%n)
      form = 0.0_wp
      if (set%n == 0) return
      change = gap_changes(set, x)
      force = matmul(set%excess, change)
      form = dot_product(change, force)
      call add_forces(set, -force, y)
   end subroutine subtract_excess

   !> Entry `row` of the vector N W N^T x.
   pure real(wp) function excess_row(set, row, x)
      type(active_coupling_t), intent(in) :: set
      integer, intent(in) :: row
      real(wp), intent(in) :: x(:)
      integer :: i
      excess_row = 0.0_wp
      do i = 1, set%n
         if (row < set%row(i) .or. row > set%row(i) + 1) cycle
         excess_row = excess_row + set%direction(1 + row - set%row(i), i) * dot_product(set%excess(:, i), gap_changes(set, x))
      end do
   end function excess_row

   !> Computes X and factors the small matrix W^-1 - N^T X; the band matrix is already factored. A zero pivot is replaced by a small
   !> positive number, so that the factors exist.
   subroutine factor_excess(set, factor, fixed)
      type(active_coupling_t), intent(inout) :: set
      type(factor_t), intent(in) :: factor
      logical, intent(in) :: fixed(:)              !! (unknowns) true: eliminated
      real(wp) :: largest
      integer :: i, zero
      set%negative_pivots = 0
      if (set%n == 0) return
      if (allocated(set%column)) then
         if (size(set%column, 2) /= set%n) deallocate (set%column)
      end if
      if (.not. allocated(set%column)) allocate (set%column(size(fixed), set%n))
      set%column = 0.0_wp
      do i = 1, set%n
         associate (d => set%row(i))
            set%column(d:d + 1, i) = merge(0.0_wp, set%direction(:, i), fixed(d:d + 1))
         end associate
      end do
      call solve_factored(factor, set%column)
      set%small = set%excess_inverse
      do i = 1, set%n
         set%small(:, i) = set%small(:, i) - gap_changes(set, set%column(:, i))
      end do
      if (allocated(set%pivot)) deallocate (set%pivot)
      allocate (set%pivot(set%n))
      largest = maxval([(abs(set%small(i, i)), i=1, set%n)])
      call factor_symmetric(set%small, set%pivot, max(sqrt(epsilon(largest)) * largest, tiny(largest)), set%negative_pivots, zero)
   end subroutine factor_excess

   !> Turns a solution x = K^-1 b with the band matrix, whose ground is too stiff by W, into the solution with the true tangent.
   !> Fixed unknowns keep their values.
   subroutine add_excess_response(set, x)
      type(active_coupling_t), intent(in) :: set
      real(wp), intent(inout) :: x(:)              !! (unknowns) solution, node axes
      real(wp) :: q(set%n, 1)
      integer :: info
      if (set%n == 0) return
      q(:, 1) = gap_changes(set, x)
      call dsytrs('L', set%n, 1, set%small, set%n, set%pivot, q, set%n, info)
      x = x + matmul(set%column, q(:, 1))
   end subroutine add_excess_response
end module active_coupling
