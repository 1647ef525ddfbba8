!> What presses a rod along a line of contact: the density of the obstacle's force.
module line_pressure
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_load, candidate_offset
   use conforming_span, only: conforming_forces, excess_curvature, node_track, track_sense, rod_angle, bend_at
   use obstacle_track, only: track_t, jump_between
   use ge_element, only: ge_load_t
   use contact_touch, only: touch_t
   use state_transfer, only: find_point
   implicit none
   private
   public :: density_at, least_pressure, virtual_pressure

   integer, parameter :: samples = 4         !! of the density in an element

contains

   !> Density of a line's force at one place along its stretch.
   real(wp) function density_at(problem, state, line, at) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(touch_t), intent(in) :: line            !! as it is now
      real(wp), intent(in) :: at
      real(wp) :: local(3), place(2), angle, tau
      integer :: e
      call find_point(problem, state, line%stretch, at, e, tau)
      if (problem%conforms(e) == 0) then
         ! The last end of the line begins a free span.
         e = e - 1
         tau = 1.0_wp
      end if
      call conforming_forces(problem, state, e, tau, local, place, angle, density)
   end function density_at

   !> Least density along a line, and where it is.
   subroutine least_pressure(problem, state, which, least, where, side)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: which                 !! index into problem%touch, of a line
      real(wp), intent(out) :: least               !! -huge(least): its track bends at once, where no rod can follow
      real(wp), intent(out) :: where               !! along the stretch
      integer, intent(out) :: side                 !! -1: at its first end, 0: inside, 1: at its last
      real(wp) :: local(3), place(2), angle, density, tau
      integer :: e, i
      least = huge(least)
      associate (element => problem%touch(which)%element)
         do e = element(1), element(2)
            if (bends_at_once(problem, state, e)) then
               least = -huge(least)
               where = state%geometry%element(e)%s(1) + problem%origin(e)
               side = 0
               return
            end if
            do i = 0, samples
               tau = real(i, wp) / samples
               call conforming_forces(problem, state, e, tau, local, place, angle, density)
               if (density >= least) cycle
               least = density
               associate (g => state%geometry%element(e))
                  where = g%s(1) + tau * (g%s(2) - g%s(1)) + problem%origin(e)
               end associate
               side = 0
               if (e == element(1) .and. i == 0) side = -1
               if (e == element(2) .and. i == samples) side = 1
            end do
         end do
      end associate
   end subroutine least_pressure

   !> True for an element that would need an infinite force to lie on its track.
   logical function bends_at_once(problem, state, e)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                     !! on an obstacle
      associate (c => problem%conforms(e), list => problem%candidates)
         bends_at_once = jump_between(problem%model%obstacle(list%obstacle(c)), -candidate_offset(problem, state, list, c), &
            & node_track(problem, state, c), node_track(problem, state, list%neighbour(2, c)))
      end associate
   end function bends_at_once

   !> The density of the obstacle's force if the rod lay on it at a point contact: what bends it onto the track, r = m'' with
   !> m = EI (curvature of the track less its own), and what the normal force and the loads across press.
   real(wp) function virtual_pressure(problem, state, candidate, beside) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(in), optional :: beside      !! as excess_curvature has it
      type(ge_load_t) :: load
      type(track_t) :: track
      real(wp) :: angle, sense, stretch, excess, axial, normal(2), bend(0:2)
      integer :: e
      e = maxval(problem%candidates%element(:, candidate))
      if (present(beside)) e = problem%candidates%element(beside, candidate)
      load = element_load(problem, state, e)
      track = node_track(problem, state, candidate)
      sense = track_sense(problem, state, candidate, track)
      angle = rod_angle(problem, state, candidate)
      normal = [-sin(angle), cos(angle)]
      call excess_curvature(problem, state, candidate, excess, stretch, beside)
      axial = (stretch - 1.0_wp - load%strain) / problem%compliance(e)%axial
      bend = bend_at(problem, state, e, merge(0.0_wp, 1.0_wp, problem%model%mesh%node(1, e) == problem%candidates%node(candidate)))
      density = (track%curvature_second * stretch**3 - sense * bend(2)) / &
         & problem%compliance(e)%bending - (axial * track%curvature * stretch + sense * (dot_product(load%line, normal) + &
         & load%pressure * stretch))
   end function virtual_pressure
end module line_pressure
