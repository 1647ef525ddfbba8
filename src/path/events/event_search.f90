!> Detects and locates the events between the last accepted point and a converged trial.
module event_search
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use force_free_contact, only: count_released
   use path_continuity, only: path_tangent_t
   use path_state, only: path_state_t, copy_path_state, test_values_at
   use branch_closure, only: check_parent_path
   use path_events, only: test_values_t, event_t, detect_events, value_events, event_limit
   use located_events, only: located_event_t
   use event_location, only: locate
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: findings_t, find_events

   !> Results of the search for events, before anything is recorded.
   type :: findings_t
      type(test_values_t) :: test_values             !! at the trial
      type(located_event_t), allocatable :: seen(:)
      logical :: comes_home = .false.          !! the last of them is a branch closure: the branch returns to its parent path
      logical, allocatable :: duplicate(:)     !! (seen) true: duplicate of another event, or spurious; not reported
      integer, allocatable :: beside(:) !! (seen) limit point at a corner: index of the contact change there; 0: none
      type(system_t), allocatable :: at_trial !! system factored at the trial, which the location of events overwrites; not
      !! allocated if there are no events
      logical :: stops = .false.               !! the trial meets the stop condition
      logical :: as_it_is = .false.            !! the mesh will not be refined for the sake of errors
      type(error_bars_t), allocatable :: bars  !! error bars of the trial; not allocated: not shown
   end type findings_t

contains

   !> Test values of the trial, and all events between the last point and the trial.
   subroutine find_events(problem, step, run, trial, ahead, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the trial on entry, at any point on return
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! path tangent at the trial
      type(findings_t), intent(out) :: findings  !! components not determined here keep their defaults
      type(event_t), allocatable :: events(:)
      type(located_event_t), allocatable :: home
      findings%test_values = test_values_at(problem, run, trial, ahead)
      call count_released(problem, trial, run%system, findings%test_values%free_pivots, findings%test_values%weak)
      if (run%fresh) then
         run%test_values%load_rate = findings%test_values%load_rate
         run%test_values%monitor_rate = findings%test_values%monitor_rate
      end if
      call detect_events(problem, step, run%test_values, findings%test_values, run%state, trial, events)
      call check_parent_path(problem, run, trial, ahead, events, home)
      findings%comes_home = allocated(home)
      if (size(events) > 0 .or. findings%comes_home) findings%at_trial = run%system
      allocate (findings%seen(0))
      call look(problem, step, run, trial, ahead, events, findings%seen)
      if (findings%comes_home) findings%seen = [findings%seen, home]
      if (size(step%stop) > 0 .or. size(step%locate) > 0) &
         & call find_hidden_values(problem, step, run, trial, ahead, findings)
   end subroutine find_events

   !> Finds prescribed values that are passed twice in one increment, before and behind a limit point, so that its ends do not show
   !> them: the increment is divided at the limit point.
   subroutine find_hidden_values(problem, step, run, trial, ahead, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(findings_t), intent(inout) :: findings
      type(event_t), allocatable :: events(:)     ! up to the limit point
      type(event_t), allocatable :: beyond_it(:)
      type(state_t) :: place
      type(path_tangent_t) :: heading
      type(test_values_t) :: top
      type(path_state_t) :: beyond
      real(wp) :: part
      integer :: limit, n
      limit = limit_among(findings)
      if (limit == 0) return
      place = findings%seen(limit)%place
      heading = findings%seen(limit)%heading
      part = findings%seen(limit)%fraction
      call linearise(problem, place, place, run%system)
      top = test_values_at(problem, run, place, heading)
      call value_events(problem, step, run%test_values, top, run%state, place, events)
      call value_events(problem, step, top, findings%test_values, place, trial, beyond_it)
      if (size(events) + size(beyond_it) == 0) return
      call drop_known(run%test_values, findings%test_values, events)
      n = size(findings%seen)
      call look(problem, step, run, place, heading, events, findings%seen)
      findings%seen(n + 1:)%fraction = part * findings%seen(n + 1:)%fraction
      call copy_path_state(run, beyond)
      beyond%state = place
      beyond%heading = heading
      beyond%test_values = top
      beyond%fresh = .false.
      call drop_known(run%test_values, findings%test_values, beyond_it)
      n = size(findings%seen)
      call look(problem, step, beyond, trial, ahead, beyond_it, findings%seen)
      findings%seen(n + 1:)%fraction = part + (1.0_wp - part) * findings%seen(n + 1:)%fraction
   end subroutine find_hidden_values

   !> Index of the last located limit point, or else of a branch closure, where the load may turn, too; 0: none.
   pure integer function limit_among(findings) result(limit)
      type(findings_t), intent(in) :: findings
      integer :: i
      limit = 0
      do i = 1, size(findings%seen)
         if (findings%seen(i)%event%kind == event_limit .and. findings%seen(i)%located) limit = i
      end do
      if (limit == 0 .and. findings%comes_home) limit = size(findings%seen)
   end function limit_among

   !> Locates events between the point of a path state and a later point, and appends them to those seen.
   subroutine look(problem, step, from, to, heading, wanted, seen)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: from
      type(state_t), intent(in) :: to
      type(path_tangent_t), intent(in) :: heading
      type(event_t), intent(in) :: wanted(:)
      type(located_event_t), allocatable, intent(inout) :: seen(:)
      type(located_event_t), allocatable :: found(:)
      integer :: k
      allocate (found(size(wanted)))
      do k = 1, size(wanted)
         found(k)%event = wanted(k)
         call locate(problem, step, from, to, heading, found(k))
      end do
      if (size(seen) > 0) found = [seen, found]
      call move_alloc(found, seen)
   end subroutine look

   !> Removes the values that lie between both ends of the whole increment, which were detected already.
   subroutine drop_known(first, last, events)
      type(test_values_t), intent(in) :: first, last
      type(event_t), allocatable, intent(inout) :: events(:)
      integer :: i
      events = pack(events, [(.not. is_between(first, last, events(i)), i=1, size(events))])
   end subroutine drop_known

   !> True if a value lies between those at both ends of the increment.
   pure logical function is_between(first, last, event)
      type(test_values_t), intent(in) :: first, last
      type(event_t), intent(in) :: event
      associate (monitor => event%monitor, value => event%value)
         if (monitor == 0) then
            is_between = (first%load_factor - value) * (last%load_factor - value) < 0.0_wp
         else
            is_between = (first%monitor(monitor) - value) * (last%monitor(monitor) - value) < 0.0_wp
         end if
      end associate
   end function is_between
end module event_search
