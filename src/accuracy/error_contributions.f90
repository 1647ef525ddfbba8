!> Contributions of the elements to the discretisation errors of the load factor, the monitors and the places of touchdown points at
!> one point of the path.
!>
!> The enriched element, with its internal unknowns eliminated about the collocation polynomial, has a relative end displacement and
!> another end moment that the element itself does not have. Imposed on the element itself, both are out-of-balance forces on the
!> nodes. By Betti's theorem these forces change a number by their work on the dual displacements of that number: one
!> back-substitution for each number. (The end forces of the enriched element for that end displacement are no substitute: at orders
!> 2 and 4 its axial stiffness differs.)
module error_contributions
   use kinds, only: wp
   use model, only: method_displacement
   use element_families, only: collocates
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use element_products, only: element_deformation, element_unknowns
   use bordered_system, only: solve_effective, solve_all_effective, unknowns_of
   use band_matrix, only: band_times
   use path_control, only: control_t, held_by
   use null_directions, only: new_null_directions, leave_out, free_of
   use state_functional, only: functional_t
   use monitor_functional, only: new_monitor_functional
   use inside_elements, only: inside_t, look_inside
   use inner_kinks, only: kink_moments
   use contact_places, only: place_gradients, moment_places
   use small_dense, only: solve_small
   implicit none
   private
   public :: contributions_t, find_contributions, eigenvalue_shares

   !> Rows: load factor, monitors, places.
   type :: contributions_t
      real(wp), allocatable :: sum(:)            !! (rows) linear estimate of the error: exact minus computed
      real(wp), allocatable :: size(:)           !! (rows) sum of the absolute contributions
      real(wp), allocatable :: rounding(:)       !! (rows) estimated effect of rounding of displacements and stress resultants
      real(wp), allocatable :: inside(:) !! (rows) bound of the error from monitors inside elements and from slope discontinuities
      !! inside elements, which enriched elements of any order do not show
      real(wp), allocatable :: rest(:)           !! (rows) part of `sum` from the residuals that the iteration left
      real(wp), allocatable :: element(:, :)     !! (rows, elements) absolute contributions
      real(wp), allocatable :: watched(:)        !! (elements) absolute contributions to the error of a watched displacement; not
      !! allocated: none
      real(wp) :: watched_kinks = 0.0_wp         !! bound of the error of the watched displacement from slope discontinuities
      logical, allocatable :: known(:)           !! (rows) false: no estimate for this number
      real(wp) :: unfolding = 0.0_wp             !! force on the null vectors of a bifurcation, beyond the error of that force
   end type contributions_t

   !> In runs of a prototype the root of the sum of squares computed below was 0.26 to 148 times the true rounding error.
   real(wp), parameter :: rounding_factor = 4.0_wp

