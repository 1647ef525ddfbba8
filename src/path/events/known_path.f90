!> Detects that a path returns to points that it has passed; it would otherwise be followed twice, or without end. For each
!> procedure the table names the object that is tested, the known part of the path with which it is compared, and the consequence in
!> the caller:
!>
!>   retraces_path           end of an increment, its tangent     last parts of the path           the increment is rejected
!>   check_closure           limit point or contact change        such points of the path itself   the path ends
!>   is_known_bifurcation    bifurcation or limit point           bifurcations (see below)         the path ends or passes it
!>   find_known_bifurcation  whole increment                      bifurcations (see below)         the known place is taken
!>
!> The first procedure compares directions: near its last points a path is close to itself in any case, so that only a reversed
!> direction shows a return. The other procedures compare positions only. A path is at a known point if its distance from this
!> point, over the arc length since the point (since the start of the path for bifurcations), is below the accuracy with which
!> events are located.
!>
!> At a bifurcation two paths cross. Known bifurcations are those of the parent path, if the run is on a branch, and earlier ones of
!> the path itself. On one of the two paths the load may have an extremum there, an eigenvalue may reach zero without changing its
!> sign, and no increment converges close to the bifurcation; but the position of the bifurcation is known from the other path. A
!> path that returns to one of its own limit points or contact changes is a closed loop or retraces itself.
module known_path
   use kinds, only: wp
   use text, only: to_text
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: carry_to
   use path_control, only: path_length
   use path_continuity, only: relate, relation_t, goes_back, stands_still
   use path_point, only: path_point_t, point_at, evaluate_tests
   use path_state, only: path_state_t, located_event_t
   use path_events, only: event_t, event_limit, event_bifurcation
   use critical_points, only: critical_point_t
   use path_outcome, only: outcome_t
   implicit none
   private
   public :: retraces_path, check_closure, is_known_bifurcation, find_known_bifurcation

   real(wp), parameter :: near = 1.0e-4_wp !! largest distance from a known critical point, divided by the length of the path, at
   !! which the path has returned to that point: the accuracy with which events are located; with values from 1E-5 to 1E-3 every
   !! deck in input has the same results

