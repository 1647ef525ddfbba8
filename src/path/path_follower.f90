!> Follows a path point by point: predict, correct, adapt the increment, go around corners of the contact set.
module path_follower
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use bordered_system, only: linearise
   use path_control, only: is_arc_length, set_tangent
   use path_continuity, only: heading_t, relation_t, relate, same_path, turned_over, too_far, at_corner
   use corner_ahead, only: corner_t, look_for_corner, is_near, part_before, differ
   use corrector, only: increment_t, take_increment
   use path_run, only: run_t, copy_run, footing_t, heading_of, turned_round
   use step_control, only: begin_arc_length, go_by_load, may_rest, next_increment, smallest, shorten_to_stop
   use path_events, only: new_probe
   use path_acceptance, only: accept
   use accuracy_asked, only: wants_another
   use path_outcome, only: outcome_t
   use contact_corner, only: find_corner, leave_corner
   use contact_regions, only: find_regions
   use span_changes, only: pass_change, pass_doubt
   use span_dips, only: note_slopes
   use span_mesh, only: renew_mesh, refine_mesh, coarsen_mesh, step_back, ask_for_twice
   use span_start, only: begin_spans
   use stiff_start, only: is_stiff_start, take_stiff_start
   use dead_end, only: why_stuck
   use path_record, only: recorder_t
   use timing, only: timers_t, count_up, counter_rejected, counter_cut
   implicit none
   private
   public :: follow_points

   integer, parameter :: max_cuts = 40          !! halvings of one increment
   integer, parameter :: cuts_before_corner = 2 !! failures after which the path may have a corner
   integer, parameter :: cuts_before_change = 3 !! failures after which a change of contact spans is looked for ahead
   real(wp), parameter :: least_load = 0.01_wp  !! of the load factor, that an increment after a corner may add
   integer, parameter :: cuts_before_mesh = 6   !! failures after which the mesh may be the reason
   real(wp), parameter :: sharper = 0.01_wp     !! of the residual, where an iteration has left too much
   integer, parameter :: max_searches = 4       !! halvings to tell events apart

