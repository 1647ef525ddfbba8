!> What foundations do to one element: a quadrature of their forces over the part of it that is in contact.
!>
!> The gap is that of the collocation polynomial between the nodes (plus the deviation of the stress-free axis from it). Where
!> it changes its sign the contact ends; Gauss points fill the part in contact, so that they move with its ends. As the
!> force vanishes there, it is a smooth function of the displacements: Newton finds contact and equilibrium together, no
!> reaction hops from point to point, and nothing oscillates. A multi-linear law is cut at its corners likewise.
module element_foundation
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, element_displacement, element_load, obstacle_shift, candidate_offset, closing_rate
   use obstacle_geometry, only: moved_gap
   use ground, only: home_deviation
   use force_law, only: law_reaction
   use gauss_tableau, only: max_stages, stage_basis
   use ge_element, only: ge_direction_changes, ge_load_t
   use inner_forces, only: inner_forces_t, clear_forces, add_force
   implicit none
   private
   public :: foundation_forces, touching_gap

   integer, parameter :: max_cuts = 64

contains

   !> Quadrature of the forces of all foundations on an element; none where it does not touch.
   subroutine foundation_forces(problem, state, e, list)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(inout) :: list
      real(wp) :: change(2, max_stages), home(2, max_stages), u(6), home_start(2), shift(2), touching, rounding
      real(wp) :: cut(max_cuts), value(0:2 * max_stages + 2), bending, turning
      type(ge_load_t) :: load
      integer :: i, c, s, obstacle, n_cuts, samples, k
      logical :: bilateral

      call clear_forces(list)
      if (.not. problem%ground%founded(e)) return
      s = problem%model%mesh%stages(e)
      u = element_displacement(problem, state, e)
      load = element_load(problem, state, e)
      associate (element => state%geometry%element(e), tab => problem%tableau(s))
         call ge_direction_changes(tab, element%length, element%angle, problem%compliance(e), load, u, &
            & state%z(:problem%z_size(e), e), change(:, :s))
         change(:, :s) = (element%length * element%scale) * change(:, :s)
         do k = 1, s
            home(:, k) = (element%length * element%scale) * [cos(element%angle(k)), sin(element%angle(k))]
         end do
         bending = element%length * problem%compliance(e)%bending
         turning = element%length * load%curvature
      end associate
      home_start = state%geometry%x(:, problem%model%mesh%node(1, e))
      rounding = rounding_gap(problem)
      samples = 2 * s + 2
      do i = problem%ground%first(e), problem%ground%first(e + 1) - 1
         c = problem%ground%candidate(i)
         obstacle = problem%ground%chain%obstacle(c)
         bilateral = problem%ground%chain%bilateral(c)
         shift = obstacle_shift(problem, state, obstacle)
         touching = touching_gap(problem, state, e)
         if (.not. bilateral .and. problem%model%obstacle(obstacle)%law == 0) then
            if (is_plain()) cycle
         end if
         do k = 0, samples
            value(k) = gap_at(real(k, wp) / samples)
         end do
         cut(1:2) = [0.0_wp, 1.0_wp]
         n_cuts = 2
         if (.not. bilateral) then
            if (all(value(:samples) > touching + waviness())) cycle
            call add_cuts(-touching)
         end if
         call add_law_cuts()
         call fill_between_cuts()
      end do

   contains

      !> Deals with an element that clearly touches with all of its length or not at all: the gap bends little between both
      !> ends compared to its size.
      logical function is_plain()
         real(wp) :: coarse(3), bending_of_gap
         integer :: j
         do j = 1, 3
            coarse(j) = gap_at(0.5_wp * (j - 1)) - touching
         end do
         bending_of_gap = 4.0_wp * abs(coarse(1) - 2.0_wp * coarse(2) + coarse(3))
         is_plain = minval(abs(coarse)) > bending_of_gap .and. (all(coarse > 0.0_wp) .or. all(coarse < 0.0_wp))
         if (.not. is_plain .or. coarse(1) > 0.0_wp) return
         cut(1:2) = [0.0_wp, 1.0_wp]
         n_cuts = 2
         call fill_between_cuts()
      end function is_plain

      !> Place on the stress-free axis, and how far the deformed one has moved from it.
      subroutine locate(tau, basis, at_home, motion)
         real(wp), intent(in) :: tau
         real(wp), intent(out) :: basis(max_stages), at_home(2), motion(2)
         real(wp) :: d(2), turn
         call stage_basis(problem%tableau(s), tau, basis)
         at_home = home_start + matmul(home(:, :s), basis(:s))
         motion = u(1:2) + matmul(change(:, :s), basis(:s))
         if (.not. problem%ground%curved(e)) return
         d = home_deviation(problem%ground, e, tau)
         at_home = at_home + d
         turn = u(3) + bending * dot_product(basis(:s), state%z(4:3 + s, e)) + tau * turning
         motion = motion + load%strain * [cos(turn) * d(1) - sin(turn) * d(2), sin(turn) * d(1) + cos(turn) * d(2)] + &
            & (2.0_wp * sin(0.5_wp * turn)) * [-sin(0.5_wp * turn) * d(1) - cos(0.5_wp * turn) * d(2), &
            & cos(0.5_wp * turn) * d(1) - sin(0.5_wp * turn) * d(2)]
      end subroutine locate

      !> Gap to the obstacle, for bilateral ones more than that of the stress-free axis.
      real(wp) function gap_at(tau) result(gap)
         real(wp), intent(in) :: tau
         real(wp) :: basis(max_stages), x(2), normal(2), bend
         call look(tau, basis, x, gap, normal, bend)
      end function gap_at

      subroutine look(tau, basis, x, gap, normal, bend)
         real(wp), intent(in) :: tau
         real(wp), intent(out) :: basis(max_stages), x(2), gap, normal(2), bend
         real(wp) :: at_home, home_place(2), motion(2)
         call locate(tau, basis, home_place, motion)
         call moved_gap(problem%model%obstacle(obstacle), home_place, motion - shift, at_home, gap, normal, bend)
         x = home_place + motion
         associate (offset => problem%ground%chain%gap_offset(c))
            ! Bilateral ones begin without force, whatever lies on its foundation begins with no gap.
            at_home = at_home + offset
            if (bilateral .or. abs(at_home) <= rounding) at_home = 0.0_wp
            gap = gap + at_home + (candidate_offset(problem, state, problem%ground%chain, c) - offset)
         end associate
      end subroutine look

      !> How far the gap may leave its samples between them.
      real(wp) function waviness()
         integer :: j
         waviness = 0.0_wp
         do j = 1, samples - 1
            waviness = max(waviness, abs(value(j - 1) - 2.0_wp * value(j) + value(j + 1)))
         end do
      end function waviness

      !> Corners of a multi-linear law.
      subroutine add_law_cuts()
         integer :: j
         associate (law => problem%model%obstacle(obstacle)%law)
            if (law == 0) return
            associate (corner => problem%model%law(law)%penetration)
               do j = 2, size(corner) - 1
                  call add_cuts(corner(j))
                  if (bilateral) call add_cuts(-corner(j))
               end do
            end associate
         end associate
      end subroutine add_law_cuts

      !> Places where gap + level changes its sign.
      subroutine add_cuts(level)
         real(wp), intent(in) :: level
         real(wp) :: a, b, fa, fb, vertex, fv, close
         integer :: j
         close = waviness()
         do j = 1, samples
            a = real(j - 1, wp) / samples
            b = real(j, wp) / samples
            fa = value(j - 1) + level
            fb = value(j) + level
            if ((fa < 0.0_wp) .neqv. (fb < 0.0_wp)) then
               call add_root(a, b, fa, fb, level)
            else if (min(abs(fa), abs(fb)) <= close) then
               ! It may dip through between two samples.
               call find_extreme(a, b, fa, fb, level, vertex, fv)
               if ((fv < 0.0_wp) .eqv. (fa < 0.0_wp)) cycle
               call add_root(a, vertex, fa, fv, level)
               call add_root(vertex, b, fv, fb, level)
            end if
         end do
      end subroutine add_cuts

      !> A place between two others where gap + level has the other sign, if there is one: vertices of parabolas, the second
      !> one through places close to the first.
      subroutine find_extreme(a, b, fa, fb, level, vertex, fv)
         real(wp), intent(in) :: a, b, fa, fb, level
         real(wp), intent(out) :: vertex, fv
         real(wp) :: half, f(2), curvature
         integer :: round
         vertex = 0.5_wp * (a + b)
         half = 0.5_wp * (b - a)
         f = [fa, fb]
         do round = 1, 3
            fv = gap_at(vertex) + level
            if ((fv < 0.0_wp) .neqv. (fa < 0.0_wp)) return
            if (round == 2) then
               half = min(0.125_wp * half, vertex - a, b - vertex)
               f = [gap_at(vertex - half), gap_at(vertex + half)] + level
            end if
            curvature = f(1) - 2.0_wp * fv + f(2)
            if (round == 3 .or. 2.0_wp * abs(curvature) <= abs(f(1) - f(2))) return
            vertex = vertex + 0.5_wp * half * (f(1) - f(2)) / curvature
         end do
      end subroutine find_extreme

      !> One root between two places of different sign: regula falsi, Illinois variant.
      subroutine add_root(first, second, value_first, value_second, level)
         real(wp), intent(in) :: first, second, value_first, value_second, level
         real(wp) :: a, b, fa, fb, x, fx
         integer :: iteration, j
         a = first; b = second; fa = value_first; fb = value_second
         do iteration = 1, 100
            x = min(max(b - fb * (b - a) / (fb - fa), first), second)
            fx = gap_at(x) + level
            if ((fx < 0.0_wp) .neqv. (fb < 0.0_wp)) then
               a = b
               fa = fb
            else
               fa = 0.5_wp * fa
            end if
            b = x
            fb = fx
            if (abs(b - a) <= 1.0e-13_wp .or. .not. abs(fx) > 0.0_wp) exit
            if (.not. abs(fb - fa) > 0.0_wp) exit
         end do
         if (n_cuts == max_cuts) return
         j = n_cuts
         do while (cut(j) > x)
            cut(j + 1) = cut(j)
            j = j - 1
         end do
         cut(j + 1) = x
         n_cuts = n_cuts + 1
      end subroutine add_root

      !> Gauss points between neighbouring cuts where the foundation acts.
      subroutine fill_between_cuts()
         real(wp) :: length, gap
         integer :: j, q
         do j = 1, n_cuts - 1
            length = cut(j + 1) - cut(j)
            if (length <= 1.0e-12_wp) cycle
            if (.not. bilateral) then
               gap = gap_at(cut(j) + 0.5_wp * length)
               if (gap >= touching) cycle
            end if
            do q = 1, s + 1
               call add_point(cut(j) + problem%ground%rule_place(q, s) * length, problem%ground%rule_weight(q, s) * length)
            end do
         end do
      end subroutine fill_between_cuts

      subroutine add_point(tau, weight)
         real(wp), intent(in) :: tau, weight
         real(wp) :: gap, normal(2), bend, push, spring, t(2), x(2), basis(max_stages)
         integer :: q
         call look(tau, basis, x, gap, normal, bend)
         associate (ground => problem%model%obstacle(obstacle))
            if (ground%law == 0) then
               spring = ground%modulus
               push = -spring * gap
            else
               call law_reaction(problem%model%law(ground%law), -gap, push, spring)
               push = ground%width * push
               spring = ground%width * spring
            end if
         end associate
         t = [normal(2), -normal(1)]
         call add_force(list, q)
         list%tau(q) = tau
         list%weight(q) = weight
         list%basis(:, q) = basis
         list%force(:, q) = push * normal
         list%stiffness(:, 1, q) = spring * normal * normal(1) - (push * bend) * t * t(1)
         list%stiffness(:, 2, q) = spring * normal * normal(2) - (push * bend) * t * t(2)
         list%rate(:, q) = matmul(list%stiffness(:, :, q), problem%model%step(problem%step)%load%motion(:, obstacle)) + &
            & (spring * closing_rate(problem, problem%ground%chain, c)) * normal
         list%source(q) = c
         list%normal(:, q) = normal
         list%pressure(q) = push
         list%bend(q) = bend
         list%x(:, q) = x
      end subroutine add_point
   end subroutine foundation_forces

   !> Gaps below it are contact: zero, or the rounding of positions where an element has not moved yet. A structure may
   !> begin with all of it on the surface.
   pure real(wp) function touching_gap(problem, state, e)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      touching_gap = 0.0_wp
      if (all(abs(element_displacement(problem, state, e)) <= 0.0_wp)) touching_gap = rounding_gap(problem)
   end function touching_gap

end module element_foundation
