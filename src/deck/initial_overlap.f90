!> How deep the stress-free structure, imperfections included, begins behind an obstacle: at its nodes, or between them
!> where reactions are distributed.
module initial_overlap
   use kinds, only: wp
   use model, only: model_t, contact_t
   use obstacle_geometry, only: obstacle_gap
   use reference_curve, only: curve_point
   implicit none
   private
   public :: least_gap_of_nodes, least_gap_between

   integer, parameter :: samples = 8 !! of an element

contains

   !> Smallest gap of a contact's nodes.
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

   !> Smallest gap inside the elements between a contact's nodes: from samples, each least one improved by a parabola.
   subroutine least_gap_between(model, contact, least, element)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      real(wp), intent(out) :: least
      integer, intent(out) :: element
      logical :: candidate(model%mesh%n_nodes)
      real(wp) :: gap(0:samples), low, curvature
      integer :: e, k
      least = huge(least)
      element = 0
      candidate = .false.
      candidate(contact%node) = .true.
      do e = 1, model%mesh%n_elements
         if (.not. all(candidate(model%mesh%node(:, e)))) cycle
         do k = 0, samples
            gap(k) = gap_at(model, contact, place(real(k, wp) / samples))
         end do
         k = minloc(gap(1:samples - 1), 1)
         low = gap(k)
         curvature = gap(k - 1) - 2.0_wp * gap(k) + gap(k + 1)
         if (2.0_wp * curvature > abs(gap(k - 1) - gap(k + 1))) &
            & low = min(low, gap_at(model, contact, place((k + 0.5_wp * (gap(k - 1) - gap(k + 1)) / curvature) / samples)))
         if (low >= least) cycle
         least = low
         element = e
      end do

   contains

      !> Place on the stress-free element.
      function place(tau) result(x)
         real(wp), intent(in) :: tau       !! 0 to 1
         real(wp) :: x(2), angle, speed
         associate (mesh => model%mesh)
            if (mesh%curve(e) > 0) then
               call curve_point(model%curve(mesh%curve(e)), model%imperfection, &
                  & mesh%s(1, e) + tau * (mesh%s(2, e) - mesh%s(1, e)), x, angle, speed)
            else
               x = (1.0_wp - tau) * mesh%x(:, mesh%node(1, e)) + tau * mesh%x(:, mesh%node(2, e))
            end if
         end associate
      end function place
   end subroutine least_gap_between

   !> Gap to the contact's obstacle where it begins, GAP included.
   real(wp) function gap_at(model, contact, x) result(gap)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: x(2)
      real(wp) :: normal(2), bend
      call obstacle_gap(model%obstacle(contact%obstacle), x, gap, normal, bend)
      gap = gap + contact%gap
   end function gap_at
end module initial_overlap
