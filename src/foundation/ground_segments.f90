!> Which segment of its foundation's law an element is on: a property of the span between two marks, not of a sign at a point.
!>
!> While Newton iterates a span of contact pushes and pulls, and a free one feels nothing; where its ends are is told by the marks.
!> At the solution the gaps must agree with that. Elements that they do not agree with find out for themselves what touches, as all
!> do on meshes without marks: that is right, too, but of a lower order.
module ground_segments
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use force_law, only: law_segment, segment_slope, carries, segment_open, segment_unknown
   use element_gap, only: element_gap_t, ground_gap, gap_look, gap_value, gap_extreme, gap_crossings, most_crossings
   use rod_profile, only: mend_ends, profile_error, profile_angle
   use element_families, only: collocates
   use state_transfer, only: find_point
   use gauss_tableau, only: max_stages
   implicit none
   private
   public :: has_kinks, follows, tell_segments, settle_found, segments_hold, element_cuts, crosses_at, segment_at
   public :: segment_stiffness, is_cut, gap_uncertainty, followed_length, followed_part, stiffest, told_gap
   public :: settled_gap, gap_rounding

   real(wp), parameter :: noise = 1.0e3_wp * epsilon(1.0_wp) !! of what moves: the rounding of gaps, and what Newton leaves
   real(wp), parameter :: at_mark = 0.1_wp !! of an element: a crossing as near as that to a mark is its own, which Newton goes to
   real(wp), parameter :: at_node = 1.0e-6_wp !! of an element: one as near as that to a node cuts no element

   !> k h^4/EI up to which the collocation of so many stages follows what a foundation does to a rod. There the amplitudes fall
   !> along the rod as the exponential of z = (k/EI)^(1/4) h at 45 degrees to the real axis; the stability function of the
   !> method, the diagonal Pade approximant, falls up to the fourth root of these values only: stiffer is longer waves.
   real(wp), parameter :: stiffest(max_stages) = [16.0_wp, 144.0_wp, 667.4_wp, 2059.0_wp, 4434.6_wp, 7682.8_wp]

