!> Corners of the path.
!>
!> At a corner of the first kind, contact at nodes changes. Such a corner is accepted as a point, and the path continues with the
!> new contact set (turn_corner).
!>
!> Behind a limit point the linear complementarity problem (LCP) of an increment may have no solution: along the tangent a contact
!> has to open, but the path without that contact continues in a direction with a negative component along the tangent, so that no
!> increment of the given length exists. The contact set is therefore kept until the first reaction or gap with the wrong sign is
!> zero: this zero is the corner. Then the set is changed, and the new tangent has the direction in which the new gap opens or the
!> new reaction grows.
!>
!> At a corner of the second kind, contact with foundations begins or ends. For example, a free end that reaches stiff soil stops
!> moving almost at once. A halved increment never ends close to such a corner. But the tangents at the two ends of an increment
!> across the corner intersect near the corner and give its distance. The next increment therefore ends at the corner, and the
!> following one passes it.
module corner_turning
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_regions, only: find_regions
   use path_control, only: is_arc_length, control_t, path_length
   use corrector, only: increment_t
   use path_point, only: path_point_t, point_at, advance, evaluate_tests
   use path_state, only: path_state_t, path_tangent_of
   use settle_findings, only: arrival_t
   use path_acceptance, only: accept
   use corner_limit, only: check_return
   use trial_request, only: request_t
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t
   use path_continuity, only: path_tangent_at, relate, same_path, length_to_corner
   use node_contact_functional, only: reaction_rate, gap_rate
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use contact_labels, only: contact_label
   use span_tests, only: spans_hold
   use step_control, only: smallest
   use displacement_functional, only: watched_displacement
   implicit none
   private
   public :: turn_corner, corner_t, find_corner_ahead, is_too_near, part_before, differ

   real(wp), parameter :: least_load = 0.01_wp !! largest change of the load factor in the first increment behind a corner, over the
   !! load factor

   !> Corner of the path, predicted by the trial increments from one point.
   type :: corner_t
      real(wp) :: length = -1.0_wp               !! arc length from the point to the corner by the last trial; negative: no corner
      real(wp) :: before = -1.0_wp !! arc length from the point to the corner by the previous trial; negative: no corner
      real(wp) :: chord = 0.0_wp                 !! chord length of the last trial
      logical :: goes_around = .false. !! true: the last trial would be on the path if the corner were at the last accepted point
   end type corner_t

