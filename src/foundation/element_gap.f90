!> Gap between an obstacle and the rod between two nodes, and the positions at which the gap has a given value. It serves the
!> quadrature of foundation forces and the report of contact.
!>
!> The rod is the polynomial of degree s from rod_profile, so that its gap has at most about 2 s bends. The gap is sampled at 2 s +
!> 3 positions; second differences bound its deviation between two samples.
module element_gap
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use element_families, only: collocates
   use candidates, only: candidates_t
   use rod_state, only: state_t, pose_of, candidate_offset, element_displacement
   use rod_profile, only: profile_t, mended_by, profile_point
   use obstacle_geometry, only: moved_gap
   use obstacle_pose, only: pose_t
   use gauss_tableau, only: max_stages
   use force_law, only: segment_open, segment_unknown
   implicit none
   private
   public :: element_gap_t, gap_root_t, new_element_gap, ground_gap, gap_and_gradient, gap_value, gap_parts, gap_crossings, &
      & gap_extreme, root_factor, is_at, most_samples, most_crossings, most_parts

   integer, parameter :: most_samples = 2 * max_stages + 2
   integer, parameter :: most_crossings = 2 * most_samples !! largest number of positions at which the gap has a given value: none,
   !! one or two between two samples
   integer, parameter :: most_parts = most_crossings / 2 + 1 !! largest number of parts of an element that are in contact

   !> Gap of one element to one obstacle.
   type :: element_gap_t
      private
      type(profile_t), public :: profile
      integer :: obstacle = 0
      logical :: bilateral = .false.            !! true: the gap is measured from the gap of the stress-free axis
      type(pose_t) :: pose                      !! present position of the obstacle
      real(wp) :: home_offset = 0.0_wp          !! GAP of the contact, added to the gap of the stress-free axis
      real(wp) :: offset = 0.0_wp               !! change of this gap since the start, see candidate_offset
      real(wp) :: touching = 0.0_wp             !! gap below which the rod is in contact
      integer :: segment = segment_unknown !! segment of a foundation's law, if the state prescribes it: contact then exists along
      !! the whole element, or nowhere
      integer, public :: samples = 0            !! number of equal intervals between samples
      logical :: sampled = .false.
      real(wp) :: sample(0:most_samples) = 0.0_wp
   end type element_gap_t

   !> A known root of the gap. In a search for extreme values the gap is divided by it (see ground_events).
   type :: gap_root_t
      real(wp) :: at = 0.0_wp !! position of the root, in the unit of the caller (part of an element, or arc length along the rod)
      real(wp) :: scale = 1.0_wp                !! unit of distances from the root, > 0
      integer :: order = 1
      real(wp) :: limit = 0.0_wp                !! limit at the root of gap / (distance/scale)^order
   end type gap_root_t

   !> Distance from a root, over the root's scale, below which the limit is used instead of the quotient. At this distance and for
   !> order 1, the rounding error of the gap over the distance equals the second-order difference from the limit.
   real(wp), parameter :: at_root = epsilon(1.0_wp)**(1.0_wp / 3.0_wp)

