!> Test values of a path point, and the events detected from them: limit points, bifurcations, contact regions that appear or
!> vanish, prescribed values. An event is the zero of a function of the state; a change of its sign between two points indicates the
!> event.
!>
!> Corners of the force laws of stops and of foundations at nodes are events, too: the penetration passes from one segment of the
!> law to the next, and the stiffness jumps.
module path_events
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, touching_gap
   use rod_state, only: state_t, candidate_opening
   use linear_system, only: system_t
   use monitors, only: monitor_values, monitor_rate
   use contact_regions, only: region_of, resolved_contact
   use ground_regions, only: find_ground_regions, regions_on_moved_nodes
   use contact_labels, only: contact_gained, contact_lost, contact_words
   use ground_events, only: ground_event_t, find_ground_events, find_roots, ground_event_value
   use path_record, only: region_t
   use force_law, only: law_segment, first_corner
   implicit none
   private
   public :: test_values_t, event_t, new_test_values, detect_events, value_events, event_value, note_of_corner, test_value, &
      & event_limit, event_bifurcation, event_release, event_turning, event_contact, event_value_reached, event_stop, &
      & law_corner_t, corner_between

   integer, parameter :: event_limit = 1, event_bifurcation = 2, event_contact = 3, event_value_reached = 4, event_stop = 5, &
      & event_turning = 6, event_release = 7

   character(*), parameter :: note_of_corner = 'limit point of the load, at a corner of the path'
   real(wp), parameter :: at_rest = 1.0e-6_wp !! if the function of a contact event is at the start of the increment at most this
   !! part of its value at the end, the contact counts as without force or gap at the start

   !> Test values of one point of the path. Events are found by comparing them with those of the next point.
   type :: test_values_t
      real(wp) :: load_factor = 0.0_wp
      real(wp) :: load_rate = 0.0_wp          !! d(load factor)/d(arc length) along the path
      integer :: negative_pivots = 0
      integer :: opening = 0 !! number of unstable directions that open line contacts without pressure (force_free_contact)
      logical :: weak = .false.               !! true: there is a line contact without pressure
      real(wp), allocatable :: monitor(:)
      real(wp), allocatable :: monitor_rate(:) !! (step%turning) d(monitor)/d(arc length) of those monitors whose turning points are
      !! requested
      logical, allocatable :: active(:)       !! (candidates) true: contact at the node, within the resolution of the mesh
      type(region_t), allocatable :: grounded(:) !! regions of contact with distributed foundations
   end type test_values_t

   !> A corner between two straight segments of the force law at one candidate.
   type :: law_corner_t
      integer :: candidate = 0                   !! candidate whose law has the corner; 0: no corner
      real(wp) :: penetration = 0.0_wp           !! penetration at the corner [length], negative where the law acts in tension
   end type law_corner_t

   !> An event between two points of the path.
   type :: event_t
      integer :: kind = 0                        !! kind of the event: event_...
      character(2) :: label = ''
      integer :: monitor = 0 !! value events: index of the monitor, 0: load factor; turning points: index into step%turning
      real(wp) :: value = 0.0_wp                 !! value events: the prescribed value
      integer :: number = 0 !! bifurcation, release: which eigenvalue changes its sign, counted in ascending order
      integer :: least = 0, most = 0 !! smaller and larger number of negative pivots (release: of `opening`) at the two ends of the
      !! increment
      integer :: pivots = 0                   !! number of negative pivots at the located point
      logical, allocatable :: marked(:)       !! contact: true for the candidates whose contact changes
      logical :: divided = .false.            !! contact: true: a region splits, or two regions merge
      type(ground_event_t) :: ground          !! contact with a distributed foundation: the change and its position
      real(wp) :: gap_scale = 1.0_wp, reaction_scale = 1.0_wp !! contact: reference values, by which gap and reaction are divided in
      !! the event function
      logical :: corner = .false. !! limit point: true: at a corner of the path; the load rate jumps from one sign to the other
      type(law_corner_t) :: law !! limit point: the corner of a force law at a node that causes the corner of the path, if any
      logical :: meets = .false. !! limit point: true: the point is a bifurcation instead. The path is a branch that has its extreme
      !! load there and meets the path on which branches start
      logical :: jumps = .false. !! bifurcation: true: the eigenvalue jumps from one sign to the other because a line contact
      !! becomes a point contact
      logical :: prescribed = .false. !! value events: true: the value was prescribed in Newton's method and is met to rounding
      logical :: steady_load = .false. !! true: the load rate is almost constant over the increment, so that the load can measure
      !! fractions of the increment
      real(wp) :: scale = 1.0_wp !! reference value of the event function, to which the tolerance of its zero is related
      real(wp) :: before = 0.0_wp, after = 0.0_wp !! event function at the start and at the end of the increment
      character(:), allocatable :: note
   end type event_t

