!> A branch that comes back to a bifurcation of the path that it left, or a path to one of its own. Two paths cross there: the load
!> of one may turn, an eigenvalue come to zero and go back, no increment gets near. But the place is known: it was found before.
!> So are those of other events: a path that comes to one of them once more goes round, or back the way that it came.
module branch_closure
   use kinds, only: wp
   use text, only: to_text
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: carry_to
   use path_control, only: path_length
   use path_continuity, only: path_tangent_t, relate, relation_t
   use path_state, only: path_state_t
   use path_events, only: event_t, event_limit, event_bifurcation
   use critical_points, only: critical_point_t
   use path_outcome, only: outcome_t
   use located_events, only: located_event_t
   implicit none
   private
   public :: on_parent_path, check_parent_path, check_closure

   real(wp), parameter :: near = 1.0e-4_wp       !! of a path's length: as well as places are located

contains

   !> True for a branch at a bifurcation of the path that it left, or a path at one of its own: beyond, it is that path, or itself
   !> again.
   logical function on_parent_path(problem, run, place)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: place
      real(wp) :: travelled, distance
      integer :: j
      on_parent_path = .false.
      if (.not. associated(run%home)) return
      travelled = run%arc_length - run%left_at + path_length(problem, run%state, place)
      do j = 1, size(run%home%list)
         if (run%home%list(j)%label /= 'BP') cycle
         distance = path_length(problem, seen_here(problem, place, run%home%list(j)), place)
         on_parent_path = on_parent_path .or. (distance <= near * travelled .and. comes_back(run, run%home%list(j), distance))
      end do
   end function on_parent_path

   !> Stops a path at a limit point, or change of contact, where it has had one before: as near to that as places are located on the
   !> way that it has gone since.
   subroutine check_closure(problem, run, place, label, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: place
      character(*), intent(in) :: label          !! LP, C+ or C-; contact that was gained is lost on the way back
      type(outcome_t), intent(inout) :: outcome
      real(wp) :: here
      integer :: j
      here = run%arc_length + path_length(problem, run%state, place)
      do j = 1, size(run%critical_points%list)
         associate (landmark => run%critical_points%list(j))
            if (landmark%label(1:1) /= label(1:1)) cycle
            if (.not. path_length(problem, seen_here(problem, place, landmark), place) < near * (here - landmark%arc_length)) cycle
            outcome%home = .true.
            outcome%why = 'the path comes back to its point '//to_text(landmark%point)//' at load factor '// &
               & to_text(landmark%state%load_factor)//': beyond lies what it has passed'
            return
         end associate
      end do
   end subroutine check_closure

   !> Where an increment passes a bifurcation of the path that its branch left. Of the events that its ends tell those that are
   !> this one are taken away: a pivot count that changes, a load that is largest or least there.
   subroutine check_parent_path(problem, run, trial, ahead, events, home)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! tangent there
      type(event_t), allocatable, intent(inout) :: events(:)
      type(located_event_t), allocatable, intent(out) :: home !! not allocated: it passes none
      type(relation_t) :: relation
      real(wp) :: before, after
      integer :: i, j
      if (.not. associated(run%home)) return
      relation = relate(problem, run%state, trial, run%heading, ahead, run%fresh)
      do j = 1, size(run%home%list)
         associate (landmark => run%home%list(j))
            if (landmark%label /= 'BP' .or. landmark%multiplicity == 0) cycle
            allocate (home)
            home%place = seen_here(problem, trial, landmark)
            before = path_length(problem, run%state, home%place)
            after = path_length(problem, home%place, trial)
            ! On a circle the two chords are longer by turn^2/32.
            if (max(before, after) < relation%length .and. comes_back(run, landmark, before) .and. &
               & before + after <= (1.0_wp + 0.125_wp * relation%turn**2 + near) * relation%length) then
               home%event = event_t(kind=event_bifurcation, label='BP', scale=landmark%scale)
               home%event%note = 'bifurcation'
               if (allocated(landmark%bars)) home%bars = landmark%bars
               home%fraction = before / (before + after)
               home%heading = run%heading
               home%located = .true.
               events = pack(events, [(.not. is_that(events(i)), i=1, size(events))])
               return
            end if
            deallocate (home)
         end associate
      end do

   contains

      pure logical function is_that(event)
         type(event_t), intent(in) :: event
         is_that = event%kind == event_bifurcation
         if (event%kind == event_limit) is_that = (home%place%load_factor - run%state%load_factor) * &
            & (home%place%load_factor - trial%load_factor) > 0.0_wp
      end function is_that
   end subroutine check_parent_path

   !> False for a bifurcation that a path has just come through: it has gone straight away from there.
   pure logical function comes_back(run, landmark, distance)
      type(path_state_t), intent(in) :: run
      type(critical_point_t), intent(in) :: landmark
      real(wp), intent(in) :: distance           !! from there, arc length
      comes_back = run%branch > 0 .or. run%arc_length - landmark%arc_length > 2.0_wp * distance
   end function comes_back

   !> The state of a landmark on the mesh that is worked on.
   function seen_here(problem, here, landmark) result(state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: here          !! of that mesh
      type(critical_point_t), intent(in) :: landmark
      type(state_t) :: state
      state = landmark%state
      if (problem%deck_mesh) return
      state%geometry = here%geometry
      call carry_to(landmark%problem, landmark%state, problem, state)
   end function seen_here
end module branch_closure
