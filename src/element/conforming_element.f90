!> The rod element that lies on an obstacle: Gauss collocation of the rod equations along the track, order 2 to 8.
!>
!>   sigma' = o (1 + e)        e = N/EA + e_T           theta' = k(sigma) sigma'     M = EI (theta' - k0 - k_T)
!>   P' = k'(sigma) (1 + e) M - q_t                     P = N + o k M                q_t = q . (o tangent)
!>
!> ' is the derivative d/ds by the stress-free length s. theta, e, N, M: tangent angle, strain, axial force and moment of the rod;
!> P: the force dual to sigma (see below). sigma: arc length along the track; k and k': curvature of the track and its derivative by
!> sigma (obstacle_track); o: 1 for a rod in the direction of the track, -1 against it; k0: stress-free curvature; e_T, k_T: thermal
!> strain and curvature of the unstressed rod; q: dead load by stress-free length. Follower pressure is normal to the track and does
!> no work along it. The rod has no shear strain.
!>
!> On the track the rod has one degree of freedom, sigma. With L = EA (e - e_T)^2/2 + EI (theta' - k0 - k_T)^2/2 - q . r the force
!> dual to sigma is dL/d(sigma') = o P, and the equation of P' is Lagrange's equation. (sigma, o P) is thus a Hamiltonian system; as
!> Gauss collocation is symplectic, the condensed tangent is symmetric.
!>
!> N and M follow from sigma and P, a linear equation: N (1 + EI k^2/EA) = P - o k EI (o k (1 + e_T) - k0 - k_T).
!> For an inextensible rod 1/EA = 0: sigma is then a function of s alone, and P is the constraint force. As in ge_element, the
!> tangent of such an element has a small artificial extension at the second end, which axial_rigidity removes from solutions.
!>
!> A foundation along the element exerts the force f per unit stress-free length, which depends on the position along the track. Its
!> quadrature has points of its own, tau_q with the weights w_q, as in ge_element: the work of f on
!>   sigma(tau) = sigma_1 + h sum b_j(tau) o (1 + e_j),   b_j the integral of the j-th Lagrange polynomial,
!> adds - h sum w_q (1 - b_i(tau_q)/b_i(1)) f_q . (o tangent) to P at stage i, and - h sum w_q f_q . (o tangent) to P at the second
!> end. The tangent remains symmetric.
!>
!> The stored unknowns z = (P at the first end, P at the stages, sigma at the stages minus sigma at the first end) are condensed out
!> here, as in ge_element: N is never computed as EA times a difference of coordinates.
module conforming_element
   use kinds, only: wp
   use obstacle_types, only: obstacle_t
   use gauss_tableau, only: tableau_t, max_stages, stage_basis
   use small_dense, only: solve_small
   use rod_load, only: ge_load_t, line_at_stage, line_at, inner_forces_t
   use ge_stages, only: ge_stiffness_t
   use obstacle_track, only: track_t, track_at, track_between, track_ahead
   implicit none
   private
   public :: conforming_data_t, conforming_equations_t, conforming_size, conforming_evaluate, conforming_output_t, new_output, &
      & output_at, conforming_resultants

   integer, parameter :: conforming_columns = 4 !! number of columns of the update operator: sigma at both ends, residual, load
   !! factor

   !> The element in one state: all data on which its equations depend, apart from the Gauss tableau, the obstacle and the forces of
   !> foundations.
   type :: conforming_data_t
      real(wp) :: length = 1.0_wp           !! stress-free length h
      real(wp) :: sense = 1.0_wp            !! o: 1: the rod has the direction of the track; -1: the opposite direction
      real(wp) :: bend(max_stages) = 0.0_wp !! stress-free curvature at the stages
      real(wp) :: offset = 0.0_wp           !! distance of the rod's axis from the surface, towards the free side
      type(track_t) :: first, last          !! track at both ends
      type(ge_stiffness_t) :: compliance    !! axial and bending (> 0) compliance; no shear
      type(ge_load_t) :: load
      real(wp) :: z(1 + 2 * max_stages) = 0.0_wp !! (conforming_size) stored unknowns; entries behind the last one are zero
   end type conforming_data_t

   !> Linearised equations of an element, its own unknowns eliminated.
   type :: conforming_equations_t
      real(wp) :: f(2) = 0.0_wp             !! condensed end forces: internal residuals eliminated
      real(wp) :: raw(2) = 0.0_wp           !! end forces from the stored unknowns, without rounding errors multiplied by EA
      real(wp) :: k(2, 2) = 0.0_wp          !! condensed tangent, symmetric
      real(wp) :: fl(2) = 0.0_wp            !! minus the derivative of f by the load factor
      real(wp) :: op(1 + 2 * max_stages, conforming_columns) = 0.0_wp !! (conforming_size, conforming_columns) update operator of
      !! the stored unknowns
      real(wp) :: defect(2) = 0.0_wp        !! largest residual of the internal equations: for P [force], for sigma [length]
      logical :: ok = .true. !! false: the internal system is singular or 1 + e <= 0; the other results are then undefined
   end type conforming_equations_t

   !> Cross section of the rod at one point of the track.
   type :: section_t
      real(wp) :: n = 0.0_wp, m = 0.0_wp    !! axial force N; moment M
      real(wp) :: stretch = 0.0_wp          !! 1 + e
      real(wp) :: pull = 0.0_wp             !! P' = k' (1 + e) M - q_t
      ! Derivatives of sigma' (run) and P' (pull) by sigma, P and the load factor; that of P' by P is minus that of sigma' by sigma:
      real(wp) :: run_by_sigma = 0.0_wp, run_by_p = 0.0_wp, run_by_load = 0.0_wp
      real(wp) :: pull_by_sigma = 0.0_wp, pull_by_load = 0.0_wp
   end type section_t

   !> Force of a foundation along the rod, at one point of its quadrature: f . (o tangent) [force/length].
   type :: tangential_force_t
      real(wp) :: force = 0.0_wp
      real(wp) :: by_place = 0.0_wp, by_load = 0.0_wp !! derivatives of the force by sigma at the point and by the load factor
      real(wp) :: by_stage(max_stages) = 0.0_wp, by_force(max_stages) = 0.0_wp !! derivatives of the force by sigma and by P at the
      !! stages
   end type tangential_force_t

   !> Data of an element for the computation of points inside it: the polynomials of sigma and P.
   type :: conforming_output_t
      type(conforming_data_t) :: element
      type(track_t) :: near                 !! a point on the element's piece of the track
      real(wp) :: run(max_stages) = 0.0_wp, pull(max_stages) = 0.0_wp !! sigma' and P' at the stages, times the element's length
      real(wp) :: miss = 0.0_wp             !! P at the second end minus the value of its polynomial of degree s there
   end type conforming_output_t

   ! Columns of the local linearisation before condensation:
   integer, parameter :: by_sigma = 1, by_p = 2, by_residual = 3, by_load = 4, n_by = 4

contains

   !> Number of stored unknowns of an element.
   pure integer function conforming_size(stages)
      integer, intent(in) :: stages
      conforming_size = 1 + 2 * stages
   end function conforming_size

   !> Computes the forces at both ends, the condensed tangent, and the operator that updates the stored unknowns.
   !>
   !> Sign: f = (-o P, o P) at the first and second node, dual to the displacements along the tangent of the track, so that in
   !> equilibrium the sum over elements minus the node loads vanishes. With the increments ds of sigma at both ends and dl of the
   !> load factor,
   !>   f + k ds - fl dl   are the end forces after one Newton step,   z + op (ds, 1, dl)   the stored unknowns.
   subroutine conforming_evaluate(tab, obstacle, element, inner, new)
      type(tableau_t), intent(in) :: tab
      type(obstacle_t), intent(in) :: obstacle
      type(conforming_data_t), intent(in) :: element
      type(inner_forces_t), intent(in) :: inner !! forces of foundations
      type(conforming_equations_t), intent(out) :: new
      type(section_t) :: section(max_stages)
      type(tangential_force_t) :: hold(inner%n)
      real(wp) :: rhs(n_by, 2 * max_stages) ! increments of sigma and P at the stages as linear functions of the columns
      real(wp) :: dend(n_by), dtail(n_by), end_defect, tail, h, sense
      logical :: singular
      integer :: s
      s = tab%stages
      h = element%length
      sense = element%sense
      call evaluate_sections()
      call solve_stages()
      call go_to_second_end()
      ! The position of the second end determines the increment of P at the first end.
      new%ok = all(section(:s)%stretch > 0.0_wp) .and. .not. singular .and. abs(dend(by_p)) > 0.0_wp
      if (new%ok) call condense()

   contains

      !> Cross sections at the stages, and the forces of foundations, with their derivatives.
      subroutine evaluate_sections()
         type(track_t) :: near
         real(wp) :: line(2), line_rate(2)
         integer :: i, q
         near = track_between(obstacle, element%offset, element%first, element%last)
         do i = 1, s
            call line_at_stage(element%load, i, line, line_rate)
            section(i) = section_at(element, track_beyond(element, obstacle, near, element%z(1 + s + i)), element%bend(i), line, &
               & line_rate, element%z(1 + i))
         end do
         do q = 1, inner%n
            hold(q) = tangential_force_at(track_beyond(element, obstacle, near, sense * h * dot_product(inner%at(q)%basis(:s), &
               & section(:s)%stretch)), sense, inner, q)
            associate (part => h * inner%at(q)%basis(:s))
               hold(q)%by_stage(:s) = hold(q)%by_place * part * section(:s)%run_by_sigma
               hold(q)%by_force(:s) = hold(q)%by_place * part * section(:s)%run_by_p
               hold(q)%by_load = hold(q)%by_load + hold(q)%by_place * dot_product(part, section(:s)%run_by_load)
            end associate
         end do
      end subroutine evaluate_sections

      !> Solves the linearised equations at the stages, first those of sigma, then those of P.
      subroutine solve_stages()
         real(wp) :: system(2 * max_stages, 2 * max_stages), weight(2 * max_stages) ! columns are equations, see solve_small
         real(wp) :: residual_sigma, residual_p, share
         integer :: i, j, q
         system = 0.0_wp
         rhs = 0.0_wp
         do i = 1, s
            system(i, i) = 1.0_wp
            system(s + i, s + i) = 1.0_wp
            rhs(by_p, s + i) = 1.0_wp
            residual_sigma = element%z(1 + s + i)
            residual_p = element%z(1 + i) - element%z(1)
            do j = 1, s
               associate (at => section(j), w => h * tab%a(i, j))
                  residual_sigma = residual_sigma - w * (sense * at%stretch)
                  residual_p = residual_p - w * at%pull
                  system(j, i) = system(j, i) - w * at%run_by_sigma
                  system(s + j, i) = -w * at%run_by_p
                  system(j, s + i) = -w * at%pull_by_sigma
                  system(s + j, s + i) = system(s + j, s + i) + w * at%run_by_sigma
                  rhs(by_sigma, i) = rhs(by_sigma, i) + w * at%run_by_sigma
                  rhs(by_sigma, s + i) = rhs(by_sigma, s + i) + w * at%pull_by_sigma
                  rhs(by_load, i) = rhs(by_load, i) + w * at%run_by_load
                  rhs(by_load, s + i) = rhs(by_load, s + i) + w * at%pull_by_load
               end associate
            end do
            do q = 1, inner%n
               share = h * inner%at(q)%weight * (1.0_wp - inner%at(q)%basis(i) / tab%b(i))
               residual_p = residual_p + share * hold(q)%force
               system(:s, s + i) = system(:s, s + i) + share * hold(q)%by_stage(:s)
               system(s + 1:2 * s, s + i) = system(s + 1:2 * s, s + i) + share * hold(q)%by_force(:s)
               rhs(by_sigma, s + i) = rhs(by_sigma, s + i) - share * (hold(q)%by_place + sum(hold(q)%by_stage(:s)))
               rhs(by_load, s + i) = rhs(by_load, s + i) - share * hold(q)%by_load
            end do
            rhs(by_residual, i) = -residual_sigma
            rhs(by_residual, s + i) = -residual_p
            new%defect(1) = max(new%defect(1), abs(residual_p))
            new%defect(2) = max(new%defect(2), abs(residual_sigma))
         end do
         ! Weight of force equations relative to length equations: the flexibility of the element.
         weight(:s) = 1.0_wp
         weight(s + 1:) = abs(h) * element%compliance%axial + abs(h)**3 * element%compliance%bending
         call solve_small(2 * s, system, rhs, singular, weight)
      end subroutine solve_stages

      !> Increments of sigma (dend) and P (dtail) at the second end, minus their increments at the first end, as linear functions of
      !> the columns: increment of sigma at the first end, increment of P at the first end, 1, increment of the load factor.
      subroutine go_to_second_end()
         real(wp) :: dsigma(n_by), dp(n_by), share
         integer :: i, q
         dend = 0.0_wp
         dtail = 0.0_wp
         dtail(by_p) = 1.0_wp
         end_defect = track_ahead(obstacle, element%offset, element%first, element%last)
         tail = element%z(1)
         do i = 1, s
            associate (at => section(i), w => h * tab%b(i))
               end_defect = end_defect - w * (sense * at%stretch)
               tail = tail + w * at%pull
               dsigma = rhs(:, i)
               dsigma(by_sigma) = dsigma(by_sigma) + 1.0_wp
               dp = rhs(:, s + i)
               dend = dend + w * (at%run_by_sigma * dsigma + at%run_by_p * dp)
               dtail = dtail + w * (at%pull_by_sigma * dsigma - at%run_by_sigma * dp)
               dend(by_load) = dend(by_load) + w * at%run_by_load
               dtail(by_load) = dtail(by_load) + w * at%pull_by_load
            end associate
         end do
         do q = 1, inner%n
            share = h * inner%at(q)%weight
            tail = tail - share * hold(q)%force
            dtail = dtail - share * (matmul(rhs(:, :s), hold(q)%by_stage(:s)) + matmul(rhs(:, s + 1:2 * s), hold(q)%by_force(:s)))
            dtail(by_sigma) = dtail(by_sigma) - share * (hold(q)%by_place + sum(hold(q)%by_stage(:s)))
            dtail(by_load) = dtail(by_load) - share * hold(q)%by_load
         end do
         new%defect(2) = max(new%defect(2), abs(end_defect))
         ! The artificial extension acts at the second end only; the tangent is that of two elements in series, and symmetric.
         dend = dend + (sense * h * element%compliance%give) * dtail
      end subroutine go_to_second_end

      !> Computes end forces, tangent and the update operator from the increments at the first end.
      subroutine condense()
         real(wp) :: ends(conforming_columns)
         integer :: j
         ends = [-1.0_wp - dend(by_sigma), 1.0_wp, end_defect - dend(by_residual), -dend(by_load)] / dend(by_p)
         new%op(1, :) = ends
         do j = 1, conforming_columns
            new%op(2:1 + s, j) = rhs(by_p, s + 1:2 * s) * ends(j)
            new%op(2 + s:1 + 2 * s, j) = rhs(by_p, :s) * ends(j)
         end do
         new%op(2:1 + s, 1) = new%op(2:1 + s, 1) + rhs(by_sigma, s + 1:2 * s)
         new%op(2 + s:1 + 2 * s, 1) = new%op(2 + s:1 + 2 * s, 1) + rhs(by_sigma, :s)
         new%op(2:1 + s, 3:4) = new%op(2:1 + s, 3:4) + transpose(rhs(by_residual:by_load, s + 1:2 * s))
         new%op(2 + s:1 + 2 * s, 3:4) = new%op(2 + s:1 + 2 * s, 3:4) + transpose(rhs(by_residual:by_load, :s))

         new%k(1, :) = -sense * ends(1:2)
         new%k(2, :) = sense * (dtail(by_p) * ends(1:2))
         new%k(2, 1) = new%k(2, 1) + sense * dtail(by_sigma)
         new%raw = sense * [-element%z(1), tail]
         new%f(1) = -sense * (element%z(1) + ends(3))
         new%f(2) = sense * (tail + dtail(by_p) * ends(3) + dtail(by_residual))
         new%fl(1) = sense * ends(4)
         new%fl(2) = -sense * (dtail(by_p) * ends(4) + dtail(by_load))
      end subroutine condense
   end subroutine conforming_evaluate

   !> Data for points inside an element, from the arguments of conforming_evaluate. The sum of loads does not contain the force of a
   !> foundation: on a foundation P is the polynomial through the stored values and, if the foundation's forces are given, the value
   !> at the second end.
   pure type(conforming_output_t) function new_output(tab, obstacle, element, stages, founded, inner) result(output)
      type(tableau_t), intent(in) :: tab
      type(obstacle_t), intent(in) :: obstacle
      type(conforming_data_t), intent(in) :: element
      integer, intent(in) :: stages            !! number of stages; 0 if only the first end is of interest, without a foundation
      logical, intent(in) :: founded           !! true: a foundation acts along the element
      type(inner_forces_t), intent(in), optional :: inner
      type(section_t) :: at
      type(tangential_force_t) :: hold
      real(wp) :: line(2), line_rate(2), rise(1, max_stages), system(max_stages, max_stages)
      logical :: singular
      integer :: i, q, s
      s = stages
      output%element = element
      output%near = track_between(obstacle, element%offset, element%first, element%last)
      associate (h => element%length, sense => element%sense, z => element%z)
         do i = 1, s
            call line_at_stage(element%load, i, line, line_rate)
            at = section_at(element, track_beyond(element, obstacle, output%near, z(1 + s + i)), element%bend(i), line, line_rate, &
               & z(1 + i))
            output%run(i) = h * (sense * at%stretch)
            output%pull(i) = h * at%pull
         end do
         if (.not. founded) return
         if (present(inner)) then
            output%miss = dot_product(tab%b(:s), output%pull(:s))
            do q = 1, inner%n
               hold = tangential_force_at(track_beyond(element, obstacle, output%near, dot_product(inner%at(q)%basis(:s), &
                  & output%run(:s))), sense, inner, q)
               output%miss = output%miss - h * inner%at(q)%weight * hold%force
            end do
         end if
         rise(1, :s) = z(2:1 + s) - z(1)
         system = transpose(tab%a)
         call solve_small(s, system, rise, singular)
         output%pull(:s) = rise(1, :s)
         if (present(inner)) output%miss = output%miss - dot_product(tab%b(:s), output%pull(:s))
      end associate
   end function new_output

   !> Track and force P at a place in an element.
   pure subroutine output_at(output, tab, obstacle, tau, here, p)
      type(conforming_output_t), intent(in) :: output
      type(tableau_t), intent(in) :: tab
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: tau              !! place in the element, 0 to 1 of its stress-free length
      type(track_t), intent(out) :: here
      real(wp), intent(out) :: p !! force P at the point
      real(wp) :: basis(max_stages)
      call stage_basis(tab, tau, basis)
      here = track_beyond(output%element, obstacle, output%near, dot_product(basis(:tab%stages), output%run(:tab%stages)))
      p = output%element%z(1) + dot_product(basis(:tab%stages), output%pull(:tab%stages))
      if (abs(output%miss) > 0.0_wp) p = p + output%miss * tau * product((tau - tab%c(:tab%stages)) / (1.0_wp - tab%c(:tab%stages)))
   end subroutine output_at

   !> Section forces inside an element. As in ge_element: n' = -q - p J r' - f, m' = -r' x n, N positive in tension, Q along the
   !> normal to the left of the rod. N and M follow from sigma and P at the point,
   !>   Q = -M'/(1 + e),   M' = EI (k' (1 + e)^2 + o k N'/EA - k0'),   N' = -o k M' - q_t,
   !> and the reaction of the obstacle from equilibrium along the normal, with Q' from the derivatives of these equations.
   pure subroutine conforming_resultants(output, tab, obstacle, tau, k0, ground, here, n, q, m, density, steady)
      type(conforming_output_t), intent(in) :: output
      type(tableau_t), intent(in) :: tab
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: tau              !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(in) :: k0(0:2) !! stress-free curvature at the point, and its first two derivatives with respect to the
      !! stress-free length; only `density` needs the second one
      real(wp), intent(in) :: ground(2, 0:1) !! force of foundations by stress-free length, and its derivative with respect to this
      !! length
      type(track_t), intent(out) :: here       !! the track at the point
      real(wp), intent(out) :: n, q, m         !! N, Q and M at the point
      real(wp), intent(out), optional :: density !! reaction of the obstacle by stress-free length, > 0 where it presses
      real(wp), intent(out), optional :: steady !! its part without the derivative of Q, which needs no second derivative of k0:
      !! density = steady - o Q'
      type(section_t) :: at
      real(wp) :: p, ei, d, along, across, n1, m1, m2, stretch1, k1, k2, q1, normal(2), line(2), line_slope(2)
      call output_at(output, tab, obstacle, tau, here, p)
      associate (element => output%element, sense => output%element%sense, compliance => output%element%compliance, &
         & load => output%element%load)
         call line_at(tab, load, tau, line, line_slope)
         line_slope = line_slope / element%length + ground(:, 1)
         line = line + ground(:, 0)
         at = section_at(element, here, k0(0), line, line_slope, p)
         ! The Newton iterate may have compressed the rod to a point.
         at%stretch = sign(max(abs(at%stretch), epsilon(q)), at%stretch)
         n = at%n
         m = at%m

         ! M' with N' substituted; k1 is (o k)'.
         ei = 1.0_wp / compliance%bending
         normal = [-here%tangent(2), here%tangent(1)]
         along = sense * dot_product(line, here%tangent)
         across = sense * dot_product(line, normal)
         d = 1.0_wp + ei * here%curvature**2 * compliance%axial
         k1 = here%curvature_rate * at%stretch
         m1 = ei * (k1 * at%stretch - sense * here%curvature * along * compliance%axial - k0(1)) / d
         n1 = -sense * here%curvature * m1 - along
         q = -m1 / at%stretch
         if (present(steady)) steady = -sense * (n * sense * here%curvature * at%stretch + across + load%pressure * at%stretch)
         if (.not. present(density)) return
         ! With (o k)' = k' (1 + e) and q_t' = o k (1 + e) q_n + q' . (o tangent):
         !   M'' = EI (o k'' (1 + e)^3 + 3 k' (1 + e) e' + o k N''/EA - k0''),   N'' = -k' (1 + e) M' - o k M'' - q_t'
         stretch1 = n1 * compliance%axial
         k2 = sense * here%curvature_second * at%stretch**2
         m2 = ei * (k2 * at%stretch + 3 * k1 * stretch1 - k0(2) - (compliance%axial * sense * here%curvature) * &
            & (k1 * m1 + sense * here%curvature * at%stretch * across + sense * dot_product(line_slope, here%tangent))) / d
         q1 = -m2 / at%stretch + m1 * stretch1 / at%stretch**2
         density = -sense * (q1 + n * sense * here%curvature * at%stretch + across + load%pressure * at%stretch)
      end associate
   end subroutine conforming_resultants

   !> The track at a distance from the first end of an element.
   pure type(track_t) function track_beyond(element, obstacle, near, way) result(here)
      type(conforming_data_t), intent(in) :: element
      type(obstacle_t), intent(in) :: obstacle
      type(track_t), intent(in) :: near        !! a point on the element's piece of the track
      real(wp), intent(in) :: way              !! sigma at the point minus sigma at the first end
      here = track_at(obstacle, element%offset, element%first%sigma + way, near)
   end function track_beyond

   !> Force of a foundation along the rod at a quadrature point, whose place on the track is `at`.
   pure type(tangential_force_t) function tangential_force_at(at, sense, inner, q) result(hold)
      type(track_t), intent(in) :: at
      real(wp), intent(in) :: sense
      type(inner_forces_t), intent(in) :: inner
      integer, intent(in) :: q
      real(wp) :: slope
      slope = dot_product(inner%at(q)%normal, at%tangent)
      hold%force = sense * dot_product(inner%at(q)%force, at%tangent)
      hold%by_place = sense * (at%curvature * dot_product(inner%at(q)%force, [-at%tangent(2), at%tangent(1)]) - &
         & inner%at(q)%spring * slope**2 - dot_product(at%tangent, matmul(inner%at(q)%sway, at%tangent)))
      hold%by_load = sense * (inner%at(q)%spring * inner%at(q)%approach * slope + dot_product(inner%at(q)%rate, at%tangent))
   end function tangential_force_at

   !> N, M and the right-hand sides of sigma' and P' with their derivatives, at the point `at` of the track for a given P.
   pure type(section_t) function section_at(element, at, bend, line, line_rate, p) result(section)
      type(conforming_data_t), intent(in) :: element
      type(track_t), intent(in) :: at
      real(wp), intent(in) :: bend             !! stress-free curvature
      real(wp), intent(in) :: line(2), line_rate(2) !! dead load at the point by stress-free length; its derivative by the load
      !! factor
      real(wp), intent(in) :: p
      real(wp) :: ei, d, k, unstretched, n_by_sigma, m_by_sigma, n_by_load, m_by_load, stretch_by_load
      associate (sense => element%sense, compliance => element%compliance, load => element%load)
         ei = 1.0_wp / compliance%bending
         k = sense * at%curvature
         d = 1.0_wp + ei * k**2 * compliance%axial
         unstretched = k * (1.0_wp + load%strain) - bend - load%curvature
         section%n = (p - k * ei * unstretched) / d
         section%stretch = 1.0_wp + load%strain + section%n * compliance%axial
         section%m = ei * (unstretched + k * section%n * compliance%axial)
         section%pull = at%curvature_rate * section%stretch * section%m - sense * dot_product(line, at%tangent)

         section%run_by_p = sense * compliance%axial / d
         n_by_sigma = -sense * at%curvature_rate * (section%m + ei * k * section%stretch) / d
         m_by_sigma = ei * (sense * at%curvature_rate * section%stretch + k * compliance%axial * n_by_sigma)
         section%run_by_sigma = sense * compliance%axial * n_by_sigma
         section%pull_by_sigma = at%curvature_second * section%stretch * section%m + &
            & at%curvature_rate * (compliance%axial * n_by_sigma * section%m + section%stretch * m_by_sigma) - &
            & k * dot_product(line, [-at%tangent(2), at%tangent(1)])
         n_by_load = -k * ei * (k * load%strain_rate - load%curvature_rate) / d
         stretch_by_load = compliance%axial * n_by_load + load%strain_rate
         m_by_load = ei * (k * stretch_by_load - load%curvature_rate)
         section%run_by_load = sense * stretch_by_load
         section%pull_by_load = at%curvature_rate * (stretch_by_load * section%m + section%stretch * m_by_load) - &
            & sense * dot_product(line_rate, at%tangent)
      end associate
   end function section_at
end module conforming_element
