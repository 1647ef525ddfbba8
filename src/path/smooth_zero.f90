!> Locates what is the zero of a function that is smooth along the path: a bifurcation (an eigenvalue of the tangent), a
!> limit point (the rate of the load), a turning point (that of a monitor).
!>
!> At a bifurcation Newton's method has no use for its last correction: the residual's rounding over a vanishing eigenvalue
!> is any share of the null vector, and with it the iteration leaves for the other path, where the eigenvalue has its zero,
!> too; and a branch may have its limit point there. So the zero is interpolated between points on both sides that are far
!> enough from it for Newton's method and near enough for a cubic: a distance h is off by epsilon/h there and by h^4 here,
!> least at h = epsilon^(1/5). Several eigenvalues that go through zero together change their order there; their sizes keep it.
module smooth_zero
   use kinds, only: wp
   use errors, only: error_t
   use model, only: step_t
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use path_control, only: control_t, path_length
   use corrector, only: correct
   use path_continuity, only: heading_t, normal_plane
   use path_samples, only: state_between, lagrange, zero_of_cubic, n_samples
   use increment_points, only: division_t, point_within
   use path_events, only: event_t, event_value, event_bifurcation, event_limit, &
      & event_release
   use sightings, only: sighting_t
   use weak_lines, only: release_lines
   use tangent_modes, only: modes_t, lowest_modes, numbered_eigenvalue
   use path_run, only: run_t, heading_of, probe_at
   use bracketing, only: bracket_t, new_bracket, next_guess, take_value
   use timing, only: timers_t
   implicit none
   private
   public :: locate_smooth, zero_eigenvalue

   integer, parameter :: eigenvalues_looked_at = 4
   integer, parameter :: max_centres = 6
   real(wp), parameter :: apart = 0.75_wp       !! of the way along all samples, half of which is that between the two inner ones

