!> Local uplift: the lengths over which a line contact lifts off on both sides of a node at which a couple or a force acts. The
!> obstacle is taken as straight (over such a short length its curvature has no effect) and presses on both sides with the density
!> r. With the distance x from the end of the line contact on each side, the gap is w = T x^3/(6 EI) - r x^4/(24 EI), where T is the
!> contact force at that end. The node is at the distances m and n from the two ends. At the node both sides have the same w and
!> slope, T1 + T2 = r (m + n) + F with a pressing force F, and the moment jumps by the couple C. With v = n/m <= 1, and m on the
!> side on which the couple lifts the rod:
!>
!>   T1 = r m (3 + v - v^2 + v^3)/12,   T2 = r m (1 - v + v^2 + 3 v^3)/(12 v^2),
!>   F = r m f(v),   f = T1/(r m) + T2/(r m) - 1 - v,   C = r m^2 c(v),   c = 1/2 - T1/(r m) + v T2/(r m) - v^2/2.
!>
!> Without a force v = 2 - sqrt(3) and C = (2 sqrt(3) - 3) r m^2; without a couple v = 1 and m = -3 F/(4 r) (F < 0 lifts). Any
!> couple lifts a finite length, however large the pressing force is. A node inside a line contact therefore transmits no couple to
!> the obstacle.
!>
!> A joint at which the curvature of the obstacle jumps by D acts on the rod like the couple C = EI D, of either sign: the line
!> contact lifts over m + n = sqrt(2 sqrt(3) C/r), n on the side where the obstacle bends less towards the rod.
!>
!> A couple at the last node of a line contact may press this node onto the obstacle, so that the rod lifts beside the node:
!> w = r x^3 (l - x)/(24 EI), with the distance x from the new end of the line contact and the lifted length l. The slope at the
!> node is neglected, and the moment at the node is -r l^2/4.
module lifted_node
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use contact_spans, only: initial_share
   use rod_state, only: state_t
   use track_nodes, only: node_track, track_sense
   use conforming_span, only: conforming_forces
   use breakpoint_forces, only: breakpoint_force, breakpoint_couple
   implicit none
   private
   public :: inside_line, lifted_beside, lifted_at_mirror, stays_in_contact, holding_density

contains

   !> True if the rod is in line contact on both sides of a node and no support fixes the rotation of the node.
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

   !> Lengths over which a line contact lifts off before and after a node inside the line contact.
   function lifted_beside(problem, state, candidate) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: length(2)                 !! lengths before and after the node; huge if there is no pressure
      real(wp) :: local(3), density(2)
      integer :: side
      do side = 1, 2
         call conforming_forces(problem, state, problem%beside(side, problem%candidates%node(candidate)), &
            & merge(1.0_wp, 0.0_wp, side == 1), local, density=density(side))
      end do
      ! breakpoint_couple is the couple of the obstacle on the node; the couple that acts on the rod is opposite and equal.
      length = lifted_lengths(breakpoint_couple(problem, state, candidate) * track_sense(problem, state, candidate, &
         & node_track(problem, state, candidate)), breakpoint_force(problem, state, candidate), 0.5_wp * sum(density))
   end function lifted_beside

   !> Density of the obstacle's force above which a couple lifts the rod over a negligible length only, or by a height below
   !> rounding. In the symbols of the module header: m <= initial_share of the rod segment, or lifted height (21 - 12 sqrt(3))/8
   !> C^2/(r EI) <= rounding_gap. (The lifted height is largest at x = n.)
   pure real(wp) function holding_density(problem, element, couple) result(density)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: element        !! element of the line contact on which the couple acts
      real(wp), intent(in) :: couple        !! couple on the element, of either sign
      density = min(abs(couple) / ((2.0_wp * sqrt(3.0_wp) - 3.0_wp) * (initial_share * &
         & problem%layout%rod_segment(problem%rod_segment(element))%length)**2), &
         & (21.0_wp - 12.0_wp * sqrt(3.0_wp)) / 8.0_wp * couple**2 * problem%compliance(element)%bending / rounding_gap(problem))
   end function holding_density

   !> Length of local uplift beside a node with fixed rotation, such as a node on a symmetry plane. The mirror image of the rod
   !> lifts with the same force, so that the node carries twice the force of one side. The result is huge if the obstacle does not
   !> press.
   pure real(wp) function lifted_at_mirror(force, density) result(length)
      real(wp), intent(in) :: force         !! force on this side of the symmetry plane, > 0: away from the obstacle
      real(wp), intent(in) :: density       !! density of the obstacle's force beside the node, > 0 where it presses
      real(wp) :: both(2)
      both = lifted_lengths(0.0_wp, -2.0_wp * force, density)
      length = both(1)
   end function lifted_at_mirror

   !> True if the node at the end of a line contact stays in contact under a couple: the couple lifts a negligible length, or by a
   !> height below rounding.
   pure logical function stays_in_contact(problem, element, couple, density)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: element        !! element of the line contact beside the node
      real(wp), intent(in) :: couple        !! couple on the node, of either sign
      real(wp), intent(in) :: density       !! density of the obstacle's force beside the node, > 0 where it presses
      real(wp) :: length, height
      stays_in_contact = density > 0.0_wp
      if (.not. stays_in_contact) return
      length = 2.0_wp * sqrt(abs(couple) / density)
      ! The lifted height w is largest at x = 3 l/4.
      height = 27.0_wp / 256.0_wp * density * length**4 * problem%compliance(element)%bending / 24.0_wp
      stays_in_contact = length <= initial_share * problem%layout%rod_segment(problem%rod_segment(element))%length .or. height <= &
         & rounding_gap(problem)
   end function stays_in_contact

   !> Lengths of local uplift before and after a node; huge if the obstacle does not press.
   pure function lifted_lengths(couple, force, density) result(length)
      real(wp), intent(in) :: couple        !! couple on the node, > 0 clockwise with the obstacle below the rod
      real(wp), intent(in) :: force         !! force on the node, > 0 towards the obstacle
      real(wp), intent(in) :: density       !! density of the obstacle's force beside the node, > 0 where it presses
      real(wp) :: length(2)                 !! lengths before and after the node
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

   !> Force f and couple c on the lifted part, dimensionless, as functions of v = n/m (formulas in the module header).
   elemental real(wp) function force_part(v) result(f)
      real(wp), intent(in) :: v
      f = first_end(v) + second_end(v) - 1.0_wp - v
   end function force_part

   elemental real(wp) function couple_part(v) result(c)
      real(wp), intent(in) :: v
      c = 0.5_wp * (1.0_wp - v**2) - first_end(v) + v * second_end(v)
   end function couple_part

   !> Contact forces at the two ends of the lifted part, T1/(r m) and T2/(r m), as functions of v = n/m (formulas in the module
   !> header).
   elemental real(wp) function first_end(v) result(t)
      real(wp), intent(in) :: v
      t = (3.0_wp + v - v**2 + v**3) / 12.0_wp
   end function first_end

   elemental real(wp) function second_end(v) result(t)
      real(wp), intent(in) :: v
      t = (1.0_wp - v + v**2 + 3.0_wp * v**3) / (12.0_wp * v**2)
   end function second_end
end module lifted_node
