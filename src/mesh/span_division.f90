!> Where the nodes stand along the stretches of the rods: what every span gets between its ends, by the deck's elements or by what
!> is demanded of a mesh that the program makes.
module span_division
   use kinds, only: wp
   use obstacle_types, only: obstacle_line
   use problem, only: problem_t
   use rod_layout, only: stretch_element
   use rod_state, only: state_t
   use remeshed_model, only: division_t
   use mesh_density, only: mesh_density_t, between, equal_shares, even_out
   use contact_spans, only: contact_span_t, sort_contact_spans
   use span_candidates, only: present_contact_spans
   use ground_mark, only: cut_t
   use ground_cuts, only: graded
   implicit none
   private
   public :: span_nodes, sampled_division, outgrown, present_demand, lasting_demand, looking_demand

   ! Every free span has a node inside, and one in contact is smooth: no layer forms at its ends.
   integer, parameter :: least_free = 2, least_conforming = 2
   real(wp), parameter :: whole_number = 0.01_wp    !! that near to one a sum of parts is it
   integer, parameter :: least_placed = 2           !! of a mesh that is made for a tolerance: its error is watched
   ! Elements that tell what touches: at least, and at most where the deck has more.
   integer, parameter :: sampling = 64, enough = 256
   !> Shortest elements, over the size: order 4 errs by the fourth power of their length, which is rounding there, and the rounding
   !> of places over the square of the length makes half of the digits of a curvature.
   real(wp), parameter :: finest = sqrt(sqrt(epsilon(1.0_wp)))

