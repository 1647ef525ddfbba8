!> Corners of the path where the contact set changes.
!>
!> Past a limit point the LCP of an increment may have no solution: along the tangent a contact has to open, but the path
!> without it leaves in a direction with a negative component on that tangent, so no increment of given length exists.
!> And a sliding contact begins between the nodes, where no LCP looks. So the corner itself is found, the contact set
!> held, the first offending reaction or gap brought to zero; the set is changed there, and the new tangent is pointed
!> where the reaction grows, or the gap opens, instead of along the old one.
module contact_corner
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise, set_path_row, solve_bordered, apply_increment
   use contact_slides, only: slide_fraction
   use path_control, only: control_t
   use path_continuity, only: heading_t, heading_at
   use corrector, only: increment_t, take_increment
   use contact_set, only: reaction_rate, gap_rate, gap_tolerance
   use gap_profile, only: least_gap_after
   use contact_spread, only: spread_contacts
   use sliding_nodes, only: move_node
   use bracketing, only: bracket_t, new_bracket, bracket_guess, bracket_update
   use timing, only: timers_t
   implicit none
   private
   public :: corner_t, contact_begins, find_corner, leave_corner

   !> Where the set changes: at a candidate, or on the element after it.
   type :: corner_t
      integer :: candidate = 0
      logical :: inside = .false.       !! a contact begins inside the element after the candidate
   end type corner_t

