!> Equilibrium of a neighbour of the present contact set, that is, a set that differs from it by one edit (neighbours). The places
!> of the ends beside a new contact or free span are prescribed, and the load factor is unknown: near a new contact of zero length,
!> or a free span that just opens, the load hardly changes with the length, so that the load does not determine the equilibrium, but
!> the length does. An edit without a new contact or free span (a contact ends, a free span closes) has no length to prescribe: its
!> equilibrium is sought at the same load factor or, where the path is smooth, in the plane normal to the path.
module set_trial
   use kinds, only: wp
   use run_end, only: give_up_for_end
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: numbered
   use span_candidates, only: touch_place, present_contact_spans
   use touchdown_points, only: carry_forces
   use state_transfer, only: carried_field
   use path_control, only: control_t, metric
   use path_continuity, only: path_tangent_t, normal_plane
   use bordered_system, only: linearise
   use sized_equilibrium, only: solve_sized
   use other_set, only: other_set_t, new_other_set, find_equilibrium
   use rod_strips, only: strip_t, on_segments, strip_place, brought_near
   use beginning_contacts, only: release
   use neighbours, only: neighbour_t, edit_add
   use end_onset, only: go_to_end_onset
   use tried_sets, only: change_place_t, tried_set_t, at_smooth_change
   implicit none
   private
   public :: solve_neighbour

   ! With half or twice each of these values no run of a sample of the tests changes.
   real(wp), parameter :: unbalanced = 1.0e-6_wp !! largest relative residual of an equilibrium, far above that of the corrector
   real(wp), parameter :: difference = 1.0e-4_wp !! step for finite differences, as a share of a load increment

