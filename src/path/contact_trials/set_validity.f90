!> Verification of a contact set: whether the path continues with it. A set is valid if all its tests are satisfied at its first
!> equilibrium or a short step along its path (step_off), and if this path is the run's. What is checked depends on the situation in
!> which the set is sought (tried_sets) and on whether the set has a new contact or free span of prescribed length (n):
!>
!>   check              condition                                              kink  smooth  closing  no increment
!>   moves_little       the rod moves no more than a path can                   x      x        x          x
!>   goes_on_smoothly   its equilibrium is ahead; no pivot has changed sign     n      n
!>   gaps_are_open      free spans are open, new ones by more than rounding     n      n        n          n
!>   complement_grows   a contact that began is pressed, an open gap grows      x
!>   on_path            within reach of the last increment, or ahead                            x          x
!>   contact_holds      contacts of nodes have the right sign                                   x          x
!>   onset              the set begins ahead of the point (set_onset)                           x       if it turns
!>   senses tried       along the path and back                                 2      1 (*)    2          2 (n: 1)
!>
!> (*) 2 for a set that holds a contact at an end (end_onset), where the path has a kink, too.
!>
!> A set with a new length makes no kink: the path has the same tangent before and after the change. The path therefore continues
!> with this set in the same sense, and the set is judged by its tests at its own equilibrium after the change. Where a contact
!> force, a gap, a couple or a free span vanishes the path has a kink, and both senses are tried: in the wrong one the tests fail.
!> If the structure is stable with an open gap, the load goes on when the gap closes, because the rate complementarity problem then
!> has one solution; only this sense is tried.
!>
!> The step along the set's path is made longer as long as the failing tests rise, because on another mesh a set may become valid a
!> little later.
module set_validity
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t
   use neighbours, only: edit_part, edit_open, edit_end_off, edit_rise
   use tried_sets, only: change_place_t, tried_set_t, at_smooth_change, before_closing
   use complement_growth, only: complement_grows
   use state_transfer, only: carried, carried_field
   use path_control, only: displacement_between, path_length
   use converged_state, only: contact_holds
   use path_continuity, only: path_tangent_t
   use path_state, only: path_state_t
   use step_control, only: largest_growth, least_part
   use test_kinds, only: span_test_t, any_fails, test_slack, test_force, test_pressure, test_vanishing, test_couple, test_slope
   use other_set, only: other_set_t, copy_other_set, tests_of
   use reachability, only: leads_to_next
   use set_onset, only: find_onset
   use step_off, only: tangent_along, along, step_by, failing
   implicit none
   private
   public :: moves_little, verify, load_changes, is_far_enough, step_ahead

   ! Half and twice each of these values change no run of a sample of the tests, but for one: with twice `farthest` this run takes a
   ! set of another path. Displacement as a share of the structure's size:
   real(wp), parameter :: another = 3.0e-3_wp     !! an equilibrium farther from the run's point is on another path
   ! Path lengths as shares of the total displacement, or of the load factor if nothing is displaced (step_off):
   real(wp), parameter :: step_ahead(3) = [1.0e-4_wp, 1.0e-3_wp, 1.0e-2_wp]  !! distances from the equilibrium at which
   !! the tests decide whether a set is valid
   real(wp), parameter :: farthest = 0.2_wp  !! largest relative change of the load factor from the run's point to another set

   real(wp), parameter :: beyond_zero = 1.1_wp !! length of the next step / distance at which the tests are zero by extrapolation: a
   !! tenth further on they are positive
   real(wp), parameter :: like_increment = 0.9_wp !! load change from a located change to an equilibrium / load change up to the end
   !! of the increment on which it was located: from such an equilibrium, increments of the same length converge

