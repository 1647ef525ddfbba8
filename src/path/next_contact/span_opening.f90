!> Opening of a free span in a line contact. A line contact lifts off where its contact force would become tensile: at zero pressure
!> a free span begins with zero length and undetermined ends. Local laws give the first ends from the zone of tensile contact force
!> slightly further along the path. The gap w of the free span has EI w'''' = -r, with x along the rod and the density r of the
!> line's contact force, positive in compression; r1, r2 > 0:
!>
!>   inside the line, tensile for |x| < x0, r = r2 (x^2 - x0^2)/2:
!>                               w = r2 (a^2 - x^2)^3/(720 EI) for |x| < a = sqrt(5) x0;
!>   at its end, x from the end into the line, tensile for 0 < x < x0, r = r1 (x - x0):
!>                               w = r1 x^2 (l - x)^3/(120 EI) for 0 < x < l = 5 x0/3; a point contact stays at x = 0;
!>   at a clamp on the obstacle: the same, x from the clamp.
!>
!> At a symmetry plane half of the first law applies. Where a force F lifts the end of a line contact that is fixed at a segment
!> boundary, the line is pressed, r > 0, and w = T x^3/(6 EI) - r x^4/(24 EI) with x from its new end: l = 2 F/r, T = F at a free
!> end of the rod, l = 3 F/(2 r), T = F/2 at a symmetry plane. Between two line contacts each of them takes half of F. If a support
!> lifts the end by d instead, the same shape has l^4 = 24 EI d/r if the rod can rotate there, 72 EI d/r if the support, or the line
!> contact beyond, fixes its rotation. If l is larger than the line, for instance at a straight wall without pressure, a point
!> contact remains at its other end. Newton's method then finds the ends.
module span_opening
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, may_react, candidate_gap
   use conforming_span, only: conforming_forces, node_track, track_sense
   use obstacle_track, only: track_t
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: begun, lost, opened, end_moved, shrunk, numbered, same_set
   use span_candidates, only: present_contact_spans
   use line_pressure, only: pressure_t, sample_line, density_at
   use test_kinds, only: span_test_t, test_force, test_pressure, test_couple, test_slack, well_below
   use breakpoint_forces, only: breakpoint_force, breakpoint_couple
   use lifted_node, only: inside_line, lifted_beside
   use next_spans, only: next_t, new_next, settle, holds
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   implicit none
   private
   public :: open_line

   integer, parameter :: samples = 64           !! samples of the density along a line contact
   real(wp), parameter :: whole_zone = sqrt(5.0_wp), half_zone = 5.0_wp / 3.0_wp  !! free span / tensile zone, lengths

contains

   !> Finds the equilibrium with the free span open, from a state with tensile contact force on a line contact. Not found if the
   !> tensile zone is too long for the local laws, or if nothing of the line contact remains.
   subroutine open_line(problem, place, beyond, test, scale, number, next, found)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: place           !! state of `problem` in equilibrium at which the test is zero
      type(state_t), intent(in) :: beyond          !! equilibrium slightly further along the path
      type(span_test_t), intent(in) :: test        !! test of pressure, couple or force, below zero at `beyond`
      real(wp), intent(in) :: scale                !! scale of forces
      integer, intent(in) :: number                !! number of the first new contact span
      type(next_t), intent(out) :: next            !! the set with the span open, at the load factor of `beyond`
      logical, intent(out) :: found
      type(contact_span_t), allocatable :: contact_span(:)
      if (test%kind == test_force .or. test%kind == test_couple) then
         call lifted_touches(problem, beyond, test%candidate, test%kind == test_couple, contact_span)
         if (allocated(contact_span)) contact_span = numbered(contact_span, number - 1)
      else
         call opened_touches(problem, place, beyond, scale, number, contact_span)
      end if
      found = allocated(contact_span)
      if (.not. found) return
      next = new_next(problem, beyond, contact_span)
      call settle(next, found)
      if (found) found = holds(next)
   end subroutine open_line

   !> Determines the contact spans after the opening of all free spans that open at the same point of the path, for instance two in
   !> a symmetric structure. Not allocated if the local laws do not apply.
   subroutine opened_touches(problem, place, state, scale, number, contact_span)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: place           !! state at which the span opens
      type(state_t), intent(in) :: state           !! state beyond
      real(wp), intent(in) :: scale                !! scale of forces
      integer, intent(in) :: number                !! number of the first new contact span
      type(contact_span_t), allocatable, intent(out) :: contact_span(:)
      type(contact_span_t), allocatable :: before(:), now(:), set(:)
      real(wp), allocatable :: zone(:, :)
      real(wp) :: nothing
      integer :: k, i, rest
      logical :: told
      now = present_contact_spans(problem, state)
      before = present_contact_spans(problem, place)
      nothing = well_below * test_slack(test_pressure) * scale / problem%size
      set = now
      do k = 1, size(now)
         if (.not. now(k)%line) cycle
         zone = pulled_zones(problem, state, now(k))
         rest = k
         do i = 1, size(zone, 2)
            if (least_density(problem, place, before(k), zone(:, i)) > nothing) cycle
            ! The span opens inside and reaches an end of the line contact only further along the path.
            if (reaches_end(problem, place, before(k), now(k), zone(:, i), nothing)) return
            call open_zone(problem, state, now(k), zone(:, i), set, rest, told)
            if (.not. told) return
         end do
      end do
      if (.not. same_set(set, now)) contact_span = numbered(set, number - 1)
   end subroutine opened_touches

   !> True if a zone with tensile contact force now reaches an end of the line contact at which the pressure was positive when the
   !> span opened.
   logical function reaches_end(problem, place, before, now, zone, nothing) result(reaches)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: place           !! state at which the span opens
      type(contact_span_t), intent(in) :: before, now     !! the line contact at `place`, and beyond
      real(wp), intent(in) :: zone(2)              !! tensile zone beyond
      real(wp), intent(in) :: nothing              !! density that counts as zero
      reaches = zone(1) <= now%at(1) .and. density_at(problem, place, before, before%at(1)) > nothing
      reaches = reaches .or. zone(2) >= now%at(2) .and. density_at(problem, place, before, before%at(2)) > nothing
   end function reaches_end

   !> Opens a free span at one zone of a line contact with tensile contact force.
   subroutine open_zone(problem, state, line, zone, set, rest, told)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! line contact with its ends in the present state
      real(wp), intent(in) :: zone(2)
      type(contact_span_t), allocatable, intent(inout) :: set(:)
      integer, intent(inout) :: rest               !! index of the part of the line contact behind this zone
      logical, intent(out) :: told                 !! false: the local laws do not apply
      real(wp) :: length, part
      integer :: c, side
      logical :: pulled(2)
      length = zone(2) - zone(1)
      pulled = [zone(1) <= line%at(1), zone(2) >= line%at(2)]
      told = length > 0.0_wp
      if (.not. told) return
      if (all(pulled)) then
         ! The whole line contact lifts off; contact remains at ends with compressive forces.
         if (problem%candidates%moves(line%candidate(2))) set = begun(set, line%contact, line%rod_segment, line%at(2))
         if (problem%candidates%moves(line%candidate(1))) then
            set = shrunk(set, rest, line%at(1))
         else
            set = lost(set, rest)
         end if
         return
      else if (.not. any(pulled)) then
         set = opened(set, rest, 0.5_wp * (sum(zone) - whole_zone * length), 0.5_wp * (sum(zone) + whole_zone * length))
         told = set(rest)%at(2) > set(rest)%at(1)
         rest = size(set)
         told = told .and. set(rest)%at(2) > set(rest)%at(1)
         return
      end if
      side = merge(1, 2, pulled(1))
      c = line%candidate(side)
      part = half_zone
      if (problem%candidates%moves(c)) then
         set = begun(set, line%contact, line%rod_segment, line%at(side))
      else if (.not. problem%model%fixed(3, problem%candidates%node(c))) then
         ! No local law exists for a line contact that continues over a segment boundary, or ends at a boundary which fixes its end.
         told = .false.
         return
      else if (free_across(c)) then
         part = whole_zone
      end if
      set = end_moved(set, rest, side, line%at(side) + merge(part, -part, side == 1) * length)
      told = set(rest)%at(2) > set(rest)%at(1)

   contains

      !> True if the supports of a node allow the node to leave the obstacle.
      logical function free_across(c)
         integer, intent(in) :: c
         type(track_t) :: track
         track = node_track(problem, state, c)
         free_across = may_react(problem, c, [-track%tangent(2), track%tangent(1)])
      end function free_across
   end subroutine open_zone

   !> Determines the contact spans after a force or a couple has lifted the ends of line contacts at a segment boundary: the line
   !> contacts then end before the boundary. Not allocated if the local laws do not apply.
   subroutine lifted_touches(problem, state, candidate, by_couple, contact_span)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      logical, intent(in) :: by_couple
      type(contact_span_t), allocatable, intent(out) :: contact_span(:)
      type(contact_span_t), allocatable :: now(:)
      real(wp) :: beside(2), force, lift, length, local(3), x(2), normal(2), bend, angle, density
      integer :: c, e, k, side
      logical :: turns
      force = -breakpoint_force(problem, state, candidate)
      call candidate_gap(problem, state, candidate, lift, normal, bend)
      turns = .not. (problem%model%fixed(3, problem%candidates%node(candidate)) .or. &
         & all(problem%candidates%element(:, candidate) > 0))
      beside = 0.0_wp
      if (inside_line(problem, candidate) .and. (by_couple .or. force > 0.0_wp)) &
         & beside = lifted_beside(problem, state, candidate)
      if (.not. (by_couple .or. force > 0.0_wp .or. lift > 0.0_wp)) return
      now = present_contact_spans(problem, state)
      if (by_couple .and. .not. all(beside > 0.0_wp)) then
         call turned_end(problem, state, candidate, now, contact_span)
         return
      end if
      if (all(problem%candidates%element(:, candidate) > 0)) force = 0.5_wp * force
      do side = 1, 2
         e = problem%candidates%element(side, candidate)
         if (e == 0) cycle
         c = problem%candidates%neighbour(side, candidate)
         if (problem%conforms(e) == 0 .or. c == 0) return
         call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local, x, angle, density)
         k = problem%candidates%contact_span(c)
         length = now(k)%at(2) - now(k)%at(1)
         if (all(beside > 0.0_wp)) then
            length = min(length, beside(side))
         else if (density > 0.0_wp .and. force > 0.0_wp) then
            length = min(length, merge(2.0_wp, 1.5_wp, turns) * force / density)
         else if (density > 0.0_wp) then
            length = min(length, (merge(24.0_wp, 72.0_wp, turns) * lift / (problem%compliance(e)%bending * density))**0.25_wp)
         end if
         now = end_moved(now, k, 3 - side, now(k)%at(3 - side) + merge(-length, length, side == 1))
         ! A line contact without pressure lifts off as a whole; a point contact remains at its other end.
         if (now(k)%at(2) <= now(k)%at(1)) now = shrunk(now, k, now(k)%at(side))
      end do
      contact_span = now
   end subroutine lifted_touches

   !> Determines the contact spans with a line contact that ends before a node with a couple, and a point contact at this node. With
   !> x from the line's end the gap is r x^3 (l - x)/(24 EI), whose slope at the node is negligible, and its moment there, -r l^2/4,
   !> equals the couple. Not allocated if the couple has the opposite sense.
   subroutine turned_end(problem, state, candidate, now, contact_span)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(contact_span_t), intent(in) :: now(:)
      type(contact_span_t), allocatable, intent(out) :: contact_span(:)
      real(wp) :: couple, length, local(3), x(2), angle, density
      integer :: side, k, e
      k = problem%candidates%contact_span(candidate)
      side = findloc(now(k)%candidate == candidate, .true., 1)
      e = problem%candidates%element(3 - side, candidate)
      if (e == 0) return
      call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 2), local, x, angle, density)
      couple = merge(-1.0_wp, 1.0_wp, side == 1) * breakpoint_couple(problem, state, candidate) * &
         & track_sense(problem, state, candidate, node_track(problem, state, candidate))
      length = now(k)%at(2) - now(k)%at(1)
      if (.not. (couple > 0.0_wp .and. 2.0_wp * sqrt(couple / max(density, tiny(density))) < length)) return
      length = 2.0_wp * sqrt(couple / density)
      contact_span = end_moved(begun(now, now(k)%contact, now(k)%rod_segment, now(k)%at(side)), k, side, now(k)%at(side) + &
         & merge(length, -length, side == 1))
   end subroutine turned_end

   !> Zones of a line contact with tensile contact force, in order along the rod.
   function pulled_zones(problem, state, line) result(zone)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! line contact with its ends in the present state
      real(wp), allocatable :: zone(:, :)          !! (2, zones)
      type(pressure_t) :: pressure
      real(wp), allocatable :: at(:), density(:)
      real(wp) :: ends(2)
      integer :: i
      pressure = sample_line(problem, state, line)
      ! Outside its ends a line contact has no tensile force.
      at = [line%at(1), pressure%at, line%at(2)]
      density = [0.0_wp, pressure%density, 0.0_wp]
      allocate (zone(2, 0))
      do i = 2, size(at) - 1
         if (density(i) >= 0.0_wp) cycle
         if (density(i - 1) >= 0.0_wp) ends(1) = zero_between(at(i), at(i - 1))
         if (density(i + 1) < 0.0_wp) cycle
         ends(2) = zero_between(at(i), at(i + 1))
         zone = reshape([zone, ends], [2, size(zone, 2) + 1])
      end do

   contains

      !> End of a zone of tensile contact force, between a place with tensile and a place with compressive force.
      real(wp) function zero_between(negative, positive) result(zero)
         real(wp), intent(in) :: negative, positive !! places
         type(bracket_t) :: bracket
         associate (low => min(negative, positive), high => max(negative, positive))
            bracket = new_bracket(density_at(problem, state, line, low), density_at(problem, state, line, high), low, high)
         end associate
         do while (next_guess(bracket, spacing(max(abs(negative), abs(positive))), zero))
            call take_value(bracket, zero, density_at(problem, state, line, zero))
         end do
      end function zero_between
   end function pulled_zones

   !> Least contact force density in a zone of a line contact.
   real(wp) function least_density(problem, state, line, zone) result(least)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! line contact with its ends in the present state
      real(wp), intent(in) :: zone(2)              !! tensile zone of another state
      real(wp) :: ends(2)
      integer :: i
      ends = min(max(zone, line%at(1)), line%at(2))
      least = minval([(density_at(problem, state, line, ends(1) + (ends(2) - ends(1)) * i / samples), i=0, samples)])
   end function least_density
end module span_opening