contains

   !> True if the increment went backwards: the trial lies on one of the last parts of the path, and its tangent points against
   !> their direction.
   logical function retraces_path(problem, run, trial) result(retraces)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      real(wp) :: rise
      integer :: k
      ! If only the load changes, the displacements of the path tangent are rounding and cannot be compared. The path then goes back
      ! if the load changes against its rate at the last point: at a limit point the load would hardly change.
      rise = trial%state%load_factor - run%last%state%load_factor
      retraces = stands_still(trial%tangent, rise)
      if (retraces) retraces = rise * run%last%tangent%load < 0.0_wp
      if (retraces .or. .not. allocated(run%trail)) return
      if (stands_still(trial%tangent, rise)) return
      do k = 1, size(run%trail)
         if (retraces) return
         associate (way => run%trail(k)%way)
            retraces = goes_back(problem, way%from, way%to, way%chord, way%first, way%last, trial%state, trial%tangent)
         end associate
      end do
   end function retraces_path

   !> True if `place` is a bifurcation of the parent path, or an earlier bifurcation of the path itself, beyond which the path is
   !> already known.
   logical function is_known_bifurcation(problem, run, place) result(known)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: place
      real(wp) :: travelled, distance
      integer :: j
      known = .false.
      if (.not. associated(run%home)) return
      travelled = run%arc_length - run%left_at + path_length(problem, run%last%state, place)
      do j = 1, size(run%home%list)
         if (run%home%list(j)%label /= 'BP') cycle
         distance = distance_from(problem, run%home%list(j), place)
         known = known .or. (distance <= near * travelled .and. has_returned(run, run%home%list(j), distance))
      end do
   end function is_known_bifurcation

   !> Stops a path that returns to one of its own limit points or contact changes. The path returns if its distance from that point,
   !> divided by the arc length since then, is below the location accuracy.
   subroutine check_closure(problem, run, place, label, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: place
      character(*), intent(in) :: label !! label of the point: LP, C+ or C-. C+ and C- are not distinguished, because a contact that
      !! begins on the way out ends on the way back
      type(outcome_t), intent(inout) :: outcome
      real(wp) :: here
      integer :: j
      here = run%arc_length + path_length(problem, run%last%state, place)
      do j = 1, size(run%critical_points%list)
         associate (critical_point => run%critical_points%list(j))
            if (critical_point%label(1:1) /= label(1:1)) cycle
            if (.not. distance_from(problem, critical_point, place) < near * (here - critical_point%arc_length)) cycle
            outcome%home = .true.
            outcome%why = 'the path comes back to its point '//to_text(critical_point%point)//' at load factor '// &
               & to_text(critical_point%state%load_factor)//': beyond lies what it has passed'
            return
         end associate
      end do
   end subroutine check_closure

   !> Detects that an increment passes a known bifurcation. Events of this increment that only repeat this bifurcation
   !> (a changed pivot count, an extremum of the load) are removed.
   subroutine find_known_bifurcation(problem, run, trial, events, home)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(event_t), allocatable, intent(inout) :: events(:)
      type(located_event_t), allocatable, intent(out) :: home !! the known bifurcation that the increment passes; not allocated: the
      !! increment passes none
      type(relation_t) :: relation
      type(state_t) :: place
      real(wp) :: before, after
      integer :: i, j
      if (.not. associated(run%home)) return
      if (.not. any(run%home%list%label == 'BP' .and. run%home%list%multiplicity > 0)) return
      relation = relate(problem, run%last%state, trial%state, run%last%tangent, trial%tangent, run%fresh)
      do j = 1, size(run%home%list)
         associate (critical_point => run%home%list(j))
            if (critical_point%label /= 'BP' .or. critical_point%multiplicity == 0) cycle
            place = transferred_here(problem, trial%state, critical_point)
            before = path_length(problem, run%last%state, place)
            after = path_length(problem, place, trial%state)
            ! On a circular path the sum of the two chords to the middle of an increment exceeds the chord of the whole increment by
            ! the fraction turn^2/32 (turn: angle between the end tangents); four times this fraction is allowed.
            if (max(before, after) < relation%length .and. has_returned(run, critical_point, before) .and. &
               & before + after <= (1.0_wp + 0.125_wp * relation%turn**2 + near) * relation%length) then
               allocate (home)
               home%event = event_t(kind=event_bifurcation, label='BP', scale=critical_point%scale)
               home%event%note = 'bifurcation'
               if (allocated(critical_point%bars)) home%bars = critical_point%bars
               home%fraction = before / (before + after)
               home%point = point_at(problem, place)
               home%point%tangent = run%last%tangent
               call evaluate_tests(problem, home%point)
               home%located = .true.
               events = pack(events, [(.not. repeats_home(events(i)), i=1, size(events))])
               return
            end if
         end associate
      end do

   contains

      !> True if an event only repeats the known bifurcation: a change of the pivot count, or an extremum of the load, at the same
      !> position.
      pure logical function repeats_home(event)
         type(event_t), intent(in) :: event
         repeats_home = event%kind == event_bifurcation
         if (event%kind == event_limit) repeats_home = (place%load_factor - run%last%state%load_factor) * &
            & (place%load_factor - trial%state%load_factor) > 0.0_wp
      end function repeats_home
   end subroutine find_known_bifurcation

   !> True if the path has returned to a bifurcation from which it had started or which it had passed. On a branch every approach is
   !> such a return. On other paths the arc length since the bifurcation must be more than twice the distance from it.
   pure logical function has_returned(run, critical_point, distance)
      type(path_state_t), intent(in) :: run
      type(critical_point_t), intent(in) :: critical_point
      real(wp), intent(in) :: distance           !! arc length from the bifurcation
      has_returned = run%branch > 0 .or. run%arc_length - critical_point%arc_length > 2.0_wp * distance
   end function has_returned

   !> Path length between a critical point and a place.
   real(wp) function distance_from(problem, critical_point, place) result(distance)
      type(problem_t), intent(in) :: problem
      type(critical_point_t), intent(in) :: critical_point
      type(state_t), intent(in) :: place
      distance = path_length(problem, transferred_here(problem, place, critical_point), place)
   end function distance_from

   !> State of a critical point, transferred to the mesh of `here`.
   function transferred_here(problem, here, critical_point) result(state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: here          !! any state on the present mesh
      type(critical_point_t), intent(in) :: critical_point
      type(state_t) :: state
      if (problem%deck_mesh) then
         state = critical_point%state
         return
      end if
      state%geometry = here%geometry
      call carry_to(critical_point%problem, critical_point%state, problem, state)
   end function transferred_here
end module known_path
