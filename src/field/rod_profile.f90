!> Rod profile of an element: position and rotation between the nodes of the element.
!>
!> For GE elements with s stages the profile is the collocation polynomial of degree s in tau (0 to 1 along the element's
!> stress-free length). Added to it is the difference between the stress-free axis and the collocation polynomial of this axis,
!> rotated and stretched with the rod. Rigid motions are then exact, and the error between nodes is that of the deformation,
!> O(h^(s+1)). At the nodes position and rotation are those of the state, with error O(h^(2 s)).
!> With the Hermite correction, direction, curvature and rate of curvature at the ends equal those of the nodes. The error between
!> nodes is then O(h^8) and decreases with the fourth power of the distance from a node; without the rate of curvature it is O(h^6)
!> and decreases with the third power.
!> For UL2 elements it is the cubic through the ends of the deformed chord with the natural rotations as slopes there; O(h^2).
module rod_profile
   use kinds, only: wp, pi
   use small_dense, only: solve_small
   use conforming_span, only: conforming_state_t, conforming_displacement
   use node_rates, only: rod_derivatives, rotation_rates
   use problem, only: problem_t
   use element_families, only: collocates, follows_curves
   use rod_geometry, only: element_geometry_t
   use reference_curve, only: curve_point, curve_angle, curve_bend, curve_length, curve_abscissa, is_straight
   use rod_state, only: state_t, element_load
   use gauss_tableau, only: max_stages, stage_basis
   use rod_load, only: ge_load_t
   use ge_in_state, only: ge_at, ge_here_t, keep_ge
   use ge_stages, only: ge_stages_t, ge_data_t, find_stages, ge_direction_rates
   use ground, only: home_deviation
   implicit none
   private
   public :: profile_t, new_profile, keep_profile, mend_ends, mend_rotation, mended_by, profile_place, profile_displacement, &
      & profile_point, mended_displacement, profile_angle, home_angle, profile_rate, profile_error, profile_error_bound, &
      & mended_error, element_place

   !> Profile of one element in one state. Coefficients of polynomials belong to the powers tau^0, tau^1, ...
   type :: profile_t
      private
      integer, public :: element = 0            !! index of the element; 0: undefined
      integer :: degree = 0
      real(wp) :: stretch = 1.0_wp              !! extension ratio of the unstressed rod caused by heat
      real(wp) :: s = 0.0_wp, length = 0.0_wp   !! nominal coordinate of the first end; stress-free length
      real(wp) :: excess(2) = 0.0_wp            !! value of curve_excess at the first end
      logical :: curved = .false.               !! true: the stress-free axis may differ from its collocation polynomial
      real(wp) :: axis(2, 0:max_stages) = 0.0_wp     !! coefficients of the polynomial of the stress-free axis
      real(wp) :: moved(2, 0:max_stages) = 0.0_wp    !! coefficients of the polynomial of the displacements
      real(wp) :: rotation(0:max_stages) = 0.0_wp
      logical, public :: mended = .false.
      integer :: order = 0                      !! order of the highest derivative in the Hermite correction; 0: no correction
      real(wp) :: mend(2, 3, 2) = 0.0_wp !! (components, derivatives by tau, ends) differences of the derivatives that the
      !! correction adds
      real(wp) :: hermite(2, 3, 2) = 0.0_wp     !! hermite_sum of `mend` up to `order`
      real(wp) :: third = 0.0_wp !! what third derivatives would add to the correction is at most this times (tau (1 - tau))^3
      real(wp) :: of_nodes = 0.0_wp !! estimated error of the nodes' own positions
      real(wp) :: twist(2, 2) = 0.0_wp !! (derivatives by tau, ends) differences of the derivatives of the rotation that its
      !! correction adds
   end type profile_t

