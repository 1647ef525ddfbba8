!> Finds the next contact set by trials. Each neighbour of the present set, that is, a set that differs from it by one edit
!> (neighbours), is solved for its equilibrium, in which the new contact or free span has a prescribed length (set_trial). The set
!> is kept if all its tests are satisfied there or a short step further along the path (step_off). No rule connects a failing test
!> with a set.
!>
!> If no set remains after one edit, a second edit is made where the tests of the edited set fail. At a located change the first
!> set that is valid is taken. Elsewhere, if several sets remain, they are followed over ten times longer paths until one is left:
!> near a degenerate change the test values of the sets differ by less than the tolerance of the tests.
module contact_trials
   use kinds, only: wp
   use model, only: step_t, method_displacement
   use problem, only: problem_t, copy_problem, rounding_gap
   use rod_state, only: state_t
   use linear_system, only: system_t
   use contact_spans, only: contact_span_t, shortest
   use contact_set_edits, only: same_set
   use span_candidates, only: present_contact_spans
   use bordered_system, only: linearise
   use state_transfer, only: carried, carried_field
   use path_control, only: displacement_between, metric
   use path_continuity, only: path_tangent_t
   use test_kinds, only: span_test_t, any_fails, test_slack, test_curvature, test_vanishing, test_length, test_crossing
   use span_tests, only: run_span_tests
   use next_spans, only: next_t, copy_next, go_to_load, tests_of
   use reachability, only: leads_to_next
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use contact_in_doubt, only: tell_differences
   use rod_strips, only: strip_t, find_strips, on_strips
   use neighbours, only: doubt_t, neighbour_t, neighbours_at, edit_merge, no_test
   use doubts, only: doubts_of, all_doubts
   use set_trial, only: solve_neighbour
   use step_off, only: tangent_along, along, step_by, failing
   implicit none
   private
   public :: try_sets

   ! Lengths as shares of the length of the rod strip, a sequence of rod segments (rod_strips):
   real(wp), parameter :: first_size(3) = [2.0e-3_wp, 5.0e-4_wp, 1.0e-2_wp] !! prescribed lengths of a new contact or free span
   real(wp), parameter :: nearby = 2.0e-3_wp      !! contacts within this distance of a failing test are edited
   real(wp), parameter :: part_of_segment = 0.25_wp !! longest new contact or free span / shortest rod segment
   ! Displacement as a share of the structure's size:
   real(wp), parameter :: another = 3.0e-3_wp     !! an equilibrium farther from the run's point is on another path
   ! Path lengths as shares of the total displacement, or of the load factor if nothing is displaced (step_off):
   real(wp), parameter :: step_ahead(4) = [1.0e-4_wp, 1.0e-3_wp, 1.0e-2_wp, 1.0e-1_wp]  !! distances from the equilibrium at which
   !! the tests decide whether a set is valid
   real(wp), parameter :: farthest = 0.2_wp  !! largest distance over which several sets are compared, and largest relative change
   !! of the load factor from the run's point to another set
   real(wp), parameter :: farther = 10.0_wp       !! factor between the distances at which several sets are compared

   real(wp), parameter :: shorter = 0.1_wp  !! least length of a new contact or free span just behind the change, as a share of the
   !! least length elsewhere (contact_spans%shortest)
   real(wp), parameter :: growth = 5.0_wp         !! factor between the lengths of a new span that are tried to leave its change
   real(wp), parameter :: most_of_strip = 0.25_wp !! longest of these lengths / length of the strip
   real(wp), parameter :: least_change = 1.0e-6_wp !! change of the load factor that an increment can make / first increment
   integer, parameter :: most_edits = 2           !! edits by which a set differs from the present one
   integer, parameter :: most_failed = 8          !! sets whose neighbours are tried, too: those of the likeliest edits
   integer, parameter :: most_halvings = 20       !! halvings of the load interval that contains the onset of the set

   !> A contact set found by the search: all its tests are satisfied at its equilibrium or a short way along its path.
   type :: way_t
      type(next_t) :: base  !! its first equilibrium, in which the new contact or free span has a prescribed length
      type(path_tangent_t) :: heading             !! path tangent at this equilibrium, pointing onward
      type(path_point_t) :: there                 !! equilibrium at which the tests are satisfied: `base`, or a short step further
      logical :: sized = .false.  !! true: `base` has a prescribed length, so that the set becomes valid before this equilibrium
   end type way_t

   !> State of the search: the rod strips, and the contact sets found so far.
   type :: search_t
      type(strip_t), allocatable :: strip(:)
      type(way_t), allocatable :: way(:)          !! all sets found
      real(wp) :: load = 0.0_wp  !! least reference value for changes of the load factor
      logical :: located = .false.                !! true: the change is at the run's point
      logical :: pivots_tell = .true.             !! false: the stiffness of the present set is singular at the run's point
   end type search_t

   !> A set to be edited, at an equilibrium, and the places where its tests fail.
   type :: trial_t
      type(next_t) :: set
      type(doubt_t), allocatable :: fails(:)
   end type trial_t

