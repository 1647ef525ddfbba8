!> Stress-free geometry of every element, in the form that the element modules use.
!>
!> The geometry belongs to the state, not to the model: a moving touchdown point moves its node along the rod and changes the
!> lengths of the elements on both sides.
module rod_geometry
   use kinds, only: wp
   use model, only: model_t
   use element_families, only: collocates, follows_curves
   use gauss_tableau, only: tableau_t, max_stages, new_tableau
   use reference_curve, only: curve_point, curve_angle, curve_excess, curve_length, curve_abscissa
   implicit none
   private
   public :: geometry_t, element_geometry_t, new_geometry, with_other_stages, shift_nodes

   !> Stress-free geometry of one element.
   type :: element_geometry_t
      real(wp) :: s(2) = 0.0_wp               !! nominal coordinates of both ends; 0 if the element is not on a curve
      real(wp) :: excess(2) = 0.0_wp          !! value of curve_excess at the first end; 0 if the element is not on a curve
      real(wp) :: length = 0.0_wp             !! stress-free length
      real(wp) :: scale = 1.0_wp              !! factor C of the GE element
      real(wp) :: chord(2) = 0.0_wp           !! stress-free vector from the first to the second node
      real(wp) :: at(max_stages) = 0.0_wp     !! nominal coordinates of the stages (GE elements)
      real(wp) :: angle(max_stages) = 0.0_wp  !! tangent angle at the stages (GE elements) [rad]
      real(wp) :: tangent(2, max_stages) = 0.0_wp !! cosine and sine of `angle` (GE elements)
      real(wp) :: end_angle(2) = 0.0_wp       !! tangent angle at both ends [rad]
   end type element_geometry_t

   !> Stress-free geometry of all elements and nodes.
   type :: geometry_t
      type(element_geometry_t), allocatable :: element(:)
      real(wp), allocatable :: x(:, :)        !! (2, nodes) stress-free position of the nodes
      real(wp), allocatable :: sample(:, :, :) !! (distributions, max_stages, elements) values of the model's distributions at the
      !! stages; zero where they are not defined. Not allocated: the model has no distributions
   end type geometry_t

