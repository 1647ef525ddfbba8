!> Penetration of the stress-free structure, imperfections included, into an obstacle: at the nodes and, if the rod may touch the
!> obstacle anywhere, also between nodes.
!>
!> The obstacle of each contact is withdrawn along its normal by the deepest penetration, so that a path begins without penetration.
!> A penetration within the rounding of coordinates is not restored later. A deeper penetration requires *CONTACT INTERFERENCE,
!> SHRINK, which moves the obstacle to its place during a step.
module initial_overlap
   use kinds, only: wp
   use minimum_search, only: minimum_search_t, to_rounding
   use text, only: to_text, rounded
   use model, only: model_t, contact_t
   use obstacle_geometry, only: obstacle_gap
   use reference_curve, only: curve_point
   implicit none
   private
   public :: overlap_of_nodes, overlap_between, overlap_of_modes, deepest_start, deepest_overlap, gap_inside

   integer, parameter :: samples = 8 !! number of parts into which the samples divide an element
   real(wp), parameter :: penetration_tolerance = 1.0e-6_wp !! rounding of the coordinates in a deck, divided by the extent of the
   !! perfect geometry

contains

   !> Largest initial penetration that counts as rounding of coordinates [length].
   pure real(wp) function deepest_start(model)
      type(model_t), intent(in) :: model
      deepest_start = penetration_tolerance * maxval(maxval(model%mesh%x_nominal, 2) - minval(model%mesh%x_nominal, 2))
   end function deepest_start

   !> Deepest initial penetration into the obstacle of a contact [length]. The obstacle is withdrawn by this distance at the start.
   !> 0: nothing penetrates the obstacle.
   real(wp) function deepest_overlap(model, contact) result(overlap)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      real(wp) :: least
      integer :: at
      associate (obstacle => model%obstacle(contact%obstacle))
         overlap = 0.0_wp
         if (obstacle%bilateral) return
         if (obstacle%at_nodes) then
            ! The gap of a stop is measured from the initial position of its node.
            least = contact%gap
         else
            call least_gap_of_nodes(model, contact, least, at)
            overlap = max(0.0_wp, -least)
            if (.not. touches_between(contact)) return
            call least_gap_between(model, contact, least, at)
         end if
         overlap = max(overlap, -least)
      end associate
   end function deepest_overlap

   !> True if the rod may touch the obstacle between its nodes.
   pure logical function touches_between(contact)
      type(contact_t), intent(in) :: contact
      touches_between = contact%distributed .or. contact%along
   end function touches_between

   !> Message about the node whose initial penetration, caused by an imperfection, is deepest.
   subroutine overlap_of_nodes(model, contact, message, node)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      character(:), allocatable, intent(out) :: message !! '' if no node penetrates the obstacle
      integer, intent(out) :: node                      !! the node with the least gap
      real(wp) :: gap
      message = ''
      call least_gap_of_nodes(model, contact, gap, node)
      if (gap >= -deepest_start(model)) return
      message = 'the imperfection puts node '//to_text(model%mesh%node_label(node))//' '//rounded(-gap)// &
         & ' behind the obstacle; leave it room with GAP, or push it out with *CONTACT INTERFERENCE, SHRINK'
   end subroutine overlap_of_nodes

   !> Message about the element with the deepest initial penetration between its nodes, for a contact whose nodes themselves do not
   !> penetrate the obstacle.
   subroutine overlap_between(model, contact, message, node)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      character(:), allocatable, intent(out) :: message !! '' if no element penetrates the obstacle
      integer, intent(out), optional :: node            !! first node of the element; unchanged if the message is ''
      real(wp) :: gap, nodes_gap
      integer :: element, worst
      message = ''
      call least_gap_of_nodes(model, contact, nodes_gap, worst)
      call least_gap_between(model, contact, gap, element)
      if (gap >= -deepest_start(model) .or. nodes_gap < -deepest_start(model)) return
      message = 'element '//to_text(model%mesh%element_label(element))//' begins '//rounded(-gap)// &
         & ' behind the obstacle, between its nodes; leave it room with GAP, or push it out with *CONTACT INTERFERENCE, SHRINK'
      if (present(node)) node = model%mesh%node(1, element)
   end subroutine overlap_between

   !> Message about initial penetration in a step with buckling modes as imperfections. (Such a step begins without the
   !> displacements of earlier steps.)
   subroutine overlap_of_modes(model, step, message, node)
      type(model_t), intent(in) :: model         !! model whose geometry contains the modes
      integer, intent(in) :: step
      character(:), allocatable, intent(out) :: message !! message with the name of the obstacle; '' if there is no penetration
      integer, intent(out) :: node
      integer :: c, k
      logical :: pushed_out
      message = ''
      node = 0
      do c = 1, size(model%contact)
         associate (contact => model%contact(c), obstacle => model%obstacle(model%contact(c)%obstacle))
            pushed_out = .false.
            do k = step, size(model%step)
               pushed_out = pushed_out .or. abs(model%step(k)%load%resolved(contact%obstacle)) > 0.0_wp
            end do
            ! The gap of a bilateral obstacle, or of a stop at a node, is measured from the initial position of the node.
            if (obstacle%bilateral .or. obstacle%at_nodes .or. pushed_out) cycle
            call overlap_of_nodes(model, contact, message, node)
            if (message == '' .and. touches_between(contact)) call overlap_between(model, contact, message, node)
            if (message == '') cycle
            message = 'contact with '//trim(obstacle%name)//': '//message
            return
         end associate
      end do
   end subroutine overlap_of_modes

   !> Least gap of a contact's nodes.
   subroutine least_gap_of_nodes(model, contact, least, node)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      real(wp), intent(out) :: least
      integer, intent(out) :: node
      real(wp) :: gap
      integer :: i
      least = huge(least)
      node = 0
      do i = 1, size(contact%node)
         gap = gap_at(model, contact, model%mesh%x(:, contact%node(i)))
         if (gap >= least) cycle
         least = gap
         node = contact%node(i)
      end do
   end subroutine least_gap_of_nodes

   !> Least gap inside the elements between the nodes of a contact. Samples and a parabola through them find the element; a minimum
   !> search then finds the gap.
   subroutine least_gap_between(model, contact, least, element)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      real(wp), intent(out) :: least
      integer, intent(out) :: element
      logical :: candidate(model%mesh%n_nodes)
      real(wp) :: gap(0:samples), low, curvature, tau
      type(minimum_search_t) :: search
      integer :: e, k, near
      least = huge(least)
      element = 0
      candidate = .false.
      candidate(contact%node) = .true.
      do e = 1, model%mesh%n_elements
         if (.not. all(candidate(model%mesh%node(:, e)))) cycle
         do k = 0, samples
            gap(k) = gap_inside(model, contact, e, real(k, wp) / samples)
         end do
         k = minloc(gap(1:samples - 1), 1)
         low = gap(k)
         curvature = gap(k - 1) - 2.0_wp * gap(k) + gap(k + 1)
         if (2.0_wp * curvature > abs(gap(k - 1) - gap(k + 1))) &
            & low = min(low, gap(k) - (gap(k - 1) - gap(k + 1))**2 / (8.0_wp * curvature))
         if (low >= least) cycle
         least = low
         element = e
         near = k
      end do
      if (element == 0) return
      e = element
      call search%begin(real(near - 1, wp) / samples, real(near + 1, wp) / samples, to_rounding)
      do while (search%next_guess(tau))
         call search%take_value(gap_inside(model, contact, e, tau))
      end do
      least = search%least
   end subroutine least_gap_between

   !> Gap at a place of a stress-free element, with the contact's obstacle in its initial position. The gap includes the clearance
   !> GAP.
   real(wp) function gap_inside(model, contact, e, tau) result(gap)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: e
      real(wp), intent(in) :: tau          !! place in the element, 0 (first node) to 1 (second node)
      real(wp) :: x(2), angle, speed
      associate (mesh => model%mesh)
         if (mesh%curve(e) > 0) then
            call curve_point(model%curve(mesh%curve(e)), model%imperfection, &
               & mesh%s(1, e) + tau * (mesh%s(2, e) - mesh%s(1, e)), x, angle, speed)
         else
            x = (1.0_wp - tau) * mesh%x(:, mesh%node(1, e)) + tau * mesh%x(:, mesh%node(2, e))
         end if
      end associate
      gap = gap_at(model, contact, x)
   end function gap_inside

   !> Gap between a point and the contact's obstacle in its initial position; includes the clearance GAP.
   real(wp) function gap_at(model, contact, x) result(gap)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: x(2)
      real(wp) :: normal(2), bend
      call obstacle_gap(model%obstacle(contact%obstacle), x, gap, normal, bend)
      gap = gap + contact%gap
   end function gap_at
end module initial_overlap
