!> Remedies after a failed increment, in this order: release of interface points, a contact change just ahead, the mesh before the
!> last coarsening, a mesh twice as fine, a corner of the path, a shorter increment. If the increment would become too short,
!> another contact set is searched for by trials (continuing_with_set). A remedy is skipped if its condition is not met. A remedy
!> returns `done` = true if no further remedy is needed, because the remedy succeeded or the run ends.
module step_recovery
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement
   use problem, only: problem_t
   use corner_turning, only: turn_corner, part_before, differ
   use path_state, only: path_state_t, point_on_mesh_t
   use path_point, only: renew
   use step_control, only: too_short
   use path_outcome, only: outcome_t
   use force_law, only: segment_unknown
   use ground_following, only: is_live
   use span_changes, only: check_contact_change
   use span_mesh, only: step_back, request_double_mesh
   use increment_trials, only: retry_refined, try_another_set, attempt_t, note_change, ended
   use path_record, only: recorder_t
   use timing, only: count_up, counter_rejected, counter_cut
   use text, only: to_text
   use path_control, only: is_arc_length
   use event_location, only: value_rate
   use corner_limit, only: unrecorded_path_t, start_unrecorded, advance_unrecorded
   use corrector, only: increment_t
   implicit none
   private
   public :: try_recovery

   integer, parameter :: max_cuts = 40 !! largest number of failed attempts at one increment; with values from 20 to 80 every deck
   !! in input has the same results
   integer, parameter :: cuts_before_release = 2 !! failed attempts after which interface points are released
   integer, parameter :: cuts_before_corner = 2 !! failed attempts after which a corner of the path is searched for
   integer, parameter :: cuts_before_change = 3 !! failed attempts after which a contact change ahead is searched for
   integer, parameter :: cuts_before_mesh = 6 !! failed attempts, or increments that ended on other paths, after which the mesh is
   !! assumed to be too coarse

   integer, parameter :: most_points = 40 !! largest number of points followed ahead; with values from 20 to 80 every deck in input
   !! has the same results
   character(*), parameter :: arc_length_can = ' (METHOD=CYLINDRICAL can)'

