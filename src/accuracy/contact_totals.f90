!> Sums of the forces that obstacles push contact spans with, as functions of the unknowns.
!>
!> They are made of the forces in elements beside touchdown points and along lines, and of reactions at breakpoints of the rod:
!> the derivatives are differences, taken with the touchdown points held, as they are in the equations.
module contact_totals
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: apply_increment
   use band_matrix, only: band_times
   use span_forces, only: span_totals
   implicit none
   private
   public :: contact_sum, contact_sum_known, contact_sum_gradient

contains

   !> True for a monitor of contact spans alone.
   pure logical function contact_sum_known(problem, state, m) result(known)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m                   !! index into model%monitor, of a contact force
      known = problem%has_spans()
      if (.not. known) return
      associate (o => problem%deck%monitor(m)%obstacle, list => problem%candidates)
         known = .not. any(list%obstacle == o .and. list%touch == 0 .and. state%active) .and. &
            & .not. any(problem%ground%chain%obstacle == o)
      end associate
   end function contact_sum_known

   !> The monitor's sum after the elements have closed their own defects.
   function contact_sum(problem, state, system, m) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m
      real(wp) :: value
      real(wp) :: none(system%n)
      none = 0.0_wp
      value = sum_after(problem, state, system, m, none, 0.0_wp)
   end function contact_sum

   !> Derivatives of the sum by the unknowns, the load factor and what is out of balance where contact holds a node. Node axes.
   subroutine contact_sum_gradient(problem, state, system, m, by_unknown, by_load, by_force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: m
      real(wp), intent(out) :: by_unknown(:), by_force(:) !! (n)
      real(wp), intent(out) :: by_load
      type(state_t) :: pushed
      real(wp) :: x(system%n), base, step, size_step
      logical :: near(problem%model%mesh%n_nodes)
      integer :: c, side, e, node, i, d
      base = contact_sum(problem, state, system, m)
      near = .false.
      associate (list => problem%candidates)
         do c = 1, list%n
            if (list%touch(c) == 0) cycle
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
         ! Reactions where a breakpoint is held: what is out of balance on their own unknowns.
         do c = 1, list%n
            if (list%touch(c) == 0 .or. system%unknown(c) == 0) cycle
            pushed = state
            step = max(system%force_scale, tiny(step))
            pushed%reaction(c) = pushed%reaction(c) + step
            by_force(system%unknown(c)) = by_force(system%unknown(c)) + (contact_sum(problem, pushed, system, m) - base) / &
               & (step * system%slope(c))
         end do
      end associate
      call band_times(system%k, by_force, x)
      by_unknown = by_unknown + x
      by_load = by_load - dot_product(by_force, system%load)
   end subroutine contact_sum_gradient

   !> The monitor's sum after an increment of the unknowns and of the load factor.
   function sum_after(problem, state, system, m, x, y) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: m
      real(wp), intent(in) :: x(:), y
      real(wp) :: value
      type(state_t) :: moved
      real(wp) :: pushed(3, size(problem%model%contact)), moment
      moved = state
      call apply_increment(problem, system, x, y, moved)
      call span_totals(problem, moved, [0.0_wp, 0.0_wp], pushed, moment)
      associate (monitor => problem%deck%monitor(m))
         value = monitor%factor * sum(pushed(monitor%component, :), mask=problem%model%contact%obstacle == monitor%obstacle)
      end associate
   end function sum_after
end module contact_totals
