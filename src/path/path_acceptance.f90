!> What happens when an increment has converged: events up to the new point are located and recorded, then the point, and
!> the run goes there.
module path_acceptance
   use kinds, only: wp
   use errors, only: error_t
   use text, only: to_text
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_opening
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use tangent_modes, only: modes_t, lowest_modes, choose_null_vectors, nodal_mode, deck_mode
   use weak_lines, only: release_lines, count_released, let_turn, line_opening
   use path_control, only: path_length
   use path_continuity, only: heading_t, largest_turn
   use corrector, only: increment_t
   use path_run, only: run_t, copy_run, probe_at, keep_landmark, leave_trail
   use homecoming, only: is_home, see_home
   use step_control, only: stop_met
   use path_events, only: probe_t, event_t, new_probe, detect_events, value_events, event_stop, event_bifurcation, &
      & event_release, event_limit, event_value_reached, event_turning
   use ground_cuts, only: find_cuts, inner_cuts
   use sightings, only: sighting_t
   use event_order, only: told_otherwise, one_sided, count_before, by_fraction, same_place
   use event_location, only: locate
   use path_outcome, only: outcome_t, note_bracketed
   use point_recording, only: record
   use error_bar, only: error_bars_t
   use error_report, only: bars_at_event, bars_at_point, note_error, asked_at
   use mesh_request, only: motion_sizes, rounding_of
   use accuracy_asked, only: wants_another, ask_at_event, ask_for_mesh, ask_for_less, sizes_there
   use path_record, only: recorder_t, critical_t
   use run_accuracy, only: place_t
   use timing, only: timers_t, count_up, counter_located
   implicit none
   private
   public :: accept

   integer, parameter :: most_null_vectors = 4
   character(*), parameter :: passing = 'bifurcation, or two paths that pass each other closely,', &
      & imperfect = ', but for an imperfection too small to tell here'
   real(wp), parameter :: loosest = 1.0e-4_wp    !! eigenvalues below this part of what they were count as zero

