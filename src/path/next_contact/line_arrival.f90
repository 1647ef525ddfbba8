!> Arrival of ends of line contacts at a segment boundary with a couple or a force: two ends from both sides, where a lifted part
!> comes into contact again, or one end at a node with a couple. The arriving end is fixed at the boundary; the change is located at
!> the load at which the fixing force or couple is zero.
module line_arrival
   use kinds, only: wp
   use problem, only: problem_t
   use contact_set_edits, only: end_moved
   use contact_spans, only: contact_span_t, shortest
   use breakpoint_forces, only: breakpoint_couple, breakpoint_force, left_over
   use past_breakpoints, only: beyond, end_node
   use lifted_node, only: lifted_ahead
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t
   use contact_change_types, only: step_interval_t
   use next_spans, only: next_t, new_next, go_to_load
   implicit none
   private
   public :: find_arrival

   integer, parameter :: max_tries = 8  !! loads of the secant method; couples of dead loads are linear for small deflections

contains

   !> Finds the contact set with the arriving ends at the segment boundary, and its equilibrium, if found on the interval or beyond
   !> its end by at most its length.
   subroutine find_arrival(problem, interval, test, next, found)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      type(span_test_t), intent(in) :: test      !! test of the free span between a contact and a segment boundary
      type(next_t), intent(out) :: next
      logical, intent(out) :: found
      type(contact_span_t), allocatable :: set(:)
      integer :: k, side
      logical :: meets
      call set_at_breakpoint(problem, interval, test, set, k, side, meets)
      found = allocated(set)
      if (.not. found) return
      next = new_next(problem, interval%to%state, set)
      k = findloc(next%problem%contact_span%number, problem%contact_span(k)%number, 1)
      call find_load(problem, interval, next%problem%contact_span(k)%candidate(3 - side), meets, next, found)
   end subroutine find_arrival

   !> Makes the contact set with the end of a line contact at the segment boundary, and the end of a second line contact if one
   !> arrives from the other side. Not allocated if no line contact arrives.
   subroutine set_at_breakpoint(problem, interval, test, set, k, side, meets)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      type(span_test_t), intent(in) :: test
      type(contact_span_t), allocatable, intent(out) :: set(:)
      integer, intent(out) :: k                  !! index of the line contact
      integer, intent(out) :: side               !! side of the free span on which the line contact lies
      logical, intent(out) :: meets              !! true: another line contact arrives from the other side
      real(wp) :: whole
      integer :: way, other, rod_segment
      k = 0
      side = 0
      meets = .false.
      if (count(test%beside > 0) /= 1) return
      side = findloc(test%beside > 0, .true., 1)
      k = test%beside(side)
      way = merge(1, -1, side == 1)
      rod_segment = beyond(problem, k, way)
      if (.not. (problem%contact_span(k)%line .and. rod_segment > 0)) return
      other = findloc(problem%contact_span%rod_segment == rod_segment .and. problem%contact_span%contact == &
         & problem%contact_span(k)%contact, .true., 1, &
         & back=way < 0)
      meets = other > 0
      if (meets) meets = problem%contact_span(other)%line .and. &
         & problem%candidates%moves(problem%contact_span(other)%candidate(side))
      whole = problem%layout%rod_segment(test%rod_segment)%length
      if (.not. meets) then
         if (lifted_ahead(problem, interval%to%state, problem%contact_span(k)%candidate(3 - side), end_node(problem, k, way)) <= &
            & shortest * whole) &
            & return
      end if
      set = end_moved(present_contact_spans(problem, interval%to%state), k, 3 - side, merge(whole, 0.0_wp, way > 0))
      if (meets) set = end_moved(set, other, side, merge(problem%layout%rod_segment(rod_segment)%length, 0.0_wp, way < 0))
   end subroutine set_at_breakpoint

   !> Finds the load at which the node at the segment boundary needs no fixing, by the secant method: the zero of its couple, or of
   !> its force if two line contacts meet and the couple is zero.
   subroutine find_load(problem, interval, c, meets, next, found)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: c                   !! candidate of the node, in the next set
      logical, intent(in) :: meets
      type(next_t), intent(inout) :: next
      logical, intent(out) :: found
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: load(2), couple(2), force(2), held(2)
      integer :: try
      load = [interval%from%load_factor, interval%to%state%load_factor]
      call look_at(load(2), couple(2), force(2))
      if (found) call look_at(load(1), couple(1), force(1))
      if (.not. found) return
      held = couple
      if (meets .and. maxval(abs(couple)) <= left_over(problem) * interval%scale * problem%size) held = force
      do try = 1, max_tries
         found = abs(held(2) - held(1)) > 0.0_wp
         if (.not. found) return
         load = [load(2), load(2) - held(2) * (load(2) - load(1)) / (held(2) - held(1))]
         found = interval%stuck .or. abs(load(2) - interval%to%state%load_factor) <= &
            & abs(interval%to%state%load_factor - interval%from%load_factor)
         associate (stop => problem%model%step(problem%step)%stop)
            found = found .and. .not. any(stop%monitor == 0 .and. (stop%value - interval%to%state%load_factor) * &
               & (load(2) - stop%value) > 0.0_wp)
         end associate
         if (.not. found) return
         couple(1) = couple(2)
         force(1) = force(2)
         held(1) = held(2)
         call look_at(load(2), couple(2), force(2))
         if (.not. found) return
         if (abs(load(2) - load(1)) <= 10.0_wp * epsilon(load) * abs(load(2))) return
         held(2) = merge(couple(2), force(2), abs(held(1) - couple(1)) <= 0.0_wp)
         if (abs(held(2)) <= 1.0e-3_wp * left_over(problem) * interval%scale * problem%size) return
      end do

   contains

      !> Computes the couple and the force that would fix the node at a load.
      subroutine look_at(load, couple, force)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: couple, force
         call go_to_load(next, load, tests)
         found = allocated(tests)
         couple = 0.0_wp
         force = 0.0_wp
         if (.not. found) return
         couple = breakpoint_couple(next%problem, next%state, c)
         force = breakpoint_force(next%problem, next%state, c)
      end subroutine look_at
   end subroutine find_load
end module line_arrival
