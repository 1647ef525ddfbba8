!> Division of rod segments into elements. The number of elements in each span between contacts, segment boundaries and interface
!> points follows from the deck's elements or from a mesh density.
module span_division
   use kinds, only: wp
   use obstacle_types, only: obstacle_line
   use problem, only: problem_t
   use rod_layout, only: segment_element
   use rod_state, only: state_t
   use remeshed_model, only: division_t
   use mesh_density, only: mesh_density_t, between, equal_shares, even_out, no_finer
   use contact_spans, only: contact_span_t, sort_contact_spans
   use span_candidates, only: present_contact_spans
   use ground_mark, only: cut_t
   use ground_cuts, only: graded
   implicit none
   private
   public :: span_nodes, sampled_division, outgrown, present_demand, lasting_demand, looking_demand

   ! Least numbers of elements in a span. (A free span needs a node inside.)
   integer, parameter :: least_free = 2, least_conforming = 2
   real(wp), parameter :: whole_number = 0.01_wp !! tolerance for sums of fractions: a sum that differs from an integer by less than
   !! this counts as the integer
   integer, parameter :: least_placed = 2 !! least number of elements of a span on a mesh made for a tolerance, as required by the
   !! error estimate
   ! Lower and upper bound for the number of elements on a mesh whose nodes detect contact; between these bounds the deck's number
   ! is used.
   integer, parameter :: sampling = 64, enough = 256
   !> Length of the shortest elements over the structure's size. At this length the error of an element of order 4 (fourth power of
   !> the length) equals the rounding unit; the rounding error of coordinates, divided by the square of the length, leaves half of
   !> the digits of a curvature.
   real(wp), parameter :: finest = sqrt(sqrt(epsilon(1.0_wp)))

