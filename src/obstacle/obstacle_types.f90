!> An obstacle as the deck describes it: its surface and its foundation.
module obstacle_types
   use kinds, only: wp, name_length
   use obstacle_curve, only: obstacle_curve_t
   implicit none
   private
   public :: obstacle_t
   public :: obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, obstacle_spline
   public :: ground_independent, ground_half_space, ground_pasternak

   ! Kinds of obstacles (words in the deck).
   integer, parameter :: obstacle_line = 1, obstacle_circle = 2, obstacle_arc = 3, obstacle_polyline = 4, obstacle_spline = 5

   ! Ground under a foundation (words in the deck): independent springs, or coupled as in ground_coupling.
   integer, parameter :: ground_independent = 1, ground_half_space = 2, ground_pasternak = 3

   !> Obstacle whose surface the structure cannot penetrate. Except for circles, the free side is to the left in the order of the
   !> points, and surfaces with ends continue straight.
   type :: obstacle_t
      character(name_length) :: name = ''
      integer :: kind = obstacle_line
      logical :: inside = .true.                !! circle: true if the structure is inside
      real(wp), allocatable :: point(:, :)      !! (2, points) line: two; polyline, spline: two or more
      real(wp) :: centre(2) = 0.0_wp            !! circle, arc
      real(wp) :: radius = 0.0_wp               !! circle, arc; polyline: radius of its rounded corners
      real(wp) :: angle(2) = 0.0_wp             !! [rad] arc: directions from the centre to the first and last point
      real(wp) :: reference_angle = 0.0_wp      !! [rad] direction from the centre at which contact angles are zero
      type(obstacle_curve_t) :: curve           !! arc, polyline, spline
      logical :: rigid = .true.
      real(wp) :: modulus = 0.0_wp              !! Winkler, Pasternak: force per unit length of rod and unit penetration
      integer :: ground = ground_independent
      real(wp) :: shear = 0.0_wp                !! Pasternak: stiffness of the shear layer times the width [force]
      real(wp) :: young = 0.0_wp, poisson = 0.0_wp !! half-space
      integer :: law = 0                        !! index into model%law, 0: none; its forces are multiplied by the width
      real(wp) :: width = 1.0_wp
      logical :: bilateral = .false.            !! true: permanent contact, with tension as well as pressure
      logical :: at_nodes = .false.             !! true: a line as model of stops at single nodes (*GAP): gaps count from each
      !! node's position at the start; modulus and law belong to one node
      integer :: carrier = 0                    !! node whose displacements x and y the obstacle has, 0: none
      logical :: along_rod = .false.            !! true: a line across a straight rod as model of soil that supports it along its
      !! axis (*AXIAL SOIL): it has no surface
   end type obstacle_t
end module obstacle_types
