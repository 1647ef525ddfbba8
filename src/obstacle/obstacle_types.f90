!> An obstacle as the deck describes it: its surface and its foundation.
module obstacle_types
   use kinds, only: wp, name_length
   use obstacle_curve, only: obstacle_curve_t
   implicit none
   private
   public :: obstacle_t
   public :: obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, obstacle_spline
   public :: ground_independent, ground_half_space, ground_pasternak

   ! Kinds of obstacles (words of the deck):
   integer, parameter :: obstacle_line = 1, obstacle_circle = 2, obstacle_arc = 3, obstacle_polyline = 4, obstacle_spline = 5

   ! Ground under a foundation (words of the deck): independent springs, or springs coupled as in ground_coupling:
   integer, parameter :: ground_independent = 1, ground_half_space = 2, ground_pasternak = 3

   !> Obstacle whose surface the structure cannot penetrate. The free side is to the left in the order of the points (except for
   !> circles); surfaces with ends are continued by straight lines.
   type :: obstacle_t
      character(name_length) :: name = ''
      integer :: kind = obstacle_line
      logical :: inside = .true.                !! circle: true: the structure is inside; false: outside
      real(wp), allocatable :: point(:, :)      !! (2, points) line: two points; polyline, spline: two or more
      real(wp) :: centre(2) = 0.0_wp            !! circle, arc: centre (x, y)
      real(wp) :: radius = 0.0_wp               !! circle, arc: radius; polyline: radius of its rounded corners
      real(wp) :: angle(2) = 0.0_wp             !! arc: directions from the centre to the first and last point [rad]
      real(wp) :: reference_angle = 0.0_wp      !! direction from the centre in which contact angles are zero [rad]
      type(obstacle_curve_t) :: curve           !! arc, polyline, spline: its curve
      logical :: rigid = .true.
      real(wp) :: modulus = 0.0_wp              !! Winkler, Pasternak: force by length of rod and penetration [force/length^2]
      integer :: ground = ground_independent
      real(wp) :: shear = 0.0_wp                !! Pasternak: stiffness of the shear layer times the width of the rod [force]
      real(wp) :: young = 0.0_wp, poisson = 0.0_wp !! half-space: Young's modulus and Poisson's ratio
      integer :: law = 0 !! index into model%law; 0: none. The forces of the law are multiplied by the width of the rod
      real(wp) :: width = 1.0_wp
      logical :: bilateral = .false.            !! true: permanent contact, with tension as well as pressure
      logical :: at_nodes = .false. !! true: a line that represents stops at single nodes (*GAP). Gaps are measured from the
      !! position of each node at the start; modulus and law are those of one node
      integer :: carrier = 0                    !! node with which the obstacle moves; 0: none
      logical :: along_rod = .false. !! true: a line across a straight rod that represents soil along the axis of the rod (*AXIAL
      !! SOIL); it has no surface
   end type obstacle_t
end module obstacle_types
