!> Detects and locates the events between the last accepted point and a converged trial.
module event_search
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t, copy_path_state
   use branch_closure, only: check_parent_path
   use path_events, only: test_values_t, event_t, detect_events, value_events, event_limit, test_value
   use tangent_modes, only: apply_tangent
   use located_events, only: located_event_t
   use event_location, only: locate_event
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: findings_t, find_events

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

contains

   !> Finds all events between the last point and the trial.
   subroutine find_events(problem, step, run, trial, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run   !! if it is at an unloaded start, the rates there become those of the trial
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
      call check_parent_path(problem, run, trial, events, home)
      findings%closes_branch = allocated(home)
      allocate (findings%seen(0))
      call locate_all(problem, step, run, trial, events, findings%seen)
      if (findings%closes_branch) findings%seen = [findings%seen, home]
      if (size(step%stop) > 0 .or. size(step%locate) > 0) call find_hidden_values(problem, step, run, trial, findings)
   end subroutine find_events

   !> Distinguishes limit points from bifurcations at which the load of this path has an extremum (a symmetric pitchfork, followed
   !> along its branch). The load rate changes its sign at both. The stiffness along the path, t.K t/(t.q)^2 with the path tangent t
   !> and the load vector q, changes its sign at a limit point only.
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
         events(k)%meets = stiffness_along(problem, run%last) * stiffness_along(problem, trial) > 0.0_wp
         if (.not. events(k)%meets) cycle
         events(k)%label = 'BP'
         events(k)%note = 'bifurcation, meets the path that this one leaves on its other side'
      end do
   end subroutine distinguish_crossings

   !> t.K t with the tangent stiffness K and the displacements t of the path tangent, divided by the square of its load rate.
   real(wp) function stiffness_along(problem, point) result(stiffness)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      real(wp) :: moves(point%system%n), force(point%system%n)
      moves = merge(0.0_wp, point%system%tangent, point%system%fixed)
      call apply_tangent(problem, point%state, point%system, moves, force, stiffness)
   end function stiffness_along

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

   !> Index of the last located limit point, or else of a closure of the branch, which may be an extremum of the load; 0: neither.
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

   !> Removes events whose value lies between the values at the ends of the whole increment: such events have been detected already.
   subroutine drop_known(first, last, events)
      type(test_values_t), intent(in) :: first, last
      type(event_t), allocatable, intent(inout) :: events(:)
      integer :: i
      events = pack(events, [(.not. (test_value(first, events(i)) - events(i)%value) * (test_value(last, events(i)) - &
         & events(i)%value) < 0.0_wp, i=1, size(events))])
   end subroutine drop_known
end module event_search
