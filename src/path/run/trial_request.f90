!> Requirements that must be fulfilled before the end of a trial increment can be accepted. If there are any, the increment is
!> repeated: shorter, on another mesh, or with a smaller residual. Acceptance and contact changes return the requirements as a
!> value, and the path follower fulfils them.
module trial_request
   use kinds, only: wp
   use model, only: step_t
   use test_kinds, only: span_test_t, test_words
   use mesh_density, only: mesh_density_t
   use path_control, only: control_t
   use step_control, only: too_short
   use path_point, only: path_point_t
   implicit none
   private
   public :: request_t

   !> Requirements of one trial, and results of the contact changes in this trial.
   type :: request_t
      ! Requirements of the last trial. If there are any, the trial is not recorded, and the increment is repeated from the last
      ! accepted point:
      logical :: shorter = .false.               !! true: the increment must be halved
      logical :: smaller_residual = .false.      !! true: the Newton iteration must end with a smaller residual
      type(mesh_density_t), allocatable :: density(:) !! (rod segments) mesh density that is required; not allocated: the present
      !! density is high enough
      logical :: events_located = .false.        !! true: events were located between the last accepted point and the trial
      ! Results of contact changes:
      logical :: set_changed = .false.           !! true: the run is at a contact change, with the contact set behind the change
      type(path_point_t), allocatable :: ahead   !! equilibrium of the next contact set, which is the next trial; not allocated: no
      !! such equilibrium is known
      character(:), allocatable :: no_set !! reason why no next contact set was found; not allocated: there was no such failure
      ! Kept for all trials of one increment:
      logical :: at_last_point = .false.         !! true: the mesh is made for the last accepted point instead of the trial
      type(mesh_density_t), allocatable :: density_before(:) !! (rod segments) mesh density before the mesh was made for the trial
   contains
      procedure :: begin_trial
      procedure :: begin_increment
      procedure :: repeats_increment
      procedure :: locate_nearer
   end type request_t

contains

   !> Clears the requirements of the previous trial.
   pure subroutine begin_trial(self)
      class(request_t), intent(inout) :: self
      self%shorter = .false.
      self%smaller_residual = .false.
      self%set_changed = .false.
      if (allocated(self%density)) deallocate (self%density)
      if (allocated(self%ahead)) deallocate (self%ahead)
      if (allocated(self%no_set)) deallocate (self%no_set)
   end subroutine begin_trial

   !> Clears the data kept for all trials of the previous increment.
   pure subroutine begin_increment(self)
      class(request_t), intent(inout) :: self
      self%at_last_point = .false.
      if (allocated(self%density_before)) deallocate (self%density_before)
   end subroutine begin_increment

   !> True if the trial must be repeated on another mesh or with a smaller residual.
   pure logical function repeats_increment(self)
      class(request_t), intent(in) :: self
      repeats_increment = self%smaller_residual .or. allocated(self%density)
   end function repeats_increment

   !> Requests a shorter increment on which the zero of a test may be located. The path ends if this increment would be below the
   !> least one of the step.
   subroutine locate_nearer(self, step, control, test)
      class(request_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      type(control_t), intent(in) :: control     !! control of the present increment
      type(span_test_t), intent(in) :: test      !! test whose zero was not found
      self%shorter = .true.
      if (too_short(step, control, 0.5_wp)) self%no_set = 'where '//trim(test_words(test%kind))//' was not found'
   end subroutine locate_nearer
end module trial_request
