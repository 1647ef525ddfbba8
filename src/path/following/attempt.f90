!> Attempts to get on from one point of a path: where the last increment that was tried from there has led, and what those before
!> it have told.
module attempt
   use kinds, only: wp
   use rod_state, only: state_t
   use path_continuity, only: path_tangent_t, relation_t
   use corner_ahead, only: corner_t
   use corrector, only: increment_t
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   implicit none
   private
   public :: attempt_t, start_from, leads_on, ended

   type :: attempt_t
      ! The point.
      integer :: point = -1                      !! which of the step: how many come before it
      real(wp) :: first_increment = 0.0_wp       !! size of the first one that was tried from it
      logical :: changed = .false.               !! its contact set is a new one: so it was found when it was looked at last
      ! The last increment.
      type(state_t) :: trial                     !! its end, in equilibrium where the report says so
      type(increment_t) :: report
      type(path_tangent_t) :: ahead                   !! tangent at the trial
      type(relation_t) :: relation               !! of the point and the trial
      type(corner_t) :: corner                   !! between the two
      logical :: astray = .false.                !! the trial is in equilibrium, but not on the path ahead of the point
      logical :: begins = .false.                !! contact spans begin with it
      logical :: has_trial = .false.             !! the next trial is in equilibrium already, on another mesh, and the system
      !! factored there
      logical :: finished = .false.              !! the step has come to its end on the way
      ! Counters.
      integer :: cuts = 0                        !! increments from the point that led nowhere
      integer :: failures = 0                    !! those that went astray since one has led on at once
      integer :: searches = 0                    !! halvings to tell events apart
      integer :: meshes = 0                      !! that the increment has had for its errors' sake, see arrival_t
      integer :: corner_meshes = 0               !! that a corner of the contact set has had, likewise
      integer :: doubled_at = -1                 !! point for whose sake the mesh was made twice as fine last
      real(wp) :: asked_at = -1.0_wp             !! arc length up to which nodes have been asked what touches
   end type attempt_t

contains

   !> Begins with the point where the run stands, if it is another one.
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

   !> True for an increment that ends on the path ahead of the point.
   pure logical function leads_on(attempt)
      type(attempt_t), intent(in) :: attempt
      leads_on = attempt%report%converged .and. .not. attempt%astray
   end function leads_on

   !> True where nothing more is to be tried: the step is at its end, or the run cannot go on.
   pure logical function ended(attempt, outcome)
      type(attempt_t), intent(in) :: attempt
      type(outcome_t), intent(in) :: outcome
      ended = attempt%finished .or. allocated(outcome%why)
   end function ended
end module attempt