contains

   !> Coordinates of the nodes along a stretch: equal parts of every span, or shares of what is wanted there.
   function span_nodes(base, touch, cut, stretch, state) result(at)
      type(problem_t), intent(in) :: base
      type(contact_span_t), intent(in) :: touch(:)          !! sorted
      type(cut_t), intent(in) :: cut(:)              !! sorted
      integer, intent(in) :: stretch
      type(state_t), intent(in), optional :: state
      real(wp), allocatable :: at(:), middle(:)
      real(wp) :: from, layer(2), all, free
      integer :: k
      associate (whole => base%layout%stretch(stretch))
         if (.not. whole%free) then
            at = whole%at
            return
         end if
         if (.not. (whole%placed .or. any(cut%stretch == stretch)) .and. base%ground%founded(base%along( &
            & base%element_first(stretch)))) then
            at = whole%at
            return
         end if
         if (present(state)) middle = element_middles(base, state, stretch)
         all = real(size(whole%element), wp)
         free = all
         do k = 1, size(touch)
            if (touch(k)%stretch == stretch) &
               & free = free - deck_elements(base, stretch, touch(k)%at(2)) + deck_elements(base, stretch, touch(k)%at(1))
         end do
         at = [0.0_wp]
         from = 0.0_wp
         do k = 1, size(touch)
            if (touch(k)%stretch /= stretch) cycle
            call divide_free(touch(k)%at(1))
            if (touch(k)%line) call divide(touch(k)%at(2), touch(k)%contact)
         end do
         call divide_free(whole%length)
      end associate

   contains

      !> A free span, which foundations may divide further.
      subroutine divide_free(to)
         real(wp), intent(in) :: to
         integer :: i
         layer = [layer_at(from), 0.0_wp]
         do i = 1, size(cut)
            if (cut(i)%stretch /= stretch .or. cut(i)%at <= from .or. cut(i)%at >= to) cycle
            layer(2) = cut(i)%layer(1)
            call divide(cut(i)%at, 0)
            layer(1) = cut(i)%layer(2)
         end do
         layer(2) = layer_at(to)
         call divide(to, 0)
         layer = 0.0_wp
      end subroutine divide_free

      !> The layer of a foundation whose contact ends next to an end of the stretch.
      pure real(wp) function layer_at(end)
         real(wp), intent(in) :: end
         integer :: i
         layer_at = 0.0_wp
         do i = 1, size(cut)
            if (cut(i)%stretch == stretch .and. cut(i)%at_end .and. abs(cut(i)%at - end) <= 0.0_wp) &
               & layer_at = max(layer_at, maxval(cut(i)%layer))
         end do
      end function layer_at

      !> Nodes up to the end of a span. Free spans share all elements of the deck; in contact there are as many as the deck has
      !> there, a quarter of them where the rod is perfect; but not less than a span needs, nor more than rounding allows. A mesh
      !> that is made has what is asked for, in contact, too: a line without pressure buckles as a free span does.
      subroutine divide(to, contact)
         real(wp), intent(in) :: to
         integer, intent(in) :: contact              ! of a line, 0: a free span
         real(wp) :: wanted
         integer :: n, least, i, stages
         type(mesh_density_t) :: deck
         if (.not. to > from) return
         stages = base%deck%mesh%stages(base%layout%stretch(stretch)%element(1))
         if (base%layout%stretch(stretch)%placed) then
            wanted = between(base%demand(stretch), from, to)
            n = max(least_placed, ceiling(min(wanted, (to - from) / (finest * base%size)) - whole_number))
            if (any(layer > 0.0_wp)) then
               n = max(1, n)
               associate (shares => graded(base%demand(stretch), from, to, n, layer, stages))
                  at = [at, shares(2:)]
               end associate
               from = to
               return
            end if
            associate (shares => equal_shares(base%demand(stretch), from, to, n))
               at = [at, shares(2:)]
            end associate
            from = to
            return
         end if
         wanted = deck_elements(base, stretch, to) - deck_elements(base, stretch, from)
         least = least_free
         if (any(cut%stretch == stretch)) then
            n = max(1, ceiling(wanted - whole_number))
            deck%at = base%layout%stretch(stretch)%at
            deck%elements = spread(1.0_wp, 1, size(deck%at) - 1)
            associate (nodes => graded(deck, from, to, n, layer, stages))
               at = [at, nodes(2:)]
            end associate
            from = to
            return
         end if
         if (contact == 0) then
            wanted = wanted * all / max(free, tiny(free))
         else
            least = least_conforming
            if (is_perfect(base, stretch)) wanted = merge(0.0_wp, 0.25_wp, on_straight(base, contact)) * wanted
         end if
         n = max(least, nint(min(wanted, (to - from) / (finest * base%size))))
         if (present(state)) n = max(n, count(middle > from .and. middle < to))
         at = [at, [(from + (to - from) * i / n, i=1, n - 1)], to]
         from = to
      end subroutine divide
   end function span_nodes

   !> True for a stretch without imperfections: in contact it is as smooth as the obstacle.
   pure logical function is_perfect(base, stretch)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: stretch
      is_perfect = all(base%deck%curve(base%deck%mesh%curve(base%layout%stretch(stretch)%element))%imperfection == 0)
   end function is_perfect

   !> True for a straight obstacle: there one element is exact for a perfect rod, its axial force is linear.
   pure logical function on_straight(base, contact)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: contact
      on_straight = base%deck%obstacle(base%deck%contact(contact)%obstacle)%kind == obstacle_line
   end function on_straight

   !> How many of the deck's elements lie before a coordinate, parts counted.
   pure real(wp) function deck_elements(base, stretch, at) result(n)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: stretch
      real(wp), intent(in) :: at
      integer :: low
      associate (whole => base%layout%stretch(stretch))
         low = stretch_element(whole, at)
         n = low - 1 + (at - whole%at(low)) / (whole%at(low + 1) - whole%at(low))
      end associate
   end function deck_elements

   !> Middles of the elements of a stretch.
   pure function element_middles(problem, state, stretch) result(middle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: stretch
      real(wp), allocatable :: middle(:)
      integer :: e
      middle = [(0.5_wp * sum(state%geometry%element(e)%s) + problem%origin(e), &
         & e=problem%element_first(stretch), problem%element_last(stretch))]
   end function element_middles

   !> Nodes that stand close enough to tell what touches, before any contact span is known.
   function sampled_division(base, touch) result(division)
      type(problem_t), intent(in) :: base            !! of the deck
      type(contact_span_t), intent(in), optional :: touch(:) !! places at which a node stands, too
      type(division_t) :: division(size(base%layout%stretch))
      real(wp) :: length, share
      integer :: k, n, i
      length = sum(base%layout%stretch%length)
      do k = 1, size(division)
         associate (whole => base%layout%stretch(k))
            division(k)%at = whole%at
            share = whole%length / length
            n = max(min(size(whole%element), max(ceiling(enough * share), 4)), ceiling(sampling * share))
            if (whole%free) division(k)%at = [(whole%length * i / n, i=0, n)]
         end associate
      end do
      if (present(touch)) then
         do k = 1, size(touch)
            associate (at => division(touch(k)%stretch)%at)
               i = minloc(abs(at - touch(k)%at(1)), 1)
               if (i > 1 .and. i < size(at)) at(i) = touch(k)%at(1)
            end associate
         end do
      end if
   end function sampled_division

   !> True where some span has grown so much that it wants a quarter more elements than it has.
   logical function outgrown(problem, state, cuts)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), intent(in), optional :: cuts(:)   !! sorted, where the kinks of foundations are
      type(contact_span_t), allocatable :: touch(:)
      type(cut_t), allocatable :: cut(:)
      real(wp), allocatable :: at(:), now(:), ends(:)
      integer :: k, i
      touch = present_contact_spans(problem, state)
      call sort_contact_spans(touch)
      allocate (cut(0))
      if (present(cuts)) cut = cuts
      outgrown = .false.
      do k = 1, size(problem%layout%stretch)
         if (problem%layout%stretch(k)%placed) cycle
         at = span_nodes(problem, touch, cut, k, state)
         do i = 1, size(cut)
            if (cut(i)%stretch == k) outgrown = outgrown .or. coarse_beside(cut(i))
         end do
         at = 0.5_wp * (at(2:) + at(:size(at) - 1))
         now = element_middles(problem, state, k)
         ends = [0.0_wp]
         do i = 1, size(touch)
            if (touch(i)%stretch == k) ends = [ends, touch(i)%at]
         end do
         do i = 1, size(cut)
            if (cut(i)%stretch == k) ends = [ends, cut(i)%at]
         end do
         ends = [ends, problem%layout%stretch(k)%length]
         do i = 2, size(ends)
            outgrown = outgrown .or. 4 * count(at > ends(i - 1) .and. at < ends(i)) > &
               & 5 * count(now > ends(i - 1) .and. now < ends(i))
         end do
      end do

   contains

      !> True where an element beside a mark with a layer is a quarter longer than a new mesh would have it.
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

   !> The demand that a mesh fulfils where its nodes stand now.
   function present_demand(problem, state) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t) :: demand(size(problem%layout%stretch))
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

   !> The same for meshes of other touches: spans that have no more than they must have, however short they are, want little more
   !> than what is beside them. When they have gone no tiny elements are to remain.
   function lasting_demand(problem, state) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t) :: demand(size(problem%layout%stretch))
      logical, allocatable :: begins(:)              ! nodes, of spans
      integer :: k, m, n
      demand = present_demand(problem, state)
      do k = 1, size(demand)
         if (.not. problem%layout%stretch(k)%placed) cycle
         n = size(demand(k)%elements)
         begins = spread(.false., 1, n + 1)
         begins([1, n + 1]) = .true.
         do m = 1, size(problem%touch)
            if (problem%touch(m)%stretch /= k) cycle
            associate (on => problem%touch(m)%element - problem%element_first(k) + 1)
               begins(min(max(on(1), 1), n + 1)) = .true.
               begins(min(on(2) + 1, n + 1)) = .true.
            end associate
         end do
         call even_out(demand(k), begins, least_placed)
      end do
   end function lasting_demand

   !> What is demanded of the next mesh, but more where elements are so much too long to tell what touches them, up to what tells
   !> it anywhere.
   function looking_demand(problem, longer) result(demand)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: longer                 !! than they should be, a factor
      type(mesh_density_t) :: demand(size(problem%layout%stretch))
      real(wp) :: most
      integer :: k
      demand = problem%demand
      do k = 1, size(demand)
         most = sampling * problem%layout%stretch(k)%length / sum(problem%layout%stretch%length)
         demand(k)%elements = demand(k)%elements * max(1.0_wp, min(longer, most / sum(demand(k)%elements)))
      end do
   end function looking_demand
end module span_division
