!> The linearised equations with their border: factored once, solved for any right-hand side.
!>
!>   K x - load y_1 - slide y_2.. = rhs      row_1.x + corner y_1 + along.y_2.. = path
!>   row_k.x + rate_k y_1 + corner_k y_k = tangency
!>
!> K is the band less the excess of the ground that couples candidates (active_coupling).
!> y_1 is the increment of the load factor, y_2.. are those of the sliding contact nodes' coordinates. Row 1 is the path
!> constraint; it keeps the system regular at limit points, where K is singular.
module bordered_system
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use rod_geometry, only: slide_node
   use linear_system, only: system_t, assemble, to_node, to_global
   use contact_slides, only: linearise_slides, slide_row
   use band_matrix, only: band_times, factorise, solve_factored
   use active_coupling, only: factor_excess, add_excess_response
   use small_dense, only: solve_small
   use timing, only: timers_t, timing_start, timing_stop, count_up, phase_factorisation, phase_solution, phase_assembly, &
      & counter_factorisation, counter_solution
   implicit none
   private
   public :: linearise, assemble_bordered, factor_system, set_path_row, solve_bordered, solve_effective, apply_increment, &
      & resultant_rates

contains

   !> Assembles the equations and the border of the sliding nodes; `base` as in linear_system.
   subroutine assemble_bordered(problem, state, base, system, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state, base
      type(system_t), intent(inout) :: system
      type(timers_t), intent(inout) :: timers
      call assemble(problem, state, base, system, timers)
      if (.not. system%ok) return
      call timing_start(timers, phase_assembly)
      call linearise_slides(problem, state, system)
      call timing_stop(timers, phase_assembly)
   end subroutine assemble_bordered

   !> Assembles and factors; system%ok tells whether it worked.
   subroutine linearise(problem, state, base, system, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state, base
      type(system_t), intent(inout) :: system
      type(timers_t), intent(inout) :: timers
      call assemble_bordered(problem, state, base, system, timers)
      if (system%ok) call factor_system(problem, state, system, timers)
   end subroutine linearise

   !> Factors the tangent and solves for the border columns.
   subroutine factor_system(problem, state, system, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      type(timers_t), intent(inout) :: timers
      real(wp) :: prescribed(system%n)
      integer :: k, c
      call timing_start(timers, phase_factorisation)
      call factorise(system%k, system%fixed, system%factor)
      call factor_excess(system%coupling, system%factor, system%fixed)
      call count_up(timers, counter_factorisation)
      call timing_stop(timers, phase_factorisation)
      system%ok = .true.
      call solve_constrained(system, system%load, system%rate, system%column(:, 1), timers)
      do k = 1, system%n_slides
         c = system%slide(k)
         prescribed = 0.0_wp
         prescribed(system%unknown(c)) = -system%slide_gap(k) / system%slope(c)
         call solve_constrained(system, system%slide_column(:, k), prescribed, system%column(:, 1 + k), timers)
      end do
      call eliminate_slides(problem, state, system)
   end subroutine factor_system

   !> Path tangent and pivot count with the sliding coordinates eliminated.
   !>
   !> A contact point lies where the gap is least: the energy is a maximum over its coordinate, so each coordinate owns
   !> one negative pivot of the bordered matrix. The energy's derivative by the coordinate is minus the reaction times the
   !> tangency; hence a negative Schur complement of the tangency row, times the reaction, is a negative pivot missing.
   subroutine eliminate_slides(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: schur(system%n_slides, system%n_slides), shift(system%n_slides, 1)
      integer :: j, m
      logical :: singular
      m = system%n_slides
      shift = 0.0_wp
      system%negative_pivots = system%factor%negative_pivots + system%coupling%negative_pivots
      system%tangent = system%column(:, 1)
      system%slide_rate = shift(:, 1)
      if (m == 0) return
      do j = 1, m
         shift(j, 1) = -slide_row(problem, system, j, system%column(:, 1)) - system%tangency_rate(j)
      end do
      schur = tangency_schur(problem, system)
      call count_missing(schur)
      call solve_small(m, schur, shift, singular)
      if (singular) return
      system%slide_rate = shift(:, 1)
      do j = 1, m
         system%tangent = system%tangent + shift(j, 1) * system%column(:, 1 + j)
      end do

   contains

      !> Signs of the pivots of a copy of the Schur complement.
      subroutine count_missing(matrix)
         real(wp), intent(in) :: matrix(:, :)
         real(wp) :: a(m, m)
         integer :: k, l
         a = matrix
         do k = 1, m
            if (a(k, k) * state%reaction(system%slide(k)) < 0.0_wp) system%negative_pivots = system%negative_pivots - 1
            if (.not. abs(a(k, k)) > 0.0_wp) return
            do l = k + 1, m
               a(l, k + 1:) = a(l, k + 1:) - a(l, k) / a(k, k) * a(k, k + 1:)
            end do
         end do
      end subroutine count_missing
   end subroutine eliminate_slides

   !> Schur complement of the tangency rows: what a move of each sliding point does to the tangency of all.
   function tangency_schur(problem, system) result(schur)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! factored, its columns of the sliding points solved
      real(wp) :: schur(system%n_slides, system%n_slides)
      integer :: i, j
      do j = 1, system%n_slides
         do i = 1, system%n_slides
            schur(i, j) = slide_row(problem, system, i, system%column(:, 1 + j))
         end do
         schur(j, j) = schur(j, j) + system%tangency_corner(j)
      end do
   end function tangency_schur

   !> Response to forces at a fixed load factor: constraints hold, sliding points keep their tangency.
   subroutine solve_effective(problem, system, rhs, tangency, x, shift, timers)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! factored
      real(wp), intent(in) :: rhs(:)           !! (n) node axes; entries of fixed unknowns do not count
      real(wp), intent(in) :: tangency(:)      !! (n_slides) right-hand sides of the tangency rows
      real(wp), intent(out) :: x(:)            !! (n)
      real(wp), intent(out) :: shift(:)        !! (n_slides)
      type(timers_t), intent(inout) :: timers
      real(wp) :: matrix(system%n_slides, system%n_slides), b(system%n_slides, 1), held(system%n)
      integer :: j
      logical :: singular
      held = 0.0_wp
      call solve_constrained(system, rhs, held, x, timers)
      if (system%n_slides == 0) return
      do j = 1, system%n_slides
         b(j, 1) = tangency(j) - slide_row(problem, system, j, x)
      end do
      matrix = tangency_schur(problem, system)
      call solve_small(system%n_slides, matrix, b, singular)
      shift = b(:, 1)
      if (singular) shift = 0.0_wp
      do j = 1, system%n_slides
         x = x + shift(j) * system%column(:, 1 + j)
      end do
   end subroutine solve_effective

   !> x = K^-1 rhs with the fixed unknowns at their prescribed values.
   subroutine solve_constrained(system, rhs, prescribed, x, timers)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs(:)         !! (n) forces on the free unknowns
      real(wp), intent(in) :: prescribed(:)  !! (n) values of the fixed unknowns
      real(wp), intent(inout) :: x(:)        !! (n) solution
      type(timers_t), intent(inout) :: timers
      real(wp) :: b(system%n, 1), known(system%n)
      call timing_start(timers, phase_solution)
      b(:, 1) = rhs
      known = merge(prescribed, 0.0_wp, system%fixed)
      if (any(abs(known) > 0.0_wp)) then
         call band_times(system%k, known, x)
         b(:, 1) = b(:, 1) - x
      end if
      where (system%fixed) b(:, 1) = known
      call solve_factored(system%factor, b)
      x = b(:, 1)
      call add_excess_response(system%coupling, x)
      call count_up(timers, counter_solution)
      call timing_stop(timers, phase_solution)
   end subroutine solve_constrained

   !> Sets the path constraint row.x + corner * (load factor increment) + slide.(coordinates' increments) = right-hand side of
   !> solve_bordered.
   subroutine set_path_row(problem, system, row, corner, slide)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(inout) :: system
      real(wp), intent(in) :: row(:, :)    !! (3, nodes) in global axes
      real(wp), intent(in) :: corner
      real(wp), intent(in), optional :: slide(:) !! (n_slides) without it: zero
      integer :: node, d
      do node = 1, size(row, 2)
         d = dof(problem, node, 1)
         system%path_row(d:d + 2) = row(:, node)
         call to_node(system, node, system%path_row(d:d + 2))
      end do
      system%path_corner = corner
      system%path_slide = spread(0.0_wp, 1, system%n_slides)
      if (present(slide)) system%path_slide = slide
   end subroutine set_path_row

   !> Solves the bordered system. Fails (ok false) when it is singular: a bifurcation, or no constraint at all.
   subroutine solve_bordered(problem, system, rhs, prescribed, path_rhs, tangency_rhs, x, y, ok, timers)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs(:), prescribed(:) !! (n)
      real(wp), intent(in) :: path_rhs
      real(wp), intent(in) :: tangency_rhs(:)       !! (n_slides)
      real(wp), intent(inout) :: x(:)               !! (n) nodal increments, node axes
      real(wp), intent(out) :: y(:)                 !! (1 + n_slides) load factor and coordinates
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      real(wp) :: matrix(1 + system%n_slides, 1 + system%n_slides), b(1 + system%n_slides, 1), weight(1 + system%n_slides)
      integer :: i, j, m
      logical :: singular
      m = 1 + system%n_slides
      call solve_constrained(system, rhs, prescribed, x, timers)
      matrix = 0.0_wp
      do j = 1, m
         matrix(1, j) = dot_product(system%path_row, system%column(:, j))
         do i = 2, m
            matrix(i, j) = slide_row(problem, system, i - 1, system%column(:, j))
         end do
      end do
      matrix(1, 1) = matrix(1, 1) + system%path_corner
      matrix(1, 2:) = matrix(1, 2:) + system%path_slide(:system%n_slides)
      b(1, 1) = path_rhs - dot_product(system%path_row, x)
      do i = 2, m
         matrix(i, 1) = matrix(i, 1) + system%tangency_rate(i - 1)
         matrix(i, i) = matrix(i, i) + system%tangency_corner(i - 1)
         b(i, 1) = tangency_rhs(i - 1) - slide_row(problem, system, i - 1, x)
      end do
      do i = 1, m
         weight(i) = maxval([abs(matrix(i, 1)), problem%size * abs(matrix(i, 2:))])
      end do
      weight = 1.0_wp / merge(weight, 1.0_wp, weight > 0.0_wp)
      call solve_small(m, matrix, b, singular, weight)
      y = b(:, 1)
      ! Without a row of displacements, as under load control, the border cannot make a singular tangent regular.
      ok = .not. singular .and. .not. (system%factor%deficient .and. all(abs(system%path_row) <= 0.0_wp))
      if (.not. ok) return
      do j = 1, m
         x = x + y(j) * system%column(:, j)
      end do
   end subroutine solve_bordered

   !> Linear change of the stored resultants of GE elements under an increment; what closes their own defects is not in it.
   pure function resultant_rates(problem, system, x, y) result(rate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:), y(:)     !! as solve_bordered gives them
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements)
      real(wp) :: du(6)
      integer :: e, k, i, z
      rate = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         if (problem%model%mesh%family(e) /= family_ge) cycle
         du(1:3) = to_global(problem, system, x, problem%model%mesh%node(1, e))
         du(4:6) = to_global(problem, system, x, problem%model%mesh%node(2, e))
         z = problem%z_size(e)
         do k = 1, 6
            rate(:z, e) = rate(:z, e) + system%op(:z, k, e) * du(k)
         end do
         rate(:z, e) = rate(:z, e) + system%op(:z, 8, e) * y(1)
      end do
      do k = 1, system%n_slides
         do i = 1, 2
            e = problem%candidates%element(i, system%slide(k))
            z = problem%z_size(e)
            rate(:z, e) = rate(:z, e) + system%slide_op(:z, i, k) * y(1 + k)
         end do
      end do
   end function resultant_rates

   !> Adds a solved increment to the state: displacements, stored resultants, load factor, sliding nodes (slides_fit).
   subroutine apply_increment(problem, system, x, y, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:), y(:)
      type(state_t), intent(inout) :: state
      real(wp) :: rate(size(state%z, 1), size(state%z, 2))
      integer :: e, node, k, z
      rate = resultant_rates(problem, system, x, y)
      do e = 1, problem%model%mesh%n_elements
         if (problem%model%mesh%family(e) /= family_ge) cycle
         z = problem%z_size(e)
         state%z(:z, e) = state%z(:z, e) + rate(:z, e) + system%op(:z, 7, e)
      end do
      do node = 1, problem%model%mesh%n_nodes
         state%u(:, node) = state%u(:, node) + to_global(problem, system, x, node)
      end do
      state%load_factor = state%load_factor + y(1)
      do k = 1, system%n_slides
         call slide_node(problem%model, problem%tableau, state%geometry, problem%candidates%element(:, system%slide(k)), &
            & y(1 + k))
      end do
   end subroutine apply_increment
end module bordered_system
