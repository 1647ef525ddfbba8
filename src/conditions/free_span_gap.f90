!> The gap of a free span to an obstacle, where it is least, and where it is largest. Beside a touch the gap rises from zero, and
!> what counts is where it comes down again.
module free_span_gap
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, obstacle_shift
   use rod_profile, only: profile_t, new_profile, mend_ends, mended_error, profile_place
   use obstacle_geometry, only: obstacle_gap
   use state_transfer, only: find_point
   use golden_section, only: golden_section_t, sections_to_rounding
   implicit none
   private
   public :: gap_at, least_gap

   ! Next to a touchdown point the gap grows with a power of the distance: there minima count only.
   real(wp), parameter :: beside = 0.06_wp  !! of a span
   integer, parameter :: samples = 4        !! of the gap in an element
   !> The way to the second sample beside a touch, again and again divided by the square root of two. Where a rod comes down beside
   !> a point that it turns over, it is least twice as far from that as it is largest: between samples that each halve the way both
   !> can hide.
   integer, parameter :: near = 20

   !> The gap of the elements from `first` to `last` to one obstacle, sampled.
   type :: sampled_gap_t
      integer :: first = 0, last = 0
      integer :: contact = 0                   !! index into model%contact
      logical :: touches(2) = .false.          !! the obstacle at the ends of these elements: there the gap is zero for certain
      type(profile_t), allocatable :: profile(:) !! (first:last)
      real(wp), allocatable :: at(:)           !! coordinates of the samples along the stretch, rising
      real(wp), allocatable :: gap(:)          !! and the gaps there
   end type sampled_gap_t

