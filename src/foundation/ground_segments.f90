!> Segments of foundation laws, assigned to elements. A segment belongs to the whole span between two interface points; it does not
!> depend on the sign of the gap at a single point.
!>
!> During Newton iterations a span in contact transmits pressure and tension, a free span no force; the interface points are the
!> ends of the spans. At the solution the gaps must agree with the assigned segments. An element whose gap does not agree determines
!> its contact from the gap (segment_unknown), as do all elements of meshes without interface points. These equations are correct as
!> well, but of lower order.
module ground_segments
   use kinds, only: wp
   use cross_section, only: section_t
   use obstacle_types, only: obstacle_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use force_law, only: law_segment, segment_slope, carries, segment_open, segment_unknown
   use element_gap, only: element_gap_t, ground_gap, gap_and_gradient, gap_value, gap_extreme, gap_crossings, gap_parts, &
      & most_crossings
   use rod_profile, only: profile_t, keep_profile, mend_ends, profile_error, profile_angle
   use ge_in_state, only: ge_here_t
   use element_families, only: collocates
   use state_transfer, only: find_point
   use gauss_tableau, only: max_stages
   implicit none
   private
   public :: has_kinks, follows, assign_segments, assign_found_segments, segments_hold, element_cuts, crosses_at, segment_at
   public :: segment_stiffness, any_cut, gap_uncertainty, followed_part, stiffest, decay_length, gap_in_state, pressed_parts
   public :: mean_gap_and_waves, gap_rounding

   real(wp), parameter :: noise = 1.0e3_wp * epsilon(1.0_wp) !! rounding error of gaps plus residual of Newton's method, over the
   !! size of the displacements
   real(wp), parameter :: at_mark = 0.1_wp !! distance from an interface point, as part of an element, up to which a crossing is the
   !! position to which Newton's method moves this point
   real(wp), parameter :: at_node = 1.0e-6_wp !! distance from a node, as part of an element, up to which a crossing does not count
   !! as inside the element

   !> Largest (h/l)^4 for which collocation with 1, 2, ... stages represents the displacement of a rod on a foundation (h: length of
   !> the element, l: decay_length). Transverse to the rod the displacement decreases as exp(-z) with z = h/l in the directions of
   !> 45 degrees to the real axis; along the rod with real z. The stability function of the method, the diagonal Pade approximant of
   !> the exponential, decreases with z only up to the fourth root of these values. Beyond it a stiffer foundation would give longer
   !> waves.
   real(wp), parameter :: stiffest(max_stages) = [16.0_wp, 144.0_wp, 667.4_wp, 2059.0_wp, 4434.6_wp, 7682.8_wp]

