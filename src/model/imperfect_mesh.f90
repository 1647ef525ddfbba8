!> Changes of the stress-free geometry between paths: the nodes follow curves whose imperfections were changed or added.
module imperfect_mesh
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text
   use model, only: model_t, imperfection_t, mode_offset_t
   use imperfection, only: nodal_imperfection
   use reference_curve, only: curve_point
   implicit none
   private
   public :: move_to_curves, add_mode_offsets, remove_mode_offsets

contains

   !> Moves the nodes on curves with an imperfection to where the curves are now.
   subroutine move_to_curves(model)
      type(model_t), intent(inout) :: model    !! its imperfections set; mesh%x is brought up to date
      real(wp) :: angle, speed
      integer :: e, i
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

   !> Adds buckling modes as imperfections: on each chain the sum of its offsets, a spline through the nodes.
   subroutine add_mode_offsets(model, offsets, mode, error)
      type(model_t), intent(inout) :: model
      type(mode_offset_t), intent(in) :: offsets(:)
      real(wp), intent(in) :: mode(:, :, :)    !! (3, nodes, offsets) the mode of each, any scale
      type(error_t), allocatable, intent(out) :: error !! a mode that does not bend its chain; chains that overlap
      type(imperfection_t) :: shape
      real(wp), allocatable :: knot(:), w(:), one(:)
      logical :: done(size(offsets))
      integer, allocatable :: node(:)
      integer :: i, j, k, n
      done = .false.
      do i = 1, size(offsets)
         if (done(i)) cycle
         associate (element => offsets(i)%element, mesh => model%mesh)
            n = size(element)
            node = [mesh%node(1, element), mesh%node(2, element(n))]
            allocate (knot(n + 1), w(n + 1), source=0.0_wp)
            do k = 1, n
               knot(k + 1) = knot(k) + (mesh%s(2, element(k)) - mesh%s(1, element(k)))
            end do
            do j = i, size(offsets)
               if (size(offsets(j)%element) /= n) cycle
               if (any(offsets(j)%element /= element)) cycle
               done(j) = .true.
               one = normal_components(model, element, mode(:, :, j))
               if (.not. maxval(abs(one)) > 1.0e-6_wp * maxval(abs(mode(1:2, :, j)))) then
                  call fail(error, 'mode '//to_text(offsets(j)%mode)//' does not bend the elements of its imperfection')
                  return
               end if
               w = w + offsets(j)%amplitude * one / maxval(abs(one))
            end do
            if (node(n + 1) == node(1)) w(n + 1) = w(1)
            call nodal_imperfection(knot, w, node(n + 1) == node(1), shape)
            model%imperfection = [model%imperfection, shape]
            do k = 1, n
               associate (curve => model%curve(mesh%curve(element(k))))
                  if (curve%imperfection > 0 .and. curve%imperfection < size(model%imperfection)) then
                     call fail(error, 'two imperfections share a curve')
                     return
                  end if
                  if (curve%imperfection == 0) curve%offset = knot(k)
                  curve%imperfection = size(model%imperfection)
               end associate
            end do
            deallocate (knot, w)
         end associate
      end do
      call move_to_curves(model)
      call check_joints(model, error)
   end subroutine add_mode_offsets

   !> Takes the offsets of earlier steps away: curves that a mode of any step bends are perfect again.
   subroutine remove_mode_offsets(model)
      type(model_t), intent(inout) :: model
      integer :: k, i, j, e, side
      real(wp) :: angle, speed
      do k = 1, size(model%step)
         do i = 1, size(model%step(k)%mode_offset)
            associate (element => model%step(k)%mode_offset(i)%element, mesh => model%mesh)
               do j = 1, size(element)
                  e = element(j)
                  model%curve(mesh%curve(e))%imperfection = 0
                  do side = 1, 2
                     call curve_point(model%curve(mesh%curve(e)), model%imperfection, mesh%s(side, e), &
                        & mesh%x(:, mesh%node(side, e)), angle, speed)
                  end do
               end do
            end associate
         end do
      end do
   end subroutine remove_mode_offsets

   !> Component of a mode to the left of the chain at its nodes.
   function normal_components(model, element, mode) result(w)
      type(model_t), intent(in) :: model
      integer, intent(in) :: element(:)
      real(wp), intent(in) :: mode(:, :)
      real(wp) :: w(size(element) + 1), angle
      integer :: k, side, e
      do k = 1, size(element) + 1
         e = element(min(k, size(element)))
         side = merge(1, 2, k <= size(element))
         associate (curve => model%curve(model%mesh%curve(e)))
            angle = curve%angle + curve%curvature * model%mesh%s(side, e)
         end associate
         w(k) = dot_product([-sin(angle), cos(angle)], mode(1:2, model%mesh%node(side, e)))
      end do
   end function normal_components

   !> All curves must agree on where a common node is.
   subroutine check_joints(model, error)
      type(model_t), intent(in) :: model
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: apart = 1.0e-9_wp
      real(wp) :: x(2), angle, speed
      integer :: e, i
      associate (mesh => model%mesh)
         do e = 1, mesh%n_elements
            if (mesh%curve(e) == 0) cycle
            do i = 1, 2
               call curve_point(model%curve(mesh%curve(e)), model%imperfection, mesh%s(i, e), x, angle, speed)
               if (norm2(x - mesh%x(:, mesh%node(i, e))) <= apart * maxval(abs(mesh%x))) cycle
               call fail(error, 'the imperfections of the curves that meet in node '// &
                  & to_text(mesh%node_label(mesh%node(i, e)))//' move it to different places')
               return
            end do
         end do
      end associate
   end subroutine check_joints
end module imperfect_mesh
