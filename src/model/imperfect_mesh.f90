!> Imperfections on the curves of a model, and its nodes, which lie on the imperfect curves. Imperfections come from the deck, or
!> are added between two paths.
module imperfect_mesh
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text
   use model, only: model_t, imperfection_t, mode_offset_t
   use imperfection, only: imperfection_value, nodal_imperfection
   use reference_curve, only: curve_point, measure_curves
   implicit none
   private
   public :: add_imperfection, move_to_curves, parted_nodes, add_mode_offsets

contains

   !> Adds an imperfection to a model, and assigns it to the curves of a chain.
   subroutine add_imperfection(model, element, knot, shape)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: element(:) !! elements of the chain in their order; they cover whole curves that have no imperfection
      !! yet
      real(wp), intent(in) :: knot(:)          !! chain coordinate of the first end of each element
      type(imperfection_t), intent(in) :: shape
      integer :: k
      model%imperfection = [model%imperfection, shape]
      do k = 1, size(element)
         associate (curve => model%curve(model%mesh%curve(element(k))))
            if (curve%imperfection == 0) curve%offset = knot(k)
            curve%imperfection = size(model%imperfection)
         end associate
      end do
   end subroutine add_imperfection

   !> Measures the curves, and moves nodes onto their curves where these have an imperfection.
   subroutine move_to_curves(model, known)
      type(model_t), intent(inout) :: model    !! in: its imperfections are set; out: mesh%x is updated
      type(model_t), intent(in), optional :: known !! model on another mesh whose curves are measured; those of `model` are made the
      !! same
      real(wp) :: angle, speed
      integer :: e, i
      if (present(known)) then
         model%curve = known%curve
         model%imperfection = known%imperfection
      else
         call measure_curves(model%curve, model%imperfection)
      end if
      associate (mesh => model%mesh)
         do e = 1, mesh%n_elements
            if (mesh%curve(e) == 0) cycle
            if (model%curve(mesh%curve(e))%imperfection == 0) cycle
            do i = 1, 2
               call curve_point(model%curve(mesh%curve(e)), model%imperfection, mesh%s(i, e), mesh%x(:, mesh%node(i, e)), &
                  & angle, speed)
            end do
         end do
         do e = 1, mesh%n_elements
            if (mesh%curve(e) == 0) mesh%s(2, e) = norm2(mesh%x(:, mesh%node(2, e)) - mesh%x(:, mesh%node(1, e)))
         end do
      end associate
   end subroutine move_to_curves

   !> Adds buckling modes as imperfections. Every node of a chain moves by the sum of the modes' normal components. If the ends of
   !> the chain move, the whole nominal chain moves with them (rotated and scaled), so that chains remain connected.
   subroutine add_mode_offsets(model, offsets, mode, error)
      type(model_t), intent(inout) :: model
      type(mode_offset_t), intent(in) :: offsets(:)
      real(wp), intent(in) :: mode(:, :, :)    !! (3, nodes, offsets) mode of each offset, with a largest translation of 1
      type(error_t), allocatable, intent(out) :: error !! allocated: a mode does not bend its chain, or chains overlap or come apart
      type(imperfection_t) :: shape
      real(wp), allocatable :: knot(:), w(:), goal(:, :)
      logical :: done(size(offsets)), closed
      integer, allocatable :: node(:)
      integer :: i, j, k, n
      done = .false.
      do i = 1, size(offsets)
         if (done(i)) cycle
         associate (element => offsets(i)%element, mesh => model%mesh)
            n = size(element)
            node = [mesh%node(1, element), mesh%node(2, element(n))]
            closed = node(n + 1) == node(1)
            goal = mesh%x(:, node)
            do j = i, size(offsets)
               if (size(offsets(j)%element) /= n) cycle
               if (any(offsets(j)%element /= element)) cycle
               done(j) = .true.
               goal = goal + offsets(j)%amplitude * mode(1:2, node, j)
            end do
            do k = 1, n
               if (model%curve(mesh%curve(element(k)))%imperfection == 0) cycle
               call fail(error, 'two imperfections share a curve')
               return
            end do
            if (.not. closed) call move_chain(model, element, goal(:, 1), goal(:, n + 1))
            allocate (knot(n + 1), source=0.0_wp)
            do k = 1, n
               knot(k + 1) = knot(k) + (mesh%s(2, element(k)) - mesh%s(1, element(k)))
            end do
            w = normal_distances(model, element, goal)
            if (closed) w(n + 1) = w(1)
            if (.not. maxval(abs(w)) > 1.0e-6_wp * maxval(abs(goal - mesh%x(:, node)))) then
               call fail(error, 'mode '//to_text(offsets(i)%mode)//' does not bend the elements of its imperfection')
               return
            end if
            call nodal_imperfection(knot, w, closed, shape)
            call add_imperfection(model, element, knot, shape)
            deallocate (knot)
         end associate
      end do
      call move_to_curves(model)
      node = parted_nodes(model)
      if (size(node) > 0) call fail(error, 'the chains that meet in node '//to_text(model%mesh%node_label(node(1)))// &
         & ' move it to different places: give SHAPE=MODE for all of them')
   end subroutine add_mode_offsets

   !> Rotates, scales and moves the nominal curves of a chain so that its ends are at two given points.
   subroutine move_chain(model, element, first, last)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: element(:)
      real(wp), intent(in) :: first(2), last(2)
      real(wp) :: old(2), new(2), start(2), turn, ratio, from(2)
      integer :: k, e, c, moved
      associate (mesh => model%mesh)
         start = mesh%x(:, mesh%node(1, element(1)))
         old = mesh%x(:, mesh%node(2, element(size(element)))) - start
         new = last - first
         turn = atan2(old(1) * new(2) - old(2) * new(1), dot_product(old, new))
         ratio = norm2(new) / norm2(old)
         moved = 0
         do k = 1, size(element)
            e = element(k)
            c = mesh%curve(e)
            mesh%s(:, e) = ratio * mesh%s(:, e)
            if (c == moved) cycle
            moved = c
            associate (curve => model%curve(c))
               from = curve%origin - start
               curve%origin = first + ratio * [cos(turn) * from(1) - sin(turn) * from(2), sin(turn) * from(1) + cos(turn) * from(2)]
               curve%angle = curve%angle + turn
               curve%curvature = curve%curvature / ratio
               if (allocated(curve%path)) curve%path%scale = ratio * curve%path%scale
               curve%length = ratio * curve%length
            end associate
         end do
      end associate
   end subroutine move_chain

   !> Distances of the nodes' new positions from the nominal chain, > 0 to the left of it.
   function normal_distances(model, element, goal) result(w)
      type(model_t), intent(in) :: model
      integer, intent(in) :: element(:)
      real(wp), intent(in) :: goal(:, :)       !! (2, nodes of the chain) new positions
      real(wp) :: w(size(element) + 1), x(2), angle, speed
      integer :: k, side, e
      do k = 1, size(element) + 1
         e = element(min(k, size(element)))
         side = merge(1, 2, k <= size(element))
         call curve_point(model%curve(model%mesh%curve(e)), model%imperfection, model%mesh%s(side, e), x, angle, speed)
         w(k) = dot_product([-sin(angle), cos(angle)], goal(:, k) - x)
      end do
   end function normal_distances

   !> Nodes that an imperfection moves, while another curve that meets there does not move to the same place.
   function parted_nodes(model) result(node)
      type(model_t), intent(in) :: model       !! model whose nodes have been moved to their curves
      integer, allocatable :: node(:)
      real(wp), parameter :: apart = 1.0e-3_wp ! accepted distance over the offset: the two curves move a common node along their
      ! own normals, whose directions differ by up to this angle where the curves count as smoothly joined
      real(wp), parameter :: rounding = 1.0e-9_wp
      real(wp), dimension(model%mesh%n_nodes) :: distance, offset
      real(wp) :: x(2), angle, speed, w, dw
      integer :: e, i
      distance = 0.0_wp
      offset = -1.0_wp
      associate (mesh => model%mesh)
         do e = 1, mesh%n_elements
            if (mesh%curve(e) == 0) cycle
            do i = 1, 2
               associate (curve => model%curve(mesh%curve(e)), at => mesh%node(i, e))
                  call curve_point(curve, model%imperfection, mesh%s(i, e), x, angle, speed)
                  distance(at) = max(distance(at), norm2(x - mesh%x(:, at)))
                  if (curve%imperfection == 0) cycle
                  call imperfection_value(model%imperfection(curve%imperfection), curve%offset + mesh%s(i, e), w, dw)
                  offset(at) = max(offset(at), abs(w))
               end associate
            end do
         end do
         node = pack([(i, i=1, mesh%n_nodes)], offset >= 0.0_wp .and. distance > apart * offset + rounding * maxval(abs(mesh%x)))
      end associate
   end function parted_nodes
end module imperfect_mesh
