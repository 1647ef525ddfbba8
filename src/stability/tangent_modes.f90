!> Eigenvalues of the tangent nearest to zero and their modes, for stability and branching.
!>
!> The problem is K x = mu M x, with the tangent K, for motions x that supports and active contacts permit. M contains the weights
!> of the arc-length metric, so that mu is a force times a length and does not depend on the mesh. Eigenvalues are numbered in
!> ascending order: with the number c of negative pivots of K, mu_1 ... mu_c are negative and mu_(c+1) ... positive. Each numbered
!> eigenvalue is continuous along the path while the contact set is unchanged; if c increases by 2 between two points, mu_(c+1) and
!> mu_(c+2) have zeros between these points.
module tangent_modes
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t, unknown_weights
   use rod_state, only: state_t, end_pressures
   use linear_system, only: system_t
   use node_matrices, only: apply_node_matrices
   use axial_rigidity, only: shrinking_forces
   use element_products, only: apply_elements
   use deck_nodes, only: deck_node_rates
   use active_coupling, only: subtract_excess
   use bordered_system, only: solve_effective, all_to_global
   use block_krylov, only: operator_t, spectrum_t, largest_eigenvalues
   implicit none
   private
   public :: modes_t, lowest_modes, null_vectors, bending_stiffness, stretching_forces, stretching_work, choose_null_vectors, &
      & apply_tangent, deck_mode, numbered_eigenvalue, mode_tolerance, most_null_vectors

   !> Eigenvalues nearest to zero, in ascending order of magnitude, with their modes.
   type :: modes_t
      integer :: n = 0                       !! number of modes
      integer :: pivots = 0                  !! number c of negative pivots of the factored tangent
      integer :: hinges = 0 !! number of those of the c negative pivots that do not indicate instability, and that events do not
      !! count (see system_t)
      logical, allocatable :: was_negative(:) !! (n) true for eigenvalues that were negative in the iteration, before the Rayleigh
      !! quotient refined them
      real(wp), allocatable :: mu(:)
      real(wp), allocatable :: x(:, :)       !! (unknowns, n) modes, node axes, of length 1 in the arc-length metric
   end type modes_t

   real(wp), parameter :: mode_tolerance = 1.0e-5_wp !! largest relative residual of the eigenvectors; the relative error of the
   !! eigenvalues is the square of the residual
   integer, parameter :: most_null_vectors = 4 !! largest number of null vectors that is determined at a bifurcation

   !> The linear operator x -> K^-1 M x.
   type, extends(operator_t) :: inverse_tangent_t
      type(system_t), pointer :: system => null()
      type(problem_t), pointer :: problem => null()
   contains
      procedure :: apply => apply_inverse
   end type inverse_tangent_t

