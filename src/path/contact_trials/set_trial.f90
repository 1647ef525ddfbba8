!> Equilibrium of a neighbour of the present contact set (neighbours). The places of the ends beside a new contact or free span are
!> prescribed, and the load factor is unknown: a new contact of zero length, or a free span that just opens, has no other regular
!> parameter. An edit without a new contact or free span (a contact ends, a free span closes) has no length to prescribe; the load
!> factor is prescribed instead.
module set_trial
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: numbered
   use span_candidates, only: touch_place
   use touchdown_points, only: carry_forces
   use bordered_system, only: linearise
   use sized_equilibrium, only: solve_sized
   use next_spans, only: next_t, new_next, settle
   use path_state, only: path_state_t
   use rod_strips, only: strip_t, on_segments, strip_place, brought_near
   use neighbours, only: neighbour_t
   implicit none
   private
   public :: solve_neighbour

   real(wp), parameter :: unbalanced = 1.0e-6_wp !! largest relative residual of an equilibrium, far above that of the corrector
   real(wp), parameter :: difference = 1.0e-4_wp !! steps for finite differences, as shares of a load increment and of the longest
   !! rod segment

contains

   !> Finds the equilibrium of a neighbour of the contact set of `problem`.
   subroutine solve_neighbour(problem, state, run, load, strip, neighbour, next, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! first guess, of `problem`
      type(path_state_t), intent(in) :: run      !! gives the last number of a contact span
      real(wp), intent(in) :: load               !! scale of load increments
      type(strip_t), intent(in) :: strip(:)
      type(neighbour_t), intent(in) :: neighbour
      type(next_t), intent(out) :: next          !! its system is factored at its state
      logical, intent(out) :: found
      type(contact_span_t), allocatable :: contact_span(:)
      integer :: ends(2)
      call on_segments(strip, problem%covered, neighbour%set, contact_span, found)
      if (.not. found) return
      next = new_next(problem, state, numbered(contact_span, max(run%spans_begun, maxval([0, contact_span%number]))))
      call carry_forces(problem, state, next%problem, next%state)
      if (all(neighbour%held == 0)) then
         call settle(next, found)
      else
         ends = held_ends(next, strip, neighbour)
         found = any(ends > 0)
         if (.not. found) return
         call solve_sized(next%problem, ends, next%system, difference * [load, maxval(problem%layout%rod_segment%length)], &
            & next%state, found)
      end if
      if (.not. found) return
      call linearise(next%problem, next%state, next%state, next%system)
      ! Fixed touchdown points might carry forces that free ones cannot.
      found = next%system%ok .and. max(next%system%force_residual, next%system%defect_residual) <= unbalanced
   end subroutine solve_neighbour

   !> Candidates (touchdown nodes) at the ends with prescribed places; 0: no end is prescribed, or it is fixed at a segment
   !> boundary.
   function held_ends(next, strip, neighbour) result(ends)
      type(next_t), intent(in) :: next
      type(strip_t), intent(in) :: strip(:)
      type(neighbour_t), intent(in) :: neighbour
      integer :: ends(2), i, c, on, nearest
      real(wp) :: along, distance, near(1)
      ends = 0
      do i = 1, 2
         if (neighbour%held(i) == 0) cycle
         associate (set => neighbour%set(neighbour%held(i)), problem => next%problem)
            nearest = 0
            distance = huge(distance)
            do c = 1, problem%candidates%n
               if (problem%candidates%contact_span(c) == 0 .or. problem%candidates%contact(c) /= set%contact) cycle
               if (.not. problem%candidates%moves(c)) cycle
               call strip_place(strip, problem%contact_span(problem%candidates%contact_span(c))%rod_segment, &
                  & touch_place(problem, next%state, c), on, along)
               if (on /= set%rod_segment) cycle
               near = brought_near(strip(on), [along], set%at(neighbour%side(i)))
               if (abs(near(1) - set%at(neighbour%side(i))) >= distance) cycle
               nearest = c
               distance = abs(near(1) - set%at(neighbour%side(i)))
            end do
            if (distance <= sqrt(epsilon(distance)) * max(1.0_wp, abs(along))) ends(i) = nearest
         end associate
      end do
   end function held_ends
end module set_trial
