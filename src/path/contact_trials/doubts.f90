!> Places at which a contact set may be wrong and is to be edited (contact_trials): those of its failing tests, or the ends of all
!> its contacts.
module doubts
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t
   use span_candidates, only: present_contact_spans, touch_place
   use line_pressure, only: pressure_t, sample_line
   use conforming_span, only: node_track
   use rod_state, only: state_t, candidate_offset
   use obstacle_track, only: joint_distance
   use test_kinds, only: span_test_t, test_gap, test_force, test_curvature, test_pressure, test_length, test_vanishing, &
      & test_crossing, test_slope, test_leaving, test_couple
   use rod_strips, only: strip_t, on_strips, strip_place, coincide
   use neighbours, only: doubt_t
   implicit none
   private
   public :: doubts_of, all_doubts

contains

   !> Places along the rod strips to which the given tests of a state belong. A contact at a boundary of rod segments has tests on
   !> both sides, but it is one place.
   function doubts_of(problem, state, strip, tests) result(doubt)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(strip_t), intent(in) :: strip(:)
      type(span_test_t), intent(in) :: tests(:)  !! the failing tests
      type(doubt_t), allocatable :: doubt(:)
      type(contact_span_t), allocatable :: now(:)
      integer :: k
      real(wp) :: at
      now = present_contact_spans(problem, state)
      allocate (doubt(size(tests)))
      do k = 1, size(tests)
         associate (test => tests(k))
            doubt(k)%kind = test%kind
            select case (test%kind)
            case (test_gap)
               doubt(k)%contact = test%contact
               call strip_place(strip, test%rod_segment, test%at, doubt(k)%strip, doubt(k)%at)
            case (test_vanishing)
               doubt(k)%contact = test%contact
               call strip_place(strip, test%rod_segment, 0.5_wp * sum(test%ends), doubt(k)%strip, doubt(k)%at)
            case (test_force, test_curvature, test_slope, test_leaving, test_couple)
               at = touch_place(problem, state, test%candidate)
               call strip_place(strip, now(test%contact_span)%rod_segment, at, doubt(k)%strip, doubt(k)%at)
               ! Beside a joint of the obstacle a point contact spreads up to the joint.
               if (test%kind == test_curvature) doubt(k)%room = joint_distance(problem%model%obstacle(problem%candidates% &
                  & obstacle(test%candidate)), -candidate_offset(problem, state, problem%candidates, test%candidate), &
                  & node_track(problem, state, test%candidate))
            case (test_pressure)
               call strip_place(strip, now(test%contact_span)%rod_segment, test%at, doubt(k)%strip, doubt(k)%at)
               doubt(k)%width = 0.5_wp * pulled_length(problem, state, now(test%contact_span), test%at)
            case (test_length)
               call strip_place(strip, test%rod_segment, test%at, doubt(k)%strip, doubt(k)%at)
            case (test_crossing)
               at = now(test%contact_span)%at(merge(2, 1, test%sense > 0.0_wp))
               call strip_place(strip, now(test%contact_span)%rod_segment, at, doubt(k)%strip, doubt(k)%at)
            end select
         end associate
      end do
      doubt = pack(doubt, [(.not. any(same_place(doubt(:k - 1), doubt(k))), k=1, size(doubt))])

   contains

      !> True if tests of the same kind belong to the same place.
      impure elemental logical function same_place(one, other) result(same)
         type(doubt_t), intent(in) :: one, other
         same = one%kind == other%kind .and. one%contact == other%contact .and. one%strip == other%strip .and. other%strip > 0
         if (same) same = coincide(strip(other%strip), one%at, other%at)
      end function same_place
   end function doubts_of

   !> Places of the ends of all contacts of a state, along the rod strips.
   function all_doubts(problem, state, strip) result(doubt)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(strip_t), intent(in) :: strip(:)
      type(doubt_t), allocatable :: doubt(:)
      type(contact_span_t), allocatable :: set(:)
      integer :: k
      set = on_strips(strip, present_contact_spans(problem, state))
      allocate (doubt(0))
      do k = 1, size(set)
         doubt = [doubt, doubt_t(contact=set(k)%contact, strip=set(k)%rod_segment, at=set(k)%at(1))]
         if (set(k)%line) doubt = [doubt, doubt_t(contact=set(k)%contact, strip=set(k)%rod_segment, at=set(k)%at(2))]
      end do
   end function all_doubts

   !> Length of the zone of tensile contact force around a place of a line contact.
   real(wp) function pulled_length(problem, state, line, at) result(length)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line   !! line contact with its ends in the present state
      real(wp), intent(in) :: at                 !! coordinate along the rod segment
      type(pressure_t) :: pressure
      integer :: first, last
      pressure = sample_line(problem, state, line)
      first = minloc(abs(pressure%at - at), 1)
      last = first
      do while (first > 1)
         if (pressure%density(first) >= 0.0_wp) exit
         first = first - 1
      end do
      do while (last < size(pressure%at))
         if (pressure%density(last) >= 0.0_wp) exit
         last = last + 1
      end do
      length = pressure%at(last) - pressure%at(first)
   end function pulled_length
end module doubts
