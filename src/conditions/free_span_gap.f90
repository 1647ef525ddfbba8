!> Least and largest gap between a free span and an obstacle. Beside a contact span the gap increases from zero. Near such an end of
!> the free span its small values mean nothing, so that only local minima of the gap count.
module free_span_gap
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, pose_of, obstacle_offset
   use ge_in_state, only: ge_here_t
   use rod_profile, only: profile_t, new_profile, keep_profile, mend_ends, mended_error, profile_place
   use obstacle_geometry, only: obstacle_gap, nearest_piece, joints_apart
   use obstacle_pose, only: pose_t
   use state_transfer, only: find_point
   use minimum_search, only: minimum_search_t, to_rounding
   implicit none
   private
   public :: gap_at, least_gap, gap_minimum_t

   ! Beside a touchdown point the gap grows with a power of the distance from the point; there only local minima of the gap count.
   real(wp), parameter :: beside = 0.06_wp  !! length of the part in which only local minima count, over the length of the free span
   integer, parameter :: samples = 4 !! number of equal parts into which samples of the gap divide an element; also the number of
   !! samples in such a part for each joint of the obstacle's curve that lies beside the part, because each piece of the curve may
   !! come near the rod
   !> Beside a contact the distances of samples from the contact grow by this factor from sample to sample, until samples are as far
   !> apart as the equal parts of the element are long. If the rod rotates about a point contact, the gap beside the contact first
   !> grows and then falls below zero; its least value is at twice the distance of its largest value. Samples at doubled distances
   !> could miss both.
   real(wp), parameter :: graded = sqrt(2.0_wp)
   real(wp), parameter :: nearest = 0.5_wp**10 !! distance of the first sample from a contact, over the length of an equal part

   !> Sampled gap of the elements from `first` to `last` to one obstacle.
   type :: sampled_gap_t
      integer :: first = 0, last = 0
      integer :: contact = 0                   !! index into model%contact
      logical :: touches(2) = .false. !! true: the first node of the first element, or the last node of the last element, touches
      !! this obstacle, so that the gap is zero there
      logical :: ends_in_contact(2) = .false. !! true: on this side the free span ends in contact with this obstacle, at the sampled
      !! elements or beyond a segment boundary
      real(wp) :: contact_at(2) = 0.0_wp       !! coordinates, along the rod segment, of the contacts at which the free span ends
      real(wp), allocatable :: at(:)           !! coordinates of the samples along the rod segment, increasing
      real(wp), allocatable :: gap(:)          !! gaps at the samples
   end type sampled_gap_t

   !> Local minimum of the gap.
   type :: gap_minimum_t
      real(wp) :: gap = 0.0_wp
      real(wp) :: at = 0.0_wp                  !! coordinate along the rod segment
   end type gap_minimum_t

