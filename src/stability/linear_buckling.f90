!> Linear buckling about an equilibrium state: the increments of the load factor at which the linearised tangent is singular.
!>
!>   (K + dl K') x = 0,   K' the stress stiffness of the step's loads
!>
!> K is the bordered tangent of the state: supports and active contacts hold, contact points that slide keep their
!> tangency. The eigenvalues 1/dl of -K^-1 K' of largest size are found by block_krylov, whatever the sign of K: the state
!> may be past its first critical load. The closer the state to a critical one, the better the estimate.
module linear_buckling
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t
   use stress_stiffness, only: stress_stiffness_t, new_stress_stiffness, apply_stress
   use contact_set, only: reaction_rate
   use bordered_system, only: solve_effective
   use tangent_modes, only: deck_mode, apply_tangent
   use band_matrix, only: band_t, band_times
   use active_coupling, only: subtract_excess
   use block_krylov, only: operator_t, spectrum_t, largest_eigenvalues
   use spectrum_slicing, only: pencil_t, eigenvalues_below, slice
   use path_record, only: buckling_t
   use timing, only: timers_t
   implicit none
   private
   public :: buckle

   real(wp), parameter :: tolerance = 1.0e-8_wp !! of the eigenvectors
   real(wp), parameter :: worst_residual = 1.0e-2_wp !! load factors to 1e-4

   !> Rows and columns of the sliding coordinates y once the fixed unknowns, which move with them, are expressed by them.
   type :: border_t
      real(wp), allocatable :: column(:, :)   !! (n, n_slides) derivative of the residual
      real(wp), allocatable :: row(:, :)      !! (3, n_slides) tangency by the node's displacements
      real(wp), allocatable :: corner(:)      !! (n_slides) tangency by its own coordinate
   end type border_t

   !> Derivative of the bordered matrix.
   type :: derivative_t
      type(stress_stiffness_t) :: stress
      type(border_t) :: border
   end type derivative_t

   !> (x, y) -> -K^-1 K' (x, y), y the sliding coordinates.
   type, extends(operator_t) :: buckling_operator_t
      type(problem_t), pointer :: problem => null()
      type(system_t), pointer :: system => null()
      type(border_t) :: border
      type(derivative_t) :: prime
      type(timers_t), pointer :: timers => null()
   contains
      procedure :: apply => apply_buckling
   end type buckling_operator_t

contains

   !> Load factors and modes of the current step's loads about a converged state.
   subroutine buckle(problem, state, system, n_modes, buckling, error, timers)
      type(problem_t), intent(in), target :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout), target :: system !! assembled and factored at `state`, there on return, too
      integer, intent(in) :: n_modes
      type(buckling_t), intent(out) :: buckling    !! as many modes as there are, n_modes at most
      type(error_t), allocatable, intent(out) :: error
      type(timers_t), intent(inout), target :: timers
      type(buckling_operator_t) :: operator
      type(spectrum_t) :: spectrum
      real(wp) :: sense
      integer :: n, i, node, d

      n = system%n
      operator%n = n + system%n_slides
      operator%symmetric = .false.
      allocate (operator%weight(operator%n), source=1.0_wp / (problem%size**2 * size(problem%weight)))
      do node = 1, size(problem%weight)
         d = dof(problem, node, 1)
         operator%weight(d:d + 1) = problem%weight(node)
         operator%weight(d + 2) = problem%weight(node) * problem%size**2
      end do
      where (system%fixed) operator%weight(:n) = 0.0_wp
      operator%border = border_of(problem, system)
      call differentiate(problem, state, system, operator%border, operator%prime)
      operator%problem => problem
      operator%system => system
      operator%timers => timers
      call largest_eigenvalues(operator, n_modes + system%n_slides, tolerance, spectrum, error)
      call drop_lost_contacts(problem, state, system, spectrum)
      spectrum%n = min(spectrum%n, n_modes)
      ! The loads do not change the tangent in the other modes.
      if (spectrum%n > 0) spectrum%n = count(abs(spectrum%value(:spectrum%n)) > 1.0e3_wp * epsilon(1.0_wp) * &
         & abs(spectrum%value(1)))
      if (spectrum%n == 0) then
         if (allocated(error)) deallocate (error)
         call fail(error, 'the loads of the step do not change the stiffness: they cannot make anything buckle')
         return
      end if
      ! Where eigenvalues can be counted, it is made sure that these are the first ones.
      if (system%n_slides == 0 .and. system%negative_pivots == 0) call check_by_counting(operator, n_modes, spectrum, error)
      if (allocated(error)) return
      buckling%step = problem%step
      allocate (buckling%load_factor(spectrum%n), buckling%residual(spectrum%n))
      allocate (buckling%mode(3, problem%deck%mesh%n_nodes, spectrum%n))
      do i = 1, spectrum%n
         call refine(operator, state, spectrum%vector(:, i), buckling%load_factor(i), buckling%residual(i))
         call deck_mode(problem, state, system, spectrum%vector(:n, i), spectrum%vector(n + 1:, i), buckling%mode(:, :, i), sense)
      end do
      ! A factored tangent of n elements a wave knows its softest modes to n^4 times rounding only.
      if (any(buckling%residual > worst_residual)) call fail(error, &
         & 'the buckling modes are lost in the rounding of the tangent (residual '// &
         & to_text(maxval(buckling%residual))//'): the mesh is too fine for them')
   end subroutine buckle

   !> Takes away what is no mode: where the reaction of a sliding contact would vanish its place is arbitrary.
   subroutine drop_lost_contacts(problem, state, system, spectrum)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(spectrum_t), intent(inout) :: spectrum
      real(wp), parameter :: near = 0.05_wp    ! of the reaction at the state
      real(wp) :: left
      integer :: i, k, kept
      logical :: keep
      if (system%n_slides == 0) return
      kept = 0
      do i = 1, spectrum%n
         keep = .true.
         do k = 1, system%n_slides
            associate (c => system%slide(k))
               left = state%reaction(c) + reaction_rate(problem, system, c) / spectrum%value(i)
               keep = keep .and. abs(left) > near * abs(state%reaction(c))
            end associate
         end do
         if (.not. keep) cycle
         kept = kept + 1
         spectrum%value(kept) = spectrum%value(i)
         spectrum%vector(:, kept) = spectrum%vector(:, i)
      end do
      spectrum%n = kept
   end subroutine drop_lost_contacts

   !> Replaces the spectrum by the first eigenvalues of both signs when it did not converge, or left some out.
   subroutine check_by_counting(operator, wanted, spectrum, error)
      type(buckling_operator_t), intent(in) :: operator
      integer, intent(in) :: wanted
      type(spectrum_t), intent(inout) :: spectrum
      type(error_t), allocatable, intent(inout) :: error  !! allocated on entry when it did not converge
      real(wp), parameter :: inside = 0.9999_wp
      type(pencil_t) :: pencil
      type(spectrum_t) :: both
      real(wp), allocatable :: value(:), vector(:, :)
      real(wp) :: bound
      logical, allocatable :: taken(:)
      integer, allocatable :: order(:)
      integer :: side, i
      logical :: missing
      pencil%k = operator%system%k
      pencil%coupling = operator%system%coupling
      pencil%prime = operator%prime%stress%k
      pencil%fixed = operator%system%fixed
      pencil%weight = operator%weight
      bound = 1.0_wp / minval(abs(spectrum%value(:spectrum%n)))
      if (.not. allocated(error) .and. spectrum%n == wanted) then
         ! Just inside the last one found, pivots and iteration must agree.
         missing = eigenvalues_below(pencil, bound * inside) /= found(1)
         if (.not. missing) missing = eigenvalues_below(pencil, -bound * inside) /= found(-1)
         if (.not. missing) return
      else if (.not. allocated(error)) then
         return
      end if
      if (allocated(error)) deallocate (error)
      allocate (both%value(0), both%vector(operator%n, 0))
      ! An estimate that has not converged is too large, never too small.
      do side = 1, -1, -2
         call slice(pencil, wanted, side * bound * (2.0_wp - inside), value, vector, error)
         if (allocated(error)) return
         both%vector = reshape([both%vector, vector], [operator%n, size(both%value) + size(value)])
         both%value = [both%value, 1.0_wp / value]
      end do
      both%n = min(wanted, size(both%value))
      allocate (order(both%n), taken(size(both%value)))
      taken = .false.
      do i = 1, both%n
         order(i) = maxloc(abs(both%value), 1, mask=.not. taken)
         taken(order(i)) = .true.
      end do
      spectrum%n = both%n
      spectrum%value = both%value(order)
      spectrum%vector = both%vector(:, order)

   contains

      !> Eigenvalues of a sign inside the last one that the iteration found.
      pure integer function found(sense)
         integer, intent(in) :: sense
         associate (value => spectrum%value(:spectrum%n))
            found = count(sense * value > 0.0_wp .and. abs(value) * bound * inside > 1.0_wp)
         end associate
      end function found
   end subroutine check_by_counting

   !> K' at a state. With the geometry held, the border changes with the reactions alone: a sliding coordinate enters the
   !> energy by its reaction times half the slope of the gap squared.
   subroutine differentiate(problem, state, system, border, prime)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(border_t), intent(in) :: border
      type(derivative_t), intent(out) :: prime
      integer :: k, c
      call new_stress_stiffness(problem, state, system, prime%stress)
      prime%border = border
      prime%border%row = 0.0_wp
      prime%border%corner = 0.0_wp
      do k = 1, system%n_slides
         c = system%slide(k)
         if (abs(state%reaction(c)) > 0.0_wp) then
            prime%border%column(:, k) = border%column(:, k) * reaction_rate(problem, system, c) / state%reaction(c)
         else
            prime%border%column(:, k) = 0.0_wp
         end if
      end do
   end subroutine differentiate

   !> The border at a state at which the system is assembled.
   function border_of(problem, system) result(border)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(border_t) :: border
      real(wp) :: moved(system%n), force(system%n), excess
      integer :: k, c, d
      allocate (border%column(system%n, system%n_slides), border%row(3, system%n_slides), border%corner(system%n_slides))
      do k = 1, system%n_slides
         c = system%slide(k)
         moved = 0.0_wp
         moved(system%unknown(c)) = -system%slide_gap(k) / system%slope(c)
         call band_times(system%k, moved, force)
         call subtract_excess(system%coupling, moved, force, excess)
         border%column(:, k) = force - system%slide_column(:, k)
         border%row(:, k) = system%tangency_row(:, k)
         d = dof(problem, problem%candidates%node(c), 1)
         border%corner(k) = system%tangency_corner(k) + dot_product(border%row(:, k), moved(d:d + 2))
      end do
   end function border_of

   !> Load factor of a mode by its Rayleigh quotient -x^T K x / x^T K' x, into which the rounding of the factored matrix
   !> enters squared; and what is left of (K + dl K') x, in the norm of the inverse tangent: its square is about the relative
   !> error of the load factor.
   subroutine refine(self, state, x, factor, residual)
      class(buckling_operator_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: factor, residual
      real(wp) :: held(self%system%n), kx(self%system%n), kpx(self%system%n), left(self%system%n), s(self%system%n)
      real(wp) :: shift(self%system%n_slides), none(self%system%n_slides), form, stress
      integer :: n, k
      n = self%system%n
      held = merge(0.0_wp, x(:n), self%system%fixed)
      call apply_tangent(self%problem, state, self%system, held, x(n + 1:), kx, form)
      call apply_stress(self%problem, self%system, self%prime%stress, held, kpx, stress)
      do k = 1, self%system%n_slides
         associate (column => self%border%column(:, k), prime => self%prime%border%column(:, k), y => x(n + k))
            kx = kx + y * column
            kpx = kpx + y * prime
            stress = stress + y * dot_product(prime, held)
         end associate
      end do
      factor = -form / stress
      left = merge(0.0_wp, kx + factor * kpx, self%system%fixed)
      none = 0.0_wp
      call solve_effective(self%problem, self%system, left, none, s, shift, self%timers)
      residual = sqrt(abs(dot_product(left, s) / form))
   end subroutine refine

   subroutine apply_buckling(self, x, y)
      class(buckling_operator_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)
      real(wp), intent(out) :: y(:, :)
      real(wp) :: rhs(self%n)
      integer :: j, n
      n = self%system%n
      do j = 1, size(x, 2)
         call times_prime(self, x(:, j), rhs)
         call solve_effective(self%problem, self%system, -rhs(:n), -rhs(n + 1:), y(:n, j), y(n + 1:, j), self%timers)
      end do
   end subroutine apply_buckling

   !> K' (x, y).
   subroutine times_prime(self, x, y)
      class(buckling_operator_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: y(:)
      call times(self, self%prime%stress%k, self%prime%border, x, y)
   end subroutine times_prime

   !> A bordered matrix times (x, y); fixed unknowns do not count.
   subroutine times(self, k, border, x, y)
      class(buckling_operator_t), intent(in) :: self
      type(band_t), intent(in) :: k
      type(border_t), intent(in) :: border
      real(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: y(:)
      real(wp) :: held(self%system%n)
      integer :: n, j, d
      n = self%system%n
      held = merge(0.0_wp, x(:n), self%system%fixed)
      call band_times(k, held, y(:n))
      do j = 1, self%system%n_slides
         y(:n) = y(:n) + border%column(:, j) * x(n + j)
         d = dof(self%problem, self%problem%candidates%node(self%system%slide(j)), 1)
         y(n + j) = dot_product(border%row(:, j), held(d:d + 2)) + border%corner(j) * x(n + j)
      end do
      where (self%system%fixed) y(:n) = 0.0_wp
   end subroutine times
end module linear_buckling
