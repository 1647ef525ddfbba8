!> Critical points of one path. Branches and limit curves start from these points, and a path that returns to one of them is closed.
!> The list is kept until the step ends. Path states contain a pointer to the list, so that copies made for trial increments share
!> it.
module critical_points
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_control, only: control_t
   use path_continuity, only: path_tangent_t
   use error_bar, only: error_bars_t
   implicit none
   private
   public :: critical_point_t, critical_points_t, way_t

   !> First point of a path that leaves a contact change with another contact set than the path of the run.
   type :: way_t
      type(problem_t) :: problem                 !! problem with this contact set
      type(state_t) :: state
      type(path_tangent_t) :: tangent            !! path tangent, pointing away from the contact change
   end type way_t

   !> A critical point, with the data for branch switching and for checking whether a path returns to a point that it has passed.
   type :: critical_point_t
      character(2) :: label = ''                 !! '': a contact change without label
      type(problem_t) :: problem                 !! problem with the mesh on which the point was found
      type(state_t) :: state
      integer :: point = 0                       !! row of the point in the results of its path, from 1
      integer :: pivots = 0                      !! number of negative pivots before the point
      integer :: multiplicity = 0                !! BP: number of null vectors
      integer :: opens = 0 !! BP: 1 (or -1) if only the side along (or against) the null vector opens contacts; 0: both sides exist
      type(way_t), allocatable :: way(:)         !! BP: paths with other contact sets that leave the point, in place of null vectors
      real(wp) :: scale = 1.0_wp                 !! BP: scale of the eigenvalue, see event_t
      logical :: corner = .false. !! LP: true: the load turns at a corner of the path, so that its rate is not zero there
      type(error_bars_t), allocatable :: bars    !! BP: error bars, if the deck requests them
      real(wp) :: arc_length = 0.0_wp
      real(wp), allocatable :: direction(:, :)   !! (3, nodes) change of the displacements along the path up to the point
      real(wp) :: direction_load = 0.0_wp        !! change of the load factor along the path up to the point
      real(wp), allocatable :: drift(:, :) !! (3, nodes) BP with null vectors: deviation of the point from the chord between its two
      !! neighbours on the path: a measure of rounding; else 0
      type(control_t) :: control
   end type critical_point_t

   !> The critical points of one path, in the order of the path.
   type :: critical_points_t
      type(critical_point_t), allocatable :: list(:)
   contains
      procedure :: keep
   end type critical_points_t

contains

   !> Copies a critical point. The copy is a procedure, because the compiler would otherwise write out the copies of all components
   !> at each assignment.
   pure subroutine copy_critical_point(from, to)
      type(critical_point_t), intent(in) :: from
      type(critical_point_t), intent(inout) :: to
      to = from
   end subroutine copy_critical_point

   !> Appends a critical point to the list.
   subroutine keep(self, critical_point)
      class(critical_points_t), intent(inout) :: self
      type(critical_point_t), intent(in) :: critical_point
      type(critical_point_t), allocatable :: longer(:)
      integer :: i, n
      n = size(self%list)
      allocate (longer(n + 1))
      do i = 1, n
         call copy_critical_point(self%list(i), longer(i))
      end do
      call copy_critical_point(critical_point, longer(n + 1))
      call move_alloc(longer, self%list)
   end subroutine keep
end module critical_points