contains

   !> Searches for a change of the contact set at a corner just ahead; if there is one, accepts the corner and continues behind it.
   subroutine turn_corner(problem, step, run, meshes, recorder, request, turned, finished, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      integer, intent(in) :: meshes !! number of meshes made for the errors of the corner. If another mesh is requested, problem and
      !! run are unchanged
      class(recorder_t), intent(inout) :: recorder
      type(request_t), intent(inout) :: request !! requirements of the corner before it can be accepted as a point (smaller
      !! residual, another mesh)
      logical, intent(out) :: turned             !! true: the run is at the corner, with the contact set behind the corner
      logical, intent(out) :: finished           !! true: the step ended at an event before the corner
      type(outcome_t), intent(inout) :: outcome
      type(path_point_t) :: place
      integer, allocatable :: corner(:)          ! candidates that change at the corner
      logical, allocatable :: active(:)          ! contact set behind the corner
      type(increment_t) :: report
      type(arrival_t) :: arrival
      real(wp) :: load
      integer :: k
      finished = .false.
      turned = .false.
      call request%begin_trial()
      if (problem%candidates%n == 0) return
      call find_corner(problem, run%last, run%control, place, corner, report, turned)
      if (.not. turned) return
      place%tangent = path_tangent_of(problem, run, place)
      active = place%state%active
      do k = 1, size(corner)
         active(corner(k)) = .not. active(corner(k))
      end do
      load = abs(run%last_load)
      arrival%report = report
      arrival%tries = meshes
      arrival%label = corner_label(problem, place%state, active)
      arrival%changing = active .neqv. place%state%active
      call accept(problem, step, run, place, arrival, recorder, request, finished, outcome)
      if (finished .or. allocated(outcome%why) .or. request%repeats_increment()) return
      load = max(load, abs(run%last_load), least_load * abs(run%last%state%load_factor))
      call leave_corner(problem, corner, run%last, turned)
      if (.not. turned) then
         outcome%why = 'no way on from where the contact set changes'
      else if (is_arc_length(run%control%method)) then
         ! Behind the corner the structure may be stiffer than before: the load increment is not made larger than the last one
         ! before it.
         if (load < abs(run%last%tangent%load) * run%control%increment) run%control%increment = load / abs(run%last%tangent%load)
      else
         call check_return(problem, step, run, outcome)
      end if
   end subroutine turn_corner

   !> Label of a corner: C+ or C- if the number of contact regions changes; '' if the end of a region moves by one node, which
   !> depends on the mesh.
   character(2) function corner_label(problem, place, active) result(label)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: place         !! state at the corner, with the contact set before it
      logical, intent(in) :: active(:)           !! contact set behind the corner
      type(state_t) :: beyond
      integer :: regions
      beyond = place
      beyond%active = active
      regions = size(find_regions(problem, beyond)) - size(find_regions(problem, place))
      label = contact_label(max(regions, 0), max(-regions, 0))
   end function corner_label

   !> Searches for a corner within one increment from a point. Several candidates may change together, for example by symmetry.
   subroutine find_corner(problem, start, control, place, corner, report, found)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(path_point_t), intent(out) :: place !! point at the corner; converged with the contact set of `start`, with one reaction
      !! or gap about to change its sign
      integer, allocatable, intent(out) :: corner(:) !! candidates whose contact changes at the corner
      type(increment_t), intent(out) :: report
      logical, intent(out) :: found
      real(wp), parameter :: at_once = 1.0e-8_wp !! part of an increment within which sign changes count as simultaneous; with
      !! values from 1E-9 to 1E-7 every deck in input has the same results
      type(path_point_t) :: beyond
      type(control_t) :: part
      real(wp), allocatable :: before(:), after(:), ends(:)
      type(bracket_t) :: bracket
      real(wp) :: fraction
      integer :: k, first

      found = .false.
      call advance(problem, start, control, beyond, report, keep_contact=.true.)
      if (.not. report%converged) return
      after = signs(problem, start%state%active, beyond)
      before = signs(problem, start%state%active, start)
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
      do while (next_guess(bracket, epsilon(fraction), fraction))
         part%increment = fraction * control%increment
         call advance(problem, start, part, place, report, keep_contact=.true.)
         if (.not. report%converged) return
         after = signs(problem, start%state%active, place)
         found = abs(after(first)) <= problem%model%step(problem%step)%locate_tolerance * bracket%scale
         if (found) exit
         call take_value(bracket, fraction, after(first))
      end do
      ! The corner is valid only if no other gap or reaction has changed its sign before it, and if all contacts along the rods pass
      ! their tests.
      if (found) found = all(after >= -1.0e-6_wp .or. before < 0.0_wp)
      if (found .and. problem%has_spans()) found = spans_hold(problem, place%state, place%system%force_scale)
      if (.not. found) return
      do k = 1, size(after)
         ! Other candidates belong to the same corner if their gap or reaction changes its sign there.
         if (after(k) >= huge(1.0_wp) .or. before(k) < 0.0_wp .or. ends(k) >= 0.0_wp) cycle
         if (k /= first .and. after(k) > at_once * (before(k) - ends(k))) cycle
         corner = [corner, k]
      end do
   end subroutine find_corner

   !> Changes the contact set at a corner of the path, where the contact of nodes changes, and orients the tangent in the direction
   !> in which new reactions grow or new gaps open.
   subroutine leave_corner(problem, corner, point, ok)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: corner(:)           !! candidates
      type(path_point_t), intent(inout) :: point !! in: the corner with the old set; out: the same point with the new set
      logical, intent(out) :: ok
      real(wp) :: rate, none(3, size(point%state%u, 2))
      integer :: k
      do k = 1, size(corner)
         associate (candidate => corner(k))
            point%state%active(candidate) = .not. point%state%active(candidate)
            point%state%reaction(candidate) = 0.0_wp
         end associate
      end do
      point = point_at(problem, point%state)
      ok = point%system%ok
      if (.not. ok) return
      rate = 0.0_wp
      do k = 1, size(corner)
         associate (candidate => corner(k))
            if (point%state%active(candidate)) then
               rate = rate + reaction_rate(problem, point%state, point%system, candidate)
            else
               rate = rate + gap_rate(problem, point%system, candidate)
            end if
         end associate
      end do
      none = 0.0_wp
      ! The rates are derivatives with respect to the load factor.
      point%tangent = path_tangent_at(problem, point%system, none, sign(1.0_wp, rate))
      call evaluate_tests(problem, point)
   end subroutine leave_corner

   !> Dimensionless reactions of active candidates, and dimensionless gaps of open candidates: all are positive while the contact
   !> set is valid. A bilateral candidate has no sign condition; its value is `huge`.
   function signs(problem, active, point) result(value)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)
      type(path_point_t), intent(in) :: point
      real(wp) :: value(problem%candidates%n)
      integer :: c
      value = huge(1.0_wp)
      do c = 1, problem%candidates%n
         if (problem%candidates%bilateral(c)) cycle
         if (active(c)) then
            value(c) = point%state%reaction(c) / max(point%system%force_scale, tiny(1.0_wp))
         else
            value(c) = point%system%opening(c) / problem%size
         end if
      end do
   end function signs

   !> Searches for a corner between the last accepted point and a trial.
   subroutine find_corner_ahead(problem, run, trial, corner)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial    !! converged, on the mesh of the last accepted point
      type(corner_t), intent(inout) :: corner
      corner%before = corner%length
      corner%length = -1.0_wp
      associate (from => run%last%state, to => trial%state, before => run%last%tangent, after => trial%tangent)
         corner%chord = path_length(problem, from, to)
         if (.not. run%fresh .and. (differ(from%active, to%active) .or. differ(from%grounded, to%grounded))) &
            & corner%length = length_to_corner(problem, from, to, before, after)
         corner%goes_around = same_path(relate(problem, from, to, before, after, .true.))
      end associate
   end subroutine find_corner_ahead

   !> True if the corner is nearer to the last accepted point than the end of the smallest increment.
   pure logical function is_too_near(problem, step, run, corner)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(corner_t), intent(in) :: corner
      is_too_near = corner%length >= 0.0_wp
      if (is_too_near) is_too_near = increment_for(problem, run, corner%length) < smallest(step, run%control)
   end function is_too_near

   !> Part of a failed increment that is tried next: a half, or the part up to the corner. If an increment up to the corner fails,
   !> the next one is shorter by the uncertainty of the corner's position. If the corner is closer than this uncertainty, increments
   !> are halved, and the tangents of the shorter trials show whether there is a corner.
   pure real(wp) function part_before(problem, step, run, corner) result(part)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(corner_t), intent(in) :: corner
      real(wp) :: length, increment
      part = 0.5_wp
      if (corner%length <= 0.0_wp .or. corner%goes_around) return
      length = corner%length
      if (corner%before > 0.0_wp) length = length - max(abs(length - corner%before), corner%chord - length)
      if (length <= 0.0_wp) return
      increment = increment_for(problem, run, length)
      if (increment < abs(run%control%increment) .and. increment >= smallest(step, run%control)) &
         & part = increment / abs(run%control%increment)
   end function part_before

   !> Increment of the controlled quantity that corresponds to an arc length along the tangent at the last accepted point.
   pure real(wp) function increment_for(problem, run, length) result(increment)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp), intent(in) :: length             !! arc length
      type(state_t) :: there
      increment = length
      if (run%control%method == method_load) increment = length * abs(run%last%tangent%load)
      if (run%control%method /= method_displacement) return
      there = run%last%state
      there%u = there%u + length * run%last%tangent%u
      increment = abs(watched_displacement(problem, there, run%control%monitor) - &
         & watched_displacement(problem, run%last%state, run%control%monitor))
   end function increment_for

   !> True if two contact sets have the same number of candidates but not the same contacts. Sets of different size belong to
   !> different meshes and are not compared.
   pure logical function differ(one, other)
      logical, intent(in) :: one(:), other(:)
      differ = size(one) == size(other)
      if (differ) differ = any(one .neqv. other)
   end function differ
end module corner_turning
