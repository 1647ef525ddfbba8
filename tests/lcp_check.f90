!> Measures how well a vector solves a linear complementarity problem, independently of the solver.
!>
!> On purpose this module uses neither the solver nor any library: an error there cannot affect the check. In a run the solver
!> tests its own answers, and each point is checked for forces that pull and for penetration.
module lcp_check
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: wp
   implicit none
   private
   public :: lcp_error

contains

   !> Largest componentwise violation of  w = q + M z,  w >= 0,  z >= 0,  z.w = 0.
   !>
   !> Everything is relative to the terms that make up w, s = |M||z| + |q|:
   !>   gap(i)    = w(i)/s(i), w computed here from M, q and z; 0 where s(i) = 0
   !>   effect(i) = max over j of |M(j, i) z(i)|/s(j): relative change of the row that is most affected if z(i) is set to zero;
   !>             1 if z(i) is not zero but column i of M is: such a force has no measurable effect
   !> and the violation of pair i is the largest of
   !>   -gap(i)                    penetration
   !>   min(gap(i), effect(i))     a force across an open gap
   !>   effect(i) where z(i) < 0   a force that pulls
   !> A wrong force leaves w(i) /= 0 at its own contact or a coupled one, and is detected although w >= 0 may be satisfied.
   !> The value lies between 0 and 1, does not change when equations, unknowns or q are put into other units, and is at
   !> most a few eps times n for a stable solution. It is a backward error: on an ill-conditioned M forces with a small
   !> value may still be far from the exact ones.
   function lcp_error(m, q, z) result(violation)
      real(wp), intent(in) :: m(:, :) !! (n, n), for instance compliances [length/force]
      real(wp), intent(in) :: q(:)    !! (n) w at z = 0, for instance gaps without contact forces [length]
      real(wp), intent(in) :: z(:)    !! (n) the solution to be checked, for instance contact forces [force]
      real(wp) :: violation           !! 0 for n = 0; huge() if shapes differ or a value is not finite

      real(wp) :: w(size(q)), s(size(q)), gap, effect, term
      integer :: i, j, n

      n = size(q)
      violation = huge(1.0_wp)
      if (size(m, 1) /= n .or. size(m, 2) /= n .or. size(z) /= n) return
      if (.not. (all(ieee_is_finite(m)) .and. all(ieee_is_finite(q)) .and. all(ieee_is_finite(z)))) return

      w = q
      s = abs(q)
      columns: do i = 1, n
         w = w + m(:, i) * z(i)
         s = s + abs(m(:, i) * z(i))
      end do columns

      if (.not. all(ieee_is_finite(s))) return

      violation = 0.0_wp
      pairs: do i = 1, n
         gap = 0.0_wp
         if (s(i) > 0.0_wp) gap = w(i) / s(i)
         violation = max(violation, 0.0_wp - gap)

         if (z(i) >= 0.0_wp .and. .not. (z(i) > 0.0_wp .and. gap > violation)) cycle
         effect = 0.0_wp
         do j = 1, n
            term = abs(m(j, i) * z(i))
            if (term > 0.0_wp) effect = max(effect, term / s(j))
         end do
         if (all(abs(m(:, i)) <= 0.0_wp)) effect = 1.0_wp
         if (z(i) < 0.0_wp) then
            violation = max(violation, effect)
         else
            violation = max(violation, min(gap, effect))
         end if
      end do pairs
   end function lcp_error
end module lcp_check
