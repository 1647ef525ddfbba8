!> Where the contact changes the path has a corner: it arrives with one tangent and leaves with another one. The load may turn
!> there.
!>
!> A load that grows up to the corner and falls behind it, or the other way round, has its maximum, or minimum, at the corner: a
!> limit point, though no rate is zero there and no tangent singular. It is reported beside the change itself, at the same point.
!> One node more or less at the end of contact at nodes is no event, but the mesh's affair; nor is a load that turns there.
module corner_limit
   use kinds, only: wp
   use text, only: to_text
   use model, only: step_t, method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_continuity, only: path_tangent_t
   use path_control, only: is_arc_length
   use path_events, only: test_values_t, note_of_corner
   use path_state, only: path_state_t, path_tangent_of
   use looking_ahead, only: goes_on
   use event_recording, only: announce, new_critical
   use path_outcome, only: outcome_t
   use path_record, only: recorder_t, critical_t
   implicit none
   private
   public :: report_turned_load, look_whether_back

contains

   !> Reports a limit point at the run's point where the path that leaves there changes the load the other way than the path that
   !> arrived. Once at each point.
   subroutine report_turned_load(problem, step, run, recorder, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its probe has the rate of the load that leaves
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(critical_t) :: critical
      type(state_t) :: place
      type(test_values_t) :: values
      if (.not. load_turns(step, run)) return
      associate (arrived => run%arrived)
         critical = new_critical('LP', note_of_corner, arrived%bars)
         critical%point = arrived%point
         ! With the next contact spans the run may stand at another load already.
         place = run%state
         place%load_factor = arrived%load_factor
         values%monitor = arrived%monitor
         call announce(problem, run, critical, place, values, .true., recorder, outcome)
         arrived%point = 0
      end associate
   end subroutine report_turned_load

   !> True where the rates of the load on both sides of the run's point have opposite signs, beyond what the iteration leaves of a
   !> load that stands.
   pure logical function load_turns(step, run) result(turns)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      real(wp) :: slower
      associate (before => run%arrived%load_rate, after => run%probe%load_rate)
         turns = run%arrived%point > 0 .and. before * after < 0.0_wp
         if (.not. turns) return
         slower = min(abs(before), abs(after))
      end associate
      turns = slower * (run%arc_length - run%left_at) > step%tolerance * abs(run%arrived%load_factor)
   end function load_turns

   !> Ends a run by load or displacement control where the path goes on against what the control prescribes. The increments by load
   !> that a step by arc length begins with go the way of the path instead.
   subroutine look_whether_back(problem, step, run, outcome)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! where the contact has changed, with its heading behind it; its system is
      !! factored there, anywhere where the run ends
      type(outcome_t), intent(inout) :: outcome
      type(path_tangent_t) :: prescribed
      if (is_arc_length(run%control%method)) return
      prescribed = path_tangent_of(problem, run, run%state)
      if (.not. run%heading%load * prescribed%load < 0.0_wp) return
      if (is_arc_length(step%method)) then
         run%control%increment = sign(run%control%increment, run%heading%load)
         return
      end if
      outcome%turns = .true.
      outcome%why = 'the path turns back where the contact changes, at load factor '//to_text(run%state%load_factor)//': '// &
         & trim(merge('load control        ', 'displacement control', run%control%method == method_load))//' cannot follow it'
      if (goes_on(problem, run)) outcome%why = outcome%why//' (METHOD=CYLINDRICAL can)'
   end subroutine look_whether_back
end module corner_limit
