!> Gauss collocation with s = 1 to 6 points on (0, 1): order 2 s, symplectic. Decks use up to four points. One point more gives
!> error estimates; two points more show how reliable the estimates are.
!> Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, II.1; b_i a_ij + b_j a_ji = b_i b_j.
module gauss_tableau
   use kinds, only: wp, pi
   implicit none
   private
   public :: tableau_t, max_stages, new_tableau, gauss_points, stage_basis, end_values, raised_values

   integer, parameter :: max_stages = 6

   !> Butcher tableau of the Gauss method with a given number of stages.
   type :: tableau_t
      integer :: stages = 0
      real(wp) :: a(max_stages, max_stages) = 0.0_wp !! a_ij: integral of the j-th Lagrange polynomial from 0 to c_i
      real(wp) :: before(max_stages) = 0.0_wp        !! sum of a_ij over j
      real(wp) :: b(max_stages) = 0.0_wp             !! weights
      real(wp) :: c(max_stages) = 0.0_wp             !! abscissae
      real(wp) :: integral(max_stages, max_stages) = 0.0_wp !! (j, power) coefficients of stage_basis; 0 behind the last stage
      real(wp) :: raise(max_stages, 0:max_stages - 1) = 0.0_wp !! (i, j) values of the Lagrange polynomials through the first end (j
      !! = 0) and the abscissae, at the i-th point of the tableau with one stage more; not set for max_stages
   end type tableau_t

contains

   !> The tableau with `stages` points, 1 to max_stages.
   pure function new_tableau(stages) result(t)
      integer, intent(in) :: stages
      type(tableau_t) :: t
      real(wp) :: basis(max_stages), lagrange(0:max_stages), scale
      integer :: i, j, k, degree
      t%stages = stages
      call gauss_points(stages, t%c(:stages), t%b(:stages))
      do j = 1, stages
         ! Coefficients of the Lagrange polynomial j: the product of (x - c_k)/(c_j - c_k) over all other k.
         lagrange = 0.0_wp
         lagrange(0) = 1.0_wp
         degree = 0
         do k = 1, stages
            if (k == j) cycle
            scale = 1.0_wp / (t%c(j) - t%c(k))
            lagrange(1:degree + 1) = scale * (lagrange(0:degree) - t%c(k) * lagrange(1:degree + 1))
            lagrange(0) = -scale * t%c(k) * lagrange(0)
            degree = degree + 1
         end do
         do k = 1, stages
            t%integral(j, k) = lagrange(k - 1) / k
         end do
      end do
      do i = 1, stages
         call stage_basis(t, t%c(i), basis)
         t%a(i, :stages) = basis(:stages)
         t%before(i) = sum(basis(:stages))
      end do
      if (stages < max_stages) t%raise(:stages + 1, 0:stages) = raising(t)
   end function new_tableau

   !> Gauss-Legendre abscissae (ascending) and weights on (0, 1) for any number of points, by Newton's method on P_n.
   pure subroutine gauss_points(n, c, b)
      integer, intent(in) :: n         !! number of points
      real(wp), intent(out) :: c(:)    !! (n) abscissae
      real(wp), intent(out) :: b(:)    !! (n) weights, sum 1
      real(wp) :: x, p0, p1, p2, slope, dx
      integer :: i, k, iteration
      do i = 1, n
         x = cos(0.25_wp * pi * (4 * i - 1) / (n + 0.5_wp))
         do iteration = 1, 50
            p0 = 1.0_wp
            p1 = x
            do k = 2, n
               p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k
               p0 = p1
               p1 = p2
            end do
            slope = n * (p0 - x * p1) / (1.0_wp - x * x)
            dx = p1 / slope
            x = x - dx
            if (abs(dx) <= 4.0_wp * epsilon(x)) exit
         end do
         c(n + 1 - i) = 0.5_wp * (1.0_wp + x)
         b(n + 1 - i) = 1.0_wp / ((1.0_wp - x * x) * slope * slope)
      end do
   end subroutine gauss_points

   !> Integrals from 0 to tau of the Lagrange polynomials through the abscissae. With them the solution of the collocation method is
   !> evaluated between the abscissae.
   pure subroutine stage_basis(t, tau, basis)
      type(tableau_t), intent(in) :: t        !! tableau; only `stages` and `integral` are used
      real(wp), intent(in) :: tau             !! upper limit of the integrals, 0 to 1
      real(wp), intent(out) :: basis(max_stages) !! (stages) the integrals; behind them zeros
      integer :: k
      basis = 0.0_wp
      do k = t%stages, 1, -1
         basis = (basis + t%integral(:, k)) * tau
      end do
   end subroutine stage_basis

   !> Values at both ends of the polynomial through values at the abscissae.
   pure function end_values(t, value) result(ends)
      type(tableau_t), intent(in) :: t
      real(wp), intent(in) :: value(:)           !! (stages) values at the abscissae
      real(wp) :: ends(2)
      integer :: k
      ends(1) = dot_product(value, t%integral(:t%stages, 1))
      ends(2) = 0.0_wp
      do k = 1, t%stages
         ends(2) = ends(2) + k * dot_product(value, t%integral(:t%stages, k))
      end do
   end function end_values

   !> Interpolates values at 0 and at the abscissae of a tableau to the abscissae of the tableau with one stage more.
   pure function raised_values(t, first, value) result(new)
      type(tableau_t), intent(in) :: t           !! tableau with fewer than max_stages stages
      real(wp), intent(in) :: first              !! value at 0, the first end
      real(wp), intent(in) :: value(:)           !! (stages) values at the abscissae
      real(wp) :: new(t%stages + 1)
      integer :: j
      new = first * t%raise(:t%stages + 1, 0)
      do j = 1, t%stages
         new = new + value(j) * t%raise(:t%stages + 1, j)
      end do
   end function raised_values

   !> Values of the Lagrange polynomials through 0 and the abscissae, at the abscissae of the tableau with one stage more.
   pure function raising(t) result(raise)
      type(tableau_t), intent(in) :: t           !! tableau with fewer than max_stages stages; only `stages` and c are used
      real(wp) :: raise(t%stages + 1, 0:t%stages), at(0:t%stages), to(t%stages + 1), weight(t%stages + 1)
      integer :: j, k
      at(0) = 0.0_wp
      at(1:) = t%c(:t%stages)
      call gauss_points(t%stages + 1, to, weight)
      raise = 1.0_wp
      do j = 0, t%stages
         do k = 0, t%stages
            if (k /= j) raise(:, j) = raise(:, j) * (to - at(k)) / (at(j) - at(k))
         end do
      end do
   end function raising
end module gauss_tableau