contains

   !> Test values at a converged point. The caller gives the load rate, because its sign depends on the sense in which the path is
   !> followed.
   function new_test_values(problem, state, system, load_rate) result(test_values)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: load_rate !! d(load factor)/d(arc length)
      type(test_values_t) :: test_values
      integer :: i
      test_values%load_factor = state%load_factor
      test_values%load_rate = load_rate
      test_values%negative_pivots = system%negative_pivots
      associate (turning => problem%model%step(problem%step)%turning)
         allocate (test_values%monitor_rate(size(turning)))
         do i = 1, size(turning)
            test_values%monitor_rate(i) = load_rate * monitor_rate(problem, turning(i), state, system)
         end do
      end associate
      test_values%monitor = monitor_values(problem, state, system)
      ! Changes of contact spans are separate events (span_changes).
      test_values%active = resolved_contact(problem, state) .and. problem%candidates%contact_span == 0
      test_values%grounded = find_ground_regions(problem, state)
   end function new_test_values

   !> Detects all events between two neighbouring points.
   subroutine detect_events(problem, step, before, after, from, to, events)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(test_values_t), intent(in) :: before, after
      type(state_t), intent(in) :: from, to
      type(event_t), allocatable, intent(out) :: events(:)
      type(event_t), allocatable :: kept(:), values(:)
      type(event_t) :: event
      integer :: i, least, most
      logical :: steady
      allocate (events(0))
      least = min(before%negative_pivots, after%negative_pivots)
      most = max(before%negative_pivots, after%negative_pivots)
      if (before%load_rate * after%load_rate < 0.0_wp) then
         event = event_t(kind=event_limit, label='LP')
         event%note = 'limit point of the load'
         call append(event)
         ! A limit point explains one change of sign of an eigenvalue. If several eigenvalues change their sign, the events must be
         ! located first: their positions show which eigenvalue belongs to the limit point.
         if (most == least + 1) most = least
      end if
      do i = least + 1, most
         event = event_t(kind=event_bifurcation, label='BP', number=i, least=least, most=most)
         event%note = 'bifurcation'
         call append(event)
      end do
      if (before%weak .and. after%weak) then
         do i = min(before%opening, after%opening) + 1, max(before%opening, after%opening)
            event = event_t(kind=event_release, label='BP', number=i, least=min(before%opening, after%opening), &
               & most=max(before%opening, after%opening))
            event%note = 'bifurcation, one-sided: contacts without force open'
            call append(event)
         end do
      end if
      do i = 1, size(step%turning)
         if (before%monitor_rate(i) * after%monitor_rate(i) >= 0.0_wp) cycle
         event = event_t(kind=event_turning, label='TP', monitor=i)
         event%note = 'turning point of '//trim(problem%model%monitor(step%turning(i))%name)
         call append(event)
      end do
      ! If contact at nodes has become contact spans, the two points have different candidates; span_changes reports this change.
      if (size(before%active) == size(after%active)) then
         if (any(before%active .neqv. after%active)) &
            & call detect_contact_events(problem, from, to, before%active, after%active, events)
      end if
      if (problem%ground%chain%n > 0) call add_ground_events()
      call value_events(problem, step, before, after, from, to, values)
      events = [events, values]
      steady = before%load_rate * after%load_rate > 0.0_wp .and. &
         & (after%load_factor - before%load_factor) * before%load_rate > 0.0_wp .and. &
         & min(abs(before%load_rate), abs(after%load_rate)) > 0.3_wp * max(abs(before%load_rate), abs(after%load_rate))
      do i = 1, size(events)
         events(i)%steady_load = steady
         events(i)%pivots = after%negative_pivots
         events(i)%before = event_value(problem, events(i), from, before)
         events(i)%after = event_value(problem, events(i), to, after)
      end do
      ! At an unloaded start a contact without force opens or transmits force under any load: this is not an event.
      if (any(abs(from%z) > 0.0_wp)) return
      allocate (kept(0))
      do i = 1, size(events)
         if (events(i)%kind == event_contact .and. (abs(events(i)%before) <= at_rest * abs(events(i)%after) .or. &
            & abs(events(i)%before) * events(i)%gap_scale <= touching_gap(problem))) cycle
         kept = [kept, events(i)]
      end do
      call move_alloc(kept, events)

   contains

      !> Appends the changes of contact with distributed foundations.
      subroutine add_ground_events()
         type(ground_event_t), allocatable :: found(:)
         integer :: k
         call find_ground_events(problem, regions_on_moved_nodes(problem, from, to, before%grounded), after%grounded, found)
         do k = 1, size(found)
            event = event_t(kind=event_contact, label=found(k)%label)
            event%ground = found(k)
            call find_roots(problem, from, to, event%ground)
            event%divided = found(k)%divided
            allocate (event%marked(problem%candidates%n), source=.false.)
            event%note = contact_words(event%label, event%divided)
            event%note = trim(event%note)
            event%gap_scale = max(abs(ground_event_value(problem, from, event%ground)), &
               & abs(ground_event_value(problem, to, event%ground)), tiny(1.0_wp))
            call append(event)
         end do
      end subroutine add_ground_events

      subroutine append(new)
         type(event_t), intent(in) :: new
         events = [events, new]
      end subroutine append
   end subroutine detect_events

   !> Detects events of prescribed values between two neighbouring points, including those that end the step.
   subroutine value_events(problem, step, before, after, from, to, events)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(test_values_t), intent(in) :: before, after
      type(state_t), intent(in) :: from, to
      type(event_t), allocatable, intent(out) :: events(:)
      type(event_t) :: event
      integer :: i
      allocate (events(0))
      do i = 1, size(step%locate)
         event = event_t(kind=event_value_reached, label='UZ', monitor=step%locate(i)%monitor, value=step%locate(i)%value)
         event%note = 'value asked for'
         if (crosses(event)) events = [events, event]
      end do
      do i = 1, size(step%stop)
         event = event_t(kind=event_stop, label='EP', monitor=step%stop(i)%monitor, value=step%stop(i)%value)
         event%note = 'end of the step'
         if (.not. crosses(event)) cycle
         if ((test_value(after, event) > test_value(before, event)) .eqv. step%stop(i)%rising) events = [events, event]
      end do
      do i = 1, size(events)
         events(i)%pivots = after%negative_pivots
         events(i)%before = event_value(problem, events(i), from, before)
         events(i)%after = event_value(problem, events(i), to, after)
      end do

   contains

      !> True if the increment passes or reaches the value.
      pure logical function crosses(candidate)
         type(event_t), intent(in) :: candidate
         real(wp) :: from_value, to_value
         from_value = test_value(before, candidate) - candidate%value
         to_value = test_value(after, candidate) - candidate%value
         ! A point may have exactly the prescribed value; the increment that starts there does not pass the value.
         crosses = from_value * to_value < 0.0_wp .or. (abs(from_value) > 0.0_wp .and. abs(to_value) <= 0.0_wp)
      end function crosses
   end subroutine value_events

   !> Detects contact regions at nodes that appear, vanish, split or merge between two states.
   subroutine detect_contact_events(problem, from, to, earlier, later, events)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      logical, intent(in) :: earlier(:), later(:) !! (candidates) true: contact within the resolution of the mesh, at the earlier
      !! and the later state
      type(event_t), allocatable, intent(inout) :: events(:)
      call compare(earlier, later, contact_lost)
      call compare(later, earlier, contact_gained)

   contains

      !> Appends an event for each region of `there` that has no counterpart among the regions of `other`, or several.
      subroutine compare(there, other, label)
         logical, intent(in) :: there(:), other(:)
         character(2), intent(in) :: label
         logical, allocatable :: done(:), region(:), near(:), counted(:)
         type(event_t) :: event
         integer :: c, parts, k
         done = .not. there
         do c = 1, size(there)
            if (done(c)) cycle
            region = region_of(problem, there, c)
            done = done .or. region
            near = widened(widened(region)) .and. other
            counted = .not. near
            parts = 0
            do k = 1, size(near)
               if (counted(k)) cycle
               parts = parts + 1
               counted = counted .or. region_of(problem, other, k)
            end do
            if (parts == 1) cycle
            event = event_t(kind=event_contact, label=label)
            event%marked = region
            if (parts > 1) then
               event%marked = region .and. .not. other
               event%divided = .true.
               ! All candidates of the region are in `other`, too; a second region of `other` is only close to it.
               if (.not. any(event%marked)) cycle
            end if
            event%note = contact_words(label, event%divided)
            event%reaction_scale = max(sum(from%reaction, mask=event%marked), sum(to%reaction, mask=event%marked), tiny(1.0_wp))
            event%gap_scale = max(abs(smallest_gap(problem, from, event%marked)), &
               & abs(smallest_gap(problem, to, event%marked)), tiny(1.0_wp))
            events = [events, event]
         end do
      end subroutine compare

      !> The set with the neighbours of each of its candidates.
      function widened(set) result(wide)
         logical, intent(in) :: set(:)
         logical :: wide(size(set))
         integer :: c, i, k
         wide = set
         do c = 1, size(set)
            if (.not. set(c)) cycle
            do i = 1, 2
               k = problem%candidates%neighbour(i, c)
               if (k > 0) wide(k) = .true.
            end do
         end do
      end function widened
   end subroutine detect_contact_events

   !> Event function at a state; the event is its zero.
   real(wp) function event_value(problem, event, state, test_values) result(value)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: state
      type(test_values_t), intent(in) :: test_values
      select case (event%kind)
      case (event_limit)
         value = test_values%load_rate
         if (event%law%candidate > 0) value = beyond_corner(problem, state, event%law) / problem%size
      case (event_bifurcation)
         ! For a bifurcation only the sign of the eigenvalue is known here, from the count of negative pivots; module smooth_zero
         ! computes the eigenvalue.
         value = merge(-1.0_wp, 1.0_wp, event%number <= test_values%negative_pivots)
      case (event_release)
         value = merge(-1.0_wp, 1.0_wp, event%number <= test_values%opening)
      case (event_turning)
         value = test_values%monitor_rate(event%monitor)
      case (event_contact)
         if (event%ground%contact > 0) then
            value = ground_event_value(problem, state, event%ground) / event%gap_scale
         else if (event%divided) then
            ! A region is undivided as long as all its candidates are in contact.
            value = minval(state%reaction, mask=event%marked) / event%reaction_scale
            if (any(event%marked .and. .not. state%active)) value = -max(0.0_wp, &
               & maxval(openings(problem, state), mask=event%marked .and. .not. state%active)) / event%gap_scale
         else if (any(state%active .and. event%marked)) then
            value = sum(state%reaction, mask=event%marked) / event%reaction_scale
         else
            value = -smallest_gap(problem, state, event%marked) / event%gap_scale
         end if
      case default
         value = test_value(test_values, event) - event%value
      end select
   end function event_value

   !> Smallest gap of the given candidates. Contact at nodes begins where a node meets the obstacle; the rod between the nodes does
   !> not count.
   real(wp) function smallest_gap(problem, state, marked) result(smallest)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: marked(:)
      smallest = minval(openings(problem, state), mask=marked)
   end function smallest_gap

   !> (candidates) gaps; on coupled ground to its settled surface.
   function openings(problem, state) result(opening)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: opening(problem%candidates%n)
      integer :: c
      opening = [(candidate_opening(problem, state, c), c=1, size(opening))]
   end function openings

   !> Load factor or monitor to which a value event refers.
   pure real(wp) function test_value(test_values, event)
      type(test_values_t), intent(in) :: test_values
      type(event_t), intent(in) :: event
      if (event%monitor == 0) then
         test_value = test_values%load_factor
      else
         test_value = test_values%monitor(event%monitor)
      end if
   end function test_value

   !> Corner of a force law that is passed between two states. Of the first candidate whose penetrations at the two states lie on
   !> different segments of its law, it is the corner nearest to the first state.
   type(law_corner_t) function corner_between(problem, from, to) result(corner)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      integer :: c, first, last, k
      do c = 1, problem%candidates%n
         associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(c)))
            if (obstacle%law == 0) cycle
            associate (law => problem%model%law(obstacle%law))
               first = law_segment(law, penetration(problem, from, c))
               last = law_segment(law, penetration(problem, to, c))
               if (first == last) cycle
               k = first_corner(first, last)
               corner%candidate = c
               corner%penetration = sign(law%penetration(abs(k)), real(k, wp))
            end associate
         end associate
         return
      end do
   end function corner_between

   !> Event function of a corner: the penetration at a state minus the penetration of the corner [length].
   real(wp) function beyond_corner(problem, state, corner) result(beyond)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(law_corner_t), intent(in) :: corner   !! corner with candidate > 0
      beyond = penetration(problem, state, corner%candidate) - corner%penetration
   end function beyond_corner

   !> Penetration of a node into its obstacle; 0 if the gap is open. If the law also acts in tension, the penetration is negative in
   !> tension.
   real(wp) function penetration(problem, state, candidate) result(depth)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      depth = -candidate_opening(problem, state, candidate)
      if (.not. problem%candidates%bilateral(candidate)) depth = max(depth, 0.0_wp)
   end function penetration
end module path_events
