!> What must hold for a set of contact spans to be the right one: test functions, smooth along a path on which the set stays,
!> positive while it holds. Their zeros are where contact begins, ends, spreads or splits.
module span_tests
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, element_load, obstacle_shift, candidate_gap
   use rod_profile, only: profile_t, new_profile, mend_ends, mended_by, profile_place
   use obstacle_geometry, only: obstacle_gap
   use conforming_span, only: conforming_forces, excess_curvature, node_track, track_sense, track_rotation, rod_angle
   use obstacle_track, only: track_t
   use ge_element, only: ge_load_t
   use state_transfer, only: find_point
   use touchdown_points, only: point_force, held_force, at_breakpoint
   use contact_touch, only: touch_t
   use span_problem, only: present_touches
   use reference_curve, only: curve_bend
   implicit none
   private
   public :: span_test_t, run_span_tests, gap_at, virtual_pressure, test_slack, well_below
   public :: test_gap, test_force, test_curvature, test_pressure, test_length, test_closing, test_crossing, test_slope
   public :: beyond, across

   ! What is tested.
   integer, parameter :: test_gap = 1       !! least gap of a free span: contact begins
   integer, parameter :: test_force = 2     !! concentrated force of a point, or at a line's end: contact ends, or lifts off behind
   integer, parameter :: test_curvature = 3 !! of a point contact against the obstacle's, at the end of a rod the slope:
   !! it becomes a line, or two points
   integer, parameter :: test_pressure = 4  !! least density along a line: it lifts off inside
   integer, parameter :: test_length = 5    !! of a line: it shrinks to a point
   integer, parameter :: test_closing = 6   !! of a free span between two contacts: they merge
   integer, parameter :: test_crossing = 7  !! of a free span between a contact and a breakpoint of the rod: it comes to that
   integer, parameter :: test_slope = 8     !! of the gap inwards from a free end that touches: the end lies down, or lifts

   !> What a test may fall below zero by before it is taken for violated: what the dense output errs by.
   real(wp), parameter :: test_slack(8) = [1.0e-9_wp, 1.0e-9_wp, 1.0e-9_wp, 1.0e-6_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0e-9_wp]

   real(wp), parameter :: well_below = 10.0_wp !! slacks, at a place where a test is zero

   type :: span_test_t
      integer :: kind = 0
      real(wp) :: value = 0.0_wp            !! over its own scale: lengths, forces and curvatures of the structure
      integer :: touch = 0                  !! index into problem%touch; 0: none yet
      integer :: candidate = 0              !! force, curvature: which node
      integer :: contact = 0                !! gap: index into model%contact
      integer :: stretch = 0
      integer :: first = 0, last = 0        !! gap: elements of the span
      real(wp) :: at = 0.0_wp               !! gap, pressure: where along the stretch
      real(wp) :: sense = 1.0_wp            !! pressure: at the first end (-1), inside (0), at the last (1); crossing: before
      !! the touch, after it; slope: likewise
   end type span_test_t

   ! Next to a touchdown point the gap grows with a power of the distance: there minima count only.
   real(wp), parameter :: beside = 0.06_wp  !! of a span
   integer, parameter :: samples = 4        !! of the gap in an element
   integer, parameter :: near = 10          !! halvings of their distance, nearer and nearer to a touch
   real(wp), parameter, public :: shortest = 1.0e-4_wp !! of a stretch: spans as short as that are taken for none

