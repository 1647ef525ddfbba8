!> Finds the next contact set by trials. Each neighbour of the present set, that is, a set that differs from it by one edit
!> (neighbours), is brought into equilibrium with a prescribed length of the new contact or free span (set_trial). The set is kept
!> if all its tests are satisfied at this equilibrium or a short step further along the path (set_validity). The kind of the failing
!> test gives the order of the edits; the set is valid if its tests are satisfied and its path continues that of the run.
!>
!> If no set remains after one edit, a second edit is made where the tests of the edited set fail. The first set that is valid is
!> taken; where a free span vanishes, the valid set that begins first is taken.
module contact_trials
   use kinds, only: wp
   use model, only: step_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use contact_spans, only: contact_span_t, initial_share
   use contact_set_edits, only: same_set
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, any_fails, test_slack
   use other_set, only: other_set_t, copy_other_set, tests_of, go_to_load
   use path_state, only: path_state_t
   use edit_labels, only: counted, set_label, contacts_of
   use rod_strips, only: strip_t, on_strips, strip_place, same_kind
   use neighbours, only: edit_place_t, neighbour_t, neighbours_at, edit_merge, may_close_span, no_test
   use edit_places, only: places_of_tests, places_of_contacts
   use set_trial, only: solve_neighbour
   use tried_sets, only: change_place_t, tried_set_t, next_set_t, copy_trial, append, before_closing, no_increment
   use set_validity, only: moves_little, verify, load_changes, is_far_enough, step_ahead
   use step_off, only: step_by, failing, tangent_along
   implicit none
   private
   public :: try_sets, neighbours_of

   ! With half or twice each of these values no run of a sample of the tests changes, except for most_edits. Lengths as shares of
   ! the length of the rod strip, a sequence of rod segments (rod_strips):
   real(wp), parameter :: first_length(6) = [10.0_wp, 2.5_wp, 1.25_wp, 50.0_wp, 0.3_wp, 0.06_wp] * initial_share !! prescribed
   !! lengths of a new contact or free span, in the order in which they are tried
   real(wp), parameter :: nearby = first_length(1) !! contacts within this distance of a failing test are edited
   real(wp), parameter :: longest = 0.25_wp       !! longest new contact or free span / shortest rod segment, or length of the strip
   real(wp), parameter :: growth = 5.0_wp !! factor by which the length of a new span is increased until increments can go on from
   !! the change

   integer, parameter :: most_edits = 2 !! largest number of edits between the present set and a tried set: a contact beside the
   !! first edit may end or begin at once
   integer, parameter :: most_failed = 8 !! largest number of failed sets whose neighbours are tried, too; sets of the likeliest
   !! edits come first

