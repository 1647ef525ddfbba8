!> A contact change is a corner of the path: the path tangents before and after it differ, and the load may turn there.
!>
!> If the load increases up to the corner and decreases behind it, or the reverse, the corner is a limit point, although no load
!> rate vanishes and no tangent is singular. This limit point is reported at the same point as the contact change. For contact at
!> nodes the change of a single node at the end of a contact region depends on the mesh; neither this change nor a turn of the load
!> at it is an event.
module corner_limit
   use kinds, only: wp
   use text, only: to_text
   use model, only: step_t, method_load
   use problem, only: problem_t
   use path_continuity, only: path_tangent_t
   use path_control, only: is_arc_length
   use path_events, only: note_of_corner
   use path_point, only: path_point_t
   use path_state, only: path_state_t, path_tangent_of
   use unrecorded_path, only: can_continue
   use event_recording, only: announce, new_critical
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t, critical_t
   implicit none
   private
   public :: report_turned_load, check_return

contains

   !> Reports a limit point at the last accepted point if the load rates of the path before and behind this point have opposite
   !> signs. It is reported once for each point.
   subroutine report_turned_load(problem, step, run, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its test values contain the load rate behind the last accepted point
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(critical_t) :: critical
      type(path_point_t) :: point
      if (.not. load_turns(step, run)) return
      associate (arrived => run%arrived)
         critical = new_critical('LP', note_of_corner, arrived%bars)
         critical%point = arrived%point
         ! The state with the next contact set may already be at another load factor.
         point = run%last
         point%state%load_factor = arrived%load_factor
         point%test_values%monitor = arrived%monitor
         call announce(problem, run, critical, point, .true., recorder, outcome)
         arrived%point = 0
      end associate
   end subroutine report_turned_load

   !> True if the load rates before and behind the last accepted point have opposite signs, and the smaller of them, times the arc
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
      if (can_continue(problem, run)) outcome%why = outcome%why//' (METHOD=CYLINDRICAL can)'
   end subroutine check_return
end module corner_limit
