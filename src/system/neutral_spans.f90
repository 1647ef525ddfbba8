!> Neutral free spans: spans that may shift along themselves. They lie between a clamp and the end of a line contact on a straight
!> wall parallel to the clamp.
!>
!> A uniform, straight rod without loads along the span has a first integral: EI k^2/2 + n.t is constant, with the curvature k, the
!> force n in the section and the unit tangent t. At the end of the line contact k = 0 and t has the direction of the wall. At the
!> clamp t is the same, so that k^2 = 0 there as well, a double root. A shift of the whole curve along itself, u = t(s) - t(0) with
!> the rotation k, then satisfies all supports to first order, and the tangent matrix is singular at every load. The root is simple
!> if the equations require a zero couple at the clamp instead of a zero rotation: a clamp beside a neutral span is therefore
!> replaced by a hinge. By the first integral the rod still has the direction of the clamp there. The tangent of the hinged rod has
!> one more negative eigenvalue than that of the clamped rod, apart from the null vector of the clamped rod.
module neutral_spans
   use kinds, only: wp
   use obstacle_types, only: obstacle_line
   use problem, only: problem_t
   use reference_curve, only: is_straight
   implicit none
   private
   public :: free_clamps, exactly_parallel

   real(wp), parameter :: exactly_parallel = 1.0e-12_wp !! sine of the angle between two directions up to which they count as
   !! parallel

contains

   !> Replaces all clamps beside neutral spans by hinges and records them in problem%hinge.
   subroutine free_clamps(problem)
      type(problem_t), intent(inout) :: problem   !! problem with its contact spans; out: with the hinges
      integer :: k, side, node, e
      do k = 1, size(problem%contact_span)
         if (.not. problem%contact_span(k)%line) cycle
         do side = 1, 2
            if (.not. last_of_its_segment(problem, k, side)) cycle
            e = problem%element_first(problem%contact_span(k)%rod_segment)
            if (side == 2) e = problem%element_last(problem%contact_span(k)%rod_segment)
            node = problem%model%mesh%node(side, e)
            if (.not. clamps(problem, node, side)) cycle
            if (.not. runs_along(problem, k)) cycle
            problem%model%fixed(3, node) = .false.
            problem%hinge = [problem%hinge, node]
         end do
      end do
   end subroutine free_clamps

   !> True if there is only one free span, and no other contact, between an end of a contact span and the end of its rod segment.
   pure logical function last_of_its_segment(problem, k, side) result(last)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k, side              !! index of the contact span; side 1: before the span, 2: after the span
      integer :: next
      associate (contact_span => problem%contact_span(k))
         if (side == 1) last = contact_span%at(1) > 0.0_wp
         if (side == 2) last = contact_span%at(2) < problem%layout%rod_segment(contact_span%rod_segment)%length
         next = k + merge(-1, 1, side == 1)
         if (next < 1 .or. next > size(problem%contact_span)) return
         last = last .and. problem%contact_span(next)%rod_segment /= contact_span%rod_segment
      end associate
   end function last_of_its_segment

   !> True if a rod is clamped at its end (rotation and at least one displacement fixed), and no step rotates this clamp or applies
   !> a couple to it.
   pure logical function clamps(problem, node, side)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: node, side           !! node at an end of a rod; side 1: beginning of the rod, 2: its end
      integer :: i
      clamps = problem%beside(side, node) == 0 .and. problem%model%fixed(3, node) .and. any(problem%model%fixed(1:2, node))
      do i = 1, size(problem%model%step)
         associate (load => problem%model%step(i)%load)
            clamps = clamps .and. .not. load%turns(node)
         end associate
      end do
   end function clamps

   !> True if the rod is straight and parallel to the straight obstacle of a contact span, and no load on the rod segment would bend
   !> it.
   pure logical function runs_along(problem, k) result(along)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k                    !! index of the contact span
      real(wp) :: d(2)
      integer :: e, i, first, last
      associate (contact_span => problem%contact_span(k), mesh => problem%model%mesh)
         first = problem%element_first(contact_span%rod_segment)
         last = problem%element_last(contact_span%rod_segment)
         associate (obstacle => problem%model%obstacle(problem%model%contact(contact_span%contact)%obstacle))
            along = obstacle%kind == obstacle_line
            if (.not. along) return
            d = obstacle%point(:, 2) - obstacle%point(:, 1)
            d = d / norm2(d)
         end associate
         do e = first, last
            associate (curve => problem%model%curve(mesh%curve(e)))
               along = along .and. is_straight(curve) .and. &
                  & abs(d(1) * sin(curve%angle) - d(2) * cos(curve%angle)) <= exactly_parallel
            end associate
         end do
         do i = 1, size(problem%model%step)
            associate (load => problem%model%step(i)%load)
               along = along .and. .not. load%bends(first, last)
            end associate
         end do
      end associate
   end function runs_along
end module neutral_spans