contains

   !> True when a converged state lies behind an obstacle between open nodes of a sliding contact, or has a contact that
   !> `start` had no node near of.
   logical function contact_begins(problem, start, state) result(begins)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start, state
      real(wp) :: least, tau
      integer :: c, next
      begins = .false.
      do c = 1, problem%candidates%n
         next = problem%candidates%neighbour(2, c)
         if (next == 0 .or. .not. problem%model%contact(problem%candidates%contact(c))%sliding) cycle
         if (start%active(c) .or. start%active(next)) cycle
         if (state%active(c) .or. state%active(next)) then
            begins = .not. any_active(problem%candidates%neighbour(1, c)) .and. &
               & .not. any_active(problem%candidates%neighbour(2, next))
         else
            call least_gap_after(problem, state, c, least, tau)
            begins = least < -10.0_wp * gap_tolerance * problem%size
         end if
         if (begins) return
      end do

   contains

      pure logical function any_active(candidate)
         integer, intent(in) :: candidate
         any_active = .false.
         if (candidate > 0) any_active = start%active(candidate)
      end function any_active
   end function contact_begins

   !> Looks for a corner within one increment of `start`; several candidates may be due at once, as where a structure is
   !> symmetric. The system is assembled and factored at `start` on entry.
   subroutine find_corner(problem, start, control, place, corner, system, report, found, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(state_t), intent(out) :: place      !! converged, contact set of `start`, signs about to change
      type(corner_t), allocatable, intent(out) :: corner(:) !! which ones
      type(system_t), intent(inout) :: system  !! assembled and factored at the corner when found
      type(increment_t), intent(out) :: report
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      integer, parameter :: max_tries = 40
      real(wp), parameter :: at_once = 1.0e-8_wp !! of an increment
      type(state_t) :: beyond
      type(control_t) :: part
      real(wp), allocatable :: before(:), after(:), ends(:)
      type(bracket_t) :: bracket
      real(wp) :: fraction
      integer :: try, k, first
      logical :: changed

      found = .false.
      call take_increment(problem, start, control, beyond, system, report, timers, keep_contact=.true.)
      if (.not. report%converged) return
      after = signs(problem, start%active, beyond, system)
      call linearise(problem, start, start, system, timers)
      before = signs(problem, start%active, start, system)
      first = 0
      fraction = 1.0_wp
      do k = 1, size(after)
         if (after(k) >= 0.0_wp .or. before(k) < 0.0_wp) cycle
         if (before(k) / (before(k) - after(k)) >= fraction) cycle
         fraction = before(k) / (before(k) - after(k))
         first = k
      end do
      if (first == 0) return
      allocate (corner(0))
      ends = after
      bracket = new_bracket(before(first), after(first))
      part = control
      place = start
      do try = 1, max_tries
         fraction = bracket_guess(bracket)
         part%increment = fraction * control%increment
         call take_increment(problem, start, part, place, system, report, timers, keep_contact=.true.)
         if (.not. report%converged) return
         after = signs(problem, start%active, place, system)
         found = abs(after(first)) <= problem%model%step(problem%step)%locate_tolerance * bracket%scale &
            & .or. bracket%high - bracket%low <= epsilon(fraction)
         ! The corner counts only if nothing else has changed its sign on the way.
         if (found) exit
         call bracket_update(bracket, fraction, after(first), changed)
         call linearise(problem, start, start, system, timers)
      end do
      if (found) found = all(after >= -1.0e-6_wp .or. before < 0.0_wp)
      if (.not. found) return
      do k = 1, size(after)
         ! As near to its change of sign as the one that was looked for.
         if (after(k) >= huge(1.0_wp) .or. before(k) < 0.0_wp .or. ends(k) >= 0.0_wp) cycle
         if (k /= first .and. after(k) > at_once * (before(k) - ends(k))) cycle
         corner = [corner, corner_t(k - merge(problem%candidates%n, 0, k > problem%candidates%n), k > problem%candidates%n)]
      end do
      ! Nor if a contact has spread meanwhile.
      beyond = place
      call spread_contacts(problem, beyond, changed)
      found = .not. changed
      if (.not. found) return
      do k = 1, size(corner)
         if (corner(k)%inside) call touch_inside(problem, control, corner(k), place, system, timers)
      end do
      ! What touches at a node does so in the elements on both sides.
      corner = pack(corner, [(all(corner(:k - 1)%candidate /= corner(k)%candidate), k=1, size(corner))])
   end subroutine find_corner

   !> Brings the nearer node of an element to the point of first contact, and the path to where that node touches.
   subroutine touch_inside(problem, control, corner, place, system, timers)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(corner_t), intent(inout) :: corner  !! at the node on return
      type(state_t), intent(inout) :: place
      type(system_t), intent(inout) :: system  !! factored at `place` on entry and on return
      type(timers_t), intent(inout) :: timers
      real(wp), parameter :: at_node = 0.05_wp !! of an element
      real(wp) :: least, tau, length, none(3, size(place%u, 2))
      integer :: next
      logical :: ok
      associate (c => corner%candidate)
         next = problem%candidates%neighbour(2, c)
         call least_gap_after(problem, place, c, least, tau)
         associate (s => place%geometry%element(problem%candidates%element(2, c))%s)
            length = s(2) - s(1)
         end associate
         ! At a node, or next to it, that node is the contact, held or not. Elsewhere the nearer one that can comes.
         if (tau > 1.0_wp - at_node .or. (tau > 0.5_wp .and. problem%candidates%may_slide(next)) .or. &
            & (tau > at_node .and. .not. problem%candidates%may_slide(c))) then
            c = next
            tau = tau - 1.0_wp
         end if
         corner%inside = .false.
         if (.not. problem%candidates%may_slide(c)) return
         none = 0.0_wp
         call move_node(problem, control, none, 1.0_wp, c, tau * length, place, system, ok, timers)
         if (ok) call follow_to_touch(problem, c, place, system, timers)
      end associate
   end subroutine touch_inside

   !> Follows the path from a state nearby to where the gap of an open candidate vanishes. Where that fails nothing changes.
   subroutine follow_to_touch(problem, candidate, place, system, timers)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      type(state_t), intent(inout) :: place
      type(system_t), intent(inout) :: system  !! factored at `place` on entry and on return
      type(timers_t), intent(inout) :: timers
      integer, parameter :: most = 10
      type(state_t) :: state
      real(wp) :: row(3, size(place%u, 2)), x(system%n), y(1 + system%n_slides), tangency(system%n_slides)
      integer :: iteration
      logical :: ok
      state = place
      do iteration = 1, most
         ok = abs(system%gap(candidate)) <= gap_tolerance * problem%size .and. max(system%force_residual, &
            & system%defect_residual) <= problem%model%step(problem%step)%tolerance
         if (ok) exit
         row = 0.0_wp
         row(1:2, problem%candidates%node(candidate)) = system%normal(:, candidate)
         call set_path_row(problem, system, row, -dot_product(system%normal(:, candidate), system%motion(:, candidate)))
         if (system%n_slides > 0) tangency = -system%tangency
         call solve_bordered(problem, system, -system%residual, system%value, -system%gap(candidate), tangency, x, y, ok, timers)
         if (ok) ok = slide_fraction(problem, state, system, y(2:)) >= 1.0_wp
         if (.not. ok) exit
         call apply_increment(problem, system, x, y, state)
         call linearise(problem, state, place, system, timers)
         ok = system%ok .and. system%n_slides == size(tangency)
         if (.not. ok) exit
      end do
      if (ok) place = state
      if (.not. ok) call linearise(problem, place, place, system, timers)
   end subroutine follow_to_touch

   !> Changes the set at a corner and returns the direction in which the path goes on: where the new reactions grow, or the
   !> new gaps open.
   subroutine leave_corner(problem, corner, place, system, heading, ok, timers)
      type(problem_t), intent(in) :: problem
      type(corner_t), intent(in) :: corner(:)
      type(state_t), intent(inout) :: place    !! its contact set is changed
      type(system_t), intent(inout) :: system  !! factored at `place` on entry, there with the new set on return
      type(heading_t), intent(inout) :: heading !! of the old path on entry, of the new one on return
      logical, intent(out) :: ok
      type(timers_t), intent(inout) :: timers
      real(wp) :: rate, none(3, size(place%u, 2))
      integer :: k
      do k = 1, size(corner)
         associate (candidate => corner(k)%candidate)
            place%active(candidate) = .not. place%active(candidate)
            place%reaction(candidate) = 0.0_wp
         end associate
      end do
      call linearise(problem, place, place, system, timers)
      ok = system%ok
      if (.not. ok) return
      rate = 0.0_wp
      do k = 1, size(corner)
         associate (candidate => corner(k)%candidate)
            if (place%active(candidate)) then
               rate = rate + reaction_rate(problem, system, candidate)
            else
               rate = rate + gap_rate(problem, system, candidate)
            end if
         end associate
      end do
      none = 0.0_wp
      ! Rates are per unit of load factor.
      heading = heading_at(problem, system, none, sign(1.0_wp, rate))
   end subroutine leave_corner

   !> Reactions of active candidates, gaps of open ones, then smallest gaps inside elements of sliding contacts: all
   !> positive while the set holds; candidates and elements that cannot tell are far positive.
   function signs(problem, active, state, system) result(value)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), allocatable :: value(:)
      real(wp) :: tau
      integer :: c, next, n
      logical :: sliding
      n = problem%candidates%n
      allocate (value(2 * n), source=huge(1.0_wp))
      do c = 1, n
         sliding = problem%model%contact(problem%candidates%contact(c))%sliding
         next = problem%candidates%neighbour(2, c)
         if (problem%candidates%bilateral(c)) cycle
         if (active(c)) then
            value(c) = state%reaction(c) / max(system%force_scale, tiny(1.0_wp))
         else if (.not. sliding) then
            value(c) = system%opening(c) / problem%size
         end if
         if (.not. sliding .or. next == 0) cycle
         if (active(c) .or. active(next)) cycle
         call least_gap_after(problem, state, c, value(n + c), tau)
         value(n + c) = value(n + c) / problem%size
      end do
   end function signs
end module contact_corner
