!> Requirements of a trial increment before its end can be accepted: none, or the same increment again, shorter, on another mesh or
!> with a smaller residual. Acceptance and contact changes return the requirements as a value, and the path follower fulfils them.
module trial_request
   use mesh_density, only: mesh_density_t
   use path_point, only: path_point_t
   implicit none
   private
   public :: request_t

   !> Requirements of one trial, and results of its contact changes.
   type :: request_t
      ! Requirements of the last trial. The trial is not recorded: the increment is repeated from the last accepted point.
      logical :: shorter = .false.               !! the increment is halved
      logical :: smaller_residual = .false.      !! the iteration must end with a smaller residual
      type(mesh_density_t), allocatable :: density(:)  !! (rod segments) density of the mesh that is needed; not allocated: the
      !! present one is high enough
      logical :: events_located = .false.        !! events were located between the last accepted point and the trial
      ! Contact changes.
      logical :: set_changed = .false.           !! the run has moved to a contact change, with the next set
      type(path_point_t), allocatable :: ahead   !! equilibrium of the next set, which is the next trial; not allocated: none is known
      character(:), allocatable :: no_set        !! reason why no next set was found; not allocated: no such failure
      ! Kept for all trials of one increment.
      logical :: at_last_point = .false.         !! the mesh is made for the last accepted point, not for the trial
      type(mesh_density_t), allocatable :: density_before(:) !! (rod segments) mesh density up to the last accepted point,
      !! before the mesh was made for the trial
   contains
      procedure :: begin_trial
      procedure :: begin_increment
      procedure :: remeshes
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
   pure logical function remeshes(self)
      class(request_t), intent(in) :: self
      remeshes = self%smaller_residual .or. allocated(self%density)
   end function remeshes
end module trial_request
