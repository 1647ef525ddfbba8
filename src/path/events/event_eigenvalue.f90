!> The eigenvalue of the tangent that an event is the zero of: where paths cross, or contacts that carry no force let go.
module event_eigenvalue
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_samples, only: n_samples
   use path_events, only: event_t, event_release
   use force_free_contact, only: remove_force_free_lines
   use tangent_modes, only: modes_t, lowest_modes, numbered_eigenvalue
   use path_state, only: path_state_t
   implicit none
   private
   public :: zero_eigenvalue, follow_through_zero

   integer, parameter :: eigenvalues_looked_at = 4

contains

   !> The eigenvalue that changes its sign, where the system is factored now; that of the system without weak contacts where these
   !> open.
   real(wp) function zero_eigenvalue(problem, run, event, state, found) result(mu)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: state
      type(modes_t), intent(out), optional :: found !! all that were looked at
      real(wp), parameter :: alone = sqrt(epsilon(mu))
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(problem_t) :: free
      type(state_t) :: at
      type(system_t) :: other
      logical :: any_weak
      if (event%kind == event_release) then
         call remove_force_free_lines(problem, state, run%system, free, at, any_weak)
         if (.not. any_weak) then
            call copy_problem(problem, free)
            at = state
         end if
         other = new_system(free)
         call linearise(free, at, at, other)
         call lowest_modes(free, at, other, eigenvalues_looked_at, modes, error)
      else
         call lowest_modes(problem, state, run%system, eigenvalues_looked_at, modes, error)
      end if
      mu = numbered_eigenvalue(modes, event%number, event%least, event%most)
      ! At the zero its sign is rounding, and tells no number.
      if (event%kind == event_release .and. abs(modes%mu(1)) <= alone * abs(modes%mu(2))) mu = modes%mu(1)
      if (present(found)) found = modes
   end function zero_eigenvalue

   !> The event's eigenvalue at samples on both sides of its zero, where others go through theirs, too: of those that change
   !> their sign there, the k-th by size is one and the same on both sides.
   pure subroutine follow_through_zero(modes, event, mu)
      type(modes_t), intent(in) :: modes(n_samples)
      type(event_t), intent(in) :: event
      real(wp), intent(inout) :: mu(n_samples)  !! by its number on entry
      integer :: first, last, k, i, j, left
      logical :: wanted, beyond
      first = negative_count(modes(1))
      last = negative_count(modes(n_samples))
      if (abs(last - first) < 2) return
      k = event%number - min(max(min(first, last), event%least), event%most - 1)
      if (k < 1 .or. k > abs(last - first)) return
      do i = 1, n_samples
         beyond = abs(negative_count(modes(i)) - last) < abs(negative_count(modes(i)) - first)
         wanted = merge(last > first, first > last, beyond)
         left = k
         ! The nearest to zero come first.
         do j = 1, modes(i)%n
            if (modes(i)%mu(j) < 0.0_wp .neqv. wanted) cycle
            left = left - 1
            if (left == 0) mu(i) = modes(i)%mu(j)
         end do
      end do
   end subroutine follow_through_zero

   !> Negative eigenvalues as events count them, by their refined values where these are known.
   pure integer function negative_count(modes)
      type(modes_t), intent(in) :: modes
      negative_count = modes%pivots - modes%hinges - count(modes%was_negative) + count(modes%mu < 0.0_wp)
   end function negative_count
end module event_eigenvalue
