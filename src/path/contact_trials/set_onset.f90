!> Onset of a contact set: the point of the path at which the set becomes valid. The set is known at a point further along the path;
!> from there it is followed back, and the first zero of its tests is located as on any increment.
module set_onset
   use kinds, only: wp
   use model, only: step_t, method_load
   use problem, only: rounding_gap
   use tried_sets, only: change_place_t, before_closing
   use other_set, only: other_set_t, copy_other_set, go_to_load
   use test_kinds, only: span_test_t, any_fails, is_length
   use span_tests, only: least_length
   use converged_state, only: contact_holds
   use span_events, only: find_change
   use contact_change_types, only: step_interval_t, change_t, new_interval, change_located, place_within
   use state_transfer, only: carried
   use path_control, only: displacement_between, path_length, metric
   use path_continuity, only: path_tangent_t, path_tangent_at
   use step_off, only: tangent_along
   use path_point, only: path_point_t, evaluate_tests, evaluate_span_tests
   use path_state, only: path_state_t, copy_path_state, forget_mesh
   implicit none
   private
   public :: find_onset, go_back

   ! With half or twice each of these values none of 146 decks of the tests changes.
   real(wp), parameter :: onset_tolerance = 1.0e-3_wp !! tolerance of an onset / tolerance of an event: an onset is sought over many
   !! increments, an event on one
   integer, parameter :: most_halvings = 20 !! largest number of halvings of the load interval, which then has a millionth of its
   !! first length
   real(wp), parameter :: shorter = 0.1_wp !! least length of a new contact or free span at its onset, over the least length
   !! elsewhere (least_length): at the exact onset the length is zero

