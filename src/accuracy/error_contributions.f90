!> What each element contributes to the discretisation error of the load factor, of the monitors and of the places of touchdown
!> points at a point.
!>
!> The finer element, its inner unknowns eliminated about the collocation polynomial, has a relative end displacement where the
!> element itself has none, and another end moment. Imposed on the element itself they are forces on the nodes that are out of
!> balance, and by Betti's theorem a number's change by these is their work on the displacements that belong to that number: one
!> back-substitution. (The finer element's own forces for that end displacement will not do: of order 2 and 4 its axial stiffness
!> is another one.)
module error_contributions
   use kinds, only: wp
   use model, only: quantity_displacement, quantity_contact, method_displacement
   use element_families, only: collocates
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, to_node
   use tied_nodes, only: node_unknowns
   use element_products, only: element_deformation
   use bordered_system, only: solve_effective, solve_all_effective, unknowns_of
   use band_matrix, only: band_times
   use path_control, only: control_t, held_row
   use null_directions, only: new_null_directions, leave_out, free_of
   use contact_totals, only: contact_sum_known, contact_sum_defect, contact_sum_gradient
   use stop_forces, only: stop_force_gradient, stop_force_defect
   use monitor_rows, only: monitor_row_t, monitor_row
   use inside_elements, only: inside_t, look_inside
   use inner_kinks, only: kink_moments
   use contact_places, only: place_gradients, moment_places
   use small_dense, only: solve_small
   implicit none
   private
   public :: contributions_t, find_contributions, eigenvalue_shares

   !> Rows: load factor, monitors, places.
   type :: contributions_t
      real(wp), allocatable :: sum(:)            !! (rows) linear estimate of the error: exact less computed
      real(wp), allocatable :: size(:)           !! (rows) sum of the sizes of all shares
      real(wp), allocatable :: rounding(:)       !! (rows) what rounding of displacements and resultants may do
      real(wp), allocatable :: inside(:)         !! (rows) of the sum, what monitors inside elements err there, and what kinks may
      !! make of the number that elements of any order do not show
      real(wp), allocatable :: rest(:)           !! (rows) of the sum, what Newton's method has left
      real(wp), allocatable :: element(:, :)     !! (rows, elements) sizes of the shares
      real(wp), allocatable :: watched(:)        !! (elements) the same of a watched displacement
      real(wp) :: watched_kinks = 0.0_wp         !! what kinks may make of that
      logical, allocatable :: known(:)           !! (rows) false: not a number that this knows of
      real(wp) :: unfolding = 0.0_wp             !! force on the null vectors of a bifurcation, beyond what it may err by
   end type contributions_t

   !> A number as a function of the unknowns, linearised. Node axes.
   type :: functional_t
      logical :: known = .false.
      real(wp), allocatable :: by_unknown(:)     !! (n)
      real(wp) :: by_load = 0.0_wp
      real(wp), allocatable :: by_force(:)       !! (n) of what is out of balance: reactions; not allocated: nothing
      real(wp), allocatable :: by_element(:, :)  !! (6, elements) of the forces of each on its nodes; not allocated: nothing
   end type functional_t

   !> Of true rounding errors the root of the sum of squares below was 0.26 to 148 times in runs of a prototype.
   real(wp), parameter :: rounding_factor = 4.0_wp

