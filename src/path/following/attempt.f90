!> Attempts from one point of the path: the last trial increment and the counters of all trials from that point.
module attempt
   use kinds, only: wp
   use problem, only: problem_t
   use path_control, only: increment_between
   use path_continuity, only: relation_t
   use path_point, only: path_point_t
   use corner_ahead, only: corner_t
   use corrector, only: increment_t
   use trial_request, only: request_t
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   implicit none
   private
   public :: attempt_t, start_from, leads_on, note_change, ended

   !> Attempts to make an increment from one point of the path.
   type :: attempt_t
      ! The point from which the attempts are made:
      integer :: point = -1                      !! number of accepted points of the step before this point
      real(wp) :: first_increment = 0.0_wp       !! size of the first increment tried from this point
      logical :: changed = .false.               !! true: a contact change was made at the point while the trial was examined
      ! The last increment:
      type(path_point_t) :: trial                !! end of the increment, in equilibrium if report%converged
      type(increment_t) :: report                !! report of the correction to the trial
      type(request_t) :: request !! what the trial requires before the path can continue (shorter increment, another mesh, smaller
      !! residual)
      type(relation_t) :: relation               !! comparison of the trial with the point: directions, distances
      type(corner_t) :: corner                   !! corner of the path between the point and the trial, if one is predicted
      logical :: off_path = .false.                !! true: the trial is in equilibrium, but not on the path ahead of the point
      logical :: begins = .false.                !! true: with this increment contact at nodes becomes contact spans
      logical :: has_trial = .false.             !! true: the next trial is already in equilibrium, because it was transferred from
      !! another mesh or found behind a change of contact
      logical :: stiff_start = .false.           !! true: the path starts on stiff foundations, see take_stiff_start
      real(wp) :: planned = 0.0_wp               !! increment planned before a change of contact gave the trial; 0: the trial's own
      logical :: finished = .false.              !! true: the step ended at an event within the increment
      ! Counters:
      integer :: cuts = 0                        !! failed increments from the point
      integer :: failures = 0 !! increments that ended on other paths, since the last increment that succeeded at the first attempt
      integer :: searches = 0                    !! halvings of the increment that were made to separate events
      integer :: meshes = 0                      !! meshes made because of the increment's errors, see arrival_t
      integer :: corner_meshes = 0               !! meshes made because of the errors at a corner of the contact set
      integer :: doubled_at = -1                 !! number of the point at which the mesh density was doubled last; -1: none
      real(wp) :: searched_to = -1.0_wp             !! arc length up to which another contact set has been searched for; -1: none
   end type attempt_t

contains

   !> Begins the attempts at the last accepted point of the path. The counters of meshes are reset if this point is new.
   subroutine start_from(run, attempt)
      type(path_state_t), intent(in) :: run
      type(attempt_t), intent(inout) :: attempt
      logical :: moved
      moved = run%step_points /= attempt%point
      if (moved) then
         attempt%meshes = 0
         attempt%corner_meshes = 0
      end if
      if (moved .or. .not. attempt%first_increment > 0.0_wp) attempt%first_increment = abs(run%control%increment)
      attempt%point = run%step_points
   end subroutine start_from

   !> True if the increment ends in equilibrium on the path ahead of the point.
   pure logical function leads_on(attempt)
      type(attempt_t), intent(in) :: attempt
      leads_on = attempt%report%converged .and. .not. attempt%off_path
   end function leads_on

   !> Records whether the contact set was changed at the point while the trial was examined. If the path of the next set is known up
   !> to an equilibrium, this equilibrium is the next trial.
   subroutine note_change(problem, run, attempt)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run   !! its increment becomes that of the trial
      type(attempt_t), intent(inout) :: attempt
      attempt%changed = attempt%request%set_changed .and. .not. allocated(attempt%request%no_set)
      if (.not. allocated(attempt%request%ahead)) return
      attempt%trial = attempt%request%ahead
      attempt%report = increment_t(converged=.true.)
      attempt%has_trial = .true.
      attempt%planned = run%control%increment
      run%control%increment = increment_between(problem, run%control, run%last%state, attempt%trial%state)
   end subroutine note_change

   !> True if the step is complete or the run cannot continue.
   pure logical function ended(attempt, outcome)
      type(attempt_t), intent(in) :: attempt
      type(outcome_t), intent(in) :: outcome
      ended = attempt%finished .or. allocated(outcome%why)
   end function ended
end module attempt
