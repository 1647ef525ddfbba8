!> Forces of obstacles on contact spans: concentrated forces at touchdown points, densities along line contacts, resultants.
!>
!> For the results, point_pushes lists the concentrated forces at point contacts and at ends of line contacts, and line_pushes the
!> forces by stress-free length along line contacts. Each entry of both lists has six numbers: index of the contact, arc length
!> along the chain of the contact, position (x, y), force (x, y) on the rod.
module span_forces
   use kinds, only: wp
   use model, only: obstacle_of
   use problem, only: problem_t
   use rod_layout, only: segment_element
   use rod_state, only: state_t, candidate_gap, node_position, element_load
   use rod_load, only: ge_load_t, sum_line, line_at, inner_forces_t
   use rod_equations, only: end_forces
   use track_nodes, only: rolled_t, rolled, track_joints, node_track, track_sense
   use conforming_span, only: conforming_state_t, conforming_forces, density_samples, smooth_parts
   use touchdown_points, only: point_force
   use span_candidates, only: touch_place
   use breakpoint_forces, only: breakpoint_force
   use state_transfer, only: find_point
   use element_foundation, only: foundation_forces
   use span_regions, only: chain_coordinate, lengths_before
   implicit none
   private
   public :: span_totals, end_force, node_shares, point_pushes, line_pushes

   real(wp), parameter :: inside = 1.0e-9_wp !! distance of the first and last sample from the ends of a smooth part of the track,
   !! divided by the length of this part; the pressure jumps where two parts join