contains

   !> The longest element of so many stages that follows what a foundation of a stiffness does to a rod of a bending stiffness.
   pure real(wp) function followed_length(stiffness, bending, stages) result(length)
      real(wp), intent(in) :: stiffness      !! [force/length^2]
      real(wp), intent(in) :: bending        !! EI
      integer, intent(in) :: stages
      length = (stiffest(stages) * bending / stiffness)**0.25_wp
   end function followed_length

   !> The part of their stiffness up to which all elements follow foundations that they may leave.
   pure real(wp) function followed_part(problem) result(part)
      type(problem_t), intent(in) :: problem
      integer :: c
      part = huge(part)
      do c = 1, problem%ground%chain%n
         if (.not. has_kinks(problem, c)) cycle
         associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, c))
            part = min(part, (followed_length(problem%ground%slope(problem%ground%chain%obstacle(c)), &
               & problem%model%section(mesh%section(e))%ei, mesh%stages(e)) / (mesh%s(2, e) - mesh%s(1, e)))**4)
         end associate
      end do
   end function followed_part

   !> False for an element in contact that is too long to follow its foundation: it tells nothing of it between its nodes. That is
   !> a property of the mesh, as its nodes were laid: it does not change where they go along with a mark.
   pure logical function follows(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: stiffness
      follows = .true.
      associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, candidate))
         stiffness = segment_stiffness(problem, candidate, state%segment(candidate))
         if (state%segment(candidate) == segment_unknown) stiffness = problem%ground%slope(problem%ground%chain%obstacle(candidate))
         if (stiffness > 0.0_wp) follows = mesh%s(2, e) - mesh%s(1, e) <= followed_length(stiffness, &
            & problem%model%section(mesh%section(e))%ei, mesh%stages(e))
      end associate
   end function follows

   !> The gap on the element after a candidate as it is told between the nodes: much better than the polynomial that the quadrature
   !> of the foundation's forces takes, where the element follows its foundation. (Of rods that shear it would take its forces at
   !> the nodes, too.)
   pure function told_gap(problem, state, candidate) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(element_gap_t) :: gap
      gap = ground_gap(problem, state, candidate)
      associate (e => problem%ground%chain%element(2, candidate))
         if (.not. collocates(problem%model%mesh%family(e)) .or. problem%compliance(e)%shear > 0.0_wp) return
      end associate
      if (follows(problem, state, candidate)) call mend_ends(problem, state, gap%profile, 3)
   end function told_gap

   !> The mean gap of the element after a candidate, one that is too long to follow its foundation, and the amplitudes of the waves
   !> that decay into it from its nodes: (A cos b s + B sin b s) / exp(b s), 4 b^4 = k/EI, for the gap and its slope there. Only
   !> elements that follow the foundation tell these, on the node's other side.
   subroutine settled_gap(problem, state, candidate, mean, waves)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(out) :: mean, waves(2)   !! the latter >= 0
      type(element_gap_t) :: gap
      real(wp) :: x(2), value, normal(2), bend, theta, rate, slope
      integer :: i, beside
      gap = told_gap(problem, state, candidate)
      mean = mean_gap(problem, candidate, gap)
      waves = 0.0_wp
      associate (mesh => problem%model%mesh, e => problem%ground%chain%element(2, candidate))
         rate = (problem%ground%slope(problem%ground%chain%obstacle(candidate)) / &
            & (4.0_wp * problem%model%section(mesh%section(e))%ei))**0.25_wp
         do i = 1, 2
            ! The candidate that the element beside comes after.
            beside = problem%ground%chain%neighbour(i, candidate)
            if (i == 2 .and. beside > 0) then
               if (problem%ground%chain%element(2, beside) == 0) beside = 0
            end if
            if (beside == 0) cycle
            if (.not. follows(problem, state, beside)) cycle
            call gap_look(problem, gap, real(i - 1, wp), x, value, normal, bend)
            theta = profile_angle(problem, state, gap%profile, real(i - 1, wp))
            slope = dot_product(normal, [cos(theta), sin(theta)]) * merge(1.0_wp, -1.0_wp, i == 1)
            waves(i) = norm2([value - mean, value - mean + slope / rate])
         end do
      end associate
   end subroutine settled_gap

   !> The mean gap of an element that is too long to follow its foundation: of what acts on it only the sum means something.
   pure real(wp) function mean_gap(problem, candidate, gap)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      type(element_gap_t), intent(in) :: gap
      integer :: j
      associate (tableau => problem%tableau(problem%model%mesh%stages(problem%ground%chain%element(2, candidate))))
         mean_gap = sum([(tableau%b(j) * gap_value(problem, gap, tableau%c(j)), j=1, tableau%stages)])
      end associate
   end function mean_gap

   !> True for the element after a candidate of the foundations' chain that the foundation may leave, or whose law has corners.
   pure logical function has_kinks(problem, candidate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      has_kinks = .false.
      if (problem%ground%chain%element(2, candidate) > 0) has_kinks = size(kink_levels(problem, candidate)) > 0
   end function has_kinks

   !> The gaps at which it has.
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

   !> The segment that a gap lies on.
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

   !> Reaction per penetration and length on a segment; 0 where there is no contact.
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

   !> The segment that a contact is on at a place along a stretch, and its stiffness.
   subroutine segment_at(problem, state, stretch, contact, at, segment, stiffness)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: stretch, contact
      real(wp), intent(in) :: at                !! coordinate along the stretch
      integer, intent(out) :: segment
      real(wp), intent(out) :: stiffness
      real(wp) :: tau
      integer :: e, k
      segment = segment_unknown
      stiffness = 0.0_wp
      call find_point(problem, state, stretch, at, e, tau)
      do k = problem%ground%first(e), problem%ground%first(e + 1) - 1
         associate (c => problem%ground%candidate(k))
            if (problem%ground%chain%contact(c) /= contact) cycle
            segment = state%segment(c)
            if (segment == segment_unknown) segment = segment_of(problem, c, &
               & gap_value(problem, told_gap(problem, state, c), tau))
            stiffness = segment_stiffness(problem, c, segment)
         end associate
      end do
   end subroutine segment_at

   !> What is not known of the gap between the nodes: the error of the element's polynomial, and rounding.
   real(wp) function uncertainty(state, gap)
      type(state_t), intent(in) :: state
      type(element_gap_t), intent(in) :: gap
      uncertainty = profile_error(gap%profile) + gap_rounding(state)
   end function uncertainty

   !> What rounding of displacements, and what Newton leaves of them, may make of any gap.
   pure real(wp) function gap_rounding(state)
      type(state_t), intent(in) :: state
      gap_rounding = noise * maxval(abs(state%u(1:2, :)))
   end function gap_rounding

   !> The same on the element after a candidate.
   real(wp) function gap_uncertainty(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      gap_uncertainty = uncertainty(state, told_gap(problem, state, candidate))
   end function gap_uncertainty

   !> Places inside the element after a candidate where the gap takes the value of a corner, with what lies between them beyond
   !> rounding. None at the marks that it lies between.
   subroutine element_cuts(problem, state, candidate, n, tau, level, smallest)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(out) :: n
      real(wp), allocatable, intent(out) :: tau(:), level(:) !! (n) in order for each level
      real(wp), intent(in), optional :: smallest !! waves of the gap no larger than this are none
      type(element_gap_t) :: gap
      real(wp) :: place(most_crossings), least, wave
      real(wp), allocatable :: levels(:)
      logical :: mine(2), known(most_crossings)
      integer :: k, j, m, crossings
      n = 0
      allocate (tau(0), level(0))
      if (.not. has_kinks(problem, candidate)) return
      gap = told_gap(problem, state, candidate)
      levels = kink_levels(problem, candidate)
      least = gap_rounding(state)
      wave = uncertainty(state, gap)
      if (present(smallest)) wave = max(wave, smallest)
      do k = 1, size(levels)
         ! What lies on its foundation without force has no ends of contact.
         if (maxval(abs([(gap_value(problem, gap, 0.125_wp * j) - levels(k), j=0, 8)])) <= least) cycle
         if (.not. follows(problem, state, candidate)) then
            associate (tableau => problem%tableau(problem%model%mesh%stages(problem%ground%chain%element(2, candidate))))
               if ((gap_value(problem, gap, tableau%c(1)) - levels(k)) * (gap_value(problem, gap, tableau%c(tableau%stages)) - &
                  & levels(k)) > 0.0_wp) cycle
            end associate
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
         ! A wave between two crossings that is no larger than the error of the polynomial.
         do j = 1, crossings - 1
            if (abs(gap_value(problem, gap, 0.5_wp * (place(j) + place(j + 1))) - levels(k)) <= wave) known(j:j + 1) = .false.
         end do
         ! Half of one, with the other half beyond a node.
         if (present(smallest) .and. crossings > 0) then
            if (abs(gap_value(problem, gap, 0.0_wp) - levels(k)) <= smallest) known(1) = .false.
            if (abs(gap_value(problem, gap, 1.0_wp) - levels(k)) <= smallest) known(crossings) = .false.
         end if
         tau = [tau, pack(place(:crossings), known(:crossings))]
         level = [level, spread(levels(k), 1, count(known(:crossings)))]
      end do
      n = size(tau)
   end subroutine element_cuts

   !> True where the gap passes the value of a mark in the parts of the elements beside it whose crossings are left to it.
   logical function crosses_at(problem, state, m)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m
      associate (mark => problem%mark(m))
         crosses_at = (gap_value(problem, told_gap(problem, state, mark%candidate(1)), 1.0_wp - at_mark) < mark%level) .neqv. &
            & (gap_value(problem, told_gap(problem, state, mark%candidate(2)), at_mark) < mark%level)
      end associate
   end function crosses_at

   !> True where a kink lies inside the element after a candidate.
   logical function is_cut(problem, state, candidate, smallest)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(in), optional :: smallest !! waves of the gap no larger than this are none
      real(wp), allocatable :: tau(:), level(:)
      integer :: n
      is_cut = .false.
      if (state%segment(candidate) /= segment_unknown .or. .not. has_kinks(problem, candidate)) return
      call element_cuts(problem, state, candidate, n, tau, level, smallest)
      is_cut = any(tau > at_node .and. tau < 1.0_wp - at_node)
   end function is_cut

   !> Sets the segments of a state: every span is on that of the marks at its ends, where the gaps do not say otherwise.
   !> Everything on meshes without marks is left to itself.
   subroutine tell_segments(problem, state, carried)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      logical, intent(in) :: carried            !! it comes from another mesh, where its nodes lay inside elements
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

      !> True where the next candidate's element follows this one's without a mark between.
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
   end subroutine tell_segments

   !> Settles what elements have found out for themselves: those beside marks that the one kink in them has left, where Newton's
   !> method brings the mark, and those without a kink. Others have found what no mark tells.
   subroutine settle_found(problem, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state         !! converged
      logical :: found(size(state%segment))
      integer :: c, m
      found = state%segment == segment_unknown
      call tell_segments(problem, state, carried=.false.)
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

      !> At all levels, or at that of a mark.
      integer function kinks_in(candidate, mark) result(kinks)
         integer, intent(in) :: candidate
         integer, intent(in), optional :: mark
         type(element_gap_t) :: gap
         real(wp) :: place(most_crossings)
         real(wp), allocatable :: levels(:)
         integer :: k, n
         levels = kink_levels(problem, candidate)
         if (present(mark)) levels = [problem%mark(mark)%level]
         gap = told_gap(problem, state, candidate)
         kinks = 0
         do k = 1, size(levels)
            call gap_crossings(problem, gap, levels(k), n, place)
            kinks = kinks + n
         end do
      end function kinks_in
   end subroutine settle_found

   !> Whether the gaps of a converged state agree with its segments; where they do not the segment is given up.
   subroutine segments_hold(problem, state, hold, carried)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      logical, intent(out) :: hold
      logical, intent(in) :: carried            !! as tell_segments has it
      type(element_gap_t) :: gap
      real(wp) :: low, high, slack
      real(wp), allocatable :: value(:)
      integer :: c, j
      logical :: marked(2)
      hold = .true.
      do c = 1, size(state%segment)
         if (state%segment(c) == segment_unknown) cycle
         gap = told_gap(problem, state, c)
         call segment_range(problem, c, state%segment(c), low, high)
         slack = uncertainty(state, gap)
         if (follows(problem, state, c)) then
            ! A mark that is not yet where it belongs takes the gap of its node along.
            marked = .false.
            do j = 1, size(problem%mark)
               marked = marked .or. problem%mark(j)%candidate([2, 1]) == c
            end do
            value = with_extremes(gap, merge(1, 0, marked(1)), gap%samples - merge(1, 0, marked(2)))
         else if (carried) then
            cycle
         else
            value = [mean_gap(problem, c, gap)]
         end if
         if (all(value >= low - slack .and. value <= high + slack)) cycle
         hold = .false.
         state%segment(c) = segment_unknown
      end do

   contains

      !> Gaps at samples, and the extreme ones between them where these may leave what the segment allows.
      function with_extremes(gap, first, last) result(value)
         type(element_gap_t), intent(in) :: gap
         integer, intent(in) :: first, last      !! samples
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

   !> The gaps of a segment.
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
