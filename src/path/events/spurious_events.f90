!> Whether what was seen on the way to a trial is what it seems: events that are none, and such as a shorter increment tells better.
module spurious_events
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use force_free_contact, only: count_released
   use path_control, only: path_length
   use path_continuity, only: largest_turn
   use path_state, only: path_state_t
   use path_events, only: test_values_t, new_test_values, event_bifurcation, event_release, event_value_reached, event_turning, &
      & event_limit
   use ground_cuts, only: find_cuts, inner_cuts
   use located_events, only: located_event_t
   use event_order, only: one_sided
   use event_search, only: findings_t
   use mesh_request, only: rounding_of
   implicit none
   private
   public :: better_from_nearer, hides_release, turns_by_rounding, doubt_limit, doubt_bifurcation

   character(*), parameter :: passing = 'bifurcation, or two paths that pass each other closely,'

contains

   !> True where a shorter increment may tell what this one does not: an event was not located, something went unseen, or an event
   !> lies where its mesh has no nodes for kinks. Values that are only looked for change nothing.
   logical function better_from_nearer(problem, run, trial, findings) result(better)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      type(findings_t), intent(in) :: findings
      integer :: i
      better = .not. findings%comes_home .and. one_sided(run, trial, findings%probe, findings%seen)
      do i = 1, size(findings%seen)
         if (better) return
         associate (sighting => findings%seen(i))
            better = .not. (findings%told(i) .or. sighting%located .or. &
               & any(sighting%event%kind == [event_value_reached, event_turning])) .or. passes_kinks(problem, run%state, sighting)
         end associate
      end do
   end function better_from_nearer

   !> True where kinks of foundations lie inside elements at a located event that have appeared on the way to it: a point between
   !> gives them nodes. Those of the last point have been refused some.
   logical function passes_kinks(problem, last, sighting)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: last
      type(located_event_t), intent(in) :: sighting
      passes_kinks = sighting%located .and. any(problem%layout%stretch%free)
      if (passes_kinks) passes_kinks = inner_cuts(find_cuts(problem, sighting%place)) > max(size(problem%mark), &
         & inner_cuts(find_cuts(problem, last)))
   end function passes_kinks

   !> True for an end of the step where lines have let go of what a trial behind it does not tell: elements so long that they buckle
   !> between their own nodes hide that, and those behind the end may be.
   logical function hides_release(problem, run, findings, end) result(hides)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run             !! its system is factored at the end
      type(findings_t), intent(in) :: findings
      integer, intent(in) :: end                 !! which of those seen
      integer :: pivots, i
      logical :: weak
      associate (seen => findings%seen)
         call count_released(problem, seen(end)%place, run%system, pivots, weak)
         hides = weak .and. run%probe%weak .and. run%system%negative_pivots == run%probe%negative_pivots
         do i = 1, size(seen)
            if (seen(i)%event%kind == event_release .and. seen(i)%located .and. .not. findings%told(i) .and. &
               & seen(i)%fraction < seen(end)%fraction) pivots = pivots - nint(sign(1.0_wp, seen(i)%event%before))
         end do
      end associate
      hides = hides .and. pivots /= run%probe%free_pivots
   end function hides_release

   !> True for a monitor that turns by no more than what rounding makes of it, as one that symmetry holds: that is nothing to tell.
   logical function turns_by_rounding(problem, step, run, probe, sighting) result(no_turn)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run             !! its system is factored at the place
      type(test_values_t), intent(in) :: probe         !! at the trial
      type(located_event_t), intent(in) :: sighting
      type(test_values_t) :: there
      real(wp) :: least
      integer :: m
      no_turn = .false.
      if (sighting%event%kind /= event_turning) return
      m = step%turning(sighting%event%monitor)
      there = new_test_values(problem, sighting%place, run%system, sighting%heading%load)
      least = rounding_of(problem, m)
      if (allocated(sighting%bars)) then
         if (sighting%bars%monitor(m)%told) least = max(least, sighting%bars%monitor(m)%rounding)
      end if
      no_turn = maxval(abs(there%monitor(m) - [run%probe%monitor(m), probe%monitor(m)])) <= least
   end function turns_by_rounding

   !> A limit point that finer elements have before the contact that there is, or as far ahead as the way since that has begun, is
   !> none that the mesh tells: where the load stands a mesh may have it fall by what it errs by.
   subroutine doubt_limit(problem, run, trial, sighting)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      type(located_event_t), intent(inout) :: sighting !! its bars
      real(wp) :: reach
      if (.not. allocated(sighting%bars) .or. sighting%event%kind /= event_limit) return
      reach = run%arc_length - max(run%left_at, run%since_change%at) + path_length(problem, run%state, sighting%place)
      if (sighting%bars%way > 0.0_wp) reach = reach + path_length(problem, sighting%place, trial)
      if (abs(sighting%bars%way) > reach) sighting%bars%unsure = .true.
   end subroutine doubt_limit

   !> What was located as a bifurcation may be two paths that pass each other: no path goes through where the null vector feels a
   !> force, and the points that the place was interpolated from lie on both.
   pure subroutine doubt_bifurcation(sighting)
      type(located_event_t), intent(inout) :: sighting !! not located where it is none
      if (.not. allocated(sighting%bars) .or. sighting%event%kind /= event_bifurcation) return
      sighting%located = sighting%bars%unfolding * sighting%swerve <= largest_turn
      if (.not. sighting%located) sighting%event%note = passing
   end subroutine doubt_bifurcation
end module spurious_events
