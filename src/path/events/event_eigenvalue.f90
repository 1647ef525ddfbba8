!> The eigenvalue of the tangent stiffness that vanishes at a bifurcation or detachment.
module event_eigenvalue
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_samples, only: n_samples
   use path_events, only: event_t, event_release
   use force_free_contact, only: isolate_force_free_lines
   use tangent_modes, only: modes_t, lowest_modes, numbered_eigenvalue, most_null_vectors
   use path_point, only: path_point_t
   implicit none
   private
   public :: zero_eigenvalue, follow_through_zero

contains

   !> Eigenvalue that changes its sign at the event, evaluated at a point near the event. For a detachment it is an eigenvalue of
   !> the structure without its force-free line contacts.
   real(wp) function zero_eigenvalue(problem, event, point, found) result(mu)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      type(path_point_t), intent(in) :: point
      type(modes_t), intent(out), optional :: found !! all eigenvalues computed
      real(wp), parameter :: alone = sqrt(epsilon(mu))
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(problem_t) :: free
      type(state_t) :: at
      type(system_t) :: other
      logical :: any_weak
      if (event%kind == event_release) then
         call isolate_force_free_lines(problem, point%state, point%system, free, at, any_weak)
         if (.not. any_weak) then
            call copy_problem(problem, free)
            at = point%state
         end if
         other = new_system(free)
         call linearise(free, at, at, other)
         call lowest_modes(free, at, other, most_null_vectors, modes, error)
      else
         call lowest_modes(problem, point%state, point%system, most_null_vectors, modes, error)
      end if
      mu = numbered_eigenvalue(modes, event%number, event%least, event%most)
      ! At the event itself the sign of the vanishing eigenvalue is rounding, so that its number in the order is unknown: the
      ! smallest eigenvalue is returned.
      if (event%kind == event_release .and. size(modes%mu) > 1) then
         if (abs(modes%mu(1)) <= alone * abs(modes%mu(2))) mu = modes%mu(1)
      end if
      if (present(found)) found = modes
   end function zero_eigenvalue

   !> Selects the eigenvalue of the event at samples on both sides of the event, if several eigenvalues vanish there. Among the
   !> eigenvalues that change their sign, the k-th by magnitude is the same eigenvalue on both sides.
   pure subroutine follow_through_zero(modes, event, mu)
      type(modes_t), intent(in) :: modes(n_samples)
      type(event_t), intent(in) :: event
      real(wp), intent(inout) :: mu(n_samples)  !! eigenvalue at each sample; in: selected by its number in the order
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
         ! The eigenvalues in `modes` are sorted by magnitude.
         do j = 1, modes(i)%n
            if (modes(i)%mu(j) < 0.0_wp .neqv. wanted) cycle
            left = left - 1
            if (left == 0) mu(i) = modes(i)%mu(j)
         end do
      end do
   end subroutine follow_through_zero

   !> Number of negative eigenvalues that event functions use. Where refined eigenvalues were computed, their signs are counted.
   pure integer function negative_count(modes)
      type(modes_t), intent(in) :: modes
      negative_count = modes%pivots - modes%hinges - count(modes%was_negative) + count(modes%mu < 0.0_wp)
   end function negative_count
end module event_eigenvalue