contains

   !> Length over which displacements of a rod decay on a foundation: (EI/k)^(1/4) transverse to the rod, (EA/k)^(1/2) along it.
   pure real(wp) function decay_length(section, obstacle, stiffness) result(length)
      type(section_t), intent(in) :: section
      type(obstacle_t), intent(in) :: obstacle
      real(wp), intent(in) :: stiffness      !! stiffness k of the foundation, > 0 [force/length^2]
      if (.not. obstacle%along_rod) then
         length = (section%ei / stiffness)**0.25_wp
      else if (section%inextensible) then
         length = huge(length)
      else
         length = sqrt(section%ea / stiffness)
      end if
   end function decay_length

   !> Length of the longest element that represents the displacement of a rod on the foundation after a candidate of the
   !> foundations' chain.
   pure real(wp) function followed_length(problem, candidate, stiffness) result(length)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: stiffness      !! stiffness of the foundation, > 0 [force/length^2]
      associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, candidate))
         length = min(stiffest(mesh%stages(e))**0.25_wp * decay_length(problem%model%section(mesh%section(e)), &
            & problem%model%obstacle(problem%ground%chain%obstacle(candidate)), stiffness), huge(length))
      end associate
   end function followed_length

   !> Largest part of the foundations' stiffness for which all elements are short enough to represent the displacement. Foundations
   !> without corners or ends of contact do not count.
   pure real(wp) function followed_part(problem) result(part)
      type(problem_t), intent(in) :: problem
      integer :: c
      part = huge(part)
      do c = 1, problem%ground%chain%n
         if (.not. has_kinks(problem, c)) cycle
         associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, c), o => problem%ground%chain%obstacle(c))
            part = min(part, (followed_length(problem, c, problem%ground%slope(o)) / (mesh%s(2, e) - mesh%s(1, e)))**merge(2, 4, &
               & problem%model%obstacle(o)%along_rod))
         end associate
      end do
   end function followed_part

   !> True if an element is short enough to represent the deflection on its foundation, or is not in contact. False for an element
   !> that is too long and in contact, or whose segment of the law is unknown: its gap between the nodes is meaningless. The result
   !> is a property of the mesh when it was made; it does not change when nodes move with interface points.
   pure logical function follows(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: stiffness
      follows = .true.
      associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, candidate))
         stiffness = segment_stiffness(problem, candidate, state%segment(candidate))
         if (state%segment(candidate) == segment_unknown) stiffness = problem%ground%slope(problem%ground%chain%obstacle(candidate))
         if (stiffness > 0.0_wp) follows = mesh%s(2, e) - mesh%s(1, e) <= followed_length(problem, candidate, stiffness)
      end associate
   end function follows

   !> Gap function on the element after a candidate. If the element is short enough for its foundation, the gap has the accuracy of
   !> the nodes by the Hermite correction, and is much more accurate than the polynomial in the quadrature of the foundation's
   !> forces. (Rods with shear flexibility have no correction, because it would require the foundation's forces at the nodes.)
   pure function gap_in_state(problem, state, candidate) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(element_gap_t) :: gap
      type(profile_t) :: profile
      type(ge_here_t) :: here
      associate (e => problem%ground%chain%element(2, candidate))
         call keep_profile(problem, state, e, profile, here)
         if (collocates(problem%model%mesh%family(e)) .and. .not. problem%compliance(e)%shear > 0.0_wp .and. &
            & problem%conforms(e) == 0) then
            if (follows(problem, state, candidate)) call mend_ends(problem, state, profile, 3, here)
         end if
      end associate
      gap = ground_gap(problem, state, candidate, profile)
   end function gap_in_state

   !> Finds the parts of the element after a candidate that are in contact, in ascending order. The gap decides only where the state
   !> prescribes no segment of the law.
   subroutine pressed_parts(problem, state, candidate, n, part)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(out) :: n                 !! number of parts
      real(wp), intent(out) :: part(:, :)       !! (2, most_parts) beginning and end of each part, 0 to 1
      type(element_gap_t) :: gap
      n = merge(0, 1, state%segment(candidate) == segment_open)
      part(:, 1) = [0.0_wp, 1.0_wp]
      if (problem%ground%chain%bilateral(candidate) .or. state%segment(candidate) /= segment_unknown) return
      gap = gap_in_state(problem, state, candidate)
      call gap_parts(problem, gap, n, part)
   end subroutine pressed_parts

   !> For an element too long for its foundation: the mean gap, and the amplitudes of the waves that decay into the element from its
   !> nodes, (A cos b s + B sin b s) / exp(b s) at the distance s from a node, with 4 b^4 = k/EI, the foundation's stiffness k, and
   !> A and B from gap and slope at the node. Amplitudes are computed only at nodes whose other element is short enough.
   subroutine mean_gap_and_waves(problem, state, candidate, mean, waves)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(out) :: mean, waves(2)   !! mean gap; amplitudes at the first and second node, >= 0
      type(element_gap_t) :: gap
      real(wp) :: x(2), value, normal(2), bend, theta, rate, slope
      integer :: i, beside
      gap = gap_in_state(problem, state, candidate)
      mean = mean_gap(problem, candidate, gap)
      waves = 0.0_wp
      associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, candidate))
         rate = (problem%ground%slope(problem%ground%chain%obstacle(candidate)) / &
            & (4.0_wp * problem%model%section(mesh%section(e))%ei))**0.25_wp
         do i = 1, 2
            ! Candidate at the first node of the neighbouring element.
            beside = problem%ground%chain%neighbour(i, candidate)
            if (i == 2 .and. beside > 0) then
               if (problem%ground%chain%element(2, beside) == 0) beside = 0
            end if
            if (beside == 0) cycle
            if (.not. follows(problem, state, beside)) cycle
            call gap_and_gradient(problem, gap, real(i - 1, wp), x, value, normal, bend)
            theta = profile_angle(problem, state, gap%profile, real(i - 1, wp))
            slope = dot_product(normal, [cos(theta), sin(theta)]) * merge(1.0_wp, -1.0_wp, i == 1)
            waves(i) = norm2([value - mean, value - mean + slope / rate])
         end do
      end associate
   end subroutine mean_gap_and_waves

   !> First and last position, in an element too long for its foundation, at which its gap has a meaning: the nodes if the
   !> foundation acts along the rod; else the first and the last stage, because the deflection at a node may be that of a wave.
   pure function meaningful_ends(problem, candidate) result(ends)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp) :: ends(2)
      ends = [0.0_wp, 1.0_wp]
      if (problem%model%obstacle(problem%ground%chain%obstacle(candidate))%along_rod) return
      associate (tableau => problem%tableau(problem%model%mesh%stages(problem%ground%chain%element(2, candidate))))
         ends = tableau%c([1, tableau%stages])
      end associate
   end function meaningful_ends

   !> Mean gap of an element too long for its foundation: only the integral of its force has a meaning.
   pure real(wp) function mean_gap(problem, candidate, gap)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      type(element_gap_t), intent(in) :: gap
      integer :: j
      associate (tableau => problem%tableau(problem%model%mesh%stages(problem%ground%chain%element(2, candidate))))
         mean_gap = sum([(tableau%b(j) * gap_value(problem, gap, tableau%c(j)), j=1, tableau%stages)])
      end associate
   end function mean_gap

   !> True if the law of the foundation on the element after a candidate has corners, or if contact may end there.
   pure logical function has_kinks(problem, candidate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      has_kinks = .false.
      if (problem%ground%chain%element(2, candidate) > 0) has_kinks = size(kink_levels(problem, candidate)) > 0
   end function has_kinks

   !> Gaps at which the law has a corner or contact ends.
   pure function kink_levels(problem, candidate) result(level)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), allocatable :: level(:)
      integer :: n
      level = [real(wp) ::]
      if (.not. problem%ground%chain%bilateral(candidate)) level = [0.0_wp]
      associate (number => problem%model%obstacle(problem%ground%chain%obstacle(candidate))%law)
         if (number == 0) return
         associate (at => problem%model%law(number)%penetration)
            n = size(at)
            level = [level, -at(2:n - 1)]
            if (problem%ground%chain%bilateral(candidate)) level = [level, at(2:n - 1)]
         end associate
      end associate
   end function kink_levels

   !> Segment of the law that applies at a given gap.
   pure integer function segment_of(problem, candidate, gap) result(segment)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: gap
      associate (number => problem%model%obstacle(problem%ground%chain%obstacle(candidate))%law)
         segment = 1
         if (.not. problem%ground%chain%bilateral(candidate) .and. gap >= 0.0_wp) then
            segment = segment_open
         else if (number > 0) then
            segment = law_segment(problem%model%law(number), -gap)
         end if
      end associate
   end function segment_of

   !> Foundation stiffness on a segment of the law: reaction by penetration and length [force/length^2]; 0 without contact.
   pure real(wp) function segment_stiffness(problem, candidate, segment) result(stiffness)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate, segment
      stiffness = 0.0_wp
      if (.not. carries(segment)) return
      associate (obstacle => problem%model%obstacle(problem%ground%chain%obstacle(candidate)))
         stiffness = obstacle%modulus
         if (obstacle%law == 0) return
         stiffness = obstacle%width * segment_slope(problem%model%law(obstacle%law), segment)
      end associate
   end function segment_stiffness

   !> Segment of the law of one contact at a point of a rod segment, and the stiffness on this segment.
   subroutine segment_at(problem, state, rod_segment, contact, at, segment, stiffness)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: rod_segment, contact !! indices into layout%rod_segment and model%contact
      real(wp), intent(in) :: at                !! coordinate along the rod segment
      integer, intent(out) :: segment           !! segment of the law; segment_unknown: there is none, or it is not determined
      real(wp), intent(out) :: stiffness        !! stiffness on the segment, see segment_stiffness
      real(wp) :: tau
      integer :: e, k
      segment = segment_unknown
      stiffness = 0.0_wp
      call find_point(problem, state, rod_segment, at, e, tau)
      do k = problem%ground%first(e), problem%ground%first(e + 1) - 1
         associate (c => problem%ground%candidate(k))
            if (problem%ground%chain%contact(c) /= contact) cycle
            segment = state%segment(c)
            if (segment == segment_unknown) segment = segment_of(problem, c, &
               & gap_value(problem, gap_in_state(problem, state, c), tau))
            stiffness = segment_stiffness(problem, c, segment)
         end associate
      end do
   end subroutine segment_at

   !> Error of every gap of a state, caused by the rounding of displacements and the residual of Newton's method. It depends on the
   !> displacements of all nodes and is the same for all candidates: callers compute it once.
   pure real(wp) function gap_rounding(state)
      type(state_t), intent(in) :: state
      gap_rounding = noise * maxval(abs(state%u(1:2, :)))
   end function gap_rounding

   !> Uncertainty of a gap between the nodes: interpolation error plus rounding error.
   real(wp) function gap_uncertainty(gap, rounding)
      type(element_gap_t), intent(in) :: gap
      real(wp), intent(in) :: rounding          !! result of gap_rounding for the state
      gap_uncertainty = profile_error(gap%profile) + rounding
   end function gap_uncertainty

   !> Finds the positions inside the element after a candidate at which the gap has the value of a corner of the law. Left out are
   !> crossings that belong to the interface points at the ends of the element, and crossings between which the gap differs from the
   !> value by rounding only.
   subroutine element_cuts(problem, state, candidate, rounding, n, tau, level, smallest)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(in) :: rounding           !! result of gap_rounding for the state
      integer, intent(out) :: n                  !! number of positions
      real(wp), allocatable, intent(out) :: tau(:), level(:) !! (n) positions, 0 to 1, in ascending order for each corner of the
      !! law; gap at this corner
      real(wp), intent(in), optional :: smallest !! oscillations of the gap up to this magnitude are ignored
      type(element_gap_t) :: gap
      real(wp) :: place(most_crossings), wave, ends(2)
      real(wp), allocatable :: levels(:)
      logical :: mine(2), known(most_crossings)
      integer :: k, j, m, crossings
      n = 0
      allocate (tau(0), level(0))
      if (.not. has_kinks(problem, candidate)) return
      gap = gap_in_state(problem, state, candidate)
      levels = kink_levels(problem, candidate)
      wave = gap_uncertainty(gap, rounding)
      if (present(smallest)) wave = max(wave, smallest)
      do k = 1, size(levels)
         ! If the gap differs from the value by rounding only, as for a rod on its foundation without force, there is no end of
         ! contact.
         if (maxval(abs([(gap_value(problem, gap, 0.125_wp * j) - levels(k), j=0, 8)])) <= rounding) cycle
         if (.not. follows(problem, state, candidate)) then
            ends = meaningful_ends(problem, candidate)
            if ((gap_value(problem, gap, ends(1)) - levels(k)) * (gap_value(problem, gap, ends(2)) - levels(k)) > 0.0_wp) cycle
         end if
         mine = .false.
         do m = 1, size(problem%mark)
            if (abs(problem%mark(m)%level - levels(k)) > 0.0_wp) cycle
            mine = mine .or. problem%mark(m)%candidate([2, 1]) == candidate
         end do
         call gap_crossings(problem, gap, levels(k), crossings, place)
         known = .true.
         do j = 1, crossings
            if (mine(1) .and. place(j) <= at_mark) known(j) = .false.
            if (mine(2) .and. place(j) >= 1.0_wp - at_mark) known(j) = .false.
         end do
         ! Crossings are dropped if the oscillation between them does not exceed the error of the polynomial.
         do j = 1, crossings - 1
            if (abs(gap_value(problem, gap, 0.5_wp * (place(j) + place(j + 1))) - levels(k)) <= wave) known(j:j + 1) = .false.
         end do
         ! A crossing that bounds half an oscillation, with the other half behind a node, is dropped as well.
         if (present(smallest) .and. crossings > 0) then
            if (abs(gap_value(problem, gap, 0.0_wp) - levels(k)) <= smallest) known(1) = .false.
            if (abs(gap_value(problem, gap, 1.0_wp) - levels(k)) <= smallest) known(crossings) = .false.
         end if
         tau = [tau, pack(place(:crossings), known(:crossings))]
         level = [level, spread(levels(k), 1, count(known(:crossings)))]
      end do
      n = size(tau)
   end subroutine element_cuts

   !> True if the gap passes the value of an interface point's corner between two positions, at the distance at_mark (part of an
   !> element) before and after the point.
   logical function crosses_at(problem, state, m)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m
      associate (mark => problem%mark(m))
         crosses_at = (gap_value(problem, gap_in_state(problem, state, mark%candidate(1)), 1.0_wp - at_mark) < mark%level) .neqv. &
            & (gap_value(problem, gap_in_state(problem, state, mark%candidate(2)), at_mark) < mark%level)
      end associate
   end function crosses_at

   !> True if the gap passes the value of a corner of the law inside an element, see element_cuts.
   logical function any_cut(problem, state, smallest)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in), optional :: smallest !! oscillations of the gap up to this magnitude are ignored
      real(wp), allocatable :: tau(:), level(:)
      real(wp) :: rounding
      integer :: c, n
      any_cut = .false.
      rounding = gap_rounding(state)
      do c = 1, problem%ground%chain%n
         if (state%segment(c) /= segment_unknown) cycle
         call element_cuts(problem, state, c, rounding, n, tau, level, smallest)
         any_cut = any(tau > at_node .and. tau < 1.0_wp - at_node)
         if (any_cut) return
      end do
   end function any_cut

   !> Assigns segments of the laws to the elements of a state: each span gets the segment that follows from the interface points at
   !> its ends. If the gaps do not agree with it, the segment becomes unknown. On meshes without interface points all segments are
   !> unknown.
   subroutine assign_segments(problem, state, carried)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      logical, intent(in) :: carried !! true: the state comes from another mesh, on which the present nodes were inside elements
      logical :: hold
      integer :: c, last, m
      state%segment = segment_unknown
      if (size(problem%mark) == 0) return
      last = 0
      do while (last < problem%ground%chain%n)
         c = last + 1
         last = c
         if (.not. has_kinks(problem, c)) cycle
         do while (goes_on(last))
            last = last + 1
         end do
         do m = 1, size(problem%mark)
            if (problem%mark(m)%candidate(1) == last) state%segment(c:last) = problem%mark(m)%segment(1)
            if (problem%mark(m)%candidate(2) == c) state%segment(c:last) = problem%mark(m)%segment(2)
         end do
      end do
      call segments_hold(problem, state, hold, carried)

   contains

      !> True if the element of the next candidate belongs to the same span, because there is no interface point in between.
      pure logical function goes_on(at)
         integer, intent(in) :: at
         integer :: m
         goes_on = .false.
         if (at == problem%ground%chain%n) return
         if (problem%ground%chain%neighbour(2, at) /= at + 1 .or. .not. has_kinks(problem, at + 1)) return
         do m = 1, size(problem%mark)
            if (problem%mark(m)%candidate(2) == at + 1) return
         end do
         goes_on = .true.
      end function goes_on
   end subroutine assign_segments

   !> Assigns segments to elements that have determined their contact from the gap. These are elements beside an interface point
   !> with a single crossing, to which Newton's method will move the point, and elements without a crossing. The segments of other
   !> elements remain unknown.
   subroutine assign_found_segments(problem, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state         !! in: converged; out: with assigned segments
      logical :: found(size(state%segment))
      integer :: c, m
      found = state%segment == segment_unknown
      call assign_segments(problem, state, carried=.false.)
      do c = 1, size(state%segment)
         if (.not. found(c) .or. state%segment(c) == segment_unknown) cycle
         if (kinks_in(c) > 0) state%segment(c) = segment_unknown
      end do
      do m = 1, size(problem%mark)
         associate (mark => problem%mark(m))
            if (.not. any(state%segment(mark%candidate) == segment_unknown)) cycle
            if (kinks_in(mark%candidate(1), m) + kinks_in(mark%candidate(2), m) == 1) state%segment(mark%candidate) = mark%segment
         end associate
      end do

   contains

      !> Number of crossings in an element, for all corners of the law, or for the corner of one interface point.
      integer function kinks_in(candidate, mark) result(kinks)
         integer, intent(in) :: candidate
         integer, intent(in), optional :: mark
         type(element_gap_t) :: gap
         real(wp) :: place(most_crossings)
         real(wp), allocatable :: levels(:)
         integer :: k, n
         levels = kink_levels(problem, candidate)
         if (present(mark)) levels = [problem%mark(mark)%level]
         gap = gap_in_state(problem, state, candidate)
         kinks = 0
         do k = 1, size(levels)
            call gap_crossings(problem, gap, levels(k), n, place)
            kinks = kinks + n
         end do
      end function kinks_in
   end subroutine assign_found_segments

   !> Tests whether the gaps of a converged state agree with the assigned segments. Where they do not, the segment of the element
   !> becomes unknown.
   subroutine segments_hold(problem, state, hold, carried)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      logical, intent(out) :: hold              !! true: all gaps agree with their segments
      logical, intent(in) :: carried !! true: the state comes from another mesh, on which the present nodes were inside elements
      type(element_gap_t) :: gap
      real(wp) :: low, high, slack, rounding
      real(wp), allocatable :: value(:)
      integer :: c, j
      logical :: marked(2)
      hold = .true.
      rounding = gap_rounding(state)
      do c = 1, size(state%segment)
         if (state%segment(c) == segment_unknown) cycle
         gap = gap_in_state(problem, state, c)
         call segment_range(problem, c, state%segment(c), low, high)
         slack = gap_uncertainty(gap, rounding)
         ! An interface point that is not at its equilibrium position shifts the gap at its node.
         marked = .false.
         do j = 1, size(problem%mark)
            marked = marked .or. problem%mark(j)%candidate([2, 1]) == c
         end do
         if (follows(problem, state, c)) then
            value = with_extremes(gap, merge(1, 0, marked(1)), gap%samples - merge(1, 0, marked(2)))
         else if (carried) then
            cycle
         else
            value = [mean_gap(problem, c, gap)]
            if (problem%model%obstacle(problem%ground%chain%obstacle(c))%along_rod) &
               & value = [value, pack([(gap_value(problem, gap, real(j, wp)), j=0, 1)], .not. marked)]
         end if
         if (all(value >= low - slack .and. value <= high + slack)) cycle
         hold = .false.
         state%segment(c) = segment_unknown
      end do

   contains

      !> Gaps at the samples, and those extreme values between samples that may be outside the range of the segment.
      function with_extremes(gap, first, last) result(value)
         type(element_gap_t), intent(in) :: gap
         integer, intent(in) :: first, last      !! indices of the first and the last sample
         real(wp), allocatable :: value(:)
         real(wp) :: waves, extreme, at
         integer :: j, n
         value = [(gap_value(problem, gap, real(j, wp) / gap%samples), j=first, last)]
         n = size(value)
         waves = maxval(abs(value(:n - 2) - 2.0_wp * value(2:n - 1) + value(3:)))
         if (maxval(value) > high - waves) then
            call gap_extreme(problem, gap, .true., real(first, wp) / gap%samples, real(last, wp) / gap%samples, extreme, at)
            value = [value, extreme]
         end if
         if (minval(value) < low + waves) then
            call gap_extreme(problem, gap, .false., real(first, wp) / gap%samples, real(last, wp) / gap%samples, extreme, at)
            value = [value, extreme]
         end if
      end function with_extremes
   end subroutine segments_hold

   !> Smallest and largest gap of a segment of the law.
   pure subroutine segment_range(problem, candidate, segment, low, high)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate, segment
      real(wp), intent(out) :: low, high
      real(wp) :: range(2)
      low = -huge(low)
      high = 0.0_wp
      associate (number => problem%model%obstacle(problem%ground%chain%obstacle(candidate))%law)
         if (segment == segment_open) then
            low = 0.0_wp
            high = huge(high)
         else if (number > 0) then
            associate (at => problem%model%law(number)%penetration, k => abs(segment))
               range = [at(k), huge(high)]
               if (k < size(at) - 1) range(2) = at(k + 1)
               if (k == 1 .and. problem%ground%chain%bilateral(candidate)) range(1) = -range(2)
            end associate
            if (segment > 0) range = -range([2, 1])
            low = range(1)
            high = range(2)
         end if
      end associate
   end subroutine segment_range
end module ground_segments