contains

   !> Computes the modes nearest to zero at a state at which the system is assembled and factored.
   subroutine lowest_modes(problem, state, system, wanted, modes, error)
      type(problem_t), intent(in), target :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in), target :: system
      integer, intent(in) :: wanted          !! number of eigenvalues that are requested
      type(modes_t), intent(out) :: modes
      type(error_t), allocatable, intent(out) :: error !! allocated: the iteration did not converge
      type(inverse_tangent_t) :: operator
      type(spectrum_t) :: spectrum
      real(wp) :: x(system%n), held(system%n)
      integer :: i, j
      operator%n = system%n
      operator%weight = unknown_weights(problem)
      ! Unknowns that are fixed by supports and rigid contacts are zero in all modes.
      where (system%fixed) operator%weight = 0.0_wp
      operator%system => system
      operator%problem => problem
      call largest_eigenvalues(operator, wanted, mode_tolerance, spectrum, error)
      modes%n = spectrum%n
      modes%pivots = system%negative_pivots + system%hinges
      modes%hinges = system%hinges
      modes%was_negative = spectrum%value < 0.0_wp
      allocate (modes%mu(modes%n))
      modes%x = spectrum%vector
      do i = 1, modes%n
         held = merge(0.0_wp, modes%x(:, i), system%fixed)
         call apply_tangent(problem, state, system, held, x, modes%mu(i))
         if (system%rigidity%n > 0) modes%mu(i) = modes%mu(i) + stretching_work(system, operator%weight * held, held)
      end do
      ! The refinement may have changed the order of the eigenvalues by magnitude.
      do i = 1, modes%n - 1
         j = i - 1 + minloc(abs(modes%mu(i:)), 1)
         modes%mu([i, j]) = modes%mu([j, i])
         modes%x(:, [i, j]) = modes%x(:, [j, i])
         modes%was_negative([i, j]) = modes%was_negative([j, i])
      end do
      ! Eigenvalues mu so large that 1/mu is rounding belong to no mode: the tangent has fewer modes than requested.
      modes%n = max(1, count(epsilon(x) * abs(modes%mu) <= bending_stiffness(problem)))
      modes%mu = modes%mu(:modes%n)
      modes%x = modes%x(:, :modes%n)
      modes%was_negative = modes%was_negative(:modes%n)
   end subroutine lowest_modes

   !> Computes the modes whose eigenvalues vanish, at a state at which the system is assembled and factored. Most critical points
   !> have one null vector: two modes are computed first, and more only if both eigenvalues vanish.
   subroutine null_vectors(problem, state, system, limit, modes, n, error)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: limit          !! eigenvalues of at most this magnitude count as zero
      type(modes_t), intent(out) :: modes    !! the first n modes are the null vectors; at least one mode, unless there is an error
      integer, intent(out) :: n              !! number of null vectors, at most most_null_vectors
      type(error_t), allocatable, intent(out) :: error !! allocated: the iteration did not converge
      call lowest_modes(problem, state, system, 2, modes, error)
      n = count(abs(modes%mu) <= limit)
      if (n < 2) return
      call lowest_modes(problem, state, system, most_null_vectors, modes, error)
      n = count(abs(modes%mu) <= limit)
   end subroutine null_vectors

   !> Reference value for eigenvalues: EI/size of the softest section. The stiffness along a path on which rods bend is at least
   !> pi^4 times this value.
   pure real(wp) function bending_stiffness(problem)
      type(problem_t), intent(in) :: problem
      bending_stiffness = minval(1.0_wp / problem%compliance%bending) / problem%size
   end function bending_stiffness

   !> Correction of x^T K x for the small artificial extension that the tangent allows in inextensible elements, see
   !> stretching_forces.
   real(wp) function stretching_work(system, rhs, x) result(work)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs(:), x(:)   !! (n) see stretching_forces
      work = -dot_product(x, stretching_forces(system, rhs, x))
   end function stretching_work

   !> Forces that remove the small artificial extension of inextensible elements from x, which is a multiple of the response of the
   !> structure to the forces `rhs`.
   function stretching_forces(system, rhs, x) result(force)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs(:)         !! (n) forces
      real(wp), intent(in) :: x(:)           !! (n) node axes, zero at the fixed unknowns
      real(wp) :: force(system%n)
      real(wp) :: answer(system%n), stretch(2, system%rigidity%n)
      call solve_effective(system, rhs, answer, stretch)
      force = 0.0_wp
      ! If the response is zero, there is no extension.
      if (abs(dot_product(x, answer)) > 0.0_wp) &
         & call shrinking_forces(system%rigidity, stretch * (dot_product(x, x) / dot_product(x, answer)), force)
   end function stretching_forces

   !> Rotates the first n modes, whose eigenvalues are zero, to null vectors that do not depend on rounding. (Every rotation of a
   !> basis of the null space is again a basis, but branches have the directions of only few vectors of this space.)
   !>
   !> The first vector is that combination of the modes, of unit length, in which a node has the largest displacement. Each further
   !> vector is found in the same way among the vectors orthogonal to the previous ones. If separate parts buckle at the same load,
   !> each vector is a mode of one part. In a symmetric structure a node on the axis of symmetry selects the vector with the
   !> symmetry of the structure, along which a branch exists (equivariant branching lemma).
   subroutine choose_null_vectors(problem, state, system, n, modes)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state     !! state at which the system is assembled
      type(system_t), intent(in) :: system
      integer, intent(in) :: n               !! number of null vectors, at most modes%n
      type(modes_t), intent(inout) :: modes !! the first n vectors x are replaced by the rotated ones; their eigenvalues are
      !! unchanged
      real(wp), dimension(problem%deck%mesh%n_nodes) :: reach
      real(wp) :: part(2, n, size(reach)), values(3, size(reach)), turn(n, n), c(n), along(2), left(n)
      integer :: i, j, node
      if (n < 2) return
      do j = 1, n
         values = deck_values(problem, state, system, modes%x(:, j))
         part(:, j, :) = values(1:2, :)
      end do
      do i = 1, n
         do node = 1, size(reach)
            call furthest(part(:, :, node), reach(node), along)
         end do
         ! Of several nodes with equal displacement, as in equal parts of a structure, the first is chosen; otherwise the error of
         ! the modes would select one.
         node = findloc(reach >= (1.0_wp - 10.0_wp * mode_tolerance) * maxval(reach), .true., 1)
         call furthest(part(:, :, node), reach(node), along)
         c = matmul(along, part(:, :, node))
         do j = 1, i - 1
            c = c - dot_product(c, turn(:, j)) * turn(:, j)
         end do
         turn(:, i) = c / norm2(c)
         do node = 1, size(reach)
            do j = 1, 2
               left = part(j, :, node)
               part(j, :, node) = left - dot_product(left, turn(:, i)) * turn(:, i)
            end do
         end do
      end do
      modes%x(:, :n) = matmul(modes%x(:, :n), turn)
   end subroutine choose_null_vectors

   !> Largest displacement of a node in a combination of modes of unit length, and the direction of this displacement.
   pure subroutine furthest(part, reach, along)
      real(wp), intent(in) :: part(:, :)     !! (2, modes) displacement of the node in each mode
      real(wp), intent(out) :: reach, along(2) !! largest displacement; unit vector of its direction
      real(wp) :: xx, xy, yy, half, angle
      xx = dot_product(part(1, :), part(1, :))
      xy = dot_product(part(1, :), part(2, :))
      yy = dot_product(part(2, :), part(2, :))
      half = hypot(0.5_wp * (xx - yy), xy)
      reach = sqrt(0.5_wp * (xx + yy) + half)
      along = [1.0_wp, 0.0_wp]
      ! The largest displacement is equal in all directions, and the x direction is chosen.
      if (half <= mode_tolerance * (xx + yy)) return
      angle = 0.5_wp * atan2(2.0_wp * xy, xx - yy)
      along = [cos(angle), sin(angle)]
   end subroutine furthest

   !> K x and x^T K x, without the rounding error of the assembled tangent (see apply_elements).
   subroutine apply_tangent(problem, state, system, x, y, form)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled at `state`
      real(wp), intent(in) :: x(:)             !! (n) vector, node axes; zero at the fixed unknowns
      real(wp), intent(out) :: y(:)            !! (n)
      real(wp), intent(out) :: form            !! x^T y
      real(wp) :: excess, pressure(2, problem%model%mesh%n_elements)
      pressure = end_pressures(problem, state, problem%constant) + &
         & state%load_factor * end_pressures(problem, state, problem%model%step(problem%step)%load)
      call apply_elements(problem, system, system%ek, system%eshift, pressure, x, y, form)
      call apply_node_matrices(problem, system%tie_block, system%slip_block, system%at_nodes, x, y, form)
      call subtract_excess(system%coupling, x, y, excess)
      form = form - excess
   end subroutine apply_tangent

   subroutine apply_inverse(self, x, y)
      class(inverse_tangent_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)
      real(wp), intent(out) :: y(:, :)
      integer :: j
      do j = 1, size(x, 2)
         call solve_effective(self%system, self%weight * x(:, j), y(:, j))
      end do
   end subroutine apply_inverse

   !> A mode at the deck's nodes, scaled to a largest translation of 1. The sign is chosen so that the larger component is positive
   !> at the first node that moves by at least half of the largest translation.
   subroutine deck_mode(problem, state, system, x, mode, sense)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state     !! state at which the system is assembled
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)           !! (unknowns) mode, node axes
      real(wp), intent(out) :: mode(:, :)    !! (3, deck's nodes) scaled mode, global axes
      real(wp), intent(out) :: sense         !! 1, or -1 if the sign of the mode was changed
      real(wp) :: largest
      integer :: node
      mode = deck_values(problem, state, system, x)
      sense = 1.0_wp
      largest = sqrt(maxval(mode(1, :)**2 + mode(2, :)**2))
      if (.not. largest > 0.0_wp) return
      mode = mode / largest
      do node = 1, size(mode, 2)
         if (hypot(mode(1, node), mode(2, node)) < 0.5_wp) cycle
         if (mode(maxloc(abs(mode(1:2, node)), 1), node) < 0.0_wp) sense = -1.0_wp
         exit
      end do
      mode = sense * mode
   end subroutine deck_mode

   !> A mode at the deck's nodes in global axes. If the mesh is that of the deck, these are the values at the nodes of the mesh,
   !> even if the nodes have moved along the rods.
   function deck_values(problem, state, system, x) result(values)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)           !! (unknowns) mode, node axes
      real(wp) :: values(3, problem%deck%mesh%n_nodes)
      if (problem%deck_mesh) then
         values = all_to_global(problem, system, x)
      else
         values = deck_node_rates(problem, state, system, x)
      end if
   end function deck_values

   !> Eigenvalue with a given number, counted in ascending order. If this eigenvalue is not among the computed ones, the result is
   !> the largest computed magnitude, with the sign that follows from the number.
   !>
   !> For an eigenvalue near zero the signs of its pivot and of its value in the iteration are rounding and may differ, while the
   !> refined value has the right sign. The number c of negative eigenvalues is then limited to lie between its values at the two
   !> ends of the path increment.
   pure real(wp) function numbered_eigenvalue(modes, number, least, most) result(mu)
      type(modes_t), intent(in) :: modes
      integer, intent(in) :: number !! number of the eigenvalue, counted without negative pivots that do not indicate instability,
      !! as in events
      integer, intent(in) :: least, most    !! lower and upper bound of c, counted in the same way
      real(wp), parameter :: next_to_zero = 1.0e-3_wp
      integer :: i, left, negative_count, tiny_ones, counted
      logical :: negative
      tiny_ones = 0
      do i = 1, modes%n - 1
         if (abs(modes%mu(i)) <= next_to_zero * abs(modes%mu(i + 1))) tiny_ones = i
      end do
      ! Number of negative eigenvalues, computed or not, except those near zero.
      counted = modes%pivots - count(modes%was_negative(:tiny_ones))
      if (tiny_ones > 0 .and. tiny_ones <= most - least) counted = min(max(counted, least + modes%hinges), &
         & most + modes%hinges - tiny_ones)
      counted = max(counted, count(modes%was_negative(tiny_ones + 1:)))
      negative_count = counted + count(modes%mu(:tiny_ones) < 0.0_wp) + count(modes%mu(tiny_ones + 1:) < 0.0_wp) - &
         & count(modes%was_negative(tiny_ones + 1:))
      negative_count = negative_count - modes%hinges
      negative = number <= negative_count
      left = merge(negative_count - number, number - negative_count - 1, negative)
      mu = merge(-1.0_wp, 1.0_wp, negative) * maxval(abs(modes%mu))
      do i = 1, modes%n
         if (modes%mu(i) < 0.0_wp .neqv. negative) cycle
         if (left == 0) mu = modes%mu(i)
         if (left == 0) exit
         left = left - 1
      end do
   end function numbered_eigenvalue
end module tangent_modes