contains

   !> Gap of a material point to the obstacle of a contact.
   real(wp) function gap_at(problem, state, contact, stretch, at) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact, stretch
      real(wp), intent(in) :: at            !! along the stretch
      real(wp) :: tau
      integer :: e
      call find_point(problem, state, stretch, at, e, tau)
      gap = gap_in(problem, state, contact, new_profile(problem, state, e), tau)
   end function gap_at

   !> Gap of a place inside an element.
   real(wp) function gap_in(problem, state, contact, profile, tau) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      type(profile_t), intent(in) :: profile
      real(wp), intent(in) :: tau
      real(wp) :: normal(2), bend
      associate (o => problem%model%contact(contact)%obstacle)
         call obstacle_gap(problem%model%obstacle(o), profile_place(problem, profile, tau) - obstacle_shift(problem, state, o), &
            & gap, normal, bend)
      end associate
      gap = gap + contact_offset(problem, state, contact)
   end function gap_in

   !> What comes on top of the distance from the obstacle of a contact: the gap left in the deck, less what has closed since.
   pure real(wp) function contact_offset(problem, state, contact) result(offset)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact
      associate (o => problem%model%contact(contact)%obstacle, load => problem%model%step(problem%step)%load)
         ! As candidate_offset.
         offset = problem%model%contact(contact)%gap + problem%overlap(contact) * (1.0_wp - problem%constant%resolved(o) - &
            & state%load_factor * load%resolved(o)) - problem%constant%closing(o) - state%load_factor * load%closing(o)
      end associate
   end function contact_offset

   !> Least gap between two elements of a stretch, without touches between, to an obstacle, and where it is.
   subroutine least_gap(problem, state, element, contact, touched, fails, least, where, largest)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: element(2)        !! the first and the last
      integer, intent(in) :: contact           !! index into model%contact
      logical, intent(in) :: touched(:)        !! (nodes) touch some obstacle
      logical, intent(in) :: fails(:)          !! (nodes) touch this one, and should not: a rod that is inside the obstacle from
      !! there on is so because of that
      real(wp), intent(out) :: least           !! the size where none counts
      real(wp), intent(out) :: where           !! along the stretch
      real(wp), intent(out) :: largest         !! gap where it is largest, be it to the inside
      type(sampled_gap_t) :: line
      real(wp) :: counts(2), from, to, value, place, tops(2)
      integer :: i, begin, end
      line%first = element(1)
      line%last = element(2)
      line%contact = contact
      call look_beside(problem, state, line, touched, counts)
      call make_profiles(problem, state, line)
      call take_samples(problem, state, line)
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
         do i = begin, end
            if (line%at(i) >= counts(1) .and. line%at(i) <= counts(2)) call take(gap(i), line%at(i))
            if (i == 1 .or. i == size(gap)) then
               ! Beside a breakpoint without a touch the rod may come down further inside.
               if (line%touches(merge(1, 2, i == 1))) cycle
               if (.not. falls_inwards(problem, state, line, i)) cycle
            else
               if (gap(i) > gap(i - 1) .or. gap(i) > gap(i + 1)) cycle
               ! No lower than the others, however deep it is between.
               if (2.0_wp * gap(i) - max(gap(i - 1), gap(i + 1)) > least) cycle
            end if
            call find_minimum(problem, state, line, i, value, place)
            ! Next to a touch rounding makes minima, too.
            tops = [merge(maxval(gap(:i)), huge(value), line%touches(1)), merge(maxval(gap(i:)), huge(value), line%touches(2))]
            if (minval(tops) <= rounding_gap(problem) .and. value >= -rounding_gap(problem)) cycle
            ! And so do elements that are too long: there the rod must be inside by what its polynomials err by.
            if (place < counts(1) .or. place > counts(2)) value = value + doubt(problem, state, line, place)
            call take(value, place)
         end do
      end associate
      if (least >= huge(least)) least = problem%size

   contains

      subroutine take(value, place)
         real(wp), intent(in) :: value, place
         if (value >= least) return
         least = value
         where = place
      end subroutine take
   end subroutine least_gap

   !> What is beside the elements: whether touches are, and how far from these, along the whole span, gaps count that are no minima.
   !> Breakpoints of the rod divide no span.
   pure subroutine look_beside(problem, state, line, touched, counts)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(inout) :: line
      logical, intent(in) :: touched(:)        !! (nodes)
      real(wp), intent(out) :: counts(2)       !! along the stretch
      real(wp) :: more(2), ends(2), margin
      logical :: zero(2), touching(problem%model%mesh%n_nodes)
      integer :: side
      touching = .false.
      touching(pack(problem%candidates%node, problem%candidates%touch > 0 .and. problem%candidates%contact == line%contact)) = &
         & .true.
      line%touches = touching([problem%model%mesh%node(1, line%first), problem%model%mesh%node(2, line%last)])
      ends = [problem%origin(line%first) + state%geometry%element(line%first)%s(1), &
         & problem%origin(line%last) + state%geometry%element(line%last)%s(2)]
      do side = 1, 2
         call to_next_touch(problem, state, touched, touching, merge(line%first, line%last, side == 1), side, more(side), &
            & zero(side))
      end do
      margin = beside * (ends(2) - ends(1) + sum(more))
      counts = ends
      if (zero(1)) counts(1) = max(ends(1), ends(1) - more(1) + margin)
      if (zero(2)) counts(2) = min(ends(2), ends(2) + more(2) - margin)
   end subroutine look_beside

   !> How much of a free span lies beyond one end of an element, and whether it ends with a touch of one obstacle.
   pure subroutine to_next_touch(problem, state, touched, touching, element, side, length, touches)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: touched(:), touching(:) !! (nodes) touch some obstacle, and this one
      integer, intent(in) :: element, side   !! 1: before its first node, 2: after its last
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

   !> The elements between their nodes.
   subroutine make_profiles(problem, state, line)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(inout) :: line
      integer :: e
      allocate (line%profile(line%first:line%last))
      do e = line%first, line%last
         line%profile(e) = new_profile(problem, state, e)
         if (problem%model%mesh%family(e) == family_ge .and. .not. problem%ground%founded(e)) &
            & call mend_ends(problem, state, line%profile(e), 2)
      end do
   end subroutine make_profiles

   !> Equal parts of all elements, the second of them divided beside a touch; from there nearer and nearer to that.
   subroutine take_samples(problem, state, line)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(inout) :: line
      real(wp) :: part(near + 1)
      integer :: i, e, n
      part = [(sqrt(0.5_wp)**(i - 1), i=0, near)] / samples
      n = (line%last - line%first + 1) * samples + 1 + (near - 1) * count(line%touches)
      allocate (line%at(n), line%gap(n))
      n = 0
      do e = line%first, line%last
         associate (after => e == line%first .and. line%touches(1), before => e == line%last .and. line%touches(2))
            if (after) call add(part(near + 1:1:-1))
            if (.not. after .and. e == line%first) call add([0.0_wp])
            call add([(real(i, wp) / samples, i=merge(2, 1, after), samples - merge(2, 1, before))])
            if (before) call add(1.0_wp - part)
            if (.not. before) call add([1.0_wp])
         end associate
      end do

   contains

      subroutine add(tau)
         real(wp), intent(in) :: tau(:)
         integer :: k
         do k = 1, size(tau)
            n = n + 1
            associate (g => state%geometry%element(e))
               line%at(n) = g%s(1) + tau(k) * (g%s(2) - g%s(1)) + problem%origin(e)
            end associate
            line%gap(n) = gap_in(problem, state, line%contact, line%profile(e), tau(k))
         end do
      end subroutine add
   end subroutine take_samples

   !> True where the gap falls from the first or the last sample to the inside, and is larger again at the next one.
   logical function falls_inwards(problem, state, line, i) result(falls)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(in) :: line
      integer, intent(in) :: i
      integer :: next
      next = merge(i + 1, i - 1, i == 1)
      falls = line%gap(next) >= line%gap(i)
      ! A gap that falls by no more than rounding over the root of it falls by no more than rounding at all.
      if (falls) falls = gap_along(problem, state, line, line%at(i) + sqrt(epsilon(1.0_wp)) * (line%at(next) - line%at(i))) &
         & < line%gap(i)
   end function falls_inwards

   !> The minimum between the neighbours of a sample that is lower than these.
   subroutine find_minimum(problem, state, line, i, value, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(in) :: line
      integer, intent(in) :: i
      real(wp), intent(out) :: value, place
      type(golden_section_t) :: search
      call search%begin(line%at(max(i - 1, 1)), line%at(min(i + 1, size(line%at))), sections_to_rounding)
      do while (search%asks(place))
         call search%tell(gap_along(problem, state, line, place))
      end do
      value = search%least
      ! Where the gap rises from a symmetry plane rounding makes minima beside it.
      if (value < line%gap(i) - rounding_gap(problem)) return
      value = line%gap(i)
      place = line%at(i)
   end subroutine find_minimum

   !> Gap of a place along the stretch.
   real(wp) function gap_along(problem, state, line, place) result(gap)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(in) :: line
      real(wp), intent(in) :: place
      real(wp) :: tau
      integer :: e
      call find_part(problem, state, line, place, e, tau)
      gap = gap_in(problem, state, line%contact, line%profile(e), tau)
   end function gap_along

   !> What the gap there may err by: the element's polynomials, and what the iteration has left at touches, where it is zero.
   real(wp) function doubt(problem, state, line, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(in) :: line
      real(wp), intent(in) :: place
      real(wp) :: tau
      integer :: e
      call find_part(problem, state, line, place, e, tau)
      doubt = mended_error(line%profile(e), tau)
      if (line%touches(1)) doubt = doubt + abs(line%gap(1))
      if (line%touches(2)) doubt = doubt + abs(line%gap(size(line%gap)))
   end function doubt

   !> The element at a place along the stretch, and which part of it lies before.
   pure subroutine find_part(problem, state, line, place, e, tau)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(sampled_gap_t), intent(in) :: line
      real(wp), intent(in) :: place
      integer, intent(out) :: e
      real(wp), intent(out) :: tau
      do e = line%first, line%last - 1
         if (place <= problem%origin(e) + state%geometry%element(e)%s(2)) exit
      end do
      associate (s => state%geometry%element(e)%s)
         tau = (place - problem%origin(e) - s(1)) / (s(2) - s(1))
      end associate
   end subroutine find_part
end module free_span_gap