contains

   !> Point after point, from where the run stands with its control set, to the stop condition.
   subroutine follow_points(problem, step, run, recorder, outcome, timers)
      type(problem_t), intent(inout) :: problem  !! its mesh changes with contact spans
      type(step_t), intent(in) :: step           !! of the deck, or as a branch has it
      type(run_t), intent(inout) :: run
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: sampled                 ! what contact spans were begun from
      type(run_t) :: unbegun                     ! the run there
      type(state_t) :: trial
      type(increment_t) :: report
      type(heading_t) :: ahead
      type(relation_t) :: relation, before
      logical :: finished, scaled, shorter, astray, changed, begins, taken
      integer :: failures                        ! since an increment has led on at once
      integer :: cuts, searches, tries, corner_tries, tried_at, doubled_at
      real(wp) :: first_increment, asked_at
      type(corner_t) :: corner                   ! that the last trials tell

      finished = .false.
      cuts = 0
      failures = 0
      searches = 0
      tries = 0
      corner_tries = 0
      tried_at = run%step_points
      doubled_at = -1
      asked_at = -1.0_wp
      first_increment = 0.0_wp
      taken = .false.
      changed = .false.
      points: do
         if (run%step_points >= step%max_points) then
            outcome%used_up = size(step%stop) > 0
            if (outcome%used_up) outcome%why = 'the allowed number of points was used up before the stop condition'
            return
         end if
         if (run%step_points /= tried_at) tries = 0
         if (run%step_points /= tried_at) corner_tries = 0
         if (run%step_points /= tried_at .or. .not. first_increment > 0.0_wp) first_increment = abs(run%control%increment)
         tried_at = run%step_points
         call go_by_load(step, run)
         if (is_arc_length(run%control%method)) &
            & call set_tangent(problem, run%system, run%heading%u, run%heading%load, run%control)
         call shorten_to_stop(step, run)
         call note_slopes(problem, run)
         begins = .false.
         if (.not. taken) then
            if (problem%is_sampled()) then
               call copy_problem(problem, sampled)
               call copy_run(run, unbegun)
               call begin_spans(problem, run, trial, report, timers)
               begins = report%converged
            else if (is_stiff_start(problem, run)) then
               call take_stiff_start(problem, run, trial, report, taken, timers)
            else
               call take_increment(problem, run%state, run%control, trial, run%system, report, timers)
            end if
         end if
         astray = .false.
         if (cuts == 0) then
            relation%told = .false.
            corner = corner_t()
         end if
         if (report%converged) call look_astray()
         taken = .false.
         if (astray .and. begins) then
            ! Before it other points and lines may hold.
            call copy_problem(sampled, problem)
            call copy_run(unbegun, run)
         end if
         if (astray .or. .not. report%converged) then
            call try_otherwise()
            if (finished .or. allocated(outcome%why)) return
            cycle points
         end if
         if (cuts == 0) failures = 0
         cuts = 0
         if (problem%has_spans() .and. .not. begins) then
            call pass_change(problem, step, run, trial, ahead, .false., tries, recorder, changed, finished, outcome, timers)
            if (finished .or. allocated(outcome%why)) return
            if (wants_another(run)) then
               call refine(.true.)
               cycle points
            end if
            if (changed .and. .not. allocated(run%stuck)) cycle points
         end if
         if (allocated(run%stuck)) then
            call ask_nodes()
            if (finished .or. allocated(outcome%why)) return
            if (changed) cycle points
            outcome%why = run%stuck
            return
         end if
         call accept(problem, step, run, trial, ahead, '  ', report, searches < max_searches, recorder, shorter, &
            & finished, outcome, timers, tries=tries)
         if (finished .or. allocated(outcome%why)) return
         if (shorter) then
            call search_closer()
            cycle points
         end if
         if (wants_another(run)) then
            call refine(.true.)
            cycle points
         end if
         searches = 0
         run%slopes%closer = 0
         if (allocated(run%slopes%ahead)) call move_alloc(run%slopes%ahead, run%slopes%here)
         if (allocated(run%footing)) deallocate (run%footing)
         call renew_mesh(problem, run, timers)
         if (allocated(run%spare)) call coarsen_mesh(problem, run, timers)
         if (is_arc_length(step%method) .and. .not. is_arc_length(run%control%method)) then
            call begin_arc_length(problem, step, run, scaled)
            if (.not. (run%last_length > 0.0_wp .or. run%control%load_scale > 0.0_wp .or. may_rest(step))) then
               outcome%why = 'the first increment moved nothing: the arc length has no scale'
               return
            end if
            ! An obstacle that is apart, or only touches, comes on in increments like the first.
            if (.not. (scaled .or. run%control%load_scale > 0.0_wp)) run%control%increment = step%increment
            if (scaled .or. .not. run%control%load_scale > 0.0_wp) cycle points
         end if
         if (allocated(run%control%tangent)) run%control%previous = run%control%tangent
         call next_increment(step, report, relation, problem%moves_nodes(), run%control)
      end do points

   contains

      !> Where there is no way on with a set of contact spans, once at each place: what do nodes say?
      subroutine ask_nodes()
         ! Points that changes alone have made, none of them anywhere else, are one place.
         changed = problem%has_spans() .and. run%arc_length - run%left_at > asked_at
         if (.not. changed) return
         asked_at = (1.0_wp + step%locate_tolerance) * (run%arc_length - run%left_at)
         call linearise(problem, run%state, run%state, run%system, timers)
         call pass_doubt(problem, step, run, first_increment, recorder, changed, finished, outcome, timers)
         ! They have been asked at the point where their set has been taken, too.
         asked_at = (1.0_wp + step%locate_tolerance) * (run%arc_length - run%left_at)
         if (.not. changed) return
         run%control%increment = sign(first_increment, run%control%increment)
         if (allocated(run%stuck)) deallocate (run%stuck)
         cuts = 0
      end subroutine ask_nodes

      !> The same increment once more, from the same point on the mesh that the trial asked for.
      subroutine refine(settled)
         logical, intent(in) :: settled          !! the trial is in equilibrium
         logical :: done
         cuts = 0
         tries = tries + 1
         if (run%unsettled) then
            run%unsettled = .false.
            problem%model%step(problem%step)%sharper = sharper * problem%model%step(problem%step)%sharper
            problem%deck%step(problem%step)%sharper = problem%model%step(problem%step)%sharper
            if (allocated(run%wanted)) deallocate (run%wanted)
            call linearise(problem, run%state, run%state, run%system, timers)
            return
         end if
         call refine_mesh(problem, run, trial, settled, taken, done, timers)
         if (.not. done) tries = huge(tries) - 1
      end subroutine refine

      !> Whether the equilibrium that was found lies on another path, or the path leads back; and the heading there.
      subroutine look_astray()
         logical :: around                      ! the path has a corner between the two
         ahead = heading_of(problem, run, trial)
         before = relation
         relation = relate(problem, run%state, trial, run%heading, ahead, run%fresh)
         astray = .not. same_path(relation)
         ! With contact spans corners are where their changes are located, and the heading is that after them.
         if (astray .and. .not. problem%has_spans()) then
            call look_for_corner(problem, run, trial, ahead, corner)
            around = .false.
            if (cuts > 0) around = corner%length >= 0.0_wp .or. at_corner(before, relation)
            astray = .not. (around .and. corner%goes_around .or. is_near(problem, step, run, corner))
         else
            corner = corner_t()
         end if
         ! The mesh of the increment is gone where contact at nodes has become spans.
         if (.not. changed) astray = astray .or. too_far(problem, run%control, relation)
         if (astray) report%message = 'what equilibrium there is ahead lies on another path, or behind a loop of this one'
         if (.not. astray) then
            astray = turned_round(problem, run, trial, ahead)
            if (astray) report%message = 'the path turns round and leads back over the points that it has passed'
         end if
         ! The same point on another mesh, where the run's point may not be in equilibrium, does not come from elsewhere.
         astray = astray .and. .not. (taken .and. .not. turned_over(relation))
      end subroutine look_astray

      !> From the last point again, which no increment has led on from: past a change of contact, on a finer mesh, around a corner,
      !> or by half the way.
      subroutine try_otherwise()
         type(footing_t), allocatable :: finer
         logical :: turned, asked
         call count_up(timers, counter_rejected)
         cuts = cuts + 1
         if (astray) failures = failures + 1
         call linearise(problem, run%state, run%state, run%system, timers)
         if (problem%has_spans() .and. cuts == cuts_before_change .and. allocated(run%trail)) then
            ! A change of contact just ahead may be the reason.
            trial = run%state
            ahead = run%heading
            call pass_change(problem, step, run, trial, ahead, .true., huge(1), recorder, changed, finished, outcome, timers)
            if (finished .or. allocated(outcome%why)) return
            if (allocated(run%stuck)) deallocate (run%stuck)
            if (changed) cuts = 0
            if (changed) return
            call linearise(problem, run%state, run%state, run%system, timers)
         end if
         if (cuts > cuts_before_change .and. allocated(run%footing)) then
            ! What was spared of the mesh may be the reason.
            call move_alloc(run%footing, finer)
            call step_back(finer, problem, run, timers)
            run%control%increment = sign(first_increment, run%control%increment)
            cuts = 0
            return
         end if
         if ((max(cuts, failures) > cuts_before_mesh .or. too_short(0.5_wp)) .and. doubled_at /= run%step_points) then
            ! Perhaps a mesh that the program has made is too coarse for any.
            doubled_at = run%step_points
            failures = 0
            call ask_for_twice(problem, run, asked)
            if (asked) then
               if (too_short(0.5_wp)) run%control%increment = sign(first_increment, run%control%increment)
               call refine(.false.)
               return
            end if
         end if
         ! A path turns at once where the contact set changes.
         if (cuts > cuts_before_corner .or. (astray .and. differ(run%state%active, trial%active))) then
            call turn_corner(problem, step, run, corner_tries, recorder, turned, finished, outcome, timers)
            if (finished .or. allocated(outcome%why)) return
            if (wants_another(run)) then
               corner_tries = corner_tries + 1
               call refine(.false.)
               return
            end if
            if (turned) cuts = 0
            if (turned) return
         end if
         run%control%increment = merge(part_before(problem, step, run, corner), 0.5_wp, astray) * run%control%increment
         if (report%hopeless) then
            outcome%why = 'no first point: '//report%message
            return
         else if (cuts > max_cuts .or. too_short(1.0_wp)) then
            if (.not. allocated(report%message)) report%message = 'no equilibrium'
            call ask_nodes()
            if (finished .or. allocated(outcome%why)) return
            if (changed) return
            call why_stuck(problem, step, run, report, outcome%why, outcome%turns, timers)
            return
         end if
         call count_up(timers, counter_cut)
         ! A shorter increment may ask for a mesh of its own.
         tries = 0
      end subroutine try_otherwise

      !> True where a part of the increment is not worth trying.
      pure logical function too_short(part)
         real(wp), intent(in) :: part
         too_short = part * abs(run%control%increment) < smallest(step, run%control)
      end function too_short

      !> Shorter increments tell apart events that the ends of one do not.
      subroutine search_closer()
         searches = searches + 1
         run%control%increment = 0.5_wp * run%control%increment
         call count_up(timers, counter_cut)
         call linearise(problem, run%state, run%state, run%system, timers)
      end subroutine search_closer
   end subroutine follow_points

   !> Tries whether the contact set changes at a corner just ahead; if so, goes there and around it.
   subroutine turn_corner(problem, step, run, tries, recorder, turned, finished, outcome, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run          !! its system is factored at the last point, on return too
      integer, intent(in) :: tries               !! meshes that the corner has had for its errors' sake, see accept
      class(recorder_t), intent(inout) :: recorder
      logical, intent(out) :: turned             !! the path stands at the corner, with its new contact set
      logical, intent(out) :: finished           !! the step ended before
      type(outcome_t), intent(inout) :: outcome
      type(timers_t), intent(inout) :: timers
      type(state_t) :: place, beyond
      type(heading_t) :: prescribed
      integer, allocatable :: corner(:)
      type(increment_t) :: report
      character(2) :: label
      real(wp) :: load
      integer :: regions, k
      logical :: shorter
      finished = .false.
      turned = .false.
      if (problem%candidates%n == 0) return
      call find_corner(problem, run%state, run%control, place, corner, run%system, report, turned, timers)
      if (.not. turned) then
         call linearise(problem, run%state, run%state, run%system, timers)
         return
      end if
      beyond = place
      do k = 1, size(corner)
         beyond%active(corner(k)) = .not. place%active(corner(k))
      end do
      ! One node more or less at the end of a region is the mesh's affair, not an event.
      regions = size(find_regions(problem, beyond)) - size(find_regions(problem, place))
      label = ''
      if (regions > 0) label = 'C+'
      if (regions < 0) label = 'C-'
      load = abs(run%last_load)
      call accept(problem, step, run, place, heading_of(problem, run, place), label, report, .false., recorder, shorter, &
         & finished, outcome, timers, beyond%active .neqv. place%active, tries=tries)
      if (finished .or. allocated(outcome%why) .or. wants_another(run)) return
      load = max(load, abs(run%last_load), least_load * abs(run%state%load_factor))
      call leave_corner(problem, corner, run%state, run%system, run%heading, turned, timers)
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
      if (.not. turned) then
         outcome%why = 'no way on from where the contact set changes'
      else if (is_arc_length(run%control%method)) then
         ! A structure that has become stiff there is not to be loaded faster than before.
         if (load < abs(run%heading%load) * run%control%increment) run%control%increment = load / abs(run%heading%load)
      else
         prescribed = heading_of(problem, run, run%state)
         outcome%turns = run%heading%load * prescribed%load < 0.0_wp
         if (outcome%turns) outcome%why = 'the path turns back where the contact set changes: '// &
            & trim(merge('load control        ', 'displacement control', run%control%method == method_load))// &
            & ' cannot follow it (an arc-length METHOD can)'
      end if
   end subroutine turn_corner
end module path_follower
