!> Detects and locates the events between the last accepted point and a converged trial. Spurious events, which are artefacts of
!> rounding or of the mesh, are rejected. Events that need a shorter increment are found. The relations between the events of one
!> increment are determined here, too: duplicates, contact changes beside limit points, and the number of negative pivots before
!> each event.
module event_search
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t, copy_path_state, located_event_t
   use known_path, only: find_known_bifurcation
   use path_events, only: test_values_t, event_t, detect_events, value_events, event_limit, test_value, event_bifurcation, &
      & event_release, event_value_reached, event_turning, event_contact
   use tangent_modes, only: apply_tangent
   use event_location, only: locate_event
   use error_bar, only: error_bars_t
   use rod_state, only: state_t
   use force_free_contact, only: count_opening
   use path_control, only: path_length
   use path_continuity, only: largest_turn
   use ground_cuts, only: find_cuts, inner_cuts
   use mesh_request, only: rounding_of
   implicit none
   private
   public :: findings_t, find_events, better_from_nearer, hides_release, turns_by_rounding, check_limit_shift, check_single_path, &
      & duplicates_of, beside, count_before, same_place

   !> Results of the search for events, before anything is recorded.
   type :: findings_t
      type(located_event_t), allocatable :: seen(:)
      logical :: closes_branch = .false.          !! the last event is a bifurcation of the parent path, at which the branch ends
      logical, allocatable :: duplicate(:)     !! (seen) true: the event is not reported, see duplicates_of
      integer, allocatable :: beside(:) !! (seen) for a limit point at a corner: index of the contact change at the same position;
      !! 0: none
      logical :: stops = .false.               !! the trial meets the stop condition of the step
      logical :: keeps_mesh = .false.            !! true: the mesh is not refined for this increment, however large the errors are
      type(error_bars_t), allocatable :: bars  !! error bars of the trial; not allocated: the deck requests none for it
   end type findings_t

   character(*), parameter :: passing = 'bifurcation, or two paths that pass each other closely,'

   real(wp), parameter :: same_place = 1.0e-5_wp !! fraction of the increment: located events closer than this coincide; with values
   !! from 1E-6 to 1E-4 every deck in input has the same results

