!> Rows of elements on a line, an arc, a ring, an ellipse or a spline: the curve, the positions of its nodes, and the mesh to which
!> they are added.
module mesh_generators
   use kinds, only: wp, pi
   use errors, only: error_t, fail
   use text, only: to_text
   use model, only: curve_t, path_t, mesh_t
   use obstacle_types, only: obstacle_spline
   use reference_curve, only: path_point
   use obstacle_track, only: track_t, track_foot
   use obstacle_shapes, only: spline_curve, ellipse_points
   implicit none
   private
   public :: line_curve, arc_curve, ring_curve, ellipse_curve, path_curve, graded_division
   public :: growing_mesh_t, new_element_t, new_growing_mesh

   real(wp), parameter :: radius_tolerance = 1.0e-6_wp !! relative difference of the two radii of an arc

   !> An element of a mesh that grows; the components are those of mesh_t.
   type :: new_element_t
      integer :: label, node(2), family, stages, curve
      real(wp) :: s(2)
      logical :: placed
   end type new_element_t

   !> Nodes, elements and curves that the deck has defined so far. Only the first entries of the arrays are in use.
   type :: growing_mesh_t
      integer :: n_nodes = 0, n_elements = 0, n_curves = 0
      integer, allocatable :: label(:)       !! (nodes) number of each node in the deck
      real(wp), allocatable :: x(:, :)       !! (2, nodes) stress-free positions
      type(new_element_t), allocatable :: element(:)
      type(curve_t), allocatable :: curve(:)
   contains
      procedure :: add_node
      procedure :: add_element
      procedure :: add_curve
      procedure :: take
   end type growing_mesh_t

