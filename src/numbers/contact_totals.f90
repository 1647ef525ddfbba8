!> Sums of the contact forces on contact spans, as functions of the unknowns.
!>
!> Each sum consists of forces in elements beside touchdown points and along line contacts, and of reactions at segment boundaries.
!> Its derivatives are differences, taken with the touchdown points fixed, as in the equations. The pressure along a line contact
!> cancels except for the section forces at both ends of the line: only these element end forces enter the sum.
module contact_totals
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t, candidate_gap
   use linear_system, only: system_t, to_node
   use bordered_system, only: apply_increment
   use band_matrix, only: band_times
   use span_forces, only: span_totals
   implicit none
   private
   public :: contact_sum_known, contact_sum_defect, contact_sum_gradient

contains

   !> True if the monitor contains forces of contact spans only.
   pure logical function contact_sum_known(problem, state, m) result(known)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m                   !! index into model%monitor, of a contact force
      known = problem%has_spans()
      if (.not. known) return
      associate (o => problem%deck%monitor(m)%obstacle, list => problem%candidates)
         known = .not. any(list%obstacle == o .and. list%contact_span == 0 .and. state%active) .and. &
            & .not. any(problem%ground%chain%obstacle == o)
      end associate
   end function contact_sum_known

   !> Change of the sum due to eliminating the internal residuals of the elements.
   real(wp) function contact_sum_defect(problem, state, system, m) result(defect)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m
      real(wp) :: none(system%n)
      none = 0.0_wp
      defect = sum_after(problem, state, system, m, none, 0.0_wp) - stored_sum(problem, state, m)
   end function contact_sum_defect

   !> Derivatives of the sum by the unknowns, the load factor, the unbalanced forces at nodes fixed by contact, and the end forces
   !> of elements with fixed unknowns. Node axes.
   subroutine contact_sum_gradient(problem, state, system, m, by_unknown, by_load, by_force, by_element)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m
      real(wp), intent(out) :: by_unknown(:), by_force(:) !! (n)
      real(wp), intent(out) :: by_element(:, :)  !! (6, elements)
      real(wp), intent(out) :: by_load
      type(state_t) :: pushed
      real(wp) :: x(system%n), none(system%n), base, step, size_step
      logical :: near(problem%model%mesh%n_nodes)
      integer :: c, side, e, node, i, d
      x = 0.0_wp
      base = sum_after(problem, state, system, m, x, 0.0_wp)
      near = .false.
      associate (list => problem%candidates)
         do c = 1, list%n
            if (list%contact_span(c) == 0) cycle
            do side = 1, 2
               e = problem%beside(side, list%node(c))
               if (e > 0) near(problem%model%mesh%node(:, e)) = .true.
            end do
         end do
         size_step = sqrt(epsilon(step))
         by_unknown = 0.0_wp
         by_force = 0.0_wp
         x = 0.0_wp
         do node = 1, size(near)
            if (.not. near(node)) cycle
            do i = 1, 3
               d = dof(problem, node, i)
               if (system%fixed(d)) cycle
               step = size_step * merge(1.0_wp, problem%size, i == 3)
               x(d) = step
               by_unknown(d) = (sum_after(problem, state, system, m, x, 0.0_wp) - base) / step
               x(d) = 0.0_wp
            end do
         end do
         step = size_step * max(abs(state%load_factor), 1.0_wp)
         by_load = (sum_after(problem, state, system, m, x, step) - base) / step
         ! Reactions at fixed segment boundaries: unbalanced forces on their own unknowns.
         none = 0.0_wp
         do c = 1, list%n
            if (list%contact_span(c) == 0 .or. system%unknown(c) == 0) cycle
            pushed = state
            step = max(system%force_scale, tiny(step))
            pushed%reaction(c) = pushed%reaction(c) + step
            d = system%unknown(c)
            by_force(d) = by_force(d) + (sum_after(problem, pushed, system, m, none, 0.0_wp) - base) / (step * system%slope(c))
         end do
      end associate
      do e = 1, problem%model%mesh%n_elements
         call set_own_part(e)
      end do
      call band_times(system%k, by_force, x)
      by_unknown = by_unknown + x
      by_load = by_load - dot_product(by_force, system%load)

   contains

      !> Contribution of an element's end forces to the sum, with fixed unknowns. All section forces cancel except those of free
      !> elements beside touchdown points, and those of conforming elements at the other ends of their line contact.
      subroutine set_own_part(e)
         integer, intent(in) :: e
         integer :: i, d, c
         associate (list => problem%candidates, own => by_element(:, e))
            own = 0.0_wp
            do i = 1, 2
               associate (node => problem%model%mesh%node(i, e), part => own(3 * i - 2:3 * i))
                  d = dof(problem, node, 1)
                  if (problem%conforms(e) == 0) part = by_force(d:d + 2)
                  do c = 1, list%n
                     if (list%contact_span(c) == 0 .or. list%node(c) /= node) cycle
                     if (list%obstacle(c) /= problem%deck%monitor(m)%obstacle) cycle
                     if (problem%conforms(e) == 0 .and. list%moves(c)) part = part + shift(c)
                     if (problem%conforms(e) > 0 .and. .not. list%moves(c)) part = part - shift(c)
                  end do
               end associate
            end do
         end associate
      end subroutine set_own_part

      !> Displacement of a contact node whose work with a force on the node is the contribution of this force to the monitor. Node
      !> axes; the rotation of the node is zero.
      function shift(c) result(along)
         integer, intent(in) :: c
         real(wp) :: along(3), normal(2), gap, bend
         along = 0.0_wp
         associate (monitor => problem%deck%monitor(m), node => problem%candidates%node(c))
            if (monitor%component < 3) then
               along(monitor%component) = monitor%factor
            else
               ! The sum of pressures along a line contact is not that of the section forces at its ends.
               if (.not. problem%candidates%moves(c)) return
               call candidate_gap(problem, state, c, gap, normal, bend)
               along(1:2) = monitor%factor * normal
            end if
            call to_node(system, node, along)
            if (system%turned(node)) along(3) = -system%roll(node) * along(1)
            along(2) = along(2) - system%lean(node) * along(3)
         end associate
      end function shift
   end subroutine contact_sum_gradient

   !> The monitor's sum from the forces stored in the state.
   real(wp) function stored_sum(problem, state, m) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m
      real(wp) :: pushed(3, size(problem%model%contact)), moment
      call span_totals(problem, state, [0.0_wp, 0.0_wp], pushed, moment)
      associate (monitor => problem%deck%monitor(m))
         value = monitor%factor * sum(pushed(monitor%component, :), mask=problem%model%contact%obstacle == monitor%obstacle)
      end associate
   end function stored_sum

   !> The monitor's sum after an increment of the unknowns and of the load factor.
   function sum_after(problem, state, system, m, x, y) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: m
      real(wp), intent(in) :: x(:), y
      real(wp) :: value
      type(state_t) :: moved
      moved = state
      call apply_increment(problem, system, x, y, moved)
      value = stored_sum(problem, moved, m)
   end function sum_after
end module contact_totals