contains

   !> Finds all events between the last accepted point and the trial.
   subroutine find_events(problem, step, run, trial, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run !! if the run is at an unloaded start, the rates of load and monitors there are
      !! replaced by those of the trial
      type(path_point_t), intent(in) :: trial
      type(findings_t), intent(out) :: findings  !! components that this procedure does not set keep their defaults
      type(event_t), allocatable :: events(:)
      type(located_event_t), allocatable :: home
      if (run%fresh) then
         run%last%test_values%load_rate = trial%test_values%load_rate
         run%last%test_values%monitor_rate = trial%test_values%monitor_rate
      end if
      call detect_events(problem, step, run%last%test_values, trial%test_values, run%last%state, trial%state, events)
      call distinguish_crossings(problem, run, trial, events)
      call find_known_bifurcation(problem, run, trial, events, home)
      findings%closes_branch = allocated(home)
      allocate (findings%seen(0))
      call locate_all(problem, step, run, trial, events, findings%seen)
      if (findings%closes_branch) findings%seen = [findings%seen, home]
      if (size(step%stop) > 0 .or. size(step%locate) > 0) call find_hidden_values(problem, step, run, trial, findings)
   end subroutine find_events

   !> Distinguishes limit points from bifurcations at which the load of this path has an extremum (a symmetric pitchfork, followed
   !> along its branch). At each of them the load rate changes its sign. The work u.q of the load vector q on the derivatives u of
   !> the displacements by the load factor changes its sign at a limit point only.
   subroutine distinguish_crossings(problem, run, trial, events)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(event_t), intent(inout) :: events(:)
      integer :: k
      if (run%fresh .or. any(run%last%state%active .neqv. trial%state%active)) return
      if (run%last%test_values%negative_pivots /= trial%test_values%negative_pivots) return
      do k = 1, size(events)
         if (events(k)%kind /= event_limit) cycle
         events(k)%meets = load_work(problem, run%last) * load_work(problem, trial) > 0.0_wp
         if (.not. events(k)%meets) cycle
         events(k)%label = 'BP'
         events(k)%note = 'bifurcation, meets the path that this one leaves on its other side'
      end do
   end subroutine distinguish_crossings

   !> The work u.q (see distinguish_crossings), computed as u.K u with the tangent stiffness K, because K u = q along the path.
   real(wp) function load_work(problem, point) result(work)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      real(wp) :: moves(point%system%n), force(point%system%n)
      moves = merge(0.0_wp, point%system%tangent, point%system%fixed)
      call apply_tangent(problem, point%state, point%system, moves, force, work)
   end function load_work

   !> Finds prescribed values that the path passes twice in one increment, before and behind a limit point. The values at the ends
   !> of the increment do not show these passages. The increment is therefore divided at the limit point.
   subroutine find_hidden_values(problem, step, run, trial, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(findings_t), intent(inout) :: findings
      type(event_t), allocatable :: events(:)     ! events up to the limit point
      type(event_t), allocatable :: beyond_it(:)
      type(path_point_t) :: top
      type(path_state_t) :: beyond
      real(wp) :: part
      integer :: limit, n
      limit = limit_among(findings)
      if (limit == 0) return
      top = findings%seen(limit)%point
      part = findings%seen(limit)%fraction
      call value_events(problem, step, run%last%test_values, top%test_values, run%last%state, top%state, events)
      call value_events(problem, step, top%test_values, trial%test_values, top%state, trial%state, beyond_it)
      if (size(events) + size(beyond_it) == 0) return
      call drop_known(run%last%test_values, trial%test_values, events)
      n = size(findings%seen)
      call locate_all(problem, step, run, top, events, findings%seen)
      findings%seen(n + 1:)%fraction = part * findings%seen(n + 1:)%fraction
      call copy_path_state(run, beyond)
      beyond%last = top
      beyond%fresh = .false.
      call drop_known(run%last%test_values, trial%test_values, beyond_it)
      n = size(findings%seen)
      call locate_all(problem, step, beyond, trial, beyond_it, findings%seen)
      findings%seen(n + 1:)%fraction = part + (1.0_wp - part) * findings%seen(n + 1:)%fraction
   end subroutine find_hidden_values

   !> Index in findings%seen of the last located limit point. Without a limit point it is the index of the point where a branch
   !> closes (returns to its start), because the load may have an extremum there. 0: there is no such point.
   pure integer function limit_among(findings) result(limit)
      type(findings_t), intent(in) :: findings
      integer :: i
      limit = 0
      do i = 1, size(findings%seen)
         if (findings%seen(i)%event%kind == event_limit .and. findings%seen(i)%located) limit = i
      end do
      if (limit == 0 .and. findings%closes_branch) limit = size(findings%seen)
   end function limit_among

   !> Locates the given events between the last accepted point of a path state and a later point, and appends them to `seen`.
   subroutine locate_all(problem, step, from, to, wanted, seen)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: from
      type(path_point_t), intent(in) :: to
      type(event_t), intent(in) :: wanted(:)
      type(located_event_t), allocatable, intent(inout) :: seen(:)
      type(located_event_t), allocatable :: found(:)
      integer :: k
      allocate (found(size(wanted)))
      do k = 1, size(wanted)
         found(k)%event = wanted(k)
         call locate_event(problem, step, from, to, found(k))
      end do
      if (size(seen) > 0) found = [seen, found]
      call move_alloc(found, seen)
   end subroutine locate_all

   !> Removes prescribed values that lie between the values at the two ends of the whole increment: the search over the whole
   !> increment has found them.
   subroutine drop_known(first, last, events)
      type(test_values_t), intent(in) :: first, last
      type(event_t), allocatable, intent(inout) :: events(:)
      integer :: i
      events = pack(events, [(.not. (test_value(first, events(i)) - events(i)%value) * (test_value(last, events(i)) - &
         & events(i)%value) < 0.0_wp, i=1, size(events))])
   end subroutine drop_known

   !> True if a shorter increment may resolve the events of this increment better. The reason may be that an event was not located,
   !> that an eigenvalue was not detected, or that interface points lie inside elements at a located event. Prescribed values and
   !> turning points that were not located do not count.
   logical function better_from_nearer(problem, run, trial, findings) result(better)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(findings_t), intent(in) :: findings
      integer :: i
      better = .not. findings%closes_branch .and. one_sided(run, trial, findings%seen)
      do i = 1, size(findings%seen)
         if (better) return
         associate (located_event => findings%seen(i))
            better = .not. (findings%duplicate(i) .or. located_event%located .or. &
               & any(located_event%event%kind == [event_value_reached, event_turning])) .or. passes_kinks(problem, run%last%state, &
               & located_event)
         end associate
      end do
   end function better_from_nearer

   !> True if a shorter increment may locate the event better: interface points of foundations lie inside elements at the event, but
   !> not at the last accepted point. At a point between these two the mesh can have nodes at the interface points. If interface
   !> points lie inside elements already at the last accepted point, no mesh has nodes there.
   logical function passes_kinks(problem, last, located_event)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: last
      type(located_event_t), intent(in) :: located_event
      passes_kinks = located_event%located .and. any(problem%layout%rod_segment%free)
      if (passes_kinks) passes_kinks = inner_cuts(find_cuts(problem, located_event%point%state)) > max(size(problem%mark), &
         & inner_cuts(find_cuts(problem, last)))
   end function passes_kinks

   !> True if a detachment before the end of the step was not detected: the numbers of directions that open force-free contacts at
   !> the last accepted point and at the end of the step differ by more than the located detachments explain. (The trial behind the
   !> end of the step may not show the detachment: there long elements buckle between their nodes.)
   logical function hides_release(problem, run, findings, end) result(hides)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(findings_t), intent(in) :: findings
      integer, intent(in) :: end                 !! index in findings%seen of the event that ends the step
      integer :: opening, i
      logical :: weak
      associate (seen => findings%seen)
         call count_opening(problem, seen(end)%point%state, seen(end)%point%system, opening, weak)
         hides = weak .and. run%last%test_values%weak
         do i = 1, size(seen)
            if (seen(i)%event%kind == event_release .and. seen(i)%located .and. .not. findings%duplicate(i) .and. &
               & seen(i)%fraction < seen(end)%fraction) opening = opening - nint(sign(1.0_wp, seen(i)%event%before))
         end do
      end associate
      hides = hides .and. opening /= run%last%test_values%opening
   end function hides_release

   !> True if the event is a turning point of a monitor that changes by rounding only, for example a monitor that is constant by
   !> symmetry.
   logical function turns_by_rounding(problem, step, run, trial, located_event) result(no_turn)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(in) :: located_event
      real(wp) :: least
      integer :: m
      no_turn = .false.
      if (located_event%event%kind /= event_turning) return
      m = step%turning(located_event%event%monitor)
      least = rounding_of(problem, m)
      if (allocated(located_event%bars)) then
         if (located_event%bars%monitor(m)%estimated) least = max(least, located_event%bars%monitor(m)%rounding)
      end if
      associate (before => run%last%test_values%monitor(m), after => trial%test_values%monitor(m))
         ! A rate whose sign changes by rounding has no zero that could be located.
         no_turn = abs(after - before) <= least
         if (located_event%located) no_turn = maxval(abs(located_event%point%test_values%monitor(m) - [before, after])) <= least
      end associate
   end function turns_by_rounding

   !> Marks a limit point as unsure if the load may turn there by the error of the mesh only; a finer mesh is then requested, or the
   !> run reports it. The limit point is unsure if finer elements place it farther away than the arc length since the last contact
   !> change. If they place it ahead, the way to the trial is added to this arc length.
   subroutine check_limit_shift(problem, run, trial, located_event)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(inout) :: located_event !! the event; out: its error bars may be marked as unsure about the sign
      !! of the load rate
      real(wp) :: reach
      if (.not. allocated(located_event%bars) .or. located_event%event%kind /= event_limit) return
      reach = run%arc_length - max(run%left_at, run%since_change%at) + path_length(problem, run%last%state, &
         & located_event%point%state)
      if (located_event%bars%way > 0.0_wp) reach = reach + path_length(problem, located_event%point%state, trial%state)
      if (abs(located_event%bars%way) > reach) located_event%bars%unsure = .true.
   end subroutine check_limit_shift

   !> Rejects a bifurcation that may be two paths close to each other. A small force along the null vector would separate the paths;
   !> the points between which the event is interpolated then lie on both paths.
   pure subroutine check_single_path(located_event)
      type(located_event_t), intent(inout) :: located_event !! located becomes false if the bifurcation is rejected
      if (.not. allocated(located_event%bars) .or. located_event%event%kind /= event_bifurcation) return
      located_event%located = located_event%bars%unfolding * located_event%tangent_turn <= largest_turn
      if (.not. located_event%located) located_event%event%note = passing
   end subroutine check_single_path

   !> (seen) true: the event is not reported as an event of its own. Not reported are
   !> - bifurcations that repeat the sign change of a limit point or are further eigenvalues of a multiple bifurcation,
   !> - jumps of the pivot count due to a change of the contact set, or to rounding if the last accepted point is a bifurcation,
   !> - bifurcations behind the trial,
   !> - limit points beside a contact change, if they were not located.
   !> If the contact set is unchanged up to the trial, the pivot count has no jumps. A change of the count without a located
   !> bifurcation then means that the trial is on another path.
   function duplicates_of(run, trial, changes, seen) result(duplicate)
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      logical, intent(in) :: changes             !! true: the contact set changes at the trial
      type(located_event_t), intent(in) :: seen(:)
      logical :: duplicate(size(seen)), set_changes, jumps, contact_located, limit_counted
      integer :: i, k
      jumps = any(run%last%state%active .neqv. trial%state%active) .or. any(seen%event%kind == event_contact)
      set_changes = changes .or. jumps
      contact_located = changes .or. any(seen%event%kind == event_contact .and. seen%located)
      limit_counted = .false.
      duplicate = .false.
      do i = 1, size(seen)
         if (seen(i)%event%kind == event_limit .and. .not. seen(i)%located) duplicate(i) = contact_located
         if (seen(i)%event%kind /= event_bifurcation) cycle
         if (seen(i)%later) then
            duplicate(i) = .true.
         else if (.not. seen(i)%located) then
            duplicate(i) = jumps
         else
            ! At a contact change the force of the contact is zero, and the number of negative pivots is undefined.
            duplicate(i) = (run%on_bifurcation .or. set_changes) .and. seen(i)%fraction <= same_place
            duplicate(i) = duplicate(i) .or. (set_changes .and. seen(i)%fraction >= 1.0_wp - same_place)
            do k = 1, size(seen)
               if (k == i .or. duplicate(i) .or. .not. seen(k)%located) cycle
               if (abs(seen(k)%fraction - seen(i)%fraction) > same_place) cycle
               if (seen(k)%event%kind == event_limit .and. .not. limit_counted) then
                  duplicate(i) = .true.
                  limit_counted = .true.
               else if (seen(k)%event%kind == event_bifurcation .and. k < i) then
                  duplicate(i) = .not. duplicate(k)
               end if
            end do
         end if
      end do
   end function duplicates_of

   !> (seen) for a located limit point at a corner of the path: index of the located contact change at the same position; 0: none.
   pure function beside(seen) result(change)
      type(located_event_t), intent(in) :: seen(:)
      integer :: change(size(seen)), i, k
      change = 0
      do i = 1, size(seen)
         if (.not. (seen(i)%event%corner .and. seen(i)%located)) cycle
         do k = 1, size(seen)
            if (seen(k)%event%kind /= event_contact .or. .not. seen(k)%located) cycle
            if (abs(seen(k)%fraction - seen(i)%fraction) <= same_place) change(i) = k
         end do
      end do
   end function beside

   !> True if the load rate changes its sign while the contact set is unchanged and the number of negative pivots changes by an even
   !> number. A second eigenvalue has then changed its sign together with the eigenvalue of the limit point, and was not detected.
   pure logical function one_sided(run, trial, seen)
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(in) :: seen(:)
      integer :: i
      one_sided = run%last%test_values%load_rate * trial%test_values%load_rate < 0.0_wp .and. &
         & all(run%last%state%active .eqv. trial%state%active) .and. &
         & modulo(trial%test_values%negative_pivots - run%last%test_values%negative_pivots, 2) == 0
      ! No eigenvalue went undetected if the path meets another path at a located event, or if a bifurcation was located at the same
      ! position as the limit point.
      do i = 1, size(seen)
         one_sided = one_sided .and. .not. (seen(i)%event%meets .and. seen(i)%located)
         if (seen(i)%event%kind == event_limit .and. seen(i)%located) one_sided = one_sided .and. .not. any( &
            & seen%event%kind == event_bifurcation .and. seen%located .and. abs(seen%fraction - seen(i)%fraction) <= same_place)
      end do
   end function one_sided

   !> Number of negative pivots just before a position in the increment. (At an event itself an eigenvalue may be zero, and the
   !> signs of pivots are then rounding.)
   pure integer function count_before(run, seen, duplicate, fraction) result(pivots)
      type(path_state_t), intent(in) :: run
      type(located_event_t), intent(in) :: seen(:)
      logical, intent(in) :: duplicate(:)             !! (seen) from duplicates_of
      real(wp), intent(in) :: fraction           !! position in the increment, 0 to 1
      integer :: i
      pivots = run%last%test_values%negative_pivots
      do i = 1, size(seen)
         if (seen(i)%event%kind /= event_bifurcation .or. .not. seen(i)%located) cycle
         if (duplicate(i) .and. seen(i)%fraction <= same_place) cycle
         if (seen(i)%fraction < fraction - same_place) pivots = pivots + nint(sign(1.0_wp, seen(i)%event%before))
      end do
   end function count_before
end module event_search