contains

   !> Error contributions of all elements at a point.
   subroutine find_contributions(problem, state, system, finer, start, at_start, control, ends, modes, shares, &
      & watched)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system !! factored at `state`; its solutions contain the artificial extension of inextensible
      !! elements (with_stretch)
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: start         !! state of the enriched problem at the same point
      type(system_t), intent(in) :: at_start     !! system of the enriched problem, assembled at `start`
      type(control_t), intent(in) :: control     !! constraint: the quantity that is prescribed
      integer, intent(in) :: ends(:)             !! touchdown points whose places are rows, see contact_places
      real(wp), intent(in) :: modes(:, :) !! (n, multiplicity) null vectors of a bifurcation, else none. Components of displacements
      !! along them are removed: they are rounding divided by a vanishing eigenvalue
      type(contributions_t), intent(out) :: shares
      real(wp), allocatable, intent(in), optional :: watched(:, :) !! (3, nodes) gradient of the watched number, global axes
      type(functional_t) :: number(2 + size(problem%model%monitor) + size(ends)) ! the last one: watched
      type(inside_t) :: inside, held
      real(wp) :: way(size(ends)), kink(problem%model%mesh%n_elements)
      real(wp), dimension(6, problem%model%mesh%n_elements) :: force, dual
      real(wp) :: moved(2, problem%model%mesh%n_elements) ! sizes of displacements and chord, of rotations
      real(wp) :: w(system%n), of_load(system%n), tangent(system%n), answers(system%n, size(number)), &
         & push(system%n), known(system%n), share(problem%model%mesh%n_elements), along, along_load, rest, change, corner
      type(functional_t) :: held_fixed
      real(wp), allocatable :: direction(:, :)
      integer :: e, m, n, k
      n = size(number) - 1
      allocate (shares%sum(n), shares%size(n), shares%rounding(n), shares%inside(n), source=0.0_wp)
      allocate (shares%element(n, size(share)), shares%rest(n), source=0.0_wp)
      allocate (shares%known(n), source=.false.)
      do e = 1, size(share)
         force(:, e) = unbalanced(problem, system, at_start, e)
         associate (node => problem%model%mesh%node(:, e))
            moved(1, e) = norm2(state%geometry%element(e)%chord) + maxval(abs(state%u(1:2, node)))
            moved(2, e) = maxval(abs(state%u(3, node)))
         end associate
      end do
      shares%unfolding = sqrt(sum([(force_on(modes(:, m))**2, m=1, size(modes, 2))]))
      kink = kink_moments(problem, state)
      direction = new_null_directions(problem, system, modes)
      held_fixed = held_by(problem, control, state, system)
      call list_numbers()
      tangent = system%tangent
      call leave_out(problem, modes, direction, tangent)
      known = merge(system%rate, 0.0_wp, system%fixed)
      push = path_load(system, known)
      along = dot_product(number(1)%by_unknown, tangent) + held_fixed%by_load
      corner = held_fixed%by_load + dot_product(number(1)%by_unknown, known)
      if (.not. abs(along) > 0.0_wp) return
      of_load = answers(:, 1) / along
      if (control%method == method_displacement) held = look_inside(problem, state, finer, start, at_start, control%monitor)
      do m = 1, n
         if (.not. number(m)%known) cycle
         if (m == 1) then
            w = of_load
            along_load = 1.0_wp
         else
            call combine(number(m), answers(:, m))
         end if
         dual = nodal_all(w)
         if (allocated(number(m)%by_element)) dual = dual + number(m)%by_element
         rest = 0.0_wp
         if (allocated(number(m)%by_force)) then
            w = number(m)%by_force + w
            rest = dot_product(number(m)%by_force, system%residual - system%raw)
         end if
         ! The residual that Newton's method left is no error of the elements.
         rest = rest + dot_product(w, merge(0.0_wp, system%residual, system%fixed))
         share = shares_by(dual)
         shares%known(m) = .true.
         shares%element(m, :) = abs(share)
         ! A prescribed monitor has the prescribed value on the element's own polynomial: between nodes the enriched polynomial
         ! differs there, and all numbers change with the correction of that difference.
         change = -along_load / along * held%change
         call share_inside(m, held, abs(along_load / along))
         shares%inside(m) = shares%inside(m) + sum(work_of_kinks())
         shares%element(m, :) = shares%element(m, :) + work_of_kinks()
         k = m - n + size(ends)
         if (k > 0) then
            change = change + way(k)
         else if (m > 1) then
            inside = look_inside(problem, state, finer, start, at_start, m - 1)
            change = change + inside%change
            call share_inside(m, inside, 1.0_wp)
            ! For displacements look_inside contains the defect.
            if (allocated(number(m)%by_force)) rest = rest + number(m)%defect
         end if
         shares%rest(m) = rest
         shares%sum(m) = sum(share) + rest + change
         shares%size(m) = sum(abs(share)) + abs(rest + change)
         shares%rounding(m) = rounding_factor * rounding_of(dual)
      end do
      if (.not. number(n + 1)%known) return
      call combine(number(n + 1), answers(:, n + 1))
      dual = nodal_all(w)
      shares%watched = abs(shares_by(dual)) + work_of_kinks()
      shares%watched_kinks = sum(work_of_kinks())

   contains

      !> Lists all numbers, and solves for the response of the structure to the gradient of each; for the load factor (row 1) this
      !> is the gradient of the constraint.
      subroutine list_numbers()
         real(wp), dimension(system%n, size(ends)) :: by_unknown
         real(wp) :: by_load(size(ends))
         integer :: last
         number(1)%known = .true.
         number(1)%by_unknown = held_fixed%by_unknown
         do m = 1, size(problem%model%monitor)
            number(m + 1) = new_monitor_functional(problem, state, system, m)
         end do
         if (size(ends) > 0) then
            call place_gradients(problem, state, system, ends, by_unknown, by_load)
            way = moment_places(problem, state, force, ends)
         end if
         do k = 1, size(ends)
            m = n - size(ends) + k
            number(m)%known = .true.
            number(m)%by_unknown = by_unknown(:, k)
            number(m)%by_load = by_load(k)
         end do
         if (present(watched)) then
            number(n + 1)%known = allocated(watched)
            if (allocated(watched)) number(n + 1)%by_unknown = unknowns_of(problem, system, watched)
         end if
         answers = 0.0_wp
         last = n
         if (number(n + 1)%known) last = n + 1
         do m = 1, last
            if (number(m)%known) answers(:, m) = free_force(number(m)%by_unknown)
         end do
         call solve_all_effective(system, answers(:, :last))
         do m = 1, last
            call leave_out(problem, modes, direction, answers(:, m))
         end do
      end subroutine list_numbers

      !> Adds the error of a monitor inside its elements to their contributions, for a number that depends on the monitor.
      subroutine share_inside(row, inside, rate)
         integer, intent(in) :: row               !! row of the number
         type(inside_t), intent(in) :: inside
         real(wp), intent(in) :: rate             !! derivative of the number by the monitor, absolute value
         integer :: i
         if (.not. allocated(inside%element)) return
         shares%inside(row) = shares%inside(row) + rate * inside%most
         do i = 1, size(inside%element)
            associate (share => shares%element(row, inside%element(i)))
               share = share + rate * inside%most / size(inside%element)
            end associate
         end do
      end subroutine share_inside

      !> Forces on the free unknowns, without their components along null vectors.
      function free_force(force) result(free)
         real(wp), intent(in) :: force(:)
         real(wp) :: free(size(force))
         free = merge(0.0_wp, free_of(problem, modes, merge(0.0_wp, force, system%fixed)), system%fixed)
      end function free_force

      !> Bounds the error from slope discontinuities inside elements by their work on the dual moments there, which are at most
      !> those at the element ends.
      function work_of_kinks() result(work)
         real(wp) :: work(size(kink))
         integer, parameter :: moments(2) = [3, 6]
         integer :: e
         work = 0.0_wp
         do e = 1, size(kink)
            if (kink(e) > 0.0_wp) work(e) = kink(e) * problem%compliance(e)%bending * &
               & maxval(abs(matmul(system%ek(moments, :, e), dual(:, e))))
         end do
      end function work_of_kinks

      !> Dual displacements of a number, including the effect of the constraint. At a limit point both parts are unbounded and their
      !> difference loses digits: there it is corrected by the residuals of the equations and of the load.
      subroutine combine(functional, answer)
         type(functional_t), intent(in) :: functional
         real(wp), intent(in) :: answer(:)        !! (n) response to the gradient of the number
         real(wp) :: lost, given, of_path, left(system%n), more(system%n)
         along_load = dot_product(functional%by_unknown, tangent) + functional%by_load
         given = functional%by_load + dot_product(functional%by_unknown, known)
         lost = sqrt(epsilon(lost)) * maxval(abs(answer))
         w = along_load * of_load - answer
         of_path = along_load / along
         w = w + (given - dot_product(push, w) - of_path * corner) * of_load
         ! The band matrix does not contain the stiffness of coupled ground.
         if (maxval(abs(w)) > lost .or. system%coupling%n > 0) return
         call band_times(system%k, w, left)
         left = free_force(of_path * number(1)%by_unknown - functional%by_unknown - left)
         call solve_effective(system, left, more)
         call leave_out(problem, modes, direction, more)
         w = w + more + (given - dot_product(push, w + more) - of_path * corner) * of_load
      end subroutine combine

      !> Force on a null vector, as far as it exceeds its own error: the sum of the absolute contributions of the elements, the
      !> rounding of the contributions, and that of the directions of the elements' forces.
      real(wp) function force_on(mode) result(excess)
         real(wp), intent(in) :: mode(:)
         integer, parameter :: forces(4) = [1, 2, 4, 5], moments(2) = [3, 6]
         real(wp) :: free(size(mode)), local(6), turned
         integer :: e
         free = merge(0.0_wp, mode, system%fixed)
         dual = nodal_all(free)
         share = shares_by(dual)
         turned = 0.0_wp
         do e = 1, size(share)
            local = dual(:, e)
            turned = turned + (norm2(local(forces)) * norm2(system%eraw(forces, e)) + &
               & norm2(local(moments)) * norm2(system%eraw(moments, e)))**2
         end do
         excess = abs(dot_product(free, system%residual) + sum(share)) - sum(abs(share)) - &
            & rounding_factor * (rounding_of(dual) + epsilon(turned) * sqrt(turned))
         excess = max(excess, 0.0_wp)
      end function force_on

      !> Contributions of the elements: work of their out-of-balance forces on the dual displacements of their nodes.
      function shares_by(dual) result(by)
         real(wp), intent(in) :: dual(:, :)       !! (6, elements)
         real(wp) :: by(problem%model%mesh%n_elements)
         by = sum(dual * force, dim=1)
      end function shares_by

      !> (6, elements) unknowns of the nodes of each element.
      function nodal_all(x) result(local)
         real(wp), intent(in) :: x(:)
         real(wp) :: local(6, problem%model%mesh%n_elements)
         integer :: e
         do e = 1, size(local, 2)
            local(:, e) = element_unknowns(problem, system, x, e)
         end do
      end function nodal_all

      !> Estimated rounding error of a number: the rounding of displacements, chords and stress resultants of all elements, weighted
      !> like their errors.
      real(wp) function rounding_of(dual)
         real(wp), intent(in) :: dual(:, :)       !! (6, elements)
         real(wp) :: resultant(3)
         integer :: e
         rounding_of = 0.0_wp
         do e = 1, problem%model%mesh%n_elements
            resultant = matmul(system%ek(4:6, :, e), dual(:, e))
            rounding_of = rounding_of + dot_product(resultant(1:2), resultant(1:2)) * moved(1, e)**2 + &
               & (resultant(3) * moved(2, e))**2 + sum((dual(:, e) * system%eraw(:, e))**2)
         end do
         rounding_of = epsilon(rounding_of) * sqrt(rounding_of)
      end function rounding_of
   end subroutine find_contributions

   !> Absolute contributions of the elements to the error of an eigenvalue at a fixed state: the change of the quadratic form of its
   !> modes due to the stiffness of the enriched elements. Only their ratios are used; at orders 2 and 4 they are too large, see
   !> above.
   function eigenvalue_shares(problem, system, finer, modes) result(share)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system, finer
      real(wp), intent(in) :: modes(:, :)        !! (unknowns, multiplicity) node axes
      real(wp) :: share(problem%model%mesh%n_elements)
      real(wp) :: relative(6)
      integer :: e, k
      share = 0.0_wp
      do k = 1, size(modes, 2)
         do e = 1, size(share)
            relative = element_deformation(problem, system, e, modes(:, k))
            share(e) = share(e) + abs(dot_product(relative, matmul(finer%ek(:, :, e) - system%ek(:, :, e), relative)))
         end do
      end do
   end function eigenvalue_shares

   !> Forces on the free unknowns per unit of the load factor, including those of moving supports.
   function path_load(system, known) result(force)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: known(:)           !! (n) change of the fixed unknowns per unit of the load factor
      real(wp) :: force(system%n)
      force = 0.0_wp
      if (any(abs(known) > 0.0_wp)) call band_times(system%k, known, force)
      force = merge(0.0_wp, system%load - force, system%fixed)
   end function path_load

   !> Out-of-balance forces of an element on its nodes, due to the enriched element. Node axes. The mean of the results for either
   !> end, so that they do not depend on the direction of the element.
   function unbalanced(problem, system, finer, e) result(force)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system, finer
      integer, intent(in) :: e
      real(wp) :: force(6)
      real(wp) :: difference(6), by_end(6, 2)
      logical :: singular(2)
      difference = finer%ef(:, e) - system%ef(:, e)
      force = difference
      if (.not. collocates(problem%model%mesh%family(e)) .or. problem%conforms(e) > 0) return
      call by_displacement(0, 3, by_end(:, 1), singular(1))
      call by_displacement(3, 0, by_end(:, 2), singular(2))
      if (.not. any(singular)) force = 0.5_wp * sum(by_end, dim=2)

   contains

      !> Out-of-balance forces from the displacement of one end that, with the other end held, gives the enriched element the force
      !> difference at the held end.
      subroutine by_displacement(held, moved, forces, singular)
         integer, intent(in) :: held, moved      !! numbers of rows before those of the held end and of the moved end
         real(wp), intent(out) :: forces(6)
         logical, intent(out) :: singular
         real(wp) :: stiffness(3, 3), gap(1, 3), weight(3)
         integer :: j
         stiffness = transpose(finer%ek(held + 1:held + 3, moved + 1:moved + 3, e))
         gap(1, :) = difference(held + 1:held + 3)
         weight = [problem%size, problem%size, 1.0_wp]
         call solve_small(3, stiffness, gap, singular, weight)
         if (singular) return
         forces(held + 1:held + 3) = 0.0_wp
         forces(moved + 1:moved + 3) = difference(moved + 1:moved + 3)
         do j = 1, 3
            associate (mine => system%ek(:, moved + j, e), its => finer%ek(:, moved + j, e))
               forces(held + 1:held + 3) = forces(held + 1:held + 3) + mine(held + 1:held + 3) * gap(1, j)
               forces(moved + 1:moved + 3) = forces(moved + 1:moved + 3) + &
                  & (mine(moved + 1:moved + 3) - its(moved + 1:moved + 3)) * gap(1, j)
            end associate
         end do
      end subroutine by_displacement
   end function unbalanced
end module error_contributions