contains

   !> Geometry of the whole mesh with every node at its nominal position.
   function new_geometry(model) result(geometry)
      type(model_t), intent(in) :: model
      type(geometry_t) :: geometry
      type(tableau_t) :: tableau(max_stages)
      integer :: e
      do e = 1, max_stages
         if (any(model%mesh%stages == e)) tableau(e) = new_tableau(e)
      end do
      allocate (geometry%element(model%mesh%n_elements))
      geometry%x = model%mesh%x
      associate (mesh => model%mesh)
         do e = 1, mesh%n_elements
            geometry%element(e) = element_geometry(model, tableau, e, mesh%s(:, e), mesh%x(:, mesh%node(1, e)), &
               & mesh%x(:, mesh%node(2, e)))
         end do
      end associate
      call take_samples(model, geometry, [(.true., e=1, model%mesh%n_elements)])
   end function new_geometry

   !> Evaluates the distributions at the stages of elements.
   subroutine take_samples(model, geometry, wanted)
      type(model_t), intent(in) :: model
      type(geometry_t), intent(inout) :: geometry
      logical, intent(in) :: wanted(:) !! (elements) true: the element has moved along its curve, and its values are evaluated
      character(:), allocatable :: wrong
      real(wp) :: x(2), angle, speed
      integer :: e, i, k, c
      if (size(model%distribution) == 0) return
      if (.not. allocated(geometry%sample)) allocate (geometry%sample(size(model%distribution), max_stages, &
         & model%mesh%n_elements), source=0.0_wp)
      do e = 1, model%mesh%n_elements
         c = model%mesh%curve(e)
         if (.not. wanted(e) .or. c == 0) cycle
         associate (g => geometry%element(e))
            do k = 1, size(model%distribution)
               if (.not. model%distribution(k)%contains_element(c, g%s, model%curve(c)%length)) cycle
               do i = 1, model%mesh%stages(e)
                  call curve_point(model%curve(c), model%imperfection, g%at(i), x, angle, speed)
                  call model%distribution(k)%value_at(g%at(i) + model%distribution(k)%offset(c), x, geometry%sample(k, i, e), wrong)
                  if (wrong /= '') error stop 'a *DISTRIBUTION has no value at a place that the reader did not check'
               end do
            end do
         end associate
      end do
   end subroutine take_samples

   !> Geometry with the same nodes for another number of stages. Elements with the same end coordinates in `known` are copied from
   !> it.
   function with_other_stages(model, tableau, geometry, known) result(new)
      type(model_t), intent(in) :: model          !! model with the new numbers of stages
      type(tableau_t), intent(in) :: tableau(:)
      type(geometry_t), intent(in) :: geometry
      type(geometry_t), intent(in) :: known       !! earlier result for the same model, or a geometry without elements
      type(geometry_t) :: new
      integer :: e
      logical :: moved(model%mesh%n_elements)
      new = geometry
      moved = .true.
      do e = 1, model%mesh%n_elements
         associate (g => new%element(e))
            if (allocated(known%element)) then
               if (stands_still(known%element(e), g)) then
                  g = known%element(e)
                  moved(e) = .false.
                  if (allocated(known%sample)) new%sample(:, :, e) = known%sample(:, :, e)
                  cycle
               end if
            end if
            g%scale = 1.0_wp
            if (follows_curves(model%mesh%family(e)) .and. model%mesh%curve(e) /= 0) then
               call place_stages(model, tableau(model%mesh%stages(e)), e, g)
            else
               call keep_straight(g)
               if (collocates(model%mesh%family(e))) g%at = g%s(1) + tableau(model%mesh%stages(e))%c * (g%s(2) - g%s(1))
            end if
         end associate
      end do
      call take_samples(model, new, moved)
   end function with_other_stages

   !> True if two elements have exactly the same end coordinates on the same curve.
   pure logical function stands_still(one, other) result(same)
      type(element_geometry_t), intent(in) :: one, other
      same = all(abs([one%s - other%s, one%chord - other%chord, one%end_angle - other%end_angle]) <= 0.0_wp) .and. &
         & abs(one%length - other%length) <= 0.0_wp
   end function stands_still

   !> Geometry of an element between two nominal coordinates, with its nodes at the positions x1 and x2.
   pure function element_geometry(model, tableau, e, s, x1, x2) result(g)
      type(model_t), intent(in) :: model
      type(tableau_t), intent(in) :: tableau(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: s(2), x1(2), x2(2)
      type(element_geometry_t) :: g
      integer :: i, c
      g%s = s
      g%chord = x2 - x1
      c = model%mesh%curve(e)
      if (.not. follows_curves(model%mesh%family(e)) .or. c == 0) then
         g%length = norm2(g%chord)
         g%end_angle = atan2(g%chord(2), g%chord(1))
         call keep_straight(g)
         if (collocates(model%mesh%family(e))) g%at = s(1) + tableau(model%mesh%stages(e))%c * (s(2) - s(1))
         return
      end if
      associate (curve => model%curve(c))
         g%excess = curve_excess(curve, model%imperfection, s(1))
         g%length = curve_length(curve, model%imperfection, s(1), s(2), g%excess)
         do i = 1, 2
            g%end_angle(i) = curve_angle(curve, model%imperfection, s(i))
         end do
      end associate
      call place_stages(model, tableau(model%mesh%stages(e)), e, g)
   end function element_geometry

   !> Sets the angles of an element that is not on a curve.
   pure subroutine keep_straight(g)
      type(element_geometry_t), intent(inout) :: g !! in: its chord and end coordinates are set
      g%angle = g%end_angle(1)
      g%tangent(1, :) = cos(g%angle(1))
      g%tangent(2, :) = sin(g%angle(1))
   end subroutine keep_straight

   !> Sets positions and angles of the stages of an element on a curve.
   !>
   !> The Gauss quadrature of the exact tangent differs from the chord by O(h^(2s+1)). A factor C and a common rotation of the
   !> stages' angles, both of the same order, remove this difference: the stress-free state then has exactly no stress, however the
   !> element is rotated.
   pure subroutine place_stages(model, tab, e, g)
      type(model_t), intent(in) :: model
      type(tableau_t), intent(in) :: tab
      integer, intent(in) :: e
      type(element_geometry_t), intent(inout) :: g !! in: its ends, chord and length are set
      real(wp) :: quadrature(2), turn
      integer :: i
      associate (curve => model%curve(model%mesh%curve(e)))
         quadrature = 0.0_wp
         do i = 1, tab%stages
            g%at(i) = curve_abscissa(curve, model%imperfection, g%s(1), tab%c(i) * g%length, g%excess)
            g%angle(i) = curve_angle(curve, model%imperfection, g%at(i))
            quadrature = quadrature + tab%b(i) * [cos(g%angle(i)), sin(g%angle(i))]
         end do
         quadrature = quadrature * g%length
         ! An element of zero length is singular; its evaluation reports this.
         g%scale = 1.0_wp
         turn = 0.0_wp
         if (norm2(quadrature) > 0.0_wp) then
            g%scale = norm2(g%chord) / norm2(quadrature)
            turn = atan2(quadrature(1) * g%chord(2) - quadrature(2) * g%chord(1), dot_product(quadrature, g%chord))
         end if
         do i = 1, tab%stages
            g%angle(i) = g%angle(i) + turn
            g%tangent(:, i) = [cos(g%angle(i)), sin(g%angle(i))]
         end do
      end associate
   end subroutine place_stages

   !> Moves many nodes at once, each along its curve.
   subroutine shift_nodes(model, tableau, shift, geometry)
      type(model_t), intent(in) :: model
      type(tableau_t), intent(in) :: tableau(:)
      real(wp), intent(in) :: shift(:) !! (nodes) distance in the nominal coordinate; 0 for nodes that are not between two elements
      !! of one curve
      type(geometry_t), intent(inout) :: geometry
      real(wp) :: angle, speed, s(2)
      integer :: e
      ! The element that ends at a node gives the node's coordinate.
      do e = 1, model%mesh%n_elements
         associate (node => model%mesh%node(2, e))
            if (abs(shift(node)) > 0.0_wp) call curve_point(model%curve(model%mesh%curve(e)), model%imperfection, &
               & geometry%element(e)%s(2) + shift(node), geometry%x(:, node), angle, speed)
         end associate
      end do
      do e = 1, model%mesh%n_elements
         associate (node => model%mesh%node(:, e))
            if (.not. any(abs(shift(node)) > 0.0_wp)) cycle
            s = geometry%element(e)%s + shift(node)
            geometry%element(e) = element_geometry(model, tableau, e, s, geometry%x(:, node(1)), geometry%x(:, node(2)))
         end associate
      end do
      call take_samples(model, geometry, abs(shift(model%mesh%node(1, :))) > 0.0_wp .or. abs(shift(model%mesh%node(2, :))) > 0.0_wp)
   end subroutine shift_nodes
end module rod_geometry
