!> Failures inside an increment at whose ends all tests pass. The force of a point contact, or the gap of a free span, may become
!> zero and then positive again: while the contact set is unchanged both are smooth along the path, and the cubic with the values
!> and slopes at both ends shows the minimum. The least pressure of a line contact may be at another place in between, so that no
!> cubic of its values is good; the pressure is evaluated in the middle, at the state of the cubic through both ends of the
!> increment. A touchdown point may also move further than its slopes at both ends allow: contact was then lost at one place and
!> gained at another, although the contact set is the same at both ends.
module minima_of_tests
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use test_kinds, only: span_test_t, test_force, test_gap, test_pressure, test_slack
   use free_span_gap, only: gap_at
   use span_tests, only: run_span_tests
   use contact_change_types, only: step_interval_t
   use tangent_step, only: states_along
   use touchdown_points, only: touchdown_steps
   use span_candidates, only: touch_place
   use path_control, only: path_length
   use path_continuity, only: blended, alike
   use path_point, only: path_point_t, evaluate_span_tests
   use path_state, only: path_state_t
   use step_control, only: too_short
   implicit none
   private
   public :: check_between, note_slopes, least_of_cubic

   ! With half or twice each of these values none of 146 decks of the tests changes.
   real(wp), parameter :: least_dip = 1.0e-3_wp !! least depth below zero of the cubic's minimum, as a share of the larger end
   !! value: six times the error of the cubic, h^4/384, for a test that turns by the largest angle h of an increment, 0.5
   integer, parameter :: most_closer = 5 !! largest number of halvings of an increment because of this check; a test that still
   !! fails it is taken to have a discontinuous slope. Halving five times reduces the difference between a smooth test and its
   !! parabola to a thousandth (4^-5)
   real(wp), parameter :: least_jump = 1.0e-2_wp !! least move of a touchdown point that may be a jump, as a share of its rod
   !! segment: contact that is lost at one place and gained less far away counts as one contact that moves
   real(wp), parameter :: outside = 0.5_wp !! largest amount by which the mean slope may lie outside the range of the two end
   !! slopes, as a share of the larger end slope: the cubic with these slopes then has in the middle a slope that differs by 3/4 of
   !! the larger one from the mean of both