contains

   !> Finds the contact set with which the path continues.
   subroutine try_sets(step, run, here, next)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here    !! the present set, at the place from which another set is sought
      type(next_set_t), intent(out) :: next
      type(edit_place_t), allocatable :: edit_place(:)
      type(tried_set_t), allocatable :: valid(:)
      type(tried_set_t) :: trial                  ! the set found
      integer :: best
      edit_place = places_to_edit(here)
      call try_edits(step, run, here, edit_place, first_length, valid, next%too_far)
      next%found = size(valid) > 0
      if (.not. next%found) return
      best = 1
      if (here%situation == before_closing) then
         best = first_to_begin(run%last%state%load_factor, valid)
      else if (decided(here, valid)) then
         best = size(valid)
      end if
      call copy_trial(valid(best), trial)
      associate (first => next%first, onward => next%onward)
         call copy_other_set(trial%set, first)
         if (here%at_change()) then
            call pass_zeros(trial, first)
            call enlarge(step, run, here, edit_place, trial)
            call copy_other_set(trial%set, onward)
            onward%problem%contact_span%number = first%problem%contact_span%number
            call pass_zeros(trial, onward)
         else
            call copy_other_set(trial%set, onward)
            onward%path_point_t = trial%there
         end if
         onward%label = '  '
         onward%test = 0
      end associate

   contains

      !> Moves the set a short step further if tests fail at its equilibrium: these tests are zero before the step's end, where the
      !> stiffness may be singular.
      subroutine pass_zeros(trial, set)
         type(tried_set_t), intent(in) :: trial
         type(other_set_t), intent(inout) :: set
         if (any_fails(tests_of(set))) set%path_point_t = trial%there
      end subroutine pass_zeros
   end subroutine try_sets

   !> Enlarges the new contact or free span of a set until the path can continue from the set's equilibrium. First its length is
   !> increased until the load factor has changed by the smallest increment: the length of a span that opens in a line contact may
   !> be proportional to a small power of the load change, so that it is long before the load has changed noticeably. From there on
   !> the load is prescribed.
   subroutine enlarge(step, run, here, edit_place, trial)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here    !! the present set, at a located change
      type(edit_place_t), intent(in) :: edit_place(:)
      type(tried_set_t), intent(inout) :: trial   !! the set found
      type(tried_set_t), allocatable :: larger(:)
      real(wp) :: length
      logical :: too_far
      length = first_length(trial%length)
      do while (trial%sized .and. .not. load_changes(here, trial%set))
         length = growth * length
         if (length > longest) return
         call try_edits(step, run, here, edit_place, [length], larger, too_far)
         if (size(larger) == 0) return
         if (larger(1)%passes_limit .or. .not. same_kind(trial%set%problem%layout, &
            & larger(1)%set%problem%contact_span, trial%set%problem%contact_span)) return
         call copy_trial(larger(1), trial)
      end do
      if (trial%sized) call follow_by_load(here, trial)
   end subroutine enlarge

   !> Follows the path of a set with load steps of growing size until it reaches an equilibrium from which increments of the usual
   !> size can continue.
   subroutine follow_by_load(here, trial)
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(inout) :: trial
      type(other_set_t) :: farther
      type(span_test_t), allocatable :: tests(:)
      real(wp) :: change
      associate (load => here%state%load_factor)
         do while (.not. is_far_enough(here, trial%set))
            call copy_other_set(trial%set, farther)
            change = growth * (farther%state%load_factor - load)
            if (abs(change) > abs(here%beyond%load_factor - load)) change = here%beyond%load_factor - load
            call go_to_load(farther, load + change, tests)
            if (.not. allocated(tests)) return
            if (any_fails(tests) .or. .not. moves_little(here, farther)) return
            farther%tangent = tangent_along(farther, farther%tangent%u, farther%tangent%load)
            call copy_other_set(farther, trial%set)
            trial%there = farther%path_point_t
         end do
      end associate
   end subroutine follow_by_load

   !> Places at which the present set is edited. At a located change these are the places of the tests that are zero; before free
   !> spans vanish, the places of these spans. Otherwise they are the places of the tests that fail at the point or, if no test
   !> fails there, a short step ahead. If no test fails there either, or no equilibrium is found, they are the ends of all contacts.
   function places_to_edit(here) result(edit_place)
      type(change_place_t), intent(in) :: here    !! the present set
      type(edit_place_t), allocatable :: edit_place(:)
      type(state_t) :: ahead
      type(system_t) :: system
      type(span_test_t), allocatable :: tests(:)
      integer :: k
      associate (problem => here%problem, strip => here%strip, scale => here%system%force_scale)
         if (here%at_change()) then
            edit_place = places_of_tests(problem, here%state, strip, here%zero, scale, here%beyond)
         else if (here%situation == before_closing) then
            edit_place = places_of_tests(problem, here%state, strip, here%closing, scale)
         else
            edit_place = places_of_tests(problem, here%state, strip, failing(tests_of(here%other_set_t)), scale)
            do k = 1, 2
               if (size(edit_place) > 0) return
               system = here%system
               call step_by(here%other_set_t, here%tangent, step_ahead(k), ahead, system, tests)
               if (allocated(tests)) edit_place = places_of_tests(problem, ahead, strip, failing(tests), system%force_scale)
            end do
            if (size(edit_place) == 0) edit_place = places_of_contacts(problem, here%state, strip)
         end if
      end associate
   end function places_to_edit

   !> Tries the neighbours of the present set at the given places. If no neighbour is valid, each of them is edited once more where
   !> its tests fail.
   subroutine try_edits(step, run, here, edit_place, length, valid, too_far)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here    !! the present set
      type(edit_place_t), intent(in) :: edit_place(:)
      real(wp), intent(in) :: length(:)           !! lengths of a new contact or free span that are tried / length of the strip
      type(tried_set_t), allocatable, intent(out) :: valid(:) !! the sets found
      logical, intent(out) :: too_far             !! true: the end of the increment is too far away to serve as a first guess
      type(tried_set_t), allocatable :: from(:), failed(:)
      integer :: edits, k
      too_far = .false.
      allocate (valid(0), from(1))
      call copy_other_set(here%other_set_t, from(1)%set)
      do edits = 1, merge(1, most_edits, here%situation == before_closing)
         allocate (failed(0))
         do k = 1, size(from)
            if (edits == 1) call edit(step, run, here, from(k), edit_place, length, valid, failed, too_far)
            if (edits > 1) call edit(step, run, here, from(k), places_of_tests(from(k)%set%problem, from(k)%fails_at, &
               & here%strip, from(k)%fails, from(k)%set%system%force_scale), length, valid, failed, too_far)
            if (decided(here, valid)) return
         end do
         if (size(valid) > 0) return
         call move_alloc(failed, from)
      end do
   end subroutine try_edits

   !> Tries the neighbours of one set, by edits at the given places.
   subroutine edit(step, run, here, from, edit_place, length, valid, failed, too_far)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here    !! the present set
      type(tried_set_t), intent(in) :: from           !! the set to be edited
      type(edit_place_t), intent(in) :: edit_place(:)
      real(wp), intent(in) :: length(:)           !! lengths of a new contact or free span that are tried / length of the strip
      type(tried_set_t), allocatable, intent(inout) :: valid(:)
      type(tried_set_t), allocatable, intent(inout) :: failed(:) !! sets with an equilibrium whose tests fail
      logical, intent(inout) :: too_far           !! true: the end of the increment is too far away to serve as a first guess
      type(neighbour_t), allocatable :: neighbour(:)
      integer :: d, k, try
      do d = 1, size(edit_place)
         if (edit_place(d)%strip == 0) cycle
         neighbour = neighbours_together(here%strip, on_strips(here%strip, present_contact_spans(from%set%problem, &
            & from%set%state)), edit_place, d, length)
         do k = 1, size(neighbour)
            if (here%situation == before_closing .and. .not. may_close_span(neighbour(k)%edit)) cycle
            ! Where a free span vanishes, neighbours of prescribed length are tried only if no other neighbour is valid.
            if (here%situation == before_closing .and. any(neighbour(k)%held > 0) .and. size(valid) > 0) cycle
            ! Where no increment converges, a set without new length may be valid only from the end of the failed increment on, or
            ! there alone: a support on the obstacle has laid the rod down.
            do try = 1, merge(2, 1, allocated(here%failed_load) .and. all(neighbour(k)%held == 0))
               call try_neighbour(step, run, here, from, neighbour(k), edit_place(d)%beside, try == 2, valid, failed, too_far)
               if (decided(here, valid)) return
            end do
         end do
      end do
   end subroutine edit

   !> Finds an equilibrium of a neighbour and finds out whether it is valid. A valid one is appended to the sets found.
   subroutine try_neighbour(step, run, here, from, neighbour, beside, at_failed_load, valid, failed, too_far)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here    !! the present set
      type(tried_set_t), intent(in) :: from           !! the set that was edited
      type(neighbour_t), intent(in) :: neighbour
      integer, intent(in) :: beside(2)            !! numbers of the contacts beside the place of the edit (edit_place_t)
      logical, intent(in) :: at_failed_load       !! true: at the load of the end of the increment that failed
      type(tried_set_t), allocatable, intent(inout) :: valid(:)
      type(tried_set_t), allocatable, intent(inout) :: failed(:) !! sets with an equilibrium whose tests fail
      logical, intent(inout) :: too_far           !! true: the end of the increment is too far away to serve as a first guess
      type(tried_set_t) :: trial
      logical :: found
      trial%at_failed_load = at_failed_load
      call solve_neighbour(here, from, neighbour, trial, found)
      if (found) found = moves_little(here, trial%set)
      too_far = too_far .or. (neighbour%beyond .and. .not. found)
      if (found) found = .not. same_kind(here%problem%layout, here%problem%contact_span, trial%set%problem%contact_span)
      if (found) found = .not. is_among(trial, valid)
      if (.not. found) return
      trial%sized = any(neighbour%held > 0)
      trial%edits = from%edits + 1
      trial%count = counted(from%count, here%strip, neighbour%edit, neighbour%parent, beside, contacts_of(here%strip, &
         & from%set%problem, from%set%state), contacts_of(here%strip, trial%set%problem, trial%set%state))
      call set_label(trial%count, trial%set)
      trial%edit = merge(neighbour%edit, from%edit, from%edits == 0)
      trial%length = neighbour%length
      call verify(step, run, here, trial)
      if (trial%valid) then
         call append(valid, trial)
      else if (allocated(trial%fails) .and. size(failed) < most_failed) then
         if (.not. is_among(trial, failed)) call append(failed, trial)
      end if
   end subroutine try_neighbour

   !> True if a set is found with which the path goes on, so that no further set need be tried. Where a free span vanishes, all sets
   !> are tried, because only then it is known which begins first. Where no increment converges, a set with which the path turns
   !> back is taken only if no other is valid. A set behind a limit point is taken only if no shorter length gives an equilibrium
   !> before the limit point.
   pure logical function decided(here, valid)
      type(change_place_t), intent(in) :: here
      type(tried_set_t), intent(in) :: valid(:)   !! the sets found so far
      decided = size(valid) > 0 .and. here%situation /= before_closing
      if (.not. decided) return
      associate (last => valid(size(valid)))
         decided = .not. (last%passes_limit .or. (last%turns .and. here%situation == no_increment))
      end associate
   end function decided

   !> True if a set of the same kind is in a list, with an equilibrium that is not behind a limit point. Sets of the same kind may
   !> still differ: which of two contacts has ended, or which of two free spans has closed, is shown by the numbers that the edits
   !> leave to contacts.
   logical function is_among(trial, list)
      type(tried_set_t), intent(in) :: trial
      type(tried_set_t), intent(in) :: list(:)
      logical :: same
      integer :: k
      is_among = .false.
      do k = 1, size(list)
         associate (one => trial%set%problem%contact_span, other => list(k)%set%problem%contact_span)
            same = same_kind(trial%set%problem%layout, one, other) .and. .not. list(k)%passes_limit
            is_among = is_among .or. (same .and. same_numbers(one, other))
         end associate
      end do
   end function is_among

   !> True if every contact of one set has the number of a contact of the other set, and the other way round.
   pure logical function same_numbers(one, other) result(same)
      type(contact_span_t), intent(in) :: one(:), other(:)
      integer :: k
      same = all([(any(other%number == one(k)%number), k=1, size(one))]) .and. all([(any(one%number == other(k)%number), &
         & k=1, size(other))])
   end function same_numbers

   !> Neighbours of a set at one of several places where its tests fail. If tests of the same kind fail at other places, for
   !> instance at mirror images, a neighbour with the same edit at all these places comes first. Then places are left out, those
   !> first whose tests are farthest from failing: they may fail only by the error of the present mesh. Last comes the neighbour
   !> that is edited at one place only.
   function neighbours_together(strip, set, edit_place, d, length) result(all)
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: set(:)  !! contact set on strips
      type(edit_place_t), intent(in) :: edit_place(:)
      integer, intent(in) :: d                    !! index of the place that is edited in any case
      real(wp), intent(in) :: length(:)           !! lengths of a new contact or free span that are tried / length of the strip
      type(neighbour_t), allocatable :: all(:)
      type(neighbour_t), allocatable :: single(:), other(:)
      type(neighbour_t) :: both
      logical :: alike(size(edit_place))          ! places that are edited together with place d
      integer :: k, j
      allocate (all(0))
      single = neighbours_of(strip, set, edit_place(d), length)
      do k = 1, size(single)
         alike = edit_place%kind == edit_place(d)%kind .and. edit_place%kind /= no_test .and. edit_place%strip > 0
         alike(d) = .false.
         do while (any(alike))
            both = single(k)
            do j = 1, size(edit_place)
               if (.not. alike(j)) cycle
               other = neighbours_of(strip, both%set, edit_place(j), length)
               other = pack(other, other%edit == both%edit)
               ! Edits that remove a contact change the indices of contacts with prescribed places.
               if (size(other) == 0 .or. any(both%held > 0 .and. both%edit == edit_merge)) cycle
               both%set = other(min(count(single(:k)%edit == single(k)%edit), size(other)))%set
            end do
            if (size(both%set) /= size(single(k)%set) .or. .not. same_set(both%set, single(k)%set)) all = [all, both]
            associate (farthest => maxval(edit_place%value, mask=alike))
               if (.not. farthest > edit_place(d)%value) exit
               alike = alike .and. edit_place%value < farthest - test_slack(edit_place(d)%kind)
            end associate
         end do
         all = [all, single(k)]
      end do
   end function neighbours_together

   !> Neighbours of a set at a place where a test fails.
   function neighbours_of(strip, set, edit_place, length) result(found)
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: set(:)  !! contact set on strips
      type(edit_place_t), intent(in) :: edit_place          !! the place, on a strip
      real(wp), intent(in) :: length(:)           !! lengths of a new contact or free span that are tried / length of the strip
      type(neighbour_t), allocatable :: found(:)
      associate (on => strip(edit_place%strip))
         found = neighbours_at(set, edit_place, on, min(length * on%length(), edit_place%room, longest * &
            & minval(on%start(2:) - on%start(:size(on%start) - 1))), nearby * on%length())
      end associate
   end function neighbours_of

   !> Index of the set that begins nearest to a load factor. Of sets that begin together, for instance those of mirror images, the
   !> first in the list is taken.
   pure integer function first_to_begin(load, valid) result(best)
      real(wp), intent(in) :: load
      type(tried_set_t), intent(in) :: valid(:)
      real(wp) :: distance(size(valid))
      integer :: k
      distance = [(abs(valid(k)%set%state%load_factor - load), k=1, size(valid))]
      best = findloc(distance <= (1.0_wp + step_ahead(1)) * minval(distance), .true., 1)
   end function first_to_begin

end module contact_trials
