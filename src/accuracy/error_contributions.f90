!> Contributions of the elements to the discretisation errors of numbers at one point of the path: the load factor, the monitors,
!> the positions of touchdown points, and the gap that is zero at an event. All these numbers are functionals of the state. By
!> Betti's theorem the error of a number is the work of the elements' errors on the dual displacements of the number.
!>
!> Dual displacements are those at which a small out-of-balance force (internal minus external) works: this work is the change of
!> the number that the force causes while the path constraint remains satisfied (solve_path_duals). Each number needs one
!> back-substitution.
module error_contributions
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use element_products, only: element_deformation
   use path_control, only: control_t, prescribed_functional
   use state_functional, only: functional_t, new_load_functional, inner_place_t, section_place_t
   use monitors, only: new_monitor_functional
   use place_functional, only: new_place_functional
   use element_errors, only: element_errors_t, new_element_errors, element_duals
   use section_quantities, only: section_value
   use bordered_system, only: apply_increment, solve_effective, solve_all_effective
   use state_transfer, only: kept_t, point_displacement
   use band_matrix, only: band_times
   use null_directions, only: new_null_directions, leave_out, free_of
   implicit none
   private
   public :: contributions_t, find_contributions, eigenvalue_shares, solve_path_duals

   !> Error contributions, one row for each number: load factor, monitors, positions of touchdown points, and the gap that is zero
   !> at an event if there is such a gap.
   type :: contributions_t
      real(wp), allocatable :: sum(:)            !! (rows) linear estimate of the error: exact minus computed
      real(wp), allocatable :: size(:)           !! (rows) sum of the absolute values of the contributions to `sum`
      real(wp), allocatable :: rounding(:) !! (rows) estimated rounding error, from the rounding of displacements and stress
      !! resultants
      real(wp), allocatable :: inside(:) !! (rows) bound of two errors that enriched elements of any order do not show: that of
      !! monitors at places inside elements, and that which slope discontinuities inside elements cause
      real(wp), allocatable :: rest(:)           !! (rows) part of `sum` that comes from the residuals left by Newton's method
      real(wp), allocatable :: element(:, :)     !! (rows, elements) absolute contributions
      logical, allocatable :: known(:)           !! (rows) true: there is an estimate for the number
      real(wp) :: unfolding = 0.0_wp !! force of the elements' errors on the null vectors of a bifurcation, less the uncertainty of
      !! this force. If it is not zero, it splits the crossing paths
   end type contributions_t

   !> Change of a number if the polynomials of the elements are replaced by those of the enriched elements.
   type :: inside_t
      real(wp) :: change = 0.0_wp !! number computed from the enriched polynomials minus the number computed from the original ones
      real(wp) :: most = 0.0_wp                  !! bound of the change
      integer, allocatable :: element(:)         !! elements that contain points on which the number depends; empty: none
   end type inside_t

   integer, parameter :: samples = 7             !! number of points in an element at which the two polynomials are compared

