!> How far a line of contact lifts off on both sides of a node that a couple turns, or a force lifts. The obstacle is straight, or
!> takes no part in what the curvature of so short a span changes, and presses on both sides with density r. With x from the end of
!> the line on each side the gap is w = T x^3/(6 EI) - r x^4/(24 EI), T the force of that end. At the node, m from the one end and
!> n from the other, both have the same w and slope, T1 + T2 = r (m + n) + F with F pressing, and the moment jumps by the couple C:
!> with v = n/m < 1, m on the side where the couple lifts,
!>
!>   T1 = r m (3 + v - v^2 + v^3)/12,   T2 = r m (1 - v + v^2 + 3 v^3)/(12 v^2),
!>   F = r m f(v),   f = T1/(r m) + T2/(r m) - 1 - v,   C = r m^2 c(v),   c = 1/2 - T1/(r m) + v T2/(r m) - v^2/2.
!>
!> Without a force v = 2 - sqrt(3) and C = (2 sqrt(3) - 3) r m^2, without a couple v = 1 and m = -3 F/(4 r). However little the
!> couple is, and however large a force presses: no node inside a line carries one.
!>
!> At the end of a line, which a couple holds down, w = r x^3 (l - x)/(24 EI) from the line's new end: as good as no slope at the
!> node, where the moment is -r l^2/4.
module lifted_node
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use contact_spans, only: line_share
   use rod_state, only: state_t
   use conforming_span, only: conforming_forces, node_track, track_sense
   use breakpoint_forces, only: breakpoint_force, breakpoint_couple, left_over
   use section_forces, only: end_forces
   implicit none
   private
   public :: inside_line, lifted_beside, lifted_ahead, lifted_at_mirror, stays_down