contains

   !> For each contact and obstacle: resultant of the contact forces on the structure (x, y) and sum of the normal forces. For each
   !> obstacle: moment of all its forces about the point `middle`.
   subroutine span_totals(problem, state, middle, total, moment, push)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: middle(2)         !! reference point of the moments
      real(wp), intent(out) :: total(:, :, :)   !! (3, contacts, obstacles) force in x, force in y, sum of normal forces
      real(wp), intent(out) :: moment(:)        !! (obstacles) moment, > 0 anticlockwise
      real(wp), intent(out) :: push(:) !! (candidates) concentrated forces, from end_force; 0 for candidates that are at no end of a
      !! contact span
      real(wp) :: x(2), force(3), turn, gap, normal(2), bend
      type(rolled_t) :: roll
      integer :: c, e
      total = 0.0_wp
      moment = 0.0_wp
      push = 0.0_wp
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         push(c) = end_force(problem, state, c)
         call candidate_gap(problem, state, c, gap, normal, bend)
         roll = rolled(problem, state, c)
         x = node_position(state, problem%candidates%node(c)) + roll%arm - middle
         associate (sums => total(:, problem%candidates%contact(c), problem%candidates%obstacle(c)))
            if (abs(roll%way) > 0.0_wp) normal = roll%normal
            force = push(c) * [normal, 1.0_wp]
            if (problem%candidates%moves(c)) force(1:2) = end_balance_force(problem, state, c)
            sums = sums + force
            moment(problem%candidates%obstacle(c)) = moment(problem%candidates%obstacle(c)) + (x(1) * force(2) - x(2) * force(1))
            e = problem%candidates%element(2, c)
            if (e == 0) cycle
            if (problem%conforms(e) /= c) cycle
            call line_force(problem, state, e, middle, force, turn)
            moment(problem%candidates%obstacle(c)) = moment(problem%candidates%obstacle(c)) + turn
         end associate
         ! At a node between two pieces of a wall the force is assigned to the first piece.
         associate (sums => total(:, problem%candidates%contact(c), obstacle_of(problem%deck%contact(problem%candidates% &
            & contact(c)), problem%deck%mesh%node(:, problem%layout%rod_segment(problem%rod_segment(e))%element(1)))))
            sums = sums + force
         end associate
      end do
   end subroutine span_totals

   !> Forces of a contact as equivalent forces at the deck's nodes, and force densities at these nodes. Each force is divided
   !> between the two nodes beside it by the lever rule, so that the sum of the forces is exact.
   subroutine node_shares(problem, state, contact, share, density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      real(wp), intent(out) :: share(:), density(:) !! (deck's nodes of the contact) forces; forces by stress-free length
      real(wp) :: sums(problem%deck%mesh%n_nodes), densities(problem%deck%mesh%n_nodes), local(3), push, at, tau, &
         & start, length, from, to
      type(conforming_state_t) :: kept
      integer :: c, e, i, j
      sums = 0.0_wp
      densities = 0.0_wp
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0 .or. problem%candidates%contact(c) /= contact) cycle
         call add(problem%contact_span(problem%candidates%contact_span(c))%rod_segment, touch_place(problem, state, c), &
            & end_force(problem, state, c))
         e = problem%candidates%element(2, c)
         if (e == 0) cycle
         if (problem%conforms(e) /= c) cycle
         ! The density is integrated between neighbouring nodes of the deck; a mesh element may contain several of these nodes or
         ! none.
         associate (tab => problem%tableau(problem%model%mesh%stages(e)), g => state%geometry%element(e), &
            & whole => problem%layout%rod_segment(problem%rod_segment(e)))
            start = g%s(1) + problem%origin(e)
            length = g%s(2) - g%s(1)
            do j = segment_element(whole, start), size(whole%element)
               if (.not. whole%at(j) < start + length) exit
               from = max(whole%at(j), start)
               to = min(whole%at(j + 1), start + length)
               if (.not. to > from) cycle
               do i = 1, tab%stages
                  at = from + tab%c(i) * (to - from)
                  call conforming_forces(problem, state, e, (at - start) / length, local, density=push, kept=kept)
                  call add(problem%rod_segment(e), at, push * tab%b(i) * g%length * (to - from) / length)
               end do
            end do
         end associate
      end do
      do i = 1, size(share)
         associate (node => problem%deck%contact(contact)%node(i))
            share(i) = sums(node)
            density(i) = 0.0_wp
            j = problem%layout%node_rod_segment(node)
            if (j == 0) cycle
            call find_point(problem, state, j, problem%layout%node_at(node), e, tau)
            if (problem%conforms(e) == 0) cycle
            if (problem%candidates%contact(problem%conforms(e)) /= contact) cycle
            call conforming_forces(problem, state, e, tau, local, density=density(i), kept=kept)
         end associate
      end do

   contains

      !> Adds a force at a material point to the shares of the two deck nodes beside this point.
      subroutine add(rod_segment, at, force)
         integer, intent(in) :: rod_segment
         real(wp), intent(in) :: at, force
         integer :: low
         real(wp) :: part
         associate (whole => problem%layout%rod_segment(rod_segment))
            low = segment_element(whole, at)
            part = min(max((at - whole%at(low)) / (whole%at(low + 1) - whole%at(low)), 0.0_wp), 1.0_wp)
            associate (node => problem%deck%mesh%node(:, whole%element(low)))
               sums(node) = sums(node) + [1.0_wp - part, part] * force
            end associate
         end associate
      end subroutine add
   end subroutine node_shares

   !> Concentrated force at a contact node, > 0 in compression; zero inside a line contact.
   real(wp) function end_force(problem, state, candidate) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      logical :: inside
      integer :: next
      if (problem%candidates%moves(candidate)) then
         force = point_force(problem, state, candidate)
         return
      end if
      ! Loads and supports act at segment boundaries only: inside a segment the force is zero.
      next = problem%candidates%element(2, candidate)
      inside = minval(problem%candidates%element(:, candidate)) > 0
      if (inside) inside = next == problem%candidates%element(1, candidate) + 1
      if (inside) inside = problem%rod_segment(next) == problem%rod_segment(next - 1)
      force = 0.0_wp
      if (.not. inside) force = breakpoint_force(problem, state, candidate)
   end function end_force

   !> Force (x, y) that balances the section forces on both sides of a touchdown point. In equilibrium this force is normal to the
   !> obstacle. For a point that moves along a rod with fixed nodes, it includes the forces between the old and the new position, so
   !> that sums of forces have the right derivatives.
   function end_balance_force(problem, state, candidate) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: force(2), ends(3, 2)
      integer :: side, e
      force = 0.0_wp
      do side = 1, 2
         e = problem%candidates%element(side, candidate)
         if (e == 0) cycle
         call end_forces(problem, state, e, ends(:, 1), ends(:, 2))
         force = force + merge(1.0_wp, -1.0_wp, side == 1) * ends(1:2, 3 - side)
      end do
   end function end_balance_force

   !> Force of the obstacle on a conforming element (x, y), integral of its density, and its moment about a given point. These are
   !> computed from end forces and loads, because the density is a derivative of the solution and less accurate. The density
   !> contains the second derivative of the stress-free curvature, which a spline or an imperfection does not have everywhere.
   subroutine line_force(problem, state, e, middle, force, moment)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2) !! reference point of the moment
      real(wp), intent(out) :: force(3), moment !! force in x, force in y, integral of the density; moment, > 0 anticlockwise
      real(wp) :: local(3), x(2), steady, ends(3, 2), place(2, 2), line(2), slope(2), shear(2)
      real(wp), allocatable :: part(:)
      real(wp) :: weight
      type(ge_load_t) :: load
      type(conforming_state_t) :: kept
      type(inner_forces_t) :: inner
      integer :: i, k
      load = element_load(problem, state, e)
      call end_forces(problem, state, e, ends(:, 1), ends(:, 2))
      do i = 1, 2
         place(:, i) = node_position(state, problem%model%mesh%node(i, e)) - middle
      end do
      associate (tab => problem%tableau(problem%model%mesh%stages(e)), length => state%geometry%element(e)%length, &
         & d => place(:, 2) - place(:, 1))
         call sum_line(tab, load, tab%b, line, slope)
         force(1:2) = ends(1:2, 1) - ends(1:2, 2) - length * line - load%pressure * [-d(2), d(1)]
         do i = 1, 2
            call conforming_forces(problem, state, e, real(i - 1, wp), local, kept=kept)
            shear(i) = local(2)
         end do
         force(3) = track_sense(problem, state, problem%conforms(e), node_track(problem, state, problem%conforms(e))) * &
            & (shear(1) - shear(2))
         call foundation_forces(problem, state, e, inner)
         do k = 1, inner%n
            force(1:2) = force(1:2) - (length * inner%at(k)%weight) * inner%at(k)%force
         end do
         moment = ends(3, 1) - ends(3, 2) + place(1, 1) * ends(2, 1) - place(2, 1) * ends(1, 1) - place(1, 2) * ends(2, 2) + &
            & place(2, 2) * ends(1, 2) - 0.5_wp * load%pressure * (dot_product(place(:, 2), place(:, 2)) - &
            & dot_product(place(:, 1), place(:, 1)))
         do k = 1, inner%n
            x = inner%at(k)%x - middle
            moment = moment - (length * inner%at(k)%weight) * (x(1) * inner%at(k)%force(2) - x(2) * inner%at(k)%force(1))
         end do
         ! The curvature has kinks where two pieces of the track join.
         part = [0.0_wp, track_joints(problem, state, e), 1.0_wp]
         do k = 2, size(part)
            do i = 1, tab%stages
               weight = tab%b(i) * (part(k) - part(k - 1)) * length
               call conforming_forces(problem, state, e, part(k - 1) + tab%c(i) * (part(k) - part(k - 1)), local, x, &
                  & steady=steady, kept=kept)
               force(3) = force(3) + weight * steady
               x = x - middle
               call line_at(tab, load, part(k - 1) + tab%c(i) * (part(k) - part(k - 1)), line, slope)
               moment = moment - weight * (x(1) * line(2) - x(2) * line(1))
            end do
         end do
      end associate
   end subroutine line_force

   !> Forces at point contacts and at the ends of line contacts. Nodes inside a line contact have no concentrated force and
   !> therefore no entry.
   function point_pushes(problem, state) result(list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), allocatable :: list(:, :)   !! (6, forces) entries, explained in the header of this module
      real(wp) :: force(2), normal(2), gap, bend, size
      type(rolled_t) :: roll
      real(wp), allocatable :: before(:)
      integer :: c, n
      allocate (list(6, 8))
      n = 0
      before = lengths_before(problem, state)
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         size = end_force(problem, state, c)
         if (abs(size) <= 0.0_wp) cycle
         roll = rolled(problem, state, c)
         if (problem%candidates%moves(c)) then
            force = end_balance_force(problem, state, c)
         else
            call candidate_gap(problem, state, c, gap, normal, bend)
            if (abs(roll%way) > 0.0_wp) normal = roll%normal
            force = size * normal
         end if
         call add(list, n, problem%candidates%contact(c), chain_coordinate(problem, state, c, 2, before) + roll%way, &
            & node_position(state, problem%candidates%node(c)) + roll%arm, force)
      end do
      list = list(:, :n)
   end function point_pushes

   !> Forces by stress-free length along the line contacts: samples in the order of the elements, one smooth part of the track after
   !> the other.
   function line_pushes(problem, state) result(list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), allocatable :: list(:, :)   !! (6, samples) entries, explained in the header of this module
      real(wp), allocatable :: part(:), before(:)
      real(wp) :: local(3), place(2), angle, density, sense, tau, at
      type(conforming_state_t) :: kept
      integer :: c, e, k, j, i, n, parts
      allocate (list(6, 8))
      n = 0
      before = lengths_before(problem, state)
      do c = 1, problem%candidates%n
         if (problem%candidates%contact_span(c) == 0) cycle
         e = problem%candidates%element(2, c)
         if (e == 0) cycle
         if (problem%conforms(e) /= c) cycle
         sense = track_sense(problem, state, c, node_track(problem, state, c))
         part = [0.0_wp, track_joints(problem, state, e), 1.0_wp]
         do k = 2, size(part)
            parts = smooth_parts(problem, state, e, part(k) - part(k - 1))
            do j = 0, parts - 1
               do i = 0, density_samples
                  tau = (j + min(max(real(i, wp) / density_samples, inside), 1.0_wp - inside)) / parts
                  tau = part(k - 1) + tau * (part(k) - part(k - 1))
                  call conforming_forces(problem, state, e, tau, local, place, angle, density, kept=kept)
                  at = chain_coordinate(problem, state, c, 2, before) + tau * state%geometry%element(e)%length
                  ! The rod lies to the left of the obstacle's track.
                  call add(list, n, problem%candidates%contact(c), at, place, sense * density * [-sin(angle), cos(angle)])
               end do
            end do
         end do
      end do
      list = list(:, :n)
   end function line_pushes

   !> Appends a force to a list.
   pure subroutine add(list, n, contact, at, place, force)
      real(wp), allocatable, intent(inout) :: list(:, :) !! (6, any) entries; the list is doubled when it is full
      integer, intent(inout) :: n           !! number of entries in the list
      integer, intent(in) :: contact
      real(wp), intent(in) :: at, place(2), force(2)
      if (n == size(list, 2)) list = reshape(list, [6, 2 * n], pad=list)
      n = n + 1
      list(:, n) = [real(contact, wp), at, place, force]
   end subroutine add
end module span_forces
