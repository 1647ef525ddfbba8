!> Density of the obstacle's force along a line contact [force/length], > 0 where the obstacle presses.
module line_pressure
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use track_nodes, only: track_joints, find_joints
   use conforming_span, only: conforming_state_t, conforming_forces, density_samples, smooth_parts
   use contact_spans, only: contact_span_t
   use lifted_node, only: holding_density
   use state_transfer, only: find_point
   use minimum_search, only: minimum_search_t
   implicit none
   private
   public :: pressure_t, sample_line, least_pressure

   real(wp), parameter :: near = 1.0e-5_wp !! accuracy to which the position of a least density is searched, over the interval
   !! between the two neighbours of the least sample

   !> Density of the obstacle's force, sampled along a line contact.
   type :: pressure_t
      real(wp), allocatable :: at(:)            !! coordinates along the rod segment, increasing
      real(wp), allocatable :: density(:)       !! density at these coordinates
   end type pressure_t

contains

   !> Samples the density along a line contact: at equal parts of its elements, at the joints of its track, and at the minima
   !> between these samples and beside the ends.
   function sample_line(problem, state, line) result(pressure)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! line contact, with its ends in `state`
      type(pressure_t) :: pressure
      real(wp), allocatable :: at(:), density(:)
      type(conforming_state_t) :: kept
      real(wp) :: place
      integer :: side, e, i, n, parts
      n = 0
      allocate (at(8))
      do e = line%element(1), line%element(2)
         associate (s => state%geometry%element(e)%s + problem%origin(e))
            parts = density_samples * smooth_parts(problem, state, e, 1.0_wp)
            do i = 0, parts
               call insert(at, n, s(1) + (s(2) - s(1)) * i / parts)
            end do
            associate (joint => s(1) + (s(2) - s(1)) * track_joints(problem, state, e))
               do i = 1, size(joint)
                  call insert(at, n, joint(i))
               end do
            end associate
         end associate
      end do
      at = at(:n)
      density = [(density_at(problem, state, line, at(i), kept), i=1, n)]
      pressure%at = at
      n = 0
      do i = 1, size(at)
         call insert(pressure%at, n, at(i))
         associate (before => max(i - 1, 1), after => min(i + 1, size(at)))
            if (density(i) > density(before) .or. (density(i) >= density(after) .and. after > i)) cycle
            ! The density is least at an end of the line contact, unless it decreases from the end inwards. At an end on an axis of
            ! symmetry, where the rotation is fixed, the slope of the density is zero except for the errors of splines, so that no
            ! minimum is searched.
            if (before == i .or. after == i) then
               side = merge(1, 2, before == i)
               if (problem%model%fixed(3, problem%model%mesh%node(side, line%element(side)))) cycle
               place = at(i) + near * (at(before) + at(after) - 2.0_wp * at(i))
               if (density_at(problem, state, line, place, kept) >= density(i)) cycle
            end if
            place = least_between(problem, state, line, at(before), at(after), kept)
         end associate
         if (density_at(problem, state, line, place, kept) < density(i)) call insert(pressure%at, n, place)
      end do
      pressure%at = pressure%at(:n)
      if (n > size(at)) density = [(density_at(problem, state, line, pressure%at(i), kept), i=1, n)]
      call move_alloc(density, pressure%density)
   end function sample_line

   !> Inserts a coordinate into an increasing list, at its place near the end of the list. A coordinate that is already in the list
   !> is skipped.
   pure subroutine insert(all, n, place)
      real(wp), allocatable, intent(inout) :: all(:) !! list; its memory is doubled when it is full
      integer, intent(inout) :: n                  !! number of entries in the list
      real(wp), intent(in) :: place
      integer :: k
      k = n
      do while (k > 0)
         if (all(k) < place) exit
         k = k - 1
      end do
      if (any(abs(all(max(1, k):min(n, k + 1)) - place) <= 10.0_wp * epsilon(place) * abs(place))) return
      if (n == size(all)) all = [all, all]
      all(k + 2:n + 1) = all(k + 1:n)
      all(k + 1) = place
      n = n + 1
   end subroutine insert

   !> Position of the least density between two positions.
   real(wp) function least_between(problem, state, line, first, last, kept) result(place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line
      real(wp), intent(in) :: first, last
      type(conforming_state_t), intent(inout) :: kept !! state of the conforming element that was evaluated last, which the next
      !! call uses again, see conforming_forces
      type(minimum_search_t) :: search
      call search%begin(first, last, near)
      do while (search%next_guess(place))
         call search%take_value(density_at(problem, state, line, place, kept))
      end do
   end function least_between

   !> Density of a line contact's force at a coordinate along its rod segment.
   real(wp) function density_at(problem, state, line, at, kept) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! line contact, with its ends in `state`
      real(wp), intent(in) :: at                          !! coordinate along the rod segment
      type(conforming_state_t), intent(inout), optional :: kept !! state of the conforming element that was evaluated last, which
      !! the next call uses again, see conforming_forces
      real(wp) :: local(3), tau
      integer :: e
      call find_point(problem, state, line%rod_segment, at, e, tau)
      if (problem%conforms(e) == 0) then
         ! At the last end of the line contact find_point gives the free element that begins there. The element before it has the
         ! density.
         e = e - 1
         tau = 1.0_wp
      end if
      call conforming_forces(problem, state, e, tau, local, density=density, kept=kept)
   end function density_at

   !> Finds the least density along a line contact and the position of the least density.
   subroutine least_pressure(problem, state, line, least, where, side)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), intent(in) :: line            !! line contact, with its ends in `state`
      real(wp), intent(out) :: least !! least density. Where the curvature of the track jumps, the density that is needed to hold
      !! the rod on the track (holding_density) is subtracted
      real(wp), intent(out) :: where               !! coordinate of the least density along the rod segment
      integer, intent(out) :: side !! part of the line contact with the least density: -1: first end, 0: inside, 1: last end
      type(pressure_t) :: pressure
      integer :: e, i
      pressure = sample_line(problem, state, line)
      i = minloc(pressure%density, 1)
      least = pressure%density(i)
      where = pressure%at(i)
      side = 0
      if (i == 1) side = -1
      if (i == size(pressure%at)) side = 1
      do e = line%element(1), line%element(2)
         call compare_joints(e)
      end do

   contains

      subroutine compare_joints(e)
         integer, intent(in) :: e
         real(wp), allocatable :: share(:), couple(:)
         real(wp) :: at, density
         integer :: i
         call find_joints(problem, state, e, share, couple)
         do i = 1, size(share)
            if (.not. abs(couple(i)) > 0.0_wp) cycle
            associate (s => state%geometry%element(e)%s + problem%origin(e))
               at = s(1) + share(i) * (s(2) - s(1))
            end associate
            density = density_at(problem, state, line, at) - holding_density(problem, e, couple(i))
            if (density >= least) cycle
            least = density
            where = at
            side = 0
         end do
      end subroutine compare_joints
   end subroutine least_pressure
end module line_pressure
