!> Places at which a contact set may be wrong and is to be edited (contact_trials): those of its failing tests, or the ends of all
!> its contacts.
module edit_places
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t
   use span_candidates, only: present_contact_spans, touch_place
   use line_pressure, only: pressure_t, sample_line
   use track_nodes, only: node_track
   use rod_state, only: state_t, candidate_offset
   use obstacle_track, only: joint_distance
   use test_kinds, only: span_test_t, test_gap, test_force, test_curvature, test_pressure, test_length, test_vanishing, &
      & test_boundary_span, test_slope, test_leaving, test_couple, test_slack, well_below
   use rod_strips, only: strip_t, on_strips, strip_place, coincide
   use neighbours, only: edit_place_t
   implicit none
   private
   public :: places_of_tests, places_of_contacts

contains

   !> Place of each given test: strip and coordinate along it. A strip is a sequence of rod segments (rod_strips). A contact at a
   !> boundary of two segments has a test in each segment, but counts as one place.
   function places_of_tests(problem, state, strip, tests, scale, beyond) result(edit_place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(strip_t), intent(in) :: strip(:)
      type(span_test_t), intent(in) :: tests(:)  !! the failing tests
      real(wp), intent(in) :: scale              !! scale of forces
      type(state_t), intent(in), optional :: beyond !! equilibrium of the same set further along the path
      type(edit_place_t), allocatable :: edit_place(:)
      type(contact_span_t), allocatable :: now(:)
      type(edit_place_t), allocatable :: zones(:)
      integer :: k
      real(wp) :: at
      now = present_contact_spans(problem, state)
      allocate (zones(0))
      allocate (edit_place(size(tests)))
      do k = 1, size(tests)
         associate (test => tests(k))
            edit_place(k)%kind = test%kind
            edit_place(k)%value = test%value
            select case (test%kind)
            case (test_gap)
               edit_place(k)%contact = test%contact
               call strip_place(strip, test%rod_segment, test%at, edit_place(k)%strip, edit_place(k)%at)
            case (test_vanishing)
               edit_place(k)%contact = test%contact
               edit_place(k)%beside = merge(now(max(test%beside, 1))%number, 0, test%beside > 0)
               call strip_place(strip, test%rod_segment, 0.5_wp * sum(test%ends), edit_place(k)%strip, edit_place(k)%at)
            case (test_force, test_curvature, test_slope, test_leaving, test_couple)
               at = touch_place(problem, state, test%candidate)
               if (test%kind == test_leaving) at = at + test%at
               call strip_place(strip, now(test%contact_span)%rod_segment, at, edit_place(k)%strip, edit_place(k)%at)
               edit_place(k)%beyond = present(beyond)
               ! Beside a joint of the obstacle, a point contact can spread only up to the joint.
               if (test%kind == test_curvature) edit_place(k)%room = joint_distance(problem%model%obstacle(problem%candidates% &
                  & obstacle(test%candidate)), -candidate_offset(problem, state, problem%candidates, test%candidate), &
                  & node_track(problem, state, test%candidate))
            case (test_pressure)
               zones = [zones, pulled_zones(problem, state, strip, now(test%contact_span), test%contact_span, scale, beyond)]
            case (test_length)
               call strip_place(strip, test%rod_segment, test%at, edit_place(k)%strip, edit_place(k)%at)
            case (test_boundary_span)
               at = now(test%contact_span)%at(merge(2, 1, test%sense > 0.0_wp))
               call strip_place(strip, now(test%contact_span)%rod_segment, at, edit_place(k)%strip, edit_place(k)%at)
            end select
         end associate
      end do
      edit_place = [pack(edit_place, tests%kind /= test_pressure), zones]
      edit_place = pack(edit_place, [(.not. any(same_place(edit_place(:k - 1), edit_place(k))), k=1, size(edit_place))])

   contains

      !> True if two tests are of the same kind and belong to the same place.
      impure elemental logical function same_place(one, other) result(same)
         type(edit_place_t), intent(in) :: one, other
         same = one%kind == other%kind .and. one%contact == other%contact .and. one%strip == other%strip .and. other%strip > 0
         if (same) same = coincide(strip(other%strip), one%at, other%at)
      end function same_place
   end function places_of_tests

   !> Places of the ends of all contacts of a state, along the rod strips.
   function places_of_contacts(problem, state, strip) result(edit_place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(strip_t), intent(in) :: strip(:)
      type(edit_place_t), allocatable :: edit_place(:)
      type(contact_span_t), allocatable :: set(:)
      integer :: k
      set = on_strips(strip, present_contact_spans(problem, state))
      allocate (edit_place(0))
      do k = 1, size(set)
         edit_place = [edit_place, edit_place_t(contact=set(k)%contact, strip=set(k)%rod_segment, at=set(k)%at(1))]
         if (set(k)%line) edit_place = [edit_place, edit_place_t(contact=set(k)%contact, strip=set(k)%rod_segment, at=set(k)%at(2))]
      end do
   end function places_of_contacts

   !> Zones of a line contact without compressive force, sorted by their least force. Each zone surrounds a local minimum of the
   !> force by length.
   function pulled_zones(problem, state, strip, line, number, scale, beyond) result(zone)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(strip_t), intent(in) :: strip(:)
      type(contact_span_t), intent(in) :: line   !! line contact with its ends in the present state
      integer, intent(in) :: number              !! its index into the contact spans
      real(wp), intent(in) :: scale              !! scale of forces
      type(state_t), intent(in), optional :: beyond !! equilibrium further along the path, where the zones have tensile force
      type(edit_place_t), allocatable :: zone(:)
      type(contact_span_t), allocatable :: now(:)
      type(pressure_t) :: pressure
      logical, allocatable :: least(:)
      real(wp), allocatable :: at(:)             ! coordinates along the rod segment
      real(wp) :: nothing                        ! force by length that counts as zero
      integer :: i, k, n
      pressure = sample_line(problem, state, line)
      n = size(pressure%at)
      nothing = well_below * test_slack(test_pressure) * scale / problem%size
      least = pressure%density <= [pressure%density(1), pressure%density(:n - 1)] .and. pressure%density < &
         & [pressure%density(2:), huge(scale)]
      least = least .and. pressure%density <= nothing
      least(minloc(pressure%density, 1)) = .true.
      allocate (zone(count(least)), at(count(least)))
      do i = 1, size(zone)
         k = minloc(pressure%density, 1, mask=least)
         least(k) = .false.
         at(i) = pressure%at(k)
         zone(i)%kind = test_pressure
         call strip_place(strip, line%rod_segment, at(i), zone(i)%strip, zone(i)%at)
      end do
      if (present(beyond)) then
         now = present_contact_spans(problem, beyond)
         ! The zone keeps its relative place in the line contact, whose ends may have moved.
         associate (there => now(number))
            at = there%at(1) + (at - line%at(1)) * (there%at(2) - there%at(1)) / (line%at(2) - line%at(1))
            pressure = sample_line(problem, beyond, there)
         end associate
      end if
      zone%width = [(0.5_wp * pulled_length(at(i)), i=1, size(zone))]
      ! If the force of a zone is not tensile at the equilibrium `beyond`, no span opens there; only the first zone is kept in any
      ! case.
      if (present(beyond)) zone = pack(zone, zone%width > 0.0_wp .or. [(i == 1, i=1, size(zone))])
      zone%beyond = present(beyond)
      zone%whole = 2.0_wp * zone%width >= pressure%at(size(pressure%at)) - pressure%at(1)
      ! If the force is tensile all along the line at the end of the increment, the length of the zone says nothing about the length
      ! of the span that opens first.
      where (zone%whole) zone%width = 0.0_wp
      ! The width is a share of the line contact, which may be much longer at the equilibrium `beyond`: the width is scaled to the
      ! line here.
      zone%width = zone%width * (line%at(2) - line%at(1)) / (pressure%at(size(pressure%at)) - pressure%at(1))

   contains

      !> Length of the zone of tensile force around a place.
      real(wp) function pulled_length(at) result(length)
         real(wp), intent(in) :: at
         integer :: first, last
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
   end function pulled_zones
end module edit_places
