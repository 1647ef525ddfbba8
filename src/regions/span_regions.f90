!> Contact regions of a state with contact spans, for the results: one for each connected contact, in order along the rods.
module span_regions
   use kinds, only: wp
   use mesh_density, only: position_rounding
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_position, pose_of
   use rod_profile, only: new_profile, profile_place
   use state_transfer, only: find_point
   use obstacle_pose, only: pose_t
   use obstacle_geometry, only: contact_angle, turns_forward, unwrap_angle
   use track_nodes, only: rod_angle, rolled_t, rolled
   use breakpoint_forces, only: is_supported
   use path_record, only: region_t
   use error_bar, only: error_bars_t, new_error_bar
   use ordering, only: ascending
   implicit none
   private
   public :: find_span_regions, beginning_region, chain_coordinate, lengths_before, assign_place_bars

contains

   !> All regions, contact by contact along the chains. A line contact that continues past a segment boundary is a single region.
   function find_span_regions(problem, state) result(regions)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(region_t), allocatable :: regions(:)
      logical :: seen(problem%candidates%n)
      integer :: c
      allocate (regions(0))
      seen = problem%candidates%contact_span(:problem%candidates%n) == 0
      ! A support may hold a node on an obstacle without contact beside the node; such a node is not a region.
      do c = 1, problem%candidates%n
         if (seen(c) .or. any(problem%candidates%neighbour(:, c) > 0)) cycle
         seen(c) = is_supported(problem, state, c)
      end do
      do c = 1, problem%candidates%n
         if (.not. seen(c) .and. problem%candidates%neighbour(1, c) == 0) regions = [regions, follow(c)]
      end do
      ! All candidates that remain belong to closed chains that are in contact all round.
      do c = 1, problem%candidates%n
         if (.not. seen(c)) regions = [regions, follow(c)]
      end do
      regions = regions(ascending(regions%start))
      regions = regions(ascending(real(regions%contact, wp)))

   contains

      !> Contact region that begins at a candidate.
      type(region_t) function follow(first) result(region)
         integer, intent(in) :: first
         logical :: forward
         real(wp) :: theta
         type(pose_t) :: pose
         type(rolled_t) :: roll
         integer :: last
         last = first
         seen(first) = .true.
         do while (problem%candidates%neighbour(2, last) > 0)
            if (seen(problem%candidates%neighbour(2, last))) exit
            last = problem%candidates%neighbour(2, last)
            seen(last) = .true.
         end do
         region%contact = problem%candidates%contact(first)
         region%contact_span = [number_of(first), number_of(last)]
         region%moves = problem%candidates%moves([first, last]) .or. problem%candidates%rolls([first, last])
         region%line = last /= first
         roll = rolled_t()
         if (last == first) roll = rolled(problem, state, first)
         region%start = chain_coordinate(problem, state, first, 2) + roll%way
         region%angle_start = angle_at(first, roll%arm)
         region%end = region%start
         region%angle_end = region%angle_start
         if (problem%candidates%neighbour(2, last) == first) then
            region%end = region%start + problem%chain_length(region%contact)
         else if (last /= first) then
            region%end = chain_coordinate(problem, state, last, 1)
            region%angle_end = angle_at(last, roll%arm)
            if (region%end < region%start) region%end = region%end + problem%chain_length(region%contact)
         end if
         associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(first)))
            if (last == first) return
            theta = rod_angle(problem, state, last)
            pose = pose_of(problem, state, problem%candidates%obstacle(first))
            forward = turns_forward(obstacle, candidate_position(problem, state, last), &
               & pose%own_direction([cos(theta), sin(theta)]))
            call unwrap_angle(obstacle, region%end - region%start, forward, region%angle_start, region%angle_end)
         end associate
      end function follow

      !> Identity number of the contact span at a candidate.
      pure integer function number_of(candidate)
         integer, intent(in) :: candidate
         number_of = problem%contact_span(problem%candidates%contact_span(candidate))%number
      end function number_of

      !> Angle, on the obstacle, of the place at which the contact force acts; NaN if the obstacle has no angles.
      real(wp) function angle_at(candidate, arm) result(angle)
         integer, intent(in) :: candidate
         real(wp), intent(in) :: arm(2)          !! vector from the candidate's node to the force
         type(pose_t) :: pose
         associate (o => problem%candidates%obstacle(candidate))
            pose = pose_of(problem, state, o)
            angle = contact_angle(problem%model%obstacle(o), candidate_position(problem, state, candidate) + &
               & pose%own_direction(arm))
         end associate
      end function angle_at
   end function find_span_regions

   !> Assigns the error bars of touchdown points to the ends of their regions. On a closed chain the coordinates of an end and of
   !> its touchdown point may differ by the length of the chain, because the end of a region is not less than its start.
   subroutine assign_place_bars(problem, bars, regions)
      type(problem_t), intent(in) :: problem
      type(error_bars_t), intent(in) :: bars
      type(region_t), intent(inout) :: regions(:)
      logical, allocatable :: mine(:), unknown(:)
      real(wp), allocatable :: off(:)             ! from the ends of the region to the touchdown points
      real(wp) :: at(2)
      integer :: r, side, k
      if (.not. allocated(bars%place)) return
      unknown = [(.not. any([(any(regions(r)%contact_span == bars%place(k)%contact_span), r=1, size(regions))]), &
         & k=1, size(bars%place))]
      do r = 1, size(regions)
         at = [regions(r)%start, regions(r)%end]
         do side = 1, 2
            associate (bar => regions(r)%bar(side), place => bars%place)
               mine = place%contact_span == regions(r)%contact_span(side) .and. (place%last .eqv. (side == 2 .and. &
                  & regions(r)%line))
               ! A contact that has just begun has no number yet. At a bifurcation away from a force-free line contact, the bars are
               ! those of the point contacts that take the place of its ends.
               if (.not. any(mine)) mine = unknown
               off = place%at - at(side)
               associate (round => problem%chain_length(regions(r)%contact))
                  if (round > 0.0_wp) off = off - round * anint(off / round)
               end associate
               k = minloc(abs(off), 1, mask=mine)
               if (.not. regions(r)%moves(side)) then
                  bar = new_error_bar(0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp)
               else if (k > 0) then
                  ! Where contact begins, the position of the least gap and that of the new point contact differ by the error of the
                  ! element's polynomials.
                  bar = place(k)%bar
                  bar%correction = bar%correction + off(k)
                  bar%bar = bar%bar + abs(off(k))
               end if
            end associate
         end do
      end do
   end subroutine assign_place_bars

   !> Region of a point contact that is just beginning: its gap and its force are zero.
   type(region_t) function beginning_region(problem, state, contact, rod_segment, at) result(region)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact, rod_segment
      real(wp), intent(in) :: at            !! coordinate along the rod segment
      real(wp) :: tau
      integer :: e
      type(pose_t) :: pose
      call find_point(problem, state, rod_segment, at, e, tau)
      region%contact = contact
      region%start = once_round(problem, contact, problem%chain_start(rod_segment, contact) + tau * &
         & state%geometry%element(e)%length + sum(state%geometry%element(problem%element_first(rod_segment):e - 1)%length), side=2)
      region%end = region%start
      associate (o => problem%model%contact(contact)%obstacle)
         pose = pose_of(problem, state, o)
         region%angle_start = contact_angle(problem%model%obstacle(o), &
            & pose%own_place(profile_place(problem, new_profile(problem, state, e), tau)))
      end associate
      region%angle_end = region%angle_start
   end function beginning_region

   !> Stress-free arc length of a candidate along the chain of its contact, at most once round a closed chain.
   pure real(wp) function chain_coordinate(problem, state, candidate, side, before) result(s)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(in) :: side !! side of the candidate on which the element is taken to compute the coordinate: 1: before the
      !! candidate, 2: after it. The side matters where a chain closes, because coordinates jump there
      real(wp), intent(in), optional :: before(:) !! result of lengths_before, which saves time if the coordinates of many
      !! candidates are needed
      integer :: e, tried, at
      ! If the contact does not cover the rod beyond a segment boundary, the element on the opposite side gives the coordinate.
      at = side
      do tried = 1, 2
         e = problem%candidates%element(at, candidate)
         if (e > 0) then
            if (problem%covered(problem%rod_segment(e), problem%candidates%contact(candidate))) exit
         end if
         at = 3 - at
      end do
      associate (rod_segment => problem%rod_segment(e))
         if (present(before)) then
            s = before(e)
            if (at == 1) s = s + state%geometry%element(e)%length
         else
            s = sum(state%geometry%element(problem%element_first(rod_segment):e - at + 1)%length)
         end if
         s = problem%chain_start(rod_segment, problem%candidates%contact(candidate)) + s
      end associate
      s = once_round(problem, problem%candidates%contact(candidate), s, at)
   end function chain_coordinate

   !> Coordinate along the chain of a contact, at most once round a closed chain. A rod segment may continue over the place where
   !> the chain closes: just before this place the coordinate is the length of the chain, just behind it zero.
   pure real(wp) function once_round(problem, contact, s, side)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact
      real(wp), intent(in) :: s             !! coordinate, counted on from the start of the rod segment
      integer, intent(in) :: side           !! 1: where the chain closes the coordinate is its length; 2: it is zero there
      once_round = s
      associate (round => problem%chain_length(contact))
         if (round > 0.0_wp .and. s > (1.0_wp + merge(1, -1, side == 1) * position_rounding) * round) once_round = max(0.0_wp, &
            & s - round)
      end associate
   end function once_round

   !> (elements) Stress-free length between the beginning of the element's rod segment and the element.
   pure function lengths_before(problem, state) result(before)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: before(problem%model%mesh%n_elements)
      integer :: j, e
      do j = 1, size(problem%element_first)
         do e = problem%element_first(j), problem%element_last(j)
            before(e) = 0.0_wp
            if (e > problem%element_first(j)) before(e) = before(e - 1) + state%geometry%element(e - 1)%length
         end do
      end do
   end function lengths_before
end module span_regions
