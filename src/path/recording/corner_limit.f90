!> A contact change is a corner of the path: the path tangents before and after it differ, and the load may turn there.
!>
!> If the load increases up to the corner and decreases behind it, or the reverse, the corner is a limit point, although no load
!> rate vanishes and no tangent is singular. This limit point is reported at the same point as the contact change. For contact at
!> nodes the change of a single node at the end of a contact region depends on the mesh; neither this change nor a turn of the load
!> at it is an event.
!>
!> Messages about the further path are verified: beyond the end of a run the path is followed by arc length, without recording
!> points.
module corner_limit
   use kinds, only: wp
   use text, only: to_text
   use model, only: step_t, method_load, method_cylindrical
   use problem, only: problem_t
   use path_continuity, only: path_tangent_t, path_tangent_at, relate, same_path
   use path_control, only: is_arc_length, control_t, set_tangent, displacement_between
   use path_events, only: note_of_corner
   use path_point, only: path_point_t, advance
   use path_state, only: path_state_t, path_tangent_of
   use event_recording, only: announce, new_critical
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t, critical_t
   use corrector, only: increment_t
   use span_tests, only: spans_hold
   implicit none
   private
   public :: report_turned_load, check_return, unrecorded_path_t, start_unrecorded, advance_unrecorded

   integer, parameter :: most_cuts = 10        !! largest number of halvings of the increment

   !> Data for following the path by arc length without recording.
   type :: unrecorded_path_t
      type(path_point_t) :: here               !! last accepted point of the run, or the last point reached beyond it
      type(control_t) :: control               !! constraint of the increments
      integer :: cuts = 0                      !! number of halvings so far
   end type unrecorded_path_t

contains

   !> Reports a limit point at the last accepted point if the load rates of the path before and behind this point have opposite
   !> signs. The limit point is reported only once for each point.
   subroutine report_turned_load(problem, step, run, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its test values contain the load rate after the last accepted point
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(critical_t) :: critical
      type(path_point_t) :: point
      if (.not. load_turns(step, run)) return
      associate (arrived => run%arrived)
         critical = new_critical('LP', note_of_corner, arrived%bars)
         critical%point = arrived%point
         ! The last state already has the next contact set and may be at another load factor; the load factor at the corner is
         ! reported.
         point = run%last
         point%state%load_factor = arrived%load_factor
         point%test_values%monitor = arrived%monitor
         call announce(problem, run, critical, point, .true., recorder, outcome)
         arrived%point = 0
      end associate
   end subroutine report_turned_load

   !> True if the load rates before and behind the last accepted point have opposite signs, and if the smaller rate, times the arc
   !> length of this step or branch, exceeds the load change that the tolerance of the iteration leaves undetermined.
   pure logical function load_turns(step, run) result(turns)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      real(wp) :: slower
      associate (before => run%arrived%load_rate, after => run%last%test_values%load_rate)
         turns = run%arrived%point > 0 .and. before * after < 0.0_wp
         if (.not. turns) return
         slower = min(abs(before), abs(after))
      end associate
      turns = slower * (run%arc_length - run%left_at) > step%tolerance * abs(run%arrived%load_factor)
   end function load_turns

   !> Ends a run under load or displacement control if the path behind a contact change continues against the sign of the increment.
   !> In an arc-length step that begins with load increments, the sign of the increment is reversed instead.
   subroutine check_return(problem, step, run, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run   !! its last point is a contact change, with the path tangent behind the change
      type(outcome_t), intent(inout) :: outcome
      type(path_tangent_t) :: prescribed
      type(unrecorded_path_t) :: look
      logical :: continues
      if (is_arc_length(run%control%method)) return
      prescribed = path_tangent_of(problem, run, run%last)
      if (.not. run%last%tangent%load * prescribed%load < 0.0_wp) return
      if (is_arc_length(step%method)) then
         run%control%increment = sign(run%control%increment, run%last%tangent%load)
         return
      end if
      outcome%turns = .true.
      outcome%why = 'the path turns back where the contact changes, at load factor '//to_text(run%last%state%load_factor)//': '// &
         & trim(merge('load control        ', 'displacement control', run%control%method == method_load))//' cannot follow it'
      look = start_unrecorded(run)
      call advance_unrecorded(problem, look, continues)
      if (continues) outcome%why = outcome%why//' (METHOD=CYLINDRICAL can)'
   end subroutine check_return

   !> Prepares to follow the path without recording, from the last accepted point of the run. The increment is the arc length of the
   !> run's last increment, or an estimate from the load increment if no node has moved yet.
   pure function start_unrecorded(run) result(look)
      type(path_state_t), intent(in) :: run
      type(unrecorded_path_t) :: look
      look%control%method = method_cylindrical
      look%control%increment = run%last_length
      if (.not. look%control%increment > 0.0_wp) &
         & look%control%increment = abs(run%control%increment) / max(abs(run%last%tangent%load), tiny(1.0_wp))
      look%here = run%last
   end function start_unrecorded

   !> Goes to the next point of the path, if the corrector converges to a point on the path at which the contact spans remain valid.
   subroutine advance_unrecorded(problem, look, found)
      type(problem_t), intent(in) :: problem
      type(unrecorded_path_t), intent(inout) :: look      !! out: at the next point; unchanged if none was found
      logical, intent(out) :: found            !! true: a next point was found
      type(path_point_t) :: next
      type(increment_t) :: report
      found = .false.
      do while (look%cuts <= most_cuts)
         if (.not. look%here%system%ok) return
         associate (here => look%here)
            call set_tangent(problem, here%system, here%tangent%u, here%tangent%load, look%control)
            call advance(problem, here, look%control, next, report)
            if (report%converged) then
               next%tangent = path_tangent_at(problem, next%system, displacement_between(problem, here%state, next%state), &
                  & next%state%load_factor - here%state%load_factor)
               report%converged = same_path(relate(problem, here%state, next%state, here%tangent, next%tangent, .false.))
            end if
         end associate
         if (report%converged) exit
         look%cuts = look%cuts + 1
         look%control%increment = 0.5_wp * look%control%increment
      end do
      if (look%cuts > most_cuts) return
      ! The contact set is not changed here: the path is followed only as far as the set is valid.
      if (problem%has_spans()) report%converged = spans_hold(problem, next%state, next%system%force_scale)
      if (.not. report%converged) return
      found = .true.
      look%here = next
   end subroutine advance_unrecorded
end module corner_limit