contains

   !> Error contributions of all elements at a point.
   subroutine find_contributions(problem, state, system, finer, start, at_start, control, ends, modes, shares, gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system !! factored at `state`; its solutions contain the small artificial extension that the
      !! equations allow in inextensible elements (with_stretch)
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: start         !! `state`, transferred to the enriched problem
      type(system_t), intent(in) :: at_start     !! system of the enriched problem, assembled at `start`
      type(control_t), intent(in) :: control     !! constraint of the path, which prescribes one quantity
      integer, intent(in) :: ends(:) !! candidates of the touchdown points whose positions are rows, see place_functional
      real(wp), intent(in) :: modes(:, :) !! (unknowns, multiplicity) null vectors of a bifurcation; no columns at other points
      type(contributions_t), intent(out) :: shares
      type(functional_t), intent(in), optional :: gap !! functional of the gap that is zero at an event
      type(functional_t), allocatable :: number(:)
      type(functional_t) :: held
      type(inside_t) :: inside, held_inside
      type(element_errors_t) :: errors
      type(state_t) :: solved                    ! `start` after elimination of the elements' internal residuals
      real(wp) :: none(at_start%n)
      real(wp), allocatable :: dual(:, :), by_held(:)
      logical :: ok
      integer :: m
      number = all_numbers()
      associate (rows => size(number)) ! all rows are unknown until they are computed
         allocate (shares%sum(rows), shares%size(rows), shares%rounding(rows), shares%inside(rows), shares%rest(rows), &
            & shares%element(rows, problem%model%mesh%n_elements), source=0.0_wp)
         allocate (shares%known(rows), source=.false.)
      end associate
      errors = new_element_errors(problem, state, system, at_start)
      shares%unfolding = norm2([(errors%excess_on_mode(problem, system, modes(:, m)), m=1, size(modes, 2))])
      held = prescribed_functional(problem, control, state, system)
      allocate (dual(system%n, size(number)), by_held(size(number)))
      call solve_path_duals(problem, system, held, number, modes, dual, by_held, ok)
      if (.not. ok) return
      solved = start
      none = 0.0_wp
      if (depends_inside(held) .or. any([(depends_inside(number(m)), m=1, size(number))])) &
         & call apply_increment(finer, at_start, none, 0.0_wp, solved)
      held_inside = enrichment_change(problem, state, held, finer, solved)
      do m = 1, size(number)
         if (.not. number(m)%estimated) cycle
         inside = enrichment_change(problem, state, number(m), finer, solved)
         ! If the constraint prescribes a monitor between nodes, the polynomial of the original element has the prescribed value.
         ! The enriched polynomial has another value there. To correct this difference changes all numbers.
         call set_row(number(m), dual(:, m), inside%change - by_held(m) * held_inside%change, m)
         call add_inside(inside, 1.0_wp, m, shares)
         call add_inside(held_inside, abs(by_held(m)), m, shares)
      end do

   contains

      !> The numbers of the rows as functionals, in the order of the rows.
      function all_numbers() result(number)
         type(functional_t), allocatable :: number(:)
         integer :: n, m, k
         n = size(problem%model%monitor)
         allocate (number(1 + n + size(ends)))
         number(1) = new_load_functional(system%n, state%load_factor)
         do m = 1, n
            number(1 + m) = new_monitor_functional(problem, state, system, m)
         end do
         do k = 1, size(ends)
            number(1 + n + k) = new_place_functional(problem, state, system, ends(k))
         end do
         if (present(gap)) number = [number, gap]
      end function all_numbers

      !> Computes one row, the error contributions of one number.
      subroutine set_row(number, dual, change, row)
         type(functional_t), intent(in) :: number
         real(wp), intent(in) :: dual(:)            ! (unknowns) dual displacements of the number
         real(wp), intent(in) :: change             ! change of the number if the enriched polynomials are used between nodes
         integer, intent(in) :: row
         real(wp), dimension(problem%model%mesh%n_elements) :: share, of_kinks
         real(wp) :: total(system%n), by_end(6, problem%model%mesh%n_elements), direct
         total = dual
         if (allocated(number%by_force)) total = total + number%by_force
         by_end = element_duals(problem, system, total)
         direct = 0.0_wp
         if (allocated(number%by_force) .and. allocated(number%by_element)) then
            by_end = by_end + number%by_element
         else if (allocated(number%by_element)) then
            direct = sum(errors%work(number%by_element))
         end if
         share = errors%work(by_end)
         of_kinks = errors%work_of_kinks(problem, system, by_end)
         shares%known(row) = .true.
         ! The residual left by Newton's method is not an error of any element.
         shares%rest(row) = dot_product(total, merge(0.0_wp, system%residual, system%fixed))
         ! The residuals inside elements are added here. If the number depends on points inside elements, they are already in
         ! `change`.
         if (.not. depends_inside(number)) shares%rest(row) = shares%rest(row) + number%defect
         shares%sum(row) = sum(share) + shares%rest(row) + change + direct
         shares%size(row) = sum(abs(share)) + abs(shares%rest(row) + change + direct)
         shares%rounding(row) = errors%rounding(system, by_end)
         shares%inside(row) = sum(of_kinks)
         shares%element(row, :) = abs(share) + of_kinks
      end subroutine set_row
   end subroutine find_contributions

   !> Adds to the contributions to a number the error of a monitor between nodes, in the elements that contain the monitor's points.
   !> The monitor may be the number itself, or the prescribed monitor, which changes all numbers.
   pure subroutine add_inside(inside, rate, row, shares)
      type(inside_t), intent(in) :: inside
      real(wp), intent(in) :: rate               !! absolute value of the derivative of the number with respect to the monitor
      integer, intent(in) :: row
      type(contributions_t), intent(inout) :: shares
      integer :: i
      if (size(inside%element) > 0) shares%inside(row) = shares%inside(row) + rate * inside%most
      do i = 1, size(inside%element)
         associate (share => shares%element(row, inside%element(i)))
            share = share + rate * inside%most / size(inside%element)
         end associate
      end do
   end subroutine add_inside

   !> Absolute contributions of the elements to the error of an eigenvalue at a fixed state: the change of the quadratic form x^T K
   !> x of its modes x if the element stiffness is that of the enriched elements. Only the ratios of these contributions are used,
   !> because at orders 2 and 4 they are too large (see element_errors).
   function eigenvalue_shares(problem, system, finer, modes) result(share)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system, finer
      real(wp), intent(in) :: modes(:, :)        !! (unknowns, multiplicity) node axes
      real(wp) :: share(problem%model%mesh%n_elements), relative(6)
      integer :: e, k
      share = 0.0_wp
      do k = 1, size(modes, 2)
         do e = 1, size(share)
            relative = element_deformation(problem, system, e, modes(:, k))
            share(e) = share(e) + abs(dot_product(relative, matmul(finer%ek(:, :, e) - system%ek(:, :, e), relative)))
         end do
      end do
   end function eigenvalue_shares

   !> True if a number depends on points inside elements.
   pure logical function depends_inside(number) result(depends)
      type(functional_t), intent(in) :: number
      depends = allocated(number%section)
      if (allocated(number%inner)) depends = depends .or. size(number%inner) > 0
   end function depends_inside

   !> Change of a number if the enriched polynomials are used between the nodes, at the same displacements of the nodes.
   function enrichment_change(problem, state, number, finer, solved) result(inside)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(functional_t), intent(in) :: number
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: solved        !! the same point as a state of the enriched problem, without internal residuals
      type(inside_t) :: inside
      type(kept_t) :: own, enriched
      integer :: i, j
      allocate (inside%element(0))
      if (allocated(number%section)) then
         inside%element = number%section%element
         do i = 1, size(number%section)
            associate (place => number%section(i))
               call add(place%tau, place%factor * section_change(place, place%tau), &
                  & abs(place%factor) * maxval([(abs(section_change(place, real(j, wp) / (samples + 1))), j=1, samples)]))
            end associate
         end do
      end if
      if (allocated(number%inner)) then
         inside%element = number%inner%element
         do i = 1, size(number%inner)
            associate (place => number%inner(i))
               call add(place%tau, difference(place, place%tau), &
                  & maxval([(abs(difference(place, real(j, wp) / (samples + 1))), j=1, samples)]))
            end associate
         end do
      end if
      inside%most = max(inside%most, abs(inside%change))

   contains

      !> Adds the change at one place. The two polynomials may agree by chance at this place, so that the bound is computed from
      !> their largest difference in the element.
      subroutine add(tau, change, largest)
         real(wp), intent(in) :: tau             !! position in the element, 0 to 1
         real(wp), intent(in) :: change, largest !! change at the place; largest change in the element
         inside%change = inside%change + change
         inside%most = inside%most + 4.0_wp * tau * (1.0_wp - tau) * largest
      end subroutine add

      !> Change of a section quantity in the enriched element.
      real(wp) function section_change(place, tau)
         type(section_place_t), intent(in) :: place
         real(wp), intent(in) :: tau             !! position in the element, 0 to 1
         section_change = section_value(finer, solved, place%element, tau, place%quantity, place%sense) - &
            & section_value(problem, state, place%element, tau, place%quantity, place%sense)
      end function section_change

      !> Difference between the two polynomials at a place in an element, summed with the weights of the place's displacements and
      !> rotation.
      real(wp) function difference(place, tau)
         type(inner_place_t), intent(in) :: place
         real(wp), intent(in) :: tau             !! position in the element, 0 to 1
         real(wp), dimension(3) :: u, v
         call point_displacement(problem, state, place%element, tau, own, u)
         call point_displacement(finer, solved, place%element, tau, enriched, v)
         difference = dot_product(place%weight, v - u)
      end function difference
   end function enrichment_change

   !> Computes the dual displacements of all given functionals.
   subroutine solve_path_duals(problem, system, held, number, modes, dual, by_held, ok)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      type(functional_t), intent(in) :: held     !! functional whose value the path constraint prescribes
      type(functional_t), intent(in) :: number(:)
      real(wp), intent(in) :: modes(:, :) !! (n, multiplicity) null vectors of a bifurcation; no columns at other points. Components
      !! of displacements along the null vectors are removed, because they are rounding divided by a vanishing eigenvalue
      real(wp), intent(out) :: dual(:, :)        !! (unknowns, numbers) dual (adjoint) displacements, a column for each number, in
      !! node axes
      real(wp), intent(out) :: by_held(:) !! (functionals) derivative of each functional along the path with respect to the
      !! prescribed quantity
      logical, intent(out) :: ok                 !! false: the prescribed quantity is constant along the path, and nothing is set
      real(wp), dimension(system%n) :: tangent, known, push, of_load
      real(wp) :: response(system%n, 0:size(number)), along
      real(wp), allocatable :: direction(:, :)
      integer :: m
      direction = new_null_directions(problem, system, modes)
      tangent = system%tangent
      call leave_out(problem, modes, direction, tangent)
      along = held%change(tangent, 1.0_wp)
      ok = abs(along) > 0.0_wp
      if (.not. ok) return
      known = merge(system%rate, 0.0_wp, system%fixed)
      push = 0.0_wp
      if (any(abs(known) > 0.0_wp)) call band_times(system%k, known, push)
      push = merge(0.0_wp, system%load - push, system%fixed)
      response(:, 0) = free_force(held%by_unknown)
      do m = 1, size(number)
         response(:, m) = free_force(number(m)%by_unknown)
      end do
      call solve_all_effective(system, response)
      do m = 0, size(number)
         call leave_out(problem, modes, direction, response(:, m))
      end do
      of_load = response(:, 0) / along
      do m = 1, size(number)
         by_held(m) = number(m)%change(tangent, 1.0_wp) / along
         call combine(number(m), response(:, m), by_held(m), dual(:, m))
      end do

   contains

      !> Dual displacements of one number. They are the difference of two parts: at constant load, and due to the change of the
      !> load. At a limit point both parts are unbounded, and their difference loses digits. The residuals of the dual equations
      !> therefore correct the difference.
      subroutine combine(number, response, by_held, dual)
         type(functional_t), intent(in) :: number
         real(wp), intent(in) :: response(:)     !! (n) response of the structure to the gradient of the number
         real(wp), intent(in) :: by_held
         real(wp), intent(out) :: dual(:)        !! (n) dual displacements, node axes
         real(wp) :: lost, left(system%n), more(system%n)
         lost = sqrt(epsilon(lost)) * maxval(abs(response))
         dual = by_held * along * of_load - response
         dual = dual + load_residual(number, by_held, dual) * of_load
         ! The band matrix does not contain the stiffness of coupled ground, so that the residual cannot be computed from it.
         if (maxval(abs(dual)) > lost .or. system%coupling%n > 0) return
         call band_times(system%k, dual, left)
         left = free_force(by_held * held%by_unknown - number%by_unknown - left)
         call solve_effective(system, left, more)
         call leave_out(problem, modes, direction, more)
         dual = dual + more
         dual = dual + load_residual(number, by_held, dual) * of_load
      end subroutine combine

      !> Residual of that dual equation which belongs to the load factor.
      pure real(wp) function load_residual(number, by_held, dual) result(residual)
         type(functional_t), intent(in) :: number
         real(wp), intent(in) :: by_held, dual(:)
         residual = number%change(known, 1.0_wp) - dot_product(push, dual) - by_held * held%change(known, 1.0_wp)
      end function load_residual

      !> Forces on the free unknowns, without components along null vectors.
      function free_force(force) result(free)
         real(wp), intent(in) :: force(:)
         real(wp) :: free(size(force))
         free = merge(0.0_wp, free_of(problem, modes, merge(0.0_wp, force, system%fixed)), system%fixed)
      end function free_force
   end subroutine solve_path_duals
end module error_contributions
