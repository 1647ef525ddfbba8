!> Eigenvalues nu of (K + nu K') x = 0 that are nearest to zero, counted before they are computed.
!>
!> K is positive definite. By Sylvester's law of inertia the number of negative pivots of K + s K' is the number of eigenvalues
!> between 0 and s. Bisection finds an s with the requested number of eigenvalues between 0 and s, even if they are close to each
!> other, and an iteration about s computes them; none can be missed (B. N. Parlett, The Symmetric Eigenvalue Problem, ch. 3).
module spectrum_slicing
   use kinds, only: wp
   use errors, only: error_t, fail
   use band_matrix, only: band_t, factor_t, band_sum, band_times, factorise, solve_factored
   use active_coupling, only: active_coupling_t, factor_excess, add_excess_response
   use block_krylov, only: operator_t, spectrum_t, largest_eigenvalues
   implicit none
   private
   public :: pencil_t, eigenvalues_below, slice, residual_tolerance

   !> Matrices K and K' on the free unknowns.
   type :: pencil_t
      type(band_t) :: k, prime
      type(active_coupling_t) :: coupling       !! coupled ground, whose matrix is subtracted from K
      logical, allocatable :: fixed(:)      !! (n) true: the unknown is fixed
      real(wp), allocatable :: weight(:)    !! (n) weights of the inner product in the iteration; zero at fixed unknowns
   end type pencil_t

   !> The linear operator x -> -(K + s K')^-1 K' x, with the eigenvalues 1/(nu - s).
   type, extends(operator_t) :: shifted_t
      type(band_t) :: prime
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling       !! coupled ground, factored together with the band matrix
      logical, allocatable :: fixed(:)
   contains
      procedure :: apply => apply_shifted
   end type shifted_t

   integer, parameter :: max_bisections = 60
   real(wp), parameter :: residual_tolerance = 1.0e-8_wp !! largest residual of an eigenvector, relative

contains

   !> Number of eigenvalues between 0 and `shift`.
   integer function eigenvalues_below(pencil, shift)
      type(pencil_t), intent(in) :: pencil
      real(wp), intent(in) :: shift         !! shift s, of either sign
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling
      coupling = pencil%coupling
      call factorise(shifted_band(pencil, shift), pencil%fixed, factor)
      call factor_excess(coupling, factor, pencil%fixed)
      eigenvalues_below = factor%negative_pivots + coupling%negative_pivots
   end function eigenvalues_below

   !> Eigenvalues of one sign nearest to zero: `wanted` of them, or fewer if the others are beyond the bound.
   subroutine slice(pencil, wanted, bound, value, vector, error)
      type(pencil_t), intent(in) :: pencil
      integer, intent(in) :: wanted         !! number of eigenvalues that are requested
      real(wp), intent(in) :: bound         !! largest eigenvalue of interest; its sign is the sign of the eigenvalues
      real(wp), allocatable, intent(out) :: value(:) !! (found) eigenvalues, the nearest to zero first
      real(wp), allocatable, intent(out) :: vector(:, :) !! (n, found) eigenvectors
      type(error_t), allocatable, intent(out) :: error
      type(shifted_t) :: operator
      type(spectrum_t) :: spectrum
      real(wp) :: low, high, middle
      integer :: below, n_high, try, asked, i
      logical, allocatable :: chosen(:)
      low = 0.0_wp
      high = bound
      n_high = eigenvalues_below(pencil, high)
      do try = 1, max_bisections
         if (n_high <= 2 * wanted .or. abs(high - low) <= 1.0e-12_wp * abs(high)) exit
         middle = 0.5_wp * (low + high)
         below = eigenvalues_below(pencil, middle)
         if (below >= wanted) then
            high = middle
            n_high = below
         else
            low = middle
         end if
      end do
      allocate (value(0), vector(size(pencil%fixed), 0))
      if (n_high == 0) return
      operator%n = size(pencil%fixed)
      operator%symmetric = .false.
      operator%weight = pencil%weight
      operator%prime = pencil%prime
      operator%fixed = pencil%fixed
      operator%coupling = pencil%coupling
      call factorise(shifted_band(pencil, high), pencil%fixed, operator%factor)
      call factor_excess(operator%coupling, operator%factor, pencil%fixed)
      ! The iteration also finds eigenvalues beyond the shift: more are computed until all eigenvalues below the shift are among
      ! them.
      asked = n_high
      do try = 1, 4
         asked = asked + n_high + 1
         call largest_eigenvalues(operator, asked, residual_tolerance, spectrum, error)
         if (allocated(error)) return
         spectrum%value = high + 1.0_wp / spectrum%value
         chosen = spectrum%value * high > 0.0_wp .and. abs(spectrum%value) < abs(high)
         if (count(chosen) >= n_high) exit
      end do
      if (count(chosen) < n_high) then
         call fail(error, 'some of the eigenvalues that were counted did not come out')
         return
      end if
      value = pack(spectrum%value, chosen)
      vector = spectrum%vector(:, pack([(i, i=1, spectrum%n)], chosen))
   end subroutine slice

   subroutine apply_shifted(self, x, y)
      class(shifted_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)
      real(wp), intent(out) :: y(:, :)
      real(wp) :: held(self%n)
      integer :: j
      do j = 1, size(x, 2)
         held = merge(0.0_wp, x(:, j), self%fixed)
         call band_times(self%prime, held, y(:, j))
         y(:, j) = merge(0.0_wp, -y(:, j), self%fixed)
      end do
      call solve_factored(self%factor, y)
      do j = 1, size(x, 2)
         call add_excess_response(self%coupling, y(:, j))
      end do
   end subroutine apply_shifted

   function shifted_band(pencil, shift) result(band)
      type(pencil_t), intent(in) :: pencil
      real(wp), intent(in) :: shift
      type(band_t) :: band
      band = band_sum(1.0_wp, pencil%k, shift, pencil%prime)
   end function shifted_band
end module spectrum_slicing