contains

   !> Detects a test that fails inside an increment although all tests pass at its end. The slopes at both ends show such a test.
   subroutine check_between(problem, step, run, interval, which, shorter)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which               !! index of the test that is zero at the interval's end; 0: none
      logical, intent(out) :: shorter            !! true: a shorter increment may show the failure
      real(wp) :: slope(size(interval%after) + problem%candidates%n), both(size(slope), 2), length
      shorter = .false.
      slope = slopes_at(problem, interval%to, interval%after, interval%scale)
      if (allocated(run%slopes%here)) then
         if (size(run%slopes%here) == size(slope)) then
            both(:, 1) = run%slopes%here
            both(:, 2) = slope
            length = path_length(problem, interval%from, interval%to%state)
            shorter = dips(problem, interval, both, length, which) .or. jumps(problem, interval, both, length)
            if (.not. shorter) shorter = pulls_between(problem, run%last, interval, length)
         end if
      end if
      ! A test whose slope is discontinuous inside the increment fails this check however short the increment is.
      if (shorter) run%slopes%closer = run%slopes%closer + 1
      run%slopes%rough = run%slopes%rough .or. run%slopes%closer > most_closer
      shorter = shorter .and. .not. run%slopes%rough .and. .not. too_short(step, run%control, 0.5_wp)
      if (.not. shorter) run%slopes%ahead = slope
   end subroutine check_between

   !> Computes the slopes of the tests at the run's point, unless they are known.
   subroutine note_slopes(problem, run)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      if (allocated(run%slopes%here) .or. .not. problem%has_spans() .or. problem%is_sampled()) return
      call evaluate_span_tests(problem, run%last)
      associate (last => run%last, scale => run%last%system%force_scale)
         run%slopes%here = slopes_at(problem, last, last%span_tests, max(scale, tiny(scale)))
      end associate
   end subroutine note_slopes

   !> Slopes of force and gap tests by arc length (0 for other kinds), followed by the slopes of the positions of all candidates.
   function slopes_at(problem, point, tests, scale) result(slope)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: point
      type(span_test_t), intent(in) :: tests(:)   !! tests at the point
      real(wp), intent(in) :: scale               !! scale of forces
      real(wp) :: slope(size(tests) + problem%candidates%n)
      type(state_t) :: here, ahead
      type(span_test_t), allocatable :: first(:), last(:)
      real(wp) :: step, length
      integer :: k
      slope = 0.0_wp
      if (.not. point%system%ok) return
      call states_along(problem, point%system, point%state, point%tangent%load, here, ahead, step)
      length = path_length(problem, here, ahead)
      if (.not. length > 0.0_wp) return
      first = run_span_tests(problem, here, scale, only=0)
      last = run_span_tests(problem, ahead, scale, only=0)
      where (tests%kind == test_force) slope(:size(tests)) = last%value - first%value
      do k = 1, size(tests)
         ! The place is that of the least gap, where a small shift along the rod does not change the gap.
         if (tests(k)%kind == test_gap) slope(k) = (gap_at(problem, ahead, tests(k)%contact, tests(k)%rod_segment, tests(k)%at) - &
            & gap_at(problem, here, tests(k)%contact, tests(k)%rod_segment, tests(k)%at)) / problem%size
      end do
      slope(size(tests) + 1:) = touchdown_steps(problem, point%state, ahead) - touchdown_steps(problem, point%state, here)
      slope = slope / length
   end function slopes_at

   !> True if the least pressure of a line contact is below zero in the middle of an increment. The state there is that of the cubic
   !> with the states and their derivatives by arc length at both ends.
   logical function pulls_between(problem, last, interval, length) result(pulls)
      type(problem_t), intent(in) :: problem
      type(path_point_t), intent(in) :: last      !! the point at which the increment begins
      type(step_interval_t), intent(in) :: interval
      real(wp), intent(in) :: length              !! path length of the increment
      type(state_t) :: along(4)                   ! at each end: the state, and the state after a short step along the tangent
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: step, part(2)                   ! eighth of the increment / short step, at each end
      logical :: presses(size(interval%after))    ! the line contact presses at both ends
      presses = interval%after%kind == test_pressure .and. min(interval%before%value, interval%after%value) > &
         & test_slack(test_pressure)
      pulls = .false.
      if (.not. any(presses) .or. .not. (last%system%ok .and. interval%to%system%ok)) return
      if (.not. alike(problem, last%state, interval%to%state)) return
      call states_along(problem, last%system, last%state, last%tangent%load, along(1), along(2), step)
      call states_along(problem, interval%to%system, interval%to%state, interval%to%tangent%load, along(3), along(4), step)
      part = [path_length(problem, along(1), along(2)), path_length(problem, along(3), along(4))]
      if (.not. all(part > 0.0_wp)) return
      part = 0.125_wp * length / part
      tests = run_span_tests(problem, blended(problem, along, [0.5_wp - part(1), part(1), 0.5_wp + part(2), -part(2)]), &
         & interval%scale, only=size(interval%after))
      pulls = any(presses .and. tests%value < -max(test_slack(test_pressure), least_dip * max(interval%before%value, &
         & interval%after%value)))
   end function pulls_between

   !> True if a touchdown point has moved much further along the rod, or less far, than its slopes at both ends of the increment
   !> allow.
   logical function jumps(problem, interval, slope, length)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      real(wp), intent(in) :: slope(:, :)         !! (tests and candidates, ends) slopes from slopes_at
      real(wp), intent(in) :: length              !! path length of the increment
      real(wp) :: way
      integer :: c
      jumps = .false.
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%moves(c) .or. problem%candidates%contact_span(c) == 0) cycle
         way = touch_place(problem, interval%to%state, c) - touch_place(problem, interval%from, c)
         associate (both => length * slope(size(interval%after) + c, :), &
            & whole => problem%layout%rod_segment(problem%contact_span(problem%candidates%contact_span(c))%rod_segment))
            if (abs(way) <= least_jump * whole%length) cycle
            jumps = jumps .or. max(way - maxval(both), minval(both) - way) > outside * maxval(abs(both))
         end associate
      end do
   end function jumps

   !> True if a point contact has a compressive force at both ends of an increment, but not everywhere between them; likewise if a
   !> gap is open at both ends, but not between them.
   pure logical function dips(problem, interval, slope, length, which)
      type(problem_t), intent(in) :: problem
      type(step_interval_t), intent(in) :: interval
      integer, intent(in) :: which                !! index of the test that is zero at the interval's end; 0: none
      real(wp), intent(in) :: slope(:, :)         !! (tests, ends of the increment) slopes from slopes_at
      real(wp), intent(in) :: length              !! path length of the increment
      integer :: k
      dips = .false.
      do k = 1, size(interval%after)
         associate (before => interval%before(k), after => interval%after(k))
            if (all(after%kind /= [test_force, test_gap])) cycle
            ! At segment boundaries forces have discontinuous slopes.
            if (after%kind == test_force) then
               if (.not. problem%candidates%moves(after%candidate)) cycle
            else
               ! Beside a contact that moves along the rod, the place of the least gap moves with the contact, so that the slope
               ! there says nothing about a minimum in between.
               if (slope(k, 1) >= 0.0_wp .or. slope(k, 2) <= 0.0_wp) cycle
            end if
            if (before%value <= test_slack(after%kind)) cycle
            if (k /= which .and. after%value <= test_slack(after%kind)) cycle
            dips = dips .or. least_of_cubic([before%value, after%value], length * slope(k, :)) < &
               & -least_dip * max(before%value, after%value)
         end associate
      end do
   end function dips

   !> Least value on [0, 1] of the cubic with given values and slopes at both ends.
   pure real(wp) function least_of_cubic(value, slope) result(least)
      real(wp), intent(in) :: value(2), slope(2)
      real(wp) :: c(0:3), root(2), square
      integer :: k
      least = minval(value)
      c(0) = value(1)
      c(1) = slope(1)
      c(2) = 3.0_wp * (value(2) - value(1)) - 2.0_wp * slope(1) - slope(2)
      c(3) = -2.0_wp * (value(2) - value(1)) + slope(1) + slope(2)
      ! Zeros of c1 + 2 c2 t + 3 c3 t^2, computed without cancellation.
      square = c(2)**2 - 3.0_wp * c(1) * c(3)
      if (square < 0.0_wp) return
      root(1) = -(c(2) + sign(sqrt(square), c(2)))
      root(2) = huge(least)
      if (abs(root(1)) > 0.0_wp) root(2) = c(1) / root(1)
      if (abs(c(3)) > 0.0_wp) root(1) = root(1) / (3.0_wp * c(3))
      if (.not. abs(c(3)) > 0.0_wp) root(1) = huge(least)
      do k = 1, 2
         if (root(k) <= 0.0_wp .or. root(k) >= 1.0_wp) cycle
         least = min(least, c(0) + root(k) * (c(1) + root(k) * (c(2) + root(k) * c(3))))
      end do
   end function least_of_cubic
end module minima_of_tests
