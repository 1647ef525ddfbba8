!> Contacts that spread from a node, or leave it: what no slide of that node does.
!>
!> A contact point is a point as long as the rod curves away from the obstacle there. Where its curvature becomes the
!> obstacle's, contact spreads to both sides: two nodes are needed for its ends. And a node that does not slide (it has a
!> support or a load, or its elements differ) holds a contact that came along the rod only while it is near: the
!> next node goes to where the rod really touches, or lets go.
module contact_spread
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap
   use rod_geometry, only: slide_node
   use gap_profile, only: gap_and_slope, gap_bend
   use contact_regions, only: rigid_overhang
   use contact_slides, only: ends_here
   use contact_hand_over, only: carry_over, offset_from_home, touches_another
   implicit none
   private
   public :: spread_contacts, close_touching

   real(wp), parameter :: gap_tolerance = 1.0e-11_wp !! of the structure's size
   real(wp), parameter :: least = 0.2_wp !! of an element: nearer to a node contact counts as being there
   !> Of a point: as long as all force acts there contact goes on, to leading order, to half of where it will. The guess must
   !> not be less, where the slope at an end falls with its distance and Newton's method would turn the other way.
   real(wp), parameter :: spread_over_overhang = 2.2_wp

contains

   !> Closes open nodes between two contacts that touch all the same: on a straight wall a region may carry no force between
   !> its ends, so that rounding decides who is in contact there.
   subroutine close_touching(problem, state, changed)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state   !! converged; the nodes that close have no reaction
      logical, intent(out) :: changed
      real(wp) :: gap, normal(2), bend
      integer :: c, k
      changed = .false.
      candidates: do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         if (.not. problem%model%contact(problem%candidates%contact(c))%sliding) cycle
         k = problem%candidates%neighbour(2, c)
         do
            if (k == 0) cycle candidates
            if (state%active(k)) exit
            call candidate_gap(problem, state, k, gap, normal, bend)
            if (gap > gap_tolerance * problem%size) cycle candidates
            k = problem%candidates%neighbour(2, k)
         end do
         k = problem%candidates%neighbour(2, c)
         do while (.not. state%active(k))
            state%active(k) = .true.
            changed = .true.
            k = problem%candidates%neighbour(2, k)
         end do
      end do candidates
   end subroutine close_touching

   !> Looks for such contacts at a converged state. Where there are some, nodes and contact set change, and the state is the
   !> old one on the new nodes: a guess.
   subroutine spread_contacts(problem, state, changed)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      logical, intent(out) :: changed
      type(state_t) :: moved
      integer :: c
      changed = .false.
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         if (.not. problem%model%contact(problem%candidates%contact(c))%sliding) cycle
         if (ends_here(problem, state%active, c, 1) .and. ends_here(problem, state%active, c, 2)) then
            call look_at_point(c)
         else if (problem%candidates%may_slide(c)) then
            cycle
         else if (ends_here(problem, state%active, c, 1)) then
            call look_at_end(c, 1)
         else if (ends_here(problem, state%active, c, 2)) then
            call look_at_end(c, 2)
         end if
      end do
      if (.not. changed) return
      call carry_over(problem, state, moved)
      state = moved

   contains

      !> The first change.
      subroutine begin
         if (.not. changed) moved = state
         changed = .true.
      end subroutine begin

      !> A node alone in contact.
      subroutine look_at_point(c)
         integer, intent(in) :: c
         real(wp) :: gap, slope, bend, there, beyond(2), offset
         integer :: side
         bend = 0.0_wp
         do side = 1, 2
            if (problem%candidates%neighbour(side, c) == 0) return
            call gap_and_slope(problem, state, problem%candidates, c, problem%candidates%element(side, c), 3 - side, gap, slope)
            bend = bend + 0.5_wp * gap_bend(problem, state, c, problem%candidates%element(side, c), 3 - side)
         end do
         if (bend > 0.0_wp) then
            if (problem%candidates%may_slide(c)) return
            ! The parabola of the gap has its minimum there.
            there = -slope / bend
            side = merge(2, 1, there > 0.0_wp)
            if (abs(there) > least * length(c, side)) call take_contact(c, side, abs(there), state%reaction(c), .false.)
            return
         end if
         do side = 1, 2
            beyond(side) = min(spread_over_overhang * rigid_overhang(problem, state, c, side), length(c, side))
         end do
         if (.not. problem%candidates%may_slide(c)) then
            do side = 1, 2
               if (beyond(side) > least * length(c, side)) &
                  & call take_contact(c, side, beyond(side), 0.5_wp * state%reaction(c), .true.)
            end do
         else if (sum(beyond) > least * problem%candidates%tributary(c) .and. minval(beyond) >= 0.0_wp) then
            ! The node becomes the end that is nearer to its home, a neighbour the other one.
            offset = offset_from_home(problem, state, c)
            side = merge(2, 1, abs(offset - beyond(1)) <= abs(offset + beyond(2)))
            call take_contact(c, side, beyond(side), 0.5_wp * state%reaction(c), .true.)
            if (changed) call slide_node(problem%model, problem%tableau, moved%geometry, problem%candidates%element(:, c), &
               & merge(-beyond(1), beyond(2), side == 2))
         end if
      end subroutine look_at_point

      !> A node that does not slide, at the end of a region.
      subroutine look_at_end(c, side)
         integer, intent(in) :: c, side
         real(wp) :: beyond
         if (min(problem%candidates%neighbour(1, c), problem%candidates%neighbour(2, c)) == 0) return
         beyond = rigid_overhang(problem, state, c, side)
         if (beyond > least * length(c, side)) then
            call take_contact(c, side, beyond, state%reaction(c), .true.)
         else if (-beyond > least * length(c, 3 - side)) then
            call take_contact(c, 3 - side, -beyond, state%reaction(c), .false.)
         end if
      end subroutine look_at_end

      !> Length of the element on one side of a candidate.
      real(wp) function length(c, side)
         integer, intent(in) :: c, side
         length = state%geometry%element(problem%candidates%element(side, c))%length
      end function length

      !> The neighbour on one side comes to a given distance from a candidate and is in contact there.
      subroutine take_contact(c, side, distance, reaction, stays)
         integer, intent(in) :: c, side
         real(wp), intent(in) :: distance, reaction
         logical, intent(in) :: stays          !! the candidate stays in contact
         integer :: next
         real(wp) :: shift
         next = problem%candidates%neighbour(side, c)
         if (.not. problem%candidates%may_slide(next)) return
         if (touches_another(problem, state, next)) return
         if (abs(offset_from_home(problem, state, next)) > 0.0_wp) return
         call begin
         shift = max(length(c, side) - distance, 0.0_wp)
         if (shift > 0.0_wp) call slide_node(problem%model, problem%tableau, moved%geometry, &
            & problem%candidates%element(:, next), merge(-shift, shift, side == 2))
         moved%active(next) = .true.
         moved%reaction(next) = reaction
         moved%active(c) = stays
         if (stays) moved%reaction(c) = state%reaction(c) - reaction
         if (.not. stays) moved%reaction(c) = 0.0_wp
      end subroutine take_contact
   end subroutine spread_contacts
end module contact_spread
