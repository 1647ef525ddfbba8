!> Data of the search for another contact set: the point of the path from which the search starts, in one of four situations; each
!> set that is tried, with its equilibrium and the result of its tests; and the set with which the path continues. The points of a
!> set along its path, away from the change:
!>
!>     change ---------- first ------------ there -------------------- onward
!>     here%state        trial%set          trial%there                next%onward
!>     the present       the new length     short step further,        further still: increments of the run's length
!>     set ends          is prescribed      where all tests pass       converge from here
!>
!> `here%beyond` is on the path of the present set: the end of the increment, where one of its tests fails.
module tried_sets
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use rod_strips, only: strip_t, find_strips
   use path_point, only: path_point_t
   use path_state, only: path_state_t, difference_load
   use test_kinds, only: span_test_t, test_gap, test_force, test_curvature, test_vanishing, test_couple
   use other_set, only: other_set_t, copy_other_set
   use edit_labels, only: edit_count_t
   implicit none
   private
   public :: change_place_t, new_change_place, tried_set_t, copy_trial, append, next_set_t
   public :: at_kink, at_smooth_change, before_closing, no_increment

   ! Situations in which another contact set is sought.
   integer, parameter :: at_kink = 1          !! at a located change where a gap, the force of a point, a couple or a free span
   !! vanishes: gap and force are complementary, and the path turns sharply
   integer, parameter :: at_smooth_change = 2 !! at a located change of another kind: a new contact or free span begins with zero
   !! length, and the path has the same tangent with both sets
   integer, parameter :: before_closing = 3   !! before or at a point at which free spans vanish
   integer, parameter :: no_increment = 4     !! at a point from which no increment converges

   !> The run's point, from which another contact set is sought.
   type, extends(other_set_t) :: change_place_t
      real(wp) :: least_load = 0.0_wp             !! smallest unit in which changes of the load factor are measured
      real(wp) :: small_load = 0.0_wp             !! small change of the load factor, for finite differences
      real(wp) :: locate_tolerance = 0.0_wp       !! relative tolerance of load factors at located places
      real(wp) :: travelled = 0.0_wp !! length of the path up to this point, as a displacement: it may be large although the
      !! structure is back where it was
      integer :: situation = no_increment         !! at_kink, at_smooth_change, before_closing or no_increment
      type(span_test_t), allocatable :: zero(:) !! tests that are zero at a located change; the test by which it was located comes
      !! first
      type(span_test_t), allocatable :: closing(:) !! tests of the free spans that vanish; only in the situation
      !! before_closing
      type(strip_t), allocatable :: strip(:)      !! strips of the structure, along which contact sets are edited
      integer :: spans_begun = 0                  !! last number given to a contact span
      type(state_t), allocatable :: beyond        !! equilibrium of the present set beyond the change, where a test fails
      real(wp), allocatable :: failed_load !! load factor at the end of the increment that does not converge; not allocated:
      !! unknown, because the load is not prescribed
   contains
      procedure :: at_change
      procedure :: pivots_are_reliable
   end type change_place_t

   !> A contact set that is tried, with an equilibrium.
   type :: tried_set_t
      type(other_set_t) :: set !! the set at its first equilibrium, in which a new contact or free span has a prescribed length; the
      !! path tangent points onward
      type(contact_span_t), allocatable :: edited(:) !! the contact set on strips, as the edit has made it
      logical :: sized = .false.                  !! true: a length is prescribed
      logical :: at_failed_load = .false.         !! true: the first equilibrium is at the end of the increment that failed
      integer :: edits = 0                        !! edits by which the set differs from the present one
      integer :: edit = 0                         !! the first of these edits (neighbours)
      type(edit_count_t) :: count                 !! contacts gained and lost by these edits
      integer :: length = 1                       !! index of the prescribed length
      logical :: valid = .false.
      logical :: turns = .false.                  !! valid: the path turns back with this set
      logical :: passes_limit = .false.           !! valid: a limit point lies between the change and the first equilibrium
      type(path_point_t) :: there                 !! valid: equilibrium at which the tests are satisfied, a short step further
      type(span_test_t), allocatable :: fails(:)  !! not valid: the tests that fail
      type(state_t) :: fails_at                   !! not valid: the state at which these tests fail
   end type tried_set_t

   !> The contact set with which the path continues.
   type :: next_set_t
      logical :: found = .false.                  !! false: no set was found, and `first` and `onward` are undefined
      logical :: too_far = .false. !! true: the end of the increment is too far away to serve as a first guess: a set has no
      !! equilibrium near the change from there. On a shorter increment it may have
      type(other_set_t) :: first !! first equilibrium of the set, labelled as a change of contact. At a located change, all tests of
      !! the set are satisfied at this equilibrium; otherwise it is the set's onset
      type(other_set_t) :: onward !! equilibrium further along the path, where all tests of the set are satisfied and from which
      !! increments can go on; it has no label and may be equal to `first`
   end type next_set_t