contains

   !> Moves a set from a point of its path back to its onset, which lies between the run's point and this point.
   subroutine find_onset(step, here, run, next, ahead)
      type(step_t), intent(in) :: step
      type(change_place_t), intent(in) :: here   !! with the present set
      type(path_state_t), intent(in) :: run      !! the last point at which the present set is known to be valid
      type(other_set_t), intent(inout) :: next !! in: the set at a point where its tests are satisfied, with its path tangent; out:
      !! at its onset, where its test `next%test` is zero; at the nearest valid point if this zero is not located
      logical, intent(out) :: ahead !! false: the set belongs to another path: it begins before the run's point, or is valid at the
      !! load of this point with another equilibrium
      type(path_state_t) :: back
      type(path_point_t) :: trial
      type(other_set_t) :: outside
      type(step_interval_t) :: interval
      type(change_t) :: change
      type(other_set_t) :: known
      type(step_t) :: fine
      logical :: closed                          ! true: the set lacks only free spans of the present set whose gap is rounding
      closed = here%situation == before_closing
      if (closed) closed = all(abs(here%closing%value) * here%problem%size <= rounding_gap(here%problem))
      ahead = .not. valid_elsewhere()
      call copy_other_set(next, known)
      call go_back(run%last%state%load_factor, next, outside)
      if (.not. allocated(outside%state%u)) then
         ahead = ahead .and. lies_ahead()
         return
      end if
      call copy_path_state(run, back)
      call forget_mesh(back)
      back%fresh = .false.
      back%control%method = method_load
      back%control%increment = outside%state%load_factor - next%state%load_factor
      back%last = next%path_point_t
      back%last%tangent = heading(next)
      call evaluate_tests(next%problem, back%last)
      trial = outside%path_point_t
      trial%tangent = heading(outside)
      call evaluate_tests(next%problem, trial)
      call evaluate_span_tests(next%problem, trial)
      interval = new_interval(next%problem, back, trial, .false.)
      fine = step
      fine%locate_tolerance = onset_tolerance * step%locate_tolerance
      call find_change(next%problem, fine, back, interval, change)
      if (change%kind == change_located .and. change%where == place_within) then
         next%path_point_t = change%point
         next%test = change%which
      else if (change%kind == change_located .and. is_length(interval%before(change%which)%kind)) then
         ! A length is too short for a mesh before it is zero: the nearest valid point is the onset, but for the least length.
         next%test = change%which
      else
         ! Newton's method may not converge where a contact osculates, that is, where the rod is as curved as its obstacle.
         call go_back(outside%state%load_factor, next)
      end if
      next%tangent = tangent_along(next, displacement_between(next%problem, next%state, known%state), &
         & known%state%load_factor - next%state%load_factor)
      ahead = ahead .and. lies_ahead()

   contains

      !> True if the path reaches the load of the set after the run's point, not before it.
      pure logical function lies_ahead()
         lies_ahead = (next%state%load_factor - run%last%state%load_factor) * run%last%tangent%load >= 0.0_wp
      end function lies_ahead

      !> True if the set is valid at the load of the run's point, with another equilibrium. If the sets differ only by closed spans,
      !> their equilibrium is the same, but for the errors of their meshes. Equilibria then count as different only if they differ
      !> by more than the accuracy that the deck asks for.
      logical function valid_elsewhere() result(elsewhere)
         type(other_set_t) :: there
         type(span_test_t), allocatable :: tests(:)
         real(wp) :: same
         call copy_other_set(next, there)
         call go_to_load(there, run%last%state%load_factor, tests)
         elsewhere = allocated(tests)
         if (elsewhere) elsewhere = .not. any_fails(tests) .and. contact_holds(there%problem, there%state, there%system)
         if (.not. elsewhere) return
         associate (on => there%problem, u => there%state%u)
            same = rounding_gap(on) * sqrt(sum(on%weight))
            if (closed) same = max(same, min(step%asked, step%asked_of_path) * sqrt(metric(on, u, u)))
            elsewhere = path_length(on, carried(here%problem, run%last%state, on), there%state) > same
         end associate
      end function valid_elsewhere

      !> Path tangent of the set at a point, in the sense from its valid point to the point where it fails.
      function heading(at) result(tangent)
         type(other_set_t), intent(in) :: at
         type(path_tangent_t) :: tangent
         tangent = path_tangent_at(at%problem, at%system, displacement_between(next%problem, next%state, outside%state), &
            & outside%state%load_factor - next%state%load_factor)
      end function heading
   end subroutine find_onset

   !> Moves the next set from a point of its path back towards a load factor, as far as the set is valid, by halving the load
   !> interval. At the change itself a new contact or free span has zero length, so a shorter length than elsewhere is valid there.
   subroutine go_back(to, next, outside)
      real(wp), intent(in) :: to
      type(other_set_t), intent(inout) :: next !! in: the next set at a point further along its path; out: at the point farthest
      !! back that was found valid
      type(other_set_t), intent(out), optional :: outside !! the set at an equilibrium before its onset, where a test fails; its
      !! state is not allocated if none was found. If this argument is present, the interval is halved only until such an
      !! equilibrium is found
      real(wp) :: fails                    ! load factor at which the set fails
      integer :: try
      logical :: valid
      call test_at(to)
      if (valid) return
      do try = 1, most_halvings
         if (present(outside)) then
            if (allocated(outside%state%u)) return
         end if
         call test_at(0.5_wp * (fails + next%state%load_factor))
      end do

   contains

      !> Tries the set at a load factor. If it is valid there, `next` moves to this equilibrium; otherwise the load is kept in
      !> `fails`, and an equilibrium at which a test fails in `outside`.
      subroutine test_at(load)
         real(wp), intent(in) :: load
         type(span_test_t), allocatable :: tests(:)
         type(other_set_t) :: there
         call copy_other_set(next, there)
         call go_to_load(there, load, tests)
         valid = allocated(tests)
         if (valid .and. present(outside)) then
            if (any_fails(tests)) call copy_other_set(there, outside)
         end if
         if (valid) then
            where (is_length(tests%kind))
               tests%value = tests%value + (1.0_wp - shorter) * least_length(next%problem, tests) / next%problem%size
            end where
            valid = .not. any_fails(tests) .and. contact_holds(there%problem, there%state, there%system)
         end if
         if (valid) call copy_other_set(there, next)
         if (.not. valid) fails = load
      end subroutine test_at
   end subroutine go_back
end module set_onset
