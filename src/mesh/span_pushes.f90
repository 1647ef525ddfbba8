!> Contact forces of contact spans for the results: concentrated forces at point contacts and at ends of line contacts, and forces
!> by stress-free length along line contacts. Each entry of both lists has six numbers: index of the contact, arc length along the
!> chain of the contact, position (x, y), force (x, y) on the rod.
module span_pushes
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap, node_position
   use span_forces, only: end_force, end_balance_force
   use span_regions, only: chain_coordinate, lengths_before
   use track_nodes, only: rolled_t, rolled, track_joints, node_track, track_sense
   use conforming_span, only: conforming_state_t, conforming_forces, density_samples, smooth_parts
   implicit none
   private
   public :: point_pushes, line_pushes

   real(wp), parameter :: inside = 1.0e-9_wp !! distance of the first and last sample from the ends of a smooth part of the track,
   !! over its length; the pressure jumps where two parts join

contains

   !> Forces at point contacts and at the ends of line contacts. Nodes inside a line contact have no concentrated force and
   !> therefore no entry.
   function point_pushes(problem, state) result(list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), allocatable :: list(:, :)   !! (6, forces) entries as in the header of this module
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
      real(wp), allocatable :: list(:, :)   !! (6, samples) entries as in the header of this module
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
                  call conforming_forces(problem, state, e, tau, local, place, angle, density, kept)
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
end module span_pushes