contains

   !> Finds the equilibrium of a neighbour of a contact set. None is found once the run must end: the mesh of each of the many
   !> neighbours would take longer than the equilibrium that is then given up.
   subroutine solve_neighbour(here, from, neighbour, trial, found)
      type(change_place_t), intent(in) :: here   !! the run's point, with its path tangent
      type(tried_set_t), intent(in) :: from      !! the set that is edited, at its equilibrium, which is the first guess
      type(neighbour_t), intent(in) :: neighbour
      type(tried_set_t), intent(inout) :: trial  !! in: `at_failed_load`; out: the neighbour's equilibrium, its system factored
      !! there
      logical, intent(out) :: found
      type(contact_span_t), allocatable :: contact_span(:)
      type(control_t) :: plane
      integer :: ends(2)
      logical :: first, free
      found = .not. give_up_for_end()
      if (.not. found) return
      first = from%edits == 0
      associate (next => trial%set, problem => from%set%problem, state => from%set%state)
         trial%edited = numbered(neighbour%set, max(here%spans_begun, maxval([0, neighbour%set%number])))
         call on_segments(here%strip, problem%covered, trial%edited, contact_span, found)
         if (.not. found) return
         next = new_other_set(problem, state, contact_span)
         if (trial%at_failed_load) next%state%load_factor = here%failed_load
         call carry_forces(problem, state, next%problem, next%state)
         if (all(neighbour%held == 0)) then
            found = .not. neighbour%beyond
            if (found) call find_equilibrium(next, found, plane_at(here, next))
            if (.not. found .and. first .and. allocated(here%beyond)) then
               ! Where no force acts at the change, the place of a free span is undetermined: the equilibrium beyond the change is
               ! the guess.
               contact_span = moved_beyond(here, next%problem%contact_span)
               found = .not. any_overlap(contact_span)
               if (.not. found) return
               next = new_other_set(problem, here%beyond, contact_span)
               call find_equilibrium(next, found)
            end if
            if (found .and. first .and. here%at_change() .and. neighbour%edit == edit_add) &
               & call release(next, here%spans_begun + 1, free)
            if (found .and. first .and. here%at_change()) call go_to_end_onset(here, next)
         else
            ends = held_ends(next, here%strip, neighbour)
            found = any(ends > 0)
            if (.not. found) return
            plane = plane_at(here, next)
            call solve_sized(next%problem, ends, next%system, plane, difference * distance_at(here, plane), next%state, found)
         end if
         if (.not. found) return
         call linearise(next%problem, next%state, next%state, next%system)
         ! A state found with fixed touchdown points may need forces that free touchdown points cannot carry.
         found = next%system%ok .and. max(next%system%force_residual, next%system%defect_residual) <= unbalanced
      end associate
   end subroutine solve_neighbour

   !> Contact spans of a neighbour, carried to the equilibrium beyond the change: each end keeps its relative place on the present
   !> contact span on which it lies.
   function moved_beyond(here, contact_span) result(moved)
      type(change_place_t), intent(in) :: here
      type(contact_span_t), intent(in) :: contact_span(:)
      type(contact_span_t), allocatable :: moved(:), before(:), after(:)
      real(wp) :: part
      integer :: k, i, j
      before = present_contact_spans(here%problem, here%state)
      after = present_contact_spans(here%problem, here%beyond)
      moved = contact_span
      do k = 1, size(moved)
         do i = 1, 2
            do j = 1, size(before)
               if (before(j)%rod_segment /= moved(k)%rod_segment .or. before(j)%contact /= moved(k)%contact) cycle
               if (contact_span(k)%at(i) < before(j)%at(1) .or. contact_span(k)%at(i) > before(j)%at(2)) cycle
               part = 0.0_wp
               if (before(j)%line) part = (contact_span(k)%at(i) - before(j)%at(1)) / (before(j)%at(2) - before(j)%at(1))
               moved(k)%at(i) = after(j)%at(1) + part * (after(j)%at(2) - after(j)%at(1))
            end do
         end do
      end do
   end function moved_beyond

   !> True if two contacts with one obstacle share a place of a rod segment: an end has moved past another contact.
   pure logical function any_overlap(contact_span) result(overlap)
      type(contact_span_t), intent(in) :: contact_span(:)
      integer :: k, j
      overlap = .false.
      do k = 1, size(contact_span)
         do j = 1, k - 1
            associate (one => contact_span(j), other => contact_span(k))
               overlap = overlap .or. (one%rod_segment == other%rod_segment .and. one%contact == other%contact .and. &
                  & one%at(1) <= other%at(2) .and. other%at(1) <= one%at(2))
            end associate
         end do
      end do
   end function any_overlap

   !> Plane in which the equilibrium of another set is sought: normal to the path tangent at the run's point where the path is
   !> smooth. At a kink, a sharp turn of the path, the tangent says nothing about the path of the other set; the plane is then one
   !> of constant load.
   function plane_at(here, next) result(plane)
      type(change_place_t), intent(in) :: here
      type(other_set_t), intent(in) :: next
      type(control_t) :: plane
      type(path_tangent_t) :: heading
      plane%method = method_load
      if (here%situation == at_smooth_change) then
         heading%u = carried_field(here%problem, here%state, here%tangent%u, next%problem, next%state)
         heading%load = here%tangent%load
         plane = normal_plane(next%problem, next%state, heading)
      end if
      ! Rounding errors are judged relative to the whole displacement or load.
      plane%whole = next%state%load_factor
      if (plane%method /= method_load) plane%whole = sqrt(metric(next%problem, next%state%u, next%state%u))
   end function plane_at

   !> Distance between two neighbouring planes of `plane_at`, for finite differences: from one to the next the load factor changes
   !> by a typical increment. Where the planes are normal to the path tangent, the distance is at most the norm of the
   !> displacements.
   real(wp) function distance_at(here, plane) result(distance)
      type(change_place_t), intent(in) :: here
      type(control_t), intent(in) :: plane
      distance = here%least_load
      if (plane%method == method_load) return
      distance = sqrt(metric(here%problem, here%state%u, here%state%u))
      if (distance * abs(plane%tangent_load) > here%least_load) distance = here%least_load / abs(plane%tangent_load)
   end function distance_at

   !> Candidates (touchdown nodes) at the ends with prescribed places; 0: no end is prescribed, or the prescribed end is fixed at a
   !> segment boundary.
   function held_ends(next, strip, neighbour) result(ends)
      type(other_set_t), intent(in) :: next
      type(strip_t), intent(in) :: strip(:)
      type(neighbour_t), intent(in) :: neighbour
      integer :: ends(2), i, c, on, nearest
      real(wp) :: along, distance, near(1)
      ends = 0
      do i = 1, 2
         if (neighbour%held(i) == 0) cycle
         associate (set => neighbour%set(neighbour%held(i)), problem => next%problem)
            nearest = 0
            distance = huge(distance)
            do c = 1, problem%candidates%n
               if (problem%candidates%contact_span(c) == 0 .or. problem%candidates%contact(c) /= set%contact) cycle
               if (.not. problem%candidates%moves(c)) cycle
               call strip_place(strip, problem%contact_span(problem%candidates%contact_span(c))%rod_segment, &
                  & touch_place(problem, next%state, c), on, along)
               if (on /= set%rod_segment) cycle
               near = brought_near(strip(on), [along], set%at(neighbour%side(i)))
               if (abs(near(1) - set%at(neighbour%side(i))) >= distance) cycle
               nearest = c
               distance = abs(near(1) - set%at(neighbour%side(i)))
            end do
            if (distance <= sqrt(epsilon(distance)) * max(1.0_wp, abs(along))) ends(i) = nearest
         end associate
      end do
   end function held_ends
end module set_trial
