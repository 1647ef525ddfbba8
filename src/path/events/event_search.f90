!> What happened on the way to a converged trial: events between the last point and it, detected and located.
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

   !> What is known of a trial, and of the way there, before anything is recorded.
   type :: findings_t
      type(test_values_t) :: probe                   !! at the trial
      type(located_event_t), allocatable :: seen(:)
      logical :: comes_home = .false.          !! one of them is where its branch comes back to the path that it left
      logical, allocatable :: told(:)          !! (seen) by another one, or nothing to tell
      type(system_t), allocatable :: at_trial  !! the run's system there, which looking at events changes; not allocated where there
      !! are none
      logical :: stops = .false.               !! the trial meets the stop condition
      logical :: as_it_is = .false.            !! no other mesh will be made for the sake of errors
      type(error_bars_t), allocatable :: bars  !! of the trial; not allocated where they are not to be shown
   end type findings_t

contains

   !> All events between the last point and the trial, looked for, and the trial's probe.
   subroutine find_events(problem, step, run, trial, ahead, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the trial on entry, anywhere on return
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! tangent there
      type(findings_t), intent(out) :: findings  !! what of it is not known yet is as it begins
      type(event_t), allocatable :: events(:)
      type(located_event_t), allocatable :: home
      findings%probe = test_values_at(problem, run, trial, ahead)
      call count_released(problem, trial, run%system, findings%probe%free_pivots, findings%probe%weak)
      if (run%fresh) then
         run%probe%load_rate = findings%probe%load_rate
         run%probe%monitor_rate = findings%probe%monitor_rate
      end if
      call detect_events(problem, step, run%probe, findings%probe, run%state, trial, events)
      call check_parent_path(problem, run, trial, ahead, events, home)
      findings%comes_home = allocated(home)
      if (size(events) > 0 .or. findings%comes_home) findings%at_trial = run%system
      allocate (findings%seen(0))
      call look(problem, step, run, trial, ahead, events, findings%seen)
      if (findings%comes_home) findings%seen = [findings%seen, home]
      if (size(step%stop) > 0 .or. size(step%locate) > 0) &
         & call find_hidden_values(problem, step, run, trial, ahead, findings)
   end subroutine find_events

   !> A load that is passed on the way to a limit point, and again on the way back, does not show at the ends: to values such an
   !> increment is two.
   subroutine find_hidden_values(problem, step, run, trial, ahead, findings)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(findings_t), intent(inout) :: findings
      type(event_t), allocatable :: events(:)
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
      call value_events(problem, step, run%probe, top, run%state, place, events)
      if (size(events) == 0) return
      call drop_known(run%probe, findings%probe, events)
      n = size(findings%seen)
      call look(problem, step, run, place, heading, events, findings%seen)
      findings%seen(n + 1:)%fraction = part * findings%seen(n + 1:)%fraction
      call copy_path_state(run, beyond)
      beyond%state = place
      beyond%heading = heading
      beyond%probe = top
      beyond%fresh = .false.
      call value_events(problem, step, top, findings%probe, beyond%state, trial, events)
      call drop_known(run%probe, findings%probe, events)
      n = size(findings%seen)
      call look(problem, step, beyond, trial, ahead, events, findings%seen)
      findings%seen(n + 1:)%fraction = part + (1.0_wp - part) * findings%seen(n + 1:)%fraction
   end subroutine find_hidden_values

   !> Which of those seen turns the load, the last one; 0: none. A branch may do so where it comes home, too.
   pure integer function limit_among(findings) result(limit)
      type(findings_t), intent(in) :: findings
      integer :: i
      limit = 0
      do i = 1, size(findings%seen)
         if (findings%seen(i)%event%kind == event_limit .and. findings%seen(i)%located) limit = i
      end do
      if (limit == 0 .and. findings%comes_home) limit = size(findings%seen)
   end function limit_among

   !> Locates events between the point of a run and a later one, and adds them to those seen.
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

   !> Leaves those values that lie between both ends of the increment: these tell of them, too.
   subroutine drop_known(first, last, events)
      type(test_values_t), intent(in) :: first, last
      type(event_t), allocatable, intent(inout) :: events(:)
      integer :: i
      events = pack(events, [(.not. is_between(first, last, events(i)), i=1, size(events))])
   end subroutine drop_known

   !> True for a value that the increment starts on one side of and ends on the other.
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