contains

   !> Profile of an element of any kind.
   pure function new_profile(problem, state, e) result(profile)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! element
      type(profile_t) :: profile
      type(ge_here_t) :: here
      call keep_profile(problem, state, e, profile, here)
   end function new_profile

   !> Makes the profile for a sequence of points of one state: it is computed again only if the element changes.
   pure subroutine keep_profile(problem, state, e, profile, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! element
      type(profile_t), intent(inout) :: profile     !! profile of the same state, or undefined
      type(ge_here_t), intent(inout) :: here        !! element of the same state, or undefined, see keep_ge
      if (profile%element == e) return
      if (problem%conforms(e) > 0) then
         profile = conforming_profile(problem, state, e)
      else
         call keep_ge(problem, state, e, here)
         profile = profile_of(problem, state, here)
      end if
   end subroutine keep_profile

   !> Profile of a conforming element: polynomials through both ends and points between them.
   pure function conforming_profile(problem, state, e) result(profile)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(profile_t) :: profile
      real(wp) :: home(2, max_stages), powers(max_stages + 1, max_stages + 1), value(3, max_stages + 1), tau, u(3), d(2), axis(2)
      type(ge_load_t) :: load
      type(conforming_state_t) :: kept
      integer :: s, j, k
      logical :: singular
      s = problem%model%mesh%stages(e)
      load = element_load(problem, state, e)
      profile%element = e
      profile%degree = s
      profile%stretch = 1.0_wp + load%strain
      profile%curved = deviates(problem, e)
      associate (g => state%geometry%element(e), node => problem%model%mesh%node(:, e), tab => problem%tableau(s))
         profile%s = g%s(1)
         profile%excess = g%excess
         profile%length = g%length
         profile%axis(:, 0) = state%geometry%x(:, node(1))
         home(1, :s) = cos(g%angle(:s))
         home(2, :s) = sin(g%angle(:s))
         home(:, :s) = g%length * g%scale * home(:, :s)
         do j = 1, s
            do k = 1, s
               profile%axis(:, k) = profile%axis(:, k) + tab%integral(j, k) * home(:, j)
            end do
         end do
         do j = 0, s
            ! The points between the ends are Chebyshev points, between which a polynomial does not oscillate.
            tau = 0.5_wp * (1.0_wp - cos(j * pi / s))
            if (j == 0) then
               u = state%u(:, node(1))
            else if (j == s) then
               tau = 1.0_wp
               u = state%u(:, node(2))
            else
               call conforming_displacement(problem, state, e, tau, kept, u)
            end if
            d = 0.0_wp
            if (profile%curved) d = deviation(problem, profile, tau)
            axis = u(1:2) + d - profile%stretch * turned(u(3), d)
            value(:, j + 1) = [axis, u(3)]
            powers(1, j + 1) = 1.0_wp
            do k = 1, s
               powers(k + 1, j + 1) = powers(k, j + 1) * tau
            end do
         end do
      end associate
      call solve_small(s + 1, powers, value, singular)
      profile%moved(:, 0:s) = value(1:2, :s + 1)
      profile%rotation(0:s) = value(3, :s + 1)
   end function conforming_profile

   !> Profile of an element that is not in line contact.
   pure function profile_of(problem, state, here) result(profile)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(ge_here_t), intent(in) :: here           !! the element in this state
      type(profile_t) :: profile
      real(wp) :: slope(2, max_stages), home(2, max_stages), turn(max_stages), phi(2), d(2), side(2)
      integer :: s, j, k
      associate (e => here%element, element => here%ge, geometry => here%ge%g)
         profile%element = e
         profile%stretch = 1.0_wp + element%load%strain
         profile%s = geometry%s(1)
         profile%excess = geometry%excess
         profile%length = geometry%length
         profile%axis(:, 0) = state%geometry%x(:, problem%model%mesh%node(1, e))
         profile%moved(:, 0) = element%u(1:2)
         profile%rotation(0) = element%u(3)
         if (collocates(problem%model%mesh%family(e))) then
            s = problem%model%mesh%stages(e)
            profile%degree = s
            profile%curved = deviates(problem, e)
            associate (tab => problem%tableau(s), scaled => geometry%length * geometry%scale, compliance => element%compliance)
               turn(:s) = geometry%length * (compliance%bending * compliance%part(2, :s) * element%z(4:3 + s) + &
                  & element%load%curvature)
               home(1, :s) = cos(geometry%angle(:s))
               home(2, :s) = sin(geometry%angle(:s))
               home(:, :s) = scaled * home(:, :s)
               slope(:, :s) = scaled * here%change(:, :s)
               do j = 1, s
                  do k = 1, s
                     profile%axis(:, k) = profile%axis(:, k) + tab%integral(j, k) * home(:, j)
                     profile%moved(:, k) = profile%moved(:, k) + tab%integral(j, k) * slope(:, j)
                     profile%rotation(k) = profile%rotation(k) + tab%integral(j, k) * turn(j)
                  end do
               end do
            end associate
         else
            ! The stored end moments are EI/h (4 phi_1 + 2 phi_2) and EI/h (2 phi_1 + 4 phi_2), where phi_1, phi_2 are the natural
            ! end rotations.
            phi = (geometry%length * problem%compliance(e)%bending / 6.0_wp) * &
               & [2.0_wp * state%z(2, e) - state%z(3, e), 2.0_wp * state%z(3, e) - state%z(2, e)]
            d = geometry%chord + element%u(4:5) - element%u(1:2)
            side = [-d(2), d(1)]
            profile%degree = 3
            profile%axis(:, 1) = geometry%chord
            profile%moved(:, 1) = d - geometry%chord + phi(1) * side
            profile%moved(:, 2) = -(2.0_wp * phi(1) + phi(2)) * side
            profile%moved(:, 3) = (phi(1) + phi(2)) * side
            profile%rotation(1:2) = [-4.0_wp * phi(1) - 2.0_wp * phi(2), 3.0_wp * (phi(1) + phi(2))]
         end if
      end associate
   end function profile_of

   !> Sets the Hermite correction of the positions of a GE element, from the derivatives at its nodes (rod_derivatives).
   pure subroutine mend_ends(problem, state, profile, order, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(inout) :: profile     !! profile of the same state
      integer, intent(in) :: order !! order of the highest derivative in the correction, 2 or 3; order 3 has larger rounding errors
      !! in thin rods
      type(ge_here_t), intent(inout), optional :: here !! element of the same state, or undefined, see keep_ge
      real(wp) :: along(2), turn(2), bend, bend_rate, home(2, 3), dense(2, 3), tau, whole(2, 0:max_stages), way
      integer :: i, k
      whole = profile%axis + profile%moved
      associate (h => profile%length, g => state%geometry%element(profile%element), &
         & curve => problem%model%mesh%curve(profile%element))
         do i = 1, 2
            tau = real(i - 1, wp)
            call rod_derivatives(problem, state, profile%element, i, dense, here)
            home = 0.0_wp
            if (profile%curved) then
               along = [cos(g%end_angle(i)), sin(g%end_angle(i))]
               call curve_bend(problem%model%curve(curve), problem%model%imperfection, g%s(i), bend, bend_rate)
               home(:, 1) = h * along
               home(:, 2) = h**2 * bend * [-along(2), along(1)]
               home(:, 3) = h**3 * (bend_rate * [-along(2), along(1)] - bend**2 * along)
               do k = 1, 3
                  home(:, k) = home(:, k) - derivative(profile%axis, profile%degree, k, tau)
               end do
            end if
            turn = rotation_derivatives(profile, tau)
            way = rotation_at(profile, tau)
            ! The difference of the stress-free axis from its polynomial rotates with the rod; at the ends it is zero.
            home(:, 3) = home(:, 3) + 3.0_wp * (turned(0.5_wp * pi, turn(1) * home(:, 2) + turn(2) * home(:, 1)) - &
               & turn(1)**2 * home(:, 1))
            home(:, 2) = home(:, 2) + 2.0_wp * turn(1) * turned(0.5_wp * pi, home(:, 1))
            do k = 1, 3
               profile%mend(:, k, i) = h**k * dense(:, k) - derivative(whole, profile%degree, k, tau) - &
                  & profile%stretch * turned(way, home(:, k))
            end do
         end do
      end associate
      profile%mended = .true.
      profile%order = order
      profile%hermite = hermite_sum(profile%mend, order)
      call estimate_errors(profile)
   end subroutine mend_ends

   !> Estimates of the errors of a corrected profile, see mended_error. What third derivatives add to a correction by first and
   !> second ones is (tau (1 - tau))^3 times a linear function of tau, which is known from two places. The larger of its values at
   !> the ends counts all along the element: the function may have a zero inside, where the error is not small.
   pure subroutine estimate_errors(profile)
      type(profile_t), intent(inout) :: profile
      real(wp) :: adds(2, 2), bend
      integer :: k
      do k = 1, 2
         associate (tau => 0.5_wp * k - 0.25_wp)
            adds(:, k) = (mended_to(profile, 3, tau) - mended_to(profile, 2, tau)) / (tau * (1.0_wp - tau))**3
         end associate
      end do
      profile%third = max(norm2(1.5_wp * adds(:, 1) - 0.5_wp * adds(:, 2)), norm2(1.5_wp * adds(:, 2) - 0.5_wp * adds(:, 1)))
      profile%of_nodes = maxval([(norm2(mended_by(profile, 0.25_wp * k)), k=1, 3)])
      bend = norm2(profile%axis(:, 2) + profile%moved(:, 2))
      if (bend > profile%of_nodes) profile%of_nodes = profile%of_nodes**2 / bend
   end subroutine estimate_errors

   !> Sets the Hermite correction of the rotation, which mended_displacement uses.
   pure subroutine mend_rotation(problem, state, profile, here)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(inout) :: profile     !! profile of the same state
      type(ge_here_t), intent(inout), optional :: here !! element of the same state, or undefined, see keep_ge
      real(wp) :: rates(2)
      integer :: i
      associate (h => profile%length)
         do i = 1, 2
            call rotation_rates(problem, state, profile%element, i, rates, here)
            profile%twist(:, i) = [h, h**2] * rates - rotation_derivatives(profile, real(i - 1, wp))
         end do
      end associate
   end subroutine mend_rotation

   !> Deformed position (x, y) at a place in the element.
   pure function profile_place(problem, profile, tau) result(x)
      type(problem_t), intent(in) :: problem
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      real(wp) :: x(2)
      x = polynomial(profile%axis + profile%moved, profile%degree, tau)
      if (profile%curved) x = x + profile%stretch * turned(rotation_at(profile, tau), deviation(problem, profile, tau))
      x = x + mended_by(profile, tau)
   end function profile_place

   !> Hermite correction of a position; its magnitude is about the error of the uncorrected position. Zero for a profile without
   !> correction.
   pure function mended_by(profile, tau) result(x)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau !! place in the element, 0 to 1 of its stress-free length
      real(wp) :: x(2)
      x = 0.0_wp
      if (profile%mended) x = hermite_place(profile%hermite, profile%order, tau)
   end function mended_by

   !> Hermite correction of a position with derivatives up to a given order.
   pure function mended_to(profile, order, tau) result(x)
      type(profile_t), intent(in) :: profile
      integer, intent(in) :: order
      real(wp), intent(in) :: tau
      real(wp) :: x(2)
      x = hermite_place(hermite_sum(profile%mend, order), order, tau)
   end function mended_to

   !> Coefficients of t, t^2, ... in the polynomials p and q of Hermite's polynomial (1 - t)^(order + 1) p(t) + t^(order + 1) q(1 -
   !> t). It has given derivatives at 0 and 1 up to an order, and is zero at 0 and 1.
   pure function hermite_sum(mend, order) result(sum)
      real(wp), intent(in) :: mend(2, 3, 2)      !! (components, derivatives, ends) given derivatives
      integer, intent(in) :: order
      real(wp) :: sum(2, 3, 2), binomial, factorial
      integer :: j, k
      sum = 0.0_wp
      factorial = 1.0_wp
      do j = 1, order
         factorial = factorial * j
         binomial = 1.0_wp
         do k = 0, order - j
            if (k > 0) binomial = binomial * real(order + k, wp) / k
            sum(:, j + k, 1) = sum(:, j + k, 1) + (binomial / factorial) * mend(:, j, 1)
            sum(:, j + k, 2) = sum(:, j + k, 2) + ((-1.0_wp)**j * binomial / factorial) * mend(:, j, 2)
         end do
      end do
   end function hermite_sum

   !> Value at t of the polynomial with the coefficients of hermite_sum.
   pure function hermite_place(sum, order, t) result(x)
      real(wp), intent(in) :: sum(2, 3, 2)
      integer, intent(in) :: order
      real(wp), intent(in) :: t
      real(wp) :: x(2), second(2), r
      integer :: k
      r = 1.0_wp - t
      x = 0.0_wp
      second = 0.0_wp
      do k = order, 1, -1
         x = t * (x + sum(:, k, 1))
         second = r * (second + sum(:, k, 2))
      end do
      x = r**(order + 1) * x + t**(order + 1) * second
   end function hermite_place

   !> Displacements and rotation, with the Hermite correction of the rotation. Positions are not corrected, because in thin rods the
   !> rounding of their second derivatives would dominate.
   pure function mended_displacement(problem, profile, tau) result(u)
      type(problem_t), intent(in) :: problem
      type(profile_t), intent(in) :: profile        !! profile after a call of mend_rotation
      real(wp), intent(in) :: tau
      real(wp) :: u(3), twist(2, 3, 2), turn(2)
      u = profile_displacement(problem, profile, tau)
      twist = 0.0_wp
      twist(1, :2, :) = profile%twist
      turn = hermite_place(hermite_sum(twist, 2), 2, tau)
      u(3) = u(3) + turn(1)
   end function mended_displacement

   !> Displacements (x, y) and rotation of a material point.
   pure function profile_displacement(problem, profile, tau) result(u)
      type(problem_t), intent(in) :: problem
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp) :: u(3), d(2)
      d = 0.0_wp
      if (profile%curved) d = deviation(problem, profile, tau)
      u = displacement_beside(profile, tau, d)
   end function profile_displacement

   !> Displacements and rotation of a material point, and its stress-free position.
   pure subroutine profile_point(problem, profile, tau, home, u)
      type(problem_t), intent(in) :: problem
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: home(2), u(3)
      real(wp) :: d(2)
      d = 0.0_wp
      if (profile%curved) d = deviation(problem, profile, tau)
      home = polynomial(profile%axis, profile%degree, tau) + d
      u = displacement_beside(profile, tau, d)
   end subroutine profile_point

   !> Displacements and rotation of a point at which the stress-free axis differs from its polynomial by the vector d.
   pure function displacement_beside(profile, tau, d) result(u)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau, d(2)
      real(wp) :: u(3)
      u(1:2) = polynomial(profile%moved, profile%degree, tau)
      u(3) = rotation_at(profile, tau)
      if (.not. profile%curved) return
      ! The difference between the rotated and the original vector would lose the digits of small rotations; this form keeps them.
      u(1:2) = u(1:2) + (profile%stretch - 1.0_wp) * d + (2.0_wp * profile%stretch * sin(0.5_wp * u(3))) * &
         & (cos(0.5_wp * u(3)) * [-d(2), d(1)] - sin(0.5_wp * u(3)) * d)
   end function displacement_beside

   !> Tangent angle of the deformed rod [rad]; if the rod has shear flexibility, the angle of the cross section's normal.
   pure function profile_angle(problem, state, profile, tau) result(angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp) :: angle
      angle = home_angle(problem, state%geometry%element(profile%element), profile%element, tau) + rotation_at(profile, tau)
   end function profile_angle

   !> Tangent angle of the stress-free rod [rad].
   pure function home_angle(problem, geometry, e, tau) result(angle)
      type(problem_t), intent(in) :: problem
      type(element_geometry_t), intent(in) :: geometry !! geometry of the element
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      real(wp) :: angle
      angle = geometry%end_angle(1)
      if (problem%model%mesh%curve(e) == 0 .or. .not. follows_curves(problem%model%mesh%family(e))) return
      associate (curve => problem%model%curve(problem%model%mesh%curve(e)), imperfections => problem%model%imperfection)
         angle = curve_angle(curve, imperfections, curve_abscissa(curve, imperfections, geometry%s(1), tau * geometry%length, &
            & geometry%excess))
      end associate
   end function home_angle

   !> Change of profile_displacement for a GE element with fixed stress-free geometry.
   pure function profile_rate(problem, state, profile, tau, du, dz, load_change) result(rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state            !! state for which the profile was made
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: du(6)                 !! changes of the displacements of both nodes
      real(wp), intent(in) :: dz(:)                 !! (z_size) changes of the stored section forces
      real(wp), intent(in) :: load_change           !! change of the load factor
      real(wp) :: rate(3), basis(max_stages), slope(2, max_stages), d(2)
      type(ge_data_t) :: element
      type(ge_stages_t) :: stages
      element = ge_at(problem, state, profile%element)
      associate (s => problem%model%mesh%stages(profile%element), g => element%g, compliance => element%compliance, &
         & load => element%load)
         call stage_basis(problem%tableau(s), tau, basis)
         call find_stages(problem%tableau(s), element, stages)
         slope = ge_direction_rates(stages, du, dz, load_change)
         rate(1:2) = du(1:2) + g%length * g%scale * matmul(slope(:, :s), basis(:s))
         rate(3) = du(3) + g%length * (compliance%bending * dot_product(basis(:s) * compliance%part(2, :s), dz(4:3 + s)) + &
            & tau * load_change * load%curvature_rate)
      end associate
      if (.not. profile%curved) return
      d = turned(rotation_at(profile, tau), deviation(problem, profile, tau))
      rate(1:2) = rate(1:2) + load_change * element%load%strain_rate * d + profile%stretch * rate(3) * [-d(2), d(1)]
   end function profile_rate

   !> Upper bound of the error of a position: the larger of the Hermite correction and the error that remains after it.
   pure real(wp) function profile_error_bound(profile, tau) result(bound)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      bound = max(norm2(mended_by(profile, tau)), profile_error(profile))
   end function profile_error_bound

   !> Estimated error of a corrected position, the larger of two contributions. The first, between the nodes, is the most that third
   !> derivatives would add to the correction. The second, of the nodes, O(h^(2 s)), is estimated by the square of the Hermite
   !> correction, O(h^(s + 1)), over the rod's deflection in the element, O(h^2).
   pure real(wp) function mended_error(profile, tau) result(error)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      if (profile%mended) then
         error = max((tau * (1.0_wp - tau))**3 * profile%third, profile%of_nodes)
      else
         error = profile_error(profile)
      end if
   end function mended_error

   !> Estimate of the error of a GE element's displacements between its nodes.
   !> Without Hermite correction it is the next coefficient of the polynomial, extrapolated from the decrease of the last ones,
   !> times the maximum of the monic error polynomial. This polynomial is s + 1 times the integral of Legendre's polynomial of
   !> degree s on (0, 1), at most (s + 1) / ((2 s + 1) binomial(2 s, s)).
   !> With Hermite correction it is the contribution of the fourth derivatives, extrapolated from those of the second and third. The
   !> errors of Hermite's polynomials of degree 3, 5 and 7 are derivatives of order 4, 6 and 8 over 2^4 4!, 2^6 6! and 2^8 8!.
   pure real(wp) function profile_error(profile) result(error)
      type(profile_t), intent(in) :: profile
      real(wp) :: last, before, binomial
      integer :: k, s
      if (profile%order == 3) then
         last = 0.0_wp
         do k = 1, 3
            last = max(last, norm2(mended_to(profile, 3, 0.25_wp * k) - mended_to(profile, 2, 0.25_wp * k)))
         end do
         before = norm2(derivative(profile%moved, profile%degree, 3, 1.0_wp) + profile%mend(:, 3, 2) - &
            & derivative(profile%moved, profile%degree, 3, 0.0_wp) - profile%mend(:, 3, 1)) / 384.0_wp
         error = last
         if (last < before) error = last**2 / before
         return
      end if
      s = profile%degree
      last = norm2(profile%moved(:, s))
      before = norm2(profile%moved(:, s - 1))
      error = last
      if (last < before) error = last**2 / before
      binomial = 1.0_wp
      do k = 1, s
         binomial = binomial * real(s + k, wp) / k
      end do
      error = error * (s + 1) / ((2 * s + 1) * binomial)
   end function profile_error

   !> Place (0 to 1) in an element on a curve that has a given nominal coordinate.
   pure real(wp) function element_place(problem, geometry, e, s) result(tau)
      type(problem_t), intent(in) :: problem
      type(element_geometry_t), intent(in) :: geometry !! stress-free geometry of the element
      integer, intent(in) :: e
      real(wp), intent(in) :: s                     !! nominal coordinate between those of the element's two ends
      tau = curve_length(problem%model%curve(problem%model%mesh%curve(e)), problem%model%imperfection, geometry%s(1), s, &
         & geometry%excess) / geometry%length
   end function element_place

   !> True if the stress-free axis of an element may differ from its collocation polynomial.
   pure logical function deviates(problem, e)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: e
      deviates = problem%model%mesh%curve(e) > 0
      if (.not. deviates) return
      associate (curve => problem%model%curve(problem%model%mesh%curve(e)))
         deviates = .not. is_straight(curve)
      end associate
      if (problem%ground%founded(e) .and. problem%ground%tabled) deviates = problem%ground%curved(e)
   end function deviates

   !> Vector from the polynomial of the stress-free axis to this axis.
   pure function deviation(problem, profile, tau) result(d)
      type(problem_t), intent(in) :: problem
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp) :: d(2), x(2), angle, speed
      if (problem%ground%founded(profile%element) .and. problem%ground%tabled) then
         ! The deviation is taken from a table, because the quadratures of foundations evaluate it at very many points.
         d = home_deviation(problem%ground, profile%element, tau)
      else
         associate (curve => problem%model%curve(problem%model%mesh%curve(profile%element)))
            call curve_point(curve, problem%model%imperfection, curve_abscissa(curve, problem%model%imperfection, profile%s, &
               & tau * profile%length, profile%excess), x, angle, speed)
         end associate
         d = x - polynomial(profile%axis, profile%degree, tau)
      end if
   end function deviation

   !> Rotation at a place in the element [rad].
   pure real(wp) function rotation_at(profile, tau)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      integer :: k
      rotation_at = profile%rotation(profile%degree)
      do k = profile%degree - 1, 0, -1
         rotation_at = profile%rotation(k) + tau * rotation_at
      end do
   end function rotation_at

   !> First and second derivative of the rotation with respect to tau.
   pure function rotation_derivatives(profile, tau) result(turn)
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp) :: turn(2)
      integer :: k
      turn = 0.0_wp
      do k = 1, profile%degree
         turn(1) = turn(1) + k * profile%rotation(k) * tau**(k - 1)
         if (k > 1) turn(2) = turn(2) + k * (k - 1) * profile%rotation(k) * tau**(k - 2)
      end do
   end function rotation_derivatives

   !> Value of a polynomial in the plane.
   pure function polynomial(coefficient, degree, tau) result(x)
      real(wp), intent(in) :: coefficient(2, 0:max_stages)
      integer, intent(in) :: degree
      real(wp), intent(in) :: tau
      real(wp) :: x(2)
      integer :: k
      x = coefficient(:, degree)
      do k = degree - 1, 0, -1
         x = coefficient(:, k) + tau * x
      end do
   end function polynomial

   !> Derivative of a polynomial in the plane.
   pure function derivative(coefficient, degree, order, tau) result(x)
      real(wp), intent(in) :: coefficient(2, 0:max_stages)
      integer, intent(in) :: degree, order
      real(wp), intent(in) :: tau
      real(wp) :: x(2), factor
      integer :: k, i
      x = 0.0_wp
      do k = degree, order, -1
         factor = 1.0_wp
         do i = k - order + 1, k
            factor = factor * i
         end do
         x = tau * x + factor * coefficient(:, k)
      end do
   end function derivative

   !> A vector rotated by an angle, counterclockwise.
   pure function turned(angle, d) result(x)
      real(wp), intent(in) :: angle, d(2)
      real(wp) :: x(2)
      x = [cos(angle) * d(1) - sin(angle) * d(2), sin(angle) * d(1) + cos(angle) * d(2)]
   end function turned
end module rod_profile
