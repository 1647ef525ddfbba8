!> An obstacle as the deck states it: where its surface is, and what is behind it.
module obstacle_types
   use kinds, only: wp, name_length
   use obstacle_curve, only: obstacle_curve_t
   implicit none
   private
   public :: obstacle_t
   public :: obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, obstacle_spline
   public :: ground_independent, ground_half_space, ground_pasternak

   ! Kinds of obstacles (named in the deck by words).
   integer, parameter :: obstacle_line = 1, obstacle_circle = 2, obstacle_arc = 3, obstacle_polyline = 4, obstacle_spline = 5

   ! What a foundation does beside a reaction (named in the deck by words): nothing, or as ground_coupling says.
   integer, parameter :: ground_independent = 1, ground_half_space = 2, ground_pasternak = 3

   !> A surface the structure cannot cross. But for circles, the free side is on the left of the sense in which its points
   !> come, and what has ends is continued straight.
   type :: obstacle_t
      character(name_length) :: name = ''
      integer :: kind = obstacle_line
      logical :: inside = .true.                !! circle: the structure lives inside
      real(wp), allocatable :: point(:, :)      !! (2, points) line: two; polyline, spline: two or more
      real(wp) :: centre(2) = 0.0_wp            !! circle, arc
      real(wp) :: radius = 0.0_wp               !! circle, arc; polyline: of its rounded corners
      real(wp) :: angle(2) = 0.0_wp             !! [rad] arc: directions from the centre to its first and last point
      real(wp) :: reference_angle = 0.0_wp      !! [rad] direction from the centre that contact angles count from
      type(obstacle_curve_t) :: curve           !! arc, polyline, spline
      logical :: rigid = .true.
      real(wp) :: modulus = 0.0_wp              !! Winkler, Pasternak: force per unit length of rod and unit penetration
      integer :: ground = ground_independent
      real(wp) :: shear = 0.0_wp                !! Pasternak: of the layer times the width [force]
      real(wp) :: young = 0.0_wp, poisson = 0.0_wp !! half-space
      integer :: law = 0                        !! index into model%law, 0: none; its forces times width
      real(wp) :: width = 1.0_wp
      logical :: bilateral = .false.            !! holds what it may touch from the start on, and pulls as it pushes
      logical :: at_nodes = .false.             !! a line that stands for stops at single nodes (*GAP): gaps count from where
      !! each node is at the start, modulus and law are those of a node
   end type obstacle_t
end module obstacle_types
