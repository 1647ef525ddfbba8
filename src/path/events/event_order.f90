!> The events of one increment beside one another: which of them is told by another one, which comes first, and how many negative
!> pivots the path has before each.
module event_order
   use kinds, only: wp
   use rod_state, only: state_t
   use path_state, only: path_state_t
   use path_events, only: test_values_t, event_bifurcation, event_limit, event_contact
   use located_events, only: located_event_t
   implicit none
   private
   public :: duplicates_of, one_sided, count_before, by_fraction, same_place

   real(wp), parameter :: same_place = 1.0e-5_wp !! of an increment: located events nearer than that are one

contains

   !> Changes of the pivot count that are no bifurcations of their own: a limit point's change of sign, further eigenvalues of
   !> a multiple bifurcation, jumps where the contact set changes on the way, and rounding at a point that is a bifurcation itself.
   !> And loads that turn back at once where a contact is gained or lost: that is what is told. Where the set stays up to the trial
   !> there are no jumps: a count that changes without an event is that of another path.
   function duplicates_of(run, trial, changes, seen) result(told)
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      logical, intent(in) :: changes             !! the contact set is about to change at the trial
      type(located_event_t), intent(in) :: seen(:)
      logical :: told(size(seen))
      logical :: set_changes, jumps, contact_located, limit_told
      integer :: i, k
      jumps = any(run%state%active .neqv. trial%active) .or. any(seen%event%kind == event_contact)
      set_changes = changes .or. jumps
      contact_located = changes .or. any(seen%event%kind == event_contact .and. seen%located)
      limit_told = .false.
      told = .false.
      do i = 1, size(seen)
         if (seen(i)%event%kind == event_limit .and. .not. seen(i)%located) told(i) = contact_located
         if (seen(i)%event%kind /= event_bifurcation) cycle
         if (seen(i)%later .or. seen(i)%passes) then
            told(i) = .true.
         else if (.not. seen(i)%located) then
            told(i) = jumps
         else
            ! Where a contact begins or ends its reaction is zero, and a count means nothing.
            told(i) = (run%on_bifurcation .or. set_changes) .and. seen(i)%fraction <= same_place
            told(i) = told(i) .or. (set_changes .and. seen(i)%fraction >= 1.0_wp - same_place)
            do k = 1, size(seen)
               if (k == i .or. told(i) .or. .not. seen(k)%located) cycle
               if (abs(seen(k)%fraction - seen(i)%fraction) > same_place) cycle
               if (seen(k)%event%kind == event_limit .and. .not. limit_told) then
                  told(i) = .true.
                  limit_told = .true.
               else if (seen(k)%event%kind == event_bifurcation .and. k < i) then
                  told(i) = .not. told(k)
               end if
            end do
         end if
      end do
   end function duplicates_of

   !> True for a limit point where the contact set stays and no eigenvalue is seen to change its sign there: another one does, too,
   !> and goes unseen.
   pure logical function one_sided(run, trial, probe, seen)
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial
      type(test_values_t), intent(in) :: probe
      type(located_event_t), intent(in) :: seen(:)
      integer :: i
      one_sided = run%probe%load_rate * probe%load_rate < 0.0_wp .and. all(run%state%active .eqv. trial%active) .and. &
         & modulo(probe%negative_pivots - run%probe%negative_pivots, 2) == 0
      ! Eigenvalues of their own are listed where there are several.
      do i = 1, size(seen)
         if (seen(i)%event%kind == event_limit .and. seen(i)%located) one_sided = one_sided .and. .not. any( &
            & seen%event%kind == event_bifurcation .and. seen%located .and. abs(seen%fraction - seen(i)%fraction) <= same_place)
      end do
   end function one_sided

   !> Negative pivots on the side of a place that the path comes from: where an eigenvalue is zero the factors have the sign of
   !> rounding.
   pure integer function count_before(run, seen, told, fraction) result(pivots)
      type(path_state_t), intent(in) :: run
      type(located_event_t), intent(in) :: seen(:)
      logical, intent(in) :: told(:)
      real(wp), intent(in) :: fraction           !! of the increment: the place, as of those seen
      integer :: i
      pivots = run%probe%negative_pivots
      do i = 1, size(seen)
         if (seen(i)%event%kind /= event_bifurcation .or. .not. seen(i)%located) cycle
         if (told(i) .and. seen(i)%fraction <= same_place) cycle
         if (seen(i)%fraction < fraction - same_place) pivots = pivots + nint(sign(1.0_wp, seen(i)%event%before))
      end do
   end function count_before

   !> Places in ascending order.
   pure function by_fraction(fraction) result(order)
      real(wp), intent(in) :: fraction(:)
      integer :: order(size(fraction))
      integer :: i, k
      do i = 1, size(fraction)
         do k = i - 1, 1, -1
            if (fraction(order(k)) <= fraction(i)) exit
            order(k + 1) = order(k)
         end do
         order(k + 1) = i
      end do
   end function by_fraction
end module event_order