contains

   !> Shares of all elements at a point.
   subroutine find_contributions(problem, state, system, finer, start, at_start, control, ends, modes, shares, &
      & watched)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored there, without inextensible elements (with_stretch)
      type(problem_t), intent(in) :: finer       !! the finer problem,
      type(state_t), intent(in) :: start         !! the same point of it
      type(system_t), intent(in) :: at_start     !! and its system, assembled there
      type(control_t), intent(in) :: control     !! what is held
      integer, intent(in) :: ends(:)             !! touchdown points whose places count, see contact_places
      real(wp), intent(in) :: modes(:, :)        !! (n, multiplicity) bifurcation: null vectors, else none. Nothing that counts
      !! is along them, but rounding over a vanishing eigenvalue
      type(contributions_t), intent(out) :: shares
      real(wp), allocatable, intent(in), optional :: watched(:, :) !! (3, nodes) another displacement's derivatives, global axes
      type(functional_t) :: number(2 + size(problem%model%monitor) + size(ends)) ! the last one: watched
      type(inside_t) :: inside, held
      real(wp) :: way(size(ends)), kink(problem%model%mesh%n_elements)
      real(wp), dimension(6, problem%model%mesh%n_elements) :: force, dual
      real(wp) :: moved(2, problem%model%mesh%n_elements) ! sizes of displacements and chord, of rotations
      real(wp) :: w(system%n), of_load(system%n), tangent(system%n), answers(system%n, size(number)), &
         & push(system%n), known(system%n), share(problem%model%mesh%n_elements), along, along_load, rest, change, corner, defect
      real(wp) :: row(3, size(state%u, 2))
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
      call held_row(problem, control, state, system, row, corner, defect)
      call list_numbers()
      tangent = system%tangent
      call leave_out(problem, modes, direction, tangent)
      known = merge(system%rate, 0.0_wp, system%fixed)
      push = path_load(system, known)
      along = dot_product(number(1)%by_unknown, tangent) + corner
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
         ! What Newton's method has left is not the elements'.
         rest = rest + dot_product(w, merge(0.0_wp, system%residual, system%fixed))
         share = shares_by(dual)
         shares%known(m) = .true.
         shares%element(m, :) = abs(share)
         ! A monitor that is held is held at its own value: where it stands between the nodes finer polynomials have another one
         ! there, and all numbers go along with what makes up for that.
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
            if (watches_stops(problem, m - 1)) then
               rest = rest + stop_force_defect(problem, state, system, m - 1)
            else if (problem%deck%monitor(m - 1)%quantity == quantity_contact) then
               ! Ends of spans carry it: what nodes are known to, not polynomials between them.
               rest = rest + contact_sum_defect(problem, state, system, m - 1)
            end if
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

      !> All numbers, and what the structure answers to each: that of the load factor to the row of what is held.
      subroutine list_numbers()
         real(wp), dimension(system%n, size(ends)) :: by_unknown
         real(wp) :: by_load(size(ends))
         integer :: last
         number(1)%known = .true.
         number(1)%by_unknown = unknowns_of(problem, system, row)
         do m = 1, size(problem%model%monitor)
            call new_functional(problem, state, system, m, number(m + 1))
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

      !> What a monitor errs by inside its elements is theirs, in all numbers that hang on it.
      subroutine share_inside(row, inside, rate)
         integer, intent(in) :: row               !! the number
         type(inside_t), intent(in) :: inside
         real(wp), intent(in) :: rate             !! of the number with the monitor
         integer :: i
         if (.not. allocated(inside%element)) return
         shares%inside(row) = shares%inside(row) + rate * inside%most
         do i = 1, size(inside%element)
            associate (share => shares%element(row, inside%element(i)))
               share = share + rate * inside%most / size(inside%element)
            end associate
         end do
      end subroutine share_inside

      !> The part of forces that free unknowns answer, and not along null vectors.
      function free_force(force) result(free)
         real(wp), intent(in) :: force(:)
         real(wp) :: free(size(force))
         free = merge(0.0_wp, free_of(problem, modes, merge(0.0_wp, force, system%fixed)), system%fixed)
      end function free_force

      !> The curvature that kinks make inside elements works on the dual moments there, at the most those of their ends.
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

      !> The dual displacements of a number, what is held included. At a limit point both parts are without bounds, and rounding
      !> leaves little of their difference: there it is refined by what it leaves of the equations and of the load.
      subroutine combine(functional, answer)
         type(functional_t), intent(in) :: functional
         real(wp), intent(in) :: answer(:)        !! (n) displacements by it
         real(wp) :: lost, given, of_path, left(system%n), more(system%n)
         along_load = dot_product(functional%by_unknown, tangent) + functional%by_load
         given = functional%by_load + dot_product(functional%by_unknown, known)
         lost = sqrt(epsilon(lost)) * maxval(abs(answer))
         w = along_load * of_load - answer
         of_path = along_load / along
         w = w + (given - dot_product(push, w) - of_path * corner) * of_load
         ! The band alone is not all of a stiffness that ground adds to.
         if (maxval(abs(w)) > lost .or. system%coupling%n > 0) return
         call band_times(system%k, w, left)
         left = free_force(of_path * number(1)%by_unknown - functional%by_unknown - left)
         call solve_effective(system, left, more)
         call leave_out(problem, modes, direction, more)
         w = w + more + (given - dot_product(push, w + more) - of_path * corner) * of_load
      end subroutine combine

      !> Force on a null vector. What finer elements make of it may err by all of their shares, and the directions of the
      !> elements' forces are rounded.
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

      !> What the elements contribute, by the work of what is out of balance on their nodes' dual displacements.
      function shares_by(dual) result(by)
         real(wp), intent(in) :: dual(:, :)       !! (6, elements)
         real(wp) :: by(problem%model%mesh%n_elements)
         by = sum(dual * force, dim=1)
      end function shares_by

      !> The unknowns of all elements' nodes.
      function nodal_all(x) result(local)
         real(wp), intent(in) :: x(:)
         real(wp) :: local(6, problem%model%mesh%n_elements)
         integer :: e
         do e = 1, size(local, 2)
            local(:, e) = nodal(problem, system, x, e)
         end do
      end function nodal_all

      !> Rounding of displacements, chords and resultants of all elements, weighed as their errors are.
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

   !> The unknowns of an element's nodes.
   pure function nodal(problem, system, x, e) result(local)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: e
      real(wp) :: local(6)
      integer :: i
      do i = 1, 2
         local(3 * i - 2:3 * i) = node_unknowns(problem, system%tie_block, problem%model%mesh%node(i, e), x)
      end do
   end function nodal

   !> Sizes of what the elements contribute to the error of an eigenvalue, the state held: what the finer ones make of its modes'
   !> deformations. How they compare is what counts; of order 2 and 4 they are too large, see above.
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

   !> The forces on the free unknowns that go with a unit of the load factor, those of moving supports included.
   function path_load(system, known) result(force)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: known(:)           !! (n) what the fixed unknowns go by
      real(wp) :: force(system%n)
      force = 0.0_wp
      if (any(abs(known) > 0.0_wp)) call band_times(system%k, known, force)
      force = merge(0.0_wp, system%load - force, system%fixed)
   end function path_load

   !> Forces of an element on its nodes that are out of balance by what the finer element says of it. Node axes. Of either end the
   !> same, so that it does not matter where an element begins.
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

      !> What one end would have to move by, the other one held, gives the finer element its forces there.
      subroutine by_displacement(held, moved, forces, singular)
         integer, intent(in) :: held, moved      !! rows before those of the end
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

   !> A monitor: displacements of nodes, reactions of supports and springs.
   subroutine new_functional(problem, state, system, m, functional)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: m                   !! index into model%monitor
      type(functional_t), intent(out) :: functional
      type(monitor_row_t) :: row
      real(wp) :: along(3), spring(system%n)
      integer :: i, d, node
      associate (monitor => problem%deck%monitor(m))
         functional%known = .true.
         if (monitor%quantity == quantity_displacement) then
            call monitor_row(problem, state, system, m, row)
            functional%by_load = row%load
            functional%by_unknown = unknowns_of(problem, system, row%node)
            return
         end if
         allocate (functional%by_unknown(system%n), functional%by_force(system%n), source=0.0_wp)
         allocate (functional%by_element(6, problem%model%mesh%n_elements), source=0.0_wp)
         if (watches_stops(problem, m)) then
            call stop_force_gradient(problem, state, system, m, spring, functional%by_load, functional%by_force)
            call through_equations()
            return
         else if (monitor%quantity == quantity_contact) then
            functional%known = contact_sum_known(problem, state, m)
            if (.not. functional%known) return
            call contact_sum_gradient(problem, state, system, m, functional%by_unknown, functional%by_load, functional%by_force, &
               & functional%by_element)
            return
         end if
         ! The reaction of a support is what is out of balance there; that of a spring is its displacement's.
         spring = 0.0_wp
         do i = 1, size(monitor%node)
            node = problem%mesh_node(monitor%node(i))
            if (node == 0) cycle
            d = dof(problem, node, 1)
            along = 0.0_wp
            along(monitor%component) = monitor%factor
            call to_node(system, node, along)
            if (problem%model%fixed(monitor%component, node)) then
               functional%by_force(d:d + 2) = functional%by_force(d:d + 2) + along
            else
               spring(d:d + 2) = spring(d:d + 2) - problem%spring(monitor%component, node) * along
            end if
         end do
         call through_equations()
      end associate

   contains

      !> What is out of balance is the unknowns', the load's and the elements'.
      subroutine through_equations()
         integer :: e
         call band_times(system%k, functional%by_force, functional%by_unknown)
         functional%by_unknown = functional%by_unknown + spring
         functional%by_load = functional%by_load - dot_product(functional%by_force, system%load)
         do e = 1, problem%model%mesh%n_elements
            functional%by_element(:, e) = nodal(problem, system, functional%by_force, e)
         end do
      end subroutine through_equations
   end subroutine new_functional

   !> True for a monitor of the force of stops.
   pure logical function watches_stops(problem, m)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                   !! index into model%monitor
      associate (monitor => problem%deck%monitor(m))
         watches_stops = monitor%quantity == quantity_contact
         if (watches_stops) watches_stops = problem%model%obstacle(monitor%obstacle)%at_nodes
      end associate
   end function watches_stops
end module error_contributions