contains

   !> Coordinates of the nodes along a rod segment. Each span is divided into parts of equal length, or into parts with equal
   !> integral of the mesh density.
   function span_nodes(base, contact_span, cut, rod_segment, state) result(at)
      type(problem_t), intent(in) :: base
      type(contact_span_t), intent(in) :: contact_span(:)   !! contact spans, sorted along the rods
      type(cut_t), intent(in) :: cut(:)              !! interface points, sorted along the rods
      integer, intent(in) :: rod_segment             !! index into layout%rod_segment
      type(state_t), intent(in), optional :: state
      real(wp), allocatable :: at(:), middle(:)
      real(wp) :: from, layer(2), all, free
      logical :: parted                              ! true: there are interface points inside the span that is being divided
      integer :: k
      associate (whole => base%layout%rod_segment(rod_segment))
         if (.not. whole%free) then
            at = whole%at
            return
         end if
         if (founded(base, rod_segment) .and. .not. (whole%placed .or. any(cut%rod_segment == rod_segment) .or. &
            & any(contact_span%rod_segment == rod_segment))) then
            at = whole%at
            return
         end if
         if (present(state)) middle = element_middles(base, state, rod_segment)
         all = real(size(whole%element), wp)
         free = all
         do k = 1, size(contact_span)
            if (contact_span(k)%rod_segment == rod_segment) &
               & free = free - deck_elements(base, rod_segment, contact_span(k)%at(2)) + deck_elements(base, rod_segment, &
               & contact_span(k)%at(1))
         end do
         at = [0.0_wp]
         from = 0.0_wp
         do k = 1, size(contact_span)
            if (contact_span(k)%rod_segment /= rod_segment) cycle
            call divide_span(contact_span(k)%at(1), 0)
            if (contact_span(k)%line) call divide_span(contact_span(k)%at(2), contact_span(k)%contact)
         end do
         call divide_span(whole%length, 0)
      end associate

   contains

      !> Divides a span and places nodes at the interface points of foundations inside it.
      subroutine divide_span(to, contact)
         real(wp), intent(in) :: to
         integer, intent(in) :: contact              ! index of the contact of a line contact; 0: a free span
         integer :: i
         layer = [layer_at(from), 0.0_wp]
         parted = .false.
         do i = 1, size(cut)
            if (cut(i)%rod_segment /= rod_segment .or. cut(i)%at <= from .or. cut(i)%at >= to) cycle
            parted = .true.
            layer(2) = cut(i)%layer(1)
            call divide(cut(i)%at, contact)
            layer(1) = cut(i)%layer(2)
         end do
         layer(2) = layer_at(to)
         call divide(to, contact)
         layer = 0.0_wp
      end subroutine divide_span

      !> Length of the boundary layer of a foundation whose contact ends near an end of the segment; 0: no such foundation.
      pure real(wp) function layer_at(end)
         real(wp), intent(in) :: end
         integer :: i
         layer_at = 0.0_wp
         do i = 1, size(cut)
            if (cut(i)%rod_segment == rod_segment .and. cut(i)%at_end .and. abs(cut(i)%at - end) <= 0.0_wp) &
               & layer_at = max(layer_at, maxval(cut(i)%layer))
         end do
      end function layer_at

      !> Adds the nodes up to the end of a span. With the deck's density all free spans of the segment together get the deck's
      !> number of elements. A line contact gets as many elements as the deck has on its length. On a perfect rod without foundation
      !> and without loads that vary, it gets a quarter of these, and the least number if the obstacle is straight. The number of
      !> elements and their length have lower bounds. A mesh made for a tolerance follows its density in line contacts as well,
      !> because a line contact without pressure buckles like a free span. A rod on its obstacle does not move, so that errors of
      !> displacements do not show whether the elements resolve a load that varies, although the contact pressure follows this load.
      !> A line contact under such a load therefore gets at least the deck's number of elements.
      subroutine divide(to, contact)
         real(wp), intent(in) :: to
         integer, intent(in) :: contact              ! index of the contact of a line contact; 0: a free span
         real(wp), allocatable :: nodes(:)           ! coordinates of the nodes of the span, its two ends included
         real(wp) :: wanted
         integer :: n, least, i, stages
         type(mesh_density_t) :: deck
         if (.not. to > from) return
         stages = base%deck%mesh%stages(base%layout%rod_segment(rod_segment)%element(1))
         if (base%layout%rod_segment(rod_segment)%placed) then
            wanted = between(base%demand(rod_segment), from, to)
            if (contact > 0 .and. load_varies(base, rod_segment)) wanted = max(wanted, deck_elements(base, rod_segment, to) - &
               & deck_elements(base, rod_segment, from))
            n = max(least_placed, ceiling(min(wanted, (to - from) / (finest * base%size)) - whole_number))
            if (any(layer > 0.0_wp)) then
               nodes = graded(base%demand(rod_segment), from, to, n, layer, stages)
            else
               nodes = equal_shares(no_finer(base%demand(rod_segment), finest * base%size), from, to, n)
            end if
         else
            wanted = deck_elements(base, rod_segment, to) - deck_elements(base, rod_segment, from)
            least = merge(1, merge(least_free, least_conforming, contact == 0), parted)
            if (contact == 0) then
               wanted = wanted * all / max(free, tiny(free))
            else if (is_perfect(base, rod_segment) .and. &
               & .not. (founded(base, rod_segment) .or. load_varies(base, rod_segment))) then
               ! On a straight obstacle one element is exact for a perfect rod with linear axial force.
               if (base%deck%obstacle(base%deck%contact(contact)%obstacle)%kind == obstacle_line) then
                  wanted = 0.0_wp
               else
                  wanted = 0.25_wp * wanted
               end if
            end if
            wanted = min(wanted, (to - from) / (finest * base%size))
            if (any(cut%rod_segment == rod_segment)) then
               deck%at = base%layout%rod_segment(rod_segment)%at
               deck%elements = spread(1.0_wp, 1, size(deck%at) - 1)
               nodes = graded(deck, from, to, max(least, ceiling(wanted - whole_number)), layer, stages)
            else
               n = max(least, nint(wanted))
               if (present(state)) n = max(n, count(middle > from .and. middle < to))
               nodes = [[(from + (to - from) * i / n, i=0, n - 1)], to]
            end if
         end if
         at = [at, nodes(2:)]
         from = to
      end subroutine divide
   end function span_nodes

   !> True for a rod segment on which a foundation acts between the nodes.
   pure logical function founded(base, rod_segment)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: rod_segment
      founded = base%ground%founded(base%along(base%element_first(rod_segment)))
   end function founded

   !> True for a rod segment without imperfections, whose solution in a line contact is as smooth as the obstacle.
   pure logical function is_perfect(base, rod_segment)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: rod_segment
      is_perfect = all(base%deck%curve(base%deck%mesh%curve(base%layout%rod_segment(rod_segment)%element))%imperfection == 0)
   end function is_perfect

   !> True for a rod segment with a load, in any step, whose intensity varies along it.
   pure logical function load_varies(base, rod_segment) result(varies)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: rod_segment
      integer :: i, k
      varies = .false.
      do k = 1, size(base%deck%step)
         associate (part => base%deck%step(k)%load%line_load)
            do i = 1, size(part)
               varies = varies .or. (part(i)%intensity%distribution > 0 .and. &
                  & part(i)%on(base%layout%rod_segment(rod_segment)%element(1)))
            end do
         end associate
      end do
   end function load_varies

   !> Number of the deck's elements up to a coordinate; the last element is counted as a fraction.
   pure real(wp) function deck_elements(base, rod_segment, at) result(n)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: rod_segment
      real(wp), intent(in) :: at
      integer :: low
      associate (whole => base%layout%rod_segment(rod_segment))
         low = segment_element(whole, at)
         n = low - 1 + (at - whole%at(low)) / (whole%at(low + 1) - whole%at(low))
      end associate
   end function deck_elements

   !> Coordinates of the middles of a segment's elements.
   pure function element_middles(problem, state, rod_segment) result(middle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: rod_segment
      real(wp), allocatable :: middle(:)
      integer :: e
      middle = [(0.5_wp * sum(state%geometry%element(e)%s) + problem%origin(e), &
         & e=problem%element_first(rod_segment), problem%element_last(rod_segment))]
   end function element_middles

   !> Division with nodes close enough to detect contact, for meshes before the first contact span. There are nodes at all given
   !> places where the rod touches an obstacle.
   function sampled_division(base, contact_span) result(division)
      type(problem_t), intent(in) :: base            !! problem on the deck's mesh
      type(contact_span_t), intent(in), optional :: contact_span(:) !! point contacts at which the mesh must have nodes
      type(division_t) :: division(size(base%layout%rod_segment))
      real(wp), allocatable :: at(:), place(:)
      real(wp) :: length, share
      integer :: k, n, i
      length = sum(base%layout%rod_segment%length)
      allocate (place(0))
      do k = 1, size(division)
         associate (whole => base%layout%rod_segment(k))
            at = whole%at
            if (whole%free) then
               share = whole%length / length
               n = max(min(size(whole%element), max(ceiling(enough * share), 4)), ceiling(sampling * share))
               at = [(whole%length * i / n, i=0, n)]
               if (present(contact_span)) place = pack(contact_span%at(1), contact_span%rod_segment == k)
               ! A place replaces the nearest node inside the segment, if that node is nearer than half an element.
               at = pack(at, [(i == 0 .or. i == n .or. all(abs(at(i + 1) - place) >= 0.5_wp * whole%length / n), i=0, n)])
               do i = 1, size(place)
                  at = [pack(at, at < place(i)), place(i), pack(at, at > place(i))]
               end do
            end if
            division(k)%at = at
         end associate
      end do
   end function sampled_division

   !> True if a span has become so long that a new mesh would give this span more than 5/4 of its present number of elements.
   logical function outgrown(problem, state, cut)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), intent(in) :: cut(:)              !! interface points of foundations, sorted along the rods
      type(contact_span_t), allocatable :: contact_span(:)
      real(wp), allocatable :: at(:), now(:), ends(:)
      integer :: k, i
      contact_span = present_contact_spans(problem, state)
      call sort_contact_spans(contact_span)
      outgrown = .false.
      do k = 1, size(problem%layout%rod_segment)
         if (problem%layout%rod_segment(k)%placed) cycle
         at = span_nodes(problem, contact_span, cut, k, state)
         do i = 1, size(cut)
            if (cut(i)%rod_segment == k) outgrown = outgrown .or. coarse_beside(cut(i))
         end do
         at = 0.5_wp * (at(2:) + at(:size(at) - 1))
         now = element_middles(problem, state, k)
         ends = [0.0_wp]
         do i = 1, size(contact_span)
            if (contact_span(i)%rod_segment == k) ends = [ends, contact_span(i)%at]
         end do
         do i = 1, size(cut)
            if (cut(i)%rod_segment == k) ends = [ends, cut(i)%at]
         end do
         ends = [ends, problem%layout%rod_segment(k)%length]
         do i = 2, size(ends)
            outgrown = outgrown .or. 4 * count(at > ends(i - 1) .and. at < ends(i)) > &
               & 5 * count(now > ends(i - 1) .and. now < ends(i))
         end do
      end do

   contains

      !> True if an element beside an interface point with a boundary layer is longer than 5/4 of the length that it would have on a
      !> new mesh.
      pure logical function coarse_beside(mark)
         type(cut_t), intent(in) :: mark
         real(wp) :: wanted(2), has(2)
         integer :: e, j
         coarse_beside = .false.
         j = minloc(abs(at - mark%at), 1)
         if (j == 1 .or. j == size(at)) return
         wanted = [at(j) - at(j - 1), at(j + 1) - at(j)]
         has = 0.0_wp
         do e = problem%element_first(k), problem%element_last(k)
            associate (s => state%geometry%element(e)%s + problem%origin(e))
               if (s(1) < mark%at - 0.1_wp * wanted(1) .and. s(2) <= mark%at + 0.1_wp * wanted(2)) has(1) = s(2) - s(1)
               if (s(1) >= mark%at - 0.1_wp * wanted(1)) then
                  has(2) = s(2) - s(1)
                  exit
               end if
            end associate
         end do
         coarse_beside = any(has > 1.25_wp * wanted .and. mark%layer > 0.0_wp)
      end function coarse_beside
   end function outgrown

   !> Mesh density of the present mesh: one element between any two neighbouring nodes, at their present positions.
   function present_demand(problem, state) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t) :: demand(size(problem%layout%rod_segment))
      integer :: k, i, n
      do k = 1, size(demand)
         n = problem%element_last(k) - problem%element_first(k) + 1
         allocate (demand(k)%at(n + 1), source=0.0_wp)
         do i = 1, n
            associate (e => problem%along(problem%element_first(k) + i - 1))
               demand(k)%at(i + 1) = state%geometry%element(e)%s(2) + problem%origin(e)
            end associate
         end do
         demand(k)%elements = spread(1.0_wp, 1, n)
      end do
   end function present_demand

   !> Mesh density of the present mesh, for meshes with another contact set. A short span between contacts or interface points that
   !> has the least number of elements gets little more than the density beside it. No tiny elements then remain after the span has
   !> closed.
   function lasting_demand(problem, state) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t) :: demand(size(problem%layout%rod_segment))
      logical, allocatable :: begins(:)              ! (nodes) true: a span begins at the node
      integer :: k, m, n
      demand = present_demand(problem, state)
      do k = 1, size(demand)
         if (.not. problem%layout%rod_segment(k)%placed) cycle
         n = size(demand(k)%elements)
         begins = spread(.false., 1, n + 1)
         begins([1, n + 1]) = .true.
         do m = 1, size(problem%contact_span)
            if (problem%contact_span(m)%rod_segment /= k) cycle
            associate (on => problem%contact_span(m)%element - problem%element_first(k) + 1)
               begins(min(max(on(1), 1), n + 1)) = .true.
               begins(min(on(2) + 1, n + 1)) = .true.
            end associate
         end do
         do m = 1, size(problem%mark)
            associate (e => problem%ground%chain%element(2, problem%mark(m)%candidate(2)))
               if (problem%rod_segment(e) == k) begins(e - problem%element_first(k) + 1) = .true.
            end associate
         end do
         call even_out(demand(k), begins, least_placed)
      end do
   end function lasting_demand

   !> Mesh density for the next mesh, increased so that its elements are short enough to detect contact, but to no more elements
   !> than are sufficient everywhere.
   function looking_demand(problem, longer) result(demand)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: longer                 !! ratio of the elements' length to the length that detects contact
      type(mesh_density_t) :: demand(size(problem%layout%rod_segment))
      real(wp) :: most
      integer :: k
      demand = problem%demand
      do k = 1, size(demand)
         most = sampling * problem%layout%rod_segment(k)%length / sum(problem%layout%rod_segment%length)
         demand(k)%elements = demand(k)%elements * max(1.0_wp, min(longer, most / sum(demand(k)%elements)))
      end do
   end function looking_demand
end module span_division
