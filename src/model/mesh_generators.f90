!> Rows of elements on a line, an arc, a ring, an ellipse or a spline: the curve, the positions of its nodes, and the mesh to which
!> they are added.
module mesh_generators
   use kinds, only: wp, pi
   use errors, only: error_t, fail
   use text, only: to_text
   use model, only: curve_t, path_t, mesh_t
   use reference_curve, only: path_point
   use obstacle_types, only: obstacle_spline
   use obstacle_track, only: track_t, track_foot
   use obstacle_shapes, only: spline_curve, ellipse_points
   implicit none
   private
   public :: line_curve, arc_curve, ring_curve, ellipse_curve, path_curve, graded_division
   public :: growing_mesh_t

   real(wp), parameter :: radius_tolerance = 1.0e-6_wp !! relative difference of the two radii of an arc

   !> Nodes, elements and curves that the deck has defined so far. The arrays may be larger than their contents.
   type :: growing_mesh_t
      type(mesh_t) :: mesh                   !! the mesh; n_nodes and n_elements are the numbers of entries in use
      type(curve_t), allocatable :: curve(:)
      integer :: n_curves = 0
      integer :: node_room = 0, element_room = 0 !! allocated lengths of the arrays of nodes and elements
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
         call fail(error, 'the nodes are not equally far from the centre: '//to_text(radius(1))//' and '// &
            to_text(radius(2)))
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
      real(wp) :: s(0:n)
      real(wp) :: half_step
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

   !> Appends a node to the mesh.
   pure subroutine add_node(self, label, x)
      class(growing_mesh_t), intent(inout) :: self
      integer, intent(in) :: label !! number of the node in the deck
      real(wp), intent(in) :: x(2) !! position (x, y)
      integer :: n
      n = self%mesh%n_nodes + 1
      self%mesh%n_nodes = n
      if (n > self%node_room) then
         self%node_room = 2 * n
         call resize_nodes(self%mesh, self%node_room)
      end if
      self%mesh%node_label(n) = label
      self%mesh%x(:, n) = x
   end subroutine add_node

   !> Appends an element to the mesh.
   pure subroutine add_element(self, label, node, family, stages, curve, s, placed)
      class(growing_mesh_t), intent(inout) :: self
      integer, intent(in) :: label          !! number of the element in the deck
      integer, intent(in) :: node(2)        !! indices of the element's nodes
      integer, intent(in) :: family, stages !! family and number of Gauss points, see mesh_t
      integer, intent(in) :: curve          !! index of the element's curve; 0: straight between its nodes
      real(wp), intent(in) :: s(2)          !! coordinates of the element's ends on the curve
      logical, intent(in) :: placed         !! true: the deck leaves the number of elements open, see mesh_t
      integer :: n
      associate (mesh => self%mesh)
         n = mesh%n_elements + 1
         mesh%n_elements = n
         if (n > self%element_room) then
            self%element_room = 2 * n
            call resize_elements(mesh, self%element_room)
         end if
         mesh%element_label(n) = label
         mesh%node(:, n) = node
         mesh%family(n) = family
         mesh%stages(n) = stages
         mesh%curve(n) = curve
         mesh%s(:, n) = s
         mesh%placed(n) = placed
      end associate
   end subroutine add_element

   !> Appends a curve, whose index is then self%n_curves.
   pure subroutine add_curve(self, curve)
      class(growing_mesh_t), intent(inout) :: self
      type(curve_t), intent(in) :: curve
      if (.not. allocated(self%curve)) allocate (self%curve(16))
      if (self%n_curves == size(self%curve)) self%curve = [self%curve, self%curve] ! twice the room
      self%n_curves = self%n_curves + 1
      self%curve(self%n_curves) = curve
   end subroutine add_curve

   !> Returns mesh and curves in arrays of their true size; all sections are 0, and x_nominal is x.
   pure subroutine take(self, mesh, curve)
      class(growing_mesh_t), intent(in) :: self
      type(mesh_t), intent(out) :: mesh
      type(curve_t), allocatable, intent(out) :: curve(:)
      mesh = self%mesh
      call resize_nodes(mesh, mesh%n_nodes)
      call resize_elements(mesh, mesh%n_elements)
      mesh%x_nominal = mesh%x
      allocate (mesh%section(mesh%n_elements), source=0)
      allocate (curve(self%n_curves))
      if (self%n_curves > 0) curve = self%curve(:self%n_curves)
   end subroutine take

   !> Changes the length of the arrays of nodes. If they must grow, the length is doubled, so that the cost of appending an entry
   !> does not depend on the size of the mesh.
   pure subroutine resize_nodes(mesh, n)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: n
      if (.not. allocated(mesh%node_label)) allocate (mesh%node_label(0), mesh%x(2, 0))
      mesh%node_label = reshape(mesh%node_label, [n], pad=[0])
      mesh%x = reshape(mesh%x, [2, n], pad=[0.0_wp])
   end subroutine resize_nodes

   !> Changes the length of the arrays of elements, in the same way as resize_nodes.
   pure subroutine resize_elements(mesh, n)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: n
      if (.not. allocated(mesh%node)) allocate (mesh%element_label(0), mesh%node(2, 0), mesh%family(0), mesh%stages(0), &
         & mesh%curve(0), mesh%s(2, 0), mesh%placed(0))
      mesh%element_label = reshape(mesh%element_label, [n], pad=[0])
      mesh%node = reshape(mesh%node, [2, n], pad=[0])
      mesh%family = reshape(mesh%family, [n], pad=[0])
      mesh%stages = reshape(mesh%stages, [n], pad=[0])
      mesh%curve = reshape(mesh%curve, [n], pad=[0])
      mesh%s = reshape(mesh%s, [2, n], pad=[0.0_wp])
      mesh%placed = reshape(mesh%placed, [n], pad=[.false.])
   end subroutine resize_elements
end module mesh_generators