contains

   !> True for a node with a line on both sides that no support keeps from turning.
   pure logical function inside_line(problem, candidate) result(inside)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      integer :: side
      associate (node => problem%candidates%node(candidate))
         inside = all(problem%beside(:, node) > 0) .and. .not. problem%model%fixed(3, node)
         do side = 1, 2
            if (inside) inside = problem%conforms(problem%beside(side, node)) > 0
         end do
      end associate
   end function inside_line

   !> Lengths that lift off beside a node inside a line.
   function lifted_beside(problem, state, candidate) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: length(2)                 !! before and after it; huge where nothing presses
      real(wp) :: local(3), place(2), angle, density(2)
      integer :: side
      do side = 1, 2
         call conforming_forces(problem, state, problem%beside(side, problem%candidates%node(candidate)), &
            & merge(1.0_wp, 0.0_wp, side == 1), local, place, angle, density(side))
      end do
      ! What the obstacle would have to turn the node by is what turns it the other way.
      length = lifted_lengths(breakpoint_couple(problem, state, candidate) * track_sense(problem, state, candidate, &
         & node_track(problem, state, candidate)), breakpoint_force(problem, state, candidate), 0.5_wp * sum(density))
   end function lifted_beside

   !> Length that lifts off beside a node that keeps its direction, as on a mirror, whose image a force lifts as much; huge where
   !> nothing presses.
   pure real(wp) function lifted_at_mirror(force, density) result(length)
      real(wp), intent(in) :: force         !! on the node, away from the obstacle, on this side of the mirror
      real(wp), intent(in) :: density       !! of the obstacle's force beside it, > 0 where it presses
      real(wp) :: both(2)
      both = lifted_lengths(0.0_wp, -2.0_wp * force, density)
      length = both(1)
   end function lifted_at_mirror

   !> True for the node at a line's end where what a couple lifts is as short as is taken for none, or as high as rounding.
   pure logical function stays_down(problem, element, couple, density)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: element        !! beside the node, of the line
      real(wp), intent(in) :: couple        !! on the node, either way
      real(wp), intent(in) :: density       !! of the obstacle's force beside it, > 0 where it presses
      real(wp) :: length, height
      stays_down = density > 0.0_wp
      if (.not. stays_down) return
      length = 2.0_wp * sqrt(abs(couple) / density)
      ! w is largest at 3 l/4.
      height = 27.0_wp / 256.0_wp * density * length**4 * problem%compliance(element)%bending / 24.0_wp
      stays_down = length <= line_share * problem%layout%stretch(problem%stretch(element))%length .or. height <= &
         & rounding_gap(problem)
   end function stays_down

   !> The shorter length of those that would lift off beside a node if a line that comes to it went on past it; 0 where no couple
   !> turns it.
   real(wp) function lifted_ahead(problem, state, candidate, node) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate      !! at the end of the line
      integer, intent(in) :: node           !! between two free elements
      real(wp) :: local(3), place(2), angle, density, couple, scale
      integer :: side
      call find_couple(problem, state, node, couple, scale)
      length = 0.0_wp
      if (abs(couple) <= left_over(problem) * scale * problem%size) return
      side = findloc(problem%conforms(problem%candidates%element(:, candidate)) > 0, .true., 1)
      call conforming_forces(problem, state, problem%candidates%element(side, candidate), merge(1.0_wp, 0.0_wp, side == 1), local, &
         & place, angle, density)
      length = minval(lifted_lengths(couple, 0.0_wp, density))
   end function lifted_ahead

   !> The couple on a node between two free elements, counterclockwise, and the scale of the forces beside it.
   subroutine find_couple(problem, state, node, couple, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      real(wp), intent(out) :: couple, scale
      real(wp) :: before(3), after(3), other(3)
      call end_forces(problem, state, problem%beside(1, node), other, before)
      scale = norm2(other(1:2))
      call end_forces(problem, state, problem%beside(2, node), after, other)
      scale = max(scale, norm2(other(1:2)), norm2(before(1:2)), norm2(after(1:2)))
      couple = before(3) - after(3)
   end subroutine find_couple

   !> Lengths that lift off, huge where nothing presses.
   pure function lifted_lengths(couple, force, density) result(length)
      real(wp), intent(in) :: couple        !! on the node, clockwise where the obstacle is below the rod
      real(wp), intent(in) :: force         !! on it, towards the obstacle
      real(wp), intent(in) :: density       !! of the obstacle's force beside it, > 0 where it presses
      real(wp) :: length(2)                 !! before and after the node
      real(wp) :: ends(2), v, m
      integer :: k
      length = huge(length)
      if (.not. density > 0.0_wp) return
      ends = [0.0_wp, 1.0_wp]
      do k = 1, digits(v)
         v = 0.5_wp * sum(ends)
         associate (f => force_part(v))
            ends(merge(1, 2, abs(couple) * density * f * abs(f) > force * abs(force) * couple_part(v))) = v
         end associate
      end do
      if (abs(couple) * density * force_part(v)**2 > force**2 * couple_part(v)) then
         m = sqrt(abs(couple) / (density * couple_part(v)))
      else
         m = force / (density * force_part(v))
      end if
      length = [m, v * m]
      if (couple < 0.0_wp) length = length([2, 1])
   end function lifted_lengths

   !> f and c of the law.
   elemental real(wp) function force_part(v) result(f)
      real(wp), intent(in) :: v
      f = first_end(v) + second_end(v) - 1.0_wp - v
   end function force_part

   elemental real(wp) function couple_part(v) result(c)
      real(wp), intent(in) :: v
      c = 0.5_wp * (1.0_wp - v**2) - first_end(v) + v * second_end(v)
   end function couple_part

   !> T1 and T2 over r m.
   elemental real(wp) function first_end(v) result(t)
      real(wp), intent(in) :: v
      t = (3.0_wp + v - v**2 + v**3) / 12.0_wp
   end function first_end

   elemental real(wp) function second_end(v) result(t)
      real(wp), intent(in) :: v
      t = (1.0_wp - v + v**2 + 3.0_wp * v**3) / (12.0_wp * v**2)
   end function second_end
end module lifted_node
