!> What presses a rod along a line of contact: the density of the obstacle's force.
module line_pressure
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_load, candidate_offset
   use conforming_span, only: conforming_forces, excess_curvature, node_track, track_sense, rod_angle, bend_at, &
      & track_joints, ge_end
   use obstacle_track, only: track_t, jump_between
   use ge_element, only: ge_load_t
   use contact_spans, only: contact_span_t
   use state_transfer, only: find_point
   use golden_section, only: golden_section_t
   implicit none
   private
   public :: pressure_t, sample_line, density_at, least_pressure, virtual_pressure

   integer, parameter :: samples = 4            !! of the density in an element
   integer, parameter :: sections = 24          !! golden ones, of what is between the neighbours of a least sample: to 1e-5 of it

   !> The density along a line.
   type :: pressure_t
      real(wp), allocatable :: at(:)            !! places along the stretch, rising
      real(wp), allocatable :: density(:)       !! there
   end type pressure_t

contains

   !> The density along a line: at equal parts of its elements, where its track is joined, and where it is least between these.
   function sample_line(problem, state, line) result(pressure)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! as it is now
      type(pressure_t) :: pressure
      real(wp), allocatable :: at(:), density(:)
      real(wp) :: place
      integer :: e, i
      allocate (pressure%at(0))
      do e = line%element(1), line%element(2)
         associate (s => state%geometry%element(e)%s + problem%origin(e))
            call merge_places(pressure%at, [(s(1) + (s(2) - s(1)) * i / samples, i=0, samples)])
            call merge_places(pressure%at, s(1) + (s(2) - s(1)) * track_joints(problem, state, e))
         end associate
      end do
      pressure%density = [(density_at(problem, state, line, pressure%at(i)), i=1, size(pressure%at))]
      at = pressure%at
      density = pressure%density
      do i = 2, size(at) - 1
         if (density(i) > density(i - 1) .or. density(i) >= density(i + 1)) cycle
         place = least_between(problem, state, line, at(i - 1), at(i + 1))
         if (density_at(problem, state, line, place) < density(i)) call merge_places(pressure%at, [place])
      end do
      if (size(pressure%at) > size(at)) &
         & pressure%density = [(density_at(problem, state, line, pressure%at(i)), i=1, size(pressure%at))]
   end function sample_line

   !> Puts rising places among others; what is there already is not there twice.
   pure subroutine merge_places(all, new)
      real(wp), allocatable, intent(inout) :: all(:)
      real(wp), intent(in) :: new(:)
      integer :: k, n
      do k = 1, size(new)
         n = count(all < new(k))
         if (any(abs(all - new(k)) <= 10.0_wp * epsilon(new) * abs(new(k)))) cycle
         all = [all(:n), new(k), all(n + 1:)]
      end do
   end subroutine merge_places

   !> The place of the one minimum of the density between two others.
   real(wp) function least_between(problem, state, line, first, last) result(place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line
      real(wp), intent(in) :: first, last
      type(golden_section_t) :: search
      call search%begin(first, last, sections)
      do while (search%asks(place))
         call search%tell(density_at(problem, state, line, place))
      end do
   end function least_between

   !> Density of a line's force at one place along its stretch.
   real(wp) function density_at(problem, state, line, at) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! as it is now
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
   subroutine least_pressure(problem, state, line, least, where, side)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! as it is now
      real(wp), intent(out) :: least               !! -huge(least): its track bends at once, where no rod can follow
      real(wp), intent(out) :: where               !! along the stretch
      integer, intent(out) :: side                 !! -1: at its first end, 0: inside, 1: at its last
      type(pressure_t) :: pressure
      integer :: e, i
      side = 0
      do e = line%element(1), line%element(2)
         if (.not. bends_at_once(problem, state, e)) cycle
         least = -huge(least)
         where = state%geometry%element(e)%s(1) + problem%origin(e)
         return
      end do
      pressure = sample_line(problem, state, line)
      i = minloc(pressure%density, 1)
      least = pressure%density(i)
      where = pressure%at(i)
      if (i == 1) side = -1
      if (i == size(pressure%at)) side = 1
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
      real(wp) :: angle, sense, stretch, excess, axial, force(2), moment, normal(2), bend(0:2)
      integer :: e, end
      e = maxval(problem%candidates%element(:, candidate))
      if (present(beside)) e = problem%candidates%element(beside, candidate)
      load = element_load(problem, state, e)
      track = node_track(problem, state, candidate)
      sense = track_sense(problem, state, candidate, track)
      angle = rod_angle(problem, state, candidate)
      normal = [-sin(angle), cos(angle)]
      call excess_curvature(problem, state, candidate, excess, stretch, beside)
      end = merge(1, 2, problem%model%mesh%node(1, e) == problem%candidates%node(candidate))
      call ge_end(problem, state, e, end, force, moment)
      axial = cos(angle) * force(1) + sin(angle) * force(2)
      ! Newton's method leaves so much of it: where it is zero its sign, which decides between a line and two points, is chance.
      if (abs(axial) <= problem%model%step(problem%step)%tolerance * norm2(force)) axial = 0.0_wp
      bend = bend_at(problem, state, e, end - 1.0_wp)
      density = (track%curvature_second * stretch**3 - sense * bend(2)) / &
         & problem%compliance(e)%bending - (axial * track%curvature * stretch + sense * (dot_product(load%line, normal) + &
         & load%pressure * stretch))
   end function virtual_pressure
end module line_pressure