contains

   !> Detects what happened up to a converged trial point, locates it, puts it in order, records it and the point, and goes
   !> there. `shorter` instead, and nothing recorded, when an event was not located and the caller can cut the increment.
   subroutine accept(problem, step, run, trial, ahead, label, report, can_cut, recorder, shorter, finished, outcome, timers, &
      & changing, divides, changes, bars, tries, times, bracketed)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the trial on entry and on return, else anywhere
      type(state_t), intent(inout) :: trial
      type(heading_t), intent(in) :: ahead       !! tangent at the trial
      character(2), intent(in) :: label          !! C+ or C- when the point is known to be one
      type(increment_t), intent(in) :: report
      logical, intent(in) :: can_cut
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: shorter
      logical, intent(out) :: finished           !! the step has come to its end
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      logical, intent(in), optional :: changing(:) !! (candidates) whose contact at a node begins or ends at the trial
      logical, intent(in), optional :: divides   !! at a C-: of the contact a part stays on both sides
      type(error_bars_t), allocatable, intent(in), optional :: bars !! at a change of contact spans
      integer, intent(in), optional :: tries     !! meshes that the same increment has had for its errors' sake; not there: this
      !! mesh has to do. Where it does not run%wanted is allocated, and nothing recorded
      integer, intent(in), optional :: times     !! how often the label happens at the trial; not there: once
      logical, intent(in), optional :: bracketed !! it happens somewhere on the way there
      logical, intent(in), optional :: changes   !! the contact set is about to change at the trial, with a label or without
      type(sighting_t), allocatable :: seen(:)
      type(system_t), allocatable :: at_trial    ! what is looked at on the way changes nothing of it
      type(probe_t) :: probe
      logical, allocatable :: told(:)
      integer, allocatable :: order(:)
      type(error_bars_t), allocatable :: shown_bars, contact_bars
      character(:), allocatable :: note
      integer :: i, unseen, told_times
      logical :: splits, set_changes, stops, comes_home, ends, exact, as_it_is

      finished = .false.
      shorter = .false.
      splits = .false.
      if (present(divides)) splits = divides
      exact = .true.
      if (present(bracketed)) exact = .not. bracketed
      probe = probe_at(problem, run, trial, ahead)
      call count_released(problem, trial, run%system, probe%free_pivots, probe%weak, timers)
      if (run%fresh) then
         run%probe%load_rate = probe%load_rate
         run%probe%monitor_rate = probe%monitor_rate
      end if
      call find_events(problem, step, run, trial, ahead, probe, seen, comes_home, at_trial, timers)
      set_changes = label /= ''
      if (present(changes)) set_changes = set_changes .or. changes
      told = told_otherwise(run, trial, set_changes, seen)
      ! Values that are only looked for change nothing.
      shorter = can_cut .and. (.not. comes_home .and. one_sided(run, trial, probe) .or. any(.not. (told .or. seen%located .or. &
         & seen%event%kind == event_value_reached .or. seen%event%kind == event_turning)) .or. &
         & any([(passes_kinks(problem, run%state, seen(i)), i=1, size(seen))]))
      if (shorter) return
      run%has_events = any(seen%located .and. .not. told)
      stops = stop_met(step, run%probe, probe)
      if (allocated(run%wanted)) deallocate (run%wanted)
      run%unsettled = .false.
      ! A given mesh stays as it is; of another one a second will not have the nodes that the first has not. (A point between has
      ! them at once: the next increment's mesh begins there.)
      as_it_is = .not. any(problem%layout%stretch%placed)
      if (present(tries)) as_it_is = as_it_is .or. tries > 0
      do i = 1, size(seen)
         if (told(i) .or. .not. seen(i)%located) cycle
         call linearise(problem, seen(i)%place, seen(i)%place, run%system, timers)
         told(i) = turns_by_rounding(problem, step, run, probe, seen(i))
         if (told(i)) cycle
         ! At home they are those of the path that was left, on its mesh.
         if (allocated(seen(i)%bars)) cycle
         shorter = can_cut .and. seen(i)%event%kind == event_stop .and. hides_release(problem, run, seen, told, seen(i), timers)
         if (shorter) return
         call bars_at_event(problem, step, run, trial, seen(i)%event, seen(i)%place, seen(i)%heading, seen(i)%bars, timers, &
            & as_it_is)
         ! Bars may know of more rounding.
         told(i) = turns_by_rounding(problem, step, run, probe, seen(i))
         if (told(i)) cycle
         if (present(tries)) call ask_at_event(problem, step, run, seen(i), tries, outcome)
         if (wants_another(run)) return
         call doubt_bifurcation(seen(i))
         shorter = can_cut .and. .not. seen(i)%located
         if (shorter) return
      end do
      if (allocated(at_trial)) run%system = at_trial
      if (present(bars)) then
         if (allocated(bars)) shown_bars = bars
      end if
      ! A trial behind the end of the step is no point of it.
      ends = any(seen%located .and. seen%event%kind == event_stop .and. .not. told)
      if (.not. (allocated(shown_bars) .or. ends)) &
         & call bars_at_point(problem, step, run, trial, ahead, merge(label, '  ', exact), stops, 0, shown_bars, timers, &
         & wanted=step%asked_of_path > 0.0_wp .and. any(problem%layout%stretch%placed), changing=changing, &
         & as_it_is=as_it_is .and. (label /= '' .or. stops))
      if (allocated(shown_bars) .and. .not. ends) then
         if (present(tries)) call ask_for_mesh(problem, step, run, trial, shown_bars, label /= '' .or. stops, tries, outcome)
         if (wants_another(run)) return
         if (.not. (label /= '' .or. stops)) call note_error(problem, step, shown_bars, sizes_there(problem, step, run, trial, &
            & asked_at(problem, step, ''), outcome), '', place_t(run%branch, problem%step, run%points + 1, trial%load_factor), &
            & outcome%accuracy)
         if (present(tries) .and. .not. (label /= '' .or. stops .or. any(seen%located))) &
            & call ask_for_less(problem, step, run, trial, shown_bars, tries, outcome)
         if (.not. (label /= '' .or. stops .or. step%bars_everywhere)) deallocate (shown_bars)
      end if
      order = by_fraction(seen%fraction)
      do i = 1, size(seen)
         associate (sighting => seen(order(i)))
            if (told(order(i)) .or. .not. sighting%located) cycle
            call record_event(problem, step, run, trial, sighting, count_before(run, seen, told, sighting%fraction), recorder, &
               & finished, outcome, timers)
         end associate
         if (finished .or. allocated(outcome%why)) return
      end do
      if (allocated(at_trial)) run%system = at_trial
      ! Where contact changes the tangent may be singular: a point as flat as its wall beside a neutral span.
      if (present(changes)) then
         if (changes) run%system%negative_pivots = count_before(run, seen, told, 1.0_wp)
      end if
      finished = stops
      call record(problem, run, trial, merge('EP', label, finished), report, recorder, outcome, timers, changing, &
         & shown_bars, ahead)
      if (allocated(outcome%why)) return
      do i = 1, size(seen)
         if (told(i) .or. seen(i)%located) cycle
         call announce(problem, run, new_critical(seen(i)%event%label, seen(i)%event%note), trial, probe, .false., recorder, &
            & outcome, timers)
         call note_bracketed(outcome, seen(i)%event%note, run%state%load_factor, trial%load_factor)
         finished = finished .or. seen(i)%event%kind == event_stop
         ! It counts, though nothing can start there.
         call keep_landmark(problem, run, seen(i)%event%label, trial, trial, 1.0_wp, &
            & run%arc_length + path_length(problem, run%state, trial), probe%negative_pivots, 0)
      end do
      told_times = 1
      if (present(times)) told_times = times
      if (label /= '') then
         note = merge('contact gained', 'contact lost  ', label == 'C+')
         if (splits) note = 'a contact region splits'
         if (exact .and. allocated(shown_bars)) contact_bars = shown_bars
         do i = 1, told_times
            call announce(problem, run, new_critical(label, trim(note), contact_bars), trial, probe, exact, recorder, outcome, &
               & timers)
         end do
         if (.not. exact) call note_bracketed(outcome, trim(note), run%state%load_factor, trial%load_factor)
      end if
      if (finished) call announce(problem, run, new_critical('EP', 'end of the step', shown_bars), trial, probe, .true., &
         & recorder, outcome, timers)
      if (allocated(outcome%why)) return
      unseen = 0
      do i = 1, size(seen)
         if (seen(i)%later) unseen = unseen + nint(sign(1.0_wp, seen(i)%event%before))
      end do
      probe%negative_pivots = probe%negative_pivots - unseen
      run%step_points = run%step_points + 1
      run%last_load = trial%load_factor - run%state%load_factor
      run%on_bifurcation = any(seen%event%kind == event_bifurcation .and. seen%located .and. seen%fraction >= 1.0_wp - same_place)
      call go_to(problem, run, trial, ahead, probe)
   end subroutine accept

   !> True for an end of the step where lines have let go of what a trial behind it does not tell: elements so long that they buckle
   !> between their own nodes hide that, and those behind the end may be.
   logical function hides_release(problem, run, seen, told, end, timers) result(hides)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run             !! its system is factored at the end
      type(sighting_t), intent(in) :: seen(:)
      logical, intent(in) :: told(:)
      type(sighting_t), intent(in) :: end
      type(timers_t), intent(inout) :: timers
      integer :: pivots, i
      logical :: weak
      call count_released(problem, end%place, run%system, pivots, weak, timers)
      hides = weak .and. run%probe%weak .and. run%system%negative_pivots == run%probe%negative_pivots
      do i = 1, size(seen)
         if (seen(i)%event%kind == event_release .and. seen(i)%located .and. .not. told(i) .and. seen(i)%fraction < end%fraction) &
            & pivots = pivots - nint(sign(1.0_wp, seen(i)%event%before))
      end do
      hides = hides .and. pivots /= run%probe%free_pivots
   end function hides_release

   !> What was located as a bifurcation may be two paths that pass each other: no path goes through where the null vector feels a
   !> force, and the points that the place was interpolated from lie on both.
   pure subroutine doubt_bifurcation(sighting)
      type(sighting_t), intent(inout) :: sighting !! not located where it is none
      if (.not. allocated(sighting%bars) .or. sighting%event%kind /= event_bifurcation) return
      sighting%located = sighting%bars%unfolding * sighting%swerve <= largest_turn
      if (.not. sighting%located) sighting%event%note = passing
   end subroutine doubt_bifurcation

   !> True for a monitor that turns by no more than what rounding makes of it, as one that symmetry holds: that is nothing to tell.
   logical function turns_by_rounding(problem, step, run, probe, sighting) result(no_turn)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(in) :: run             !! its system is factored at the place
      type(probe_t), intent(in) :: probe         !! at the trial
      type(sighting_t), intent(in) :: sighting
      type(probe_t) :: there
      real(wp) :: least
      integer :: m
      no_turn = .false.
      if (sighting%event%kind /= event_turning) return
      m = step%turning(sighting%event%monitor)
      there = new_probe(problem, sighting%place, run%system, sighting%heading%load)
      least = rounding_of(problem, m)
      if (allocated(sighting%bars)) then
         if (sighting%bars%monitor(m)%told) least = max(least, sighting%bars%monitor(m)%rounding)
      end if
      no_turn = maxval(abs(there%monitor(m) - [run%probe%monitor(m), probe%monitor(m)])) <= least
   end function turns_by_rounding

   !> True where kinks of foundations lie inside elements at a located event that have appeared on the way to it: a point between
   !> gives them nodes. Those of the last point have been refused some.
   logical function passes_kinks(problem, last, sighting)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: last
      type(sighting_t), intent(in) :: sighting
      passes_kinks = sighting%located .and. any(problem%layout%stretch%free)
      if (passes_kinks) passes_kinks = inner_cuts(find_cuts(problem, sighting%place)) > max(size(problem%mark), &
         & inner_cuts(find_cuts(problem, last)))
   end function passes_kinks

   !> The run moves to a point whose probe is known.
   subroutine go_to(problem, run, place, heading, probe)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: place
      type(heading_t), intent(in) :: heading
      type(probe_t), intent(in) :: probe
      call leave_trail(problem, run, place, heading)
      run%last_length = path_length(problem, run%state, place)
      run%arc_length = run%arc_length + run%last_length
      run%state = place
      run%motion = max(run%motion, motion_sizes(problem, place))
      run%heading = heading
      run%probe = probe
      run%fresh = .false.
      run%shrunk = .false.
   end subroutine go_to

   !> All events between the last point and the trial, looked for. A load that is passed on the way to a limit point, and
   !> again on the way back, does not show at the ends: to values such an increment is two.
   subroutine find_events(problem, step, run, trial, ahead, probe, seen, comes_home, at_trial, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead
      type(probe_t), intent(in) :: probe
      type(sighting_t), allocatable, intent(out) :: seen(:)
      logical, intent(out) :: comes_home         !! one of them is where its branch comes back to the path that it left
      type(system_t), allocatable, intent(out) :: at_trial !! the run's system as it was; allocated where something was seen
      type(timers_t), intent(inout) :: timers
      type(event_t), allocatable :: events(:)
      type(sighting_t), allocatable :: home
      type(probe_t) :: top
      type(run_t) :: beyond
      real(wp) :: part
      integer :: i, limit, n
      call detect_events(problem, step, run%probe, probe, run%state, trial, events)
      call see_home(problem, run, trial, ahead, events, home)
      comes_home = allocated(home)
      if (size(events) > 0 .or. comes_home) at_trial = run%system
      call look(run, trial, ahead, events)
      if (comes_home) seen = [seen, home]
      limit = 0
      do i = 1, size(seen)
         if (seen(i)%event%kind == event_limit .and. seen(i)%located) limit = i
      end do
      ! A branch may turn its load where it comes home, too.
      if (limit == 0 .and. comes_home) limit = size(seen)
      if (limit == 0 .or. (size(step%stop) == 0 .and. size(step%locate) == 0)) return
      associate (place => seen(limit)%place, heading => seen(limit)%heading)
         call linearise(problem, place, place, run%system, timers)
         top = probe_at(problem, run, place, heading)
         call value_events(problem, step, run%probe, top, run%state, place, events)
         if (size(events) == 0) return
      end associate
      ! Those that the ends tell, too, are known.
      events = pack(events, [(.not. crossed(events(i)%monitor, events(i)%value), i=1, size(events))])
      n = size(seen)
      part = seen(limit)%fraction
      call look(run, seen(limit)%place, seen(limit)%heading, events)
      seen(n + 1:)%fraction = part * seen(n + 1:)%fraction
      call copy_run(run, beyond)
      beyond%state = seen(limit)%place
      beyond%heading = seen(limit)%heading
      beyond%probe = top
      beyond%fresh = .false.
      call value_events(problem, step, top, probe, beyond%state, trial, events)
      events = pack(events, [(.not. crossed(events(i)%monitor, events(i)%value), i=1, size(events))])
      n = size(seen)
      call look(beyond, trial, ahead, events)
      seen(n + 1:)%fraction = part + (1.0_wp - part) * seen(n + 1:)%fraction

   contains

      !> Locates events between the point of a run and a later one, and adds them to those seen.
      subroutine look(from, to, heading, wanted)
         type(run_t), intent(inout) :: from
         type(state_t), intent(in) :: to
         type(heading_t), intent(in) :: heading
         type(event_t), intent(in) :: wanted(:)
         type(sighting_t), allocatable :: found(:)
         integer :: k
         allocate (found(size(wanted)))
         do k = 1, size(wanted)
            found(k)%event = wanted(k)
            call locate(problem, step, from, to, heading, found(k), timers)
         end do
         if (allocated(seen)) found = [seen, found]
         call move_alloc(found, seen)
      end subroutine look

      !> True for a value between those at both ends of the increment.
      pure logical function crossed(monitor, value)
         integer, intent(in) :: monitor
         real(wp), intent(in) :: value
         if (monitor == 0) then
            crossed = (run%probe%load_factor - value) * (probe%load_factor - value) < 0.0_wp
         else
            crossed = (run%probe%monitor(monitor) - value) * (probe%monitor(monitor) - value) < 0.0_wp
         end if
      end function crossed
   end subroutine find_events

   !> Records a located event: its point, its words, what others may start from. At the end of a step the run goes there.
   subroutine record_event(problem, step, run, trial, sighting, pivots, recorder, finished, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(sighting_t), intent(in) :: sighting
      integer, intent(in) :: pivots              !! negative ones before it
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: finished
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(critical_t) :: critical
      type(modes_t) :: modes
      type(probe_t) :: probe
      type(problem_t) :: free
      type(state_t) :: released
      type(system_t) :: other
      real(wp) :: arc_length
      type(error_bars_t), allocatable :: bars
      logical :: weak
      finished = .false.
      associate (event => sighting%event, place => sighting%place)
         call linearise(problem, place, place, run%system, timers)
         if (run%branch == 0 .and. any(event%kind == [event_bifurcation, event_limit])) outcome%home = is_home(problem, run, place)
         if (outcome%home) outcome%why = 'the path comes back to a bifurcation of its own at load factor '// &
            & to_text(place%load_factor)//': beyond lies what it has passed'
         if (outcome%home) return
         if (allocated(sighting%bars)) bars = sighting%bars
         critical = new_critical(event%label, event%note, bars)
         if (any(event%kind == [event_bifurcation, event_limit])) run%system%negative_pivots = pivots
         call record(problem, run, place, event%label, sighting%report, recorder, outcome, timers, first_touch(problem, event, &
            & place), bars, sighting%heading)
         if (allocated(outcome%why)) return
         call count_up(timers, counter_located)
         probe = new_probe(problem, place, run%system, sighting%heading%load)
         arc_length = run%arc_length + path_length(problem, run%state, place)
         select case (event%kind)
         case (event_bifurcation)
            call find_null_vectors(problem, step, run%system, place, event, critical, modes, timers)
            if (allocated(bars)) then
               if (bars%unfolding > 0.0_wp) critical%note = critical%note//imperfect
            end if
            call keep_landmark(problem, run, 'BP', place, trial, sighting%fraction, arc_length, pivots, &
               & size(critical%null_vector, 3), event%scale, sighting%bars)
         case (event_release)
            call release_lines(problem, place, run%system, free, released, weak)
            other = new_system(free)
            call linearise(free, released, released, other, timers)
            call find_null_vectors(free, step, other, released, event, critical, modes, timers)
            critical%note = event%note
            if (line_opening(problem, place, free, released, nodal_mode(free, other, modes%x(:, 1))) == 0) &
               & critical%note = 'bifurcation without contacts that carry no force; none of its directions opens them all'
            call let_turn(free)
            call keep_landmark(problem, run, 'BP', place, trial, sighting%fraction, arc_length, pivots, 1, &
               & free=free, released=released)
         case (event_limit)
            call keep_landmark(problem, run, 'LP', place, trial, 0.0_wp, arc_length, pivots, 0)
         end select
         call announce(problem, run, critical, place, probe, .true., recorder, outcome, timers)
         if (allocated(outcome%why)) return
         if (any(event%kind == [event_bifurcation, event_limit])) then
            finished = is_home(problem, run, place)
            if (finished) call announce(problem, run, new_critical('EP', 'back on the path it left, at a bifurcation', bars), &
               & place, probe, .true., recorder, outcome, timers)
         else if (event%kind == event_stop) then
            finished = .true.
            call go_to(problem, run, place, sighting%heading, probe)
         end if
      end associate
   end subroutine record_event

   !> The candidate that is about to carry force where a contact is gained at nodes: the one with the least gap.
   function first_touch(problem, event, place) result(touching)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: place
      logical :: touching(problem%candidates%n)
      real(wp) :: opening, least
      integer :: c, nearest
      touching = .false.
      if (event%label /= 'C+' .or. event%ground%contact > 0) return
      if (any(event%marked .and. place%active)) return
      nearest = 0
      least = huge(least)
      do c = 1, problem%candidates%n
         if (.not. event%marked(c)) cycle
         opening = candidate_opening(problem, place, c)
         if (opening >= least) cycle
         least = opening
         nearest = c
      end do
      if (nearest > 0) touching(nearest) = .true.
   end function first_touch

   !> Reports the point recorded last as a critical one.
   subroutine announce(problem, run, point, state, values, exact, recorder, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(in) :: run
      type(critical_t), intent(in) :: point      !! label, note and null vectors
      type(state_t), intent(in) :: state
      type(probe_t), intent(in) :: values
      logical, intent(in) :: exact               !! located, not only bracketed
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(critical_t) :: full
      type(place_t) :: at
      type(error_t), allocatable :: error
      full = point
      full%step = problem%step
      full%point = run%points
      full%load_factor = state%load_factor
      full%located = exact
      full%monitor = values%monitor
      if (allocated(full%bars)) then
         at = place_t(run%branch, problem%step, run%points, state%load_factor)
         associate (step => problem%model%step(problem%step))
            call note_error(problem, step, full%bars, sizes_there(problem, step, run, state, asked_at(problem, step, full%label), &
               & outcome), full%label, at, outcome%accuracy)
         end associate
      end if
      call recorder%critical(full, timers, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine announce

   !> The modes whose eigenvalues vanish at a bifurcation, where the system is factored now.
   subroutine find_null_vectors(problem, step, system, state, event, point, modes, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(system_t), intent(in) :: system         !! factored there
      type(state_t), intent(in) :: state
      type(event_t), intent(in) :: event
      type(critical_t), intent(inout) :: point   !! gets its null vectors and a note of their number
      type(modes_t), intent(out) :: modes        !! the same on the mesh come first
      type(timers_t), intent(inout) :: timers
      type(error_t), allocatable :: error
      real(wp) :: sense
      integer :: n, j
      call lowest_modes(problem, state, system, most_null_vectors, modes, error, timers)
      n = max(count(abs(modes%mu) <= min(max(1.0e3_wp * step%locate_tolerance, same_place), loosest) * event%scale), 1)
      call choose_null_vectors(problem, state, system, n, modes)
      allocate (point%null_vector(3, problem%deck%mesh%n_nodes, n))
      do j = 1, n
         call deck_mode(problem, state, system, modes%x(:, j), point%null_vector(:, :, j), sense)
      end do
      point%note = 'bifurcation, simple'
      if (n == 2) point%note = 'bifurcation, double'
      if (n > 2) point%note = 'bifurcation, '//to_text(n)//'-fold'
   end subroutine find_null_vectors

   !> A critical point with its words. (gfortran 12 loses the length of a deferred-length component in a constructor.)
   function new_critical(label, note, bars) result(critical)
      character(*), intent(in) :: label, note
      type(error_bars_t), allocatable, intent(in), optional :: bars
      type(critical_t) :: critical
      critical%label = label
      critical%note = note
      if (.not. present(bars)) return
      if (allocated(bars)) critical%bars = bars
   end function new_critical
end module path_acceptance
