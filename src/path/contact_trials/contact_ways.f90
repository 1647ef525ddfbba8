!> Ways on from a point at which several contacts begin, or end, at once.
!>
!> Gaps and contact forces are complementary: behind the change each of these contacts either stays open, with a gap that grows, or
!> is closed, with a force that grows. This rate complementarity problem has one solution in a stable structure. If the structure
!> with the contacts open is unstable, the problem may have several, for instance where an antisymmetric column meets two walls: it
!> rests on both, or turns towards one of the walls. All sets are tried; those whose path satisfies all tests are solutions.
module contact_ways
   use model, only: step_t
   use contact_spans, only: contact_span_t, initial_share
   use span_candidates, only: present_contact_spans
   use test_kinds, only: test_gap, test_force
   use other_set, only: other_set_t, copy_other_set
   use path_state, only: path_state_t
   use rod_strips, only: strip_t, on_strips, same_kind
   use neighbours, only: edit_place_t, neighbour_t, edit_add, edit_remove
   use edit_places, only: places_of_tests
   use set_trial, only: solve_neighbour
   use tried_sets, only: change_place_t, tried_set_t, append
   use set_validity, only: moves_little, verify
   use contact_trials, only: neighbours_of
   implicit none
   private
   public :: other_ways

   integer, parameter :: most_together = 4 !! largest number of contacts that are combined: each contact doubles the number of sets

contains

   !> Finds the contact sets with which the path may go on from a located change, except the set with which the run goes on.
   subroutine other_ways(step, run, here, taken, way)
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(change_place_t), intent(in) :: here    !! place of the located change, with the present set
      type(other_set_t), intent(in) :: taken      !! the set with which the run goes on
      type(tried_set_t), allocatable, intent(out) :: way(:) !! the other sets, all valid
      type(edit_place_t), allocatable :: edit_place(:)
      type(contact_span_t), allocatable :: now(:) ! present contact set on strips
      type(neighbour_t) :: neighbour
      type(tried_set_t) :: from, trial
      integer :: subset, k
      logical :: found
      allocate (way(0))
      associate (problem => here%problem, zero => here%zero, strip => here%strip)
         if (all(zero(1)%kind /= [test_gap, test_force]) .or. count(zero%kind == zero(1)%kind) < 2) return
         edit_place = places_of_tests(problem, here%state, strip, pack(zero, zero%kind == zero(1)%kind), here%system%force_scale)
         edit_place = pack(edit_place, edit_place%strip > 0)
         if (size(edit_place) < 2 .or. size(edit_place) > most_together) return
         call copy_other_set(here%other_set_t, from%set)
         now = on_strips(strip, present_contact_spans(problem, here%state))
         do subset = 1, 2**size(edit_place) - 1
            call edit_all(strip, now, pack(edit_place, [(btest(subset, k - 1), k=1, size(edit_place))]), neighbour, found)
            if (found) call solve_neighbour(here, from, neighbour, trial, found)
            if (found) found = moves_little(here, trial%set) .and. .not. same_kind(problem%layout, taken%problem%contact_span, &
               & trial%set%problem%contact_span)
            if (.not. found) cycle
            trial%edits = 1
            trial%edit = neighbour%edit
            call verify(step, run, here, trial)
            if (trial%valid) call append(way, trial)
         end do
      end associate
   end subroutine other_ways

   !> Makes the set in which all the given contacts have begun, or have ended.
   subroutine edit_all(strip, set, edit_place, neighbour, found)
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: set(:)  !! contact set on strips
      type(edit_place_t), intent(in) :: edit_place(:)       !! places of these contacts
      type(neighbour_t), intent(out) :: neighbour
      logical, intent(out) :: found               !! false: no set results from these edits
      type(neighbour_t), allocatable :: one(:)
      integer :: k
      neighbour%edit = merge(edit_add, edit_remove, edit_place(1)%kind == test_gap)
      neighbour%set = set
      do k = 1, size(edit_place)
         one = neighbours_of(strip, neighbour%set, edit_place(k), [initial_share])
         one = pack(one, one%edit == neighbour%edit)
         found = size(one) > 0
         if (.not. found) return
         neighbour%set = one(1)%set
      end do
   end subroutine edit_all
end module contact_ways
