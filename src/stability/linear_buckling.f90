!> Linear buckling about an equilibrium state: the increments dl of the load factor at which the tangent of the state, plus the
!> effect of the stresses from dl, is singular.
!>
!>   (K + S(dl)) x = 0,   S the stress stiffness of the step's loads at fixed geometry
!>
!> K is the tangent of the state with its supports and active contacts. For a rod S is linear in dl; for an element S is not,
!> because its inner unknowns are eliminated. block_krylov finds the largest eigenvalues 1/dl of -K^-1 S'(0). K may be indefinite,
!> because the state may be beyond its first critical load. These eigenvalues have the discretisation error of the linear form,
!> O(h^4) (see stress_stiffness). Starting from each of them, an iteration finds the dl of the equation above (settle). The critical
!> load is the more accurate, the closer the state is to it.
!>
!> If K is positive definite, the eigenvalues nu of (K + nu K') x = 0 that are nearest to zero can be counted before they are
!> computed (slice). Here K' is S'(0). By Sylvester's law of inertia the number of negative pivots of K + s K' is the number of
!> eigenvalues between 0 and s. Bisection finds an s with the requested number of eigenvalues between 0 and s, even if they are
!> close to each other, and an iteration with the shift s computes these eigenvalues; none can be missed (B. N. Parlett, The
!> Symmetric Eigenvalue Problem, ch. 3).
module linear_buckling
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text
   use problem, only: problem_t, unknown_weights
   use rod_state, only: state_t
   use linear_system, only: system_t
   use stress_stiffness, only: stress_stiffness_t, new_stress_stiffness, stiffness_under, apply_stress
   use bordered_system, only: solve_effective, factor_system
   use tangent_modes, only: deck_mode, apply_tangent, stretching_work
   use band_matrix, only: band_sum, band_times, band_t, factor_t, factorise, solve_factored
   use block_krylov, only: operator_t, spectrum_t, largest_eigenvalues
   use tangent_rounding, only: is_rounding, rounding_cure
   use path_record, only: buckling_t
   use ordering, only: ascending
   use active_coupling, only: active_coupling_t, factor_excess, add_excess_response
   implicit none
   private
   public :: buckle, pencil_t, eigenvalues_below, slice

   integer, parameter :: most_steps = 12 !! largest number of iterations from a mode of the linearised problem to a mode under the
   !! finite stresses
   real(wp), parameter :: worst_residual = 1.0e-2_wp !! largest relative residual of an accepted mode; the relative error of the
   !! load factor is the square of the residual, 1e-4

   !> The linear operator x -> -K^-1 K' x, with K' = S'(0).
   type, extends(operator_t) :: buckling_operator_t
      type(problem_t), pointer :: problem => null()
      type(system_t), pointer :: system => null()
      type(stress_stiffness_t) :: prime
   contains
      procedure :: apply => apply_buckling
   end type buckling_operator_t

   !> The matrices K and K' of the linearised buckling problem (see the header).
   type :: pencil_t
      type(band_t) :: k, prime
      type(active_coupling_t) :: coupling !! coupled ground; the part of its stiffness that the band matrix K has in excess is
      !! subtracted
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

   !> Critical load factors and modes for the loads of the current step, about a converged state.
   subroutine buckle(problem, state, system, n_modes, buckling, error)
      type(problem_t), intent(in), target :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout), target :: system !! in: assembled and factored at `state`; unchanged on return
      integer, intent(in) :: n_modes                  !! number of modes that are requested
      type(buckling_t), intent(out) :: buckling    !! the modes found, at most n_modes
      type(error_t), allocatable, intent(out) :: error
      type(buckling_operator_t) :: operator
      type(spectrum_t) :: spectrum
      real(wp) :: sense
      integer, allocatable :: order(:)
      integer :: i

      operator%n = system%n
      operator%symmetric = .false.
      operator%weight = unknown_weights(problem)
      operator%weight(3::3) = operator%weight(1::3) * problem%size**2
      where (system%fixed) operator%weight = 0.0_wp
      if (is_rounding(problem, state, system)) then
         call fail(error, 'the tangent is nothing but rounding: '//rounding_cure(problem, state))
         return
      end if
      call new_stress_stiffness(problem, state, system, 0.0_wp, operator%prime)
      operator%problem => problem
      operator%system => system
      call largest_eigenvalues(operator, n_modes, residual_tolerance, spectrum, error)
      spectrum%n = min(spectrum%n, n_modes)
      ! Eigenvalues below rounding count as zero: the loads do not change the tangent in these modes.
      if (spectrum%n > 0) spectrum%n = count(abs(spectrum%value(:spectrum%n)) > 1.0e3_wp * epsilon(1.0_wp) * abs(spectrum%value(1)))
      if (spectrum%n == 0) then
         if (allocated(error)) deallocate (error)
         call fail(error, 'the loads of the step do not change the stiffness: they cannot make anything buckle')
         return
      end if
      ! If the tangent is positive definite, a count shows whether the eigenvalues found are those nearest to zero.
      if (system%negative_pivots + system%hinges == 0) call check_by_counting(operator, n_modes, spectrum, error)
      if (allocated(error)) return
      buckling%step = problem%step
      allocate (buckling%load_factor(spectrum%n), buckling%residual(spectrum%n))
      allocate (buckling%mode(3, problem%deck%mesh%n_nodes, spectrum%n))
      do i = 1, spectrum%n
         call settle(operator, state, spectrum%vector(:, i), buckling%load_factor(i), buckling%residual(i), error)
         if (allocated(error)) return
      end do
      order = ascending(abs(buckling%load_factor))
      buckling%load_factor = buckling%load_factor(order)
      buckling%residual = buckling%residual(order)
      do i = 1, spectrum%n
         call deck_mode(problem, state, system, spectrum%vector(:, order(i)), buckling%mode(:, :, i), sense)
      end do
   end subroutine buckle

   !> If the iteration did not converge or left eigenvalues out: replaces the spectrum by the eigenvalues of both signs that are
   !> nearest to zero, computed by `slice`.
   subroutine check_by_counting(operator, wanted, spectrum, error)
      type(buckling_operator_t), intent(in) :: operator
      integer, intent(in) :: wanted
      type(spectrum_t), intent(inout) :: spectrum
      type(error_t), allocatable, intent(inout) :: error  !! in: allocated if the iteration did not converge
      real(wp), parameter :: inside = 0.9999_wp
      type(pencil_t) :: pencil
      type(spectrum_t) :: both
      real(wp), allocatable :: value(:), vector(:, :)
      real(wp) :: bound
      integer, allocatable :: order(:)
      integer :: side
      logical :: missing
      pencil%k = operator%system%k
      pencil%coupling = operator%system%coupling
      pencil%prime = operator%prime%k
      pencil%fixed = operator%system%fixed
      pencil%weight = operator%weight
      bound = 1.0_wp / minval(abs(spectrum%value(:spectrum%n)))
      if (.not. allocated(error) .and. spectrum%n == wanted) then
         ! Just inside the last eigenvalue found, the pivot count must equal the number of eigenvalues that the iteration found.
         missing = eigenvalues_below(pencil, bound * inside) /= found(1)
         if (.not. missing) missing = eigenvalues_below(pencil, -bound * inside) /= found(-1)
         if (.not. missing) return
      else if (.not. allocated(error)) then
         return
      end if
      if (allocated(error)) deallocate (error)
      allocate (both%value(0), both%vector(operator%n, 0))
      ! A critical load from an iteration that has not converged is too large, never too small, so that `bound` includes enough
      ! eigenvalues.
      do side = 1, -1, -2
         call slice(pencil, wanted, side * bound * (2.0_wp - inside), value, vector, error)
         if (allocated(error)) return
         both%vector = reshape([both%vector, vector], [operator%n, size(both%value) + size(value)])
         both%value = [both%value, 1.0_wp / value]
      end do
      order = ascending(-abs(both%value))
      order = order(:min(wanted, size(order)))
      spectrum%n = size(order)
      spectrum%value = both%value(order)
      spectrum%vector = both%vector(:, order)

   contains

      !> Number of critical loads of one sign that the iteration found below `inside` times the bound.
      pure integer function found(sense)
         integer, intent(in) :: sense
         associate (value => spectrum%value(:spectrum%n))
            found = count(sense * value > 0.0_wp .and. abs(value) * bound * inside > 1.0_wp)
         end associate
      end function found
   end subroutine check_by_counting

   !> Iterates from a mode of the linear problem to a mode of the stiffness under the finite stresses: K + S(factor), S(0) = 0,
   !> S'(0) = K'.
   !>
   !> Inverse iteration with the derivative of S gives the mode x, and Newton's method for the zero of x^T (K + S) x gives the
   !> factor. Both converge quadratically. The quadratic forms are summed over the elements, so that the rounding of the factored
   !> matrix has a second-order effect only. `residual` is (K + S) x in the norm of the inverse tangent; its square is about the
   !> relative error of the load factor.
   subroutine settle(self, state, x, factor, residual, error)
      class(buckling_operator_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      real(wp), intent(inout) :: x(:)
      real(wp), intent(out) :: factor, residual
      type(error_t), allocatable, intent(inout) :: error
      type(stress_stiffness_t) :: stress, derivative
      type(system_t) :: stressed
      real(wp), dimension(self%system%n) :: held, kx, sx, dx, left, s
      real(wp) :: form, form_s, form_d, change, last
      integer :: k
      held = merge(0.0_wp, x, self%system%fixed)
      call apply_tangent(self%problem, state, self%system, held, kx, form)
      call apply_stress(self%problem, self%system, self%prime, held, sx, form_s)
      factor = -form / form_s
      residual = huge(residual)
      last = huge(last)
      do k = 1, most_steps
         call stiffness_under(self%problem, state, self%system, factor, stress, derivative)
         call apply_stress(self%problem, self%system, stress, held, sx, form_s)
         call apply_stress(self%problem, self%system, derivative, held, dx, form_d)
         left = merge(0.0_wp, kx + sx, self%system%fixed)
         call solve_effective(self%system, left, s)
         residual = sqrt(abs(dot_product(left, s) / form))
         change = -(form + form_s) / form_d
         if (self%system%rigidity%n > 0) change = change - stretching_work(self%system, sx, held) / form_d
         factor = factor + change
         ! The change of the factor no longer decreases quadratically, because it has reached rounding.
         if (abs(change) <= epsilon(change) * abs(factor) .or. (abs(change) >= 0.5_wp * last .and. residual < worst_residual)) exit
         last = abs(change)
         stressed = self%system
         stressed%k = band_sum(1.0_wp, self%system%k, 1.0_wp, stress%k)
         call factor_system(stressed)
         call solve_effective(stressed, merge(0.0_wp, dx, self%system%fixed), s)
         held = merge(0.0_wp, s / maxval(abs(s)), self%system%fixed)
         call apply_tangent(self%problem, state, self%system, held, kx, form)
      end do
      x = held
      if (residual > worst_residual) call fail(error, 'a buckling mode is not found between those of the linearised elements: '// &
         & 'the mesh is too coarse or too fine for it (residual '//to_text(residual)//')')
   end subroutine settle

   subroutine apply_buckling(self, x, y)
      class(buckling_operator_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)
      real(wp), intent(out) :: y(:, :)
      real(wp) :: held(self%n), rhs(self%n)
      integer :: j
      do j = 1, size(x, 2)
         held = merge(0.0_wp, x(:, j), self%system%fixed)
         call band_times(self%prime%k, held, rhs)
         call solve_effective(self%system, -rhs, y(:, j))
      end do
   end subroutine apply_buckling

   !> Number of eigenvalues between 0 and `shift`.
   integer function eigenvalues_below(pencil, shift)
      type(pencil_t), intent(in) :: pencil
      real(wp), intent(in) :: shift         !! shift s, of either sign
      type(factor_t) :: factor
      type(active_coupling_t) :: coupling
      coupling = pencil%coupling
      call factorise(band_sum(1.0_wp, pencil%k, shift, pencil%prime), pencil%fixed, factor)
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
      call factorise(band_sum(1.0_wp, pencil%k, high, pencil%prime), pencil%fixed, operator%factor)
      call factor_excess(operator%coupling, operator%factor, pencil%fixed)
      ! The iteration also finds eigenvalues beyond the shift. More and more eigenvalues are therefore requested, until all those
      ! below the shift are among them.
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
end module linear_buckling
