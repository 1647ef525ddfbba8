!> The zero of an event's function inside an increment, by points of the path on both sides of it.
module zero_search
   use kinds, only: wp
   use model, only: step_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_control, only: path_length
   use path_continuity, only: path_tangent_t
   use path_samples, only: state_between, lagrange, zero_of_cubic, n_samples
   use increment_points, only: division_t, point_within
   use path_events, only: event_value, event_bifurcation
   use event_eigenvalue, only: zero_eigenvalue, follow_through_zero
   use located_events, only: located_event_t
   use tangent_modes, only: modes_t
   use path_state, only: path_state_t, path_tangent_of, test_values_at
   use bracketing, only: bracket_t, next_guess, take_value
   implicit none
   private
   public :: zero_search_t, find_zero, swerve_per_force

   integer, parameter :: max_centres = 6
   real(wp), parameter :: apart = 0.75_wp       !! of the way along all samples, half of which is that between the two inner ones
   real(wp), parameter :: reach = epsilon(1.0_wp)**0.2_wp !! between samples, see smooth_zero; of the increment

   type :: zero_search_t
      type(bracket_t) :: bracket                 !! of the zero, with the function's values at both ends of the increment
      real(wp) :: centre = 0.0_wp                !! fraction of the increment: the zero, as far as it is known
      real(wp) :: at(n_samples) = 0.0_wp         !! fractions of the increment where samples are
      real(wp) :: value(n_samples) = 0.0_wp      !! the function there
      ! The point that was looked at last.
      type(state_t) :: here
      real(wp) :: value_here = 0.0_wp
      type(modes_t) :: modes                     !! lowest ones there, at a bifurcation
      logical :: known = .false.                 !! there is one, with the trial's contact set
   end type zero_search_t

