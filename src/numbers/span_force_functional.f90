!> Sum of an obstacle's forces on contact spans as a functional.
!>
!> The sum consists of forces in elements beside touchdown points and along line contacts, and of reactions at segment boundaries.
!> Along a line contact the pressure is balanced by the section forces at the two ends of the line contact: only these forces enter
!> the sum, not the polynomials between nodes.
module span_force_functional
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap
   use linear_system, only: system_t, to_node
   use bordered_system, only: apply_increment
   use node_axes, only: element_unknowns
   use span_forces, only: span_totals
   use tangent_step, only: states_along
   use state_functional, only: functional_t
   use local_differences, only: local_number_t, linearised
   use reaction_functional, only: add_held_forces
   implicit none
   private
   public :: span_force_sum, span_force_rate, new_span_force_functional

   !> Sum of an obstacle's forces on contact spans as a number of the state.
   type, extends(local_number_t) :: span_sum_t
      integer :: obstacle = 0
      integer :: component = 0                   !! 1: force in x, 2: force in y, 3: sum of normal forces
   contains
      procedure :: value => sum_of_state
   end type span_sum_t

contains

   !> Sum of an obstacle's forces on contact spans: one component, or the sum of the normal forces.
   real(wp) function span_force_sum(problem, state, obstacle, component) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      real(wp) :: pushed(3, size(problem%model%contact), size(problem%model%obstacle)), moment(size(problem%model%obstacle))
      real(wp) :: push(problem%candidates%n)
      call span_totals(problem, state, [0.0_wp, 0.0_wp], pushed, moment, push)
      total = sum(pushed(component, :, obstacle))
   end function span_force_sum

   !> Derivative of span_force_sum along the path with respect to the load factor, as one difference along the path tangent. The
   !> derivatives of the functional by single unknowns are finite differences, too, but cannot be used here: for stiff rods they may
   !> be 10,000 times the derivative along the path, with errors as large as this derivative.
   real(wp) function span_force_rate(problem, state, system, obstacle, component) result(rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      type(state_t) :: here, ahead
      real(wp) :: step
      call states_along(problem, system, state, 1.0_wp, here, ahead, step, sqrt(epsilon(step)))
      rate = (span_force_sum(problem, ahead, obstacle, component) - span_force_sum(problem, here, obstacle, component)) / step
   end function span_force_rate

   !> Value of the sum at a state.
   real(wp) function sum_of_state(self, problem, state) result(total)
      class(span_sum_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      total = span_force_sum(problem, state, self%obstacle, self%component)
   end function sum_of_state

   !> Linearisation of span_force_sum. The reaction at a segment boundary is the unbalanced force on the unknown that its contact
   !> eliminates.
   function new_span_force_functional(problem, state, system, obstacle, component) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: obstacle
      integer, intent(in) :: component           !! 1: force in x, 2: force in y, 3: sum of normal forces
      type(functional_t) :: number
      type(span_sum_t) :: forces
      type(state_t) :: pushed
      real(wp) :: none(system%n), step
      integer :: c, e
      forces = span_sum_t(element=elements_beside(problem, obstacle), obstacle=obstacle, component=component)
      number = linearised(problem, state, system, forces)
      allocate (number%by_force(system%n), source=0.0_wp)
      pushed = state
      none = 0.0_wp
      call apply_increment(problem, system, none, 0.0_wp, pushed)
      step = max(system%force_scale, tiny(step))
      do c = 1, problem%candidates%n
         if (.not. counts(problem, obstacle, c) .or. system%unknown(c) == 0) cycle
         associate (d => system%unknown(c))
            pushed%reaction(c) = state%reaction(c) + step
            number%by_force(d) = number%by_force(d) + (forces%value(problem, pushed) - number%value - number%defect) / &
               & (step * system%slope(c))
            pushed%reaction(c) = state%reaction(c)
         end associate
      end do
      call add_held_forces(system, number)
      allocate (number%by_element(6, problem%model%mesh%n_elements), source=0.0_wp)
      do e = 1, problem%model%mesh%n_elements
         call set_own_part(problem, state, system, forces, e, number)
      end do
   end function new_span_force_functional

   !> True if a candidate is a node of one of the obstacle's contact spans.
   pure logical function counts(problem, obstacle, c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: obstacle, c
      counts = problem%candidates%contact_span(c) > 0 .and. problem%candidates%obstacle(c) == obstacle
   end function counts

   !> Elements beside the nodes of the obstacle's contact spans.
   pure function elements_beside(problem, obstacle) result(element)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: obstacle
      integer, allocatable :: element(:)
      logical :: beside(problem%model%mesh%n_elements)
      integer :: c, side, e
      beside = .false.
      do c = 1, problem%candidates%n
         if (.not. counts(problem, obstacle, c)) cycle
         do side = 1, 2
            e = problem%beside(side, problem%candidates%node(c))
            if (e > 0) beside(e) = .true.
         end do
      end do
      element = pack([(e, e=1, size(beside))], beside)
   end function elements_beside

   !> Sets the derivatives of the sum by the end forces of an element at constant unknowns. Two kinds of end forces contribute:
   !> those of free elements at touchdown points, and those of conforming elements at contact nodes that do not move. All other
   !> section forces cancel.
   subroutine set_own_part(problem, state, system, forces, e, number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(span_sum_t), intent(in) :: forces
      integer, intent(in) :: e
      type(functional_t), intent(inout) :: number
      integer :: i, c
      associate (list => problem%candidates, own => number%by_element(:, e))
         ! `by_force` multiplies the forces of all elements on the fixed unknowns. The forces of a conforming element on its own
         ! nodes are no part of the contact forces in the sum and are subtracted.
         if (problem%conforms(e) > 0) own = -element_unknowns(problem, system, number%by_force, e)
         do c = 1, list%n
            if (.not. counts(problem, forces%obstacle, c)) cycle
            i = findloc(problem%model%mesh%node(:, e), list%node(c), 1)
            if (i == 0) cycle
            associate (part => own(3 * i - 2:3 * i))
               if (problem%conforms(e) == 0 .and. list%moves(c)) part = part + shift(problem, state, system, forces%component, c)
               if (problem%conforms(e) > 0 .and. .not. list%moves(c)) part = part - &
                  & shift(problem, state, system, forces%component, c)
            end associate
         end do
      end associate
   end subroutine set_own_part

   !> Weights of an element's end force at a contact node, in node axes: their product with the force is the contribution to the
   !> sum.
   function shift(problem, state, system, component, c) result(along)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: component
      integer, intent(in) :: c                   !! candidate
      real(wp) :: along(3), normal(2), gap, bend
      along = 0.0_wp
      associate (node => problem%candidates%node(c))
         if (component < 3) then
            along(component) = 1.0_wp
         else
            ! For a line contact the sum of the normal forces does not follow from the section forces at its ends.
            if (.not. problem%candidates%moves(c)) return
            call candidate_gap(problem, state, c, gap, normal, bend)
            along(1:2) = normal
         end if
         call to_node(system, node, along)
         if (system%turned(node)) along(3) = -system%roll(node) * along(1)
         along(2) = along(2) - system%lean(node) * along(3)
      end associate
   end function shift
end module span_force_functional