contains

   !> All tests of a converged state; in the same order for all states of one problem.
   function run_span_tests(problem, state, scale) result(tests)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: scale         !! of forces
      type(span_test_t), allocatable :: tests(:)
      type(span_test_t), allocatable :: gaps(:)
      type(span_test_t) :: test
      real(wp) :: stretch, noise
      logical :: touched(problem%model%mesh%n_nodes), touching(problem%model%mesh%n_nodes)
      integer :: k, j, c, first, e
      allocate (tests(0), gaps(0))
      do c = 1, problem%candidates%n
         if (problem%candidates%touch(c) == 0) cycle
         associate (touch => problem%touch(problem%candidates%touch(c)))
            if (problem%candidates%moves(c) .or. at_breakpoint(problem, c)) then
               test = span_test_t(kind=test_force, touch=problem%candidates%touch(c), candidate=c)
               if (problem%candidates%moves(c)) then
                  test%value = point_force(problem, state, c) / scale
               else
                  test%value = held_force(problem, state, c) / scale
                  ! Where a line goes on nothing is held, and what is left is what equilibrium leaves.
                  noise = max(10.0_wp * problem%model%step(problem%step)%tolerance, 1.0e-10_wp)
                  if (abs(test%value) <= noise) test%value = 0.0_wp
                  ! A support that leaves takes the node along.
                  if (lift(problem, state, c) > noise * problem%size) test%value = -lift(problem, state, c) / problem%size
               end if
               tests = [tests, test]
            end if
            if (.not. touch%line) then
               if (problem%candidates%moves(c) .or. problem%model%fixed(3, problem%candidates%node(c))) then
                  test = span_test_t(kind=test_curvature, touch=problem%candidates%touch(c), candidate=c)
                  call excess_curvature(problem, state, c, test%value, stretch)
                  test%value = test%value * problem%size
                  tests = [tests, test]
               else if (any(problem%beside(:, problem%candidates%node(c)) == 0) .and. may_turn(c)) then
                  test = span_test_t(kind=test_slope, touch=problem%candidates%touch(c), candidate=c)
                  test%sense = merge(1.0_wp, -1.0_wp, problem%beside(1, problem%candidates%node(c)) == 0)
                  test%value = test%sense * track_rotation(problem, state, c) * &
                     & track_sense(problem, state, c, node_track(problem, state, c))
                  tests = [tests, test]
               end if
            end if
         end associate
      end do
      touched = .false.
      touched(pack(problem%candidates%node, problem%candidates%touch > 0)) = .true.
      do k = 1, size(problem%deck%contact)
         if (.not. problem%deck%contact(k)%spans) cycle
         touching = .false.
         touching(pack(problem%candidates%node, problem%candidates%touch > 0 .and. problem%candidates%contact == k)) = .true.
         do j = 1, size(problem%layout%stretch)
            if (.not. problem%covered(j, k)) cycle
            first = 0
            do e = problem%element_first(j), problem%element_last(j)
               if (problem%conforms(e) > 0) cycle
               if (first == 0) first = e
               if (e < problem%element_last(j)) then
                  if (problem%conforms(e + 1) == 0 .and. .not. touched(problem%model%mesh%node(2, e))) cycle
               end if
               test = span_test_t(kind=test_gap, contact=k, stretch=j, first=first, last=e)
               call least_gap(problem, state, touched, touching, tests, test)
               test%value = test%value / problem%size
               gaps = [gaps, test]
               first = 0
            end do
         end do
      end do
      tests = [gaps, tests]
      call add_lengths()
      do k = 1, size(problem%touch)
         if (.not. problem%touch(k)%line) cycle
         test = span_test_t(kind=test_pressure, touch=k)
         call least_pressure(problem, state, test)
         test%value = test%value * problem%size / scale
         tests = [tests, test]
      end do

   contains

      !> Lines that shrink to points, free spans between two contacts that close.
      subroutine add_lengths()
         real(wp) :: length
         type(touch_t), allocatable :: now(:)
         integer :: k
         now = present_touches(problem, state)
         do k = 1, size(problem%touch)
            associate (whole => problem%layout%stretch(problem%touch(k)%stretch)%length)
               if (problem%touch(k)%line) then
                  test = span_test_t(kind=test_length, touch=k, stretch=problem%touch(k)%stretch, at=0.5_wp * sum(now(k)%at))
                  test%value = (now(k)%at(2) - now(k)%at(1) - shortest * whole) / problem%size
                  tests = [tests, test]
               end if
               call add_crossing(k, now(k)%at(1), -1)
               call add_crossing(k, whole - now(k)%at(2), 1)
               if (k == size(problem%touch)) cycle
               if (problem%touch(k + 1)%stretch /= problem%touch(k)%stretch) cycle
               ! What lies on two obstacles is never one.
               if (problem%touch(k + 1)%contact /= problem%touch(k)%contact) cycle
               length = now(k + 1)%at(1) - now(k)%at(2)
               test = span_test_t(kind=test_closing, touch=k, stretch=problem%touch(k)%stretch)
               test%value = (length - shortest * whole) / problem%size
               tests = [tests, test]
            end associate
         end do
      end subroutine add_lengths

      !> True for a touched end of a rod that nothing holds.
      pure logical function may_turn(c)
         integer, intent(in) :: c
         may_turn = .not. any(problem%model%fixed(:, problem%candidates%node(c)))
      end function may_turn

      !> A touch that comes to an end of its stretch.
      subroutine add_crossing(k, distance, way)
         integer, intent(in) :: k, way        !! touch; -1: before it, 1: after it
         real(wp), intent(in) :: distance     !! to the breakpoint; 0 for one that is there
         if (.not. distance > 0.0_wp) return
         if (k + way >= 1 .and. k + way <= size(problem%touch)) then
            if (problem%touch(k + way)%stretch == problem%touch(k)%stretch) return
         end if
         test = span_test_t(kind=test_crossing, touch=k, stretch=problem%touch(k)%stretch, sense=real(way, wp))
         test%value = (distance - shortest * problem%layout%stretch(test%stretch)%length) / problem%size
         tests = [tests, test]
      end subroutine add_crossing
   end function run_span_tests

   !> The stretch on which a contact goes on past the end of its own: the obstacle is the same there, and at the breakpoint between
   !> no support holds the rod. Forces pass from the free span to the contact, or back. 0: there is none.
   pure integer function beyond(problem, touch, way) result(stretch)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: touch             !! index into problem%touch
      integer, intent(in) :: way               !! -1: before it, 1: after it
      stretch = across(problem, touch, way)
      if (any(problem%model%fixed(:, end_node(problem, touch, way)))) stretch = 0
   end function beyond

   !> The stretch on the other side of a breakpoint at which the stretch of a touch ends, held there or not, where the contact
   !> covers it. 0: there is none.
   pure integer function across(problem, touch, way) result(stretch)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: touch             !! index into problem%touch
      integer, intent(in) :: way               !! -1: before it, 1: after it
      integer :: e
      stretch = 0
      e = problem%beside(merge(1, 2, way < 0), end_node(problem, touch, way))
      if (e == 0) return
      if (problem%covered(problem%stretch(e), problem%touch(touch)%contact)) stretch = problem%stretch(e)
   end function across

   !> The node at one end of a touch's stretch.
   pure integer function end_node(problem, touch, way) result(node)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: touch, way        !! as in across
      associate (own => problem%touch(touch)%stretch)
         if (way < 0) then
            node = problem%model%mesh%node(1, problem%element_first(own))
         else
            node = problem%model%mesh%node(2, problem%element_last(own))
         end if
      end associate
   end function end_node

   !> How far a touched node is from the track.
   pure real(wp) function lift(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: gap, normal(2), bend
      call candidate_gap(problem, state, candidate, gap, normal, bend)
      lift = gap
   end function lift

   !> Gap of a material point to the obstacle of a contact.
   real(wp) function gap_at(problem, state, contact, stretch, at) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact, stretch
      real(wp), intent(in) :: at            !! along the stretch
      real(wp) :: normal(2), bend, tau
      integer :: e
      call find_point(problem, state, stretch, at, e, tau)
      associate (o => problem%model%contact(contact)%obstacle)
         call obstacle_gap(problem%model%obstacle(o), profile_place(problem, new_profile(problem, state, e), tau) - &
            & obstacle_shift(problem, state, o), gap, normal, bend)
      end associate
      gap = gap + contact_offset(problem, state, contact)
   end function gap_at

   !> What comes on top of the distance from the obstacle of a contact: the gap left in the deck, less what has closed since.
   pure real(wp) function contact_offset(problem, state, contact) result(offset)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      associate (o => problem%model%contact(contact)%obstacle, load => problem%model%step(problem%step)%load)
         ! As candidate_offset.
         offset = problem%model%contact(contact)%gap + problem%overlap(contact) * (1.0_wp - problem%constant%resolved(o) - &
            & state%load_factor * load%resolved(o)) - problem%constant%closing(o) - state%load_factor * load%closing(o)
      end associate
   end function contact_offset

   !> The density of the obstacle's force if the rod lay on it at a point contact: what bends it onto the track, r = m'' with
   !> m = EI (curvature of the track less its own), and what the normal force and the loads across press.
   real(wp) function virtual_pressure(problem, state, candidate) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(ge_load_t) :: load
      type(track_t) :: track
      real(wp) :: angle, sense, stretch, excess, axial, normal(2), at, step, bend, rate(2)
      integer :: e, i
      e = maxval(problem%candidates%element(:, candidate))
      load = element_load(problem, state, e)
      track = node_track(problem, state, candidate)
      sense = track_sense(problem, state, candidate, track)
      angle = rod_angle(problem, state, candidate)
      normal = [-sin(angle), cos(angle)]
      call excess_curvature(problem, state, candidate, excess, stretch)
      axial = (stretch - 1.0_wp - load%strain) / problem%compliance(e)%axial
      associate (g => state%geometry%element(e), curve => problem%model%curve(problem%model%mesh%curve(e)))
         ! Of the stress-free curvature the second derivative, by a difference of the first.
         at = g%s(merge(1, 2, problem%model%mesh%node(1, e) == problem%candidates%node(candidate)))
         step = epsilon(step)**(1.0_wp / 3.0_wp) * g%length
         do i = 1, 2
            call curve_bend(curve, problem%model%imperfection, at + merge(-step, step, i == 1), bend, rate(i))
         end do
      end associate
      density = (track%curvature_second * stretch**3 - sense * (rate(2) - rate(1)) / (2.0_wp * step)) / &
         & problem%compliance(e)%bending - (axial * track%curvature * stretch + sense * (dot_product(load%line, normal) + &
         & load%pressure * stretch))
   end function virtual_pressure

   !> Least gap of a free span to an obstacle, and where it is. Beside a touch the gap rises from zero, and what counts is where it
   !> comes down again. A rod that is inside the obstacle from the touch on is so because that is no longer right, where its own
   !> test says so.
   subroutine least_gap(problem, state, touched, touching, own, test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: touched(:)     !! (nodes) touch some obstacle
      logical, intent(in) :: touching(:)    !! (nodes) touch this one: there the gap is zero for certain
      type(span_test_t), intent(in) :: own(:) !! of all touches
      type(span_test_t), intent(inout) :: test
      type(profile_t), allocatable :: profile(:)
      integer, allocatable :: element(:)    ! of samples
      real(wp), allocatable :: tau(:), gap(:), at(:)
      real(wp) :: from, to, low, high, nothing, top(2), more(2), place, value
      logical :: zero(2)
      integer :: e, i, first, last, n
      associate (g => state%geometry%element)
         from = g(test%first)%s(1) + problem%origin(test%first)
         to = g(test%last)%s(2) + problem%origin(test%last)
      end associate
      ! Breakpoints of the rod divide no span.
      call to_next_touch(problem, state, touched, touching, test%first, 1, more(1), zero(1))
      call to_next_touch(problem, state, touched, touching, test%last, 2, more(2), zero(2))
      low = from
      high = to
      if (zero(1)) low = max(from, from - more(1) + beside * (to - from + sum(more)))
      if (zero(2)) high = min(to, to + more(2) - beside * (to - from + sum(more)))
      zero = touching([problem%model%mesh%node(1, test%first), problem%model%mesh%node(2, test%last)])
      nothing = rounding_gap(problem)
      allocate (profile(test%first:test%last))
      do e = test%first, test%last
         profile(e) = new_profile(problem, state, e)
         if (problem%model%mesh%family(e) == family_ge .and. .not. problem%ground%founded(e)) &
            & call mend_ends(problem, state, profile(e))
      end do
      call take_samples()
      first = 1
      last = n
      if (zero(1) .and. fails_at(problem%model%mesh%node(1, test%first))) &
         & first = findloc([gap > 0.0_wp, .true.], .true., 1)
      if (zero(2) .and. fails_at(problem%model%mesh%node(2, test%last))) &
         & last = findloc([.true., gap > 0.0_wp], .true., 1, back=.true.) - 1
      test%value = huge(1.0_wp)
      test%at = 0.5_wp * (from + to)
      do i = first, last
         if (at(i) >= low .and. at(i) <= high) call take(gap(i), at(i))
         if (i == 1 .or. i == n) cycle
         if (gap(i) > gap(i - 1) .or. gap(i) > gap(i + 1)) cycle
         ! No lower than the others, however deep it is between.
         if (2.0_wp * gap(i) - max(gap(i - 1), gap(i + 1)) > test%value) cycle
         call find_minimum(i, value, place)
         ! Next to a touch rounding makes minima, too.
         top = [merge(maxval(gap(:i)), huge(nothing), zero(1)), merge(maxval(gap(i:)), huge(nothing), zero(2))]
         if (minval(top) <= nothing .and. value >= -nothing) cycle
         ! And so do elements that are too long: there the rod must be inside by what its polynomials err by.
         call take(merge(value, value + doubt_along(place), place >= low .and. place <= high), place)
      end do
      if (test%value >= huge(1.0_wp)) test%value = problem%size

   contains

      subroutine take(value, place)
         real(wp), intent(in) :: value, place
         if (value >= test%value) return
         test%value = value
         test%at = place
      end subroutine take

      !> True for a node whose touch is no longer right.
      pure logical function fails_at(node)
         integer, intent(in) :: node
         integer :: k
         fails_at = .false.
         do k = 1, size(own)
            if (own(k)%candidate == 0) cycle
            if (problem%candidates%node(own(k)%candidate) /= node .or. &
               & problem%candidates%contact(own(k)%candidate) /= test%contact) cycle
            fails_at = fails_at .or. own(k)%value < -well_below * test_slack(own(k)%kind)
         end do
      end function fails_at

      !> Equal parts of all elements; nearer and nearer to the touches.
      subroutine take_samples()
         integer :: i, e, most
         most = (test%last - test%first + 1) * (samples + 1) + 2 * near
         allocate (element(most), tau(most))
         n = 0
         do e = test%first, test%last
            if (e == test%first .and. zero(1)) then
               do i = near, 1, -1
                  call add(e, 0.5_wp**i / samples)
               end do
            end if
            do i = merge(0, 1, e == test%first .and. .not. zero(1)), samples
               if (i == samples .and. e == test%last .and. zero(2)) cycle
               call add(e, real(i, wp) / samples)
            end do
            if (e == test%last .and. zero(2)) then
               do i = 1, near
                  call add(e, 1.0_wp - 0.5_wp**i / samples)
               end do
            end if
         end do
         at = [(place_of(element(i), tau(i)), i=1, n)]
         gap = [(gap_there(element(i), tau(i)), i=1, n)]
      end subroutine take_samples

      subroutine add(e, where)
         integer, intent(in) :: e
         real(wp), intent(in) :: where
         n = n + 1
         element(n) = e
         tau(n) = where
      end subroutine add

      !> The minimum between the neighbours of a sample that is lower than both, by golden sections.
      subroutine find_minimum(i, value, place)
         integer, intent(in) :: i
         real(wp), intent(out) :: value, place
         real(wp), parameter :: golden = 0.5_wp * (sqrt(5.0_wp) - 1.0_wp)
         integer, parameter :: sections = ceiling(log(epsilon(value)) / (2.0_wp * log(golden))) ! to the root of rounding
         real(wp) :: ends(2), inner(2), f(2)
         integer :: k
         ends = [at(i - 1), at(i + 1)]
         inner = [ends(2) - golden * (ends(2) - ends(1)), ends(1) + golden * (ends(2) - ends(1))]
         f = [gap_along(inner(1)), gap_along(inner(2))]
         do k = 1, sections
            if (f(1) < f(2)) then
               ends(2) = inner(2)
               inner = [ends(2) - golden * (ends(2) - ends(1)), inner(1)]
               f = [gap_along(inner(1)), f(1)]
            else
               ends(1) = inner(1)
               inner = [inner(2), ends(1) + golden * (ends(2) - ends(1))]
               f = [f(2), gap_along(inner(2))]
            end if
         end do
         value = gap(i)
         place = at(i)
         if (minval(f) >= value) return
         value = minval(f)
         place = inner(minloc(f, 1))
      end subroutine find_minimum

      real(wp) function gap_along(place) result(gap)
         real(wp), intent(in) :: place
         integer :: e
         e = element_at(place)
         gap = gap_there(e, part_of(e, place))
      end function gap_along

      real(wp) function doubt_along(place) result(doubt)
         real(wp), intent(in) :: place
         integer :: e
         e = element_at(place)
         doubt = norm2(mended_by(profile(e), part_of(e, place)))
      end function doubt_along

      pure integer function element_at(place) result(e)
         real(wp), intent(in) :: place
         do e = test%first, test%last - 1
            if (place <= place_of(e, 1.0_wp)) exit
         end do
      end function element_at

      pure real(wp) function part_of(e, place) result(tau)
         integer, intent(in) :: e
         real(wp), intent(in) :: place
         associate (s => state%geometry%element(e)%s)
            tau = (place - problem%origin(e) - s(1)) / (s(2) - s(1))
         end associate
      end function part_of

      pure real(wp) function place_of(e, tau) result(at)
         integer, intent(in) :: e
         real(wp), intent(in) :: tau
         associate (g => state%geometry%element(e))
            at = g%s(1) + tau * (g%s(2) - g%s(1)) + problem%origin(e)
         end associate
      end function place_of

      real(wp) function gap_there(e, tau) result(gap)
         integer, intent(in) :: e
         real(wp), intent(in) :: tau
         real(wp) :: normal(2), bend
         integer :: obstacle
         obstacle = problem%model%contact(test%contact)%obstacle
         call obstacle_gap(problem%model%obstacle(obstacle), profile_place(problem, profile(e), tau) - &
            & obstacle_shift(problem, state, obstacle), gap, normal, bend)
         gap = gap + contact_offset(problem, state, test%contact)
      end function gap_there
   end subroutine least_gap

   !> How much of a free span lies beyond one end of an element, and whether it ends with a touch of one obstacle.
   pure subroutine to_next_touch(problem, state, touched, touching, element, side, length, touches)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: touched(:), touching(:) !! (nodes) as in least_gap
      integer, intent(in) :: element, side   !! 1: before its first node, 2: after its last
      real(wp), intent(out) :: length
      logical, intent(out) :: touches
      integer :: e, node
      length = 0.0_wp
      e = element
      do
         node = problem%model%mesh%node(side, e)
         touches = touching(node)
         if (touched(node)) return
         e = problem%beside(side, node)
         if (e == 0 .or. e == element) return
         if (problem%conforms(e) > 0) return
         associate (s => state%geometry%element(e)%s)
            length = length + s(2) - s(1)
         end associate
      end do
   end subroutine to_next_touch

   !> Least density of the obstacle's force along a line, and where it is.
   subroutine least_pressure(problem, state, test)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(span_test_t), intent(inout) :: test
      real(wp) :: local(3), place(2), angle, density, tau
      integer :: e, i, c, first, last
      test%value = huge(1.0_wp)
      first = 0
      last = 0
      do e = problem%element_first(problem%touch(test%touch)%stretch), problem%element_last(problem%touch(test%touch)%stretch)
         c = problem%conforms(e)
         if (c == 0) cycle
         ! The first node may be that of the line before it, which goes on over a breakpoint.
         if (problem%candidates%touch(problem%candidates%neighbour(2, c)) /= test%touch .and. &
            & problem%candidates%touch(c) /= test%touch) cycle
         if (first == 0) first = e
         last = e
         do i = 0, samples
            tau = real(i, wp) / samples
            call conforming_forces(problem, state, e, tau, local, place, angle, density)
            if (density >= test%value) cycle
            test%value = density
            associate (g => state%geometry%element(e))
               test%at = g%s(1) + tau * (g%s(2) - g%s(1)) + problem%origin(e)
            end associate
            test%sense = 0.0_wp
            if (e == first .and. i == 0) test%sense = -1.0_wp
         end do
      end do
      if (last == 0) then
         test%value = 1.0_wp
         return
      end if
      associate (g => state%geometry%element(last))
         if (test%at >= g%s(2) + problem%origin(last)) test%sense = 1.0_wp
      end associate
   end subroutine least_pressure
end module span_tests