contains

   !> True if an equilibrium is near enough to be on the same path: displacements and load factor differ by less than fixed bounds
   !> from those of the run's point, or of the equilibrium of the present set beyond the change.
   logical function moves_little(here, next)
      type(change_place_t), intent(in) :: here
      type(other_set_t), intent(in) :: next
      moves_little = moves_little_from(here%state)
      if (.not. moves_little .and. allocated(here%beyond)) moves_little = moves_little_from(here%beyond)

   contains

      logical function moves_little_from(state) result(near)
         type(state_t), intent(in) :: state      !! equilibrium of the present set
         real(wp), allocatable :: u(:, :)
         real(wp) :: change, whole, reach
         u = displacement_between(next%problem, carried(here%problem, state, next%problem), next%state)
         reach = farthest * max(abs(state%load_factor), here%least_load)
         if (here%at_change()) reach = max(reach, largest_growth * here%least_load)
         change = maxval(abs(u(1:2, :)))
         whole = maxval(abs(state%u(1:2, :)))
         if (allocated(here%beyond)) whole = max(whole, maxval(abs(here%beyond%u(1:2, :))))
         near = change <= another * next%problem%size .and. abs(next%state%load_factor - state%load_factor) <= reach
         ! Nothing may be displaced before the first change of contact.
         if (whole > rounding_gap(here%problem)) near = near .and. change <= farthest * max(whole, here%travelled)
      end function moves_little_from
   end function moves_little

   !> Finds out whether a set is valid, and in which sense the path continues with it.
   subroutine verify(step, run, here, trial)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(inout) :: trial       !! in: set with its equilibrium, its edits and whether it is sized
      integer :: sense
      logical :: decides                          ! true: the tests at the set's own equilibrium decide, because it lies apart from
      ! the change: after one edit, with a new length or at the end of the increment that failed
      decides = (trial%sized .or. trial%at_failed_load) .and. trial%edits == 1
      trial%valid = .false.
      trial%passes_limit = .false.
      if (allocated(trial%fails)) deallocate (trial%fails)
      associate (set => trial%set)
         set%tangent = tangent_along(set, carried_field(here%problem, here%state, here%tangent%u, set%problem, &
            & carried(here%problem, here%state, set%problem)), here%tangent%load)
         if (here%at_change() .and. (decides .or. any(trial%edit == [edit_open, edit_end_off]))) then
            if (here%zero(1)%kind == test_slope) then
               ! The path has a corner where a contact leaves an end: it goes on in the sense in which the new length grows.
               set%tangent = tangent_along(set, displacement_between(set%problem, carried(here%problem, here%state, &
                  & set%problem), set%state), set%state%load_factor - here%state%load_factor)
            else if (.not. goes_on_smoothly(here, set)) then
               return
            end if
         end if
         ! A set at its onset at an end (end_onset) is behind a corner of the path.
         do sense = 1, merge(1, 2, decides .or. (here%situation == at_smooth_change .and. set%test == 0))
            if (sense == 2) call reverse(set%tangent)
            trial%turns = sense == 2
            if (decides) call verify_at_equilibrium(here, trial)
            if (.not. trial%valid) call verify_onward(run, here, decides, trial)
            if (trial%valid) exit
         end do
         if (trial%valid .and. .not. here%at_change()) call begin_at_onset(step, run, here, trial)
      end associate
   end subroutine verify

   !> Marks a set as valid if its tests are satisfied at its equilibrium.
   subroutine verify_at_equilibrium(here, trial)
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(inout) :: trial
      type(span_test_t), allocatable :: tests(:)
      tests = tests_of(trial%set)
      trial%valid = .not. any_fails(tests)
      if (trial%valid) trial%valid = gaps_are_open(here, trial, trial%set, tests)
      if (.not. trial%valid) return
      trial%passes_limit = here%situation == at_smooth_change .and. trial%set%tangent%load * &
         & here%tangent%load < 0.0_wp
      trial%there = trial%set%path_point_t
   end subroutine verify_at_equilibrium

   !> Marks a set as valid if its tests are satisfied a short step along its path. Notes the tests that fail at the first step.
   subroutine verify_onward(run, here, decides, trial)
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here
      logical, intent(in) :: decides              !! true: the tests at the set's equilibrium decide
      type(tried_set_t), intent(inout) :: trial   !! with its path tangent
      type(other_set_t) :: there
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: least, before                   ! least value of the tests at the last step and at the set's first equilibrium
      real(wp) :: distance, onset                 ! from the first equilibrium: to the step's end, and to where tests should pass
      integer :: k
      associate (set => trial%set)
         call copy_other_set(set, there)
         before = worst(tests_of(set))
         least = before
         onset = 0.0_wp
         do k = 1, size(step_ahead)
            there%system = set%system
            distance = max(step_ahead(k), onset)
            call step_by(set, set%tangent, distance, there%state, there%system, tests)
            if (.not. allocated(tests)) return
            if (.not. any_fails(tests)) then
               if (decides) then
                  if (.not. gaps_are_open(here, trial, there, tests)) return
               end if
               ! Where no change is located, a contact at a node may have the wrong sign of force or gap here, but the right sign
               ! further along the path: a longer step is tried.
               if (.not. (here%at_change() .or. contact_holds(there%problem, there%state, there%system))) cycle
               trial%valid = complement_grows(here, trial, there)
               if (trial%valid) trial%valid = on_path(run, here, there)
               if (.not. trial%valid) return
               there%tangent = tangent_along(there, set%tangent%u, set%tangent%load)
               trial%there = there%path_point_t
               if (.not. here%at_change()) set%path_point_t = there%path_point_t
               return
            end if
            if (.not. allocated(trial%fails)) then
               trial%fails = failing(tests)
               trial%fails_at = there%state
            end if
            if (worst(tests) <= least) return
            ! The set without a closing span may begin far ahead. Its tests rise linearly, which gives the length of the next step.
            if (here%situation == before_closing) onset = beyond_zero * distance * before / (before - worst(tests))
            least = worst(tests)
         end do
      end associate
   end subroutine verify_onward

   !> Reverses the sense of a path tangent.
   pure subroutine reverse(tangent)
      type(path_tangent_t), intent(inout) :: tangent
      tangent%u = -tangent%u
      tangent%load = -tangent%load
   end subroutine reverse

   !> Moves the first equilibrium of a valid set to the set's onset. A set without a closing free span is sought before a test
   !> fails, so it must begin ahead. A set with which the path turns back must begin ahead, too, because the path has not passed its
   !> onset yet.
   subroutine begin_at_onset(step, run, here, trial)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(inout) :: trial
      type(other_set_t) :: nearer
      type(span_test_t), allocatable :: tests(:)
      logical :: ahead
      integer :: k
      call find_onset(step, here, run, trial%set, ahead)
      if (here%situation == before_closing .or. trial%turns) trial%valid = ahead
      if (.not. trial%valid) return
      ! The path goes on from a point nearer to the onset, if there is one.
      associate (set => trial%set, there => trial%there)
         call copy_other_set(set, nearer)
         do k = 1, size(step_ahead)
            nearer%system = set%system
            call step_by(set, set%tangent, step_ahead(k), nearer%state, nearer%system, tests)
            if (.not. allocated(tests)) return
            if (abs(nearer%state%load_factor - set%state%load_factor) >= abs(there%state%load_factor - set%state%load_factor)) &
               & return
            if (any_fails(tests)) cycle
            nearer%tangent = tangent_along(nearer, set%tangent%u, set%tangent%load)
            there = nearer%path_point_t
            return
         end do
      end associate
   end subroutine begin_at_onset

   !> True if an equilibrium lies on the run's path, and not on another one that Newton's method has found: it belongs to a located
   !> change, or is no further than the longest next increment, or lies ahead in the direction of the path (reachability). Other
   !> paths may be near: a stocky column beside a wall is displaced along its axis by much more than it bends.
   logical function on_path(run, here, there)
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here
      type(other_set_t), intent(in) :: there
      on_path = here%at_change()
      if (.not. on_path) on_path = path_length(there%problem, carried(here%problem, here%state, there%problem), there%state) <= &
         & largest_growth * run%last_length
      if (.not. on_path) on_path = leads_to_next(here%problem, run, there)
   end function on_path

   !> True if a set with a new contact or free span of a prescribed length continues the path at a located change smoothly: its
   !> equilibrium lies ahead, and no eigenvalue has changed its sign from that at the change.
   logical function goes_on_smoothly(here, next) result(smoothly)
      type(change_place_t), intent(in) :: here
      type(other_set_t), intent(in) :: next  !! with its path tangent, in the direction in which the path arrives at `here`
      smoothly = .not. here%pivots_are_reliable() .or. next%system%negative_pivots == here%system%negative_pivots
      if (smoothly) smoothly = along(next, next%tangent, displacement_between(next%problem, carried(here%problem, here%state, &
         & next%problem), next%state), next%state%load_factor - here%state%load_factor, here%state%load_factor) >= 0.0_wp
   end function goes_on_smoothly

   !> True if no gap of a free span beside a contact has the wrong sign. The gap of a span that just opened is smaller than the
   !> slack of its test. This gap must nevertheless be larger than rounding: a rod that lies along a straight obstacle between two
   !> points without force has no free span there. The gap may be as small as rounding only if the load has changed since the
   !> contact force in the span's place became tensile, because gap and contact force are complementary.
   logical function gaps_are_open(here, trial, next, tests) result(open)
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(in) :: trial
      type(other_set_t), intent(in) :: next  !! the set at its first equilibrium, or a short step further
      type(span_test_t), intent(in) :: tests(:)   !! tests of the set at this equilibrium
      real(wp) :: least
      least = -rounding_gap(next%problem)
      if (any(trial%edit == [edit_part, edit_open, edit_end_off, edit_rise])) then
         if (.not. (lifts_off(here) .and. load_changes(here, trial%set))) least = -least
      end if
      open = .not. any(tests%kind == test_vanishing .and. tests%value * next%problem%size < least)
   end function gaps_are_open

   !> True if a contact force of a line is zero at a located change.
   pure logical function lifts_off(here)
      type(change_place_t), intent(in) :: here
      lifts_off = here%at_change()
      if (lifts_off) lifts_off = any(here%zero(1)%kind == [test_force, test_pressure, test_couple])
   end function lifts_off

   !> True if the load factor differs from that of the run's point by more than the smallest increment.
   pure logical function load_changes(here, next)
      type(change_place_t), intent(in) :: here
      type(other_set_t), intent(in) :: next
      load_changes = abs(next%state%load_factor - here%state%load_factor) > least_part * here%least_load
   end function load_changes

   !> True if an equilibrium is so far from the change that increments of the present length converge from it. This is required
   !> where a line contact lifts off: its free span must be about as long as that at the end of the increment.
   pure logical function is_far_enough(here, next)
      type(change_place_t), intent(in) :: here
      type(other_set_t), intent(in) :: next
      is_far_enough = .true.
      if (lifts_off(here) .and. allocated(here%beyond)) is_far_enough = abs(next%state%load_factor - &
         & here%state%load_factor) >= like_increment * abs(here%beyond%load_factor - here%state%load_factor)
   end function is_far_enough

   !> Least value of the tests, each divided by the slack of its kind; 0 if no test is negative.
   pure real(wp) function worst(tests)
      type(span_test_t), intent(in) :: tests(:)
      worst = minval([0.0_wp, tests%value / max(test_slack(tests%kind), epsilon(worst))])
   end function worst

end module set_validity