contains

   !> The place from which another contact set is sought: a located change (`zero`), a point at which or soon after which free spans
   !> vanish (`closing`), or, without both arguments, a point from which no increment converges.
   function new_change_place(problem, step, run, point, zero, beyond, closing, reach) result(here)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step            !! step of the deck; its first increment serves as a scale of load changes
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: point     !! on the path of the present set, at the run's point or further on
      type(span_test_t), intent(in), optional :: zero(:) !! tests that are zero at the point, if the change is located there
      type(state_t), allocatable, intent(in), optional :: beyond !! equilibrium of the present set further along the path; not
      !! allocated: none is known
      type(span_test_t), intent(in), optional :: closing(:) !! tests of free spans that are about to vanish
      real(wp), intent(in), optional :: reach     !! size of the increment that does not converge
      type(change_place_t) :: here
      here%problem = problem
      here%path_point_t = point
      here%least_load = abs(run%last_load)
      if (step%method /= method_displacement) here%least_load = max(here%least_load, abs(step%increment))
      here%small_load = difference_load(run)
      here%locate_tolerance = step%locate_tolerance
      here%travelled = run%arc_length * problem%size
      here%spans_begun = run%spans_begun
      here%strip = find_strips(problem%layout)
      if (present(beyond)) then
         if (allocated(beyond)) here%beyond = beyond
      end if
      if (present(closing)) then
         here%situation = before_closing
         here%closing = closing
      else if (present(zero)) then
         here%situation = at_smooth_change
         if (any(zero(1)%kind == [test_gap, test_force, test_vanishing, test_couple])) here%situation = at_kink
         here%zero = zero
      else if (present(reach) .and. run%control%method == method_load) then
         here%failed_load = point%state%load_factor + sign(reach, run%control%increment)
      end if
   end function new_change_place

   !> True if the change is located at this point.
   pure logical function at_change(here)
      class(change_place_t), intent(in) :: here
      at_change = any(here%situation == [at_kink, at_smooth_change])
   end function at_change

   !> True if the signs of the pivots of the present set's stiffness are certain. An osculating contact may move along the rod
   !> without change of force, so that rounding decides the sign of a pivot.
   pure logical function pivots_are_reliable(here)
      class(change_place_t), intent(in) :: here   !! at a located change
      pivots_are_reliable = here%zero(1)%kind /= test_curvature
   end function pivots_are_reliable

   !> Copies a trial. A procedure, because the compiler would expand the copies of all components at each assignment.
   subroutine copy_trial(from, to)
      type(tried_set_t), intent(in) :: from
      type(tried_set_t), intent(inout) :: to
      call copy_other_set(from%set, to%set)
      to%edited = from%edited
      to%sized = from%sized
      to%at_failed_load = from%at_failed_load
      to%edits = from%edits
      to%edit = from%edit
      to%count = from%count
      to%length = from%length
      to%valid = from%valid
      to%turns = from%turns
      to%passes_limit = from%passes_limit
      to%there = from%there
      if (allocated(to%fails)) deallocate (to%fails)
      if (allocated(from%fails)) to%fails = from%fails
      to%fails_at = from%fails_at
   end subroutine copy_trial

   !> Appends a set to a list.
   subroutine append(all, new)
      type(tried_set_t), allocatable, intent(inout) :: all(:)
      type(tried_set_t), intent(in) :: new
      type(tried_set_t), allocatable :: longer(:)
      integer :: k
      allocate (longer(size(all) + 1))
      do k = 1, size(all)
         call copy_trial(all(k), longer(k))
      end do
      call copy_trial(new, longer(size(longer)))
      call move_alloc(longer, all)
   end subroutine append
end module tried_sets
