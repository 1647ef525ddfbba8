!> The critical points that branches and limit curves may start at, and that a path may come back to, kept as long as a step runs.
!> Runs point to them: copies of a run, which trials are made with, share them.
module critical_points
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_control, only: control_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: critical_point_t, critical_points_t

   !> A critical point.
   type :: critical_point_t
      character(2) :: label = ''
      type(problem_t) :: problem                 !! on the mesh of that point
      type(state_t) :: state
      integer :: point = 0                       !! its row in the results of its path, from 1
      integer :: pivots = 0                      !! negative ones on the side that its path comes from
      integer :: multiplicity = 0                !! BP: how many null vectors
      real(wp) :: scale = 1.0_wp                 !! BP: that of its event
      type(error_bars_t), allocatable :: bars    !! BP: where the deck wants them
      real(wp) :: arc_length = 0.0_wp
      real(wp), allocatable :: direction(:, :)   !! of its path: displacements
      real(wp) :: direction_load = 0.0_wp        !! and load factor
      real(wp), allocatable :: drift(:, :)       !! displacements less those between its neighbours: rounding
      type(control_t) :: control
   end type critical_point_t

   !> Those of one path, in order.
   type :: critical_points_t
      type(critical_point_t), allocatable :: list(:)
   contains
      procedure :: keep
   end type critical_points_t

contains

   !> A landmark, copied out of line as copy_problem does.
   pure subroutine copy_landmark(from, to)
      type(critical_point_t), intent(in) :: from
      type(critical_point_t), intent(inout) :: to
      to = from
   end subroutine copy_landmark

   !> Adds the one found last.
   subroutine keep(self, landmark)
      class(critical_points_t), intent(inout) :: self
      type(critical_point_t), intent(in) :: landmark
      type(critical_point_t), allocatable :: longer(:)
      integer :: i, n
      n = size(self%list)
      allocate (longer(n + 1))
      do i = 1, n
         call copy_landmark(self%list(i), longer(i))
      end do
      call copy_landmark(landmark, longer(n + 1))
      call move_alloc(longer, self%list)
   end subroutine keep
end module critical_points
