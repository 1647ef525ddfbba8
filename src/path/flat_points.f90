!> Point contacts where they are as curved as their obstacle: where a point becomes a line, or divides, where a line has become a
!> point, and two points one.
module flat_points
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use contact_touch, only: shortest
   use conforming_span, only: excess_curvature, flat_excess
   use touchdown_points, only: point_force
   use path_control, only: control_t
   use path_continuity, only: heading_t
   use path_samples, only: state_between, lagrange, n_samples
   use path_run, only: run_t
   use corrector, only: increment_t, correct
   use timing, only: timers_t
   implicit none
   private
   public :: find_flat_point, leave_flat_point

   real(wp), parameter :: share(n_samples) = [4.0_wp, 3.0_wp, 2.0_wp, 1.0_wp] !! of the excess nearest to none
   real(wp), parameter :: nearer = 0.125_wp      !! to the next samples

contains

   !> Where on its path a point is as curved as its obstacle. Its own equation, that of the least gap, has no slope there: it turns
   !> with the obstacle as the end of a line does, and goes to where no moment is left; held is by how much more it is curved.
   subroutine find_flat_point(problem, run, candidate, place, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run          !! its system ends up anywhere
      integer, intent(in) :: candidate
      type(state_t), intent(inout) :: place      !! a state nearby on entry
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: turning
      call copy_problem(problem, turning)
      turning%candidates%follows(candidate) = problem%candidates%rolls(candidate)
      call go_to_excess(turning, run, candidate, 0.0_wp, of_no_line(problem, place, candidate), place, found, timers)
      if (found .and. problem%candidates%moves(candidate)) place%reaction(candidate) = point_force(problem, place, candidate)
   end subroutine find_flat_point

   !> The same where a line has become a point, and the way on from there, in the sense in which it becomes more curved. Free spans
   !> beside it may buckle as the line between them vanishes, both at once, and no equation tells more than their sum: the place is
   !> extrapolated from equilibria further on.
   subroutine leave_flat_point(problem, run, candidate, place, heading, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run          !! its system ends up anywhere
      integer, intent(in) :: candidate
      type(state_t), intent(inout) :: place      !! a state nearby on entry
      type(heading_t), intent(out) :: heading
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(state_t) :: sample(n_samples), near
      real(wp) :: at(n_samples), whole, least, stretch
      integer :: k
      least = 10.0_wp * flat_excess / problem%size
      whole = of_no_line(problem, place, candidate)
      near = place
      do
         ! The first one comes from somewhere else.
         call go_to_excess(problem, run, candidate, share(1) * whole, whole, near, found, timers)
         do k = 1, n_samples
            if (.not. found) return
            sample(k) = near
            call go_to_excess(problem, run, candidate, share(k) * whole, whole, sample(k), found, timers)
            call excess_curvature(problem, sample(k), candidate, at(k), stretch)
            near = sample(k)
         end do
         if (.not. found) return
         ! The path may bend just before: as the point stops turning.
         if (is_cubic() .or. whole <= least) exit
         whole = max(nearer * whole, least)
      end do
      call state_between(problem, sample, at, 0.0_wp, place, heading)
      if (problem%candidates%moves(candidate)) place%reaction(candidate) = point_force(problem, place, candidate)

   contains

      !> True where the load that they lead to hardly hangs on the farthest of the samples.
      logical function is_cubic()
         real(wp), dimension(n_samples) :: w, d, of_three
         of_three = 0.0_wp
         call lagrange(at, 0.0_wp, w, d)
         call lagrange(at(2:), 0.0_wp, of_three(2:), d(2:))
         is_cubic = abs(dot_product(w - of_three, sample%load_factor)) <= problem%model%step(problem%step)%locate_tolerance * &
            & maxval(abs(sample%load_factor))
      end function is_cubic
   end subroutine leave_flat_point

   !> A small excess: a part of what the point's force makes of the curvature along a line of a length that is taken for none.
   real(wp) function of_no_line(problem, state, candidate) result(excess)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), parameter :: part = 0.25_wp
      integer :: e
      e = maxval(problem%candidates%element(:, candidate))
      excess = max(part * abs(point_force(problem, state, candidate)) * problem%compliance(e)%bending * shortest * &
         & problem%layout%stretch(problem%stretch(e))%length, 10.0_wp * flat_excess / problem%size)
   end function of_no_line

   !> The equilibrium at which a point is more curved than its obstacle by a given amount.
   subroutine go_to_excess(problem, run, candidate, excess, whole, state, found, timers)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      integer, intent(in) :: candidate
      real(wp), intent(in) :: excess
      real(wp), intent(in) :: whole              !! to a small part of which it is met
      type(state_t), intent(inout) :: state      !! a guess on entry
      logical, intent(out) :: found
      type(timers_t), intent(inout) :: timers
      type(control_t) :: curved
      type(state_t) :: start
      type(increment_t) :: report
      curved%flat = candidate
      curved%increment = excess
      curved%whole = whole
      start = state
      call correct(problem, start, curved, .true., state, run%system, report, timers)
      found = report%converged
   end subroutine go_to_excess
end module flat_points