contains

   !> Applies the first remedy that succeeds; if none does, the run ends.
   subroutine try_recovery(problem, step, run, attempt, recorder, outcome)
      type(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(attempt_t), intent(inout) :: attempt  !! the attempts from the last accepted point; the last one has failed
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical :: done
      call count_up(counter_rejected)
      attempt%cuts = attempt%cuts + 1
      if (attempt%off_path) attempt%failures = attempt%failures + 1
      call release_marks(done)
      if (.not. done) call go_past_change(done)
      if (.not. done) call go_back_to_finer_mesh(done)
      if (.not. done) call double_mesh(done)
      if (.not. done) call go_around_corner(done)
      if (.not. done) call cut_increment()

   contains

      !> Releases the interface points beside contact spans: the increment is repeated with elements that have the end of contact
      !> with a foundation inside. This helps if interface points meet one another or a touchdown point, or if they jump along the
      !> rod. The mesh of the next point has nodes at the new positions.
      subroutine release_marks(done)
         logical, intent(out) :: done
         integer :: m
         done = problem%has_spans() .and. attempt%cuts >= cuts_before_release
         if (done) done = any([(is_live(problem, run%last%state, m), m=1, size(problem%mark))])
         if (.not. done) return
         run%last%state%segment = segment_unknown
         call renew(problem, run%last)
      end subroutine release_marks

      !> Searches for a contact change of spans just ahead of the last accepted point, and makes this change.
      subroutine go_past_change(done)
         logical, intent(out) :: done
         done = .false.
         if (.not. (problem%has_spans() .and. attempt%cuts == cuts_before_change .and. allocated(run%trail))) return
         attempt%trial = run%last
         associate (request => attempt%request)
            call check_contact_change(problem, step, run, attempt%trial, .true., huge(1), recorder, request, attempt%finished, &
               & outcome)
            done = ended(attempt, outcome)
            if (done) return
            call note_change(problem, run, attempt)
            done = request%set_changed .or. request%shorter .or. request%repeats_increment()
            if (done) attempt%cuts = 0
            if (request%shorter) run%control%increment = 0.5_wp * run%control%increment
         end associate
      end subroutine go_past_change

      !> Repeats the increment on the mesh used before the last coarsening.
      subroutine go_back_to_finer_mesh(done)
         logical, intent(out) :: done
         type(point_on_mesh_t), allocatable :: finer
         done = attempt%cuts > cuts_before_change .and. allocated(run%mesh%before_coarsening)
         if (.not. done) return
         call move_alloc(run%mesh%before_coarsening, finer)
         call step_back(finer, problem, run)
         run%control%increment = sign(attempt%first_increment, run%control%increment)
         attempt%cuts = 0
      end subroutine go_back_to_finer_mesh

      !> Doubles the mesh density, at most once at each point, if the mesh was made by the program and may be too coarse for any
      !> increment.
      subroutine double_mesh(done)
         logical, intent(out) :: done
         done = .false.
         if (attempt%doubled_at == run%step_points) return
         if (max(attempt%cuts, attempt%failures) <= cuts_before_mesh .and. .not. too_short(step, run%control, 0.5_wp)) return
         attempt%doubled_at = run%step_points
         attempt%failures = 0
         call request_double_mesh(problem, run%last%state, attempt%request, done)
         if (.not. done) return
         if (too_short(step, run%control, 0.5_wp)) run%control%increment = sign(attempt%first_increment, run%control%increment)
         call retry_refined(problem, run, attempt, .false.)
      end subroutine double_mesh

      !> Passes a corner of the path at which the contact set changes.
      subroutine go_around_corner(done)
         logical, intent(out) :: done
         logical :: turned
         done = .false.
         if (attempt%cuts <= cuts_before_corner .and. &
            & .not. (attempt%off_path .and. differ(run%last%state%active, attempt%trial%state%active))) return
         call turn_corner(problem, step, run, attempt%corner_meshes, recorder, attempt%request, turned, attempt%finished, outcome)
         done = ended(attempt, outcome)
         if (done) return
         if (attempt%request%repeats_increment()) then
            attempt%corner_meshes = attempt%corner_meshes + 1
            call retry_refined(problem, run, attempt, .false.)
            done = .true.
            return
         end if
         if (turned) attempt%cuts = 0
         done = turned
      end subroutine go_around_corner

      !> Halves the increment, or shortens it to end just before a corner of the path at a foundation. If the increment becomes too
      !> short, another contact set is searched for; the run ends if none is found.
      subroutine cut_increment()
         if (attempt%off_path) then
            run%control%increment = part_before(problem, step, run, attempt%corner) * run%control%increment
         else
            run%control%increment = 0.5_wp * run%control%increment
         end if
         if (attempt%report%hopeless) then
            outcome%why = 'no first point: '//attempt%report%message
         else if (attempt%cuts > max_cuts .or. too_short(step, run%control, 1.0_wp)) then
            if (.not. allocated(attempt%report%message)) attempt%report%message = 'no equilibrium'
            call try_another_set(problem, step, run, attempt, recorder, outcome)
            if (attempt%changed .or. ended(attempt, outcome)) return
            call why_stuck(problem, step, run, attempt%report, outcome%why, outcome%turns)
         else
            call count_up(counter_cut)
            ! For the errors of the shortened increment, as many meshes may be made as for a new increment.
            attempt%meshes = 0
         end if
      end subroutine cut_increment
   end subroutine try_recovery

   !> Reason, as one sentence, why no further point of the path was found, with a remedy if one is known.
   !>
   !> Load control ends at a limit point, displacement control at a turning point of the monitor. To verify that such a point lies
   !> ahead, the path is followed by arc length, without recording, until the load or the monitor turns back.
   subroutine why_stuck(problem, step, run, report, why, turns)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(increment_t), intent(in) :: report   !! report of the last increment tried
      character(:), allocatable, intent(out) :: why
      logical, intent(out) :: turns             !! true: the path continues, but the step's strategy cannot follow it
      character(:), allocatable :: cut
      real(wp) :: at
      integer :: points
      turns = .false.
      why = 'no further point at load factor '//to_text(run%last%state%load_factor)//': '//report%message
      cut = ' (increments were cut to '//to_text(abs(run%control%increment))
      if (is_arc_length(run%control%method)) then
         why = why//cut//'; *STATIC sets the smallest, *CONTROLS the iterations)'
         return
      end if
      call look_ahead(problem, run, at, points, turns)
      if (.not. turns) then
         ! Arc-length strategies begin with an increment of the load factor.
         if (is_arc_length(step%method)) then
            why = why//cut//' of the load factor)'
         else if (points > 0) then
            why = why//cut//'; METHOD=CYLINDRICAL goes on from there, to load factor '//to_text(at)//' at least)'
         else
            why = why//cut//')'
         end if
      else if (step%method == method_displacement) then
         why = 'displacement control cannot pass the turning point of '//trim(problem%model%monitor(step%monitor)%name)// &
            & ' ahead, near load factor '//to_text(at)//arc_length_can//': '//why
      else if (step%method == method_load) then
         why = 'load control cannot pass the limit point ahead, near load factor '//to_text(at)//arc_length_can//': '//why
      else
         why = 'the first increment cannot pass the limit point near load factor '//to_text(at)//' (a smaller one can): '//why
      end if
   end subroutine why_stuck

   !> Follows the path by arc length until the controlled quantity (load or monitor) turns back.
   subroutine look_ahead(problem, run, at, points, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      real(wp), intent(out) :: at               !! load factor where the controlled quantity turns back, or at the last point
      integer, intent(out) :: points            !! number of points found
      logical, intent(out) :: found             !! true: the controlled quantity turns back
      type(unrecorded_path_t) :: look
      real(wp) :: rate_here, rate_there, load, slope
      integer :: controlled                      ! index of the controlled monitor; 0: the load factor
      logical :: ahead
      found = .false.
      points = 0
      at = run%last%state%load_factor
      if (.not. run%last%system%ok) return
      look = start_unrecorded(run)
      controlled = merge(run%control%monitor, 0, run%control%method == method_displacement)
      rate_here = value_rate(problem, controlled, look%here)
      ! If the controlled quantity already changes against the sign of the increment at the last accepted point, it has turned back
      ! before that point.
      if (.not. rate_here * run%control%increment > 0.0_wp) return
      do while (points < most_points)
         load = look%here%state%load_factor
         slope = look%here%tangent%load
         call advance_unrecorded(problem, look, ahead)
         if (.not. ahead) return
         points = points + 1
         rate_there = value_rate(problem, controlled, look%here)
         found = rate_here * rate_there < 0.0_wp
         at = look%here%state%load_factor
         if (found .and. (at - load) * slope < 0.0_wp) at = load
         if (found) return
         rate_here = rate_there
      end do
   end subroutine look_ahead
end module step_recovery