contains

   !> The straight curve from one point to another.
   pure type(curve_t) function line_curve(first, last) result(curve)
      real(wp), intent(in) :: first(2), last(2) !! the two points, which must differ
      curve%origin = first
      curve%angle = atan2(last(2) - first(2), last(1) - first(1))
      curve%length = norm2(last - first)
   end function line_curve

   !> The arc from one point to another about a centre.
   !>
   !> A centre that is slightly inaccurate is moved along the chord so that the arc passes exactly through both points.
   subroutine arc_curve(first, last, centre, anticlockwise, curve, error)
      real(wp), intent(in) :: first(2), last(2)        !! the two ends of the arc
      real(wp), intent(in) :: centre(2)                !! centre, at equal distance from both points to 1e-6 of the radius
      logical, intent(in) :: anticlockwise             !! true: the arc runs anticlockwise
      type(curve_t), intent(out) :: curve              !! the arc; undefined on failure
      type(error_t), allocatable, intent(out) :: error !! allocated: there is no such arc
      real(wp) :: chord(2), c(2), a(2), b(2), radius(2), sweep
      chord = last - first
      radius = [norm2(first - centre), norm2(last - centre)]
      if (minval(radius) <= 0.0_wp) then
         call fail(error, 'the centre is one of the nodes')
         return
      else if (abs(radius(1) - radius(2)) > radius_tolerance * maxval(radius)) then
         call fail(error, 'the nodes are not equally far from the centre: '//to_text(radius(1))//' and '//to_text(radius(2)))
         return
      else if (norm2(chord) <= radius_tolerance * maxval(radius)) then
         call fail(error, 'the nodes are at the same place; *RING makes a closed circle')
         return
      end if
      c = centre - chord * dot_product(centre - 0.5_wp * (first + last), chord) / dot_product(chord, chord)
      a = first - c
      b = last - c
      sweep = atan2(a(1) * b(2) - a(2) * b(1), dot_product(a, b))
      if (.not. anticlockwise) sweep = -sweep
      if (sweep <= 0.0_wp) sweep = sweep + 2 * pi
      curve%origin = first
      if (anticlockwise) then
         curve%angle = atan2(a(1), -a(2))
         curve%curvature = 1.0_wp / norm2(a)
      else
         curve%angle = atan2(-a(1), a(2))
         curve%curvature = -1.0_wp / norm2(a)
      end if
      curve%length = sweep * norm2(a)
   end subroutine arc_curve

   !> The closed circle through a point, in the anticlockwise direction.
   pure type(curve_t) function ring_curve(point, centre) result(curve)
      real(wp), intent(in) :: point(2)  !! start and end of the circle
      real(wp), intent(in) :: centre(2) !! centre of the circle, different from `point`
      real(wp) :: a(2)
      a = point - centre
      curve%origin = point
      curve%angle = atan2(a(1), -a(2))
      curve%curvature = 1.0_wp / norm2(a)
      curve%length = 2 * pi * norm2(a)
   end function ring_curve

   !> The arc of an ellipse between two points, or the whole ellipse from one point back to it.
   subroutine ellipse_curve(first, last, centre, half, turn, anticlockwise, curve, error)
      real(wp), intent(in) :: first(2), last(2) !! ends of the arc, on the ellipse to 1e-6 of its axes; equal: the whole ellipse
      real(wp), intent(in) :: centre(2), half(2)       !! centre; half axes, positive
      real(wp), intent(in) :: turn                     !! direction of the first axis [rad]
      logical, intent(in) :: anticlockwise             !! true: the arc runs anticlockwise
      type(curve_t), intent(out) :: curve              !! the arc; undefined on failure
      type(error_t), allocatable, intent(out) :: error !! allocated: a point is not on the ellipse
      real(wp), allocatable :: at(:)
      real(wp) :: ends(2, 2), d(2), off
      integer :: i
      ends = reshape([first, last], [2, 2])
      do i = 1, 2
         d = ends(:, i) - centre
         off = norm2([cos(turn) * d(1) + sin(turn) * d(2), cos(turn) * d(2) - sin(turn) * d(1)] / half) - 1.0_wp
         if (abs(off) <= radius_tolerance) cycle
         call fail(error, 'the '//trim(merge('first', 'last ', i == 1))//' node is not on the ellipse: its place there is '// &
            to_text(1.0_wp + off)//' half axes from the centre')
         return
      end do
      call path_curve(ellipse_points(centre, half, turn, anticlockwise), .true., ends, curve, at)
   end subroutine ellipse_curve

   !> The curve of a spline between two of its points, rotated and scaled so that it passes exactly through both.
   subroutine path_curve(point, closed, node, curve, at)
      real(wp), intent(in) :: point(:, :) !! (2, points) points of the spline; for a closed spline the last one equals the first
      logical, intent(in) :: closed
      real(wp), intent(in) :: node(:, :) !! (2, nodes) points on the spline in its direction, with small errors. The first and the
      !! last are the ends; on a closed spline they may be equal: the curve is then the whole spline
      type(curve_t), intent(out) :: curve
      real(wp), allocatable, intent(out) :: at(:)      !! (nodes) coordinates of the nodes along the curve
      real(wp), parameter :: here = 1.0e-9_wp ! part of a closed spline: a point that lies before the first point by less counts as
      ! the first point
      type(path_t) :: path
      type(track_t) :: foot
      real(wp) :: round, angle, chord(2), of(2)
      integer :: i, n
      n = size(node, 2)
      path%shape%kind = obstacle_spline
      path%shape%curve = spline_curve(point, closed)
      allocate (at(n))
      do i = 1, n
         foot = track_foot(path%shape, 0.0_wp, node(:, i))
         at(i) = foot%sigma
      end do
      path%start = at(1)
      at = at - at(1)
      if (closed) then
         round = path%shape%curve%start(size(path%shape%curve%start))
         at = modulo(at + here * round, round) - here * round
         if (norm2(node(:, n) - node(:, 1)) <= 0.0_wp) at(n) = round
      end if
      at(1) = 0.0_wp
      call path_point(path, at(n), foot, angle)
      of = foot%place
      call path_point(path, 0.0_wp, foot, path%angle)
      path%point = foot%place
      of = of - path%point
      chord = node(:, n) - node(:, 1)
      curve%origin = node(:, 1)
      curve%angle = path%angle
      if (norm2(chord) > 0.0_wp) then
         path%scale = norm2(chord) / norm2(of)
         curve%angle = curve%angle + atan2(of(1) * chord(2) - of(2) * chord(1), dot_product(of, chord))
      end if
      at = path%scale * at
      curve%length = at(n)
      curve%path = path
   end subroutine path_curve

   !> Ends of n elements on a given length; the lengths of the elements are a geometric series.
   pure function graded_division(length, n, grading) result(s)
      real(wp), intent(in) :: length  !! length of the curve
      integer, intent(in) :: n        !! number of elements, 1 or more
      real(wp), intent(in) :: grading !! length of the last element over that of the first, positive; 1 if n = 1
      real(wp) :: s(0:n), half_step
      integer :: i
      half_step = 0.0_wp
      if (n > 1) half_step = 0.5_wp * log(grading) / (n - 1)
      do i = 0, n
         if (abs(half_step) > 0.0_wp) then
            ! (q^i - 1)/(q^n - 1) with q = exp(2 half_step), without cancellation if q is nearly 1.
            s(i) = length * exp((i - n) * half_step) * (sinh(i * half_step) / sinh(n * half_step))
         else
            s(i) = length * (real(i, wp) / n)
         end if
      end do
      s(n) = length
   end function graded_division

   !> A mesh without nodes.
   type(growing_mesh_t) function new_growing_mesh() result(grown)
      integer, parameter :: room = 64 ! first length of the arrays
      allocate (grown%label(room), grown%x(2, room), grown%element(room), grown%curve(room))
   end function new_growing_mesh

   !> Appends a node to the mesh. The length of a full array is doubled, so that the cost of appending an entry does not depend on
   !> the size of the mesh.
   pure subroutine add_node(self, label, x)
      class(growing_mesh_t), intent(inout) :: self
      integer, intent(in) :: label !! number of the node in the deck
      real(wp), intent(in) :: x(2) !! position (x, y)
      if (self%n_nodes == size(self%label)) then
         self%label = [self%label, self%label]
         self%x = reshape([self%x, self%x], [2, 2 * self%n_nodes])
      end if
      self%n_nodes = self%n_nodes + 1
      self%label(self%n_nodes) = label
      self%x(:, self%n_nodes) = x
   end subroutine add_node

   !> Appends an element to the mesh.
   pure subroutine add_element(self, element)
      class(growing_mesh_t), intent(inout) :: self
      type(new_element_t), intent(in) :: element
      if (self%n_elements == size(self%element)) self%element = [self%element, self%element]
      self%n_elements = self%n_elements + 1
      self%element(self%n_elements) = element
   end subroutine add_element

   !> Appends a curve, whose index is then self%n_curves.
   pure subroutine add_curve(self, curve)
      class(growing_mesh_t), intent(inout) :: self
      type(curve_t), intent(in) :: curve
      if (self%n_curves == size(self%curve)) self%curve = [self%curve, self%curve]
      self%n_curves = self%n_curves + 1
      self%curve(self%n_curves) = curve
   end subroutine add_curve

   !> Returns mesh and curves in arrays of their true size; all sections are 0, and x_nominal is x.
   pure subroutine take(self, mesh, curve)
      class(growing_mesh_t), intent(in) :: self
      type(mesh_t), intent(out) :: mesh
      type(curve_t), allocatable, intent(out) :: curve(:)
      integer :: e
      mesh%n_nodes = self%n_nodes
      mesh%node_label = self%label(:self%n_nodes)
      mesh%x = self%x(:, :self%n_nodes)
      mesh%x_nominal = mesh%x
      mesh%n_elements = self%n_elements
      associate (element => self%element(:self%n_elements))
         mesh%element_label = element%label
         mesh%family = element%family
         mesh%stages = element%stages
         mesh%curve = element%curve
         mesh%placed = element%placed
         allocate (mesh%section(size(element)), source=0)
         allocate (mesh%node(2, size(element)), mesh%s(2, size(element)))
         do e = 1, size(element)
            mesh%node(:, e) = element(e)%node
            mesh%s(:, e) = element(e)%s
         end do
      end associate
      allocate (curve(self%n_curves))
      if (self%n_curves > 0) curve = self%curve(:self%n_curves)
   end subroutine take
end module mesh_generators
