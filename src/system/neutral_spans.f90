!> Free spans that may shift along themselves: from a clamp to the end of a line on a straight wall that is parallel to it.
!>
!> A uniform, straight rod without loads along it has a first integral: EI k^2/2 + n . t is the same all along the span. At the end
!> of the line k = 0 and t is the wall's direction; at the clamp t is the same, so k^2 = 0 there as well: a double root. With it
!> the shift of the whole curve along itself, u = t(s) - t(0) with the rotation k, obeys all supports to first order, and the
!> tangent is singular at every load. The root is simple where the clamp's couple is zero by equation instead of its rotation:
!> beside such a span a clamp is a hinge. Its direction comes out right, for the integral says so. The tangent of the hinged rod has
!> one more negative eigenvalue than what the clamped one has besides its null vector.
module neutral_spans
   use kinds, only: wp
   use obstacle_types, only: obstacle_line
   use problem, only: problem_t
   implicit none
   private
   public :: free_clamps, parallel

   real(wp), parameter :: parallel = 1.0e-12_wp !! sine of an angle that is none

contains

   !> Makes hinges of all clamps beside such spans, and notes them.
   subroutine free_clamps(problem)
      type(problem_t), intent(inout) :: problem   !! of contact spans, its touches set
      integer :: k, side, node, e
      do k = 1, size(problem%touch)
         if (.not. problem%touch(k)%line) cycle
         do side = 1, 2
            if (.not. last_of_its_stretch(problem, k, side)) cycle
            e = problem%element_first(problem%touch(k)%stretch)
            if (side == 2) e = problem%element_last(problem%touch(k)%stretch)
            node = problem%model%mesh%node(side, e)
            if (.not. clamps(problem, node, side)) cycle
            if (.not. runs_along(problem, k)) cycle
            problem%model%fixed(3, node) = .false.
            problem%hinge = [problem%hinge, node]
         end do
      end do
   end subroutine free_clamps

   !> True where nothing but a free span lies between one end of a touch and the end of its stretch.
   pure logical function last_of_its_stretch(problem, k, side) result(last)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k, side              !! touch; 1: before it, 2: after it
      integer :: next
      associate (touch => problem%touch(k))
         if (side == 1) last = touch%at(1) > 0.0_wp
         if (side == 2) last = touch%at(2) < problem%layout%stretch(touch%stretch)%length
         next = k + merge(-1, 1, side == 1)
         if (next < 1 .or. next > size(problem%touch)) return
         last = last .and. problem%touch(next)%stretch /= touch%stretch
      end associate
   end function last_of_its_stretch

   !> True for the end of a rod that neither turns nor is turned by anything in any step.
   pure logical function clamps(problem, node, side)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: node, side           !! 1: where the rod begins, 2: where it ends
      integer :: i
      clamps = problem%beside(side, node) == 0 .and. problem%model%fixed(3, node) .and. any(problem%model%fixed(1:2, node))
      do i = 1, size(problem%model%step)
         associate (load => problem%model%step(i)%load)
            clamps = clamps .and. .not. load%turns(node)
         end associate
      end do
   end function clamps

   !> True where the rod is straight, parallel to the wall that a touch is on and held from it at its end, and nothing acts along
   !> it.
   pure logical function runs_along(problem, k) result(along)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k                    !! touch
      real(wp) :: d(2)
      integer :: e, i, first, last
      associate (touch => problem%touch(k), mesh => problem%model%mesh)
         first = problem%element_first(touch%stretch)
         last = problem%element_last(touch%stretch)
         associate (obstacle => problem%model%obstacle(problem%model%contact(touch%contact)%obstacle))
            along = obstacle%kind == obstacle_line
            if (.not. along) return
            d = obstacle%point(:, 2) - obstacle%point(:, 1)
            d = d / norm2(d)
         end associate
         do e = first, last
            associate (curve => problem%model%curve(mesh%curve(e)))
               along = along .and. curve%imperfection == 0 .and. abs(curve%curvature) <= 0.0_wp .and. &
                  & abs(d(1) * sin(curve%angle) - d(2) * cos(curve%angle)) <= parallel
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