contains

   !> Gap function on the element after a candidate of contact or of a foundation.
   pure function new_element_gap(problem, state, list, candidate, profile) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: candidate          !! candidate that has an element after it
      type(profile_t), intent(in) :: profile    !! profile of this element in the state
      type(element_gap_t) :: gap
      gap%profile = profile
      associate (e => list%element(2, candidate))
         gap%samples = 4
         if (collocates(problem%model%mesh%family(e))) gap%samples = 2 * problem%model%mesh%stages(e) + 2
         gap%touching = touching_gap(problem, state, e)
      end associate
      gap%obstacle = list%obstacle(candidate)
      gap%bilateral = list%bilateral(candidate)
      gap%pose = pose_of(problem, state, gap%obstacle)
      gap%home_offset = list%gap_offset(candidate)
      gap%offset = candidate_offset(problem, state, list, candidate) - gap%home_offset
   end function new_element_gap

   !> Gap function on the element after a candidate of the foundations' chain, with the state's segment of the law.
   pure function ground_gap(problem, state, candidate, profile) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate          !! candidate that has an element after it
      type(profile_t), intent(in) :: profile    !! profile of this element in the state
      type(element_gap_t) :: gap
      gap = new_element_gap(problem, state, problem%ground%chain, candidate, profile)
      gap%segment = state%segment(candidate)
   end function ground_gap

   !> At a position in the element: position of the rod, gap, gradient of the gap, and curvature of the gap along the obstacle.
   pure subroutine gap_and_gradient(problem, gap, tau, x, value, normal, bend)
      type(problem_t), intent(in) :: problem
      type(element_gap_t), intent(in) :: gap
      real(wp), intent(in) :: tau               !! position in the element, 0 to 1
      real(wp), intent(out) :: x(2), value, normal(2), bend !! position of the rod, gap, gradient, curvature
      real(wp) :: at_home, home(2), displacement(3)
      call profile_point(problem, gap%profile, tau, home, displacement)
      if (gap%profile%mended) displacement(1:2) = displacement(1:2) + mended_by(gap%profile, tau)
      x = home + displacement(1:2)
      call moved_gap(problem%model%obstacle(gap%obstacle), home, gap%pose%own_motion(home, displacement(1:2)), at_home, value, &
         & normal, bend)
      normal = gap%pose%direction(normal)
      at_home = at_home + gap%home_offset
      ! The initial gap is taken as exactly zero for a rod on its obstacle and for a bilateral contact, which have no force at the
      ! start.
      if (gap%bilateral .or. abs(at_home) <= rounding_gap(problem)) at_home = 0.0_wp
      value = value + at_home + gap%offset
   end subroutine gap_and_gradient

   !> Gap at a position in the element.
   pure real(wp) function gap_value(problem, gap, tau) result(value)
      type(problem_t), intent(in) :: problem
      type(element_gap_t), intent(in) :: gap
      real(wp), intent(in) :: tau !! position in the element, 0 to 1
      real(wp) :: x(2), normal(2), bend
      call gap_and_gradient(problem, gap, tau, x, value, normal, bend)
   end function gap_value

   !> Finds the parts of the element in contact, in ascending order; under a bilateral obstacle the whole element.
   subroutine gap_parts(problem, gap, n, part)
      type(problem_t), intent(in) :: problem
      type(element_gap_t), intent(inout) :: gap !! out: contains the samples
      integer, intent(out) :: n                 !! number of parts
      real(wp), intent(out) :: part(:, :)       !! (2, most_parts) beginning and end of each part, 0 to 1
      real(wp) :: coarse(3), cut(0:most_crossings + 1)
      integer :: j, crossings
      n = 1
      part(:, 1) = [0.0_wp, 1.0_wp]
      if (gap%segment == segment_open) n = 0
      if (gap%bilateral .or. gap%segment /= segment_unknown) return
      ! First the usual case: the element is in contact as a whole or not at all, and its gap varies little compared with its
      ! magnitude.
      do j = 1, 3
         coarse(j) = gap_value(problem, gap, 0.5_wp * (j - 1)) - gap%touching
      end do
      if (minval(abs(coarse)) > 4.0_wp * abs(coarse(1) - 2.0_wp * coarse(2) + coarse(3))) then
         if (all(coarse < 0.0_wp)) return
         n = 0
         if (all(coarse > 0.0_wp)) return
      end if
      n = 0
      call gap_crossings(problem, gap, gap%touching, crossings, cut(1:most_crossings))
      cut(0) = 0.0_wp
      cut(crossings + 1) = 1.0_wp
      do j = 0, crossings
         if (gap_value(problem, gap, 0.5_wp * (cut(j) + cut(j + 1))) >= gap%touching) cycle
         if (n > 0) then
            if (part(2, n) >= cut(j)) then
               part(2, n) = cut(j + 1)
               cycle
            end if
         end if
         n = n + 1
         part(:, n) = cut(j:j + 1)
      end do
   end subroutine gap_parts

   !> Finds the positions at which the gap has a given value, in ascending order.
   subroutine gap_crossings(problem, gap, level, n, place)
      type(problem_t), intent(in) :: problem
      type(element_gap_t), intent(inout) :: gap !! out: contains the samples
      real(wp), intent(in) :: level             !! the given value of the gap
      integer, intent(out) :: n                 !! number of positions
      real(wp), intent(out) :: place(:)         !! (most_crossings) positions, 0 to 1
      real(wp) :: a, b, fa, fb, vertex, fv, waviness
      integer :: j
      call take_samples(problem, gap)
      ! Bound of the deviation of the gap from linear interpolation between samples.
      waviness = maxval(abs(gap%sample(:gap%samples - 2) - 2.0_wp * gap%sample(1:gap%samples - 1) + gap%sample(2:gap%samples)))
      n = 0
      do j = 1, gap%samples
         a = real(j - 1, wp) / gap%samples
         b = real(j, wp) / gap%samples
         fa = gap%sample(j - 1) - level
         fb = gap%sample(j) - level
         if ((fa < 0.0_wp) .neqv. (fb < 0.0_wp)) then
            call add_root(a, b, fa, fb)
         else if (min(abs(fa), abs(fb)) <= waviness) then
            ! The gap may reach the value between two samples without a change of sign at the samples.
            call find_extreme(vertex, fv)
            if ((fv < 0.0_wp) .eqv. (fa < 0.0_wp)) cycle
            call add_root(a, vertex, fa, fv)
            call add_root(vertex, b, fv, fb)
         end if
      end do

   contains

      !> Finds a position between a and b at which gap - level has the opposite sign, if there is one: the vertex of a parabola,
      !> improved by a second parabola through closer points.
      subroutine find_extreme(top, f_top)
         real(wp), intent(out) :: top, f_top
         real(wp) :: half, f(2), curvature
         integer :: round
         top = 0.5_wp * (a + b)
         half = 0.5_wp * (b - a)
         f = [fa, fb]
         do round = 1, 3
            f_top = gap_value(problem, gap, top) - level
            if ((f_top < 0.0_wp) .neqv. (fa < 0.0_wp)) return
            if (round == 2) then
               half = min(0.125_wp * half, top - a, b - top)
               f = [gap_value(problem, gap, top - half), gap_value(problem, gap, top + half)] - level
            end if
            curvature = f(1) - 2.0_wp * f_top + f(2)
            if (round == 3 .or. 2.0_wp * abs(curvature) <= abs(f(1) - f(2))) return
            top = top + 0.5_wp * half * (f(1) - f(2)) / curvature
         end do
      end subroutine find_extreme

      !> Adds the root between two positions at which the function has different signs: regula falsi, Illinois variant.
      subroutine add_root(first, second, value_first, value_second)
         real(wp), intent(in) :: first, second, value_first, value_second
         real(wp) :: low, high, f_low, f_high, x, fx
         integer :: iteration
         low = first; high = second; f_low = value_first; f_high = value_second
         do iteration = 1, 100
            x = min(max(high - f_high * (high - low) / (f_high - f_low), first), second)
            fx = gap_value(problem, gap, x) - level
            if ((fx < 0.0_wp) .neqv. (f_high < 0.0_wp)) then
               low = high
               f_low = f_high
            else
               f_low = 0.5_wp * f_low
            end if
            high = x
            f_high = fx
            if (abs(high - low) <= 1.0e-13_wp .or. .not. abs(fx) > 0.0_wp) exit
            if (.not. abs(f_high - f_low) > 0.0_wp) exit
         end do
         n = n + 1
         place(n) = x
      end subroutine add_root
   end subroutine gap_crossings

   !> Finds the largest or smallest gap in an interval that includes its ends: the best sample, improved by parabolas.
   pure subroutine gap_extreme(problem, gap, largest, from, to, value, tau, root)
      type(problem_t), intent(in) :: problem
      type(element_gap_t), intent(in) :: gap
      logical, intent(in) :: largest            !! true: the largest gap; false: the smallest gap
      real(wp), intent(in) :: from, to          !! ends of the interval, 0 <= from <= to <= 1
      real(wp), intent(out) :: value, tau       !! the gap found, and its position, 0 to 1
      type(gap_root_t), intent(in), optional :: root(:) !! known roots by which the gap is divided; `at` and `scale` are parts of
      !! the element
      integer, parameter :: rounds = 40
      real(wp), parameter :: finest = 1.0e-4_wp !! smallest step over the length of the interval; second differences over it keep
      !! half of the digits
      real(wp) :: step, f(3), curvature, place, there, middle, last, sense
      integer :: i
      sense = merge(-1.0_wp, 1.0_wp, largest)
      value = huge(1.0_wp)
      tau = from
      do i = 0, gap%samples
         place = from + (to - from) * i / gap%samples
         there = at(place)
         if (there >= value) cycle
         tau = place
         value = there
      end do
      step = 0.5_wp * (to - from) / gap%samples
      place = tau
      do i = 1, rounds
         last = place
         middle = min(max(place, from + step), to - step)
         f = [at(middle - step), at(middle), at(middle + step)]
         curvature = f(1) - 2.0_wp * f(2) + f(3)
         if (2.0_wp * curvature > abs(f(1) - f(3))) then
            place = middle + 0.5_wp * step * (f(1) - f(3)) / curvature
         else
            place = middle + sign(step, f(1) - f(3))
         end if
         if (step <= finest * (to - from) .and. abs(place - last) <= finest * step) exit
         step = max(0.5_wp * step, finest * (to - from))
      end do
      there = at(place)
      if (there < value) tau = place
      value = sense * min(there, value)

   contains

      pure real(wp) function at(t)
         real(wp), intent(in) :: t
         at = gap_value(problem, gap, t)
         if (present(root)) at = without_roots(at, t, root)
         at = sense * at
      end function at
   end subroutine gap_extreme

   !> Gap divided by the powers of the distances from the known roots; at a root itself the limit of the quotient.
   pure real(wp) function without_roots(gap, at, root) result(value)
      real(wp), intent(in) :: gap
      real(wp), intent(in) :: at                !! position, in the unit of the roots
      type(gap_root_t), intent(in) :: root(:)
      integer :: k
      value = gap
      do k = 1, size(root)
         if (is_at(root(k), at)) value = root(k)%limit
      end do
      value = value * root_factor(at, root)
   end function without_roots

   !> Factor by which the division by the roots changes a gap. A root at the position itself contributes no factor.
   pure real(wp) function root_factor(at, root) result(factor)
      real(wp), intent(in) :: at
      type(gap_root_t), intent(in) :: root(:)
      integer :: k
      factor = 1.0_wp
      do k = 1, size(root)
         if (.not. is_at(root(k), at)) factor = factor * (root(k)%scale / abs(at - root(k)%at))**root(k)%order
      end do
   end function root_factor

   !> True if a position coincides with a root up to rounding.
   elemental logical function is_at(root, at)
      type(gap_root_t), intent(in) :: root
      real(wp), intent(in) :: at
      is_at = abs(at - root%at) <= at_root * root%scale
   end function is_at

   !> Samples the gap at equal distances.
   subroutine take_samples(problem, gap)
      type(problem_t), intent(in) :: problem
      type(element_gap_t), intent(inout) :: gap
      integer :: k
      if (gap%sampled) return
      do k = 0, gap%samples
         gap%sample(k) = gap_value(problem, gap, real(k, wp) / gap%samples)
      end do
      gap%sampled = .true.
   end subroutine take_samples

   !> Gap below which the rod counts as in contact: zero. For an element that has not moved yet it is the rounding of positions,
   !> because a structure may begin with its whole length on the surface.
   pure real(wp) function touching_gap(problem, state, e)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      touching_gap = 0.0_wp
      if (all(abs(element_displacement(problem, state, e)) <= 0.0_wp)) touching_gap = rounding_gap(problem)
   end function touching_gap
end module element_gap