contains

   !> Finds the zero of the event's function between the last accepted point and the trial.
   subroutine locate_smooth(problem, step, run, trial, ahead, division, sighting, timers)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(run_t), intent(inout) :: run
      type(state_t), intent(in) :: trial
      type(heading_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      type(sighting_t), intent(inout) :: sighting  !! located, place, heading, fraction, and the scale of its event
      type(timers_t), intent(inout) :: timers
      type(state_t) :: sample(n_samples)
      type(modes_t) :: modes, near_zero(n_samples)
      type(bracket_t) :: bracket
      real(wp) :: at(n_samples), mu(n_samples), f, centre, guess, h, near
      logical :: branching, told, found

      sighting%located = .false.
      h = epsilon(h)**0.2_wp
      branching = sighting%event%kind == event_bifurcation
      bracket = new_bracket(sighting%event%before, sighting%event%after)
      if (branching) then
         call bracket_eigenvalue()
         if (told) return
      end if
      sighting%event%scale = bracket%scale
      ! Where contact at nodes changes the function may jump: no zero can be interpolated there. Foundations that act along the
      ! elements take hold and let go little by little.
      if (.not. division%smooth .and. any(run%state%active .neqv. trial%active)) return
      call narrow_bracket(found)
      if (found) call interpolate_zero(found)
      if (.not. (found .or. branching)) call close_in(found)
      if (found) call bring_to_balance(found)
      if (found) found = max(run%system%force_residual, run%system%defect_residual) <= max(step%tolerance, run%system%round_off)
      if (.not. found) then
         if (run%shrunk) then
            call take_beginning()
         else if (sighting%event%kind == event_limit) then
            call take_nearer_end()
         end if
         return
      end if
      sighting%event%pivots = run%system%negative_pivots
      sighting%report%residual = max(run%system%force_residual, run%system%defect_residual)
      ! In balance as any point is, and zero relative to its change over the increment. Other functions than the eigenvalue
      ! mean nothing there where it is zero, too: of these the samples tell.
      sighting%located = .true.
      if (.not. branching) return
      ! The numbers that tell eigenvalues apart are rounding there.
      f = zero_eigenvalue(problem, run, sighting%event, sighting%place, timers, modes)
      sighting%located = minval(abs(modes%mu)) <= sqrt(step%locate_tolerance) * bracket%scale
      sighting%swerve = swerve_per_force()

   contains

      !> The eigenvalue at both ends of the increment.
      subroutine bracket_eigenvalue()
         call linearise(problem, trial, trial, run%system, timers)
         f = zero_eigenvalue(problem, run, sighting%event, trial, timers)
         call linearise(problem, run%state, run%state, run%system, timers)
         bracket = new_bracket(zero_eigenvalue(problem, run, sighting%event, run%state, timers), f)
         sighting%event%scale = bracket%scale
         sighting%later = bracket%f_low * f > 0.0_wp .and. sighting%event%before * f > 0.0_wp
         told = sighting%later .or. bracket%f_low * sighting%event%before <= 0.0_wp
         if (sighting%later .or. .not. told) return
         ! It was passed next to the last point, which had the sign of rounding.
         call take_beginning()
         sighting%located = sighting%located .or. abs(bracket%f_low) <= sqrt(step%locate_tolerance) * bracket%scale
      end subroutine bracket_eigenvalue

      !> The last point. There it is where a line of contact has just become a point: what holds the point's rotation is without
      !> bounds where it is as curved as the obstacle, Newton's method does not get near, and by how much the line was shorter than
      !> none no eigenvalue tells.
      subroutine take_beginning()
         sighting%place = run%state
         sighting%heading = run%heading
         sighting%fraction = 0.0_wp
         call linearise(problem, run%state, run%state, run%system, timers)
         sighting%report%residual = max(run%system%force_residual, run%system%defect_residual)
         sighting%located = run%shrunk .and. sighting%report%residual <= max(step%tolerance, run%system%round_off)
      end subroutine take_beginning

      !> Where an increment is so short that rounding lets no point within it be told, the load beyond its higher end, or below its
      !> lower one, is at most where the tangents at both ends meet.
      subroutine take_nearer_end()
         real(wp) :: left, rates(2)
         if (run%state%load_factor * sighting%event%before > trial%load_factor * sighting%event%before) then
            sighting%place = run%state
            sighting%heading = run%heading
            sighting%fraction = 0.0_wp
         else
            sighting%place = trial
            sighting%heading = ahead
            sighting%fraction = 1.0_wp
         end if
         rates = abs([run%heading%load, ahead%load])
         left = (product(rates) * path_length(problem, run%state, trial) - abs(sighting%heading%load) * abs(trial%load_factor - &
            & run%state%load_factor)) / sum(rates)
         if (left > step%locate_tolerance * abs(sighting%place%load_factor)) return
         call linearise(problem, sighting%place, sighting%place, run%system, timers)
         sighting%report%residual = max(run%system%force_residual, run%system%defect_residual)
         sighting%located = sighting%report%residual <= max(step%tolerance, run%system%round_off)
         sighting%event%pivots = run%system%negative_pivots
      end subroutine take_nearer_end

      !> To within the reach of the samples.
      subroutine narrow_bracket(found)
         logical, intent(out) :: found
         found = .true.
         do while (next_guess(bracket, h, centre))
            found = sampled(centre, sample(1), f)
            if (.not. found .or. abs(f) <= h * bracket%scale) return
            call take_value(bracket, centre, f)
         end do
      end subroutine narrow_bracket

      !> The zero of the cubic through samples around it.
      subroutine interpolate_zero(found)
         logical, intent(out) :: found
         integer :: try, k
         do try = 1, max_centres
            ! Two on each side of it; where the increment ends all on one side, so that none comes near it.
            near = min(h, 0.125_wp)
            at = centre + near * [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
            if (at(1) < 0.0_wp) at = max(centre, 0.0_wp) + near * [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
            if (at(n_samples) > 1.0_wp) at = min(centre, 1.0_wp) - near * [4.0_wp, 3.0_wp, 2.0_wp, 1.0_wp]
            guess = centre
            do k = 1, n_samples
               found = sampled(at(k), sample(k), mu(k))
               if (.not. found) return
               if (branching) near_zero(k) = modes
            end do
            if (branching) call follow_through_zero(near_zero, sighting%event, mu)
            found = .not. jumps(mu)
            if (.not. found) then
               ! From an unstable path to a stable one that cannot be told from it there is no harm in going.
               sighting%passes = sighting%event%after > 0.0_wp .and. &
                  & path_length(problem, sample(2), sample(3)) <= apart * path_length(problem, sample(1), sample(4))
               return
            end if
            centre = zero_of_cubic(at, mu)
            if (abs(centre - guess) <= 2.0_wp * near) exit
         end do
         ! It lies between the ends, whose signs differ; beyond is rounding. So does its load, where the load grows steadily.
         found = centre >= -near .and. centre <= 1.0_wp + near
         if (.not. found) return
         centre = min(max(centre, 0.0_wp), 1.0_wp)
         sighting%fraction = centre
         call state_between(problem, sample, at, centre, sighting%place, sighting%heading)
         if (run%heading%load * ahead%load > 0.0_wp) sighting%place%load_factor = min(max(sighting%place%load_factor, &
            & min(run%state%load_factor, trial%load_factor)), max(run%state%load_factor, trial%load_factor))
      end subroutine interpolate_zero

      !> Where a foundation takes hold the function may bend so much within the reach of the samples that they take it for a jump.
      subroutine close_in(found)
         logical, intent(out) :: found
         found = .false.
         do while (next_guess(bracket, epsilon(h), centre))
            if (.not. sampled(centre, sighting%place, f)) return
            found = abs(f) <= step%locate_tolerance * bracket%scale
            if (found) exit
            call take_value(bracket, centre, f)
         end do
         if (.not. found) return
         sighting%fraction = centre
         sighting%heading = heading_of(problem, run, sighting%place)
      end subroutine close_in

      !> Ends of contact that have gone far between the samples make more of the cubic's error than the iteration leaves. But at
      !> bifurcations, see above.
      subroutine bring_to_balance(found)
         logical, intent(out) :: found
         type(control_t) :: hold
         call linearise(problem, sighting%place, sighting%place, run%system, timers)
         found = run%system%ok
         if (.not. found .or. branching) return
         sighting%report%residual = max(run%system%force_residual, run%system%defect_residual)
         if (sighting%report%residual <= max(step%tolerance, run%system%round_off)) return
         sample(1) = sighting%place
         hold = normal_plane(problem, sample(1), sighting%heading)
         hold%increment = 0.0_wp
         call correct(problem, sample(1), hold, .true., sighting%place, run%system, sighting%report, timers)
         found = sighting%report%converged
      end subroutine bring_to_balance

      !> A point of the increment and the function there; false where there is none, or its contact set is another one.
      logical function sampled(fraction, here, value) result(ok)
         real(wp), intent(in) :: fraction
         type(state_t), intent(out) :: here
         real(wp), intent(out) :: value
         type(heading_t) :: heading
         value = 0.0_wp
         call point_within(problem, run, trial, ahead, division, fraction, .false., .false., here, sighting%report, timers)
         ok = sighting%report%converged
         if (ok) ok = all(here%active .eqv. trial%active)
         if (.not. ok) return
         heading = heading_of(problem, run, here)
         if (branching) then
            value = zero_eigenvalue(problem, run, sighting%event, here, timers, modes)
         else
            value = event_value(problem, sighting%event, here, probe_at(problem, run, here, heading))
         end if
      end function sampled

      !> A force f on the null vector, of length 1, keeps a path away from the bifurcation: where its eigenvalue is mu it has moved
      !> by f/mu along that vector, and mu grows by its slope.
      real(wp) function swerve_per_force() result(turn)
         real(wp) :: w(n_samples), d(n_samples), slope
         call lagrange(at, centre, w, d)
         slope = abs(dot_product(d, mu))
         near = minval(abs(at - centre))
         turn = slope * near**2 * path_length(problem, run%state, trial)
         if (turn > 0.0_wp) turn = 1.0_wp / turn
      end function swerve_per_force
   end subroutine locate_smooth

   !> True for samples between which there is no zero, but a jump: Newton's method has gone from one path to another next to it.
   pure logical function jumps(value)
      real(wp), intent(in) :: value(n_samples)  !! two on each side
      real(wp), parameter :: times = 4.0_wp     !! what a function changes by on either side of its zero; a smooth one does so once
      jumps = value(2) * value(3) < 0.0_wp .and. abs(value(3) - value(2)) > times * (abs(value(2) - value(1)) + &
         & abs(value(4) - value(3)))
   end function jumps

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

   !> The eigenvalue that changes its sign, where the system is factored now; that of the system without weak contacts where these
   !> open.
   real(wp) function zero_eigenvalue(problem, run, event, state, timers, found) result(mu)
      type(problem_t), intent(in) :: problem
      type(run_t), intent(inout) :: run
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: state
      type(timers_t), intent(inout) :: timers
      type(modes_t), intent(out), optional :: found !! all that were looked at
      real(wp), parameter :: alone = sqrt(epsilon(mu))
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      type(problem_t) :: free
      type(state_t) :: at
      type(system_t) :: other
      logical :: any_weak
      if (event%kind == event_release) then
         call release_lines(problem, state, run%system, free, at, any_weak)
         if (.not. any_weak) then
            call copy_problem(problem, free)
            at = state
         end if
         other = new_system(free)
         call linearise(free, at, at, other, timers)
         call lowest_modes(free, at, other, eigenvalues_looked_at, modes, error, timers)
      else
         call lowest_modes(problem, state, run%system, eigenvalues_looked_at, modes, error, timers)
      end if
      mu = numbered_eigenvalue(modes, event%number, event%least, event%most)
      ! At the zero its sign is rounding, and tells no number.
      if (event%kind == event_release .and. abs(modes%mu(1)) <= alone * abs(modes%mu(2))) mu = modes%mu(1)
      if (present(found)) found = modes
   end function zero_eigenvalue
end module smooth_zero
