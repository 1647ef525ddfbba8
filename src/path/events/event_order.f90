!> Relations between the events of one increment: duplicates, contact changes beside limit points, and the number of negative pivots
!> before each event.
module event_order
   use kinds, only: wp
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use path_events, only: event_bifurcation, event_limit, event_contact
   use located_events, only: located_event_t
   implicit none
   private
   public :: duplicates_of, beside, one_sided, count_before, same_place

   real(wp), parameter :: same_place = 1.0e-5_wp !! fraction of the increment: located events closer than this coincide; with values
   !! from 1E-6 to 1E-4 every deck in input has the same results

contains

   !> (seen) true: the event is not reported as an event of its own. Not reported are
   !> - bifurcations that repeat the sign change of a limit point or are further eigenvalues of a multiple bifurcation,
   !> - jumps of the pivot count due to a change of the contact set, or to rounding if the last accepted point is a bifurcation,
   !> - bifurcations behind the trial,
   !> - limit points beside a contact change, if they were not located.
   !> If the contact set is unchanged up to the trial, the pivot count has no jumps. A change of the count without a located
   !> bifurcation then means that the trial is on another path.
   function duplicates_of(run, trial, changes, seen) result(duplicate)
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      logical, intent(in) :: changes             !! true: the contact set changes at the trial
      type(located_event_t), intent(in) :: seen(:)
      logical :: duplicate(size(seen))
      logical :: set_changes, jumps, contact_located, limit_counted
      integer :: i, k
      jumps = any(run%last%state%active .neqv. trial%state%active) .or. any(seen%event%kind == event_contact)
      set_changes = changes .or. jumps
      contact_located = changes .or. any(seen%event%kind == event_contact .and. seen%located)
      limit_counted = .false.
      duplicate = .false.
      do i = 1, size(seen)
         if (seen(i)%event%kind == event_limit .and. .not. seen(i)%located) duplicate(i) = contact_located
         if (seen(i)%event%kind /= event_bifurcation) cycle
         if (seen(i)%later) then
            duplicate(i) = .true.
         else if (.not. seen(i)%located) then
            duplicate(i) = jumps
         else
            ! At a contact change the force of the contact is zero, and the number of negative pivots is undefined.
            duplicate(i) = (run%on_bifurcation .or. set_changes) .and. seen(i)%fraction <= same_place
            duplicate(i) = duplicate(i) .or. (set_changes .and. seen(i)%fraction >= 1.0_wp - same_place)
            do k = 1, size(seen)
               if (k == i .or. duplicate(i) .or. .not. seen(k)%located) cycle
               if (abs(seen(k)%fraction - seen(i)%fraction) > same_place) cycle
               if (seen(k)%event%kind == event_limit .and. .not. limit_counted) then
                  duplicate(i) = .true.
                  limit_counted = .true.
               else if (seen(k)%event%kind == event_bifurcation .and. k < i) then
                  duplicate(i) = .not. duplicate(k)
               end if
            end do
         end if
      end do
   end function duplicates_of

   !> (seen) for a located limit point at a corner of the path: index of the located contact change at the same position; 0: none.
   pure function beside(seen) result(change)
      type(located_event_t), intent(in) :: seen(:)
      integer :: change(size(seen))
      integer :: i, k
      change = 0
      do i = 1, size(seen)
         if (.not. (seen(i)%event%corner .and. seen(i)%located)) cycle
         do k = 1, size(seen)
            if (seen(k)%event%kind /= event_contact .or. .not. seen(k)%located) cycle
            if (abs(seen(k)%fraction - seen(i)%fraction) <= same_place) change(i) = k
         end do
      end do
   end function beside

   !> True if the load rate changes its sign while the contact set is unchanged and the number of negative pivots changes by an even
   !> number: a second eigenvalue changes its sign together with that of the limit point and went undetected.
   pure logical function one_sided(run, trial, seen)
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial
      type(located_event_t), intent(in) :: seen(:)
      integer :: i
      one_sided = run%last%test_values%load_rate * trial%test_values%load_rate < 0.0_wp .and. &
         & all(run%last%state%active .eqv. trial%state%active) .and. &
         & modulo(trial%test_values%negative_pivots - run%last%test_values%negative_pivots, 2) == 0
      ! If bifurcations were located at the same position as the limit point, these explain the further eigenvalues.
      do i = 1, size(seen)
         one_sided = one_sided .and. .not. (seen(i)%event%meets .and. seen(i)%located)
         if (seen(i)%event%kind == event_limit .and. seen(i)%located) one_sided = one_sided .and. .not. any( &
            & seen%event%kind == event_bifurcation .and. seen%located .and. abs(seen%fraction - seen(i)%fraction) <= same_place)
      end do
   end function one_sided

   !> Number of negative pivots just before a position in the increment. (At an event itself an eigenvalue may be zero, and the
   !> signs of pivots are then rounding.)
   pure integer function count_before(run, seen, duplicate, fraction) result(pivots)
      type(path_state_t), intent(in) :: run
      type(located_event_t), intent(in) :: seen(:)
      logical, intent(in) :: duplicate(:)             !! (seen) from duplicates_of
      real(wp), intent(in) :: fraction           !! position in the increment, 0 to 1
      integer :: i
      pivots = run%last%test_values%negative_pivots
      do i = 1, size(seen)
         if (seen(i)%event%kind /= event_bifurcation .or. .not. seen(i)%located) cycle
         if (duplicate(i) .and. seen(i)%fraction <= same_place) cycle
         if (seen(i)%fraction < fraction - same_place) pivots = pivots + nint(sign(1.0_wp, seen(i)%event%before))
      end do
   end function count_before
end module event_order
