!> Contact at nodes: gap and reaction of a candidate as functionals, and the sum of an obstacle's reactions at nodes.
!>
!> A rigid obstacle in contact eliminates an unknown of the node. Its reaction is the unbalanced force on this unknown, like the
!> reaction of a support. The reaction of a foundation at nodes, or of an elastic stop, follows from its force law, like the force
!> of a spring. On coupled ground each reaction depends on all gaps. None of these reactions depends on the polynomials inside
!> elements and their errors.
module node_contact_functional
   use kinds, only: wp
   use problem, only: problem_t
   use obstacle_pose, only: about_pivot
   use rod_state, only: state_t
   use tied_nodes, only: spread_force
   use linear_system, only: system_t, to_node, reaction_weights
   use state_functional, only: functional_t, new_functional
   use reaction_functional, only: add_held_forces
   use contact_lcp, only: gap_change, reaction_change
   implicit none
   private
   public :: is_stop, gap_rate, reaction_rate, acts_at_nodes, holds_node, reaction_total, new_reactions_functional

contains

   !> True if a candidate is a stop at a node that the deck names; such a node exists on every mesh.
   pure elemental logical function is_stop(problem, c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: c                   !! candidate
      is_stop = problem%model%obstacle(problem%candidates%obstacle(c))%at_nodes
   end function is_stop

   !> Change of a candidate's gap as a functional, or on coupled ground the change of its opening (gap plus settlement of the
   !> ground). The value of the functional is not set.
   pure type(functional_t) function new_gap_functional(problem, system, candidate) result(number)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled
      integer, intent(in) :: candidate
      real(wp), allocatable :: share(:)
      integer :: i
      number = new_functional(system%n)
      call add_gap(problem, system, candidate, 1.0_wp, number)
      if (system%coupling%n == 0 .or. problem%coupling%entry(candidate) == 0) return
      share = matmul(problem%coupling%compliance(system%coupling%entry, problem%coupling%entry(candidate)), &
         & system%coupling%stiffness)
      do i = 1, system%coupling%n
         call add_gap(problem, system, system%coupling%candidate(i), -share(i), number)
      end do
   end function new_gap_functional

   !> Reaction of an active candidate as a functional.
   pure type(functional_t) function new_contact_force_functional(problem, state, system, candidate) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: candidate
      number = new_functional(system%n)
      allocate (number%by_force(system%n), source=0.0_wp)
      call add_reaction(problem, state, system, candidate, 1.0_wp, number)
      call add_held_forces(system, number)
   end function new_contact_force_functional

   !> Derivative of a candidate's gap along the path with respect to the load factor. On coupled ground it is the derivative of the
   !> opening (gap plus settlement).
   pure real(wp) function gap_rate(problem, system, candidate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! factored
      integer, intent(in) :: candidate
      type(functional_t) :: number
      ! Unless the ground couples the candidates, the derivative depends on the unknowns of one node only, and is computed from
      ! these. For all candidates together this takes a number of operations proportional to the size of the mesh.
      if (problem%coupling%entry(candidate) == 0) then
         gap_rate = gap_change(problem, system, candidate, system%tangent, 1.0_wp)
      else
         number = new_gap_functional(problem, system, candidate)
         gap_rate = number%change(system%tangent, 1.0_wp)
      end if
   end function gap_rate

   !> Derivative of an active candidate's reaction along the path with respect to the load factor.
   pure real(wp) function reaction_rate(problem, state, system, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      integer, intent(in) :: candidate
      type(functional_t) :: number
      if (system%unknown(candidate) > 0) then
         reaction_rate = reaction_change(system, candidate, system%tangent, 1.0_wp)
      else if (problem%coupling%entry(candidate) == 0) then
         reaction_rate = -system%spring(candidate) * gap_rate(problem, system, candidate)
      else
         number = new_contact_force_functional(problem, state, system, candidate)
         reaction_rate = number%change(system%tangent, 1.0_wp)
      end if
   end function reaction_rate

   !> (candidates) true for active candidates of an obstacle that belong to no contact span.
   pure function acts_at_nodes(problem, state, obstacle) result(acts)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: obstacle
      logical :: acts(problem%candidates%n)
      acts = problem%candidates%obstacle(:size(acts)) == obstacle .and. problem%candidates%contact_span(:size(acts)) == 0 .and. &
         & state%active(:size(acts))
   end function acts_at_nodes

   !> (candidates) true for rigid contacts that act on a node. If a support also holds a component of this node, the unbalanced
   !> force on the node is the sum of support reaction and contact force.
   pure function holds_node(problem, system, node) result(holds)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled
      integer, intent(in) :: node
      logical :: holds(problem%candidates%n)
      holds = problem%candidates%node(:size(holds)) == node .and. system%unknown(:size(holds)) > 0
   end function holds_node

   !> Sum of the reactions of several candidates: one component of the forces, or the sum of the normal forces.
   pure real(wp) function reaction_total(state, system, counts, component) result(total)
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      logical, intent(in) :: counts(:)           !! (candidates) true: the reaction is in the sum
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      integer :: c
      total = 0.0_wp
      do c = 1, size(counts)
         if (counts(c)) total = total + state%reaction(c) * along_component(system, c, component)
      end do
   end function reaction_total

   !> reaction_total with its linearisation. A reaction changes its direction when the node moves along a curved obstacle or the
   !> obstacle moves.
   pure type(functional_t) function new_reactions_functional(problem, state, system, counts, component) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      logical, intent(in) :: counts(:)           !! (candidates) true: the reaction is in the sum
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      real(wp) :: along(2), turning
      integer :: c
      number = new_functional(system%n)
      allocate (number%by_force(system%n), source=0.0_wp)
      do c = 1, size(counts)
         if (.not. counts(c)) cycle
         call add_reaction(problem, state, system, c, along_component(system, c, component), number)
         along = [system%normal(2, c), -system%normal(1, c)]
         turning = 0.0_wp
         if (component < 3) turning = state%reaction(c) * system%bend(c) * along(component)
         if (abs(turning) > 0.0_wp) call add_motion(problem, system, c, turning * along, number)
      end do
      call add_held_forces(system, number)
   end function new_reactions_functional

   !> Factor of a candidate's reaction in the sum: the component of its unit normal in global axes; 1 for component 3, the normal
   !> force.
   pure real(wp) function along_component(system, candidate, component) result(share)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate, component
      share = 1.0_wp
      if (component < 3) share = system%normal(component, candidate)
   end function along_component

   !> Adds a multiple of an active candidate's reaction to a functional. If the contact eliminates an unknown, the reaction is the
   !> residual of the equation of this unknown and enters `by_force` only.
   pure subroutine add_reaction(problem, state, system, candidate, factor, number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: factor
      type(functional_t), intent(inout) :: number
      integer :: i, k
      number%value = number%value + factor * state%reaction(candidate)
      if (system%unknown(candidate) > 0) then
         call reaction_weights(system, candidate, factor, number%by_force)
      else if (problem%coupling%entry(candidate) > 0) then
         k = findloc(system%coupling%candidate, candidate, 1)
         do i = 1, system%coupling%n
            call add_gap(problem, system, system%coupling%candidate(i), -factor * system%coupling%stiffness(i, k), number)
         end do
      else if (system%soft(candidate)) then
         call add_gap(problem, system, candidate, -factor * system%spring(candidate), number)
         number%defect = number%defect + factor * (system%push(candidate) - state%reaction(candidate))
      end if
   end subroutine add_reaction

   !> Adds a multiple of a candidate's gap to the derivatives of a functional; its value is not changed.
   pure subroutine add_gap(problem, system, candidate, factor, number)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: factor
      type(functional_t), intent(inout) :: number
      call add_motion(problem, system, candidate, factor * system%normal(:, candidate), number)
      number%by_load = number%by_load - factor * system%closing(candidate)
   end subroutine add_gap

   !> Adds to the derivatives of a functional those of the displacement of a candidate's node relative to its obstacle, times a
   !> vector.
   pure subroutine add_motion(problem, system, candidate, direction, number)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: direction(2)       !! the vector, global axes
      type(functional_t), intent(inout) :: number
      real(wp) :: along(3)
      along = [direction, 0.0_wp]
      call to_node(system, problem%candidates%node(candidate), along)
      call spread_force(problem, system%tie_block, problem%candidates%node(candidate), along, number%by_unknown)
      number%by_load = number%by_load - dot_product(direction, system%motion(:, candidate))
      associate (carrier => problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier)
         if (carrier > 0) call spread_force(problem, system%tie_block, carrier, -about_pivot(system%arm(:, candidate), direction), &
            & number%by_unknown)
      end associate
   end subroutine add_motion
end module node_contact_functional
