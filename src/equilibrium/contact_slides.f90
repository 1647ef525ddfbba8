!> Contact points that slide along the rod: the material coordinate of their node as an unknown of its own.
!>
!> A point contact, and the end of a contact region, lies between the mesh nodes. Its node is moved there along the
!> stress-free rod, the lengths of its two elements change with it, and the equation for the new unknown is tangency:
!> n.t = 0, the gap has no slope along the rod (the configurational force on the node vanishes). So the contact force
!> moves smoothly along the rod and never hops from node to node.
module contact_slides
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t, element_displacement, element_load
   use rod_geometry, only: element_geometry_t, slid_pair, node_reference
   use ge_element, only: ge_columns, ge_rate_t, ge_evaluate
   use contact_hand_over, only: hand_over, carry_over, offset_from_home
   use linear_system, only: system_t, turn_pair, row_times
   implicit none
   private
   public :: linearise_slides, slide_row, slide_force, slide_fraction, planned_fraction, pass_on, &
      & ends_contact, ends_here, reach, close_short_gaps, drop_slides

   real(wp), parameter :: least_length = 0.1_wp !! of an element beside a sliding node, over its tributary length

contains

   !> Border of the sliding nodes: those at the end of a contact region, or alone, whose elements may change their length.
   subroutine linearise_slides(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: c, k, ns
      ns = 0
      do c = 1, problem%candidates%n
         if (slides_now(c)) ns = ns + 1
      end do
      if (ns /= system%n_slides) then
         deallocate (system%slide, system%column)
         allocate (system%slide(ns), system%column(system%n, 1 + ns))
         if (allocated(system%slide_op)) deallocate (system%slide_op, system%slide_column, system%slide_gap, &
            & system%tangency, system%tangency_row, system%tangency_corner, system%tangency_rate, system%slide_direction)
         if (ns > 0) allocate (system%slide_op(size(state%z, 1), 2, ns), system%slide_column(system%n, ns), &
            & system%slide_gap(ns), system%tangency(ns), system%tangency_row(3, ns), system%tangency_corner(ns), &
            & system%tangency_rate(ns), system%slide_direction(2, ns))
      end if
      system%n_slides = ns
      if (ns == 0) return
      k = 0
      do c = 1, problem%candidates%n
         if (.not. slides_now(c)) cycle
         k = k + 1
         system%slide(k) = c
         call linearise_slide(problem, state, system, k)
      end do

   contains

      logical function slides_now(candidate)
         integer, intent(in) :: candidate
         slides_now = problem%candidates%may_slide(candidate)
         if (slides_now) slides_now = ends_contact(problem, state%active, candidate)
      end function slides_now
   end subroutine linearise_slides

   !> True for a candidate in contact where contact ends on one side or both.
   pure logical function ends_contact(problem, active, candidate) result(ends)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)      !! (candidates)
      integer, intent(in) :: candidate
      ends = active(candidate)
      if (ends) ends = ends_here(problem, active, candidate, 1) .or. ends_here(problem, active, candidate, 2)
   end function ends_contact

   !> True where contact ends on one side of an active candidate. Reactions at nodes leave open stretches of a few nodes inside
   !> a contact region, most of all next to its end and where the length of the elements changes: these are none. But two
   !> points, each alone in contact, have free rod between them however near they are.
   pure logical function ends_here(problem, active, candidate, side) result(ends)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)      !! (candidates)
      integer, intent(in) :: candidate, side
      integer, parameter :: unresolved = 3  !! nodes
      integer :: k, steps
      ends = .false.
      k = candidate
      do steps = 0, unresolved
         k = problem%candidates%neighbour(side, k)
         ends = k == 0
         if (ends) return
         if (active(k)) exit
      end do
      ends = .not. active(k)
      if (ends .or. steps == 0) return
      ends = alone(candidate, 3 - side) .and. alone(k, side)

   contains

      pure logical function alone(c, way)
         integer, intent(in) :: c, way
         alone = problem%candidates%neighbour(way, c) == 0
         if (.not. alone) alone = .not. active(problem%candidates%neighbour(way, c))
      end function alone
   end function ends_here

   !> Derivatives by the material coordinate of one sliding node, the node's displacement held. Those of the stress-free
   !> geometry are central differences; they steer Newton only, the solution does not depend on them.
   subroutine linearise_slide(problem, state, system, k)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer, intent(in) :: k
      type(element_geometry_t) :: pair(2, 2)
      type(ge_rate_t) :: rate
      real(wp) :: f(6), x(2), reference, speed, t0(2), t(2), n(2), across(2), turning(2), angle, angles(2), step
      integer :: c, node, i, side, e, d, end_node, j
      c = system%slide(k)
      node = problem%candidates%node(c)
      system%slide_column(:, k) = 0.0_wp
      step = 1.0e-4_wp * minval(state%geometry%element(problem%candidates%element(:, c))%length)
      do side = 1, 2
         call slid_pair(problem%model, problem%tableau, state%geometry, problem%candidates%element(:, c), &
            & merge(-step, step, side == 1), pair(:, side), x, angles(side))
      end do
      do i = 1, 2
         e = problem%candidates%element(i, c)
         rate%length = (pair(i, 2)%length - pair(i, 1)%length) / (2.0_wp * step)
         rate%scaled = (pair(i, 2)%scale * pair(i, 2)%length - pair(i, 1)%scale * pair(i, 1)%length) / (2.0_wp * step)
         rate%angle = (pair(i, 2)%angle - pair(i, 1)%angle) / (2.0_wp * step)
         call element_rates(problem, state, e, rate, f, system%slide_op(:, i, k))
         do j = 1, 2
            end_node = problem%model%mesh%node(j, e)
            if (system%turned(end_node)) call turn_pair(system%axis(:, end_node), f(3 * j - 2:3 * j - 1))
            d = dof(problem, end_node, 1)
            system%slide_column(d:d + 2, k) = system%slide_column(d:d + 2, k) - f(3 * j - 2:3 * j)
         end do
      end do
      ! Tangency: the gap's slope along the rod, n.t, vanishes.
      e = problem%candidates%element(1, c)
      call node_reference(problem%model, state%geometry, e, 2, x, reference, speed)
      t0 = speed * [cos(reference), sin(reference)]
      angle = reference + state%u(3, node)
      t = [cos(angle), sin(angle)]
      n = system%normal(:, c)
      across = [n(2), -n(1)]
      system%slide_direction(:, k) = t0
      system%slide_gap(k) = dot_product(n, t0)
      system%tangency(k) = dot_product(n, t)
      system%tangency_row(1:2, k) = system%bend(c) * dot_product(across, t) * across
      system%tangency_row(3, k) = n(2) * t(1) - n(1) * t(2)
      system%tangency_rate(k) = -system%bend(c) * dot_product(across, t) * dot_product(across, system%motion(:, c))
      system%tangency_corner(k) = system%bend(c) * dot_product(across, t) * dot_product(across, t0)
      system%tangency_corner(k) = system%tangency_corner(k) + &
         & system%tangency_row(3, k) * (angles(2) - angles(1)) / (2.0_wp * step)
      ! The node moves along the stress-free rod, so the direction of its reaction turns with the obstacle.
      turning = state%reaction(c) * system%bend(c) * dot_product(across, t0) * across
      if (system%turned(node)) then
         call turn_pair(system%axis(:, node), system%tangency_row(1:2, k))
         call turn_pair(system%axis(:, node), turning)
      end if
      d = dof(problem, node, 1)
      system%slide_column(d:d + 1, k) = system%slide_column(d:d + 1, k) + turning
   end subroutine linearise_slide

   !> Derivatives of an element's end forces and stored resultants by a change of its stress-free geometry.
   subroutine element_rates(problem, state, e, rate, f_rate, z_rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(ge_rate_t), intent(in) :: rate
      real(wp), intent(out) :: f_rate(6)
      real(wp), intent(out) :: z_rate(:)    !! (largest z_size)
      real(wp) :: u(6), f(6), raw(6), k(6, 6), fl(6), op(size(z_rate), ge_columns), defect(2)
      logical :: ok
      u = element_displacement(problem, state, e)
      associate (geometry => state%geometry%element(e))
         call ge_evaluate(problem%tableau(problem%model%mesh%stages(e)), geometry%length, geometry%scale, &
            & geometry%angle, geometry%chord, problem%compliance(e), element_load(problem, state, e), u, &
            & state%z(:problem%z_size(e), e), f, raw, k, fl, op, defect, ok, rate=rate, f_rate=f_rate, &
            & z_rate=z_rate(:problem%z_size(e)))
      end associate
   end subroutine element_rates

   !> Product of a tangency row with a vector of unknowns.
   pure real(wp) function slide_row(problem, system, k, x)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: k
      real(wp), intent(in) :: x(:)
      integer :: d
      d = dof(problem, problem%candidates%node(system%slide(k)), 1)
      slide_row = dot_product(system%tangency_row(:, k), x(d:d + 2))
   end function slide_row

   !> Work of the forces that a unit move of a sliding point sets free, on a displacement that fixed unknowns take no part
   !> in. Its own node's fixed unknown moves with the point.
   pure real(wp) function slide_force(system, k, x)
      type(system_t), intent(in) :: system
      integer, intent(in) :: k
      real(wp), intent(in) :: x(:)     !! zero at the fixed unknowns
      integer :: c, d
      c = system%slide(k)
      d = system%unknown(c)
      slide_force = dot_product(system%slide_column(:, k), x) + (system%slide_gap(k) / system%slope(c)) * row_times(system, d, x)
   end function slide_force

   !> The part of predicted shifts, at most 1, after which every contact point is still in one of its elements, or only just in
   !> the next one.
   pure real(wp) function planned_fraction(problem, state, system, shift) result(fraction)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: shift(:)   !! (n_slides)
      real(wp), parameter :: least = 1.0_wp !! of the tributary length: over to a node that does not slide
      integer :: k
      fraction = 1.0_wp
      do k = 1, system%n_slides
         if (.not. abs(shift(k)) > 0.0_wp) cycle
         fraction = min(fraction, max(most_ahead(problem, state, system%slide(k), shift(k)), &
            & least * problem%candidates%tributary(system%slide(k))) / abs(shift(k)))
      end do
   end function planned_fraction

   !> The part of given shifts, at most 1, that leaves every sliding node enough of the element ahead of it.
   pure real(wp) function slide_fraction(problem, state, system, shift) result(fraction)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: shift(:) !! (n_slides)
      integer :: k
      fraction = 1.0_wp
      do k = 1, system%n_slides
         if (.not. abs(shift(k)) > 0.0_wp) cycle
         fraction = min(fraction, most_ahead(problem, state, system%slide(k), shift(k)) / abs(shift(k)))
      end do
   end function slide_fraction

   !> How far the node of a candidate may move in the direction of `shift`.
   pure real(wp) function most_ahead(problem, state, candidate, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(in) :: shift
      real(wp), parameter :: slack = 0.1_wp  ! beyond reach, so that few hand-overs fall into an increment
      real(wp) :: home, share
      integer :: side, e, next
      side = merge(2, 1, shift > 0.0_wp)
      e = problem%candidates%element(side, candidate)
      next = problem%candidates%neighbour(side, candidate)
      home = problem%model%mesh%s(2, e) - problem%model%mesh%s(1, e)
      ! One that is free to come takes over before the element behind has become too long; none goes past its neighbour's home.
      share = 1.0_wp - least_length
      if (next > 0) then
         if (problem%candidates%may_slide(next)) then
            if (.not. abs(offset_from_home(problem, state, next)) > 0.0_wp) &
               & share = min(share, slack + reach(problem, state%active, candidate, side))
         end if
      end if
      most_ahead = min(state%geometry%element(e)%length - least_length * problem%candidates%tributary(candidate), &
         & share * home - sign(1.0_wp, shift) * offset_from_home(problem, state, candidate))
      most_ahead = max(most_ahead, 0.0_wp)
   end function most_ahead

   !> How far towards the next node a contact point goes with its node, over the length of the element at home; beyond, the
   !> next node takes over if it is free to come. At the end of a region the element inside is kept short: its reactions sit at
   !> its nodes only, and what the rod bends between them costs accuracy.
   pure real(wp) function reach(problem, active, candidate, side)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)      !! (candidates)
      integer, intent(in) :: candidate      !! at the end of a region, or alone
      integer, intent(in) :: side           !! on which it goes: 1 before, 2 after
      real(wp), parameter :: alone = 0.6_wp, inwards = 0.85_wp, outwards = 0.25_wp
      reach = alone
      if (.not. ends_here(problem, active, candidate, side)) then
         reach = inwards
      else if (.not. ends_here(problem, active, candidate, 3 - side)) then
         reach = outwards
      end if
   end function reach

   !> Hands contact points that stand at the end of their reach over to the next nodes, between two iterations.
   subroutine pass_on(problem, system, shift, state, done)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: shift(:)      !! (n_slides) how they want to move on
      type(state_t), intent(inout) :: state
      logical, intent(out) :: done          !! false: there is no way on for one of them
      real(wp), parameter :: at_the_end = 1.0e-6_wp !! of the tributary length
      type(state_t) :: moved
      integer :: k
      done = .true.
      moved = state
      do k = 1, system%n_slides
         if (.not. abs(shift(k)) > 0.0_wp) cycle
         if (most_ahead(problem, state, system%slide(k), shift(k)) > &
            & at_the_end * problem%candidates%tributary(system%slide(k))) cycle
         call hand_over(problem, system%slide(k), merge(2, 1, shift(k) > 0.0_wp), state, moved, done)
         if (.not. done) return
      end do
      call carry_over(problem, state, moved)
      state = moved
   end subroutine pass_on

   !> Closes the open stretches of at most three nodes that node-wise reactions leave inside a contact region next to its
   !> end: once the end node slides they are in contact.
   subroutine close_short_gaps(problem, active)
      type(problem_t), intent(in) :: problem
      logical, intent(inout) :: active(:)   !! (candidates) the contact set
      integer :: c, k, steps
      do c = 1, problem%candidates%n
         if (.not. (active(c) .and. problem%candidates%may_slide(c))) cycle
         k = c
         do steps = 1, 4
            k = problem%candidates%neighbour(2, k)
            if (k == 0) exit
            if (active(k)) exit
         end do
         if (k == 0 .or. steps == 1 .or. steps > 4) cycle
         k = problem%candidates%neighbour(2, c)
         do while (.not. active(k))
            active(k) = .true.
            k = problem%candidates%neighbour(2, k)
         end do
      end do
   end subroutine close_short_gaps

   !> Holds all contact nodes at their material points for one solution.
   subroutine drop_slides(system)
      type(system_t), intent(inout) :: system
      system%n_slides = 0
   end subroutine drop_slides
end module contact_slides
