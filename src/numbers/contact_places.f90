!> Positions of touchdown points along their rods, as functions of the unknowns, for their error estimates.
!>
!> A touchdown point lies where the moment does not jump, or where a point contact has the obstacle's direction (touchdown_points).
!> The derivatives of its position are differences of this condition, taken with the touchdown points fixed, as in the equations. A
!> point contact at a segment boundary keeps its node; its force moves beside the node (rolling contact).
module contact_places
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: apply_increment
   use conforming_span, only: rolled_t, rolled
   use touchdown_points, only: touchdown_steps, touchdown_slopes
   use span_regions, only: chain_coordinate
   use error_bar, only: place_bar_t
   implicit none
   private
   public :: moving_ends, places_at, places_after, place_gradients, moment_places, named_place

contains

   !> Candidates that are touchdown points and move along the rod, or roll beside their node.
   pure function moving_ends(problem) result(ends)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: ends(:)
      integer :: c
      ends = pack([(c, c=1, problem%candidates%n)], [(problem%candidates%contact_span(c) > 0 .and. (problem%candidates%moves(c) &
         & .or. problem%candidates%rolls(c)), c=1, problem%candidates%n)])
   end function moving_ends

   !> Stress-free arc lengths of touchdown points along the chains of their contacts.
   function places_at(problem, state, ends) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: ends(:)             !! candidates, see moving_ends
      real(wp) :: at(size(ends))
      type(rolled_t) :: roll
      integer :: k
      do k = 1, size(ends)
         roll = rolled(problem, state, ends(k))
         at(k) = chain_coordinate(problem, state, ends(k), merge(1, 2, is_last(problem, ends(k)))) + roll%way
      end do
   end function places_at

   !> Positions in a state `after` that is close to `before` and has the same nodes.
   function places_after(problem, before, after, ends) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before, after
      integer, intent(in) :: ends(:)
      real(wp) :: at(size(ends)), way(problem%candidates%n)
      at = places_at(problem, after, ends)
      if (size(ends) == 0) return
      way = touchdown_steps(problem, before, after)
      at = at + way(ends)
   end function places_after

   !> Derivatives of the positions by the unknowns (node axes) and the load factor.
   subroutine place_gradients(problem, state, system, ends, by_unknown, by_load)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: ends(:)
      real(wp), intent(out) :: by_unknown(:, :)  !! (n, places)
      real(wp), intent(out) :: by_load(:)        !! (places)
      real(wp) :: x(system%n), base(size(ends)), step, size_step
      logical :: near(problem%model%mesh%n_nodes)
      integer :: node, i, d, side, k, e
      near = .false.
      do k = 1, size(ends)
         do side = 1, 2
            e = problem%candidates%element(side, ends(k))
            if (e > 0) near(problem%model%mesh%node(:, e)) = .true.
         end do
      end do
      by_unknown = 0.0_wp
      x = 0.0_wp
      base = places_moved(0.0_wp)
      size_step = sqrt(epsilon(step))
      do node = 1, size(near)
         if (.not. near(node)) cycle
         do i = 1, 3
            d = dof(problem, node, i)
            if (system%fixed(d)) cycle
            step = size_step * merge(1.0_wp, problem%size, i == 3)
            x(d) = step
            by_unknown(d, :) = (places_moved(0.0_wp) - base) / step
            x(d) = 0.0_wp
         end do
      end do
      step = size_step * max(abs(state%load_factor), 1.0_wp)
      by_load = (places_moved(step) - base) / step

   contains

      function places_moved(y) result(at)
         real(wp), intent(in) :: y               !! change of the load factor; x: change of the unknowns
         real(wp) :: at(size(ends))
         type(state_t) :: moved
         moved = state
         call apply_increment(problem, system, x, y, moved)
         at = places_after(problem, state, moved, ends)
      end function places_moved
   end subroutine place_gradients

   !> Distances by which the ends of line contacts move if unbalanced moments act on both sides of these ends.
   function moment_places(problem, state, force, ends) result(way)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: force(:, :)        !! (6, elements) forces and moments of the elements on their nodes
      integer, intent(in) :: ends(:)
      real(wp) :: way(size(ends)), slope(problem%candidates%n), jump
      integer :: k
      slope = touchdown_slopes(problem, state)
      way = 0.0_wp
      do k = 1, size(ends)
         associate (c => ends(k), list => problem%candidates)
            if (.not. abs(slope(c)) > 0.0_wp) cycle
            jump = 0.0_wp
            if (list%element(1, c) > 0) jump = jump + force(6, list%element(1, c))
            if (list%element(2, c) > 0) jump = jump + force(3, list%element(2, c))
            way(k) = jump / slope(c)
         end associate
      end do
   end function moment_places

   !> Position of a touchdown point, prepared for its error bar.
   type(place_bar_t) function named_place(problem, candidate, at) result(place)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: at
      place%contact_span = problem%contact_span(problem%candidates%contact_span(candidate))%number
      place%last = is_last(problem, candidate)
      place%at = at
   end function named_place

   !> True for the end of a line contact; false for its beginning, or for a point contact.
   pure logical function is_last(problem, candidate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      is_last = problem%candidates%neighbour(1, candidate) > 0
   end function is_last
end module contact_places