contains

   !> Finds the contact set with which the path continues from the run's point, and the first equilibrium of this set.
   subroutine try_sets(problem, step, run, first, next, found, zero)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step            !! its first increment is a scale of load changes
      type(path_state_t), intent(in) :: run
      type(next_t), intent(out) :: first          !! the set at its onset, labelled as a change of contact
      type(next_t), intent(out) :: next           !! the same set at a point further on, where all its tests are satisfied
      logical, intent(out) :: found
      type(span_test_t), intent(in), optional :: zero(:) !! tests that are zero at the run's point, if the change is located there:
      !! the first set that is valid is taken, and begins at this point
      type(search_t) :: search
      type(next_t) :: here
      type(doubt_t), allocatable :: doubt(:)
      type(contact_span_t), allocatable :: before(:)
      integer :: k, best
      search%strip = find_strips(problem%layout)
      search%load = max(abs(run%last_load), first_load(step))
      allocate (search%way(0))
      call copy_problem(problem, here%problem)
      here%path_point_t = run%last
      search%located = present(zero)
      if (search%located) then
         doubt = doubts_of(here%problem, here%state, search%strip, zero)
         ! The place of an osculating contact is undetermined.
         search%pivots_tell = zero(1)%kind /= test_curvature
      else
         doubt = places_in_doubt(here, run, search%strip)
      end if
      do k = 1, size(first_size)
         call look_at(run, here, doubt, first_size(k), search)
         if (size(search%way) > 0) exit
      end do
      if (search%located) call enlarge(run, here, doubt, first_size(min(k, size(first_size))), search)
      call follow_further(search, best)
      found = best > 0
      if (.not. found) return
      call copy_next(search%way(best)%base, next)
      next%path_point_t = search%way(best)%there
      if (search%way(best)%sized .and. .not. search%located) then
         call begin_earlier(problem, run, next, first)
      else
         call copy_next(search%way(best)%base, first)
         first%tangent = search%way(best)%heading
      end if
      before = present_contact_spans(problem, run%last%state)
      ! The former contacts are widened by `nearby`: a new contact beside a former one is a part of it, so that the former contact
      ! divides.
      do k = 1, size(before)
         before(k)%at = before(k)%at + [-nearby, nearby] * problem%layout%rod_segment(before(k)%rod_segment)%length
      end do
      call tell_differences(problem, run, before, 0.0_wp * problem%layout%rod_segment%length, spread(0.0_wp, 1, &
         & size(problem%deck%contact)), first)
      next%problem%contact_span%number = first%problem%contact_span%number
   end subroutine try_sets

   !> Enlarges the new contact or free span of a set found as long as the load factor has changed by less than the smallest
   !> increment, so that the path can continue from there: a span that opens in a line contact may grow with a small power of the
   !> load.
   subroutine enlarge(run, here, doubt, part, search)
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: here            !! the present set, at the run's point
      type(doubt_t), intent(in) :: doubt(:)
      real(wp), intent(in) :: part                !! length of the new contact or free span / length of the strip
      type(search_t), intent(inout) :: search
      type(search_t) :: larger
      real(wp) :: longer
      longer = part
      do while (size(search%way) > 0)
         associate (way => search%way(1))
            longer = growth * longer
            if (.not. way%sized .or. longer > most_of_strip .or. abs(way%base%state%load_factor - here%state%load_factor) > &
               & least_change * search%load) return
            larger%strip = search%strip
            larger%load = search%load
            larger%located = search%located
            larger%pivots_tell = search%pivots_tell
            allocate (larger%way(0))
            call look_at(run, here, doubt, longer, larger)
            if (size(larger%way) == 0) return
            if (.not. same_kind(larger%way(1)%base%problem, way%base%problem)) return
         end associate
         call move_alloc(larger%way, search%way)
      end do
   end subroutine enlarge

   !> Finds the first equilibrium of a set, by halving the load interval between the run's point and a later point at which the set
   !> is valid. At the change itself a new contact or free span has zero length, so shorter ones than elsewhere are accepted.
   subroutine begin_earlier(problem, run, next, first)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: next            !! the set at the valid point, with its path tangent
      type(next_t), intent(out) :: first
      type(next_t) :: there
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: before, load
      integer :: k
      call copy_next(next, first)
      before = run%last%state%load_factor
      do k = 1, most_halvings
         load = 0.5_wp * (before + first%state%load_factor)
         call copy_next(first, there)
         call go_to_load(there, load, tests)
         if (allocated(tests)) then
            where (tests%kind == test_length .or. tests%kind == test_crossing) tests%value = tests%value + (1.0_wp - shorter) * &
               & shortest * minval(problem%layout%rod_segment%length) / problem%size
            if (.not. any_fails(tests) .and. there%system%negative_pivots == next%system%negative_pivots) then
               call copy_next(there, first)
               cycle
            end if
         end if
         before = load
      end do
      ! The tangent at `next` is used, because rounding spoils the tangent where the new span is very short.
      first%tangent = next%tangent
      call linearise(first%problem, first%state, first%state, first%system)
   end subroutine begin_earlier

   !> Places at which the present set is edited: those of the tests that fail at the run's point or, if none fails there, a short
   !> step ahead. If no test fails, or no equilibrium is found ahead: the ends of all contacts.
   function places_in_doubt(here, run, strip) result(doubt)
      type(next_t), intent(in) :: here            !! the present set
      type(path_state_t), intent(in) :: run
      type(strip_t), intent(in) :: strip(:)
      type(doubt_t), allocatable :: doubt(:)
      type(state_t) :: ahead
      type(system_t) :: system
      type(span_test_t), allocatable :: tests(:)
      integer :: k
      tests = run_span_tests(here%problem, here%state, max(here%system%force_scale, tiny(1.0_wp)))
      doubt = doubts_of(here%problem, here%state, strip, failing(tests))
      do k = 1, size(step_ahead) / 2
         if (size(doubt) > 0) return
         system = here%system
         call step_by(here, run%last%tangent, step_ahead(k), ahead, system, tests)
         if (allocated(tests)) doubt = doubts_of(here%problem, ahead, strip, failing(tests))
      end do
      if (size(doubt) == 0) doubt = all_doubts(here%problem, here%state, strip)
   end function places_in_doubt

   !> Tries the neighbours of the present set at the given places. If none of them is valid, their neighbours are tried, where their
   !> tests fail.
   subroutine look_at(run, here, doubt, part, search)
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: here            !! the present set, at the run's point
      type(doubt_t), intent(in) :: doubt(:)
      real(wp), intent(in) :: part                !! length of a new contact or free span / length of the strip
      type(search_t), intent(inout) :: search
      type(trial_t), allocatable :: from(:), failed(:)
      integer :: edits, k
      allocate (from(1))
      call copy_next(here, from(1)%set)
      from(1)%fails = doubt
      do edits = 1, most_edits
         allocate (failed(0))
         do k = 1, size(from)
            call edit(run, here, from(k), part, edits == 1, search, failed)
            if (search%located .and. size(search%way) > 0) return
         end do
         if (size(search%way) > 0) return
         call move_alloc(failed, from)
      end do
   end subroutine look_at

   !> Tries the neighbours of one set at the places where its tests fail.
   subroutine edit(run, here, from, part, first, search, failed)
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: here            !! the present set, at the run's point
      type(trial_t), intent(in) :: from           !! the set to be edited
      real(wp), intent(in) :: part                !! length of a new contact or free span / length of the strip
      logical, intent(in) :: first                !! true: `from` is the present set
      type(search_t), intent(inout) :: search
      type(trial_t), allocatable, intent(inout) :: failed(:) !! sets with an equilibrium whose tests fail
      type(neighbour_t), allocatable :: neighbour(:)
      type(trial_t) :: trial
      integer :: d, k
      logical :: found
      do d = 1, size(from%fails)
         if (from%fails(d)%strip == 0) cycle
         neighbour = neighbours_together(search%strip, on_strips(search%strip, present_contact_spans(from%set%problem, &
            & from%set%state)), from%fails, d, part)
         do k = 1, size(neighbour)
            call solve_neighbour(from%set%problem, from%set%state, run, search%load, search%strip, neighbour(k), trial%set, found)
            if (found) found = is_near(here, trial%set, search%load)
            if (.not. found) cycle
            call step_onward(run, here, trial%set, any(neighbour(k)%held > 0), first, search, trial%fails)
            if (search%located .and. size(search%way) > 0) return
            if (size(trial%fails) > 0 .and. size(failed) < most_failed) call append_trial(failed, trial)
         end do
      end do
   end subroutine edit

   !> Neighbours of a set at one of several places where its tests fail. If tests of the same kind fail at other places, for
   !> instance at mirror images, a neighbour with the same edit at all these places comes before the neighbour that is edited at one
   !> place.
   function neighbours_together(strip, set, doubt, d, part) result(all)
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: set(:)  !! contact set on strips
      type(doubt_t), intent(in) :: doubt(:)
      integer, intent(in) :: d                    !! index of the place
      real(wp), intent(in) :: part                !! length of a new contact or free span / length of the strip
      type(neighbour_t), allocatable :: all(:)
      type(neighbour_t), allocatable :: single(:), other(:)
      type(neighbour_t) :: both
      integer :: k, j
      allocate (all(0))
      single = at_place(set, d)
      do k = 1, size(single)
         both = single(k)
         do j = 1, size(doubt)
            if (j == d .or. doubt(j)%kind /= doubt(d)%kind .or. doubt(j)%kind == no_test .or. doubt(j)%strip == 0) cycle
            other = at_place(both%set, j)
            other = pack(other, other%edit == both%edit)
            ! Edits that remove a contact change the indices of contacts with prescribed places.
            if (size(other) == 0 .or. any(both%held > 0 .and. both%edit == edit_merge)) cycle
            both%set = other(min(count(single(:k)%edit == single(k)%edit), size(other)))%set
         end do
         if (size(both%set) /= size(single(k)%set) .or. .not. same_set(both%set, single(k)%set)) all = [all, both]
         all = [all, single(k)]
      end do

   contains

      function at_place(set, j) result(found)
         type(contact_span_t), intent(in) :: set(:)
         integer, intent(in) :: j
         type(neighbour_t), allocatable :: found(:)
         associate (on => strip(doubt(j)%strip))
            found = neighbours_at(set, doubt(j), on, min(part * on%length(), part_of_segment * minval(on%start(2:) - &
               & on%start(:size(on%start) - 1))), nearby * on%length())
         end associate
      end function at_place
   end function neighbours_together

   !> First increment of the load factor that the deck gives; 0 if the step controls a displacement.
   pure real(wp) function first_load(step)
      type(step_t), intent(in) :: step
      first_load = 0.0_wp
      if (step%method /= method_displacement) first_load = abs(step%increment)
   end function first_load

   !> True if an equilibrium is near enough to the run's point to be on the same path, by displacements and load factor.
   logical function is_near(here, next, least)
      type(next_t), intent(in) :: here, next
      real(wp), intent(in) :: least               !! least reference value for the change of the load factor
      real(wp), allocatable :: u(:, :)
      real(wp) :: change, whole
      u = displacement_between(next%problem, carried(here%problem, here%state, next%problem), next%state)
      change = maxval(abs(u(1:2, :)))
      whole = maxval(abs(here%state%u(1:2, :)))
      is_near = change <= another * next%problem%size .and. &
         & abs(next%state%load_factor - here%state%load_factor) <= farthest * max(abs(here%state%load_factor), least)
      ! Nothing may be displaced before the first change of contact.
      if (whole > rounding_gap(here%problem)) is_near = is_near .and. change <= farthest * whole
   end function is_near

   !> Steps from the equilibrium of a set along its path, and adds the set to the search if all its tests are satisfied there. The
   !> path is smooth where a new contact or free span begins with zero length, so such a set continues in the sense in which the
   !> path arrives at the run's point, and its tests decide at once, because the change is behind its equilibrium. Where a contact
   !> force or a gap vanishes the path has a kink, and both senses are tried: in the wrong one the tests fail. The distance grows as
   !> long as the failing tests rise, because on another mesh a set may become valid a little later.
   subroutine step_onward(run, here, next, sized, first, search, fails)
      type(path_state_t), intent(in) :: run
      type(next_t), intent(in) :: here
      type(next_t), intent(in) :: next            !! equilibrium of another set, from which the steps are made
      logical, intent(in) :: sized                !! true: the set has a prescribed length, see way_t
      logical, intent(in) :: first                !! true: the set differs from the present one by one edit
      type(search_t), intent(inout) :: search
      type(doubt_t), allocatable, intent(out) :: fails(:) !! places of failing tests; empty if the set was added
      type(way_t) :: way
      type(next_t) :: there                       !! the set at the end of a step
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: least
      integer :: k, sense
      allocate (fails(0))
      if (same_kind(here%problem, next%problem)) return
      call copy_next(next, way%base)
      call copy_next(next, there)
      way%sized = sized .or. .not. first
      way%heading = tangent_along(next, carried_field(here%problem, here%state, run%last%tangent%u, next%problem, &
         & carried(here%problem, here%state, next%problem)), run%last%tangent%load)
      if (sized .and. first .and. search%located) then
         if (.not. goes_on_smoothly(here, next, way%heading, search%pivots_tell)) return
      end if
      do sense = 1, merge(1, 2, sized .and. first)
         if (sense == 2) then
            way%heading%u = -way%heading%u
            way%heading%load = -way%heading%load
         end if
         tests = tests_of(next)
         least = worst(tests)
         if (sized .and. first .and. .not. any_fails(tests) .and. .not. penetrates(next%problem, tests)) then
            if (.not. (search%located .or. leads_to_next(here%problem, run, next))) cycle
            there%tangent = way%heading
            call append(search%way, way, there%path_point_t)
            return
         end if
         do k = 1, size(step_ahead)
            there%system = next%system
            call step_by(way%base, way%heading, step_ahead(k), there%state, there%system, tests)
            if (.not. allocated(tests)) exit
            if (.not. any_fails(tests)) then
               ! Newton's method may have found another path.
               if (.not. (search%located .or. leads_to_next(here%problem, run, there))) exit
               ! If the step comes nearer to the run's point, the new contact or free span becomes shorter.
               if (sized .and. .not. first) then
                  if (distance_from(here, there%problem, there%state) < distance_from(here, next%problem, next%state)) exit
               end if
               there%tangent = tangent_along(there, way%heading%u, way%heading%load)
               call append(search%way, way, there%path_point_t)
               deallocate (fails)
               allocate (fails(0))
               return
            end if
            if (size(fails) == 0) fails = doubts_of(next%problem, there%state, search%strip, failing(tests))
            if (worst(tests) <= least) exit
            least = worst(tests)
         end do
      end do
   end subroutine step_onward

   !> True if a set with a new contact or free span of a prescribed length continues the path at a located change smoothly: its
   !> equilibrium lies ahead, and no eigenvalue has changed its sign.
   logical function goes_on_smoothly(here, next, heading, pivots_tell) result(smoothly)
      type(next_t), intent(in) :: here, next
      type(path_tangent_t), intent(in) :: heading !! direction in which the path arrives at `here`, on the mesh of `next`
      logical, intent(in) :: pivots_tell          !! false: the stiffness is singular at `here`
      smoothly = .not. pivots_tell .or. next%system%negative_pivots == here%system%negative_pivots
      if (smoothly) smoothly = along(next, heading, displacement_between(next%problem, carried(here%problem, here%state, &
         & next%problem), next%state), next%state%load_factor - here%state%load_factor, here%state%load_factor) >= 0.0_wp
   end function goes_on_smoothly

   !> True if the gap of a free span beside a contact has the wrong sign. The gap of a span that just opened is smaller than the
   !> slack of its test.
   pure logical function penetrates(problem, tests)
      type(problem_t), intent(in) :: problem
      type(span_test_t), intent(in) :: tests(:)
      penetrates = any(tests%kind == test_vanishing .and. tests%value * problem%size < -rounding_gap(problem))
   end function penetrates

   !> Least value of the tests as a multiple of its slack; 0 if none is negative.
   pure real(wp) function worst(tests)
      type(span_test_t), intent(in) :: tests(:)
      worst = minval([0.0_wp, tests%value / max(test_slack(tests%kind), epsilon(worst))])
   end function worst

   !> Distance of an equilibrium from the run's point: displacements and load factor are both measured relative to their values at
   !> the run's point.
   real(wp) function distance_from(here, problem, state) result(distance)
      type(next_t), intent(in) :: here
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state          !! state of `problem`
      real(wp), allocatable :: u(:, :)
      real(wp) :: whole
      u = displacement_between(problem, carried(here%problem, here%state, problem), state)
      whole = max(metric(here%problem, here%state%u, here%state%u), epsilon(whole))
      distance = metric(problem, u, u) / whole + &
         & ((state%load_factor - here%state%load_factor) / max(abs(here%state%load_factor), tiny(whole)**0.25_wp))**2
      distance = sqrt(distance)
   end function distance_from

   !> True if two problems have the same point and line contacts; the places of touchdown points may differ.
   logical function same_kind(one, other) result(same)
      type(problem_t), intent(in) :: one, other
      type(strip_t), allocatable :: strip(:)
      type(contact_span_t), allocatable :: a(:), b(:)
      integer :: k, side
      strip = find_strips(one%layout)
      a = on_strips(strip, one%contact_span)
      b = on_strips(strip, other%contact_span)
      same = size(a) == size(b)
      if (.not. same) return
      do k = 1, size(a)
         same = same .and. a(k)%contact == b(k)%contact .and. a(k)%rod_segment == b(k)%rod_segment .and. (a(k)%line .eqv. b(k)%line)
         if (.not. same) return
         do side = 1, 2
            same = same .and. (strip(a(k)%rod_segment)%at_boundary(a(k)%at(side)) .eqv. &
               & strip(b(k)%rod_segment)%at_boundary(b(k)%at(side)))
         end do
      end do
   end function same_kind

   !> Follows the sets found over longer and longer distances until only one of them still satisfies its tests. `best` is its index,
   !> or that of the first one left if they cannot be separated; 0: no set was found.
   subroutine follow_further(search, best)
      type(search_t), intent(in) :: search
      integer, intent(out) :: best
      logical :: left(size(search%way)), goes(size(search%way))
      type(state_t) :: state
      type(system_t) :: system
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: distance
      integer :: k
      best = 0
      if (size(left) == 0) return
      left = .true.
      distance = step_ahead(2)
      do
         best = findloc(left, .true., 1)
         if (all([(same_kind(search%way(k)%base%problem, search%way(best)%base%problem) .or. &
            & .not. left(k), k=1, size(left))])) return
         distance = farther * distance
         if (distance > farthest) return
         goes = .false.
         do k = 1, size(left)
            if (.not. left(k)) cycle
            system = search%way(k)%base%system
            call step_by(search%way(k)%base, search%way(k)%heading, distance, state, system, tests)
            if (allocated(tests)) goes(k) = .not. any_fails(tests)
         end do
         if (.not. any(goes)) return
         left = goes
      end do
   end subroutine follow_further

   !> Appends a set to be edited further. Here and below the sets are copied by procedures for the reason given at copy_problem.
   subroutine append_trial(all, new)
      type(trial_t), allocatable, intent(inout) :: all(:)
      type(trial_t), intent(in) :: new
      type(trial_t), allocatable :: longer(:)
      integer :: k
      allocate (longer(size(all) + 1))
      do k = 1, size(all)
         call copy_trial(all(k), longer(k))
      end do
      call copy_trial(new, longer(size(longer)))
      call move_alloc(longer, all)
   end subroutine append_trial

   !> Copies a set to be edited further.
   subroutine copy_trial(from, to)
      type(trial_t), intent(in) :: from
      type(trial_t), intent(inout) :: to
      call copy_next(from%set, to%set)
      to%fails = from%fails
   end subroutine copy_trial

   !> Appends a set found.
   subroutine append(all, new, there)
      type(way_t), allocatable, intent(inout) :: all(:)
      type(way_t), intent(in) :: new
      type(path_point_t), intent(in) :: there     !! its equilibrium at which the tests are satisfied
      type(way_t), allocatable :: longer(:)
      integer :: k
      allocate (longer(size(all) + 1))
      do k = 1, size(all)
         call copy_way(all(k), longer(k))
      end do
      call copy_way(new, longer(size(longer)))
      longer(size(longer))%there = there
      call move_alloc(longer, all)
   end subroutine append

   !> Copies a set found.
   subroutine copy_way(from, to)
      type(way_t), intent(in) :: from
      type(way_t), intent(inout) :: to
      call copy_next(from%base, to%base)
      to%there = from%there
      to%heading = from%heading
      to%sized = from%sized
   end subroutine copy_way
end module contact_trials