contains

   !> Where the function has its zero, and the state there: between samples around it, or by closing in on it.
   subroutine find_zero(problem, step, run, trial, ahead, division, search, sighting, found)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system ends up at some point of the increment
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead       !! tangent there
      type(division_t), intent(inout) :: division
      type(zero_search_t), intent(inout) :: search !! its bracket is given
      type(located_event_t), intent(inout) :: sighting !! place, heading, fraction, as good as the search has them
      logical, intent(out) :: found
      call narrow_bracket(problem, run, trial, ahead, division, search, sighting, found)
      if (found) call interpolate_zero(problem, run, trial, ahead, division, search, sighting, found)
      if (.not. found .and. sighting%event%kind /= event_bifurcation) &
         & call close_in(problem, step, run, trial, ahead, division, search, sighting, found)
   end subroutine find_zero

   !> To within the reach of the samples. Where Newton's method finds nothing several eigenvalues may be zero: samples around the
   !> guess tell.
   subroutine narrow_bracket(problem, run, trial, ahead, division, search, sighting, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      type(zero_search_t), intent(inout) :: search
      type(located_event_t), intent(inout) :: sighting
      logical, intent(out) :: found
      found = .true.
      do while (next_guess(search%bracket, reach, search%centre))
         call look_at(problem, run, trial, ahead, division, search%centre, search, sighting)
         found = search%known .or. .not. sighting%report%converged
         if (.not. search%known .or. abs(search%value_here) <= reach * search%bracket%scale) return
         call take_value(search%bracket, search%centre, search%value_here)
      end do
   end subroutine narrow_bracket

   !> The zero of the cubic through samples around it.
   subroutine interpolate_zero(problem, run, trial, ahead, division, search, sighting, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      type(zero_search_t), intent(inout) :: search
      type(located_event_t), intent(inout) :: sighting
      logical, intent(out) :: found
      type(state_t) :: sample(n_samples)
      real(wp) :: guess
      integer :: try
      do try = 1, max_centres
         guess = search%centre
         call take_samples(problem, run, trial, ahead, division, search, sighting, sample, found)
         if (.not. found) return
         found = .not. jumps(search%value)
         if (.not. found) then
            ! From an unstable path to a stable one that cannot be told from it there is no harm in going.
            sighting%passes = sighting%event%after > 0.0_wp .and. &
               & path_length(problem, sample(2), sample(3)) <= apart * path_length(problem, sample(1), sample(4))
            return
         end if
         search%centre = zero_of_cubic(search%at, search%value)
         if (abs(search%centre - guess) <= 2.0_wp * reach) exit
      end do
      ! It lies between the ends, whose signs differ; beyond is rounding. So does its load, where the load grows steadily.
      found = search%centre >= -reach .and. search%centre <= 1.0_wp + reach
      if (.not. found) return
      search%centre = min(max(search%centre, 0.0_wp), 1.0_wp)
      sighting%fraction = search%centre
      call state_between(problem, sample, search%at, search%centre, sighting%place, sighting%heading)
      if (run%heading%load * ahead%load > 0.0_wp) sighting%place%load_factor = min(max(sighting%place%load_factor, &
         & min(run%state%load_factor, trial%load_factor)), max(run%state%load_factor, trial%load_factor))
   end subroutine interpolate_zero

   !> States of the path around the search's centre, and the function there.
   subroutine take_samples(problem, run, trial, ahead, division, search, sighting, sample, found)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      type(zero_search_t), intent(inout) :: search
      type(located_event_t), intent(inout) :: sighting
      type(state_t), intent(inout) :: sample(n_samples)
      logical, intent(out) :: found
      type(modes_t) :: modes(n_samples)
      integer :: k
      search%at = sample_places(search%centre)
      do k = 1, n_samples
         call look_at(problem, run, trial, ahead, division, search%at(k), search, sighting)
         search%value(k) = search%value_here
         sample(k) = search%here
         found = search%known
         if (.not. found) return
         if (sighting%event%kind == event_bifurcation) modes(k) = search%modes
      end do
      if (sighting%event%kind == event_bifurcation) call follow_through_zero(modes, sighting%event, search%value)
   end subroutine take_samples

   !> Two on each side of the centre; where the increment ends all on one side, so that none comes near it.
   pure function sample_places(centre) result(at)
      real(wp), intent(in) :: centre             !! fraction of the increment
      real(wp) :: at(n_samples)
      at = centre + reach * [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
      if (at(1) < 0.0_wp) at = max(centre, 0.0_wp) + reach * [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
      if (at(n_samples) > 1.0_wp) at = min(centre, 1.0_wp) - reach * [4.0_wp, 3.0_wp, 2.0_wp, 1.0_wp]
   end function sample_places

   !> Where a foundation takes hold the function may bend so much within the reach of the samples that they take it for a jump.
   subroutine close_in(problem, step, run, trial, ahead, division, search, sighting, found)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      type(zero_search_t), intent(inout) :: search
      type(located_event_t), intent(inout) :: sighting
      logical, intent(out) :: found
      found = .false.
      do while (next_guess(search%bracket, epsilon(1.0_wp), search%centre))
         call look_at(problem, run, trial, ahead, division, search%centre, search, sighting)
         sighting%place = search%here
         if (.not. search%known) return
         found = abs(search%value_here) <= step%locate_tolerance * search%bracket%scale
         if (found) exit
         call take_value(search%bracket, search%centre, search%value_here)
      end do
      if (.not. found) return
      sighting%fraction = search%centre
      sighting%heading = path_tangent_of(problem, run, sighting%place)
   end subroutine close_in

   !> A point of the increment and the function there; not known where there is none, or its contact set is another one.
   subroutine look_at(problem, run, trial, ahead, division, fraction, search, sighting)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run          !! its system is factored there on return
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      real(wp), value :: fraction               !! 0 to 1; may be one of the search's
      type(zero_search_t), intent(inout) :: search
      type(located_event_t), intent(inout) :: sighting !! its report is that on the point
      search%value_here = 0.0_wp
      call point_within(problem, run, trial, ahead, division, fraction, .false., .false., search%here, sighting%report)
      search%known = sighting%report%converged
      if (search%known) search%known = all(search%here%active .eqv. trial%active)
      if (.not. search%known) return
      if (sighting%event%kind == event_bifurcation) then
         search%value_here = zero_eigenvalue(problem, run, sighting%event, search%here, search%modes)
      else
         search%value_here = event_value(problem, sighting%event, search%here, test_values_at(problem, run, search%here, &
            & path_tangent_of(problem, run, search%here)))
      end if
   end subroutine look_at

   !> True for samples between which there is no zero, but a jump: Newton's method has gone from one path to another next to it.
   pure logical function jumps(value)
      real(wp), intent(in) :: value(n_samples)  !! two on each side
      real(wp), parameter :: times = 4.0_wp     !! what a function changes by on either side of its zero; a smooth one does so once
      jumps = value(2) * value(3) < 0.0_wp .and. abs(value(3) - value(2)) > times * (abs(value(2) - value(1)) + &
         & abs(value(4) - value(3)))
   end function jumps

   !> A force f on the null vector, of length 1, keeps a path away from the bifurcation: where its eigenvalue is mu it has moved
   !> by f/mu along that vector, and mu grows by its slope.
   pure real(wp) function swerve_per_force(search, length) result(turn)
      type(zero_search_t), intent(in) :: search !! that has found the zero between its samples
      real(wp), intent(in) :: length            !! of the increment
      real(wp) :: w(n_samples), d(n_samples), slope
      call lagrange(search%at, search%centre, w, d)
      slope = abs(dot_product(d, search%value))
      turn = slope * minval(abs(search%at - search%centre))**2 * length
      if (turn > 0.0_wp) turn = 1.0_wp / turn
   end function swerve_per_force
end module zero_search