contains

   !> Gap between a material point of the rod and the obstacle of a contact.
   real(wp) function gap_at(problem, state, contact, rod_segment, at) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact, rod_segment
      real(wp), intent(in) :: at            !! coordinate of the point along the rod segment
      real(wp) :: tau
      integer :: e
      call find_point(problem, state, rod_segment, at, e, tau)
      gap = gap_in(problem, state, contact, new_profile(problem, state, e), tau)
   end function gap_at

   !> Gap to the obstacle of a contact at a place in an element, tau = 0 (first node) to 1 (second node).
   real(wp) function gap_in(problem, state, contact, profile, tau) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp) :: normal(2), bend
      type(pose_t) :: pose
      associate (o => problem%model%contact(contact)%obstacle)
         pose = pose_of(problem, state, o)
         call obstacle_gap(problem%model%obstacle(o), pose%own_place(profile_place(problem, profile, tau)), gap, normal, bend)
         gap = gap + obstacle_offset(problem, state, o, problem%model%contact(contact)%gap, problem%overlap(contact))
      end associate
   end function gap_in

   !> Finds the least gap, and its position, between an obstacle and elements that do not touch it. The elements are those of a free
   !> span in a rod segment, or those in line contact with another obstacle.
   subroutine least_gap(problem, state, element, contact, touched, fails, profile, least, where, uncertain, largest, level, low)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: element(2)        !! first and last element
      integer, intent(in) :: contact           !! index into model%contact
      logical, intent(in) :: touched(:)        !! (nodes) true: the node touches any obstacle
      logical, intent(in) :: fails(:) !! (nodes) true: the node touches this obstacle, but the test of its own contact fails. A
      !! penetration that begins at such a node is an effect of this failed contact and is not counted
      type(profile_t), intent(inout) :: profile(:) !! (elements) rod profiles (deformed axes) of this state; those of the given
      !! elements are made if they do not exist
      real(wp), intent(out) :: least           !! least gap; the structure's size if no sample counts
      real(wp), intent(out) :: where           !! coordinate of the least gap along the rod segment
      real(wp), intent(out) :: uncertain !! bound of the error of the least gap, including that other samples may be lower by their
      !! own errors
      real(wp), intent(out) :: largest !! gap with the largest magnitude of all samples, with its sign (< 0: inside the obstacle)
      real(wp), intent(in), optional :: level  !! local minima with at most this gap are listed in `low`
      type(gap_minimum_t), allocatable, intent(out), optional :: low(:) !! local minima with at most the gap `level`, in order along
      !! the rod
      type(sampled_gap_t) :: line
      type(gap_minimum_t), allocatable :: minimum(:)
      real(wp) :: counts(2), from, to, value, place, tops(2), error, most
      integer :: i, begin, end
      line%first = element(1)
      line%last = element(2)
      line%contact = contact
      call find_contact_beside(problem, state, line, touched, counts)
      call make_profiles(problem, state, element, profile)
      call take_samples(problem, state, profile, line)
      from = problem%origin(line%first) + state%geometry%element(line%first)%s(1)
      to = problem%origin(line%last) + state%geometry%element(line%last)%s(2)
      begin = 1
      end = size(line%gap)
      associate (gap => line%gap)
         if (line%touches(1) .and. fails(problem%model%mesh%node(1, line%first))) begin = findloc([gap > 0.0_wp, .true.], .true., 1)
         if (line%touches(2) .and. fails(problem%model%mesh%node(2, line%last))) &
            & end = findloc([.true., gap > 0.0_wp], .true., 1, back=.true.) - 1
         largest = gap(maxloc(abs(gap), 1))
         least = huge(least)
         where = 0.5_wp * (from + to)
         most = -huge(most)
         if (present(level)) most = level
         allocate (minimum(0))
         do i = begin, end
            if (line%at(i) >= counts(1) .and. line%at(i) <= counts(2)) call take(gap(i), line%at(i))
            if (i == 1 .or. i == size(gap)) then
               ! If the gap decreases from an end without contact (a segment boundary) inwards, it may have a minimum further
               ! inside.
               if (line%touches(merge(1, 2, i == 1))) cycle
               if (.not. falls_inwards(problem, state, profile, line, i)) cycle
            else
               if (gap(i) > gap(i - 1) .or. gap(i) > gap(i + 1)) cycle
               ! The minimum of the parabola through these samples cannot be below the least gap found so far.
               if (2.0_wp * gap(i) - max(gap(i - 1), gap(i + 1)) > max(least, most)) cycle
            end if
            call find_minimum(problem, state, profile, line, i, value, place)
            ! A minimum next to a contact span may be a discretisation error. A penetration counts there only as far as it exceeds
            ! the interpolation error. Where the gap does not rise between the contact and the minimum, this excess must be larger
            ! than rounding.
            error = 0.0_wp
            if (place < counts(1) .or. place > counts(2)) error = gap_error_bound(problem, state, profile, line, place)
            tops = [merge(maxval(gap(:i)), huge(value), line%touches(1)), merge(maxval(gap(i:)), huge(value), line%touches(2))]
            if (minval(tops) <= rounding_gap(problem) .and. value + error >= -rounding_gap(problem)) cycle
            call take(value + error, place)
            if (value + error <= most) minimum = [minimum, gap_minimum_t(value + error, place)]
         end do
      end associate
      uncertain = 0.0_wp
      if (least < huge(least)) then
         uncertain = gap_error_bound(problem, state, profile, line, where)
         do i = begin, end
            if (line%at(i) < counts(1) .or. line%at(i) > counts(2)) cycle
            uncertain = max(uncertain, least - line%gap(i) + gap_error_bound(problem, state, profile, line, line%at(i)))
         end do
      end if
      if (least >= huge(least)) least = problem%size
      if (present(low)) call move_alloc(minimum, low)

   contains

      subroutine take(value, place)
         real(wp), intent(in) :: value, place
         if (value >= least) return
         least = value
         where = place
      end subroutine take
   end subroutine least_gap

   !> Determines whether the ends of the sampled elements touch this obstacle, and the coordinates between which a gap counts even
   !> if it is not a local minimum. The margin beside a contact is a part of the length of the whole free span, which may cross
   !> segment boundaries.
   pure subroutine find_contact_beside(problem, state, line, touched, counts)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(inout) :: line
      logical, intent(in) :: touched(:)        !! (nodes) true: the node touches any obstacle
      real(wp), intent(out) :: counts(2)       !! coordinates along the rod segment between which every gap counts
      real(wp) :: more(2), ends(2), margin
      logical :: touching(problem%model%mesh%n_nodes)
      integer :: side
      touching = .false.
      touching(pack(problem%candidates%node, problem%candidates%contact_span > 0 .and. &
         & problem%candidates%contact == line%contact)) = .true.
      line%touches = touching([problem%model%mesh%node(1, line%first), problem%model%mesh%node(2, line%last)])
      ends = [problem%origin(line%first) + state%geometry%element(line%first)%s(1), &
         & problem%origin(line%last) + state%geometry%element(line%last)%s(2)]
      do side = 1, 2
         call to_next_touch(problem, state, touched, touching, merge(line%first, line%last, side == 1), side, more(side), &
            & line%ends_in_contact(side))
      end do
      line%contact_at = ends + [-more(1), more(2)]
      margin = beside * (ends(2) - ends(1) + sum(more))
      counts = ends
      if (line%ends_in_contact(1)) counts(1) = max(ends(1), line%contact_at(1) + margin)
      if (line%ends_in_contact(2)) counts(2) = min(ends(2), line%contact_at(2) - margin)
   end subroutine find_contact_beside

   !> Determines the length of the free span beyond one end of an element. `touches` is true if the free span ends at a contact with
   !> this obstacle.
   pure subroutine to_next_touch(problem, state, touched, touching, element, side, length, touches)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: touched(:), touching(:) !! (nodes) true: the node touches any obstacle; true: the node touches this
      !! obstacle
      integer, intent(in) :: element, side !! element at which the search begins; direction of the search: 1: before its first node,
      !! 2: after its last node
      real(wp), intent(out) :: length
      logical, intent(out) :: touches
      integer :: e, node
      length = 0.0_wp
      e = element
      do
         node = problem%model%mesh%node(side, e)
         touches = touching(node)
         if (touched(node)) return
         e = problem%beside(side, node)
         if (e == 0 .or. e == element) return
         if (problem%conforms(e) > 0) return
         associate (s => state%geometry%element(e)%s)
            length = length + s(2) - s(1)
         end associate
      end do
   end subroutine to_next_touch

   !> Makes the rod profile (interpolated deformed axis) of each element. A geometrically exact element (GE) gets a correction at
   !> its ends (mend_ends). A conforming element has the shape of its obstacle and needs none.
   subroutine make_profiles(problem, state, element, profile)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: element(2)      !! first and last element
      type(profile_t), intent(inout) :: profile(:)
      type(ge_here_t) :: here
      integer :: e
      do e = element(1), element(2)
         if (profile(e)%element == e) cycle
         call keep_profile(problem, state, e, profile(e), here)
         if (problem%conforms(e) > 0) cycle
         if (problem%model%mesh%family(e) == family_ge) call mend_ends(problem, state, profile(e), 2, here)
      end do
   end subroutine make_profiles

   !> Samples the gap at equal parts of all elements, more densely where several pieces of the obstacle's curve lie beside such a
   !> part, and at graded distances (`graded`) beside a contact. The contact itself is no sample.
   subroutine take_samples(problem, state, profile, line)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(in) :: profile(:)
      type(sampled_gap_t), intent(inout) :: line
      real(wp), allocatable :: tau(:)          ! (at least n) places in the element, increasing
      real(wp), allocatable :: at(:), gap(:)   ! (at least `taken`) coordinates and gaps of the samples so far
      type(pose_t) :: pose
      integer :: e, k, n, side, taken
      n = (samples + 1) * (line%last - line%first + 1)
      allocate (tau(8 * samples), at(n), gap(n))
      taken = 0
      do e = line%first, line%last
         n = 0
         do k = 0, samples
            ! A node between two elements is a sample of the first one.
            if (k == 0 .and. (e > line%first .or. line%touches(1))) cycle
            if (k == samples .and. e == line%last .and. line%touches(2)) cycle
            n = n + 1
            tau(n) = real(k, wp) / samples
         end do
         call pass_joints()
         associate (g => state%geometry%element(e))
            do side = 1, 2
               if (line%ends_in_contact(side)) call grade(g%s(1) + problem%origin(e), g%s(2) + problem%origin(e), side)
            end do
            if (taken + n > size(at)) then
               at = [at(:taken), spread(0.0_wp, 1, taken + n)]
               gap = [gap(:taken), spread(0.0_wp, 1, taken + n)]
            end if
            do k = 1, n
               at(taken + k) = g%s(1) + tau(k) * (g%s(2) - g%s(1)) + problem%origin(e)
               gap(taken + k) = gap_in(problem, state, line%contact, profile(e), tau(k))
            end do
            taken = taken + n
         end associate
      end do
      line%at = at(:taken)
      line%gap = gap(:taken)

   contains

      !> Adds samples in those equal parts of the element along which the nearest point passes joints of the obstacle's curve.
      subroutine pass_joints()
         integer :: piece(0:samples), joints(samples), part, i
         associate (o => problem%model%contact(line%contact)%obstacle)
            if (.not. allocated(problem%model%obstacle(o)%curve%piece)) return
            pose = pose_of(problem, state, o)
            do part = 0, samples
               piece(part) = nearest_piece(problem%model%obstacle(o), pose%own_place(profile_place(problem, profile(e), &
                  & real(part, wp) / samples)))
            end do
            joints = [(joints_apart(problem%model%obstacle(o), piece(part - 1), piece(part)), part=1, samples)]
            do part = 1, samples
               do i = 1, samples * joints(part) - 1
                  call insert((part - 1 + real(i, wp) / (samples * joints(part))) / samples)
               end do
            end do
         end associate
      end subroutine pass_joints

      !> Adds samples at graded distances from the contact at one end of the free span, up to the distance at which equal parts lie
      !> as close.
      subroutine grade(from, to, side)
         real(wp), intent(in) :: from, to      !! coordinates of the element's ends along the rod segment
         integer, intent(in) :: side           !! end of the free span
         real(wp) :: distance, least, most, at
         associate (contact => line%contact_at(side))
            least = merge(from - contact, contact - to, side == 1)
            most = merge(to - contact, contact - from, side == 1)
         end associate
         associate (g => state%geometry%element(merge(line%first, line%last, side == 1)))
            distance = nearest * (g%s(2) - g%s(1)) / samples
         end associate
         if (least > distance) distance = distance * graded**ceiling(log(least / distance) / log(graded))
         do while (distance < most .and. (graded - 1.0_wp) * distance < (to - from) / samples)
            at = (line%contact_at(side) + merge(distance, -distance, side == 1) - from) / (to - from)
            if (all(abs(tau(:n) - at) > sqrt(epsilon(at)))) call insert(at)
            distance = graded * distance
         end do
      end subroutine grade

      !> Inserts a place in the element between its neighbours.
      subroutine insert(at)
         real(wp), intent(in) :: at
         if (n == size(tau)) tau = [tau, tau]
         k = n
         do while (k > 0)
            if (tau(k) < at) exit
            tau(k + 1) = tau(k)
            k = k - 1
         end do
         tau(k + 1) = at
         n = n + 1
      end subroutine insert
   end subroutine take_samples

   !> True if the gap decreases from the first or last sample inwards but is not smaller at the next sample: the minimum then lies
   !> between these two samples, and no sample shows it.
   logical function falls_inwards(problem, state, profile, line, i) result(falls)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(in) :: profile(:)
      type(sampled_gap_t), intent(in) :: line
      integer, intent(in) :: i
      real(wp) :: share
      integer :: next
      next = merge(i + 1, i - 1, i == 1)
      falls = line%gap(next) >= line%gap(i)
      if (.not. falls) return
      ! The gap is compared at a small share of the way to the next sample: the square root of the machine epsilon, over which the
      ! decrease by a slope exceeds rounding. At a symmetry plane the slope is zero; a decrease by curvature exceeds rounding over
      ! the fourth root.
      share = sqrt(epsilon(share))
      falls = below(share)
      if (.not. falls) falls = below(sqrt(share))

   contains

      !> True if the gap at a share of the way to the next sample is smaller than at the sample itself.
      logical function below(share)
         real(wp), intent(in) :: share
         below = gap_along(problem, state, profile, line, line%at(i) + share * (line%at(next) - line%at(i))) < line%gap(i)
      end function below
   end function falls_inwards

   !> Finds the minimum of the gap between the two neighbours of sample `i`, which is the lowest of the three samples.
   subroutine find_minimum(problem, state, profile, line, i, value, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(in) :: profile(:)
      type(sampled_gap_t), intent(in) :: line
      integer, intent(in) :: i
      real(wp), intent(out) :: value, place
      type(minimum_search_t) :: search
      integer :: before, after
      before = max(i - 1, 1)
      after = min(i + 1, size(line%at))
      ! Beside a symmetry plane, and beside contact, rounding causes minima that do not count. Inside the span, the minimum of the
      ! parabola through the three samples is below the lowest sample by no more than the higher neighbour is above this sample; if
      ! this is rounding, no search is made.
      value = line%gap(i)
      place = line%at(i)
      if (before < i .and. i < after .and. max(line%gap(before), line%gap(after)) - value <= rounding_gap(problem)) return
      call search%begin(line%at(before), line%at(after), to_rounding)
      do while (search%next_guess(place))
         call search%take_value(gap_along(problem, state, profile, line, place))
      end do
      if (search%least < value - rounding_gap(problem)) then
         value = search%least
      else
         place = line%at(i)
      end if
   end subroutine find_minimum

   !> Gap at a coordinate along the rod segment.
   real(wp) function gap_along(problem, state, profile, line, place) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(in) :: profile(:)
      type(sampled_gap_t), intent(in) :: line
      real(wp), intent(in) :: place
      real(wp) :: tau
      integer :: e
      call find_part(problem, state, line, place, e, tau)
      gap = gap_in(problem, state, line%contact, profile(e), tau)
   end function gap_along

   !> Bound of the error of the gap at a position: the interpolation error of the element, plus, for each end in contact, the gap at
   !> the sample nearest to this contact, where the exact gap is almost zero.
   real(wp) function gap_error_bound(problem, state, profile, line, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(profile_t), intent(in) :: profile(:)
      type(sampled_gap_t), intent(in) :: line
      real(wp), intent(in) :: place
      real(wp) :: tau
      integer :: e
      call find_part(problem, state, line, place, e, tau)
      gap_error_bound = mended_error(profile(e), tau)
      if (line%touches(1)) gap_error_bound = gap_error_bound + abs(line%gap(1))
      if (line%touches(2)) gap_error_bound = gap_error_bound + abs(line%gap(size(line%gap)))
   end function gap_error_bound

   !> Finds, by bisection, the element at a coordinate along the rod segment, and the place tau (0 to 1) in it.
   pure subroutine find_part(problem, state, line, place, e, tau)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(in) :: line
      real(wp), intent(in) :: place
      integer, intent(out) :: e
      real(wp), intent(out) :: tau
      integer :: last, middle
      e = line%first
      last = line%last
      do while (e < last)
         middle = (e + last) / 2
         if (place <= problem%origin(middle) + state%geometry%element(middle)%s(2)) then
            last = middle
         else
            e = middle + 1
         end if
      end do
      associate (s => state%geometry%element(e)%s)
         tau = (place - problem%origin(e) - s(1)) / (s(2) - s(1))
      end associate
   end subroutine find_part
end module free_span_gap
